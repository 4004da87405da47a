"""Laws written in Python: for prototypes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from . import _native

# Step of central differences over the size of the argument: cube root of the rounding.
STEP = 6e-6


def law(name: str | None = None, *, derivative: Callable | None = None) -> Callable:
    """Registers a Python function as a force law: ``element: {type: python, function: NAME}`` in a model.

    The function takes ``q`` (m, or rad for shafts) and ``v`` (m/s, rad/s), arrays of equal length, and the ``parameters:`` of the model
    as keyword arguments; if it has a parameter ``phase``, that of the excitation too (0 to 2 pi). It returns the force in N (N m), an
    array of the same shape. ``derivative`` takes the same and returns (df/dq, df/dv); without it the partials come from differences that
    do not cross the ``breakpoints:`` of the model.

    >>> @gl.law("bumper")
    ... def bumper(q, v, k, gap):
    ...     return k * np.maximum(q - gap, 0) ** 1.5

    The price: a call takes some 50 microseconds with a derivative and 200 without, in which no other thread of Python computes. Harmonic balance calls it once per
    iteration with all samples; integration once per step and event. Use a formula (``type: expression``) or a law in Rust for what lasts.
    Other processes, such as workers of Dask, must register the law themselves.
    """

    def register(function: Callable) -> Callable:
        import inspect

        own = name or function.__name__
        if not isinstance(own, str):
            raise TypeError(f"found {type(own).__name__}, wanted a text: the name of the law")
        _native.register_law(own, _series(function, derivative, "phase" in inspect.signature(function).parameters))
        return function

    if callable(name):
        function, name = name, None
        return register(function)
    return register


def _series(function: Callable, derivative: Callable | None, wants_phase: bool) -> Callable:
    import numpy

    def force(q: Any, v: Any, phase: Any, given: dict[str, float]) -> Any:
        found = function(q, v, phase=phase, **given) if wants_phase else function(q, v, **given)
        found = numpy.asarray(found, dtype=float)
        if found.shape not in ((), q.shape):
            raise ValueError(f"the law returned an array of shape {found.shape}, wanted {q.shape}")
        found = numpy.broadcast_to(found, q.shape)
        if not numpy.isfinite(found).all():
            k = int(numpy.argmin(numpy.isfinite(found)))
            raise ValueError(f"the law returned {found[k]} at q = {q[k]!r}, v = {v[k]!r}")
        return found

    def partials(q: Any, v: Any, phase: Any, given: dict[str, float], levels: list[float], scales: tuple[float, float]) -> Any:
        if derivative is not None:
            found = derivative(q, v, phase=phase, **given) if wants_phase else derivative(q, v, **given)
            return tuple(numpy.broadcast_to(numpy.asarray(part, dtype=float), q.shape) for part in found)
        step = STEP * numpy.maximum(numpy.abs(q), scales[0])
        low, high = q - step, q + step
        for level in levels:
            near = (low < level) & (level < high)
            low = numpy.where(near & (q >= level), q, low)
            high = numpy.where(near & (q < level), q, high)
        step_v = STEP * numpy.maximum(numpy.abs(v), scales[1])
        count = len(q)
        places = numpy.concatenate([high, low, q, q])
        speeds = numpy.concatenate([v, v, v + step_v, v - step_v])
        found = force(places, speeds, numpy.tile(phase, 4), given)
        right, left, faster, slower = (found[k * count : (k + 1) * count] for k in range(4))
        return (right - left) / (high - low), (faster - slower) / (2 * step_v)

    def called(q: bytes, v: bytes, phase: bytes, given: dict[str, float], levels: list[float], scales: tuple[float, float]) -> Any:
        places, speeds, turns = (numpy.frombuffer(part) for part in (q, v, phase))
        parts = (force(places, speeds, turns, given), *partials(places, speeds, turns, given, levels, scales))
        return [numpy.ascontiguousarray(part).tobytes() for part in parts]

    return called
