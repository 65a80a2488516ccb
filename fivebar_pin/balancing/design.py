"""Design: what `balance` answers, with everything needed to check it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np

from fivebar_pin._arrays import Array, Immutable, figures, settled
from fivebar_pin.balancing.change import Change
from fivebar_pin.balancing.conditions import BalanceConditions
from fivebar_pin.balancing.objectives.objective import Objective, known
from fivebar_pin.balancing.objectives.peak import Peak
from fivebar_pin.balancing.objectives.rms import Rms
from fivebar_pin.balancing.parameters import Space
from fivebar_pin.balancing.pieces.piece import Piece
from fivebar_pin.balancing.regions.shape import Shape
from fivebar_pin.balancing.regressors.measures import Measurement
from fivebar_pin.balancing.solvers import Certificate
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InfeasibleError

PROVED = 1e-5  # gap at which a design counts as optimal [of the objective or its typical size]
__all__ = ["Asked", "Certificate", "Change", "Design", "Solvable"]


class Solvable(Protocol):
    """What a design answers, as far as a design needs it: `BalanceProblem`."""

    @property
    def density(self) -> tuple[float, float] | None:
        """How dense the material may be [kg/m3], and its thickness [m]; None for any."""

    def solve(
        self,
        minimise: Mapping[Objective, float],
        *,
        limits: Mapping[Objective, float] | None = None,
        solver: str | None = None,
    ) -> Design:
        """Solve for other weights, or further upper bounds."""

    def in_pieces(self, pieces: Mapping[str, Piece]) -> Solvable:
        """Return the same problem for counterweights of stated kinds."""

    def shape(self, b: int) -> Shape | None:
        """Return where material added to a body may lie, in chain lengths."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Asked(Immutable):
    """What a design answers: the problem, the weights of its terms, and limits besides those of the problem."""

    problem: Solvable
    minimise: Mapping[Objective, float]
    limits: Mapping[Objective, float]


@dataclass(frozen=True, eq=False, repr=False)
class Design(Immutable):
    """A balanced mechanism, optimal for the objective, or the proof that there is none.

    Attributes:
        status: "optimal", "feasible" (a design, with a bound on how much better another could be) or "infeasible".
        original: the chain that was to be balanced.
        kind: what is exact, or None.
        mode: "add" or "redesign".
        space: parameters that the design is written in, four per body (planar) or ten.
        conditions: the balancing conditions, or None when nothing is exact.
        objective: weighted sum of the terms.
        dual_bound: no design within the bounds has a lower objective, whatever the solver's errors (see
            `solvers.bound`): they are charged against the bounds on the variables that follow from masses and regions.
            Of counterweights on arms: none on the same bodies with the same arms is better.
        terms: value of every term of the objective, in its own unit.
        parameters: inertial parameters of all bodies (nb, 10); nan when infeasible.
        added, removed: material per body that may change; for a redesign, `added` holds the new bodies.
        measurement: the quantities along the given motions, for `before` and `after`; None when infeasible.
        certificate: proof of infeasibility, else None; of a design for one branch, the proof that there is none for all
            assembly modes together.
        branch: configuration (nq,) of the branch that the design is for; None when it serves all assembly modes.
        alternatives: configurations (nq,) of all branches with a design of their own, found where there is none for
            all assembly modes together; pass one as `near`.
        pieces: what the material added to a body is made as, by joint; empty where it may be anything.
        arms: what carries these pieces; part of `parameters`, and of the added mass.
        asked: what was asked for.
    """

    status: str
    original: ClosedChain
    kind: str | None
    mode: str
    space: Space
    conditions: BalanceConditions | None
    objective: float
    dual_bound: float
    terms: dict[str, float]
    parameters: Array
    added: tuple[Change, ...] = ()
    removed: tuple[Change, ...] = ()
    measurement: Measurement | None = None
    certificate: Certificate | None = None
    branch: Array | None = None
    alternatives: tuple[Array, ...] = ()
    pieces: Mapping[str, Piece] = field(default_factory=dict)
    arms: tuple[Change, ...] = ()
    asked: Asked | None = None

    def __repr__(self) -> str:
        if not self.feasible:
            hint = "".join(f"; possible on the branch near={q.round(6).tolist()} alone" for q in self.alternatives)
            return f"Design({self.original.name!r}, {self.kind}: infeasible; {self.certificate}{hint})"
        where = "" if self.branch is None else f", only on the branch of {self.branch.round(6).tolist()}"
        return (
            f"Design({self.original.name!r}, {self.kind}: {self.status}, objective {self.objective_text()}, "
            f"gap {self.gap:.1e}, residual {self.residual:.1e}{where})"
        )

    def objective_text(self, *, digits: int = 6) -> str:
        """Return the objective in figures; 0 where every term of it is round-off."""
        some = any(settled(x, self.scale(term)) for term, x in self.terms.items())
        return figures(self.objective if some else 0.0, digits=digits)

    def __str__(self) -> str:
        lines = [repr(self)]
        if self.material:
            lines.append(f"  material: {self.material}")
        length = self.original.length
        for sign, changes in (("+", self.added), ("-", self.removed)):
            for c in changes:
                if c.mass == 0.0:
                    continue
                place = ", ".join(f"{x:.5g}" for x in np.round(c.place / length, 9) * length + 0.0)
                lines.append(f"  {sign} {c.body}: {c.mass:.6g} kg at ({place}) m")
        lines += [f"  + {c.body}: arm of {c.mass:.6g} kg" for c in self.arms]
        if self.feasible:
            lines += [f"  {k}: {self._written(k)}" for k in self.before]
        return "\n".join(lines)

    def _written(self, term: str) -> str:
        """Return a term before and after, round-off as 0."""
        sizes = (self._scale(term, pi) for pi in (self.original.inertial_parameters, self.parameters))
        values = (self.before[term], self.after[term])
        return " -> ".join(figures(x, size, digits=5) for x, size in zip(values, sizes, strict=True))

    @property
    def feasible(self) -> bool:
        """Whether there is a design."""
        return self.status != "infeasible"

    @property
    def material(self) -> str:
        """How dense the material may be, in words; empty where that was not asked."""
        density = None if self.asked is None else self.asked.problem.density
        if density is None:
            return ""
        thick = f", {1e3 * density[1]:.4g} mm thick" if self.space.planar else ""
        return f"no denser than {density[0]:g} kg/m3{thick}"

    @property
    def gap(self) -> float:
        """Difference between the objective and its lower bound."""
        return self.objective - self.dual_bound

    @cached_property
    def before(self) -> dict[str, float]:
        """Rms and peak of each quantity of the original over the given motions, "rms_torque" and so on.

        Torque, shaking force and moment; frame force and moment too where gravity acts; what the objective needs.
        """
        return self._measured(self.original.inertial_parameters)

    @cached_property
    def after(self) -> dict[str, float]:
        """The same of the design."""
        return self._measured(self.parameters)

    def scale(self, term: str) -> float:
        """Return the sum of the sizes of what adds up to a term of the design, see `Loads.scale`; 0 when unknown."""
        return self._scale(term, self.parameters)

    def value(self, term: str, parameters: Array) -> float:
        """Return a term for bodies of parameters (nb, 10), measured along the motions of this design."""
        atom, measurement = self._atom(term), self.measurement
        assert atom is not None and measurement is not None
        return atom.value(measurement, parameters)

    def _scale(self, term: str, pi: Array) -> float:
        atom = self._atom(term)
        return 0.0 if atom is None or self.measurement is None else atom.size(self.measurement, pi)

    def _atom(self, term: str) -> Objective | None:
        """Return the atom of a name: one of the objective, or one that is known."""
        minimised = () if self.asked is None else self.asked.minimise
        return next((atom for atom in minimised if atom.name == term), None) or known().get(term)

    def _measured(self, pi: Array) -> dict[str, float]:
        measurement = self.measurement
        if measurement is None:
            return {}
        atoms = [atom for name in measurement.rows for atom in (Rms(name), Peak(name))]
        return {atom.name: atom.value(measurement, pi) for atom in atoms}

    @cached_property
    def residual(self) -> float:
        """Largest residual of the conditions over the moving mass [-]; first moments count at the chain's length."""
        if self.conditions is None or not self.conditions.rank:
            return 0.0
        return float(np.abs(self.conditions.residual(self.parameters)).max() / (self.chain.mass or 1.0))

    @property
    def added_mass(self) -> float:
        """Moving mass gained [kg]."""
        return float(self.parameters[:, 0].sum()) - self.original.mass

    @cached_property
    def chain(self) -> ClosedChain:
        """The designed mechanism.

        Raises:
            InfeasibleError: there is none; the message holds the certificate.
        """
        if not self.feasible:
            raise InfeasibleError(
                f"{self.original.name} cannot be balanced ({self.kind}) within the bounds: {self.certificate}"
            )
        return self.original.with_inertial_parameters(self.parameters)
