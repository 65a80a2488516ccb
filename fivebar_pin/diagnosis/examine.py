"""Diagnosis: what the closures of a chain allow, whether its motors determine it, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, checked, frozen, integer
from fivebar_pin.chain import ClosedChain
from fivebar_pin.diagnosis import inertias
from fivebar_pin.diagnosis.report import ActuatedSet, Actuation, Diagnosis, Finding, RedundantRow, Severity
from fivebar_pin.dynamics.reactions import reactions
from fivebar_pin.mechanism import mobility
from fivebar_pin.mechanism.closing import CLOSED, closed_enough, residual_of
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.loops import Loops, loops_of
from fivebar_pin.mechanism.rank import SINGULAR, Decomposed, singular_values
from fivebar_pin.trajectory import Trajectory

__all__ = ["ActuatedSet", "Actuation", "Diagnosis", "Finding", "RedundantRow", "diagnose"]

_CLOSED = 1e-9  # closure residual up to which a given configuration counts as closed [m or rad]
_NEAR = 1e-2  # distance to a type 2 singularity that is worth a warning [-]
_STILL = 1e-8  # scaled speed below which a joint counts as standing still [-]
_SETS = 12  # actuated sets listed
_ORDER: tuple[Severity, ...] = ("error", "warning", "note")


def diagnose(chain: ClosedChain, q: npt.ArrayLike | None = None, *, seed: int = 0) -> Diagnosis:
    """Examine a closed chain: mobility, rank, redundancy, actuation, singularity, reactions, inertias.

    Args:
        chain: the mechanism.
        q: configuration (nq,). When the loops are open there, the diagnosis says by how much and holds for the closed
            configuration found from it. Without it a regular closed configuration is looked for.
        seed: of the random search and of the walk to generic configurations.

    Returns:
        The diagnosis. What is wrong with the chain is in its `problems`; only bad arguments raise.

    Raises:
        InvalidInputError: q of the wrong shape or not finite.
    """
    integer("seed", seed)
    loops = loops_of(chain)
    findings: list[Finding] = []
    start, gap = _start(chain, q, seed, findings)
    here = mobility.site_at(loops, start)
    generic = mobility.generic_site(chain, here, seed, CLOSED) if _is_closed(loops, start) else here
    if q is None and here.rank < generic.rank:
        findings.append(Finding("warning", _jump(chain, here, generic, "the configuration nearest to the neutral one")))
        here, gap = generic, float(generic.gap[0])
    actuation, undetermined, excess = _actuation(chain, generic)
    sets = mobility.determining_sets(chain, generic if here.rank < generic.rank else here, _SETS)
    redundant = _redundant_rows(loops, here, generic)
    sigma = mobility.passive_sigma(loops, here.J[0], loops.actuated)
    joints, closures, multipliers = _determinate(chain, here.q[0])
    findings += _about_mobility(chain, here, generic, redundant)
    findings += _about_actuation(chain, actuation, undetermined, excess, sets, generic)
    findings += _about_singularity(chain, here, generic, actuation, sigma)
    findings += _about_parts(chain, here, generic)
    findings += _about_inertia(chain, generic)
    return Diagnosis(
        name=chain.name,
        q=frozen(here.q[0]),
        gap=gap,
        rows=loops.m,
        rank=here.rank,
        generic_rank=generic.rank,
        mobility=chain.nv - here.rank,
        generic_mobility=chain.nv - generic.rank,
        singular_values=frozen(singular_values(loops.scaled(here.J[0]))),
        redundant=redundant,
        actuated=chain.actuated,
        actuation=actuation,
        undetermined=undetermined,
        excess=excess,
        actuated_sets=tuple(ActuatedSet(names, value) for names, value in sets),
        sigma=sigma,
        amplification=_amplification(loops, here.J[0], sigma),
        determinate_joints=joints,
        determinate_closures=closures,
        determinate_rows=multipliers,
        joints=chain.joints,
        closures=tuple(c.name for c in chain.closures),
        springs=tuple(s.name for s in chain.springs),
        problems=tuple(sorted(findings, key=lambda f: _ORDER.index(f.severity))),
    )


def _is_closed(loops: Loops, q: Array) -> bool:
    return bool(closed_enough(loops, mobility.gap(loops, q[None]), _CLOSED)[0])


def _start(chain: ClosedChain, q: npt.ArrayLike | None, seed: int, findings: list[Finding]) -> tuple[Array, float]:
    """Return a closed configuration to look at and the gap of the one asked for; report what is open."""
    loops = loops_of(chain)
    if q is None:
        found, gap = mobility.first_closed(chain, seed, CLOSED)
        asked, opened = found, gap
    else:
        asked = checked("q", q, (chain.nq,))
        asked = np.array(pin.normalize(chain.model, asked))
        found = mobility.close(chain, asked[None], CLOSED)[0][0]
        opened, gap = (float(mobility.gap(loops, x[None])[0]) for x in (found, asked))
        if not _is_closed(loops, asked):
            name, size = loops.worst(residual_of(loops, asked[None])[0])
            findings.append(
                Finding(
                    "error",
                    f"the loops are open at the given configuration: closure {name} by {size:.3g} m or rad. "
                    "assemble(chain, ...) closes them; what follows holds for the closest configuration found.",
                )
            )
    poses = loops.tree.poses(found[None])
    if loops.m and not closed_enough(loops, np.array([opened]), _CLOSED)[0]:
        name, size = loops.worst(residual_of(loops, found[None])[0])
        findings.append(
            Finding(
                "error",
                f"no configuration that closes the loops was found: closure {name} stays open by {size:.3g} m or rad. "
                "Check the lengths and the frames of the closures.",
            )
        )
    elif loops.m and loops.opposed(loops.pairs(poses))[0]:
        findings.append(
            Finding(
                "error", "a hinge closes back to front: its two axes point against each other. Turn one frame over."
            )
        )
    return found, gap


def _redundant_rows(loops: Loops, here: Configurations, generic: Configurations) -> tuple[RedundantRow, ...]:
    names = [(c.name, row) for c in loops.closures for row in c.row_names]
    always, extra = mobility.redundant_combinations(loops, here)
    beyond: str = "here" if here.rank < generic.rank else "closed"
    out = []
    for scope, combinations in (("always", always), (beyond, extra)):
        for weights in combinations:
            pivot = int(np.argmax(np.isclose(np.abs(weights), 1.0) & (np.sum(combinations != 0.0, axis=0) == 1)))
            named = {f"{c}.{r}": float(w) for (c, r), w in zip(names, weights, strict=True) if w != 0.0}
            out.append(RedundantRow(*names[pivot], scope=scope, weights=named))  # type: ignore[arg-type]
    return tuple(out)


def _actuation(chain: ClosedChain, site: Configurations) -> tuple[Actuation, tuple[str, ...], int]:
    """Return the verdict, the joints left free when the actuated ones are held, and the number of motors too many."""
    loops = loops_of(chain)
    Jp = mobility.held(site.J[0], loops.actuated)
    free = int(loops.passive.size - loops.rank(Jp))
    excess = chain.na - (chain.nv - site.rank - free)
    undetermined: tuple[str, ...] = ()
    if free:
        scaled = loops.scaled(Jp)[:, loops.passive]
        loose = Decomposed.of(scaled[None]).tangent(loops.passive.size - free)[0]
        undetermined = _owners(chain, loops.passive[np.abs(loose).max(axis=1) > _STILL])
    if not chain.na:
        return Actuation.NONE, undetermined, excess
    if free:
        return (Actuation.CONFLICT if excess else Actuation.UNDER), undetermined, excess
    return (Actuation.OVER if excess else Actuation.EXACT), undetermined, excess


def _amplification(loops: Loops, J: Array, sigma: float) -> float:
    if not loops.passive.size or not loops.actuated.size:
        return 0.0
    if sigma == 0.0:
        return float("inf")
    scaled = loops.scaled(J)
    passive = Decomposed.of(scaled[None][:, :, loops.passive])
    return float(np.abs(passive.solve(scaled[:, loops.actuated].T, loops.passive.size)).max())


def _determinate(
    chain: ClosedChain, q: Array
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_], tuple[tuple[str, ...], ...]]:
    """Return which reaction components of joints and closures, and which rows of these, are not marked as open."""
    rest = np.zeros((1, chain.nv))
    still = Trajectory(np.zeros(1), q[None], rest, rest, np.zeros((1, chain.nv, chain.na)), np.zeros(1))
    bare = chain.with_springs(()) if chain.springs else chain  # what is open does not depend on what pulls
    found = reactions(bare, still, rest, np.zeros((1, chain.na)), {})
    joints, closures = np.isfinite(found.joint_local[0]), np.isfinite(found.closure_local[0])
    closures[[not c.ends for c in chain.closures]] = False  # a coupling of joints has no wrench
    for mask in (joints, closures):
        mask.setflags(write=False)
    rows = [
        tuple(name for name, yes in zip(c.closure.row_names, found.determinate_rows[0, c.rows], strict=True) if yes)
        for c in loops_of(chain).anchored
    ]
    return joints, closures, tuple(rows)


def _jump(chain: ClosedChain, here: Configurations, generic: Configurations, where: str) -> str:
    return (
        f"{where} is singular: mobility {chain.nv - here.rank} instead of {chain.nv - generic.rank}. Several assembly "
        "modes meet there and the motion can go on along any of them. Start from, and stay at, other configurations."
    )


def _about_mobility(
    chain: ClosedChain, here: Configurations, generic: Configurations, redundant: tuple[RedundantRow, ...]
) -> Iterator[Finding]:
    if not chain.closures:
        yield Finding("note", "there are no closures: this is an open tree")
    if chain.nv == generic.rank:
        yield Finding("error", "the mechanism cannot move: mobility 0. A closure or its kind is too much.")
    if here.rank < generic.rank:
        yield Finding("error", _jump(chain, here, generic, "this configuration"))
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


def _about_actuation(
    chain: ClosedChain,
    actuation: Actuation,
    undetermined: tuple[str, ...],
    excess: int,
    sets: list[tuple[tuple[str, ...], float]],
    generic: Configurations,
) -> Iterator[Finding]:
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


def _about_singularity(
    chain: ClosedChain, here: Configurations, generic: Configurations, actuation: Actuation, sigma: float
) -> Iterator[Finding]:
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


def _about_parts(chain: ClosedChain, here: Configurations, generic: Configurations) -> Iterator[Finding]:
    loops, model = loops_of(chain), chain.model
    looped = np.zeros(chain.nv, dtype=np.bool_)
    for anchored in loops.anchored:
        looped[anchored.columns] = True
    looped[loops.actuated] = True
    loose = _owners(chain, np.flatnonzero(~looped))
    if loose and chain.na:
        yield Finding("warning", f"no closure and no motor touches {', '.join(loose)}")
    parts = _parts(chain)
    if len(parts) > 1:
        each = "; ".join(", ".join(part) for part in parts)
        yield Finding("note", f"there are {len(parts)} parts that do not act on each other's motion: {each}")
    passive = [int(k) for k in loops.passive]
    locked = [k for k in passive if _is_still(generic, k)]
    if locked and chain.nv > generic.rank:
        yield Finding("note", f"the closures never let {', '.join(_owners(chain, np.array(locked)))} move")
    dead = [k for k in passive if k not in locked and _is_still(here, k)]
    if dead:
        yield Finding("note", f"{', '.join(_owners(chain, np.array(dead)))} stands still here (dead point)")
    lower, upper = np.array(model.lowerPositionLimit), np.array(model.upperPositionLimit)
    outside = np.flatnonzero((here.q[0] < lower - _CLOSED) | (here.q[0] > upper + _CLOSED))
    if outside.size:
        owners = [j for j in range(1, model.njoints) if np.isin(outside, _columns_q(model, j)).any()]
        names = ", ".join(model.names[j] for j in owners)
        yield Finding("warning", f"the configuration is outside the limits of {names}")


def _about_inertia(chain: ClosedChain, site: Configurations) -> Iterator[Finding]:
    for severity, text in inertias.inertia_problems(chain, inertias.normals(chain, site)):
        yield Finding("warning" if severity == "warning" else "error", text)
    text = inertias.mass_problem(chain, site)
    if text:
        yield Finding("error", text)


def _is_still(site: Configurations, k: int) -> bool:
    return bool(np.abs(site.free[0, k]).max(initial=0.0) < _STILL)


def _owners(chain: ClosedChain, columns: npt.NDArray[np.intp]) -> tuple[str, ...]:
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


def _columns_q(model: pin.Model, j: int) -> npt.NDArray[np.intp]:
    return np.arange(model.idx_qs[j], model.idx_qs[j] + model.joints[j].nq)
