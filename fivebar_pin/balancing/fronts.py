"""What one objective costs in terms of another, and designs side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, figures, frozen, integer
from fivebar_pin.balancing.balanced import balance
from fivebar_pin.balancing.design import Design
from fivebar_pin.balancing.objectives.term import check_terms
from fivebar_pin.balancing.problem import BalanceProblem, balance_problem
from fivebar_pin.balancing.regressors.measures import Motions
from fivebar_pin.balancing.scoring import score
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InfeasibleError, InvalidInputError, UnknownNameError

__all__ = ["Comparison", "ParetoFront", "alici_shirinzadeh", "compare", "pareto"]

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
    first: str,
    second: str,
    n: int = 11,
    **options: Any,
) -> ParetoFront:
    """Trace the front between two objectives.

    The ends minimise one objective and break ties by the other; in between the second is minimised under equally
    spaced upper bounds on the first. Every point is a global optimum.

    Args:
        chain, kind: as for `balance`.
        first, second: two of its terms.
        n: number of designs, at least 2.
        **options: further arguments of `balance`, except `minimise`.

    Raises:
        InfeasibleError: there is no design at all.
        InvalidInputError: fewer than two points, or the same objective twice.
    """
    check_terms((first, second), "objective")
    if first == second:
        raise InvalidInputError("objectives", (first, second), "must differ")
    n = integer("n", n, least=2, most=_MOST_DESIGNS)
    problem = balance_problem(chain, kind, objectives=(first, second), **options)
    left, right = _end(problem, first, second), _end(problem, second, first)
    low, high = left.terms[first], right.terms[first]
    designs = [left]
    room = _ROOM * max(abs(low), abs(high))
    if high - low > room:
        for bound in np.linspace(low, high, int(n))[1:-1]:
            root = np.sqrt(bound) if first.startswith("mean_square_") else bound
            designs.append(problem.solve(_both(problem, second, first), limits={first: float(root)}))
    designs.append(right)
    values = [(d.terms[first], d.terms[second]) for d in designs]
    return ParetoFront(first, second, frozen(values), tuple(designs))


def _both(problem: BalanceProblem, main: str, other: str) -> dict[str, float]:
    """Weight one objective, with just enough of the other to break ties."""
    return {main: 1.0, other: _TINY * problem.size(main) / problem.size(other)}


def _end(problem: BalanceProblem, main: str, other: str) -> Design:
    design = problem.solve(_both(problem, main, other))
    if not design.feasible:
        raise InfeasibleError(f"{problem.chain.name} cannot be balanced within the bounds: {design.certificate}")
    return design


def alici_shirinzadeh(
    chain: ClosedChain,
    motions: Motions,
    *,
    weights: Mapping[str, float] | None = None,
    kind: str | None = "force",
    **options: Any,
) -> Design:
    """Minimise the objective of Alici and Shirinzadeh (2004) under the force balance equalities, globally.

    Theirs is the sum of squares of bearing forces, driving torques, shaking moment and deviation of the angular
    momentum from its mean over the motion, minimised by a general optimiser from a starting point. All four are linear
    in the inertial parameters, so it is one convex quadratic problem.

    Args:
        chain: the mechanism.
        motions: over which the mean squares are taken.
        weights: of bearing_force, torque, shaking_moment and angular_momentum; one each unless given.
        kind, **options: as for `balance`.
    """
    names = ("bearing_force", "torque", "shaking_moment", "angular_momentum")
    given = dict.fromkeys(names, 1.0) if weights is None else dict(weights)
    for name in given:
        if name not in names:
            raise UnknownNameError("weight", name, names)
    minimise = {f"mean_square_{name}": weight for name, weight in given.items()}
    return balance(chain, kind, minimise=minimise, motions=motions, **options)


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Immutable):
    """Mechanisms with the same kinematics, side by side.

    Attributes:
        names: of the mechanisms.
        values: per term one value for each mechanism.
        scales: per term the sum of the sizes of what adds up to it, the largest of all mechanisms; see `Loads.scale`.
    """

    names: tuple[str, ...]
    values: dict[str, Array]
    scales: dict[str, float] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"Comparison({', '.join(self.names)}: {', '.join(self.values)})"

    def __str__(self) -> str:
        width = max(map(len, self.names)) + 2
        column = max(13, width)
        lines = [" " * 24 + "".join(f"{name:>{column}}" for name in self.names)]
        for term, row in self.values.items():
            words = (figures(float(x), self.scales.get(term, 0.0), digits=5) for x in row)
            lines.append(f"{term:<24}" + "".join(f"{word:>{column}}" for word in words))
        return "\n".join(lines)


def compare(
    chains: Mapping[str, ClosedChain | Design],
    motions: Motions,
    *,
    about: npt.ArrayLike = (0.0, 0.0, 0.0),
    near: npt.ArrayLike | None = None,
    terms: Sequence[str] = (
        "inertia",
        "rms_torque",
        "peak_torque",
        "rms_shaking_force",
        "peak_shaking_force",
        "rms_shaking_moment",
        "peak_shaking_moment",
        "peak_bearing_force",
    ),
) -> Comparison:
    """Measure mechanisms that differ in their mass distribution only, along the same motions.

    Args:
        chains: mechanisms or designs by name; the kinematics, gravity and friction are those of the first.
        motions, about, near, terms: as for `score`.

    Raises:
        InvalidInputError: no mechanism, or mechanisms with different bodies.
    """
    made = {name: item.chain if isinstance(item, Design) else item for name, item in chains.items()}
    if not made:
        raise InvalidInputError("chains", {}, "must hold at least one mechanism")
    one = next(iter(made.values()))
    for name, chain in made.items():
        if chain.joints != one.joints:
            raise InvalidInputError(f"joints of {name}", chain.joints, f"must be {one.joints}")
    designs = np.stack([c.inertial_parameters for c in made.values()])
    scores = score(one, motions, designs, terms=terms, about=about, near=near)
    mass = np.array([c.mass for c in made.values()])
    return Comparison(tuple(made), {"mass": mass, **{t: scores[t] for t in terms}}, dict(scores.scales))
