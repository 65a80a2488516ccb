"""Arguments that the commands about balancing share, and what they mean to the library."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from importlib import import_module
from typing import Any

from fivebar_pin.chain import ClosedChain
from fivebar_pin.cli._load import add_reading
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.trajectory import Trajectory


class _Late:
    """Choices that the library knows, asked for only where they are needed: help, and what was chosen."""

    def __init__(self, module: str, table: str) -> None:
        self._module, self._table = module, table

    def __iter__(self) -> Iterator[str]:
        return iter(getattr(import_module(f"fivebar_pin.balancing.{self._module}"), self._table))

    def __contains__(self, word: object) -> bool:
        return word in tuple(self)


KINDS = _Late("conditions", "KINDS")
_MODES = _Late("variables", "MODES")
SHAPES = _Late("pieces", "SHAPES")
_SOLVERS = _Late("solvers", "SOLVERS")


def add_common(parser: argparse.ArgumentParser) -> None:
    """Add what conditions and designs take: the mechanism, the kind of balance, gravity."""
    parser.add_argument("path", help="URDF with sidecar, MJCF, linkage file, folder, or a shipped mechanism's name")
    parser.add_argument(
        "--kind", choices=KINDS, metavar="KIND", default="force", help="what is to vanish: %(choices)s [force]"
    )
    add_reading(parser)
    parser.add_argument(
        "--along",
        type=float,
        nargs=3,
        metavar=("X", "Y", "Z"),
        help="static balance for gravity along this direction only [any direction]",
    )


def add_designing(parser: argparse.ArgumentParser) -> None:
    """Add what designs take besides: what may change, and within which bounds."""
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
    add_branch(parser)


def add_branch(parser: argparse.ArgumentParser) -> None:
    """Add the motion, and whether its assembly mode alone is meant."""
    parser.add_argument("--motion", metavar="CSV", help="motion of the actuated joints; unless given, they sway")
    parser.add_argument(
        "--branch", choices=("all", "motion"), default="all", help="assembly modes: all, or the motion's [all]"
    )


def direction(chosen: argparse.Namespace, chain: ClosedChain) -> Any:
    """Return the gravity of static balance: springs are held by the weight that there is, others by any."""
    if chosen.along is None:
        return "model" if chosen.kind == "static" and chain.springs else "any"
    if chosen.kind != "static":
        raise InvalidInputError("--along", chosen.along, "has a meaning for --kind static only")
    if chain.springs:
        raise InvalidInputError("--along", chosen.along, "has no size to hold springs by", "Pass --gravity X Y Z.")
    return chosen.along


def options_of(chosen: argparse.Namespace, chain: ClosedChain, trajectory: Trajectory) -> dict[str, Any]:
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
        "gravity": direction(chosen, chain),
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


def piece_of_words(chosen: argparse.Namespace, chain: ClosedChain) -> Any:
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


def pairs(option: str, words: list[str] | None) -> list[tuple[str, float | None]]:
    """Read NAME or NAME=NUMBER."""
    out: list[tuple[str, float | None]] = []
    for word in words or []:
        name, equals, number = word.partition("=")
        try:
            out.append((name, float(number) if equals else None))
        except ValueError:
            raise InvalidInputError(option, word, "must be NAME=NUMBER") from None
    return out


def given_number(option: str, name: str, value: float | None) -> float:
    if value is None:
        raise InvalidInputError(option, name, "must be NAME=NUMBER")
    return value
