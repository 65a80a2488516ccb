"""Record a meshcat scene without a server: shapes, colours and keyframes as the commands its viewer understands."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.errors import FileFormatError

if TYPE_CHECKING:
    from fivebar_pin.chain import Visual

__all__ = ["Colour", "Recorder", "along", "pose", "quaternions"]

Colour = tuple[float, float, float, float]

_FLOAT32 = 0x17
"""Extension code of a Float32Array in the viewer's message format."""


def pose(position: Array, z: Array | None = None) -> Array:
    """Return the pose (4, 4) at a position whose z axis has a given direction (any turn about it)."""
    matrix = np.eye(4)
    matrix[:3, 3] = position
    if z is not None:
        matrix[:3, :3] = along(z)
    return matrix


def along(z: Array) -> Array:
    """Return a rotation (3, 3) whose third column is the direction of z."""
    e3 = z / np.linalg.norm(z)
    e1 = np.cross(np.eye(3)[int(np.argmin(np.abs(e3)))], e3)
    e1 /= np.linalg.norm(e1)
    return np.column_stack([e1, np.cross(e3, e1), e3])


def quaternions(rotations: Array) -> Array:
    """Return x, y, z, w (k, 4) of rotations (k, 3, 3), without jumps of sign."""
    from scipy.spatial.transform import Rotation

    Q = np.asarray(Rotation.from_matrix(rotations).as_quat())
    flips = np.cumprod(np.where(np.sum(Q[1:] * Q[:-1], axis=1) < 0.0, -1.0, 1.0))
    Q[1:] *= flips[:, None]
    return Q


def _hex(rgba: Colour) -> int:
    r, g, b = (round(255 * min(max(c, 0.0), 1.0)) for c in rgba[:3])
    return (r << 16) | (g << 8) | b


def _meshcat() -> Any:
    """Return meshcat, imported without the deprecation warnings of what it imports in turn."""
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        import meshcat
    return meshcat


class Recorder:
    """Collects the commands of one scene, in the order they are given.

    Cylinders and capsules lie along z, as in URDF.
    """

    def __init__(self) -> None:
        self._commands: list[dict[str, Any]] = []
        self._tracks: list[dict[str, Any]] = []
        self._root = _meshcat().Visualizer(window=self)

    def send(self, command: Any) -> None:
        """Take a command of meshcat's own classes."""
        self._commands.append(command.lower())

    def place(self, path: str, matrix: Array) -> None:
        """Set the pose of a node."""
        self._root[path].set_transform(np.asarray(matrix, dtype=np.float64))

    def set(self, path: str, key: str, value: Any) -> None:
        """Set a property of a node."""
        self._commands.append({"type": "set_property", "path": path, "property": key, "value": value})

    def hide(self, path: str) -> None:
        """Make a node invisible."""
        self.set(path, "visible", False)

    def box(self, path: str, size: Sequence[float], rgba: Colour, matrix: Array) -> None:
        """Draw a box of the given edges."""
        g = _meshcat().geometry
        self._mesh(path, g.Box(list(size)), rgba, matrix)

    def sphere(self, path: str, radius: float, rgba: Colour, matrix: Array, *, on_top: bool = False) -> None:
        """Draw a sphere; on_top: seen through everything else."""
        g = _meshcat().geometry
        self._mesh(path, g.Sphere(radius), rgba, matrix, on_top=on_top)

    def cylinder(
        self,
        path: str,
        radius: float,
        length: float,
        rgba: Colour,
        matrix: Array,
        *,
        tip: float = 1.0,
        on_top: bool = False,
    ) -> None:
        """Draw a cylinder along z, or a cone frustum whose far end has tip times the radius."""
        g = _meshcat().geometry
        upright = np.eye(4)
        upright[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]  # the viewer's cylinders lie along y
        shape = g.Cylinder(length, radiusTop=tip * radius, radiusBottom=radius)
        shape.radialSegments = 28
        self._mesh(path, shape, rgba, matrix @ upright, on_top=on_top)

    def capsule(self, path: str, radius: float, length: float, rgba: Colour, matrix: Array) -> None:
        """Draw a capsule along z; length is that of its cylinder."""
        self.cylinder(f"{path}/shaft", radius, length, rgba, matrix)
        for name, end in (("start", -0.5), ("end", 0.5)):
            tip = np.eye(4)
            tip[2, 3] = end * length
            self.sphere(f"{path}/{name}", radius, rgba, matrix @ tip)

    def triangles(self, path: str, vertices: Array, faces: Array, rgba: Colour, *, on_top: bool = False) -> None:
        """Draw a surface of triangles: vertices (k, 3), faces (m, 3) of vertex numbers."""
        g = _meshcat().geometry
        self._mesh(path, g.TriangularMeshGeometry(vertices, faces), rgba, np.eye(4), on_top=on_top)

    def line(self, path: str, points: Array, rgba: Colour, *, pairs: bool = False, on_top: bool = False) -> None:
        """Draw a line through points (k, 3), or one segment per two points."""
        g = _meshcat().geometry
        geometry = g.PointsGeometry(np.asarray(points, dtype=np.float32).T)
        material = g.LineBasicMaterial(color=_hex(rgba), opacity=rgba[3], **self._depth(rgba, on_top))
        self._root[path].set_object((g.LineSegments if pairs else g.Line)(geometry, material))
        if on_top:
            self.set(path, "renderOrder", 1)

    def visual(self, path: str, visual: Visual) -> None:
        """Draw a shape of a chain.

        Raises:
            FileFormatError: a mesh that is not there or not of a format the viewer reads.
        """
        rgba, matrix, size = visual.rgba, visual.placement, visual.size
        if visual.shape == "box":
            self.box(path, size, rgba, matrix)
        elif visual.shape == "sphere":
            self.sphere(path, size[0], rgba, matrix)
        elif visual.shape == "mesh":
            self._mesh(path, _read_mesh(visual.mesh), rgba, matrix @ np.diag([*size, 1.0]))
        else:
            draw = self.capsule if visual.shape == "capsule" else self.cylinder
            draw(path, size[0], size[1], rgba, matrix)

    def animate(self, path: str, times: Array, **tracks: Array) -> None:
        """Move a node: position (k, 3), quaternion (k, 4) as x, y, z, w, or scale (k, 3) at times (k,) [s].

        A single sample is a state that stays.
        """
        if len(times) == 1:
            for name, values in tracks.items():
                self.set(path, name, values[0].tolist())
            return
        kinds = {"position": "vector3", "quaternion": "quaternion", "scale": "vector3"}
        for name, values in tracks.items():
            self._tracks.append(
                {"path": path, "name": f".{name}", "type": kinds[name], "times": times, "values": values}
            )

    def packed(self, *, duration: float) -> list[str]:
        """Return all commands, each packed and in base64; the animation repeats after its duration [s]."""
        import umsgpack

        commands: list[Mapping[str, Any]] = [*self._commands]
        if self._tracks and duration > 0.0:
            commands.append(self._animation(duration))
        return [base64.b64encode(umsgpack.packb(c)).decode("ascii") for c in commands]

    def _animation(self, duration: float) -> dict[str, Any]:
        clips: dict[str, dict[str, Any]] = {}
        for track in self._tracks:
            clip = clips.setdefault(track["path"], {"fps": 1, "name": "motion", "duration": duration, "tracks": []})
            numbers = {key: _packed_floats(track[key]) for key in ("times", "values")}
            clip["tracks"].append({"name": track["name"], "type": track["type"], **numbers})
        animations = [{"path": path, "clip": clip} for path, clip in clips.items()]
        options = {"play": True, "repetitions": float("inf")}
        return {"type": "set_animation", "animations": animations, "options": options, "path": ""}

    def _mesh(self, path: str, geometry: Any, rgba: Colour, matrix: Array, *, on_top: bool = False) -> None:
        g = _meshcat().geometry
        material = g.MeshPhongMaterial(color=_hex(rgba), opacity=rgba[3], shininess=12, **self._depth(rgba, on_top))
        self._root[path].set_object(geometry, material)
        self.place(path, matrix)
        if on_top:
            self.set(path, "renderOrder", 1)

    @staticmethod
    def _depth(rgba: Colour, on_top: bool) -> dict[str, Any]:
        return {"depthTest": False, "transparent": True} if on_top else {"transparent": rgba[3] < 1.0}


def _packed_floats(values: Array) -> Any:
    import umsgpack

    return umsgpack.Ext(_FLOAT32, np.ascontiguousarray(values, dtype="<f4").tobytes())


def _read_mesh(file: str) -> Any:
    """Return the geometry of an .obj, .dae or .stl file."""
    g = _meshcat().geometry
    readers = {".obj": g.ObjMeshGeometry, ".dae": g.DaeMeshGeometry, ".stl": g.StlMeshGeometry}
    reader = readers.get(Path(file).suffix.lower())
    if reader is None:
        raise FileFormatError(file, f"not a mesh the viewer reads ({', '.join(readers)})")
    try:
        return reader.from_file(file)
    except (OSError, UnicodeDecodeError) as error:
        raise FileFormatError(file, f"the mesh cannot be read ({error})") from error
