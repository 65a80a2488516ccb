"""Counterweights one can make: discs (with a bore where needed), bars and balls, and the arms that carry them.

In the plane a flat piece of density d and thickness t has the area A = m / (d t). With its polar inertia I about its
mass centre,

    disc with radii r > b:   I = m (r^2 + b^2) / 2,    A = pi (r^2 - b^2)     possible when I >= m^2 / (2 pi d t)
    bar  with sides l > w:   I = m (l^2 + w^2) / 12,   A = l w                possible when I >= m^2 / (6 d t)

so mass, place and inertia come out exact. A ball has the inertia that it has. What is stated of a realisation is
measured on the bodies that it consists of, never taken from the optimum that they were made for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array, Immutable, frozen
from fivebar_pin.balancing.change import Change
from fivebar_pin.balancing.design import Design
from fivebar_pin.balancing.parameters import Space
from fivebar_pin.balancing.pieces.materials import density_of
from fivebar_pin.balancing.pieces.piece import SHAPES, Piece

__all__ = ["COLOUR", "SAME", "Counterweight", "made_for"]

COLOUR = (0.86, 0.36, 0.10, 1.0)  # of every counterweight: by it the viewer knows them, in files too
SAME = 1e-6  # difference of realised and promised terms that counts as none [of the term or its size before]
_SHOWN = 1e-3  # the same that is worth a word [radii of the piece]
_RIM = 720  # points of a rim that are asked whether they lie in the region


@dataclass(frozen=True, slots=True, eq=False)
class Counterweight(Immutable):
    """One piece of material fixed to a body.

    Attributes:
        body: name of the body's joint.
        shape: "disc", "bar" or "ball".
        density: [kg/m3].
        size: disc (radius, bore radius, thickness), bar (length, width, thickness), ball (radius,) [m].
        pose: of the piece in joint axes (4, 4); z along the thickness, x along a bar.
        parameters: its ten inertial parameters about the joint origin.
        deviation: largest difference to the wanted mass, first moment and inertia (3,) [kg, kg m, kg m2]; of a planar
            mechanism only the parameters that it feels count.
        radius: from its centre to its farthest point, in the plane of a flat piece [m].
        overhang: how far it sticks out of its region [m]; 0 when it lies within.
        arm: the arm that carries it, or None.
        arm_size: its length, width and thickness (3,) [m].
    """

    body: str
    shape: str
    density: float
    size: tuple[float, ...]
    pose: Array
    parameters: Array
    deviation: Array
    radius: float
    overhang: float
    arm: Change | None
    arm_size: tuple[float, ...]

    def __str__(self) -> str:
        size = SHAPES[self.shape].words(self.size)
        place = ", ".join(f"{1e3 * x:.4g}" for x in np.round(self.pose[:3, 3], 9) + 0.0)
        out_of = f", {1e3 * self.overhang:.3g} mm out of its region"
        out = out_of if self.overhang > _SHOWN * self.radius else ""
        own = float(np.abs(self.parameters[4:]).max())
        off = "" if self.deviation[2] <= SAME * own else f", inertia off by {self.deviation[2]:.2g} kg m2"
        arm = "" if self.arm is None else f", on an arm of {1e3 * self.arm_size[0]:.4g} mm, {self.arm.mass:.4g} kg"
        return f"{self.body}: {self.shape} {size} mm, {self.parameters[0]:.5g} kg at ({place}) mm{arm}{off}{out}"


def made_for(design: Design, change: Change) -> Counterweight:
    space = design.space
    piece, b, m = design.pieces[change.body], space.bodies.index(change.body), change.mass
    axes, pose = np.array(space.axes[b]), np.eye(4)
    size = piece.size(m, change.inertia, axes)
    radius = piece.radius_of(size)
    pose[:3, :3], pose[:3, 3] = piece.axes_at(change.place, axes), change.place
    inertia = pose[:3, :3] @ np.diag(piece.principal(m, size)) @ pose[:3, :3].T
    pi = np.array(pin.Inertia(m, change.place, inertia).toDynamicParameters())
    arm = next((a for a in design.arms if a.body == change.body), None)
    return Counterweight(
        change.body,
        piece.shape,
        density_of(piece.density),
        size,
        frozen(pose),
        frozen(pi),
        _deviation(space, b, pi - change.parameters),
        radius,
        _overhang(design, b, change.place, radius),
        arm,
        () if arm is None else _arm_size(piece, arm, radius),
    )


def _deviation(space: Space, b: int, difference: Array) -> Array:
    T = space.selection()[b * space.width : (b + 1) * space.width, 10 * b : 10 * (b + 1)]
    off = np.abs(T @ difference)
    return frozen([off[space.orders == k].max() for k in (0.0, 1.0, 2.0)])


def _arm_size(piece: Piece, arm: Change, radius: float) -> tuple[float, ...]:
    """Return length, width and thickness of an arm [m]."""
    width = piece.arm_width(radius)
    return (arm.mass / (density_of(piece.density) * width**2), width, width)


def _overhang(design: Design, b: int, place: Array, radius: float) -> float:
    """Return how far a round piece sticks out of its region [m], asked of the points of its rim."""
    assert design.asked is not None
    space, L, shape = design.space, design.original.length, design.asked.problem.shape(b)
    assert shape is not None
    center = np.array(space.axes[b])[:2] @ place if space.planar else place
    off = L * (shape.axes @ (center / L - shape.center))
    away = off / np.linalg.norm(off) if off.any() else np.eye(off.size)[0]
    points = off + radius * np.vstack([_directions(off.size), away, np.eye(off.size), -np.eye(off.size)])
    return shape.overhang(points, L)


def _directions(d: int) -> Array:
    """Return unit vectors spread over the circle (d = 2) or the sphere."""
    k = np.arange(_RIM)
    if d == 2:
        angle = 2.0 * np.pi * k / _RIM
        return np.column_stack([np.cos(angle), np.sin(angle)])
    z, turn = 1.0 - (2.0 * k + 1.0) / _RIM, np.pi * (1.0 + np.sqrt(5.0)) * k
    r = np.sqrt(1.0 - z * z)
    return np.column_stack([r * np.cos(turn), r * np.sin(turn), z])
