"""Freedoms that move nothing else: rods that spin about their own axis, bodies that no closure and no motor touches.

They say nothing of how a mechanism moves, but leave its motion undetermined. Joints that only a spring holds do, too,
and are taken for as stiff as their springs where that is all that is missing. A motion holds them at rest: beside the
closures of the chain stand rows of velocities alone, see `closures.rest`. Nothing holds them in a simulation.

A freedom of that kind lives in the coordinates of the one or two joints (hinges about one point count as one) at which
what moves hangs on the rest, on one branch of the tree or on two: it is looked for there, at a generic closed
configuration.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from itertools import combinations

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, Immutable
from fivebar_pin.chain import ClosedChain
from fivebar_pin.closures import Closure
from fivebar_pin.closures.rest import Spin, Still
from fivebar_pin.mechanism import mobility
from fivebar_pin.mechanism.closing import CLOSED, closed_enough
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.loops import Loops, loops_of
from fivebar_pin.mechanism.per_chain import once_per_chain
from fivebar_pin.mechanism.rank import ranks_of, singular_values
from fivebar_pin.springs import JointSpring

__all__ = ["Idle", "Kind", "at_rest", "carried_by_rests", "idle_freedoms"]

_VANISHING = 1e-8  # scaled speed of a unit freedom that is round-off [-]
_ONE_POINT = 1e-9  # distance of two joints that turn about one point [chain lengths]
_REST = "at rest "

_Columns = npt.NDArray[np.intp]


class Kind(Enum):
    """What is idle: bodies that spin or slide; a joint that a spring alone, or nothing, holds; a base; a prop."""

    SPIN = "spin"
    SLIDE = "slide"
    SPRUNG = "sprung"
    LOOSE = "loose"
    BASE = "base"
    PROP = "prop"


@dataclass(frozen=True, slots=True, eq=False)
class Idle(Immutable):
    """A freedom that moves nothing else.

    Attributes:
        kind: what it is.
        joint: in whose coordinates it is.
        bodies: names of the bodies that it moves.
        rest: what holds it at rest.
    """

    kind: Kind
    joint: str
    bodies: tuple[str, ...]
    rest: tuple[Closure, ...]

    def __str__(self) -> str:
        names = " and ".join((", ".join(self.bodies[:-1]), self.bodies[-1])) if len(self.bodies) > 1 else self.bodies[0]
        alone = len(self.bodies) == 1
        return {
            Kind.SPIN: f"{names} may spin about {'its own axis' if alone else 'one axis together'}",
            Kind.SLIDE: f"{names} may slide{'' if alone else ' together'}",
            Kind.SPRUNG: f"its spring alone holds {self.joint}",
            Kind.LOOSE: f"no closure and no motor touches {self.joint}",
            Kind.BASE: f"the base floats on {self.joint}",
            Kind.PROP: f"no closure and no motor touches the free body {names}",
        }[self.kind]


def at_rest(chain: ClosedChain) -> ClosedChain:
    """Return the chain with what holds its idle freedoms at rest, itself where it has none.

    Columns, frames and joints are those of the chain; frames and closures may follow behind its own. Where there are
    no motors, a loose or sprung joint or a floating base is not held: nothing tells it from any other.
    """
    held = _held(chain)
    return chain if held is None else held


def carried_by_rests(chain: ClosedChain) -> Iterator[tuple[int, int]]:
    """Yield what holds bodies at rest, by its number among the closures of a chain, and the joints that it acts in.

    What holds a body at rest acts between it and what carries it, in the joints between the two.
    """
    for k, anchored in enumerate(loops_of(chain).anchored):
        if isinstance(anchored.closure, Spin):
            carrier, j = anchored.joints
            while j != carrier:
                yield k, j
                j = int(chain.model.parents[j])


@once_per_chain
def _held(chain: ClosedChain) -> ClosedChain | None:
    if not loops_of(chain).lacking:
        return None
    held = [x for x in idle_freedoms(chain) if chain.na or x.kind not in (Kind.SPRUNG, Kind.LOOSE, Kind.BASE)]
    rests = [rest for idle in held for rest in idle.rest]
    return _with(chain, rests) if rests else None


def _with(chain: ClosedChain, rests: Sequence[Closure]) -> ClosedChain:
    """Return a chain with further rows, and with the frames that they are between."""
    model = chain.model.copy()
    rests = [replace(rest, name=f"{rest.name} at rest ({k})") for k, rest in enumerate(rests)]
    for rest in rests:
        if isinstance(rest, Spin):
            j = int(rest.frames[1].removeprefix(_REST))
            carrier = int(rest.frames[0].removeprefix(_REST + "beside "))
            origin = np.array(model.jointPlacements[1].translation) if carrier == 0 else np.zeros(3)
            for name, joint, place in ((rest.frames[0], carrier, origin), (rest.frames[1], j, np.zeros(3))):
                if not model.existFrame(name):
                    model.addFrame(pin.Frame(name, joint, 0, pin.SE3(np.eye(3), place), pin.FrameType.OP_FRAME))
    return replace(chain, model=model, closures=(*chain.closures, *rests))


@once_per_chain
def idle_freedoms(chain: ClosedChain) -> tuple[Idle, ...]:
    """Return the freedoms of a chain that move nothing else, those of props and loose joints first.

    Where no configuration closes, only those that no closure touches are known.
    """
    loops = loops_of(chain)
    felt = np.zeros(chain.nv, dtype=np.bool_)
    for anchored in loops.anchored:
        felt[anchored.columns] = True
    told = np.isin(np.arange(chain.nv), loops.actuated)
    found = list(_untouched(chain, loops, felt | told))
    if loops.m:
        q, _ = mobility.first_closed(chain, 0, CLOSED)
        if closed_enough(loops, mobility.gap(loops, q[None]), CLOSED)[0]:
            site = mobility.generic_site(chain, mobility.site_at(loops, q), 0, CLOSED)
            found += _Search(chain, loops, site, felt & ~told).found()
    return tuple(found)


def _untouched(chain: ClosedChain, loops: Loops, touched: npt.NDArray[np.bool_]) -> Iterator[Idle]:
    """Find joints that no closure and no motor touches."""
    model = chain.model
    for j in range(1, model.njoints):
        columns = np.arange(model.idx_vs[j], model.idx_vs[j] + model.nvs[j])
        loose = [int(k) for k in columns if not touched[k]]
        if not loose:
            continue
        below = [i for i in range(1, model.njoints) if j in list(model.supports[i])]
        own = {k for i in below for k in range(model.idx_vs[i], model.idx_vs[i] + model.nvs[i])}
        floats = int(model.parents[j]) == 0 and model.nvs[j] == 6
        kind = Kind.LOOSE
        if floats:
            kind = Kind.BASE if any(touched[k] for k in own) else Kind.PROP
        rest = tuple(Still(str(model.names[j]), k - int(columns[0])) for k in loose)
        yield Idle(kind, str(model.names[j]), tuple(_name(model, i) for i in below), rest)


class _Search:
    """Looks for idle freedoms in the loops of a chain at one closed configuration."""

    def __init__(self, chain: ClosedChain, loops: Loops, site: Configurations, mine: npt.NDArray[np.bool_]) -> None:
        self._chain, self._loops, self._mine = chain, loops, mine
        self._J = loops.scaled(site.J[0])
        self._S, self._R, self._p = site.poses.S[0], site.poses.R[:, 0], site.poses.p[:, 0]
        self._clusters = self._about_one_point()
        self._known = np.zeros((chain.nv, 0))
        self._felt = np.array([np.isin(np.arange(chain.nv), c.columns) for c in loops.anchored])
        held = mobility.with_held(site.J[0], loops.actuated)
        self._most = int(mine.sum()) - loops.rank(held)

    def found(self) -> Iterator[Idle]:
        """Yield them: first those in the coordinates of one joint, then of two that a closure has in common."""
        for one in self._clusters:
            yield from self._within(one, None)
        felt = [set(np.flatnonzero(self._felt[:, self._columns(x)].any(axis=1))) for x in self._clusters]
        for (k, one), (i, two) in combinations(enumerate(self._clusters), 2):
            if self._known.shape[1] < self._most and felt[k] & felt[i]:
                yield from self._within(one, two)
        yield from self._sprung()

    def _sprung(self) -> list[Idle]:
        """Return joints that their springs alone hold, where with them at rest the motors tell everything."""
        model, found = self._chain.model, list[Idle]()
        names = dict.fromkeys(s.joint for s in self._chain.springs if isinstance(s, JointSpring) and s.stiffness > 0.0)
        rows = np.concatenate([self._J, self._known.T])[:, self._mine]
        rank = int(ranks_of(singular_values(rows), self._loops.misfit))
        for name in names:
            k = int(model.idx_vs[model.getJointId(name)])
            more = np.concatenate([rows, np.eye(self._chain.nv)[k : k + 1, self._mine]])
            if self._mine[k] and int(ranks_of(singular_values(more), self._loops.misfit)) > rank:
                rows, rank = more, rank + 1
                body = _name(model, int(model.getJointId(name)))
                found.append(Idle(Kind.SPRUNG, name, (body,), (Still(name, 0),)))
        return found if rank == int(self._mine.sum()) else []

    def _about_one_point(self) -> list[list[int]]:
        """Gather joints that follow each other at one point; one alone is a list of its own."""
        model, clusters = self._chain.model, dict[int, list[int]]()
        for j in range(1, model.njoints):
            parent = int(model.parents[j])
            apart = float(np.linalg.norm(model.jointPlacements[j].translation))
            near = apart <= _ONE_POINT * self._chain.length
            joined = parent in clusters and near and self._turns(j) and self._turns(parent)
            clusters[j] = [*clusters.pop(parent), j] if joined else [j]
        return list(clusters.values())

    def _turns(self, j: int) -> bool:
        """Tell whether a joint does nothing but turn about its origin."""
        model = self._chain.model
        S = self._S[:, model.idx_vs[j] : model.idx_vs[j] + model.nvs[j]]
        slides = S[:3] - np.cross(self._p[j], S[3:], axisb=0, axisc=0)
        return bool(np.abs(slides).max(initial=0.0) <= _ONE_POINT * self._chain.length)

    def _columns(self, cluster: Sequence[int] | None) -> list[int]:
        model = self._chain.model
        spans = (range(model.idx_vs[j], model.idx_vs[j] + model.nvs[j]) for j in cluster or ())
        return [k for span in spans for k in span if self._mine[k]]

    def _within(self, one: list[int], two: list[int] | None) -> Iterator[Idle]:
        """Yield what moves in the coordinates of these joints alone and is not known yet."""
        columns = np.array([*self._columns(one), *self._columns(two)], dtype=np.intp)
        if not columns.size or (two is not None and not self._columns(two)):
            return
        J, known = self._J[:, columns], self._known[columns] if two is None else self._inside(columns)
        _, s, Vt = np.linalg.svd(np.concatenate([J, known.T]), full_matrices=True)
        rank = int(np.sum(s > _VANISHING))
        for x in Vt[rank:]:
            z = np.zeros(self._chain.nv)
            z[columns] = x
            idle = self._idle(z, one, two)
            if idle is not None:
                self._known = np.column_stack([self._known, z])
                yield idle

    def _inside(self, columns: _Columns) -> Array:
        """Return the known freedoms that live in these coordinates alone (columns, k)."""
        outside = np.delete(self._known, columns, axis=0)
        return np.asarray(self._known[columns][:, ~np.any(outside, axis=0)])

    def _idle(self, z: Array, one: list[int], two: list[int] | None) -> Idle | None:
        """Return the freedom z, scaled (nv,), where all that it moves moves as one body, and stays so."""
        loops, model = self._loops, self._chain.model
        v = z * loops.column_scale
        twists = np.array([self._S @ (v * loops.tree.support[j]) for j in range(model.njoints)])
        twists[:, :3] /= self._chain.length
        top = one[-1]
        crosses = {*one[:-1], *(two or [])[:-1]}
        moved = [j for j in range(1, model.njoints) if j not in crosses and np.abs(twists[j]).max() > _VANISHING]
        if not moved or any(np.abs(twists[j] - twists[top]).max() > _VANISHING for j in moved):
            return None
        names = tuple(_name(model, j) for j in moved)
        omega = twists[top, 3:]
        if np.abs(omega).max() > _VANISHING:
            axis = self._R[top].T @ omega / np.linalg.norm(omega)
            frames = f"{_REST}beside {int(model.parents[one[0]])}", f"{_REST}{top}"
            return Idle(Kind.SPIN, str(model.names[top]), names, (Spin(frames, axis, name=names[0]),))
        k = int(np.argmax(np.abs(z)))
        j = next(j for j in (*one, *(two or ())) if model.idx_vs[j] <= k < model.idx_vs[j] + model.nvs[j])
        return Idle(Kind.SLIDE, str(model.names[j]), names, (Still(str(model.names[j]), k - int(model.idx_vs[j])),))


def _name(model: pin.Model, joint: int) -> str:
    """Return what the body on a joint is called: its link where there is one, else the joint."""
    bodies = [f.name for f in model.frames if f.type == pin.FrameType.BODY and int(f.parentJoint) == joint]
    return str(bodies[0] if bodies else model.names[joint])
