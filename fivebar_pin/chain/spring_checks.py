"""What the springs of a chain must be."""

from __future__ import annotations

from collections.abc import Iterable

import pinocchio as pin

from fivebar_pin.chain.frames import frames_by_name
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.springs import JointSpring, Spring

__all__ = ["checked_springs"]

_MUST = "must hold Spring and JointSpring objects"


def checked_springs(model: pin.Model, springs: Iterable[Spring | JointSpring]) -> tuple[Spring | JointSpring, ...]:
    """Return the springs as a tuple once every frame and joint is known to the model.

    Raises:
        UnknownNameError: a frame or joint that the model does not have.
        InvalidInputError: something else than springs, both ends on one body, a joint of several degrees of freedom.
    """
    if not isinstance(springs, Iterable):
        raise InvalidInputError("springs", springs, _MUST)
    found = tuple(springs)
    frames = frames_by_name(model) if found else {}
    for spring in found:
        if isinstance(spring, JointSpring):
            _check_on_joint(model, spring)
        elif isinstance(spring, Spring):
            _check_between(model, spring, frames)
        else:
            raise InvalidInputError("springs", spring, _MUST)
    return found


def _check_on_joint(model: pin.Model, spring: JointSpring) -> None:
    places = {name: j for j, name in enumerate(model.names) if j}
    if spring.joint not in places:
        raise UnknownNameError("joint of a spring", spring.joint, places)
    nv = model.nvs[places[spring.joint]]
    if nv != 1:
        raise InvalidInputError(f"spring on joint {spring.joint}", f"nv = {nv}", "needs one degree of freedom")


def _check_between(model: pin.Model, spring: Spring, frames: dict[str, pin.Frame]) -> None:
    for frame in (spring.frame1, spring.frame2):
        if frame not in frames:
            raise UnknownNameError("frame of a spring", frame, frames)
    first, second = (frames[f].parentJoint for f in (spring.frame1, spring.frame2))
    if first == second:
        ends = (spring.frame1, spring.frame2)
        raise InvalidInputError(
            f"spring {spring.name}", ends, f"joins two frames of one body ({model.names[first]}): it does nothing"
        )
