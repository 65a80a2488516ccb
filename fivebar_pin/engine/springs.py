"""Springs and dampers at one sample, and forces from outside: what they add to what links and joints need.

between frames    F = k (|d| - l) + c d|d|/dt   along d = P_2 - P_1, pulling the frames together when positive
on a joint        k (q - rest) + b dq/dt
"""

from __future__ import annotations

from math import floor, pi

from fivebar_pin._arrays import Array
from fivebar_pin.engine.compiled import compiled
from fivebar_pin.engine.rows import motion_of_point
from fivebar_pin.engine.tables import (
    AT_TURNING,
    BETWEEN,
    CARRIED,
    COIL,
    COLUMN_SIZE,
    COLUMNS,
    DAMPER,
    FORCE,
    JOINT,
    LINK_SIZE,
    LINKS,
    LOAD,
    LOAD_A,
    LOAD_B,
    MEETING,
    MOMENT,
    ORIGIN,
    POINT_B,
    POSE,
    POSE_A,
    POSE_B,
    RATE_A,
    RATE_B,
    REST,
    ROTATION,
    SPRING_SIZE,
    SPRING_SORT,
    SPRINGS,
    SPRINGS_END,
    STIFFNESS,
    V_HERE,
    Integers,
)  # fmt: skip
from fivebar_pin.engine.tree import coordinate
from fivebar_pin.engine.vectors import (
    Vector,
    add,
    cross,
    dot,
    length_of,
    matrix_at,
    push,
    scaled,
    sub,
    times,
    vector_at,
)  # fmt: skip

__all__ = ["apply", "pull"]


@compiled
def pull(I: Integers, W: Array) -> int:
    """Add what holds against all springs; return the number of the first whose force has no direction, else -1."""
    lost = -1
    for s in range(I[SPRINGS], I[SPRINGS_END], SPRING_SIZE):
        coil = I[s + COIL]
        if I[s + SPRING_SORT] == BETWEEN:
            if not _between(I, W, s, coil) and lost < 0:
                lost = (s - I[SPRINGS]) // SPRING_SIZE
        else:
            k = I[s + POSE_A]  # of its joint
            stretch = coordinate(I, W, I[COLUMNS] + COLUMN_SIZE * k) - W[coil + REST]
            if I[s + SPRING_SORT] == AT_TURNING:
                stretch -= 2.0 * pi * floor((stretch + pi) / (2.0 * pi))
            W[I[JOINT] + k] += W[coil + STIFFNESS] * stretch + W[coil + DAMPER] * W[I[V_HERE] + k]
    return lost


@compiled
def _between(I: Integers, W: Array, s: int, coil: int) -> bool:
    """Add what holds against a spring between two frames; False where its ends lie on one point."""
    arm1 = times(matrix_at(W, I[s + POSE_A] + ROTATION), vector_at(W, coil))
    arm2 = times(matrix_at(W, I[s + POSE_B] + ROTATION), vector_at(W, coil + POINT_B))
    d = sub(add(vector_at(W, I[s + POSE_B] + ORIGIN), arm2), add(vector_at(W, I[s + POSE_A] + ORIGIN), arm1))
    size, rest, damper = length_of(d), W[coil + REST], W[coil + DAMPER]
    free = rest == 0.0 and damper == 0.0  # then the force is k d, without a direction to define
    defined: bool = free or size >= W[coil + MEETING]
    if free:
        force = scaled(W[coil + STIFFNESS], d)
    else:
        u = scaled(1.0 / size if defined else 0.0, d)
        velocity1, _ = motion_of_point(W, I[s + RATE_A], arm1)
        velocity2, _ = motion_of_point(W, I[s + RATE_B], arm2)
        force = scaled(W[coil + STIFFNESS] * (size - rest) + damper * dot(u, sub(velocity2, velocity1)), u)
    _act(W, I[s + LOAD_A], arm1, force, (0.0, 0.0, 0.0))
    _act(W, I[s + LOAD_B], arm2, scaled(-1.0, force), (0.0, 0.0, 0.0))
    return defined


@compiled
def _act(W: Array, load: int, arm: Vector, f: Vector, m: Vector) -> None:
    """Take from what a link needs a force, at an arm from its origin, and a moment that act on it."""
    push(W, load + FORCE, scaled(-1.0, f))
    push(W, load + MOMENT, scaled(-1.0, add(m, cross(arm, f))))


@compiled
def apply(I: Integers, W: Array, links: Integers, points: Array, wrenches: Array, sample: int, about: Vector) -> None:
    """Take from what links need wrenches (n, k, 6) from outside at their points (k, 3); add them up about a point."""
    for i in range(links.shape[0]):
        j = I[LINKS] + LINK_SIZE * links[i]
        arm = times(matrix_at(W, I[j + POSE] + ROTATION), (points[i, 0], points[i, 1], points[i, 2]))
        f = wrenches[sample, i, 0], wrenches[sample, i, 1], wrenches[sample, i, 2]
        m = wrenches[sample, i, 3], wrenches[sample, i, 4], wrenches[sample, i, 5]
        _act(W, I[j + LOAD], arm, f, m)
        push(W, I[CARRIED] + FORCE, f)
        arm = sub(add(vector_at(W, I[j + POSE] + ORIGIN), arm), about)
        push(W, I[CARRIED] + MOMENT, add(m, cross(arm, f)))
