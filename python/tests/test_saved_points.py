"""Points of a run are read, and followed, by a program that shares nothing with gearlash."""

import csv
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("scipy")
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "examples"))
import continue_orbit as own  # noqa: E402
import numpy as np  # noqa: E402

LOAD = "reduced.loads.harmonics.0.cos.0"
MODEL = f"""
schema: 1
name: pair
reduced:
  stiffness: [[2, 1], [1, 2]]
  damping: {{modal_ratio: 0.05}}
  elements: {{mesh_1: {{type: backlash, half_gap: 1.0}}, mesh_2: {{type: backlash, half_gap: 0.1}}}}
  loads: {{mean: [0.5, 0.5], harmonics: [{{order: 1, cos: [0.25, 0], sin: [0, 0]}}]}}
analyses:
  doubling:
    type: bifurcation_curve
    parameters: [frequency, {LOAD}]
    ranges: [[1.85, 2.0], [0.2, 0.3]]
    start: {{kind: period_doubling, at: {{frequency: 1.9201, {LOAD}: 0.25}}}}
    marks: [0.25]
    confirm: none
  branch: {{type: frequency_response, method: shooting, from: 1.93, to: 1.91, stability: true}}
"""


@pytest.fixture(scope="module")
def folder(program, tmp_path_factory):
    folder = tmp_path_factory.mktemp("saved")
    (folder / "pair.yaml").write_text(MODEL)
    command = [program, "run", folder / "pair.yaml", "--out", folder / "out", "--quiet"]
    assert subprocess.run(command, capture_output=True).returncode == 0
    return folder / "out"


def system(load):
    # zeta = 0.05 of the modes (1, -1) and (1, 1) with frequencies 1 and 3^(1/2).
    damping = 0.05 * (np.array([[1.0, -1.0], [-1.0, 1.0]]) + 3**0.5 * np.ones((2, 2)))
    ones = np.array([0.5, 0.5])
    stiffness = np.array([[2.0, 1.0], [1.0, 2.0]])
    return own.System(stiffness, damping, np.array([1.0, 0.1]), ones, np.array([load, 0.0]))


def test_points_of_a_doubling_are_doublings(folder):
    points = own.saved_points(folder, "doubling")
    assert len(points) > 5
    for (omega, load), u in points[::4]:
        image, _ = system(load).image_and_derivative(u, omega)
        assert abs(image - u).max() < 1e-7
        assert min(abs(own.multipliers(system(load), u, omega) + 1)) < 1e-4


def test_a_branch_goes_on_from_a_point(folder):
    """Five steps along the branch through the doubling at Q_a1 = 0.25: the orbits are those of gearlash's own branch."""
    points = own.saved_points(folder, "doubling")
    (omega, load), u = min(points, key=lambda p: abs(p[0][1] - 0.25))
    assert load == 0.25
    path = own.follow(system(load), u, omega, 5)
    assert len({round(w, 9) for w, _ in path}) == 5
    for w, u in path:
        image, _ = system(load).image_and_derivative(u, w)
        assert abs(image - u).max() < 1e-7
    with open(folder / "branch.csv") as file:
        rows = list(csv.DictReader(file))
    frequency = np.array([float(r["omega"]) for r in rows])
    order = np.argsort(frequency)
    assert frequency.min() < min(w for w, _ in path) and frequency.max() > max(w for w, _ in path)
    # r.m.s. of the first deformation without its mean, from the orbit itself and from the branch.
    rms = np.array([float(r["rms.mesh_1"]) for r in rows])
    for w, u in path:
        wanted = np.interp(w, frequency[order], rms[order])
        q = system(load).orbit(u, w, 400)[0]
        assert abs(q.std() - wanted) < 1e-4
