"""`fivebar-pin conditions`, `balance` and `pareto`: any mechanism, from its balancing conditions to a file."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from fivebar_pin._arrays import figures, integer, settled
from fivebar_pin._files import check_folder, check_new, write_file, write_set
from fivebar_pin.chain import ClosedChain
from fivebar_pin.cli import _output, _tables
from fivebar_pin.cli._load import add_gravity, load_any
from fivebar_pin.cli._moving import motion_along
from fivebar_pin.dynamics import inverse_dynamics
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.trajectory import Trajectory

_SHOWN = 1e-7  # mass of material that is worth a row [of the moving mass]
_MOST_POINTS = 10_000  # designs on a front; each is a problem to solve


class _Late:
    """Choices that the library knows, asked for only where they are needed: help, and what was chosen."""

    def __init__(self, module: str, table: str) -> None:
        self._module, self._table = module, table

    def __iter__(self) -> Iterator[str]:
        return iter(getattr(import_module(f"fivebar_pin.balancing.{self._module}"), self._table))

    def __contains__(self, word: object) -> bool:
        return word in tuple(self)


_KINDS = _Late("conditions", "KINDS")
_MODES = _Late("variables", "MODES")
_SHAPES = _Late("pieces", "SHAPES")
_SOLVERS = _Late("solvers", "SOLVERS")


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the commands to the parser."""
    conditions = commands.add_parser("conditions", help="the balancing conditions of a mechanism")
    _common(conditions)
    _branch(conditions)
    conditions.set_defaults(run=run_conditions)
    balance = commands.add_parser(
        "balance",
        help="the globally optimal balanced design, or the proof that there is none",
        description="Balance a mechanism; exit code 1 when it is proved to be impossible within the bounds.",
    )
    _common(balance)
    _designing(balance)
    balance.add_argument("--minimise", action="append", metavar="TERM[=WEIGHT]", help="what to minimise; repeatable")
    balance.add_argument("--limit", action="append", metavar="TERM=VALUE", help="upper bound on a term; repeatable")
    balance.add_argument(
        "--realise",
        choices=_SHAPES,
        metavar="SHAPE",
        help="solve for counterweights of this shape, and make them: %(choices)s",
    )
    balance.add_argument(
        "--arm", type=float, help="side of the square arms that carry them [m]; 0: none [a fifth of a radius]"
    )
    balance.add_argument("--out", metavar="FOLDER", help="write the design, the curves and a page before / after there")
    balance.add_argument("--overwrite", action="store_true", help="replace files that exist already")
    balance.add_argument("--view", action="store_true", help="open the live view before / after (Ctrl-C ends it)")
    balance.set_defaults(run=run_balance)
    pareto = commands.add_parser("pareto", help="the front between two objectives of balanced designs")
    _common(pareto)
    _designing(pareto)
    pareto.add_argument("first", help="term that is bounded step by step")
    pareto.add_argument("second", help="term that is minimised under each bound")
    pareto.add_argument("--points", type=int, default=11, help="designs on the front [11]")
    pareto.add_argument("--out", metavar="CSV", help="write the front as a table")
    pareto.set_defaults(run=run_pareto)


def run_conditions(chosen: argparse.Namespace) -> int:
    """Find and print the conditions, and how far the mechanism is from them."""
    from fivebar_pin.balancing import balance_conditions

    chain = load_any(chosen.path, chosen.gravity)
    near = motion_along(chain, chosen.motion).q[0] if chosen.branch == "motion" else None
    conditions = balance_conditions(chain, chosen.kind, gravity=_direction(chosen, chain), near=near)
    console = _tables.console()
    console.print(str(conditions), markup=False, soft_wrap=True)
    residual = float(np.abs(conditions.residual(chain)).max(initial=0.0))
    sizes = np.abs(conditions.matrix) @ np.abs(chain.inertial_parameters.reshape(-1)) + np.abs(conditions.offset)
    words = figures(residual, float(sizes.max(initial=0.0)))
    console.print(f"largest residual of {chain.name} as it is: {words} kg", markup=False)
    return 0


def run_balance(chosen: argparse.Namespace) -> int:
    """Balance, print, write."""
    from fivebar_pin.balancing import balance, realise

    folder = check_folder(chosen.out, overwrite=chosen.overwrite) if chosen.out is not None else None
    chain = load_any(chosen.path, chosen.gravity)
    trajectory = motion_along(chain, chosen.motion)
    minimise = {name: 1.0 if value is None else value for name, value in _pairs("--minimise", chosen.minimise)}
    limits = {name: _given("--limit", name, value) for name, value in _pairs("--limit", chosen.limit)}
    console = _tables.console()
    with _tables.progress().status("balancing"):
        options = _options(chosen, chain, trajectory)
        piece = _piece(chosen, chain)
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


def run_pareto(chosen: argparse.Namespace) -> int:
    """Trace the front, print and write it."""
    from fivebar_pin.balancing import pareto

    integer("--points", chosen.points, least=2, most=_MOST_POINTS)
    out = check_new(chosen.out, overwrite=False) if chosen.out is not None else None
    chain = load_any(chosen.path, chosen.gravity)
    options = _options(chosen, chain, motion_along(chain, chosen.motion))
    console = _tables.console()
    with _tables.progress().status("tracing the front"):
        front = pareto(chain, chosen.kind, chosen.first, chosen.second, chosen.points, **options)
    if out is not None:
        columns = [(chosen.first, front.values[:, 0]), (chosen.second, front.values[:, 1])]
        write_file(out, _output.columns_text(columns), overwrite=False)
    pair = (chosen.first, chosen.second)
    rows = [[figures(d.terms[name], d.scale(name), digits=6) for name in pair] for d in front.designs]
    _tables.table(console, f"{chain.name}: {chosen.kind} balance", (chosen.first, chosen.second), rows)
    _tables.written(console, () if out is None else (out,))
    return 0


def _common(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", help="URDF with sidecar, MJCF, linkage file, folder, or a shipped mechanism's name")
    parser.add_argument(
        "--kind", choices=_KINDS, metavar="KIND", default="force", help="what is to vanish: %(choices)s [force]"
    )
    add_gravity(parser)
    parser.add_argument(
        "--along",
        type=float,
        nargs=3,
        metavar=("X", "Y", "Z"),
        help="static balance for gravity along this direction only [any direction]",
    )


def _designing(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--mode", choices=_MODES, metavar="MODE", default="add", help="what may change: %(choices)s [add]"
    )
    parser.add_argument("--bodies", nargs="+", metavar="JOINT", help="bodies that may change, by joint [all]")
    parser.add_argument("--radius", type=float, help="material lies within this distance of each joint [m]")
    parser.add_argument(
        "--masses", type=float, nargs=2, metavar=("LOW", "HIGH"), help="bounds on each added mass or new body [kg]"
    )
    parser.add_argument("--remove", nargs="+", default=(), metavar="JOINT", help="bodies that may lose material too")
    parser.add_argument(
        "--material", default="steel", help="nothing is denser: a name, kg/m3, or 'none' for points of mass [steel]"
    )
    parser.add_argument("--thickness", type=float, help="of flat material [m] [a fifth of the mechanism's length]")
    parser.add_argument(
        "--solver", choices=_SOLVERS, metavar="NAME", help="of the conic program: %(choices)s [the first of them]"
    )
    _branch(parser)


def _branch(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--motion", metavar="CSV", help="motion of the actuated joints; unless given, they sway")
    parser.add_argument(
        "--branch",
        choices=("all", "motion"),
        default="all",
        help="assembly modes: all, or the motion's [all]",
    )


def _direction(chosen: argparse.Namespace, chain: ClosedChain) -> Any:
    """Return the gravity of static balance: springs are held by the weight that there is, others by any."""
    if chosen.along is None:
        return "model" if chosen.kind == "static" and chain.springs else "any"
    if chosen.kind != "static":
        raise InvalidInputError("--along", chosen.along, "has a meaning for --kind static only")
    if chain.springs:
        raise InvalidInputError("--along", chosen.along, "has no size to hold springs by", "Pass --gravity X Y Z.")
    return chosen.along


def _options(chosen: argparse.Namespace, chain: ClosedChain, trajectory: Trajectory) -> dict[str, Any]:
    from fivebar_pin.balancing import Ball

    return {
        "mode": chosen.mode,
        "bodies": chosen.bodies,
        "region": None if chosen.radius is None else Ball(chosen.radius),
        "material": _material(chosen),
        "thickness": chosen.thickness,
        "masses": None if chosen.masses is None else tuple(chosen.masses),
        "remove": chosen.remove,
        "motions": [trajectory],
        "gravity": _direction(chosen, chain),
        "near": trajectory.q[0] if chosen.branch == "motion" else None,
        **({} if chosen.solver is None else {"solver": chosen.solver}),
    }


def _material(chosen: argparse.Namespace) -> str | float | None:
    if chosen.material == "none":
        return None
    try:
        return float(chosen.material)
    except ValueError:
        return str(chosen.material)


def _piece(chosen: argparse.Namespace, chain: ClosedChain) -> Any:
    """Return what the counterweights are made as, or None for any material."""
    from fivebar_pin.balancing.pieces import piece_of

    if chosen.realise is None:
        if chosen.arm is not None:
            raise InvalidInputError("--arm", chosen.arm, "has a meaning with --realise only")
        return None
    material = _material(chosen)
    if material is None:
        raise InvalidInputError("--material", chosen.material, "cannot be made: counterweights have a density")
    return piece_of(chain, chosen.realise, material, chosen.thickness, chosen.arm)


def _pairs(option: str, words: list[str] | None) -> list[tuple[str, float | None]]:
    """Read NAME or NAME=NUMBER."""
    out: list[tuple[str, float | None]] = []
    for word in words or []:
        name, equals, number = word.partition("=")
        try:
            out.append((name, float(number) if equals else None))
        except ValueError:
            raise InvalidInputError(option, word, "must be NAME=NUMBER") from None
    return out


def _given(option: str, name: str, value: float | None) -> float:
    if value is None:
        raise InvalidInputError(option, name, "must be NAME=NUMBER")
    return value


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
