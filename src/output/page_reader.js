"use strict";
// Plots by keyboard and for screen readers: arrow keys walk along a curve and say its values.
const reader = (() => {
  const HELP = "Left and right arrows walk along a curve, up and down change the curve, Enter shows the orbit of the point.";

  const isMap = (trace) => trace.type === "heatmap";

  // What a trace has at a point; the cells of a map are counted row by row.
  const at = (trace, values, row) => (values && isMap(trace) ? values[Math.floor(row / trace.x.length)][row % trace.x.length] : values && values[row]);

  const place = (trace, row) => (isMap(trace) ? [trace.x[row % trace.x.length], trace.y[Math.floor(row / trace.x.length)]] : [trace.x[row], trace.y[row]]);

  // Numbers of the points of a trace that can be drawn.
  function points(trace) {
    const rows = [];
    if (isMap(trace)) return Array.from({ length: trace.x.length * trace.y.length }, (_, k) => k);
    for (let k = 0; k < trace.x.length; k++) {
      if (trace.x[k] !== null && trace.y[k] !== null && trace.y[k] !== undefined) rows.push(k);
    }
    return rows;
  }

  const plain = (html) => html.replace(/<br>/g, ", ").replace(/<[^>]*>/g, "").replace(/&lt;/g, "<").replace(/&gt;/g, ">").replace(/&amp;/g, "&");

  function said(trace, row, number, count) {
    const own = at(trace, trace.text, row);
    const spot = place(trace, row).join(", ");
    const words = !own ? plain(trace.name || "") + " " + spot : isMap(trace) ? own + ", " + spot : plain(own);
    return words + " (point " + (number + 1) + " of " + count + ")";
  }

  // What plots show is said by their labels and by the walk, not shape by shape; their tools have a name.
  function quiet() {
    for (const drawing of document.querySelectorAll(".js-plotly-plot svg, #js-plotly-tester")) drawing.setAttribute("aria-hidden", "true");
    for (const tools of document.querySelectorAll(".js-plotly-plot [role=toolbar]")) tools.setAttribute("aria-label", "Tools of the plot");
  }

  function attach(plot, canvas, traces) {
    const curves = traces.map((trace, index) => ({ trace, index, rows: Array.isArray(trace.x) ? points(trace) : [] })).filter((c) => c.rows.length > 0 && c.trace.hoverinfo !== "skip");
    if (curves.length === 0) return;
    const voice = document.createElement("p");
    voice.className = "voice";
    voice.setAttribute("aria-live", "polite");
    canvas.after(voice);
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "application");
    const image = plot.querySelector("img");
    canvas.setAttribute("aria-label", (image ? image.alt + ". " : "") + curves.length + " curves. " + HELP);
    let curve = 0, point = -1;

    function show() {
      const { trace, index, rows } = curves[curve];
      const row = rows[point];
      voice.textContent = said(trace, row, point, rows.length);
      const axis = trace.xaxis ? trace.xaxis + (trace.yaxis || "y") : "xy";
      const width = trace.x.length;
      Plotly.Fx.hover(canvas, [{ curveNumber: index, pointNumber: isMap(trace) ? [Math.floor(row / width), row % width] : row }], axis);
    }

    canvas.addEventListener("focus", () => { if (point < 0) voice.textContent = HELP; });
    canvas.addEventListener("keydown", (event) => {
      const count = curves[curve].rows.length;
      const moves = { ArrowRight: 1, ArrowLeft: -1, PageDown: 10, PageUp: -10 };
      if (event.key in moves) point = Math.min(count - 1, Math.max(0, point + moves[event.key]));
      else if (event.key === "Home") point = 0;
      else if (event.key === "End") point = count - 1;
      else if (event.key === "ArrowDown" || event.key === "ArrowUp") {
        curve = (curve + (event.key === "ArrowDown" ? 1 : curves.length - 1)) % curves.length;
        point = Math.min(Math.max(point, 0), curves[curve].rows.length - 1);
      } else if (event.key === "Enter" && point >= 0) {
        const { trace, rows } = curves[curve];
        canvas.emit("plotly_click", { points: [{ customdata: at(trace, trace.customdata, rows[point]), data: trace }] });
        event.preventDefault();
        return;
      } else return;
      event.preventDefault();
      show();
    });
  }

  return { attach, quiet };
})();
