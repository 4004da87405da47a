"""Cross-checks of the answers: maxima of the curves, states after some periods, against reference values."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Maximum:
    """The largest half peak-to-peak of a coordinate along a frequency response, and its frequency."""

    coordinate: int  # from 0
    amplitude: float
    omega: float
    relative: float  # tolerance of the amplitude, relative
    shift: float  # tolerance of the frequency

    def error(self, outcome):
        """Relative error of the amplitude."""
        return abs(peak(*outcome.curves[self.coordinate])[0] / self.amplitude - 1.0)

    def disagreements(self, outcome):
        """Error messages; none if the outcome agrees."""
        amplitude, omega = peak(*outcome.curves[self.coordinate])
        name = f"q{self.coordinate + 1}"
        if not abs(amplitude / self.amplitude - 1.0) <= self.relative:
            yield f"maximum of {name}: {amplitude:.6f}, expected {self.amplitude} within {self.relative:g} of it"
        if not abs(omega - self.omega) <= self.shift:
            yield f"maximum of {name}: at {omega:.6f}, expected {self.omega} within {self.shift:g}"


@dataclass(frozen=True)
class StateAfter:
    """(q, v) after some periods from rest."""

    periods: int
    state: tuple
    tolerance: float  # largest deviation allowed, by what the method promises a step
    unit: float = 1.0  # of displacement, in the results
    frequency: float = 1.0  # of velocity over displacement

    def error(self, outcome):
        """Largest deviation of a coordinate or velocity."""
        half = len(self.state) // 2
        units = [self.unit] * half + [self.unit * self.frequency] * half
        found = outcome.states[self.periods - 1]
        return max(abs(a - b) / unit for a, b, unit in zip(found, self.state, units))

    def disagreements(self, outcome):
        """Error messages; none if the outcome agrees."""
        error = self.error(outcome)
        if not error <= self.tolerance:
            yield f"state after {self.periods} periods: off by {error:.1e}, expected {self.tolerance:g} at most"


def peak(omega, amplitude):
    """Height and frequency of a curve's maximum: of the parabola through the highest point and its neighbours.

    Where the branch turns back at the highest point, or ends there, the point itself.
    """
    top = max(range(len(omega)), key=amplitude.__getitem__)
    if not 0 < top < len(omega) - 1:
        return amplitude[top], omega[top]
    left, right = omega[top - 1] - omega[top], omega[top + 1] - omega[top]
    if left * right >= 0.0:
        return amplitude[top], omega[top]
    # amplitude = amplitude[top] + slope x + bend x^2 through the neighbours, x = omega - omega[top]
    rise_left, rise_right = ((amplitude[top + i] - amplitude[top]) / x for i, x in ((-1, left), (1, right)))
    bend = (rise_right - rise_left) / (right - left)
    if bend == 0.0:
        return amplitude[top], omega[top]
    slope = rise_left - bend * left
    return amplitude[top] - 0.25 * slope**2 / bend, omega[top] - 0.5 * slope / bend
