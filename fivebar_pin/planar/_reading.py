"""Reading a linkage file: YAML that a person writes; every refusal names the file, the key and the line."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fivebar_pin._files import as_path, read_bounded
from fivebar_pin.errors import FileFormatError, FiveBarPinError, UnknownNameError
from fivebar_pin.io._sidecar import MAX_SIDECAR_BYTES, plain_yaml
from fivebar_pin.planar._checks import Key, unknown_names
from fivebar_pin.planar.linkage import Linkage

__all__ = ["load"]

_KEYS = ("linkage", "gravity", "points", "ground", "bars", "plates", "slides", "masses", "springs", "gears", "motors")
_MOTOR = re.compile(r"(?P<link>\S+)(\s+at\s+(?P<at>\S+))?(\s+on\s+(?P<on>\S+))?")
_DEGREES = re.compile(r"(?P<number>[-+.\de]+)\s*deg")


def load(path: object) -> Linkage:
    """Read a linkage file.

        linkage: four_bar
        points: {A: [0, 0], B: [0.4, 0], C: [0.05, 0.09], D: [0.3, 0.3], P: [0.2, 0.35]}   # a sketch [m]
        ground: [A, B]
        bars:
          crank: [A, C]
          coupler: {points: [C, D, P], length: 0.35}
          rocker: [B, D]
        motors: [crank at A]

    Further keys: `gravity`; `plates` and `slides`, as bars; `masses` (each {bar, at, mass}), `springs` (each {between,
    stiffness, length}), `gears` (each {between: [driver, driven], ratio, carrier}). A bar is a list of its points, or
    what `Linkage.bar` takes. Angles may be written as 30 deg.

    Args:
        path: the file.

    Raises:
        FileFormatError: not such a file, an unknown key, or a value that cannot be; names key and line.
    """
    file = as_path(path)
    return _Reader(file).linkage(plain_yaml(file, MAX_SIDECAR_BYTES))


class _Reader:
    """Says the content of one file to a `Linkage`."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def fail(self, where: tuple[Key, ...], problem: str) -> FileFormatError:
        words = "".join(f"[{key}]" if isinstance(key, int) else f", {key}" for key in where).removeprefix(", ")
        line = _line_of(self.path, where)
        return FileFormatError(self.path, f"{words}{f' (line {line})' if line else ''}: {problem}")

    def linkage(self, content: object) -> Linkage:
        if not isinstance(content, dict) or "linkage" not in content:
            known = ", ".join(_KEYS)
            raise FileFormatError(self.path, f"is no linkage file: it needs the key linkage: NAME; others are {known}")
        for key in content:
            if key not in _KEYS:
                raise self.fail((key,), str(UnknownNameError("key", key, _KEYS)))
        made: Linkage = self.say(("linkage",), Linkage, content["linkage"])
        if "gravity" in content:
            made = self.say(("gravity",), Linkage, made.name, gravity=content["gravity"])
        for point, place in self.mapping(("points",), content).items():
            self.say(("points", point), made.points, {point: self.numbers(("points", point), place)})
        self.say(("ground",), made.ground, *self.names(("ground",), content.get("ground", [])))
        for word, add in (("bars", made.bar), ("plates", made.plate), ("slides", made.slide)):
            for name, value in self.mapping((word,), content).items():
                entries = dict(value) if isinstance(value, dict) else {"points": value}
                self.link((word, name), name, entries, add)
        for k, value in enumerate(self.sequence(("masses",), content)):
            entries = self.entries(("masses", k), value, ("bar", "at", "mass"), made.mass)
            self.say(("masses", k), made.mass, entries.pop("bar"), **entries)
        for k, value in enumerate(self.sequence(("springs",), content)):
            entries = self.entries(("springs", k), value, ("between", "stiffness"), made.spring)
            ends = self.two(("springs", k, "between"), entries.pop("between"))
            self.say(("springs", k), made.spring, *ends, **entries)
        for k, value in enumerate(self.sequence(("gears",), content)):
            entries = self.entries(("gears", k), value, ("between", "ratio"), made.gear)
            ends = self.two(("gears", k, "between"), entries.pop("between"))
            self.say(("gears", k), made.gear, *ends, **entries)
        for k, value in enumerate(self.sequence(("motors",), content)):
            found = _MOTOR.fullmatch(value.strip()) if isinstance(value, str) else None
            if found is None:
                raise self.fail(("motors", k), f"{value!r} must read like 'crank at A', or 'slider'")
            words = {word: name for word, name in found.groupdict().items() if name}
            self.say(("motors", k), made.motor, words.pop("link"), **words)
        for where, error in unknown_names(made.sketch, made.links, made.gears, made.motors):
            raise self.fail(where, str(error))
        return made

    def link(self, where: tuple[Key, ...], name: str, entries: dict[Any, Any], add: Callable[..., None]) -> None:
        entries = self.entries(where, entries, ("points",), add)
        points = self.names((*where, "points"), entries.pop("points"))
        if "places" in entries:
            inner = (*where, "places")
            entries["places"] = {p: self.numbers((*inner, p), z) for p, z in self.mapping(inner, entries).items()}
        self.say(where, add, name, *points, **entries)

    def entries(self, where: tuple[Key, ...], value: object, needed: tuple[str, ...], add: Callable[..., None]) -> Any:
        """Return what one thing is said to be, by the words that the method takes; numbers as numbers."""
        if not isinstance(value, dict):
            raise self.fail(where, f"must map words to values, such as {needed[0]}: ...")
        words = inspect.signature(add).parameters.values()
        known = (*needed, *(p.name for p in words if p.kind is p.KEYWORD_ONLY and p.name not in needed))
        out: dict[str, Any] = {}
        for key, entry in value.items():
            word = "on" if key is True else key  # YAML takes a bare `on` for a truth value
            if word not in known:
                raise self.fail((*where, key), str(UnknownNameError("key", word, known)))
            out[word] = entry if word in _TEXTS else self.value((*where, key), entry)
        for word in needed:
            if word not in out:
                raise self.fail(where, f"{word} is missing")
        return out

    def value(self, where: tuple[Key, ...], entry: object) -> Any:
        return self.numbers(where, entry) if isinstance(entry, list) else self.number(where, entry)

    def number(self, where: tuple[Key, ...], entry: object) -> float:
        """Return a number; YAML reads 1e-3 (no point) as text, which is taken as the number it is."""
        degrees = _DEGREES.fullmatch(entry.strip()) if isinstance(entry, str) else None
        text: Any = degrees["number"] if degrees else entry
        try:
            if isinstance(text, bool):
                raise ValueError
            return math.radians(float(text)) if degrees else float(text)
        except (TypeError, ValueError, OverflowError):
            raise self.fail(where, f"{str(entry)[:40]!r} must be a number") from None

    def numbers(self, where: tuple[Key, ...], value: object) -> list[float]:
        if not isinstance(value, list):
            raise self.fail(where, f"{str(value)[:40]!r} must be a list of numbers, such as [0.1, 0.2]")
        return [self.number((*where, k), entry) for k, entry in enumerate(value)]

    def names(self, where: tuple[Key, ...], value: object) -> list[str]:
        if not isinstance(value, list) or not all(isinstance(x, str) for x in value):
            raise self.fail(where, f"{str(value)[:40]!r} must be a list of names, such as [A, B]; quote numbers")
        return value

    def two(self, where: tuple[Key, ...], value: object) -> list[str]:
        names = self.names(where, value)
        if len(names) != 2:
            raise self.fail(where, f"{str(value)[:40]!r} must be two names")
        return names

    def mapping(self, where: tuple[Key, ...], holder: dict[Any, Any]) -> dict[str, Any]:
        value = holder.get(where[-1]) or {}
        if not isinstance(value, dict) or not all(isinstance(key, str) for key in value):
            raise self.fail(where, "must map names to values; quote names that YAML takes for something else")
        return value

    def sequence(self, where: tuple[Key, ...], holder: dict[Any, Any]) -> list[Any]:
        value = holder.get(where[-1]) or []
        if not isinstance(value, list):
            raise self.fail(where, "must be a list: each entry after a dash, or all in brackets")
        return value

    def say(self, where: tuple[Key, ...], do: Callable[..., Any], *given: object, **named: object) -> Any:
        """Say a part to the linkage; what is wrong with it is told with its place in the file."""
        try:
            return do(*given, **named)
        except FiveBarPinError as error:
            raise self.fail(where, str(error)) from error
        except TypeError as error:  # too few or too many names
            raise self.fail(where, f"cannot be understood ({error})") from error


_TEXTS = ("points", "between", "bar", "at", "carrier", "on", "places")
"""Words whose values are names, or mappings that are read on their own."""


def _line_of(path: Path, where: tuple[Key, ...]) -> int:
    """Return the line (from 1) that a key of the file stands on, 0 where it is not found."""
    import yaml

    node, line = yaml.compose(read_bounded(path, MAX_SIDECAR_BYTES).decode("utf-8"), Loader=yaml.SafeLoader), 0
    for key in where:
        if isinstance(node, yaml.MappingNode):
            found = [(k, v) for k, v in node.value if k.value == ("on" if key is True else str(key))]
            if not found:
                break
            line, node = found[0][0].start_mark.line + 1, found[0][1]
        elif isinstance(node, yaml.SequenceNode) and isinstance(key, int) and key < len(node.value):
            node = node.value[key]
            line = node.start_mark.line + 1
        else:
            break
    return line
