"""What is drawn of MJCF geoms: those of the groups 0 to 2, as MuJoCo draws them."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.chain import Visual
from fivebar_pin.errors import FiveBarPinError
from fivebar_pin.io._mjcf_assets import Assets, Mesh
from fivebar_pin.io._mjcf_mass import geom_shape
from fivebar_pin.io._mjcf_reader import MjcfReader, homogeneous

__all__ = ["geom_visual"]

_DRAWN = (0, 1, 2)
_UNDRAWN = {"plane": "plane", "hfield": "height field", "ellipsoid": "ellipsoid shape", "sdf": "distance field"}
_READ = (".dae", ".obj", ".stl")
_TURNED = 1e-12  # entry of a rotation between axes that are scaled differently, below which it is none [-]


def geom_visual(reader: MjcfReader, assets: Assets, geom: ElementTree.Element, link: str, where: str) -> list[Visual]:
    """Return what is drawn of a geom with its defaults; what a chain cannot draw is noted as left out."""
    colour = assets.colour(geom, where)
    mesh = assets.find(geom, where) if "mesh" in geom.attrib else None
    drawn = reader.numbers(geom, "group", 1, where, [0.0])[0] in _DRAWN
    if mesh is not None and not drawn:
        return []  # no need to read it
    try:
        kind, sizes, M = geom_shape(reader, assets, geom, where)
    except ValueError as error:
        if isinstance(error, FiveBarPinError):
            raise
        _note(reader, f"mesh {geom.get('mesh')!r}, which {error}")
        return []
    if not drawn:
        return []
    if kind in _UNDRAWN and mesh is None:
        reader.left_out.append(_UNDRAWN[kind])
        return []
    if kind in ("mesh", "sdf") and mesh is not None:
        placed = _placed(mesh)
        why = mesh.missing or _why_undrawn(mesh, placed)
        if why or placed is None:
            _note(reader, f"mesh {geom.get('mesh')!r}, which {why}")
            return []
        return [Visual(link, "mesh", tuple(mesh.scale), M @ placed, colour, str(mesh.file))]  # type: ignore[arg-type]
    if kind == "box":
        sizes = [2.0 * s for s in sizes]
    elif kind != "sphere":
        sizes = [sizes[0], 2.0 * sizes[1]]
    return [Visual(link, kind, tuple(sizes), M, colour)]  # type: ignore[arg-type]


def _why_undrawn(mesh: Mesh, placed: Array | None) -> str:
    """Return why a mesh that can be read is not drawn, "" where it is."""
    if mesh.file is None:
        return "has no file and is not drawn"
    if mesh.file.suffix.lower() not in _READ:
        return f"is not drawn: of {', '.join(_READ)} files alone"
    return "" if placed is not None else "is scaled along turned axes and not drawn"


def _placed(mesh: Mesh) -> Array | None:
    """Return the pose of the scaled mesh, S R^T (x - p) = R^T S x - S R^T p; None where S and R do not commute."""
    S, R = np.diag(mesh.scale), mesh.R.T
    if np.abs(S @ R - R @ S).max() > _TURNED * np.abs(mesh.scale).max():
        return None
    return homogeneous(-S @ R @ mesh.position, R)


def _note(reader: MjcfReader, what: str) -> None:
    if what not in reader.left_out:
        reader.left_out.append(what)
