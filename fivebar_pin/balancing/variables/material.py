"""One piece of material as variables and cones: a physical body, in its region, no denser than it can be, makeable.

In scaled parameters: lengths in chain lengths, masses in moving masses. The variables are the parameters themselves,
(m, h_1, h_2, I) in the plane or the ten of a body in space, then what the cones need besides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable
from fivebar_pin.balancing.change import change_of
from fivebar_pin.balancing.moments import TWO
from fivebar_pin.balancing.parameters import Space, from_pseudo_inertia, lowest_eigenvalue, pseudo_inertia
from fivebar_pin.balancing.pieces.materials import Density
from fivebar_pin.balancing.pieces.solid import Solid
from fivebar_pin.balancing.regions.shape import Shape
from fivebar_pin.balancing.setting import Setting
from fivebar_pin.balancing.solvers import Block
from fivebar_pin.balancing.variables.part import Made, Part
from fivebar_pin.balancing.variables.sizes import tightened
from fivebar_pin.chain import ClosedChain

__all__ = ["Bounds", "Material"]


@dataclass(frozen=True, slots=True, eq=False)
class Bounds(Immutable):
    """What is asked of a piece besides being a body.

    Attributes:
        shape: region, scaled, or None for anywhere.
        density: how dense it may be, or None for any.
        solid: what it asks to be made as, or None.
        radius: about which the outer radius of `solid` is bounded from above, or None.
        point: the centre (2,) or (3,) that goes with it.
        stray: how far the centre of `solid` may be from `point` [chain lengths], or None for any distance.
        elastic: whether `solid` may stick out of its region, by a variable of its own.
        taken_from: pseudo-inertia (4, 4) of the body that it is taken from, in the axes of the space, or None.
        masses: bounds on its mass [kg], or None.
        cap: bound on its mass where there is none [moving masses].
    """

    shape: Shape | None = None
    density: Density | None = None
    solid: Solid | None = None
    radius: float | None = None
    point: Array | None = None
    stray: float | None = None
    elastic: bool = False
    taken_from: Array | None = None
    masses: tuple[float, float] | None = None
    cap: float | None = None

    @property
    def by_direction(self) -> bool:
        """Whether the in-plane second moments are variables of their own."""
        return self.taken_from is not None or (self.shape is not None and self.shape.by_direction)


@dataclass(frozen=True, slots=True, eq=False)
class Material(Part):
    """Variables of one piece of material.

    Attributes:
        body: index of the body.
        sign: +1 added or present, -1 removed.
        planar: whether there are four parameters.
        label, size, cones: as for `Part`.
        limits: what is asked of it.
        overreach: which of its variables says how far an elastic piece sticks out, times its mass, or None.
        new: whether it is the whole body, in place of the present one.
    """

    body: int
    sign: int
    planar: bool
    label: str
    limits: Bounds
    size: int
    cones: tuple[Block, ...]
    overreach: int | None
    new: bool

    @property
    def apex(self) -> int | None:
        """Return the index of the mass."""
        return 0

    @property
    def sticks_out(self) -> int | None:
        """Return the index of the overreach, or None."""
        return self.overreach

    @property
    def whole(self) -> bool:
        """Whether a planar piece has all ten parameters as variables: what is taken from a body must leave one."""
        return self.limits.taken_from is not None

    @property
    def width(self) -> int:
        """Number of parameters."""
        return 4 if self.planar else 10

    @property
    def inertias(self) -> slice:
        """Where the inertias stand among the variables."""
        return slice(3, 4) if self.planar else slice(4, 10)

    @property
    def split(self) -> bool:
        """Whether the in-plane second moments are variables of their own."""
        return self.planar and self.limits.by_direction

    def replaces(self) -> tuple[int, ...]:
        """Return the body that it is the whole of."""
        return (self.body,) if self.new else ()

    def map(self, setting: Setting) -> Array:
        """Return what its moments change; what cones need besides comes after them.

        What `make` does with planar variables is linear in them but for the share of second moments between the
        directions of the plane, which planar motion does not feel.
        """
        E = np.zeros((10 * len(setting.chain.joints), self.size))
        for k, unit in enumerate(np.eye(self.size)[:10]):
            E[10 * self.body : 10 * self.body + 10, k] = self.sign * self._ten(setting.chain, setting.space, unit)
        return E

    def scaled_map(self, setting: Setting) -> Array:
        """Return that its first variables are the scaled parameters of the body themselves."""
        w = setting.space.width
        E = np.zeros((w * len(setting.chain.joints), self.size))
        E[self.body * w : (self.body + 1) * w, : self.width] = self.sign * np.eye(w)
        return E

    def bounds(self, setting: Setting) -> list[Block]:
        """Return the bounds on its mass that were asked for."""
        if self.limits.masses is None:
            return []  # see caps
        (low, high), row = self.limits.masses, np.eye(1, self.size)
        if low == high:
            return [Block(f"mass of {self.label} = {low:g} kg", "zero", row, np.array([-low / setting.mass]))]
        return [
            Block(f"mass of {self.label} >= {low:g} kg", "nonneg", row, np.array([-low / setting.mass])),
            Block(f"mass of {self.label} <= {high:g} kg", "nonneg", -row, np.array([high / setting.mass])),
        ]

    def caps(self, setting: Setting) -> list[Block]:
        """Return the bound on its mass where there is none."""
        if self.limits.cap is None or self.limits.masses is not None:
            return []
        label = f"mass of {self.label} <= {self.limits.cap:g} times the moving mass"
        return [Block(label, "nonneg", -np.eye(1, self.size), np.array([self.limits.cap]))]

    def fixed(self, setting: Setting) -> Array:
        """Return its mass where it is given exactly."""
        masses = self.limits.masses
        if masses is None or masses[0] != masses[1]:
            return np.zeros((0, self.size + 1))
        return np.append(np.eye(1, self.size)[0], masses[0] / setting.mass)[None]

    def sizes(self, most: Array) -> Array:
        """Return bounds on mass, moments and what the cones need besides.

        With R the radius about the origin that holds its region in the mean square, |h| <= R m, and second moments and
        inertias are at most R^2 m; what is taken from a body is no more than the body.
        """
        heaviest = most[0]
        reach = np.inf if self.limits.shape is None else self.limits.shape.radius
        known = heaviest * reach ** np.concatenate([[0.0], np.ones(self.width - 1)])
        known[self.inertias] = heaviest * reach**2
        if self.limits.taken_from is not None:  # entries of a matrix between zero and the body's
            known = np.append(known, np.full(10 - self.width, np.inf))
            known = np.minimum(known, float(np.trace(self.limits.taken_from)))
        low, high = np.full(self.size, -np.inf), np.full(self.size, np.inf)
        low[: known.size], high[: known.size] = -known, known
        low[0] = 0.0
        return tightened(self.cones, low, high)

    def share(self, z: Array) -> float:
        """Return its mass [moving masses]."""
        return abs(float(z[0]))

    def compact(self, z: Array, felt: npt.NDArray[np.bool_]) -> Array:
        """Return the most compact piece of the same mass and place, where that is known and nobody feels it."""
        solid, density = self.limits.solid, self.limits.density
        if self.sign < 0 or felt[self.inertias].any():
            return z
        if z[0] <= 0.0 or (solid is None and (density is None or self.split or not self.planar)):
            return z
        m, z = float(z[0]), np.array(z)
        if not self.planar:
            own = None if solid is None else solid.second_moment(m)
            if own is not None:
                h = z[1:4]
                S = np.outer(h, h) / m + own * np.eye(3)
                z[:10] = from_pseudo_inertia(np.block([[S, h[:, None]], [h, m]]))
            return z
        if solid is None:
            assert density is not None
            own = density.least * m**TWO
        else:
            own = solid.polar(m)
        h = z[1:3]
        z[3] = float(h @ h) / m + own
        if self.split:
            z[4], z[5] = h[0] ** 2 / m + 0.5 * own, h[0] * h[1] / m
        return z

    def swollen(self, z: Array) -> Array:
        """Return the piece with the least second moments about its mass centre that its density leaves.

        What is taken from a body keeps its own: more could not be taken.
        """
        density, m = self.limits.density, float(z[0])
        if density is None or self.limits.solid is not None or self.sign < 0 or m <= 0.0:
            return z
        z = np.array(z)
        if self.planar:
            lack = density.lacking(m, float(z[3] - z[1:3] @ z[1:3] / m))
            z[3] += lack
            if self.split:
                z[4] += 0.5 * lack
            return z
        P = pseudo_inertia(z[:10])
        values, V = np.linalg.eigh(P[:3, :3] - np.outer(z[1:4], z[1:4]) / m)
        P[:3, :3] += (V * (density.raised(m, values) - values)) @ V.T
        z[:10] = from_pseudo_inertia(P)
        return z

    def make(self, setting: Setting, z: Array, parameters: Array) -> Made:
        """Return the bodies with it, made flat in the plane, at the height of the present body's centre of mass."""
        b, name = self.body, setting.chain.joints[self.body]
        ten, pi = self._ten(setting.chain, setting.space, z), np.array(parameters)
        lowest, change = lowest_eigenvalue(ten, planar=False), (change_of(name, ten),)
        pi[b] = ten if self.new else pi[b] + self.sign * ten
        if self.sign > 0:
            return Made(pi, change, (), lowest)
        left = lowest_eigenvalue(setting.chain.inertial_parameters[b] - ten, planar=False)
        return Made(pi, (), change, min(lowest, left))

    def _ten(self, chain: ClosedChain, space: Space, z: Array) -> Array:
        """Return the ten parameters of the piece, SI units."""
        turn, axes = np.eye(4), np.array(space.axes[self.body])
        turn[:3, :3] = space.length * axes.T
        height = _height_of(chain.inertial_parameters[self.body], axes[2]) / space.length
        P = (chain.mass or 1.0) * self.pseudo_inertia(z, height)
        return np.asarray(from_pseudo_inertia(turn @ P @ turn.T))

    def pseudo_inertia(self, z: Array, height: float) -> Array:
        """Return the pseudo-inertia (4, 4), scaled, in the axes of the space, of variables z (size,).

        Planar material is flat, at a height along the normal, unless it is taken from a body.
        """
        if not self.planar:
            return pseudo_inertia(z[:10])
        lift = np.zeros((4, 3))
        lift[0, 0] = lift[1, 1] = lift[3, 2] = 1.0
        lift[2, 2] = height
        P = np.asarray(lift @ np.block([[self._in_plane(z), z[1:3, None]], [z[None, 1:3], z[:1, None]]]) @ lift.T)
        if self.whole:
            hn, S1n, S2n, Snn = z[6:10]
            P[2] = P[:, 2] = np.array([S1n, S2n, Snn, hn])
        return P

    def _in_plane(self, z: Array) -> Array:
        """Return the in-plane second moments (2, 2), isotropic about the mass centre where they are free."""
        if self.split:
            return np.array([[z[4], z[5]], [z[5], z[3] - z[4]]])
        h = z[1:3]
        own = np.outer(h, h) / z[0] if z[0] > 0.0 else np.zeros((2, 2))
        return np.asarray(own + 0.5 * max(0.0, float(z[3] - np.trace(own))) * np.eye(2))


def _height_of(parameters: Array, normal: Array) -> float:
    """Return the height of a body's mass centre (10,) along a normal in joint axes [m]; 0 without mass."""
    mass = float(parameters[0])
    return float(normal @ parameters[1:4]) / mass if mass > 0.0 else 0.0
