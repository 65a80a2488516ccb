"""The paper's matrices along a solution: A, B, M, u, I(q) (`inertia`), C and tau, repaired; as printed where wrong.

Twists are stacked link by link, t = (omega_1, c_1', ..., omega_4, c_4'), (12,); joint forces f01, f12, f23, f34, f40,
(10,). r_i goes from O_i to the mass centre C_i and b_i = r_{i,i+1} - r_i from there to O_{i+1}. E turns by +90 degrees.
"""

from __future__ import annotations

import numpy as np

from fivebar_pin._arrays import Array, finite
from fivebar_pin.errors import UnknownNameError
from fivebar_pin.paper.linkage import FiveBar
from fivebar_pin.paper.solution import Solution
from fivebar_pin.paper.velocity_ratios import FORMS, ratio_rates, ratios

__all__ = ["TWISTS", "A", "B", "C", "M", "inertia", "tau", "twist", "twist_rate", "u", "u_dot", "vectors"]

TWISTS = tuple(f"{x}{i}" for i in range(1, 5) for x in ("omega_", "c'_x", "c'_y"))


@finite()
def vectors(solution: Solution) -> tuple[Array, Array, Array]:
    """Return r_i, b_i and r_{i,i+1}, each (n, 4, 2) [m], world axes."""
    z = np.exp(1j * solution.angles) * (solution.linkage.lengths[:4] * np.array([1.0, 1.0, -1.0, -1.0]))
    r = solution.linkage.kappa * z  # (54)
    return _pairs(r), _pairs(z - r), _pairs(z)


def A(solution: Solution, *, form: str = "repaired") -> Array:
    """Return the constraint matrix (36), A t = 0, (n, 10, 12).

    As printed, its first block row has an identity block at the third link. A 2 x 2 identity does not fit the column
    of omega_3 where it stands; it is put at c_3' here.
    """
    _known(form)
    r, b, _ = vectors(solution)
    out = np.zeros((len(solution), 10, 12))
    for i in range(4):
        here, twist_columns = 2 * i, 3 * i
        out[:, here : here + 2, twist_columns] = -_turned(r[:, i])
        out[:, here : here + 2, twist_columns + 1 : twist_columns + 3] = np.eye(2)
        out[:, here + 2 : here + 4, twist_columns] = -_turned(b[:, i])
        out[:, here + 2 : here + 4, twist_columns + 1 : twist_columns + 3] = -np.eye(2)
    if form == "printed":
        out[:, 0:2, 7:9] = np.eye(2)
    return out


def printed_neighbours(solution: Solution) -> Array:
    """Return (33) with the blocks as (34) prints them, A_{i,i-1} t_{i-1} + A_{i,i} t_i for i = 2, 3, 4, (n, 3, 2)."""
    r, b, _ = vectors(solution)
    t = twist(solution).reshape(-1, 4, 3)
    return np.asarray(_turned(b[:, :3]) * t[:, :3, :1] + t[:, :3, 1:] - _turned(r[:, 1:]) * t[:, 1:, :1] + t[:, 1:, 1:])


def B(solution: Solution) -> Array:
    """Return the wrench matrix (28), M t' = w + B f, (n, 12, 10); it is the transpose of the repaired A."""
    r, b, _ = vectors(solution)
    out = np.zeros((len(solution), 12, 10))
    for i in range(4):
        row, column = 3 * i, 2 * i
        out[:, row, column : column + 2] = -_turned(r[:, i])  # r^T E = -(E r)^T
        out[:, row, column + 2 : column + 4] = -_turned(b[:, i])
        out[:, row + 1 : row + 3, column : column + 2] = np.eye(2)
        out[:, row + 1 : row + 3, column + 2 : column + 4] = -np.eye(2)
    return out


def M(linkage: FiveBar) -> Array:
    """Return the extended mass matrix (27), diag(I_1, m_1, m_1, ..., I_4, m_4, m_4), (12, 12)."""
    return np.diag(np.stack([linkage.inertias, linkage.masses, linkage.masses], axis=1).ravel())


@finite()
def u(solution: Solution, *, form: str = "repaired") -> Array:
    """Return the complement (41), t = u (psi', gamma'), (n, 12, 2).

    Repaired, its columns hold the partial derivatives of theta and phi, exist at psi' = 0 and satisfy A u = 0. As
    printed, the first column holds r_theta and r_phi and the second has zeros there: only the product with (psi',
    gamma') is right, A u is not zero, and psi' must not vanish.
    """
    _known(form)
    return _complement(solution, _passive(solution, form))


@finite()
def u_dot(solution: Solution, *, form: str = "repaired") -> Array:
    """Return the time derivative of u, (n, 12, 2)."""
    _known(form)
    return _complement_rate(solution, _passive(solution, form), _passive_rate(solution, form))


@finite()
def twist(solution: Solution) -> Array:
    """Return t (n, 12), (38), from the rates of all four links."""
    r, b, z = vectors(solution)
    w = solution.rates[..., None]
    out = np.empty((len(solution), 4, 3))
    out[..., :1] = w
    out[:, 0, 1:] = _turned(r[:, 0]) * w[:, 0]
    out[:, 1, 1:] = _turned(z[:, 0]) * w[:, 0] + _turned(r[:, 1]) * w[:, 1]
    out[:, 2, 1:] = -_turned(z[:, 3]) * w[:, 3] - _turned(b[:, 2]) * w[:, 2]
    out[:, 3, 1:] = -_turned(b[:, 3]) * w[:, 3]
    return out.reshape(-1, 12)


@finite()
def twist_rate(solution: Solution, *, form: str = "repaired") -> Array:
    """Return t' = u q'' + u' q' (n, 12), (45); printed and repaired u agree on it."""
    v, a = solution.rates[:, ::3], solution.accelerations[:, ::3]
    return _apply(u(solution, form=form), a) + _apply(u_dot(solution, form=form), v)


@finite()
def inertia(solution: Solution, *, form: str = "repaired") -> Array:
    """Return the generalized inertia matrix u^T M u of (46), (n, 2, 2) [kg m2]."""
    U = u(solution, form=form)
    return np.asarray(np.swapaxes(U, 1, 2) @ M(solution.linkage) @ U)


def C(solution: Solution, *, form: str = "repaired") -> Array:
    """Return C = -u^T M u' of (46), I q'' = C q' + tau, (n, 2, 2) [kg m2/s]."""
    U = u(solution, form=form)
    return np.asarray(-np.swapaxes(U, 1, 2) @ M(solution.linkage) @ u_dot(solution, form=form))


@finite()
def tau(solution: Solution, *, form: str = "repaired") -> Array:
    """Return the motor torques without gravity, tau = u^T M t', (72), (n, 2) [N m]."""
    U = u(solution, form=form)
    return np.asarray(_apply(np.swapaxes(U, 1, 2), twist_rate(solution) @ M(solution.linkage)))


def _known(form: str) -> None:
    if form not in FORMS:
        raise UnknownNameError("form", form, FORMS)


def _passive(solution: Solution, form: str) -> Array:
    """Rows theta, phi of the angular part of u (n, 2, 2): partial derivatives, or the printed ratios beside zeros."""
    if form == "repaired":
        return solution.partials
    out = np.zeros((len(solution), 2, 2))
    r = ratios(solution)
    out[:, 0, 0], out[:, 1, 0] = r.theta, r.phi
    return out


def _passive_rate(solution: Solution, form: str) -> Array:
    """Time derivative of `_passive` (n, 2, 2) [1/s]."""
    out = np.zeros((len(solution), 2, 2))
    if form == "printed":
        r = ratio_rates(solution)
        out[:, 0, 0], out[:, 1, 0] = r.theta, r.phi
        return out
    w = solution.rates
    z = np.exp(1j * solution.angles) * solution.linkage.lengths[:4]
    product = np.conj(z)[:, :, None] * z[:, None, :]  # real: dot products, imaginary: cross products of b_i, b_j
    rate = product.real * (w[:, None, :] - w[:, :, None])  # of the cross products
    X, dX = product[:, 1, 2].imag, rate[:, 1, 2]
    for row, other in ((0, 2), (1, 1)):  # theta from b3, phi from b2
        for column, driver, sign in ((0, 0, 1.0), (1, 3, -1.0)):
            out[:, row, column] = sign * rate[:, other, driver] / X - solution.partials[:, row, column] * dX / X
    return out


def _complement(solution: Solution, P: Array) -> Array:
    r, b, z = vectors(solution)
    out = np.zeros((len(solution), 4, 3, 2))
    out[:, 0, 0, 0] = out[:, 3, 0, 1] = 1.0
    out[:, 1, 0], out[:, 2, 0] = P[:, 0], P[:, 1]
    out[:, 0, 1:, 0] = _turned(r[:, 0])
    out[:, 1, 1:] = _turned(r[:, 1])[:, :, None] * P[:, 0, None]
    out[:, 1, 1:, 0] += _turned(z[:, 0])
    out[:, 2, 1:] = -_turned(b[:, 2])[:, :, None] * P[:, 1, None]
    out[:, 2, 1:, 1] -= _turned(z[:, 3])
    out[:, 3, 1:, 1] = -_turned(b[:, 3])
    return out.reshape(-1, 12, 2)


def _complement_rate(solution: Solution, P: Array, dP: Array) -> Array:
    """Differentiate `_complement` term by term: (E x)' = -omega x."""
    r, b, z = vectors(solution)
    w = solution.rates[..., None]
    out = np.zeros((len(solution), 4, 3, 2))
    out[:, 1, 0], out[:, 2, 0] = dP[:, 0], dP[:, 1]
    out[:, 0, 1:, 0] = -w[:, 0] * r[:, 0]
    out[:, 1, 1:] = _turned(r[:, 1])[:, :, None] * dP[:, 0, None] - (w[:, 1] * r[:, 1])[:, :, None] * P[:, 0, None]
    out[:, 1, 1:, 0] -= w[:, 0] * z[:, 0]
    out[:, 2, 1:] = -_turned(b[:, 2])[:, :, None] * dP[:, 1, None] + (w[:, 2] * b[:, 2])[:, :, None] * P[:, 1, None]
    out[:, 2, 1:, 1] += w[:, 3] * z[:, 3]
    out[:, 3, 1:, 1] = w[:, 3] * b[:, 3]
    return out.reshape(-1, 12, 2)


def _pairs(z: np.ndarray[tuple[int, ...], np.dtype[np.complex128]]) -> Array:
    return np.stack([z.real, z.imag], axis=-1)


def _turned(x: Array) -> Array:
    """E x, (23)."""
    return np.stack([-x[..., 1], x[..., 0]], axis=-1)


def _apply(matrix: Array, vector: Array) -> Array:
    return np.asarray((matrix @ vector[..., None])[..., 0])
