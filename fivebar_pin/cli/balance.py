"""`fivebar-pin balance`: the optimal design, or the proof that there is none."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from fivebar_pin._arrays import figures, settled
from fivebar_pin._files import check_folder, write_set
from fivebar_pin.chain import ClosedChain
from fivebar_pin.cli import _output, _tables
from fivebar_pin.cli._designing import (
    SHAPES,
    add_common,
    add_designing,
    given_number,
    options_of,
    pairs,
    piece_of_words,
)
from fivebar_pin.cli._load import load_any
from fivebar_pin.cli._moving import motion_along
from fivebar_pin.dynamics import inverse_dynamics
from fivebar_pin.trajectory import Trajectory

_SHOWN = 1e-7  # mass of material that is worth a row [of the moving mass]


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the parser."""
    balance = commands.add_parser(
        "balance",
        help="the globally optimal balanced design, or the proof that there is none",
        description="Balance a mechanism; exit code 1 when it is proved to be impossible within the bounds.",
    )
    add_common(balance)
    add_designing(balance)
    balance.add_argument("--minimise", action="append", metavar="TERM[=WEIGHT]", help="what to minimise; repeatable")
    balance.add_argument("--limit", action="append", metavar="TERM=VALUE", help="upper bound on a term; repeatable")
    balance.add_argument(
        "--realise",
        choices=SHAPES,
        metavar="SHAPE",
        help="solve for counterweights of this shape, and make them: %(choices)s",
    )
    balance.add_argument(
        "--arm", type=float, help="side of the square arms that carry them [m]; 0: none [a fifth of a radius]"
    )
    balance.add_argument("--out", metavar="FOLDER", help="write the design, the curves and a page before / after there")
    balance.add_argument("--overwrite", action="store_true", help="replace files that exist already")
    balance.add_argument("--view", action="store_true", help="open the live view before / after (Ctrl-C ends it)")
    balance.set_defaults(run=run)


def run(chosen: argparse.Namespace) -> int:
    """Balance, print, write."""
    from fivebar_pin.balancing import balance, realise

    folder = check_folder(chosen.out, overwrite=chosen.overwrite) if chosen.out is not None else None
    chain = load_any(chosen)
    trajectory = motion_along(chain, chosen.motion)
    minimise = {name: 1.0 if value is None else value for name, value in pairs("--minimise", chosen.minimise)}
    limits = {name: given_number("--limit", name, value) for name, value in pairs("--limit", chosen.limit)}
    console = _tables.console()
    with _tables.progress().status("balancing"):
        options = options_of(chosen, chain, trajectory)
        piece = piece_of_words(chosen, chain)
        design = balance(chain, chosen.kind, minimise=minimise or None, limits=limits, counterweight=piece, **options)
    if not design.feasible:
        _print_refusal(console, design)
        return 1
    made = realise(design) if chosen.realise else None
    after = design.chain if made is None else made.chain
    pair = _moving(design, after, trajectory)
    files: tuple[Path, ...] = ()
    if folder is not None:
        files = write_set(folder, _files(folder, design, after, trajectory, pair), overwrite=chosen.overwrite)
    if made is not None:
        _print_realised(console, made)
    _print_design(console, design, after, pair)
    _tables.written(console, files)
    if chosen.view:
        from fivebar_pin import viz

        viz.view(pair, title=_title(design), announce=_tables.announce)
    return 0


def _title(design: Any) -> str:
    return f"{design.original.name}: {_balance(design)}"


def _balance(design: Any) -> str:
    return f"{design.kind} balance" + ("" if design.branch is None else " on the branch of the motion")


def _print_refusal(console: Any, design: Any) -> None:
    """Say that there is no design, with the proof, and what the material was."""
    lines = [
        f"{design.original.name}: infeasible, no {design.kind} balance within the bounds.",
        f"Proof: {design.certificate}",
    ]
    if design.material:
        lines.append(f"Material: {design.material}; --material none asks for any density.")
    for q in design.alternatives:
        lines.append(
            f"It is possible on the branch of {q.round(6).tolist()} alone: --branch motion, with a motion there."
        )
    for line in lines:
        console.print(line, markup=False, soft_wrap=True)


def _print_realised(console: Any, made: Any) -> None:
    """Print the counterweights that were asked for, promised beside realised."""
    for weight in made.weights:
        console.print(f"  {weight}", markup=False, soft_wrap=True)
    rows = [[name, *words] for name, words in made.figures.items()]
    _tables.table(console, "Counterweights", ("", "promised", "realised"), rows)
    console.print(f"{made.claim}", markup=False, soft_wrap=True)


def _print_design(console: Any, design: Any, after: ClosedChain, pair: list[Any]) -> None:
    changes = [("added", c) for c in design.added] + [("removed", c) for c in design.removed]
    rows = [
        [word, c.body, f"{c.mass:.6g}", _place(design, c), _inertia(design, c)]
        for word, c in changes
        if c.mass > _SHOWN * design.original.mass
    ]
    title = f"{design.original.name}: {_balance(design)}, {design.status}; moving mass {_gained(design)} kg"
    headings = ("", "body of joint", "mass [kg]", "at [m], joint axes", "inertia about it [kg m2]")
    _tables.table(console, title, headings, rows)
    frame = any(one.loads.loaded for one in pair)
    columns = [_output.curves(one.chain, one.loads, frame=frame) for one in pair]
    rows = [[same[0].name, *(cell for curve in same for cell in curve.cells)] for same in zip(*columns, strict=True)]
    _tables.table(console, "Along the motion", ("", "before: peak", "RMS", "after: peak", "RMS"), rows)
    rows = [
        ["material", design.material or "any density"],
        ["objective", design.objective_text(digits=9)],
        ["no design is better than", f"{design.dual_bound:.9g}"],
        ["residual of the conditions, relative", figures(design.residual)],
    ]
    _tables.table(console, "Certificate", ("", ""), rows)


def _gained(design: Any) -> str:
    return f"{settled(design.added_mass, design.scale('added_mass')):+.6g}"


def _place(design: Any, change: Any) -> str:
    return ", ".join(figures(float(x), design.original.length, digits=5) for x in change.place)


def _inertia(design: Any, change: Any) -> str:
    """Write the inertia about the normal of the plane of motion, or the principal ones of a spatial mechanism."""
    if design.space.planar:
        normal = design.space.axes[design.space.bodies.index(change.body), 2]
        return figures(float(normal @ change.inertia @ normal))
    return ", ".join(f"{x:.3g}" for x in np.linalg.eigvalsh(change.inertia))


def _moving(design: Any, after: ClosedChain, trajectory: Trajectory) -> list[Any]:
    """Return before and after for the viewer, with their loads."""
    from fivebar_pin.viz import Shown

    both = {"before": design.original, "after": after}
    return [Shown(chain, trajectory, inverse_dynamics(chain, trajectory), label) for label, chain in both.items()]


def _files(
    folder: Path, design: Any, after: ClosedChain, trajectory: Trajectory, pair: list[Any]
) -> dict[str, str | bytes]:
    from fivebar_pin import viz
    from fivebar_pin.io._save import texts

    columns = _output.motion_columns(design.original, trajectory)
    for one in pair:
        columns += [(f"{one.label} {name}", x) for name, x in _output.load_columns(one.chain, one.loads)]
    return {
        **texts(after, folder, name=f"{design.original.name}_balanced"),
        "results.csv": _output.columns_text(columns),
        **viz.plots.png(_output.load_figures({one.label: one.loads for one in pair}, trajectory.t)),
        "animation.html": viz.page(pair, title=_title(design)),
    }
