"""ClosedChain: the one immutable description of a mechanism."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, Immutable, all_of, checked, frozen, seal
from fivebar_pin.closures import Closure
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["ClosedChain", "Visual"]

_JOINT_FRAMES = (pin.FrameType.JOINT, pin.FrameType.FIXED_JOINT)


@dataclass(frozen=True, slots=True, eq=False)
class Visual(Immutable):
    """A shape drawn on a frame of the tree; it has no mass.

    Attributes:
        frame: name of the frame it moves with.
        shape: "box", "cylinder", "capsule", "sphere" or "mesh".
        size: box (x, y, z); cylinder and capsule (radius, length along z); sphere (radius,); mesh (scale x, y, z) [m].
        placement: pose of the shape in the frame, homogeneous (4, 4).
        rgba: colour, each in [0, 1].
        mesh: file of a mesh, else "".
    """

    frame: str
    shape: str
    size: tuple[float, ...]
    placement: Array = field(default_factory=lambda: np.eye(4))
    rgba: tuple[float, float, float, float] = (0.6, 0.6, 0.65, 1.0)
    mesh: str = ""

    def __post_init__(self) -> None:
        lengths = {"box": 3, "cylinder": 2, "capsule": 2, "sphere": 1, "mesh": 3}
        if self.shape not in lengths:
            raise UnknownNameError("visual shape", self.shape, lengths)
        name = f"size of {self.shape} on {self.frame}"
        size = checked(name, self.size, (lengths[self.shape],))
        if self.shape == "mesh" and not size.all():
            raise InvalidInputError(name, size.tolist(), "must be scales other than zero")
        if self.shape != "mesh" and size.min() < 0.0:
            raise InvalidInputError(name, size.tolist(), "must not be negative [m]")
        object.__setattr__(self, "size", tuple(float(s) for s in size))
        object.__setattr__(self, "placement", checked("visual placement", self.placement, (4, 4)))
        object.__setattr__(self, "rgba", tuple(float(c) for c in checked("rgba", self.rgba, (4,))))


@dataclass(frozen=True, eq=False, repr=False)
class ClosedChain(Immutable):
    """An open tree, the closures that make loops of it, and the joints that are driven.

    Args:
        model: the open tree; copied, the caller's stays untouched.
        closures: loop closures between frames of the tree.
        actuated: names of the driven joints, in the order of all actuated columns; one degree of freedom each.
        name: what reports call the mechanism; the model's name unless given.
        visuals: shapes to draw.

    Raises:
        InvalidInputError: a closure within one body, a joint named twice or with several degrees of freedom,
            placements or inertias that are not finite.
        UnknownNameError: a frame or joint that the model does not have.
    """

    model: pin.Model
    closures: tuple[Closure, ...]
    actuated: tuple[str, ...]
    name: str = ""
    visuals: tuple[Visual, ...] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.model, pin.Model):
            raise InvalidInputError("model", self.model, "must be a pin.Model; load(path) reads one from a file")
        object.__setattr__(self, "model", self.model.copy())
        for name, kind in (("closures", Closure), ("actuated", str), ("visuals", Visual)):
            object.__setattr__(self, name, all_of(name, getattr(self, name), kind))
        object.__setattr__(self, "name", self.name or self.model.name or "mechanism")
        _check_tree(self.model)
        _check_closures(self.model, self.closures)
        _check_actuated(self.model, self.actuated)
        frames = {f.name for f in self.model.frames} if self.visuals else set()
        for visual in self.visuals:
            if visual.frame not in frames:
                raise UnknownNameError("frame", visual.frame, sorted(frames))

    def __repr__(self) -> str:
        closures = ", ".join(f"{c.name} ({c.kind.value})" for c in self.closures) or "none"
        return (
            f"ClosedChain({self.name!r}: {self.model.njoints - 1} joints, nq = {self.nq}, nv = {self.nv}; "
            f"closures: {closures}; actuated: {', '.join(self.actuated) or 'none'})"
        )

    @property
    def nq(self) -> int:
        """Length of a configuration."""
        return int(self.model.nq)

    @property
    def nv(self) -> int:
        """Degrees of freedom of the open tree."""
        return int(self.model.nv)

    @property
    def na(self) -> int:
        """Number of actuated coordinates."""
        return len(self.actuated)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints of the tree, without the universe."""
        return tuple(self.model.names)[1:]

    @property
    def mass(self) -> float:
        """Total moving mass [kg]."""
        return float(sum(I.mass for I in list(self.model.inertias)[1:]))

    @cached_property
    def actuated_index(self) -> npt.NDArray[np.intp]:
        """Positions of the actuated coordinates in v (na,)."""
        model = self.model
        index = np.array([model.idx_vs[model.getJointId(j)] for j in self.actuated], dtype=np.intp)
        seal(index)
        return index

    @cached_property
    def passive_index(self) -> npt.NDArray[np.intp]:
        """Positions of the passive coordinates in v (nv - na,)."""
        index = np.setdiff1d(np.arange(self.nv), self.actuated_index)
        seal(index)
        return index

    @cached_property
    def inertial_parameters(self) -> Array:
        """Inertial parameters of the moving bodies (njoints - 1, 10), Pinocchio's order, about the joint origin."""
        return frozen([I.toDynamicParameters() for I in list(self.model.inertias)[1:]])

    @cached_property
    def references(self) -> dict[str, Array]:
        """Named configurations that came with the model (nq,)."""
        return {entry.key(): frozen(entry.data()) for entry in self.model.referenceConfigurations}

    @cached_property
    def length(self) -> float:
        """Characteristic length [m]: the mean distance between neighbouring joints, closures included.

        What stands on the ground counts from the first joint there, so that it does not matter where the mechanism is.
        """
        model = self.model
        spans, origin = [], np.array(model.jointPlacements[1].translation) if model.njoints > 1 else np.zeros(3)
        places = [(model.parents[j], model.jointPlacements[j].translation) for j in range(1, model.njoints)]
        frames = frames_by_name(model) if self.closures else {}
        ends = [frames[f] for closure in self.closures for f in closure.frames]
        for parent, place in [*places, *((f.parentJoint, f.placement.translation) for f in ends)]:
            spans.append(float(np.linalg.norm(place - origin if parent == 0 else place)))
        real = [s for s in spans if s > 0.0]
        return float(np.mean(real)) if real else 1.0

    def with_inertias(self, inertias: Mapping[str, pin.Inertia]) -> ClosedChain:
        """Return the same mechanism with other inertias for the named joints' bodies."""
        model = self.model.copy()
        for joint, inertia in inertias.items():
            if joint not in self.joints:
                raise UnknownNameError("joint", joint, self.joints)
            model.inertias[model.getJointId(joint)] = inertia
        return replace(self, model=model)

    def with_inertial_parameters(self, parameters: npt.ArrayLike) -> ClosedChain:
        """Return the same mechanism with the given inertial parameters (njoints - 1, 10)."""
        pi = checked("inertial parameters", parameters, (self.model.njoints - 1, 10))
        return self.with_inertias({j: _inertia(j, row) for j, row in zip(self.joints, pi, strict=True)})

    def with_gravity(self, gravity: npt.ArrayLike) -> ClosedChain:
        """Return the same mechanism under another gravity (3,) [m/s2]."""
        model = self.model.copy()
        model.gravity.linear = np.array(checked("gravity", gravity, (3,)))
        return replace(self, model=model)

    def with_actuated(self, actuated: Iterable[str]) -> ClosedChain:
        """Return the same mechanism driven at other joints."""
        return replace(self, actuated=all_of("actuated", actuated, str))


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


def _inertia(joint: str, pi: Array) -> pin.Inertia:
    """Return ten parameters as an inertia; Pinocchio divides by the mass, which a massless body does not have."""
    if pi[0] != 0.0:
        return pin.Inertia.FromDynamicParameters(np.array(pi))
    if pi[1:4].any():
        raise InvalidInputError(
            f"first moment of the body of joint {joint}", pi[1:4].tolist(), "must be zero, as its mass"
        )
    I = np.array([[pi[4], pi[5], pi[7]], [pi[5], pi[6], pi[8]], [pi[7], pi[8], pi[9]]])
    return pin.Inertia(0.0, np.zeros(3), I)


def _check_tree(model: pin.Model) -> None:
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
            "Build the model without mimic: buildModelFromUrdf reads them as joints of their own.",
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


def _check_closures(model: pin.Model, closures: tuple[Closure, ...]) -> None:
    frames = frames_by_name(model) if closures else {}
    for closure in closures:
        for frame in closure.frames:
            if frame not in frames:
                raise UnknownNameError(f"frame of closure {closure.name}", frame, frames)
        first, second = (frames[f].parentJoint for f in closure.frames)
        if first == second:
            raise InvalidInputError(
                f"closure {closure.name}",
                closure.frames,
                f"joins two frames of one body ({model.names[first]})",
            )
    names = [c.name for c in closures]
    if len(set(names)) != len(names):
        raise InvalidInputError("closure names", names, "must differ")


def _check_actuated(model: pin.Model, actuated: tuple[str, ...]) -> None:
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
