"""What a linkage is made of, as it was said: links with points, slides, motors and the rest."""

from __future__ import annotations

from dataclasses import dataclass, field

__all__ = [
    "ALUMINIUM",
    "GROUND",
    "THICKNESS",
    "WIDTH",
    "Gear",
    "Guide",
    "Link",
    "Lump",
    "Motor",
    "PointSpring",
    "Section",
]

GROUND = "ground"
"""Name of the link that does not move."""
ALUMINIUM = 2700.0
"""Density of bars and plates unless another is given [kg/m3]."""
WIDTH, THICKNESS = 0.02, 0.01
"""Section of bars, and thickness of plates, unless another is given [m]."""


@dataclass(frozen=True, slots=True)
class Section:
    """What a link is made of.

    Attributes:
        plate: a plate through its points rather than bars along them.
        density: of the material [kg/m3]; 0 for no mass.
        width: of bars, or of a plate's drawn sides [m].
        thickness: square to the plane [m].
        linear_density: of bars [kg/m], in place of that of the section; None where the section states it.
    """

    plate: bool
    density: float
    width: float
    thickness: float
    linear_density: float | None = None


@dataclass(frozen=True, slots=True)
class Guide:
    """The straight line on another link along which a link slides without turning.

    Attributes:
        on: the link that carries the line.
        through: a point of it in the sketch [m]; None: the sliding link's first point.
        angle: its direction in the sketch, from x [rad].
    """

    on: str
    through: complex | None
    angle: float


@dataclass(frozen=True, slots=True)
class Link:
    """A link and its points; its own axes start at the first one.

    Attributes:
        name: of the link.
        points: names of its points.
        length: from the first point to the second [m]; None: that of the sketch.
        places: coordinates of other points in the link's axes [m], in place of those of the sketch.
        section: what it is made of; None for nothing.
        guide: the line it slides along; None for a link on pins.
    """

    name: str
    points: tuple[str, ...]
    length: float | None = None
    places: dict[str, complex] = field(default_factory=dict)
    section: Section | None = None
    guide: Guide | None = None


@dataclass(frozen=True, slots=True)
class Lump:
    """Mass on a link [kg, m, kg m2]; `centre` is in the link's axes, from the point `at`."""

    link: str
    at: str
    mass: float
    centre: complex = 0j
    inertia: float = 0.0


@dataclass(frozen=True, slots=True)
class PointSpring:
    """A spring with a damper between two points [N/m, m, N s/m]."""

    ends: tuple[str, str]
    stiffness: float
    length: float
    damping: float = 0.0


@dataclass(frozen=True, slots=True)
class Gear:
    """Two links whose angles on a carrier keep a ratio: turn of `driven` = ratio * turn of `driver`, on the carrier."""

    driver: str
    driven: str
    ratio: float
    carrier: str


@dataclass(frozen=True, slots=True)
class Motor:
    """A driven pivot or slide: `link` turns at the point `at` against `on`, or slides (at is empty)."""

    link: str
    at: str = ""
    on: str = ""

    @property
    def words(self) -> str:
        """How it is said in a file: `crank at A on ground`."""
        return self.link + (f" at {self.at}" if self.at else "") + (f" on {self.on}" if self.on else "")
