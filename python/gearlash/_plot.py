"""Figures, drawn from the tables as the program draws them."""

from __future__ import annotations

import math
from typing import Any

from ._errors import missing

# Okabe and Ito: colours that stay apart for colour-blind readers.
PALETTE = (
    "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9",
    "#7B4F9D", "#8C6D31", "#5F6A72", "#A6192E", "#5C8A00", "#1F2A6B",
)
NEUTRAL = "#222222"
# Marks of matplotlib and plotly by kind of event.
MARKS = {
    "fold": ("^", "triangle-up"),
    "branch_point": ("s", "square"),
    "period_doubling": ("D", "diamond"),
    "neimark_sacker": ("o", "circle"),
    "grazing": ("P", "cross-thin"),
    "cusp": ("1", "triangle-se"),
    "fold_flip": ("X", "hourglass"),
    "turning_1": ("<", "triangle-left"),
    "turning_2": (">", "triangle-right"),
    "meets_grazing": ("p", "cross"),
    "generalised_flip": ("h", "pentagon"),
    "generalised_neimark_sacker": ("H", "hexagon"),
    **{f"resonance_1_{k}": ("*", "circle-open-dot") for k in (1, 2, 3, 4)},
}
OTHER_MARK = ("v", "triangle-down")
# Kinds of cells of a map: light, so that curves stay visible on them (Tol); and cells of which nothing is known.
KINDS = ("#77AADD", "#EE8866", "#EEDD88", "#99DDFF", "#FFAABB", "#44BB99", "#BBCC33", "#AAAA00")
UNKNOWN = "#DDDDDD"
# Sizes of units of frequency in rad/s; nondimensional ones are in omega_c.
RADIANS = {"RadianPerSecond": 1.0, "Hertz": math.tau, "RevolutionsPerMinute": math.tau / 60}
# Styles that take no colour of their own.
COLOURLESS = ("Events", "Cells")
STATES = ("stable", "unstable", "stability unknown")


def draw(result: Any, ax: Any, backend: str) -> Any:
    """The figure of a result with a backend by its name."""
    if backend not in ("matplotlib", "plotly"):
        raise ValueError(f"backend = {backend!r}: must be 'matplotlib' or 'plotly'")
    figure = result._parts["figure"]
    if not figure or not figure["panels"]:
        raise ValueError(f"{result.name} has no figure: use its tables")
    panels = [(panel, _resolve(panel, result)) for panel in _colored(figure)]
    if backend == "plotly":
        if ax is not None:
            raise ValueError("plotly draws its own figure: leave out `ax`")
        return _plotly(figure, panels)
    return _matplotlib(figure, panels, ax)


def _family(curve: dict, by_label: bool) -> str:
    """What decides the colour: the connection in ``rms.mesh_1``, else the label."""
    _, dot, connection = curve["y"].partition(".")
    return connection if dot and not by_label else curve["label"]


def _style(curve: dict) -> str:
    style = curve["style"]
    return style if isinstance(style, str) else next(iter(style))


def _colored(figure: dict) -> list[dict]:
    """The panels, each curve with its colour."""

    def clash(panel: dict) -> bool:
        seen: dict[tuple[str, str], str] = {}
        for curve in panel["curves"]:
            key = (_style(curve), _family(curve, False))
            if key[0] not in COLOURLESS and seen.setdefault(key, curve["label"]) != curve["label"]:
                return True
        return False

    by_label = any(clash(panel) for panel in figure["panels"])
    families: list[str] = []
    panels = []
    for panel in figure["panels"]:
        curves = []
        for curve in panel["curves"]:
            family = _family(curve, by_label)
            style = _style(curve)
            if style == "Dots" and any(_style(other) == "Cells" for other in panel["curves"]):
                curves.append({**curve, "color": NEUTRAL})
                continue
            if family not in families and style not in COLOURLESS:
                families.append(family)
            color = PALETTE[families.index(family) % len(PALETTE)] if family in families else NEUTRAL
            curves.append({**curve, "color": color})
        panels.append({**panel, "curves": curves})
    return panels


def _resolve(panel: dict, result: Any) -> list[dict]:
    """Strokes and points of a panel: x, y, look."""
    import numpy

    drawn = []
    for curve in panel["curves"]:
        table = result.tables[curve["table"]]
        x = numpy.asarray(table[curve["x"]], dtype=float)
        keep = numpy.ones(len(x), dtype=bool)
        if curve["only"]:
            column, value = curve["only"]
            keep = numpy.array([str(cell) == value for cell in table[column]], dtype=bool)
        style = _style(curve)
        if style == "Events" and curve["y"] not in table:
            y = _on_branches(result, table, curve, x)
        else:
            y = numpy.asarray(table[curve["y"]], dtype=float)
        x = numpy.where(keep, x, numpy.nan) * _shown(panel["x_frequency"])
        own = {"color": curve["color"], "label": curve["label"]}
        if style == "Branch":
            names = curve["style"]["Branch"]
            branch, stable = (numpy.asarray(table[names[key]], dtype=float) for key in ("branch", "stable"))
            for state in range(3):
                xs, ys = _strokes(x, y, branch, stable, state)
                if len(xs):
                    drawn.append({**own, "look": "stroke", "state": state, "x": xs, "y": ys})
        elif style == "Cells":
            drawn.append({**own, "look": "cells", **_cells(x, y, table[curve["style"]["Cells"]["value"]], curve["style"]["Cells"]["names"])})
        elif style == "Line":
            drawn.append({**own, "look": "stroke", "state": None, "x": x, "y": y})
        elif style == "Events":
            kinds = table[curve["style"]["Events"]["kind"]]
            for kind in dict.fromkeys(kinds):
                these = (kinds == kind) & numpy.isfinite(x) & numpy.isfinite(y)
                if these.any():
                    drawn.append({"look": "event", "kind": kind, "x": x[these], "y": y[these], "color": NEUTRAL})
        else:
            drawn.append({**own, "look": style.lower(), "x": x, "y": y})
    return drawn


def _shown(axis: dict | None) -> float:
    """Numbers that are drawn over those that the table holds."""
    if not axis or axis.get("shown", axis["written"]) == axis["written"]:
        return 1.0
    size = lambda unit: RADIANS.get(unit, axis["omega_c"])
    return size(axis["written"]) / size(axis["shown"])


def _cells(x: Any, y: Any, values: Any, names: list) -> dict:
    """A grid of numbers z, and for words and whole numbers what each means: (text, colour). Gaps take what lies beside them."""
    import numpy

    kinds = None
    if values.dtype.kind == "f":
        numbers = values
    else:
        known = [key for key, _ in names]
        known += [word for word in dict.fromkeys(str(value) for value in values) if word not in known]
        texts = [*(text for _, text in names), *known[len(names) :]]
        kinds = [(text, UNKNOWN if text == "undecided" else KINDS[k % len(KINDS)]) for k, text in enumerate(texts)]
        numbers = numpy.array([known.index(str(value)) for value in values], dtype=float)
    present = numpy.isfinite(x) & numpy.isfinite(y)
    columns, at_x = numpy.unique(x[present], return_inverse=True)
    rows, at_y = numpy.unique(y[present], return_inverse=True)
    z = numpy.full((len(rows), len(columns)), numpy.nan)
    z[at_y.reshape(-1), at_x.reshape(-1)] = numbers[present]
    # A grid that is refined in parts has rows for some places only.
    while numpy.isnan(z).any() and not numpy.isnan(z).all():
        wide = numpy.pad(z, 1, constant_values=numpy.nan)
        for beside in (wide[:-2, 1:-1], wide[1:-1, :-2], wide[1:-1, 2:], wide[2:, 1:-1]):
            z = numpy.where(numpy.isnan(z), beside, z)
    return {"x": columns, "y": rows, "z": z, "kinds": kinds}


def _strokes(x: Any, y: Any, branch: Any, stable: Any, state: int) -> tuple[Any, Any]:
    """The parts of branches of one stability, NaN between them; each begins where the one before ended."""
    import numpy

    states = numpy.where(stable == 1.0, 0, numpy.where(stable == 0.0, 1, 2))
    drawable = numpy.isfinite(x) & numpy.isfinite(y)
    xs: list[float] = []
    ys: list[float] = []
    for row in range(len(x)):
        if not drawable[row] or states[row] != state:
            continue
        follows = row > 0 and drawable[row - 1] and branch[row - 1] == branch[row]
        if not follows or states[row - 1] != state:
            xs.append(numpy.nan)
            ys.append(numpy.nan)
            if follows:
                xs.append(x[row - 1])
                ys.append(y[row - 1])
        xs.append(x[row])
        ys.append(y[row])
    return numpy.array(xs), numpy.array(ys)


def _on_branches(result: Any, events: Any, curve: dict, x: Any) -> Any:
    """Ordinates of events whose table has none: interpolated between the two points of the main table that bracket them."""
    import numpy

    main = result.tables["main"]
    branch, point = main["branch"], main["point"]
    xs, ys = (numpy.asarray(main[curve[key]], dtype=float) for key in ("x", "y"))
    found = numpy.full(len(x), numpy.nan)
    rows = {(int(b), int(p)): row for row, (b, p) in enumerate(zip(branch, point))}
    for k, (on, after) in enumerate(zip(events["branch"], events["after_point"])):
        if not (numpy.isfinite(on) and numpy.isfinite(after)):
            continue
        row = rows.get((int(on), int(after)))
        if row is None:
            continue
        following = row + 1
        if following >= len(xs) or branch[following] != on or xs[following] == xs[row]:
            found[k] = ys[row]
            continue
        share = min(max((x[k] - xs[row]) / (xs[following] - xs[row]), 0.0), 1.0)
        found[k] = ys[row] + share * (ys[following] - ys[row])
    return found


def _said(kind: str) -> str:
    return "Neimark-Sacker" if kind == "neimark_sacker" else kind.replace("_", " ")


def _matplotlib(figure: dict, panels: list, ax: Any) -> Any:
    try:
        import matplotlib.pyplot as plt
    except ImportError:
        raise missing("matplotlib", "plot", "plot") from None
    own = ax is None
    whole: Any
    axes: list[Any]
    if own:
        height = 4.6 if len(panels) == 1 else 2.9 * len(panels) + 1.2
        whole, grid = plt.subplots(len(panels), 1, figsize=(7.1, height), squeeze=False, layout="constrained")
        axes = list(grid[:, 0])
    else:
        axes = [ax] if hasattr(ax, "plot") else list(ax)
        whole = axes[0].figure if axes else None
        if len(axes) != len(panels):
            raise ValueError(f"{len(axes)} axes for {len(panels)} panels: give one per panel")
    for (panel, drawn), axis in zip(panels, axes):
        _panel(axis, panel, drawn)
        if not own and axis.get_legend_handles_labels()[1]:
            axis.legend(fontsize=8, frameon=False)
    if own:
        _legend(whole, axes)
    axes[0].set_title(figure["title"], fontsize=11, wrap=True)
    return whole


def _panel(axis: Any, panel: dict, drawn: list) -> None:
    said = set()

    def once(text: str) -> str | None:
        if not text or text in said:
            return None
        said.add(text)
        return text

    for curve in drawn:
        x, y, color = curve["x"], curve["y"], curve["color"]
        if curve["look"] == "stroke":
            thin = curve["state"] == 2
            line = "--" if curve["state"] == 1 else "-"
            axis.plot(x, y, line, color=color, linewidth=0.7 if thin else 1.4, dashes=(5, 3) if line == "--" else (None, None))
            label = once(curve["label"])
            if label:
                axis.plot([], [], "-", color=color, linewidth=1.4, label=label)
        elif curve["look"] == "cells":
            _draw_cells(axis, curve, once)
        elif curve["look"] == "event":
            mark = MARKS.get(curve["kind"], OTHER_MARK)[0]
            label = once(_said(curve["kind"]))
            axis.plot(x, y, mark, color=NEUTRAL, markeredgecolor="white", markersize=7, linestyle="", label=label, zorder=5, clip_on=False)
        else:
            mark, size = ("x", 4) if curve["look"] == "crosses" else (".", 2.5)
            axis.plot(x, y, mark, color=color, markersize=size, linestyle="", label=once(curve["label"]))
    for state in (0, 1, 2):
        if any(curve.get("state") == state for curve in drawn):
            line, width = ("--", 1.4) if state == 1 else ("-", 0.7 if state == 2 else 1.4)
            axis.plot([], [], line, color=NEUTRAL, linewidth=width, label=once(STATES[state]))
    axis.set_xlabel(panel["x_label"])
    axis.set_ylabel(panel["y_label"])
    if panel["x_range"]:
        axis.set_xlim(sorted(panel["x_range"]))
    axis.grid(color="#e4e4e4", linewidth=0.8)
    axis.set_axisbelow(True)
    axis.tick_params(direction="in", top=True, right=True)


def _legend(whole: Any, axes: list) -> None:
    """One legend below the panels, where it covers no curve; what several panels say is said once."""
    entries: dict[str, Any] = {}
    for axis in axes:
        for handle, label in zip(*axis.get_legend_handles_labels()):
            entries.setdefault(label, handle)
    if entries:
        whole.legend(entries.values(), entries.keys(), loc="outside lower center", ncols=4, fontsize=8, frameon=False)


def _draw_cells(axis: Any, curve: dict, once: Any) -> None:
    from matplotlib.colors import ListedColormap

    kinds = curve["kinds"]
    if kinds is None:
        mesh = axis.pcolormesh(curve["x"], curve["y"], curve["z"], shading="nearest", cmap="viridis", rasterized=True)
        axis.figure.colorbar(mesh, ax=axis, label=curve["label"])
        return
    colors = ListedColormap([color for _, color in kinds])
    limits = {"vmin": -0.5, "vmax": len(kinds) - 0.5}
    axis.pcolormesh(curve["x"], curve["y"], curve["z"], shading="nearest", cmap=colors, rasterized=True, **limits)
    for k, (text, color) in enumerate(kinds):
        if (curve["z"] == k).any():
            axis.plot([], [], "s", color=color, markersize=8, label=once(text))


def _plotly(figure: dict, panels: list) -> Any:
    try:
        from plotly.subplots import make_subplots
    except ImportError:
        raise missing("plotly", "plot(backend='plotly')", "plot") from None
    whole = make_subplots(rows=len(panels), cols=1)
    said = set()
    for row, (panel, drawn) in enumerate(panels, start=1):
        for curve in drawn:
            if curve["look"] == "cells":
                heat = {"type": "heatmap", "x": curve["x"], "y": curve["y"], "z": curve["z"], "name": curve["label"]}
                if curve["kinds"] is not None:
                    words, colors = zip(*curve["kinds"])
                    count = len(words)
                    scale = [[(k + end) / count, color] for k, color in enumerate(colors) for end in (0, 1)]
                    bar = {"tickvals": list(range(count)), "ticktext": list(words)}
                    heat |= {"zmin": -0.5, "zmax": count - 0.5, "colorscale": scale, "colorbar": bar}
                whole.add_trace(heat, row=row, col=1)
                continue
            text = _said(curve["kind"]) if curve["look"] == "event" else curve["label"]
            trace = {"type": "scatter", "x": curve["x"], "y": curve["y"], "name": text, "legendgroup": text}
            trace["showlegend"] = bool(text) and text not in said
            said.add(text)
            if curve["look"] == "stroke":
                dash = "dash" if curve["state"] == 1 else "solid"
                trace |= {"mode": "lines", "line": {"color": curve["color"], "dash": dash, "width": 1 if curve["state"] == 2 else 2}}
            else:
                marks = {"event": MARKS.get(curve.get("kind", ""), OTHER_MARK)[1], "crosses": "x-thin-open"}
                mark = marks.get(curve["look"], "circle")
                trace |= {"mode": "markers", "marker": {"color": curve["color"], "symbol": mark, "size": 9 if curve["look"] == "event" else 4}}
            whole.add_trace(trace, row=row, col=1)
        whole.update_xaxes(title_text=panel["x_label"], range=sorted(panel["x_range"]) if panel["x_range"] else None, row=row, col=1)
        whole.update_yaxes(title_text=panel["y_label"], row=row, col=1)
    whole.update_layout(title=figure["title"], template="simple_white", height=420 if len(panels) == 1 else 300 * len(panels))
    return whole
