"""Poincare points from rest with numbalsoda's LSODA and a right-hand side compiled by numba.

    numbalsoda_problem.py MODEL OUT --rtol 1e-8 --periods 10000
"""

import math
import time

import numpy as np
from numba import cfunc
from numbalsoda import lsoda, lsoda_sig

import gear_pair
import problem

# The states written: later ones are chaotic and no reference.
STATES_KEPT = 20


def main():
    """Integrate, then write solver CPU seconds, without compilation, and the first Poincare points as JSON."""
    arguments = parse()
    system = problem.load(arguments.model)
    times = np.arange(arguments.periods + 1) * system.period
    rates = pair_rates(system) if isinstance(system, gear_pair.Pair) else right_hand_side(system)
    rest = np.array(system.rest)
    # Compiles whatever numbalsoda itself leaves to the first call.
    lsoda(rates.address, rest, times[:2], rtol=arguments.rtol, atol=arguments.rtol)
    begin = time.process_time()
    states, success = lsoda(rates.address, rest, times, rtol=arguments.rtol, atol=arguments.rtol)
    seconds = time.process_time() - begin
    if not success:
        raise SystemExit("numbalsoda: LSODA gave up")
    kept = system.in_si(states[1 : STATES_KEPT + 1].tolist())
    result = {"solver_cpu": seconds, "points": arguments.periods, "states": kept}
    problem.write(arguments.out, result)


def parse():
    """Command line."""
    parser = problem.parser(__doc__)
    parser.add_argument("--rtol", type=float, required=True, help="relative and absolute tolerance")
    parser.add_argument("--periods", type=int, required=True)
    return parser.parse_args()


def right_hand_side(system):
    """(q, v)' with v' = Q - Gam v - kappa f(q), the numbers of the system compiled in as constants."""
    (k11, k12, k21, k22), (g11, g12, g21, g22), (b1, b2), (m1, m2), (a1, a2), omega = problem.scalars(system)

    @cfunc(lsoda_sig)
    def rates(t, state, out, _parameters):
        q1, q2, v1, v2 = state[0], state[1], state[2], state[3]
        f1 = q1 + 0.5 * (abs(q1 - b1) - abs(q1 + b1))
        f2 = q2 + 0.5 * (abs(q2 - b2) - abs(q2 + b2))
        cosine = math.cos(omega * t)
        out[0] = v1
        out[1] = v2
        out[2] = m1 + a1 * cosine - g11 * v1 - g12 * v2 - k11 * f1 - k12 * f2
        out[3] = m2 + a2 * cosine - g21 * v1 - g22 * v2 - k21 * f1 - k22 * f2

    return rates


def pair_rates(pair):
    """(x, x')' of the gear pair, the numbers compiled in as constants."""
    force, stiffness, damping, a1, p1, a2, p2, e1, q1, e2, q2 = pair.numbers()

    @cfunc(lsoda_sig)
    def rates(t, state, out, _parameters):
        deformation = state[0] - e1 * math.cos(t + q1) - e2 * math.cos(2.0 * t + q2)
        rate = state[1] + e1 * math.sin(t + q1) + 2.0 * e2 * math.sin(2.0 * t + q2)
        factor = 1.0 + a1 * math.cos(t + p1) + a2 * math.cos(2.0 * t + p2)
        contact = deformation + 0.5 * (abs(deformation - 1.0) - abs(deformation + 1.0))
        out[0] = state[1]
        out[1] = force - stiffness * factor * contact - damping * rate

    return rates


if __name__ == "__main__":
    main()
