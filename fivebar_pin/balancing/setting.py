"""Names and bounds of a balancing problem turned into pieces of material and cones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fivebar_pin._arrays import Array, Immutable, checked
from fivebar_pin.balancing import lifting
from fivebar_pin.balancing.conditions import BalanceConditions
from fivebar_pin.balancing.counterweight_search import Sizes
from fivebar_pin.balancing.parameters import Space, pseudo_inertia
from fivebar_pin.balancing.pieces.piece import Piece, Sphere, density_bound
from fivebar_pin.balancing.regions.region import Ball, Region, resolve
from fivebar_pin.balancing.solvers import Block
from fivebar_pin.balancing.variables.material import Bounds, Material, material
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["CAP", "MassBounds", "Setup", "unit_row"]

MassBounds = tuple[float, float] | Mapping[str, tuple[float, float]] | None
_WHOLE = 1e-9  # negative eigenvalue of a pseudo-inertia that is round-off [of its mass, at the chain's length]
CAP = 10.0  # largest mass added to one body unless given [moving masses]


@dataclass(frozen=True, slots=True, eq=False)
class Setup(Immutable):
    """Names and bounds turned into materials and cones, lengths in chain lengths and masses in moving masses."""

    chain: ClosedChain
    space: Space
    conditions: BalanceConditions | None
    mode: str
    arms: Array  # inertial parameters (nb, 10) of the arms that carry counterweights

    @property
    def mass(self) -> float:
        """Unit of mass [kg]."""
        return self.chain.mass or 1.0

    @property
    def unit(self) -> Array:
        """Unit of every parameter of the space (nb * width,)."""
        return np.asarray(self.space.scale * self.mass)

    def present(self) -> Array:
        """Return the present scaled parameters (nb, width), arms included."""
        x = self.space.of(self.chain.inertial_parameters + self.arms).reshape(-1) / self.unit
        return np.asarray(x.reshape(-1, self.space.width))

    def body(self, b: int) -> Array:
        """Return the scaled pseudo-inertia (4, 4) of a present body in the axes of the space, arms left out."""
        turn = np.eye(4)
        turn[:3, :3] = np.array(self.space.axes[b]) / self.space.length
        return np.asarray(turn @ pseudo_inertia(self.chain.inertial_parameters[b]) @ turn.T / self.mass)

    def check_physical(self) -> None:
        """Raise when a present body could not exist."""
        for name, x in zip(self.chain.joints, self.present(), strict=True):
            lowest = lifting.lowest_eigenvalue(x, planar=self.space.planar)
            if lowest < -1e-9 and self.mode == "add":
                raise InvalidInputError(
                    f"inertia of body {name}",
                    [float(v) for v in self.space.of(self.chain.inertial_parameters)[self.chain.joints.index(name)]],
                    f"is not that of a physical body (pseudo-inertia has the eigenvalue {lowest:.3g}, scaled)",
                    "Correct the model, or redesign the body.",
                )

    def chosen(self, bodies: Sequence[str] | None) -> list[int]:
        """Return the indices of the bodies that may change."""
        joints = self.chain.joints
        if bodies is None:
            found = [b for b in range(len(joints)) if self._influences(b)]
            if not found:
                raise InvalidInputError("bodies", list(joints), f"cannot influence the {self._kind} conditions")
            return found
        if isinstance(bodies, str) or not len(bodies):
            raise InvalidInputError("bodies", bodies, "must be a sequence of at least one name")
        for name in bodies:
            if name not in joints:
                raise UnknownNameError("body", name, joints)
        idle = [name for name in bodies if not self._influences(joints.index(name))]
        if idle:
            raise InvalidInputError("bodies", idle, f"cannot influence the {self._kind} conditions")
        return sorted({joints.index(name) for name in bodies})

    def removable(self, remove: Sequence[str]) -> list[int]:
        """Return the indices of the bodies that may lose material."""
        if isinstance(remove, str):
            raise InvalidInputError("remove", remove, "must be a sequence of names")
        for name in remove:
            if name not in self.chain.joints:
                raise UnknownNameError("body", name, self.chain.joints)
        if remove and self.mode == "redesign":
            raise InvalidInputError("remove", list(remove), "has no meaning for a redesign")
        return sorted(self.chain.joints.index(name) for name in remove)

    @property
    def _kind(self) -> str:
        return self.conditions.kind if self.conditions is not None else "given"

    def _influences(self, body: int) -> bool:
        if self.conditions is None:
            return True
        w = self.space.width
        return bool(np.abs(self.conditions.basis[:, body * w : (body + 1) * w]).max(initial=0.0) > 1e-9)

    def materials(
        self,
        chosen: Sequence[int],
        removable: Sequence[int],
        region: Region | Mapping[str, Region] | None,
        counterweight: Piece | Mapping[str, Piece] | None,
        density: tuple[float, float] | None,
        sizes: Sizes,
        *,
        elastic: bool = False,
    ) -> list[Material]:
        """Return the pieces of material that are variables.

        Args:
            chosen, removable: indices of the bodies that may change and that may lose material.
            region, counterweight: where material may lie and what it is made as, for all bodies or by name.
            density: of all material that is not a counterweight [kg/m3], and its thickness [m]; None for any.
            sizes: by body, about which counterweights are bounded in size from above; others from below.
            elastic: whether counterweights may stick out of their regions.
        """
        self._check_names(region, "region")
        self._check_names(counterweight, "counterweight")
        out, start = [], 0
        word = "new body" if self.mode == "redesign" else "material added to"
        for bodies, sign, label in ((chosen, 1, word), (removable, -1, "material removed from")):
            for b in bodies:
                own = self._bounds_of(b, sign, region, counterweight, density, sizes)
                own = replace(own, elastic=elastic and own.solid is not None)
                made = material(b, sign, start, f"{label} {self.chain.joints[b]}", own, planar=self.space.planar)
                out.append(made)
                start += made.size
        return out

    def piece(self, b: int, counterweight: Piece | Mapping[str, Piece] | None) -> Piece | None:
        """Return what the material added to a body is to be made as."""
        name = self.chain.joints[b]
        piece = counterweight.get(name) if isinstance(counterweight, Mapping) else counterweight
        if piece is None:
            return None
        if not isinstance(piece, Piece):
            raise InvalidInputError(f"counterweight of body {name}", piece, "must be a Disc, a Bar or a Sphere")
        if self.mode != "add":
            raise InvalidInputError("counterweight", type(piece).__name__, "needs mode 'add'")
        if not isinstance(piece, Sphere) and not self.space.planar:
            raise InvalidInputError(
                "counterweight", type(piece).__name__, "needs a planar mechanism", "Use balls: Sphere."
            )
        return piece

    def _check_names(self, given: object, what: str) -> None:
        for name in given if isinstance(given, Mapping) else ():
            if name not in self.chain.joints:
                raise UnknownNameError(f"body of a {what}", name, self.chain.joints)

    def _bounds_of(
        self,
        b: int,
        sign: int,
        region: Region | Mapping[str, Region] | None,
        counterweight: Piece | Mapping[str, Piece] | None,
        density: tuple[float, float] | None,
        sizes: Sizes,
    ) -> Bounds:
        space, name = self.space, self.chain.joints[b]
        own = region.get(name) if isinstance(region, Mapping) else region
        where = own or Ball(self.chain.length)
        shape = resolve(where, self.chain, b, space.axes[b], planar=space.planar, unit=space.length)
        piece = self.piece(b, counterweight) if sign > 0 else None
        size = sizes.get(b)
        solid = None if piece is None else piece.solid(space.axes[b], self.mass, space.length)
        if solid is not None and size is not None:
            solid = replace(solid, radius=size.radius)
        bound = None
        if density is not None:
            bound = density_bound(*density, planar=space.planar, mass=self.mass, length=space.length)
        taken = self._taken(b) if sign < 0 else None
        center = None if size is None else size.center
        stray = None if size is None else size.stray
        return Bounds(shape, bound, solid, center, stray, taken_from=taken)

    def _taken(self, b: int) -> Array:
        """Return the body that material is taken from, which must exist in space and not only in the plane."""
        P = self.body(b)
        lowest = float(np.linalg.eigvalsh(P)[0]) / max(float(P[3, 3]), 1e-300)
        if lowest < -_WHOLE:
            raise InvalidInputError(
                f"remove: inertia of body {self.chain.joints[b]}",
                [float(v) for v in self.chain.inertial_parameters[b]],
                f"is not that of a body in space (pseudo-inertia has the eigenvalue {lowest:.3g}, scaled)",
                "Give all six entries of its inertia: what is left must be a body.",
            )
        return P

    def map(self, materials: Sequence[Material]) -> tuple[Array, Array]:
        """Return E, X0 with scaled parameters = X0 + E y."""
        X0 = self.present()
        w = self.space.width
        E = np.zeros((X0.size, sum(m.size for m in materials)))
        for m in materials:
            E[m.body * w : (m.body + 1) * w, m.parameters] = m.sign * np.eye(w)
            if self.mode == "redesign":
                X0[m.body] = 0.0
        return E, X0.reshape(-1)

    def constraints(
        self,
        materials: Sequence[Material],
        E: Array,
        X0: Array,
        masses: MassBounds,
    ) -> list[Block]:
        """Return conditions, physical bodies, regions and mass bounds."""
        n = E.shape[1]
        blocks = []
        if self.conditions is not None and self.conditions.equations:
            R = self.conditions.rows
            labels = tuple(f"[{text}]" for text in self.conditions.equations)
            held = self.conditions.constants(R) / self.mass  # what springs ask of the masses, none without springs
            if len(R):
                blocks.append(Block(labels[: len(R)], "zero", R @ E, R @ X0 + held))
            if self.conditions.unheld:
                never = np.array([self.conditions.unheld / self.mass])
                blocks.append(Block(labels[-1], "zero", np.zeros((1, n)), never))
        for m in materials:
            blocks += m.blocks(n)
            if m.sign < 0:
                half = 0.5 * self.body(m.body)[3:, 3]
                blocks.append(Block(f"{m.label} <= half its mass", "nonneg", -unit_row(m.start, n), half))
        for m in materials:
            if m.sign > 0:
                blocks += self._mass_bounds(m, masses, n)
        return blocks

    def caps(self, materials: Sequence[Material], masses: MassBounds, n: int) -> list[Block]:
        """Return bounds on added masses that have none of their own; without them an optimum need not exist."""
        out = []
        for m in materials:
            if m.sign > 0 and self._bounds(m, masses) is None:
                label = f"mass of {m.label} <= {CAP:g} times the moving mass"
                out.append(Block(label, "nonneg", -unit_row(m.start, n), np.array([CAP])))
        return out

    def fixed(self, materials: Sequence[Material], masses: MassBounds, n: int) -> Array:
        """Return rows (k, n + 1) of masses that are given exactly: row @ y = last entry."""
        out = np.zeros((0, n + 1))
        for m in materials:
            bounds = self._bounds(m, masses) if m.sign > 0 else None
            if bounds is not None and bounds[0] == bounds[1]:
                out = np.vstack([out, np.append(unit_row(m.start, n)[0], bounds[0] / self.mass)])
        return out

    def _mass_bounds(self, m: Material, masses: MassBounds, n: int) -> list[Block]:
        bounds = self._bounds(m, masses)
        if bounds is None:
            return []  # see caps
        (low, high), row = bounds, unit_row(m.start, n)
        if low == high:
            return [Block(f"mass of {m.label} = {low:g} kg", "zero", row, np.array([-low / self.mass]))]
        return [
            Block(f"mass of {m.label} >= {low:g} kg", "nonneg", row, np.array([-low / self.mass])),
            Block(f"mass of {m.label} <= {high:g} kg", "nonneg", -row, np.array([high / self.mass])),
        ]

    def _bounds(self, m: Material, masses: MassBounds) -> tuple[float, float] | None:
        """Return the bounds on the mass of one material [kg], or None."""
        name = self.chain.joints[m.body]
        if isinstance(masses, Mapping):
            for key in masses:
                if key not in self.chain.joints:
                    raise UnknownNameError("body of a mass bound", key, self.chain.joints)
        given = masses.get(name) if isinstance(masses, Mapping) else masses
        if given is None:
            present = float(self.chain.inertial_parameters[m.body, 0])
            return None if self.mode == "add" else (0.5 * present, 2.0 * present)
        low, high = (float(v) for v in checked(f"masses of {name}", given, (2,)))
        if not 0.0 <= low <= high:
            raise InvalidInputError(f"masses of {name}", (low, high), "must be 0 <= low <= high [kg]")
        return low, high


def unit_row(k: int, n: int) -> Array:
    """Return e_k as a row (1, n)."""
    row = np.zeros((1, n))
    row[0, k] = 1.0
    return row
