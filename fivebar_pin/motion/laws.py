"""The motion laws that make a motion."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, finite, number, numeric
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.motion.motion import Motion

__all__ = ["constant", "cycloidal", "harmonic", "polynomial", "spline"]

_SAME = 1e-12  # difference of the first and last knot of a cycle that is round-off [of the values, at least one]


def constant(t: npt.ArrayLike, value: float) -> Motion:
    """Hold one coordinate still."""
    time = checked("t", t, (None,))
    zero = np.zeros_like(time)
    return _column(time, zero + number("value", value), zero, zero)


@finite()
def cycloidal(t: npt.ArrayLike, start: float, stop: float, *, duration: float | None = None) -> Motion:
    """Move from start to stop along a cycloid: q = start + h (s - sin(2 pi s) / 2 pi), s = (t - t_0) / duration.

    Velocity and acceleration vanish at both ends; after the end the coordinate stays.

    Args:
        t: times (n,) [s].
        start, stop: values at the ends [rad or m].
        duration: length of the move [s]; the whole of t unless given.
    """
    time, T, s, moving = _phase(t, duration)
    low, h = _ends(start, stop)
    w = 2.0 * np.pi
    return _column(
        time,
        low + h * (s - np.sin(w * s) / w),
        moving * h / T * (1.0 - np.cos(w * s)),
        moving * h * w / T**2 * np.sin(w * s),
    )


@finite()
def harmonic(t: npt.ArrayLike, mean: float, amplitude: float, *, period: float, phase: float = 0.0) -> Motion:
    """Swing about a mean: q = mean + amplitude cos(2 pi t / period + phase)."""
    time = checked("t", t, (None,))
    w = 2.0 * np.pi / number("period", period, positive=True, unit="s")
    centre, h, x = number("mean", mean), number("amplitude", amplitude), w * time + number("phase", phase)
    return _column(time, centre + h * np.cos(x), -h * w * np.sin(x), -h * w**2 * np.cos(x))


@finite()
def polynomial(
    t: npt.ArrayLike, start: float, stop: float, *, degree: int = 5, duration: float | None = None
) -> Motion:
    """Move from rest to rest along a polynomial: degree 3, 5 (3-4-5) or 7 (4-5-6-7).

    Velocity vanishes at both ends; acceleration does too for degrees 5 and 7, jerk for degree 7.

    Args:
        t: times (n,) [s].
        start, stop: values at the ends [rad or m].
        degree: 3, 5 or 7.
        duration: length of the move [s]; the whole of t unless given.
    """
    known = {3: [3, -2], 5: [10, -15, 6], 7: [35, -84, 70, -20]}
    if not isinstance(degree, (int, np.integer)) or degree not in known:
        raise InvalidInputError("degree", degree, f"must be one of {sorted(known)}")
    time, T, s, moving = _phase(t, duration)
    first = (degree + 1) // 2
    p = np.polynomial.Polynomial([0.0] * first + [float(c) for c in known[degree]])
    low, h = _ends(start, stop)
    return _column(time, low + h * p(s), moving * h / T * p.deriv()(s), moving * h / T**2 * p.deriv(2)(s))


@finite()
def spline(t: npt.ArrayLike, knots: npt.ArrayLike, values: npt.ArrayLike, *, periodic: bool = False) -> Motion:
    """Pass through given values with a quintic spline (continuous to the fourth derivative).

    Args:
        t: times to sample (n,) [s], within the knots.
        knots: times of the given values (k,) [s], strictly increasing, at least six.
        values: values at the knots (k,) or (k, na).
        periodic: whether the first and last knot are the same instant of a cycle.
    """
    from scipy.interpolate import make_interp_spline

    time, x = checked("t", t, (None,)), checked("knots", knots, (None,))
    y = numeric("values", values)
    y = checked("values", y[:, None] if y.ndim == 1 else y, (x.size, None))
    if x.size < 6 or np.any(np.diff(x) <= 0.0):
        raise InvalidInputError("knots", x.tolist(), "must be at least six, strictly increasing")
    if time.size and (time.min() < x[0] or time.max() > x[-1]):
        raise InvalidInputError("t", [float(time.min()), float(time.max())], f"must lie within [{x[0]}, {x[-1]}]")
    if periodic and not np.allclose(y[0], y[-1], rtol=0.0, atol=_SAME * (1.0 + np.abs(y).max())):
        raise InvalidInputError("values[-1]", y[-1].tolist(), f"must equal values[0] = {y[0].tolist()} when periodic")
    if periodic:
        y = np.concatenate([y[:-1], y[:1]])
    curve = make_interp_spline(x, y, k=5, bc_type="periodic" if periodic else None)
    return Motion(time, curve(time), curve.derivative(1)(time), curve.derivative(2)(time))


def _phase(t: npt.ArrayLike, duration: float | None) -> tuple[Array, float, Array, Array]:
    """Return the times, the duration, the phase in [0, 1] and 1.0 where the move is under way."""
    time = checked("t", t, (None,))
    if time.size == 0:
        raise InvalidInputError("t", [], "must hold at least one sample")
    T = number("duration", time[-1] - time[0] if duration is None else duration, positive=True, unit="s")
    s = np.clip((time - time[0]) / T, 0.0, 1.0)
    return time, T, s, ((time - time[0]) <= T).astype(np.float64)


def _column(t: Array, q: Array, v: Array, a: Array) -> Motion:
    return Motion(t, q[:, None], v[:, None], a[:, None])


def _ends(start: float, stop: float) -> tuple[float, float]:
    """Return the start and the way from there to the end."""
    low = number("start", start)
    return low, number("stop", stop) - low
