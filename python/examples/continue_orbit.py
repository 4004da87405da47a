"""A continuation program of its own, begun at a point that gearlash saved.

It reads `NAME.csv` of a `bifurcation_curve` and knows nothing else of gearlash: equation of motion, integration (scipy), shooting and
path following are written out here for `reduced` models with backlash,

    q'' + Gam q' + kappa f(q) = Qm + Qa cos(omega T),    f(q) = q + (|q - b| - |q + b|) / 2.

    gearlash run model.yaml
    python continue_orbit.py results/model doubling 12
"""

import csv
import sys
from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp


@dataclass
class System:
    """Matrices of a `reduced` model; one load of order 1."""

    stiffness: np.ndarray
    damping: np.ndarray
    half_gap: np.ndarray
    mean: np.ndarray
    amplitude: np.ndarray

    def acceleration(self, t, q, v, omega):
        """q'' of states in columns."""
        b = self.half_gap[:, None]
        force = q + (abs(q - b) - abs(q + b)) / 2
        load = self.mean + self.amplitude * np.cos(omega * t)
        return load[:, None] - self.damping @ v - self.stiffness @ force

    def _integrate(self, states, omega, times=None):
        n = len(self.mean)

        def rate(t, flat):
            x = flat.reshape(states.shape)
            return np.vstack([x[n:], self.acceleration(t, x[:n], x[n:], omega)]).ravel()

        period = 2 * pi / omega
        options = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-12, "max_step": period / 100}
        return solve_ivp(rate, (0, period), states.ravel(), t_eval=times, **options).y

    def period_map(self, states, omega):
        """States in columns, one period of the excitation later."""
        return self._integrate(states, omega)[:, -1].reshape(states.shape)

    def orbit(self, u, omega, count):
        """States at equal steps of a period, its end excluded, in columns."""
        return self._integrate(u[:, None], omega, np.arange(count) * 2 * pi / omega / count)

    def image_and_derivative(self, u, omega, step=1e-6):
        """P(u) and DP by central differences, all columns in one integration."""
        n = len(u)
        columns = np.column_stack([u, u[:, None] + step * np.eye(n), u[:, None] - step * np.eye(n)])
        image = self.period_map(columns, omega)
        return image[:, 0], (image[:, 1 : n + 1] - image[:, n + 1 :]) / (2 * step)


def saved_points(folder, name):
    """Rows of a curve: (parameters, state at phase 0)."""
    with open(Path(folder) / f"{name}.csv") as file:
        rows = list(csv.DictReader(file))
    state = [c for c in rows[0] if c.startswith("q.")] + [c for c in rows[0] if c.startswith("v.")]
    return [((float(r["parameter_1"]), float(r["parameter_2"])), np.array([float(r[c]) for c in state])) for r in rows]


def multipliers(system, u, omega):
    """Floquet multipliers of a periodic orbit."""
    return np.linalg.eigvals(system.image_and_derivative(u, omega)[1])


def follow(system, u, omega, points, step=1e-3):
    """Pseudo-arclength continuation in the frequency: [(omega, u)], the given orbit first."""
    n, h = len(u), 1e-6

    def equations(x):
        image, derivative = system.image_and_derivative(x[:n], x[n])
        slope = (system.period_map(x[:n, None], x[n] + h) - system.period_map(x[:n, None], x[n] - h))[:, 0] / (2 * h)
        return image - x[:n], np.column_stack([derivative - np.eye(n), slope])

    x, tangent = np.append(u, omega), None
    path = []
    for _ in range(points):
        guess = x if tangent is None else x + step * tangent
        for _ in range(8):
            residual, matrix = equations(guess)
            border = np.eye(n + 1)[n] if tangent is None else tangent
            aim = 0.0 if tangent is None else tangent @ (guess - x) - step
            change = np.linalg.solve(np.vstack([matrix, border]), -np.append(residual, aim))
            guess = guess + change
            if abs(change).max() < 1e-9:
                break
        direction = np.linalg.solve(np.vstack([matrix, np.eye(n + 1)[n] if tangent is None else tangent]), np.eye(n + 1)[n])
        x, tangent = guess, direction / np.linalg.norm(direction)
        path.append((x[n], x[:n].copy()))
    return path


def main(folder, name, point):
    system = System(
        stiffness=np.array([[2.0, 1.0], [1.0, 2.0]]),
        # zeta = 0.05 of the modes at 1 and 3^(1/2).
        damping=0.05 * (np.array([[1.0, -1.0], [-1.0, 1.0]]) + 3**0.5 * np.ones((2, 2))),
        half_gap=np.array([1.0, 0.1]),
        mean=np.array([0.5, 0.5]),
        amplitude=np.zeros(2),
    )
    (omega, load), u = saved_points(folder, name)[int(point)]
    system.amplitude[0] = load
    image, _ = system.image_and_derivative(u, omega)
    print(f"omega = {omega:.9f}, Q_a1 = {load:.9f}: the orbit closes to {abs(image - u).max():.1e}")
    print("multipliers", multipliers(system, u, omega))
    for omega, u in follow(system, u, omega, 5):
        print(f"omega = {omega:.9f}  q_1(0) = {u[0]:.9f}  nearest to -1: {min(abs(multipliers(system, u, omega) + 1)):.2e}")


if __name__ == "__main__":
    main(*sys.argv[1:])
