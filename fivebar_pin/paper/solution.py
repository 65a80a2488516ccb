"""The result of the closed-form road: motion and loads of the five-bar along its samples."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fivebar_pin._arrays import Array, Immutable, finite, frozen
from fivebar_pin.paper.assembly_mode import AssemblyMode
from fivebar_pin.paper.linkage import FiveBar
from fivebar_pin.paper.positions import CArray
from fivebar_pin.trajectory import Trajectory

__all__ = ["Solution"]


@dataclass(frozen=True, eq=False, repr=False)
class Solution(Immutable):
    """Motion and loads of the five-bar. Columns of angles, rates and accelerations: psi, theta, phi, gamma.

    Attributes:
        linkage: the parameters.
        mode: assembly mode.
        t: times (n,) [s].
        angles: absolute link angles (n, 4) [rad], continuous along the samples.
        rates: (n, 4) [rad/s].
        accelerations: (n, 4) [rad/s2].
        partials: d(theta, phi)/d(psi, gamma) (n, 2, 2) [-].
        torque: of the motors at O1 on link 1 and at O0 on link 4 (n, 2) [N m].
        joint_forces: f01, f12, f23, f34, f40 (n, 5, 2) [N]; f_ij by link i on link j, f40 by link 4 on the frame.
        shaking_force: -dp/dt, of the links' inertia on the frame (n, 3) [N].
        shaking_moment: -dH/dt about O1, the world origin (n, 3) [N m].
        frame_force, frame_moment: the same with the weight: all that the frame carries (n, 3) [N, N m].
        com: mass centre of the linkage (n, 3) [m].
    """

    linkage: FiveBar
    mode: AssemblyMode
    t: Array
    angles: Array
    rates: Array
    accelerations: Array
    partials: Array
    torque: Array
    joint_forces: Array
    shaking_force: Array
    shaking_moment: Array
    frame_force: Array
    frame_moment: Array
    com: Array

    def __repr__(self) -> str:
        return f"Solution({len(self)} samples, {self.mode.value} mode)"

    def __len__(self) -> int:
        return int(self.t.size)

    @property
    def theta(self) -> Array:
        """Angle of link 2 (n,) [rad]."""
        return np.asarray(self.angles[:, 1])

    @property
    def phi(self) -> Array:
        """Angle of link 3 (n,) [rad]."""
        return np.asarray(self.angles[:, 2])

    @cached_property
    def trajectory(self) -> Trajectory:
        """The same motion in the layout of `FiveBar.chain`: q = (gamma, phi - gamma, psi, theta - psi)."""
        q, v, a = (_relative(x) for x in (self.angles, self.rates, self.accelerations))
        N = np.zeros((len(self), 4, 2))
        N[:, 2, 0] = N[:, 0, 1] = 1.0
        N[:, 3], N[:, 1] = self.partials[:, 0], self.partials[:, 1]
        N[:, 3, 0] -= 1.0
        N[:, 1, 1] -= 1.0
        return Trajectory(self.t, frozen(q), frozen(v), frozen(a), frozen(N), frozen(self.closure_residual))

    @cached_property
    @finite()
    def closure_residual(self) -> Array:
        """How far the loop (1) stays open, the larger component along and across link 2, from the angles (n,) [m]."""
        turn = np.exp(1j * self.angles)
        b = self.linkage.lengths[:4] * turn
        gap = (b[:, 0] + b[:, 1] - self.linkage.lengths[4] - b[:, 3] - b[:, 2]) * turn[:, 1].conj()
        return frozen(np.maximum(np.abs(gap.real), np.abs(gap.imag)))

    @cached_property
    @finite()
    def energy(self) -> Array:
        """Kinetic energy (n,) [J]."""
        m, c = self.linkage.masses, _mass_centre_rates(self.linkage, self.angles, self.rates)
        return frozen(0.5 * ((np.abs(c) ** 2) @ m + (self.rates**2) @ self.linkage.inertias))


def _relative(x: Array) -> Array:
    """(n, 4) absolute psi, theta, phi, gamma -> the chain's gamma, phi - gamma, psi, theta - psi."""
    return np.stack([x[:, 3], x[:, 2] - x[:, 3], x[:, 0], x[:, 1] - x[:, 0]], axis=1)


def _mass_centre_rates(linkage: FiveBar, angles: Array, rates: Array) -> CArray:
    """Return c' (n, 4) [m/s] of the four links."""
    turn = 1j * rates * np.exp(1j * angles)
    c = turn * linkage.offsets
    c[:, 1] += linkage.lengths[0] * turn[:, 0]
    c[:, 2] += linkage.lengths[3] * turn[:, 3]
    return np.asarray(c)
