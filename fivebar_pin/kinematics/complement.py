"""The natural orthogonal complement, as asked for at configurations; the equations are in `mechanism.complement`."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, finite, numeric
from fivebar_pin.chain import ClosedChain
from fivebar_pin.mechanism.complement import complement_of, require_regular
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.idle import at_rest
from fivebar_pin.mechanism.loops import loops_of

__all__ = ["complement"]


@finite()
def complement(chain: ClosedChain, q: npt.ArrayLike) -> Array:
    """Return the complement N of the closure Jacobian: v = N v_actuated and J N = 0.

    Args:
        chain: the mechanism.
        q: closed configuration (nq,) or (n, nq).

    Returns:
        N (nv, na) or (n, nv, na), rows in Pinocchio's order, columns in the order of `chain.actuated`.

    Raises:
        SingularityError: the actuated joints do not determine the motion at q.
    """
    loops = loops_of(at_rest(chain))
    loops.require_determined()
    Q = numeric("q", q)
    single = Q.ndim == 1
    here = Configurations(loops, checked("q", np.atleast_2d(Q), (None, chain.nq)))
    require_regular(here.passive.sigma)
    N = complement_of(here)
    return np.asarray(N[0]) if single else N
