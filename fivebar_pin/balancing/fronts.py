"""What one objective costs in terms of another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, figures, frozen, integer
from fivebar_pin.balancing.conditions import BalanceConditions
from fivebar_pin.balancing.design import Design
from fivebar_pin.balancing.objectives.objective import Objective, named
from fivebar_pin.balancing.pieces.piece import Piece
from fivebar_pin.balancing.problem import BalanceProblem, Limits, balance_problem
from fivebar_pin.balancing.regions.region import Region
from fivebar_pin.balancing.regressors.measures import Motions
from fivebar_pin.balancing.sampling import SpaceName
from fivebar_pin.balancing.solvers import DEFAULT
from fivebar_pin.balancing.variables.variable import MassBounds, Variable
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InfeasibleError, InvalidInputError

__all__ = ["ParetoFront", "front_of", "pareto"]

_MOST_DESIGNS = 10_000  # on one front
_TINY = 1e-6  # weight, in natural units, of the objective that only breaks ties
_ROOM = 1e-7  # relative room at the ends of a front, where a bound leaves no interior


@dataclass(frozen=True, eq=False, repr=False)
class ParetoFront(Immutable):
    """Designs of which none is better in both objectives than another.

    Attributes:
        first, second: names of the objectives.
        values: their values (n, 2), the first ascending.
        designs: the designs (n,).
    """

    first: str
    second: str
    values: Array
    designs: tuple[Design, ...]

    def __len__(self) -> int:
        return len(self.designs)

    def __repr__(self) -> str:
        ends = (self.designs[0], self.designs[-1])
        spans = [
            f"{name} " + " .. ".join(figures(design.terms[name], design.scale(name)) for design in ends)
            for name in (self.first, self.second)
        ]
        return f"ParetoFront({len(self)} designs: {', '.join(spans)})"


def pareto(
    chain: ClosedChain,
    kind: str | None,
    first: str | Objective,
    second: str | Objective,
    n: int = 11,
    *,
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
) -> ParetoFront:
    """Trace the front between two objectives.

    The ends minimise one objective and break ties by the other; in between the second is minimised under equally
    spaced upper bounds on the first. Every point is a global optimum.

    Args:
        chain, kind: as for `balance`.
        first, second: two of its terms.
        n: number of designs, at least 2.
        bodies, mode, region, masses, material, thickness, counterweight, remove, variables, motions, limits, gravity,
            about, near, space, seed, conditions, solver: as for `balance`.

    Raises:
        InfeasibleError: there is no design at all.
        InvalidInputError: fewer than two points, or the same objective twice.
    """
    one, two = named(first, "objective"), named(second, "objective")
    if one == two:
        raise InvalidInputError("objectives", (one.name, two.name), "must differ")
    n = integer("n", n, least=2, most=_MOST_DESIGNS)
    problem = balance_problem(
        chain,
        kind,
        objectives=(one, two),
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
    return front_of(problem, one, two, n)


def front_of(problem: BalanceProblem, first: Objective, second: Objective, n: int) -> ParetoFront:
    """Trace the front between two prepared objectives of a problem; arguments as for `pareto`."""
    left, right = _end(problem, first, second), _end(problem, second, first)
    low, high = left.terms[first.name], right.terms[first.name]
    designs = [left]
    room = _ROOM * max(abs(low), abs(high))
    if high - low > room:
        for bound in np.linspace(low, high, n)[1:-1]:
            designs.append(problem.solve(_both(problem, second, first), limits={first: float(bound)}))
    designs.append(right)
    values = [(d.terms[first.name], d.terms[second.name]) for d in designs]
    return ParetoFront(first.name, second.name, frozen(values), tuple(designs))


def _both(problem: BalanceProblem, main: Objective, other: Objective) -> dict[Objective, float]:
    """Weight one objective, with just enough of the other to break ties."""
    return {main: 1.0, other: _TINY * problem.size(main) / problem.size(other)}


def _end(problem: BalanceProblem, main: Objective, other: Objective) -> Design:
    design = problem.solve(_both(problem, main, other))
    if not design.feasible:
        raise InfeasibleError(f"{problem.chain.name} cannot be balanced within the bounds: {design.certificate}")
    return design
