"""The sidecar's key ``parameters``: named lengths, and how joints, frames and bodies follow them.

values:     {l2: 0.3}                                     name: value [m or rad]
lengths:    [l2]                                          those that must stay positive
placements: {elbow: {moves: [[l2, [1, 0, 0, 0, 0, 0]]], base: [[...], ...]}}    base: 4 x 4, where it is not 1
bodies:     [{bar: [frame, frame], linear_density: 0.54, width: 0.02, thickness: 0.01}, {plate: ...}, {lump: ...}]
"""

from __future__ import annotations

from dataclasses import MISSING, fields
from typing import Any, Protocol

import numpy as np

from fivebar_pin.chain import Geometry, Placement
from fivebar_pin.chain.bodies import RULES, Body
from fivebar_pin.errors import FileFormatError, FiveBarPinError, UnknownNameError

__all__ = ["geometry_entries", "read_geometry"]

_KEYS = ("values", "lengths", "placements", "bodies")
_PLACEMENT_KEYS = ("moves", "base")


class _Reader(Protocol):
    """What is asked of the reader of a sidecar."""

    def fail(self, key: str, problem: str) -> FileFormatError: ...
    def mapping(self, key: str, value: object) -> dict[str, Any]: ...
    def sequence(self, key: str, value: object, count: int | None = None) -> list[Any]: ...
    def names(self, key: str, value: object, count: int | None = None) -> list[str]: ...
    def numbers(self, key: str, value: object, count: int | None = None) -> list[float]: ...


def geometry_entries(geometry: Geometry) -> dict[str, Any]:
    """Return plain values that say what a geometry says; every number reads back exactly."""
    content: dict[str, Any] = {"values": dict(geometry.parameters)}
    if geometry.lengths:
        content["lengths"] = list(geometry.lengths)
    content["placements"] = {placement.name: _placement_entries(placement) for placement in geometry.placements}
    if geometry.bodies:
        content["bodies"] = [_body_entries(body) for body in geometry.bodies]
    return content


def _placement_entries(placement: Placement) -> dict[str, Any]:
    entries: dict[str, Any] = {"moves": [[name, [float(x) for x in twist]] for name, twist in placement.moves]}
    if not np.array_equal(placement.base, np.eye(4)):
        entries["base"] = [[float(x) for x in row] for row in np.asarray(placement.base)]
    return entries


def _body_entries(body: Body) -> dict[str, Any]:
    word = next(word for word, kind in RULES.items() if type(body) is kind)
    entries: dict[str, Any] = {word: list(body.frames)}
    for f in fields(body):  # type: ignore[arg-type]
        value = getattr(body, f.name)
        if f.name != "frames" and value != f.default:
            entries[f.name] = list(value) if isinstance(value, tuple) else value
    return entries


def read_geometry(check: _Reader, value: object) -> Geometry:
    """Return the geometry that the key `parameters` states; none where it is absent.

    Raises:
        FileFormatError: an unknown or missing key, or a value of the wrong type; names it.
    """
    content = check.mapping("parameters", value)
    for key in content:
        if key not in _KEYS:
            raise check.fail("parameters", str(UnknownNameError("key", key, _KEYS)))
    values = check.mapping("parameters, values", content.get("values"))
    placements = check.mapping("parameters, placements", content.get("placements"))
    bodies = check.sequence("parameters, bodies", content.get("bodies", []))
    try:
        return Geometry(
            {name: check.numbers(f"parameter {name}", [x])[0] for name, x in values.items()},
            tuple(_placement(check, name, entries) for name, entries in placements.items()),
            tuple(_body(check, f"parameters, bodies[{k}]", entries) for k, entries in enumerate(bodies)),
            tuple(check.names("parameters, lengths", content.get("lengths", []))),
        )
    except FileFormatError:
        raise
    except FiveBarPinError as error:
        raise check.fail("parameters", str(error)) from error


def _placement(check: _Reader, name: str, value: object) -> Placement:
    where = f"parameters, placement of {name}"
    entries = check.mapping(where, value)
    for key in entries:
        if key not in _PLACEMENT_KEYS:
            raise check.fail(where, str(UnknownNameError("key", key, _PLACEMENT_KEYS)))
    moves = []
    for move in check.sequence(where, entries.get("moves", [])):
        parameter, twist = check.sequence(f"{where}, move", move, 2)
        moves.append((check.names(where, [parameter])[0], np.array(check.numbers(where, twist, 6))))
    rows = [check.numbers(f"{where}, base", row, 4) for row in check.sequence(where, entries.get("base", []))]
    return Placement(name, tuple(moves), np.array(rows) if rows else np.eye(4))


def _body(check: _Reader, where: str, value: object) -> Body:
    entries = check.mapping(where, value)
    words = [word for word in entries if word in RULES]
    if len(words) != 1:
        raise check.fail(where, f"must have one of the keys {', '.join(RULES)}")
    kind = RULES[words[0]]
    known = {f.name: f for f in fields(kind) if f.name != "frames"}  # type: ignore[arg-type]
    stated: dict[str, Any] = {}
    for key, entry in entries.items():
        if key == words[0]:
            continue
        if key not in known:
            raise check.fail(where, str(UnknownNameError("key", key, known)))
        stated[key] = (
            tuple(check.numbers(f"{where}, {key}", entry))
            if isinstance(entry, list)
            else check.numbers(f"{where}, {key}", [entry])[0]
        )
    for key, f in known.items():
        if key not in stated and f.default is MISSING:
            raise check.fail(where, f"{key} is missing")
    make: Any = kind
    return make(tuple(check.names(where, entries[words[0]])), **stated)  # type: ignore[no-any-return]
