"""Position, velocity and acceleration of the five-bar in closed form, elementwise over the samples.

Link vectors are complex numbers, (9): b1 = a1 e^{i psi}, b2 = a2 e^{i theta}, b3 = a3 e^{i phi}, b4 = a4 e^{i gamma}.
The loop (1) reads b1 + b2 = a5 + b4 + b3. With d = a5 + b4 - b1, the vector from O2 to O4, and D = |d|^2,

    b2 = d (u + i X) / D,   u = (a2^2 - a3^2 + D) / 2,   X = +-sqrt(a2^2 D - u^2) = Im(conj(b2) b3)

solves (2)-(6) without half tangents; the sign of X is the assembly mode. X is also the determinant of the passive
closure Jacobian, so that X = 0 is the type 2 singularity (O2, O3, O4 on a line).

From b2 theta' - b3 phi' = b4 gamma' - b1 psi' follow the partial derivatives of the passive angles, theta_psi =
Im(conj(b3) b1) / X and so on, and from its rate, with g = b1 psi'^2 + b2 theta'^2 - b3 phi'^2 - b4 gamma'^2,

    theta'' = Re(conj(b3) g) / X + theta_psi psi'' + theta_gamma gamma'',
    phi'' = Re(conj(b2) g) / X + phi_psi psi'' + phi_gamma gamma''.

The paper's ratios are r_theta = theta_psi + theta_gamma r_gamma, r_phi = phi_psi + phi_gamma r_gamma; these never
divide by psi'.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, finite, require_finite
from fivebar_pin.errors import AssemblyError, SingularityError
from fivebar_pin.paper.assembly_mode import AssemblyMode

__all__ = ["CArray", "Pose", "close", "in_rows", "position"]

CArray = npt.NDArray[np.complex128]

SINGULAR = 1e-7  # |sin(theta - phi)| [-] below this counts as singular: its square is at round-off


@dataclass(frozen=True, slots=True, eq=False)
class Pose(Immutable):
    """Positions of the linkage. Angles (n,) [rad] in (-pi, pi], link vectors b (4, n) [m], X (n,) [m2]."""

    theta: Array
    phi: Array
    b: CArray
    X: Array


def close(
    lengths: Array, q: Array, *, mode: AssemblyMode = AssemblyMode.LEFT, times: Array | None = None
) -> tuple[CArray, Array, Array]:
    """Return the link vectors b (4, n) [m], the triangle O2 O3 O4 as D, X^2, X (n, 3), and theta, phi (2, n) [rad].

    Args:
        lengths: a1 .. a5 (5,) [m].
        q: psi and gamma (n, 2) [rad], row by row in memory.
        mode: which of the two closures.
        times: times (n,) [s] for the messages.

    Raises:
        AssemblyError: a sample at which the links do not reach.
        SingularityError: a sample at which O2, O3, O4 lie on a line.
    """
    from fivebar_pin.paper.kernels import close_loops

    b, triangle = np.empty((4, len(q)), dtype=np.complex128), np.empty((len(q), 3))
    if close_loops(lengths, mode.sign, _least(lengths), np.tan(0.5 * q), b, triangle):
        _refuse(lengths, np.sqrt(triangle[:, 0]), triangle[:, 1], times)
    return b, triangle, np.arctan2(b[1:3].imag, b[1:3].real)


@finite()
def position(lengths: Array, psi: Array, gamma: Array, *, mode: AssemblyMode = AssemblyMode.LEFT) -> Pose:
    """Return theta and phi from psi and gamma, (2)-(7), with the branch of (7) kept by atan2; see `close`."""
    b, triangle, passive = close(lengths, in_rows(np.stack([psi, gamma], axis=1)), mode=AssemblyMode.parse(mode))
    return Pose(passive[0], passive[1], b, triangle[:, 2].copy())


def in_rows(x: Array) -> Array:
    """Return x row by row in memory and read-only, the one form that the kernels are compiled for."""
    rows = np.ascontiguousarray(x)
    rows.setflags(write=False)
    return rows


def sigma(lengths: Array, X: npt.ArrayLike) -> Array:
    """Return sqrt(1 - |cos(theta - phi)|), the smallest singular value of the passive Jacobian with unit columns."""
    sine = np.clip(np.abs(np.asarray(X)) / (lengths[1] * lengths[2]), 0.0, 1.0)
    return np.asarray(sine / np.sqrt(1.0 + np.sqrt(1.0 - sine * sine)))


def _least(lengths: Array) -> float:
    """Return X^2 up to which O2, O3, O4 count as on a line [m4]."""
    area = float(lengths[1]) * float(lengths[2])
    require_finite("(a2 a3)^2", area * area)
    return (SINGULAR * area) ** 2


def _refuse(lengths: Array, reach: Array, square: Array, times: Array | None) -> None:
    """Raise for the worst of the samples whose loop does not close, or else for the first singular one."""
    a2, a3 = float(lengths[1]), float(lengths[2])
    small = _least(lengths)
    open_ = square + small < 0.0
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
    k = int(np.flatnonzero(square <= small)[0])
    raise SingularityError(
        f"O2, O3 and O4 lie on a line at {_where(k, times)}: theta and phi are not determined there "
        "(type 2 singularity). Keep the motion away from it.",
        sigma=float(sigma(lengths, np.sqrt(max(square[k], 0.0)))),
        sample=k,
        time=None if times is None else float(times[k]),
    )


def _where(k: int, times: Array | None) -> str:
    return f"sample {k}" + ("" if times is None else f", t = {times[k]:.6g} s")
