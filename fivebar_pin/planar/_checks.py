"""Names that parts of a linkage use and nothing has: which part, by its place in a file, and what is wrong."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

from fivebar_pin.errors import UnknownNameError
from fivebar_pin.planar._parts import GROUND, Gear, Link, Motor

__all__ = ["Key", "unknown_names"]

Key = str | int


def unknown_names(
    sketch: Collection[str], links: Mapping[str, Link], gears: Sequence[Gear], motors: Sequence[Motor]
) -> Iterable[tuple[tuple[Key, ...], UnknownNameError]]:
    """Yield the place in a file, and the error, of every part that names a point or bar that there is not.

    Args:
        sketch: the points.
        links: by name, the ground among them.
        gears: in the order said.
        motors: in the order said.
    """
    for link in links.values():
        where = (_word(link), link.name)
        for point in link.points:
            if point not in sketch:
                yield where, UnknownNameError(f"point of bar {link.name}", point, sketch)
        if link.guide is not None and link.guide.on not in links:
            yield where, UnknownNameError("bar", link.guide.on, links)
    for k, gear in enumerate(gears):
        for name in (gear.driver, gear.driven, gear.carrier):
            if name not in links:
                yield ("gears", k), UnknownNameError("bar", name, links)
    for k, motor in enumerate(motors):
        if motor.link not in links:
            yield ("motors", k), UnknownNameError("bar", motor.link, links)
        elif motor.at and motor.at not in links[motor.link].points:
            yield ("motors", k), UnknownNameError(f"point of {motor.link}", motor.at, links[motor.link].points)


def _word(link: Link) -> str:
    """Return the key of a file under which a link stands."""
    if link.name == GROUND:
        return GROUND
    if link.guide is not None:
        return "slides"
    return "plates" if link.section is not None and link.section.plate else "bars"
