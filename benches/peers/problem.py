"""The benchmark problems as arrays, read from the model files in `benches/problems`.

    q'' + Gam q' + kappa f(q) = Q_m + Q_a cos(Om T),   f_i(q) = q_i + (|q_i - b_i| - |q_i + b_i|) / 2

The other programs solve the model files of `gearlash`: there is no second copy that could diverge.
"""

import argparse
import json
import math
from dataclasses import dataclass

import numpy as np
import yaml

import gear_pair


@dataclass(frozen=True)
class Problem:
    """One nondimensional system and the settings of its analysis."""

    stiffness: np.ndarray  # kappa, n x n
    damping: np.ndarray  # Gam, n x n
    half_gap: np.ndarray  # b, n
    mean: np.ndarray  # Q_m, n
    amplitude: np.ndarray  # Q_a, n
    analysis: dict  # the file's only analysis, as written

    @property
    def dof(self):
        """Number of coordinates."""
        return len(self.half_gap)

    @property
    def period(self):
        """One excitation period in the time of the equation."""
        return 2.0 * math.pi / self.analysis["at"]

    @property
    def rest(self):
        """Initial state."""
        return (0.0,) * (2 * self.dof)

    def in_si(self, states):
        """The states unchanged: everything is nondimensional."""
        return [list(state) for state in states]


def load(path):
    """The problem in the file `path`, a `Problem` or a `gear_pair.Pair`; raises `ValueError` if it says more than is known here."""
    with open(path, encoding="utf-8") as file:
        model = yaml.safe_load(file)
    if "bodies" in model:
        return gear_pair.read(path, model)
    reduced = model["reduced"]
    stiffness = np.array(reduced["stiffness"], dtype=float)
    elements = list(reduced["elements"].values())
    if any(e["type"] != "backlash" or e.get("impact_damping", 0) != 0 for e in elements):
        raise ValueError(f"{path}: only backlash without impact damping is known here")
    mean, amplitude = _loads(path, reduced["loads"])
    (analysis,) = model["analyses"].values()
    return Problem(
        stiffness=stiffness,
        damping=_damping(path, reduced["damping"], stiffness),
        half_gap=np.array([e["half_gap"] for e in elements], dtype=float),
        mean=mean,
        amplitude=amplitude,
        analysis=analysis,
    )


def _damping(path, entry, stiffness):
    """Gam as written, or 2 zeta kappa^(1/2) for a modal ratio (kappa symmetric)."""
    if "matrix" in entry:
        return np.array(entry["matrix"], dtype=float)
    if set(entry) != {"modal_ratio"} or not np.array_equal(stiffness, stiffness.T):
        raise ValueError(f"{path}: damping must be a matrix, or a modal ratio with symmetric stiffness")
    squares, modes = np.linalg.eigh(stiffness)
    return modes @ np.diag(2.0 * entry["modal_ratio"] * np.sqrt(squares)) @ modes.T


def _loads(path, entry):
    """Q_m and Q_a; the alternating load is one cosine."""
    (harmonic,) = entry["harmonics"]
    if harmonic["order"] != 1 or any(harmonic["sin"]):
        raise ValueError(f"{path}: the alternating load must be a cosine of order 1")
    return np.array(entry["mean"], dtype=float), np.array(harmonic["cos"], dtype=float)


def scalars(system):
    """The numbers of a system of two coordinates one by one, for right-hand sides written out in floats.

    (k11, k12, k21, k22), (g11, g12, g21, g22), (b1, b2), (m1, m2), (a1, a2), omega
    """
    if system.dof != 2:
        raise ValueError(f"the right-hand sides of P3 are written for 2 coordinates, not {system.dof}")
    arrays = (system.stiffness, system.damping, system.half_gap, system.mean, system.amplitude)
    return (*(tuple(a.ravel().tolist()) for a in arrays), float(system.analysis["at"]))


def parser(text):
    """Command line of a program's script: the model, and where its result goes; `text` describes the script."""
    made = argparse.ArgumentParser(description=text.splitlines()[0])
    made.add_argument("model")
    made.add_argument("out")
    return made


def write(path, result):
    """Writes what a script has measured as JSON."""
    with open(path, "w", encoding="utf-8") as file:
        json.dump(result, file)
