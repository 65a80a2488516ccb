"""Moving joints, frames, bodies and visuals of a chain to where its named parameters put them."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain.bodies import Body
from fivebar_pin.chain.frames import frames_by_name
from fivebar_pin.chain.parameters import Geometry
from fivebar_pin.chain.visual import Visual
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["put_in_place", "reshaped", "with_bodies"]

_SAME = 1e-9
"""Difference of placements up to which they are the same one, written and read back [m, -]."""


def put_in_place(model: pin.Model, geometry: Geometry) -> None:
    """Put joints and frames where the parameters say, to the last digit; they have to be there already.

    Raises:
        UnknownNameError: a joint or frame of a placement or body that the model does not have.
        InvalidInputError: the model has it somewhere else, or a body with frames on several links.
    """
    for name, pose in geometry.poses().items():
        away = np.abs(np.array(_placed(model, name).homogeneous) - np.array(pose.homogeneous)).max()
        if away > _SAME:
            raise InvalidInputError(
                f"placement of {name}", float(away), "lies that far from where the parameters put it [m, -]"
            )
    _put(model, geometry)
    frames = frames_by_name(model) if geometry.bodies else {}
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
    _follow_bodies(model, moved, geometry.bodies)
    return moved, tuple(_follow_visuals(model, moved, visuals, geometry.bodies))


def with_bodies(model: pin.Model, bodies: Iterable[Body]) -> pin.Model:
    """Return the model with each link that a rule is about made of what the rules say and nothing else."""
    model = model.copy()
    for j, rules in _by_joint(model, bodies).items():
        model.inertias[j] = _total(model, rules)
    return model


def _follow_bodies(before: pin.Model, after: pin.Model, bodies: Iterable[Body]) -> None:
    """Give the links whose frames have moved their new inertia, in place.

    What a link has beyond its rules (a counterweight, say) stays where it is in the axes of its joint.
    """
    for j, rules in _by_joint(after, bodies).items():
        if all(np.array_equal(_poses(before, r), _poses(after, r)) for r in rules):
            continue
        old, new, present = _total(before, rules), _total(after, rules), before.inertias[j]
        if present == old:
            after.inertias[j] = new
            continue
        pi = present.toDynamicParameters() + new.toDynamicParameters() - old.toDynamicParameters()
        name = after.names[j]
        if not pi[0] > 0.0:
            raise InvalidInputError(
                f"mass of the body of joint {name}", float(pi[0]), "must stay positive [kg]", "Cut off less."
            )
        after.inertias[j] = pin.Inertia.FromDynamicParameters(pi)


def _follow_visuals(
    before: pin.Model, after: pin.Model, visuals: Iterable[Visual], bodies: Iterable[Body]
) -> Iterable[Visual]:
    """Yield the visuals; those that show a body of a rule as it was show it as it is now."""
    boxes = [
        (j, was, now)
        for j, rules in _by_joint(after, bodies).items()
        for rule in rules
        for was, now in zip(rule.drawn(_poses(before, rule)), rule.drawn(_poses(after, rule)), strict=True)
        if was[0] != now[0] or not np.array_equal(was[1], now[1])
    ]
    there, then = frames_by_name(before), frames_by_name(after)
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


def _near(one: object, other: object) -> bool:
    return bool(np.allclose(np.asarray(one), np.asarray(other), rtol=0.0, atol=_SAME))


def _joint_of(model: pin.Model, name: str) -> int:
    """Return the joint of this name, 0 where there is none: then it is the name of a frame."""
    return int(model.getJointId(name)) if model.existJointName(name) else 0


def _placed(model: pin.Model, name: str) -> pin.SE3:
    j = _joint_of(model, name)
    if j:
        return model.jointPlacements[j]
    frames = frames_by_name(model)
    if name not in frames:
        raise UnknownNameError("joint or frame of a placement", name, [*list(model.names)[1:], *frames])
    return frames[name].placement


def _put(model: pin.Model, geometry: Geometry) -> None:
    poses = geometry.poses()
    ids = dict(_ids(model, poses.__contains__))
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


def _ids(model: pin.Model, wanted: Callable[[str], bool]) -> Iterable[tuple[str, int]]:
    """Yield name and index of the frames that `frames_by_name` means."""
    meant = frames_by_name(model)
    for k, frame in enumerate(model.frames):
        if wanted(frame.name) and frame.type == meant[frame.name].type:
            yield frame.name, k


def _by_joint(model: pin.Model, bodies: Iterable[Body]) -> dict[int, list[Body]]:
    """Return the rules of every moving link."""
    frames, found = frames_by_name(model), dict[int, list[Body]]()
    for body in bodies:
        j = int(frames[body.frames[0]].parentJoint)
        if j:
            found.setdefault(j, []).append(body)
    return found


def _poses(model: pin.Model, body: Body) -> Array:
    frames = frames_by_name(model)
    return np.stack([np.array(frames[name].placement.homogeneous) for name in body.frames])


def _total(model: pin.Model, rules: Iterable[Body]) -> pin.Inertia:
    total = None
    for rule in rules:
        part = rule.inertia(_poses(model, rule))
        total = part if total is None else total + part
    return total
