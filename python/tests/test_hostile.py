"""Wrong input of every kind: exceptions that say what was wanted, never a panic."""

import datetime
import math

import numpy as np
import pytest

import gearlash as gl
from conftest import PAIR

CIRCLE: list = []
CIRCLE.append(CIRCLE)
BOMB: list = [0]
for _ in range(50):
    BOMB = [BOMB, BOMB]

VALUES = [
    math.nan,
    math.inf,
    -math.inf,
    -1.0,
    -0.0,
    5e-324,
    1.7e308,
    10**400,
    -(10**400),
    2**64,
    np.nan,
    np.array([1.0, 2.0]),
    np.zeros((2, 2, 2)),
    np.array([]),
    np.array(["a", "b"]),
    np.complex128(1j),
    1j,
    "",
    "60 zm",
    "nan",
    "1e999 m",
    "\x00",
    "\ud800",
    "x" * 100_000,
    b"60 um",
    object(),
    datetime.date(2020, 1, 1),
    {1: 2},
    {"a": CIRCLE},
    CIRCLE,
    BOMB,
    set(),
    lambda: 0,
    None,
    True,
    [],
    {},
]
SAID = (ValueError, TypeError, KeyError, AttributeError, OSError, OverflowError)


@pytest.mark.parametrize("value", VALUES, ids=lambda value: repr(type(value).__name__))
@pytest.mark.parametrize("name", ["mesh.half_gap", "bodies.A.inertia", "analyses.speed.harmonics", "bodies", "loads.A"])
def test_values_are_taken_or_refused_with_words(pair, name, value):
    try:
        changed = pair.set({name: value})
    except SAID as error:
        assert len(str(error)) > 5
    else:
        # Analyses are judged when they run.
        if not name.startswith("analyses"):
            changed.get("B.inertia")


@pytest.mark.parametrize("value", VALUES, ids=lambda value: repr(type(value).__name__))
def test_definitions_and_names_are_refused_with_words(pair, value, tmp_path):
    for use in (gl.Model, gl.load, pair.get, pair.run, pair.study, pair.numbers.__getitem__):
        with pytest.raises(SAID):
            use(value)
    for keys in ({"grid": value}, {"list": value}, {"sample": value}, {"collect": value}, {"analysis": value}):
        given = {"grid": {"mesh.half_gap": [1e-5]}, "analysis": "speed", "collect": {"n": {"reduce": "count"}}, **keys}
        if given["grid"] is None or "grid" not in keys and ("list" in keys or "sample" in keys):
            given.pop("grid")
        with pytest.raises(SAID):
            pair.study(**given).rows(0, 10**6)


def test_nan_says_where_it_is(pair):
    with pytest.raises(gl.ModelError, match="mesh.half_gap: found NaN, wanted a finite number"):
        pair.set({"mesh.half_gap": np.nan})
    with pytest.raises(gl.ModelError, match="no text"):
        gl.Model({1: 2})
    with pytest.raises(gl.ModelError, match="gearlash.load reads files"):
        gl.Model("idle.yaml")
    with pytest.raises(gl.ModelError, match="did you mean `speed`"):
        pair.run("sped")
    with pytest.raises(gl.ModelError, match="wanted a parameter_study"):
        pair.study("speed")


def test_numbers_of_runs_are_judged(pair):
    study = pair.study("grid")
    for span in ((-1, 2), (0, 7), (5, 4), (0, 2**70), (0.5, 1), ("a", 1)):
        with pytest.raises((ValueError, OverflowError, TypeError)):
            study.rows(*span)
    for options in ({"bundle": 0}, {"bundle": 1.5}, {"jobs": -1}, {"jobs": True}):
        with pytest.raises(ValueError, match="whole number"):
            study.run(**options)
    with pytest.raises(TypeError, match="dask.distributed.Client"):
        study.run(client="tcp://127.0.0.1")


def test_tables_are_judged():
    native = gl._native.Table
    for columns in (
        [("x", "", "float", b"1234567")],
        [("x", "", "complex", b"")],
        [("x", "", "float", b""), ("y", "", "float", b"12345678")],
        [("x", "", "text", [1, 2])],
        [("x", "")],
    ):
        with pytest.raises((ValueError, TypeError)):
            native.of("t", columns)
    empty = gl.Table(native.of("t", []))
    assert empty.num_rows == 0 and empty.to_numpy().shape == (0, 0)


def test_thousands_of_mutated_texts_end_in_words():
    import random

    random.seed(5)
    for _ in range(3000):
        text = list(PAIR)
        for _ in range(random.randint(1, 6)):
            text[random.randrange(len(text))] = random.choice("{}[]:,-#&*!|>'\"%@` \n\t0e9aé\x00")
        try:
            gl.Model("".join(text)).numbers
        except SAID as error:
            assert str(error)
