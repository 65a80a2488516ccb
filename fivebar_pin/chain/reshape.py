"""Moving joints, frames, bodies and visuals of a chain to where its named parameters put them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain.bodies import Body
from fivebar_pin.chain.frames import frames_by_name
from fivebar_pin.chain.parameters import Geometry
from fivebar_pin.chain.visual import Visual
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["put_in_place", "reshaped", "with_bodies"]

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
    bodies = tuple(_moved_bodies(there, then, geometry.bodies))
    _follow_bodies(model, moved, bodies)
    return moved, tuple(_follow_visuals(visuals, there, then, bodies))


def with_bodies(model: pin.Model, bodies: Iterable[Body]) -> pin.Model:
    """Return the model with each link that a rule is about made of what the rules say and nothing else."""
    model = model.copy()
    frames = frames_by_name(model)
    for j, found in _by_joint(_moved_bodies(frames, frames, bodies)).items():
        model.inertias[j] = _total(body.rule.inertia(body.now) for body in found)
    return model


@dataclass(frozen=True, slots=True, eq=False)
class _Body:
    """A rule about a moving link: its joint, and the poses of its frames (k, 4, 4) before and after."""

    rule: Body
    joint: int
    was: Array
    now: Array


def _moved_bodies(
    there: Mapping[str, pin.Frame], then: Mapping[str, pin.Frame], bodies: Iterable[Body]
) -> Iterator[_Body]:
    for rule in bodies:
        joint = int(then[rule.frames[0]].parentJoint)
        if joint:
            was, now = (
                np.stack([np.array(frames[name].placement.homogeneous) for name in rule.frames])
                for frames in (there, then)
            )
            yield _Body(rule, joint, was, now)


def _by_joint(bodies: Iterable[_Body]) -> dict[int, list[_Body]]:
    found: dict[int, list[_Body]] = {}
    for body in bodies:
        found.setdefault(body.joint, []).append(body)
    return found


def _follow_bodies(before: pin.Model, after: pin.Model, bodies: Iterable[_Body]) -> None:
    """Give the links whose frames have moved their new inertia, in place.

    What a link has beyond its rules (a counterweight, say) stays where it is in the axes of its joint.
    """
    for j, found in _by_joint(bodies).items():
        if all(np.array_equal(body.was, body.now) for body in found):
            continue
        old = _total(body.rule.inertia(body.was) for body in found)
        new = _total(body.rule.inertia(body.now) for body in found)
        present = before.inertias[j]
        if present == old:
            after.inertias[j] = new
            continue
        parts = np.stack([inertia.toDynamicParameters() for inertia in (present, new, old)])
        pi = parts[0] + parts[1] - parts[2]
        if not pi[0] > 0.0:
            name, weight = f"mass of the body of joint {after.names[j]}", parts[2, 0]
            rule = f"must stay positive [kg]: the link weighs {present.mass:.4g} kg, what it is said to be made of"
            way = "Cut off less, or give the model the inertias of its bodies."
            raise InvalidInputError(name, float(pi[0]), f"{rule} {weight:.4g} kg", way)
        after.inertias[j] = pin.Inertia.FromDynamicParameters(pi)
        if _lacks(after.inertias[j]) > max(_lacks(present), _REAL * np.abs(parts[:, 4:]).max()):
            moments = np.linalg.eigvalsh(after.inertias[j].inertia).tolist()
            rule = "must be those of a body [kg m2]: the link has less of it than what it is said to be made of"
            way = "Cut off less, or change lengths before masses."
            raise InvalidInputError(f"moments of inertia of the body of joint {after.names[j]}", moments, rule, way)


def _lacks(inertia: pin.Inertia) -> float:
    """Return by how much the largest principal moment exceeds the sum of the others [kg m2]."""
    moments = np.linalg.eigvalsh(inertia.inertia)
    return float(moments[2] - moments[0] - moments[1])


def _follow_visuals(
    visuals: Iterable[Visual], there: Mapping[str, pin.Frame], then: Mapping[str, pin.Frame], bodies: Iterable[_Body]
) -> Iterator[Visual]:
    """Yield the visuals; those that show a body of a rule as it was show it as it is now."""
    boxes = [
        (body.joint, was, now)
        for body in bodies
        if not np.array_equal(body.was, body.now)
        for was, now in zip(body.rule.drawn(body.was), body.rule.drawn(body.now), strict=True)
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
        joint = model.frames[frame.parentFrame]
        if frame.parentFrame and joint.type == pin.FrameType.FIXED_JOINT:  # as read from a file
            joint.placement = pose


def _total(parts: Iterable[pin.Inertia]) -> pin.Inertia:
    total = None
    for part in parts:
        total = part if total is None else total + part
    return total
