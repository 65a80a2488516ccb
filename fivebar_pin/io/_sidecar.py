"""The sidecar beside a URDF or SDF: which frames close loops, which joints are driven, and what URDF cannot say.

Keys that example-parallel-robots uses: ``closed_loop``, ``type``, ``name_mot``, ``joint_name``, ``joint_type``.
Ours, written only when needed: ``closure_name`` and what the kinds of closure state of themselves (``axis``,
``length``, ``ratio``, ``offset``), one entry per closure; ``gravity``, ``joint_order``, ``joint_data`` (per joint:
armature, limits and losses of joints with several coordinates), ``reference_configurations``, ``springs`` (each with
``frames``, ``stiffness``, ``length`` or ``joint``, ``stiffness``, ``rest``, and ``damping`` where it has some) and
``parameters`` (named lengths and what follows them, see `_geometry`), ``closure_tolerance`` (how far loops of rounded
dimensions may stay open). ``closed_loop`` names two frames, for a coupling any number of joints, whose ratios stand in
the same order:

    closed_loop: [[tip_left, tip_right], [rod_end, slider], [wheel, crank]]
    type: [3d, distance, coupling]
    length: [null, 0.7, null]
    ratio: [null, null, [1.0, 3.7]]
    offset: [null, null, 0.2]
    name_mot: [crank]
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from fivebar_pin._files import read_bounded
from fivebar_pin.chain import Geometry
from fivebar_pin.closures import Closure
from fivebar_pin.closures.closure import Entry
from fivebar_pin.errors import FileFormatError, FiveBarPinError, UnknownNameError
from fivebar_pin.io._geometry import geometry_entries, read_geometry
from fivebar_pin.io._xml import HUGE, UNLIMITED
from fivebar_pin.springs import JointSpring, Spring

__all__ = [
    "DATA_FIELDS",
    "DATA_WORDS",
    "JOINT_WORDS",
    "UNIVERSAL",
    "Sidecar",
    "dump_sidecar",
    "plain_yaml",
    "read_sidecar",
]

MAX_SIDECAR_BYTES = 1024 * 1024
MAX_DEPTH = 20

UNIVERSAL = {
    "CARDAN": "XY",
    **{f"UJOINT_{a}{b}": a + b for a in "XYZ" for b in "XYZ" if a != b},
}
"""Joints of two hinges, and the axes of the joint's own frame that these turn about, one after the other."""

JOINT_WORDS = ("SPHERICAL", "SPHERICAL_ZYX", "TRANSLATION", "FIXED", *UNIVERSAL)
"""Joint types a sidecar can give to a joint of the URDF."""

DATA_FIELDS = {
    "armature": "armature",
    "damping": "damping",
    "effort": "upperEffortLimit",
    "effort_lower": "lowerEffortLimit",
    "friction": "upperDryFrictionLimit",
    "gear_ratio": "rotorGearRatio",
    "lower": "lowerPositionLimit",
    "rotor_inertia": "rotorInertia",
    "upper": "upperPositionLimit",
    "velocity": "upperVelocityLimit",
}
DATA_WORDS = tuple(DATA_FIELDS)
"""What ``joint_data`` can state of a joint, and the field of pin.Model that holds it."""

_KEYS = (
    "closed_loop", "type", "name_mot", "joint_name", "joint_type", "closure_name", "gravity", "joint_order",
    "joint_data", "reference_configurations", "springs", "parameters", "closure_tolerance",
)  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Sidecar:
    """What a sidecar says, checked as far as it can be without the tree."""

    closures: tuple[Closure, ...] = ()
    actuated: tuple[str, ...] = ()
    joint_types: Mapping[str, str] = field(default_factory=dict)
    gravity: tuple[float, ...] | None = None
    joint_order: tuple[str, ...] | None = None
    joint_data: Mapping[str, Mapping[str, list[float]]] = field(default_factory=dict)
    configurations: Mapping[str, list[float]] = field(default_factory=dict)
    springs: tuple[Spring | JointSpring, ...] = ()
    geometry: Geometry = field(default_factory=Geometry)
    closure_tolerance: float = 0.0


def read_sidecar(path: Path, *, max_bytes: int = MAX_SIDECAR_BYTES) -> Sidecar:
    """Return what the sidecar says.

    Raises:
        FileFormatError: not YAML of plain values, an unknown or missing key, or a value of the wrong type.
    """
    return _Check(path).sidecar(plain_yaml(path, max_bytes))


def dump_sidecar(sidecar: Sidecar) -> str:
    """Return the YAML text; every number reads back exactly."""
    import yaml

    closures = sidecar.closures
    content: dict[str, Any] = {
        "closed_loop": [list(c.joins) for c in closures],
        "type": [c.kind.value for c in closures],
        "name_mot": list(sidecar.actuated),
    }
    if sidecar.joint_types:
        content["joint_name"] = list(sidecar.joint_types)
        content["joint_type"] = list(sidecar.joint_types.values())
    values = [c.values() for c in closures]
    content |= {key: [v.get(key) for v in values] for key in _closure_keys() if any(key in v for v in values)}
    if any(c.name != "~".join(c.joins) for c in closures):
        content["closure_name"] = [c.name for c in closures]
    if sidecar.closure_tolerance:
        content["closure_tolerance"] = sidecar.closure_tolerance
    if sidecar.gravity is not None:
        content["gravity"] = _floats(sidecar.gravity)
    if sidecar.joint_order is not None:
        content["joint_order"] = list(sidecar.joint_order)
    if sidecar.joint_data:
        content["joint_data"] = {j: {k: _floats(v) for k, v in d.items()} for j, d in sidecar.joint_data.items()}
    if sidecar.configurations:
        content["reference_configurations"] = {k: _floats(v) for k, v in sidecar.configurations.items()}
    if sidecar.springs:
        content["springs"] = [_spring(s) for s in sidecar.springs]
    if sidecar.geometry.parameters:
        content["parameters"] = geometry_entries(sidecar.geometry)
    return "".join(
        yaml.safe_dump({key: value}, default_flow_style=True, width=10**6, allow_unicode=True).strip()[1:-1] + "\n"
        for key, value in content.items()
    )


def _closure_keys() -> tuple[str, ...]:
    """Return the keys that some kind of closure states of itself, each once."""
    return tuple(dict.fromkeys(entry.key for kind in Closure.family.values() for entry in kind.entries))


def _floats(values: Any) -> list[float]:
    return [float(v) for v in values]


def _spring(spring: Spring | JointSpring) -> dict[str, Any]:
    """Return the plain entry of a spring, without a damping of zero."""
    ends: dict[str, Any] = {"frames": [spring.frame1, spring.frame2]} if isinstance(spring, Spring) else {}
    rest = {f.name: getattr(spring, f.name) for f in fields(spring) if f.name not in ("frame1", "frame2")}
    entry = ends | {word: x if isinstance(x, str) else float(x) for word, x in rest.items()}
    return entry if spring.damping else {word: x for word, x in entry.items() if word != "damping"}


def plain_yaml(path: Path, max_bytes: int) -> object:
    """Return the one document of a YAML file, without aliases, tags, doubled keys or deep nests."""
    import yaml

    class Loader(yaml.SafeLoader):
        depth = 0

        def compose_node(self, parent: Any, index: Any) -> Any:
            if self.check_event(yaml.AliasEvent):
                raise FileFormatError(path, "uses YAML aliases (*name), which are not read; write the value out")
            self.depth += 1
            if self.depth > MAX_DEPTH:
                raise FileFormatError(path, f"is nested deeper than {MAX_DEPTH}")
            node = super().compose_node(parent, index)
            self.depth -= 1
            return node

        def construct_mapping(self, node: Any, deep: bool = False) -> Any:
            keys = [key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode)]
            doubled = {key for key in keys if keys.count(key) > 1} if len(keys) < 1000 else set()
            if doubled or len(keys) >= 1000:
                lines = [key.start_mark.line + 1 for key, _ in node.value if getattr(key, "value", None) in doubled]
                where = f" (lines {', '.join(map(str, lines[:5]))})" if doubled else ""
                raise FileFormatError(path, f"states {sorted(doubled)[:5] or 'too many keys'} more than once{where}")
            return super().construct_mapping(node, deep)

    text = read_bounded(path, max_bytes)
    try:
        return yaml.load(text.decode("utf-8"), Loader=Loader)
    except UnicodeDecodeError as error:
        raise FileFormatError(path, f"is not UTF-8 text ({error})") from error
    except (yaml.YAMLError, ValueError, TypeError, AttributeError, RecursionError, OverflowError, LookupError) as error:
        raise FileFormatError(path, "is not plain YAML (" + " ".join(str(error).split()) + ")") from error


class _Check:
    """Turns plain YAML values into a `Sidecar`, naming the key that is wrong."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def fail(self, key: str, problem: str) -> FileFormatError:
        return FileFormatError(self.path, f"{key}: {problem}")

    def sidecar(self, content: object) -> Sidecar:
        if not isinstance(content, dict):
            raise FileFormatError(self.path, f"holds {_kind(content)}; expected the keys closed_loop, type, name_mot")
        known = (*_KEYS, *_closure_keys())
        for key in content:
            if key not in known:
                raise FileFormatError(self.path, str(UnknownNameError("sidecar key", key, known)))
        for key in ("closed_loop", "type", "name_mot"):
            if key not in content:
                raise self.fail(key, "is missing; write an empty list [] if there are none")
        gravity, order = content.get("gravity"), content.get("joint_order")
        return Sidecar(
            closures=self.closures(content),
            actuated=tuple(self.names("name_mot", content["name_mot"])),
            joint_types=self.joint_types(content),
            gravity=None if gravity is None else tuple(self.numbers("gravity", gravity, 3)),
            joint_order=None if order is None else tuple(self.names("joint_order", order)),
            joint_data=self.joint_data(content.get("joint_data")),
            configurations=self.configurations(content.get("reference_configurations")),
            springs=self.springs(content.get("springs")),
            geometry=read_geometry(self, content.get("parameters")),
            closure_tolerance=self.numbers("closure_tolerance", [content.get("closure_tolerance", 0.0)], 1)[0],
        )

    def closures(self, content: dict[str, Any]) -> tuple[Closure, ...]:
        loops = self.sequence("closed_loop", content["closed_loop"])
        n = len(loops)
        kinds = self.names("type", content["type"], n)
        names = self.names("closure_name", content.get("closure_name") or [""] * n, n)
        stated = {key: self.sequence(key, content.get(key) or [None] * n, n) for key in _closure_keys()}
        closures = []
        for k, (loop, word, name) in enumerate(zip(loops, kinds, names, strict=True)):
            where = f"closed_loop[{k}]"
            try:
                kind = Closure.of_kind(word)
                joins = self.names(where, loop, kind.joined)
                values = {e.key: self.entry(e, stated[e.key][k], k, len(joins)) for e in kind.entries}
                given = {key: value for key, value in values.items() if value is not None}
                closures.append(kind.of_entry(joins, given, name))
            except FileFormatError:
                raise
            except FiveBarPinError as error:
                raise self.fail(where, str(error)) from error
        return tuple(closures)

    def entry(self, entry: Entry, value: object, k: int, joined: int) -> float | list[float] | None:
        """Return what a key states of closure k, which joins so many things."""
        where = f"{entry.key}[{k}]"
        if value is None:
            if entry.needed:
                raise self.fail(where, f"is missing; {entry.needed}")
            return None
        if entry.size is None:
            return self.numbers(where, [value], 1)[0]
        return self.numbers(where, value, entry.size or joined)

    def joint_types(self, content: dict[str, Any]) -> dict[str, str]:
        names = self.names("joint_name", content.get("joint_name") or [])
        words = self.names("joint_type", content.get("joint_type") or [], len(names))
        if len(set(names)) != len(names):
            raise self.fail("joint_name", "names a joint twice")
        for word in words:
            if word.upper() not in JOINT_WORDS:
                raise self.fail("joint_type", str(UnknownNameError("joint type", word, JOINT_WORDS)))
        return {name: word.upper() for name, word in zip(names, words, strict=True)}

    def joint_data(self, value: object) -> dict[str, dict[str, list[float]]]:
        result: dict[str, dict[str, list[float]]] = {}
        for joint, entries in self.mapping("joint_data", value).items():
            where = f"joint_data of {joint}"
            result[joint] = {}
            for word, numbers in self.mapping(where, entries).items():
                if word not in DATA_WORDS:
                    raise self.fail(where, str(UnknownNameError("joint data", word, DATA_WORDS)))
                result[joint][word] = self.numbers(f"{where}, {word}", numbers, bound=UNLIMITED)
        return result

    def configurations(self, value: object) -> dict[str, list[float]]:
        mapping = self.mapping("reference_configurations", value)
        return {name: self.numbers(f"reference_configurations of {name}", q) for name, q in mapping.items()}

    def springs(self, value: object) -> tuple[Spring | JointSpring, ...]:
        entries = [] if value is None else self.sequence("springs", value)
        return tuple(self.spring(f"springs[{k}]", entry) for k, entry in enumerate(entries))

    def spring(self, key: str, value: object) -> Spring | JointSpring:
        entry = self.mapping(key, value)
        on_joint = "joint" in entry
        place = "rest" if on_joint else "length"
        words = ("joint" if on_joint else "frames", "stiffness", place, "damping")
        for word in entry:
            if word not in words:
                raise self.fail(key, str(UnknownNameError("spring data", word, words)))
        for word in words[:3]:
            if word not in entry:
                raise self.fail(
                    key, f"{word} is missing; a spring needs frames, stiffness, length or joint, stiffness, rest"
                )
        k, at, c = (
            self.numbers(f"{key}, {word}", [entry.get(word, 0.0)], 1)[0] for word in ("stiffness", place, "damping")
        )
        try:
            if on_joint:
                return JointSpring(self.names(f"{key}, joint", [entry["joint"]])[0], k, at, c)
            first, second = self.names(f"{key}, frames", entry["frames"], 2)
            return Spring(first, second, k, at, c)
        except FileFormatError:
            raise
        except FiveBarPinError as error:
            raise self.fail(key, str(error)) from error

    def mapping(self, key: str, value: object) -> dict[str, Any]:
        if value is None:
            return {}
        if not isinstance(value, dict) or not all(isinstance(k, str) for k in value):
            raise self.fail(key, f"must map names to values, is {_kind(value)}")
        return value

    def sequence(self, key: str, value: object, count: int | None = None) -> list[Any]:
        if not isinstance(value, list):
            raise self.fail(key, f"must be a list, is {_kind(value)}")
        if count is not None and len(value) != count:
            raise self.fail(key, f"has {len(value)} entries; expected {count}")
        return value

    def names(self, key: str, value: object, count: int | None = None) -> list[str]:
        entries = self.sequence(key, value, count)
        for entry in entries:
            if not isinstance(entry, str):
                raise self.fail(key, f"{entry!r} must be a name (text); put it in quotes")
        return entries

    def numbers(self, key: str, value: object, count: int | None = None, *, bound: float = HUGE) -> list[float]:
        result = []
        for entry in self.sequence(key, value, count):
            number = _number(entry)
            if number is None or not abs(number) <= bound:
                raise self.fail(key, f"{str(entry)[:40]!r} must be a finite number of sensible size")
            result.append(number)
        return result


def _number(entry: object) -> float | None:
    """Return a number; YAML 1.1 reads 1e-3 (no point) as text, which is taken as the number it is."""
    if isinstance(entry, bool) or not isinstance(entry, (int, float, str)):
        return None
    try:
        return float(entry)
    except (ValueError, OverflowError):
        return None


def _kind(value: object) -> str:
    return "nothing" if value is None else f"a {type(value).__name__}"
