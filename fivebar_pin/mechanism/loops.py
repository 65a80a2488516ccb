"""The closures of a chain over a batch of samples: residual, Jacobian, drift, and their independent groups."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain, frames_by_name
from fivebar_pin.closures import Anchored
from fivebar_pin.closures.anchored import FramePair
from fivebar_pin.closures.frame_closure import AnchoredFrames
from fivebar_pin.engine.tables import unwritten
from fivebar_pin.errors import AssemblyError, InvalidInputError
from fivebar_pin.mechanism.layout import Parts, layout_of
from fivebar_pin.mechanism.links import links_of
from fivebar_pin.mechanism.passive import Group, PassiveMap, passive_map
from fivebar_pin.mechanism.per_chain import once_per_chain
from fivebar_pin.mechanism.rank import ranks_of, singular_values
from fivebar_pin.mechanism.tree import Tree

__all__ = ["IF_ROUNDED", "Loops", "Seen", "loops_of", "open_message", "rounded"]


_Index = npt.NDArray[np.intp] | slice

IF_ROUNDED = "If its dimensions are rounded, state how far its loops may stay open: closure_tolerance, --tolerance."

_GENERIC_SAMPLES = 12
_ROUNDING = 1e-4  # residual that may come from rounded dimensions [m or rad; times a length above 1 m]


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """What closures are at n configurations.

    Attributes:
        residual: all rows (n, m) [m, rad].
        J: closure Jacobian (n, m, nv): residual rate = J v.
        T: wrench on body 2 of a unit force in every row, its opposite on body 1, world origin (n, m, 6).
        frames: of every closure R_1, p_1, R_2, p_2, row by row (n, closures, 24).
    """

    residual: Array
    J: Array
    T: Array
    frames: Array

    def pair(self, k: int) -> FramePair:
        """Return the frames of a closure; unmoved ones where it has none."""
        one, two = self.frames[:, k, :12], self.frames[:, k, 12:]
        return FramePair(one[:, :9].reshape(-1, 3, 3), one[:, 9:], two[:, :9].reshape(-1, 3, 3), two[:, 9:])


class Loops:
    """Closure residual, Jacobian and drift of one chain, batched.

    Attributes:
        tree: the open tree.
        m: number of closure rows.
        reduce: constant row combinations that are independent in general, (r, m); all redundancy that holds at every
            configuration (the out-of-plane rows of a planar loop) is gone from them, and their unit is one.
        tolerance: how far closures may stay open for good [m or rad; times the length above 1 m].
        misfit: the same as a scaled residual [-].
        column_scale: unit of every velocity coordinate (nv,): 1 for angles, the chain's length for slides.
        unit: what a residual is multiplied by to be one of lengths and angles (m,): 1 but for rows of coordinates,
            which say the same whatever factor they are multiplied by.
    """

    def __init__(self, chain: ClosedChain) -> None:
        model = chain.model
        self.tree = Tree(model)
        self._neutral = pin.neutral(model)
        self.closures = chain.closures
        self.actuated, self.passive = chain.actuated_index, chain.passive_index
        self.length = chain.length
        self.tolerance = chain.closure_tolerance
        self.misfit = self.tolerance * max(1.0, 1.0 / self.length)
        self.anchored: list[Anchored] = []
        frames, self.m = frames_by_name(model) if chain.closures else {}, 0
        for closure in chain.closures:
            self.anchored.append(closure.anchor(model, frames, self.tree.support, self.m))
            self.m = self.anchored[-1].rows.stop
        self.column_scale = np.array([1.0 if self.tree.is_angle(k) else self.length for k in range(self.tree.nv)])
        scales = [c.row_scale(self.length, self.column_scale) for c in self.anchored]
        self.row_scale = np.concatenate(scales or [np.zeros(0)])
        tied = [closure.ends == () for closure in self.closures for _ in closure.row_names]
        self.unit = np.where(np.array(tied, dtype=np.bool_), self.row_scale, 1.0)
        rows = [c.closure.rows if isinstance(c, AnchoredFrames) else () for c in self.anchored]
        parts = Parts(chain, links_of(model), self.anchored, rows, (), self.column_scale, 1.0)
        (self._I, self._W), self._threads = layout_of(parts), threading.local()
        self._groups = [self._group(members) for members in self._members()]
        self.reduce = np.zeros((sum(g.reduce.shape[0] for g in self._groups), self.m))
        done = 0
        for g in self._groups:
            r = g.reduce.shape[0]
            self.reduce[done : done + r, g.rows] = g.reduce
            done += r

    @property
    def independent(self) -> list[Group]:
        """The groups of closures that share no passive joint."""
        return self._groups

    @property
    def r(self) -> int:
        """Number of rows that are independent in general."""
        return int(self.reduce.shape[0])

    def actuated_of(self, q: Array) -> Array:
        """Return the actuated coordinates of configurations q (n, nq) -> (n, na)."""
        x = np.empty((q.shape[0], self.actuated.size))
        for column, k in enumerate(self.actuated):
            x[:, column] = self.tree.coordinate(q, int(k))
        return x

    def set_actuated(self, q: Array, x: Array) -> None:
        """Write actuated coordinates x, (na,) for all or (n, na), into configurations q (n, nq), in place."""
        for column, k in enumerate(self.actuated):
            self.tree.set_coordinate(q, int(k), np.broadcast_to(x[..., column], q.shape[:1]))

    def see(self, q: Array) -> Seen:
        """Return what the closures are at configurations q (n, nq)."""
        from fivebar_pin.engine.batches import closures

        n, m = q.shape[0], self.m
        seen = Seen(np.empty((n, m)), np.zeros((n, m, self.tree.nv)), np.zeros((n, m, 6)), self._frames(n))
        closures(self._I, self._memory(), unwritten(q), seen.residual, seen.J, seen.T, seen.frames)
        return seen

    def _frames(self, n: int) -> Array:
        """Return room for the frames of closures, unmoved where there are none."""
        unmoved = np.r_[np.eye(3).ravel(), np.zeros(3)]
        return np.tile(unmoved, (n, len(self.anchored), 2))

    def _memory(self) -> Array:
        """Return the working memory of this thread."""
        if not hasattr(self._threads, "W"):
            self._threads.W = np.array(self._W)
        found: Array = self._threads.W
        return found

    def blocks(self, J: Array) -> list[Array]:
        """Return a closure Jacobian (n, m, nv) per independent group of closures, without the zeros."""
        return [J[:, g.rows[:, None], g.columns] for g in self._groups]

    def drift(self, q: Array, v: Array) -> Array:
        """Return the second rate of the residual at zero joint accelerations (n, m); q (n, nq), v (n, nv).

        That of rotation vectors holds where the closure is met.
        """
        from fivebar_pin.engine.batches import drift

        out = np.empty((q.shape[0], self.m))
        drift(self._I, self._memory(), unwritten(q), unwritten(v), out)
        return out

    def opposed(self, seen: Seen) -> npt.NDArray[np.bool_]:
        """Return where some hinge closes with its axes against each other (n,)."""
        flags = [c.opposed(seen.pair(k)) for k, c in enumerate(self.anchored)]
        return np.asarray(np.any(flags, axis=0)) if flags else np.zeros(seen.residual.shape[0], dtype=np.bool_)

    def passive_map(self, blocks: list[Array], n: int) -> PassiveMap:
        """Invert the passive columns of the Jacobian's blocks, see `passive.passive_map`."""
        return passive_map(self._groups, blocks, n, (self.passive.size, self.actuated.size))

    def scaled(self, J: Array, rows: _Index = slice(None), columns: _Index = slice(None)) -> Array:
        """Return closure Jacobians (..., m, nv), or these rows and columns of them, in one unit: lengths do not matter.

        Velocities of angles stay as they are, those of slides and the rates of gaps are in the chain's length.
        """
        return np.asarray(self.row_scale[rows, None] * J * self.column_scale[columns])

    def rank(self, J: Array) -> int:
        """Return the rank of one closure Jacobian (m, nv)."""
        return int(ranks_of(singular_values(self.scaled(J)), self.misfit))

    def worst(self, residual: Array) -> tuple[str, float]:
        """Return the closure that one residual (m,) leaves open the most, and by how much."""
        sizes = [float(np.max(np.abs(residual[c.rows]))) for c in self.anchored]
        k = int(np.argmax(sizes))
        return self.anchored[k].closure.name, sizes[k]

    @property
    def lacking(self) -> int:
        """Number of passive coordinates for which there is no row."""
        return int(self.passive.size - sum(min(g.reduce.shape[0], g.passive.size) for g in self._groups))

    def require_determined(self) -> None:
        """Raise unless the actuated joints can determine the motion."""
        lacking = self.lacking
        if lacking:
            raise InvalidInputError(
                "actuated joints",
                f"{self.actuated.size} for {self.tree.nv} coordinates and {self.r} independent closure rows",
                f"leave {lacking} coordinate(s) undetermined",
                "Actuate more joints; diagnose(chain) lists the sets that determine the motion.",
            )

    def _members(self) -> list[tuple[int, ...]]:
        """Gather closures that share a passive joint."""
        groups: list[tuple[set[int], list[int]]] = []
        passive = set(self.passive.tolist())
        for k, c in enumerate(self.anchored):
            columns, members = set(c.columns.tolist()) & passive, [k]
            apart = []
            for other_columns, other_members in groups:
                if columns & other_columns:
                    columns, members = columns | other_columns, other_members + members
                else:
                    apart.append((other_columns, other_members))
            groups = [*apart, (columns, members)]
        return sorted(tuple(sorted(members)) for _, members in groups)

    def _group(self, members: tuple[int, ...]) -> Group:
        closures = [self.anchored[k] for k in members]
        rows_ = np.concatenate([np.arange(c.rows.start, c.rows.stop) for c in closures])
        columns = np.unique(np.concatenate([c.columns for c in closures]))
        passive = np.flatnonzero(np.isin(self.passive, columns))
        actuated = np.flatnonzero(np.isin(self.actuated, columns))
        return Group(
            members=members,
            rows=rows_,
            columns=columns,
            passive=passive,
            passive_columns=np.searchsorted(columns, self.passive[passive]),
            actuated=actuated,
            actuated_columns=np.searchsorted(columns, self.actuated[actuated]),
            reduce=self._independent_rows(members, rows_, columns),
            scale=self.column_scale[self.passive[passive]],
        )

    def _independent_rows(
        self, members: tuple[int, ...], rows_: npt.NDArray[np.intp], columns: npt.NDArray[np.intp]
    ) -> Array:
        """Find the row combinations of some closures that are independent at generic configurations."""
        J = self._generic.J[:, rows_[:, None], columns]
        scale = self.row_scale[rows_]
        wide = np.concatenate(list(self.scaled(J, rows_, columns)), axis=1)
        U, s, _ = np.linalg.svd(wide, full_matrices=False)
        r = int(ranks_of(s))
        return np.diag(scale) if r == rows_.size else np.asarray(U[:, :r].T * scale)

    @property
    def what_to_check(self) -> str:
        """Which numbers of the chain may be wrong where its loops stay open, in words."""
        between = any(c.ends for c in self.closures)
        words = ["the link lengths and the frames of the closures"] if between else []
        words += ["the ratios and offsets of the couplings"] if not all(c.ends for c in self.closures) else []
        return ", and ".join(words)

    @property
    def generic_jacobians(self) -> list[Array]:
        """The Jacobians of all closures, in their columns, at some generic configurations (n, m, columns) each."""
        return [self._generic.J[:, c.rows][:, :, c.columns] for c in self.anchored]

    @property
    def may_oppose(self) -> bool:
        """Whether some closure can be met falsely, axes against each other."""
        return any(c.may_oppose for c in self.closures)

    @property
    def left(self) -> float:
        """What combinations of rows that no motion changes leave open, whatever the configuration [m, rad or -]."""
        if not self.m:
            return 0.0
        residual = self._generic.residual[0] * self.row_scale
        Q, _ = np.linalg.qr((self.reduce / self.row_scale).T)
        return float(np.abs((residual - Q @ (Q.T @ residual)) / self.row_scale * self.unit).max())

    @cached_property
    def _generic(self) -> Seen:
        rng = np.random.default_rng(7)
        tangent = rng.uniform(-np.pi, np.pi, (_GENERIC_SAMPLES, self.tree.nv)) * self.column_scale
        q = self.tree.integrate(np.repeat(self._neutral[None], _GENERIC_SAMPLES, axis=0), tangent)
        return self.see(q)


@once_per_chain
def loops_of(chain: ClosedChain) -> Loops:
    """Return the prepared closures of a chain, made once."""
    return Loops(chain)


def rounded(loops: Loops, gap: float) -> str:
    """Return what to do about loops that stay open by no more than rounded dimensions may make it, else nothing."""
    return f" {IF_ROUNDED}" if gap <= _ROUNDING * max(1.0, loops.length) else ""


def open_message(loops: Loops, residual: Array, where: str) -> AssemblyError:
    """Make the error for a configuration that does not close."""
    name, size = loops.worst(residual)
    tied = ""
    if loops.r > loops.passive.size:
        tied = (
            f" With {loops.r} closure rows for {loops.passive.size} passive coordinates the closures may tie the "
            "actuated joints to each other, so that only some combinations close: diagnose(chain) lists the sets "
            "that are free."
        )
    return AssemblyError(
        f"the mechanism cannot be assembled {where}: closure {name} stays open by {size:.3g} m or rad. "
        f"Bring the actuated coordinates within reach, or check {loops.what_to_check}.{rounded(loops, size)}{tied}",
        closure=name,
        residual=size,
    )
