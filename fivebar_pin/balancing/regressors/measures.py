"""What a design is judged by: rows linear in the inertial parameters, along the given motions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable
from fivebar_pin.balancing.parameters import Space
from fivebar_pin.balancing.regressors.regressor import MEASURES, TABLE, regressor
from fivebar_pin.balancing.regressors.rows import Rows
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.kinematics import drive
from fivebar_pin.motion import Motion
from fivebar_pin.trajectory import Trajectory

__all__ = ["Measurement", "Motions", "measure", "reflected_inertia", "trajectories"]

Motions = Motion | Trajectory | Sequence[Motion | Trajectory]


@dataclass(frozen=True, slots=True, eq=False)
class Measurement(Immutable):
    """What bodies are measured by: quantities along motions, and the mechanism that they belong to.

    Attributes:
        chain: the mechanism; its present bodies are those that distances and gains are from.
        space: the parameters that distances are measured in, or None where there are none.
        paths: the motions.
        rows: quantities along them, by name.
    """

    chain: ClosedChain
    space: Space | None = None
    paths: tuple[Trajectory, ...] = ()
    rows: Mapping[str, Rows] = field(default_factory=dict)

    def required(self, name: str) -> tuple[Trajectory, ...]:
        """Return the motions, of which there must be one for a term or quantity."""
        if not self.paths:
            raise InvalidInputError("motions", [], f"must hold at least one motion for {name}")
        return self.paths


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
    quantity = TABLE[name]
    assert quantity.judged is not None
    for path in paths:
        path.require_of(chain)
    parts = [quantity.judged(chain, path, about) for path in paths]
    F, f = np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])
    return quantity.grouped(name, chain, F, f)


def reflected_inertia(chain: ClosedChain, paths: Sequence[Trajectory]) -> Array:
    """Return the functional (10 nb,) of the mean of trace(N^T M N) over all samples, rotor inertia apart [kg m2]."""
    total, count = np.zeros(10 * len(chain.joints)), 0
    for path in paths:
        for k in range(chain.na):
            unit = Trajectory(path.t, path.q, path.N[:, :, k], np.zeros_like(path.a), path.N, path.closure_residual)
            total += 2.0 * regressor(chain, unit, "kinetic_energy").matrix.sum(axis=(0, 1))
        count += len(path)
    return total / max(count, 1)
