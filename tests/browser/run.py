"""The page of a run in a real browser: see README.md. Usage: run.py PROGRAM FOLDER"""

import base64
import math
import os
import subprocess
import sys

from devtools import Browser

HERE = os.path.dirname(os.path.abspath(__file__))
MODEL = os.path.join(HERE, "..", "..", "models", "reverse_idler.yaml")
ARGUMENTS = ["--only", "fig_08", "--only", "fig_11", "--set", "analyses.fig_11.orbits=true",
             "--set", "analyses.fig_08.points=21", "--quiet"]
MAPS = """schema: 1
name: one mesh
reduced:
  stiffness: [[1.0]]
  damping: {matrix: [[0.1]]}
  elements: {m: {type: backlash, half_gap: 1.0}}
  loads: {mean: [0.5], harmonics: [{order: 1, cos: [0.2], sin: [0]}]}
analyses:
  regimes: {type: regime_map, parameters: {frequency: {from: 0.5, to: 0.9, points: 5}, reduced.loads.harmonics.0.cos.0: {from: 0.1, to: 0.3, points: 3}}, seeds: [rest], refine: 0, transient: 60, periods: 20}
  basins: {type: basins, at: 0.6, set: {reduced.loads.harmonics.0.cos.0: 0.2}, grid: {q.m: {from: -2, to: 2, points: 9}, v.m: {from: -2, to: 2, points: 9}}}
"""
PLOT = "document.querySelector('[data-name=fig_11] .js-plotly-plot')"
ORBIT = "document.querySelector('#a-fig_11 .orbit')"


def close(a, b):
    return math.isclose(a, b, rel_tol=1e-6)


def check(truth, what):
    if not truth:
        raise AssertionError(what)
    print("  " + what)


def middle_of(page, element):
    """Middle of an element on the screen."""
    return page.evaluate(f"(() => {{ const r = {element}.getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2]; }})()")


def curve_point(page, trace, row):
    """Where a point of a trace lies on the screen."""
    return page.evaluate(f"""(() => {{
        const plot = {PLOT}, trace = plot._fullData[{trace}], box = plot.getBoundingClientRect();
        const x = plot._fullLayout.xaxis, y = plot._fullLayout.yaxis;
        return [box.x + x._offset + x.d2p(trace.x[{row}]), box.y + y._offset + y.d2p(trace.y[{row}])];
    }})()""")


def axis(page, name):
    return page.evaluate(f"(({{ type, range, title }}) => ({{ type, range, title: title.text }}))({PLOT}.layout.{name})")


def free_row(page):
    """Row of the first trace far from events, whose markers would be hit instead."""
    return page.evaluate(f"""(() => {{
        const [trace] = {PLOT}.data;
        return trace.x.findIndex((x) => x !== null && x < 2.1);
    }})()""")


def loads(page, file):
    check(os.path.getsize(file) < 4e6, "the page is below 4 MB, with all its orbits")
    page.open(file)
    page.wait_for("document.querySelectorAll('.js-plotly-plot .main-svg').length >= 4", "plots of both analyses")
    check(page.evaluate("document.querySelectorAll('[data-title^=Share]').length") == 0, "no button sends a plot away")
    check(page.evaluate(f"{PLOT}.data.length") > 6, "curves are drawn")
    check(page.evaluate("[...document.querySelectorAll('.plot img')].every((i) => getComputedStyle(i).display === 'none')"), "static figures gave way")
    check(page.evaluate("document.querySelector('#model img').naturalWidth") > 400, "the train is drawn")
    check(page.evaluate("document.querySelectorAll('#model tbody tr').length") == 5, "three bodies and two connections are listed")
    check(page.evaluate("document.querySelectorAll('nav li').length") == 2, "the table of contents lists both analyses")
    page.evaluate(f"{PLOT}.parentElement.scrollIntoView()")


def hovers(page, row):
    page.mouse("mouseMoved", [2, 2])
    page.mouse("mouseMoved", curve_point(page, 0, row))
    page.wait_for(f"{PLOT}.querySelector('.hoverlayer .hovertext')", "a hover box")
    words = page.evaluate(f"{PLOT}.querySelector('.hoverlayer .hovertext').textContent")
    check("mesh 1" in words and "omega" in words and "stable" in words, "the hover box names curve, frequency, stability")


def zooms(page):
    before = axis(page, "xaxis")["range"]
    box = page.evaluate(f"(() => {{ const r = {PLOT}.querySelector('.nsewdrag').getBoundingClientRect(); return [r.x, r.y, r.width, r.height]; }})()")
    at = lambda x, y: [box[0] + x * box[2], box[1] + y * box[3]]
    page.drag(at(0.3, 0.2), at(0.6, 0.8))
    page.wait_for(f"{PLOT}.layout.xaxis.range[0] > {before[0]} + 0.1", "a zoomed abscissa")
    low, high = axis(page, "xaxis")["range"]
    share = (high - low) / (before[1] - before[0])
    check(abs(share - 0.3) < 0.01, "dragging zooms to the part framed")
    other = axis(page, "xaxis2")["range"]
    check(close(other[0], low) and close(other[1], high), "the other panel shows the same part")
    return low, high


def changes_axes(page, low, high):
    select = f"{PLOT}.parentElement.querySelector('.controls select')"
    first = page.evaluate(f"{PLOT}.data[0].x[0]")
    omega_c = math.sqrt(6e8)
    for unit, size in [("rad/s", 1.0), ("Hz", 2 * math.pi), ("rpm", 2 * math.pi / 60), ("ω/ωc", omega_c)]:
        page.evaluate(f"(() => {{ const s = {select}; s.value = '{unit}'; s.dispatchEvent(new Event('change')); }})()")
        factor = omega_c / size
        page.wait_for(f"Math.abs({PLOT}.data[0].x[0] / {first * factor} - 1) < 1e-6", "frequencies in " + unit)
        now = axis(page, "xaxis")
        check(close(now["range"][0], low * factor) and close(now["range"][1], high * factor) and unit in now["title"],
              f"the same part is in view in {unit}")
    page.click(middle_of(page, f"{PLOT}.parentElement.querySelector('.controls input')"))
    page.wait_for(f"{PLOT}.layout.yaxis.type === 'log'", "a logarithmic ordinate")
    check(axis(page, "yaxis")["range"][0] < -1, "the logarithmic ordinate shows small values")
    check(page.evaluate("!document.querySelector('[data-name=fig_08] .controls input')"),
          "negative values are not offered a logarithm")


def zooms_out(page):
    at = middle_of(page, f"{PLOT}.querySelector('.nsewdrag')")
    page.double_click(at)
    page.wait_for(f"Math.abs({PLOT}.layout.xaxis.range[1] - 2.5) < 1e-9", "the whole range after a double click")
    check(axis(page, "yaxis")["type"] == "log", "zooming out keeps the scale")
    page.click(middle_of(page, f"{PLOT}.parentElement.querySelector('.controls input')"))
    page.wait_for(f"{PLOT}.layout.yaxis.type === 'linear'", "a linear ordinate")


def toggles(page):
    entry = f"[...{PLOT}.querySelectorAll('.legend .traces')].find((t) => t.textContent.trim() === 'mesh 1').querySelector('.legendtoggle')"
    hidden = f"{PLOT}._fullData.filter((t) => t.name === 'mesh 1').every((t) => t.visible === 'legendonly')"
    page.click(middle_of(page, entry))
    page.wait_for(hidden, "mesh 1 hidden")
    check(True, "a click in the legend hides a curve")
    page.click(middle_of(page, entry))
    page.wait_for(f"!({hidden})", "mesh 1 shown again")


def shows_orbit(page, row):
    page.wait_for(f"{PLOT}._fullData[0].visible === true", "the first curve")
    expected = page.evaluate(f"{PLOT}.data[0].customdata[{row}]")
    page.click(curve_point(page, 0, row))
    page.wait_for(f"{ORBIT}.querySelectorAll('.subplot').length === 4", "four diagrams of the orbit")
    words = page.evaluate(f"{ORBIT}.querySelector('p').textContent")
    check(f"branch {expected[0]}, point" in words, "the orbit says where it belongs: " + words)
    drawn = f"{ORBIT}.querySelector('.js-plotly-plot').data"
    check(page.evaluate(f"{drawn}.map((t) => t.x.length)") == [257, 257, 257, 60], "time histories, phase plane and spectrum have their points")
    spread = page.evaluate(f"(() => {{ const y = {drawn}[0].y; const m = y.slice(1).reduce((a, b) => a + b) / 256; return Math.sqrt(y.slice(1).reduce((a, b) => a + (b - m) ** 2, 0) / 256); }})()")
    own = page.evaluate(f"(({{ orbits }}, [branch, point]) => orbits.orbits.some((o) => o.branch === branch && o.point === point))(JSON.parse(document.getElementById('data-fig_11').textContent), {expected})")
    check(own, "the orbit of this very point is in the page")
    rms = page.evaluate(f"{PLOT}.data[0].y[{row}]")
    check(abs(spread / rms - 1) < 1e-3, "the r.m.s. of the orbit is the ordinate of the point")


def walks_by_keyboard(page):
    page.evaluate(f"{PLOT}.focus()")
    voice = "document.querySelector('[data-name=fig_11] .voice').textContent"
    check("arrows" in page.evaluate(voice), "a plot says how to use it by keyboard")
    for _ in range(3):
        page.key("ArrowRight")
    words = page.evaluate(voice)
    check("mesh 1" in words and "point 3 of" in words, "arrow keys walk along the curve: " + words)
    page.evaluate(f"{ORBIT}.querySelector('p').textContent = ''")
    page.key("Enter")
    page.wait_for(f"{ORBIT}.querySelector('p').textContent.startsWith('Orbit of')", "the orbit of the point by keyboard")


def cell(page, plot, i, j):
    """Where a cell of a heat map lies on the screen."""
    return page.evaluate(f"""(() => {{
        const plot = {plot}, trace = plot._fullData[0], box = plot.getBoundingClientRect();
        const x = plot._fullLayout.xaxis, y = plot._fullLayout.yaxis;
        return [box.x + x._offset + x.d2p(trace.x[{i}]), box.y + y._offset + y.d2p(trace.y[{j}])];
    }})()""")


def shows_orbits_of_cells(page, program, folder):
    model = os.path.join(folder, "maps.yaml")
    os.makedirs(folder, exist_ok=True)
    with open(model, "w") as file:
        file.write(MAPS)
    subprocess.run([program, "run", model, "--out", folder, "--quiet"], check=True, stdout=subprocess.DEVNULL, timeout=120)
    page.open(os.path.join(folder, "report.html"))
    page.wait_for("document.querySelectorAll('.js-plotly-plot .main-svg').length >= 4", "both heat maps")
    for name, words, said in [("regimes", "period 1", "Orbit of the cell at "), ("basins", "1: ", "Orbit of branch ")]:
        plot = f"document.querySelector('[data-name={name}] .js-plotly-plot')"
        orbit = f"document.querySelector('#a-{name} .orbit')"
        page.evaluate(f"{plot}.parentElement.scrollIntoView()")
        place = cell(page, plot, 1, 1)
        page.mouse("mouseMoved", [2, 2])
        page.mouse("mouseMoved", place)
        page.wait_for(f"{plot}.querySelector('.hoverlayer .hovertext')", "a hover box over a cell")
        text = page.evaluate(f"{plot}.querySelector('.hoverlayer .hovertext').textContent")
        check(words in text, f"the hover box names the attractor of a cell ({name}): {text}")
        page.click(place)
        page.wait_for(f"{orbit}.querySelectorAll('.subplot').length === 4", "the orbit of a cell")
        text = page.evaluate(f"{orbit}.querySelector('p').textContent")
        check(text.startswith(said) and "nearest" not in text, f"a click on a cell shows the orbit of its attractor ({name}): {text}")
        page.evaluate(f"{orbit}.querySelector('p').textContent = ''")
        page.evaluate(f"{plot}.focus()")
        page.key("ArrowRight")
        page.key("Enter")
        page.wait_for(f"{orbit}.querySelector('p').textContent.startsWith('Orbit of')", "the orbit of a cell by keyboard")
    page.screenshot(os.path.join(folder, "maps.png"))


def speaks(page):
    """Names for a screen reader, and a visible focus on the way through the page by Tab."""
    page.send("Accessibility.enable")
    nodes = [n for n in page.send("Accessibility.getFullAXTree")["nodes"] if not n.get("ignored")]
    roles = ("table", "columnheader", "button", "link", "checkbox", "combobox", "searchbox", "application", "toolbar", "image", "graphics-symbol")
    unnamed = [n["role"]["value"] for n in nodes if n["role"]["value"] in roles and not n.get("name", {}).get("value")]
    check(unnamed == [], "everything has a name: " + ", ".join(unnamed))
    page.send("Accessibility.disable")
    page.evaluate("document.activeElement.blur(); window.scrollTo(0, 0)")
    page.evaluate("document.querySelector('.skip').focus()")
    check(page.evaluate("document.querySelector('.skip').getBoundingClientRect().left >= 0"), "the page begins with a way past its contents")
    kinds, unseen = set(), []
    for _ in range(40):
        page.key("Tab")
        kind, width, opacity = page.evaluate(
            "(() => { const e = document.activeElement, bar = e.closest('.modebar'); const s = getComputedStyle(e); "
            "return [e.className.includes('modebar-btn') ? 'tool' : e.tagName, s.outlineStyle === 'none' ? 0 : parseFloat(s.outlineWidth), bar ? parseFloat(getComputedStyle(bar).opacity) : 1]; })()")
        kinds.add(kind)
        if kind != "BODY" and (width < 2 or opacity < 0.5):
            unseen.append(kind)
    check(unseen == [], "the focus is seen everywhere: " + ", ".join(unseen))
    check({"A", "tool", "SUMMARY", "DIV"} <= kinds, "Tab reaches links, plots and their tools: " + ", ".join(sorted(kinds)))


def filters_events(page):
    rows = "[...document.querySelectorAll('#a-fig_11 table.events tbody tr')].filter((r) => !r.hidden).length"
    every = page.evaluate(rows)
    page.evaluate("document.querySelector('#a-fig_11 .filter input[type=checkbox]').click()")
    some = page.evaluate(rows)
    check(0 < some < every, "the filter hides one kind of event")
    page.evaluate("document.querySelector('#a-fig_11 .filter input[type=checkbox]').click()")
    check(page.evaluate(rows) == every, "and shows it again")


def suits_the_dark(page, folder):
    page.send("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
    page.wait_for(f"{PLOT}.layout.paper_bgcolor !== '#ffffff'", "dark plots")
    light = page.evaluate("getComputedStyle(document.body).backgroundColor")
    check(light != "rgb(255, 255, 255)", "the page is dark where the system is")
    page.screenshot(os.path.join(folder, "dark.png"))
    page.send("Emulation.setEmulatedMedia", features=[])


def suits_a_phone(page, folder):
    page.send("Emulation.setDeviceMetricsOverride", width=390, height=844, deviceScaleFactor=2, mobile=True)
    page.open(os.path.join(folder, "report.html"))
    page.wait_for("document.querySelectorAll('.js-plotly-plot .main-svg').length >= 4", "plots on a phone")
    check(page.evaluate("document.documentElement.scrollWidth <= 390"), "nothing is wider than a phone")
    page.evaluate(f"{PLOT}.parentElement.scrollIntoView()")
    page.screenshot(os.path.join(folder, "phone.png"))
    page.send("Emulation.clearDeviceMetricsOverride")


def prints(page, folder):
    page.send("Emulation.setEmulatedMedia", media="print")
    check(page.evaluate("[...document.querySelectorAll('.plot img')].every((i) => getComputedStyle(i).display === 'block')"),
          "static figures are printed")
    check(page.evaluate("[...document.querySelectorAll('.canvas')].every((i) => getComputedStyle(i).display === 'none')"),
          "interactive ones are not")
    page.send("Emulation.setEmulatedMedia", media="")
    data = page.send("Page.printToPDF", printBackground=False, preferCSSPageSize=True)["data"]
    with open(os.path.join(folder, "printed.pdf"), "wb") as file:
        file.write(base64.b64decode(data))


def main():
    program, folder = sys.argv[1:3]
    run = [program, "run", MODEL, "--out", folder, *ARGUMENTS]
    subprocess.run(run, check=True, stdout=subprocess.DEVNULL, timeout=120)
    with Browser() as page:
        try:
            loads(page, os.path.join(folder, "report.html"))
            row = free_row(page)
            hovers(page, row)
            low, high = zooms(page)
            changes_axes(page, low, high)
            zooms_out(page)
            toggles(page)
            shows_orbit(page, row)
            walks_by_keyboard(page)
            filters_events(page)
            speaks(page)
            suits_the_dark(page, folder)
            page.evaluate(f"{PLOT}.parentElement.scrollIntoView()")
        finally:
            page.screenshot(os.path.join(folder, "screenshot.png"))
        prints(page, folder)
        suits_a_phone(page, folder)
        shows_orbits_of_cells(page, program, os.path.join(folder, "maps"))
        if page.faults:
            raise AssertionError("\n".join(page.faults))
    print("the page works; screenshot: " + os.path.join(folder, "screenshot.png"))


if __name__ == "__main__":
    main()
