"""From the parts of a linkage to a closed chain as it lies in the sketch, closed or not."""

from __future__ import annotations

import cmath
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise

import numpy as np
import pinocchio as pin

from fivebar_pin.chain import BarBody, ClosedChain, Geometry, LumpBody, Placement, PlateBody, Visual
from fivebar_pin.chain.bodies import Body
from fivebar_pin.chain.reshape import with_bodies
from fivebar_pin.closures import Closure, Coupling
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.planar._parts import GROUND, Gear, Link, Lump, Motor, PointSpring
from fivebar_pin.planar._shape import LinkShape, Moves, back, link_poses
from fivebar_pin.planar._tree import Edge, SpanningTree, block_of, spanning_tree
from fivebar_pin.springs import Spring

__all__ = ["HOME", "built"]

HOME = "home"
"""Name of the configuration of the sketch."""
_WIDE = 1e4
"""Bound of coordinates that have none [rad or m]."""
_BLOCK = (0.06, 0.04, 0.03)
"""Size of a sliding block as it is drawn [m]."""
_COLOURS = (
    (0.16, 0.44, 0.70, 1.0),
    (0.90, 0.62, 0.10, 1.0),
    (0.34, 0.62, 0.32, 1.0),
    (0.76, 0.30, 0.28, 1.0),
    (0.50, 0.36, 0.66, 1.0),
    (0.36, 0.56, 0.60, 1.0),
)


def built(
    name: str,
    sketch: Mapping[str, complex],
    links: Mapping[str, Link],
    *,
    motors: Sequence[Motor],
    gears: Iterable[Gear],
    lumps: Iterable[Lump],
    springs: Iterable[PointSpring],
    gravity: Sequence[float],
) -> ClosedChain:
    """Return the chain; its configuration "home" is that of the sketch, and open where the sketch is.

    Args:
        name: of the linkage.
        sketch: where every point lies, x + i y [m].
        links: by name, the ground among them.
        motors: with the point and the other link of each filled in.
        gears: between links.
        lumps: masses on links.
        springs: between points.
        gravity: (3,) [m/s2].
    """
    tree = spanning_tree(name, links, motors)
    return _Builder(name, sketch, links, tree).chain(motors, gears, tuple(lumps), springs, gravity)


class _Builder:
    """Adds the joints of a tree to a model, and keeps what their placements follow."""

    def __init__(self, name: str, sketch: Mapping[str, complex], links: Mapping[str, Link], tree: SpanningTree) -> None:
        self.links, self.tree = links, tree
        self.poses, self.shape = link_poses(links, sketch), LinkShape(links, sketch)
        self.stems: dict[str, Moves] = {GROUND: ()}
        self.placements: list[Placement] = []
        self.home: list[float] = []
        self.model = pin.Model()
        self.model.name = name
        self.model.addBodyFrame(GROUND, 0, pin.SE3.Identity(), 0)

    def chain(
        self,
        motors: Sequence[Motor],
        gears: Iterable[Gear],
        lumps: Sequence[Lump],
        springs: Iterable[PointSpring],
        gravity: Sequence[float],
    ) -> ClosedChain:
        for edge in self.tree.edges:
            self.joint(edge)
        for link in self.links.values():
            for point in link.points:
                self.frame(link.name, point)
        geometry = Geometry(
            self.shape.values, tuple(self.placements), tuple(self.bodies(lumps)), tuple(self.shape.lengths)
        )
        model = with_bodies(self.model, geometry.bodies)
        model.gravity.linear = np.array(gravity)
        model.referenceConfigurations[HOME] = np.array(self.home)
        return ClosedChain(
            model,
            (*self.closures(), *(self.coupling(gear) for gear in gears)),
            tuple(self.driven(m) for m in motors),
            visuals=tuple(self.visuals(model, geometry.bodies)),
            springs=tuple(self.spring(s) for s in springs),
            geometry=geometry,
        )

    def joint(self, edge: Edge) -> None:
        """Add the joint of an edge; it is named after the link that hangs on it."""
        stem = self.stems[edge.parent]
        if edge.at:
            moves = stem + self.shape.point(edge.parent, edge.at)
            self.stems[edge.child] = back(self.shape.point(edge.child, edge.at))
            angle = self.poses[edge.child].angle - self.poses[edge.parent].angle
            self.add(edge, pin.JointModelRZ(), moves, cmath.phase(cmath.exp(1j * angle)))
            return
        child = self.links.get(edge.child)
        if child is not None and (child.guide is None or child.guide.on != edge.parent):  # the line hangs on the block
            self.stems[edge.child] = back(self.shape.line(edge.parent))
            self.add(edge, pin.JointModelPX(), stem, -self.along(edge.parent))
            return
        slider = edge.child if child is not None else next(x for x in self.links if block_of(x) == edge.child)
        self.stems[edge.child] = ()
        self.add(edge, pin.JointModelPX(), stem + self.shape.line(slider), self.along(slider))

    def along(self, slider: str) -> float:
        """Return how far along its line a sliding link is in the sketch [m]."""
        guide = self.links[slider].guide
        assert guide is not None
        away = self.poses[slider].origin - self.poses[guide.on].origin
        return float((away * cmath.exp(-1j * guide.angle)).real)

    def add(self, edge: Edge, kind: object, moves: Moves, coordinate: float) -> None:
        model, name = self.model, edge.child
        if model.existJointName(name):
            raise InvalidInputError("names of bars", name, "is needed for a sliding block", "Rename the bar.")
        parent = 0 if edge.parent == GROUND else model.getJointId(edge.parent)
        j = model.addJoint(parent, kind, self.placed(name, moves), name)
        model.lowerPositionLimit[model.idx_qs[j]], model.upperPositionLimit[model.idx_qs[j]] = -_WIDE, _WIDE
        model.addJointFrame(j, -1)
        model.addBodyFrame(f"{name}_link", j, pin.SE3.Identity(), -1)
        self.home.append(coordinate)

    def frame(self, link: str, point: str) -> None:
        """Name a point of a link."""
        name, moves = frame_of(link, point), self.stems[link] + self.shape.point(link, point)
        if self.model.existFrame(name):
            raise InvalidInputError("names of bars and points", name, "would name two frames", "Rename one of them.")
        j = 0 if link == GROUND else self.model.getJointId(link)
        self.model.addFrame(pin.Frame(name, j, 0, self.placed(name, moves), pin.FrameType.OP_FRAME), False)

    def placed(self, name: str, moves: Moves) -> pin.SE3:
        placement = Placement(name, moves)
        if moves:
            self.placements.append(placement)
        return placement.at(self.shape.values)

    def closures(self) -> Iterable[Closure]:
        """Yield what closes the cuts: points that stay together, and blocks that stay on their links."""
        met: dict[str, int] = {}
        for cut in self.tree.cuts:
            if not cut.at:
                end = frame_of(cut.second, self.links[cut.second].points[0])
                yield Closure((f"{block_of(cut.second)}_link", end), "6d", name=cut.second)
                continue
            met[cut.at] = met.get(cut.at, 0) + 1
            name = cut.at if met[cut.at] == 1 else f"{cut.at}_{met[cut.at]}"
            yield Closure((frame_of(cut.first, cut.at), frame_of(cut.second, cut.at)), name=name)

    def coupling(self, gear: Gear) -> Coupling:
        """Return the coupling of a gear; it meshes as the links lie in the sketch.

        The angle of a link is the sum of the coordinates of the hinges that lead to it, so that for angles counted on
        the carrier: driven - carrier = ratio (driver - carrier) + constant.
        """
        ratios: dict[str, float] = {}
        for link, factor in ((gear.driven, 1.0), (gear.driver, -gear.ratio), (gear.carrier, gear.ratio - 1.0)):
            for joint in self.hinges(link):
                ratios[joint] = ratios.get(joint, 0.0) + factor
        ratios = {joint: c for joint, c in ratios.items() if c}
        name = f"{gear.driver}_{gear.driven}"
        if not ratios:
            raise InvalidInputError(f"gear {name}", gear.ratio, "ties nothing: both turn alike as it is")
        at = dict(zip(list(self.model.names)[1:], self.home, strict=True))
        return Coupling(ratios, sum(c * at[joint] for joint, c in ratios.items()), name=name)

    def hinges(self, link: str) -> list[str]:
        """Return the hinges from the ground to a link."""
        above = {e.child: e for e in self.tree.edges}
        found = []
        while link in above:
            if above[link].at:
                found.append(link)
            link = above[link].parent
        return found

    def driven(self, motor: Motor) -> str:
        """Return the joint that a motor drives."""
        return next(
            e.child for e in self.tree.edges if {e.parent, e.child} == {motor.link, motor.on} and e.at == motor.at
        )

    def bodies(self, lumps: Iterable[Lump]) -> Iterable[Body]:
        for link in self.links.values():
            section, frames = link.section, tuple(frame_of(link.name, point) for point in link.points)
            if section is None:
                continue
            if section.plate:
                yield PlateBody(frames, section.density, section.thickness, section.width)
                continue
            line = section.linear_density
            density = section.density * section.width * section.thickness if line is None else line
            for ends in pairwise(frames):
                yield BarBody(ends, density, section.width, section.thickness)
        for lump in lumps:
            centre = (lump.centre.real, lump.centre.imag, 0.0)
            yield LumpBody((frame_of(lump.link, lump.at),), lump.mass, centre, lump.inertia)

    def visuals(self, model: pin.Model, bodies: Iterable[Body]) -> Iterable[Visual]:
        for body in bodies:
            frames = [model.frames[model.getFrameId(name)] for name in body.frames]
            j = frames[0].parentJoint
            poses = np.stack([np.array(frame.placement.homogeneous) for frame in frames])
            link = f"{model.names[j]}_link" if j else GROUND
            for size, pose in body.drawn(poses):
                yield Visual(link, "box", size, pose, _COLOURS[(j - 1) % len(_COLOURS)])
        for link_ in self.links.values():
            if link_.guide is not None:
                j = model.getJointId(link_.name)
                frame = frame_of(link_.name, link_.points[0])
                yield Visual(frame, "box", _BLOCK, np.eye(4), _COLOURS[(j - 1) % len(_COLOURS)])

    def spring(self, spring: PointSpring) -> Spring:
        """Return a spring between links that are not the same one."""
        one, other = ([x.name for x in self.links.values() if point in x.points] for point in spring.ends)
        for point, links in zip(spring.ends, (one, other), strict=True):
            if not links:
                raise InvalidInputError(f"point {point} of a spring", spring.ends, "must belong to a bar or the ground")
        shared = next((link for link in one if link in other), None)
        if shared is not None:
            raise InvalidInputError(
                "spring between points", spring.ends, f"joins two points of one bar ({shared}): it does nothing"
            )
        pairs = [(a, b) for a in one for b in other]
        ends = [frame_of(link, point) for link, point in zip(pairs[0], spring.ends, strict=True)]
        return Spring(ends[0], ends[1], spring.stiffness, spring.length, spring.damping)


def frame_of(link: str, point: str) -> str:
    """Return the name of the frame of a point on a link."""
    return f"{link}_{point}"
