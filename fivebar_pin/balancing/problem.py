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
from typing import Literal

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, checked, frozen
from fivebar_pin.balancing import facial_reduction, lifting
from fivebar_pin.balancing.conditions import KINDS, BalanceConditions, conditions_for
from fivebar_pin.balancing.counterweight_search import Maker, Sizes
from fivebar_pin.balancing.design import PROVED, Asked, Design
from fivebar_pin.balancing.given import Given
from fivebar_pin.balancing.objectives.making import OVERREACH, TermMaker, overreach, weights_of
from fivebar_pin.balancing.objectives.term import Term, base, check_terms, measure_of, positive_limit
from fivebar_pin.balancing.parameters import Space
from fivebar_pin.balancing.pieces.piece import Piece, density_of, thickness_of
from fivebar_pin.balancing.regions.region import Region
from fivebar_pin.balancing.regressors.measures import MEASURES, Motions, Rows, measure, trajectories
from fivebar_pin.balancing.sampling import SpaceName, random_samples, space_of
from fivebar_pin.balancing.setting import MassBounds, Setup
from fivebar_pin.balancing.solvers import DEFAULT, SECOND, Block, Certificate, Outcome, Program, solve, solver_named
from fivebar_pin.balancing.solvers.cones import outside
from fivebar_pin.balancing.variables import sizes as variable_sizes
from fivebar_pin.balancing.variables.material import Material
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError, SolverError, UnknownNameError

__all__ = ["BalanceProblem", "balance_problem"]

_MARGINS = (1e-9, 1e-8, 1e-7, 1e-6)  # how far inside the cones a design is kept, as a share of the moving mass
_GIVE = ((1e-9, 1e-8), (1e-8, 1e-7))  # margin, and how far regions give way where nothing else is left, the same
_ROUGH = 1e-3  # residual of a rough answer, and gap that it may leave to the design without material [-]
_NEGLIGIBLE = 1e-7  # share of the moving mass that is not worth a piece of material
_EXACT = 1e-13  # residual of the conditions of a finished design [of its largest mass or the moving mass]
_FELT = 1e-9  # factor of an inertia that counts as zero in the conditions and terms of a scaled problem [-]
_PHYSICAL = 1e-12  # smallest eigenvalue of a pseudo-inertia that counts as zero [kg, kg m, kg m2]


@dataclass(frozen=True, slots=True, eq=False)
class _Task:
    """One objective over a problem: a program, its cost in units, what that stands for, and who solves it."""

    program: Program
    P: Array
    q: Array
    unit: float
    weights: Mapping[str, float]
    limits: tuple[Block, ...]
    solver: str

    def size(self, design: Design) -> float:
        """Return the size of the objective that gaps are measured by."""
        return max(abs(design.objective), self.unit)

    def solve(self, *, margin: float = 0.0, give: float = 0.0) -> Outcome:
        """Solve; where the default solver has no acceptable answer, the other one is asked before giving up."""
        try:
            return solve(self.program, self.P, self.q, margin=margin, give=give, solver=self.solver)
        except SolverError as error:
            if self.solver != DEFAULT or np.isnan(error.residual):
                raise
        return solve(self.program, self.P, self.q, margin=margin, give=give, solver=SECOND)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BalanceProblem(Immutable):
    """A balancing problem prepared once, to be solved for any weights of its objectives.

    Attributes:
        chain, kind, conditions: what is balanced.
        space: the parameters of the problem.
        mode: "add" or "redesign".
        materials: pieces of material that are variables.
        gone: for each of them, whether the conditions leave none of it.
        terms: objectives by base name.
        rows: quantities along the motions.
        limits: upper bounds, as given.
        E, X0: scaled parameters (nb * width,) = X0 + E y, y the variables (n,) of all materials.
        program: conditions, physical bodies, regions, bounds.
        fixed: rows (k, n + 1) of masses that are given exactly.
        limited: upper bounds on terms, part of the program.
        caps: bounds on added masses that have none of their own.
        mass: unit of mass [kg].
        sizes: bounds on the variables (n,) that follow from those on masses and the regions.
        near: configuration (nq,) of the one branch that is balanced, or None.
        given: what the problem was made from.
        arms: parameters (nb, 10) of the arms that carry counterweights, part of the present bodies.
        pieces: what the material added to a body is made as, by its index; empty for any material.
    """

    chain: ClosedChain
    kind: str | None
    conditions: BalanceConditions | None
    space: Space
    mode: str
    materials: tuple[Material, ...]
    gone: tuple[bool, ...]
    terms: dict[str, Term]
    rows: dict[str, Rows]
    limits: dict[str, npt.ArrayLike]
    E: Array = field(repr=False)  # scaled parameters = X0 + E y
    X0: Array = field(repr=False)
    program: Program = field(repr=False)
    fixed: Array = field(repr=False)
    limited: tuple[Block, ...] = field(repr=False)
    caps: tuple[Block, ...] = field(repr=False)
    mass: float
    sizes: Array = field(repr=False)
    near: Array | None
    given: Given = field(repr=False)
    arms: Array = field(repr=False)
    pieces: dict[int, Piece]

    @property
    def n(self) -> int:
        """Number of variables of the material."""
        return sum(m.size for m in self.materials)

    def size(self, objective: str) -> float:
        """Return the typical size of a prepared objective, in its own unit."""
        scale = self.terms[base(objective)].scale
        return scale * scale if objective.startswith("mean_square_") else scale

    def solve(
        self,
        minimise: str | Mapping[str, float],
        *,
        limits: Mapping[str, float] | None = None,
        solver: str | None = None,
    ) -> Design:
        """Solve for other weights, or further upper bounds, of the prepared objectives.

        Counterweights of a stated kind are found in steps that each give something that can be made.

        Args:
            minimise, limits: as for `balance`.
            solver: one of `solvers.SOLVERS`; the one the problem was prepared for unless given.

        Raises:
            UnknownNameError: an objective that was not prepared, or a solver that there is not.
            SolverError: no solution to the tolerance and no proof either.
        """
        weights = weights_of(minimise, self.mode)
        if solver is not None:
            solver_named(solver)
            return replace(self, given=replace(self.given, solver=solver)).solve(minimise, limits=limits)
        further = dict(limits or {})
        for name in (*weights, *further):
            if base(name) not in self.terms:
                raise UnknownNameError("prepared objective", name, self.terms)
        asked = Asked(self.given, weights, further)
        if not self.pieces:
            return replace(self._optimum(weights, further), asked=asked)

        def without(bodies: frozenset[int]) -> Given:
            return replace(self.given, bodies=tuple(b for b in self.given.bodies if b not in bodies))

        def solved(sizes: Sizes, arms: Array, left: frozenset[int]) -> Design:
            return assembled(without(left), sizes, arms)._optimum(weights, further)

        def fitted(sizes: Sizes, arms: Array, left: frozenset[int]) -> Design:
            return assembled(without(left), sizes, arms, elastic=True)._optimum({OVERREACH: 1.0}, further)

        rooms = {m.body: m.room * self.space.length for m in self.materials if m.sign > 0}
        design = Maker(self.chain, self.space, self.pieces, rooms, solved, fitted, self._objective(weights)[2]).search()
        named = {self.chain.joints[b]: piece for b, piece in self.pieces.items()}
        return replace(design, asked=asked, pieces=named)

    def _optimum(self, weights: Mapping[str, float], limits: Mapping[str, float]) -> Design:
        """Return the optimum, or the proof that there is none."""
        limited = [
            block for name, top in limits.items() for block in self.terms[base(name)].bounded(positive_limit(name, top))
        ]
        bounds = [*self.program.blocks, *limited]
        P, q, unit, epigraphs, sizes = self._objective(weights)
        program = Program(P.size, [*bounds, *self.caps, *epigraphs], sizes)
        asked = _Task(program, P, q, unit, weights, tuple(limited), self.given.solver)
        failure = SolverError("the problem was not solved")
        for solver in dict.fromkeys((asked.solver, SECOND)):
            try:
                return self._answer(replace(asked, solver=solver), bounds)
            except SolverError as error:
                if isinstance(error.__cause__, ImportError):  # a solver that is missing is to be installed
                    raise
                failure = error
        design = self._no_material(asked, bounds)
        if design is None:
            raise failure
        return design

    def _no_material(self, asked: _Task, bounds: Sequence[Block]) -> Design | None:
        """Return the design without any material, where it is one and a rough answer proves it all but optimal.

        Conditions can leave nothing else, at the apex of all cones, where no solver comes to an end.
        """
        if max((outside(b.cone, b.g) for b in bounds), default=0.0) > _EXACT:
            return None
        try:
            rough = solve(asked.program, asked.P, asked.q, tolerance=_ROUGH, solver=asked.solver)
        except SolverError:
            return None
        design, _ = self._finish(replace(rough, x=np.zeros(asked.P.size)), asked)
        near = design is not None and design.gap <= _ROUGH * asked.size(design)
        return _graded(design, asked) if design is not None and near else None

    def _answer(self, asked: _Task, bounds: Sequence[Block]) -> Design:
        """Return what one solver makes of it."""
        design = self._inside(asked)
        if design is not None:
            return self._closer(design, asked)
        outcome = asked.solve()
        if outcome.x is None:
            return self._infeasible(self._proof(bounds) or outcome.certificate)
        design, problem = self._finish(outcome, asked)
        return _graded(design or self._on_the_boundary(asked, problem), asked)

    def _closer(self, design: Design, asked: _Task) -> Design:
        """Return the better of two solvers' designs, with the better bound, where the first leaves a gap."""
        if design.gap > PROVED * asked.size(design) and asked.solver != SECOND:
            other = self._inside(replace(asked, solver=SECOND))
            if other is not None:
                below = max(design.dual_bound, other.dual_bound)
                design = replace(min(design, other, key=lambda d: d.objective), dual_bound=below)
        return _graded(design, asked)

    def _inside(self, asked: _Task) -> Design | None:
        """Return the design that is kept a hair inside the cones, by the least margin that makes it physical."""
        for margin in _MARGINS:
            try:
                outcome = asked.solve(margin=margin)
            except SolverError:
                return None  # to be tried on the boundary, where it says why if it fails again
            if outcome.x is None:
                return None
            design, _ = self._finish(outcome, asked)
            if design is not None:
                return design
        return None

    def _on_the_boundary(self, asked: _Task, problem: str) -> Design:
        """Return a design where bodies are points or sheets on the boundary of their regions, which give way by a hair.

        Raises:
            SolverError: there is none either.
        """
        for margin, give in _GIVE:
            outcome = asked.solve(margin=margin, give=give)
            if outcome.x is not None:
                design, problem = self._finish(outcome, asked)
                if design is not None:
                    return design
        raise SolverError(
            f"neither a design nor a proof that there is none: the closest one {problem}. It may exist only where "
            "bodies shrink to points, or only as a limit. Loosen the bounds or the regions."
        )

    def _proof(self, bounds: Sequence[Block]) -> Certificate | None:
        """Return a proof that does without the caps on masses, which says more, if there is one."""
        try:
            nothing = np.zeros(self.n)
            return solve(Program(self.n, bounds, self.sizes), nothing, nothing, solver=self.given.solver).certificate
        except SolverError:
            return None

    def _objective(self, weights: Mapping[str, float]) -> tuple[Array, Array, float, list[Block], Array]:
        """Return P, q over all variables, the unit they were divided by, the epigraphs of the terms that count, bounds.

        Every such term gets one variable after those of the material.
        """
        used = list(dict.fromkeys(base(name) for name, weight in weights.items() if weight > 0.0))
        P, q = np.zeros(self.n + len(used)), np.zeros(self.n + len(used))
        for name, weight in weights.items():
            if weight > 0.0:
                term = self.terms[base(name)]
                column = self.n + used.index(base(name))
                if name.startswith("mean_square_"):
                    P[column] += 2.0 * weight * term.scale**2
                else:
                    q[column] += weight * term.scale
        unit = float(max(P.max(initial=0.0), q.max(initial=0.0))) or 1.0
        blocks = [b for k, name in enumerate(used) for b in self.terms[name].epigraph(self.n + k)]
        sizes = np.concatenate([self.sizes, [self.terms[name].largest(self.sizes) for name in used]])
        return P / unit, q / unit, unit, blocks, sizes

    def _finish(self, outcome: Outcome, asked: _Task) -> tuple[Design | None, str]:
        """Make a solution exact and check it; None and the reason when it is not physical."""
        assert outcome.x is not None
        felt = self._felt(asked)
        x = self._compact(outcome.x[: self.n], felt)
        for drop in (_NEGLIGIBLE, 0.0):  # without what only keeps a body strictly physical, if that can be
            y, residual = self._exact(x, drop)
            y = self._compact(y, felt)  # again: inertias about centres that have moved a hair
            parts = lifting.lift(self, y)
            if residual <= _EXACT and parts.lowest >= -_PHYSICAL:
                break
        else:
            return None, (
                f"misses the conditions by {residual:.2g} ({_EXACT:g} is allowed) and its least physical body by "
                f"{max(0.0, -parts.lowest):.2g} ({_PHYSICAL:g})"
            )
        weights = asked.weights
        values = {name: self.terms[base(name)].measured(parts.parameters) for name in weights}
        squared = {k: v * v if k.startswith("mean_square_") else v for k, v in values.items()}
        objective = sum(weights[k] * squared[k] for k in weights)
        design = Design(
            status="optimal",
            original=self.chain,
            kind=self.kind,
            mode=self.mode,
            space=self.space,
            conditions=self.conditions,
            objective=objective,
            dual_bound=asked.unit * outcome.bound,
            terms=squared,
            parameters=frozen(parts.parameters),
            added=parts.added,
            removed=parts.removed,
            rows=self.rows,
            branch=self.near,
        )
        return design, ""

    def _felt(self, asked: _Task) -> npt.NDArray[np.bool_]:
        """Return which variables (n,) the conditions, the objective and the limits depend on."""
        rows = [b.G for b in (*self.limited, *asked.limits)]
        rows += [G for name in asked.weights for G, _ in self.terms[base(name)].vectors]
        if self.conditions is not None:
            rows.append(self.conditions.rows @ self.E)
        return np.asarray(np.max([np.abs(G).max(axis=0, initial=0.0) for G in rows], axis=0) > _FELT)

    def _compact(self, y: Array, felt: npt.NDArray[np.bool_]) -> Array:
        """Return the variables with the least inertia that a piece can have, where nothing depends on it."""
        y = np.array(y)
        for m in self.materials:
            own = slice(m.start, m.start + m.size)
            if m.sign > 0 and not felt[own][m.inertias].any():
                y[own] = m.compact(y[own])
        return y

    def _exact(self, y: Array, drop: float) -> tuple[Array, float]:
        """Move y onto the conditions by the smallest step, measured in shares of each body's own material.

        Args:
            y: variables (n,).
            drop: share of the moving mass below which material is left out altogether.

        Returns:
            The variables and the largest residual left, scaled.
        """
        B = np.zeros((0, self.X0.size)) if self.conditions is None else self.conditions.basis
        held = np.zeros(len(B)) if self.conditions is None else self.conditions.offset / self.mass
        A = np.concatenate([B @ self.E, self.fixed[:, :-1]])
        b = np.concatenate([B @ self.X0 + held, -self.fixed[:, -1]])
        mass = np.array([abs(float(y[m.start])) for m in self.materials])
        share = np.where((mass < drop) | np.array(self.gone), 0.0, np.maximum(mass, 1e-9))
        share = np.repeat(share, [m.size for m in self.materials])
        y = np.where(share > 0.0, y, 0.0)
        for _ in range(3 if A.size else 0):
            y = y - share * np.linalg.lstsq(A * share, A @ y + b, rcond=1e-10)[0]
        return y, float(np.abs(A @ y + b).max(initial=0.0)) / max(1.0, float(np.abs(y).max(initial=0.0)))

    def _infeasible(self, certificate: Certificate | None) -> Design:
        nothing = np.full_like(self.chain.inertial_parameters, np.nan)
        return Design(
            status="infeasible",
            original=self.chain,
            kind=self.kind,
            mode=self.mode,
            space=self.space,
            conditions=self.conditions,
            objective=float("inf"),
            dual_bound=float("inf"),
            terms={},
            parameters=frozen(nothing),
            certificate=certificate,
        )


def _graded(design: Design, asked: _Task) -> Design:
    """Call a design optimal where its bound says so."""
    return design if design.gap <= PROVED * asked.size(design) else replace(design, status="feasible")


def balance_problem(
    chain: ClosedChain,
    kind: str | None = "force",
    *,
    objectives: Sequence[str] = ("added_mass",),
    bodies: Sequence[str] | None = None,
    mode: Literal["add", "redesign"] = "add",
    region: Region | Mapping[str, Region] | None = None,
    masses: MassBounds = None,
    material: str | float | None = "steel",
    thickness: float | None = None,
    counterweight: Piece | Mapping[str, Piece] | None = None,
    remove: Sequence[str] = (),
    motions: Motions = (),
    limits: Mapping[str, npt.ArrayLike] | None = None,
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
    if mode not in ("add", "redesign"):
        raise UnknownNameError("mode", mode, ("add", "redesign"))
    solver_named(solver)
    check_terms(tuple(objectives), "objective")
    check_terms(dict(limits or {}), "limit")
    point = checked("about", about, (3,))
    if kind is not None:
        conditions = conditions_for(
            chain, kind, conditions, gravity=gravity, about=about, near=near, space=space, seed=seed
        )
        own, near = conditions.space, conditions.near
    elif conditions is not None:
        raise InvalidInputError("conditions", conditions, "have no meaning where kind is None")
    else:
        own = space_of(chain, random_samples(chain, 50, near=near, seed=seed), space)
    nothing = np.zeros((len(chain.joints), 10))
    setup = Setup(chain, own, conditions, mode, nothing)
    setup.check_physical()
    chosen, removable = setup.chosen(bodies), setup.removable(remove)
    paths = trajectories(chain, motions, near)
    wanted = {measure_of(t) for t in (*objectives, *(limits or {}))} - {None}
    if paths:
        wanted |= {"torque", "shaking_force", "shaking_moment"}
        if chain.model.gravity.linear.any():
            wanted |= {"frame_force", "frame_moment"}
    rows = {m: measure(chain, paths, m, about=point) for m in MEASURES if m in wanted}
    given = Given(
        chain=chain,
        kind=kind,
        conditions=conditions,
        space=own,
        mode=mode,
        objectives=tuple(dict.fromkeys(base(t) for t in objectives)),
        bodies=tuple(chosen),
        removable=tuple(removable),
        region=region,
        masses=masses,
        counterweight=counterweight,
        density=stuff(chain, material, thickness),
        limits=dict(limits or {}),
        paths=paths,
        rows=rows,
        near=None if near is None else checked("near", near, (chain.nq,)),
        solver=solver,
    )
    return assembled(given)


def stuff(chain: ClosedChain, material: str | float | None, thickness: float | None) -> tuple[float, float] | None:
    """Return density [kg/m3] and thickness [m] of the material, or None for any density."""
    thick = thickness_of(thickness, chain.length)
    return None if material is None else (density_of(material), thick)


def assembled(
    given: Given, sizes: Sizes | None = None, arms: Array | None = None, *, elastic: bool = False
) -> BalanceProblem:
    """Put the problem together.

    Args:
        given: what it is made from.
        sizes: by index of the body, about which its counterweight is bounded in size from above; from below without.
        arms: inertial parameters (nb, 10) of arms that are part of the bodies; none unless given.
        elastic: whether counterweights may stick out of their regions, which then is a term that can be minimised.
    """
    chain, space = given.chain, given.space
    arms = np.zeros((len(chain.joints), 10)) if arms is None else arms
    setup = Setup(chain, space, given.conditions, given.mode, arms)
    materials = setup.materials(
        given.bodies, given.removable, given.region, given.counterweight, given.density, sizes or {}, elastic=elastic
    )
    E, X0 = setup.map(materials)
    full_E = lifting.linear(chain, space, setup.mass, materials)
    present = chain.inertial_parameters + arms
    if given.mode == "redesign":
        present[[m.body for m in materials]] = 0.0
    full_0 = present.reshape(-1)
    n = E.shape[1]
    maker = TermMaker(chain, setup, dict(given.rows), given.paths, E, X0, full_E, full_0)
    terms = {name: maker.make(name) for name in given.objectives}
    if elastic:
        terms[OVERREACH] = overreach(materials, n)
    limited = maker.limits(given.limits)
    blocks, caps = setup.constraints(materials, E, X0, given.masses), tuple(setup.caps(materials, given.masses, n))
    gone = facial_reduction.empty(blocks, materials, n)
    return BalanceProblem(
        chain=chain,
        kind=given.kind,
        conditions=given.conditions,
        space=space,
        mode=given.mode,
        materials=tuple(materials),
        gone=gone,
        terms=terms,
        rows=dict(given.rows),
        limits=dict(given.limits),
        E=frozen(E),
        X0=frozen(X0),
        program=Program(n, facial_reduction.without([*blocks, *limited], materials, gone, n)),
        fixed=frozen(setup.fixed(materials, given.masses, n)),
        limited=tuple(limited),
        caps=caps,
        mass=setup.mass,
        sizes=frozen(variable_sizes.extents(materials, gone, [*blocks, *caps], n)),
        near=given.near,
        given=given,
        arms=frozen(arms),
        pieces={b: piece for b in given.bodies if (piece := setup.piece(b, given.counterweight)) is not None},
    )
