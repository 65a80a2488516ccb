"""Moving joints, frames, bodies and visuals of a chain to where its named parameters put them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain.bodies import Body
from fivebar_pin.chain.frames import frames_by_name
from fivebar_pin.chain.masses import about_centre, about_origin, inertia_of, joined, row_of, symmetric
from fivebar_pin.chain.parameters import Geometry
from fivebar_pin.chain.visual import Visual
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["Shapes", "put_in_place", "reshaped", "shapes_of", "with_bodies"]

_REAL = 1e-9
"""How far moments of inertia may break the triangle inequality, as part of those about the joint: round-off [-]."""
_SAME = 1e-9
"""Difference of placements up to which they are the same one, written and read back [m, -]."""


def put_in_place(model: pin.Model, geometry: Geometry) -> None:
    """Put joints and frames where the parameters say, to the last digit; they have to be there already.

    Raises:
        UnknownNameError: a joint or frame of a placement or body that the model does not have.
        InvalidInputError: the model has it somewhere else, or a body with frames on several links.
    """
    if not geometry.placements and not geometry.bodies:
        return
    frames = frames_by_name(model)
    for name, pose in geometry.poses().items():
        j = _joint_of(model, name)
        if not j and name not in frames:
            raise UnknownNameError("joint or frame of a placement", name, [*list(model.names)[1:], *frames])
        placed = model.jointPlacements[j] if j else frames[name].placement
        away = np.abs(np.array(placed.homogeneous) - np.array(pose.homogeneous)).max()
        if away > _SAME:
            raise InvalidInputError(
                f"placement of {name}", float(away), "lies that far from where the parameters put it [m, -]"
            )
    _put(model, geometry)
    for body in geometry.bodies:
        for frame in body.frames:
            if frame not in frames:
                raise UnknownNameError("frame of a body", frame, frames)
        if len({frames[frame].parentJoint for frame in body.frames}) > 1:
            raise InvalidInputError("frames of a body", body.frames, "must be frames of one link")


def reshaped(model: pin.Model, visuals: Iterable[Visual], geometry: Geometry) -> tuple[pin.Model, tuple[Visual, ...]]:
    """Return the model and visuals of a chain as they are with another geometry."""
    moved = model.copy()
    _put(moved, geometry)
    there, then = frames_by_name(model), frames_by_name(moved)
    bodies = tuple(_moved_bodies(there, _poses(then), geometry.bodies))
    _follow_bodies(model, moved, bodies)
    return moved, tuple(_follow_visuals(visuals, there, then, bodies))


def with_bodies(model: pin.Model, bodies: Iterable[Body]) -> pin.Model:
    """Return the model with each link that a rule is about made of what the rules say and nothing else."""
    model = model.copy()
    frames = frames_by_name(model)
    for j, found in _by_joint(_moved_bodies(frames, _poses(frames), bodies)).items():
        for body in found:
            body.rule.require_real(body.now[0])
        model.inertias[j] = inertia_of(_total(body.rule.masses(body.now) for body in found)[0])
    return model


@dataclass(frozen=True, slots=True, eq=False)
class Shapes:
    """Where the joints, frames and bodies of n designs are that parameters move; what they leave alone is not there.

    Attributes:
        joints: placements on the parent's joint (n, 4, 4) by number of the joint; (1, 4, 4) where all are alike.
        frames: the same of frames in their joint, by name.
        masses: rows of the bodies (n, 10), see `fivebar_pin.chain.masses`, by number of the joint; nan for no body.
    """

    joints: dict[int, Array]
    frames: dict[str, Array]
    masses: dict[int, Array]


def shapes_of(model: pin.Model, geometry: Geometry, values: Mapping[str, Array]) -> Shapes:
    """Return the shapes of n designs, parameters (n,) each, of a chain that has this model and geometry."""
    joints: dict[int, Array] = {}
    there, moved, masses = frames_by_name(model), dict[str, Array](), dict[int, Array]()
    for placement in geometry.placements:
        poses, j = placement.poses(values), _joint_of(model, placement.name)
        if j:
            joints[j] = poses
        else:
            fixed = _fixed_joint(model, there[placement.name])
            moved |= {placement.name: poses} if fixed is None else {fixed.name: poses, placement.name: poses}
    for j, found in _by_joint(_moved_bodies(there, _poses(there) | moved, geometry.bodies)).items():
        if not all(_unmoved(body) for body in found):
            made = _Remade.of(model.inertias[j], found)
            masses[j] = np.where(made.real[:, None], made.rows, np.nan)
    return Shapes(joints, moved, masses)


@dataclass(frozen=True, slots=True, eq=False)
class _Body:
    """A rule about a moving link: its joint, and the poses of its frames (k, 4, 4) before and (n, k, 4, 4) after."""

    rule: Body
    joint: int
    was: Array
    now: Array


def _moved_bodies(there: Mapping[str, pin.Frame], then: Mapping[str, Array], bodies: Iterable[Body]) -> Iterator[_Body]:
    for rule in bodies:
        joint = int(there[rule.frames[0]].parentJoint)
        if joint:
            was = np.stack([np.array(there[name].placement.homogeneous) for name in rule.frames])
            now = np.broadcast_arrays(*(then[name] for name in rule.frames))
            yield _Body(rule, joint, was, np.stack(now, axis=1))


def _poses(frames: Mapping[str, pin.Frame]) -> dict[str, Array]:
    return {name: np.array(frame.placement.homogeneous)[None] for name, frame in frames.items()}


def _by_joint(bodies: Iterable[_Body]) -> dict[int, list[_Body]]:
    found: dict[int, list[_Body]] = {}
    for body in bodies:
        found.setdefault(body.joint, []).append(body)
    return found


def _unmoved(body: _Body) -> bool:
    return bool(np.array_equal(np.broadcast_to(body.was, body.now.shape), body.now))


@dataclass(frozen=True, slots=True, eq=False)
class _Remade:
    """A link of n designs made anew.

    Attributes:
        rows: of its body (n, 10).
        old: row of what the rules were about (10,); None where that is all of it.
        slack: how far its moments may break the triangle inequality (n,) [kg m2].
    """

    rows: Array
    old: Array | None
    slack: Array

    @classmethod
    def of(cls, present: pin.Inertia, found: Sequence[_Body]) -> _Remade:
        """Make it; what a link has beyond its rules (a counterweight, say) stays where it is in the joint's axes."""
        old = _total(body.rule.masses(body.was[None]) for body in found)
        new = _total(body.rule.masses(body.now) for body in found)
        if present == inertia_of(old[0]):
            return cls(new, None, np.zeros(len(new)))
        parts = [about_origin(x) for x in (row_of(present)[None], new, old)]
        size = np.max([np.abs(x[:, 4:]).max(axis=1) * np.ones(len(new)) for x in parts], axis=0)
        slack = np.maximum(_lacks(row_of(present)[None]), _REAL * size)
        return cls(about_centre(parts[0] + parts[1] - parts[2]), old[0], slack)

    @property
    def weighs(self) -> npt.NDArray[np.bool_]:
        """Where it has a mass, or is made of nothing but its rules (n,)."""
        return np.asarray((self.rows[:, 0] > 0.0) if self.old is not None else np.isfinite(self.rows[:, 0]))

    @property
    def real(self) -> npt.NDArray[np.bool_]:
        """Where it is a body (n,)."""
        found = np.array(self.weighs)
        if self.old is not None:
            found[found] = _lacks(self.rows[found]) <= self.slack[found]
        return found


def _follow_bodies(before: pin.Model, after: pin.Model, bodies: Iterable[_Body]) -> None:
    """Give the links whose frames have moved their new inertia, in place."""
    for j, found in _by_joint(bodies).items():
        if all(_unmoved(body) for body in found):
            continue
        for body in found:
            body.rule.require_real(body.now[0])
        made = _Remade.of(before.inertias[j], found)
        if made.old is not None and not made.real[0]:
            raise _unreal(after.names[j], before.inertias[j].mass, made, float(made.old[0]))
        after.inertias[j] = inertia_of(made.rows[0])


def _unreal(name: str, weight: float, made: _Remade, said: float) -> InvalidInputError:
    """Say what is wrong with a link that was cut down too far."""
    if not made.weighs[0]:
        rule = f"must stay positive [kg]: the link weighs {weight:.4g} kg, what it is said to be made of {said:.4g} kg"
        way = "Cut off less, or give the model the inertias of its bodies."
        return InvalidInputError(f"mass of the body of joint {name}", float(made.rows[0, 0]), rule, way)
    moments = np.linalg.eigvalsh(symmetric(made.rows[0, 4:])).tolist()
    rule = "must be those of a body [kg m2]: the link has less of it than what it is said to be made of"
    way = "Cut off less, or change lengths before masses."
    return InvalidInputError(f"moments of inertia of the body of joint {name}", moments, rule, way)


def _lacks(rows: Array) -> Array:
    """Return by how much the largest principal moment exceeds the sum of the others (n,) [kg m2]."""
    moments = np.linalg.eigvalsh(symmetric(rows[:, 4:]))
    return np.asarray(moments[:, 2] - moments[:, 0] - moments[:, 1])


def _follow_visuals(
    visuals: Iterable[Visual], there: Mapping[str, pin.Frame], then: Mapping[str, pin.Frame], bodies: Iterable[_Body]
) -> Iterator[Visual]:
    """Yield the visuals; those that show a body of a rule as it was show it as it is now."""
    boxes = [
        (body.joint, was, now)
        for body in bodies
        if not _unmoved(body)
        for was, now in zip(body.rule.drawn(body.was), body.rule.drawn(body.now[0]), strict=True)
    ]
    for visual in visuals:
        frame = there[visual.frame]
        pose = np.array(frame.placement.homogeneous) @ visual.placement
        for j, was, now in boxes if visual.shape == "box" else ():
            if frame.parentJoint == j and _near(visual.size, was[0]) and _near(pose, was[1]):
                placement = np.array(then[visual.frame].placement.inverse().homogeneous) @ now[1]
                yield Visual(visual.frame, visual.shape, now[0], placement, visual.rgba)
                break
        else:
            yield visual


def _near(one: npt.ArrayLike, other: npt.ArrayLike) -> bool:
    return bool(np.abs(np.asarray(one) - np.asarray(other)).max() <= _SAME)


def _joint_of(model: pin.Model, name: str) -> int:
    """Return the joint of this name, 0 where there is none: then it is the name of a frame."""
    return int(model.getJointId(name)) if model.existJointName(name) else 0


def _put(model: pin.Model, geometry: Geometry) -> None:
    poses = geometry.poses()
    meant = frames_by_name(model)
    ids = {f.name: k for k, f in enumerate(model.frames) if f.name in poses and f.type == meant[f.name].type}
    for name, pose in poses.items():
        j = _joint_of(model, name)
        if j:
            model.jointPlacements[j] = pose
            continue
        frame = model.frames[ids[name]]
        frame.placement = pose
        joint = _fixed_joint(model, frame)
        if joint is not None:
            joint.placement = pose


def _fixed_joint(model: pin.Model, frame: pin.Frame) -> pin.Frame | None:
    """Return the fixed joint that a frame, as read from a file, stands for."""
    above = model.frames[frame.parentFrame]
    return above if frame.parentFrame and above.type == pin.FrameType.FIXED_JOINT else None


def _total(parts: Iterable[Array]) -> Array:
    """Return the rows of bodies that are one."""
    return reduce(joined, parts)
