"""The mechanism that the variables of a problem belong to, in scaled parameters.

Lengths in chain lengths, masses in moving masses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array, Immutable
from fivebar_pin.balancing.conditions import BalanceConditions
from fivebar_pin.balancing.parameters import Space, pseudo_inertia
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["Setting"]

_FELT = 1e-9  # factor of a body in the conditions below which it has no influence [-, rows of length one]


@dataclass(frozen=True, slots=True, eq=False)
class Setting(Immutable):
    """A mechanism, its parameters and the conditions on them.

    Attributes:
        chain: the mechanism.
        space: the parameters that conditions and variables are written in.
        conditions: the balancing conditions, or None when nothing is exact.
        arms: inertial parameters (nb, 10) of the arms that carry counterweights, part of the present bodies.
    """

    chain: ClosedChain
    space: Space
    conditions: BalanceConditions | None
    arms: Array

    @property
    def mass(self) -> float:
        """Unit of mass [kg]."""
        return self.chain.mass or 1.0

    @property
    def unit(self) -> Array:
        """Unit of every parameter of the space (nb * width,)."""
        return np.asarray(self.space.scale * self.mass)

    def present(self) -> Array:
        """Return the present scaled parameters (nb, width), arms included."""
        x = self.space.of(self.chain.inertial_parameters + self.arms).reshape(-1) / self.unit
        return np.asarray(x.reshape(-1, self.space.width))

    def body(self, b: int) -> Array:
        """Return the scaled pseudo-inertia (4, 4) of a present body in the axes of the space, arms left out."""
        turn = np.eye(4)
        turn[:3, :3] = np.array(self.space.axes[b]) / self.space.length
        return np.asarray(turn @ pseudo_inertia(self.chain.inertial_parameters[b]) @ turn.T / self.mass)

    def named(self, names: Sequence[str], argument: str) -> list[int]:
        """Return the indices of named bodies.

        Raises:
            InvalidInputError: one name instead of a sequence of them.
            UnknownNameError: a body that there is not.
        """
        if isinstance(names, str):
            raise InvalidInputError(argument, names, "must be a sequence of names")
        for name in names:
            if name not in self.chain.joints:
                raise UnknownNameError("body", name, self.chain.joints)
        return sorted({self.chain.joints.index(name) for name in names})

    def chosen(self, bodies: Sequence[str] | None) -> list[int]:
        """Return the indices of the bodies that may change: those named, or all that influence the conditions.

        Raises:
            InvalidInputError: bodies without influence, or none at all.
            UnknownNameError: a body that there is not.
        """
        joints, kind = self.chain.joints, "given" if self.conditions is None else self.conditions.kind
        if bodies is None:
            found = [b for b in range(len(joints)) if self._influences(b)]
            if not found:
                raise InvalidInputError("bodies", list(joints), f"cannot influence the {kind} conditions")
            return found
        if isinstance(bodies, str) or not len(bodies):
            raise InvalidInputError("bodies", bodies, "must be a sequence of at least one name")
        found = self.named(bodies, "bodies")
        idle = [name for name in bodies if not self._influences(joints.index(name))]
        if idle:
            raise InvalidInputError("bodies", idle, f"cannot influence the {kind} conditions")
        return found

    def _influences(self, body: int) -> bool:
        if self.conditions is None:
            return True
        w = self.space.width
        return bool(np.abs(self.conditions.basis[:, body * w : (body + 1) * w]).max(initial=0.0) > _FELT)
