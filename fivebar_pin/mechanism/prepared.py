"""A chain prepared for the engine: its records, and working memory for every thread."""

from __future__ import annotations

import threading
from typing import NamedTuple

import numpy as np

from fivebar_pin._arrays import Array, seal
from fivebar_pin.chain import ClosedChain
from fivebar_pin.closures import Anchored
from fivebar_pin.closures.frame_closure import AnchoredFrames
from fivebar_pin.closures.rows import Row
from fivebar_pin.engine.tables import Integers
from fivebar_pin.mechanism.layout import Index, Parts, blocks_of, joined_rows, layout_of
from fivebar_pin.mechanism.links import links_of
from fivebar_pin.mechanism.loops import Loops, loops_of
from fivebar_pin.mechanism.per_chain import once_per_chain
from fivebar_pin.mechanism.rank import ranks_of

__all__ = ["Prepared", "parts_of", "prepared_of"]

_SILENT = 1e-12  # share of the largest singular value that is the round-off of a row that says nothing [-]


class Prepared:
    """The two vectors of the engine.

    Attributes:
        I: records of the chain, never written.
        W: its constants, and working memory as it is before the first sample; never written.
        turns: 1 for motors that come back to the same pose after a whole turn, 2 for those of these whose coordinates
            do not tell, else 0 (na,).
        left: residual of the combinations of rows that no motion changes: they say nothing, and stay open where they
            are [m, rad or -].
        mixed: the rows of the engine as orthonormal combinations of those of the closures, both scaled (rows, m).
        vanishing: the other combinations, which say nothing anywhere, each of rows of one sort of one closure (k, m).
    """

    def __init__(
        self, vectors: tuple[Integers, Array], turns: Integers, left: float, mixes: tuple[Array, Array]
    ) -> None:
        (self.I, self.W), self.turns, self.left = vectors, turns, left
        self.mixed, self.vanishing = mixes
        seal((*vectors, turns, *mixes))
        self._threads = threading.local()

    def memory(self) -> Array:
        """Return the working memory of this thread."""
        if not hasattr(self._threads, "W"):
            self._threads.W = np.array(self.W)
        found: Array = self._threads.W
        return found


@once_per_chain
def prepared_of(chain: ClosedChain) -> Prepared:
    """Return a chain as the engine sees it, made once."""
    loops = loops_of(chain)
    parts, mixes = _taken_apart(loops, chain)
    return Prepared(layout_of(parts), _turns(chain, loops), loops.left, mixes)


def parts_of(chain: ClosedChain) -> Parts:
    """Return what the tables of a chain are made of: independent rows, and the blocks they make."""
    return _taken_apart(loops_of(chain), chain)[0]


def _taken_apart(loops: Loops, chain: ClosedChain) -> tuple[Parts, tuple[Array, Array]]:
    """Return the parts of a chain, and the combinations of all rows that are kept and that vanish."""
    kept = [_independent_rows(c, J, loops) for c, J in zip(loops.anchored, loops.generic_jacobians, strict=True)]
    starts = np.cumsum([0, *(x.J.shape[1] for x in kept)])
    touched = [c.columns for c, x in zip(loops.anchored, kept, strict=True) for _ in range(x.J.shape[1])]
    systems = []
    for group in loops.independent:
        rows = np.concatenate([np.arange(starts[k], starts[k + 1]) for k in group.members])
        wide = [_spread(kept[k].J, loops.anchored[k].columns, chain.nv) for k in group.members]
        systems.append((rows, loops.passive[group.passive], _combinations(np.concatenate(wide))))
    parts = Parts(
        chain,
        links_of(chain.model),
        loops.anchored,
        [x.rows for x in kept],
        blocks_of(systems, touched, chain.actuated_index),
        loops.column_scale,
        loops.length,
        [x.left for x in kept],
        misfit=loops.misfit,
    )
    return parts, _mixes(loops, [x.mixes for x in kept])


def _turns(chain: ClosedChain, loops: Loops) -> Integers:
    """Return whether motors come back to the same pose after a whole turn, see `Prepared`."""
    names = {name for closure in chain.closures for name in closure.counted}
    counted = {int(chain.model.idx_vs[chain.model.getJointId(name)]) for name in names}
    motors = [int(k) for k in loops.actuated]
    whole = [loops.tree.is_angle(k) and k not in counted for k in motors]
    cyclic = [loops.tree.is_cyclic(k) for k in motors]
    return np.array([2 * c or int(w) for w, c in zip(whole, cyclic, strict=True)], dtype=np.int64)


def _mixes(loops: Loops, parts: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Return the combinations of the rows of each closure as ones of all rows: those kept, those that vanish."""
    found = []
    for some in zip(*parts, strict=True):
        spread = np.zeros((sum(len(x) for x in some), loops.m))
        start = 0
        for c, mix in zip(loops.anchored, some, strict=True):
            spread[start : start + len(mix), c.rows], start = mix, start + len(mix)
        found.append(spread)
    kept, vanishing = found if found else (np.zeros((0, 0)), np.zeros((0, 0)))
    return kept, vanishing


class _Kept(NamedTuple):
    """What is kept of the rows of a closure, what says nothing, the scaled Jacobian, and both as combinations."""

    rows: tuple[Row, ...]
    left: tuple[Row, ...]
    J: Array
    mixes: tuple[Array, Array]


def _independent_rows(anchored: Anchored, J: Array, loops: Loops) -> _Kept:
    """Return the rows of a closure that say something, and those that say nothing anywhere.

    Rows of one sort are combined: in a planar loop three rows along the axes become two in the plane. The combinations
    that are kept, and those that are not, come with them.
    """
    J, length = J * loops.column_scale[anchored.columns], loops.length
    if not isinstance(anchored, AnchoredFrames):
        whole = np.eye(J.shape[1])
        J = J * anchored.row_scale(length, loops.column_scale)[:, None]
        return _Kept((), (), J, (whole, whole[:0]))
    rows = anchored.closure.rows
    kept: list[Row] = []
    left: list[Row] = []
    scaled: list[Array] = []
    mixes: tuple[list[Array], list[Array]] = [], []
    for sort in dict.fromkeys((row.sort, row.other.tobytes()) for row in rows):
        some = [k for k, row in enumerate(rows) if (row.sort, row.other.tobytes()) == sort]
        mine = J[:, some] * (1.0 / length if sort[0] in ("along", "length") else 1.0)
        mix, idle = _split(np.concatenate(list(mine), axis=1))
        kept += joined_rows([rows[k] for k in some], mix)
        left += joined_rows([rows[k] for k in some], idle)
        scaled.append(np.matmul(mix, mine))
        for found, mixed in zip(mixes, (mix, idle), strict=True):
            found.append(mixed @ np.eye(len(rows))[some])
    both = np.concatenate(mixes[0]), np.concatenate(mixes[1])
    return _Kept(tuple(kept), tuple(left), np.concatenate(scaled, axis=1), both)


def _split(wide: Array) -> tuple[Array, Array]:
    """Return combinations of rows (k, m) that are independent, and the others, which vanish.

    Rows that are zero are left out and the others stay as they are, so that they are the same for all designs of a
    linkage; only where that is not all they are mixed.
    """
    U, s, _ = np.linalg.svd(wide, full_matrices=False)
    r = int(ranks_of(s))
    sizes = np.linalg.norm(wide, axis=1)
    silent = np.argsort(sizes)[: len(wide) - r]
    if np.all(sizes[silent] <= _SILENT * s.max(initial=0.0)):
        same = np.eye(len(wide))
        return np.delete(same, silent, axis=0), same[np.sort(silent)]
    return np.asarray(U[:, :r].T), np.asarray(U[:, r:].T)


def _spread(J: Array, columns: Index, nv: int) -> Array:
    """Return rows of a closure at all samples side by side, in all columns (rows, n nv)."""
    whole = np.zeros((J.shape[1], J.shape[0], nv))
    whole[:, :, columns] = np.swapaxes(J, 0, 1)
    return whole.reshape(J.shape[1], J.shape[0] * nv)


def _combinations(wide: Array) -> Array | None:
    """Return the combinations of rows that are independent, or None where all are."""
    U, s, _ = np.linalg.svd(wide, full_matrices=False)
    r = int(ranks_of(s))
    return None if r == wide.shape[0] else np.asarray(U[:, :r].T)
