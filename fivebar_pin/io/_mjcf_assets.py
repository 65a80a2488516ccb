"""Meshes and materials of an MJCF file."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.errors import UnknownNameError
from fivebar_pin.io._meshes import is_pointer
from fivebar_pin.io._mjcf_include import element_key
from fivebar_pin.io._mjcf_reader import MjcfReader, quaternion_matrix

__all__ = ["Assets", "Mesh"]

_RULES = ("convex", "exact", "legacy", "shell")


@dataclass(frozen=True)
class Mesh:
    """A mesh asset; its points are scale * (R^T (point - position)), point by point of the file.

    Attributes:
        file: where it is read from, None for points in the MJCF file itself.
        scale: per axis (3,).
        position, R: refpos [m] and refquat, as a rotation (3, 3).
        inertia: "convex", "exact", "legacy" or "shell".
        vertices, faces: inline points (n, 3) [m] and triangles (k, 3); None without.
    """

    file: Path | None
    scale: Array
    position: Array
    R: Array
    inertia: str
    vertices: Array | None
    faces: Array | None

    @cached_property
    def missing(self) -> str:
        """Why nothing can be read or drawn, "" where it can."""
        if self.file is None:
            return "" if self.vertices is not None else "has no file and no points"
        if not os.path.isfile(self.file):
            return "cannot be read (there is no such file)"
        try:
            pointer = is_pointer(self.file)
        except OSError as error:
            return f"cannot be read ({error.strerror or error})"
        return "is a git-lfs pointer, not the mesh; run git lfs pull" if pointer else ""


class Assets:
    """What geoms refer to by name.

    Attributes:
        meshes: by name.
        materials: their colours (r, g, b, a).
    """

    def __init__(self, reader: MjcfReader, root: ElementTree.Element) -> None:
        self.reader = reader
        self.meshes: dict[str, Mesh] = {}
        self.materials: dict[str, tuple[float, ...]] = {}
        for element in root.findall("asset/mesh"):
            name = element.get("name") or Path(element.get("file", "")).stem
            if name in self.meshes:
                raise reader.fail(f"mesh {name!r}", "is defined twice")
            self.meshes[name] = self.mesh(reader.with_defaults(element, None), element_key(element))
        for element in root.findall("asset/material"):
            full, where = reader.with_defaults(element, None), element_key(element)
            self.materials[element.get("name", "")] = tuple(reader.numbers(full, "rgba", 4, where, [1.0] * 4))

    def mesh(self, element: ElementTree.Element, where: str) -> Mesh:
        reader = self.reader
        rule = element.get("inertia", "legacy")
        if rule not in _RULES:
            raise reader.fail(where, str(UnknownNameError("inertia", rule, _RULES)))
        quaternion = np.array(reader.numbers(element, "refquat", 4, where, [1.0, 0.0, 0.0, 0.0]))
        points, corners = (
            np.array([reader.number(x, word, where) for x in element.get(word, "").split()])
            for word in ("vertex", "face")
        )
        if points.size % 3 or corners.size % 3:
            raise reader.fail(where, "vertex and face must hold three numbers for each point and triangle")
        if np.any(corners < 0) or np.any(corners >= points.size // 3) or np.any(corners % 1.0):
            raise reader.fail(where, f"face must name points by whole numbers from 0 to {points.size // 3 - 1}")
        return Mesh(
            self.file(element, where),
            np.array(reader.numbers(element, "scale", 3, where, [1.0, 1.0, 1.0])),
            np.array(reader.numbers(element, "refpos", 3, where, [0.0, 0.0, 0.0])),
            quaternion_matrix(reader.unit(quaternion, "refquat", where)),
            rule,
            points.reshape(-1, 3) if points.size else None,
            corners.reshape(-1, 3).astype(int) if corners.size else None,
        )

    def file(self, element: ElementTree.Element, where: str) -> Path | None:
        """Return the file of a mesh: in the mesh folder beside the first file, else beside the file that names it."""
        name = element.get("file", "").replace("\\", "/")
        if not name:
            return None
        if self.reader.compiler.get("strippath") == "true":
            name = Path(name).name
        compiler = self.reader.compiler
        file = self.reader.path.parent / compiler.get("meshdir", compiler.get("assetdir", "")) / name
        beside = self.reader.sources.get(where, self.reader.path).parent / name
        return beside if not os.path.isfile(file) and os.path.isfile(beside) else file

    def find(self, geom: ElementTree.Element, where: str) -> Mesh:
        """Return the mesh that a geom names."""
        name = geom.get("mesh", "")
        if name not in self.meshes:
            raise self.reader.fail(where, str(UnknownNameError("mesh", name, self.meshes)))
        return self.meshes[name]

    def colour(self, geom: ElementTree.Element, where: str) -> tuple[float, ...]:
        """Return the colour of a geom: its own where that is not MuJoCo's grey, else that of its material."""
        grey = [0.5, 0.5, 0.5, 1.0]
        own, material = self.reader.numbers(geom, "rgba", 4, where, grey), geom.get("material")
        if material is None:
            return tuple(own)
        if material not in self.materials:
            raise self.reader.fail(where, str(UnknownNameError("material", material, self.materials)))
        return self.materials[material] if own == grey else tuple(own)
