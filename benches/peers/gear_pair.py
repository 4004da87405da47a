"""The gear pair of P13 as numbers, read from the model file, in the deformation of its mesh.

    r'' = T_1 R_1 / I_1 + T_2 R_2 / I_2 - (R_1^2 / I_1 + R_2^2 / I_2) N,   N = k s(phase) p(r - e) + c (r' - e')

Solved in x = r / b over the phase w t, so that every number is of the order of 1; b is half the gap, w the mesh frequency.
"""

import math
from dataclasses import dataclass

ORDERS = (1, 2)


@dataclass(frozen=True)
class Pair:
    """x'' = force - stiffness s(phase) p(x - e(phase)) - damping (x' - e'(phase)), half gap 1."""

    force: float
    stiffness: float
    damping: float
    variation: tuple  # (amplitude, phase) of the orders 1 and 2
    error: tuple  # the same, over b
    length: float  # b [m]
    frequency: float  # w [rad/s]

    @property
    def period(self):
        """One excitation period in the time of the equation."""
        return 2.0 * math.pi

    @property
    def rest(self):
        """Initial state: undeformed, at rest."""
        return (0.0, 0.0)

    def in_si(self, states):
        """(r, r') in m and m/s."""
        return [[self.length * x, self.length * self.frequency * v] for x, v in states]

    def numbers(self):
        """All numbers one by one, for right-hand sides written out in floats."""
        (a1, p1), (a2, p2) = self.variation
        (e1, q1), (e2, q2) = self.error
        return self.force, self.stiffness, self.damping, a1, p1, a2, p2, e1, q1, e2, q2


def read(path, model):
    """The pair in a model file; raises `ValueError` if it says more than this module understands."""
    ((_, mesh),) = model["connections"].items()
    bodies = {name: body["inertia"] for name, body in model["bodies"].items()}
    if set(mesh["gear"]) != set(bodies) or set(mesh["element"]) != {"type", "half_gap"}:
        raise ValueError(f"{path}: only one pair with a backlash is known here")
    (analysis,) = model["analyses"].values()
    value, unit = analysis["at"].split()
    if unit != "Hz":
        raise ValueError(f"{path}: the frequency must be in Hz")
    length, frequency = float(mesh["element"]["half_gap"]), 2.0 * math.pi * float(value)
    mobility = sum(radius**2 / bodies[name] for name, radius in mesh["gear"].items())
    drive = sum(mesh["gear"][name] * load["mean"] / bodies[name] for name, load in model["loads"].items())
    return Pair(
        force=drive / (length * frequency**2),
        stiffness=mobility * float(mesh["stiffness"]) / frequency**2,
        damping=mobility * float(mesh["damping"]) / frequency,
        variation=harmonics(path, mesh["stiffness_variation"], 1.0),
        error=harmonics(path, mesh["transmission_error"], length),
        length=length,
        frequency=frequency,
    )


def harmonics(path, entry, unit):
    """Amplitudes over a unit and phases of the orders 1 and 2."""
    found = {h["order"]: (float(h["amplitude"]) / unit, float(h.get("phase", 0.0))) for h in entry["harmonics"]}
    if set(found) != set(ORDERS):
        raise ValueError(f"{path}: harmonics of the orders {ORDERS} are expected")
    return tuple(found[order] for order in ORDERS)
