"""The globally optimal balanced design in one call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy.typing as npt

from fivebar_pin.balancing._objective import weights_of
from fivebar_pin.balancing._sampling import SpaceName
from fivebar_pin.balancing._setup import MassBounds
from fivebar_pin.balancing.branches import branches
from fivebar_pin.balancing.design import Design
from fivebar_pin.balancing.problem import Motions, balance_problem
from fivebar_pin.balancing.regions import Disc, Region
from fivebar_pin.chain import ClosedChain

__all__ = ["balance"]


def balance(
    chain: ClosedChain,
    kind: str | None = "force",
    *,
    minimise: str | Mapping[str, float] | None = None,
    bodies: Sequence[str] | None = None,
    mode: Literal["add", "redesign"] = "add",
    region: Region | Mapping[str, Region] | None = None,
    masses: MassBounds = None,
    counterweight: Disc | Mapping[str, Disc] | None = None,
    remove: Sequence[str] = (),
    motions: Motions = (),
    limits: Mapping[str, npt.ArrayLike] | None = None,
    gravity: npt.ArrayLike | Literal["any", "model"] = "any",
    about: npt.ArrayLike = (0.0, 0.0, 0.0),
    near: npt.ArrayLike | None = None,
    space: SpaceName = "auto",
    seed: int = 0,
) -> Design:
    """Find the globally optimal balanced design, or prove that there is none.

    Args:
        chain: the mechanism.
        kind: what is exact: "force", "moment", "dynamic", "static", or None for nothing.
        minimise: a term, or terms with weights: added_mass [kg], inertia (mean trace of N^T M N) [kg m2], distance (to
            the present design, scaled) [-], and rms_, peak_ or mean_square_ of torque, shaking_force, shaking_moment,
            bearing_force, angular_momentum (its deviation from the mean) over the motions. The added mass unless
            given, for a redesign the distance.
        bodies: names of the joints whose bodies may change; all that influence the conditions unless given.
        mode: "add" material to the present bodies, or "redesign" them.
        region: where material may lie, one for all bodies or by body; a ball about the joint frame with the chain's
            characteristic length as radius unless given.
        masses: bounds (low, high) [kg] on the mass added to a body, or of a redesigned body; one for all or by body.
            A redesigned body keeps between half and twice its mass, and a body gets at most ten times the moving
            mass, unless given.
        counterweight: discs that the added material must be makeable as, one kind for all bodies or by body; planar
            mechanisms only. See `realise`.
        remove: bodies that material may also be taken from, up to half of their mass.
        motions: motions (driven from `near`) or trajectories that terms and limits refer to.
        limits: upper bounds on terms; "peak_torque" takes one for every motor too.
        gravity, about, near, space, seed: as for `balance_conditions`.

    Returns:
        The design; ask its `feasible`, `chain`, `certificate`.

    Raises:
        UnknownNameError: a kind, body, term or mode that does not exist.
        InvalidInputError: bounds that contradict themselves, bodies without influence, a mechanism that is not
            physical to begin with, terms without motions.
        SolverError: no solution to the tolerance and no proof either.
    """
    terms = weights_of(minimise, mode)

    def solved(near: npt.ArrayLike | None) -> Design:
        problem = balance_problem(
            chain,
            kind,
            objectives=tuple(terms),
            bodies=bodies,
            mode=mode,
            region=region,
            masses=masses,
            counterweight=counterweight,
            remove=remove,
            motions=motions,
            limits=limits,
            gravity=gravity,
            about=about,
            near=near,
            space=space,
            seed=seed,
        )
        return problem.solve(terms)

    design = solved(near)
    if design.feasible or design.conditions is None or near is not None:
        return design
    found = [b.near for b in branches(chain, design.conditions, seed=seed, gravity=gravity, about=about)]
    return replace(design, alternatives=tuple(q for q in found if solved(q).feasible))
