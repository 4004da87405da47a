"use strict";
// The orbit of a point on click: time histories, phase plane, spectrum.
const orbits = (() => {
  const COLOR = "#0072B2";
  const HARMONICS = 60;

  function decode(base64) {
    const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const view = new DataView(bytes.buffer);
    return Array.from({ length: bytes.length / 4 }, (_, i) => view.getFloat32(4 * i, true));
  }

  // Amplitudes of the harmonics 1, 2, .. of equally spaced samples over one period.
  function amplitudes(samples) {
    const n = samples.length;
    return Array.from({ length: Math.min(HARMONICS, n / 2 - 1) }, (_, i) => {
      let re = 0, im = 0;
      samples.forEach((value, s) => {
        const angle = 2 * Math.PI * (i + 1) * s / n;
        re += value * Math.cos(angle);
        im += value * Math.sin(angle);
      });
      return 2 * Math.hypot(re, im) / n;
    });
  }

  // The kept orbit of this branch that is nearest to a point.
  function nearest(kept, branch, point) {
    const same = kept.orbits.filter((orbit) => orbit.branch === branch);
    const distance = (orbit) => Math.abs(orbit.point - point);
    return same.reduce((best, orbit) => (best && distance(best) <= distance(orbit) ? best : orbit), null);
  }

  const APERIODIC = /^(chaotic|quasi-periodic|undecided)/;

  // The kept orbit nearest to a cell of a map: of its seed, and of its label where cells show labels.
  function nearestCell(kept, [seed, , x, y, word], spans) {
    const isLike = (orbit) => !/^period \d+$/.test(word) || orbit.label === word;
    const same = kept.orbits.filter((orbit) => orbit.place && orbit.branch === seed && isLike(orbit));
    const distance = ({ place }) => Math.hypot((place[0] - x) / spans[0], (place[1] - y) / spans[1]);
    return same.reduce((best, orbit) => (best && distance(best) <= distance(orbit) ? best : orbit), null);
  }

  function series(kept, orbit, kind, connection) {
    const index = kept.names.indexOf(kind + "." + connection);
    const unit = kept.units[index];
    const values = decode(orbit.values[index]);
    return { values, closed: [...values, values[0]], title: kind + (unit ? " [" + unit + "]" : "") };
  }

  function draw(canvas, kept, orbit, connection) {
    const [q, v, f] = ["q", "v", "f"].map((kind) => series(kept, orbit, kind, connection));
    const phase = q.closed.map((_, s) => s / q.values.length);
    const spectrum = amplitudes(q.values);
    const largest = Math.max(...spectrum);
    const line = { mode: "lines", line: { color: COLOR, width: 1.8 } };
    const traces = [
      { ...line, x: phase, y: q.closed, xaxis: "x", yaxis: "y" },
      { ...line, x: q.closed, y: v.closed, xaxis: "x2", yaxis: "y2" },
      { ...line, x: phase, y: f.closed, xaxis: "x3", yaxis: "y3" },
      { type: "bar", x: spectrum.map((_, i) => i + 1), y: spectrum, marker: { color: COLOR }, xaxis: "x4", yaxis: "y4" },
    ];
    const period = "share of the response period";
    const titles = [[period, "deformation " + q.title], ["deformation " + q.title, "rate " + v.title],
      [period, "force " + f.title], ["harmonic of the response", "amplitude of " + q.title]];
    const narrow = canvas.clientWidth < 700;
    const layout = {
      height: narrow ? 1080 : 560, showlegend: false, hovermode: "closest", margin: { l: 70, r: 16, t: 34, b: 50 },
      ...theme.layout(),
      grid: { rows: narrow ? 4 : 2, columns: narrow ? 1 : 2, pattern: "independent", xgap: 0.2, ygap: 0.28 },
    };
    titles.forEach(([x, y], i) => {
      const frame = { showline: true, mirror: true, ticks: "inside", zeroline: false, exponentformat: "power", automargin: true, ...theme.axis() };
      layout["xaxis" + axes.suffix(i)] = { ...frame, title: { text: x, standoff: 6 } };
      layout["yaxis" + axes.suffix(i)] = { ...frame, title: { text: y, standoff: 6 } };
    });
    if (largest > 0) Object.assign(layout.yaxis4, { type: "log", range: [Math.log10(largest) - 6, Math.log10(largest) + 0.2] });
    return Plotly.react(canvas, traces, layout, { responsive: true, displaylogo: false, showSendToCloud: false, plotlyServerURL: "", modeBarButtonsToRemove: ["lasso2d", "select2d"] }).then((plot) => { reader.quiet(); return plot; });
  }

  function heading(orbit, point) {
    const omega = orbit.omega === null ? "" : " (omega " + orbit.omega + ")";
    const place = "Orbit of branch " + orbit.branch + ", point " + orbit.point + omega;
    return orbit.point === point ? place : place + ", the kept one nearest to point " + point;
  }

  function cellHeading(orbit, [, , x, y, word]) {
    if (APERIODIC.test(word)) return "The attractor of this cell is " + word + ": it has no periodic orbit.";
    if (!orbit) return "No orbit of such a cell was kept.";
    const place = "Orbit of the cell at " + orbit.place.join(", ") + " (" + orbit.label + ")";
    const isOwn = orbit.place[0] === x && orbit.place[1] === y;
    return isOwn ? place : place + ", the kept one nearest to " + x + ", " + y;
  }

  function hint(kept) {
    const shown = kept.orbits.length;
    if (kept.orbits.some((orbit) => orbit.place)) return "Click a cell for the orbit of its attractor. Orbits of some cells are kept.";
    const some = shown < kept.kept ? " This page holds " + shown + " of " + kept.kept + " orbits; all are in the orbits file." : "";
    return "Click a point for its orbit." + some;
  }

  // Shows an orbit below the plot when a point of a branch is clicked.
  function attach(plot, canvas, data) {
    const kept = data.orbits;
    if (!kept) return;
    const box = document.createElement("div");
    box.className = "orbit";
    const words = document.createElement("p");
    words.textContent = hint(kept);
    const select = document.createElement("select");
    for (const name of kept.names.filter((n) => n.startsWith("q."))) select.add(new Option(name.slice(2), name.slice(2)));
    const label = document.createElement("label");
    label.append("Connection ", select);
    label.hidden = true;
    const drawing = document.createElement("div");
    box.append(words, label, drawing);
    plot.after(box);
    let orbit = null;
    const show = () => draw(drawing, kept, orbit, select.value);
    select.addEventListener("change", show);
    canvas.on("plotly_click", (event) => {
      const { customdata, data: trace } = event.points[0];
      if (!customdata) return;
      const [branch, point, ...cell] = customdata;
      if (cell.length > 0) {
        const spans = [trace.x, trace.y].map((places) => Math.abs(places[places.length - 1] - places[0]) || 1);
        orbit = APERIODIC.test(cell[2]) ? null : nearestCell(kept, customdata, spans);
        words.textContent = cellHeading(orbit, customdata);
      } else {
        orbit = nearest(kept, branch, point);
        words.textContent = orbit ? heading(orbit, point) : "No orbit of branch " + branch + " was kept.";
      }
      label.hidden = drawing.hidden = !orbit;
      if (!orbit) return;
      const connection = trace.meta.connection;
      if ([...select.options].some((option) => option.value === connection)) select.value = connection;
      show();
    });
  }

  return { attach };
})();
