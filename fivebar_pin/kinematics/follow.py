"""Following an assembly mode along a motion, sample after sample, every step certified: see `engine.following`.

Long motions are cut into chunks of a fixed number of samples. Their first samples are reached first, along straight
lines of the actuated coordinates; then every chunk is followed by itself, by several threads where there are some.
Where a chunk does not lead to where the next one begins, because the motion went another way round a singularity than
the straight line, that one is followed again from where it led to. What comes out does not depend on the number of
threads.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array, frozen
from fivebar_pin.engine.tables import FARTHEST, NQ, Q_HERE, STATUS, TOGETHER, Integers, unwritten
from fivebar_pin.engine.threads import each, threads_of
from fivebar_pin.errors import AssemblyError, InvalidInputError, SingularityError
from fivebar_pin.mechanism.closing import closed_enough, search
from fivebar_pin.mechanism.complement import complement_of
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.loops import Loops, open_message
from fivebar_pin.mechanism.prepared import Prepared

__all__ = ["Followed", "blocked", "follow", "require_near", "singular"]


_CHUNK = 4096  # samples that are followed one after the other
_SAME = 1e-9  # distance of closed configurations up to which they are one [rad, or chain lengths]
_NOWHERE = frozen([np.nan])
_OUT_OF_REACH = 1e-8  # closure residual that a search leaves where nothing closes, at least [m or rad]

Blocked = AssemblyError | SingularityError | InvalidInputError


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """A motion of all coordinates.

    Attributes:
        q, v, a: (n, nq), (n, nv), (n, nv).
        N: complement (n, nv, na).
        gap: largest closure residual (n,) [m or rad].
    """

    q: Array
    v: Array
    a: Array
    N: Array
    gap: Array

    @staticmethod
    def room(loops: Loops, n: int, nq: int) -> Followed:
        """Return room for n samples, the configurations nan."""
        nv, na = loops.tree.nv, loops.actuated.size
        q = np.empty((n, nq))
        q.fill(np.nan)
        return Followed(q, np.empty((n, nv)), np.empty((n, nv)), np.empty((n, nv, na)), np.empty(n))

    def part(self, k: slice) -> Followed:
        """Return some samples, the same memory."""
        return Followed(self.q[k], self.v[k], self.a[k], self.N[k], self.gap[k])


def follow(
    loops: Loops, ready: Prepared, q0: Array, motion: tuple[Array, Array, Array], threads: int | None
) -> Followed:
    """Follow the branch of q0 (nq,), closed at the first sample, along a motion of the motors: q, v, a (n, na) each.

    Raises:
        SingularityError, AssemblyError: with an attribute `sample` at the first sample not reached.
        InvalidInputError: the closures tie the motors to each other; steps too long.
    """
    X, n = motion[0], len(motion[0])
    require_near(loops, X)
    out = Followed.room(loops, n, q0.size)
    chunks = [_Chunk(loops, ready, motion, out, k, min(k + _CHUNK, n)) for k in range(0, n, _CHUNK)]
    if len(chunks) == 1:
        chunks[0].follow(q0)
    else:
        begun, _, _ = _reach(loops, ready, q0, X[::_CHUNK])
        begun[0] = q0
        each(lambda c: chunks[c].follow(begun[c]), len(chunks), threads_of(threads))
    for chunk, after in zip(chunks, [*chunks[1:], None], strict=True):
        if chunk.error is not None:
            raise chunk.error
        if after is not None and not _one(loops, chunk.end, after.begun):
            after.follow(chunk.end)
    return out


class _Chunk:
    """Some samples of a motion.

    Attributes:
        begun: the configuration that the first one was taken for (nq,).
        end: that at the first sample of the next chunk (nq,).
        error: why there is none.
    """

    def __init__(
        self, loops: Loops, ready: Prepared, motion: tuple[Array, Array, Array], out: Followed, first: int, last: int
    ) -> None:
        self._loops, self._ready, self._first = loops, ready, first
        self._q, self._v, self._a = (unwritten(x[first:last]) for x in motion)
        self._line = motion[0][last - 1 : last + 1]
        self._out = out.part(slice(first, last))
        self.begun = self.end = _NOWHERE
        self.error: Blocked | None = None

    def follow(self, begun: Array) -> None:
        """Follow them from a configuration, where it is one."""
        from fivebar_pin.engine.entries import drive

        self.begun, self.error = begun, None
        if not np.isfinite(begun).all():
            return  # the line to here was blocked: it is followed once the samples before it are
        I, W, out = self._ready.I, self._ready.memory(), self._out
        out.q[0] = begun
        done = drive(I, W, self._q, self._v, self._a, out.q, out.v, out.a, out.N, out.gap)
        if done < len(out.q):
            self.error = _blocked(self._loops, self._ready, self._q[done], done)
            _at(self.error, self._first + done)
        elif len(self._line) > 1:
            ends, _, self.error = _reach(self._loops, self._ready, out.q[-1], self._line)
            self.end = ends[1]
            if self.error is not None:
                _at(self.error, self._first + done)


def _reach(loops: Loops, ready: Prepared, q0: Array, X: Array) -> tuple[Array, Array, Blocked | None]:
    """Return the configurations reached, nan where none were, their residuals, and why."""
    from fivebar_pin.engine.entries import drive

    out, still = Followed.room(loops, len(X), q0.size), unwritten(np.zeros_like(X))
    out.q[0] = q0
    done = drive(ready.I, ready.memory(), unwritten(X), still, still, out.q, out.v, out.a, out.N, out.gap)
    return out.q, out.gap, _at(_blocked(loops, ready, X[done], done), done) if done < len(X) else None


def require_near(loops: Loops, X: Array) -> None:
    """Raise for a step so long that to follow it would take for ever."""
    if len(X) < 2 or not X.shape[1]:
        return
    step = np.abs(X[1:] - X[:-1]) / loops.column_scale[loops.actuated]
    if step.max() > FARTHEST:
        k, a = (int(i) for i in np.argwhere(step == step.max())[0])
        raise InvalidInputError(
            f"step of motor {a} to sample {k + 1}",
            float(X[k + 1, a] - X[k, a]),
            f"must be below {FARTHEST:g} rad, or lengths of the chain",
            "Take more samples.",
        )


def _one(loops: Loops, q: Array, other: Array) -> bool:
    """Tell whether two closed configurations (nq,) are one."""
    if not np.isfinite(other).all():
        return False
    away = loops.tree.difference(q[None], other[None])[0] / loops.column_scale
    return bool(np.abs(away).max(initial=0.0) <= _SAME)


def _blocked(loops: Loops, ready: Prepared, x: Array, done: int) -> Blocked:
    """Say why there is no way on from where this thread's memory is."""
    return blocked(loops, ready.I, ready.memory(), x if done else None)


def blocked(loops: Loops, I: Integers, W: Array, x: Array | None) -> Blocked:
    """Say why there is no way on from q in W to x (na,), or none at all: the motors, out of reach, or a singularity."""
    q = np.array(W[I[Q_HERE] : I[Q_HERE] + I[NQ]][None])
    here = Configurations(loops, np.array(q))
    if W[I[STATUS]] == TOGETHER:
        try:
            complement_of(here)
        except InvalidInputError as error:
            return error
    sigma = float(here.passive.sigma[0])
    if x is not None:
        loops.set_actuated(q, x)
        found = Configurations(loops, search(loops, q))
        if not closed_enough(loops, found.gap, _OUT_OF_REACH)[0]:
            return open_message(loops, found.residual[0], "at these actuated coordinates")
    return singular(sigma)


def singular(sigma: float) -> SingularityError:
    """Return the error of a motion that meets a singularity."""
    return SingularityError(
        "the motion meets a type 2 singularity: the actuated joints do not determine the passive ones there "
        f"(smallest scaled singular value {sigma:.2g}). Choose a motion that keeps away from it.",
        sigma=sigma,
    )


def _at(error: Blocked, sample: int) -> Blocked:
    """Say at which sample it happened."""
    if not isinstance(error, InvalidInputError):
        error.sample = sample
    return error
