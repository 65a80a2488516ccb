"""Counterweights one can make: discs (with a bore where needed), bars and balls that carry given parameters.

In the plane a flat piece of density d and thickness t has the area A = m / (d t). With its polar inertia I about its
mass centre,

    disc with radii r > b:   I = m (r^2 + b^2) / 2,    A = pi (r^2 - b^2)     possible when I >= m^2 / (2 pi d t)
    bar  with sides l > w:   I = m (l^2 + w^2) / 12,   A = l w                possible when I >= m^2 / (6 d t)

so mass, place and inertia come out exact. Asked for less inertia than that, the solid disc or the square bar is the
closest; mass and place are exact still, and the surplus of inertia is stated.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array, frozen
from fivebar_pin.balancing._parameters import Space
from fivebar_pin.balancing.design import Change, Design
from fivebar_pin.chain import ClosedChain, Visual
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["MATERIALS", "Counterweight", "Realisation", "realise"]

MATERIALS: Mapping[str, float] = {
    "aluminium": 2700.0,
    "brass": 8500.0,
    "lead": 11340.0,
    "steel": 7850.0,
    "tungsten": 19250.0,
}  # densities [kg/m3]
SHAPES = ("disc", "bar", "ball")
COLOUR = (0.86, 0.36, 0.10, 1.0)  # of every counterweight: by it the viewer knows them, in files too


@dataclass(frozen=True, slots=True, eq=False)
class Counterweight:
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
    """

    body: str
    shape: str
    density: float
    size: tuple[float, ...]
    pose: Array
    parameters: Array
    deviation: Array


@dataclass(frozen=True, eq=False, repr=False)
class Realisation:
    """Counterweights for a design, and the mechanism that carries them.

    Attributes:
        design: what was wanted.
        weights: one for each body that gets material.
    """

    design: Design
    weights: tuple[Counterweight, ...]

    def __repr__(self) -> str:
        return f"Realisation({len(self.weights)} counterweights on {self.design.original.name!r})"

    def __str__(self) -> str:
        lines = [repr(self)]
        for w in self.weights:
            size = " x ".join(f"{1e3 * s:.4g}" for s in w.size)
            lines.append(
                f"  {w.body}: {w.shape} {size} mm, {w.parameters[0]:.5g} kg, inertia off by {w.deviation[2]:.2g} kg m2"
            )
        return "\n".join(lines)

    @property
    def deviation(self) -> Array:
        """Largest deviations over all pieces (3,) [kg, kg m, kg m2]."""
        return frozen(np.max([w.deviation for w in self.weights], axis=0) if self.weights else np.zeros(3))

    @cached_property
    def chain(self) -> ClosedChain:
        """The mechanism with its counterweights, drawn in a colour of their own."""
        original = self.design.original
        pi = np.array(original.inertial_parameters)
        for removed in self.design.removed:
            pi[original.joints.index(removed.body)] -= removed.parameters
        for w in self.weights:
            pi[original.joints.index(w.body)] += w.parameters
        chain = _with_frames(original, [w.body for w in self.weights]).with_inertial_parameters(pi)
        return replace(chain, visuals=(*chain.visuals, *(_visual(chain, w) for w in self.weights)))


def realise(
    design: Design, *, shape: str = "disc", material: str | float = "steel", thickness: float | None = None
) -> Realisation:
    """Turn added material into counterweights.

    Args:
        design: of `balance` in mode "add".
        shape: "disc" or "bar" for planar mechanisms, "ball" for any; a ball has the inertia that it has.
        material: one of `MATERIALS`, or a density [kg/m3].
        thickness: along the normal of the plane [m]; a fifth of the chain's characteristic length unless given.

    Raises:
        UnknownNameError: a shape or material that is not known.
        InvalidInputError: a redesign (nothing is added), a flat piece on a spatial mechanism, a bad thickness.
        InfeasibleError: there is no design.
    """
    if shape not in SHAPES:
        raise UnknownNameError("shape", shape, SHAPES)
    density = _density(material)
    _ = design.chain  # raises when infeasible
    space = design.space
    if design.mode != "add":
        raise InvalidInputError("design", design.mode, "must be of mode 'add' to be made by counterweights")
    if shape != "ball" and not space.planar:
        raise InvalidInputError("shape", shape, "needs a planar mechanism", "Use shape='ball'.")
    thick = 0.2 * design.original.length if thickness is None else thickness
    if not (isinstance(thick, (int, float, np.number)) and np.isfinite(thick) and thick > 0.0):
        raise InvalidInputError("thickness", thickness, "must be positive and finite [m]")
    made = [_make(c, space, shape, density, float(thick)) for c in design.added if c.mass > 0.0]
    return Realisation(design, tuple(made))


def flat_size(shape: str, mass: float, inertia: float, density: float, thickness: float) -> tuple[float, float]:
    """Return (radius, bore) of a disc or (length, width) of a bar, the most compact where the inertia is too small.

    A bore below a thousandth of the radius is not drilled.
    """
    area = mass / (density * thickness)
    if shape == "disc":
        total = max(2.0 * inertia / mass, area / np.pi)  # r^2 + b^2
        difference = area / np.pi
        bore = total - difference
        return float(np.sqrt(0.5 * (total + difference))), float(np.sqrt(0.5 * bore)) if bore > 1e-6 * total else 0.0
    squares = max(12.0 * inertia / mass, 2.0 * area)  # l^2 + w^2
    plus, minus = np.sqrt(squares + 2.0 * area), np.sqrt(max(squares - 2.0 * area, 0.0))
    return float(0.5 * (plus + minus)), float(0.5 * (plus - minus))


def _make(change: Change, space: Space, shape: str, density: float, thickness: float) -> Counterweight:
    b = space.bodies.index(change.body)
    m = change.mass
    axes = np.array(space.axes[b])
    pose = np.eye(4)
    pose[:3, 3] = change.place
    if shape == "ball":
        r = float(np.cbrt(0.75 * m / (np.pi * density)))
        size: tuple[float, ...] = (r,)
        inertia = np.eye(3) * 0.4 * m * r * r
    else:
        wanted = float(axes[2] @ change.inertia @ axes[2])
        long, short = flat_size(shape, m, wanted, density, thickness)
        size = (long, short, thickness)
        x = _along(change.place, axes)
        pose[:3, :3] = np.column_stack([x, np.cross(axes[2], x), axes[2]])
        own = _own_inertia(shape, m, size)
        inertia = pose[:3, :3] @ np.diag(own) @ pose[:3, :3].T
    pi = np.array(pin.Inertia(m, change.place, inertia).toDynamicParameters())
    T = space.selection()[b * space.width : (b + 1) * space.width, 10 * b : 10 * (b + 1)]
    off = np.abs(T @ (pi - change.parameters))
    deviation = [off[space.orders == k].max() for k in (0.0, 1.0, 2.0)]
    return Counterweight(change.body, shape, density, size, frozen(pose), frozen(pi), frozen(deviation))


def _own_inertia(shape: str, m: float, size: tuple[float, ...]) -> Array:
    """Return the principal inertias of a flat piece about its mass centre, z along the thickness (3,)."""
    a, b, t = size
    if shape == "disc":
        side = m * (3.0 * (a * a + b * b) + t * t) / 12.0
        return np.array([side, side, 0.5 * m * (a * a + b * b)])
    return m / 12.0 * np.array([b * b + t * t, a * a + t * t, a * a + b * b])


def _along(place: Array, axes: Array) -> Array:
    """Return the in-plane direction from the joint to the piece."""
    flat = place - axes[2] * float(axes[2] @ place)
    size = float(np.linalg.norm(flat))
    return np.asarray(flat / size if size > 1e-12 else axes[0])


def _density(material: str | float) -> float:
    if isinstance(material, str):
        if material not in MATERIALS:
            raise UnknownNameError("material", material, MATERIALS)
        return MATERIALS[material]
    if not (isinstance(material, (int, float, np.number)) and np.isfinite(material) and material > 0.0):
        raise InvalidInputError("density", material, "must be positive and finite [kg/m3]")
    return float(material)


def _frame_of(chain: ClosedChain, joint: str) -> pin.Frame | None:
    index = chain.model.getJointId(joint)
    return next((f for f in chain.model.frames if f.parentJoint == index), None)


def _with_frames(chain: ClosedChain, joints: list[str]) -> ClosedChain:
    """Give the named bodies a frame to draw on where they have none."""
    bare = [j for j in joints if _frame_of(chain, j) is None]
    if not bare:
        return chain
    model = chain.model.copy()
    for j in bare:
        frame = pin.Frame(f"{j}_counterweight", model.getJointId(j), 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME)
        model.addFrame(frame)
    return replace(chain, model=model)


def _visual(chain: ClosedChain, w: Counterweight) -> Visual:
    frame = _frame_of(chain, w.body)
    assert frame is not None
    placement = np.asarray(frame.placement.inverse().homogeneous) @ w.pose
    if w.shape == "ball":
        return Visual(frame.name, "sphere", w.size, placement, COLOUR)
    a, b, t = w.size
    size = (a, t) if w.shape == "disc" else (a, b, t)
    return Visual(frame.name, "cylinder" if w.shape == "disc" else "box", size, placement, COLOUR)
