"""The closures of a chain over a batch of samples, and the one place where rank is decided."""

from __future__ import annotations

import weakref
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin import closures as rows
from fivebar_pin._arrays import Array
from fivebar_pin._tree import Poses, Rates, Tree
from fivebar_pin.chain import ClosedChain
from fivebar_pin.closures import Closure, FramePair
from fivebar_pin.errors import AssemblyError, InvalidInputError

RANK_TOLERANCE = 1e-9  # of the largest singular value of the scaled Jacobian [-]
_GENERIC_SAMPLES = 12


@dataclass(frozen=True, slots=True, eq=False)
class _Anchored:
    """A closure with its frames resolved to joints."""

    closure: Closure
    joints: tuple[int, int]
    R: tuple[Array, Array]
    p: tuple[Array, Array]
    sign: Array  # (nv,): +1 moves only body 2, -1 only body 1, 0 both or neither
    moved: npt.NDArray[np.intp]  # columns with a sign
    rows: slice


@dataclass(frozen=True, slots=True, eq=False)
class PassiveMap:
    """What takes the actuated coordinates to the passive ones at a batch of configurations.

    Attributes:
        X: pseudo-inverse of the passive columns of the reduced closure Jacobian (n, np, r).
        sigma: lower estimate of their smallest singular value, scaled [-] (n,).
        sign: sign of their determinant where they are square, else one (n,).
    """

    X: Array
    sigma: Array
    sign: Array


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
        self.closures = chain.closures
        self.actuated, self.passive = chain.actuated_index, chain.passive_index
        self.length = chain.length
        self.anchored: list[_Anchored] = []
        start = 0
        for closure in chain.closures:
            frames = [model.frames[model.getFrameId(f)] for f in closure.frames]
            i, j = (int(f.parentJoint) for f in frames)
            sign = self.tree.support[j].astype(float) - self.tree.support[i].astype(float)
            self.anchored.append(
                _Anchored(
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
        self.reduce = self._independent_rows()
        self.is_square = self.reduce.shape[0] == self.passive.size

    @property
    def r(self) -> int:
        """Number of rows that are independent in general."""
        return int(self.reduce.shape[0])

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
        """Return all closure rows (n, m) [m, rad]."""
        return np.concatenate([rows.residual(c.closure, x) for c, x in zip(self.anchored, pairs, strict=True)], axis=1)

    def jacobian(self, poses: Poses, pairs: list[FramePair]) -> Array:
        """Return the closure Jacobian J (n, m, nv): residual rate = J v."""
        J = np.zeros((poses.S.shape[0], self.m, self.tree.nv))
        for c, pair in zip(self.anchored, pairs, strict=True):
            block = np.matmul(rows.selector(c.closure, pair), poses.S[:, :, c.moved] * c.sign[c.moved])
            J[:, c.rows, c.moved] = block
        return J

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

    def passive_map(self, J: Array) -> PassiveMap:
        """Invert the passive columns of J (n, m, nv). Singular samples get sigma = 0 and X = nan."""
        Jp = np.matmul(self.reduce, J[:, :, self.passive]) * self.column_scale[self.passive]
        n = J.shape[0]
        if not self.passive.size:
            return PassiveMap(np.zeros((n, 0, self.r)), np.ones(n), np.ones(n))
        if self.is_square:
            X, determinant = inverse(Jp)
            sign = np.sign(determinant)
            with np.errstate(invalid="ignore", over="ignore"):
                sigma = 1.0 / np.sqrt(np.einsum("nij,nij->n", X, X))
            sigma = np.where(np.isfinite(sigma), sigma, 0.0)
        else:
            sign = np.ones(n)
            U, s, Vt = np.linalg.svd(Jp, full_matrices=False)
            sigma = s[:, -1] if self.r >= self.passive.size else np.zeros(n)
            with np.errstate(divide="ignore", invalid="ignore"):
                X = np.matmul(np.swapaxes(Vt, 1, 2) / s[:, None, :], np.swapaxes(U, 1, 2))
        return PassiveMap(self.column_scale[self.passive][:, None] * X, sigma, sign)

    def rank(self, J: Array, *, tolerance: float = RANK_TOLERANCE) -> int:
        """Return the rank of one closure Jacobian (m, nv), scaled so that lengths and units do not matter."""
        s = self.singular_values(J)
        return int(np.sum(s > tolerance * max(1.0, s[0]))) if s.size else 0

    def singular_values(self, J: Array) -> Array:
        """Return the singular values of the scaled closure Jacobian, descending."""
        if 0 in J.shape:
            return np.zeros(0)
        return np.asarray(np.linalg.svd(self.row_scale[:, None] * J * self.column_scale, compute_uv=False))

    def worst(self, residual: Array) -> tuple[str, float]:
        """Return the closure that one residual (m,) leaves open the most, and by how much."""
        sizes = [float(np.max(np.abs(residual[c.rows]))) for c in self.anchored]
        k = int(np.argmax(sizes))
        return self.anchored[k].closure.name, sizes[k]

    def require_determined(self) -> None:
        """Raise unless the actuated joints can determine the motion."""
        if self.r < self.passive.size:
            raise InvalidInputError(
                "actuated joints",
                f"{self.actuated.size} for {self.tree.nv} coordinates and {self.r} independent closure rows",
                f"leave {self.passive.size - self.r} coordinate(s) undetermined",
                "Actuate more joints; diagnose(chain) lists the sets that determine the motion.",
            )

    def _independent_rows(self) -> Array:
        """Find the row combinations that are independent at generic configurations."""
        if not self.closures:
            return np.zeros((0, 0))
        rng = np.random.default_rng(7)
        import pinocchio as pin

        tangent = rng.uniform(-np.pi, np.pi, (_GENERIC_SAMPLES, self.tree.nv)) * self.column_scale
        q0 = np.broadcast_to(pin.neutral(self.tree._model), (_GENERIC_SAMPLES, self.tree.nq))
        poses = self.tree.poses(self.tree.integrate(np.array(q0), tangent))
        J = self.jacobian(poses, self.pairs(poses)) * self.row_scale[:, None] * self.column_scale
        wide = np.concatenate(list(J), axis=1)
        U, s, _ = np.linalg.svd(wide, full_matrices=False)
        r = int(np.sum(s > RANK_TOLERANCE * max(s[0], 1e-300)))
        if r == self.m:
            return np.diag(self.row_scale)
        return np.asarray(U[:, :r].T * self.row_scale)


_CACHE: weakref.WeakKeyDictionary[ClosedChain, Loops] = weakref.WeakKeyDictionary()


def loops_of(chain: ClosedChain) -> Loops:
    """Return the prepared closures of a chain, made once."""
    found = _CACHE.get(chain)
    if found is None:
        found = _CACHE[chain] = Loops(chain)
    return found


def open_message(loops: Loops, residual: Array, where: str) -> AssemblyError:
    """Make the error for a configuration that does not close."""
    name, size = loops.worst(residual)
    return AssemblyError(
        f"the mechanism cannot be assembled {where}: closure {name} stays open by {size:.3g} m or rad. "
        "Bring the actuated coordinates within reach, or check the link lengths.",
        closure=name,
        residual=size,
    )


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
