"""What a design is judged by: rows linear in the inertial parameters, along the given motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import ROUND_OFF, Array, Immutable
from fivebar_pin.balancing.regressors import regressor
from fivebar_pin.balancing.regressors.reaction_rows import reaction_matrices
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics import inverse_dynamics
from fivebar_pin.dynamics.reactions import determinate
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.kinematics import drive
from fivebar_pin.motion import Motion
from fivebar_pin.trajectory import Trajectory

__all__ = ["MEASURES", "Motions", "Rows", "measure", "reflected_inertia", "trajectories"]

Motions = Motion | Trajectory | Sequence[Motion | Trajectory]
MEASURES = (
    "torque",
    "shaking_force",
    "shaking_moment",
    "frame_force",
    "frame_moment",
    "bearing_force",
    "angular_momentum",
)


@dataclass(frozen=True, slots=True, eq=False)
class Rows(Immutable):
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
        return self._longest(self.values(pi))

    def scale(self, term: str, pi: Array) -> float:
        """Return the sum of the sizes of what adds up to a term of this quantity, see `Loads.scale`.

        Args:
            term: rms_, peak_ or mean_square_ of the quantity; a mean square is round-off when its root is.
            pi: parameters (nb, 10).
        """
        sizes = np.abs(self.F) @ np.abs(pi.reshape(-1)) + np.abs(self.f)
        if term.startswith("peak_"):
            return self._longest(sizes)
        rms = float(np.sqrt(np.mean(np.sum(sizes**2, axis=1))))
        return ROUND_OFF * rms * rms if term.startswith("mean_square_") else rms

    def _longest(self, values: Array) -> float:
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


def measure(chain: ClosedChain, paths: Sequence[Trajectory], name: str, *, about: Array) -> Rows:
    """Return one quantity over all trajectories: what `inverse_dynamics` calls so, all three components of vectors.

    Args:
        name: one of `MEASURES`; angular momentum is its deviation from the mean of each motion.
        about: point of moments and angular momentum (3,) [m].
    """
    if name not in MEASURES:
        raise UnknownNameError("quantity", name, MEASURES)
    if not paths:
        raise InvalidInputError("motions", [], f"must hold at least one motion for {name}")
    parts = [_one(chain, path, name, about) for path in paths]
    F, f = np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])
    if name == "bearing_force":
        return _bearings(chain, F, f)
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


def _one(chain: ClosedChain, path: Trajectory, name: str, about: Array) -> tuple[Array, Array]:
    if name == "bearing_force":
        return _bearing_rows(chain, path)
    Y = regressor(chain, path, name, about=about)
    F, f = np.array(Y.matrix), np.array(Y.offset)
    if name == "angular_momentum":
        F, f = F - F.mean(axis=0), f - f.mean(axis=0)
    return F, f


def _bearing_rows(chain: ClosedChain, path: Trajectory) -> tuple[Array, Array]:
    """Return the determinate part of the forces in all joints and closures, three rows each."""
    joint, closure = reaction_matrices(chain, path)
    forces = np.concatenate([joint, closure], axis=1)[:, :, :3]
    forces = np.matmul(determinate(inverse_dynamics(chain, path).reactions.free), forces)
    forces = forces.reshape(len(path), -1, forces.shape[-1])
    return forces[..., :-1], forces[..., -1]


def _bearings(chain: ClosedChain, F: Array, f: Array) -> Rows:
    """Group the rows by joint and closure, without those of which nothing is determinate."""
    names = (*chain.joints, *(c.name for c in chain.closures))
    used = [k for k in range(len(names)) if F[:, 3 * k : 3 * k + 3].any() or f[:, 3 * k : 3 * k + 3].any()]
    rows = np.array([3 * k + i for k in used for i in range(3)], dtype=np.intp)
    groups = tuple(slice(3 * k, 3 * k + 3) for k in range(len(used)))
    return Rows("bearing_force", F[:, rows], f[:, rows], groups, tuple(names[k] for k in used))
