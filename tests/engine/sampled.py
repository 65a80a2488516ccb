"""The sample at hand of a chain, written and read by name, and samples one after the other; for tests."""

from __future__ import annotations

import calls
import numpy as np

import fivebar_pin as fb
from fivebar_pin._arrays import frozen
from fivebar_pin.engine import entries
from fivebar_pin.engine import tables as e
from fivebar_pin.mechanism.links import bodies_of, links_of
from fivebar_pin.mechanism.prepared import prepared_of


class Sampled:
    """One sample of a chain in the memory of the engine.

    Attributes:
        chain: the mechanism.
        I, W: its records, and a copy of its memory.
    """

    def __init__(self, chain: fb.ClosedChain) -> None:
        prepared = prepared_of(chain)
        self.chain, self.I, self.W = chain, prepared.I, np.array(prepared.W)
        self.last = bodies_of(links_of(chain.model))  # link of a joint's body

    def numbers(self, field: int, count: int) -> np.ndarray:
        """Return a view of the numbers whose place a field of the header tells."""
        return self.W[self.I[field] : self.I[field] + count]

    def set(self, q=None, v=None, a=None) -> Sampled:
        """Write configuration, velocity and acceleration."""
        for field, x in ((e.Q_HERE, q), (e.V_HERE, v), (e.A_HERE, a)):
            if x is not None:
                self.numbers(field, len(x))[:] = x
        return self

    @property
    def q(self) -> np.ndarray:
        return np.array(self.numbers(e.Q_HERE, self.chain.nq))

    def records(self, first: int, size: int) -> range:
        """Return where the records of a kind begin."""
        return range(int(self.I[first]), int(self.I[first + 1]), size)

    @property
    def rows(self) -> range:
        return self.records(e.ROWS, e.ROW_SIZE)

    @property
    def blocks(self) -> range:
        return self.records(e.BLOCKS, e.BLOCK_SIZE)

    def of(self, record: int, field: int) -> int:
        return int(self.I[record + field])

    def listed(self, record: int, field: int, count: int) -> np.ndarray:
        """Return a list of integers that a record points at."""
        start = self.of(record, field)
        return self.I[start : start + self.of(record, count)]

    def pose(self, joint: int) -> tuple[np.ndarray, np.ndarray]:
        """Return axes (3, 3) and origin (3,) of a joint of the model in the world."""
        j, axes = self.last[joint]
        k = self.of(self.I[e.LINKS] + e.LINK_SIZE * j, e.POSE)
        return self.W[k : k + 9].reshape(3, 3) @ axes.T, self.W[k + 9 : k + 12]

    def rate(self, joint: int) -> np.ndarray:
        """Return ω, v, α, a of a joint of the model (4, 3)."""
        k = self.of(self.I[e.LINKS] + e.LINK_SIZE * self.last[joint][0], e.RATE)
        return self.W[k : k + 12].reshape(4, 3)

    def per_row(self, field: int) -> np.ndarray:
        """Return one number of every row."""
        return np.array([self.W[self.of(r, field)] for r in self.rows])

    @property
    def J(self) -> np.ndarray:
        """The Jacobian of the rows of the engine (rows, nv)."""
        J = np.zeros((len(self.rows), self.chain.nv))
        for i, r in enumerate(self.rows):
            for n, k in enumerate(range(self.of(r, e.ENTRIES), self.of(r, e.ENTRIES_END), e.ENTRY_SIZE)):
                J[i, self.of(k, e.COLUMN)] = self.W[self.of(r, e.JACOBIAN0) + n]
        return J

    def close(self, q: np.ndarray) -> bool:
        self.set(q=q)
        return bool(calls.close(self.I, self.W))


class Driven:
    """A motion of the motors (n, na), followed by `entries.drive` from q0; memory may be that of another drive."""

    def __init__(self, chain: fb.ClosedChain, x, q0, *, v=None, a=None, W=None) -> None:
        s, x = Sampled(chain), frozen(np.atleast_2d(np.asarray(x, dtype=float)))
        self.W = s.W if W is None else W
        n, nv, still = len(x), chain.nv, np.zeros_like(x)
        self.q, self.v, self.a = np.full((n, chain.nq), np.nan), np.full((n, nv), np.nan), np.full((n, nv), np.nan)
        self.N, self.gap = np.full((n, nv, chain.na), np.nan), np.full(n, np.nan)
        self.q[0] = q0
        rates = [frozen(still if y is None else y) for y in (v, a)]
        out = self.q, self.v, self.a, self.N, self.gap
        self.done = entries.drive(s.I, self.W, x, *rates, *out)
        self.status = int(self.W[s.I[e.STATUS]])
        self.here = np.array(self.W[s.I[e.Q_HERE] :][: chain.nq])
