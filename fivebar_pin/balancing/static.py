"""Springs in static balance: what of the torque at rest does not depend on the masses.

Weight and springs hold each other at rest, at every closed configuration q, when

    N^T (weight(q; pi) - f(q)) = 0        f: generalised force of the springs, dampers at rest

With |g| the size of gravity and p the linear momentum of the bodies at the velocities N this reads, row by row,

    g/|g| . p(q, N; pi) + N^T f(q) / |g| = 0        that is        A x + c = 0.

Masses that hold the springs exist only if c lies in the range of A: if rank [A, c] = rank A. What of c lies outside is
held by no masses at all, and is told apart from round-off by its share of all that the springs do.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.sameness import ALIKE
from fivebar_pin.balancing.sampling import Samples
from fivebar_pin.chain import ClosedChain, find_frame
from fivebar_pin.dynamics.elastic import resting_force
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.springs import JointSpring, Spring

__all__ = ["held_by_masses", "required_gravity", "same_springs", "spring_rows", "springs_act"]

_ROUND_OFF = 1e-9  # share of the power of all joints' spring torques that is round-off in their sum [-]


def spring_rows(chain: ClosedChain, samples: Samples) -> tuple[Array, Array]:
    """Return N^T f for unit velocities, and the sum of the sizes of what adds up to it (na n,) each [N or N m].

    The rows are in the order of `momentum_rows`: all samples for the first velocity, then for the next.
    """
    loops = loops_of(chain)
    force = resting_force(chain, loops, samples.q, samples.poses)
    v = np.moveaxis(samples.N, 2, 0)  # (na, n, nv)
    power = force * (v / np.abs(v / loops.column_scale).max(axis=2, keepdims=True))
    return power.sum(axis=2).reshape(-1), np.abs(power).sum(axis=2).reshape(-1)


def springs_act(chain: ClosedChain, samples: Samples) -> bool:
    """Whether the springs do any work on the motions of the chain."""
    if not chain.springs:
        return False
    total, parts = spring_rows(chain, samples)
    return bool(np.linalg.norm(total) > _ROUND_OFF * np.linalg.norm(parts))


def required_gravity(chain: ClosedChain, gravity: Array | None) -> float:
    """Return the size of gravity [m/s2] that springs are held by.

    Raises:
        InvalidInputError: none is told.
    """
    if gravity is None:
        names = ", ".join(s.name for s in chain.springs)
        raise InvalidInputError(
            "gravity",
            "any",
            f"must be a vector where springs ({names}) act: the weight that holds them has one size and direction",
            "Pass gravity='model' or a vector in m/s2, or balance chain.with_springs(()).",
        )
    return float(np.linalg.norm(gravity))


def held_by_masses(U: Array, s: Array, rank: int, column: Array, parts: float) -> tuple[Array, float]:
    """Return the constants b (rank,) of the conditions V x + b = 0, and the size of what no masses hold.

    Args:
        U, s: of the singular value decomposition A = U s V of the rows (m, P), all of U (m, m).
        rank: of A.
        column: c (m,).
        parts: norm of the sizes of all that adds up to c.
    """
    inside, outside = U[:, :rank].T @ column, float(np.linalg.norm(U[:, rank:].T @ column))
    return inside / s[:rank], 0.0 if outside <= _ROUND_OFF * parts else outside


def same_springs(a: ClosedChain, b: ClosedChain) -> bool:
    """Whether two chains have the same springs between the same points, dampers and names of frames apart."""
    if len(a.springs) != len(b.springs):
        return False
    return all(_same(a, s, b, t) for s, t in zip(a.springs, b.springs, strict=True))


def _same(a: ClosedChain, s: Spring | JointSpring, b: ClosedChain, t: Spring | JointSpring) -> bool:
    if isinstance(s, JointSpring) or isinstance(t, JointSpring):
        return replace(s, damping=0.0) == replace(t, damping=0.0)
    ends = [(find_frame(a.model, f), find_frame(b.model, g)) for f, g in ((s.frame1, t.frame1), (s.frame2, t.frame2))]
    alike = all(f.parentJoint == g.parentJoint and f.placement.isApprox(g.placement, ALIKE) for f, g in ends)
    return alike and (s.stiffness, s.length) == (t.stiffness, t.length)
