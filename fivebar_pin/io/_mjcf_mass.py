"""Inertia of MJCF bodies: as stated, or from the shapes of their geoms."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.errors import FiveBarPinError, UnknownNameError
from fivebar_pin.io._build import bare_inertia
from fivebar_pin.io._mjcf_assets import Assets
from fivebar_pin.io._mjcf_fit import fitted
from fivebar_pin.io._mjcf_meshes import mesh_inertia
from fivebar_pin.io._mjcf_reader import MjcfReader, homogeneous, shortest_turn

__all__ = ["geom_inertia", "geom_shape", "stated_inertia"]

SOLIDS = ("box", "capsule", "cylinder", "ellipsoid", "sphere")
WITHOUT_MASS = ("hfield", "plane")
_KINDS = (*SOLIDS, *WITHOUT_MASS, "mesh", "sdf")
_SIZES = {"box": 3, "ellipsoid": 3, "sphere": 1, "capsule": 2, "cylinder": 2}


def stated_inertia(reader: MjcfReader, inertial: ElementTree.Element, where: str) -> pin.Inertia:
    """Return the inertia that <inertial> states, in body axes."""
    reader.check_known(inertial, where)
    if "pos" not in inertial.attrib:
        raise reader.fail(where, "<inertial> needs pos")
    M = reader.pose(inertial, where)
    (mass,) = reader.numbers(inertial, "mass", 1, where, None)
    if "fullinertia" in inertial.attrib:
        for word in ("diaginertia", "quat", "axisangle", "xyaxes", "zaxis", "euler"):
            if word in inertial.attrib:
                raise reader.fail(where, f"<inertial> states fullinertia, which excludes {word}")
        xx, yy, zz, xy, xz, yz = reader.numbers(inertial, "fullinertia", 6, where, None)
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    else:
        tensor = np.diag(reader.numbers(inertial, "diaginertia", 3, where, None))
    R = M[:3, :3]
    if not np.array_equal(R, np.eye(3)):
        tensor = R @ tensor @ R.T
        tensor = 0.5 * (tensor + tensor.T)
    if mass < 0.0 or (mass == 0.0 and np.any(tensor)):
        raise reader.fail(where, f"mass = {mass!r} must be positive [kg]")
    return bare_inertia(mass, M[:3, 3], tensor)


def geom_shape(
    reader: MjcfReader, assets: Assets, geom: ElementTree.Element, where: str
) -> tuple[str, list[float], Array]:
    """Return a geom's kind, its sizes (half lengths, as MJCF has them) and its pose in the body.

    Raises:
        ValueError: it is fitted to a mesh that cannot be read; says why.
    """
    kind = geom.get("type", "mesh" if "mesh" in geom.attrib else "sphere")
    if kind not in _KINDS:
        raise reader.fail(where, str(UnknownNameError("geom type", kind, _KINDS)))
    if kind not in SOLIDS:
        return kind, [], reader.pose(geom, where)
    if "mesh" in geom.attrib:
        (scale,) = reader.numbers(geom, "fitscale", 1, where, [1.0])
        around = reader.compiler.get("fitaabb") == "true"
        sizes, M = fitted(assets.find(geom, where), kind, scale, around=around)
        return kind, sizes, reader.pose(geom, where) @ M
    count = _SIZES[kind]
    if "fromto" in geom.attrib:
        if count == 1:
            raise reader.fail(where, f"fromto is not for a {kind}")
        ends = np.array(reader.numbers(geom, "fromto", 6, where, None)).reshape(2, 3)
        sizes = _sizes(reader, geom, 1, where) * (count - 1)
        along = ends[0] - ends[1]
        length = float(np.linalg.norm(along))
        z = reader.unit(along, "fromto", where)
        M = homogeneous(0.5 * (ends[0] + ends[1]), shortest_turn(z))
        return kind, [*sizes, 0.5 * length], reader.frame(geom) @ M
    return kind, _sizes(reader, geom, count, where), reader.pose(geom, where)


def _sizes(reader: MjcfReader, geom: ElementTree.Element, count: int, where: str) -> list[float]:
    words = geom.get("size", "").split()
    if not count <= len(words) <= 3:
        raise reader.fail(where, f"size = {geom.get('size')!r} must be {count} number(s)")
    sizes = [reader.number(word, "size", where) for word in words[:count]]
    if min(sizes) <= 0.0:
        raise reader.fail(where, f"size = {sizes} must be positive [m]")
    return sizes


def geom_inertia(reader: MjcfReader, assets: Assets, geom: ElementTree.Element, where: str) -> pin.Inertia | None:
    """Return the inertia of a solid geom or a mesh in body axes, None for one without mass."""
    (density,) = reader.numbers(geom, "density", 1, where, [1000.0])
    stated = reader.numbers(geom, "mass", 1, where, [-1.0])[0] if "mass" in geom.attrib else None
    if geom.get("type") in WITHOUT_MASS or stated == 0.0 or (stated is None and density == 0.0):
        return None
    if reader.flag(geom, "shellinertia", where, "false") != "false":
        raise reader.fail(where, "shellinertia is not supported; state <inertial> in the body")
    try:
        kind, sizes, M = geom_shape(reader, assets, geom, where)
        inertia = mesh_inertia(assets.find(geom, where)) if kind in ("mesh", "sdf") else _dense(kind, sizes)
    except ValueError as error:
        if isinstance(error, FiveBarPinError):
            raise
        rule = f'has its mass from mesh {geom.get("mesh")!r}, which {error}; state <inertial> in the body, or mass="0"'
        raise reader.fail(where, rule) from error
    factor = density if stated is None else stated / inertia.mass
    if factor < 0.0:
        raise reader.fail(where, f"mass = {factor * inertia.mass!r} must not be negative [kg]")
    dense = bare_inertia(factor * inertia.mass, inertia.lever, factor * np.array(inertia.inertia))
    return pin.SE3(M).act(dense)


def _dense(kind: str, sizes: list[float]) -> pin.Inertia:
    """Return the inertia of a solid of density one."""
    volume, unit = _solid(kind, sizes)
    return bare_inertia(volume, np.zeros(3), np.diag(volume * unit))


def _solid(kind: str, sizes: list[float]) -> tuple[float, Array]:
    """Return the volume [m3] and the principal moments of inertia per mass [m2]."""
    if kind == "sphere":
        r = sizes[0]
        return 4.0 / 3.0 * np.pi * r**3, np.full(3, 0.4 * r * r)
    if kind in ("box", "ellipsoid"):
        a, b, c = (s * s for s in sizes)
        product = sizes[0] * sizes[1] * sizes[2]
        moments = np.array([b + c, a + c, a + b])
        return (8.0 * product, moments / 3.0) if kind == "box" else (4.0 / 3.0 * np.pi * product, moments / 5.0)
    r, half = sizes
    cylinder, ball = 2.0 * np.pi * r * r * half, 4.0 / 3.0 * np.pi * r**3
    across, along = r * r / 4.0 + half * half / 3.0, 0.5 * r * r
    if kind == "cylinder":
        return cylinder, np.array([across, across, along])
    volume = cylinder + ball
    across = cylinder * across + ball * (0.4 * r * r + half * half + 0.75 * half * r)
    return volume, np.array([across, across, cylinder * along + ball * 0.4 * r * r]) / volume
