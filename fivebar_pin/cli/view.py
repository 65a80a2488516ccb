"""`fivebar-pin view`: a mechanism in the browser."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

import numpy as np

from fivebar_pin import motion as laws
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics import inverse_dynamics
from fivebar_pin.errors import AssemblyError, SingularityError
from fivebar_pin.kinematics import assemble, drive
from fivebar_pin.trajectory import Trajectory

if TYPE_CHECKING:
    from fivebar_pin.viz.scene import Shown


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the parser."""
    parser = commands.add_parser("view", help="show a mechanism in the browser, or write it as one HTML file")
    parser.add_argument("path", help="URDF with sidecar, MJCF, folder, or the name of a shipped mechanism")
    parser.add_argument("--motion", metavar="CSV", help="motion of the actuated joints (t, q_*, v_*, a_*)")
    parser.add_argument("--html", metavar="FILE", help="write this HTML file instead of opening the browser")
    parser.add_argument("--speed", type=float, default=1.0, help="playing speed over real time [1]")
    parser.add_argument("--port", type=int, help="port of the live view (loopback only); a free one unless given")
    parser.add_argument("--overwrite", action="store_true", help="replace an existing file")
    parser.set_defaults(run=run)


def run(chosen: argparse.Namespace) -> int:
    """Load, move and show the mechanism."""
    from fivebar_pin import viz
    from fivebar_pin.cli._load import load_any

    chain = load_any(chosen.path)
    shown = [_shown(chain, chosen.motion)]
    if chosen.html:
        viz.html(chosen.html, shown, speed=chosen.speed, overwrite=chosen.overwrite)
        return 0
    viz.view(shown, port=chosen.port, speed=chosen.speed)
    return 0


def _shown(chain: ClosedChain, file: str | None) -> Shown:
    """Move the chain as the file says, else let its motors sway as far as they can, else let it stand."""
    from fivebar_pin.viz import Shown

    if file:
        trajectory = drive(chain, laws.from_file(file))
        return Shown(chain, trajectory, inverse_dynamics(chain, trajectory))
    q0 = _standing(chain)
    swaying = sway(chain, q0)
    if swaying is None:
        return Shown.at(chain, q0)
    return Shown(chain, swaying, inverse_dynamics(chain, swaying))


def _standing(chain: ClosedChain) -> np.ndarray:
    """Return some assembled configuration: the model's own reference if it has one that closes."""
    import pinocchio as pin

    from fivebar_pin._loops import loops_of

    loops = loops_of(chain)
    for q in [*chain.references.values(), pin.neutral(chain.model)]:
        at = np.array([loops.tree.coordinate(q[None], int(k))[0] for k in chain.actuated_index])
        try:
            return assemble(chain, at, q)
        except (AssemblyError, SingularityError):
            continue
    rng = np.random.default_rng(0)
    for _ in range(50):
        try:
            return assemble(chain, rng.uniform(-np.pi, np.pi, chain.na) * loops.column_scale[chain.actuated_index])
        except AssemblyError as error:
            last = error
    raise last


def sway(chain: ClosedChain, q0: np.ndarray, *, samples: int = 121, period: float = 2.0) -> Trajectory | None:
    """Swing every motor about q0, each at its own pace, with the largest amplitude that the mechanism allows."""
    from fivebar_pin._loops import loops_of

    if not chain.na:
        return None
    loops = loops_of(chain)
    t = np.linspace(0.0, period, samples)
    at = [float(loops.tree.coordinate(q0[None], int(k))[0]) for k in chain.actuated_index]
    scale = loops.column_scale[chain.actuated_index]
    for amplitude in (0.8, 0.5, 0.3, 0.15, 0.05):
        swings = [
            laws.harmonic(t, x, amplitude * s, period=period / (k + 1), phase=-0.5 * np.pi)
            for k, (x, s) in enumerate(zip(at, scale, strict=True))
        ]
        try:
            return drive(chain, laws.combine(*swings), near=q0, limits="ignore")
        except (AssemblyError, SingularityError):
            continue
    return None
