"""Small linear algebra over batches."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays.immutable import Array

_DENSE = 60  # rows or columns up to which a matrix is decomposed as a whole


def block_svd(A: Array) -> tuple[Array, Array, Array]:
    """Return U (m, m), s (min(m, n),), Vt (n, n) as `np.linalg.svd` does, each independent block of a large A alone.

    Rows and columns that no entry connects do not act on each other: the closures of a long row of loops fall into
    many small blocks, and the cost grows with their number instead of the cube of it.
    """
    m, n = A.shape
    if max(m, n) <= _DENSE or not A.size:
        return np.linalg.svd(A, full_matrices=True)
    U, Vt = np.zeros((m, m)), np.zeros((n, n))
    found: list[tuple[float, Any, Any, Any, Any]] = []
    blocks = _blocks(A)
    for rows, columns in blocks:
        u, s, vt = np.linalg.svd(A[np.ix_(rows, columns)], full_matrices=True)
        found += [(float(x), rows, u[:, k], columns, vt[k]) for k, x in enumerate(s)]
        found += [(-1.0, rows, u[:, k], None, None) for k in range(s.size, rows.size)]
        found += [(-1.0, None, None, columns, vt[k]) for k in range(s.size, columns.size)]
    found.sort(key=lambda entry: -entry[0])
    values = np.array([entry[0] for entry in found if entry[0] >= 0.0])
    left, right = 0, 0
    for _, rows, u, columns, v in found:
        if u is not None:
            U[rows, left], left = u, left + 1
        if v is not None:
            Vt[right, columns], right = v, right + 1
    return U, np.concatenate([values, np.zeros(min(m, n) - values.size)]), Vt


def _blocks(A: Array) -> list[tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]]:
    """Return rows and columns of every independent block; a row or column of zeros is a block of its own."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    m, n = A.shape
    i, j = np.nonzero(A)
    graph = coo_array((np.ones(i.size), (i, m + j)), shape=(m + n, m + n))
    count, label = connected_components(graph, directed=False)
    order = np.argsort(label, kind="stable")
    parts = np.split(order, np.searchsorted(label[order], np.arange(1, count)))
    return [(part[part < m], part[part >= m] - m) for part in parts]


def inverse(M: Array) -> tuple[Array, Array]:
    """Invert a batch of square matrices; singular ones become nan. Also return the determinants."""
    if M.shape[-1] == 2:
        return _inverse_of_two(M)
    return _inverse(M), np.asarray(np.linalg.det(M))


def _inverse_of_two(M: Array) -> tuple[Array, Array]:
    """The usual case of one planar loop in closed form: by the cofactors, far cheaper than a factorisation."""
    det = M[:, 0, 0] * M[:, 1, 1] - M[:, 0, 1] * M[:, 1, 0]
    with np.errstate(divide="ignore"):
        scale = np.where(det == 0.0, np.nan, 1.0 / det)
    X = np.empty_like(M)
    X[:, 0, 0], X[:, 1, 1] = M[:, 1, 1] * scale, M[:, 0, 0] * scale
    X[:, 0, 1], X[:, 1, 0] = -M[:, 0, 1] * scale, -M[:, 1, 0] * scale
    return X, det


def _inverse(M: Array) -> Array:
    """Invert a batch of square matrices by factorisation; singular ones become nan."""
    try:
        return np.asarray(np.linalg.inv(M))
    except np.linalg.LinAlgError:
        out = np.full_like(M, np.nan)
        for i, Mi in enumerate(M):
            try:
                out[i] = np.linalg.inv(Mi)
            except np.linalg.LinAlgError:
                continue
        return out


def skew(x: Array) -> Array:
    """Return [x]× with [x]× y = x × y.  x (..., 3) -> (..., 3, 3)."""
    S = np.zeros((*x.shape, 3))
    S[..., 0, 1], S[..., 0, 2], S[..., 1, 2] = -x[..., 2], x[..., 1], -x[..., 0]
    S[..., 1, 0], S[..., 2, 0], S[..., 2, 1] = x[..., 2], -x[..., 1], x[..., 0]
    return S


def cross(x: Array, y: Array) -> Array:
    """Return x × y along the last axis (far cheaper than np.cross for small batches)."""
    return np.stack(
        [
            x[..., 1] * y[..., 2] - x[..., 2] * y[..., 1],
            x[..., 2] * y[..., 0] - x[..., 0] * y[..., 2],
            x[..., 0] * y[..., 1] - x[..., 1] * y[..., 0],
        ],
        axis=-1,
    )
