"""The globally optimal balanced design in one call."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy.typing as npt

from fivebar_pin.balancing.branches import Branch, branches, configurations_meant
from fivebar_pin.balancing.conditions import BalanceConditions, conditions_for
from fivebar_pin.balancing.design import Design
from fivebar_pin.balancing.objectives.weights import Minimised, weights_of
from fivebar_pin.balancing.pieces.piece import Piece
from fivebar_pin.balancing.problem import Limits, balance_problem
from fivebar_pin.balancing.regions.region import Region
from fivebar_pin.balancing.regressors.measures import Motions
from fivebar_pin.balancing.sampling import SpaceName
from fivebar_pin.balancing.solvers import DEFAULT
from fivebar_pin.balancing.variables.choice import aim_of
from fivebar_pin.balancing.variables.variable import MassBounds, Variable
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import SolverError

__all__ = ["balance"]


def balance(
    chain: ClosedChain,
    kind: str | None = "force",
    *,
    minimise: Minimised | None = None,
    bodies: Sequence[str] | None = None,
    mode: str = "add",
    region: Region | Mapping[str, Region] | None = None,
    masses: MassBounds = None,
    material: str | float | None = "steel",
    thickness: float | None = None,
    counterweight: Piece | Mapping[str, Piece] | None = None,
    remove: Sequence[str] = (),
    variables: Sequence[Variable] = (),
    motions: Motions = (),
    limits: Limits | None = None,
    gravity: npt.ArrayLike | Literal["any", "model"] = "any",
    about: npt.ArrayLike = (0.0, 0.0, 0.0),
    near: npt.ArrayLike | None = None,
    space: SpaceName = "auto",
    seed: int = 0,
    conditions: BalanceConditions | None = None,
    solver: str = DEFAULT,
) -> Design:
    """Find the globally optimal balanced design, or prove that there is none.

    Args:
        chain: the mechanism.
        kind: what is exact: "force", "moment", "dynamic", "static", or None for nothing.
        minimise: a term, or terms with weights, by name or as atoms of `objectives`: added_mass [kg], inertia (mean
            trace of N^T M N of the bodies, rotors apart) [kg m2], distance (to the present design, scaled) [-], and
            rms_, peak_ or mean_square_ of torque, shaking_force, shaking_moment, frame_force, frame_moment,
            bearing_force, angular_momentum (its deviation from the mean) over the motions: what `inverse_dynamics` of
            the design calls so, all components. The added mass unless given, for a redesign the distance.
        bodies: names of the joints whose bodies may change; all that influence the conditions unless given.
        mode: "add" material to the present bodies, or "redesign" them.
        region: where material may lie, one for all bodies or by body; a ball about the joint frame with the chain's
            characteristic length as radius unless given.
        masses: bounds (low, high) [kg] on the mass added to a body, or of a redesigned body; one for all or by body.
            A redesigned body keeps between half and twice its mass, and a body gets at most ten times the moving
            mass, unless given.
        material: no material is denser than this, added, removed or redesigned: a name of `MATERIALS`, a density
            [kg/m3], or None for points of mass. In the plane I_c >= m^2 / (2 pi density thickness) about the mass
            centre, in space det(S_c)^(1/3) >= k m^(5/3) (see `pieces`).
        thickness: of material in planar mechanisms [m]; a fifth of the chain's characteristic length unless given.
        counterweight: what the added material is made as, one kind for all bodies or by body: a `Disc` or a `Bar` in
            planar mechanisms, a `Sphere` in all. The whole piece lies in its region, and the arm that carries it is
            part of the design. See `realise`.
        remove: bodies that material may also be taken from, up to half of their mass; what is left is a body, in
            space too.
        variables: what may change, said in full, in place of mode, bodies, region, masses, material, counterweight and
            remove: see `variables`.
        motions: motions (driven from `near`) or trajectories that terms and limits refer to.
        limits: upper bounds on terms; "peak_torque" takes one for every motor too.
        gravity, about, near, space, seed: as for `balance_conditions`.
        conditions: of this mechanism and kind, with the same arguments, where they were found before; a sweep over
            bounds or objectives then finds them once.
        solver: "clarabel", or "scipy", which shares nothing with it and takes some fifty times as long. Where Clarabel
            has no acceptable answer, SciPy is asked before giving up.

    Returns:
        The design; ask its `feasible`, `chain`, `certificate`. Special lengths (antiparallelograms, kites) may leave no
        design for all assembly modes together, but one for a single branch. Then the design is for that branch,
        `design.branch` says which, and the certificate proves that none serves all of them. Where trajectories are
        given, or else the model has closed reference configurations, the design is for one of their branches or
        infeasible; other branches are listed as alternatives.

    Raises:
        UnknownNameError: a kind, body, term, mode or solver that does not exist.
        InvalidInputError: bounds that contradict themselves, bodies without influence, a mechanism that is not
            physical to begin with, terms without motions.
        SolverError: no solution to the tolerance and no proof either.
    """
    terms = weights_of(aim_of(mode, variables) if minimise is None else minimise)

    def solved(conditions: BalanceConditions | None, near: npt.ArrayLike | None) -> Design:
        problem = balance_problem(
            chain,
            kind,
            objectives=tuple(terms),
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
        return problem.solve(terms)

    if kind is None:
        return solved(conditions, near)
    conditions = conditions_for(
        chain, kind, conditions, gravity=gravity, about=about, near=near, space=space, seed=seed
    )
    if conditions.near is not None:
        return solved(conditions, conditions.near)
    together: Design | SolverError
    try:
        together = solved(conditions, None)
        if together.feasible:
            return together
    except SolverError as error:
        together = error
    named = configurations_meant(chain, motions)
    found = branches(chain, conditions, named=named, seed=seed, gravity=gravity, about=about)
    return _on_one_branch(together, found, solved, any_branch=not named)


def _on_one_branch(
    together: Design | SolverError,
    found: Sequence[Branch],
    solved: Callable[[BalanceConditions, npt.ArrayLike], Design],
    *,
    any_branch: bool,
) -> Design:
    """Return the best design for a single branch that is meant, or what became of all of them together."""
    possible = []
    for branch in found:
        try:
            design = solved(branch.conditions, branch.near)
        except SolverError:
            continue  # neither a design nor a proof there
        if design.feasible:
            possible.append((branch, design))
    others = tuple(branch.near for branch, _ in possible)
    meant = [design for branch, design in possible if branch.named or any_branch]
    if meant:
        best = min(meant, key=lambda design: design.objective)
        certificate = together.certificate if isinstance(together, Design) else None
        return replace(best, certificate=certificate, alternatives=others)
    if isinstance(together, SolverError):
        raise together
    return replace(together, alternatives=others)
