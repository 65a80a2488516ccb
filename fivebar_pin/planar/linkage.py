"""Building a planar linkage in its own words."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import checked, number
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.planar._build import built
from fivebar_pin.planar._checks import unknown_names
from fivebar_pin.planar._closing import closed_at_home
from fivebar_pin.planar._parts import (
    ALUMINIUM,
    GROUND,
    THICKNESS,
    WIDTH,
    Gear,
    Guide,
    Link,
    Lump,
    Motor,
    PointSpring,
    Section,
)
from fivebar_pin.planar._writing import write_linkage

__all__ = ["Linkage"]

_DOWN = (0.0, -9.81, 0.0)
_NAME = re.compile(r"\w[\w.-]*")


class Linkage:
    """A planar linkage under construction: points of a sketch, bars that join them, slides, springs, masses, motors.

        watt = Linkage("watt")
        watt.ground(A=(0, 0), B=(0.4, 0))
        watt.points(C=(0.05, 0.09), D=(0.36, 0.3), E=(0.2, 0.28), F=(0.52, 0.2), G=(0.4, 0.42))
        watt.bar("crank", "A", "C")
        watt.bar("coupler", "C", "D", "E")
        watt.bar("rocker", "B", "D", "F")
        watt.bar("strut", "E", "G")
        watt.bar("output", "F", "G")
        watt.motor("crank", at="A")
        chain = watt.chain()

    Bars that share a point are pinned to each other there, bars that share one with the ground to the ground. A point
    of one bar alone is a tracer. The sketch fixes every length that is not stated; where lengths are stated it need be
    a rough one only, and is closed with the motors where they are.

    Names of the chain's parameters: a bar's own for its length from its first to its second point; `bar_P_x`,
    `bar_P_y` for other points P, in the bar's axes (origin at the first point, x towards the second); `A_x`, `A_y`
    for pivots of the ground; `slider_angle`, `slider_offset` for the line of a slide, in the axes of what carries it.
    Joints are named after the bar that hangs on them, frames `bar_P` after bar and point, closures after the point.
    """

    def __init__(self, name: str, *, gravity: npt.ArrayLike = _DOWN) -> None:
        """Start a linkage.

        Args:
            name: of the mechanism.
            gravity: (2,) in the plane or (3,) [m/s2]; (0, 0, -9.81) for a linkage that lies flat.
        """
        self.name = _checked_name("linkage", name)
        g = np.asarray(gravity)
        shape = (2,) if g.shape == (2,) else (3,)
        self.gravity = tuple(float(x) for x in (*checked("gravity", gravity, shape), 0.0)[:3])
        self.sketch: dict[str, complex] = {}
        self.links: dict[str, Link] = {GROUND: Link(GROUND, ())}
        self.lumps: list[Lump] = []
        self.springs: list[PointSpring] = []
        self.gears: list[Gear] = []
        self.motors: list[Motor] = []

    def __repr__(self) -> str:
        bars = ", ".join(f"{x.name} ({'-'.join(x.points)})" for x in self.links.values() if x.name != GROUND)
        fixed = ", ".join(self.links[GROUND].points)
        motors = ", ".join(f"{m.link} at {m.at}" if m.at else m.link for m in self.motors)
        return f"Linkage({self.name!r}: ground {fixed or 'none'}; bars: {bars or 'none'}; motors: {motors or 'none'})"

    def points(self, places: Mapping[str, Sequence[float]] | None = None, /, **named: Sequence[float]) -> None:
        """Sketch points: P=(x, y) [m]; a mapping for names that are no words of Python."""
        if not isinstance(places, Mapping | None):
            raise InvalidInputError("points", places, "must map names to places, as A=(0, 0) or {'A': (0, 0)}")
        for name, place in {**(places or {}), **named}.items():
            _checked_name("point", name)
            if name in self.sketch:
                raise InvalidInputError(f"point {name}", place, "is sketched twice")
            x, y = checked(f"point {name}", place, (2,))
            self.sketch[name] = complex(x, y)

    def ground(self, *points: str, **named: Sequence[float]) -> None:
        """Fix points to the ground: names of sketched points, or P=(x, y) [m] for new ones."""
        self.points(named)
        fixed = (*self.links[GROUND].points, *self._known((*points, *named)))
        if len(set(fixed)) < len(fixed):
            raise InvalidInputError("points of the ground", fixed, "must be named once")
        self.links[GROUND] = Link(GROUND, fixed)

    def bar(
        self,
        name: str,
        *points: str,
        length: float | None = None,
        places: Mapping[str, Sequence[float]] | None = None,
        density: float = ALUMINIUM,
        width: float = WIDTH,
        thickness: float = THICKNESS,
        linear_density: float | None = None,
    ) -> None:
        """Add a bar that joins points: two, or more for a ternary link; one for a wheel, which has no mass of its own.

        It is made of uniform bars from each point to the next.

        Args:
            name: of the bar.
            points: that it joins, in order.
            length: from the first to the second [m]; the sketch's unless given.
            places: coordinates (x, y) of the third and further points in the bar's axes [m]; the sketch's unless given.
            density: [kg/m3]; 0 for no mass.
            width, thickness: of the section [m].
            linear_density: mass per length [kg/m], instead of that of density and section.
        """
        section = Section(False, density, width, thickness, linear_density)
        self._add(Link(name, points, length, _places(name, places), self._checked_section(name, section)))

    def plate(
        self,
        name: str,
        *points: str,
        length: float | None = None,
        places: Mapping[str, Sequence[float]] | None = None,
        density: float = ALUMINIUM,
        thickness: float = THICKNESS,
    ) -> None:
        """Add a link that is a plate, the polygon through three or more points in order; see `bar` for the rest."""
        if len(points) < 3:
            raise InvalidInputError(f"points of plate {name}", points, "must be three or more")
        section = self._checked_section(name, Section(True, density, WIDTH, thickness))
        self._add(Link(name, points, length, _places(name, places), section))

    def slide(
        self,
        name: str,
        *points: str,
        on: str = GROUND,
        angle: float = 0.0,
        through: Sequence[float] | None = None,
        places: Mapping[str, Sequence[float]] | None = None,
        mass: float = 0.0,
    ) -> None:
        """Add a link that slides along a straight line without turning on it.

        Args:
            name: of the sliding link.
            points: of it; bars that share one are pinned to it. Its mass sits at the first.
            on: link that carries the line; the ground unless given.
            angle: direction of the line in the sketch, from x [rad].
            through: a point (x, y) of the line in the sketch [m]; the first of `points` unless given.
            places: coordinates of further points in the axes of the slide (origin at the first, x along the line) [m].
            mass: [kg].
        """
        start = None if through is None else complex(*checked(f"through of slide {name}", through, (2,)))
        guide = Guide(_checked_name("link", on), start, number(f"angle of slide {name}", angle, unit="rad"))
        self._add(Link(name, points, None, _places(name, places), None, guide))
        if mass:
            self.mass(name, at=points[0], mass=mass)

    def mass(
        self, link: str, *, at: str, mass: float, centre: Sequence[float] = (0.0, 0.0), inertia: float = 0.0
    ) -> None:
        """Put a body on a link, beside what it is made of: a point mass, or one with a stated inertia.

        Args:
            link: that carries it.
            at: point of the link.
            mass: [kg].
            centre: (x, y) of its mass centre from that point, in the link's axes [m].
            inertia: about its mass centre, square to the plane [kg m2].
        """
        self._point_of(link, at)
        for what, value in (("mass", mass), ("inertia", inertia)):
            _not_negative(f"{what} on {link}", value)
        x, y = checked(f"centre of the mass on {link}", centre, (2,))
        self.lumps.append(Lump(link, at, float(mass), complex(x, y), float(inertia)))

    def spring(self, first: str, second: str, *, stiffness: float, length: float = 0.0, damping: float = 0.0) -> None:
        """Put a spring with a damper between two points: k [N/m], free length [m], c [N s/m]."""
        ends = self._known((first, second))
        values = [
            _not_negative(f"{what} of spring {first}-{second}", value)
            for what, value in (("stiffness", stiffness), ("length", length), ("damping", damping))
        ]
        self.springs.append(PointSpring((ends[0], ends[1]), *values))

    def gear(self, driver: str, driven: str, *, ratio: float, carrier: str = GROUND) -> None:
        """Gear two links to each other: turn of `driven` = ratio * turn of `driver`, both counted on the carrier.

        They mesh as they lie in the sketch, and count their turns. Wheels that touch outside turn against each other:
        ratio = -teeth of the driver / teeth of the driven. A wheel is a bar with one point and a mass of its own.

        Args:
            driver, driven: links that turn.
            ratio: of their angles on the carrier; not zero [-].
            carrier: link that carries both wheels; the ground unless given.
        """
        if number(f"ratio of gear {driver}_{driven}", ratio) == 0.0:
            raise InvalidInputError(f"ratio of gear {driver}_{driven}", ratio, "must not be zero")
        if len({driver, driven, carrier}) < 3:
            raise InvalidInputError("links of a gear", (driver, driven, carrier), "must be three different ones")
        self.gears.append(Gear(driver, driven, float(ratio), carrier))

    def motor(self, link: str, *, at: str = "", on: str = "") -> None:
        """Drive a link: where it turns at a point, or along its line when it is a slide.

        Args:
            link: that is driven.
            at: point where it turns; none for a slide.
            on: link that it turns on; needed only where several others share the point (the ground goes first).
        """
        self.motors.append(Motor(link, at, on))

    def chain(self) -> ClosedChain:
        """Return the linkage as a closed chain whose configuration "home" is the sketch, closed.

        Raises:
            InvalidInputError: a bar that connects to nothing, or motors that are not as many as the mobility, or do
                not determine the motion; says which joints could be driven.
            AssemblyError: the lengths do not close.
            UnknownNameError: a bar or point that there is not.
        """
        self._check_links()
        motors = [self._completed(motor) for motor in self.motors]
        chain = built(
            self.name,
            self.sketch,
            dict(sorted(self.links.items(), key=lambda item: _rank(item[1]))),
            motors=motors,
            gears=self.gears,
            lumps=self.lumps,
            springs=self.springs,
            gravity=self.gravity,
        )
        return closed_at_home(chain, self.links)

    def save(self, path: object, *, overwrite: bool = False) -> Path:
        """Write the linkage as a file that `fivebar_pin.planar.load` reads, and a person.

        Raises:
            OutputError: the file exists already, or cannot be written.
        """
        return write_linkage(self, path, overwrite=overwrite)

    def _add(self, link: Link) -> None:
        _checked_name("bar", link.name)
        if link.name in self.links:
            raise InvalidInputError("names of bars", link.name, "is there already", "Choose another name.")
        _check_words(f"points of {link.name}", link.points)
        if not link.points or len(set(link.points)) < len(link.points):
            raise InvalidInputError(f"points of {link.name}", link.points, "must be one or more different points")
        if link.length is not None:
            if len(link.points) < 2:
                raise InvalidInputError(f"length of {link.name}", link.length, "needs two points")
            number(f"length of bar {link.name}", link.length, positive=True, unit="m")
        own = link.points[1 if link.guide is not None else 2 :]
        for point in link.places:
            if point not in own:
                raise UnknownNameError(f"further point of {link.name}", point, own)
        self.links[link.name] = link

    def _checked_section(self, name: str, section: Section) -> Section:
        for what in ("density", "width", "thickness", "linear_density"):
            value = getattr(section, what)
            if value is not None:
                _not_negative(f"{what} of {name}", value)
        return section

    def _known(self, points: Sequence[str]) -> tuple[str, ...]:
        _check_words("points", points)
        for point in points:
            if point not in self.sketch:
                raise UnknownNameError("point", point, self.sketch)
        return tuple(points)

    def _link(self, name: str) -> Link:
        if name not in self.links:
            raise UnknownNameError("bar", name, self.links)
        return self.links[name]

    def _point_of(self, link: str, point: str) -> None:
        points = self._link(link).points
        if point not in points:
            raise UnknownNameError(f"point of {link}", point, points)

    def _check_links(self) -> None:
        if not self.links[GROUND].points and not any(x.guide and x.guide.on == GROUND for x in self.links.values()):
            problem = "must be one at least: a linkage stands on points that do not move"
            raise InvalidInputError(f"points of the ground of {self.name}", (), problem, "Say ground(A=(0, 0)).")
        if len(self.links) == 1:
            raise InvalidInputError(f"bars of {self.name}", (), "must be one at least")
        for _, error in unknown_names(self.sketch, self.links, self.gears, self.motors):
            raise error
        for link in self.links.values():
            if link.guide is not None:
                carrier = self.links[link.guide.on]
                if carrier is link or (carrier.guide is not None and carrier.guide.on == link.name):
                    raise InvalidInputError(f"slide {link.name}", link.guide.on, "slides on itself")

    def _completed(self, motor: Motor) -> Motor:
        """Return the motor with the link that it works against."""
        link = self.links[motor.link]
        if not motor.at:
            if link.guide is None:
                raise InvalidInputError(f"motor of {link.name}", "", "needs the point where it turns", "Say at=...")
            return replace(motor, on=link.guide.on)
        others = [x.name for x in self.links.values() if motor.at in x.points and x is not link]
        if motor.on:
            if motor.on not in others:
                raise UnknownNameError(f"link at {motor.at}", motor.on, others)
            return motor
        if not others:
            raise InvalidInputError(f"motor of {link.name}", motor.at, "is a point of this bar alone")
        if len(others) > 1 and GROUND not in others:
            raise InvalidInputError(
                f"motor of {link.name} at {motor.at}", others, "could work against any of these", "Say on=..."
            )
        return replace(motor, on=GROUND if GROUND in others else others[0])


def _rank(link: Link) -> int:
    """Order links as files do, so that what is read back is the same to the last frame: bars, plates, slides."""
    return 2 if link.guide is not None else int(link.section is not None and link.section.plate)


def _checked_name(kind: str, name: object) -> str:
    if not isinstance(name, str) or not _NAME.fullmatch(name) or (kind == "bar" and name == GROUND):
        raise InvalidInputError(f"name of a {kind}", name, "must be letters, digits, _, - or .")
    return name


def _not_negative(name: str, value: object) -> float:
    x = number(name, value)
    if x < 0.0:
        raise InvalidInputError(name, value, "must not be negative")
    return x


def _check_words(name: str, words: Sequence[str]) -> None:
    if not all(isinstance(word, str) for word in words):
        raise InvalidInputError(name, words, "must be names, one after the other and not in a list")


def _places(name: str, places: Mapping[str, Sequence[float]] | None) -> dict[str, complex]:
    return {p: complex(*checked(f"place of {p} on {name}", z, (2,))) for p, z in (places or {}).items()}
