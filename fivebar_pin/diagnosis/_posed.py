"""Whether some closures make a well-posed mechanism of a tree, and which kind of closure suits a loop."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain
from fivebar_pin.closures import Closure
from fivebar_pin.diagnosis.findings import STILL, owners_of
from fivebar_pin.mechanism import mobility
from fivebar_pin.mechanism.closing import CLOSED, closed_enough
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.loops import Loops, loops_of
from fivebar_pin.mechanism.plane import plane_normal

__all__ = ["Posed", "is_planar", "judge"]


_OVER = "the loop is overconstrained: it closes only with these exact dimensions"


@dataclass(frozen=True, slots=True, eq=False)
class Posed:
    """What closures make of a tree.

    Attributes:
        problems: what is wrong, by the index of the closure it is about.
        q: configuration that closes them best (nq,).
        mobility: freedoms left in general; -1 when they cannot be closed.
        gap: what the worst of them stays open by then [m or rad], else 0.
    """

    problems: dict[int, str]
    q: Array
    mobility: int
    gap: float = 0.0

    @property
    def only_over(self) -> bool:
        """Whether nothing is wrong but that some closures hold only with these exact dimensions."""
        return all(text == _OVER for text in self.problems.values())


def judge(chain: ClosedChain, closures: Iterable[Closure], starts: list[Array]) -> Posed:
    """Close the loops from some configurations, else from random ones, and look at what is left to move."""
    closed = replace(chain, closures=tuple(closures), actuated=())
    loops = loops_of(closed)
    q, found = _close(closed, starts)
    if not found:
        gaps = _gaps(loops, q)
        worst = int(np.argmax(gaps))
        text = f"the loop cannot be closed; it stays open by {gaps[worst]:.2g} m or rad"
        return Posed({worst: text}, q, -1, gaps[worst])
    site = mobility.generic_site(closed, mobility.site_at(loops, q), 0, CLOSED)
    return Posed(_problems(closed, loops, site), q, closed.nv - site.rank)


def _close(chain: ClosedChain, starts: list[Array]) -> tuple[Array, bool]:
    loops = loops_of(chain)
    q, residual = mobility.close_all(chain, np.stack(starts), CLOSED)
    good = closed_enough(loops, residual, CLOSED)
    if good.any():
        return q[int(np.argmax(good))], True
    best, gap = mobility.first_closed(chain, 0, CLOSED)
    return best, bool(closed_enough(loops, np.array([gap]), CLOSED)[0])


def _gaps(loops: Loops, q: Array) -> list[float]:
    residual = loops.see(q[None]).residual[0]
    return [float(np.abs(residual[c.rows]).max()) for c in loops.anchored]


def _problems(chain: ClosedChain, loops: Loops, site: Configurations) -> dict[int, str]:
    """Say what is wrong with each closure at a generic configuration."""
    out: dict[int, str] = {}
    for k, c in enumerate(loops.anchored):
        without = np.array(site.J[0])
        without[c.rows] = 0.0
        if not c.columns.size or not np.abs(site.J[0][c.rows]).max(initial=0.0) > STILL:
            out[k] = "no joint moves the two frames apart: it would hold nothing"
        elif np.abs(site.free[0][c.columns]).max(initial=0.0) < STILL:
            out[k] = f"it would lock {', '.join(owners_of(chain, c.columns))}"
        elif loops.rank(without) == site.rank:
            out[k] = "it follows from the other closures: it takes no freedom away"
        elif site.rank < loops.r and _is_over(loops, site, c.rows):
            out[k] = _OVER
    return out


def _is_over(loops: Loops, site: Configurations, rows: slice) -> bool:
    """Whether rows of this closure take part in a dependence that holds only where the loops are closed."""
    _, closed = mobility.redundant_combinations(loops, site)
    return bool(np.any(closed[:, rows]))


def is_planar(chain: ClosedChain, joints: tuple[int, int]) -> bool:
    """Whether everything between two bodies moves in one plane, whatever the configuration."""
    loops = loops_of(replace(chain, closures=(), actuated=()))
    rng = np.random.default_rng(0)
    q = pin.integrate(chain.model, pin.neutral(chain.model), rng.uniform(-1.0, 1.0, chain.nv))
    moved = np.flatnonzero(loops.tree.support[joints[0]] != loops.tree.support[joints[1]])
    S = loops.tree.poses(q[None]).S[0][:, moved]
    return plane_normal(S[None], chain.length) is not None
