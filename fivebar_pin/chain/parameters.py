"""Named lengths and placements of a chain, and how joints, frames and bodies follow them.

A joint's placement on its parent's link, or a frame's on its joint's, is a product of exponentials of named numbers,

    M = base exp(x_1 s_1) exp(x_2 s_2) ...,     s = (translation, rotation) per unit of the parameter

which covers lengths (translations along a direction) and angles (rotations about one). Bodies follow their frames by
rules (`fivebar_pin.chain.bodies`). It is data alone: a chain with named parameters is a chain like any other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, Immutable, all_of, checked, number, skew
from fivebar_pin.chain.bodies import Body
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["Geometry", "Placement"]

_RIGID = 1e-9
"""How far a rotation may be from orthonormal: written with ten digits and read back [-]."""


@dataclass(frozen=True, slots=True, eq=False)
class Placement(Immutable):
    """How parameters place a joint on its parent's link, or a frame on its joint's.

    Attributes:
        name: of the joint, or of the frame where no joint is called so.
        moves: parameter and twist (6,), linear before angular, per unit of it [-, or rad/m and so on], in order.
        base: pose (4, 4) before the first.
    """

    name: str
    moves: tuple[tuple[str, Array], ...]
    base: npt.ArrayLike = field(default_factory=lambda: np.eye(4))

    def __post_init__(self) -> None:
        what = f"placement of {self.name}"
        if not all(isinstance(move, tuple | list) and len(move) == 2 for move in self.moves):
            raise InvalidInputError(f"moves of the {what}", self.moves, "must be pairs of a parameter and its twist")
        moves = tuple((str(name), checked(f"twist of {name} in the {what}", twist, (6,))) for name, twist in self.moves)
        object.__setattr__(self, "moves", moves)
        base = checked(f"base of the {what}", self.base, (4, 4))
        R = base[:3, :3]
        if np.abs(R.T @ R - np.eye(3)).max() > _RIGID or np.linalg.det(R) < 0.0 or (base[3] != np.eye(4)[3]).any():
            raise InvalidInputError(f"base of the {what}", base.tolist(), "must be a rotation and a translation")
        object.__setattr__(self, "base", base)

    def at(self, values: Mapping[str, float]) -> pin.SE3:
        """Return the pose for values of the parameters."""
        return pin.SE3(self.poses({name: np.array([values[name]]) for name, _ in self.moves})[0])

    def poses(self, values: Mapping[str, Array]) -> Array:
        """Return the poses (n, 4, 4) for n designs, values (n,) of the parameters; one pose where none moves it."""
        M = np.asarray(self.base)[None]
        for name, twist in self.moves:
            M = np.matmul(M, _exponentials(twist, values[name]))
        return np.array(M)


def _exponentials(twist: Array, x: Array) -> Array:
    """Return exp(x s) of a twist s for numbers x (n,): (n, 4, 4) [Murray, Li and Sastry 1994, (2.36)].

    R = 1 + sin θ K + (1 - cos θ) K^2,     p = (θ + (1 - cos θ) K + (θ - sin θ) K^2) v,     K = [w]×
    """
    M = np.tile(np.eye(4), (x.size, 1, 1))
    v, w = twist[:3], twist[3:]
    rate = float(np.linalg.norm(w))
    if rate == 0.0:
        M[:, :3, 3] = x[:, None] * v
        return M
    K, angle = skew(w / rate), (rate * x)[:, None, None]
    c, s, versed = np.cos(angle), np.sin(angle), 2.0 * np.sin(0.5 * angle) ** 2  # exact where it hardly turns, too
    M[:, :3, :3] = c * np.eye(3) + s * K + versed * np.outer(w, w) / rate**2
    M[:, :3, 3] = np.matmul(angle * np.eye(3) + versed * K + (angle - s) * (K @ K), v / rate)
    return M


@dataclass(frozen=True, slots=True, eq=False)
class Geometry(Immutable):
    """The named parameters of a chain and what follows them.

    Attributes:
        parameters: value by name [m or rad]; read-only.
        placements: of joints and frames, each named once.
        bodies: rules of what the links are made of; the model's inertias hold them already, and what a link carries
            beside them stays in place on it.
        lengths: names of parameters that have to stay positive: a bar would turn over.
    """

    parameters: Mapping[str, float] = field(default_factory=dict)
    placements: tuple[Placement, ...] = ()
    bodies: tuple[Body, ...] = ()
    lengths: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        values = {str(name): number(f"parameter {name}", value) for name, value in dict(self.parameters).items()}
        object.__setattr__(self, "parameters", MappingProxyType(values))
        for name, kind in (("placements", Placement), ("bodies", Body), ("lengths", str)):
            object.__setattr__(self, name, all_of(name, getattr(self, name), kind))
        for used in (*self.lengths, *(name for placement in self.placements for name, _ in placement.moves)):
            if used not in values:
                raise UnknownNameError("parameter", used, values)
        placed = [placement.name for placement in self.placements]
        if len(set(placed)) < len(placed):
            raise InvalidInputError("placements", placed, "must name each joint or frame once")
        for name in self.lengths:
            if values[name] <= 0.0:
                raise InvalidInputError(f"length {name}", values[name], "must be positive [m]: the bar would turn over")

    def with_values(self, values: Mapping[str, float]) -> Geometry:
        """Return the same with other values for the named parameters.

        Raises:
            UnknownNameError: no such parameter; lists those there are.
            InvalidInputError: not a finite number, or a length that is not positive.
        """
        for name in values:
            if name not in self.parameters:
                raise UnknownNameError("parameter", name, self.parameters)
        return replace(self, parameters={**self.parameters, **values})

    def poses(self) -> dict[str, pin.SE3]:
        """Return the pose of every joint and frame that is placed by parameters."""
        return {placement.name: placement.at(self.parameters) for placement in self.placements}
