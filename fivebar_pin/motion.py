"""Motion of the actuated coordinates, and the motion laws that make one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, checked, finite, number, numeric, table_text
from fivebar_pin._files import as_path, check_new, read_bounded, write_file
from fivebar_pin.errors import FileFormatError, InvalidInputError

__all__ = [
    "Motion",
    "combine",
    "constant",
    "cycloidal",
    "from_file",
    "harmonic",
    "polynomial",
    "spline",
    "to_file",
]

_MAX_TABLE_BYTES = 256 * 1024 * 1024
"""Size above which a table is not read [bytes]: some million samples."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion(Immutable):
    """Sampled motion of the actuated coordinates.

    Attributes:
        t: times, strictly increasing (n,) [s].
        q: coordinates (n, na) [rad or m]; the columns follow `ClosedChain.actuated`.
        v: velocities (n, na).
        a: accelerations (n, na).

    Raises:
        InvalidInputError: shapes that do not fit, values that are not finite, times that do not increase.
    """

    t: Array
    q: Array
    v: Array
    a: Array

    def __post_init__(self) -> None:
        t = checked("motion.t", self.t, (None,))
        if t.size == 0:
            raise InvalidInputError("motion.t", [], "must hold at least one sample")
        q = checked("motion.q", self.q, (t.size, None))
        v = checked("motion.v", self.v, q.shape)
        a = checked("motion.a", self.a, q.shape)
        late = np.flatnonzero(np.diff(t) <= 0.0)
        if late.size:
            k = int(late[0]) + 1
            raise InvalidInputError(f"motion.t[{k}]", float(t[k]), f"times must increase (t[{k - 1}] = {t[k - 1]})")
        for name, array in (("t", t), ("q", q), ("v", v), ("a", a)):
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return int(self.t.size)

    @property
    def na(self) -> int:
        """Number of actuated coordinates."""
        return int(self.q.shape[1])

    @finite()
    def scaled(self, speed: float) -> Motion:
        """Return the same path run `speed` times as fast."""
        k = number("speed", speed, positive=True)
        return Motion(self.t / k, self.q, self.v * k, self.a * k**2)


def combine(*motions: Motion) -> Motion:
    """Put motions over the same times side by side, one column after the other."""
    if not motions:
        raise InvalidInputError("motions", [], "must hold at least one motion")
    t = motions[0].t
    for k, m in enumerate(motions):
        if m.t.shape != t.shape or not np.array_equal(m.t, t):
            raise InvalidInputError(f"motions[{k}].t", m.t.shape, "must equal the times of motions[0]")
    return Motion(t, *(np.concatenate([getattr(m, x) for m in motions], axis=1) for x in ("q", "v", "a")))


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
    if periodic and not np.allclose(y[0], y[-1], rtol=0.0, atol=1e-12 * (1.0 + np.abs(y).max())):
        raise InvalidInputError("values[-1]", y[-1].tolist(), f"must equal values[0] = {y[0].tolist()} when periodic")
    if periodic:
        y = np.concatenate([y[:-1], y[:1]])
    curve = make_interp_spline(x, y, k=5, bc_type="periodic" if periodic else None)
    return Motion(time, curve(time), curve.derivative(1)(time), curve.derivative(2)(time))


def from_file(path: str | Path, names: Sequence[str] | None = None) -> Motion:
    """Read a motion from a csv file with one row per sample.

    The columns are t, q_*, v_*, a_* as `to_file` writes them, or those of our own tables of results, with their units:
    t [s], q crank [rad], v crank [rad/s], a crank [rad/s2], or crank [rad], dcrank [rad/s], ddcrank [rad/s2]. Where
    there are positions but no velocities and no accelerations, these come from a quintic spline through the positions
    (`spline`), which needs at least six samples.

    Args:
        path: the file.
        names: actuated joints whose columns are wanted, in this order; then the file may hold others too. Without
            names, or where the file has as many coordinates and knows none of these names, all are taken as they come.

    Raises:
        FileFormatError: not a table of numbers, columns missing or of another unit; names them.
        InvalidInputError: values that are not finite, times that do not increase, too few samples for a spline.
    """
    import csv
    import io

    file = as_path(path)
    try:
        text = read_bounded(file, _MAX_TABLE_BYTES, may_be_empty=True).decode("utf-8-sig")
        lines = [line for line in csv.reader(io.StringIO(text, newline="")) if line]
    except (UnicodeDecodeError, csv.Error) as error:
        raise FileFormatError(file, f"cannot be read as a motion table ({error})") from error
    head = [name.strip() for name in lines[0]] if lines else []
    if len(set(head)) < len(head):
        raise FileFormatError(file, f"has two columns of one name among {', '.join(head)}")
    wanted = _wanted(file, _columns(file, head), names)
    table = np.array([_numbers(file, k + 2, line, len(head)) for k, line in enumerate(lines[1:])])
    table = table.reshape(-1, len(head))
    t, q, v, a = (table[:, [head.index(name) for name in wanted[x]]] for x in "tqva")
    return Motion(t[:, 0], q, v, a) if wanted["v"] else spline(t[:, 0], t[:, 0], q)


_UNITS = {"t": ("s",), "q": ("rad", "m", "-"), "v": ("rad/s", "m/s"), "a": ("rad/s2", "m/s2", "rad/s^2", "m/s^2")}
Columns = dict[str, dict[str, str]]


def _columns(file: Path, head: list[str]) -> Columns:
    """Return what the columns hold: for t, q, v, a the heading of every coordinate by its name.

    Raises:
        FileFormatError: a unit that is not ours; numbers are not converted.
    """
    found: Columns = {x: {} for x in "tqva"}
    bare = {(name.split("[")[0].strip() if name.endswith("]") else name): name for name in head}
    for name, heading in bare.items():
        if name == "t":
            found["t"][""] = heading
        elif name[:2] in ("q_", "q ", "v_", "v ", "a_", "a "):
            found[name[0]][name[2:]] = heading
        elif f"d{name}" in bare and f"dd{name}" in bare:
            for x, prefix in (("q", ""), ("v", "d"), ("a", "dd")):
                found[x][name] = bare[prefix + name]
    for x, headings in found.items():
        for heading in headings.values():
            unit = heading.partition("[")[2].rstrip("]").strip()
            if unit and unit not in _UNITS[x]:
                known = " or ".join(_UNITS[x])
                raise FileFormatError(file, f"has the column {heading!r}; its unit must be {known}, convert it first")
    return found


def _wanted(file: Path, found: Columns, names: Sequence[str] | None) -> dict[str, list[str]]:
    """Return the headings to read for t, q, v, a; none for v and a where there are neither.

    Raises:
        FileFormatError: columns are missing; names them.
    """
    chosen = list(found["q"])
    if names is not None and (set(names) & set(chosen) or len(names) != len(chosen)):
        chosen = list(names)
    rates = "va" if any(name in found[x] for x in "va" for name in chosen) else ""
    missing = [] if found["t"] else ["t"]
    missing += [f"{x}_{name}" for x in "q" + rates for name in chosen if name not in found[x]]
    if missing or not chosen:
        there = ", ".join(found["q"]) or "none"
        raise FileFormatError(
            file,
            f"needs the columns t, q_*, v_*, a_* (or t, q_* alone); missing {', '.join(missing) or 'q_*'}; "
            f"coordinates there: {there}",
        )
    return {
        "t": [found["t"][""]],
        "q": [found["q"][name] for name in chosen],
        **{x: [found[x][name] for name in chosen] if rates else [] for x in "va"},
    }


def to_file(motion: Motion, path: str | Path, names: tuple[str, ...], *, overwrite: bool = False) -> None:
    """Write the csv that `from_file` reads.

    Args:
        motion: the motion.
        path: the file to write.
        names: names of the actuated joints, one per column, all different.
        overwrite: whether an existing file may be replaced.

    Raises:
        InvalidInputError: names that are not one per column, repeat, or hold a comma, quote or line break.
        OutputError: the file exists, or cannot be written.
    """
    if len(names) != motion.na or len(set(names)) < len(names):
        raise InvalidInputError("names", names, f"must be {motion.na} different names")
    if any(mark in name for name in names for mark in ',"\r\n'):
        raise InvalidInputError("names", names, "must hold no comma, quote or line break")
    check_new(path, overwrite=overwrite)
    header = ",".join(["t", *(f"{x}_{n}" for x in "qva" for n in names)])
    body = np.column_stack([motion.t, motion.q, motion.v, motion.a])
    write_file(path, table_text(header, body), overwrite=overwrite)


def _numbers(file: Path, line: int, cells: list[str], width: int) -> list[float]:
    if len(cells) != width:
        raise FileFormatError(file, f"row {line} has {len(cells)} cells, the header has {width}")
    try:
        return [float(cell) for cell in cells]
    except ValueError as error:
        raise FileFormatError(file, f"row {line} is not numeric ({error})") from error


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
