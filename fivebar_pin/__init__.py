"""Closed-chain dynamics and balancing on Pinocchio.

    import fivebar_pin as fb

    chain = fb.load("robot.urdf")                       # open tree + sidecar with the loop closures
    trajectory = fb.drive(chain, motion)                # the whole mechanism from its actuated joints
    loads = fb.inverse_dynamics(chain, trajectory)      # torque, shaking force and moment, reactions
    evaluator = fb.Evaluator(chain)                     # the same one sample at a time, for a controller
    design = fb.balance(chain, "force")                 # the optimal mass distribution, or the proof of none

Sub-packages: `fb.planar` (linkages in their own words), `fb.paper` (the planar five-bar in closed form),
`fb.balancing`, `fb.shipped`, `fb.io`, `fb.viz`. Each is imported when it is first used, so that importing stays cheap
and an interrupted command line can say so.
"""

from __future__ import annotations

import importlib

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from fivebar_pin import balancing, closures, io, motion, paper, planar, shipped, viz
    from fivebar_pin.balancing import BalanceConditions, Design, balance, balance_conditions, pareto, score
    from fivebar_pin.chain import ClosedChain, Visual
    from fivebar_pin.closures import Closure
    from fivebar_pin.control import Evaluator
    from fivebar_pin.diagnosis import Diagnosis, diagnose
    from fivebar_pin.dynamics import Loads, energy_balance, forward_dynamics, inverse_dynamics, reduced_dynamics
    from fivebar_pin.errors import FiveBarPinError
    from fivebar_pin.io import save
    from fivebar_pin.kinematics import assemble, assembly_modes, closure_residual, complement, drive, frame_motion
    from fivebar_pin.motion import Motion
    from fivebar_pin.planar.loading import load
    from fivebar_pin.simulation import simulate
    from fivebar_pin.springs import JointSpring, Spring
    from fivebar_pin.sweeps import sweep
    from fivebar_pin.trajectory import Trajectory

__all__ = [
    "BalanceConditions",
    "ClosedChain",
    "Closure",
    "Design",
    "Diagnosis",
    "Evaluator",
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
    "closures",
    "complement",
    "diagnose",
    "drive",
    "energy_balance",
    "forward_dynamics",
    "frame_motion",
    "inverse_dynamics",
    "io",
    "load",
    "motion",
    "paper",
    "pareto",
    "planar",
    "reduced_dynamics",
    "save",
    "score",
    "shipped",
    "simulate",
    "sweep",
    "viz",
]

_LATE = {
    "balancing": ("BalanceConditions", "Design", "balance", "balance_conditions", "pareto", "score"),
    "chain": ("ClosedChain", "Visual"),
    "closures": ("Closure", "ClosureKind"),
    "control": ("Evaluator",),
    "diagnosis": ("Diagnosis", "diagnose"),
    "dynamics": ("Loads", "energy_balance", "forward_dynamics", "inverse_dynamics", "reduced_dynamics"),
    "errors": ("FiveBarPinError",),
    "io": ("save",),
    "kinematics": ("assemble", "assembly_modes", "closure_residual", "complement", "drive", "frame_motion"),
    "motion": ("Motion",),
    "paper": (),
    "planar": (),
    "planar.loading": ("load",),
    "shipped": (),
    "simulation": ("simulate",),
    "springs": ("JointSpring", "Spring"),
    "sweeps": ("sweep",),
    "trajectory": ("Trajectory",),
    "viz": (),
}


def __getattr__(name: str) -> Any:
    for room, names in _LATE.items():
        if name == room or name in names:
            module = importlib.import_module(f"fivebar_pin.{room}")
            found = module if name == room else getattr(module, name)
            globals()[name] = found
            return found
    raise AttributeError(f"module 'fivebar_pin' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
