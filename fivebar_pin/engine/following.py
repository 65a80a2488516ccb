"""Following an assembly mode along a motion, every step certified [Kantorovich 1948; Beltrán and Leykin 2013].

From a closed configuration q_0 the actuated coordinates go along a straight line to where Newton's method, from a
prediction, finds q_1. With δ = q_1 - q_0 and everything scaled, consider the chord q(s) = q_0 + s δ. Let D be the
travel of all joints of a loop together and Λ the longest arm of one of them to the closure. Along the chord

    |c''| <= |(J_1 - J_0) δ| + Λ D^3,    |J_p''| <= sqrt(n) Λ D^2,    |J_p| changes by n Λ for a unit of passive travel

with n passive columns, so that, β being the larger inverse of J_p at the two ends,

    |c| <= |c''| / 8,    |J_p^-1| <= β_s = β / (1 - β (|J_p1 - J_p0| / 2 + |J_p''| / 8))
    η = β_s |c''| / 8,    K = n Λ

Where β_s K η <= 1/2, the theorem of Newton and Kantorovich gives for every s one closed configuration near q(s), and no
other: together they are one branch from q_0 to q_1. Where it is more, the step is halved.
"""

from __future__ import annotations

from math import inf, sqrt

from fivebar_pin._arrays import Array
from fivebar_pin.engine.blocks import inverse_norm
from fivebar_pin.engine.closing import close
from fivebar_pin.engine.compiled import compiled
from fivebar_pin.engine.complement import complement
from fivebar_pin.engine.tables import (
    BLOCK_SIZE,
    BLOCKED,
    BLOCKS,
    BLOCKS_END,
    CLOSED,
    CLOSURE,
    COLUMN,
    COLUMN_LIST,
    COLUMN_SIZE,
    COLUMNS,
    DIRECTION,
    ENTRIES,
    ENTRIES_END,
    ENTRY_CENTRE,
    ENTRY_MOTION,
    ENTRY_PITCH,
    ENTRY_SIZE,
    FOLLOWED,
    HELIX,
    J_BEFORE,
    J_HERE,
    JACOBIAN,
    JACOBIAN0,
    LAST_STEP,
    LENGTH,
    LOCAL,
    MOTOR_COUNT,
    MOTOR_LIST,
    MOTORS,
    MOVED,
    N_HERE,
    N_LAST,
    N_SECOND,
    NA,
    NORMS,
    NORMS_BEFORE,
    NQ,
    NUMBER,
    NV,
    OFFSET,
    OWNER,
    POINT,
    Q_BEFORE,
    Q_HERE,
    RAW,
    REACH,
    ROW0,
    ROW_LIST,
    SCALE,
    SECOND_STEP,
    SIGNS,
    SIGNS_BEFORE,
    SORT,
    SPIN,
    STATUS,
    TARGET,
    TO,
    UNIT,
    WEAK,
    WIDTH,
    WRENCH,
    Integers,
)  # fmt: skip
from fivebar_pin.engine.tree import integrate, set_coordinate
from fivebar_pin.engine.vectors import dot, sub, vector_at

__all__ = ["advance", "copy_state"]

LONGEST = 0.5  # longest step of a coordinate that is tried [rad, or chain lengths]
_SHORTEST = 1e-9  # step of all motors together that is round-off: the way is blocked [rad, or chain lengths]
_SINGULAR = 1e7  # inverse from which on the motors do not determine the mechanism: 1 / `rank.SINGULAR` [-]
_EVEN = 3.0  # ratio of steps up to which the ones before tell how N changes [-]


@compiled
def advance(I: Integers, W: Array, first: bool) -> None:
    """Go on from q, at `TARGET`, along the straight line to `TO`, coordinates of the motors, on the same branch.

    The first time nothing moves: q is closed there already, and becomes the point to go on from. `STATUS` tells how it
    ended.
    """
    if first:
        W[I[REACH]], W[I[LAST_STEP]], W[I[SECOND_STEP]] = inf, 0.0, 0.0
    total = 0.0 if first else _distance(I, W)
    done = 1.0 if not first and total == 0.0 else 0.0
    step = min(1.0, 2.0 * W[I[REACH]] / total) if total > 0.0 else 1.0
    W[I[STATUS]] = FOLLOWED
    while done < 1.0 and W[I[STATUS]] == FOLLOWED:
        step = min(step, 1.0 - done)
        copy_state(I, W, I[Q_HERE], I[Q_BEFORE], I[J_HERE], I[J_BEFORE], I[SIGNS], I[SIGNS_BEFORE])
        W[I[CLOSED]] = 1.0
        if not first:
            _predict(I, W, done, step, step * total)
        if W[I[CLOSED]] == 1.0:
            close(I, W)
        if W[I[CLOSED]] == 1.0:
            _certify(I, W, first)
        if W[I[CLOSED]] == 1.0:
            done = done + step if done + step < 1.0 else 1.0
            if not first:
                W[I[REACH]] = step * total if step < 1.0 else max(step * total, W[I[REACH]])
                _shift(I, W, step * total)
            _settle(I, W)
            step *= 2.0
        else:
            copy_state(I, W, I[Q_BEFORE], I[Q_HERE], I[J_BEFORE], I[J_HERE], I[SIGNS_BEFORE], I[SIGNS])
            step *= 0.5
            if not step * total >= _SHORTEST:  # it is not, either, where a motor goes to what is no number
                W[I[STATUS]] = BLOCKED
    for a in range(I[NA]):
        W[I[TARGET] + a] = W[I[TO] + a]


@compiled
def _settle(I: Integers, W: Array) -> None:
    """Take q, closed and factorised, for a point of the branch."""
    for g in range(I[BLOCKS], I[BLOCKS_END], BLOCK_SIZE):
        if not W[I[NORMS] + I[g + NUMBER]] < _SINGULAR:
            W[I[STATUS]] = BLOCKED
    complement(I, W)


@compiled
def copy_state(I: Integers, W: Array, q: int, q_to: int, J: int, J_to: int, signs: int, signs_to: int) -> None:
    """Keep the point of the branch that a step starts from, or go back to it. Norms stand behind the signs."""
    for i in range(I[NQ]):
        W[q_to + i] = W[q + i]
    for i in range(I[JACOBIAN]):
        W[J_to + i] = W[J + i]
    for i in range(2 * (I[NORMS] - I[SIGNS])):
        W[signs_to + i] = W[signs + i]


@compiled
def _distance(I: Integers, W: Array) -> float:
    """Return the length of the straight line from `TARGET` to `TO`, scaled."""
    total = 0.0
    for a in range(I[NA]):
        total += ((W[I[TO] + a] - W[I[TARGET] + a]) / W[I[SCALE] + I[I[MOTORS] + a]]) ** 2
    return sqrt(total)


@compiled
def _predict(I: Integers, W: Array, done: float, step: float, h: float) -> None:
    """Move q to where it will be after a step of length h; too far to say, and the flag `CLOSED` is taken down.

    N is taken for a parabola in the way, through this point and the two before [Adams and Bashforth 1883]:

        δ_p = (N + h/2 D_1 + (h^2 / 3 + h h_1 / 2) D_12) δ_a,     D_1, D_12 its divided differences
    """
    w0, w1, w2 = _weights(h, W[I[LAST_STEP]], W[I[SECOND_STEP]])
    moved, target, to = I[MOVED], I[TARGET], I[TO]
    for a in range(I[NA]):
        W[moved + I[I[MOTORS] + a]] = step * (W[to + a] - W[target + a])
    for k in range(I[NV]):
        g = I[I[COLUMNS] + COLUMN_SIZE * k + OWNER]
        if g >= 0:
            total = 0.0
            for i in range(I[g + MOTOR_LIST], I[g + MOTOR_LIST] + I[g + MOTOR_COUNT]):
                n = k * I[NA] + I[i]
                N = w0 * W[I[N_HERE] + n] + w1 * W[I[N_LAST] + n] + w2 * W[I[N_SECOND] + n]
                total += N * W[moved + I[I[MOTORS] + I[i]]]
            W[moved + k] = total
        if not abs(W[moved + k]) <= LONGEST * W[I[SCALE] + k]:
            W[I[CLOSED]] = 0.0
    if W[I[CLOSED]] == 1.0:
        integrate(I, W, moved)
        for a in range(I[NA]):
            x = W[to + a] if done + step >= 1.0 else W[target + a] + (done + step) * (W[to + a] - W[target + a])
            set_coordinate(I, W, I[COLUMNS] + COLUMN_SIZE * I[I[MOTORS] + a], x)


@compiled
def _weights(h: float, h1: float, h2: float) -> tuple[float, float, float]:
    """Return the weights of N at this point and at the two before, for a step h after steps h1 and, before it, h2."""
    if not h <= _EVEN * h1:
        return 1.0, 0.0, 0.0
    first = 0.5 * h / h1
    if not (h <= _EVEN * h2 and h1 <= _EVEN * h2):
        return 1.0 + first, -first, 0.0
    second = (h * h / 3.0 + 0.5 * h * h1) / (h1 + h2)
    return 1.0 + first + second / h1, -first - second / h1 - second / h2, second / h2


@compiled
def _shift(I: Integers, W: Array, h: float) -> None:
    """Make N and the length of the step those of the point before."""
    W[I[SECOND_STEP]], W[I[LAST_STEP]] = W[I[LAST_STEP]], h
    for g in range(I[BLOCKS], I[BLOCKS_END], BLOCK_SIZE):
        for k in range(I[g + COLUMN_LIST], I[g + COLUMN_LIST] + I[g + WIDTH]):
            for i in range(I[g + MOTOR_LIST], I[g + MOTOR_LIST] + I[g + MOTOR_COUNT]):
                n = I[k] * I[NA] + I[i]
                W[I[N_SECOND] + n] = W[I[N_LAST] + n]
                W[I[N_LAST] + n] = W[I[N_HERE] + n]


@compiled
def _certify(I: Integers, W: Array, first: bool) -> None:
    """Take the flag `CLOSED` down unless this point and the one before are on one branch; write the inverses' norms."""
    for g in range(I[BLOCKS], I[BLOCKS_END], BLOCK_SIZE):
        number = I[g + NUMBER]
        if first:  # whatever this memory was used for before
            for i in range(I[g + WEAK], I[g + WEAK] + I[g + WIDTH]):
                W[i] = 1.0
        norm = W[I[NORMS] + number] = inverse_norm(I, W, g)
        if not first:
            turned = W[I[SIGNS] + number] != W[I[SIGNS_BEFORE] + number]
            if turned or not _contraction(I, W, g, max(norm, W[I[NORMS_BEFORE] + number])) <= 0.5:
                W[I[CLOSED]] = 0.0


@compiled
def _contraction(I: Integers, W: Array, g: int, beta: float) -> float:
    """Return the largest β_s K η along the chord, of a block whose inverses are no larger than beta at its ends."""
    n = I[g + WIDTH]
    bend, change, bend_rate, change_rate, slope = 0.0, 0.0, 0.0, 0.0, 0.0  # squares
    for i in range(I[g + RAW]):
        r = I[I[g + ROW_LIST] + i]
        bent, changed = _change(I, W, r)
        bend, change = bend + bent * bent, change + changed
        travel, arm = _travel_and_arm(I, W, r)
        change_rate += n * (arm * travel * travel) ** 2
        bend_rate += (arm * travel * travel * travel) ** 2
        slope += (n * arm) ** 2
    left = 1.0 - beta * (0.5 * sqrt(change) + 0.125 * sqrt(change_rate))
    eta = 0.125 * beta * (sqrt(bend) + sqrt(bend_rate))
    return beta * sqrt(slope) * eta / (left * left) if left > 0.0 else inf


@compiled
def _change(I: Integers, W: Array, r: int) -> tuple[float, float]:
    """Return of a row (J_1 - J_0) δ and the square of its change in the columns of its block, scaled."""
    bent, changed, k, before = 0.0, 0.0, I[r + JACOBIAN0], I[J_BEFORE] - I[J_HERE]
    for e in range(I[r + ENTRIES], I[r + ENTRIES_END], ENTRY_SIZE):
        change = W[k] - W[k + before]
        k += 1
        bent += change * W[I[MOVED] + I[e + COLUMN]]
        if I[e + LOCAL] >= 0:
            changed += (change * W[I[SCALE] + I[e + COLUMN]]) ** 2
    return bent, changed


@compiled
def _travel_and_arm(I: Integers, W: Array, r: int) -> tuple[float, float]:
    """Return how far the joints of a loop have moved together, and the longest arm of one to the closure, scaled.

    An arm counts as one at least, and is longer by the lead of a joint that slides as it turns. A rod of length ρ
    turns by 1 / ρ for a unit of travel of its ends, which makes its derivatives larger. Each closure counts once, with
    its first row; those of coordinates, and of velocities alone, are straight.
    """
    point, square, travel = vector_at(W, I[r + WRENCH] + POINT), 0.0, 0.0
    curved = r == I[I[r + CLOSURE] + ROW0] and I[r + SORT] < SPIN
    for e in range(I[r + ENTRIES], I[r + ENTRIES_END] if curved else I[r + ENTRIES], ENTRY_SIZE):
        travel += abs(W[I[MOVED] + I[e + COLUMN]]) / W[I[SCALE] + I[e + COLUMN]]
        arm = sub(point, vector_at(W, I[e + ENTRY_CENTRE]))
        reach = dot(arm, arm)
        if I[e + ENTRY_MOTION] == HELIX:
            reach = (sqrt(reach) + abs(W[I[e + ENTRY_PITCH]])) ** 2
        square = max(square, reach)
    longest = max(1.0, W[I[r + DIRECTION] + UNIT] * sqrt(square)) if curved else 0.0
    rod = 1.0 + sqrt(square) / W[I[r + DIRECTION] + OFFSET] if I[r + SORT] == LENGTH else 1.0
    return travel, longest * rod * rod
