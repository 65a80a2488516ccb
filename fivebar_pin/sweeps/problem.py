"""A sweep as data: the chain, the motion, the designs, and what is asked."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fivebar_pin._arrays import Array, Immutable, seal
from fivebar_pin.chain import ClosedChain
from fivebar_pin.engine.tables import CONSTANTS, Integers
from fivebar_pin.mechanism.dimensions import with_inertias, with_values
from fivebar_pin.mechanism.layout import Parts, constants_of, layout_of
from fivebar_pin.mechanism.prepared import parts_of
from fivebar_pin.motion import Motion
from fivebar_pin.sweeps.left_out import left_out
from fivebar_pin.sweeps.terms import Term, widths

__all__ = ["Problem", "Tables"]

_KNOT = 0.1  # turn of a placement from one knot to the next: between them its axes are straight lines [rad]
_MOST_NUMBERS = 400_000  # numbers of a chunk, at most: they stay in cache
_MOST_DESIGNS = 256  # designs of a chunk, at most: enough for NumPy's calls not to count


@dataclass(frozen=True, slots=True, eq=False)
class Tables:
    """What the engine needs, made once in every process.

    Attributes:
        I: records of the chain.
        checks: records with the rows that say nothing of this chain in place of its own; None where there are none.
        W: constants, and working memory as it is before the first sample.
        before: the constants of the chain (1, constants).
    """

    I: Integers
    checks: Integers | None
    W: Array
    before: Array


@dataclass(frozen=True, eq=False)
class Problem(Immutable):
    """What is to be computed.

    Attributes:
        chain: the mechanism that the designs are designs of.
        q0: its configuration at the first sample (nq,).
        motion: of the motors.
        n: number of designs.
        parameters: of every design, those that differ, (n,) each.
        inertias: inertial parameters (n, nb, 10), or None for those that follow from the parameters.
        terms: what is asked for.
        about: point of the moments (3,) [m].
        limits: lowest and highest configuration (nq,) each; infinite where they do not count.
    """

    chain: ClosedChain
    q0: Array
    motion: Motion
    n: int
    parameters: dict[str, Array]
    inertias: Array | None
    terms: tuple[Term, ...]
    about: Array
    limits: tuple[Array, Array]

    @cached_property
    def tables(self) -> Tables:
        """What the engine needs of the chain."""
        I, W = layout_of(self._parts)
        before = np.array(W[None, : I[CONSTANTS]])
        checks, W = left_out(I, W, self._parts)
        found = Tables(I, checks, W, before)
        seal((I, W, before, *(() if checks is None else (checks,))))
        return found

    @cached_property
    def chunk(self) -> int:
        """Number of designs that are worked on together; it does not depend on who does the work."""
        columns = sum(widths(self.chain)[name] for name in {term.quantity for term in self.terms})
        numbers = columns * len(self.motion) + self.knots * self.tables.before.size
        return max(1, min(_MOST_DESIGNS, _MOST_NUMBERS // numbers))

    @property
    def chunks(self) -> list[slice]:
        """The designs in chunks."""
        return [slice(k, min(k + self.chunk, self.n)) for k in range(0, self.n, self.chunk)]

    @cached_property
    def knots(self) -> int:
        """Number of points on the way from the chain to a design at which its constants are computed.

        Between them they change along straight lines: exactly where parameters slide, nearly where they turn.
        """
        rates = {name: 0.0 for name in self.parameters}
        for placement in self.chain.geometry.placements:
            for name, twist in placement.moves:
                if name in rates:
                    rates[name] += float(np.linalg.norm(twist[3:]))
        turn = sum(r * np.abs(self.parameters[k] - self.chain.parameters[k]).max(initial=0.0) for k, r in rates.items())
        return 1 + int(turn / _KNOT)

    def constants(self, k: slice) -> Array:
        """Return the constants of some designs at all knots (designs, knots, constants), the last being their own."""
        chain, knots, n = self.chain, self.knots, k.stop - k.start
        share = np.arange(1, knots + 1) / knots
        values: dict[str, Array] = {}
        for name, start in chain.parameters.items():
            end = self.parameters[name][k] if name in self.parameters else np.full(n, start)
            way = start + share * (end[:, None] - start)
            way[:, -1] = end
            values[name] = way.ravel()
        dimensions = with_values(chain, values)
        if self.inertias is not None:
            dimensions = with_inertias(dimensions, np.repeat(self.inertias[k], knots, axis=0))
        C = constants_of(replace(self._parts, dimensions=dimensions))
        return np.array(np.broadcast_to(C, (n * knots, C.shape[1]))).reshape(n, knots, -1)

    @cached_property
    def _parts(self) -> Parts:
        return replace(parts_of(self.chain), bodiless=True)

    @cached_property
    def key(self) -> str:
        """A number that is another one for another problem, in hexadecimal digits."""
        tables, geometry = self.tables, self.chain.geometry
        found = hashlib.sha256()
        for array in (tables.I, tables.W, self.q0, self.about, *self.limits):
            found.update(np.ascontiguousarray(array).tobytes())
        for array in (self.motion.t, self.motion.q, self.motion.v, self.motion.a):
            found.update(array.tobytes())
        for placement in geometry.placements:
            found.update(repr((placement.name, [name for name, _ in placement.moves])).encode())
            found.update(b"".join([np.asarray(placement.base).tobytes(), *(s.tobytes() for _, s in placement.moves)]))
        found.update(repr((geometry.bodies, dict(geometry.parameters), [term.name for term in self.terms])).encode())
        for name, values in sorted(self.parameters.items()):
            found.update(name.encode() + values.tobytes())
        found.update(b"" if self.inertias is None else self.inertias.tobytes())
        return found.hexdigest()
