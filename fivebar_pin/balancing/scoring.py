"""Scoring many mass distributions: the kinematics is paid once, a design costs one small matrix product.

A quantity along the motions is F pi + f. With the triangular factor R of [F f] / sqrt(n), its rms is |R (pi, 1)|, and
R has no more rows than there are parameters that matter, however long the motions are. Peaks need all samples.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import TINY, Array, Immutable, checked, figures, finite, frozen, reals
from fivebar_pin.balancing.objectives.objective import Objective, known, named
from fivebar_pin.balancing.regressors.measures import Measurement, Motions, measure, trajectories
from fivebar_pin.balancing.regressors.rows import Rows
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError

__all__ = ["Scores", "score"]

_PHYSICAL = 1e-9  # invariant of the second moments about a mass centre that counts as zero [of their size]
_NOISE = 1e-15  # singular values of a factor below this share of the largest are round-off [-]
_PEAK_VALUES = 2_000_000  # intermediate values per block when peaks are wanted
_BLOCK = 8192
_SINGLE = 200_000  # multiplications in a matrix product that stays on one thread


@dataclass(frozen=True, eq=False, repr=False)
class Scores(Immutable):
    """Values of the terms for every design.

    Attributes:
        values: by term name, (k,) each.
        scales: by term name, the largest sum of the sizes of what adds up to it; see `Loads.scale`.
    """

    values: MappingProxyType[str, Array]
    scales: MappingProxyType[str, float]

    def __getitem__(self, term: str) -> Array:
        return self.values[term]

    def __len__(self) -> int:
        return int(next(iter(self.values.values())).size)

    def __repr__(self) -> str:
        least = {name: figures(float(x.min()), self.scales[name]) for name, x in self.values.items() if len(self)}
        best = ", ".join(f"{name} from {x}" for name, x in least.items())
        return f"Scores({len(self)} designs; {best})"

    def best(self, term: str) -> int:
        """Return the index of the design with the smallest value."""
        return int(np.argmin(self.values[term]))


@finite()
def score(
    chain: ClosedChain,
    motions: Motions,
    designs: npt.ArrayLike,
    *,
    terms: Sequence[str | Objective] = ("rms_shaking_force", "rms_shaking_moment", "rms_torque"),
    about: npt.ArrayLike = (0.0, 0.0, 0.0),
    near: npt.ArrayLike | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Scores:
    """Evaluate many mass distributions of one chain along the same motions.

    Args:
        chain: the mechanism; gravity, friction and rotor inertia are its own, the bodies those of the designs.
        motions: motions (driven from `near`) or trajectories.
        designs: inertial parameters (k, nb, 10), or (nb, 10) for one.
        terms: rms_, peak_ or mean_square_ of torque (all motors), shaking_force, shaking_moment, frame_force,
            frame_moment, bearing_force, angular_momentum (deviation from the mean); added_mass, inertia. Vectors count
            with their length, all three components; an rms is over the samples.
        about: point of moments (3,) [m].
        near: picks the assembly mode of motions.
        progress: called with (designs done, designs in all) after every block.

    Raises:
        UnknownNameError: a term that does not exist.
        InvalidInputError: designs of the wrong shape, not finite, or not physical (which one).
    """
    given = (terms,) if isinstance(terms, (str, Objective)) else tuple(terms)
    atoms = tuple(dict.fromkeys(named(term, "term") for term in given))
    if not atoms or any(atom.distance for atom in atoms):
        possible = [name for name, atom in known().items() if not atom.distance]
        raise InvalidInputError("terms", [atom.name for atom in atoms], f"must be some of {possible}")
    X = _designs(chain, designs)
    point = checked("about", about, (3,))
    paths = trajectories(chain, motions, near)
    names = dict.fromkeys(atom.quantity for atom in atoms if atom.quantity is not None)
    measurement = Measurement(chain, None, paths, {m: measure(chain, paths, m, about=point) for m in names})
    found = {atom.root: rows for atom in atoms if (rows := atom.rms_rows(measurement)) is not None}
    factors = _factors(found, chain)
    whole = [measurement.rows[a.quantity] for a in atoms if a.quantity is not None and a.root not in found]
    block = _BLOCK
    if whole:
        block = max(1, min(block, _PEAK_VALUES // max(r.F.shape[0] * r.F.shape[1] for r in whole)))
    out = {atom: np.empty(len(X)) for atom in atoms}
    for start in range(0, len(X), block):
        part = slice(start, min(start + block, len(X)))
        _require_physical(X[part], start, chain)
        _fill(out, part, X[part].reshape(part.stop - start, -1), factors, measurement)
        if progress is not None:
            progress(part.stop, len(X))
    largest = np.abs(X).max(axis=0, initial=0.0)
    scales = {atom.name: atom.size(measurement, largest) for atom in atoms}
    values = MappingProxyType({atom.name: frozen(x) for atom, x in out.items()})
    return Scores(values, MappingProxyType(scales))


@dataclass(frozen=True, slots=True, eq=False)
class _Factors:
    """All triangular factors side by side: rms of a term = |(x[columns] @ W + w)[parts[term]]|."""

    columns: npt.NDArray[np.intp]
    W: Array  # (columns, r)
    w: Array  # (r,)
    parts: dict[Objective, slice]


def _factors(rows: dict[Objective, Rows], chain: ClosedChain) -> _Factors:
    scale = np.tile(chain.length ** np.array([0.0] + [1.0] * 3 + [2.0] * 6), len(chain.joints))
    found, parts, done = [np.zeros((0, scale.size + 1))], {}, 0
    for root, row in rows.items():
        stacked = np.concatenate([row.F * scale, row.f[..., None]], axis=2).reshape(-1, scale.size + 1)
        R = np.asarray(np.linalg.qr(stacked / np.sqrt(len(row.F)), mode="r"))
        _, s, Vt = np.linalg.svd(R, full_matrices=False)
        keep = s > _NOISE * max(float(s[0]) if s.size else 0.0, TINY)
        W = s[keep, None] * Vt[keep]
        W[np.abs(W) < _NOISE * np.abs(W).max(initial=0.0)] = 0.0
        found.append(W)
        parts[root] = slice(done, done + len(W))
        done += len(W)
    both = np.concatenate(found)
    columns = np.flatnonzero(np.any(both[:, :-1], axis=0))
    return _Factors(columns, np.ascontiguousarray((both[:, columns] / scale[columns]).T), both[:, -1], parts)


def _fill(out: dict[Objective, Array], part: slice, x: Array, factors: _Factors, measurement: Measurement) -> None:
    squares: dict[Objective, Array] = {}
    if factors.parts:
        y = _product(x.take(factors.columns, axis=1), factors.W)
        y += factors.w
        squares = {root: np.einsum("kr,kr->k", y[:, s], y[:, s]) for root, s in factors.parts.items()}
    for atom, values in out.items():
        if atom.root in squares:
            square = squares[atom.root]
            values[part] = square if atom.squared else np.sqrt(square)
        else:
            values[part] = atom.values(measurement, x)


def _product(x: Array, W: Array) -> Array:
    """Return x @ W in pieces too small for the linear algebra library to spread them over threads.

    Waiting for each other, its threads make products of this shape up to ten times slower.
    """
    if not W.size:
        return np.zeros((len(x), W.shape[1]))
    rows = max(1, _SINGLE // W.size)
    whole = len(x) // rows * rows
    out = np.empty((len(x), W.shape[1]))
    pieces = out[:whole].reshape(-1, rows, W.shape[1])
    np.matmul(x[:whole].reshape(-1, rows, W.shape[0]), W, out=pieces)
    np.matmul(x[whole:], W, out=out[whole:])
    return out


def _designs(chain: ClosedChain, designs: npt.ArrayLike) -> Array:
    X = reals("designs", designs)
    nb = len(chain.joints)
    X = X[None] if X.ndim == 2 else X
    if X.ndim != 3 or X.shape[1:] != (nb, 10):
        raise InvalidInputError("shape of designs", X.shape, f"must be (k, {nb}, 10)")
    return X


def _require_physical(X: Array, start: int, chain: ClosedChain, tolerance: float = _PHYSICAL) -> None:
    """Raise for a body whose second moments about its mass centre are not positive semidefinite.

    A symmetric matrix is so when its three invariants are not negative.
    """
    m, x, y, z, xx, xy, yy, xz, yz, zz = np.ascontiguousarray(np.moveaxis(X, 2, 0))
    with np.errstate(all="ignore"):  # nan fails every comparison below
        per = 1.0 / np.where(m > 0.0, m, 1.0)
        px, py, pz, half = x * per, y * per, z * per, 0.5 * (xx + yy + zz)
        a, b, c = half - xx - x * px, half - yy - y * py, half - zz - z * pz
        d, e, f = -xy - x * py, -xz - x * pz, -yz - y * pz
        size = np.abs(half) + x * px + y * py + z * pz
        ok = (m >= 0.0) & (m < np.inf) & (a + b + c >= -tolerance * size)
        ok &= a * b + a * c + b * c - d * d - e * e - f * f >= -tolerance * size**2
        ok &= a * (b * c - f * f) - d * (d * c - e * f) + e * (d * f - b * e) >= -tolerance * size**3
        ok &= (m > 0.0) | ((x == 0.0) & (y == 0.0) & (z == 0.0))
    if not ok.all():
        k, body = (int(i) for i in np.argwhere(~ok)[0])
        raise InvalidInputError(
            f"design {start + k}, body {chain.joints[body]}",
            [float(v) for v in X[k, body]],
            "is not physical: mass and second moments about the mass centre must not be negative",
        )
