"""The forces in all joints and closures, as far as the model says them."""

from __future__ import annotations

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.regressors.reaction_rows import reaction_matrices
from fivebar_pin.balancing.regressors.rows import Rows
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics import inverse_dynamics
from fivebar_pin.dynamics.reactions import determinate
from fivebar_pin.trajectory import Trajectory

__all__ = ["bearing_forces", "by_bearing"]


def bearing_forces(chain: ClosedChain, path: Trajectory, about: Array) -> tuple[Array, Array]:
    """Return the determinate part of the forces in all joints and closures, three rows each."""
    joint, closure = reaction_matrices(chain, path)
    forces = np.concatenate([joint, closure], axis=1)[:, :, :3]
    forces = np.matmul(determinate(inverse_dynamics(chain, path).reactions.free), forces)
    forces = forces.reshape(len(path), -1, forces.shape[-1])
    return forces[..., :-1], forces[..., -1]


def by_bearing(name: str, chain: ClosedChain, F: Array, f: Array) -> Rows:
    """Group the rows by joint and closure, without those of which nothing is determinate."""
    names = (*chain.joints, *(c.name for c in chain.closures))
    used = [k for k in range(len(names)) if F[:, 3 * k : 3 * k + 3].any() or f[:, 3 * k : 3 * k + 3].any()]
    rows = np.array([3 * k + i for k in used for i in range(3)], dtype=np.intp)
    groups = tuple(slice(3 * k, 3 * k + 3) for k in range(len(used)))
    return Rows(name, F[:, rows], f[:, rows], groups, tuple(names[k] for k in used))
