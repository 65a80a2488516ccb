"""The sections of an MJCF file: what is read, what does not move a mechanism and is noted, what is refused by name."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree import ElementTree

from fivebar_pin.errors import UnknownNameError
from fivebar_pin.io._mjcf_reader import MjcfReader

__all__ = ["check_disabled", "check_sections", "disabled", "gravity"]

_SECTIONS = (
    "actuator", "asset", "compiler", "contact", "custom", "default", "deformable", "equality", "extension", "keyframe",
    "option", "sensor", "size", "statistic", "tendon", "visual", "worldbody",
)  # fmt: skip
_LEFT_OUT = {
    "asset/hfield": "height field asset",
    "asset/skin": "skin",
    "asset/texture": "texture",
    "contact/exclude": "contact exclusion",
    "contact/pair": "contact pair",
    "deformable/skin": "skin",
    "extension/plugin": "plugin",
    "sensor/*": "sensor",
}
_OFF = {
    "constraint": ("equality", "frictionloss"),
    "passive": ("spring", "damper"),
    **{word: (word,) for word in ("equality", "frictionloss", "spring", "damper")},
}
"""Flags that, disabled, take forces away: which ones."""


def check_sections(reader: MjcfReader, root: ElementTree.Element) -> None:
    """Refuse unknown sections and settings that would change the mechanism; note what does not move it."""
    for section in root:
        if section.tag not in _SECTIONS:
            raise reader.fail("<mujoco>", str(UnknownNameError("section", section.tag, _SECTIONS)))
    for path, noun in _LEFT_OUT.items():
        reader.left_out += [noun] * len(root.findall(path))
    for element in root.findall("deformable/flex"):
        raise reader.fail(f"flex {element.get('name', '')!r}", "deformable bodies are not supported")
    reader.check_known(ElementTree.Element("compiler", reader.compiler), "<compiler>")
    if reader.compiler.get("coordinate", "local") != "local":
        raise reader.fail("<compiler>", "global coordinates are not supported; write local ones")
    if reader.compiler.get("inertiafromgeom", "auto") not in ("auto", "true", "false"):
        raise reader.fail("<compiler>", "inertiafromgeom must be auto, true or false")
    option = reader.merged(root.findall("option"))
    fluid = [
        word
        for word in ("density", "viscosity", "wind")
        if any(reader.number(x, word, "<option>") for x in option.get(word, "").split())
    ]
    if fluid:
        reader.left_out.append(f"{' and '.join(fluid)} of the fluid around it")


def disabled(reader: MjcfReader, root: ElementTree.Element) -> set[str]:
    """Return which forces the flags take away, of equality, frictionloss, spring and damper."""
    flags = reader.merged(root.findall("option/flag"))
    return {force for word, forces in _OFF.items() if flags.get(word) == "disable" for force in forces}


def check_disabled(reader: MjcfReader, root: ElementTree.Element, acting: Mapping[str, bool]) -> None:
    """Refuse flags that take away forces that the file states elsewhere; `acting` tells which act, by name."""
    for force in sorted(disabled(reader, root)):
        if acting.get(force):
            raise reader.fail("<flag>", f"{force} is disabled, but the file states it; remove the flag or the {force}")


def gravity(reader: MjcfReader, root: ElementTree.Element) -> tuple[float, ...]:
    """Return the gravity of a file [m/s2]."""
    if reader.merged(root.findall("option/flag")).get("gravity") == "disable":
        return (0.0, 0.0, 0.0)
    option = ElementTree.Element("option", reader.merged(root.findall("option")))
    return tuple(reader.numbers(option, "gravity", 3, "<option>", [0.0, 0.0, -9.81]))
