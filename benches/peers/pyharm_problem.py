"""A frequency response with pyHarm: harmonic balance and arc-length continuation, no stability.

    pyharm_problem.py MODEL OUT --step-max 0.1 [--time-limit SECONDS]

pyHarm's gap element pulls at the node it is attached to, whereas kappa spreads the force of each connection over all
coordinates. Multiplied by the inverse of kappa the equation has the form pyHarm wants, exactly:

    kappa^-1 q'' + kappa^-1 Gam q' + f(q) = kappa^-1 Q

so that every f_i is a stock `PenaltyBilateralGap` of stiffness 1 and gap b_i between coordinate i and the ground.
"""

import time
import warnings

import numpy as np
from numba import NumbaPerformanceWarning
from pyHarm import Maestro

import problem

# Samples a period at which the extremes of a solution are looked for, many more than the solver uses.
FINE_SAMPLES = 2048


def main():
    """Solve, then write solver CPU seconds and the curves as JSON."""
    warnings.simplefilter("ignore", NumbaPerformanceWarning)
    arguments = parse()
    system = problem.load(arguments.model)
    maestro = Maestro(description(system, arguments))
    begin = time.process_time()
    maestro.operate(x0=start(system))
    seconds = time.process_time() - begin
    omega, amplitude = curves(maestro, system)
    result = {"solver_cpu": seconds, "points": len(omega), "omega": omega, "half_peak_to_peak": amplitude}
    problem.write(arguments.out, result)


def parse():
    """Command line."""
    parser = problem.parser(__doc__)
    parser.add_argument("--step-max", type=float, required=True, help="longest step along the branch")
    parser.add_argument("--time-limit", type=int, default=3600, metavar="SECONDS")
    return parser.parse_args()


def description(system, arguments):
    """pyHarm's input: one substructure with one node per coordinate, with a gap and the loads at each."""
    inverse = np.linalg.inv(system.stiffness)
    nothing = np.zeros_like(inverse)
    return {
        "system": {"type": "Base", "nh": system.analysis["harmonics"], "nti": system.analysis["samples"]},
        "substructures": {
            "train": {"ndofs": 1, "matrix": {"M": inverse, "C": inverse @ system.damping, "K": nothing, "G": nothing}}
        },
        "connectors": {**gaps(system), **loads(inverse @ system.mean, inverse @ system.amplitude)},
        "analysis": {"response": continuation(system, arguments)},
    }


def gaps(system):
    """One gap with both flanks per coordinate, against ground."""
    return {
        f"gap_{i}": {"type": "PenaltyBilateralGap", "connect": {"train": [i]}, "dirs": [0], "g": half_gap, "k": 1.0}
        for i, half_gap in enumerate(system.half_gap)
    }


def loads(mean, amplitude):
    """Forces at the nodes that have any: order 0 the mean, order 1 a cosine."""
    return {
        f"load_{i}_{order}": {
            "type": "GOForcing", "connect": {"train": [i]}, "dirs": [0], "dto": 0, "ho": order, "amp": force,
        }
        for order, forces in enumerate((mean, amplitude))
        for i, force in enumerate(forces)
        if force != 0.0
    }


def continuation(system, arguments):
    """Settings of the analysis: from high to low frequencies, with pyHarm's default solver and predictor."""
    high, low = system.analysis["from"], system.analysis["to"]
    hours, seconds = divmod(arguments.time_limit, 3600)
    minutes, seconds = divmod(seconds, 60)
    return {
        "study": "frf",
        "solver": "scipyroot",
        "predictor": "tangent",
        "corrector": "arc_length",
        "stepsizer": "acceptance",
        "stopper": "bounds",
        "stopper_options": {"timeout": {"status": True, "timeout": f"00:{hours:02}:{minutes:02}:{seconds:02}"}},
        "ds0": arguments.step_max / 2.0,
        "ds_max": arguments.step_max,
        "ds_min": 1e-8,
        "sign_ds": -1,
        "puls_inf": low,
        "puls_sup": high,
        "verbose": False,
    }


def start(system):
    """Fourier coefficients of the motion in permanent contact on the front flank, at the first frequency.

        kappa^-1 (q'' + Gam q') + q - b = kappa^-1 Q

    pyHarm's own start linearises about q = 0, inside the gaps, where there is no stiffness at all.
    """
    omega, dof = system.analysis["from"], system.dof
    dynamic = system.stiffness - omega**2 * np.eye(dof) + 1j * omega * system.damping
    alternating = np.linalg.solve(dynamic, system.amplitude)
    coefficients = np.zeros((2 * system.analysis["harmonics"] + 1, dof))
    coefficients[0] = system.half_gap + np.linalg.solve(system.stiffness, system.mean)
    coefficients[1], coefficients[2] = alternating.real, -alternating.imag
    return coefficients.ravel()


def curves(maestro, system):
    """Frequencies of the accepted solutions and half the peak-to-peak of every coordinate there."""
    accepted = [s for s in maestro.nls["response"].SolList if s.flag_accepted]
    phase = np.arange(FINE_SAMPLES) * 2.0 * np.pi / FINE_SAMPLES
    orders = range(1, system.analysis["harmonics"] + 1)
    basis = np.array([np.ones_like(phase), *(wave(k * phase) for k in orders for wave in (np.cos, np.sin))])
    amplitude = []
    for solution in accepted:
        coefficients = solution.x[:-1].reshape(len(basis), system.dof)
        amplitude.append(0.5 * np.ptp(coefficients.T @ basis, axis=1))
    return [float(s.x[-1]) for s in accepted], np.transpose(amplitude).tolist()


if __name__ == "__main__":
    main()
