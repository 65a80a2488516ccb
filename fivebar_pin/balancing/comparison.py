"""Designs side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, figures
from fivebar_pin.balancing.design import Design
from fivebar_pin.balancing.objectives.objective import Objective, named
from fivebar_pin.balancing.regressors.measures import Motions
from fivebar_pin.balancing.scoring import score
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError

__all__ = ["Comparison", "compare"]


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
    terms: Sequence[str | Objective] = (
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
    if not isinstance(chains, Mapping):
        raise InvalidInputError("chains", type(chains).__name__, "must map names to mechanisms or designs")
    made = {name: item.chain if isinstance(item, Design) else item for name, item in chains.items()}
    if not made:
        raise InvalidInputError("chains", {}, "must hold at least one mechanism")
    one = next(iter(made.values()))
    for name, chain in made.items():
        if chain.joints != one.joints:
            raise InvalidInputError(f"joints of {name}", chain.joints, f"must be {one.joints}")
    designs = np.stack([c.inertial_parameters for c in made.values()])
    scores = score(one, motions, designs, terms=terms, about=about, near=near)
    names = [named(term, "term").name for term in terms]
    mass = np.array([c.mass for c in made.values()])
    return Comparison(tuple(made), {"mass": mass, **{name: scores[name] for name in names}}, dict(scores.scales))
