"""Forces applied from outside: checked once, and moved once to where they act.

A wrench (f, m) given at a frame's origin p, in world axes, is (f, m + p × f) at the world origin. There it adds to what
its body carries, and makes the torques S^T (f, m) in the joints that carry the frame, S being their motion subspaces.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, cross, numeric
from fivebar_pin.chain import ClosedChain, find_frame
from fivebar_pin.errors import UnknownNameError
from fivebar_pin.mechanism.tree import Poses, Tree

__all__ = ["Applied", "Wrench", "about_point", "checked_wrenches", "moved_to_origin", "require_frames"]


Wrench = npt.ArrayLike | Callable[[float, Array, Array], npt.ArrayLike]
"""Constant (6,), or a function (t, q, v) of it: force [N] and moment [N m], world axes at the frame's origin."""


@dataclass(frozen=True, slots=True, eq=False)
class Applied:
    """External wrenches on k frames along n configurations, world axes.

    Attributes:
        joints: that carry the frames, 0 for the ground (k,).
        given: at the frames' origins (k, n, 6) [N, N m].
        wrench: the same at the world origin (k, n, 6).
    """

    joints: npt.NDArray[np.intp]
    given: Array
    wrench: Array

    @property
    def total(self) -> Array:
        """Sum at the world origin (n, 6)."""
        return np.asarray(np.sum(self.wrench, axis=0))

    @property
    def on_ground(self) -> Array:
        """Sum at the world origin of what acts on the ground itself (n, 6)."""
        return np.asarray(np.sum(self.wrench[self.joints == 0], axis=0))

    def on_bodies(self, bodies: int) -> Array:
        """Return the wrench on every body, at the world origin (n, bodies, 6)."""
        out = np.zeros((self.wrench.shape[1], bodies, 6))
        for j, wrench in zip(self.joints, self.wrench, strict=True):
            if j:
                out[:, j - 1] += wrench
        return out

    def torques(self, tree: Tree, poses: Poses) -> Array:
        """Return the generalised forces of each (k, n, nv) [N m or N]."""
        each = [
            np.einsum("nik,ni->nk", poses.S, w) * tree.support[j] for j, w in zip(self.joints, self.wrench, strict=True)
        ]
        return np.stack(each) if each else np.zeros((0, *poses.S.shape[::2]))

    def sizes(self, about: Array) -> tuple[Array, Array]:
        """Return the sums of the sizes of the forces, and of the moments about a point and of their arms (n,)."""
        force, moment = np.zeros(self.wrench.shape[1]), np.zeros(self.wrench.shape[1])
        for given, wrench in zip(self.given, self.wrench, strict=True):
            force += np.linalg.norm(given[:, :3], axis=1)
            arm = about_point(about, wrench) - given[:, 3:]
            moment += np.linalg.norm(given[:, 3:], axis=1) + np.linalg.norm(arm, axis=1)
        return force, moment


def about_point(point: Array, wrench: Array) -> Array:
    """Return the moments (n, 3) about a point of wrenches (n, 6) at the world origin."""
    return np.asarray(wrench[:, 3:] - cross(point, wrench[:, :3]))


def require_frames(chain: ClosedChain, names: Iterable[str]) -> None:
    """Raise when an external force names a frame that the chain does not have.

    Raises:
        UnknownNameError: with the frames that there are.
    """
    known = [f.name for f in chain.model.frames]
    for name in names:
        if name not in known:
            raise UnknownNameError("frame of an external force", name, known)


def checked_wrenches(chain: ClosedChain, external: Mapping[str, npt.ArrayLike] | None, n: int) -> dict[str, Array]:
    """Return external wrenches by frame, each (n, 6), from ones of (6,) or (n, 6).

    Raises:
        UnknownNameError: a frame that does not exist.
        InvalidInputError: a wrong shape, or not finite.
    """
    given = external or {}
    if not given:
        return {}
    require_frames(chain, given)
    out = {}
    for name, wrench in given.items():
        label = f"external[{name!r}]"
        w = numeric(label, wrench)
        out[name] = np.broadcast_to(checked(label, w, (6,)), (n, 6)) if w.ndim == 1 else checked(label, w, (n, 6))
    return out


def moved_to_origin(chain: ClosedChain, poses: Poses, external: Mapping[str, Array]) -> Applied:
    """Return checked wrenches (n, 6) by frame as they act at configurations with these poses."""
    n = poses.S.shape[0]
    joints, moved = np.zeros(len(external), dtype=np.intp), np.zeros((len(external), n, 6))
    for k, (name, wrench) in enumerate(external.items()):
        frame = find_frame(chain.model, name)
        joints[k] = j = int(frame.parentJoint)
        point = poses.p[j] + np.matmul(poses.R[j], np.array(frame.placement.translation))
        moved[k] = np.concatenate([wrench[:, :3], wrench[:, 3:] + cross(point, wrench[:, :3])], axis=1)
    given = np.stack(list(external.values())) if external else np.zeros((0, n, 6))
    return Applied(joints, given, moved)
