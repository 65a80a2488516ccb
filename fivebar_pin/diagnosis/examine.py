"""Diagnosis: what the closures of a chain allow, whether its motors determine it, and what is wrong with it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, checked, frozen, integer
from fivebar_pin.chain import ClosedChain
from fivebar_pin.diagnosis.findings import (
    GIVEN,
    STILL,
    about_actuation,
    about_idle,
    about_inertia,
    about_mobility,
    about_parts,
    about_roads,
    about_singularity,
    jump,
    owners_of,
)
from fivebar_pin.diagnosis.report import ActuatedSet, Actuation, Diagnosis, Finding, RedundantRow, Severity
from fivebar_pin.dynamics.inverse import roads_apart
from fivebar_pin.dynamics.reactions import reactions
from fivebar_pin.errors import InvalidInputError, SolverError
from fivebar_pin.mechanism import mobility
from fivebar_pin.mechanism.closing import CLOSED, closed_enough, residual_of
from fivebar_pin.mechanism.complement import rates_of
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.idle import at_rest, idle_freedoms
from fivebar_pin.mechanism.loops import Loops, loops_of, rounded
from fivebar_pin.mechanism.rank import SINGULAR, Decomposed, singular_values
from fivebar_pin.trajectory import Trajectory

__all__ = ["ActuatedSet", "Actuation", "Diagnosis", "Finding", "RedundantRow", "diagnose"]

Mask = npt.NDArray[np.bool_]

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
    bare, chain = chain, at_rest(chain)
    rests = len(chain.closures) - len(bare.closures)
    idle = idle_freedoms(bare) if rests else ()
    loops = loops_of(chain)
    findings: list[Finding] = []
    start, gap = _start(chain, q, seed, findings)
    here = mobility.site_at(loops, start)
    generic = mobility.generic_site(chain, here, seed, CLOSED) if _is_closed(loops, start) else here
    if q is None and here.rank < generic.rank:
        findings.append(Finding("warning", jump(chain, here, generic, "the configuration nearest to the neutral one")))
        here, gap = generic, float(generic.gap[0])
    determinate = _determinate(bare, here.q[0])
    if q is None and here is not generic:
        usual = _determinate(bare, generic.q[0])
        if any(np.any(there & ~then) for there, then in zip(determinate, usual, strict=True)):
            # The neutral configuration lies flat: rows that share a load elsewhere have none to share there.
            here, gap, determinate = generic, float(generic.gap[0]), usual
    actuation, undetermined, excess = _actuation(chain, generic)
    sets = mobility.determining_sets(chain, generic if here.rank < generic.rank else here, _SETS)
    redundant = _redundant_rows(loops, here, generic)
    sigma = mobility.passive_sigma(loops, here.J[0], loops.actuated)
    apart = _roads_apart(chain, here) if actuation is Actuation.EXACT and sigma >= SINGULAR else None
    closed = _is_closed(loops, start)
    if closed:
        findings += about_roads(apart)
        findings += about_idle(idle)
        findings += about_mobility(chain, here, generic, redundant, is_tree=not bare.closures)
        findings += about_actuation(chain, actuation, undetermined, excess, sets, generic)
        findings += about_singularity(chain, here, generic, actuation, sigma)
        findings += about_parts(chain, here, generic, idle)
    findings += about_inertia(chain, generic, closed)
    return Diagnosis(
        name=chain.name,
        q=frozen(here.q[0]),
        gap=gap,
        closed=closed,
        rows=loops.m - rests,
        rank=here.rank - rests,
        generic_rank=generic.rank - rests,
        mobility=chain.nv - here.rank,
        generic_mobility=chain.nv - generic.rank,
        idle=idle,
        singular_values=frozen(singular_values(loops.scaled(here.J[0])[: loops.m - rests])),
        redundant=redundant,
        actuated=chain.actuated,
        actuation=actuation,
        undetermined=undetermined,
        excess=excess,
        actuated_sets=tuple(ActuatedSet(names, value) for names, value in sets),
        sigma=sigma,
        amplification=_amplification(loops, here.J[0], sigma),
        roads_apart=apart,
        determinate_joints=determinate[0],
        determinate_closures=determinate[1],
        determinate_rows=tuple(
            tuple(name for name, yes in zip(c.closure.row_names, determinate[2][c.rows], strict=True) if yes)
            for c in loops_of(bare).anchored
        ),
        joints=chain.joints,
        closures=tuple(c.name for c in bare.closures),
        springs=tuple(s.name for s in chain.springs),
        problems=tuple(sorted(findings, key=lambda f: _ORDER.index(f.severity))),
    )


def _is_closed(loops: Loops, q: Array) -> bool:
    return bool(closed_enough(loops, mobility.gap(loops, q[None]), GIVEN)[0])


def _start(chain: ClosedChain, q: npt.ArrayLike | None, seed: int, findings: list[Finding]) -> tuple[Array, float]:
    """Return a closed configuration to look at and the gap of the one asked for; report what is open."""
    loops = loops_of(chain)
    if q is None:
        found, gap = mobility.first_closed(chain, seed, CLOSED)
        asked, opened = found, gap
    else:
        asked = checked("q", q, (chain.nq,))
        asked = np.array(pin.normalize(chain.model, asked))
        found = mobility.closed_from(chain, asked, CLOSED)
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
    if loops.m and not closed_enough(loops, np.array([opened]), GIVEN)[0]:
        name, size = loops.worst(residual_of(loops, found[None])[0])
        findings.append(
            Finding(
                "error",
                f"no configuration that closes the loops was found: closure {name} stays open by {size:.3g} m or rad. "
                f"Check {loops.what_to_check}.{rounded(loops, size)}",
            )
        )
    elif loops.m and loops.opposed(loops.see(found[None]))[0]:
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
    Jp = mobility.with_held(site.J[0], loops.actuated)
    free = int(loops.passive.size - loops.rank(Jp))
    excess = chain.na - (chain.nv - site.rank - free)
    undetermined: tuple[str, ...] = ()
    if free:
        scaled = loops.scaled(Jp)[:, loops.passive]
        loose = Decomposed.of(scaled[None]).tangent(loops.passive.size - free)[0]
        undetermined = owners_of(chain, loops.passive[np.abs(loose).max(axis=1) > STILL])
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


def _roads_apart(chain: ClosedChain, site: Configurations) -> float | None:
    """Return how far the two roads of inverse dynamics lie apart, all motors moving at unit speed and acceleration.

    None where they have no torques to compare: springs whose ends meet, numbers beyond double precision.
    """
    unit = loops_of(chain).column_scale[chain.actuated_index][None]
    try:
        v, a, N = rates_of(site, unit, unit)
        return roads_apart(chain, Trajectory(np.zeros(1), site.q, v, a, N, site.gap))
    except (InvalidInputError, SolverError):
        return None


def _determinate(chain: ClosedChain, q: Array) -> tuple[Mask, Mask, Mask]:
    """Return which reaction components of joints and closures, and which rows of these, are not marked as open."""
    rest = np.zeros((1, chain.nv))
    still = Trajectory(np.zeros(1), q[None], rest, rest, np.zeros((1, chain.nv, chain.na)), np.zeros(1))
    bare = chain.with_springs(()) if chain.springs else chain  # what is open does not depend on what pulls
    found = reactions(bare, still, rest, np.zeros((1, chain.na)), {})
    joints, closures = np.isfinite(found.joint_local[0]), np.isfinite(found.closure_local[0])
    closures[[not c.ends for c in chain.closures]] = False  # a coupling of joints has no wrench
    for mask in (joints, closures):
        mask.setflags(write=False)
    return joints, closures, found.determinate_rows[0]
