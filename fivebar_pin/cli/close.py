"""`fivebar-pin close`: find the loops of an open URDF or SDF and write the sidecar that closes them."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fivebar_pin._files import as_path, check_new, write_file
from fivebar_pin.chain import ClosedChain
from fivebar_pin.cli import _tables
from fivebar_pin.errors import FileFormatError, InvalidInputError

if TYPE_CHECKING:
    from rich.console import Console

    from fivebar_pin.closures import Closure
    from fivebar_pin.diagnosis import Diagnosis, Proposal

_MOST_LEFT = 12
"""Candidates that were not chosen of which the reason is printed [-]."""
_CLOSED = 1e-9
"""Closure residual up to which the configuration found is worth keeping [m or rad]."""
_MOST_BALLS = 5
"""Joints called balls that are named [-]."""
_BY_HAND = "state a pair by hand: --pair FRAME FRAME [--kind 3d|6d|revolute]"


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the parser."""
    parser = commands.add_parser(
        "close",
        help="find the loops of an open URDF or SDF, propose motors and write the sidecar",
        description="Look for frames named for a loop, one point named on two bodies, and frames and hinges that "
        "coincide; write the closures and motors as the sidecar beside the file. Exit code 1 when nothing is found, "
        "or when check would refuse what is written.",
    )
    parser.add_argument(
        "path",
        help="URDF, SDF or xacro file, or a folder with one; what it closes itself and what a sidecar says is kept",
    )
    parser.add_argument("--out", metavar="PATH", help="sidecar to write; the file's name ending in .yaml unless given")
    parser.add_argument("--overwrite", action="store_true", help="replace an existing sidecar")
    parser.add_argument(
        "--kind", metavar="K", help="kind of all closures (3d, 6d, revolute); the one that suits each loop unless given"
    )
    parser.add_argument(
        "--pair", nargs=2, action="append", default=[], metavar="FRAME", help="join these frames, and nothing else"
    )
    parser.add_argument("--motor", nargs="+", default=[], metavar="NAME", help="drive these joints, and no other")
    parser.add_argument("--dry-run", action="store_true", help="print the proposal, write nothing")
    parser.set_defaults(run=run)


def run(chosen: argparse.Namespace) -> int:
    """Propose, print and write."""
    from fivebar_pin import io
    from fivebar_pin.diagnosis import diagnose, propose_closures, propose_motors
    from fivebar_pin.io._find import sidecar_file, stem
    from fivebar_pin.io._load import stated_closures

    tree = _tree(chosen.path)
    there = sidecar_file(tree)
    file = as_path(chosen.out) if chosen.out is not None else there or tree.with_name(f"{stem(tree)}.yaml")
    if not chosen.dry_run:
        check_new(file, overwrite=chosen.overwrite)
    own, gears = stated_closures(tree)
    chain = io.load(tree, closures=(*gears, *own), actuated=())
    console = _tables.console()
    proposals = propose_closures(chain, pairs=[(a, b) for a, b in chosen.pair], kind=chosen.kind)
    _closures_table(console, chain, proposals)
    closures = tuple(p.closure for p in proposals if p.chosen)
    if not closures and not chain.closures:
        raise _nothing(chain, proposals)
    closed = replace(chain, closures=(*gears, *closures, *own))
    if chain.closures:
        console.print(f"stated already: {', '.join(c.name for c in chain.closures)}", soft_wrap=True)
    motors = {name: "given" for name in chosen.motor} or {m.joint: m.reason for m in propose_motors(closed)}
    closed = closed.with_actuated(motors)
    _tables.table(console, "motors", ("joint", "why"), list(motors.items()))
    diagnosis = diagnose(closed)
    console.print(f"check: {_verdict(diagnosis)}", soft_wrap=True)
    if not diagnosis.ok:
        _tell_of_balls(console, chain)
    if not chosen.dry_run:
        text = _text(there, (*gears, *closures), closed.actuated, diagnosis)
        _tables.written(console, (write_file(file, text, overwrite=chosen.overwrite),))
    return 0 if diagnosis.ok else 1


def _tree(path: str) -> Path:
    """Return the file of a tree that is meant."""
    from fivebar_pin.io._find import TREES, mechanism_file

    file = mechanism_file(as_path(path))
    if file.suffix.lower() not in TREES:
        raise FileFormatError(file, f"is none of {', '.join(TREES)}; a sidecar closes the loops of such a tree only")
    return file


def _closures_table(console: Console, chain: ClosedChain, proposals: Sequence[Proposal]) -> None:
    chosen = [p for p in proposals if p.chosen]
    left = [p for p in proposals if not p.chosen]
    if chosen:
        rows = [
            (c.name, c.kind.value, " ".join(c.joins), f"{p.gap:.2g}", f"{p.angle:.2g}", p.sure, p.reason)
            for p in chosen
            for c in (p.closure,)
        ]
        headings = ("closure", "kind", "frames", "gap [m]", "angle [rad]", "sure", "why")
        _tables.table(console, f"closures of {chain.name}", headings, rows)
    if left:
        rows_left = [(" ".join(p.closure.joins), p.closure.kind.value, p.reason) for p in left[:_MOST_LEFT]]
        _tables.table(console, "not proposed", ("frames", "kind", "why not"), rows_left)
        if len(left) > _MOST_LEFT:
            console.print(f"  ... and {len(left) - _MOST_LEFT} more")


def _nothing(chain: ClosedChain, proposals: Sequence[Proposal]) -> InvalidInputError:
    rule = (
        "shows no loop: frames named for one (closedloop1_A and closedloop1_B), one point named on two bodies "
        "(B_coupler and B_rocker), frames or hinges that coincide where a branch ends, and the only two open ends "
        "were looked for" + (f"; the {len(proposals)} found would make no mechanism" if proposals else "")
    )
    return InvalidInputError("tree", chain.name, rule, f"{_BY_HAND[0].upper()}{_BY_HAND[1:]}.")


def _verdict(diagnosis: Diagnosis) -> str:
    """Return in one line what `check` says."""
    if not diagnosis.ok:
        return f"NOT ok: {diagnosis.problems[0].text}"
    more = f", {len(diagnosis.problems)} finding(s)" if diagnosis.problems else ""
    return f"ok, mobility {diagnosis.mobility}, {diagnosis.actuation.value}{more}"


def _tell_of_balls(console: Console, chain: ClosedChain) -> None:
    """Say which hinges are called balls: URDF has no such joint, and without it loops may not close."""
    hinges = [name for name in chain.joints if chain.model.nvs[chain.model.getJointId(name)] == 1]
    balls = [name for name in hinges if "spherical" in name.lower() or "ball" in name.lower()]
    if balls:
        more = f" and {len(balls) - _MOST_BALLS} more" if len(balls) > _MOST_BALLS else ""
        text = f"note: {', '.join(balls[:_MOST_BALLS])}{more} turn about one axis in the URDF"
        console.print(f"{text}; joint_name and joint_type in a sidecar make SPHERICAL ones of them", soft_wrap=True)


def _text(there: Path | None, closures: Sequence[Closure], actuated: Sequence[str], diagnosis: Diagnosis) -> str:
    """Return the sidecar: closures, motors, a closed configuration, and what the one there says besides."""
    from fivebar_pin.io._sidecar import Sidecar, dump_sidecar, read_sidecar

    old = Sidecar() if there is None else read_sidecar(there)
    configurations = dict(old.configurations)
    if diagnosis.gap < _CLOSED and not configurations:
        configurations["closed"] = [float(x) for x in np.array(diagnosis.q)]
    new = replace(old, closures=tuple(closures), actuated=tuple(actuated), configurations=configurations)
    return dump_sidecar(new)
