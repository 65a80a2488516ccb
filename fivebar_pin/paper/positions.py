"""Position, velocity and acceleration of the five-bar in closed form, elementwise over the samples.

Link vectors are complex numbers, (9): b1 = a1 e^{i psi}, b2 = a2 e^{i theta}, b3 = a3 e^{i phi}, b4 = a4 e^{i gamma}.
The loop (1) reads b1 + b2 = a5 + b4 + b3. With d = a5 + b4 - b1, the vector from O2 to O4, and D = |d|^2,

    b2 = d (u + i X) / D,   u = (a2^2 - a3^2 + D) / 2,   X = +-sqrt(a2^2 D - u^2) = Im(conj(b2) b3)

solves (2)-(6) without half tangents; the sign of X is the assembly mode. X is also the determinant of the passive
closure Jacobian, so that X = 0 is the type 2 singularity (O2, O3, O4 on a line).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable
from fivebar_pin.errors import AssemblyError, SingularityError
from fivebar_pin.paper.assembly_mode import AssemblyMode

__all__ = ["CArray", "Pose", "links", "partials", "position"]

CArray = npt.NDArray[np.complex128]

SINGULAR = 1e-7  # |sin(theta - phi)| [-] below this counts as singular: its square is at round-off


@dataclass(frozen=True, slots=True, eq=False)
class Pose(Immutable):
    """Positions of the linkage. Angles (n,) [rad] in (-pi, pi], link vectors b (4, n) [m], X (n,) [m2]."""

    theta: Array
    phi: Array
    b: CArray
    X: Array


def links(
    lengths: Array,
    psi: Array,
    gamma: Array,
    *,
    mode: AssemblyMode = AssemblyMode.LEFT,
    times: Array | None = None,
) -> tuple[CArray, Array, Array]:
    """Return the link vectors b (4, n) [m], X = Im(conj(b2) b3) (n,) [m2] and D = |O2 O4|^2 (n,) [m2].

    Args:
        lengths: a1 .. a5 (5,) [m].
        psi, gamma: input angles (n,) [rad].
        mode: which of the two closures.
        times: times (n,) [s] for the messages.

    Raises:
        AssemblyError: a sample at which the links do not reach.
        SingularityError: a sample at which O2, O3, O4 lie on a line.
    """
    a1, a2, a3, a4, a5 = lengths.tolist()
    b = np.empty((4, psi.size), dtype=np.complex128)
    b1, b2, b3, b4 = b
    np.cos(psi, out=b1.real)
    np.sin(psi, out=b1.imag)
    np.cos(gamma, out=b4.real)
    np.sin(gamma, out=b4.imag)
    b1 *= a1
    b4 *= a4
    d = b4 - b1
    d += a5
    D = d.real * d.real
    D += d.imag * d.imag
    turn = np.empty_like(d)
    u, X = turn.real, turn.imag
    np.add(D, a2 * a2 - a3 * a3, out=u)
    u *= 0.5
    X2 = a2 * a2 * D
    X2 -= u * u
    if psi.size and X2.min() <= (SINGULAR * a2 * a3) ** 2:
        _refuse(lengths, np.sqrt(D), X2, times)
    np.sqrt(X2, out=X)
    if AssemblyMode.parse(mode) is AssemblyMode.RIGHT:
        np.negative(X, out=X)
    X = X.copy()
    turn /= D
    np.multiply(d, turn, out=b2)
    np.subtract(b2, d, out=b3)
    return b, X, D


def position(
    lengths: Array,
    psi: Array,
    gamma: Array,
    *,
    mode: AssemblyMode = AssemblyMode.LEFT,
    times: Array | None = None,
) -> Pose:
    """Return theta and phi from psi and gamma, (2)-(7), with the branch of (7) kept by atan2; see `links`."""
    b, X, _ = links(lengths, psi, gamma, mode=mode, times=times)
    return Pose(np.angle(b[1]), np.angle(b[2]), b, X)


def partials(b: CArray, X: Array, *, out: Array | None = None) -> Array:
    """Return P (2, 2, n): [[theta_psi, theta_gamma], [phi_psi, phi_gamma]], partial derivatives of the passive angles.

    From b2 theta' - b3 phi' = b4 gamma' - b1 psi': theta_psi = Im(conj(b3) b1) / X, and so on. The paper's ratios are
    r_theta = theta_psi + theta_gamma r_gamma, r_phi = phi_psi + phi_gamma r_gamma; these never divide by psi'.
    """
    cross = (np.conj(b[2:0:-1])[:, None, :] * b[::3]).imag
    P = np.empty_like(cross) if out is None else out
    np.divide(cross[:, 0], X, out=P[:, 0])
    np.divide(cross[:, 1], -X, out=P[:, 1])
    return P


def passive_acceleration(b: CArray, X: Array, P: Array, rates: Array, driven: Array) -> Array:
    """Return (theta'', phi'') (2, n) [rad/s2].

    Args:
        b, X, P: link vectors, determinant and partial derivatives.
        rates: psi', theta', phi', gamma' (4, n) [rad/s].
        driven: psi'', gamma'' (2, n) [rad/s2].
    """
    pull = b * (rates * rates)  # centripetal terms of each link
    g = pull[0] + pull[1]
    g -= pull[2]
    g -= pull[3]
    out = (np.conj(b[2:0:-1]) * g).real
    out /= X
    out += P[:, 0] * driven[0]
    out += P[:, 1] * driven[1]
    return np.asarray(out)


def unwrapped(angles: Array) -> Array:
    """Return angles (k, n) made continuous along the samples."""
    if angles.shape[1] > 1 and np.abs(np.diff(angles)).max() > np.pi:
        return np.asarray(np.unwrap(angles, axis=1))
    return angles


def sigma(lengths: Array, X: npt.ArrayLike) -> Array:
    """Return sqrt(1 - |cos(theta - phi)|), the smallest singular value of the passive Jacobian with unit columns."""
    sine = np.clip(np.abs(np.asarray(X)) / (lengths[1] * lengths[2]), 0.0, 1.0)
    return np.asarray(sine / np.sqrt(1.0 + np.sqrt(1.0 - sine * sine)))


def _refuse(lengths: Array, reach: Array, X2: Array, times: Array | None) -> None:
    """Raise for the worst of the samples whose loop does not close, or else for the first singular one."""
    a2, a3 = float(lengths[1]), float(lengths[2])
    small = (SINGULAR * a2 * a3) ** 2
    open_ = X2 + small < 0.0
    gap = np.maximum(reach - (a2 + a3), abs(a2 - a3) - reach)
    if np.any(open_):
        k = int(np.argmax(gap))
        far = reach[k] > a2 + a3
        raise AssemblyError(
            f"The linkage cannot be assembled at {_where(k, times)}: O2 and O4 are {reach[k]:.6g} m apart, "
            + (f"links 2 and 3 reach {a2 + a3:.6g} m" if far else f"links 2 and 3 need {abs(a2 - a3):.6g} m")
            + f"; the loop stays open by {gap[k]:.3g} m ({int(np.sum(open_))} of {reach.size} samples fail). "
            "Change the lengths or the range of psi and gamma.",
            closure="O3",
            residual=float(gap[k]),
            sample=k,
            time=None if times is None else float(times[k]),
        )
    k = int(np.flatnonzero(X2 - small <= 0.0)[0])
    raise SingularityError(
        f"O2, O3 and O4 lie on a line at {_where(k, times)}: theta and phi are not determined there "
        "(type 2 singularity). Keep the motion away from it.",
        sigma=float(sigma(lengths, np.sqrt(max(X2[k], 0.0)))),
        sample=k,
        time=None if times is None else float(times[k]),
    )


def _where(k: int, times: Array | None) -> str:
    return f"sample {k}" + ("" if times is None else f", t = {times[k]:.6g} s")
