"""Samples of the closed configurations of a chain, drawn once, and whether it moves in a plane."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from threading import Lock
from typing import Literal

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, Immutable, checked, frozen
from fivebar_pin.balancing.parameters import Space, plane_axes
from fivebar_pin.balancing.walk import Ground, Walk, ground
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import AssemblyError, InvalidInputError, UnknownNameError
from fivebar_pin.mechanism.closing import Limits, polish, residual_of, search
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.idle import at_rest
from fivebar_pin.mechanism.loops import Loops, loops_of
from fivebar_pin.mechanism.per_chain import once_per_chain
from fivebar_pin.mechanism.plane import plane_normal
from fivebar_pin.mechanism.rank import HELD
from fivebar_pin.mechanism.tree import Poses

__all__ = ["Samples", "SpaceName", "closed_at", "random_samples", "space_of"]

SpaceName = Literal["auto", "planar", "spatial"]

_FILED = 1e-6  # residual of a closed configuration from a file, with its digits [m or rad, times a length above 1 m]
_STARTS = 96  # random configurations at a time that a search for closed ones starts from
_TRIES = 12  # times so many, while nothing closes
_SEARCH = 60  # steps of a search
_MANY = 16  # places that walkers set out from that are many
_WALKERS = 48  # walkers at least, several from one place when these are few
_ROUND, _LONG = 4, 80  # steps of a round, when they set out from many places and when from few
_ROUNDS, _IDLE = 400, 12  # rounds of one request, and of them without a sample in turn, before it is an error
_KEPT = 1024  # samples kept of a round
_USUAL = 0.1  # share of the usual hold of the motors on the mechanism (`Ground.control`) that is worth a sample [-]
_ENDLESS = 1e3  # joint limits beyond this [rad, or chain lengths] are none
_AT_LIMIT = 1e-9  # how far beyond a limit a configuration still lies on it [rad or m]
_SHELF = 8  # draws remembered for one chain


@dataclass(frozen=True, slots=True, eq=False)
class Samples(Immutable):
    """Closed, regular configurations.

    Attributes:
        q: configurations (n, nq).
        N: at each a basis of the velocities that keep the loops closed (n, nv, na), orthonormal when scaled.
        poses: of the joints.
    """

    q: Array
    N: Array
    poses: Poses

    def __len__(self) -> int:
        return int(self.q.shape[0])


def random_samples(
    chain: ClosedChain, count: int, *, near: npt.ArrayLike | None = None, seed: int = 0, skip: int = 0
) -> Samples:
    """Return closed configurations met on random walks over all that the mechanism can take.

    Walkers set out from the model's reference configurations, the neutral one and random ones, closed in all
    coordinates. They keep the limits of the actuated joints; those of passive joints play no part. What was drawn for
    a chain, `near` and seed is remembered and goes on where it stopped: more samples begin with the same ones.

    Args:
        chain: the mechanism.
        count: how many.
        near: closed configuration (nq,); when given, only configurations that can be reached from it without
            passing a singularity are drawn, else all assembly modes that the starts lead to.
        seed: of the draw.
        skip: how many of the first to leave out.

    Raises:
        AssemblyError: too few configurations close, or `near` is not closed.
        InvalidInputError: nothing is actuated, the motion is left undetermined, or `near` is beyond a limit.
    """
    chain = at_rest(chain)
    loops = loops_of(chain)
    loops.require_determined()
    if not chain.na:
        raise InvalidInputError("actuated joints", [], "must be at least one, else nothing moves")
    if not isinstance(seed, (int, np.integer)) or seed < 0:
        raise InvalidInputError("seed", seed, "must be an integer, not negative")
    at = None if near is None else checked("near", near, (chain.nq,))
    q, N = _shelf_of(chain).first(chain, at, int(seed), count)
    q, N = q[skip:], N[skip:]
    return Samples(q, N, loops.tree.poses(q))


def space_of(chain: ClosedChain, samples: Samples, space: SpaceName = "auto") -> Space:
    """Return the space of parameters: planar when every joint of the sampled chain moves in parallel planes.

    Raises:
        InvalidInputError: a spatial mechanism asked to be planar.
        UnknownNameError: a space that does not exist.
    """
    if space not in ("auto", "planar", "spatial"):
        raise UnknownNameError("space", space, ("auto", "planar", "spatial"))
    nb = chain.model.njoints - 1
    normal = None if space == "spatial" else plane_normal(samples.poses.S, chain.length)
    if normal is None:
        if space == "planar":
            raise InvalidInputError("space", space, f"{chain.name} does not move in parallel planes")
        return Space(chain.joints, None, frozen(np.broadcast_to(np.eye(3), (nb, 3, 3))), chain.length)
    axes = [plane_axes(samples.poses.R[j][0].T @ normal) for j in range(1, nb + 1)]
    return Space(chain.joints, frozen(normal), frozen(axes), chain.length)


class _Shelf:
    """The draws of one chain: made once, then continued, the oldest given up; one thread at a time."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._draws: OrderedDict[tuple[bytes, int], _Draw] = OrderedDict()

    def first(self, chain: ClosedChain, near: Array | None, seed: int, count: int) -> tuple[Array, Array]:
        """Return q and N of the first samples of a draw."""
        key = (b"" if near is None else near.tobytes(), seed)
        with self._lock:
            draw = self._draws.pop(key, None) or _Draw(chain, near, seed)
            self._draws[key] = draw
            if len(self._draws) > _SHELF:
                self._draws.popitem(last=False)
            return draw.first(count)


@once_per_chain
def _shelf_of(chain: ClosedChain) -> _Shelf:
    return _Shelf()


class _Draw:
    """The samples of one chain, place and seed that were asked for so far; kept, so it holds no chain."""

    def __init__(self, chain: ClosedChain, near: Array | None, seed: int) -> None:
        self._loops = loops_of(chain)
        self._rng = np.random.default_rng(seed)
        self._limits = _limits(chain, self._loops)
        self._near = near is not None
        self._tried = self._walked = 0
        self._open: tuple[str, float] = ("none", float("nan"))
        if near is None:
            places = self._places([pin.neutral(chain.model), *chain.references.values()])
        else:
            places = self._place(chain, near)
        self._closed = n = places.q.shape[0]
        walkers = places.of(np.resize(np.arange(n), max(_WALKERS, n)) if n else np.arange(0))
        self._steps = _ROUND if n >= _MANY else _LONG
        self._walk = Walk(self._loops, self._limits, walkers, self._rng, careful=self._near)
        self._fit = max(HELD, _USUAL * float(np.median(places.control))) if n else HELD
        self._q, self._N = self._mixed([places])

    def first(self, count: int) -> tuple[Array, Array]:
        """Return q (count, nq) and N (count, nv, na); walk on where fewer were drawn so far.

        Raises:
            AssemblyError: the walks lead to fewer.
        """
        rounds = idle = 0
        while self._closed and self._q.shape[0] < count and rounds < _ROUNDS and idle < _IDLE:
            q, N = self._mixed([self._walk.step() for _ in range(self._steps)])
            self._q, self._N = np.concatenate([self._q, q]), np.concatenate([self._N, N])
            self._walked += self._steps
            rounds, idle = rounds + 1, 0 if q.shape[0] else idle + 1
        if self._q.shape[0] < count:
            raise self._too_few(count)
        return self._q[:count], self._N[:count]

    def _mixed(self, stops: Sequence[Ground]) -> tuple[Array, Array]:
        """Return q and N of some of the stops that are fit for samples, in random order."""
        fit = [stop.control > self._fit for stop in stops]
        q = np.concatenate([stop.q[ok] for stop, ok in zip(stops, fit, strict=True)])
        T = np.concatenate([stop.T[ok] for stop, ok in zip(stops, fit, strict=True)])
        pick = self._rng.permutation(q.shape[0])[:_KEPT]
        return q[pick], T[pick] * self._loops.column_scale[:, None]

    def _places(self, named: Sequence[Array]) -> Ground:
        """Return closed, regular configurations that a search leads to from named and random ones."""
        loops = self._loops
        starts = np.concatenate([np.stack(named), self._random(named[0], named[-1])])
        for _ in range(_TRIES):
            self._limits.clamp(loops, starts)
            q = starts
            if loops.m:
                q = search(loops, starts, columns=np.arange(loops.tree.nv), limits=self._limits, iterations=_SEARCH)
                self._note(q)
                q = polish(loops, q).q
            here = ground(Configurations(loops, q))
            good = here.sound & (here.control > HELD) & self._limits.inside(loops, q)
            if loops.m:
                good &= ~loops.opposed(loops.see(q))
            self._tried += starts.shape[0]
            if good.any():
                break
            starts = self._random(named[0], named[-1])
        return here.of(np.flatnonzero(good))

    def _note(self, q: Array) -> None:
        """Remember what stays open the least, as evidence."""
        residual = residual_of(self._loops, q)
        name, size = self._loops.worst(residual[int(np.argmin(np.linalg.norm(residual, axis=1)))])
        if not size >= self._open[1]:
            self._open = name, size

    def _random(self, neutral: Array, middle: Array) -> Array:
        """Return random configurations (n, nq), limited coordinates within their limits, about a middle one."""
        loops, limits = self._loops, self._limits
        tangent = self._rng.uniform(-np.pi, np.pi, (_STARTS, loops.tree.nv)) * loops.column_scale
        q = loops.tree.integrate(np.repeat(neutral[None], _STARTS, axis=0), tangent)
        turn = 2.0 * np.pi * loops.column_scale[limits.index]
        width = np.minimum(limits.high - limits.low, turn)
        centre = limits.values(loops, middle[None])[0] if width.size else width
        start = np.clip(centre - 0.5 * width, limits.low, limits.high - width)
        for k, low, wide in zip(limits.index, start, width, strict=True):
            loops.tree.set_coordinate(q, int(k), low + wide * self._rng.uniform(0.0, 1.0, _STARTS))
        return q

    def _place(self, chain: ClosedChain, near: Array) -> Ground:
        """Return one closed configuration, checked."""
        loops, q = self._loops, np.array(near)[None]
        if loops.m:
            if not closed_at(loops, q[0]):
                name, size = loops.worst(residual_of(loops, q)[0])
                raise AssemblyError(
                    f"the configuration near is not closed: closure {name} stays open by {size:.3g} m or rad. "
                    "Use assemble(chain, q_actuated) to close it.",
                    closure=name,
                    residual=size,
                )
            q = polish(loops, q).q
        x = self._limits.values(loops, q)[0] if self._limits.index.size else np.zeros(0)
        for k, value, low, high in zip(self._limits.index, x, self._limits.low, self._limits.high, strict=True):
            if not low - _AT_LIMIT <= value <= high + _AT_LIMIT:
                joint = chain.actuated[int(np.flatnonzero(loops.actuated == k)[0])]
                bound = f"must lie within its limits [{low:.6g}, {high:.6g}]"
                raise InvalidInputError(f"actuated joint {joint} in near", float(value), bound)
        self._tried = 1
        return ground(Configurations(loops, q))

    def _too_few(self, wanted: int) -> AssemblyError:
        name, size = self._open
        if self._near:
            from_where = f"{self._walked} steps from near, short of every singularity,"
        else:
            from_where = (
                f"searches from {self._tried} starts (references, neutral and random configurations) closed "
                f"{self._closed}, smallest closure residual {size:.3g}; {self._walked} steps from there"
            )
        return AssemblyError(
            f"only {self._q.shape[0]} of {wanted} random configurations close away from singularities and within the "
            f"limits of the actuated joints: {from_where} led to no more. Give near=, a closed configuration to start "
            "from, widen the limits, or ask diagnose(chain) whether too many joints are actuated.",
            closure=name,
            residual=size,
        )


def _limits(chain: ClosedChain, loops: Loops) -> Limits:
    """Return the limits of the actuated coordinates that are any; huge ones are none."""
    model, index, low, high = chain.model, [], [], []
    for k, name in zip(loops.actuated, chain.actuated, strict=True):
        joint = model.joints[model.getJointId(name)]
        if joint.nq != 1:
            continue
        ends = float(model.lowerPositionLimit[joint.idx_q]), float(model.upperPositionLimit[joint.idx_q])
        real = [abs(x) <= _ENDLESS * loops.column_scale[k] for x in ends]
        if any(real):
            index.append(int(k))
            low.append(ends[0] if real[0] else -np.inf)
            high.append(ends[1] if real[1] else np.inf)
    return Limits(np.array(index, dtype=np.intp), np.array(low), np.array(high))


def closed_at(loops: Loops, q: Array) -> bool:
    """Return whether a configuration (nq,) closes the loops, but for what rounding in a file leaves."""
    residual = residual_of(loops, q[None])[0] if loops.m else np.zeros(1)
    return bool(np.abs(residual).max() <= _FILED * max(1.0, loops.length))
