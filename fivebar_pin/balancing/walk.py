"""Walking on the closed configurations of a chain.

With J the scaled closure Jacobian, r its rank at closed configurations and T the last nv - r directions of a complete
orthogonal factorisation of J, velocities T x keep the loops closed, whatever joints are actuated. A step goes along T
and comes back to the closures by Newton steps of least length in all coordinates; so it does not stop where the
actuated joints lose control, only where the mechanism itself branches.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable
from fivebar_pin.mechanism.closing import Limits, iterate
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.loops import Loops
from fivebar_pin.mechanism.rank import BRANCHING, HELD, TIED

__all__ = ["Ground", "Walk", "come_back", "ground"]

_LONGEST, _SHORTEST = 0.7, 1e-4  # steps of a walk [rad, or chain lengths]
_CAREFUL = 0.2  # longest step of a careful walk over the smallest singular value [rad, or chain lengths]
_CLOSED = 1e-11  # scaled closure residual of a closed configuration [rad, or chain lengths]
_NEARLY = 1e-9  # scaled residual below which one more Newton step reaches round-off [rad, or chain lengths]
_STILL = 1e-12  # length of a heading that has no direction [rad, or chain lengths]
_NEWTON = 8  # steps of Newton's method
_DETOUR, _FREE = 0.4, 0.01  # longest way back to the closures, as a share of a step that is at least so long


@dataclass(frozen=True, slots=True, eq=False)
class Ground(Immutable):
    """Where a batch of walkers stands, as far as they need it.

    Attributes:
        q: configurations (n, nq).
        T: orthonormal tangent space, scaled (n, nv, na).
        sigma: lower estimate of the smallest singular value of the scaled Jacobian (n,).
        sound: whether it is closed and the mechanism does not branch (n,) of bool.
        control: the same estimate as sigma for the passive columns alone (n,).
        sign: sign of the determinant of these, per group of closures (n, groups).
    """

    q: Array
    T: Array
    sigma: Array
    sound: npt.NDArray[np.bool_]
    control: Array
    sign: Array

    def replaced(self, where: npt.NDArray[np.bool_], other: Ground) -> Ground:
        """Return the same with some walkers (n,) moved to where others stand."""
        mixed = {}
        for name in self.__slots__:
            mine, theirs = getattr(self, name), getattr(other, name)
            mixed[name] = np.where(where.reshape(-1, *(1,) * (mine.ndim - 1)), theirs, mine)
        return Ground(**mixed)

    def of(self, index: npt.NDArray[np.intp]) -> Ground:
        """Return some of the walkers."""
        return Ground(**{name: getattr(self, name)[index] for name in self.__slots__})


def ground(here: Configurations) -> Ground:
    """Return where walkers stand."""
    J, passive = here.factored, here.passive
    sound = (here.error <= _CLOSED) & (J.sigma > BRANCHING) & (J.tied < TIED)
    return Ground(here.q, J.tangent, J.sigma, sound, passive.sigma, passive.sign)


def come_back(loops: Loops, q: Array, longest: Array) -> tuple[Ground, Array]:
    """Bring nearly closed configurations (n, nq) to the closures; what is left shows in the residual.

    Args:
        loops: the closures.
        q: configurations (n, nq).
        longest: how far the coordinates may move before a walker is given up (n,) [rad, or chain lengths].

    Returns:
        Where they stand, and how far they moved (n,).
    """
    rule = _BackSteps(longest)
    iterate(loops, q, rule, most=_NEWTON + 1)  # the last one only looks
    return ground(rule.reached), rule.moved


class _BackSteps:
    """Newton steps of least length in all coordinates. Walkers that are done wait for the others."""

    reached: Configurations

    def __init__(self, longest: Array) -> None:
        self.moved = np.zeros(longest.size)
        self._longest, self._last, self._left = longest, np.zeros(longest.size, dtype=np.bool_), _NEWTON

    def __call__(self, here: Configurations, which: npt.NDArray[np.intp]) -> tuple[Array, npt.NDArray[np.bool_]]:
        self.reached = here
        step = -np.matmul(here.factored.back, here.reduced[..., None])[..., 0]
        step[self._last | ~np.isfinite(step).all(axis=1) | (self.moved > self._longest)] = 0.0
        if not self._left or not step.any():
            return here.q, np.zeros(which.size, dtype=np.bool_)
        self._left -= 1
        self._last = here.error < _NEARLY
        self.moved += np.abs(step).max(axis=1)
        return here.loops.tree.integrate(here.q, step * here.loops.column_scale), np.ones(which.size, dtype=np.bool_)


class Walk:
    """Walkers that wander over the closed configurations, each within what it can reach.

    Args:
        loops: of the chain.
        limits: of the actuated coordinates, kept.
        start: closed, regular configurations (n, nq) within the limits.
        rng: decides on the ways.
        careful: whether walkers turn round before every singularity, those of the actuated joints too. Steps are then
            so short that the smallest singular value cannot pass through zero on the way: where two branches of a
            mechanism meet, nobody jumps from one to the other.
    """

    def __init__(self, loops: Loops, limits: Limits, start: Ground, rng: np.random.Generator, *, careful: bool) -> None:
        self._loops, self._limits, self._rng, self._careful = loops, limits, rng, careful
        self.here = start
        n = start.q.shape[0]
        room = np.min((limits.high - limits.low) / loops.column_scale[limits.index], initial=np.inf)
        self._shortest = min(_SHORTEST, 0.05 * float(room)) if room > 0.0 else _SHORTEST
        self._reach = np.full(n, min(_LONGEST, max(0.5 * float(room), self._shortest)))
        self._heading = self._straight(rng.normal(size=(n, loops.tree.nv)))

    def step(self) -> Ground:
        """Let every walker take a step, shorter next time where it could not; return where those stand that could."""
        loops, here = self._loops, self.here
        along = np.matmul(here.T, np.matmul(np.swapaxes(here.T, 1, 2), self._heading[..., None]))[..., 0]
        length = np.minimum(self._reach, _CAREFUL * here.sigma) if self._careful else self._reach
        length = length * self._rng.uniform(0.3, 1.0, length.size)
        step = along * (length / np.maximum(np.abs(along).max(axis=1, initial=0.0), _STILL))[:, None]
        longest = _DETOUR * np.maximum(length, _FREE)
        there, detour = come_back(loops, loops.tree.integrate(here.q, step * loops.column_scale), longest)
        went = there.sound & (detour <= longest) & self._limits.inside(loops, there.q)
        if self._careful:
            went &= (there.sign == here.sign).all(axis=1) & (there.control > HELD)
        self.here = here.replaced(went, there)
        self._reach = np.clip(np.where(went, 1.5, 0.5) * self._reach, self._shortest, _LONGEST)
        turned = np.where(went[:, None], along, -along)
        size = np.linalg.norm(turned, axis=1, keepdims=True)
        self._heading = self._straight(turned / np.maximum(size, _STILL) + self._noise())
        return there.of(np.flatnonzero(went))

    def _noise(self) -> Array:
        shape = self._heading.shape
        return np.asarray(0.3 * self._rng.normal(size=shape) / np.sqrt(shape[1]))

    def _straight(self, heading: Array) -> Array:
        """Return headings (n, nv) along the tangent space, of length one."""
        T = self.here.T
        along = np.matmul(T, np.matmul(np.swapaxes(T, 1, 2), heading[..., None]))[..., 0]
        return np.asarray(along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), _STILL))
