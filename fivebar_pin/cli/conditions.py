"""`fivebar-pin conditions`: what the masses must fulfil."""

from __future__ import annotations

import argparse

import numpy as np

from fivebar_pin._arrays import figures
from fivebar_pin.cli import _tables
from fivebar_pin.cli._designing import add_branch, add_common, direction
from fivebar_pin.cli._load import load_any
from fivebar_pin.cli._moving import motion_along


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the parser."""
    conditions = commands.add_parser("conditions", help="the balancing conditions of a mechanism")
    add_common(conditions)
    add_branch(conditions)
    conditions.set_defaults(run=run)


def run(chosen: argparse.Namespace) -> int:
    """Find and print the conditions, and how far the mechanism is from them."""
    from fivebar_pin.balancing import balance_conditions

    chain = load_any(chosen)
    near = motion_along(chain, chosen.motion).q[0] if chosen.branch == "motion" else None
    conditions = balance_conditions(chain, chosen.kind, gravity=direction(chosen, chain), near=near)
    console = _tables.console()
    console.print(str(conditions), markup=False, soft_wrap=True)
    residual = float(np.abs(conditions.residual(chain)).max(initial=0.0))
    sizes = np.abs(conditions.matrix) @ np.abs(chain.inertial_parameters.reshape(-1)) + np.abs(conditions.offset)
    words = figures(residual, float(sizes.max(initial=0.0)))
    console.print(f"largest residual of {chain.name} as it is: {words} kg", markup=False)
    return 0
