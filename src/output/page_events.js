"use strict";
// Filter of the tables of events: kinds to show, and words that a row must hold.
(() => {
  function labelled(control, words) {
    const label = document.createElement("label");
    label.append(control, " " + words);
    return label;
  }

  function attach(table) {
    const rows = [...table.tBodies[0].rows];
    const kinds = [...new Set(rows.map((row) => row.cells[0].textContent))];
    const bar = document.createElement("div");
    bar.className = "controls filter";
    const hidden = new Set();
    const words = document.createElement("input");
    words.type = "search";
    words.size = 14;
    const count = document.createElement("span");
    count.setAttribute("aria-live", "polite");
    function apply() {
      let shown = 0;
      for (const row of rows) {
        const is = !hidden.has(row.cells[0].textContent) && row.textContent.toLowerCase().includes(words.value.trim().toLowerCase());
        row.hidden = !is;
        if (is) shown += 1;
      }
      count.textContent = shown + " of " + rows.length + " shown";
    }
    for (const kind of kinds) {
      const box = document.createElement("input");
      box.type = "checkbox";
      box.checked = true;
      box.addEventListener("change", () => {
        if (box.checked) hidden.delete(kind); else hidden.add(kind);
        apply();
      });
      const number = rows.filter((row) => row.cells[0].textContent === kind).length;
      bar.append(labelled(box, kind + " (" + number + ")"));
    }
    words.addEventListener("input", apply);
    const search = document.createElement("label");
    search.append("Rows with ", words);
    bar.append(search, count);
    table.closest(".scroll").before(bar);
    apply();
  }

  document.querySelectorAll("table.events").forEach((table) => { if (table.tBodies[0].rows.length > 3) attach(table); });
})();
