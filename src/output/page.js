"use strict";
(() => {
  const STATES = {
    stable: { share: 1, dash: "solid" },
    plain: { share: 1, dash: "solid" },
    unstable: { share: 1, dash: "7px,4px" },
    unknown: { share: 0.5, dash: "solid" },
  };
  // Marks of the second and third of several curves that lie on each other.
  const MARKS = ["", "circle-open", "square-open"];
  const SYMBOLS = {
    fold: "triangle-up", branch_point: "square", period_doubling: "diamond",
    neimark_sacker: "circle", grazing: "cross-thin", cusp: "triangle-se", fold_flip: "hourglass", turning_1: "triangle-left",
    turning_2: "triangle-right", meets_grazing: "cross", generalised_flip: "pentagon", generalised_neimark_sacker: "hexagon",
    resonance_1_1: "circle-open-dot", resonance_1_2: "circle-open-dot", resonance_1_3: "circle-open-dot", resonance_1_4: "circle-open-dot",
  };
  const MANY_DOTS = 15000;
  const CELLS = 2000;

  const text = (s) => String(s).replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;");
  const number = (v) => (v === null || v === undefined ? "" : String(v));

  // One line of the hover box for each column that the point has.
  function hover(data, curve, row, panel) {
    const lines = [];
    const title = [panel.heading, curve.label].filter((word, i, all) => word && all.indexOf(word) === i);
    if (title.length > 0) lines.push("<b>" + text(title.join(", ")) + "</b>");
    for (const [name, key] of curve.hover) lines.push(name + " " + number(data.columns[key][row]));
    lines.push(text(panel.y_label) + ": " + number(data.columns[curve.y][row]));
    return lines;
  }

  // Columns are called rms.mesh_1.
  const connection = (curve) => curve.name.slice(curve.name.indexOf(".") + 1);

  // Branch and point of a row: what leads to its orbit.
  function place(data, curve, row) {
    const value = (name) => {
      const entry = curve.hover.find(([own]) => own === name);
      return entry ? data.columns[entry[1]][row] : null;
    };
    return [value("branch"), value("point") ?? value("after_point")];
  }

  // The runs of one state as one trace, separated by gaps.
  function runTrace(data, panel, curve, state) {
    const x = [], y = [], tips = [], places = [];
    for (const [s, first, end] of curve.runs) {
      if (s !== state) continue;
      for (let row = first; row < end; row++) {
        x.push(data.columns[curve.x][row]);
        y.push(data.columns[curve.y][row]);
        const lines = hover(data, curve, row, panel);
        if (state !== "plain") lines.push(state === "unknown" ? "stability unknown" : state);
        tips.push(lines.join("<br>"));
        places.push(place(data, curve, row));
      }
      x.push(null); y.push(null); tips.push(""); places.push(null);
    }
    const lone = curve.runs.every(([, first, end]) => end - first === 1);
    const mark = MARKS[Math.min(curve.rank, 2)];
    return {
      x, y, text: tips, customdata: places, hoverinfo: "text", mode: lone ? "markers" : mark ? "lines+markers" : "lines",
      line: { color: curve.color, width: STATES[state].share * (curve.width + 0.3), dash: STATES[state].dash, shape: curve.shape || "linear" },
      marker: mark ? { color: curve.color, size: 7, symbol: mark, maxdisplayed: 40 } : { color: curve.color, size: 5 },
      meta: { state, connection: connection(curve) },
    };
  }

  // One of all dots that lie on each other, to a share of the range that no screen resolves.
  function distinct(data, curve, rows) {
    const places = [data.columns[curve.x], data.columns[curve.y]].map((values) => {
      let low = Infinity, high = -Infinity;
      for (const r of rows) if (values[r] !== null) { low = Math.min(low, values[r]); high = Math.max(high, values[r]); }
      return rows.map((r) => Math.round((values[r] - low) / (high - low || 1) * CELLS));
    });
    const seen = new Set();
    return rows.filter((_, k) => {
      const key = places[0][k] * (CELLS + 1) + places[1][k];
      return !seen.has(key) && seen.add(key);
    });
  }

  function pointTrace(data, panel, curve, all, marker) {
    const rows = all.length > MANY_DOTS ? distinct(data, curve, all) : all;
    return {
      x: rows.map((r) => data.columns[curve.x][r]), y: rows.map((r) => data.columns[curve.y][r]),
      mode: "markers", marker, meta: { connection: connection(curve) }, customdata: rows.map((r) => place(data, curve, r)),
      type: "scatter",
      text: rows.map((r) => hover(data, curve, r, panel).join("<br>")), hoverinfo: "text",
    };
  }

  // Coloured dots, bars.
  function areaTrace(data, panel, curve, all) {
    const x = data.columns[curve.x], y = data.columns[curve.y];
    const bar = panel.bar ? { title: { text: text(panel.bar), side: "right" }, thickness: 12, outlinewidth: 0 } : undefined;
    const common = { x, y, name: "", first: true, meta: { connection: connection(curve) } };
    if (curve.style === "bars") {
      return { ...common, type: "bar", width: curve.widths, marker: { color: curve.color, opacity: 0.6 } };
    }
    if (curve.style === "tornado") {
      return { ...common, y: curve.names, type: "bar", orientation: "h", marker: { color: curve.color, opacity: 0.6 } };
    }
    const marker = { size: 6, color: curve.z, colorscale: "Viridis", colorbar: bar, showscale: true };
    return { ...pointTrace(data, panel, curve, all, marker), name: "", first: true };
  }

  // Cells of a grid: a heat map, and an entry of the legend for every kind of cell. Kinds that are numbers lead to orbits, and so
  // do cells of a map: by seed, place and label.
  function cellTraces(panel, curve) {
    const count = curve.levels.length;
    const words = curve.cells.map((row) => row.map((level) => (level === null ? "" : curve.levels[level][0])));
    const scale = curve.is_continuous
      ? curve.levels.map(([, color], k) => [k / (count - 1), color])
      : curve.levels.flatMap(([, color], k) => [[k / count, color], [(k + 1) / count, color]]);
    const ends = curve.is_continuous ? [0, count - 1] : [-0.5, count - 0.5];
    const ofCell = (word, j, i) => [Number(curve.only), null, curve.x[i], curve.y[j], word];
    const ofKind = (word) => (/^\d+/.test(word) ? [parseInt(word, 10), 0] : null);
    const places = words.map((row, j) => row.map((word, i) => (curve.only === null ? ofKind(word) : ofCell(word, j, i))));
    const map = {
      type: "heatmap", x: curve.x, y: curve.y, z: curve.cells, text: words, customdata: places, meta: { connection: connection(curve) },
      zmin: ends[0], zmax: ends[1], colorscale: scale, showscale: false, hoverongaps: false, name: "",
      hovertemplate: "%{text}<br>" + text(panel.x_label) + " %{x}<br>" + text(panel.y_label) + " %{y}<extra></extra>",
    };
    const shown = new Set(curve.cells.flat());
    if (curve.is_continuous) {
      const named = [0, 1, 2, 3, 4].map((k) => Math.floor(k * (count - 1) / 4));
      return [{ ...map, showscale: true, colorbar: { thickness: 11, x: 1.01, tickvals: named, ticktext: named.map((k) => Number(curve.levels[k][0]).toPrecision(4)), title: { text: text(panel.bar || ""), side: "right" } } }];
    }
    const named = [...curve.levels.keys()].filter((k) => shown.has(k));
    const entries = named.map((k) => ({
      x: [null], y: [null], mode: "markers", hoverinfo: "skip", name: text(curve.levels[k][0]), first: true, meta: {},
      marker: { symbol: "square", size: 11, color: curve.levels[k][1] },
    }));
    return [map, ...entries];
  }

  function curveTraces(data, panel, curve) {
    if (curve.style === "cells") return cellTraces(panel, curve);
    const all = data.columns[curve.x].map((_, row) => row);
    const name = text(curve.label);
    if (curve.style === "runs") {
      const states = ["stable", "plain", "unstable", "unknown"].filter((s) => curve.runs.some((r) => r[0] === s));
      return states.map((s, i) => ({ ...runTrace(data, panel, curve, s), name, first: i === 0 }));
    }
    if (curve.style === "events") {
      const kinds = [...new Set(curve.kinds)];
      return kinds.map((kind) => {
        const rows = all.filter((r) => curve.kinds[r] === kind && data.columns[curve.y][r] !== null);
        const title = data.kinds[kind];
        const { ink, paper } = theme.colors();
        const marker = { symbol: SYMBOLS[kind] || "triangle-down", size: 7, color: ink, line: { color: kind === "grazing" ? ink : paper, width: kind === "grazing" ? 1.5 : 0.8 } };
        const trace = pointTrace(data, panel, curve, rows, marker);
        trace.text = trace.text.map((t) => "<b>" + text(title) + "</b><br>" + t);
        trace.meta.ink = kind === "grazing" ? ["marker.color", "marker.line.color"] : ["marker.color"];
        return { ...trace, name: text(title), first: true };
      }).filter((trace) => trace.x.length > 0);
    }
    if (curve.style === "coloured" || curve.style === "bars" || curve.style === "tornado") {
      return [areaTrace(data, panel, curve, all)];
    }
    const crosses = curve.style === "crosses";
    const onLines = panel.curves.some((other) => other.style === "runs");
    const marker = crosses
      ? { symbol: "x-thin", size: 5, color: curve.color, line: { color: curve.color, width: 1 } }
      : curve.rank > 0 ? { size: 9, color: curve.color, opacity: 0.35 }
      : onLines ? { size: 5, color: theme.colors().ink }
      : { size: all.length > 600 ? 3 : 5, color: curve.color };
    return [{ ...pointTrace(data, panel, curve, all, marker), name, first: true }];
  }

  // Entries that explain the strokes; a click on one hides or shows everything drawn that way.
  function strokeEntries(traces) {
    const names = { stable: "stable", unstable: "unstable", unknown: "stability unknown" };
    return Object.keys(names).filter((s) => traces.some((t) => t.meta.state === s)).map((s) => ({
      x: [null], y: [null], mode: "lines", name: names[s], line: { color: theme.colors().ink, width: 2 * STATES[s].share, dash: STATES[s].dash }, hoverinfo: "skip", meta: { toggles: s, ink: ["line.color"] },
    }));
  }

  // Ranges are copies: a zoom writes into the ones that the layout holds.
  // Heights of the panels, and the share of all of them that one takes.
  function heights(data) {
    const n = data.panels.length;
    const panelHeight = n === 1 ? 400 : 290;
    const inner = n * panelHeight + (n - 1) * 80;
    const domain = (i) => {
      const top = 1 - (i * (panelHeight + 80)) / inner;
      return [Math.max(0, top - panelHeight / inner), top];
    };
    return { panelHeight, inner, domain };
  }

  function layout(data, width) {
    const n = data.panels.length;
    const small = width < 700;
    const dotted = data.panels.every((panel) => panel.curves.every((curve) => curve.style === "dots"));
    const scaled = data.panels.some((panel) => panel.curves.some((curve) => curve.is_continuous));
    const { panelHeight, inner, domain } = heights(data);
    const height = n * panelHeight + (n - 1) * 80 + (small ? 230 : 160);
    const result = {
      height, autosize: true, hovermode: "closest", dragmode: "zoom", ...theme.layout(),
      annotations: [],
      margin: { l: small ? 62 : 78, r: scaled ? 84 : 16, t: 34, b: 20 }, hoverlabel: { align: "left" },
      legend: { orientation: "h", x: 0, xanchor: "left", yanchor: "top", y: -70 / (n * panelHeight + (n - 1) * 80), tracegroupgap: 0, itemsizing: dotted ? "constant" : "trace" },
    };
    data.panels.forEach((panel, i) => {
      const suffix = axes.suffix(i);
      const frame = { showline: true, mirror: "allticks", ticks: "inside", zeroline: false, exponentformat: "power", automargin: true, ...theme.axis() };
      const names = panel.curves.some((curve) => curve.style === "tornado");
      result["xaxis" + suffix] = { ...frame, title: { text: text(panel.x_label), standoff: 10 }, anchor: "y" + suffix, range: panel.x_range.slice() };
      result["yaxis" + suffix] = { ...frame, title: { text: text(panel.y_label) }, anchor: "x" + suffix, domain: domain(i), range: panel.y_range.slice() };
      if (data.shared && i > 0) result["xaxis" + suffix].matches = "x";
      if (names) result["yaxis" + suffix] = { ...frame, type: "category", autorange: "reversed", anchor: "x" + suffix, domain: result["yaxis" + suffix].domain };
      if (panel.log) result["yaxis" + suffix] = { ...result["yaxis" + suffix], type: "log", range: panel.y_range.map(Math.log10) };
      if (panel.heading) {
        result.annotations.push({ text: "<b>" + text(panel.heading) + "</b>", xref: "x" + suffix + " domain", yref: "y" + suffix + " domain", x: 0, y: 1, xanchor: "left", yanchor: "bottom", yshift: 3, showarrow: false });
      }
    });
    return result;
  }

  function traces(data) {
    const list = [], named = new Set();
    const { domain } = heights(data);
    data.panels.forEach((panel, i) => {
      const suffix = axes.suffix(i);
      for (const curve of panel.curves) {
        for (const trace of curveTraces(data, panel, curve)) {
          const group = curve.style + "|" + trace.name;
          const { first, ...rest } = trace;
          const showlegend = first && trace.name !== "" && !named.has(group);
          if (showlegend) named.add(group);
          if (rest.colorbar) {
            const [bottom, top] = domain(i);
            rest.colorbar = { ...rest.colorbar, len: top - bottom, lenmode: "fraction", y: (bottom + top) / 2, yanchor: "middle" };
          }
          list.push({ ...rest, legendgroup: group, showlegend, xaxis: "x" + suffix, yaxis: "y" + suffix });
        }
      }
    });
    const events = list.filter((t) => t.legendgroup.startsWith("events"));
    const curves = list.filter((t) => !t.legendgroup.startsWith("events"));
    return [...curves, ...strokeEntries(curves), ...events];
  }

  function toggleState(plot, event) {
    const state = (event.data[event.curveNumber].meta || {}).toggles;
    if (!state) return true;
    const own = event.data[event.curveNumber].visible;
    const show = own === "legendonly";
    const hit = event.data.map((t, i) => i).filter((i) => (event.data[i].meta || {}).state === state);
    Plotly.restyle(plot, { visible: show ? true : "legendonly" }, [event.curveNumber]);
    // A hidden trace keeps its place in the legend of its curve.
    Plotly.restyle(plot, { visible: show }, hit);
    return false;
  }

  async function draw(plot) {
    const data = JSON.parse(document.getElementById(plot.dataset.source).textContent);
    const canvas = document.createElement("div");
    canvas.className = "canvas";
    plot.append(canvas);
    const config = { responsive: true, displaylogo: false, showSendToCloud: false, plotlyServerURL: "", doubleClick: false, modeBarButtonsToRemove: ["lasso2d", "select2d", "resetScale2d"], toImageButtonOptions: { format: "svg", filename: plot.dataset.name } };
    try {
      const list = traces(data);
      const base = list.map(({ x, xaxis }) => ({ x, xaxis }));
      await Plotly.newPlot(canvas, list, layout(data, plot.clientWidth), config);
      canvas.on("plotly_legendclick", (event) => toggleState(canvas, event));
      axes.attach(canvas, data, base);
      orbits.attach(plot, canvas, data);
      reader.attach(plot, canvas, list);
      reader.quiet();
      plot.classList.add("drawn");
    } catch (error) {
      canvas.remove(); // the static figure stays
      console.error(error);
    }
  }

  async function drawAll() {
    await plotting;
    for (const plot of document.querySelectorAll(".plot")) {
      await draw(plot);
      await new Promise((next) => setTimeout(next, 0));
    }
  }
  drawAll();
  theme.onChange(() => document.querySelectorAll(".js-plotly-plot").forEach((canvas) => {
    const { ink } = theme.colors();
    canvas.data.forEach((trace, index) => {
      const keys = (trace.meta || {}).ink || [];
      if (keys.length > 0) Plotly.restyle(canvas, Object.fromEntries(keys.map((key) => [key, ink])), [index]);
    });
    const frames = {};
    for (const key of Object.keys(canvas.layout || {}).filter((name) => /^[xy]axis/.test(name))) {
      for (const [name, value] of Object.entries(theme.axis())) frames[key + "." + name] = value;
    }
    const { font, ...papers } = theme.layout();
    Plotly.relayout(canvas, { ...papers, "font.color": font.color, ...frames });
  }));
})();
