"""What a design is judged by: rows linear in the inertial parameters, along the given motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array
from fivebar_pin.balancing._parameters import plane_axes
from fivebar_pin.balancing._reaction_rows import reactions
from fivebar_pin.balancing.regressors import regressor
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.kinematics import drive
from fivebar_pin.motion import Motion
from fivebar_pin.trajectory import Trajectory

Motions = Motion | Trajectory | Sequence[Motion | Trajectory]
MEASURES = ("torque", "shaking_force", "shaking_moment", "bearing_force", "angular_momentum")


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """A quantity along motions: values = F pi + f.

    Attributes:
        name: one of `MEASURES`.
        F: (n, rows, 10 nb).
        f: (n, rows).
        groups: rows that belong to one vector: a peak is the largest length of such a vector.
        labels: name of each group.
    """

    name: str
    F: Array
    f: Array
    groups: tuple[slice, ...]
    labels: tuple[str, ...]

    def values(self, pi: Array) -> Array:
        """Return the values (n, rows) at parameters (nb, 10)."""
        return np.asarray(self.F @ pi.reshape(-1) + self.f)

    def rms(self, pi: Array) -> float:
        """Return the root of the mean square over samples, all rows summed."""
        return float(np.sqrt(np.mean(np.sum(self.values(pi) ** 2, axis=1))))

    def peak(self, pi: Array) -> float:
        """Return the largest length of a group over all samples."""
        values = self.values(pi)
        return max((float(np.linalg.norm(values[:, g], axis=1).max()) for g in self.groups), default=0.0)


def trajectories(
    chain: ClosedChain,
    motions: Motions,
    near: npt.ArrayLike | None = None,
) -> tuple[Trajectory, ...]:
    """Return the trajectories of all motions; a motion is driven from `near`."""
    if not isinstance(motions, (Motion, Trajectory, Sequence)):
        raise InvalidInputError("motions", type(motions).__name__, "must be motions or trajectories, one or a list")
    given = [motions] if isinstance(motions, (Motion, Trajectory)) else list(motions)
    out = []
    for k, item in enumerate(given):
        if isinstance(item, Trajectory):
            out.append(item)
        elif isinstance(item, Motion):
            out.append(drive(chain, item, near=near))
        else:
            raise InvalidInputError(f"motions[{k}]", type(item).__name__, "must be a Motion or a Trajectory")
    return tuple(out)


def measure(
    chain: ClosedChain, paths: Sequence[Trajectory], name: str, *, about: Array, normal: Array | None = None
) -> Rows:
    """Return one quantity over all trajectories.

    Args:
        name: one of `MEASURES`; angular momentum is its deviation from the mean of each motion.
        about: point of moments and angular momentum (3,) [m].
        normal: normal of the plane (3,): only in-plane forces and the moment along it count.
    """
    if name not in MEASURES:
        raise UnknownNameError("quantity", name, MEASURES)
    if not paths:
        raise InvalidInputError("motions", [], f"must hold at least one motion for {name}")
    parts = [_one(chain, path, name, about, normal) for path in paths]
    F, f = np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])
    if name == "bearing_force":
        return _bearings(chain, F, f, flat=normal is not None)
    if name == "torque":
        single = tuple(slice(k, k + 1) for k in range(chain.na))
        return Rows(name, F, f, single, chain.actuated)
    return Rows(name, F, f, (slice(0, F.shape[1]),), (name,))


def reflected_inertia(chain: ClosedChain, paths: Sequence[Trajectory]) -> Array:
    """Return the functional (10 nb,) of the mean of trace(N^T M N) over all samples, rotor inertia apart [kg m2]."""
    total, count = np.zeros(10 * len(chain.joints)), 0
    for path in paths:
        for k in range(chain.na):
            unit = Trajectory(path.t, path.q, path.N[:, :, k], np.zeros_like(path.a), path.N, path.closure_residual)
            total += 2.0 * regressor(chain, unit, "kinetic_energy").matrix.sum(axis=(0, 1))
        count += len(path)
    return total / max(count, 1)


def _one(chain: ClosedChain, path: Trajectory, name: str, about: Array, normal: Array | None) -> tuple[Array, Array]:
    if name == "bearing_force":
        return _bearing_rows(chain, path, normal)
    Y = regressor(chain, path, name, about=about)
    F, f = np.array(Y.matrix), np.array(Y.offset)
    if normal is not None and name != "torque":
        axes = plane_axes(normal)
        P = axes[:2] if name == "shaking_force" else axes[2:]
        F, f = np.matmul(P, F), f @ P.T
    if name == "angular_momentum":
        F, f = F - F.mean(axis=0), f - f.mean(axis=0)
    return F, f


def _bearing_rows(chain: ClosedChain, path: Trajectory, normal: Array | None) -> tuple[Array, Array]:
    """Return the forces in all joints and closures, in the plane or (nan where indeterminate) in space."""
    if normal is None:
        parts = [regressor(chain, path, x) for x in ("joint_reactions", "closure_reactions")]
        keep = [np.arange(p.offset.shape[1]) % 6 < 3 for p in parts]
        F = np.concatenate([p.matrix[:, k] for p, k in zip(parts, keep, strict=True)], axis=1)
        return F, np.concatenate([p.offset[:, k] for p, k in zip(parts, keep, strict=True)], axis=1)
    joint, closure = reactions(chain, path)
    both = np.concatenate([joint, closure], axis=1)[:, :, :3]
    flat = np.matmul(plane_axes(normal)[:2], both).reshape(len(path), -1, both.shape[-1])
    return flat[..., :-1], flat[..., -1]


def _bearings(chain: ClosedChain, F: Array, f: Array, *, flat: bool) -> Rows:
    """Group the rows by joint and closure, without those that the model leaves open."""
    names = (*chain.joints, *(c.name for c in chain.closures))
    size = 2 if flat else 3
    determinate = np.asarray(~np.isnan(f).any(axis=0))
    groups, labels, start = [], [], 0
    for k, name in enumerate(names):
        count = int(determinate[size * k : size * (k + 1)].sum())
        if count:
            groups.append(slice(start, start + count))
            labels.append(name)
        start += count
    return Rows("bearing_force", F[:, determinate], f[:, determinate], tuple(groups), tuple(labels))
