"""Writing a linkage as a file: YAML, one thing a line, only what differs from the defaults."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Protocol

from fivebar_pin._files import as_path, write_set
from fivebar_pin.planar._parts import (
    ALUMINIUM,
    GROUND,
    THICKNESS,
    WIDTH,
    Gear,
    Link,
    Lump,
    Motor,
    PointSpring,
    Section,
)

__all__ = ["linkage_text", "write_linkage"]

_DOWN = (0.0, -9.81, 0.0)


class Description(Protocol):
    """What a linkage is made of, see `Linkage`."""

    name: str
    gravity: tuple[float, ...]
    sketch: dict[str, complex]
    links: dict[str, Link]
    lumps: list[Lump]
    springs: list[PointSpring]
    gears: list[Gear]
    motors: list[Motor]


def write_linkage(linkage: Description, path: object, *, overwrite: bool) -> Path:
    """Write the file and return its path."""
    target = as_path(path)
    return write_set(target.parent, {target.name: linkage_text(linkage)}, overwrite=overwrite)[0]


def linkage_text(linkage: Description) -> str:
    """Return the text of the file; every number reads back exactly."""
    links = linkage.links
    bars = [link for link in links.values() if link.guide is None and link.name != GROUND]
    lines = [f"linkage: {_text(linkage.name)}"]
    if linkage.gravity != _DOWN:
        lines.append(f"gravity: {_text(list(linkage.gravity))}    # [m/s2]")
    lines += ["points:    # the sketch, x and y [m]"]
    lines += [f"  {_text(name)}: {_text([z.real, z.imag])}" for name, z in linkage.sketch.items()]
    lines.append(f"ground: {_text(list(links[GROUND].points))}")
    lines += _block("bars", {x.name: _bar(x) for x in bars if x.section is None or not x.section.plate})
    lines += _block("plates", {x.name: _bar(x) for x in bars if x.section is not None and x.section.plate})
    lines += _block("slides", {x.name: _slide(x) for x in links.values() if x.guide is not None})
    lines += _list("masses", (_mass(x) for x in linkage.lumps))
    lines += _list("springs", (_spring(x) for x in linkage.springs))
    motors = (
        " ".join([m.link, *(["at", m.at] if m.at else []), *(["on", m.on] if m.on else [])]) for m in linkage.motors
    )
    lines += _list("gears", (_gear(x) for x in linkage.gears))
    lines += _list("motors", motors)
    return "\n".join([*lines, ""])


def _bar(link: Link) -> dict[str, Any]:
    section = link.section or Section(False, 0.0, WIDTH, THICKNESS)
    usual = Section(section.plate, ALUMINIUM, WIDTH, THICKNESS)
    words = ("density", "width", "thickness", "linear_density")
    made = {word: getattr(section, word) for word in words if getattr(section, word) != getattr(usual, word)}
    return {**_start(link), **made}


def _start(link: Link) -> dict[str, Any]:
    out: dict[str, Any] = {"points": list(link.points)}
    if link.length is not None:
        out["length"] = link.length
    if link.places:
        out["places"] = {point: [z.real, z.imag] for point, z in link.places.items()}
    return out


def _slide(link: Link) -> dict[str, Any]:
    guide, out = link.guide, _start(link)
    assert guide is not None
    if guide.on != GROUND:
        out["on"] = guide.on
    if guide.angle:
        out["angle"] = guide.angle
    if guide.through is not None:
        out["through"] = [guide.through.real, guide.through.imag]
    return out


def _mass(lump: Any) -> dict[str, Any]:
    out: dict[str, Any] = {"bar": lump.link, "at": lump.at, "mass": lump.mass}
    if lump.centre:
        out["centre"] = [lump.centre.real, lump.centre.imag]
    if lump.inertia:
        out["inertia"] = lump.inertia
    return out


def _spring(spring: Any) -> dict[str, Any]:
    out: dict[str, Any] = {"between": list(spring.ends), "stiffness": spring.stiffness, "length": spring.length}
    if spring.damping:
        out["damping"] = spring.damping
    return out


def _gear(gear: Any) -> dict[str, Any]:
    out: dict[str, Any] = {"between": [gear.driver, gear.driven], "ratio": gear.ratio}
    return out if gear.carrier == GROUND else {**out, "carrier": gear.carrier}


def _block(word: str, things: Mapping[str, Mapping[str, Any]]) -> list[str]:
    short = {name: said["points"] if set(said) == {"points"} else said for name, said in things.items()}
    return [f"{word}:", *(f"  {_text(name)}: {_text(said)}" for name, said in short.items())] if things else []


def _list(word: str, things: Iterable[Any]) -> list[str]:
    lines = [f"  - {_text(said)}" for said in things]
    return [f"{word}:", *lines] if lines else []


def _text(value: Any) -> str:
    """Return a plain value on one line."""
    import yaml

    text = yaml.safe_dump(value, default_flow_style=True, width=10**6, allow_unicode=True, sort_keys=False)
    return text.removesuffix("...\n").strip()
