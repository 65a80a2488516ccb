"""Mass and inertia of triangle meshes, by the rules that MuJoCo's compiler knows.

Tetrahedra between a reference point and the triangles have the signed volume V_k = x1 . (x2 x x3) / 6 and, with
s = x1 + x2 + x3, the moments  int x = V_k s / 4  and  int x x^T = V_k (s s^T + sum_i x_i x_i^T) / 20.

    exact   signed volumes: right for a closed surface
    legacy  their sizes, from the middle of the surface for the centre of mass, from that for mass and inertia
    convex  exact, of the convex hull
    shell   a surface of even density: triangles of area A_k have  int x = A_k s / 3,
            int x x^T = A_k (s s^T + sum_i x_i x_i^T) / 12
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.io._build import bare_inertia
from fivebar_pin.io._mjcf_assets import Mesh

__all__ = ["mesh_inertia", "mesh_points"]


def mesh_inertia(mesh: Mesh) -> pin.Inertia:
    """Return the inertia of a mesh of density one, per volume or per area, about the mesh's origin.

    Raises:
        ValueError: it cannot be read, or has no volume; says why.
    """
    vertices, faces = _triangles(mesh)
    corners = _placed(mesh, vertices)
    if mesh.inertia == "convex" or faces is None:
        triangles = _hull(corners)
    else:
        triangles = corners[faces[:, ::-1] if np.prod(mesh.scale) < 0.0 else faces]
    if mesh.inertia == "shell":
        volume, first, second = _surface(triangles)
        return _inertia(volume, first, second)
    middle = _middle(triangles)
    size: Callable[[Array], Array] = np.abs if mesh.inertia == "legacy" else np.asarray
    volume, first, second = _solid(triangles - middle, size)
    if volume <= 0.0:
        raise ValueError(f"has the volume {volume:g} m3, as if its triangles faced inwards")
    if mesh.inertia == "legacy":
        middle = middle + first / volume
        volume, _, second = _solid(triangles - middle, size)
        first = np.zeros(3)
    return pin.SE3(np.eye(3), middle).act(_inertia(volume, first, second))


def mesh_points(mesh: Mesh) -> Array:
    """Return the points of a mesh (n, 3) [m].

    Raises:
        ValueError: it cannot be read; says why.
    """
    return _placed(mesh, _triangles(mesh)[0])


def _placed(mesh: Mesh, vertices: Array) -> Array:
    return np.asarray((vertices - mesh.position) @ mesh.R * mesh.scale)


def _triangles(mesh: Mesh) -> tuple[Array, Array | None]:
    """Return the points (n, 3) and the triangles (k, 3) of a mesh; None where it has points alone."""
    if mesh.missing:
        raise ValueError(mesh.missing)
    if mesh.vertices is not None:
        return mesh.vertices, mesh.faces
    import coal

    try:
        solid = coal.MeshLoader().load(str(mesh.file), np.ones(3))
    except (ValueError, RuntimeError) as error:
        raise ValueError(f"cannot be read ({' '.join(str(error).split())[-120:]})") from error
    faces = [(t[0], t[1], t[2]) for t in map(solid.tri_indices, range(solid.num_tris))]
    return np.array(solid.vertices()), np.array(faces)


def _hull(points: Array) -> Array:
    """Return the triangles of the convex hull, facing outwards (k, 3, 3)."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError) as error:
        raise ValueError("has no convex hull, as its points lie in a plane") from error
    triangles = points[hull.simplices]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    inward = np.einsum("ki,ki->k", normals, hull.equations[:, :3]) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    return np.asarray(triangles)


def _areas(triangles: Array) -> Array:
    sides = triangles[:, 1:] - triangles[:, :1]
    return np.asarray(0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1))


def _middle(triangles: Array) -> Array:
    """Return the centre of the surface (3,)."""
    areas = _areas(triangles)
    return np.asarray(areas @ triangles.mean(axis=1) / areas.sum())


def _moments(triangles: Array, weights: Array, first: float, second: float) -> tuple[float, Array, Array]:
    s = triangles.sum(axis=1)
    products = np.einsum("k,ki,kj->ij", weights, s, s) + np.einsum("k,kci,kcj->ij", weights, triangles, triangles)
    return float(weights.sum()), weights @ s / first, products / second


def _solid(triangles: Array, size: Callable[[Array], Array]) -> tuple[float, Array, Array]:
    volumes = size(np.linalg.det(triangles) / 6.0)
    return _moments(triangles, volumes, 4.0, 20.0)


def _surface(triangles: Array) -> tuple[float, Array, Array]:
    return _moments(triangles, _areas(triangles), 3.0, 12.0)


def _inertia(mass: float, first: Array, second: Array) -> pin.Inertia:
    """Return the inertia of a mass with the given first and second moments."""
    centre = first / mass
    about = second - mass * np.outer(centre, centre)
    return bare_inertia(mass, centre, np.trace(about) * np.eye(3) - about)
