"""Closed configurations to start from."""

from __future__ import annotations

from contextlib import suppress

import numpy.typing as npt

from fivebar_pin._arrays import Array, checked
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics.forward import require_closed
from fivebar_pin.errors import AssemblyError, InvalidInputError, SingularityError
from fivebar_pin.kinematics import assemble
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.loops import loops_of

__all__ = ["require_standing", "start_of"]


def start_of(chain: ClosedChain, near: npt.ArrayLike | None) -> Array:
    """Return a closed configuration (nq,): the one given, or the first named one, itself or assembled near it.

    Raises:
        AssemblyError, SingularityError: there is none.
    """
    import pinocchio as pin

    given = list(chain.references.values()) if near is None else [checked("near", near, (chain.nq,))]
    for q in given:
        with suppress(InvalidInputError):
            require_standing(chain, q)
            return q
    loops = loops_of(chain)
    if near is not None:
        return assemble(chain, loops.actuated_of(given[0][None])[0], given[0])
    for q in given:
        with suppress(AssemblyError, SingularityError):
            return assemble(chain, loops.actuated_of(q[None])[0], q)
    return assemble(chain, loops.actuated_of(pin.neutral(chain.model)[None])[0])


def require_standing(chain: ClosedChain, q: Array) -> None:
    """Raise unless q (nq,) closes the loops, its hinges the right way round.

    Raises:
        InvalidInputError: names the closure that is open.
    """
    loops = loops_of(chain)
    here = Configurations(loops, q[None])
    require_closed(here)
    if loops.m and loops.opposed(here.seen)[0]:
        raise InvalidInputError("q", q, "closes a hinge with its axes against each other", "Use assemble.")
