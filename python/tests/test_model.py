"""Models: from files, texts and dicts; numbers by name."""

import copy
import pickle

import numpy as np
import pytest

import gearlash as gl
from conftest import MODELS, PAIR


def test_file_text_and_dict_give_the_same_model(tmp_path, pair):
    path = tmp_path / "pair.yaml"
    path.write_text(PAIR)
    loaded = gl.load(path)
    assert loaded == pair == gl.Model(pair.to_dict())
    assert loaded.name == "pair" and loaded.analyses == ["modes", "speed", "grid"]
    for other in (pickle.loads(pickle.dumps(pair)), copy.deepcopy(pair)):
        assert other == pair
    nameless = gl.load(_written(tmp_path / "nameless.yaml", PAIR.replace("name: pair", "")))
    assert nameless.name == pickle.loads(pickle.dumps(nameless)).name == "nameless"


def _written(path, text):
    path.write_text(text)
    return path


def test_numbers_are_read_and_changed_by_name(pair):
    assert pair.get("mesh.half_gap") == 40e-6
    wider = pair.set({"mesh.half_gap": "60 um", "A.mean": 0.1 + 0.2})
    assert wider.get("mesh.half_gap") == 60e-6 and pair.get("mesh.half_gap") == 40e-6
    assert wider.get("A.mean") == 0.1 + 0.2
    number = pair.numbers["mesh.half_gap"]
    assert (number.name, number.unit, number.range) == ("connections.mesh.element.half_gap", "m", ">= 0")
    assert number.is_written and not pair.numbers["mesh.impact_damping"].is_written
    assert "mesh.half_gap" in pair.numbers and "mesh.half_gab" not in pair.numbers and 3 not in pair.numbers
    frame = pair.numbers.to_pandas()
    assert frame.set_index("name").loc["connections.mesh.element.half_gap", "value"] == 40e-6
    assert "half_gap" in repr(pair.numbers) and "<table>" in pair.numbers._repr_html_()


def test_every_bit_of_a_number_survives(pair):
    random = np.random.default_rng(1)
    for value in random.uniform(1e-7, 1e-3, 200):
        changed = pair.set({"mesh.half_gap": value})
        again = pickle.loads(pickle.dumps(changed))
        assert changed.get("mesh.half_gap") == again.get("mesh.half_gap") == value


def test_values_of_numpy_and_pandas_are_values(pair):
    import pandas

    for value in (np.float64(5e-5), np.float32(0.5), np.int64(1), np.array(5e-5), pandas.Series([5e-5]).iloc[0]):
        assert pair.set({"mesh.half_gap": value}).get("mesh.half_gap") == float(value)
    tree = pair.to_dict()
    tree["analyses"]["grid"]["grid"] = {"mesh.half_gap": np.linspace(1e-5, 5e-5, 3)}
    assert gl.Model(tree).study("grid").runs == 3


def test_files_of_loads_are_found_from_elsewhere(tmp_path):
    folder = tmp_path / "models"
    folder.mkdir()
    angles = np.arange(72) * 5
    lines = [f"{float(100 * np.sin(np.radians(2 * a)))!r}" for a in angles]
    (folder / "torque.csv").write_text("torque\n" + "\n".join(lines) + "\n")
    text = PAIR.replace("harmonics: [{order: 1, amplitude: 30, phase: 10 deg}]", "cycle: {file: torque.csv, column: torque}")
    (folder / "m.yaml").write_text(text)
    model = gl.load(folder / "m.yaml")
    again = pickle.loads(pickle.dumps(model))
    assert again.run("speed").main == model.run("speed").main
    study = model.study(grid={"mesh.half_gap": [1e-5]}, analysis="speed", collect={"n": {"reduce": "count"}})
    assert study.run().main["n"][0] > 0


def test_check_gives_what_the_program_gives(program):
    import json
    import subprocess

    for path in sorted(MODELS.glob("*.yaml")):
        text = subprocess.run([program, "check", "--json", path], capture_output=True, text=True, check=True).stdout
        expected = json.loads(text)
        check = gl.load(path).check()
        for key in ("natural_frequencies", "stiffness", "damping", "omega_c", "static_displacement", "connections"):
            assert check[key] == expected[key], (path.name, key)
    assert "sound" in repr(check)


def test_analyses_need_not_be_in_the_model(pair):
    modes = pair.analyse(type="modes", title="lines")
    assert modes.kind == "modes" and modes.title == "lines" and modes.main.num_rows > 1
    assert pair.analyses == ["modes", "speed", "grid"]
    tree = pair.to_dict()
    del tree["analyses"]
    bare = gl.Model(tree)
    study = bare.study(grid={"mesh.half_gap": [1e-5, 2e-5]}, analysis={"type": "modes"}, collect={"n": {"reduce": "count"}})
    assert study.run().main.num_rows == 2
    with pytest.raises(gl.ModelError, match="no analysis type is called `mode`"):
        pair.analyse(type="mode")


def test_models_do_not_change(pair):
    with pytest.raises(AttributeError, match="returns another one"):
        pair.name = "other"
    assert repr(pair) == "<gearlash.Model 'pair': 2 bodies, 1 connections, 3 analyses>"
    assert "half_gap" in pair._repr_html_()
    with pytest.raises(TypeError):
        hash(pair)


def test_mistakes_have_file_line_column_and_path(tmp_path):
    path = _written(tmp_path / "m.yaml", PAIR.replace("half_gap", "half_gab"))
    with pytest.raises(gl.ModelError) as caught:
        gl.load(path)
    error = caught.value
    assert error.file == str(path) and error.line == 7 and error.column == PAIR.splitlines()[6].index("half_gap") + 1
    assert error.path.startswith("connections.mesh.element") and "half_gap" in str(error)
    assert error.diagnostics[0].help == "did you mean `half_gap`?"
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) and again.diagnostics == error.diagnostics
    assert isinstance(error, ValueError) and isinstance(error, gl.GearlashError)
    with pytest.raises(FileNotFoundError) as missing:
        gl.load(tmp_path / "none.yaml")
    assert missing.value.filename.endswith("none.yaml")


def test_warnings_are_python_warnings():
    unbalanced = PAIR.replace("B: {mean: 120}", "B: {mean: 10}")
    with pytest.warns(gl.GearlashWarning):
        model = gl.Model(unbalanced)
        model.run("modes")
