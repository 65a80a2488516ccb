"""ClosedChain: the one immutable description of a mechanism."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, Immutable, all_of, checked, frozen, seal
from fivebar_pin.chain.checks import check_actuated, check_closures, check_tree
from fivebar_pin.chain.frames import frames_by_name
from fivebar_pin.chain.visual import Visual
from fivebar_pin.closures import Closure
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["ClosedChain"]


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
        check_tree(self.model)
        check_closures(self.model, self.closures)
        check_actuated(self.model, self.actuated)
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

    def columns(self, joint: str) -> tuple[slice, slice]:
        """Return where a joint's coordinates are in a configuration q and in v, a.

        Raises:
            UnknownNameError: there is no such joint.
        """
        if joint not in self.joints:
            raise UnknownNameError("joint", joint, self.joints)
        j = self.model.getJointId(joint)
        q, v, own = int(self.model.idx_qs[j]), int(self.model.idx_vs[j]), self.model.joints[j]
        return slice(q, q + int(own.nq)), slice(v, v + int(own.nv))

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
