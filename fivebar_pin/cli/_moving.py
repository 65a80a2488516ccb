"""Moving a mechanism about which nothing is known but its file."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from fivebar_pin import motion as laws
from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import AssemblyError, InvalidInputError, SingularityError
from fivebar_pin.kinematics import assemble, drive
from fivebar_pin.mechanism.closing import CLOSED, closed_enough, residual_of
from fivebar_pin.mechanism.loops import loops_of, open_message
from fivebar_pin.mechanism.mobility import first_closed, inside_limits
from fivebar_pin.trajectory import Trajectory


def motion_along(chain: ClosedChain, file: str | None, *, stand: bool = False) -> Trajectory:
    """Move the chain as the file says, else let its motors sway as far as they can, else let it stand.

    Args:
        chain: the mechanism.
        file: of the motion.
        stand: let it stand, too, where motors do not determine how it moves.
    """
    if file is not None:
        return drive(chain, laws.from_file(file, chain.actuated))
    q0 = standing(chain)
    try:
        swaying = sway(chain, q0)
        if swaying is not None:
            return swaying
        at = loops_of(chain).actuated_of(q0[None])
        rest = np.zeros((1, chain.na))
        return drive(chain, laws.Motion(np.zeros(1), at, rest, rest), near=q0, limits="ignore")
    except InvalidInputError:
        if not stand:
            raise
        still, N = np.zeros((1, chain.nv)), np.full((1, chain.nv, chain.na), np.nan)
        return Trajectory(np.zeros(1), q0[None], still, still, N, np.zeros(1))


def standing(chain: ClosedChain) -> Array:
    """Return some assembled configuration: the first that keeps the joint limits, the model's own references first.

    Raises:
        AssemblyError: none was found.
    """
    import pinocchio as pin

    loops, found = loops_of(chain), list[Array]()
    for q in [*chain.references.values(), pin.neutral(chain.model)]:
        with suppress(AssemblyError, SingularityError, InvalidInputError):
            found.append(assemble(chain, loops.actuated_of(q[None])[0], q))
            if inside_limits(chain, found[-1][None])[0]:
                return found[-1]
    q, gap = first_closed(chain, 0, CLOSED)
    closed = bool(closed_enough(loops, gap, CLOSED))
    if closed and (inside_limits(chain, q[None])[0] or not found):
        return q
    if not found:
        raise open_message(loops, residual_of(loops, q[None])[0], "anywhere that was looked")
    return found[0]


def sway(chain: ClosedChain, q0: Array, *, samples: int = 121, period: float = 2.0) -> Trajectory | None:
    """Swing every motor about q0, each at its own pace, with the largest amplitude that the mechanism allows."""
    if not chain.na:
        return None
    loops = loops_of(chain)
    t = np.linspace(0.0, period, samples)
    at = loops.actuated_of(q0[None])[0].tolist()
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
