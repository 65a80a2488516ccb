"""The cone of physical mass distributions within a region, for one body, in scaled parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing._parameters import _PAIRS
from fivebar_pin.balancing.regions import Shape, Solid
from fivebar_pin.balancing.solvers import Block, svec


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """Variables of one piece of material: parameters (4 planar or 10), then auxiliary ones where needed.

    Attributes:
        body: index of the body.
        sign: +1 added or present, -1 removed.
        start: position of the first variable.
        planar: whether there are four parameters.
        shape: region, scaled, or None for anywhere.
        label: what certificates call it.
        solid: bound of the discs it is to be made of, or None.
    """

    body: int
    sign: int
    start: int
    planar: bool
    shape: Shape | None
    label: str
    solid: Solid | None = None

    @property
    def width(self) -> int:
        """Number of parameters."""
        return 4 if self.planar else 10

    @property
    def split(self) -> bool:
        """Whether the in-plane second moments are variables of their own (box and ellipsoid in the plane)."""
        return self.planar and self.shape is not None and self.shape.kind != "ball"

    @property
    def size(self) -> int:
        """Number of variables."""
        return self.width + (2 if self.split else 0) + (1 if self.solid is not None else 0)

    @property
    def parameters(self) -> slice:
        """Where the parameters stand among all variables."""
        return slice(self.start, self.start + self.width)

    def blocks(self, n: int) -> list[Block]:
        """Return the cones for a problem with n variables."""
        out = [Block(f"{self.label} is a physical body", *self._physical(), np.zeros(0))]
        if self.shape is not None:
            out.append(
                Block(f"{self.label} stays in its region", "nonneg", -self._region(self.shape), np.zeros(0), soft=True)
            )
        placed = [self._placed(block, n) for block in out]
        return placed if self.solid is None else placed + [self._placed(b, n) for b in self._disc(self.solid)]

    def sizes(self, heaviest: float) -> Array:
        """Return bounds on all variables (size,) that follow from a bound on the mass.

        With R the radius about the origin that holds the region in the mean square, |h| <= R m and every second moment
        and inertia is at most R^2 m; so is the part u of the inertia of a disc.
        """
        R = np.inf
        if self.shape is not None:
            semi = self.shape.semi_axes
            spread = np.linalg.norm(semi) if self.shape.kind == "box" else semi.max()
            R = float(np.linalg.norm(self.shape.center) + spread)
        first = 2 if self.planar else 3
        orders = np.concatenate([[0.0], np.ones(first), np.full(self.size - 1 - first, 2.0)])
        return np.asarray(heaviest * R**orders if heaviest > 0.0 else np.zeros(self.size))

    def anchor(self, length: float = 0.3) -> Array:
        """Return the variables (size,) of a unit mass spread well inside the region."""
        d = 2 if self.planar else 3
        c, spread = np.zeros(d), length
        if self.shape is not None:
            c, spread = self.shape.center, 0.3 * float(self.shape.semi_axes.min())
        return self._of_moments(np.outer(c, c) + spread**2 * np.eye(d), c)

    def second_moments(self, z: Array) -> Array:
        """Return the in-plane second moments (2, 2) of planar variables z (size,); isotropic where they are free."""
        if self.split:
            return np.array([[z[4], z[5]], [z[5], z[3] - z[4]]])
        h = z[1:3]
        own = np.outer(h, h) / z[0] if z[0] > 0.0 else np.zeros((2, 2))
        return np.asarray(own + 0.5 * max(0.0, float(z[3] - np.trace(own))) * np.eye(2))

    def _placed(self, block: Block, n: int) -> Block:
        G = np.zeros((block.G.shape[0], n))
        G[:, self.start : self.start + self.size] = block.G
        if block.g.size:
            return replace(block, G=G)
        return replace(block, G=G, g=np.zeros(G.shape[0]), inward=block.G @ self.anchor())

    def _unit(self, k: int) -> Array:
        e = np.zeros(self.size)
        e[k] = 1.0
        return e

    def _first(self, d: Array) -> Array:
        """Functional d.h."""
        e = np.zeros(self.size)
        e[1 : 1 + d.size] = d
        return e

    def _second(self, d: Array, f: Array) -> Array:
        """Functional d.S f."""
        e = np.zeros(self.size)
        if not self.planar:
            trace = 0.5 * float(d @ f)
            for k, (i, j) in enumerate(_PAIRS):
                e[4 + k] = trace - d[i] * f[i] if i == j else -(d[i] * f[j] + d[j] * f[i])
        elif self.split:
            e[4], e[5] = d[0] * f[0] - d[1] * f[1], d[0] * f[1] + d[1] * f[0]
            e[3] = d[1] * f[1]
        return e

    def _physical(self) -> tuple[str, Array]:
        m = self._unit(0)
        if self.planar and not self.split:  # m I >= |h|^2
            inertia = self._unit(3)
            return "soc", np.stack([m + inertia, m - inertia, 2.0 * self._unit(1), 2.0 * self._unit(2)])
        E = np.eye(2 if self.planar else 3)
        matrix = [[self._second(d, f) for f in E] + [self._first(d)] for d in E]
        matrix.append([self._first(f) for f in E] + [m])
        return "psd", svec(matrix)

    def _disc(self, solid: Solid) -> list[Block]:
        """Return I - u >= |h|^2 / m, u >= least m^2 and the line: discs, with or without a bore."""
        m, u = self._unit(0), self._unit(self.size - 1)
        own = self._unit(3) - u
        label = f"{self.label} is a disc"
        centre = np.stack([m + own, m - own, 2.0 * self._unit(1), 2.0 * self._unit(2)])
        spread = np.stack([u / solid.least, u / solid.least, 2.0 * m])
        tip = np.array([1.0, 0.0, 0.0])
        blocks = [
            Block(label, "soc", centre, np.zeros(0)),
            Block(label, "soc", spread, np.array([1.0, -1.0, 0.0]), tip),
        ]
        if solid.across is not None:
            label = f"{self.label} lies on its line"
            blocks.append(Block(label, "zero", self._first(solid.across)[None], np.zeros(1), np.zeros(1)))
        return blocks

    def _region(self, shape: Shape) -> Array:
        """Return the functionals (k, size) that must not be positive."""
        m, c = self._unit(0), shape.center
        if shape.kind == "ball":
            E = np.eye(c.size)
            about_origin = self._unit(3) if self.planar else sum((self._second(e, e) for e in E), np.zeros(self.size))
            r = float(shape.semi_axes[0])
            return np.asarray(about_origin - 2.0 * self._first(c) + (float(c @ c) - r * r) * m)[None] / r**2
        spreads = []
        for d, a in zip(shape.axes, shape.semi_axes, strict=True):
            at = float(d @ c)
            spreads.append((self._second(d, d) - 2.0 * at * self._first(d) + at**2 * m) / a**2)
        if shape.kind == "ellipsoid":
            return np.asarray(np.sum(spreads, axis=0) - m)[None]
        return np.stack([s - m for s in spreads] + self._corners(shape))

    def _corners(self, shape: Shape) -> list[Array]:
        """Products of two half-spaces of a box, (1 + s u_i)(1 + t u_j) with u_i = d_i.(x - c) / a_i."""
        if self.planar:
            return []
        m, c, out = self._unit(0), shape.center, []
        for i in range(3):
            for j in range(i):
                di, dj = shape.axes[i] / shape.semi_axes[i], shape.axes[j] / shape.semi_axes[j]
                ui, uj = self._first(di) - float(di @ c) * m, self._first(dj) - float(dj @ c) * m
                both = self._second(di, dj) - float(di @ c) * self._first(dj) - float(dj @ c) * self._first(di)
                both += float(di @ c) * float(dj @ c) * m
                out += [-(m + s * ui + t * uj + s * t * both) for s in (1.0, -1.0) for t in (1.0, -1.0)]
        return out

    def _of_moments(self, S: Array, h: Array) -> Array:
        z = np.zeros(self.size)
        z[0], z[1 : 1 + h.size] = 1.0, h
        if self.planar:
            z[3] = np.trace(S)
            if self.split:
                z[4], z[5] = S[0, 0], S[0, 1]
            if self.solid is not None:
                z[-1] = 0.5 * (np.trace(S) - h @ h)
        else:
            inertia = np.trace(S) * np.eye(3) - S
            for k, (i, j) in enumerate(_PAIRS):
                z[4 + k] = inertia[i, j]
        return z
