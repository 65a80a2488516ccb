"""The open tree as the engine sees it: links whose joints turn about or slide along their z axis.

A joint of several axes in a row is several links. Everything that a joint does is read off Pinocchio's joint model.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.engine import tables as e
from fivebar_pin.errors import InvalidInputError

__all__ = ["Link", "bodies_of", "links_of"]


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """A link, and the joint that carries it.

    Attributes:
        joint: number of the joint of the model that it belongs to.
        parent: number of the link that carries it; 0 is the ground.
        kind: of the joint, see `engine.tables`.
        q, v: its first places in a configuration and in a velocity.
        R, p: its axes (3, 3) and origin (3,) on the parent, coordinates zero.
        axes: the same axes in those of the model's joint (3, 3): the body's are `R @ axes.T`.
        pitch: how far the joint slides for a unit of its coordinate: the lead of a screw [m/rad], one for slides unless
            their axis has another length.
        columns: axis and motion of every velocity coordinate.
        within: pose (4, 4) on the joint's placement, or on the link of the same joint before.
        first: whether it is the first link of its joint.
        radii: of the ellipsoid that it rolls on, along its axes, as parts of the pitch, the longest one; else none.
    """

    joint: int
    parent: int
    kind: int
    q: int
    v: int
    R: Array
    p: Array
    axes: Array
    pitch: float
    columns: tuple[tuple[int, int], ...]
    within: Array
    first: bool
    radii: tuple[float, ...]

    def placed(self, before: Array, placements: Array) -> tuple[Array, Array]:
        """Return axes (n, 3, 3) and origin (n, 3) on the parent, whose axes are `before`, for placements (n, 4, 4)."""
        M = np.matmul(placements, self.within)
        return np.matmul(np.matmul(before.T, M[:, :3, :3]), self.axes), np.matmul(before.T, M[:, :3, 3, None])[..., 0]


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """One of the simple joints that a joint is made of, on the one before."""

    kind: int
    placement: pin.SE3
    axis: Array  # in its own axes
    pitch: float = 1.0
    radii: tuple[float, ...] = ()


_TURN, _SHIFT, _HELIX = ((2, motion) for motion in (e.TURN, e.SHIFT, e.HELIX))
_COLUMNS: dict[int, tuple[tuple[int, int], ...]] = {
    e.REVOLUTE: (_TURN,),
    e.TURNING: (_TURN,),
    e.SLIDE: (_SHIFT,),
    e.SCREW: (_HELIX,),
    e.BALL: tuple((k, e.TURN) for k in range(3)),
    e.PLANAR: ((0, e.SHIFT), (1, e.SHIFT), _TURN),
    e.FREE: (*((k, e.SHIFT) for k in range(3)), *((k, e.TURN) for k in range(3))),
    e.EGG: ((0, e.HELIX), (1, e.HELIX), _TURN),
}
_COORDINATES = {e.TURNING: 2, e.BALL: 4, e.PLANAR: 4, e.FREE: 7, e.EGG: 3}
_Z = np.array([0.0, 0.0, 1.0])
_WHOLE = {"JointModelSpherical": e.BALL, "JointModelPlanar": e.PLANAR, "JointModelFreeFlyer": e.FREE}


def links_of(model: pin.Model) -> list[Link]:
    """Return the links of a model without the ground; the last one of a joint carries its body."""
    links: list[Link] = []
    last, axes = {0: 0}, {0: np.eye(3)}
    for j in range(1, model.njoints):
        parent = last[int(model.parents[j])]
        q, v = int(model.idx_qs[j]), int(model.idx_vs[j])
        placement = model.jointPlacements[j]
        for part in _parts(model, model.joints[j]):
            turn, columns = _to_z(part.axis), _COLUMNS[part.kind]
            within, first = np.array(part.placement.homogeneous), parent == last[int(model.parents[j])]
            link = Link(
                j, parent, part.kind, q, v, np.eye(3), np.zeros(3), turn, part.pitch, columns, within, first, part.radii
            )
            R, p = link.placed(axes[parent], np.array(placement.homogeneous)[None])
            links.append(replace(link, R=R[0], p=p[0]))
            parent, placement = len(links), pin.SE3.Identity()
            axes[parent] = turn
            q, v = q + _COORDINATES.get(part.kind, 1), v + len(columns)
        last[j] = parent
    return links


def bodies_of(links: Sequence[Link]) -> dict[int, tuple[int, Array]]:
    """Return, by joint of the model, the number of the link that carries its body, and the link's `axes`."""
    return {0: (0, np.eye(3))} | {x.joint: (k, x.axes) for k, x in enumerate(links, start=1)}


def _parts(model: pin.Model, joint: pin.JointModel) -> Iterator[_Part]:
    """Take a joint apart."""
    name, here = joint.shortname(), pin.SE3.Identity()
    if name == "JointModelComposite":
        composite = joint.extract() if hasattr(joint, "extract") else joint
        for sub, placement in zip(composite.joints, composite.jointPlacements, strict=True):
            first = placement
            for part in _parts(model, sub):
                yield replace(part, placement=first * part.placement)
                first = pin.SE3.Identity()
        return
    if name in _WHOLE:
        yield _Part(_WHOLE[name], here, _Z)
        return
    if name == "JointModelEllipsoid":
        egg = joint.extract() if hasattr(joint, "extract") else joint
        radii = [float(x) for x in (egg.radius_x, egg.radius_y, egg.radius_z)]
        longest = max(map(abs, radii)) or 1.0
        yield _Part(e.EGG, here, _Z, longest, tuple(x / longest for x in radii))
        return
    S = _subspace(model, joint)
    linear, angular = S[:3], S[3:]
    if name == "JointModelTranslation":
        for k in range(3):
            yield _slide(linear[:, k])
    elif name == "JointModelSphericalZYX":
        for axis in np.eye(3)[::-1]:
            yield _Part(e.REVOLUTE, here, axis)
    elif name == "JointModelUniversal":
        for k in range(2):
            yield _Part(e.REVOLUTE, here, angular[:, k])
    elif joint.nv == 1 and not angular.any():
        yield _slide(linear[:, 0])
    elif joint.nv == 1 and linear.any():
        yield _Part(e.SCREW, here, angular[:, 0], float(linear[:, 0] @ angular[:, 0]))
    elif joint.nv == 1:
        yield _Part(e.REVOLUTE if joint.nq == 1 else e.TURNING, here, angular[:, 0])
    elif joint.nv:
        raise InvalidInputError(
            "joint kind", name, "is not known", "Known are those of one axis, and the composite, universal, spherical, "
            "ellipsoid, translation, planar and free-flyer joints.",
        )  # fmt: skip


def _slide(axis: Array) -> _Part:
    size = float(np.linalg.norm(axis))
    return _Part(e.SLIDE, pin.SE3.Identity(), axis / size, size)


def _subspace(model: pin.Model, joint: pin.JointModel) -> Array:
    """Return the motion subspace of a joint at its neutral configuration (6, nv)."""
    data = joint.createData()
    joint.calc(data, pin.neutral(model), np.zeros(model.nv))
    return np.array(data.S, dtype=np.float64).reshape(6, -1) if joint.nv else np.zeros((6, 0))


def _to_z(axis: Array) -> Array:
    """Return axes (3, 3) whose z is a unit vector; those of coordinate axes come without round-off."""
    if np.array_equal(np.sort(axis), [0.0, 0.0, 1.0]):
        return np.roll(np.eye(3), -(2 - int(np.argmax(axis))), axis=0)
    x = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(axis, x), axis], axis=1)
