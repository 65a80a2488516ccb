"""The closures of a chain over a batch of samples, and the one place where rank is decided."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, block_svd
from fivebar_pin.chain import ClosedChain, frames_by_name
from fivebar_pin.closures import Anchored
from fivebar_pin.errors import AssemblyError, InvalidInputError
from fivebar_pin.mechanism.per_chain import once_per_chain
from fivebar_pin.mechanism.tree import Poses, Rates, Tree

__all__ = ["RANK_TOLERANCE", "Loops", "PassiveMap", "inverse", "loops_of", "open_message", "same_side"]


RANK_TOLERANCE = 1e-9  # of the largest singular value of the scaled Jacobian [-]
_WHOLE = 4000  # entries of a Jacobian from which on it is decomposed block by block
_GENERIC_SAMPLES = 12


@dataclass(frozen=True, slots=True, eq=False)
class _Group:
    """Closures that share passive joints; groups are independent of each other given the actuated coordinates."""

    members: tuple[int, ...]  # closures
    rows: npt.NDArray[np.intp]  # of J
    columns: npt.NDArray[np.intp]  # velocity coordinates that move some of the rows
    passive: npt.NDArray[np.intp]  # positions in `Loops.passive`
    passive_columns: npt.NDArray[np.intp]  # the same, positions in `columns`
    actuated: npt.NDArray[np.intp]  # positions in `Loops.actuated`
    actuated_columns: npt.NDArray[np.intp]
    reduce: Array  # independent row combinations (r, rows)
    scale: Array  # of the passive columns

    @property
    def is_square(self) -> bool:
        return bool(self.reduce.shape[0] == self.passive.size)


@dataclass(frozen=True, slots=True, eq=False)
class PassiveMap:
    """What takes the actuated coordinates to the passive ones at a batch of configurations.

    Attributes:
        groups: the independent groups of closures.
        X: per group, pseudo-inverse of the passive columns of its reduced rows (n, np_g, r_g); nan where singular.
        sigma: lower estimate of their smallest singular value, scaled [-] (n,).
        sign: sign of their determinant, per group; one where they are not square (n, groups).
        tall: those that are not square, scaled (n, r_g, np_g): see `same_side`.
        size: number of passive and actuated coordinates.
    """

    groups: list[_Group]
    X: list[Array]
    sigma: Array
    sign: Array
    tall: list[Array]
    size: tuple[int, int]

    def solve(self, rows: Array) -> Array:
        """Return the passive tangent that changes the closure rows (n, m) by this much, (n, np)."""
        out = np.zeros((rows.shape[0], self.size[0]))
        for g, X in zip(self.groups, self.X, strict=True):
            out[:, g.passive] = np.matmul(X, (rows[:, g.rows] @ g.reduce.T)[..., None])[..., 0]
        return out

    def complement(self, blocks: list[Array]) -> Array:
        """Return the passive rows of the complement (n, np, na) from the Jacobian's blocks."""
        out = np.zeros((self.sigma.size, *self.size))
        for g, X, J in zip(self.groups, self.X, blocks, strict=True):
            if g.actuated.size:
                out[:, g.passive[:, None], g.actuated] = -np.matmul(X, np.matmul(g.reduce, J[:, :, g.actuated_columns]))
        return out


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
        self.anchored: list[Anchored] = []
        frames, self.m = frames_by_name(model) if chain.closures else {}, 0
        for closure in chain.closures:
            self.anchored.append(closure.anchor(model, frames, self.tree.support, self.m))
            self.m = self.anchored[-1].rows.stop
        self.column_scale = np.array([1.0 if self.tree.is_angle(k) else self.length for k in range(self.tree.nv)])
        scales = [c.row_scale(self.length, self.column_scale) for c in self.anchored]
        self.row_scale = np.concatenate(scales or [np.zeros(0)])
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
    def independent(self) -> list[_Group]:
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

    def pairs(self, poses: Poses) -> list[Any]:
        """Return what every closure sees of the configurations: the world poses of its frames, or its coordinates."""
        return [c.look(poses) for c in self.anchored]

    def residual(self, pairs: list[Any]) -> Array:
        """Return all closure rows (n, m) [m, rad]; the chain has closures."""
        return np.concatenate([c.residual(x) for c, x in zip(self.anchored, pairs, strict=True)], axis=1)

    def jacobian(self, poses: Poses, pairs: list[Any]) -> Array:
        """Return the closure Jacobian J (n, m, nv): residual rate = J v."""
        J = np.zeros((poses.S.shape[0], self.m, self.tree.nv))
        for g, block in zip(self._groups, self.blocks(poses, pairs), strict=True):
            J[:, g.rows[:, None], g.columns] = block
        return J

    def blocks(self, poses: Poses, pairs: list[Any]) -> list[Array]:
        """Return the same per independent group of closures, without the zeros."""
        return [self._block(g.members, g.columns, poses, pairs) for g in self._groups]

    def _block(self, members: tuple[int, ...], columns: npt.NDArray[np.intp], poses: Poses, pairs: list[Any]) -> Array:
        """Return the rows of some closures in some columns (n, rows, columns)."""
        closures = [self.anchored[k] for k in members]
        sizes = [c.rows.stop - c.rows.start for c in closures]
        block, start = np.zeros((poses.S.shape[0], sum(sizes), columns.size)), 0
        for k, c, size in zip(members, closures, sizes, strict=True):
            block[:, start : start + size, np.searchsorted(columns, c.columns)] = c.jacobian(pairs[k], poses)
            start += size
        return block

    def drift(self, pairs: list[Any], rates: Rates) -> Array:
        """Return the second rate of the residual at zero joint accelerations (n, m)."""
        return np.concatenate([c.drift(x, rates) for c, x in zip(self.anchored, pairs, strict=True)], axis=1)

    def opposed(self, pairs: list[Any]) -> npt.NDArray[np.bool_]:
        """Return where some hinge closes with its axes against each other (n,)."""
        flags = [c.opposed(x) for c, x in zip(self.anchored, pairs, strict=True)]
        return np.asarray(np.any(flags, axis=0))

    def passive_map(self, blocks: list[Array]) -> PassiveMap:
        """Invert the passive columns of the Jacobian's blocks. Singular samples get sigma = 0 and X = nan."""
        n = blocks[0].shape[0] if blocks else 1
        X, tall, sigma, sign = [], [], np.full(n, 1.0), np.ones((n, len(self._groups)))
        for k, (g, J) in enumerate(zip(self._groups, blocks, strict=True)):
            Jp = np.matmul(g.reduce, J[:, :, g.passive_columns]) * g.scale
            if g.is_square:
                inverted, determinant = inverse(Jp)
                sign[:, k] = np.sign(determinant)
                with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
                    smallest = 1.0 / np.sqrt(np.einsum("nij,nij->n", inverted, inverted))
            else:
                inverted, smallest = _pseudo_inverse(Jp)
                tall.append(Jp)
            X.append(g.scale[:, None] * inverted)
            if g.passive.size:
                smallest = np.where(np.isfinite(smallest), smallest, 0.0)
                sigma = smallest if len(self._groups) == 1 else np.minimum(sigma, smallest)
        return PassiveMap(self._groups, X, sigma, sign, tall, (self.passive.size, self.actuated.size))

    def rank(self, J: Array, *, tolerance: float = RANK_TOLERANCE) -> int:
        """Return the rank of one closure Jacobian (m, nv), scaled so that lengths and units do not matter."""
        s = self.singular_values(J)
        return int(np.sum(s > tolerance * max(1.0, s[0]))) if s.size else 0

    def singular_values(self, J: Array) -> Array:
        """Return the singular values of the scaled closure Jacobian, descending."""
        if 0 in J.shape:
            return np.zeros(0)
        scaled = self.row_scale[:, None] * J * self.column_scale
        return np.asarray(np.linalg.svd(scaled, compute_uv=False) if J.size < _WHOLE else block_svd(scaled)[1])

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

    def _group(self, members: tuple[int, ...]) -> _Group:
        closures = [self.anchored[k] for k in members]
        rows_ = np.concatenate([np.arange(c.rows.start, c.rows.stop) for c in closures])
        columns = np.unique(np.concatenate([c.columns for c in closures]))
        passive = np.flatnonzero(np.isin(self.passive, columns))
        actuated = np.flatnonzero(np.isin(self.actuated, columns))
        return _Group(
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
        poses, pairs = self._generic
        J = self._block(members, columns, poses, pairs)
        scale = self.row_scale[rows_]
        wide = np.concatenate(list(J * scale[:, None] * self.column_scale[columns]), axis=1)
        U, s, _ = np.linalg.svd(wide, full_matrices=False)
        r = int(np.sum(s > RANK_TOLERANCE * max(s[0], 1e-300)))
        return np.diag(scale) if r == rows_.size else np.asarray(U[:, :r].T * scale)

    @cached_property
    def _generic(self) -> tuple[Poses, list[Any]]:
        rng = np.random.default_rng(7)
        tangent = rng.uniform(-np.pi, np.pi, (_GENERIC_SAMPLES, self.tree.nv)) * self.column_scale
        q = self.tree.integrate(np.repeat(self._neutral[None], _GENERIC_SAMPLES, axis=0), tangent)
        poses = self.tree.poses(q)
        return poses, self.pairs(poses)


@once_per_chain
def loops_of(chain: ClosedChain) -> Loops:
    """Return the prepared closures of a chain, made once."""
    return Loops(chain)


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


def same_side(before: list[Array], after: list[Array]) -> npt.NDArray[np.bool_]:
    """Tell whether no singularity lies between tall matrices (..., r, k): square ones show it in their determinant.

    A column combination that passes through zero turns round, which makes det(A^T B) negative.
    """
    sides = [np.linalg.det(np.matmul(np.swapaxes(A, -1, -2), B)) > 0.0 for A, B in zip(before, after, strict=True)]
    return np.asarray(np.all(sides, axis=0))


def _pseudo_inverse(M: Array) -> tuple[Array, Array]:
    """Return the pseudo-inverses of a batch of tall matrices and their smallest singular values."""
    U, s, Vt = np.linalg.svd(M, full_matrices=False)
    smallest = s[:, -1] if M.shape[1] >= M.shape[2] > 0 else np.zeros(M.shape[0])
    with np.errstate(divide="ignore", invalid="ignore"):
        X = np.matmul(np.swapaxes(Vt, 1, 2) / s[:, None, :], np.swapaxes(U, 1, 2))
    return X, smallest


def inverse(M: Array) -> tuple[Array, Array]:
    """Invert a batch of square matrices; singular ones become nan. Also return the determinants."""
    if M.shape[-1] == 2:
        return _inverse_of_two(M)
    return _inverse(M), np.asarray(np.linalg.det(M))


def _inverse_of_two(M: Array) -> tuple[Array, Array]:
    """The usual case of one planar loop in closed form: by the cofactors, far cheaper than a factorisation."""
    det = M[:, 0, 0] * M[:, 1, 1] - M[:, 0, 1] * M[:, 1, 0]
    with np.errstate(divide="ignore"):
        scale = np.where(det == 0.0, np.nan, 1.0 / det)
    X = np.empty_like(M)
    X[:, 0, 0], X[:, 1, 1] = M[:, 1, 1] * scale, M[:, 0, 0] * scale
    X[:, 0, 1], X[:, 1, 0] = -M[:, 0, 1] * scale, -M[:, 1, 0] * scale
    return X, det


def _inverse(M: Array) -> Array:
    """Invert a batch of square matrices by factorisation; singular ones become nan."""
    try:
        return np.asarray(np.linalg.inv(M))
    except np.linalg.LinAlgError:
        out = np.full_like(M, np.nan)
        for i, Mi in enumerate(M):
            try:
                out[i] = np.linalg.inv(Mi)
            except np.linalg.LinAlgError:
                continue
        return out
