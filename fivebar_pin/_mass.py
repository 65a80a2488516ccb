"""The mass matrix of an open tree whose joints may come in any order."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array

__all__ = ["depth_first", "mass_matrix"]


def depth_first(model: pin.Model) -> bool:
    """Tell whether each joint is followed by all the joints it carries: `pin.crba` is silently wrong otherwise."""
    parents = list(model.parents)
    path = [0]
    for j in range(1, model.njoints):
        while path and path[-1] != parents[j]:
            path.pop()
        if not path:
            return False
        path.append(j)
    return True


def mass_matrix(model: pin.Model, data: pin.Data, q: Array, *, ordered: bool) -> Array:
    """Return M(q), armature included (nv, nv).

    Args:
        model, data: the tree and a workspace.
        q: configuration (nq,).
        ordered: what `depth_first` tells; otherwise the columns come from inverse dynamics, M e_k = tau(e_k) - tau(0).
    """
    if ordered:
        upper = np.triu(pin.crba(model, data, q))
        return np.asarray(upper + np.triu(upper, 1).T)
    still = np.zeros(model.nv)
    rest = np.array(pin.rnea(model, data, q, still, still))
    columns = np.array([pin.rnea(model, data, q, still, unit) for unit in np.eye(model.nv)]) - rest
    return np.asarray(0.5 * (columns + columns.T))
