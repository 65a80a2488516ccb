"""Pinocchio's batched recursion on the tree with a free-flying root held at rest.

The wrench on the frame comes out of the same recursion as the torques. It runs without gravity, so that a balanced
mechanism does not shake by the digits of its weight; the weight has a run of its own, at rest, where there is any.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain
from fivebar_pin.engine.threads import threads_of
from fivebar_pin.mechanism.per_chain import once_per_chain

__all__ = ["HangingTree", "hanging_tree"]


_SAMPLES_PER_THREAD = 4096


class HangingTree:
    """The tree on a free-flying root held at rest, ready for Pinocchio's batched recursion."""

    def __init__(self, chain: ClosedChain) -> None:
        source, model = chain.model, pin.Model()
        model.gravity = pin.Motion.Zero()
        root = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "frame")
        ids = [root]
        for j in range(1, source.njoints):
            ids.append(
                model.addJoint(ids[source.parents[j]], source.joints[j], source.jointPlacements[j], source.names[j])
            )
            model.appendBodyToJoint(ids[j], source.inertias[j], pin.SE3.Identity())
        model.armature = np.concatenate([np.zeros(6), source.armature])
        self._threads = threads_of(None)
        self._pool = pin.ModelPool(model, self._threads)
        self._nv = int(model.nv)

    def inertia(self, q: Array, v: Array, a: Array, threads: int | None = None) -> tuple[Array, Array]:
        """Return the wrench of the frame on the mechanism at the world origin (n, 6) and the torques (n, nv)."""
        V, A = (np.zeros((len(q), x.shape[1] + 6)) for x in (v, a))
        V[:, 6:], A[:, 6:] = v, a
        return self._evaluate(q, V, A, threads)

    def weight(self, q: Array, gravity: Array, threads: int | None = None) -> tuple[Array, Array]:
        """Return the same of the weight alone: at rest, on a root that accelerates against gravity (3,)."""
        V = np.zeros((len(q), self._nv))
        A = np.zeros_like(V)
        A[:, :3] = -gravity
        return self._evaluate(q, V, A, threads)

    def _evaluate(self, q: Array, V: Array, A: Array, most: int | None) -> tuple[Array, Array]:
        n = q.shape[0]
        Q = np.zeros((n, q.shape[1] + 7))
        Q[:, 6], Q[:, 7:] = 1.0, q
        out = np.zeros((self._nv, n), order="F")
        threads = min(self._threads, most or self._threads, 1 + n // _SAMPLES_PER_THREAD)
        pin.rneaInParallel(threads, self._pool, Q.T, V.T, A.T, out)
        return out[:6].T, np.array(out[6:].T)


@once_per_chain
def hanging_tree(chain: ClosedChain) -> HangingTree:
    return HangingTree(chain)
