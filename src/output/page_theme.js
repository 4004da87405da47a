"use strict";
// Colours of the plots in light and dark, as the style sheet of the page has them.
const theme = (() => {
  const query = window.matchMedia("(prefers-color-scheme: dark)");
  const value = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  const colors = () => ({ ink: value("--ink"), paper: value("--paper"), line: value("--line") });

  function layout() {
    const { ink, paper } = colors();
    return {
      paper_bgcolor: paper, plot_bgcolor: paper,
      font: { family: "system-ui, 'DejaVu Sans', Arial, sans-serif", size: 13, color: ink },
    };
  }

  function axis() {
    const { ink, line } = colors();
    return { linecolor: ink, tickcolor: ink, gridcolor: line };
  }

  const onChange = (act) => query.addEventListener("change", act);

  return { colors, layout, axis, onChange };
})();
