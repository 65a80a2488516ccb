"""Torques, joint forces and what the frame carries, sample by sample; the equations are those of `closed_form`."""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.engine.compiled import compiled, entry
from fivebar_pin.paper.kernels.plane import CArray, Four, Vectors, cross, four, put, sum_of, times

__all__ = ["Linkage", "Loads", "load"]

Forces: TypeAlias = tuple[complex, complex, complex, complex, complex]


class Linkage(NamedTuple):
    """The arrays of a `FiveBar`."""

    lengths: Array
    masses: Array
    inertias: Array
    rho: Array
    alpha: Array


class Loads(NamedTuple):
    """Where the loads go, as in `Solution`: (n, 2), complex (n, 5), then (n, 3) each."""

    torque: Array
    joint_forces: CArray
    shaking_force: Array
    shaking_moment: Array
    frame_force: Array
    frame_moment: Array
    com: Array

    @classmethod
    def empty(cls, n: int) -> Loads:
        """Return room for n samples."""
        rest = (np.empty((n, 3)) for _ in range(5))
        return cls(np.empty((n, 2)), np.empty((n, 5), dtype=np.complex128), *rest)


class Constants(NamedTuple):
    """What does not change along the samples.

    kappa: mass centre over link vector, seen from the joint of the link in the tree.
    first: first moment over link vector [kg]; m c = sum(first b) + fixed.
    """

    masses: Four
    inertias: Four
    kappa: Vectors
    first: Vectors
    fixed: float
    mass: float
    a5: float
    gravity: complex
    weight: tuple[float, float, float]


@compiled
def ratio(rho: float, alpha: float) -> complex:
    """Return r_i over r_{i,i+1}, (55)."""
    return complex(rho * math.cos(alpha), rho * math.sin(alpha))


@compiled
def constants(linkage: Linkage, gravity: Array) -> Constants:
    a, m, I, rho, alpha = linkage
    k1, k2 = ratio(rho[0], alpha[0]), ratio(rho[1], alpha[1])
    k3, k4 = 1.0 - ratio(rho[2], alpha[2]), 1.0 - ratio(rho[3], alpha[3])
    mass = m[0] + m[1] + m[2] + m[3]
    return Constants(
        masses=(m[0], m[1], m[2], m[3]),
        inertias=(I[0], I[1], I[2], I[3]),
        kappa=(k1, k2, k3, k4),
        first=(times(m[0], k1) + m[1], times(m[1], k2), times(m[2], k3), times(m[3], k4) + m[2]),
        fixed=(m[2] + m[3]) * a[4],
        mass=mass,
        a5=a[4],
        gravity=complex(gravity[0], gravity[1]),
        weight=(mass * gravity[0], mass * gravity[1], mass * gravity[2]),
    )


@compiled
def second_rates(b: Vectors, w: Four, alpha: Four) -> Vectors:
    """Return e = b'' = b (-w^2 + i alpha)."""
    return (
        b[0] * complex(-w[0] * w[0], alpha[0]),
        b[1] * complex(-w[1] * w[1], alpha[1]),
        b[2] * complex(-w[2] * w[2], alpha[2]),
        b[3] * complex(-w[3] * w[3], alpha[3]),
    )


@compiled
def inertia_loads(k: Constants, b: Vectors, e: Vectors, alpha: Four) -> tuple[Vectors, Four]:
    """Return p_i = m_i c_i'' and n_i without gravity; O2 moves with e1, O4 with e4."""
    m, I, K = k.masses, k.inertias, k.kappa
    p1, p2 = times(m[0], K[0] * e[0]), times(m[1], e[0] + K[1] * e[1])
    p3, p4 = times(m[2], e[3] + K[2] * e[2]), times(m[3], K[3] * e[3])
    n1, n2 = I[0] * alpha[0] + cross(K[0] * b[0], p1), I[1] * alpha[1] + cross(K[1] * b[1], p2)
    n3, n4 = I[2] * alpha[2] + cross(K[2] * b[2], p3), I[3] * alpha[3] + cross(K[3] * b[3], p4)
    return (p1, p2, p3, p4), (n1, n2, n3, n4)


@compiled
def less_weight(k: Constants, b: Vectors, p: Vectors, n: Four) -> tuple[Vectors, Four]:
    """Return p and n as the joints feel them: without the weights of the links."""
    m, K, g = k.masses, k.kappa, k.gravity
    w1, w2, w3, w4 = times(m[0], g), times(m[1], g), times(m[2], g), times(m[3], g)
    n1, n2 = n[0] - cross(K[0] * b[0], w1), n[1] - cross(K[1] * b[1], w2)
    n3, n4 = n[2] - cross(K[2] * b[2], w3), n[3] - cross(K[3] * b[3], w4)
    return (p[0] - w1, p[1] - w2, p[2] - w3, p[3] - w4), (n1, n2, n3, n4)


@compiled
def shaking_moment(k: Constants, b: Vectors, p: Vectors, n: Four) -> float:
    """Return minus the sum of the moments about the joints of the tree and of the forces there: O1, O2, O4, O0."""
    return -(n[0] + n[1] + n[2] + n[3] + cross(b[0], p[1]) + cross(b[3], p[2]) + k.a5 * (p[2] + p[3]).imag)


@compiled
def forces(b: Vectors, X: float, p: Vectors, n: Four) -> Forces:
    """Return f01, f12, f23, f34, f40: f23 from the moments of links 2 and 3, the others by (22b), link by link."""
    s = times(n[2], b[1]) + times(n[1], b[2])  # Im(conj(b2) f23) = -n2, Im(conj(b3) f23) = n3
    f23 = complex(-s.real / X, -s.imag / X)
    f12, f34 = f23 + p[1], f23 - p[2]
    return f12 + p[0], f12, f23, f34, f34 - p[3]


@entry
def load(
    linkage: Linkage,
    gravity: Array,
    links: CArray,
    triangle: Array,
    rates: Array,
    accelerations: Array,
    out: Loads,
) -> float:
    """Fill the loads, and return a sum that is finite only if all of them are.

    Args:
        linkage: the parameters.
        gravity: (3,) [m/s2].
        links, triangle: from `close_loops`.
        rates, accelerations: of the links (n, 4).
        out: the loads.
    """
    k, total = constants(linkage, gravity), 0.0
    wx, wy, wz = k.weight
    for i in range(len(rates)):
        b = links[0, i], links[1, i], links[2, i], links[3, i]
        w, alpha = four(rates, i), four(accelerations, i)
        e = second_rates(b, w, alpha)
        p, n = inertia_loads(k, b, e, alpha)
        pull, moment = sum_of(k.first, e), shaking_moment(k, b, p, n)
        p, n = less_weight(k, b, p, n)
        f = forces(b, triangle[i, 2], p, n)
        tau1, tau4 = n[0] + cross(b[0], f[1]), n[3] - cross(b[3], f[3])  # (22a) of links 1 and 4
        c = sum_of(k.first, b)
        cx, cy = (c.real + k.fixed) / k.mass, c.imag / k.mass
        # what the frame carries: the bearings' f40 and -tau1, -tau4, out of the plane the weight
        mx, my = (cy * wz, -cx * wz) if wz != 0.0 else (0.0, 0.0)
        mz = k.a5 * f[4].imag - tau1 - tau4
        out.torque[i, 0], out.torque[i, 1] = tau1, tau4
        F = out.joint_forces
        F[i, 0], F[i, 1], F[i, 2], F[i, 3], F[i, 4] = f
        put(out.shaking_force, i, -pull.real, -pull.imag, 0.0)
        put(out.shaking_moment, i, 0.0, 0.0, moment)
        put(out.frame_force, i, wx - pull.real, wy - pull.imag, wz)
        put(out.frame_moment, i, mx, my, mz)
        put(out.com, i, cx, cy, 0.0)
        # not finite where any of the others is: these end the chains in which infinity is carried on
        total += (wx - pull.real) + (wy - pull.imag) + (mx + my) + (mz + moment) + (cx + cy)
        total += f[0].real + f[0].imag + f[4].real
    return total
