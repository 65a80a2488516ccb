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

_NOISE = 1e-15  # singular values of a factor below this share of the largest are round-off [-]
_PEAK_VALUES = 2_000_000  # intermediate values per block when peaks are wanted
_BLOCK = 2048  # designs at a time: they stay in cache while they are looked at, measured and scored


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
    from fivebar_pin.balancing.scoring_loops import enlarge

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
    out, largest = {atom: np.empty(len(X)) for atom in atoms}, np.zeros(X.shape[1:])
    for start in range(0, len(X), block):
        part = slice(start, min(start + block, len(X)))
        some = np.ascontiguousarray(X[part])
        _require_physical(some, start, chain)
        enlarge(largest, some)
        _fill(out, part, some.reshape(len(some), -1), factors, measurement)
        if progress is not None:
            progress(part.stop, len(X))
    scales = {atom.name: atom.size(measurement, largest) for atom in atoms}
    values = MappingProxyType({atom.name: frozen(x) for atom, x in out.items()})
    return Scores(values, MappingProxyType(scales))


@dataclass(frozen=True, slots=True, eq=False)
class _Factors:
    """All triangular factors one below the other: rms of a term = |(W @ x[columns] + w)[parts[term]]|."""

    columns: npt.NDArray[np.intp]
    W: Array  # (r, columns)
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
    W, w = both[:, columns] / scale[columns], both[:, -1]
    return _Factors(columns, np.ascontiguousarray(W), np.ascontiguousarray(w), parts)


def _fill(out: dict[Objective, Array], part: slice, x: Array, factors: _Factors, measurement: Measurement) -> None:
    from fivebar_pin.balancing.scoring_loops import squares

    ends = np.array([rows.stop for rows in factors.parts.values()], dtype=np.intp)
    found = dict(zip(factors.parts, squares(x, factors.columns, factors.W, factors.w, ends), strict=True))
    for atom, values in out.items():
        if atom.root in found:
            square = found[atom.root]
            values[part] = square if atom.squared else np.sqrt(square)
        else:
            values[part] = atom.values(measurement, x)


def _designs(chain: ClosedChain, designs: npt.ArrayLike) -> Array:
    X = reals("designs", designs)
    nb = len(chain.joints)
    X = X[None] if X.ndim == 2 else X
    if X.ndim != 3 or X.shape[1:] != (nb, 10):
        raise InvalidInputError("shape of designs", X.shape, f"must be (k, {nb}, 10)")
    return X


def _require_physical(X: Array, start: int, chain: ClosedChain) -> None:
    """Raise for the first body whose mass or second moments about its mass centre are negative."""
    from fivebar_pin.balancing.scoring_loops import first_unphysical

    first = first_unphysical(X)
    if first >= 0:
        k, body = divmod(first, X.shape[1])
        raise InvalidInputError(
            f"design {start + k}, body {chain.joints[body]}",
            [float(v) for v in X[k, body]],
            "is not physical: mass and second moments about the mass centre must not be negative",
        )
