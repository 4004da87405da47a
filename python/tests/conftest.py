"""What the tests share: a small model, and the program to compare with."""

import os
import shutil
import warnings
from pathlib import Path

import pytest

import gearlash as gl

ROOT = Path(__file__).resolve().parents[2]
MODELS = ROOT / "models"

PAIR = """
name: pair
bodies:
  A: {inertia: 1e-3}
  B: {inertia: 2e-3}
connections:
  mesh: {gear: {A: 50 mm, B: 60 mm}, stiffness: 2e8, element: {type: backlash, half_gap: 40 um}}
damping: {stiffness_proportional: 1e-6}
loads:
  A: {mean: 100, harmonics: [{order: 1, amplitude: 30, phase: 10 deg}]}
  B: {mean: 120}
analyses:
  modes: {type: modes}
  speed: {type: frequency_response, from: 3000 Hz, to: 2800 Hz, harmonics: 5}
  grid:
    type: parameter_study
    grid: {mesh.half_gap: [20 um, 40 um], A.mean: [80, 90, 100]}
    analysis: speed
    collect: {largest: {column: rms.mesh, reduce: max}, rows: {reduce: count}}
"""

@pytest.fixture
def pair() -> gl.Model:
    return gl.Model(PAIR)


@pytest.fixture(scope="session")
def program() -> str:
    """The program `gearlash` of the same sources."""
    given = os.environ.get("GEARLASH_PROGRAM") or shutil.which("gearlash")
    built = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    for path in filter(None, (given, built / "debug/gearlash", built / "release/gearlash")):
        if Path(path).exists():
            return str(path)
    pytest.skip("no program to compare with: cargo build, or set GEARLASH_PROGRAM")


@pytest.fixture(autouse=True)
def quiet():
    """Warnings of models are tested where they matter."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gl.GearlashWarning)
        yield
