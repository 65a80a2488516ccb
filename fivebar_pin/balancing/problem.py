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
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, frozen
from fivebar_pin.balancing import _lift
from fivebar_pin.balancing._conic import Block, Outcome, Program
from fivebar_pin.balancing._material import Material
from fivebar_pin.balancing._parameters import Space
from fivebar_pin.balancing._quantities import MEASURES, Rows, measure, reflected_inertia, trajectories
from fivebar_pin.balancing._sampling import SpaceName, random_samples, space_of
from fivebar_pin.balancing._terms import (
    LINEAR,
    Term,
    base,
    check_terms,
    linear_term,
    measure_of,
    positive_limit,
    rows_term,
    torque_limits,
)
from fivebar_pin.balancing.branches import branches
from fivebar_pin.balancing.conditions import KINDS, BalanceConditions, balance_conditions
from fivebar_pin.balancing.design import Design
from fivebar_pin.balancing.regions import Ball, Disc, Region, resolve
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError, SolverError, UnknownNameError
from fivebar_pin.motion import Motion
from fivebar_pin.trajectory import Trajectory

__all__ = ["BalanceProblem", "balance", "balance_problem"]

Motions = Motion | Trajectory | Sequence[Motion | Trajectory]
MassBounds = tuple[float, float] | Mapping[str, tuple[float, float]] | None
_MARGINS = (1e-9, 1e-8, 1e-7, 0.0)  # how far inside the cones a design is kept, as a share of the moving mass
_CAP = 10.0  # largest mass added to one body unless given [moving masses]
_NEGLIGIBLE = 1e-7  # share of the moving mass that is not worth a piece of material
_EXACT = 1e-13  # residual of the conditions of a finished design [moving masses]
_PHYSICAL = 1e-12  # smallest eigenvalue of a pseudo-inertia that counts as zero [kg, kg m, kg m2]


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
        remove: bodies that material may also be taken from.
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
    terms = _weights(minimise, mode)

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


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BalanceProblem:
    """A balancing problem prepared once, to be solved for any weights of its objectives.

    Attributes:
        chain, kind, conditions: what is balanced.
        space: the parameters of the problem.
        materials: pieces of material that are variables.
        terms: objectives by base name.
        rows: quantities along the motions.
    """

    chain: ClosedChain
    kind: str | None
    conditions: BalanceConditions | None
    space: Space
    mode: str
    materials: tuple[Material, ...]
    terms: dict[str, Term]
    rows: dict[str, Rows]
    limits: dict[str, npt.ArrayLike]
    E: Array = field(repr=False)  # scaled parameters = X0 + E y
    X0: Array = field(repr=False)
    program: Program = field(repr=False)
    fixed: Array = field(repr=False)
    caps: tuple[Block, ...] = field(repr=False)
    mass: float

    @property
    def n(self) -> int:
        """Number of variables of the material."""
        return sum(m.size for m in self.materials)

    def size(self, objective: str) -> float:
        """Return the typical size of a prepared objective, in its own unit."""
        scale = self.terms[base(objective)].scale
        return scale * scale if objective.startswith("mean_square_") else scale

    def solve(self, minimise: str | Mapping[str, float], *, limits: Mapping[str, float] | None = None) -> Design:
        """Solve for other weights, or further upper bounds, of the prepared objectives.

        Raises:
            UnknownNameError: an objective that was not prepared.
            SolverError: no solution to the tolerance and no proof either.
        """
        weights = _weights(minimise, self.mode)
        for name in (*weights, *(limits or {})):
            if base(name) not in self.terms:
                raise UnknownNameError("prepared objective", name, self.terms)
        P, q, unit = self._objective(weights)
        extra = [b for name, top in (limits or {}).items() for b in self.terms[base(name)].bounded(float(top))]
        free = Program(self.program.n, [*self.program.blocks, *extra]) if extra else self.program
        program = Program(self.program.n, [*free.blocks, *self.caps]) if self.caps else free
        problem = "the design could not be made exact"
        for margin in _MARGINS:
            outcome = program.solve(P, q, margin=margin)
            if outcome.x is None:
                outcome = program.solve(P, q)
                if outcome.x is None:  # a proof that does without the caps says more
                    unbounded = free.solve(0.0 * P, 0.0 * q)
                    return self._infeasible(unbounded if unbounded.x is None else outcome)
            design, problem = self._finish(outcome, program, weights, (P, q, unit))
            if design is not None:
                return design
        raise SolverError(problem)

    def _objective(self, weights: Mapping[str, float]) -> tuple[Array, Array, float]:
        """Return P, q over all variables and the unit they were divided by."""
        P, q = np.zeros(self.program.n), np.zeros(self.program.n)
        for name, weight in weights.items():
            term = self.terms[base(name)]
            column = self.n + list(self.terms).index(base(name))
            if name.startswith("mean_square_"):
                P[column] += 2.0 * weight * term.scale**2
            else:
                q[column] += weight * term.scale
        unit = float(max(P.max(initial=0.0), q.max(initial=0.0))) or 1.0
        return P / unit, q / unit, unit

    def _finish(
        self, outcome: Outcome, program: Program, weights: Mapping[str, float], cost: tuple[Array, Array, float]
    ) -> tuple[Design | None, str]:
        """Make a solution exact and check it; None and the reason when it is not physical."""
        assert outcome.x is not None
        for drop in (_NEGLIGIBLE, 0.0):  # without what only keeps a body strictly physical, if that can be
            y, residual = self._exact(outcome.x[: self.n], drop)
            parts = _lift.lift(self, y)
            if residual <= _EXACT and parts.lowest >= -_PHYSICAL:
                break
        else:
            return None, (
                f"the design misses the conditions by {residual:.2g} ({_EXACT:g} is allowed) and its least physical "
                f"body is outside by {max(0.0, -parts.lowest):.2g} ({_PHYSICAL:g})"
            )
        full = np.concatenate([y, np.zeros(len(self.terms))])
        values = {name: self.terms[base(name)].value(full) for name in weights}
        squared = {k: v * v if k.startswith("mean_square_") else v for k, v in values.items()}
        objective = sum(weights[k] * squared[k] for k in weights)
        P, _, unit = cost
        x = outcome.x
        dual = unit * (-float(program.g @ outcome.z) - 0.5 * float(x @ (P * x)))
        design = Design(
            status="optimal",
            original=self.chain,
            kind=self.kind,
            mode=self.mode,
            space=self.space,
            conditions=self.conditions,
            objective=objective,
            dual_bound=dual,
            terms=squared,
            parameters=frozen(parts.parameters),
            added=parts.added,
            removed=parts.removed,
            rows=self.rows,
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
        share = np.where(mass < drop, 0.0, np.maximum(mass, 1e-9))
        share = np.repeat(share, [m.size for m in self.materials])
        y = np.where(share > 0.0, y, 0.0)
        for _ in range(3 if A.size else 0):
            y = y - share * np.linalg.lstsq(A * share, A @ y + b, rcond=1e-10)[0]
        return y, float(np.abs(A @ y + b).max(initial=0.0))

    def _infeasible(self, outcome: Outcome) -> Design:
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
            certificate=outcome.certificate,
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
) -> BalanceProblem:
    """Prepare a balancing problem for several objectives; arguments as for `balance`."""
    if kind is not None and kind not in KINDS:
        raise UnknownNameError("kind of balance", kind, KINDS)
    if mode not in ("add", "redesign"):
        raise UnknownNameError("mode", mode, ("add", "redesign"))
    check_terms(tuple(objectives), "objective")
    check_terms(dict(limits or {}), "limit")
    point = checked("about", about, (3,))
    conditions, own = None, None
    if kind is not None:
        conditions = balance_conditions(chain, kind, gravity=gravity, about=about, near=near, space=space, seed=seed)
        own = conditions.space
    else:
        own = space_of(chain, random_samples(chain, 50, near=near, seed=seed), space)
    setup = _Setup(chain, own, conditions, mode)
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

    def padded(G: Array) -> Array:
        return np.concatenate([G, np.zeros((*G.shape[:-1], len(names)))], axis=-1)

    maker = _TermMaker(chain, setup, rows, paths, padded(E), X0, padded(full_E), full_0)
    terms = {name: maker.make(name) for name in names}
    blocks = setup.constraints(materials, E, X0, masses)
    blocks = [Block(b.label, b.cone, padded(b.G), b.g, b.inward) for b in blocks]
    for k, term in enumerate(terms.values()):
        blocks += term.epigraph(n + k)
    blocks += maker.limits(limits or {})
    return BalanceProblem(
        chain=chain,
        kind=kind,
        conditions=conditions,
        space=own,
        mode=mode,
        materials=tuple(materials),
        terms=terms,
        rows=rows,
        limits=dict(limits or {}),
        E=frozen(E),
        X0=frozen(X0),
        program=Program(n + len(names), blocks),
        fixed=frozen(setup.fixed(materials, masses, n)),
        caps=tuple(Block(b.label, b.cone, padded(b.G), b.g) for b in setup.caps(materials, masses, n)),
        mass=setup.mass,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _TermMaker:
    """Builds terms and limits over designs X = X0 + E y (scaled) and pi = pi0 + full_E y."""

    chain: ClosedChain
    setup: _Setup
    rows: dict[str, Rows]
    paths: tuple[Trajectory, ...]
    E: Array
    X0: Array
    full_E: Array
    pi0: Array

    def make(self, name: str) -> Term:
        """Return a term by its base name."""
        present = self.chain.inertial_parameters.reshape(-1)
        if name in LINEAR:
            weight = np.zeros(present.size)
            weight[::10] = 1.0
            if name == "inertia":
                if not self.paths:
                    raise InvalidInputError("motions", [], "must hold at least one motion for inertia")
                weight = reflected_inertia(self.chain, self.paths)
            now = float(weight @ present)
            constant = float(weight @ self.pi0) - (now if name == "added_mass" else 0.0)
            return linear_term(name, weight @ self.full_E, constant, abs(now) or 1.0)
        if name == "distance":
            X = self.setup.space.of(self.chain.inertial_parameters).reshape(-1) / self.setup.unit
            return Term(name, ((self.E, self.X0 - X),), False, 1.0)
        measured = measure_of(name)
        assert measured is not None
        return rows_term(name, self.rows[measured], self.full_E, self.pi0, present)

    def limits(self, limits: Mapping[str, npt.ArrayLike]) -> list[Block]:
        """Return the cones of all upper bounds."""
        blocks: list[Block] = []
        for name, top in limits.items():
            if name == "peak_torque":
                blocks += torque_limits(top, self.rows["torque"], self.full_E, self.pi0)
            else:
                limit = positive_limit(name, float(np.asarray(top)))
                root = np.sqrt(limit) if name.startswith("mean_square_") else limit
                blocks += self.make(base(name)).bounded(float(root))
        return blocks


@dataclass(frozen=True, slots=True, eq=False)
class _Setup:
    """Names and bounds turned into materials and cones, lengths in chain lengths and masses in moving masses."""

    chain: ClosedChain
    space: Space
    conditions: BalanceConditions | None
    mode: str

    @property
    def mass(self) -> float:
        """Unit of mass [kg]."""
        return self.chain.mass or 1.0

    @property
    def unit(self) -> Array:
        """Unit of every parameter of the space (nb * width,)."""
        return np.asarray(self.space.scale * self.mass)

    def present(self) -> Array:
        """Return the present scaled parameters (nb, width)."""
        x = self.space.of(self.chain.inertial_parameters).reshape(-1) / self.unit
        return np.asarray(x.reshape(-1, self.space.width))

    def check_physical(self) -> None:
        """Raise when a present body could not exist."""
        for name, x in zip(self.chain.joints, self.present(), strict=True):
            lowest = _lift.lowest_eigenvalue(x, planar=self.space.planar)
            if lowest < -1e-9 and self.mode == "add":
                raise InvalidInputError(
                    f"inertia of body {name}",
                    [float(v) for v in self.space.of(self.chain.inertial_parameters)[self.chain.joints.index(name)]],
                    f"is not that of a physical body (pseudo-inertia has the eigenvalue {lowest:.3g}, scaled)",
                    "Correct the model, or redesign the body.",
                )

    def chosen(self, bodies: Sequence[str] | None) -> list[int]:
        """Return the indices of the bodies that may change."""
        joints = self.chain.joints
        if bodies is None:
            found = [b for b in range(len(joints)) if self._influences(b)]
            if not found:
                raise InvalidInputError("bodies", list(joints), f"cannot influence the {self._kind} conditions")
            return found
        if isinstance(bodies, str) or not len(bodies):
            raise InvalidInputError("bodies", bodies, "must be a sequence of at least one name")
        for name in bodies:
            if name not in joints:
                raise UnknownNameError("body", name, joints)
        idle = [name for name in bodies if not self._influences(joints.index(name))]
        if idle:
            raise InvalidInputError("bodies", idle, f"cannot influence the {self._kind} conditions")
        return sorted({joints.index(name) for name in bodies})

    def removable(self, remove: Sequence[str]) -> list[int]:
        """Return the indices of the bodies that may lose material."""
        for name in remove:
            if name not in self.chain.joints:
                raise UnknownNameError("body", name, self.chain.joints)
        if remove and self.mode == "redesign":
            raise InvalidInputError("remove", list(remove), "has no meaning for a redesign")
        return sorted(self.chain.joints.index(name) for name in remove)

    @property
    def _kind(self) -> str:
        return self.conditions.kind if self.conditions is not None else "given"

    def _influences(self, body: int) -> bool:
        if self.conditions is None:
            return True
        w = self.space.width
        return bool(np.abs(self.conditions.basis[:, body * w : (body + 1) * w]).max(initial=0.0) > 1e-9)

    def materials(
        self,
        chosen: Sequence[int],
        region: Region | Mapping[str, Region] | None,
        removable: Sequence[int],
        counterweight: Disc | Mapping[str, Disc] | None,
    ) -> list[Material]:
        """Return the pieces of material that are variables."""
        for given, what in ((region, "region"), (counterweight, "counterweight")):
            for name in given if isinstance(given, Mapping) else ():
                if name not in self.chain.joints:
                    raise UnknownNameError(f"body of a {what}", name, self.chain.joints)
        if counterweight is not None and (self.mode != "add" or not self.space.planar):
            raise InvalidInputError("counterweight", "Disc", "needs a planar mechanism and mode 'add'")
        out, start = [], 0
        word = "new body" if self.mode == "redesign" else "material added to"
        for bodies, sign, label in ((chosen, 1, word), (removable, -1, "material removed from")):
            for b in bodies:
                name = self.chain.joints[b]
                own = region.get(name) if isinstance(region, Mapping) else region
                planar = self.space.planar
                shape = resolve(
                    own or Ball(self.chain.length),
                    self.chain,
                    b,
                    self.space.axes[b],
                    planar=planar,
                    unit=self.space.length,
                )
                disc = counterweight.get(name) if isinstance(counterweight, Mapping) else counterweight
                solid = disc.scaled(self.space.axes[b], self.mass, self.space.length) if disc and sign > 0 else None
                material = Material(b, sign, start, planar, shape, f"{label} {name}", solid)
                out.append(material)
                start += material.size
        return out

    def map(self, materials: Sequence[Material]) -> tuple[Array, Array]:
        """Return E, X0 with scaled parameters = X0 + E y."""
        X0 = self.present()
        w = self.space.width
        E = np.zeros((X0.size, sum(m.size for m in materials)))
        for m in materials:
            E[m.body * w : (m.body + 1) * w, m.parameters] = m.sign * np.eye(w)
            if self.mode == "redesign":
                X0[m.body] = 0.0
        return E, X0.reshape(-1)

    def constraints(
        self,
        materials: Sequence[Material],
        E: Array,
        X0: Array,
        masses: MassBounds,
    ) -> list[Block]:
        """Return conditions, physical bodies, regions and mass bounds."""
        n = E.shape[1]
        blocks = []
        if self.conditions is not None and self.conditions.rank:
            R = self.conditions.rows
            labels = tuple(f"[{text}]" for text in self.conditions.equations)
            blocks.append(Block(labels, "zero", R @ E, R @ X0))
        w = self.space.width
        for m in materials:
            blocks += m.blocks(n)
            if m.sign < 0:  # what is left of a body is a body
                left = Material(m.body, 1, m.start, m.planar, None, "").blocks(n)[0]
                own = left.G[:, m.parameters] @ X0[m.body * w : (m.body + 1) * w]
                label = f"what is left of {self.chain.joints[m.body]} is a physical body"
                blocks.append(Block(label, left.cone, -left.G, own, left.inward))
        for m in materials:
            if m.sign > 0:
                blocks += self._mass_bounds(m, masses, n)
        return blocks

    def caps(self, materials: Sequence[Material], masses: MassBounds, n: int) -> list[Block]:
        """Return bounds on added masses that have none of their own; without them an optimum need not exist."""
        out = []
        for m in materials:
            if m.sign > 0 and self._bounds(m, masses) is None:
                label = f"mass of {m.label} <= {_CAP:g} times the moving mass"
                out.append(Block(label, "nonneg", -_unit_row(m.start, n), np.array([_CAP])))
        return out

    def fixed(self, materials: Sequence[Material], masses: MassBounds, n: int) -> Array:
        """Return rows (k, n + 1) of masses that are given exactly: row @ y = last entry."""
        out = np.zeros((0, n + 1))
        for m in materials:
            bounds = self._bounds(m, masses) if m.sign > 0 else None
            if bounds is not None and bounds[0] == bounds[1]:
                out = np.vstack([out, np.append(_unit_row(m.start, n)[0], bounds[0] / self.mass)])
        return out

    def _mass_bounds(self, m: Material, masses: MassBounds, n: int) -> list[Block]:
        bounds = self._bounds(m, masses)
        if bounds is None:
            return []  # see caps
        (low, high), row = bounds, _unit_row(m.start, n)
        if low == high:
            return [Block(f"mass of {m.label} = {low:g} kg", "zero", row, np.array([-low / self.mass]))]
        return [
            Block(f"mass of {m.label} >= {low:g} kg", "nonneg", row, np.array([-low / self.mass])),
            Block(f"mass of {m.label} <= {high:g} kg", "nonneg", -row, np.array([high / self.mass])),
        ]

    def _bounds(self, m: Material, masses: MassBounds) -> tuple[float, float] | None:
        """Return the bounds on the mass of one material [kg], or None."""
        name = self.chain.joints[m.body]
        if isinstance(masses, Mapping):
            for key in masses:
                if key not in self.chain.joints:
                    raise UnknownNameError("body of a mass bound", key, self.chain.joints)
        given = masses.get(name) if isinstance(masses, Mapping) else masses
        if given is None:
            present = float(self.chain.inertial_parameters[m.body, 0])
            return None if self.mode == "add" else (0.5 * present, 2.0 * present)
        low, high = (float(v) for v in checked(f"masses of {name}", given, (2,)))
        if not 0.0 <= low <= high:
            raise InvalidInputError(f"masses of {name}", (low, high), "must be 0 <= low <= high [kg]")
        return low, high


def _unit_row(k: int, n: int) -> Array:
    row = np.zeros((1, n))
    row[0, k] = 1.0
    return row


def _weights(minimise: str | Mapping[str, float] | None, mode: str) -> dict[str, float]:
    """Return the terms and their weights, checked."""
    if minimise is None:
        minimise = "distance" if mode == "redesign" else "added_mass"
    weights = {minimise: 1.0} if isinstance(minimise, str) else {str(k): float(v) for k, v in minimise.items()}
    if not weights:
        raise InvalidInputError("minimise", {}, "must name at least one term")
    check_terms(weights, "objective")
    for name, weight in weights.items():
        if not (np.isfinite(weight) and weight >= 0.0):
            raise InvalidInputError(f"weight of {name}", weight, "must be finite and not negative")
    if not any(weights.values()):
        raise InvalidInputError("minimise", weights, "must have a positive weight")
    return weights
