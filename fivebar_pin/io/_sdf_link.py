"""Links of an SDF model: mass, moments and shapes."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from fivebar_pin.chain import Visual
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.io._build import stated_inertia
from fivebar_pin.io._entries import LinkEntry
from fivebar_pin.io._meshes import find_file
from fivebar_pin.io._sdf_frames import Frames, Thing, relative, stated_frame
from fivebar_pin.io._sdf_pose import read_pose, text_numbers
from fivebar_pin.io._xml import Reader

__all__ = ["read_link"]

_IN_LINK = (
    "pose", "inertial", "visual", "collision", "gravity", "self_collide", "kinematic", "must_be_base_link",
    "enable_wind", "velocity_decay", "sensor",
)  # fmt: skip
_TENSOR = {"ixx": 1.0, "ixy": 0.0, "ixz": 0.0, "iyy": 1.0, "iyz": 0.0, "izz": 1.0}
"""Moments of inertia, and what SDF says they are where a file does not [kg m2]."""
_GREY = [0.6, 0.6, 0.65, 1.0]
_SIZES = {"box": (("size", 3),), "sphere": (("radius", 1),), "mesh": ()} | dict.fromkeys(
    ("cylinder", "capsule"), (("radius", 1), ("length", 1))
)


def read_link(reader: Reader, frames: Frames, thing: Thing) -> tuple[LinkEntry, list[str]]:
    """Return a link, and what of it the mechanism goes without."""
    where = f"link {thing.name!r}"
    reader.no_misspelt(thing.element, where, tags=_IN_LINK)
    inertial = reader.only(thing.element, "inertial", where)
    visuals, told = [], [f"{element.tag} element" for element in thing.element if element.tag not in _IN_LINK]
    told += ["sensor"] * len(thing.element.findall("sensor"))
    if thing.element.findtext("gravity", "1").strip() in ("0", "false"):
        told.append(f"absence of gravity on link {thing.name!r}")
    for element in thing.element.findall("visual"):
        shape = element.find("geometry/*")
        if shape is None or shape.tag not in _SIZES:
            told.append("empty shape" if shape is None else f"{shape.tag} to draw")
        else:
            visuals.append(_visual(reader, frames, thing, element, shape))
    return LinkEntry(thing.name, _inertia(reader, inertial, where), tuple(visuals)), told


def _inertia(reader: Reader, inertial: ElementTree.Element | None, where: str) -> pin.Inertia | None:
    if inertial is not None and inertial.get("auto", "false").strip() in ("1", "true"):
        raise reader.fail(where, "inertia from collision shapes (auto) is not supported; state <mass> and <inertia>")
    reader.no_misspelt(inertial, where, tags=("pose", "mass", "inertia", "density", "fluid_added_mass"))
    (mass,) = text_numbers(reader, inertial, "mass", 1, where, [1.0])
    if mass < 0.0:
        raise reader.fail(where, f"mass = {mass!r} must not be negative [kg]")
    tensor = None if inertial is None else inertial.find("inertia")
    reader.no_misspelt(tensor, where, tags=tuple(_TENSOR))
    xx, xy, xz, yy, yz, zz = (text_numbers(reader, tensor, word, 1, where, [x])[0] for word, x in _TENSOR.items())
    I = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    M = np.eye(4) if inertial is None else read_pose(reader, inertial, where)
    if not np.array_equal(M[:3, :3], np.eye(3)):
        I = M[:3, :3] @ I @ M[:3, :3].T
        I = 0.5 * (I + I.T)
    return stated_inertia(mass, M[:3, 3], I)


def _visual(
    reader: Reader, frames: Frames, link: Thing, element: ElementTree.Element, shape: ElementTree.Element
) -> Visual:
    where = f"visual of link {link.name!r}"
    placement = read_pose(reader, element, where)
    stated = stated_frame(element)
    if stated:
        placement = relative(frames.pose(link), frames.named_pose(stated, link.scope, where) @ placement)
    size = [x for word, n in _SIZES[shape.tag] for x in text_numbers(reader, shape, word, n, where, None)]
    mesh = ""
    if shape.tag == "mesh":
        uri = (shape.findtext("uri") or "").strip()
        if not uri:
            raise reader.fail(where, "needs <uri>")
        mesh, size = find_file(reader.path, uri), text_numbers(reader, shape, "scale", 3, where, [1.0, 1.0, 1.0])
    try:
        return Visual(link.name, shape.tag, tuple(size), placement, _colour(reader, element, where), mesh)
    except InvalidInputError as error:
        raise reader.fail(where, str(error)) from error


def _colour(reader: Reader, visual: ElementTree.Element, where: str) -> tuple[float, float, float, float]:
    """Return the diffuse colour, else the ambient one; three numbers are opaque."""
    for word in ("material/diffuse", "material/ambient"):
        stated = visual.findtext(word, "").split()
        if stated:
            opaque = [reader.number(x, word, where) for x in stated]
            r, g, b, a = [*opaque, 1.0] if len(opaque) == 3 else text_numbers(reader, visual, word, 4, where, None)
            return r, g, b, a
    r, g, b, a = _GREY
    return r, g, b, a
