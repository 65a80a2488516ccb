"""Motions from tables and to tables."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fivebar_pin._arrays import table_text
from fivebar_pin._files import as_path, check_new, read_bounded, write_file
from fivebar_pin.errors import FileFormatError, InvalidInputError
from fivebar_pin.motion.laws import spline
from fivebar_pin.motion.motion import Motion

__all__ = ["Columns", "from_file", "to_file"]


_MAX_TABLE_BYTES = 256 * 1024 * 1024
"""Size above which a table is not read [bytes]: some million samples."""


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
