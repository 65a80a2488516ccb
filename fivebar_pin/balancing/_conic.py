"""Conic programs in standard form, solved by Clarabel, and checked here.

    minimise  x.P x / 2 + q.x      subject to      g + G x in K

K is a product of zero cones, half-lines, second-order cones and cones of positive semidefinite matrices. With z in
the dual cone, a solution has P x + q = G^T z and no gap between x.P x / 2 + q.x and -g.z - x.P x / 2. There is no
solution at all when some z in the dual cone has G^T z = 0 and g.z < 0 (Farkas).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.errors import SolverError

_LISTED = 8  # conflicts written out in a message
ROOT2 = float(np.sqrt(2.0))
# The programs come well scaled, so the solver's own equilibration is left out at first; the others are for the rest.
_ATTEMPTS: tuple[dict[str, object], ...] = (
    {"equilibrate_enable": False},
    {},
    {"max_step_fraction": 0.9},
    {"static_regularization_constant": 1e-10},
    {"equilibrate_enable": False, "max_step_fraction": 0.9},
)


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Rows g + G x in one cone: "zero", "nonneg", "soc" or "psd" (scaled upper triangle, column by column).

    Attributes:
        label: what the rows mean, for certificates; one for the block or one per row.
        G: (rows, n).
        g: (rows,).
        inward: direction into the cone (rows,): a margin subtracts this much from g.
    """

    label: str | tuple[str, ...]
    cone: str
    G: Array
    g: Array
    inward: Array | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Certificate:
    """A proof that a set of conditions and bounds has no solution.

    Attributes:
        stationarity: largest entry of G^T z [-]; zero in exact arithmetic.
        violation: how far z is outside the dual cone [-]; zero in exact arithmetic.
        size: any solution would have to be larger than this many times the mechanism itself [-].
        conflict: the conditions and bounds that take part, with their share of the contradiction g.z = -1.
    """

    stationarity: float
    violation: float
    size: float
    conflict: dict[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        names = list(self.conflict)
        listed = "; ".join(names[:_LISTED]) + (f"; and {len(names) - _LISTED} more" if len(names) > _LISTED else "")
        return (
            f"no solution (Farkas certificate checked: |G^T z| = {self.stationarity:.1e}, outside the dual cone by "
            f"{self.violation:.1e}); in conflict: {listed}"
        )


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """What came of a solve. x is None when infeasible, certificate is None when solved.

    Attributes:
        x, z: primal (n,) and dual (rows,) solution.
        objective, dual: values of the two problems.
        certificate: proof of infeasibility.
    """

    x: Array | None
    z: Array
    objective: float
    dual: float
    certificate: Certificate | None


class Program:
    """The constraints of one problem, assembled once and solved for many objectives."""

    def __init__(self, n: int, blocks: Sequence[Block]) -> None:
        """Put blocks together; those with fewer than n columns leave the last variables alone."""
        order = {"zero": 0, "nonneg": 1, "soc": 2, "psd": 3}
        self.n = n
        self.blocks = sorted(blocks, key=lambda b: order[b.cone])
        self.G = np.zeros((sum(b.g.size for b in self.blocks), n))
        self.g = np.concatenate([b.g for b in self.blocks]) if blocks else np.zeros(0)
        self.inward = np.concatenate(
            [np.zeros(b.g.size) if b.inward is None else b.inward for b in self.blocks] or [np.zeros(0)]
        )
        ends = np.cumsum([b.g.size for b in self.blocks])
        self.slices = [slice(int(e) - b.g.size, int(e)) for e, b in zip(ends, self.blocks, strict=True)]
        for block, part in zip(self.blocks, self.slices, strict=True):
            self.G[part, : block.G.shape[1]] = block.G
        self._sparse: object = None

    def solve(self, P: Array, q: Array, *, margin: float = 0.0, tolerance: float = 1e-8) -> Outcome:
        """Solve for a diagonal P (n,) and q (n,), the cones tightened by a margin.

        Raises:
            SolverError: no solution to the tolerance and no valid certificate; Clarabel not installed.
        """
        clarabel = _clarabel()
        failure = SolverError("the conic solver was not run")
        for changes in _ATTEMPTS:
            try:
                return self._attempt(clarabel, changes, (P, q, self.g - margin * self.inward), tolerance)
            except SolverError as error:
                failure = error
        raise failure

    def _attempt(
        self, clarabel: Any, changes: Mapping[str, object], data: tuple[Array, Array, Array], tolerance: float
    ) -> Outcome:
        """Run the solver once with some of its settings changed."""
        from scipy import sparse

        P, q, offset = data
        if self._sparse is None:
            self._sparse = sparse.csc_matrix(-self.G)
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.max_iter = 300
        for name in ("tol_gap_abs", "tol_gap_rel", "tol_feas", "tol_infeas_abs", "tol_infeas_rel"):
            setattr(settings, name, 1e-2 * tolerance)
        for name, value in changes.items():
            setattr(settings, name, value)
        quadratic = sparse.csc_matrix((P, (np.arange(P.size), np.arange(P.size))), shape=(P.size, P.size))
        solver = clarabel.DefaultSolver(quadratic, q, self._sparse, offset, _cones(clarabel, self.blocks), settings)
        solution = solver.solve()
        status = str(solution.status)
        x, z = np.array(solution.x), np.array(solution.z)
        if "PrimalInfeasible" in status:
            return Outcome(None, z, float("nan"), float("nan"), self._certificate(z, offset, tolerance))
        if "DualInfeasible" in status:
            raise SolverError(
                "the objective can fall without bound: bound the region, the masses or choose another objective"
            )
        return self._accept(status, x, z, data, tolerance)

    def _accept(self, status: str, x: Array, z: Array, data: tuple[Array, Array, Array], tolerance: float) -> Outcome:
        """Check a solution ourselves, whatever the solver calls it."""
        P, q, g = data
        if not (np.isfinite(x).all() and np.isfinite(z).all()):
            raise SolverError(f"the conic solver stopped without an answer ({status})")
        quadratic = float(x @ (P * x))
        objective, dual = 0.5 * quadratic + float(q @ x), -float(g @ z) - 0.5 * quadratic
        scale = 1.0 + float(np.abs(x).max(initial=0.0))
        worst = max(
            self.outside(g + self.G @ x) / scale,
            float(np.abs(P * x + q - self.G.T @ z).max(initial=0.0)) / (1.0 + float(np.abs(q).max(initial=0.0))),
            abs(objective - dual) / (1.0 + abs(objective)),
        )
        if not worst <= tolerance:
            raise SolverError(
                f"the conic solver stopped at a residual of {worst:.2g}, {tolerance:g} is needed ({status}). "
                "Loosen the bounds, or drop objectives of very different size.",
                residual=worst,
                tolerance=tolerance,
            )
        return Outcome(x, z, objective, dual, None)

    def outside(self, s: Array) -> float:
        """Return how far s (rows,) is outside the cone."""
        return max((_outside(b.cone, s[part]) for b, part in zip(self.blocks, self.slices, strict=True)), default=0.0)

    def _certificate(self, z: Array, g: Array, tolerance: float) -> Certificate:
        """Polish and check a dual ray; the solver's word is not taken for it."""
        z = self.polished(z, g)
        stationarity = float(np.abs(self.G.T @ z).max(initial=0.0))
        violation = 0.0
        for block, part in zip(self.blocks, self.slices, strict=True):
            if block.cone != "zero":
                violation = max(violation, _outside(block.cone, z[part]))
        if not max(stationarity, violation) <= tolerance:
            raise SolverError(
                f"the conic solver reports infeasibility, but its certificate is off by {stationarity:.2g} and "
                f"{violation:.2g}, {tolerance:g} is needed",
                residual=max(stationarity, violation),
                tolerance=tolerance,
            )
        size = 1.0 / max(stationarity + violation, 1e-300)
        return Certificate(stationarity, violation, size, self._conflict(z, g))

    def polished(self, z: Array, g: Array) -> Array:
        """Return a dual ray moved onto G^T z = 0, with g.z = -1."""
        z = z / -float(g @ z)
        z = z - self._reach(z) @ (self.G.T @ z)
        return np.asarray(z / -float(g @ z))

    def _reach(self, z: Array) -> Array:
        """Return the weighted pseudo-inverse (rows, n) of G^T; rows that z uses are moved most."""
        weight = np.ones_like(z)
        for block, part in zip(self.blocks, self.slices, strict=True):
            if block.cone != "zero":
                weight[part] = np.minimum(1.0, np.linalg.norm(z[part]))
        W = weight[:, None] * self.G
        return np.asarray(weight[:, None] * np.linalg.pinv(W.T, rcond=1e-10))

    def _conflict(self, z: Array, g: Array) -> dict[str, float]:
        share: dict[str, float] = {}
        use: dict[str, float] = {}
        for block, part in zip(self.blocks, self.slices, strict=True):
            labels = (block.label,) * z[part].size if isinstance(block.label, str) else block.label
            for label, zi, gi in zip(labels, z[part], g[part], strict=True):
                share[label] = share.get(label, 0.0) - float(zi * gi)
                use[label] = max(use.get(label, 0.0), abs(float(zi)))
        largest = max(use.values(), default=0.0)
        kept = [label for label in use if use[label] > 1e-6 * largest]
        return {label: share[label] for label in sorted(kept, key=lambda k: -abs(share[k]))}


def svec(rows: Sequence[Sequence[Array]]) -> Array:
    """Stack linear functionals M_ij (n,) of a symmetric matrix into the scaled triangle of a "psd" block."""
    size = len(rows)
    return np.stack([rows[i][j] * (1.0 if i == j else ROOT2) for j in range(size) for i in range(j + 1)])


def smat(s: Array) -> Array:
    """Return the symmetric matrix of a scaled triangle."""
    size = int(np.sqrt(2 * s.size))
    M = np.zeros((size, size))
    k = 0
    for j in range(size):
        for i in range(j + 1):
            M[i, j] = M[j, i] = s[k] / (1.0 if i == j else ROOT2)
            k += 1
    return M


def _outside(cone: str, s: Array) -> float:
    if not s.size:
        return 0.0
    if cone == "zero":
        return float(np.abs(s).max())
    if cone == "nonneg":
        return max(0.0, -float(s.min()))
    if cone == "soc":
        return max(0.0, float(np.linalg.norm(s[1:]) - s[0]))
    return max(0.0, -float(np.linalg.eigvalsh(smat(s))[0]))


def _cones(clarabel: Any, blocks: Sequence[Block]) -> list[object]:
    made = {"zero": "ZeroConeT", "nonneg": "NonnegativeConeT", "soc": "SecondOrderConeT"}
    out = []
    for block in blocks:
        if block.cone == "psd":
            out.append(clarabel.PSDTriangleConeT(int(np.sqrt(2 * block.g.size))))
        else:
            out.append(getattr(clarabel, made[block.cone])(block.g.size))
    return out


def _clarabel() -> Any:
    try:
        import clarabel
    except ImportError as error:
        raise SolverError("the conic solver is not installed: pip install clarabel") from error
    return clarabel
