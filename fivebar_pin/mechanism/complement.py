"""The natural orthogonal complement and the rates that follow from the actuated ones [Angeles and Lee 1988].

With the closure rows c(q) = 0, J = dc/dq and the coordinates split into actuated and passive,

    J_a v_a + J_p v_p = 0      =>   v = N v_a,   N = [1; -J_p^+ J_a],   J N = 0
    J a + (dJ/dt) v = 0        =>   a_p = -J_p^+ (J_a a_a + (dJ/dt) v)
"""

from __future__ import annotations

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.errors import InvalidInputError, SingularityError
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.loops import Loops
from fivebar_pin.mechanism.rank import SINGULAR, raised

__all__ = ["complement_of", "rates_of", "require_regular"]


_INDEPENDENT = 1e-7  # scaled closure rate at unit actuated speed above which the motors are in each other's way [-]


def complement_of(here: Configurations) -> Array:
    """Return N (n, nv, na): ones for the actuated coordinates, -J_p^+ J_a for the passive ones; nan where singular.

    Raises:
        InvalidInputError: the closures tie the actuated coordinates to each other.
    """
    loops = here.loops
    N = np.zeros((here.q.shape[0], loops.tree.nv, loops.actuated.size))
    N[:, loops.actuated, np.arange(loops.actuated.size)] = 1.0
    if loops.m:
        N[:, loops.passive] = here.passive.complement(here.blocks)
        for group, J in zip(here.passive.groups, here.blocks, strict=True):
            if not group.is_square:
                _require_independent(loops, loops.row_scale[group.rows, None] * J, N[:, group.columns])
    return N


def rates_of(here: Configurations, va: Array, aa: Array) -> tuple[Array, Array, Array]:
    """Return v, a (n, nv) and N (n, nv, na) from the rates of the actuated coordinates (n, na)."""
    loops, N = here.loops, complement_of(here)
    v = np.matmul(N, va[..., None])[..., 0]
    a = np.matmul(N, aa[..., None])[..., 0]
    if loops.m:
        a[:, loops.passive] -= here.passive.solve(loops.drift(here.q, v))
    return v, a, N


def require_regular(sigma: Array) -> None:
    """Raise where the actuated joints do not determine the passive ones.

    Args:
        sigma: `PassiveMap.sigma` (n,).

    Raises:
        SingularityError: names the configuration nearest to singular.
    """
    worst = int(np.argmin(sigma)) if sigma.size else 0
    if sigma.size and sigma[worst] < SINGULAR:
        raise SingularityError(
            f"configuration {worst} is at a type 2 singularity: the actuated joints do not determine the passive ones "
            f"(smallest scaled singular value {sigma[worst]:.2g}, must be above {SINGULAR:g})",
            sigma=float(sigma[worst]),
            sample=worst,
        )


def _require_independent(loops: Loops, J: Array, N: Array) -> None:
    """Raise unless J N = 0: more rows than passive coordinates may ask too much of the actuated ones."""
    left = np.abs(np.matmul(J, N * loops.column_scale[loops.actuated])).max(initial=0.0)
    least = raised(_INDEPENDENT, loops.misfit)
    if left > least * max(1.0, float(np.abs(N).max(initial=0.0))):
        raise InvalidInputError(
            "actuated joints",
            f"{loops.actuated.size} for {loops.tree.nv} coordinates",
            "are not independent: the closures tie them to each other",
            "Actuate fewer joints; diagnose(chain) lists the sets that determine the motion.",
        )
