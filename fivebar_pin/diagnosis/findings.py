"""What a diagnosis finds worth saying: about mobility, motors, singularities, parts and inertias."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from fivebar_pin.chain import ClosedChain
from fivebar_pin.chain.coordinates import q_slice, v_slice
from fivebar_pin.diagnosis import inertias
from fivebar_pin.diagnosis.report import Actuation, Finding, RedundantRow
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.idle import Idle, Kind
from fivebar_pin.mechanism.loops import IF_ROUNDED, loops_of
from fivebar_pin.mechanism.mobility import beyond
from fivebar_pin.mechanism.rank import SINGULAR

__all__ = [
    "GIVEN",
    "STILL",
    "about_actuation",
    "about_idle",
    "about_inertia",
    "about_mobility",
    "about_parts",
    "about_roads",
    "about_singularity",
    "jump",
    "owners_of",
]


GIVEN = 1e-9  # residual up to which a given configuration counts as closed [m or rad]
STILL = 1e-8  # scaled speed below which a joint counts as standing still [-]
_NEAR = 1e-2  # distance to a type 2 singularity that is worth a warning [-]
_ROADS = 1e-9  # difference of the two roads of inverse dynamics, of what adds up, that is no round-off [-]


def jump(chain: ClosedChain, here: Configurations, generic: Configurations, where: str) -> str:
    """Say that a configuration, named by `where`, is singular."""
    return (
        f"{where} is singular: mobility {chain.nv - here.rank} instead of {chain.nv - generic.rank}. Several assembly "
        "modes meet there and the motion can go on along any of them. Start from, and stay at, other configurations."
    )


def about_idle(idle: tuple[Idle, ...]) -> Iterator[Finding]:
    """Name the freedoms that move nothing else."""
    for x in idle:
        if x.kind == Kind.PROP:
            yield Finding("note", f"{x}: left out of the count")
        elif x.kind == Kind.BASE:
            yield Finding("note", f"{x}: held where it stands unless it is simulated")
        else:
            yield Finding(
                "warning" if x.kind in (Kind.LOOSE, Kind.SPRUNG) else "note",
                f"{x}: held at rest unless it is simulated",
            )


def about_mobility(
    chain: ClosedChain,
    here: Configurations,
    generic: Configurations,
    redundant: tuple[RedundantRow, ...],
    *,
    is_tree: bool,
) -> Iterator[Finding]:
    """Find what keeps the mechanism from moving, or from moving in one way, and rows that are too many."""
    if is_tree:
        yield Finding("note", "there are no closures: this is an open tree")
    if chain.nv == generic.rank:
        stuck = "the mechanism cannot move: mobility 0. A closure or its kind is too much."
        yield Finding("error", f"{stuck} {IF_ROUNDED}")
    if here.rank < generic.rank:
        yield Finding("error", jump(chain, here, generic, "this configuration"))
    always, closed = ([r for r in redundant if r.scope == scope] for scope in ("always", "closed"))
    if always:
        names = ", ".join(f"{r.closure}.{r.row}" for r in always)
        yield Finding("note", f"redundant rows {names}: the reactions they share with the joints are not determinate")
    if closed:
        names = ", ".join(f"{r.closure}.{r.row}" for r in closed)
        yield Finding(
            "warning",
            f"overconstrained: {names} follow from the other rows wherever the loops are closed. The mechanism moves "
            "only with these exact dimensions; loosen the closure if that is not meant.",
        )
    for closure, anchored in zip(chain.closures, loops_of(chain).anchored, strict=True):
        if not anchored.columns.size:
            yield Finding("warning", f"closure {closure.name} joins bodies that no joint moves apart: it holds nothing")


def about_actuation(
    chain: ClosedChain,
    actuation: Actuation,
    undetermined: tuple[str, ...],
    excess: int,
    sets: list[tuple[tuple[str, ...], float]],
    generic: Configurations,
) -> Iterator[Finding]:
    """Find motors that are missing or too many."""
    names = ", ".join(chain.actuated)
    way_out = (
        f" Actuate for example {', '.join(sets[0][0])}."
        if sets
        else " No set of joints with one degree of freedom determines the motion."
    )
    if actuation is Actuation.NONE:
        yield Finding("note", f"no joint is actuated: the mechanism can be simulated, not driven.{way_out}")
        return
    if undetermined:
        yield Finding("error", f"with {names} held, {', '.join(undetermined)} can still move.{way_out}")
    if excess:
        locked = [n for n, k in zip(chain.actuated, chain.actuated_index, strict=True) if _is_still(generic, k)]
        why = (
            f"{', '.join(locked)} cannot move at all"
            if locked
            else f"only {chain.na - excess} of {names} can move freely"
        )
        yield Finding("error", f"{excess} actuated joint(s) too many: {why}.{way_out}")


def about_singularity(
    chain: ClosedChain, here: Configurations, generic: Configurations, actuation: Actuation, sigma: float
) -> Iterator[Finding]:
    """Find a type 2 singularity here or near."""
    if actuation not in (Actuation.EXACT, Actuation.OVER) or here.rank < generic.rank or sigma >= _NEAR:
        return
    if sigma < SINGULAR:
        yield Finding(
            "error",
            f"this configuration is a type 2 singularity: with {', '.join(chain.actuated)} held the mechanism still "
            f"moves (smallest scaled singular value {sigma:.2g}). Move away from it, or drive other joints.",
        )
    else:
        yield Finding(
            "warning",
            f"a type 2 singularity is near: smallest scaled singular value {sigma:.2g}; torques and passive speeds get "
            "large here",
        )


def about_roads(apart: float | None) -> Iterator[Finding]:
    """Find that the torques by the two roads are not the same."""
    if apart is not None and not apart <= _ROADS:
        yield Finding(
            "error",
            f"torques by Pinocchio and by the complement differ by {apart:.2g} of what adds up to them: neither is to "
            "be trusted here. Check the inertias and placements of the model for numbers that lie far apart.",
        )


def about_parts(
    chain: ClosedChain, here: Configurations, generic: Configurations, idle: tuple[Idle, ...]
) -> Iterator[Finding]:
    """Find joints that nothing holds, that cannot move, that stand still here or are outside their limits."""
    loops, model = loops_of(chain), chain.model
    looped = np.zeros(chain.nv, dtype=np.bool_)
    for anchored in loops.anchored:
        looped[anchored.columns] = True
    looped[loops.actuated] = True
    loose = owners_of(chain, np.flatnonzero(~looped))
    if loose and chain.na:
        yield Finding("warning", f"no closure and no motor touches {', '.join(loose)}")
    parts = _parts(chain)
    if len(parts) > 1:
        each = "; ".join(", ".join(part) for part in parts)
        yield Finding("note", f"there are {len(parts)} parts that do not act on each other's motion: {each}")
    resting = {k for x in idle for k in range(chain.nv)[v_slice(model, model.getJointId(x.joint))]}
    passive = [int(k) for k in loops.passive if int(k) not in resting]
    locked = [k for k in passive if _is_still(generic, k)]
    if locked and chain.nv > generic.rank:
        yield Finding("note", f"the closures never let {', '.join(owners_of(chain, np.array(locked)))} move")
    dead = [k for k in passive if k not in locked and _is_still(here, k)]
    if dead:
        yield Finding("note", f"{', '.join(owners_of(chain, np.array(dead)))} stands still here (dead point)")
    outside = beyond(here.q[0], np.array(model.lowerPositionLimit), np.array(model.upperPositionLimit))
    if outside.any():
        owners = [j for j in range(1, model.njoints) if outside[q_slice(model, j)].any()]
        names = ", ".join(model.names[j] for j in owners)
        yield Finding("warning", f"the configuration is outside the limits of {names}")


def about_inertia(chain: ClosedChain, site: Configurations, closed: bool) -> Iterator[Finding]:
    """Find bodies that cannot be, that have no mass and, where the loops are closed, motions without inertia."""
    for severity, text in inertias.inertia_problems(chain, inertias.normals(chain, site)):
        yield Finding("warning" if severity == "warning" else "error", text)
    massless = inertias.massless_bodies(chain)
    if massless:
        yield Finding("note", f"without mass: {', '.join(massless)}")
    text = inertias.mass_problem(chain, site) if closed else ""
    if text:
        yield Finding("error", text)


def _is_still(site: Configurations, k: int) -> bool:
    return bool(np.abs(site.free[0, k]).max(initial=0.0) < STILL)


def owners_of(chain: ClosedChain, columns: npt.NDArray[np.intp]) -> tuple[str, ...]:
    """Return the joints that velocity indices belong to, each once, in the order of the tree."""
    first = np.array(chain.model.idx_vs)
    widths = np.array([joint.nv for joint in chain.model.joints])
    hit = [j for j in range(1, chain.model.njoints) if np.any((columns >= first[j]) & (columns < first[j] + widths[j]))]
    return tuple(chain.model.names[j] for j in hit)


def _parts(chain: ClosedChain) -> list[tuple[str, ...]]:
    """Group the joints that hang on, or are closed with, each other; the ground does not connect."""
    model = chain.model
    group = list(range(model.njoints))

    def find(j: int) -> int:
        while group[j] != j:
            j = group[j]
        return j

    links = [(j, int(model.parents[j])) for j in range(1, model.njoints)]
    links += [pair for c in loops_of(chain).anchored for pair in zip(c.tied, c.tied[1:], strict=False)]
    for a, b in links:
        if a and b:
            group[find(a)] = find(b)
    roots = sorted({find(j) for j in range(1, model.njoints)})
    return [tuple(model.names[j] for j in range(1, model.njoints) if find(j) == root) for root in roots]
