"""The closed-form road: the whole inverse dynamics of the five-bar, elementwise over the samples.

Forces f_ij are those of link i on link j (link 0 is the frame), so that (22b) reads f_{i-1,i} - f_{i,i+1} + m_i g =
m_i c_i''. With p_i = m_i (c_i'' - g) and n_i the rate of angular momentum of link i about its joint in the tree, the
moments of link 2 about O2 and of link 3 about O4 give f23 alone; the others follow link by link. No system of
equations is solved. All planar vectors are complex numbers inside and pairs of numbers outside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, finite, frozen
from fivebar_pin.errors import AssemblyError, InvalidInputError, SingularityError
from fivebar_pin.motion import Motion
from fivebar_pin.paper.assembly_mode import AssemblyMode
from fivebar_pin.paper.linkage import FiveBar
from fivebar_pin.paper.path import check_path
from fivebar_pin.paper.positions import CArray, links, partials, passive_acceleration, unwrapped
from fivebar_pin.paper.solution import Solution

__all__ = ["solve", "solve_states"]

_BLOCK = 2048  # samples per block: the temporaries stay in the cache


@finite()
def solve(
    linkage: FiveBar,
    motion: Motion,
    *,
    mode: AssemblyMode = AssemblyMode.LEFT,
    gravity: npt.ArrayLike = (0.0, 0.0, 0.0),
) -> Solution:
    """Return the motion of all links and every force that it takes.

    Args:
        linkage: the linkage.
        motion: of psi and gamma; na = 2.
        mode: assembly mode, kept throughout.
        gravity: (3,) [m/s2]; the paper's linkage moves without.

    Raises:
        AssemblyError: the loop cannot be closed at some sample (which one, and by how much).
        SingularityError: O2, O3, O4 on a line at a sample, or between two of them.
        InvalidInputError: the motion does not have two columns.
    """
    driven = _driven(motion.q, motion.v, motion.a)
    return _solve(linkage, motion.t, driven, AssemblyMode.parse(mode), gravity, motion.t)


@finite()
def solve_states(
    linkage: FiveBar,
    q: npt.ArrayLike,
    v: npt.ArrayLike,
    a: npt.ArrayLike,
    *,
    mode: AssemblyMode = AssemblyMode.LEFT,
    gravity: npt.ArrayLike = (0.0, 0.0, 0.0),
) -> Solution:
    """Return the same as `solve` for unrelated states: q, v, a (n, 2) of psi and gamma; t counts the samples."""
    x = checked("q", q, (None, 2))
    y, z = checked("v", v, x.shape), checked("a", a, x.shape)
    t = frozen(np.arange(len(x)))
    return _solve(linkage, t, _driven(x, y, z), AssemblyMode.parse(mode), gravity, None)


def _driven(q: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
    if q.shape[1] != 2:
        raise InvalidInputError("shape of motion.q", q.shape, "must be (n, 2): psi and gamma")
    return np.ascontiguousarray(q.T), np.ascontiguousarray(v.T), np.ascontiguousarray(a.T)


def _solve(
    linkage: FiveBar,
    t: Array,
    driven: tuple[Array, Array, Array],
    mode: AssemblyMode,
    gravity: npt.ArrayLike,
    times: Array | None,
) -> Solution:
    n, g = t.size, checked("gravity", gravity, (3,))
    out = _Rows(
        angles=np.empty((4, n)),
        rates=np.empty((4, n)),
        accelerations=np.empty((4, n)),
        partials=np.empty((2, 2, n)),
        torque=np.empty((2, n)),
        forces=np.empty((5, n), dtype=np.complex128),
        reach2=np.empty(n),
        force=np.zeros((3, n)),
        moment=np.zeros((3, n)),
        frame_force=np.zeros((3, n)),
        frame_moment=np.zeros((3, n)),
        com=np.zeros((3, n)),
    )
    load = _Coefficients.of(linkage, g)
    for k in range(0, n, _BLOCK):
        s = slice(k, min(k + _BLOCK, n))
        q, v, a = (x[:, s] for x in driven)
        try:
            b, X, out.reach2[s] = links(linkage.lengths, q[0], q[1], mode=mode)
        except (AssemblyError, SingularityError):
            links(linkage.lengths, *driven[0], mode=mode, times=times)  # names the worst sample of all
            raise
        _move(b, X, (q, v, a), out, s)
        _load(load, b, X, out, s)
    if times is not None:
        check_path(linkage, times, driven, np.sqrt(out.reach2))
        out.angles[1:3] = unwrapped(out.angles[1:3])
    f = out.forces.view(np.float64).reshape(5, n, 2).transpose(1, 0, 2)
    arrays = [x.T for x in (out.angles, out.rates, out.accelerations)]
    arrays += [out.partials.transpose(2, 0, 1), out.torque.T, f, out.force.T, out.moment.T]
    arrays += [out.frame_force.T, out.frame_moment.T, out.com.T]
    for array in arrays:
        array.setflags(write=False)
    return Solution(linkage, mode, t, *arrays)


@dataclass(frozen=True, slots=True, eq=False)
class _Rows:
    """Where the results of the blocks go: one row per quantity, samples last."""

    angles: Array
    rates: Array
    accelerations: Array
    partials: Array
    torque: Array
    forces: CArray
    reach2: Array
    force: Array
    moment: Array
    frame_force: Array
    frame_moment: Array
    com: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Coefficients:
    """Constants of the linkage: everything below is linear in them."""

    a5: float
    K: CArray  # offsets over link length, conjugated (4, 1)
    mK: CArray  # m_i times offset over link length (4, 1)
    first: CArray  # first moment per link vector (4, 1): m c = sum(first * b) + m_fixed
    m_fixed: float  # (m3 + m4) a5 [kg m]
    masses: list[float]
    inertias: Array  # (4, 1)
    mass: float
    gravity: list[float]

    @classmethod
    def of(cls, linkage: FiveBar, gravity: Array) -> _Coefficients:
        m, a5 = linkage.masses, float(linkage.lengths[4])
        K = linkage.offsets / linkage.lengths[:4]
        first = (m * K + np.array([m[1], 0.0, 0.0, m[2]]))[:, None]
        fixed = float(m[2] + m[3]) * a5
        mass, I = float(m.sum()), linkage.inertias[:, None]
        return cls(a5, K.conj()[:, None], (m * K)[:, None], first, fixed, m.tolist(), I, mass, gravity.tolist())


def _move(b: CArray, X: Array, driven: tuple[Array, Array, Array], out: _Rows, s: slice) -> None:
    """Fill angles, rates, accelerations and partial derivatives of one block."""
    q, v, a = driven
    angles, rates, accelerations = out.angles[:, s], out.rates[:, s], out.accelerations[:, s]
    P = partials(b, X, out=out.partials[..., s])
    angles[::3], rates[::3], accelerations[::3] = q, v, a
    np.arctan2(b[1:3].imag, b[1:3].real, out=angles[1:3])
    np.multiply(P[:, 0], v[0], out=rates[1:3])
    rates[1:3] += P[:, 1] * v[1]
    accelerations[1:3] = passive_acceleration(b, X, P, rates, a)


def _load(k: _Coefficients, b: CArray, X: Array, out: _Rows, s: slice) -> None:
    """Fill torques, joint forces, what shakes the frame and what it carries, and the mass centre of one block."""
    e, p, n = _inertia_loads(k, b, out.rates[:, s], out.accelerations[:, s])
    force, moment = out.force[:, s], out.moment[:, s]
    pull = (k.first * e).sum(axis=0)
    np.negative(pull.real, out=force[0])  # F = -m c''
    np.negative(pull.imag, out=force[1])
    # M_O = -sum of the moments about the joints of the tree and of the forces there: O1, O2, O4, O0
    carried = np.conj(b[0]) * p[1] + np.conj(b[3]) * p[2]
    moment[2] = -(n.sum(axis=0) + carried.imag + k.a5 * (p[2] + p[3]).imag)
    _add_weight(k, b, p, n)
    f01, f12, f23, f34, f40 = f = out.forces[:, s]
    np.multiply(b[1], n[2], out=f23)  # Im(conj(b2) f23) = -n2, Im(conj(b3) f23) = n3
    f23 += b[2] * n[1]
    f23 /= -X
    np.add(f23, p[1], out=f12)  # (22b), link by link
    np.add(f12, p[0], out=f01)
    np.subtract(f23, p[2], out=f34)
    np.subtract(f34, p[3], out=f40)
    turn = (np.conj(b[::3]) * f[1:4:2]).imag
    tau = out.torque[:, s]
    np.add(n[0], turn[0], out=tau[0])  # (22a) of links 1 and 4
    np.subtract(n[3], turn[1], out=tau[1])
    com = out.com[:, s]
    # not first @ b: on a busy machine threaded BLAS makes four rows wait for a core
    centre = (k.first * b).sum(axis=0)
    centre += k.m_fixed
    np.divide(centre.real, k.mass, out=com[0])
    np.divide(centre.imag, k.mass, out=com[1])
    _fill_frame(k, f40, tau, out, s)


def _fill_frame(k: _Coefficients, f40: CArray, tau: Array, out: _Rows, s: slice) -> None:
    """Fill what the frame carries: the moment from its reactions f40, -tau1, -tau4, out of the plane the weight."""
    weight = [k.mass * g for g in k.gravity]
    force, moment, com = out.frame_force[:, s], out.frame_moment[:, s], out.com[:, s]
    for axis in range(3):
        np.add(out.force[axis, s], weight[axis], out=force[axis])
    np.multiply(f40.imag, k.a5, out=moment[2])
    moment[2] -= tau[0]
    moment[2] -= tau[1]
    if weight[2] != 0.0:
        np.multiply(com[1], weight[2], out=moment[0])
        np.multiply(com[0], -weight[2], out=moment[1])


def _add_weight(k: _Coefficients, b: CArray, p: CArray, n: Array) -> None:
    """Take the weight of the links out of p and its moments out of n, in place."""
    gx, gy, _ = k.gravity
    if gx != 0.0 or gy != 0.0:
        g = complex(gx, gy)
        p -= np.array(k.masses)[:, None] * g
        n -= (np.conj(b * k.mK) * g).imag


def _inertia_loads(k: _Coefficients, b: CArray, rates: Array, accelerations: Array) -> tuple[CArray, CArray, Array]:
    """Return e = b'' (4, n) [m/s2], and p (4, n) [N] and n (4, n) [N m] of the module's head without gravity."""
    beta = np.empty_like(b)
    np.multiply(rates, rates, out=beta.real)
    np.negative(beta.real, out=beta.real)
    beta.imag[...] = accelerations
    e = b * beta
    p = e * k.mK
    p[1] += k.masses[1] * e[0]
    p[2] += k.masses[2] * e[3]
    n = (np.conj(b) * p * k.K).imag
    n += k.inertias * accelerations
    return e, p, n
