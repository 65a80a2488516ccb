"""The whole mechanism from the motion of its actuated joints."""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, finite, integer, number, seal
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import AssemblyError, InvalidInputError, SingularityError
from fivebar_pin.kinematics.assemble import assemble_near, assemble_somewhere
from fivebar_pin.kinematics.follow import follow
from fivebar_pin.mechanism.closing import CLOSED, most_open, residual_of
from fivebar_pin.mechanism.idle import at_rest
from fivebar_pin.mechanism.loops import Loops, loops_of, open_message
from fivebar_pin.mechanism.mobility import SLACK
from fivebar_pin.mechanism.per_chain import once_per_chain
from fivebar_pin.mechanism.prepared import prepared_of
from fivebar_pin.motion import Motion
from fivebar_pin.trajectory import Trajectory

__all__ = ["drive"]


@finite()
def drive(
    chain: ClosedChain,
    motion: Motion,
    near: npt.ArrayLike | None = None,
    *,
    tolerance: float = CLOSED,
    limits: Literal["check", "ignore"] = "check",
    threads: int | None = None,
) -> Trajectory:
    """Move the whole mechanism from the motion of its actuated joints, on one assembly mode.

    Args:
        chain: the mechanism.
        motion: of the actuated joints, columns in the order of `chain.actuated`.
        near: configuration (nq,) that picks the assembly mode, see `assemble`.
        tolerance: closure residual to reach [m or rad; relative to the chain's length above 1 m].
        limits: whether the joint limits of the model are checked.
        threads: at most so many at once, for long motions; as many as there are processors unless given. The result
            is the same to the last digit.

    Returns:
        q, v, a of all joints, consistent with each other, the complement N and the closure residual.

    Raises:
        AssemblyError: a sample out of reach; names sample, time, closure and gap.
        SingularityError: the motion meets a type 2 singularity; names sample and time.
        InvalidInputError: motion of the wrong width, joint limits passed, motion left undetermined.
    """
    number("tolerance", tolerance, positive=True)
    if threads is not None:
        integer("threads", threads, least=1)
    chain = at_rest(chain)
    loops = loops_of(chain)
    loops.require_determined()
    if motion.na != chain.na:
        raise InvalidInputError(
            "motion columns", motion.na, f"must be {chain.na}, one for each of {', '.join(chain.actuated)}"
        )
    try:
        if near is None:
            q0 = assemble_somewhere(chain, motion.q[0], tolerance=tolerance)
        else:
            q0 = assemble_near(chain, motion.q[0], checked("near", near, (chain.nq,)), tolerance)
        found = follow(loops, prepared_of(chain), q0, (motion.q, motion.v, motion.a), threads)
        _require_closed(loops, found.q, found.gap, tolerance)
    except (AssemblyError, SingularityError) as error:
        raise _with_time(error, motion) from None
    if limits == "check":
        _check_limits(chain, found.q, motion)
    seal((found.q, found.v, found.a, found.N, found.gap))
    return Trajectory(motion.t, found.q, found.v, found.a, found.N, found.gap)


def _require_closed(loops: Loops, q: Array, gap: Array, tolerance: float) -> None:
    """Raise where round-off leaves a sample further open than asked for."""
    worst = int(gap.argmax())
    if not gap[worst] <= most_open(loops, tolerance):
        error = open_message(loops, residual_of(loops, q[worst, None])[0], "at these actuated coordinates")
        error.sample = worst
        raise error


@once_per_chain
def _limits(chain: ClosedChain) -> tuple[Array, Array]:
    """Return the limits of the coordinates (nq,), a little wider than the model has them."""
    return np.array(chain.model.lowerPositionLimit) - SLACK, np.array(chain.model.upperPositionLimit) + SLACK


def _check_limits(chain: ClosedChain, q: Array, motion: Motion) -> None:
    lower, upper = _limits(chain)
    outside = (q < lower) | (q > upper)
    if np.count_nonzero(outside):
        lower, upper = chain.model.lowerPositionLimit, chain.model.upperPositionLimit
        k, i = (int(b) for b in np.argwhere(outside)[0])
        owner = int(np.searchsorted(np.array(chain.model.idx_qs)[1:], i, side="right"))
        raise InvalidInputError(
            f"joint {chain.model.names[owner]} at sample {k} (t = {motion.t[k]:.6g} s)",
            float(q[k, i]),
            f"must stay within its limits [{lower[i]:.6g}, {upper[i]:.6g}]",
            "Change the motion, or pass limits='ignore'.",
        )


def _with_time(error: AssemblyError | SingularityError, motion: Motion) -> AssemblyError | SingularityError:
    """Say at which sample and time it happened."""
    k = error.sample if error.sample is not None else 0
    error.sample, error.time = k, float(motion.t[k])
    error.args = (f"sample {k} (t = {motion.t[k]:.6g} s): {error.args[0]}",)
    return error
