"""Every type of analysis: results as tables, the program's values to the bit, a figure."""

import subprocess

import numpy as np
import polars
import pytest

import gearlash as gl
from test_result import _compare

matplotlib = pytest.importorskip("matplotlib")
matplotlib.use("agg")

TRAIN = """
name: gearbox
bodies:
  engine: {inertia: 0.1}
  input: {inertia: 4.0e-3, drag: 0.5 N m}
  idler: {inertia: 1.0e-3, drag: 0.2 N m}
connections:
  clutch:
    shaft: [engine, input]
    stiffness: 1000
    length: 0.05
    damping: 0.1
    element: {type: clutch, stages: [{to: 8 deg, stiffness: 30, hysteresis: 1, hysteresis_stiffness: 500}, {stiffness: 1000, hysteresis: 15, hysteresis_stiffness: 4000}]}
  mesh: {gear: {teeth: {input: 23, idler: 41}, module: 2 mm}, stiffness: 2.0e6, damping: 80, length: 50 um, element: {type: backlash, half_gap: 50 um}}
reference: {body: engine, speed: 900 rpm}
balance: engine
loads: {engine: {harmonics: [{order: 2, amplitude: 60}]}}
analyses:
  point: {type: operating_point, at: 900 rpm, settle: 20, periods: 10, extend: 1}
  ramp: {type: run_up, from: 800 rpm, to: 900 rpm, duration: 2 s, window: 4, orders: [2, 4]}
  history: {type: time_history, at: 900 rpm, duration: 0.2 s, samples_per_period: 40}
"""

PAIR = """
name: figure 11, smaller
reduced:
  stiffness: [[2, 1], [1, 2]]
  damping: {modal_ratio: 0.05}
  elements: {m1: {type: backlash, half_gap: 1.0}, m2: {type: backlash, half_gap: 0.1}}
  loads: {mean: [0.5, 0.5], harmonics: [{order: 1, cos: [0.25, 0]}]}
analyses:
  cells: {type: basins, at: 0.65, transient: 20, periods: 20, limit: 200, grid: {q.m1: {from: -2, to: 2, points: 5}, v.m1: {from: -1, to: 1, points: 4}}}
  regimes:
    type: regime_map
    parameters: {frequency: {from: 0.6, to: 1.2, points: 4}, damping.modal_ratio: {from: 0.03, to: 0.08, points: 3}}
    transient: 30
    periods: 30
    measures: [impacts]
    refine: 0
  curve:
    type: bifurcation_curve
    parameters: [frequency, reduced.loads.harmonics.0.cos.0]
    ranges: [[1.9, 2.1], [0.1, 0.4]]
    start: {kind: grazing, connection: m1, at: {frequency: 1.9837, reduced.loads.harmonics.0.cos.0: 0.25}}
"""

TORUS = """
reduced:
  stiffness: [[1.4180125, 0.4180125], [0.4180125, 1.4180125]]
  damping: {matrix: [[0.0671175, 0.0101175], [0.0101175, 0.0671175]]}
  elements: {m1: {type: backlash, half_gap: 1.0}, m2: {type: backlash, half_gap: 1.0}}
  loads: {mean: [0.5, 0.5], harmonics: [{order: 1, cos: [0.2, 0]}]}
analyses:
  ring: {type: torus, at: 1.2, parameter: reduced.loads.harmonics.0.cos.0, start: {attractor: {value: 0.1795}}, from: 0.1795, to: 0.18}
"""

RUNS = [(TRAIN, name) for name in ("point", "ramp", "history")] + [(PAIR, name) for name in ("cells", "regimes", "curve")]
RUNS.append((TORUS, "ring"))


@pytest.fixture(scope="module")
def results():
    return {}


@pytest.mark.parametrize("model, name", RUNS, ids=[name for _, name in RUNS])
def test_values_tables_and_figure(tmp_path, program, model, name, results):
    result = gl.Model(model).run(name)
    results[name] = result
    assert result.main.num_rows > 0 and result.interrupted is False
    (tmp_path / "m.yaml").write_text(model)
    command = [program, "run", tmp_path / "m.yaml", "--only", name, "--out", tmp_path / "out", "--quiet"]
    assert subprocess.run(command, capture_output=True).returncode == (0 if result.ended_early is None else 1)
    assert len(result.tables) == len(list((tmp_path / "out").glob("*.csv")))
    for table, values in result.tables.items():
        file = f"{name}.csv" if table == "main" else f"{name}.{table}.csv"
        _compare(values, tmp_path / "out" / file)
        assert polars.DataFrame(values).shape == (values.num_rows, len(values.columns))
    if result._parts["figure"] is not None:
        figure = result.plot()
        figure.savefig(tmp_path / "figure.pdf")
        assert all(axis.get_ylabel() or axis.get_xlabel() for axis in figure.axes)
        matplotlib.pyplot.close(figure)


def test_what_the_tables_say(results):
    if len(results) < len(RUNS):
        pytest.skip("needs the results of the tests above")
    point = results["point"].main
    assert point.num_rows == 1 and point["impacts.mesh"][0] >= 0 and point["energy_lost.clutch"][0] > 0
    orders = results["ramp"].tables["orders"]
    assert set(orders["order"]) == {2.0, 4.0} and orders.units["amplitude.q.mesh"] == "m"
    assert np.all(np.diff(results["ramp"].main["speed_rpm"]) > 0)
    cells = results["cells"]
    shares = cells.tables["attractors"]["share"]
    assert cells.main.num_rows == 20 and abs(shares.sum() - 1) < 1e-12
    grid = results["regimes"].main.to_xarray(dims=["damping.modal_ratio", "frequency", "seed"])
    assert grid["impacts.m1"].shape[:2] == (3, 4)
    assert set(results["curve"].main["kind"]) == {"grazing"}
    ring = results["ring"].main
    assert np.all((ring["rotation"] > 0) & (ring["rotation"] < 1)) and np.all(ring["invariance_error"] < 1e-3)


def test_laws_with_memory_are_varied(results):
    model = gl.Model(TRAIN)
    name = "clutch.element.stages.0.hysteresis"
    assert model.get(name) == 1.0 and model.numbers[name].unit == "N m"
    losses = [model.set({name: value}).run("point").main["energy_lost.clutch"][0] for value in (0.0, 1.0)]
    # Without hysteresis nothing but rounding is lost.
    assert abs(losses[0]) < 1e-12 * losses[1]
