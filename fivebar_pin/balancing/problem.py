"""Balancing as one convex problem: what may change, what is exact, what is minimised, what is bounded.

With x the parameters of the mechanism and delta, rho the material added and removed,

    x = x_0 + delta - rho,     delta, rho, x_0 - rho physical, delta and rho within their regions
    B x = 0                    the balancing conditions

or x itself physical, within its region and within mass bounds (redesign). Every term of the objective is linear in x
or a length of a vector linear in x, so the problem is a conic one: its optimum is global, its dual bounds it from
below, and if there is no design a certificate proves it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, frozen
from fivebar_pin.balancing import _empty, _lift
from fivebar_pin.balancing._material import Material
from fivebar_pin.balancing._objective import TermMaker, weights_of
from fivebar_pin.balancing._parameters import Space
from fivebar_pin.balancing._quantities import MEASURES, Motions, Rows, measure, trajectories
from fivebar_pin.balancing._sampling import SpaceName, random_samples, space_of
from fivebar_pin.balancing._setup import MassBounds, Setup
from fivebar_pin.balancing._terms import Term, base, check_terms, measure_of, positive_limit
from fivebar_pin.balancing.conditions import KINDS, BalanceConditions, balance_conditions
from fivebar_pin.balancing.design import Design
from fivebar_pin.balancing.regions import Disc, Region
from fivebar_pin.balancing.solvers import DEFAULT, SECOND, Block, Certificate, Outcome, Program, solve, solver_named
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import SolverError, UnknownNameError

__all__ = ["BalanceProblem", "balance_problem"]

_MARGINS = (1e-9, 1e-8, 1e-7, 1e-6)  # how far inside the cones a design is kept, as a share of the moving mass
_GIVE = ((1e-9, 1e-8), (1e-8, 1e-7))  # margin, and how far regions give way where nothing else is left, the same
_NEGLIGIBLE = 1e-7  # share of the moving mass that is not worth a piece of material
_EXACT = 1e-13  # residual of the conditions of a finished design [of its largest mass or the moving mass]
_PHYSICAL = 1e-12  # smallest eigenvalue of a pseudo-inertia that counts as zero [kg, kg m, kg m2]


@dataclass(frozen=True, slots=True, eq=False)
class _Asked:
    """One objective over a problem: a program, its cost in units, what that stands for, and who solves it."""

    program: Program
    P: Array
    q: Array
    unit: float
    weights: Mapping[str, float]
    solver: str

    def solve(self, *, margin: float = 0.0, give: float = 0.0) -> Outcome:
        """Solve; where the default solver has no acceptable answer, the other one is asked before giving up."""
        try:
            return solve(self.program, self.P, self.q, margin=margin, give=give, solver=self.solver)
        except SolverError as error:
            if self.solver != DEFAULT or np.isnan(error.residual):
                raise
        return solve(self.program, self.P, self.q, margin=margin, give=give, solver=SECOND)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BalanceProblem:
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
        caps: bounds on added masses that have none of their own.
        mass: unit of mass [kg].
        sizes: bounds on the variables (n,) that follow from those on masses and the regions.
        near: configuration (nq,) of the one branch that is balanced, or None.
        solver: name of the solver.
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
    caps: tuple[Block, ...] = field(repr=False)
    mass: float
    sizes: Array = field(repr=False)
    near: Array | None
    solver: str = DEFAULT

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

        Args:
            minimise, limits: as for `balance`.
            solver: one of `solvers.SOLVERS`; the one the problem was prepared for unless given.

        Raises:
            UnknownNameError: an objective that was not prepared, or a solver that there is not.
            SolverError: no solution to the tolerance and no proof either.
        """
        weights = weights_of(minimise, self.mode)
        solver = solver or self.solver
        for name in (*weights, *(limits or {})):
            if base(name) not in self.terms:
                raise UnknownNameError("prepared objective", name, self.terms)
        limited = [
            block
            for name, top in (limits or {}).items()
            for block in self.terms[base(name)].bounded(positive_limit(name, top))
        ]
        bounds = [*self.program.blocks, *limited]
        P, q, unit, epigraphs, sizes = self._objective(weights)
        program = Program(P.size, [*bounds, *self.caps, *epigraphs], sizes)
        asked = _Asked(program, P, q, unit, weights, solver)
        design = self._inside(asked)
        if design is not None:
            return design
        outcome = asked.solve()
        if outcome.x is None:
            return self._infeasible(self._proof(bounds, solver) or outcome.certificate)
        design, problem = self._finish(outcome, asked)
        return design or self._on_the_boundary(asked, problem)

    def _inside(self, asked: _Asked) -> Design | None:
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

    def _on_the_boundary(self, asked: _Asked, problem: str) -> Design:
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

    def _proof(self, bounds: Sequence[Block], solver: str) -> Certificate | None:
        """Return a proof that does without the caps on masses, which says more, if there is one."""
        try:
            nothing = np.zeros(self.n)
            return solve(Program(self.n, bounds, self.sizes), nothing, nothing, solver=solver).certificate
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

    def _finish(self, outcome: Outcome, asked: _Asked) -> tuple[Design | None, str]:
        """Make a solution exact and check it; None and the reason when it is not physical."""
        assert outcome.x is not None
        for drop in (_NEGLIGIBLE, 0.0):  # without what only keeps a body strictly physical, if that can be
            y, residual = self._exact(outcome.x[: self.n], drop)
            parts = _lift.lift(self, y)
            if residual <= _EXACT and parts.lowest >= -_PHYSICAL:
                break
        else:
            return None, (
                f"misses the conditions by {residual:.2g} ({_EXACT:g} is allowed) and its least physical body by "
                f"{max(0.0, -parts.lowest):.2g} ({_PHYSICAL:g})"
            )
        weights = asked.weights
        values = {name: self.terms[base(name)].value(y) for name in weights}
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

    def _exact(self, y: Array, drop: float) -> tuple[Array, float]:
        """Move y onto the conditions by the smallest step, measured in shares of each body's own material.

        Args:
            y: variables (n,).
            drop: share of the moving mass below which material is left out altogether.

        Returns:
            The variables and the largest residual left, scaled.
        """
        B = np.zeros((0, self.X0.size)) if self.conditions is None else self.conditions.basis
        A = np.concatenate([B @ self.E, self.fixed[:, :-1]])
        b = np.concatenate([B @ self.X0, -self.fixed[:, -1]])
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


def balance_problem(
    chain: ClosedChain,
    kind: str | None = "force",
    *,
    objectives: Sequence[str] = ("added_mass",),
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
    conditions, own = None, None
    if kind is not None:
        conditions = balance_conditions(chain, kind, gravity=gravity, about=about, near=near, space=space, seed=seed)
        own = conditions.space
    else:
        own = space_of(chain, random_samples(chain, 50, near=near, seed=seed), space)
    setup = Setup(chain, own, conditions, mode)
    setup.check_physical()
    materials = setup.materials(setup.chosen(bodies), region, setup.removable(remove), counterweight)
    paths = trajectories(chain, motions, near)
    wanted = {measure_of(t) for t in (*objectives, *(limits or {}))} - {None}
    if paths:
        wanted |= {"torque", "shaking_force", "shaking_moment"}
    rows = {m: measure(chain, paths, m, about=point, normal=own.normal) for m in MEASURES if m in wanted}
    E, X0 = setup.map(materials)
    unit = (own.scale * setup.mass)[:, None]
    to_pi = own.injection()
    start = chain.inertial_parameters.reshape(-1) - to_pi @ own.of(chain.inertial_parameters).reshape(-1)
    full_E, full_0 = to_pi @ (unit * E), start + to_pi @ (unit[:, 0] * X0)
    names = list(dict.fromkeys(base(t) for t in objectives))
    n = E.shape[1]
    maker = TermMaker(chain, setup, rows, paths, E, X0, full_E, full_0)
    terms = {name: maker.make(name) for name in names}
    blocks = setup.constraints(materials, E, X0, masses) + maker.limits(limits or {})
    gone = _empty.empty(blocks, materials, n)
    blocks = _empty.without(blocks, materials, gone, n)
    caps = tuple(setup.caps(materials, masses, n))
    return BalanceProblem(
        chain=chain,
        kind=kind,
        conditions=conditions,
        space=own,
        mode=mode,
        materials=tuple(materials),
        gone=gone,
        terms=terms,
        rows=rows,
        limits=dict(limits or {}),
        E=frozen(E),
        X0=frozen(X0),
        program=Program(n, blocks),
        fixed=frozen(setup.fixed(materials, masses, n)),
        caps=caps,
        mass=setup.mass,
        sizes=frozen(_sizes(materials, gone, [*blocks, *caps], n)),
        near=None if near is None else checked("near", near, (chain.nq,)),
        solver=solver,
    )


def _sizes(materials: Sequence[Material], gone: Sequence[bool], blocks: Sequence[Block], n: int) -> Array:
    """Return bounds on the variables (n,): the heaviest mass that single rows allow, and its moments."""
    heaviest = np.full(n, np.inf)
    for block in blocks:
        if block.cone not in ("zero", "nonneg"):
            continue
        single = np.count_nonzero(block.G, axis=1) == 1
        for row, offset in zip(block.G[single], block.g[single], strict=True):
            k = int(np.argmax(row != 0.0))
            if row[k] < 0.0 or block.cone == "zero":
                heaviest[k] = min(heaviest[k], max(0.0, -offset / row[k]))
    sizes = [np.zeros(m.size) if g else m.sizes(heaviest[m.start]) for m, g in zip(materials, gone, strict=True)]
    return np.concatenate(sizes) if sizes else np.zeros(0)
