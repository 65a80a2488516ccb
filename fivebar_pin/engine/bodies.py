"""The equations of motion by the natural orthogonal complement, body by body [Angeles and Lee 1988, (44)-(46)].

With t_i = T_i v_a the twist of body i at the origin of its link, and f_i, n_i the force and the moment about it that
its motion needs,

    f = m (a_c - g),    n = I α + ω × I ω + c × f,    a_c = a + α × c + ω × (ω × c)
    tau = sum_i T_i^T (n_i, f_i) + N^T (armature, losses, springs)
    M_bar = sum_i T_i^T M_i T_i + N^T diag(armature) N
    F = -sum m a_c,    M_O = -sum (n + p × f)           shaking force and moment, weight left out
"""

from __future__ import annotations

from fivebar_pin._arrays import Array
from fivebar_pin.engine.compiled import compiled
from fivebar_pin.engine.tables import (
    A_HERE,
    ACCELERATION,
    ALPHA,
    ANGULAR,
    ARMATURE,
    AXIS,
    BLOCK_SIZE,
    BLOCKS,
    BLOCKS_END,
    CARRIED,
    COLUMN0,
    COLUMN_LIST,
    COLUMN_SIZE,
    DAMPING,
    DOF,
    FORCE,
    FRICTION,
    GRAVITY,
    JOINT,
    LINEAR,
    LINK_SIZE,
    LINKS,
    LINKS_END,
    LOAD,
    LOSSES,
    MASS,
    MASS_CENTRE,
    MOMENT,
    MOMENTS,
    MOTION,
    MOTOR_COUNT,
    MOTOR_LIST,
    MOTORS,
    N_HERE,
    NA,
    NV,
    OMEGA,
    ORIGIN,
    PARENT_LOAD,
    PARENT_POSE,
    PARENT_TWIST,
    PITCH,
    POSE,
    RATE,
    REACHED,
    REACHED_END,
    ROTATION,
    SHAKING,
    SHIFT,
    TAU,
    TURN,
    TWIST,
    V_HERE,
    WAY,
    WIDTH,
    Integers,
    V,
)  # fmt: skip
from fivebar_pin.engine.vectors import (
    Vector,
    add,
    axis_at,
    back,
    cross,
    dot,
    matrix_at,
    push,
    put,
    scaled,
    sub,
    times,
    vector_at,
)  # fmt: skip

__all__ = ["drag", "inertia_forces", "joint_forces", "reduced_inertia", "torques", "twists", "weigh"]


@compiled
def twists(I: Integers, W: Array) -> None:
    """Write the twist-shaping matrices T_i of all links: their twists at unit speed of each motor, t_i = T_i v_a."""
    for j in range(I[LINKS] + LINK_SIZE, I[LINKS_END], LINK_SIZE):
        r = sub(vector_at(W, I[j + POSE] + ORIGIN), vector_at(W, I[j + PARENT_POSE] + ORIGIN))
        for i in range(I[j + REACHED], I[j + REACHED_END]):
            a = I[i]
            parent, here = I[j + PARENT_TWIST] + 6 * a, I[j + TWIST] + 6 * a
            omega = vector_at(W, parent + ANGULAR)
            v = add(vector_at(W, parent + LINEAR), cross(omega, r))
            c, N = I[j + COLUMN0], I[N_HERE] + I[j + V] * I[NA] + a
            for _ in range(I[j + DOF]):
                axis = scaled(W[N], axis_at(W, I[c + AXIS]))
                if I[c + MOTION] != SHIFT:
                    omega = add(omega, axis)
                if I[c + MOTION] != TURN:
                    v = add(v, scaled(W[N] * W[I[c + PITCH]], axis_at(W, I[c + WAY])))
                c, N = c + COLUMN_SIZE, N + I[NA]
            put(W, here + ANGULAR, omega)
            put(W, here + LINEAR, v)


@compiled
def inertia_forces(I: Integers, W: Array, about: Vector) -> None:
    """Write what every link needs to move as it does, weight left out, and the shaking wrench about a point."""
    force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for j in range(I[LINKS], I[LINKS_END], LINK_SIZE):
        f, n = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        if I[j + MASS] >= 0:
            f, n = _newton_euler(W, I[j + MASS], I[j + POSE], I[j + RATE])
            force = sub(force, f)
            moment = sub(moment, add(n, cross(sub(vector_at(W, I[j + POSE] + ORIGIN), about), f)))
        put(W, I[j + LOAD] + FORCE, f)
        put(W, I[j + LOAD] + MOMENT, n)
    put(W, I[SHAKING] + FORCE, force)
    put(W, I[SHAKING] + MOMENT, moment)


@compiled
def _newton_euler(W: Array, mass: int, pose: int, rate: int) -> tuple[Vector, Vector]:
    """Return the rate of momentum of a body and of its moment about the origin of the link."""
    R, omega, alpha = matrix_at(W, pose + ROTATION), vector_at(W, rate + OMEGA), vector_at(W, rate + ALPHA)
    c = times(R, vector_at(W, mass + MASS_CENTRE))
    f = scaled(W[mass], add(vector_at(W, rate + ACCELERATION), add(cross(alpha, c), cross(omega, cross(omega, c)))))
    own_omega, own_alpha = back(R, omega), back(R, alpha)
    own = add(_moments(W, mass, own_alpha), cross(own_omega, _moments(W, mass, own_omega)))
    return f, add(times(R, own), cross(c, f))


@compiled
def _moments(W: Array, mass: int, u: Vector) -> Vector:
    """Return I_c u in the axes of the link."""
    xx, xy, yy = vector_at(W, mass + MOMENTS)
    xz, yz, zz = vector_at(W, mass + MOMENTS + 3)
    return (
        xx * u[0] + xy * u[1] + xz * u[2],
        xy * u[0] + yy * u[1] + yz * u[2],
        xz * u[0] + yz * u[1] + zz * u[2],
    )


@compiled
def weigh(I: Integers, W: Array, about: Vector) -> None:
    """Add to what the links need what holds their weight; write the wrench of the weight about a point."""
    g, force, moment = vector_at(W, I[GRAVITY]), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if g[0] != 0.0 or g[1] != 0.0 or g[2] != 0.0:
        for j in range(I[LINKS] + LINK_SIZE, I[LINKS_END], LINK_SIZE):
            if I[j + MASS] >= 0:
                c = times(matrix_at(W, I[j + POSE] + ROTATION), vector_at(W, I[j + MASS] + MASS_CENTRE))
                f = scaled(W[I[j + MASS]], g)
                push(W, I[j + LOAD] + FORCE, scaled(-1.0, f))
                push(W, I[j + LOAD] + MOMENT, scaled(-1.0, cross(c, f)))
                force = add(force, f)
                moment = add(moment, cross(sub(add(vector_at(W, I[j + POSE] + ORIGIN), c), about), f))
    put(W, I[CARRIED] + FORCE, force)
    put(W, I[CARRIED] + MOMENT, moment)


@compiled
def drag(I: Integers, W: Array) -> None:
    """Write what the joints themselves need: armature, viscous damping and dry friction."""
    for k in range(I[NV]):
        v, i = W[I[V_HERE] + k], I[LOSSES] + 3 * k
        sense = 1.0 if v > 0.0 else (-1.0 if v < 0.0 else 0.0)
        W[I[JOINT] + k] = W[i + ARMATURE] * W[I[A_HERE] + k] + W[i + DAMPING] * v + W[i + FRICTION] * sense


@compiled
def torques(I: Integers, W: Array) -> None:
    """Write tau = sum_i T_i^T (n_i, f_i) + N^T (what the joints themselves need)."""
    for a in range(I[NA]):
        W[I[TAU] + a] = W[I[JOINT] + I[I[MOTORS] + a]]
    for g in range(I[BLOCKS], I[BLOCKS_END], BLOCK_SIZE):
        for i in range(I[g + MOTOR_LIST], I[g + MOTOR_LIST] + I[g + MOTOR_COUNT]):
            for k in range(I[g + COLUMN_LIST], I[g + COLUMN_LIST] + I[g + WIDTH]):
                W[I[TAU] + I[i]] += W[I[N_HERE] + I[k] * I[NA] + I[i]] * W[I[JOINT] + I[k]]
    for j in range(I[LINKS] + LINK_SIZE, I[LINKS_END], LINK_SIZE):
        f, n = vector_at(W, I[j + LOAD] + FORCE), vector_at(W, I[j + LOAD] + MOMENT)
        for i in range(I[j + REACHED], I[j + REACHED_END]):
            t = I[j + TWIST] + 6 * I[i]
            W[I[TAU] + I[i]] += dot(f, vector_at(W, t + LINEAR)) + dot(n, vector_at(W, t + ANGULAR))


@compiled
def joint_forces(I: Integers, W: Array) -> None:
    """Add to what the joints need what all links beyond them need: the inverse dynamics of the open tree.

    The loads are gathered on the way down, so that they are then what passes through each joint.
    """
    for j in range(I[LINKS_END] - LINK_SIZE, I[LINKS], -LINK_SIZE):
        f, n = vector_at(W, I[j + LOAD] + FORCE), vector_at(W, I[j + LOAD] + MOMENT)
        c = I[j + COLUMN0]
        for k in range(I[JOINT] + I[j + V], I[JOINT] + I[j + V] + I[j + DOF]):
            axis = axis_at(W, I[c + AXIS])
            if I[c + MOTION] != SHIFT:
                W[k] += dot(axis, n)
            if I[c + MOTION] != TURN:
                W[k] += W[I[c + PITCH]] * dot(axis_at(W, I[c + WAY]), f)
            c += COLUMN_SIZE
        r = sub(vector_at(W, I[j + POSE] + ORIGIN), vector_at(W, I[j + PARENT_POSE] + ORIGIN))
        push(W, I[j + PARENT_LOAD] + FORCE, f)
        push(W, I[j + PARENT_LOAD] + MOMENT, add(n, cross(r, f)))


@compiled
def reduced_inertia(I: Integers, W: Array, M: int) -> None:
    """Write M_bar = sum_i T_i^T M_i T_i + N^T diag(armature) N (na, na) from W[M] on, row by row."""
    na = I[NA]
    for k in range(M, M + na * na):
        W[k] = 0.0
    for j in range(I[LINKS] + LINK_SIZE, I[LINKS_END], LINK_SIZE):
        for i in range(I[j + REACHED], I[j + REACHED_END]):
            p, h = _momentum(I, W, j, I[i])
            for k in range(I[j + REACHED], i + 1):
                t = I[j + TWIST] + 6 * I[k]
                value = dot(p, vector_at(W, t + LINEAR)) + dot(h, vector_at(W, t + ANGULAR))
                value += _rotors(I, W, j, I[i], I[k])
                W[M + I[i] * na + I[k]] += value
                if i != k:
                    W[M + I[k] * na + I[i]] += value


@compiled
def _momentum(I: Integers, W: Array, j: int, a: int) -> tuple[Vector, Vector]:
    """Return momentum, and its moment about the origin of the link, of a body at unit speed of one motor."""
    p, h, t, mass = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), I[j + TWIST] + 6 * a, I[j + MASS]
    if mass >= 0:
        R, omega = matrix_at(W, I[j + POSE] + ROTATION), vector_at(W, t + ANGULAR)
        c = times(R, vector_at(W, mass + MASS_CENTRE))
        p = scaled(W[mass], add(vector_at(W, t + LINEAR), cross(omega, c)))
        h = add(times(R, _moments(W, mass, back(R, omega))), cross(c, p))
    return p, h


@compiled
def _rotors(I: Integers, W: Array, j: int, a: int, b: int) -> float:
    """Return N^T diag(armature) N of the joint of a link, for two motors."""
    total = 0.0
    for k in range(I[j + V], I[j + V] + I[j + DOF]):
        N = I[N_HERE] + k * I[NA]
        total += W[I[LOSSES] + 3 * k + ARMATURE] * W[N + a] * W[N + b]
    return total
