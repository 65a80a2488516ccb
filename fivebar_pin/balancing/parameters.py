"""Inertial parameters: Pinocchio's ten per body, the four that a planar mechanism feels, and what makes them physical.

Ten: m, m c (3), I_xx, I_xy, I_yy, I_xz, I_yz, I_zz about the joint origin in joint axes. With n the normal of the plane
in body axes and e_1, e_2 completing it, the four of a planar body are m, m c.e_1, m c.e_2 and n.I n.

A mass distribution with these moments exists if and only if the pseudo-inertia [Wensing, Kim, Slotine 2018]

    P = [[S, m c], [m c^T, m]],   S = tr(I)/2 1 - I  (second moments)

is positive semidefinite; for the planar four this reads m >= 0 and |m c|^2 <= m I.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array, Immutable, frozen

__all__ = ["INERTIA_PAIRS", "TEN", "Space", "from_pseudo_inertia", "inertia_matrix", "plane_axes", "pseudo_inertia"]

TEN = ("m", "mcx", "mcy", "mcz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
INERTIA_PAIRS = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))  # order of the inertia entries
_AXES = "xyz"
_PARALLEL = 1e-9  # sine of the angle up to which a normal is taken for the joint axis next to it [-]
_ALIGNED = 1e-12  # difference of an axis to that of a joint, for the parameter to be called after it [-]


def inertia_matrix(pi: Array) -> Array:
    """Return the inertia about the joint origin (..., 3, 3) of parameters (..., 10)."""
    I = np.empty((*pi.shape[:-1], 3, 3))
    for k, (i, j) in enumerate(INERTIA_PAIRS):
        I[..., i, j] = I[..., j, i] = pi[..., 4 + k]
    return I


def pseudo_inertia(pi: Array) -> Array:
    """Return the pseudo-inertia (..., 4, 4) of parameters (..., 10)."""
    I = inertia_matrix(pi)
    P = np.empty((*pi.shape[:-1], 4, 4))
    trace = I[..., 0, 0] + I[..., 1, 1] + I[..., 2, 2]
    P[..., :3, :3] = 0.5 * trace[..., None, None] * np.eye(3) - I
    P[..., :3, 3] = P[..., 3, :3] = pi[..., 1:4]
    P[..., 3, 3] = pi[..., 0]
    return P


def from_pseudo_inertia(P: Array) -> Array:
    """Return the parameters (..., 10) of a pseudo-inertia (..., 4, 4)."""
    pi = np.empty((*P.shape[:-2], 10))
    S = P[..., :3, :3]
    I = (S[..., 0, 0] + S[..., 1, 1] + S[..., 2, 2])[..., None, None] * np.eye(3) - S
    pi[..., 0], pi[..., 1:4] = P[..., 3, 3], P[..., :3, 3]
    for k, (i, j) in enumerate(INERTIA_PAIRS):
        pi[..., 4 + k] = I[..., i, j]
    return pi


@dataclass(frozen=True, slots=True, eq=False)
class Space(Immutable):
    """The parameters that conditions and designs are written in: four per body (planar) or ten (spatial).

    Attributes:
        bodies: names of the bodies' joints (nb,).
        normal: normal of the plane in the world (3,), or None when spatial.
        axes: per body the rows e_1, e_2, n in joint axes (nb, 3, 3); e_3 = n. Joint axes when spatial.
        length: unit of length [m]: a parameter is divided by length ** order.
    """

    bodies: tuple[str, ...]
    normal: Array | None
    axes: Array
    length: float

    @property
    def planar(self) -> bool:
        """Whether the mechanism moves in parallel planes."""
        return self.normal is not None

    @property
    def width(self) -> int:
        """Parameters per body."""
        return 4 if self.planar else 10

    @property
    def orders(self) -> Array:
        """Power of length in each parameter of one body (width,)."""
        return np.array([0.0, 1.0, 1.0, 2.0] if self.planar else [0.0] + [1.0] * 3 + [2.0] * 6)

    @property
    def scale(self) -> Array:
        """Unit of each parameter of all bodies (nb * width,), masses in kg."""
        return np.tile(self.length**self.orders, len(self.bodies))

    @property
    def names(self) -> tuple[str, ...]:
        """Names such as 'mcx(psi)', body by body."""
        return tuple(f"{p}({b})" for k, b in enumerate(self.bodies) for p in self._own_names(k))

    def selection(self) -> Array:
        """Return T (nb * width, 10 nb): parameters of this space = T @ (stacked ten per body)."""
        nb, w = len(self.bodies), self.width
        T = np.zeros((nb * w, 10 * nb))
        for b in range(nb):
            T[b * w : (b + 1) * w, 10 * b : 10 * (b + 1)] = self._body_selection(b)
        return T

    def injection(self) -> Array:
        """Return U (10 nb, nb * width), T U = 1: ten parameters that carry the planar ones and nothing else."""
        return np.asarray(np.linalg.pinv(self.selection())) if self.planar else np.eye(10 * len(self.bodies))

    def of(self, pi: Array) -> Array:
        """Return the parameters of this space (nb, width) of ten per body (nb, 10)."""
        return (self.selection() @ pi.reshape(-1)).reshape(len(self.bodies), self.width)

    def _body_selection(self, b: int) -> Array:
        if not self.planar:
            return np.eye(10)
        T = np.zeros((4, 10))
        T[0, 0] = 1.0
        T[1:3, 1:4] = self.axes[b, :2]
        n = self.axes[b, 2]
        for k, (i, j) in enumerate(INERTIA_PAIRS):
            T[3, 4 + k] = n[i] * n[j] * (1.0 if i == j else 2.0)
        return T

    def _own_names(self, b: int) -> tuple[str, ...]:
        if not self.planar:
            return TEN
        letters = []
        for axis in self.axes[b]:
            k = int(np.argmax(np.abs(axis)))
            letters.append(_AXES[k] if np.allclose(axis, np.eye(3)[k], atol=_ALIGNED) else "")
        if "" in letters:
            letters = ["1", "2", "n"]
        return ("m", f"mc{letters[0]}", f"mc{letters[1]}", f"I{letters[2]}{letters[2]}")


def plane_axes(n: Array) -> Array:
    """Return the rows e_1, e_2, n (3, 3), right-handed; joint axes where n is one of them (up to sign)."""
    k = int(np.argmax(np.abs(n)))
    unit = np.eye(3)[k]
    if np.linalg.norm(np.cross(unit, n)) < _PARALLEL:
        return frozen([np.eye(3)[(k + 1) % 3], np.eye(3)[(k + 2) % 3], unit])
    e1 = np.cross(n, np.eye(3)[int(np.argmin(np.abs(n)))])
    e1 /= np.linalg.norm(e1)
    return frozen([e1, np.cross(n, e1), n])


def lowest_eigenvalue(x: Array, *, planar: bool) -> float:
    """Return the smallest eigenvalue of the pseudo-inertia of one body (4,) or (10,)."""
    if planar:
        h = float(np.hypot(x[1], x[2]))
        return float(np.linalg.eigvalsh(np.array([[x[3], h], [h, x[0]]]))[0])
    return float(np.linalg.eigvalsh(pseudo_inertia(x))[0])
