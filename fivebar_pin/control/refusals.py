"""Why a sample could not be computed, in words; what was asked for, and the place where it failed, stand in memory."""

from __future__ import annotations

import numpy as np

from fivebar_pin._arrays import Array, checked, require_finite
from fivebar_pin.chain import ClosedChain
from fivebar_pin.control.placed import Pushes
from fivebar_pin.control.views import results
from fivebar_pin.dynamics.elastic import spring_forces
from fivebar_pin.dynamics.equations import massless
from fivebar_pin.engine import single
from fivebar_pin.engine.tables import FARTHEST, TARGET, TO, TO_V, Integers
from fivebar_pin.errors import AssemblyError, FiveBarPinError, InvalidInputError, SingularityError, SolverError
from fivebar_pin.kinematics.follow import blocked
from fivebar_pin.mechanism.loops import loops_of

__all__ = ["refusal"]


def refusal(
    chain: ClosedChain, I: Integers, W: Array, status: int, task: int, pushes: Pushes
) -> FiveBarPinError:  # fmt: skip
    """Return the error of a task of `engine.single.sample` that ended with this status."""
    try:
        if status == single.NO_NUMBER:
            _require_numbers(chain, I, W, task, pushes)
        if status == single.LOST:
            there = results(I, W)
            loops, q, v = loops_of(chain), there["q"][None], there["v"][None]
            spring_forces(chain, loops, q, v, loops.tree.poses(q))
        if status == single.BEYOND:
            require_finite("evaluator", results(I, W))
    except (InvalidInputError, SolverError) as error:
        return error
    if status == single.TOO_FAR:
        return _too_far(chain, I, W)
    if status == single.MASSLESS:
        return massless("inertia of the motion")
    return _blocked(chain, I, W, task)


def _require_numbers(chain: ClosedChain, I: Integers, W: Array, task: int, pushes: Pushes) -> None:
    """Raise for what is nan or infinite in what was asked for."""
    given = I[I.size - single.RECORD_SIZE + single.GIVEN]
    places = {"q_actuated": I[TO], "v_actuated": I[TO_V], "tau" if task == single.FORWARD else "a_actuated": given}
    for name, k in places.items():
        checked(name, W[k : k + chain.na], (chain.na,))
    for frame, wrench in zip(pushes.names, pushes.wrenches[0], strict=True):
        checked(f"external[{frame!r}]", wrench, (6,))


def _too_far(chain: ClosedChain, I: Integers, W: Array) -> InvalidInputError:
    step = W[I[TO] : I[TO] + chain.na] - W[I[TARGET] : I[TARGET] + chain.na]
    k = int(np.argmax(np.abs(step) / loops_of(chain).column_scale[chain.actuated_index]))
    return InvalidInputError(
        f"step of {chain.actuated[k]}",
        float(step[k]),
        f"must be below {FARTHEST:g} rad, or lengths of the chain",
        "Go there in several calls, or jump.",
    )


def _blocked(chain: ClosedChain, I: Integers, W: Array, task: int) -> FiveBarPinError:
    standing, x = task == single.STAND, np.array(W[I[TO] : I[TO] + chain.na])
    error = blocked(loops_of(chain), I, W, None if standing else x)
    if isinstance(error, (AssemblyError, SingularityError)) and not standing:
        error.args = (f"on the way to the actuated coordinates {x.tolist()}: {error.args[0]}",)
    return error
