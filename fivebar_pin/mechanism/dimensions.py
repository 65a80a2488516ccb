"""What differs from one design of a chain to another: placements of joints and frames, and bodies."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain, frames_by_name
from fivebar_pin.chain.masses import about_centre, row_of
from fivebar_pin.chain.reshape import shapes_of
from fivebar_pin.closures.frame_closure import FrameClosure
from fivebar_pin.springs import Spring

__all__ = ["Dimensions", "dimensions_of", "with_inertias", "with_values"]


@dataclass(frozen=True, slots=True, eq=False)
class Dimensions:
    """Of n designs; what all have in common stands there once.

    Attributes:
        joints: placements of the joints on that of their parent, by number (n or 1, 4, 4).
        frames: of frames that closures and springs are at, in their joints, by name (n or 1, 4, 4).
        masses: rows of the bodies, see `chain.masses`, by number of the joint (n or 1, 10).
    """

    joints: Mapping[int, Array]
    frames: Mapping[str, Array]
    masses: Mapping[int, Array]


def dimensions_of(model: pin.Model, names: Iterable[str]) -> Dimensions:
    """Return those of one design as it is; the names are of the frames that closures and springs are at."""
    wanted = dict.fromkeys(names)
    frames = frames_by_name(model) if wanted else {}
    return Dimensions(
        {j: _pose(model.jointPlacements[j]) for j in range(1, model.njoints)},
        {name: _pose(frames[name].placement) for name in wanted},
        {j: row_of(model.inertias[j])[None] for j in range(1, model.njoints)},
    )


def with_values(chain: ClosedChain, values: Mapping[str, Array]) -> Dimensions:
    """Return those of n designs of a chain, from values (n,) of all its named parameters."""
    names = [f for c in chain.closures if isinstance(c, FrameClosure) for f in c.frames]
    names += [f for s in chain.springs if isinstance(s, Spring) for f in (s.frame1, s.frame2)]
    present, shapes = dimensions_of(chain.model, names), shapes_of(chain.model, chain.geometry, values)
    frames = {name: shapes.frames.get(name, pose) for name, pose in present.frames.items()}
    return Dimensions({**present.joints, **shapes.joints}, frames, {**present.masses, **shapes.masses})


def with_inertias(dimensions: Dimensions, pi: Array) -> Dimensions:
    """Return those of n designs whose bodies have these inertial parameters (n, nb, 10)."""
    rows = {j: about_centre(pi[:, j - 1]) for j in dimensions.masses}
    return Dimensions(dimensions.joints, dimensions.frames, rows)


def _pose(placement: pin.SE3) -> Array:
    return np.array(placement.homogeneous)[None]
