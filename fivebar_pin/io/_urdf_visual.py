"""Shapes and colours of a URDF."""

from __future__ import annotations

from xml.etree import ElementTree

from fivebar_pin.chain import Visual
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.io._meshes import find_file
from fivebar_pin.io._urdf_pose import pose
from fivebar_pin.io._xml import Reader

__all__ = ["Colours", "read_colours", "read_visual"]

_SHAPES = ("box", "capsule", "cylinder", "sphere", "mesh")
_GREY = (0.6, 0.6, 0.65, 1.0)
Colours = dict[str, tuple[float, float, float, float]]


def read_colours(reader: Reader, robot: ElementTree.Element) -> Colours:
    colours: Colours = {}
    for material in robot.findall("material"):
        colour = material.find("color")
        if colour is not None and material.get("name"):
            colours[str(material.get("name"))] = _rgba(reader, colour, f"material {material.get('name')!r}")
    return colours


def _rgba(reader: Reader, colour: ElementTree.Element, where: str) -> tuple[float, float, float, float]:
    r, g, b, a = reader.numbers(colour, "rgba", 4, where, None)
    return r, g, b, a


def read_visual(reader: Reader, element: ElementTree.Element, link: str, colours: Colours) -> Visual:
    where = f"visual of link {link!r}"
    geometry = reader.only(element, "geometry", where)
    if geometry is None or len(geometry) != 1:
        raise reader.fail(where, "needs one <geometry> with one shape in it")
    shape = geometry[0]
    mesh = ""
    if shape.tag == "box":
        size = reader.numbers(shape, "size", 3, where, None)
    elif shape.tag in ("cylinder", "capsule"):
        size = [*reader.numbers(shape, "radius", 1, where, None), *reader.numbers(shape, "length", 1, where, None)]
    elif shape.tag == "sphere":
        size = reader.numbers(shape, "radius", 1, where, None)
    elif shape.tag == "mesh":
        mesh = find_file(reader.path, reader.text(shape, "filename", where))
        size = reader.numbers(shape, "scale", 3, where, [1.0, 1.0, 1.0])
    else:
        raise reader.fail(where, str(UnknownNameError("shape", shape.tag, _SHAPES)))
    material = element.find("material")
    rgba = _GREY
    if material is not None:
        colour = material.find("color")
        known = colours.get(material.get("name") or "", _GREY)
        rgba = known if colour is None else _rgba(reader, colour, where)
    placement = pose(reader, element, where)
    try:
        return Visual(link, shape.tag, tuple(size), placement, rgba, mesh)
    except InvalidInputError as error:
        raise reader.fail(where, str(error)) from error
