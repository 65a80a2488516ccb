"""The answer of `diagnose`: plain values that can be asked and printed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Literal

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable
from fivebar_pin.errors import UnknownNameError
from fivebar_pin.mechanism.idle import Idle

__all__ = ["ActuatedSet", "Actuation", "Diagnosis", "Finding", "RedundantRow", "Severity", "apart_in_words"]


_COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz")
_SHOWN = 4  # actuated sets printed

Severity = Literal["error", "warning", "note"]


class Actuation(Enum):
    """Whether the actuated joints determine the motion."""

    NONE = "no joint is actuated"
    UNDER = "under-actuated"
    EXACT = "exactly actuated"
    OVER = "over-actuated"
    CONFLICT = "too many motors in one place, too few in another"


@dataclass(frozen=True, slots=True)
class Finding(Immutable):
    """Something worth knowing.

    Attributes:
        severity: "error" (the chain cannot be used as it is), "warning" (check it) or "note".
        text: what is the matter and what to do about it.
    """

    severity: Severity
    text: str

    def __str__(self) -> str:
        return f"{self.severity}: {self.text}"


@dataclass(frozen=True, slots=True)
class RedundantRow(Immutable):
    """A closure row that the others imply.

    Attributes:
        closure, row: where it is; row in the axes of frame 1 of the closure.
        scope: "always" (at every configuration, like the out-of-plane row of a planar loop), "closed" (wherever the
            loops are closed: the mechanism is overconstrained and lives off its special dimensions) or "here" (only at
            the configuration diagnosed: a singular one).
        weights: the combination of rows that vanishes, by "closure.row", lengths measured in chain lengths; one for
            this row.
    """

    closure: str
    row: str
    scope: Literal["always", "closed", "here"]
    weights: Mapping[str, float]

    def __str__(self) -> str:
        own = f"{self.closure}."
        others = [name.removeprefix(own) for name in self.weights if name != own + self.row]
        where = {"always": "always", "closed": "wherever the loops are closed", "here": "at this configuration"}
        return (
            f"{self.closure}.{self.row}"
            + (f" (through {', '.join(others)})" if others else "")
            + (f" {where[self.scope]}")
        )


@dataclass(frozen=True, slots=True)
class ActuatedSet(Immutable):
    """Joints that would determine the motion.

    Attributes:
        joints: their names.
        sigma: smallest singular value of the scaled passive columns with them [-]; larger is better.
    """

    joints: tuple[str, ...]
    sigma: float


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosis(Immutable):
    """What `diagnose` found. Print it, or ask its fields; "here" is the configuration q.

    Attributes:
        name: of the mechanism.
        q: closed configuration the diagnosis holds for (nq,).
        gap: largest closure residual at the configuration that was asked for, else at q [m or rad].
        closed: whether the loops are closed at q. Where no configuration closes them, q is the nearest one found, and
            what is said of it (rank, mobility, actuation and so on) is not true of the mechanism.
        rows: number of closure rows.
        rank, generic_rank: rank of the closures here and at almost every closed configuration nearby.
        mobility, generic_mobility: degrees of freedom here and in general.
        singular_values: of the scaled closure Jacobian here, descending [-].
        idle: freedoms that move nothing else, at rest in any motion that is driven; not counted in the mobilities.
        redundant: rows implied by the others.
        actuated: the driven joints.
        actuation: whether they determine the motion in general.
        undetermined: joints that can still move, in general, when the actuated ones are held.
        excess: number of actuated joints that follow from the others, in general.
        actuated_sets: joints that determine the motion here (nearby when here is singular), the best conditioned
            first (at most 12).
        sigma: distance to the type 2 singularity: smallest singular value of the scaled passive columns here, zero
            where the actuated joints do not determine the motion [-].
        amplification: largest passive speed per unit actuated speed here, scaled [-]; infinite at the singularity.
        roads_apart: largest difference of the motors' torques by Pinocchio and by the complement here, all motors
            moving at unit speed and acceleration, in parts of what adds up to them [-]; None where the motors do not
            determine the motion, and where there are no torques to compare.
        determinate_joints: which components of every joint's reaction are determinate (njoints - 1, 6).
        determinate_closures: the same for the closures (closures, 6), axes of frame 1; force before moment. A coupling
            of joints has no wrench and no component of one.
        determinate_rows: of every closure the rows whose multipliers are determinate.
        joints, closures: names that the rows of these two belong to.
        springs: names of the springs.
        problems: findings, the gravest first.
    """

    name: str
    q: Array
    gap: float
    closed: bool
    rows: int
    rank: int
    generic_rank: int
    mobility: int
    generic_mobility: int
    idle: tuple[Idle, ...]
    singular_values: Array
    redundant: tuple[RedundantRow, ...]
    actuated: tuple[str, ...]
    actuation: Actuation
    undetermined: tuple[str, ...]
    excess: int
    actuated_sets: tuple[ActuatedSet, ...]
    sigma: float
    amplification: float
    roads_apart: float | None
    determinate_joints: npt.NDArray[np.bool_]
    determinate_closures: npt.NDArray[np.bool_]
    determinate_rows: tuple[tuple[str, ...], ...]
    joints: tuple[str, ...]
    closures: tuple[str, ...]
    springs: tuple[str, ...]
    problems: tuple[Finding, ...]

    @property
    def ok(self) -> bool:
        """Whether nothing is wrong (warnings and notes aside)."""
        return not any(p.severity == "error" for p in self.problems)

    @property
    def is_singular(self) -> bool:
        """Whether the closures lose rank at q compared with configurations nearby."""
        return self.rank < self.generic_rank

    def determinate(self, name: str) -> str:
        """Return the determinate reaction components of a joint or closure as words, like 'fx fy mz'.

        Of a closure that has no wrench (a coupling) they are its determinate rows.

        Raises:
            UnknownNameError: neither a joint nor a closure.
        """
        known = {**dict(zip(self.closures, self.determinate_closures, strict=True))}
        known.update(zip(self.joints, self.determinate_joints, strict=True))
        if name not in known:
            raise UnknownNameError("joint or closure", name, known)
        words = [c for c, yes in zip(_COMPONENTS, known[name], strict=True) if yes]
        if not words and name in self.closures:
            words = list(self.determinate_rows[self.closures.index(name)])
        return " ".join(words)

    def __str__(self) -> str:
        return "\n".join(_lines(self))


def _lines(d: Diagnosis) -> Iterator[str]:
    yield f"{d.name}: {'ok' if d.ok else 'NOT ok'}"
    changes, general = "", ""
    if d.is_singular:
        changes, general = f" here, {d.generic_mobility} in general (singular)", f" here, {d.generic_rank} in general"
    if not d.closed:
        yield _entry("open by", f"{d.gap:.2g} m or rad at best; mobility and actuation are those of closed loops only")
        yield _entry("closures", f"{', '.join(d.closures)}: {d.rows} rows")
        yield _entry("actuated", ", ".join(d.actuated) or "none")
        yield "  findings"
        for problem in d.problems:
            yield f"    {problem}"
        return
    held = sum(len(x.rest) for x in d.idle)
    yield _entry("mobility", f"{d.mobility}{changes}{f', and {held} held at rest' if held else ''}")
    yield _entry("closures", f"{', '.join(d.closures) or 'none'}: {d.rows} rows, rank {d.rank}{general}")
    yield _entry("open by", f"{d.gap:.2g} m or rad")
    for k, row in enumerate(d.redundant):
        yield _entry("" if k else "redundant", str(row))
    yield _entry("actuated", f"{', '.join(d.actuated) or 'none'}: {d.actuation.value}")
    if d.springs:
        yield _entry("springs", ", ".join(d.springs))
    if d.undetermined and d.actuated:
        yield _entry("left free", ", ".join(d.undetermined))
    if d.actuation in (Actuation.EXACT, Actuation.OVER):
        speeds = f"passive speeds up to {d.amplification:.3g} x the actuated" if d.sigma else "reached"
        yield _entry("type 2", f"singularity at distance {d.sigma:.3g} ({speeds})")
    if d.roads_apart is not None:
        yield _entry("torques", apart_in_words(d.roads_apart))
    for k, option in enumerate(d.actuated_sets[:_SHOWN]):
        yield _entry("" if k else "could drive", f"{', '.join(option.joints)} ({option.sigma:.3g})")
    yield "  determinate reactions, in the axes of the joint or of the first closure frame"
    width = max(map(len, (*d.joints, *d.closures)), default=0)
    for name in (*d.joints, *d.closures):
        yield f"    {name:{width}s}  {d.determinate(name) or 'none'}"
    yield "  findings" if d.problems else _entry("findings", "none")
    for problem in d.problems:
        yield f"    {problem}"


def apart_in_words(apart: float) -> str:
    """Say how far the torques by the two roads lie apart, in parts of what adds up to them."""
    return f"by Pinocchio and by the complement differ by {apart:.1g} of what adds up to them"


def _entry(label: str, text: str) -> str:
    return f"  {label:11s}  {text}"
