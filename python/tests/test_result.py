"""Results: the program's values to the bit, as tables of every kind."""

import csv
import pickle
import subprocess
import sys
import textwrap
import warnings

import numpy as np
import pandas
import polars
import pyarrow
import pytest
import xarray

import gearlash as gl
from conftest import MODELS, PAIR


@pytest.fixture(scope="module")
def speed():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return gl.Model(PAIR).run("speed")


@pytest.mark.parametrize("model, analysis", [("reverse_idler", "fig_11"), ("neutral_rattle", None), ("bilinear_stop", None)])
def test_values_are_those_of_the_program_to_the_bit(tmp_path, program, model, analysis):
    path = MODELS / f"{model}.yaml"
    loaded = gl.load(path)
    analysis = analysis or loaded.analyses[0]
    subprocess.run([program, "run", path, "--only", analysis, "--out", tmp_path, "--quiet"], check=True, capture_output=True)
    result = loaded.run(analysis)
    assert len(result.tables) == len(list(tmp_path.glob("*.csv"))) > 0
    for name, table in result.tables.items():
        file = tmp_path / (f"{analysis}.csv" if name == "main" else f"{analysis}.{name}.csv")
        _compare(table, file)


def _compare(table, file):
    with open(file, newline="") as text:
        lines = [line for line in csv.reader(text) if not line[0].startswith("#")]
    header, rows = lines[0], lines[1:]
    assert len(rows) == table.num_rows and len(header) == len(table)
    for place, column in enumerate(table):
        written = [row[place] for row in rows]
        values = table[column]
        if values.dtype == np.float64:
            expected = np.array([float(cell) if cell else np.nan for cell in written])
            assert np.array_equal(expected, values, equal_nan=True), (file.name, column)
        else:
            assert [str(value) for value in values] == written, (file.name, column)


def test_columns_reach_numpy_and_arrow_without_a_copy(speed):
    table = speed.main
    column = next(name for name in table if table[name].dtype == np.float64 and not np.isnan(table[name]).any())
    address = table[column].__array_interface__["data"][0]
    assert table[column].__array_interface__["data"][0] == address
    arrow = pyarrow.table(table)
    assert arrow[column].chunk(0).buffers()[1].address == address
    series = polars.DataFrame(table)[column]
    assert series.to_arrow().buffers()[1].address == address
    batch = pyarrow.record_batch(table)
    assert batch[column].buffers()[1].address == address
    with pytest.raises(ValueError):
        table[column][0] = 1.0


def test_memory_outlives_the_result(speed):
    column = gl.Model(PAIR).run("speed").main["rms.mesh"]
    arrow = pyarrow.table(gl.Model(PAIR).run("speed").main)
    assert np.array_equal(column, speed.main["rms.mesh"])
    assert arrow["rms.mesh"].to_numpy().sum() == column.sum()


def test_tables_become_frames(speed):
    table = speed.main
    pandas_frame, polars_frame = table.to_pandas(), table.to_polars()
    assert isinstance(pandas_frame, pandas.DataFrame) and isinstance(polars_frame, polars.DataFrame)
    for column in table:
        values = table[column]
        if values.dtype == object:
            assert list(polars_frame[column]) == list(values)
            continue
        assert np.array_equal(pandas_frame[column].to_numpy(), values, equal_nan=True)
        assert np.array_equal(polars_frame[column].to_numpy(), values.astype(float), equal_nan=True)
    assert pandas_frame.attrs["units"]["rms.mesh"] == table.units["rms.mesh"]
    named = table.to_pandas(attributes=True)
    assert np.array_equal(named.rms_mesh, table["rms.mesh"])
    assert table.to_polars(attributes=True).columns == list(named.columns)
    field = table.to_arrow().schema.field("frequency_hz" if "frequency_hz" in table else table.columns[2])
    assert field.metadata[b"unit"] is not None
    assert table.to_numpy().shape[0] == table.num_rows


def test_empty_cells_are_null_in_arrow_and_nan_in_numpy():
    table = gl.Table(gl._native.Table.of("t", [("x", "m", "float", np.array([1.0, np.nan]).tobytes())]))
    assert pyarrow.table(table)["x"].to_pylist() == [1.0, None]
    assert np.isnan(table["x"][1]) and polars.DataFrame(table)["x"].null_count() == 1


def test_netcdf_and_xarray(tmp_path, speed):
    data = speed.to_xarray()
    assert data["rms.mesh"].dims == ("row",)
    path = tmp_path / "speed.nc"
    speed.to_netcdf(path)
    with xarray.open_dataset(path) as again:
        assert np.array_equal(again["rms.mesh"].values, speed.main["rms.mesh"])
        assert again.attrs["type"] == "frequency_response"
    if speed.events is not None:
        with xarray.open_dataset(path, group="events") as events:
            assert events.sizes["events_row"] == speed.events.num_rows


def test_studies_become_grids(pair):
    result = pair.run("grid")
    table = result.main
    dims = table.columns[1:3]
    data = table.to_xarray(dims)
    assert dict(data.sizes) == {dims[0]: 2, dims[1]: 3}
    largest = data["largest"].values
    assert np.array_equal(largest.reshape(-1), table["largest"])
    with pytest.raises(ValueError, match="no grid"):
        table.to_xarray(dims[:1])


def test_results_say_what_they_are(speed):
    assert speed.kind == "frequency_response" and speed.name == "speed"
    assert "rms.mesh" in repr(speed) and "<table>" in speed._repr_html_()
    assert "<table>" in speed.main._repr_html_() and "rows" in repr(speed.main)
    assert speed.summary["options"]["harmonics"] == 5
    with pytest.raises(KeyError, match="did you mean `rms.mesh`"):
        speed.main["rms.mash"]
    with pytest.raises(KeyError, match="the result has main"):
        speed.tables["maim"]
    again = pickle.loads(pickle.dumps(speed))
    assert all(again.tables[name] == table for name, table in speed.tables.items())
    assert again.summary == speed.summary


def test_rows_are_selected(speed):
    table = speed.main
    branch = table.rows(branch=0)
    assert branch.num_rows == int((table["branch"] == 0).sum()) and branch.units == table.units


@pytest.mark.parametrize("model, analysis", [("reverse_idler", "fig_11"), ("reverse_idler", "fig_02"), ("tolerance_study", None)])
def test_figures_are_drawn(model, analysis):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    loaded = gl.load(MODELS / f"{model}.yaml")
    name = analysis or next(a for a in loaded.analyses if loaded.to_dict()["analyses"][a]["type"] != "parameter_study")
    result = loaded.run(name)
    figure = result.plot()
    assert figure.axes[0].lines and figure.axes[0].get_xlabel() and result.title in figure.axes[0].get_title()
    if name == "fig_11":
        said = {text.get_text() for text in figure.legends[0].get_texts()}
        assert {"stable", "unstable"} <= said
        assert figure.axes[0].get_xlim() == (0.4, 2.5)
        assert len(result.plot(backend="plotly").data) > 10
    axes = [plt.subplots()[1] for _ in figure.axes]
    result.plot(ax=axes if len(axes) > 1 else axes[0])
    with pytest.raises(ValueError, match="must be 'matplotlib' or 'plotly'"):
        result.plot(backend="gnuplot")
    plt.close("all")


def _map(values, kind, written, shown):
    """A result with a map of cells over a frequency."""
    places = [(x, y) for x in (10.0, 20.0) for y in (1.0, 2.0, 3.0)][: len(values)]
    x, y = (np.array(column).tobytes() for column in zip(*places))
    data = values if kind == "text" else np.array(values).tobytes()
    table = gl._native.Table.of("", [("x", "Hz", "float", x), ("y", "", "float", y), ("v", "", kind, data)])
    style = {"Cells": {"value": "v", "names": [["b", "bees"]]}}
    curve = {"table": "", "x": "x", "y": "y", "label": "map", "style": style, "only": None}
    axis = {"written": written, "shown": shown, "omega_c": 100.0}
    panel = {"x_label": "speed", "y_label": "y", "x_range": None, "x_frequency": axis, "curves": [curve]}
    text = dict(name="m", kind="regime_map", title="t", caption="", assumed=[], warnings=[], ended_early=None, summary={})
    return gl.Result({**text, "figure": {"title": "t", "panels": [panel]}, "tables": [table]})


def test_maps_are_drawn_in_the_unit_of_their_axis():
    from gearlash import _plot

    kinds = _map(["a", "b", "a", "undecided", "b"], "text", "Hertz", "RevolutionsPerMinute")
    figure = kinds.plot()
    assert {text.get_text() for text in figure.legends[0].get_texts()} == {"a", "bees", "undecided"}
    (cells,) = _plot._resolve(kinds._parts["figure"]["panels"][0] | {"curves": _plot._colored(kinds._parts["figure"])[0]["curves"]}, kinds)
    assert np.allclose(cells["x"], [600, 1200])
    # The last place has no row: it takes the value of the one below.
    assert cells["z"].tolist() == [[1, 2], [0, 0], [1, 0]]
    numbers = _map([1.0, 2.0, np.nan, 4.0, 5.0, 6.0], "float", "Nondimensional", "RadianPerSecond")
    assert len(numbers.plot().axes) == 2
    assert numbers.plot(backend="plotly").data[0].x[1] == 2000.0 and kinds.plot(backend="plotly").data


def test_ctrl_c_ends_a_run_with_what_it_has(tmp_path):
    script = textwrap.dedent(
        f"""
        import os, signal, threading, time, warnings
        import gearlash as gl
        warnings.simplefilter("ignore")
        m = gl.Model({PAIR!r}).set({{"analyses.speed": {{"type": "frequency_response", "from": "9000 Hz", "to": "1 Hz",
            "harmonics": 40, "max_step": 1e-6, "max_points": 1000000}}}})
        threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT)).start()
        begun = time.monotonic()
        r = m.run("speed")
        assert r.interrupted and "interrupted" in r.ended_early, r.ended_early
        assert r.main.num_rows > 0 and time.monotonic() - begun < 5
        print("rows", r.main.num_rows)
        """
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60)
    assert done.stdout.startswith("rows"), done.stdout + done.stderr
