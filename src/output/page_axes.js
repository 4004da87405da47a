"use strict";
// Controls above a plot: unit of an abscissa of frequencies, scale of the ordinates.
const axes = (() => {
  const WRITTEN = "ω/ωc";
  const RAD_PER_SECOND = { "rad/s": 1, Hz: 2 * Math.PI, rpm: 2 * Math.PI / 60 };

  const suffix = (i) => (i === 0 ? "" : String(i + 1));

  // Factor that makes numbers in this unit of the abscissa as written.
  function factor(panel, unit) {
    if (!panel.frequency) return 1;
    const size = (name) => (name === WRITTEN ? panel.frequency.omega_c : RAD_PER_SECOND[name]);
    return size(panel.frequency.written) / size(unit);
  }

  function abscissaTitle(panel, unit) {
    if (!panel.frequency || unit === panel.frequency.written) return panel.x_label;
    return unit === WRITTEN ? "excitation frequency ω/ωc" : "excitation frequency [" + unit + "]";
  }

  function ordinates(data, panel) {
    const [low, high] = [Math.min(...panel.x_range), Math.max(...panel.x_range)];
    const list = [];
    for (const curve of panel.curves) {
      if (curve.style === "cells") continue;
      const x = data.columns[curve.x], y = data.columns[curve.y];
      y.forEach((value, row) => {
        if (value !== null && x[row] !== null && x[row] >= low && x[row] <= high) list.push(value);
      });
    }
    return list;
  }

  // Range over the positive ordinates; none where a negative one could not be shown.
  function logRange(data, panel) {
    let least = Infinity;
    if (panel.curves.some((curve) => curve.style === "cells")) return null;
    for (const value of ordinates(data, panel)) {
      if (value < 0) return null;
      if (value > 0) least = Math.min(least, value);
    }
    return least < panel.y_range[1] ? [Math.log10(least) - 0.05, Math.log10(panel.y_range[1])] : null;
  }

  // Everything in view, in the units and scales chosen.
  function whole(data, choice) {
    const layout = {};
    data.panels.forEach((panel, i) => {
      const f = factor(panel, choice.unit);
      layout["xaxis" + suffix(i) + ".range"] = panel.x_range.map((x) => x * f);
      layout["yaxis" + suffix(i) + ".range"] = choice.log ? logRange(data, panel) : panel.y_range.slice();
    });
    return layout;
  }

  function labelled(name, control) {
    const label = document.createElement("label");
    label.append(name + " ", control);
    return label;
  }

  // Abscissae of the traces in another unit; the part in view stays in view.
  function changeUnit(canvas, data, base, from, to) {
    const panelOf = (axis) => data.panels[axis === "x" ? 0 : Number(axis.slice(1)) - 1];
    const lists = base.map(({ x, xaxis }) => {
      const f = xaxis ? factor(panelOf(xaxis), to) : 1;
      return x.map((value) => (value === null ? null : value * f));
    });
    const hints = base.map(({ xaxis }) => {
      const frequency = xaxis && panelOf(xaxis).frequency;
      return frequency && to !== frequency.written ? "%{text}<br>" + to + " %{x:.7g}<extra></extra>" : "";
    });
    const layout = {};
    data.panels.forEach((panel, i) => {
      const axis = "xaxis" + suffix(i), f = factor(panel, to) / factor(panel, from);
      layout[axis + ".range"] = canvas.layout[axis].range.map((x) => x * f);
      layout[axis + ".title.text"] = abscissaTitle(panel, to);
    });
    return Plotly.update(canvas, { x: lists, hovertemplate: hints }, layout);
  }

  function changeScale(canvas, data, choice) {
    const ranges = whole(data, choice), layout = {};
    data.panels.forEach((_, i) => {
      const axis = "yaxis" + suffix(i);
      layout[axis + ".type"] = choice.log ? "log" : "linear";
      layout[axis + ".range"] = ranges[axis + ".range"];
    });
    return Plotly.relayout(canvas, layout);
  }

  // Builds the controls that make sense for these data. `base`: the traces as drawn first.
  function attach(canvas, data, base) {
    const first = data.panels.find((panel) => panel.frequency);
    const choice = { unit: first ? first.frequency.written : null, log: data.panels.every((panel) => panel.log) };
    const bar = document.createElement("div");
    bar.className = "controls";
    if (first) {
      const select = document.createElement("select");
      for (const unit of [WRITTEN, ...Object.keys(RAD_PER_SECOND)]) select.add(new Option(unit, unit));
      select.value = choice.unit;
      select.addEventListener("change", () => {
        changeUnit(canvas, data, base, choice.unit, select.value);
        choice.unit = select.value;
      });
      bar.append(labelled("Frequency in", select));
    }
    if (data.panels.every((panel) => logRange(data, panel))) {
      const box = document.createElement("input");
      box.type = "checkbox";
      box.checked = choice.log;
      box.addEventListener("change", () => {
        choice.log = box.checked;
        changeScale(canvas, data, choice);
      });
      bar.append(labelled("Logarithmic ordinate", box));
    }
    if (bar.children.length > 0) canvas.before(bar);
    canvas.on("plotly_doubleclick", () => Plotly.relayout(canvas, whole(data, choice)));
  }

  return { attach, suffix };
})();
