"""The equations of motion in the motors' coordinates, compiled, where the motors determine the motion.

M_bar a_a + b = tau,     M_bar = N^T M N,     a = N a_a + a_0                   [Angeles and Lee 1988, (46)]
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import TINY, Array, Immutable
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics.compiled_calls import in_pieces, outside, told_by_closures
from fivebar_pin.engine.tables import unwritten
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.mechanism.prepared import prepared_of

__all__ = ["MotorEquations", "motor_equations"]

_WEAK = 1e-6  # scaled pivot below which the motion is left to the tangent space of the closures [-]
_CLEAR = 0.1  # part of a bound up to which a state keeps it without a closer look [-]


@dataclass(frozen=True, eq=False)
class MotorEquations(Immutable):
    """Equations of motion at a batch of n states.

    Attributes:
        N: complement (n, nv, na).
        inertia: M_bar (n, na, na), symmetric.
        bias: torques of the motors at no accelerations of theirs (n, na) [N m or N].
        rest: accelerations of all joints then, a_0 (n, nv).
    """

    N: Array
    inertia: Array
    bias: Array
    rest: Array


def motor_equations(
    chain: ClosedChain, q: Array, v: Array, external: Mapping[str, Array], closed: float, *, driven: bool = False
) -> MotorEquations | None:
    """Return them; None where something is to be looked at more closely.

    That is where the motors do not determine the motion, at or near a type 2 singularity, and where a state comes near
    the bound on what it leaves open.

    Args:
        chain: the mechanism.
        q, v: states (n, nq), (n, nv).
        external: wrenches (n, 6) by frame.
        closed: bound on closure residual and scaled rate of the closures [m, rad or -].
        driven: only the velocities of the motors are given, the others follow.
    """
    if not chain.na or not told_by_closures(chain) or prepared_of(chain).left > _CLEAR * closed:
        return None
    from fivebar_pin.engine.reduced import DRIVEN, GIVEN, OPEN, RATE, STATES, WEAKEST, reduced

    prepared, n, na, nv = prepared_of(chain), len(q), chain.na, chain.nv
    links, points, wrenches = outside(chain, external, n)
    q, v = unwritten(q), unwritten(v)
    N, M, bias, rest = (np.empty((n, *shape)) for shape in ((nv, na), (na, na), (na,), (nv,)))
    states = np.empty((n, STATES))

    def work(k: slice) -> int:
        given = prepared.I, prepared.memory(), q[k], v[k], DRIVEN if driven else GIVEN
        return reduced(*given, links, points, wrenches[k], N[k], M[k], bias[k], rest[k], states[k])

    in_pieces(chain, n, None, work)
    fast = np.abs(v / loops_of(chain).column_scale).max(axis=1)
    bound = _CLEAR * closed * (np.inf if driven else np.maximum(fast, TINY))
    clear = (states[:, OPEN] <= _CLEAR * closed) & (states[:, WEAKEST] > _WEAK) & (states[:, RATE] <= bound)
    return MotorEquations(N, M, bias, rest) if clear.all() else None
