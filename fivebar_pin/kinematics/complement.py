"""The natural orthogonal complement written in the joint coordinates of the tree [Angeles and Lee 1988].

With the closure rows c(q) = 0, J = dc/dq and the coordinates split into actuated and passive,

    J_a v_a + J_p v_p = 0      =>   v = N v_a,   N = [1; -J_p^+ J_a],   J N = 0
    J a + (dJ/dt) v = 0        =>   a_p = -J_p^+ (J_a a_a + (dJ/dt) v)
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, finite, numeric
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError, SingularityError
from fivebar_pin.mechanism.loops import Loops, loops_of
from fivebar_pin.mechanism.passive import PassiveMap
from fivebar_pin.mechanism.rank import SINGULAR

__all__ = ["complement", "require_regular", "whole_complement"]


_INDEPENDENT = 1e-7  # scaled closure rate at unit actuated speed above which the motors are in each other's way [-]


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
    loops = loops_of(chain)
    loops.require_determined()
    Q = numeric("q", q)
    single = Q.ndim == 1
    Q = checked("q", np.atleast_2d(Q), (None, chain.nq))
    poses = loops.tree.poses(Q)
    blocks = loops.blocks(poses, loops.pairs(poses))
    passive = loops.passive_map(blocks)
    require_regular(passive.sigma)
    N = whole_complement(loops, passive, blocks, Q.shape[0])
    return np.asarray(N[0]) if single else N


def whole_complement(loops: Loops, passive: PassiveMap, blocks: list[Array], n: int) -> Array:
    """Return N (n, nv, na): ones for the actuated coordinates, -J_p^+ J_a for the passive ones."""
    N = np.zeros((n, loops.tree.nv, loops.actuated.size))
    N[:, loops.actuated, np.arange(loops.actuated.size)] = 1.0
    if loops.m:
        N[:, loops.passive] = passive.complement(blocks)
        for group, J in zip(passive.groups, blocks, strict=True):
            if not group.is_square:
                _require_independent(loops, loops.row_scale[group.rows, None] * J, N[:, group.columns])
    return N


def _require_independent(loops: Loops, J: Array, N: Array) -> None:
    """Raise unless J N = 0: more rows than passive coordinates may ask too much of the actuated ones."""
    left = np.abs(np.matmul(J, N * loops.column_scale[loops.actuated])).max(initial=0.0)
    if left > _INDEPENDENT * max(1.0, float(np.abs(N).max(initial=0.0))):
        raise InvalidInputError(
            "actuated joints",
            f"{loops.actuated.size} for {loops.tree.nv} coordinates",
            "are not independent: the closures tie them to each other",
            "Actuate fewer joints; diagnose(chain) lists the sets that determine the motion.",
        )


def require_regular(sigma: Array) -> None:
    worst = int(np.argmin(sigma)) if sigma.size else 0
    if sigma.size and sigma[worst] < SINGULAR:
        raise SingularityError(
            f"configuration {worst} is at a type 2 singularity: the actuated joints do not determine the passive ones "
            f"(smallest scaled singular value {sigma[worst]:.2g}, must be above {SINGULAR:g})",
            sigma=float(sigma[worst]),
            sample=worst,
        )
