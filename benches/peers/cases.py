"""The compared problems, the programs per problem, and the expected answers.

Half peak-to-peak maxima and the state after ten periods are the reference values of the problems. Points of a branch
lie some 0.003 apart near the maxima of P1, where contact is lost and the curves have kinks: its tolerances say how well
a parabola finds the maximum there. P3 is chaotic: an integrator's error a step grows some tenfold in ten periods.
"""

import math
from dataclasses import dataclass
from typing import Optional

from answers import Maximum, StateAfter
from programs import GearlashMap, GearlashResponse, Peer

P1_MAXIMA = (Maximum(0, 1.50865, 0.8523, 5e-4, 1e-3), Maximum(1, 0.99980, 0.8470, 5e-4, 1e-3))
P2_MAXIMA = (Maximum(0, 0.460204, 0.144836, 2e-4, 1e-4), Maximum(9, 1.901169, 0.149226, 2e-4, 1e-4))
P3_STATE = (0.58825073954, 0.82527974846, 0.17936863666, 0.18405848575)
# (r, r') [m, m/s] of the gear pair after ten periods, by extrapolation with 40 digits between located switches; half the gap
# [m] and the mesh frequency [rad/s] are the units of its errors.
P13_STATE = (3.3992714617507705e-5, 0.110674434880134258)
P13_LENGTH, P13_FREQUENCY = 2e-5, 2.0 * math.pi * 2500.0

# pyHarm's longest steps are such that its branches have about as many points as those of `gearlash`.
PYHARM_STEP = {"P1": "0.075", "P2": "0.35", "P2b": "0.35"}

OURS = "gearlash"


@dataclass(frozen=True)
class Entry:
    """A program and its expected answer to a problem."""

    program: object
    checks: tuple


@dataclass(frozen=True)
class Case:
    """A problem; the first entry is `gearlash`."""

    name: str
    title: str
    entries: tuple
    # The number of periods every cost is scaled to, for problems that are integrations.
    periods: Optional[int] = None


def responses(gearlash, python, peers, names):
    """Frequency responses: P1 and P2."""
    titles = {
        "P1": "2 coordinates, gaps 1 and 0.1, 12 harmonics",
        "P2": "chain of 20, never separating, 7 harmonics",
    }
    for name, maxima in (("P1", P1_MAXIMA), ("P2", P2_MAXIMA)):
        if name not in names:
            continue
        model = f"{name}.yaml"
        entries = [Entry(GearlashResponse(OURS, gearlash, model), maxima)]
        if "pyharm" in peers:
            options = ("--step-max", PYHARM_STEP[name])
            entries.append(Entry(Peer("pyHarm", python, "pyharm_problem.py", model, options), maxima))
        yield Case(name, titles[name], tuple(entries))


def attractor(gearlash, python, peers, periods):
    """Poincare points of a chaotic motion: P3. scipy computes a hundredth of the periods because it is slow."""
    def after_ten(tolerance):
        return (StateAfter(10, P3_STATE, tolerance),)

    entries = integrations("P3.yaml", gearlash, python, peers, periods, after_ten)
    return Case("P3", f"chaotic, from rest, {periods} periods", entries, periods)


def gear_pair(gearlash, python, peers, periods):
    """Poincare points of the everyday gear pair: P13."""

    def after_ten(tolerance):
        return (StateAfter(10, P13_STATE, tolerance, P13_LENGTH, P13_FREQUENCY),)

    entries = integrations("P13.yaml", gearlash, python, peers, periods, after_ten)
    title = f"gear pair, stiffness varies, transmission error, {periods} periods"
    return Case("P13", title, entries, periods)


def integrations(model, gearlash, python, peers, periods, after_ten):
    """Programs that take part in an integration."""
    entries = [Entry(GearlashMap(OURS, gearlash, model, periods), after_ten(1e-10))]
    if "numbalsoda" in peers:
        for rtol, tolerance in (("1e-8", 1e-5), ("1e-12", 2e-9)):
            options = ("--rtol", rtol, "--periods", str(periods))
            peer = Peer(f"numbalsoda LSODA, rtol {rtol}", python, "numbalsoda_problem.py", model, options)
            entries.append(Entry(peer, after_ten(tolerance)))
    if "scipy" in peers:
        for method in ("LSODA", "DOP853"):
            options = ("--method", method, "--rtol", "1e-8", "--periods", str(max(periods // 100, 10)))
            peer = Peer(f"scipy {method}, rtol 1e-8", python, "scipy_problem.py", model, options)
            entries.append(Entry(peer, after_ten(1e-5)))
    return tuple(entries)


def hard_chain(gearlash, python, peers, seconds):
    """P2b: lowest frequency reached in a given time. There is no reference."""
    model = "P2b.yaml"
    entries = [Entry(GearlashResponse(OURS, gearlash, model, interrupt_after=seconds), ())]
    if "pyharm" in peers:
        options = ("--step-max", PYHARM_STEP["P2b"], "--time-limit", str(seconds))
        entries.append(Entry(Peer("pyHarm", python, "pyharm_problem.py", model, options), ()))
    return Case("P2b", f"chain of 20 that separates, 7 harmonics, limit {seconds} s", tuple(entries))
