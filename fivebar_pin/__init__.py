"""Closed-chain dynamics and balancing on Pinocchio.

    import fivebar_pin as fb

    chain = fb.load("robot.urdf")                       # open tree + sidecar with the loop closures
    trajectory = fb.drive(chain, motion)                # the whole mechanism from its actuated joints
    loads = fb.inverse_dynamics(chain, trajectory)      # torque, shaking force and moment, reactions

Sub-packages, imported when first used: `fb.paper` (the planar five-bar in closed form), `fb.balancing`, `fb.io`,
`fb.viz`.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from fivebar_pin import motion
from fivebar_pin.chain import ClosedChain, Visual
from fivebar_pin.closures import Closure, ClosureKind
from fivebar_pin.diagnosis import Diagnosis, diagnose
from fivebar_pin.dynamics import Loads, inverse_dynamics
from fivebar_pin.errors import FiveBarPinError
from fivebar_pin.kinematics import assemble, assembly_modes, closure_residual, complement, drive
from fivebar_pin.motion import Motion
from fivebar_pin.simulation import JointSpring, Spring, energy_balance, forward_dynamics, simulate
from fivebar_pin.trajectory import Trajectory

if TYPE_CHECKING:
    from fivebar_pin import balancing, io, paper, viz
    from fivebar_pin.balancing import BalanceConditions, Design, balance, balance_conditions, pareto, score
    from fivebar_pin.io import load, save

__all__ = [
    "BalanceConditions",
    "ClosedChain",
    "Closure",
    "ClosureKind",
    "Design",
    "Diagnosis",
    "FiveBarPinError",
    "JointSpring",
    "Loads",
    "Motion",
    "Spring",
    "Trajectory",
    "Visual",
    "assemble",
    "assembly_modes",
    "balance",
    "balance_conditions",
    "balancing",
    "closure_residual",
    "complement",
    "diagnose",
    "drive",
    "energy_balance",
    "forward_dynamics",
    "inverse_dynamics",
    "io",
    "load",
    "motion",
    "paper",
    "pareto",
    "save",
    "score",
    "simulate",
    "viz",
]

_PACKAGES = ("balancing", "io", "paper", "viz")
_LATE = {
    "BalanceConditions": "balancing",
    "Design": "balancing",
    "balance": "balancing",
    "balance_conditions": "balancing",
    "load": "io",
    "pareto": "balancing",
    "save": "io",
    "score": "balancing",
}


def __getattr__(name: str) -> Any:
    if name in _PACKAGES:
        return importlib.import_module(f"fivebar_pin.{name}")
    if name in _LATE:
        return getattr(importlib.import_module(f"fivebar_pin.{_LATE[name]}"), name)
    raise AttributeError(f"module 'fivebar_pin' has no attribute {name!r}")
