"""Balancing as one convex problem: what may change, what is exact, what is minimised, what is bounded.

With x the parameters of the mechanism and delta, rho the material added and removed,

    x = x_0 + delta - rho,     delta, rho, x_0 - rho physical, delta and rho within their regions
    B x + b = 0                the balancing conditions, b = 0 without springs

or x itself physical, within its region and within mass bounds (redesign). Every term of the objective is linear in x
or a length of a vector linear in x, so the problem is a conic one: its optimum is global, its dual bounds it from
below, and if there is no design a certificate proves it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, checked, frozen
from fivebar_pin.balancing.conditions import KINDS, BalanceConditions, conditions_for
from fivebar_pin.balancing.conic import ConicForm, conic_form
from fivebar_pin.balancing.counterweight_search import CounterweightSearch
from fivebar_pin.balancing.design import Asked, Design
from fivebar_pin.balancing.objectives.objective import Objective, named, positive_limit
from fivebar_pin.balancing.objectives.overreach import Overreach
from fivebar_pin.balancing.objectives.weights import Minimised, weights_of
from fivebar_pin.balancing.parameters import Space
from fivebar_pin.balancing.pieces.materials import density_of, thickness_of
from fivebar_pin.balancing.pieces.piece import Piece
from fivebar_pin.balancing.pieces.trial import Trial
from fivebar_pin.balancing.regions.region import Region
from fivebar_pin.balancing.regions.shape import Shape
from fivebar_pin.balancing.regressors.measures import Measurement, Motions, measure, trajectories
from fivebar_pin.balancing.regressors.regressor import MEASURES
from fivebar_pin.balancing.sampling import SpaceName, random_samples, space_of
from fivebar_pin.balancing.setting import Setting
from fivebar_pin.balancing.solve import Question, optimum
from fivebar_pin.balancing.solvers import DEFAULT, solver_named
from fivebar_pin.balancing.variables.choice import chosen
from fivebar_pin.balancing.variables.variable import MassBounds, Stated, Variable
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.trajectory import Trajectory

__all__ = ["BalanceProblem", "Limits", "balance_problem"]

Limits = Mapping[Any, npt.ArrayLike]  # keys are names or atoms
_SAMPLES = 50  # configurations that tell whether a mechanism is planar, where there are no conditions
_SHOWN = ("torque", "shaking_force", "shaking_moment")  # what a design is always measured by along motions
_SHOWN_WITH_WEIGHT = ("frame_force", "frame_moment")  # the same where gravity acts


@dataclass(frozen=True, eq=False, repr=False)
class BalanceProblem(Immutable):
    """A balancing problem prepared once, to be solved for any weights of its objectives.

    Attributes:
        chain, kind, conditions: what is balanced.
        space: the parameters of the problem.
        mode: the word for what may change.
        variables: what may change.
        objectives: the atoms that are prepared.
        limits: upper bounds on atoms.
        measurement: quantities along the motions.
        density: of the material [kg/m3] and its thickness in the plane [m], or None for any.
        near: configuration (nq,) of the one branch that is balanced, or None.
        solver: name of the solver.
    """

    chain: ClosedChain
    kind: str | None
    conditions: BalanceConditions | None
    space: Space
    mode: str
    variables: tuple[Variable, ...]
    objectives: tuple[Objective, ...]
    limits: Mapping[Objective, npt.ArrayLike]
    measurement: Measurement = field(repr=False)
    density: tuple[float, float] | None
    near: Array | None
    solver: str

    def __repr__(self) -> str:
        names = ", ".join(atom.name for atom in self.objectives)
        return f"BalanceProblem({self.chain.name!r}, {self.kind}, {self.mode}: {names})"

    @property
    def n(self) -> int:
        """Number of variables."""
        return self.form.n

    @cached_property
    def form(self) -> ConicForm:
        """The problem as a conic program."""
        return self._form(Trial(), np.zeros((len(self.chain.joints), 10)))

    def size(self, objective: str | Objective) -> float:
        """Return the typical size of a prepared objective, in its own unit."""
        atom = named(objective, "objective")
        scale = self.form.terms[atom.root].scale
        return scale * scale if atom.squared else scale

    def solve(
        self,
        minimise: Minimised,
        *,
        limits: Mapping[Any, float] | None = None,
        solver: str | None = None,
    ) -> Design:
        """Solve for other weights, or further upper bounds, of the prepared objectives.

        Counterweights of a stated kind are found in steps that each give something that can be made.

        Args:
            minimise, limits: as for `balance`; a limit is one number.
            solver: name of a solver; the one the problem was prepared for unless given.

        Raises:
            UnknownNameError: an objective that was not prepared, or a solver that there is not.
            SolverError: no solution to the tolerance and no proof either.
        """
        weights = weights_of(minimise)
        asked_of = self if solver is None else replace(self, solver=_checked_solver(solver))
        further = {named(name, "limit"): float(top) for name, top in (limits or {}).items()}
        for atom in (*weights, *further):
            if atom.root not in self.form.terms:
                raise UnknownNameError("prepared objective", atom.name, [root.name for root in self.form.terms])
        asked = Asked(asked_of, weights, further)
        pieces = self._pieces()
        if not pieces:
            return replace(self._optimum(self.form, asked, weights), asked=asked)
        design = self._search(pieces, asked).search()
        return replace(design, asked=asked, pieces={self.chain.joints[b]: piece for b, piece in pieces.items()})

    def in_pieces(self, pieces: Mapping[str, Piece]) -> BalanceProblem:
        """Return the same problem for counterweights of stated kinds, by joint."""
        return replace(self, variables=tuple(v.in_pieces(pieces) for v in self.variables))

    def shape(self, b: int) -> Shape | None:
        """Return where material added to a body may lie, in chain lengths; None where none is added."""
        shapes = (v.shape(self.form.setting, b) for v in self.variables)
        return next((shape for shape in shapes if shape is not None), None)

    def _pieces(self) -> dict[int, Piece]:
        """Return what the material added to a body is made as, by its index."""
        return {b: piece for v in self.variables for b, piece in v.pieces(self.form.setting).items()}

    def _form(self, trial: Trial, arms: Array) -> ConicForm:
        """Return the program for one step of the search for counterweights, with their arms (nb, 10)."""
        setting = Setting(self.chain, self.space, self.conditions, arms)
        atoms = (*self.objectives, Overreach()) if trial.elastic else self.objectives
        return conic_form(setting, [v.tried(trial) for v in self.variables], atoms, self.limits, self.measurement)

    def _search(self, pieces: Mapping[int, Piece], asked: Asked) -> CounterweightSearch:
        def solved(trial: Trial, arms: Array) -> Design:
            weights: Mapping[Objective, float] = {Overreach(): 1.0} if trial.elastic else asked.minimise
            return self._optimum(self._form(trial, arms), asked, weights)

        rooms = {b: shape.room * self.space.length for b in pieces if (shape := self.shape(b)) is not None}
        unit = self.form.cost(asked.minimise).unit
        return CounterweightSearch(self.chain, self.space, pieces, rooms, solved, unit)

    def _optimum(self, form: ConicForm, asked: Asked, weights: Mapping[Objective, float]) -> Design:
        """Return the optimum of a program, or the proof that there is none."""
        bounds = [
            block
            for atom, top in asked.limits.items()
            for block in form.terms[atom.root].bounded(atom.rooted(positive_limit(atom.name, top)))
        ]
        nothing = Design(
            status="infeasible",
            original=self.chain,
            kind=self.kind,
            mode=self.mode,
            space=self.space,
            conditions=self.conditions,
            objective=float("inf"),
            dual_bound=float("inf"),
            terms={},
            parameters=frozen(np.full_like(self.chain.inertial_parameters, np.nan)),
        )
        assert isinstance(asked.problem, BalanceProblem)
        return optimum(Question(form, weights, tuple(bounds), asked.problem.solver, nothing, self.near))


def _checked_solver(name: str) -> str:
    solver_named(name)
    return name


def balance_problem(
    chain: ClosedChain,
    kind: str | None = "force",
    *,
    objectives: Sequence[str | Objective] = ("added_mass",),
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
) -> BalanceProblem:
    """Prepare a balancing problem for several objectives; arguments as for `balance`."""
    if kind is not None and kind not in KINDS:
        raise UnknownNameError("kind of balance", kind, KINDS)
    _checked_solver(solver)
    atoms = tuple(dict.fromkeys(named(name, "objective") for name in objectives))
    bounded = {named(name, "limit"): top for name, top in (limits or {}).items()}
    point = checked("about", about, (3,))
    density = None if material is None else (density_of(material), thickness_of(thickness, chain.length))
    stated = Stated(bodies, region, masses, counterweight, remove, density)
    word, wanted = chosen(mode, stated, variables)
    if kind is not None:
        conditions = conditions_for(
            chain, kind, conditions, gravity=gravity, about=about, near=near, space=space, seed=seed
        )
        own, near = conditions.space, conditions.near
    elif conditions is not None:
        raise InvalidInputError("conditions", conditions, "have no meaning where kind is None")
    else:
        own = space_of(chain, random_samples(chain, _SAMPLES, near=near, seed=seed), space)
    problem = BalanceProblem(
        chain=chain,
        kind=kind,
        conditions=conditions,
        space=own,
        mode=word,
        variables=wanted,
        objectives=atoms,
        limits=bounded,
        measurement=_measurement(chain, own, trajectories(chain, motions, near), (*atoms, *bounded), point),
        density=None if variables else density,
        near=None if near is None else checked("near", near, (chain.nq,)),
        solver=solver,
    )
    _ = problem.form  # refuses what makes no program
    return problem


def _measurement(
    chain: ClosedChain, space: Space, paths: Sequence[Trajectory], atoms: Sequence[Objective], about: Array
) -> Measurement:
    """Measure what atoms refer to, and what designs are always measured by."""
    wanted = {atom.quantity for atom in atoms} - {None}
    if paths:
        wanted |= set(_SHOWN)
        if chain.model.gravity.linear.any():
            wanted |= set(_SHOWN_WITH_WEIGHT)
    rows = {name: measure(chain, paths, name, about=about) for name in MEASURES if name in wanted}
    return Measurement(chain, space, tuple(paths), rows)
