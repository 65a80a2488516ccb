"""The closures of a chain over a batch of samples: residual, Jacobian, drift, and their independent groups."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain, frames_by_name
from fivebar_pin.closures import Closure
from fivebar_pin.closures import closure as rows
from fivebar_pin.closures.closure import FramePair
from fivebar_pin.errors import AssemblyError, InvalidInputError
from fivebar_pin.mechanism.passive import Group, PassiveMap, passive_map
from fivebar_pin.mechanism.per_chain import once_per_chain
from fivebar_pin.mechanism.rank import ranks_of, singular_values
from fivebar_pin.mechanism.tree import Poses, Rates, Tree

__all__ = ["Loops", "loops_of", "open_message"]


_Index = npt.NDArray[np.intp] | slice

_GENERIC_SAMPLES = 12


@dataclass(frozen=True, slots=True, eq=False)
class _Anchored:
    """A closure with its frames resolved to joints."""

    index: int
    closure: Closure
    joints: tuple[int, int]
    R: tuple[Array, Array]
    p: tuple[Array, Array]
    sign: Array  # (nv,): +1 moves only body 2, -1 only body 1, 0 both or neither
    moved: npt.NDArray[np.intp]  # columns with a sign
    rows: slice


class Loops:
    """Closure residual, Jacobian and drift of one chain, batched.

    Attributes:
        tree: the open tree.
        m: number of closure rows.
        reduce: constant row combinations that are independent in general, (r, m); all redundancy that holds at every
            configuration (the out-of-plane rows of a planar loop) is gone from them, and their unit is one.
        column_scale: unit of every velocity coordinate (nv,): 1 for angles, the chain's length for slides.
    """

    def __init__(self, chain: ClosedChain) -> None:
        model = chain.model
        self.tree = Tree(model)
        self._neutral = pin.neutral(model)
        self.closures = chain.closures
        self.actuated, self.passive = chain.actuated_index, chain.passive_index
        self.length = chain.length
        self.anchored: list[_Anchored] = []
        start, named = 0, frames_by_name(model) if chain.closures else {}
        for closure in chain.closures:
            frames = [named[f] for f in closure.frames]
            i, j = (int(f.parentJoint) for f in frames)
            sign = self.tree.support[j].astype(float) - self.tree.support[i].astype(float)
            self.anchored.append(
                _Anchored(
                    len(self.anchored),
                    closure,
                    (i, j),
                    (np.array(frames[0].placement.rotation), np.array(frames[1].placement.rotation)),
                    (np.array(frames[0].placement.translation), np.array(frames[1].placement.translation)),
                    sign,
                    np.flatnonzero(sign),
                    slice(start, start + closure.kind.rows),
                )
            )
            start += closure.kind.rows
        self.m = start
        self.row_scale = np.concatenate(
            [np.r_[np.full(3, 1.0 / self.length), np.ones(c.kind.rows - 3)] for c in chain.closures] or [np.zeros(0)]
        )
        self.column_scale = np.array([1.0 if self.tree.is_angle(k) else self.length for k in range(self.tree.nv)])
        self._groups = [self._group(members) for members in self._members()]
        self.reduce = np.zeros((sum(g.reduce.shape[0] for g in self._groups), self.m))
        done = 0
        for g in self._groups:
            r = g.reduce.shape[0]
            self.reduce[done : done + r, g.rows] = g.reduce
            done += r

    @property
    def groups(self) -> int:
        """Number of independent groups of closures."""
        return len(self._groups)

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

    def pairs(self, poses: Poses) -> list[FramePair]:
        """Return the world poses of the frames of every closure."""
        out = []
        for c in self.anchored:
            (i, j), (Ri, Rj), (pi, pj) = c.joints, c.R, c.p
            out.append(
                FramePair(
                    np.matmul(poses.R[i], Ri),
                    poses.p[i] + np.matmul(poses.R[i], pi),
                    np.matmul(poses.R[j], Rj),
                    poses.p[j] + np.matmul(poses.R[j], pj),
                )
            )
        return out

    def residual(self, pairs: list[FramePair]) -> Array:
        """Return all closure rows (n, m) [m, rad]; the chain has closures."""
        return np.concatenate([rows.residual(c.closure, x) for c, x in zip(self.anchored, pairs, strict=True)], axis=1)

    def jacobian(self, poses: Poses, pairs: list[FramePair]) -> Array:
        """Return the closure Jacobian J (n, m, nv): residual rate = J v."""
        return self.joined(self.blocks(poses, pairs), poses.S.shape[0])

    def joined(self, blocks: list[Array], n: int) -> Array:
        """Return the closure Jacobian (n, m, nv) from its blocks."""
        J = np.zeros((n, self.m, self.tree.nv))
        for g, block in zip(self._groups, blocks, strict=True):
            J[:, g.rows[:, None], g.columns] = block
        return J

    def blocks(self, poses: Poses, pairs: list[FramePair]) -> list[Array]:
        """Return the same per independent group of closures, without the zeros."""
        out = []
        for g in self._groups:
            block = np.zeros((poses.S.shape[0], g.rows.size, g.columns.size))
            start = 0
            for c in (self.anchored[k] for k in g.members):
                m = c.closure.kind.rows
                block[:, start : start + m, np.searchsorted(g.columns, c.moved)] = _rows(c, poses, pairs)
                start += m
            out.append(block)
        return out

    def drift(self, pairs: list[FramePair], rates: Rates) -> Array:
        """Return the second rate of the residual at zero joint accelerations (n, m)."""
        return np.concatenate(
            [
                rows.drift(c.closure, x, *(rates.V[j] for j in c.joints), *(rates.A[j] for j in c.joints))
                for c, x in zip(self.anchored, pairs, strict=True)
            ],
            axis=1,
        )

    def opposed(self, pairs: list[FramePair]) -> npt.NDArray[np.bool_]:
        """Return where some hinge closes with its axes against each other (n,)."""
        flags = [rows.opposed(c.closure, x) for c, x in zip(self.anchored, pairs, strict=True)]
        return np.asarray(np.any(flags, axis=0))

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
        return int(ranks_of(singular_values(self.scaled(J))))

    def worst(self, residual: Array) -> tuple[str, float]:
        """Return the closure that one residual (m,) leaves open the most, and by how much."""
        sizes = [float(np.max(np.abs(residual[c.rows]))) for c in self.anchored]
        k = int(np.argmax(sizes))
        return self.anchored[k].closure.name, sizes[k]

    def require_determined(self) -> None:
        """Raise unless the actuated joints can determine the motion."""
        lacking = self.passive.size - sum(min(g.reduce.shape[0], g.passive.size) for g in self._groups)
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
        for c in self.anchored:
            columns, members = set(c.moved.tolist()) & passive, [c.index]
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
        columns = np.unique(np.concatenate([c.moved for c in closures]))
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
            reduce=self._independent_rows(closures, rows_, columns),
            scale=self.column_scale[self.passive[passive]],
        )

    def _independent_rows(
        self, closures: list[_Anchored], rows_: npt.NDArray[np.intp], columns: npt.NDArray[np.intp]
    ) -> Array:
        """Find the row combinations of some closures that are independent at generic configurations."""
        poses, pairs = self._generic
        J = np.zeros((_GENERIC_SAMPLES, rows_.size, columns.size))
        start = 0
        for c in closures:
            m = c.closure.kind.rows
            J[:, start : start + m, np.searchsorted(columns, c.moved)] = _rows(c, poses, pairs)
            start += m
        scale = self.row_scale[rows_]
        wide = np.concatenate(list(self.scaled(J, rows_, columns)), axis=1)
        U, s, _ = np.linalg.svd(wide, full_matrices=False)
        r = int(ranks_of(s))
        return np.diag(scale) if r == rows_.size else np.asarray(U[:, :r].T * scale)

    @cached_property
    def _generic(self) -> tuple[Poses, list[FramePair]]:
        rng = np.random.default_rng(7)
        tangent = rng.uniform(-np.pi, np.pi, (_GENERIC_SAMPLES, self.tree.nv)) * self.column_scale
        q = self.tree.integrate(np.repeat(self._neutral[None], _GENERIC_SAMPLES, axis=0), tangent)
        poses = self.tree.poses(q)
        return poses, self.pairs(poses)


@once_per_chain
def loops_of(chain: ClosedChain) -> Loops:
    """Return the prepared closures of a chain, made once."""
    return Loops(chain)


def _rows(c: _Anchored, poses: Poses, pairs: list[FramePair]) -> Array:
    """Return the Jacobian of one closure in the columns that move it (n, rows, moved)."""
    return np.asarray(np.matmul(rows.selector(c.closure, pairs[c.index]), poses.S[:, :, c.moved] * c.sign[c.moved]))


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
        f"Bring the actuated coordinates within reach, or check the link lengths.{tied}",
        closure=name,
        residual=size,
    )
