"""What a tree, its closures and its motors must be."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from fivebar_pin.chain.frames import frames_by_name
from fivebar_pin.closures import Closure
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["check_actuated", "check_closures", "check_tree"]


def check_tree(model: pin.Model) -> None:
    for j in range(1, model.njoints):
        placement, inertia = model.jointPlacements[j], model.inertias[j]
        if not np.all(np.isfinite(placement.homogeneous)):
            raise InvalidInputError(f"placement of joint {model.names[j]}", "nan", "must be finite")
        if not np.all(np.isfinite(inertia.toDynamicParameters())):
            raise InvalidInputError(f"inertia of joint {model.names[j]}", "nan", "must be finite")
        if inertia.mass < 0.0:
            raise InvalidInputError(
                f"mass of the body of joint {model.names[j]}", inertia.mass, "must not be negative [kg]"
            )
    mimics = [model.names[j] for j in model.mimicking_joints]
    if mimics:
        raise InvalidInputError(
            "mimic joints",
            mimics,
            "cannot be part of a chain: the bodies they move would be left out",
            "Build the model without mimic: buildModelFromUrdf makes them joints of their own; a Coupling ties them.",
        )
    _check_losses(model)


_LOSSES = {
    "armature": "armature",
    "damping": "damping",
    "upperDryFrictionLimit": "dry friction",
    "rotorInertia": "rotor inertia",
    "upperEffortLimit": "effort limit",
    "upperVelocityLimit": "velocity limit",
}  # what must not be negative, by the field of pin.Model
_LIMITS = (
    ("lowerPositionLimit", "upperPositionLimit", "position limits"),
    ("lowerEffortLimit", "upperEffortLimit", "effort limits"),
    ("lowerVelocityLimit", "upperVelocityLimit", "velocity limits"),
)


def _check_losses(model: pin.Model) -> None:
    """Raise for losses and limits that no joint can have; each check is one comparison for all joints."""
    if not np.all(np.isfinite(model.gravity.linear)):
        raise InvalidInputError("gravity", np.array(model.gravity.linear).tolist(), "must be finite [m/s2]")
    for field_name, word in _LOSSES.items():
        values = np.array(getattr(model, field_name))
        bad = np.flatnonzero(~(values >= 0.0))
        if bad.size:
            k = int(bad[0])
            name = _owner(model, k, "idx_vs")
            raise InvalidInputError(f"{word} of joint {name}", float(values[k]), "must be a number, not negative")
    for low_name, high_name, word in _LIMITS:
        low, high = np.array(getattr(model, low_name)), np.array(getattr(model, high_name))
        bad = np.flatnonzero(~(low <= high))
        if bad.size:
            k = int(bad[0])
            name = _owner(model, k, "idx_qs" if word == "position limits" else "idx_vs")
            raise InvalidInputError(f"{word} of joint {name}", [float(low[k]), float(high[k])], "must be lower, upper")


def _owner(model: pin.Model, k: int, starts: str) -> str:
    """Return the joint that coordinate k belongs to."""
    first = list(getattr(model, starts))
    return str(model.names[max(j for j in range(1, model.njoints) if first[j] <= k)])


def check_closures(model: pin.Model, closures: tuple[Closure, ...]) -> None:
    frames = frames_by_name(model) if closures else {}
    for closure in closures:
        closure.check(model, frames)
    names = [c.name for c in closures]
    if len(set(names)) != len(names):
        raise InvalidInputError("closure names", names, "must differ")


def check_actuated(model: pin.Model, actuated: tuple[str, ...]) -> None:
    places = {name: j for j, name in enumerate(model.names) if j}
    for name in actuated:
        if name not in places:
            raise UnknownNameError("actuated joint", name, places)
    if len(set(actuated)) < len(actuated):
        name = next(name for name in actuated if actuated.count(name) > 1)
        raise InvalidInputError("actuated joints", actuated, f"{name!r} is named twice")
    for name in actuated:
        nv = model.nvs[places[name]]
        if nv != 1:
            raise InvalidInputError(f"actuated joint {name}", f"nv = {nv}", "must have one degree of freedom")
