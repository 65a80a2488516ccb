"""The sections of an MJCF file: what is read, what does not move a mechanism and is noted, what is refused by name."""

from __future__ import annotations

from xml.etree import ElementTree

from fivebar_pin.errors import UnknownNameError
from fivebar_pin.io._mjcf_reader import MjcfReader

__all__ = ["check_sections", "gravity"]

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
_OFF = ("constraint", "equality", "spring", "damper", "passive", "frictionloss")
"""Flags that, disabled, take forces away."""


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
    option, flags = reader.merged(root.findall("option")), reader.merged(root.findall("option/flag"))
    for word in _OFF:
        if flags.get(word) == "disable":
            raise reader.fail(
                "<flag>", f"{word} is disabled, but it acts on the mechanism; remove the flag or the {word}"
            )
    fluid = [
        word
        for word in ("density", "viscosity", "wind")
        if any(reader.number(x, word, "<option>") for x in option.get(word, "").split())
    ]
    if fluid:
        reader.left_out.append(f"{' and '.join(fluid)} of the fluid around it")


def gravity(reader: MjcfReader, root: ElementTree.Element) -> tuple[float, ...]:
    """Return the gravity of a file [m/s2]."""
    if reader.merged(root.findall("option/flag")).get("gravity") == "disable":
        return (0.0, 0.0, 0.0)
    option = ElementTree.Element("option", reader.merged(root.findall("option")))
    return tuple(reader.numbers(option, "gravity", 3, "<option>", [0.0, 0.0, -9.81]))
