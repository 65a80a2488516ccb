"""Counterweights one can make: discs (with a bore where needed), bars and balls, and the arms that carry them.

In the plane a flat piece of density d and thickness t has the area A = m / (d t). With its polar inertia I about its
mass centre,

    disc with radii r > b:   I = m (r^2 + b^2) / 2,    A = pi (r^2 - b^2)     possible when I >= m^2 / (2 pi d t)
    bar  with sides l > w:   I = m (l^2 + w^2) / 12,   A = l w                possible when I >= m^2 / (6 d t)

so mass, place and inertia come out exact. A ball has the inertia that it has. What is stated of a realisation is
measured on the bodies that it consists of, never taken from the optimum that they were made for.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array, Immutable, figures, frozen
from fivebar_pin.balancing.change import Change
from fivebar_pin.balancing.design import Design
from fivebar_pin.balancing.parameters import Space, plane_axes
from fivebar_pin.balancing.pieces.materials import density_of, thickness_of
from fivebar_pin.balancing.pieces.piece import SHAPES, Piece
from fivebar_pin.chain import ClosedChain, Visual
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["Counterweight", "Realisation", "realise"]

COLOUR = (0.86, 0.36, 0.10, 1.0)  # of every counterweight: by it the viewer knows them, in files too
_SAME = 1e-6  # difference of realised and promised terms that counts as none [of the term or its size before]
_FITS = 2e-5  # length that a piece may stick out of its region, for round-off [chain lengths]
_SHOWN = 1e-3  # the same that is worth a word [radii of the piece]
_EXACT = 1e-9  # residual of the conditions that counts as balanced [of the moving mass]
_ROUND_OFF = 1e-12  # difference of terms that is none, whatever their size [their unit]
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
        off = "" if self.deviation[2] <= _SAME * own else f", inertia off by {self.deviation[2]:.2g} kg m2"
        arm = "" if self.arm is None else f", on an arm of {1e3 * self.arm_size[0]:.4g} mm, {self.arm.mass:.4g} kg"
        return f"{self.body}: {self.shape} {size} mm, {self.parameters[0]:.5g} kg at ({place}) mm{arm}{off}{out}"


@dataclass(frozen=True, eq=False, repr=False)
class Realisation(Immutable):
    """Counterweights for a design, and the mechanism that carries them.

    Attributes:
        design: what they were made for; solved in pieces of their kind.
        weights: one for each body that gets material.
    """

    design: Design
    weights: tuple[Counterweight, ...]

    def __repr__(self) -> str:
        return f"Realisation({len(self.weights)} counterweights on {self.design.original.name!r})"

    def __str__(self) -> str:
        lines = [repr(self), *(f"  {w}" for w in self.weights)]
        lines += [f"  {name}: {x} promised, {y} realised" for name, (x, y) in self.figures.items()]
        return "\n".join([*lines, f"  {self.claim}"])

    @property
    def deviation(self) -> Array:
        """Largest deviations over all pieces (3,) [kg, kg m, kg m2]."""
        return frozen(np.max([w.deviation for w in self.weights], axis=0) if self.weights else np.zeros(3))

    @property
    def parameters(self) -> Array:
        """Inertial parameters (nb, 10) of the bodies with what was made, summed piece by piece."""
        original = self.design.original
        pi = np.array(original.inertial_parameters)
        for removed in self.design.removed:
            pi[original.joints.index(removed.body)] -= removed.parameters
        for w in self.weights:
            b = original.joints.index(w.body)
            pi[b] += w.parameters + (0.0 if w.arm is None else w.arm.parameters)
        return frozen(pi)

    @cached_property
    def promised(self) -> dict[str, float]:
        """Terms of the objective, and rms and peaks along the motions, of the design."""
        return {**self.design.terms, **self.design.after}

    @cached_property
    def terms(self) -> dict[str, float]:
        """The same, measured on the bodies that were made."""
        return {name: self.design.value(name, self.parameters) for name in self.promised}

    @property
    def figures(self) -> dict[str, tuple[str, str]]:
        """What is promised and what is realised, for people to read: round-off is written as 0."""
        scale = self.design.scale
        return {
            name: (figures(x, scale(name), digits=6), figures(self.terms[name], scale(name), digits=6))
            for name, x in self.promised.items()
        }

    @cached_property
    def residual(self) -> float:
        """Largest residual of the conditions of what was made, over the moving mass [-]."""
        conditions = self.design.conditions
        if conditions is None or not conditions.rank:
            return 0.0
        return float(np.abs(conditions.residual(self.parameters)).max() / (self.chain.mass or 1.0))

    @property
    def attained(self) -> bool:
        """Whether what was made is balanced, lies in its regions, and has the terms that the design promises."""
        before = {**self.design.terms, **self.design.before}
        same = all(
            abs(self.terms[k] - x) <= _SAME * max(abs(x), abs(before.get(k, 0.0))) + _ROUND_OFF
            for k, x in self.promised.items()
        )
        reach = self.design.original.length
        return same and self.residual <= _EXACT and all(w.overhang <= _FITS * reach for w in self.weights)

    @property
    def claim(self) -> str:
        """What can be said of it, in words."""
        d = self.design
        if not self.attained:
            return "the pieces do not have what the design asks for: take the realised figures"
        kind = "of this kind, on these bodies and with these arms," if d.arms else "of this kind"
        if d.status == "optimal":
            return f"optimal: no counterweights {kind} are better than {d.dual_bound:.9g}"
        best = f"none {kind} is better than {d.dual_bound:.9g}"
        return f"not proved optimal: objective {d.objective_text(digits=9)}, {best}"

    @cached_property
    def chain(self) -> ClosedChain:
        """The mechanism with its counterweights and their arms, drawn in a colour of their own."""
        original = self.design.original
        chain = _with_frames(original, [w.body for w in self.weights]).with_inertial_parameters(self.parameters)
        drawn = [visual for w in self.weights for visual in _visuals(chain, w)]
        return replace(chain, visuals=(*chain.visuals, *drawn))


def realise(
    design: Design,
    *,
    shape: str | None = None,
    material: str | float | None = None,
    thickness: float | None = None,
    arm: float | None = None,
) -> Realisation:
    """Turn added material into counterweights.

    A design that was solved in pieces is made of them. Any other is solved again in pieces of the kind asked for, so
    that what is made is the best that can be made, and not the nearest to something that cannot.

    Args:
        design: of `balance` in mode "add".
        shape: "disc" or "bar" for planar mechanisms, "ball" for any; a ball has the inertia that it has. A disc, or
            in space a ball, unless given.
        material: one of `MATERIALS`, or a density [kg/m3]; steel unless given.
        thickness: along the normal of the plane [m]; a fifth of the chain's characteristic length unless given.
        arm: side of the square arms [m]; a fifth of the outer radius of the counterweight unless given, 0 for none.

    Raises:
        UnknownNameError: a shape or material that is not known.
        InvalidInputError: a redesign (nothing is added), a flat piece on a spatial mechanism, a bad thickness.
        InfeasibleError: there is no design, or none in such pieces.
        SolverError: neither counterweights of this kind nor a proof that there are none.
    """
    _ = design.chain  # raises when infeasible
    if design.mode != "add":
        raise InvalidInputError("design", design.mode, "must be of mode 'add' to be made by counterweights")
    asked = (shape, material, thickness, arm) != (None, None, None, None)
    if asked or not all(c.body in design.pieces for c in design.added):
        word = shape or ("disc" if design.space.planar else "ball")
        piece = piece_of(design.original, word, material, thickness, arm)
        wanted = {c.body: piece if asked else design.pieces.get(c.body, piece) for c in design.added}
        if not all(body in design.pieces and piece.alike(design.pieces[body]) for body, piece in wanted.items()):
            design = _solved_in(design, wanted)
            _ = design.chain
    made = [_make(design, c) for c in design.added if c.mass > 0.0]
    return Realisation(design, tuple(made))


def piece_of(
    chain: ClosedChain,
    shape: str,
    material: str | float | None,
    thickness: float | None,
    arm: float | None,
) -> Piece:
    """Return the kind of piece that these words stand for; arguments as for `realise`."""
    if shape not in SHAPES:
        raise UnknownNameError("shape", shape, SHAPES)
    stuff = "steel" if material is None else material
    return SHAPES[shape].of(density_of(stuff), thickness_of(thickness, chain.length), arm)


def _solved_in(design: Design, pieces: Mapping[str, Piece]) -> Design:
    asked = design.asked
    if asked is None:
        raise InvalidInputError("design", design.status, "must come from balance, to be solved again in pieces")
    solved = asked.problem.in_pieces(pieces).solve(asked.minimise, limits=asked.limits)
    return replace(solved, alternatives=design.alternatives)


def _make(design: Design, change: Change) -> Counterweight:
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


def _visuals(chain: ClosedChain, w: Counterweight) -> list[Visual]:
    """Return the piece, and its arm up to the rim."""
    frame = _frame_of(chain, w.body)
    assert frame is not None
    into = np.asarray(frame.placement.inverse().homogeneous)
    kind = SHAPES[w.shape]
    out = [Visual(frame.name, *kind.visual(w.size), into @ w.pose, COLOUR)]
    if w.arm is not None:
        x = w.arm.place - w.pose[:3, 2] * float(w.pose[:3, 2] @ w.arm.place) if kind.flat else w.arm.place
        x = x / np.linalg.norm(x)
        z = w.pose[:3, 2] if kind.flat else plane_axes(x)[0]
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = np.column_stack([x, np.cross(z, x), z]), w.arm.place
        out.append(Visual(frame.name, "box", w.arm_size, into @ pose, COLOUR))
    return out
