"""Closure forces and joint reactions, with what the model leaves open marked as nan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, cross, finite, frozen, lazy, require_finite
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics.bodies import Bodies, BodyRates, body_rates, gravity_wrenches
from fivebar_pin.dynamics.by_factors import carried_by_factors, seen_by_structure, structure_of
from fivebar_pin.dynamics.elastic import body_wrenches
from fivebar_pin.dynamics.wrenches import moved_to_origin
from fivebar_pin.mechanism.idle import at_rest, carried_by_rests
from fivebar_pin.mechanism.loops import Loops, Seen, loops_of
from fivebar_pin.mechanism.prepared import prepared_of
from fivebar_pin.mechanism.rank import Decomposed
from fivebar_pin.mechanism.tree import Poses
from fivebar_pin.trajectory import Trajectory

__all__ = ["Reactions", "determinate", "reactions"]


_OPEN = 1e-9  # force in a joint for a unit force in the closures above which the joint's own is not determinate [-]


@dataclass(frozen=True, eq=False)
class Reactions(Immutable):
    """Reactions along a trajectory, world axes.

    Attributes:
        chain, trajectory: what they belong to.
        applied: wrenches (n, 6) from outside by frame.
        multipliers: closure forces in the rows of J (n, m); of least norm where the closures are redundant.
        vanishing: combinations of rows that say nothing, scaled and orthonormal, zero where there are fewer (n, k, m).
        wrench: of the joints, by the parent on the body at the joint origin, motor and joint springs included; then of
            the closures, by body 1 on body 2 at the closure point; of least norm where they are not determinate
            (n, nb + closures, 6) [N, N m].
        mismatch: largest unbalanced joint torque [N m or N]; round-off when the trajectory is consistent.
        regular: no configuration is singular: the redundancy is that of the structure, everywhere the same.
        closures: how many of the closures are the mechanism's own. Behind them stands what holds idle freedoms at rest,
            whose couples are part of those of the joints that they act in.

    Components that the closures do not determine (they depend on which of the redundant rows carries the load) are
    nan, judged in the axes they are given in: in a plane that is tilted in the world, the local axes tell more.
    """

    chain: ClosedChain
    trajectory: Trajectory
    applied: Mapping[str, Array]
    multipliers: Array
    vanishing: Array
    wrench: Array
    mismatch: float
    regular: bool
    closures: int

    @lazy
    def determinate_rows(self) -> npt.NDArray[np.bool_]:
        """Which multipliers are determinate (n, m)."""
        rows = np.asarray(np.linalg.norm(self.vanishing, axis=1) <= _OPEN)  # those of idle freedoms among them
        rows.setflags(write=False)
        return rows

    @property
    def joint(self) -> Array:
        """Wrench by the parent on the body of every joint at the joint origin (n, nb, 6) [N, N m]."""
        return self._in_world[:, : self._bodies]

    @property
    def closure(self) -> Array:
        """Wrench by body 1 on body 2 at the closure point (n, closures, 6) [N, N m]."""
        return self._in_world[:, self._bodies : self._own]

    @property
    def joint_local(self) -> Array:
        """`joint` in the axes of the joint, that is of the body it carries."""
        return self._in_own_axes[:, : self._bodies]

    @property
    def closure_local(self) -> Array:
        """`closure` in the axes of frame 1."""
        return self._in_own_axes[:, self._bodies : self._own]

    @property
    def forces(self) -> Array:
        """Forces of the joints, then of the closures, of least norm where not determinate (n, nb + closures, 3) [N]."""
        return self.wrench[:, : self._own, :3]

    @property
    def free(self) -> Array:
        """Forces that the redundant closures could carry besides, in every joint, then every closure.

        For a basis of unit closure forces (n, k, nb + closures, 3) [-].
        """
        return self._slack[:, :, : self._own, :3]

    @lazy
    @finite()
    def bodies(self) -> BodyRates:
        """Momenta of the bodies and their rates."""
        tree, path = loops_of(self.chain).tree, self.trajectory
        rates = tree.rates(path.q, path.v)
        return body_rates(tree, Bodies.of(self.chain), self._poses, rates, path.a)

    @lazy
    def gravity(self) -> Array:
        """Weight of every body as a wrench at the world origin (n, nb, 6)."""
        gravity = np.array(self.chain.model.gravity.linear)
        return frozen(gravity_wrenches(Bodies.of(self.chain), self.bodies.centre, gravity))

    @lazy
    def external(self) -> Array:
        """Wrench from outside on every body at the world origin (n, nb, 6)."""
        return frozen(moved_to_origin(self.chain, self._poses, self.applied).on_bodies(self._bodies))

    @lazy
    def sprung(self) -> Array:
        """Wrench by springs on every body at the world origin (n, nb, 6)."""
        return frozen(body_wrenches(self.chain, loops_of(self.chain), self.trajectory.v, self._poses))

    @property
    def _bodies(self) -> int:
        return int(self.chain.model.njoints) - 1

    @property
    def _own(self) -> int:
        return self._bodies + self.closures

    @lazy
    def _poses(self) -> Poses:
        return loops_of(self.chain).tree.poses(self.trajectory.q)

    @lazy
    def _closures(self) -> Seen:
        return loops_of(self.chain).see(self.trajectory.q)

    @lazy
    def _in_world(self) -> Array:
        return self._seen(turned=False)

    @lazy
    def _in_own_axes(self) -> Array:
        return self._seen(turned=True)

    def _seen(self, *, turned: bool) -> Array:
        """Return the wrenches in world or in their own axes, nan where they are open."""
        structure, chain = structure_of(self.chain) if self.regular else None, self.chain
        bounds = _OPEN, _OPEN * chain.length
        if structure is not None:
            seen = seen_by_structure(chain, structure, self.trajectory.q, self.wrench, bounds, turned=turned)
        else:
            points, axes = _places(loops_of(chain), self._closures, self._poses)
            seen, slack = np.array(self.wrench), _at_point(self._slack, points[:, None])
            if turned:
                seen, slack = _turned(seen, axes), _turned(slack, axes[:, None])
            seen[np.linalg.norm(slack, axis=1) > np.repeat(bounds, 3)] = np.nan
        seen.setflags(write=False)
        return seen

    @lazy
    def _slack(self) -> Array:
        """What unit strains of the redundant closures put into joints and closures, at the world origin."""
        loops, (n, k, _) = loops_of(self.chain), self.vanishing.shape
        strains = self.vanishing * loops.row_scale * loops.length
        closures = _wrenches(loops, self._closures, strains)
        joints = _carried(self.chain, loops, np.zeros((n, k, self._bodies, 6)), closures)
        return np.concatenate([joints, closures], axis=2)


def reactions(
    chain: ClosedChain,
    trajectory: Trajectory,
    tree_torque: Array,
    torque: Array,
    external: Mapping[str, Array],
) -> Reactions:
    """Compute all reactions; see `Reactions`."""
    own, chain = len(chain.closures), at_rest(chain)
    found = _by_factors(chain, trajectory, torque, external)
    regular = found is not None
    if found is None:
        unbalanced = np.array(tree_torque)
        unbalanced[:, chain.actuated_index] -= torque
        found = _by_decomposition(chain, trajectory, unbalanced, external)
    multipliers, vanishing, wrench, mismatch = found
    require_finite("reactions", {"multipliers": multipliers, "wrench": wrench, "mismatch": mismatch})
    for k, j in carried_by_rests(chain):
        wrench[:, j - 1] += wrench[:, chain.model.njoints - 1 + k]
    return Reactions(chain, trajectory, external, multipliers, vanishing, wrench, mismatch, regular, own)


_Found = tuple[Array, Array, Array, float]  # multipliers, vanishing, wrench, mismatch


def _by_factors(chain: ClosedChain, path: Trajectory, torque: Array, external: Mapping[str, Array]) -> _Found | None:
    """Solve for the forces in the rows that say something; None where they do not tell the closure forces."""
    structure = structure_of(chain)
    found = None if structure is None else carried_by_factors(chain, structure, path, external)
    if found is None:
        return None
    multipliers, wrench, left = found
    left[:, chain.actuated_index] -= torque
    vanishing = prepared_of(chain).vanishing
    mismatch = float(np.abs(left).max(initial=0.0))
    return multipliers, np.broadcast_to(vanishing, (len(path), *vanishing.shape)), wrench, mismatch


@finite()
def _by_decomposition(chain: ClosedChain, path: Trajectory, unbalanced: Array, external: Mapping[str, Array]) -> _Found:
    """Solve J^T lambda = unbalanced torque (n, nv), lambda of least norm."""
    loops = loops_of(chain)
    tree = loops.tree
    poses = tree.poses(path.q)
    seen = loops.see(path.q)
    decomposed = Decomposed.of(loops.scaled(seen.J), loops.misfit)
    ranks = decomposed.ranks
    multipliers = decomposed.carry(unbalanced * loops.column_scale, ranks) * loops.row_scale
    moving = body_rates(tree, Bodies.of(chain), poses, tree.rates(path.q, path.v), path.a)
    needed = moving.rate - gravity_wrenches(Bodies.of(chain), moving.centre, np.array(chain.model.gravity.linear))
    needed -= moved_to_origin(chain, poses, external).on_bodies(needed.shape[1])
    needed -= body_wrenches(chain, loops, path.v, poses)
    closures = _wrenches(loops, seen, multipliers[:, None])[:, 0]
    wrench = np.concatenate([_carried(chain, loops, needed, closures), closures], axis=1)
    mismatch = float(np.abs(unbalanced - np.einsum("nmk,nm->nk", seen.J, multipliers)).max(initial=0.0))
    return multipliers, decomposed.left_null(ranks), _at_point(wrench, _places(loops, seen, poses)[0]), mismatch


def determinate(free: Array) -> Array:
    """Return the projections (n, x, 3, 3) of forces onto what redundant closures leave alone.  free (n, k, x, 3)."""
    n, _, x, _ = free.shape
    if not free.any():
        return np.broadcast_to(np.eye(3), (n, x, 3, 3))
    _, size, axes = np.linalg.svd(np.swapaxes(free, 1, 2), full_matrices=False)
    lost = axes * (size > _OPEN)[..., None]
    return np.asarray(np.eye(3) - np.matmul(np.swapaxes(lost, -1, -2), lost))


def _places(loops: Loops, seen: Seen, poses: Poses) -> tuple[Array, Array]:
    """Return the points (n, x, 3) and the axes (n, x, 3, 3) of all joints, then of all closures."""
    closures = [c.place(seen.pair(k)) for k, c in enumerate(loops.anchored)]
    points = [*poses.p[1:], *(point for point, _ in closures)]
    axes = [*poses.R[1:], *(turn for _, turn in closures)]
    return np.stack(points, axis=1), np.stack(axes, axis=1)


def _wrenches(loops: Loops, seen: Seen, rows: Array) -> Array:
    """Return what forces in the rows (n, k, m) do to body 2 of every closure, at the world origin (n, k, nc, 6)."""
    out = np.zeros((*rows.shape[:2], len(loops.anchored), 6))
    for c, anchored in enumerate(loops.anchored):
        out[:, :, c] = np.einsum("nmi,nkm->nki", seen.T[:, anchored.rows], rows[..., anchored.rows])
    return out


def _carried(chain: ClosedChain, loops: Loops, bodies: Array, closures: Array) -> Array:
    """Return what every joint passes on (..., nb, 6) from what its bodies need and the closures (..., nc, 6) give."""
    needed = np.array(bodies)
    for k, anchored in enumerate(loops.anchored):
        for j, sign in zip(anchored.joints, (1.0, -1.0), strict=True):
            if j:
                needed[..., j - 1, :] += sign * closures[..., k, :]
    for j in range(chain.model.njoints - 1, 0, -1):
        parent = int(chain.model.parents[j])
        if parent:
            needed[..., parent - 1, :] += needed[..., j - 1, :]
    return needed


def _turned(wrench: Array, axes: Array) -> Array:
    """Return wrenches (..., 6) in the axes R (..., 3, 3)."""
    RT = np.swapaxes(axes, -1, -2)
    parts = [np.matmul(RT, wrench[..., k : k + 3, None])[..., 0] for k in (0, 3)]
    return np.concatenate(parts, axis=-1)


def _at_point(wrench: Array, point: Array) -> Array:
    return np.concatenate([wrench[..., :3], wrench[..., 3:] - cross(point, wrench[..., :3])], axis=-1)
