"""Laws in Python, against the built-in ones."""

import numpy as np
import pytest

import gearlash as gl


@gl.law("play")
def play(q, v, k, gap):
    return k * (np.maximum(q - gap, 0) + np.minimum(q + gap, 0))


@gl.law("play_with_slope", derivative=lambda q, v, k, gap: (np.where(np.abs(q) > gap, k, 0.0), 0.0))
def play_with_slope(q, v, k, gap):
    return play(q, v, k, gap)


def using(model, function, **more):
    entry = {"type": "python", "function": function, "parameters": {"k": 2e8, "gap": 4e-5}, "breakpoints": [-4e-5, 4e-5]}
    return model.set({"connections.mesh.element": {**entry, **more}})


@pytest.mark.parametrize("function, accuracy", [("play", 1e-6), ("play_with_slope", 1e-9)])
def test_a_gap_in_python_is_the_gap(pair, function, accuracy):
    expected = pair.run("speed").main
    found = using(pair, function).run("speed").main
    assert abs(found["rms.mesh"].max() / expected["rms.mesh"].max() - 1) < accuracy
    low = lambda table: table["omega"].min()
    assert abs(low(found) / low(expected) - 1) < accuracy


def test_what_a_law_raises_comes_out(pair):
    @gl.law
    def broken(q, v, k, gap):
        raise ZeroDivisionError("as planned")

    @gl.law("shape")
    def shape(q, v, k, gap):
        return np.zeros(len(q) + 1)

    @gl.law("nan")
    def nan(q, v, k, gap):
        return q * np.nan

    for name, error, words in (
        ("broken", ZeroDivisionError, "as planned"),
        ("shape", ValueError, "wanted"),
        ("nan", ValueError, "returned nan at q"),
    ):
        with pytest.raises(error, match=words):
            using(pair, name).run("speed")
    assert pair.run("speed").main.num_rows >= 3


def test_wrong_names_are_refused(pair):
    with pytest.raises(gl.ModelError, match="did you mean `play`"):
        using(pair, "plai")
    with pytest.raises(gl.ModelError, match="ascending"):
        using(pair, "play", breakpoints=[1e-5, -1e-5])
