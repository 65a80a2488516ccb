"""The cones of our programs: zero, half-lines, second-order cones, positive semidefinite matrices.

A symmetric matrix stands as its scaled upper triangle, column by column: M_ij times sqrt(2) off the diagonal, so that
inner products are those of the matrices. All but "zero" are their own duals; its dual is everything.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fivebar_pin._arrays import Array

__all__ = ["CONES", "outside", "projected", "scaling", "smat", "svec", "vector"]

CONES = ("zero", "nonneg", "soc", "psd")  # in the order in which programs hold them
ROOT2 = float(np.sqrt(2.0))


def svec(rows: Sequence[Sequence[Array]]) -> Array:
    """Stack linear functionals M_ij (n,) of a symmetric matrix into the scaled triangle of a "psd" block."""
    size = len(rows)
    return np.stack([rows[i][j] * (1.0 if i == j else ROOT2) for j in range(size) for i in range(j + 1)])


def smat(s: Array) -> Array:
    """Return the symmetric matrix of a scaled triangle."""
    size = int(np.sqrt(2 * s.size))
    M = np.zeros((size, size))
    k = 0
    for j in range(size):
        for i in range(j + 1):
            M[i, j] = M[j, i] = s[k] / (1.0 if i == j else ROOT2)
            k += 1
    return M


def outside(cone: str, s: Array) -> float:
    """Return how far s (rows,) is outside one cone."""
    if not s.size:
        return 0.0
    if cone == "zero":
        return float(np.abs(s).max())
    if cone == "nonneg":
        return max(0.0, -float(s.min()))
    if cone == "soc":
        return max(0.0, float(np.linalg.norm(s[1:]) - s[0]))
    return max(0.0, -float(np.linalg.eigvalsh(smat(s))[0]))


def vector(M: Array) -> Array:
    """Return the scaled triangle of a symmetric matrix."""
    size = len(M)
    return np.array([M[i, j] * (1.0 if i == j else ROOT2) for j in range(size) for i in range(j + 1)])


def projected(cone: str, z: Array) -> Array:
    """Return the point of the dual cone that is closest to z (rows,)."""
    if cone == "zero" or not z.size:
        return z
    if cone == "nonneg":
        return np.maximum(z, 0.0)
    if cone == "soc":
        size = float(np.linalg.norm(z[1:]))
        if size <= z[0]:
            return z
        if size <= -z[0]:
            return np.zeros_like(z)
        return np.asarray(0.5 * (1.0 + z[0] / size) * np.concatenate([[size], z[1:]]))
    values, vectors = np.linalg.eigh(smat(z))
    return z if values[0] >= 0.0 else vector((vectors * np.maximum(values, 0.0)) @ vectors.T)


def scaling(cone: str, z: Array) -> Array:
    """Return the matrix W (rows, rows) that takes the unit of a cone to its point z, and the cone onto itself."""
    if cone == "zero":
        return np.eye(z.size)
    if cone == "nonneg":
        return np.diag(z)
    if cone == "soc":
        size = float(np.linalg.norm(z[1:]))
        more, less = np.sqrt(max(z[0] + size, 0.0)), np.sqrt(max(z[0] - size, 0.0))
        root = np.concatenate([[more + less], (more - less) * z[1:] / (size or 1.0)]) / 2.0
        flip = -np.eye(z.size)
        flip[0, 0] = 1.0
        return np.asarray(2.0 * np.outer(root, root) - more * less * flip)
    values, vectors = np.linalg.eigh(smat(z))
    root = (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
    return np.stack([vector(root @ smat(e) @ root) for e in np.eye(z.size)], axis=1)
