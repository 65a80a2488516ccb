"""Material added to one body, removed from it, or the body as redesigned."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array, Immutable

__all__ = ["Change", "change_of"]


@dataclass(frozen=True, slots=True, eq=False)
class Change(Immutable):
    """Material added to one body (or removed from it, or the body as redesigned).

    Attributes:
        body: name of the body's joint.
        mass: [kg].
        place: its centre of mass in joint axes (3,) [m]; zero without mass.
        inertia: about its centre of mass, joint axes (3, 3) [kg m2].
        parameters: the ten inertial parameters about the joint origin.
    """

    body: str
    mass: float
    place: Array
    inertia: Array
    parameters: Array


def change_of(body: str, pi: Array) -> Change:
    """Describe ten inertial parameters as a body."""
    if pi[0] <= 0.0:
        return Change(body, float(pi[0]), np.zeros(3), np.zeros((3, 3)), pi)
    inertia = pin.Inertia.FromDynamicParameters(pi)
    return Change(body, float(pi[0]), np.array(inertia.lever), np.array(inertia.inertia), pi)
