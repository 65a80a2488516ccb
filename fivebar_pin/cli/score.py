"""`fivebar-pin score`: many mass distributions of one mechanism along one motion."""

from __future__ import annotations

import argparse
import io
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fivebar_pin._arrays import Array, figures, integer
from fivebar_pin._files import as_path, check_new, read_bounded, write_file
from fivebar_pin.chain import ClosedChain
from fivebar_pin.cli import _output, _tables
from fivebar_pin.cli._load import add_reading, load_any
from fivebar_pin.cli._moving import motion_along
from fivebar_pin.errors import FileFormatError, InvalidInputError

if TYPE_CHECKING:
    from fivebar_pin.balancing import Scores
    from fivebar_pin.trajectory import Trajectory

TERMS = ("rms_shaking_force", "rms_shaking_moment", "rms_torque")
FILES = (".npy", ".csv")
_MAX_DESIGN_BYTES = 4 * 1024 * 1024 * 1024
"""Size above which a file of designs is not read [bytes]: ten million designs of five bodies."""


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the parser."""
    parser = commands.add_parser(
        "score",
        help="score many mass distributions of a mechanism",
        description="Score mass distributions, from a file or drawn at random about the mechanism's own.",
    )
    parser.add_argument("path", help="URDF with sidecar, MJCF, linkage file, folder, or a shipped mechanism's name")
    given = parser.add_mutually_exclusive_group(required=True)
    given.add_argument(
        "--designs",
        metavar="FILE",
        help=".npy (k, bodies, 10), or .csv with ten columns for every body: m, m c, Ixx, Ixy, Iyy, Ixz, Iyz, Izz",
    )
    given.add_argument("--random", type=int, metavar="N", help="draw N designs about the mechanism's own")
    parser.add_argument("--spread", type=float, default=0.2, help="relative change of random designs [0.2]")
    parser.add_argument("--seed", type=int, default=0, help="of random designs [0]")
    parser.add_argument(
        "--terms", nargs="+", default=TERMS, metavar="TERM", help=f"what to measure [{' '.join(TERMS)}]"
    )
    parser.add_argument("--motion", metavar="CSV", help="motion of the actuated joints; unless given, they sway")
    parser.add_argument(
        "--best", type=int, default=5, metavar="K", help="how many designs to list, by the first term [5]"
    )
    parser.add_argument("--out", metavar="CSV", help="write all scores as a table")
    add_reading(parser)
    parser.set_defaults(run=run)


def run(chosen: argparse.Namespace) -> int:
    """Read or draw the designs, score them with progress, print the best, write all."""
    from fivebar_pin.balancing import variations

    integer("--best", chosen.best, least=1)
    out = check_new(chosen.out, overwrite=False) if chosen.out is not None else None
    chain = load_any(chosen)
    if chosen.designs is not None:
        designs = _read(as_path(chosen.designs), chain)
    else:
        designs = variations(chain, chosen.random, spread=chosen.spread, seed=chosen.seed)
    scores = _scored(chain, motion_along(chain, chosen.motion), designs, tuple(chosen.terms))
    if out is not None:
        columns = [("design [-]", np.arange(len(scores), dtype=np.float64)), *scores.values.items()]
        write_file(out, _output.columns_text(columns), overwrite=False)
    _print(chain, scores, tuple(chosen.terms), chosen.best)
    _tables.written(_tables.console(), () if out is None else (out,))
    return 0


def _read(file: Path, chain: ClosedChain) -> Array:
    """Return designs (k, nb, 10) from a file."""
    nb = len(chain.joints)
    if file.suffix not in FILES:
        raise InvalidInputError("--designs", str(file), f"must end in {' or '.join(FILES)}")
    content = read_bounded(file, _MAX_DESIGN_BYTES)
    try:
        if file.suffix == ".npy":
            given = np.load(io.BytesIO(content), allow_pickle=False)
            if np.iscomplexobj(given):
                raise FileFormatError(file, "cannot be read as designs (complex numbers)")
            return np.asarray(given, dtype=np.float64)
        lines = content.decode("utf-8-sig").splitlines()
        heading = any(c.isalpha() and c not in "eE" for c in lines[0])
        table = np.loadtxt(lines, delimiter=",", skiprows=int(heading), ndmin=2)
    except (TypeError, ValueError, EOFError, MemoryError) as error:
        raise FileFormatError(file, f"cannot be read as designs ({error})") from error
    if table.shape[1] != 10 * nb:
        raise FileFormatError(file, f"has {table.shape[1]} columns, {10 * nb} are needed: ten for each of {nb} bodies")
    return np.asarray(table.reshape(len(table), nb, 10))


def _scored(chain: ClosedChain, trajectory: Trajectory, designs: Array, terms: tuple[str, ...]) -> Scores:
    """Score behind a progress bar on the error stream, which leaves the results alone."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from fivebar_pin.balancing import score

    columns = (TextColumn("scoring"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=_tables.progress(), transient=True) as bar:
        task = bar.add_task("scoring", total=None)
        return score(
            chain,
            trajectory,
            designs,
            terms=terms,
            progress=lambda done, total: bar.update(task, completed=done, total=total),
        )


def _print(chain: ClosedChain, scores: Scores, terms: tuple[str, ...], best: int) -> None:
    first = scores[terms[0]]
    order = np.argsort(first, kind="stable")[:best]
    picked = {f"{k}": [float(scores[term][k]) for term in terms] for k in order}
    if len(scores):
        picked["median"] = [float(np.median(scores[term])) for term in terms]
    scales = [scores.scales[term] for term in terms]
    rows = [[name, *map(partial(figures, digits=6), values, scales)] for name, values in picked.items()]
    title = f"{chain.name}: {len(scores)} designs, smallest {terms[0]} first (SI units)"
    _tables.table(_tables.console(), title, ("design", *terms), rows)
