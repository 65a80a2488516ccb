"""Forces applied from outside: checked and mapped."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, cross, numeric
from fivebar_pin.chain import ClosedChain, find_frame
from fivebar_pin.errors import UnknownNameError
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.trajectory import Trajectory

__all__ = ["about_point", "applied_sizes", "applied_wrenches", "checked_wrenches", "on_ground"]


def about_point(point: Array, wrench: Array) -> Array:
    """Return the moments (n, 3) about a point of wrenches (n, 6) at the world origin."""
    return np.asarray(wrench[:, 3:] - cross(point, wrench[:, :3]))


def checked_wrenches(chain: ClosedChain, external: Mapping[str, npt.ArrayLike] | None, n: int) -> dict[str, Array]:
    names = [f.name for f in chain.model.frames]
    out = {}
    for name, wrench in (external or {}).items():
        if name not in names:
            raise UnknownNameError("frame of an external force", name, names)
        label = f"external[{name!r}]"
        w = numeric(label, wrench)
        out[name] = np.broadcast_to(checked(label, w, (6,)), (n, 6)) if w.ndim == 1 else checked(label, w, (n, 6))
    return out


def applied_wrenches(chain: ClosedChain, trajectory: Trajectory, applied: Mapping[str, Array]) -> tuple[Array, Array]:
    """Return the joint torques (n, nv) of the external forces and their sum at the world origin (n, 6)."""
    loops = loops_of(chain)
    poses = loops.tree.poses(trajectory.q)
    generalised, total = np.zeros_like(trajectory.v), np.zeros((len(trajectory), 6))
    for name, wrench in applied.items():
        frame = find_frame(chain.model, name)
        j = int(frame.parentJoint)
        point = poses.p[j] + np.matmul(poses.R[j], np.array(frame.placement.translation))
        at_origin = np.concatenate([wrench[:, :3], wrench[:, 3:] + cross(point, wrench[:, :3])], axis=1)
        total += at_origin
        generalised += np.einsum("nik,ni->nk", poses.S, at_origin) * loops.tree.support[j]
    return generalised, total


def applied_sizes(
    chain: ClosedChain, trajectory: Trajectory, applied: Mapping[str, Array], about: Array
) -> tuple[Array, Array, Array]:
    """Return the sums of the sizes of the external forces and moments (n,), and of their joint torques (n, nv)."""
    force, moment, generalised = np.zeros(len(trajectory)), np.zeros(len(trajectory)), np.zeros_like(trajectory.v)
    for name, wrench in applied.items():
        torque, at_origin = applied_wrenches(chain, trajectory, {name: wrench})
        generalised += np.abs(torque)
        force += np.linalg.norm(wrench[:, :3], axis=1)
        moment += np.linalg.norm(wrench[:, 3:], axis=1) + np.linalg.norm(
            about_point(about, at_origin) - wrench[:, 3:], axis=1
        )
    return force, moment, generalised


def on_ground(chain: ClosedChain, applied: Mapping[str, Array], n: int) -> Array:
    """Return the sum (n, 6) at the world origin of what is applied to the ground itself."""
    total = np.zeros((n, 6))
    for name, wrench in applied.items():
        frame = find_frame(chain.model, name)
        if frame.parentJoint == 0:
            total[:, :3] += wrench[:, :3]
            total[:, 3:] += wrench[:, 3:] + cross(np.array(frame.placement.translation), wrench[:, :3])
    return total
