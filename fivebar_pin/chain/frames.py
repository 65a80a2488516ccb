"""Frames of a model by name."""

from __future__ import annotations

import pinocchio as pin

from fivebar_pin.errors import UnknownNameError

__all__ = ["find_frame", "frames_by_name"]


_JOINT_FRAMES = (pin.FrameType.JOINT, pin.FrameType.FIXED_JOINT)


def frames_by_name(model: pin.Model) -> dict[str, pin.Frame]:
    """Return every frame by its name; where a link and a joint share one (legal in URDF), the link's frame."""
    found: dict[str, pin.Frame] = {}
    for frame in model.frames:
        if frame.name not in found or (found[frame.name].type in _JOINT_FRAMES and frame.type not in _JOINT_FRAMES):
            found[frame.name] = frame
    return found


def find_frame(model: pin.Model, name: str) -> pin.Frame:
    """Return the frame of this name, see `frames_by_name`, which is for many.

    Raises:
        UnknownNameError: there is none.
    """
    found = [frame for frame in model.frames if frame.name == name]
    if not found:
        raise UnknownNameError("frame", name, [frame.name for frame in model.frames])
    return next((frame for frame in found if frame.type not in _JOINT_FRAMES), found[0])
