"""What is drawn of one mechanism: its poses, colours, names and extent, before any shape is made."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array
from fivebar_pin.chain import find_frame
from fivebar_pin.io._meshes import is_there
from fivebar_pin.springs import Spring
from fivebar_pin.viz._geometry import BodyPaths, View, body_points, spring_ends
from fivebar_pin.viz._recording import Colour

if TYPE_CHECKING:
    from fivebar_pin.chain import ClosedChain, Visual

__all__ = [
    "COLOURS",
    "LINK_COLOURS",
    "Drawing",
    "amid_ground",
    "body_names",
    "ground_closures",
    "is_counterweight",
    "points_reached",
    "safe",
]

LINK_COLOURS: tuple[Colour, ...] = (
    (0.00, 0.45, 0.70, 1.0),
    (0.90, 0.62, 0.00, 1.0),
    (0.00, 0.62, 0.45, 1.0),
    (0.34, 0.71, 0.91, 1.0),
    (0.84, 0.37, 0.00, 1.0),
    (0.55, 0.50, 0.75, 1.0),
)
"""Colours of bodies without visuals, in turn; told apart with any colour vision."""

COLOURS: dict[str, Colour] = {
    "joint": (0.20, 0.20, 0.22, 1.0),
    "closure": (0.98, 0.90, 0.20, 1.0),
    "ground": (0.55, 0.57, 0.60, 1.0),
    "spring": (0.45, 0.55, 0.05, 1.0),
    "body com": (1.0, 1.0, 1.0, 1.0),
    "com": (0.80, 0.00, 0.55, 1.0),
    "force": (0.05, 0.05, 0.05, 1.0),
}

_WRITTEN = 1e-6  # difference of colours by the digits that files keep [-]
_THICKNESS = 0.045
"""Radius of a link, as a part of the chain's characteristic length [-]."""


@dataclass(frozen=True, slots=True, eq=False)
class Drawing:
    """One mechanism and what is drawn of it.

    Attributes:
        chain: the mechanism.
        poses: where its bodies are.
        force: shaking force (n, 3) [N], or None.
        frame_force: (n, 3) [N], where weight or applied forces act; or None.
        view: axes of the picture.
        keys: samples that become keyframes (k,).
        times: playing times of the keyframes (k,) [s].
        arrow: length of an arrow per force [m/N].
        size: common size of the scene [m], for what has none of its own.
        mass_unit: mass whose sphere has the full radius [kg]; 0: all spheres are alike.
    """

    chain: ClosedChain
    poses: BodyPaths
    force: Array | None
    frame_force: Array | None
    view: View
    keys: npt.NDArray[np.intp]
    times: Array
    arrow: float
    size: float
    mass_unit: float

    @property
    def radius(self) -> float:
        """Radius of a link [m]."""
        return float(np.clip(_THICKNESS * self.chain.length, 0.008 * self.size, 0.04 * self.size))

    @property
    def visuals(self) -> tuple[Visual, ...]:
        """Shapes of the chain that can be drawn: a mesh whose file is missing, or stands for one, is left out."""
        return tuple(v for v in self.chain.visuals if v.shape != "mesh" or _is_there(v.mesh))


_is_there = lru_cache(maxsize=1024)(is_there)


def is_counterweight(visual: Visual) -> bool:
    """Return whether a shape is a counterweight that `balancing.realise` has made: by its colour, also from a file."""
    from fivebar_pin.balancing.counterweights import COLOUR

    return bool(np.allclose(visual.rgba, COLOUR, rtol=0.0, atol=_WRITTEN))


def safe(name: str) -> str:
    """Return a name as one step of a scene path."""
    return name.replace("/", "_") or "_"


def body_names(chain: ClosedChain) -> tuple[str, ...]:
    """Return what the body of each joint is called: its body frame where there is exactly one, else its joint."""
    names = []
    for j, joint in enumerate(chain.joints, start=1):
        frames = [f.name for f in chain.model.frames if f.parentJoint == j and f.type.name == "BODY"]
        names.append(safe(frames[0] if frames else joint))
    return tuple(n if names.count(n) == 1 else safe(j) for n, j in zip(names, chain.joints, strict=True))


def points_reached(chain: ClosedChain, poses: BodyPaths) -> Array:
    """Return points (k, 3) [m] that the mechanism passes: joints, ends of bodies and springs, corners, mass centres."""
    points = [poses.joints[:, j, :3, 3] for j in range(1, chain.model.njoints) if chain.model.parents[j] == 0]
    points.append(_visual_corners(chain, 0))
    for j in range(1, chain.model.njoints):
        local = [*body_points(chain, j), np.array(chain.model.inertias[j].lever), *_visual_corners(chain, j)]
        R, p = poses.joints[:, j, :3, :3], poses.joints[:, j, :3, 3]
        points += [R @ x + p for x in local]
    points += [end for s in chain.springs if isinstance(s, Spring) for end in spring_ends(chain, s, poses.joints)]
    return np.concatenate([*points, poses.com] if points else [np.zeros((1, 3)), poses.com])


def _visual_corners(chain: ClosedChain, joint: int) -> Array:
    """Return the corners (k, 3) [m] of the boxes around the shapes of a body, in its frame."""
    model, corners = chain.model, [np.empty((0, 3))]
    signs = np.array([[x, y, z, 0.0] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    for visual in chain.visuals:
        frame = find_frame(model, visual.frame)
        if frame.parentJoint != joint:
            continue
        if visual.shape == "mesh":
            low, high = np.array(extent(visual.mesh)) * visual.size
            half, middle = 0.5 * np.abs(high - low), 0.5 * (high + low)
        else:
            half, middle = _half(visual), np.zeros(3)
        points = signs * [*half, 0.0] + [*middle, 1.0]
        corners.append((points @ visual.placement.T @ frame.placement.homogeneous.T)[:, :3])
    return np.concatenate(corners)


def _half(visual: Visual) -> Array:
    """Return half the size (3,) of the box around a shape that is no mesh [m]."""
    r = visual.size[0]
    tall = 0.5 * visual.size[-1] + (r if visual.shape == "capsule" else 0.0)
    return {"box": 0.5 * np.array(visual.size), "sphere": np.full(3, r)}.get(visual.shape, np.array([r, r, tall]))


@lru_cache(maxsize=1024)
def extent(mesh: str) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Return the lowest and the highest corner of a mesh in its own unit; its origin where it cannot be read."""
    import coal

    try:
        points = np.array(coal.MeshLoader().load(mesh, np.ones(3)).vertices())
    except (ValueError, RuntimeError):  # whoever draws it says so
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    low, high = (tuple(float(x) for x in corner) for corner in (points.min(axis=0), points.max(axis=0)))
    return (low[0], low[1], low[2]), (high[0], high[1], high[2])


def amid_ground(chain: ClosedChain) -> Array:
    """Return the mean place of the joints on the ground."""
    model = chain.model
    places = [np.array(model.jointPlacements[j].translation) for j in range(1, model.njoints) if model.parents[j] == 0]
    return np.asarray(np.mean([*places, *ground_closures(chain)], axis=0))


def ground_closures(chain: ClosedChain) -> list[Array]:
    """Return the places of the closure frames that are fixed to the ground."""
    frames = [find_frame(chain.model, f) for c in chain.closures for f in c.ends]
    return [np.array(f.placement.translation) for f in frames if f.parentJoint == 0]
