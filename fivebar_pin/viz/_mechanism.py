"""Draw one mechanism into a recorder: bodies, joints, closures, springs, ground, mass centres, trace, force."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.chain import find_frame
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.viz._drawing import (
    COLOURS,
    LINK_COLOURS,
    Drawing,
    amid_ground,
    body_names,
    ground_closures,
    is_counterweight,
    safe,
)
from fivebar_pin.viz._geometry import JointShape, body_points, joint_shapes
from fivebar_pin.viz._recording import Recorder, along, pose, quaternions
from fivebar_pin.viz._springs import draw_springs

if TYPE_CHECKING:
    from fivebar_pin.chain import ClosedChain

__all__ = ["draw_mechanism"]

_SMALLEST = 1e-6  # scale of an arrow of no length: none may be zero [-]
_STILL = 1e-12  # step of a trace that has no direction [m]
_SEEN = 1e-6  # length below which a line is not seen, as a part of the scene [-]
_RIBBON_POINTS = 2000
"""Points of a trace that are drawn wide; the line itself holds all of them."""


def draw_mechanism(recorder: Recorder, path: str, drawing: Drawing) -> None:
    """Draw all of one mechanism under a path of the scene, in metres and world axes."""
    shapes = joint_shapes(drawing.chain, _neutral(drawing.chain))
    drawn = {v.frame for v in drawing.visuals if not is_counterweight(v)}
    dressed = {f.parentJoint for f in drawing.chain.model.frames if f.name in drawn}
    for j, body in enumerate(body_names(drawing.chain), start=1):
        node = f"{path}/{body}"
        if j not in dressed:
            _draw_link(recorder, f"{node}/link", drawing, j)
        _draw_joint(recorder, f"{node}/joint", drawing, shapes[j - 1])
        _draw_body_com(recorder, f"{node}/com", drawing, j)
        _move(recorder, node, drawing, drawing.poses.joints[:, j])
    _draw_visuals(recorder, path, drawing)
    _draw_closures(recorder, path, drawing)
    _draw_segments(recorder, path, drawing)
    draw_springs(recorder, path, drawing)
    _draw_ground(recorder, f"{path}/ground", drawing, shapes)
    _draw_com(recorder, path, drawing)
    if drawing.force is not None and drawing.arrow > 0.0:
        _draw_force(recorder, f"{path}/force", drawing, drawing.force[drawing.keys])


def _neutral(chain: ClosedChain) -> Array:
    import pinocchio as pin

    return np.asarray(pin.neutral(chain.model))


def _node(chain: ClosedChain, path: str, joint: int) -> str:
    """Return the scene node of the body of a joint (0: the ground)."""
    return f"{path}/{body_names(chain)[joint - 1]}" if joint else f"{path}/ground"


def _draw_link(recorder: Recorder, path: str, drawing: Drawing, joint: int) -> None:
    """Draw rods between the points of a body: all sides of a triangle, else a star from its own joint."""
    points, r = body_points(drawing.chain, joint), drawing.radius
    colour = LINK_COLOURS[(joint - 1) % len(LINK_COLOURS)]
    pairs = [(0, k) for k in range(1, len(points))] + ([(1, 2)] if len(points) == 3 else [])
    for number, (a, b) in enumerate(pairs):
        start, end = points[a], points[b]
        length = float(np.linalg.norm(end - start))
        recorder.capsule(f"{path}/{number}", r, length, colour, pose(0.5 * (start + end), end - start))
    if not pairs:
        recorder.box(f"{path}/0", (3.0 * r, 3.0 * r, 3.0 * r), colour, np.eye(4))


def _draw_joint(recorder: Recorder, path: str, drawing: Drawing, shape: JointShape) -> None:
    r, colour = drawing.radius, COLOURS["joint"]
    if shape.kind == "hinge":
        recorder.cylinder(path, 1.25 * r, 2.8 * r, colour, pose(np.zeros(3), shape.axis))
    elif shape.kind == "slide":
        recorder.box(path, (2.6 * r, 2.6 * r, 4.0 * r), colour, pose(np.zeros(3), shape.axis))
    elif shape.kind == "ball":
        recorder.sphere(path, 1.4 * r, colour, np.eye(4))


def _draw_body_com(recorder: Recorder, path: str, drawing: Drawing, joint: int) -> None:
    """Draw the mass centre of a body: a white dot with a dark rim, seen through everything, on a thin arm."""
    inertia = drawing.chain.model.inertias[joint]
    if inertia.mass <= 0.0:
        return
    share = (inertia.mass / drawing.mass_unit) ** (1.0 / 3.0) if drawing.mass_unit > 0.0 else 1.0
    r = 0.9 * drawing.radius * float(np.clip(share, 0.35, 1.0))
    centre = np.array(inertia.lever)
    recorder.line(f"{path}/arm", np.array([np.zeros(3), centre]), COLOURS["joint"], on_top=True)
    recorder.sphere(f"{path}/rim", r, COLOURS["joint"], pose(centre), on_top=True)
    recorder.sphere(f"{path}/dot", 0.72 * r, COLOURS["body com"], pose(centre), on_top=True)
    recorder.set(f"{path}/dot", "renderOrder", 2)


def _draw_visuals(recorder: Recorder, path: str, drawing: Drawing) -> None:
    model = drawing.chain.model
    for number, visual in enumerate(drawing.visuals):
        frame = find_frame(model, visual.frame)
        node = f"{_node(drawing.chain, path, frame.parentJoint)}/visual {number}"
        recorder.place(node, frame.placement.homogeneous)
        recorder.visual(f"{node}/shape", visual)
        if is_counterweight(visual):  # a thin arm says whose it is
            ends = np.array([frame.placement.inverse().translation, visual.placement[:3, 3]])
            recorder.line(f"{node}/arm", ends, COLOURS["joint"], on_top=True)


def _draw_closures(recorder: Recorder, path: str, drawing: Drawing) -> None:
    """Draw both frames of each closure: a yellow pin on the first, a smaller dark one on the second."""
    model, r = drawing.chain.model, drawing.radius
    for closure in drawing.chain.closures:
        mark = closure.mark
        for number, name in enumerate(closure.ends):
            frame = find_frame(model, name)
            node = f"{_node(drawing.chain, path, frame.parentJoint)}/closure {safe(closure.name)} {number + 1}"
            recorder.place(node, frame.placement.homogeneous)
            colour = COLOURS["closure"] if number == 0 else COLOURS["joint"]
            wide, long = (1.5 * r, 3.2 * r) if number == 0 else (0.7 * r, 3.6 * r)
            axis = mark.axis
            if mark.shape == "ball" and drawing.view.planar:  # seen along the plane's normal it is a pin
                rotation = drawing.poses.joints[0, frame.parentJoint, :3, :3] @ frame.placement.rotation
                axis = rotation.T @ drawing.view.normal
            if mark.shape == "box":
                recorder.box(f"{node}/mark", (2 * wide, 2 * wide, 2 * wide), colour, np.eye(4))
            elif axis is None:
                recorder.sphere(f"{node}/mark", wide, colour, np.eye(4))
            else:
                recorder.cylinder(f"{node}/mark", wide, mark.stretch * long, colour, pose(np.zeros(3), axis))


def _draw_segments(recorder: Recorder, path: str, drawing: Drawing) -> None:
    """Draw the rods of closures, and a thin line between joints that are coupled."""
    for anchored in loops_of(drawing.chain).anchored:
        for number, segment in enumerate(anchored.segments()):
            poses = [drawing.poses.joints[:, j] for j in segment.joints]
            ends = [M[:, :3, :3] @ p + M[:, :3, 3] for M, p in zip(poses, segment.points, strict=True)]
            along_it = ends[1] - ends[0]
            length = np.linalg.norm(along_it, axis=1)
            if not length.max() > _SEEN * drawing.size:
                continue  # coupled joints on one axis
            node = f"{path}/closure {safe(anchored.closure.name)} line {number + 1}"
            thick = (0.55 if segment.rod else 0.2) * drawing.radius
            middle = pose(np.array([0.0, 0.0, 0.5]))
            recorder.cylinder(f"{node}/stretch/bar", thick, 1.0, COLOURS["closure"], middle, on_top=not segment.rod)
            directions = np.where(length[:, None] > 0.0, along_it, drawing.view.up)[drawing.keys]
            turns = quaternions(np.array([along(d) for d in directions]))
            stretched = np.maximum(length, _SEEN * drawing.size)[drawing.keys]
            recorder.place(node, pose(ends[0][0], directions[0]))
            recorder.animate(node, drawing.times, position=ends[0][drawing.keys], quaternion=turns)
            one = np.ones_like(stretched)
            recorder.animate(f"{node}/stretch", drawing.times, scale=np.stack([one, one, stretched], axis=1))


def _draw_ground(recorder: Recorder, path: str, drawing: Drawing, shapes: tuple[JointShape, ...]) -> None:
    """Draw a foot below every hinge on the ground, and a rail along every slide on it."""
    model, r, up = drawing.chain.model, drawing.radius, drawing.view.up
    feet: list[tuple[Array, int | None]] = [(p, None) for p in ground_closures(drawing.chain)]
    for j in range(1, model.njoints):
        if model.parents[j] == 0 and shapes[j - 1].kind != "free":
            feet.append((np.array(model.jointPlacements[j].translation), j))
    for number, (p, joint) in enumerate(feet):
        if joint is not None and shapes[joint - 1].kind == "slide":
            axis = model.jointPlacements[joint].rotation @ shapes[joint - 1].axis
            travel = (drawing.poses.joints[:, joint, :3, 3] - p) @ axis
            low, high = float(travel.min()) - 4.0 * r, float(travel.max()) + 4.0 * r
            rail = pose(p + 0.5 * (low + high) * axis, axis)
            recorder.box(f"{path}/rail {number}", (r, r, high - low), COLOURS["ground"], rail)
            continue
        foot = pose(p - 2.2 * r * up, up)
        recorder.cylinder(f"{path}/foot {number}", 2.4 * r, 4.4 * r, COLOURS["ground"], foot, tip=0.2)
        recorder.box(
            f"{path}/base {number}", (7.0 * r, 7.0 * r, 0.8 * r), COLOURS["ground"], pose(p - 4.6 * r * up, up)
        )


def _draw_com(recorder: Recorder, path: str, drawing: Drawing) -> None:
    """Draw the total centre of mass and the line through its places at all samples."""
    com, r = drawing.poses.com, drawing.radius
    if not len(com):
        return
    recorder.line(f"{path}/trace/line", com, COLOURS["com"], on_top=True)
    if float(np.max(np.ptp(com, axis=0))) > 0.05 * r:
        vertices, faces = _ribbon(com[:: 1 + len(com) // _RIBBON_POINTS], drawing.view.normal, 0.16 * r)
        recorder.triangles(f"{path}/trace/ribbon", vertices, faces, COLOURS["com"], on_top=True)
    recorder.sphere(f"{path}/com/ball", 0.9 * r, COLOURS["com"], np.eye(4), on_top=True)
    recorder.set(f"{path}/com/ball", "renderOrder", 3)
    recorder.place(f"{path}/com", pose(com[0]))
    recorder.animate(f"{path}/com", drawing.times, position=com[drawing.keys])


def _ribbon(points: Array, normal: Array, half: float) -> tuple[Array, Array]:
    """Return vertices and faces of a band of given half width about a line, facing a direction."""
    step = np.gradient(points, axis=0) if len(points) > 1 else np.zeros_like(points)
    side = np.cross(normal, step)
    length = np.linalg.norm(side, axis=1, keepdims=True)
    side = np.divide(side, length, out=np.zeros_like(side), where=length > _STILL)
    vertices = np.concatenate([points + half * side, points - half * side])
    n = len(points)
    k = np.arange(n - 1)
    faces = np.concatenate([np.stack([k, k + 1, n + k], axis=1), np.stack([k + 1, n + k + 1, n + k], axis=1)])
    return vertices, faces


def _draw_force(recorder: Recorder, path: str, drawing: Drawing, force: Array) -> None:
    """Draw the shaking force (k, 3) as an arrow whose tail is amid the joints on the ground."""
    r, colour = drawing.radius, COLOURS["force"]
    head = 3.4 * r
    recorder.place(path, pose(amid_ground(drawing.chain)))
    rod, cone = pose(np.array([0.0, 0.0, 0.5])), pose(np.array([0.0, 0.0, -0.5 * head]))
    recorder.cylinder(f"{path}/shaft/rod", 0.55 * r, 1.0, colour, rod, on_top=True)
    recorder.cylinder(f"{path}/head/cone", 1.5 * r, head, colour, cone, tip=0.02, on_top=True)
    for part in ("shaft/rod", "head/cone"):
        recorder.set(f"{path}/{part}", "renderOrder", 4)
    length = drawing.arrow * np.linalg.norm(force, axis=1)
    # A short arrow is drawn smaller as a whole; an arrow of no length keeps a scale above zero.
    size = np.clip(length / (1.5 * head), _SMALLEST, 1.0)
    shaft = np.maximum(length - head * size, _SMALLEST * head)
    directions = np.where(size[:, None] > _SMALLEST, force, drawing.view.up)
    zero = np.zeros_like(length)
    recorder.animate(path, drawing.times, quaternion=quaternions(np.array([along(f) for f in directions])))
    recorder.animate(f"{path}/shaft", drawing.times, scale=np.stack([size, size, shaft], axis=1))
    tips = np.stack([zero, zero, length], axis=1)
    recorder.animate(f"{path}/head", drawing.times, position=tips, scale=np.stack([size, size, size], axis=1))


def _move(recorder: Recorder, path: str, drawing: Drawing, placements: Array) -> None:
    """Move a node along placements (n, 4, 4)."""
    recorder.place(path, placements[0])
    shown = placements[drawing.keys]
    recorder.animate(path, drawing.times, position=shown[:, :3, 3], quaternion=quaternions(shown[:, :3, :3]))
