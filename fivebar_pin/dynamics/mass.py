"""The mass matrix of an open tree whose joints may come in any order."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array, skew
from fivebar_pin.mechanism.tree import Tree

__all__ = ["composite_mass_matrix", "depth_first", "mass_matrix"]


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


def composite_mass_matrix(tree: Tree, model: pin.Model, q: Array) -> Array:
    """Return M(q), armature included (nv, nv), without pin.Data, whose tables grow with the cube of nv.

    Composite rigid bodies in world axes at the world origin: with I_j the inertia (6, 6) of everything that joint j
    carries and S its motion subspace, M_ik = S_i^T I_k S_k for every joint i on the way to joint k.
    """
    poses = tree.poses(q[None])
    S = poses.S[0]
    carried = np.zeros((tree.njoints, 6, 6))
    M = np.zeros((tree.nv, tree.nv))
    for j in range(tree.njoints - 1, 0, -1):
        joint, inertia = tree.joints[j], model.inertias[j]
        assert joint is not None
        R = poses.R[j][0]
        c, I = poses.p[j][0] + R @ inertia.lever, R @ inertia.inertia @ R.T
        C = skew(c)
        m = float(inertia.mass)
        carried[j] += np.block([[m * np.eye(3), -m * C], [m * C, I - m * C @ C]])
        carried[joint.parent] += carried[j]
        above = np.flatnonzero(tree.support[j])
        M[np.ix_(above, np.arange(tree.nv)[joint.v])] = S[:, above].T @ carried[j] @ S[:, joint.v]
        M[np.ix_(np.arange(tree.nv)[joint.v], above)] = M[np.ix_(above, np.arange(tree.nv)[joint.v])].T
    return np.asarray(M + np.diag(np.array(model.armature)))
