"""The objective of Alici and Shirinzadeh (2004), globally."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy.typing as npt

from fivebar_pin.balancing.balanced import balance
from fivebar_pin.balancing.conditions import BalanceConditions
from fivebar_pin.balancing.design import Design
from fivebar_pin.balancing.objectives.mean_square import MeanSquare
from fivebar_pin.balancing.pieces.piece import Piece
from fivebar_pin.balancing.problem import Limits
from fivebar_pin.balancing.regions.region import Region
from fivebar_pin.balancing.regressors.measures import Motions
from fivebar_pin.balancing.sampling import SpaceName
from fivebar_pin.balancing.solvers import DEFAULT
from fivebar_pin.balancing.variables.variable import MassBounds, Variable
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import UnknownNameError

__all__ = ["alici_shirinzadeh"]

_TERMS = ("bearing_force", "torque", "shaking_moment", "angular_momentum")  # whose mean squares are added


def alici_shirinzadeh(
    chain: ClosedChain,
    motions: Motions,
    *,
    weights: Mapping[str, float] | None = None,
    kind: str | None = "force",
    bodies: Sequence[str] | None = None,
    mode: str = "add",
    region: Region | Mapping[str, Region] | None = None,
    masses: MassBounds = None,
    material: str | float | None = "steel",
    thickness: float | None = None,
    counterweight: Piece | Mapping[str, Piece] | None = None,
    remove: Sequence[str] = (),
    variables: Sequence[Variable] = (),
    limits: Limits | None = None,
    gravity: npt.ArrayLike | Literal["any", "model"] = "any",
    about: npt.ArrayLike = (0.0, 0.0, 0.0),
    near: npt.ArrayLike | None = None,
    space: SpaceName = "auto",
    seed: int = 0,
    conditions: BalanceConditions | None = None,
    solver: str = DEFAULT,
) -> Design:
    """Minimise the objective of Alici and Shirinzadeh (2004) under the force balance equalities, globally.

    Theirs is the sum of squares of bearing forces, driving torques, shaking moment and deviation of the angular
    momentum from its mean over the motion, minimised by a general optimiser from a starting point. All four are linear
    in the inertial parameters, so it is one convex quadratic problem.

    Args:
        chain: the mechanism.
        motions: over which the mean squares are taken.
        weights: of bearing_force, torque, shaking_moment and angular_momentum; one each unless given.
        kind, bodies, mode, region, masses, material, thickness, counterweight, remove, variables, limits, gravity,
            about, near, space, seed, conditions, solver: as for `balance`.
    """
    given = dict.fromkeys(_TERMS, 1.0) if weights is None else dict(weights)
    for name in given:
        if name not in _TERMS:
            raise UnknownNameError("weight", name, _TERMS)
    return balance(
        chain,
        kind,
        minimise={MeanSquare(name): weight for name, weight in given.items()},
        bodies=bodies,
        mode=mode,
        region=region,
        masses=masses,
        material=material,
        thickness=thickness,
        counterweight=counterweight,
        remove=remove,
        variables=variables,
        motions=motions,
        limits=limits,
        gravity=gravity,
        about=about,
        near=near,
        space=space,
        seed=seed,
        conditions=conditions,
        solver=solver,
    )
