"""ClosedChain: the one immutable description of a mechanism."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, Immutable, all_of, checked, frozen, number, seal
from fivebar_pin.chain.checks import check_actuated, check_closures, check_tree
from fivebar_pin.chain.coordinates import q_slice, v_slice
from fivebar_pin.chain.counting import counting_turns
from fivebar_pin.chain.frames import frames_by_name
from fivebar_pin.chain.parameters import Geometry
from fivebar_pin.chain.reshape import put_in_place, reshaped
from fivebar_pin.chain.spring_checks import checked_springs
from fivebar_pin.chain.visual import Visual
from fivebar_pin.closures import Closure
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.springs import JointSpring, Spring

__all__ = ["ClosedChain"]

_COARSE = 1e-3  # closure tolerance from which on dimensions are wrong rather than rounded [m or rad]
_FLOATING = 6  # degrees of freedom of a joint that holds nothing


@dataclass(frozen=True, eq=False, repr=False)
class ClosedChain(Immutable):
    """An open tree, the closures that make loops of it, the joints that are driven, and the springs.

    Args:
        model: the open tree; copied, the caller's stays untouched. A joint that a coupling ties counts its turns: one
            whose coordinates are a cosine and a sine is stored as an ordinary revolute joint about the same axis,
            without limits, so that q has one coordinate for it instead of two (`chain.nq`, not `model.nq`, counts).
            Its reference configurations get the fewest whole turns that make the couplings hold.
        closures: loop closures between frames of the tree.
        actuated: names of the driven joints, in the order of all actuated columns; one degree of freedom each.
        name: what reports call the mechanism; the model's name unless given.
        visuals: shapes to draw.
        springs: springs and dampers between frames and on joints; all dynamics and balancing take them from here.
        geometry: named lengths and placements, and how joints, frames and bodies follow them; none unless given.
        closure_tolerance: how far the loops of a model with rounded dimensions stay open where nothing closes them
            further [m or rad; times its length above 1 m]. Up to there closures count as met, in the sense of least
            squares, and rows of theirs that contradict each other by no more as one. Zero for dimensions that are
            exact.

    Raises:
        InvalidInputError: a closure within one body, a joint named twice or with several degrees of freedom, a spring
            within one body, placements or inertias that are not finite.
        UnknownNameError: a frame or joint that the model does not have.
    """

    model: pin.Model
    closures: tuple[Closure, ...]
    actuated: tuple[str, ...]
    name: str = ""
    visuals: tuple[Visual, ...] = ()
    springs: tuple[Spring | JointSpring, ...] = ()
    geometry: Geometry = field(default_factory=Geometry)
    closure_tolerance: float = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.model, pin.Model):
            raise InvalidInputError("model", self.model, "must be a pin.Model; load(path) reads one from a file")
        object.__setattr__(self, "model", self.model.copy())
        for name, kind in (("closures", Closure), ("actuated", str), ("visuals", Visual)):
            object.__setattr__(self, name, all_of(name, getattr(self, name), kind))
        object.__setattr__(self, "name", self.name or self.model.name or "mechanism")
        if not isinstance(self.geometry, Geometry):
            raise InvalidInputError("geometry", self.geometry, "must be a Geometry")
        tolerance = number("closure tolerance", self.closure_tolerance)
        if not 0.0 <= tolerance <= _COARSE:
            raise InvalidInputError("closure tolerance", tolerance, f"must be from 0 to {_COARSE:g} m or rad")
        object.__setattr__(self, "closure_tolerance", tolerance)
        put_in_place(self.model, self.geometry)
        check_tree(self.model)
        check_closures(self.model, self.closures)
        object.__setattr__(self, "model", counting_turns(self.model, self.closures))
        check_actuated(self.model, self.actuated)
        object.__setattr__(self, "springs", checked_springs(self.model, self.springs))
        frames = {f.name for f in self.model.frames} if self.visuals else set()
        for visual in self.visuals:
            if visual.frame not in frames:
                raise UnknownNameError("frame", visual.frame, sorted(frames))

    def __repr__(self) -> str:
        closures = ", ".join(f"{c.name} ({c.kind})" for c in self.closures) or "none"
        springs = f"; springs: {', '.join(s.name for s in self.springs)}" if self.springs else ""
        parameters = f"; parameters: {', '.join(self.parameters)}" if self.parameters else ""
        return (
            f"ClosedChain({self.name!r}: {self.model.njoints - 1} joints, nq = {self.nq}, nv = {self.nv}; "
            f"closures: {closures}; actuated: {', '.join(self.actuated) or 'none'}{springs}{parameters})"
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

    @property
    def parameters(self) -> Mapping[str, float]:
        """Named lengths and placements and their values, read-only [m or rad]; `with_parameters` changes them."""
        return self.geometry.parameters

    @cached_property
    def length(self) -> float:
        """Characteristic length [m]: the mean distance between neighbouring joints, closures included.

        What stands on the ground counts from the first joint there, so that it does not matter where the mechanism is.
        """
        model = self.model
        spans, origin = [], np.array(model.jointPlacements[1].translation) if model.njoints > 1 else np.zeros(3)
        places = [(model.parents[j], model.jointPlacements[j].translation) for j in range(1, model.njoints)]
        frames = frames_by_name(model) if self.closures else {}
        ends = [frames[f] for closure in self.closures for f in closure.ends]
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
        return q_slice(self.model, j), v_slice(self.model, j)

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

    def with_parameters(self, values: Mapping[str, float] | None = None, /, **named: float) -> ClosedChain:
        """Return the same mechanism with other values of its named lengths and placements.

        Joints and frames go where the new values put them; bodies follow by their rules, and so do their boxes among
        the visuals; what a link carries beyond its rules stays where it is on the link. Named configurations
        (`references`) are kept as they are: they no longer close the loops, and are starts for `assemble`.

        Args:
            values: by name [m or rad]; for names that are no words of Python.
            named: the same as keywords.

        Raises:
            UnknownNameError: no such parameter; lists those there are.
            InvalidInputError: not a finite number, a length that is not positive, or a body cut down to nothing real.
        """
        if not isinstance(values, Mapping | None):
            raise InvalidInputError("parameters", values, "must map names to numbers, as {'crank': 0.1}")
        geometry = self.geometry.with_values({**(values or {}), **named})
        model, visuals = reshaped(self.model, self.visuals, geometry)
        return replace(self, model=model, visuals=visuals, geometry=geometry)

    def with_gravity(self, gravity: npt.ArrayLike) -> ClosedChain:
        """Return the same mechanism under another gravity (3,) [m/s2]."""
        model = self.model.copy()
        model.gravity.linear = np.array(checked("gravity", gravity, (3,)))
        return replace(self, model=model)

    def with_fixed_base(self, q: npt.ArrayLike | None = None) -> ClosedChain:
        """Return the same mechanism with what floats on the ground held where it stands.

        Args:
            q: configuration (nq,) that tells where; the first of `references` unless given, else the neutral one.

        Raises:
            InvalidInputError: nothing floats, or q of the wrong shape.
        """
        model = self.model
        floating = [j for j in range(1, model.njoints) if not model.parents[j] and model.nvs[j] == _FLOATING]
        if not floating:
            raise InvalidInputError("base", "fixed", "does not float: no joint of six degrees of freedom on the ground")
        stands = next(iter(self.references.values()), pin.neutral(model)) if q is None else q
        fixed = pin.buildReducedModel(model, floating, np.array(checked("q", stands, (self.nq,))))
        return replace(self, model=fixed)

    def with_actuated(self, actuated: Iterable[str]) -> ClosedChain:
        """Return the same mechanism driven at other joints."""
        return replace(self, actuated=all_of("actuated", actuated, str))

    def with_tolerance(self, closure_tolerance: float) -> ClosedChain:
        """Return the same mechanism with closures that may stay open by so much [m or rad]."""
        return replace(self, closure_tolerance=closure_tolerance)

    def with_springs(self, springs: Iterable[Spring | JointSpring]) -> ClosedChain:
        """Return the same mechanism with these springs in place of its own."""
        return replace(self, springs=checked_springs(self.model, springs))


def _inertia(joint: str, pi: Array) -> pin.Inertia:
    """Return ten parameters as an inertia; Pinocchio divides by the mass, which a massless body does not have."""
    if pi[0] != 0.0:
        return pin.Inertia.FromDynamicParameters(np.array(pi))
    if pi[1:4].any():
        raise InvalidInputError(
            f"first moment of the body of joint {joint}", pi[1:4].tolist(), "must be zero, as its mass"
        )
    I = np.array([[pi[4], pi[5], pi[7]], [pi[5], pi[6], pi[8]], [pi[7], pi[8], pi[9]]])
    try:
        return pin.Inertia(0.0, np.zeros(3), I)
    except RuntimeError as error:
        raise InvalidInputError(
            f"inertia of the body of joint {joint}",
            pi[4:].tolist(),
            "must have no negative moments where it has no mass",
        ) from error
