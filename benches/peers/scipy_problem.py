"""Poincare points from rest with scipy's `solve_ivp` and a right-hand side in Python.

    scipy_problem.py MODEL OUT --method DOP853 --rtol 1e-8 --periods 30
"""

import math
import time

import numpy as np
from scipy.integrate import solve_ivp

import gear_pair
import problem

# The states written: later ones are chaotic and no reference.
STATES_KEPT = 20


def main():
    """Integrate, then write solver CPU seconds and the first Poincare points as JSON."""
    arguments = parse()
    system = problem.load(arguments.model)
    times = np.arange(1, arguments.periods + 1) * system.period
    rates = pair_rates(system) if isinstance(system, gear_pair.Pair) else right_hand_side(system)
    begin = time.process_time()
    solution = solve_ivp(
        rates, (0.0, times[-1]), system.rest, t_eval=times,
        method=arguments.method, rtol=arguments.rtol, atol=arguments.rtol,
    )
    seconds = time.process_time() - begin
    if not solution.success:
        raise SystemExit(f"solve_ivp: {solution.message}")
    states = system.in_si(solution.y.T[:STATES_KEPT].tolist())
    result = {"solver_cpu": seconds, "points": arguments.periods, "states": states}
    problem.write(arguments.out, result)


def parse():
    """Command line."""
    parser = problem.parser(__doc__)
    parser.add_argument("--method", required=True, help="a method of solve_ivp")
    parser.add_argument("--rtol", type=float, required=True, help="relative and absolute tolerance")
    parser.add_argument("--periods", type=int, required=True)
    return parser.parse_args()


def right_hand_side(system):
    """(q, v)' with v' = Q - Gam v - kappa f(q).

    Written out in floats: several times faster than numpy arrays of two.
    """
    (k11, k12, k21, k22), (g11, g12, g21, g22), (b1, b2), (m1, m2), (a1, a2), omega = problem.scalars(system)

    def rates(t, state):
        q1, q2, v1, v2 = state.tolist()
        f1 = q1 + 0.5 * (abs(q1 - b1) - abs(q1 + b1))
        f2 = q2 + 0.5 * (abs(q2 - b2) - abs(q2 + b2))
        cosine = math.cos(omega * t)
        return (
            v1,
            v2,
            m1 + a1 * cosine - g11 * v1 - g12 * v2 - k11 * f1 - k12 * f2,
            m2 + a2 * cosine - g21 * v1 - g22 * v2 - k21 * f1 - k22 * f2,
        )

    return rates


def pair_rates(pair):
    """(x, x')' of the gear pair."""
    force, stiffness, damping, a1, p1, a2, p2, e1, q1, e2, q2 = pair.numbers()

    def rates(t, state):
        x, v = state.tolist()
        deformation = x - e1 * math.cos(t + q1) - e2 * math.cos(2.0 * t + q2)
        rate = v + e1 * math.sin(t + q1) + 2.0 * e2 * math.sin(2.0 * t + q2)
        factor = 1.0 + a1 * math.cos(t + p1) + a2 * math.cos(2.0 * t + p2)
        contact = deformation + 0.5 * (abs(deformation - 1.0) - abs(deformation + 1.0))
        return v, force - stiffness * factor * contact - damping * rate

    return rates


if __name__ == "__main__":
    main()
