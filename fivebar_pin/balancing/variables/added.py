"""Material added to present bodies, of any shape or as counterweights of a stated kind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from fivebar_pin.balancing.parameters import lowest_eigenvalue
from fivebar_pin.balancing.pieces.piece import Piece
from fivebar_pin.balancing.pieces.trial import Trial
from fivebar_pin.balancing.regions.region import Region
from fivebar_pin.balancing.regions.shape import Shape
from fivebar_pin.balancing.setting import Setting
from fivebar_pin.balancing.variables.asked import material
from fivebar_pin.balancing.variables.material import Bounds
from fivebar_pin.balancing.variables.part import Part
from fivebar_pin.balancing.variables.placement import check_names, densest, masses_of, shape_of
from fivebar_pin.balancing.variables.variable import MassBounds, Stated, Variable, register
from fivebar_pin.errors import InvalidInputError

__all__ = ["CAP", "AddedMaterial"]

CAP = 10.0  # largest mass added to one body unless given [moving masses]
_PHYSICAL = 1e-9  # negative eigenvalue of a present body's pseudo-inertia that is round-off [moving mass, chain length]


@register("add")
@dataclass(frozen=True, slots=True, eq=False)
class AddedMaterial(Variable):
    """Material added to the present bodies.

    Attributes:
        bodies, region, masses, counterweight: as for `balance`.
        density: of all that is no counterweight [kg/m3], and its thickness [m]; None for any.
        trial: the sizes and places about which counterweights are looked for.
    """

    bodies: Sequence[str] | None = None
    region: Region | Mapping[str, Region] | None = None
    masses: MassBounds = None
    counterweight: Piece | Mapping[str, Piece] | None = None
    density: tuple[float, float] | None = None
    trial: Trial = field(default_factory=Trial)

    @classmethod
    def of(cls, stated: Stated) -> AddedMaterial:
        """Return it from the arguments of `balance`."""
        return cls(stated.bodies, stated.region, stated.masses, stated.counterweight, stated.density)

    def in_pieces(self, pieces: Mapping[str, Piece]) -> AddedMaterial:
        """Return it with counterweights of stated kinds."""
        return replace(self, counterweight=dict(pieces))

    def shape(self, setting: Setting, b: int) -> Shape | None:
        """Return where material may lie."""
        return shape_of(setting, b, self.region)

    def tried(self, trial: Trial) -> AddedMaterial:
        """Return it with counterweights about other sizes and places."""
        return replace(self, trial=trial)

    def parts(self, setting: Setting) -> list[Part]:
        """Return one piece of material for each body that may change."""
        _check_physical(setting)
        check_names(setting, self.region, "region")
        check_names(setting, self.counterweight, "counterweight")
        bodies = [b for b in setting.chosen(self.bodies) if b not in self.trial.without]
        return [self._part(setting, b) for b in bodies]

    def pieces(self, setting: Setting) -> dict[int, Piece]:
        """Return what the material added to a body is made as, by its index."""
        found = ((b, self._piece(setting, b)) for b in setting.chosen(self.bodies) if b not in self.trial.without)
        return {b: piece for b, piece in found if piece is not None}

    def _part(self, setting: Setting, b: int) -> Part:
        space, piece, size = setting.space, self._piece(setting, b), self.trial.sizes.get(b)
        solid = None if piece is None else piece.solid(space.axes[b], setting.mass, space.length)
        limits = Bounds(
            shape=shape_of(setting, b, self.region),
            density=densest(setting, self.density),
            solid=solid,
            radius=None if size is None else size.radius,
            point=None if size is None else size.center,
            stray=None if size is None else size.stray,
            elastic=self.trial.elastic and solid is not None,
            masses=masses_of(setting, b, self.masses),
            cap=CAP,
        )
        return material(b, 1, f"material added to {setting.chain.joints[b]}", limits, planar=space.planar)

    def _piece(self, setting: Setting, b: int) -> Piece | None:
        name, given = setting.chain.joints[b], self.counterweight
        piece = given.get(name) if isinstance(given, Mapping) else given
        if piece is None:
            return None
        if not isinstance(piece, Piece):
            raise InvalidInputError(f"counterweight of body {name}", piece, "must be a Disc, a Bar or a Sphere")
        if piece.flat and not setting.space.planar:
            word = type(piece).__name__
            raise InvalidInputError("counterweight", word, "needs a planar mechanism", "Use balls: Sphere.")
        return piece


def _check_physical(setting: Setting) -> None:
    """Raise when a present body could not exist."""
    for b, (name, x) in enumerate(zip(setting.chain.joints, setting.present(), strict=True)):
        lowest = lowest_eigenvalue(x, planar=setting.space.planar)
        if lowest < -_PHYSICAL:
            raise InvalidInputError(
                f"inertia of body {name}",
                [float(v) for v in setting.space.of(setting.chain.inertial_parameters)[b]],
                f"is not that of a physical body (pseudo-inertia has the eigenvalue {lowest:.3g}, scaled)",
                "Correct the model, or redesign the body.",
            )
