"""One piece of material as variables and cones: a physical body, in its region, no denser than it can be, makeable.

In scaled parameters: lengths in chain lengths, masses in moving masses. The variables are the parameters themselves,
(m, h_1, h_2, I) in the plane or the ten of a body in space, then what the cones need besides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fivebar_pin._arrays import Array, Immutable
from fivebar_pin.balancing.parameters import INERTIA_PAIRS, from_pseudo_inertia, pseudo_inertia
from fivebar_pin.balancing.pieces.piece import Density, Solid
from fivebar_pin.balancing.regions.region import Shape
from fivebar_pin.balancing.solvers import Block, svec
from fivebar_pin.balancing.variables.forms import Cones, constant

__all__ = ["Bounds", "Material", "material"]

_SPREAD = 0.3  # of the anchor's unit mass, as a share of the region (of the chain's length without one) [-]
_FAR = 100.0  # how far an elastic piece may stick out [of the region's least half extent]
_INSIDE = 1.0 - 1e-6  # share of a region that a piece to be made is solved for, lest round-off make it stick out
_TWO, _FIVE_THIRDS = 2.0, 5.0 / 3.0  # powers of the mass in the least inertia of a flat piece and of a ball
_RANK = 1e-9  # eigenvalue of a body's pseudo-inertia, as a share of the largest, that counts as flat [-]


@dataclass(frozen=True, slots=True, eq=False)
class Bounds(Immutable):
    """What is asked of a piece besides being a body.

    Attributes:
        shape: region, scaled, or None for anywhere.
        density: how dense it may be, or None for any.
        solid: the kind of piece it is to be made as, or None.
        point: the centre c_0 (2,) or (3,) about which the outer radius of `solid` is bounded from above.
        stray: how far the centre of `solid` may be from `point` [chain lengths], or None for any distance.
        elastic: whether `solid` may stick out of its region, by a variable of its own.
        taken_from: pseudo-inertia (4, 4) of the body that it is taken from, in the axes of the space, or None.
    """

    shape: Shape | None = None
    density: Density | None = None
    solid: Solid | None = None
    point: Array | None = None
    stray: float | None = None
    elastic: bool = False
    taken_from: Array | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Material(Immutable):
    """Variables of one piece of material.

    Attributes:
        body: index of the body.
        sign: +1 added or present, -1 removed.
        start: position of the first variable.
        planar: whether there are four parameters.
        label: what certificates call it.
        bounds: what is asked of it.
        size: number of variables.
        own: cones on its own variables.
        overreach: which of its variables says how far an elastic piece sticks out, times its mass, or None.
        whole: whether a planar piece has all ten parameters as variables: what is taken from a body must leave one.
    """

    body: int
    sign: int
    start: int
    planar: bool
    label: str
    bounds: Bounds
    size: int
    own: tuple[Block, ...]
    overreach: int | None
    whole: bool

    @property
    def width(self) -> int:
        """Number of parameters."""
        return 4 if self.planar else 10

    @property
    def parameters(self) -> slice:
        """Where the parameters stand among all variables."""
        return slice(self.start, self.start + self.width)

    @property
    def inertias(self) -> slice:
        """Where the inertias stand among the own variables."""
        return slice(3, 4) if self.planar else slice(4, 10)

    @property
    def room(self) -> float:
        """Largest radius of a round piece in the region [chain lengths]."""
        return np.inf if self.bounds.shape is None else float(self.bounds.shape.semi_axes.min())

    @property
    def split(self) -> bool:
        """Whether the in-plane second moments are variables of their own."""
        return self.planar and (self.whole or (self.bounds.shape is not None and self.bounds.shape.kind != "ball"))

    def blocks(self, n: int) -> list[Block]:
        """Return the cones for a problem with n variables."""
        out = []
        for block in self.own:
            G = np.zeros((block.G.shape[0], n))
            G[:, self.start : self.start + self.size] = block.G
            out.append(replace(block, G=G))
        return out

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

    def compact(self, z: Array) -> Array:
        """Return the variables (size,) of the most compact piece of the same mass and place, where that is known."""
        solid, density = self.bounds.solid, self.bounds.density
        if z[0] <= 0.0 or (solid is None and (density is None or self.split or not self.planar)):
            return z
        m, z = float(z[0]), np.array(z)
        if not self.planar:
            if solid is not None:
                h = z[1:4]
                S = np.outer(h, h) / m + solid.least * m**_FIVE_THIRDS * np.eye(3)
                P = np.block([[S, h[:, None]], [h, m]])
                z[:10] = from_pseudo_inertia(P)
            return z
        if solid is None:
            assert density is not None
            own = density.least * m**_TWO
        else:
            own = 2.0 * solid.least * m**_FIVE_THIRDS if solid.word == "a ball" else solid.least * m**_TWO
        h = z[1:3]
        z[3] = float(h @ h) / m + own
        if self.split:
            z[4], z[5] = h[0] ** 2 / m + 0.5 * own, h[0] * h[1] / m
        return z

    def _in_plane(self, z: Array) -> Array:
        """Return the in-plane second moments (2, 2), isotropic about the mass centre where they are free."""
        if self.split:
            return np.array([[z[4], z[5]], [z[5], z[3] - z[4]]])
        h = z[1:3]
        own = np.outer(h, h) / z[0] if z[0] > 0.0 else np.zeros((2, 2))
        return np.asarray(own + 0.5 * max(0.0, float(z[3] - np.trace(own))) * np.eye(2))


def material(body: int, sign: int, start: int, label: str, bounds: Bounds, *, planar: bool) -> Material:
    """Make the variables and cones of a piece of material."""
    forms = _Moments(planar, bounds)
    forms.physical(label, bounds.taken_from)
    if bounds.shape is not None:
        forms.cones.add(f"{label} stays in its region", "nonneg", forms.region(bounds.shape), soft=True)
    if bounds.solid is not None:
        forms.makeable(label, bounds.solid, bounds)
    elif bounds.density is not None:
        forms.no_denser(label, bounds.density)
    return Material(
        body=body,
        sign=sign,
        start=start,
        planar=planar,
        label=label,
        bounds=bounds,
        size=forms.cones.count,
        own=forms.cones.blocks(),
        overreach=forms.overreach,
        whole=bounds.taken_from is not None,
    )


class _Moments:
    """The moments of a piece as forms of its variables, and what is asked of them."""

    def __init__(self, planar: bool, bounds: Bounds) -> None:
        self.planar = planar
        self.cones = Cones()
        self.overreach: int | None = None
        d = 2 if planar else 3
        self.d = d
        c, spread = np.zeros(d), _SPREAD
        if bounds.shape is not None:
            c, spread = bounds.shape.center, _SPREAD * float(bounds.shape.semi_axes.min())
        self.spread = spread
        S = np.outer(c, c) + spread**2 * np.eye(d)
        new = self.cones.variable
        self.m = new(1.0)
        self.h = [new(float(x)) for x in c]
        if planar:
            self.inertia = new(float(np.trace(S)))
            self.S: list[list[Array]] | None = None
            if bounds.taken_from is not None or (bounds.shape is not None and bounds.shape.kind != "ball"):
                a, b = new(float(S[0, 0])), new(float(S[0, 1]))
                self.S = [[a, b], [b, self.inertia - a]]
            return
        I = np.trace(S) * np.eye(3) - S
        entry = {(i, j): new(float(I[i, j])) for i, j in INERTIA_PAIRS}
        half = 0.5 * (entry[0, 0] + entry[1, 1] + entry[2, 2])
        self.S = [[half - entry[i, i] if i == j else -entry[min(i, j), max(i, j)] for j in range(3)] for i in range(3)]
        self.inertia = half  # trace of the second moments

    def first(self, d: Array) -> Array:
        """Form d.h."""
        return np.asarray(sum((float(x) * h for x, h in zip(d, self.h, strict=True)), constant(0.0)))

    def second(self, d: Array, f: Array) -> Array:
        """Form d.S f."""
        assert self.S is not None
        rows = range(self.d)
        return np.asarray(sum((float(d[i] * f[j]) * self.S[i][j] for i in rows for j in rows), constant(0.0)))

    def physical(self, label: str, taken_from: Array | None) -> None:
        """Ask for a physical body, and that what it is taken from stays one."""
        text = f"{label} is a physical body"
        if taken_from is not None:
            self._taken(text, label, taken_from)
        elif self.S is None:
            self.cones.square(text, self.h, self.m, self.inertia)
        else:
            self.cones.semidefinite(text, self.pseudo_inertia(self.S))

    def pseudo_inertia(self, S: Sequence[Sequence[Array]]) -> list[list[Array]]:
        """Return [[S, h], [h^T, m]] as forms."""
        return [[*row, h] for row, h in zip(S, self.h, strict=True)] + [[*self.h, self.m]]

    def _taken(self, text: str, label: str, present: Array) -> None:
        """Ask P and present - P to be semidefinite, within the range of a present body that is flat or a rod."""
        assert self.S is not None
        S, h = self.S, self.h
        if self.planar:
            hn, S1n, S2n = (self.cones.variable(0.0) for _ in range(3))
            S = [[*S[0], S1n], [*S[1], S2n], [S1n, S2n, self.cones.variable(self.spread**2)]]
            h = [*h, hn]
        P = [[*row, x] for row, x in zip(S, h, strict=True)] + [[*h, self.m]]
        values, V = np.linalg.eigh(present)
        keep = values > _RANK * values[-1]
        V, off = V[:, keep], V[:, ~keep]
        inside = _congruence(P, V, V)
        way = svec(
            [list(row) for row in np.diag(values[keep] / float(np.trace(present)))]
        )  # in step with the body, however flat
        self.cones.semidefinite(text, inside, way)
        left = [
            [constant(float(values[keep][i] if i == j else 0.0)) - inside[i][j] for j in range(len(inside))]
            for i in range(len(inside))
        ]
        self.cones.semidefinite(f"what is left by {label} is a physical body", left, way)
        if off.size:
            zero = [form for row in _congruence(P, off, np.eye(4)) for form in row]
            self.cones.add(f"{label} lies where the body is", "zero", zero, np.zeros(len(zero)))

    def no_denser(self, label: str, density: Density) -> None:
        """Ask for at least the inertia of the most compact body of this density."""
        text = f"{label} is no denser than its material"
        if self.planar:
            self._own_inertia(text, density.least, _TWO)
            return
        self._determinant(text, density.least)

    def _determinant(self, text: str, least: float) -> None:
        """Ask det(S_c)^(1/3) >= least m^(5/3): S - h h^T / m >= least Z D^-1 Z^T, D = diag(Z), Z lower triangular."""
        assert self.S is not None
        zero, one, anchor = constant(0.0), constant(1.0), min(1.0, 0.5 * self.spread**2 / least)
        new = self.cones.variable
        Z = [[new(anchor if i == j else 0.0) if j <= i else zero for j in range(3)] for i in range(3)]
        root = float(np.sqrt(least))
        top = [[*self.S[i], self.h[i], *(root * z for z in Z[i])] for i in range(3)]
        middle = [[*self.h, self.m, zero, zero, zero]]
        corner = [[Z[j][j] if i == j else zero for i in range(3)] for j in range(3)]
        bottom = [[*(root * Z[i][j] for i in range(3)), zero, *corner[j]] for j in range(3)]
        self.cones.semidefinite(text, top + middle + bottom)
        self.cones.mean(text, self.m, [Z[0][0], Z[1][1], Z[2][2], one, one, self.m, self.m, self.m])

    def _own_inertia(self, text: str, least: float, power: float) -> Array:
        """Ask I_c >= least u and u >= m^power; return the form least u."""
        u = self.cones.variable(min(1.0, self.spread**2 / least))  # the anchor has I_c = 2 spread^2
        self.cones.square(text, self.h, self.m, self.inertia - least * u)
        if power == _TWO:
            self.cones.square(text, self.m, u, constant(1.0))
        else:
            self._five_thirds(text, u)
        return np.asarray(least * u)

    def _five_thirds(self, text: str, t: Array) -> None:
        """Ask m^(5/3) <= t."""
        one = constant(1.0)
        self.cones.mean(text, self.m, [t, t, t, one, one, self.m, self.m, self.m])

    def makeable(self, label: str, solid: Solid, bounds: Bounds) -> None:
        """Ask for a piece that can be made and lies within its region as a whole."""
        text = f"{label} is {solid.word}"
        assert bounds.shape is not None
        w = self.cones.variable(0.5 * float(bounds.shape.semi_axes.min()))
        if solid.word == "a ball":
            self._ball(text, solid, w)
        else:
            u = self._own_inertia(text, solid.least, _TWO)
            k = float(np.sqrt(solid.alpha * solid.least + solid.beta))
            self.cones.mean(text, float(np.sqrt(k)) * self.m, [w, w, constant(1.0), self.m])
            if solid.radius is not None and bounds.point is not None:
                c = bounds.point
                about = self.inertia - 2.0 * self.first(c) + float(c @ c) * self.m  # >= I_c, equal for the centre c
                square = solid.alpha * about + solid.beta / solid.least * u
                outer = 0.5 * (solid.radius * self.m + square / solid.radius)
                self.cones.add(f"{text} of bounded size", "nonneg", [w - outer], np.ones(1))
        if solid.across is not None:
            self.cones.add(f"{label} lies on its line", "zero", [self.first(solid.across)], np.zeros(1))
        if bounds.elastic:
            room = float(bounds.shape.semi_axes.min())
            self.overreach = self.cones.count
            out = self.cones.variable(0.5 * room)
            self.cones.add(f"{label} sticks out", "nonneg", [out, _FAR * room * self.m - out], np.array([1.0, 1.0]))
            w = w - out
        if bounds.point is not None and bounds.stray is not None:
            off = [h - float(c) * self.m for h, c in zip(self.h, bounds.point, strict=True)]
            self.cones.add(f"{label} stays near", "soc", [bounds.stray * self.m, *off])
        within = bounds.shape
        if bounds.point is not None:
            within = replace(within, semi_axes=_INSIDE * within.semi_axes)
        self._reach(f"{label} lies in its region as a whole", within, w)

    def _ball(self, text: str, solid: Solid, w: Array) -> None:
        """Ask for S_c >= least m^(5/3) in every direction and w >= beta m^(4/3)."""
        if self.planar:
            self._own_inertia(text, 2.0 * solid.least, _FIVE_THIRDS)
        else:
            assert self.S is not None
            s = self.cones.variable(min(1.0, 0.5 * self.spread**2 / solid.least))
            less = [[self.S[i][j] - (solid.least * s if i == j else 0.0) for j in range(3)] for i in range(3)]
            self.cones.semidefinite(text, self.pseudo_inertia(less))
            self._five_thirds(text, s)
        self.cones.mean(text, solid.beta**0.75 * self.m, [w, w, w, constant(1.0)])

    def _reach(self, text: str, shape: Shape, w: Array) -> None:
        """Ask a round piece with w = m r to lie within a region."""
        off = [h - float(c) * self.m for h, c in zip(self.h, shape.center, strict=True)]
        along = [
            np.asarray(sum((float(x) * f for x, f in zip(axis, off, strict=True)), constant(0.0)))
            for axis in shape.axes
        ]
        if shape.kind == "ball":
            self.cones.add(text, "soc", [float(shape.semi_axes[0]) * self.m - w, *off])
            return
        if shape.kind == "box":
            pairs = zip(along, shape.semi_axes, strict=True)
            self.cones.add(text, "nonneg", [float(a) * self.m - w + s * f for f, a in pairs for s in (1.0, -1.0)])
            return
        self._in_ellipsoid(text, along, shape.semi_axes, w)

    def _in_ellipsoid(self, text: str, along: list[Array], semi_axes: Array, w: Array) -> None:
        """Ask for a ball within an ellipsoid, by the S-lemma: [[m - l, 0, b^T], [0, l 1, A w], [b, A w, m 1]] >= 0."""
        d, zero = self.d, constant(0.0)
        l = self.cones.variable(0.5)
        b = [f / float(a) for f, a in zip(along, semi_axes, strict=True)]
        A = [[w / float(semi_axes[i]) if i == j else zero for j in range(d)] for i in range(d)]
        top = [[self.m - l, *(zero for _ in range(d)), *b]]
        middle = [[zero, *(l if i == j else zero for j in range(d)), *A[i]] for i in range(d)]
        last = [[b[i], *A[i], *(self.m if i == j else zero for j in range(d))] for i in range(d)]
        self.cones.semidefinite(text, top + middle + last)

    def region(self, shape: Shape) -> list[Array]:
        """Return the forms that must not be negative for a mass distribution in a region."""
        m, c = self.m, shape.center
        if shape.kind == "ball":
            r = float(shape.semi_axes[0])
            about = self.inertia - 2.0 * self.first(c) + float(c @ c) * m
            return [(r * r * m - about) / r**2]
        spreads = []
        for d, a in zip(shape.axes, shape.semi_axes, strict=True):
            at = float(d @ c)
            spreads.append((self.second(d, d) - 2.0 * at * self.first(d) + at**2 * m) / a**2)
        if shape.kind == "ellipsoid":
            return [m - np.sum(spreads, axis=0)]
        return [m - s for s in spreads] + self._corners(shape)

    def _corners(self, shape: Shape) -> list[Array]:
        """Products of two half-spaces of a box, (1 + s u_i)(1 + t u_j) with u_i = d_i.(x - c) / a_i."""
        if self.planar:
            return []
        m, c, out = self.m, shape.center, []
        for i in range(3):
            for j in range(i):
                di, dj = shape.axes[i] / shape.semi_axes[i], shape.axes[j] / shape.semi_axes[j]
                ui, uj = self.first(di) - float(di @ c) * m, self.first(dj) - float(dj @ c) * m
                both = self.second(di, dj) - float(di @ c) * self.first(dj) - float(dj @ c) * self.first(di)
                both = both + float(di @ c) * float(dj @ c) * m
                out += [m + s * ui + t * uj + s * t * both for s in (1.0, -1.0) for t in (1.0, -1.0)]
        return out


def _congruence(P: Sequence[Sequence[Array]], U: Array, V: Array) -> list[list[Array]]:
    """Return U^T P V of a matrix of forms."""
    stacked = np.stack([np.stack(row) for row in P])
    out = np.einsum("ia,ijf,jb->abf", U, stacked, V)
    return [list(row) for row in out]
