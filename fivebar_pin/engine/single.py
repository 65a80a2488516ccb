"""One sample at a time, for those who ask within a loop: all that is known of it stays in the memory of one evaluator.

With M_bar and b the inertia and the bias of the mechanism in its actuated coordinates, and a_0 the accelerations that
the closed loops ask for when the motors have none,

    M_bar a_a + b = tau,    M_bar = sum_i T_i^T M_i T_i + N^T diag(armature) N,    b = tau at a_a = 0
    a = N a_a + a_0                                                              [Angeles and Lee 1988, (44)-(46)]

Inverse dynamics gives tau for a_a; forward dynamics gives a_a for tau, by Cholesky's factors of M_bar.

Behind the memory of a chain stands what an evaluator needs besides, and behind this a copy of all of it as it was after
the last sample that could be computed: an evaluator that failed goes back there. Its record stands last in I.
"""

from __future__ import annotations

from math import floor, inf, nan, pi, sqrt

import numpy as np

from fivebar_pin._arrays import Array, seal
from fivebar_pin.engine.bodies import inertia_forces, reduced_inertia, torques, twists
from fivebar_pin.engine.compiled import compiled, entry
from fivebar_pin.engine.complement import accelerations, velocities
from fivebar_pin.engine.entries import need, open_by
from fivebar_pin.engine.following import advance
from fivebar_pin.engine.rows import motion_of_point
from fivebar_pin.engine.tables import (
    A_HERE,
    ALPHA,
    CARRIED,
    COLUMN_SIZE,
    COLUMNS,
    CONSTANTS,
    FARTHEST,
    FOLLOWED,
    LINK_SIZE,
    LINKS,
    MEMORY,
    MOTOR_COUNT,
    MOTOR_LIST,
    MOTORS,
    N_HERE,
    NA,
    NV,
    OMEGA,
    ORIGIN,
    OWNER,
    POSE,
    QS_KIND,
    RATE,
    ROTATION,
    SCALE,
    SHAKING,
    STATUS,
    TARGET,
    TAU,
    TO,
    TO_A,
    TO_V,
    TURNING,
    Integers,
)  # fmt: skip
from fivebar_pin.engine.tree import accelerate, coordinate
from fivebar_pin.engine.vectors import add, matrix_at, product, put, put_matrix, times, vector_at

__all__ = [
    "BEYOND",
    "FORWARD",
    "INVERSE",
    "LOST",
    "MASSLESS",
    "MOVE",
    "NO_NUMBER",
    "STAND",
    "TOO_FAR",
    "frame",
    "memory_of",
    "sample",
]

STAND, MOVE, INVERSE, FORWARD = range(4)
"""Tasks: stand at q, at rest; move; what the motors need for it; how the mechanism moves by what they give."""
NO_NUMBER, TOO_FAR, LOST, MASSLESS, BEYOND = range(3, 8)
"""Status, after those of `tables`: nan or infinity was given; a way that would take for ever; a spring whose force
has no direction; a motion that moves no mass; a result beyond what can be computed."""

_LEAST = 1e-13  # pivot of the inertia, of unit diagonal, below which some motion moves no mass [-]

# Fields of the record of an evaluator: the point of moments, force and moment on the frame, the closure residual, bias,
# what is given (a_a or tau), inertia, its factors and the roots of its diagonal, and the copy of all that changes.
ABOUT, FRAME, GAP, BIAS, GIVEN, INERTIA, FACTORS, ROOTS, BEFORE = range(9)
RECORD_SIZE = 9

# Numbers of a frame: its placement on the link, then axes, origin, and their rates.
AXES, PLACE, SPEED, RATE_OF_SPEED, SPIN, RATE_OF_SPIN, FRAME_SIZE = 12, 21, 24, 27, 30, 33, 36


def memory_of(I: Integers, W: Array, about: Array) -> tuple[Integers, Array]:
    """Return I and W of a chain with the record and the memory of an evaluator behind.

    Args:
        I, W: of the chain.
        about: the point of moments (3,) [m].
    """
    na, end = int(I[NA]), int(I[MEMORY])
    starts = end + np.cumsum([0, 3, 6, 1, na, na, na * na, na * na, na])
    longer = np.concatenate([I, starts])
    seal(longer)
    memory = np.zeros(2 * starts[-1] - I[CONSTANTS])
    memory[:end], memory[end : end + 3] = W, about
    return longer, memory


@entry
def sample(I: Integers, W: Array, task: int, links: Integers, points: Array, wrenches: Array) -> int:
    """Do a task at the sample that stands at `TO`, `TO_V` and `GIVEN`, and tell how it ended.

    Args:
        I, W: of an evaluator. To stand, q is in place and closed: nothing moves.
        task: see `STAND`.
        links, points, wrenches: of forces from outside (k,), (k, 3), (1, k, 6).
    """
    s, loaded = I.shape[0] - RECORD_SIZE, task >= INVERSE
    about = vector_at(W, I[s + ABOUT])
    _begin(I, W, s, task)
    for i in range(links.shape[0]):
        for k in range(6):
            if not abs(wrenches[0, i, k]) < inf:
                W[I[STATUS]] = NO_NUMBER
    if W[I[STATUS]] == FOLLOWED:
        advance(I, W, task == STAND)
    if W[I[STATUS]] == FOLLOWED:
        velocities(I, W)
        accelerations(I, W)
        W[I[s + GAP]] = open_by(I, W)
        for a in range(I[NA]):
            W[I[TO_A] + a] = W[I[s + GIVEN] + a]
        if loaded:
            twists(I, W)
            lost = need(I, W, about, links, points, wrenches, 0)
            torques(I, W)
            if lost >= 0:
                W[I[STATUS]] = LOST
            _equations(I, W, s, task)
        _complete(I, W)
        if loaded:
            inertia_forces(I, W, about)
            _add_up(I, W, s)
        _end(I, W, s, loaded)
    return int(W[I[STATUS]])


@compiled
def _begin(I: Integers, W: Array, s: int, task: int) -> None:
    """Look at what is asked for; what will not be computed of the sample becomes nan.

    A joint whose coordinates are a cosine and a sine does not count its turns: it goes the shorter way.
    """
    W[I[STATUS]] = FOLLOWED
    for a in range(I[NA]):
        k = I[I[MOTORS] + a]
        c = I[COLUMNS] + COLUMN_SIZE * k
        if task == STAND:
            W[I[TO] + a], W[I[TO_V] + a], W[I[s + GIVEN] + a] = coordinate(I, W, c), 0.0, 0.0
        elif not (abs(W[I[TO] + a]) < inf and abs(W[I[TO_V] + a]) < inf and abs(W[I[s + GIVEN] + a]) < inf):
            W[I[STATUS]] = NO_NUMBER
        else:
            turns = (W[I[TO] + a] - W[I[TARGET] + a]) / (2.0 * pi) if I[c + QS_KIND] == TURNING else 0.0
            W[I[TARGET] + a] += 2.0 * pi * floor(0.5 + turns)
            if not abs(W[I[TO] + a] - W[I[TARGET] + a]) <= FARTHEST * W[I[SCALE] + k]:
                W[I[STATUS]] = TOO_FAR
        W[I[TO_A] + a] = 0.0
        W[I[TAU] + a], W[I[s + BIAS] + a] = nan, nan
    for k in range(6):
        W[I[SHAKING] + k], W[I[s + FRAME] + k] = nan, nan
    for k in range(I[NA] * I[NA]):
        W[I[s + INERTIA] + k] = nan


@compiled
def _equations(I: Integers, W: Array, s: int, task: int) -> None:
    """Write M_bar, b, and in forward dynamics the accelerations of the motors, M_bar^-1 (tau - b) for tau."""
    for a in range(I[NA]):
        W[I[s + BIAS] + a] = W[I[TAU] + a]
    reduced_inertia(I, W, I[s + INERTIA])
    if task == FORWARD:
        for a in range(I[NA]):
            W[I[TO_A] + a] -= W[I[s + BIAS] + a]
        _factorise(I, W, s)
        _substitute(I, W, s)


@compiled
def _factorise(I: Integers, W: Array, s: int) -> None:
    """Factorise M_bar = D L L^T D, D^2 its diagonal [Cholesky]; `STATUS` says where some motion moves no mass."""
    n, M, L, D = I[NA], I[s + INERTIA], I[s + FACTORS], I[s + ROOTS]
    for i in range(n):
        square = W[M + i * n + i]
        W[D + i] = sqrt(square) if square > 0.0 else 1.0
    for i in range(n):
        for j in range(i + 1):
            value = W[M + i * n + j] / (W[D + i] * W[D + j])
            for k in range(j):
                value -= W[L + i * n + k] * W[L + j * n + k]
            if i != j:
                W[L + i * n + j] = value / W[L + j * n + j]
            else:
                W[L + i * n + i] = sqrt(value) if value > _LEAST else 1.0
                if value <= _LEAST:
                    W[I[STATUS]] = MASSLESS


@compiled
def _substitute(I: Integers, W: Array, s: int) -> None:
    """Solve D L L^T D x = b in place, b being where the accelerations of the motors will stand."""
    n, L, D, x = I[NA], I[s + FACTORS], I[s + ROOTS], I[TO_A]
    for i in range(n):
        W[x + i] /= W[D + i]
        for k in range(i):
            W[x + i] -= W[L + i * n + k] * W[x + k]
        W[x + i] /= W[L + i * n + i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            W[x + i] -= W[L + k * n + i] * W[x + k]
        W[x + i] /= W[L + i * n + i]
    for i in range(n):
        W[x + i] /= W[D + i]


@compiled
def _complete(I: Integers, W: Array) -> None:
    """Add N a_a to the accelerations of all joints, those of the motors being written, and write those of all links."""
    for i in range(I[NV]):
        g = I[I[COLUMNS] + COLUMN_SIZE * i + OWNER]
        if g < 0:
            W[I[A_HERE] + i] = W[I[TO_A] - 1 - g]
        else:
            for m in range(I[g + MOTOR_LIST], I[g + MOTOR_LIST] + I[g + MOTOR_COUNT]):
                W[I[A_HERE] + i] += W[I[N_HERE] + i * I[NA] + I[m]] * W[I[TO_A] + I[m]]
    accelerate(I, W)


@compiled
def _add_up(I: Integers, W: Array, s: int) -> None:
    """Write tau = M_bar a_a + b, and all that the frame carries."""
    for a in range(I[NA]):
        W[I[TAU] + a] = W[I[s + BIAS] + a]
        for b in range(I[NA]):
            W[I[TAU] + a] += W[I[s + INERTIA] + a * I[NA] + b] * W[I[TO_A] + b]
    for k in range(6):
        W[I[s + FRAME] + k] = W[I[SHAKING] + k] + W[I[CARRIED] + k]


@compiled
def _end(I: Integers, W: Array, s: int, loaded: bool) -> None:
    """Keep a copy of all that changes, for when the next sample cannot be computed; this one must be numbers."""
    size = 0.0
    for k in range(I[A_HERE], I[A_HERE] + I[NV]):
        size += abs(W[k])
    if loaded:
        for k in range(I[TAU], I[TAU] + I[NA]):
            size += abs(W[k])
        for k in range(I[s + FRAME], I[s + FRAME] + 6):
            size += abs(W[k])
    if W[I[STATUS]] == FOLLOWED and not size < inf:
        W[I[STATUS]] = BEYOND
    if W[I[STATUS]] == FOLLOWED:
        here, before = I[CONSTANTS], I[s + BEFORE]
        for k in range(before - here):
            W[np.uint64(before + k)] = W[np.uint64(here + k)]  # places without a sign: several at once


@entry
def frame(I: Integers, W: Array, link: int, F: Array) -> None:
    """Write pose and motion of a frame, see `AXES`, whose placement on a link stands in F (36,)."""
    j = I[LINKS] + LINK_SIZE * link
    R, w = matrix_at(W, I[j + POSE] + ROTATION), vector_at(W, I[j + RATE] + OMEGA)
    arm = times(R, vector_at(F, ORIGIN))
    velocity, acceleration = motion_of_point(W, I[j + RATE], arm)
    put_matrix(F, AXES, product(R, matrix_at(F, ROTATION)))
    put(F, PLACE, add(vector_at(W, I[j + POSE] + ORIGIN), arm))
    put(F, SPEED, velocity)
    put(F, RATE_OF_SPEED, acceleration)
    put(F, SPIN, w)
    put(F, RATE_OF_SPIN, vector_at(W, I[j + RATE] + ALPHA))
