"""Mechanisms with rods, sliding hinges and gears, for tests; each with a closed configuration."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
from mechanisms import AT_ORIGIN, TILTED, add, at, body, five_bar, four_bar, point

import fivebar_pin as fb
from fivebar_pin.closures import Coupling, Cylindrical, Distance, Weld

RATIO, OFFSET = 2.5, 1.4
SUN, PLANET = 24, 18  # teeth
RING = SUN + 2 * PLANET


def geared_five_bar(
    ratio: float = RATIO,
    *,
    base: pin.SE3 = AT_ORIGIN,
    joint: type = pin.JointModelRZ,
    driven: str = "left",
    offset: float = OFFSET,
    lengths: tuple[float, ...] = (0.3, 1.2, 1.0, 0.25, 0.9),
) -> tuple[fb.ClosedChain, np.ndarray]:
    """Return a five-bar whose cranks are geared, ratio q_left + q_right = offset, driven at one of them."""
    free = five_bar(lengths, base=base, joint=joint)
    gear = Coupling({"left": ratio, "right": 1.0}, offset, name="gear")
    chain = fb.ClosedChain(free.model, (*free.closures, gear), (driven,), name="geared five-bar")
    start = 0.9 if driven == "left" else offset - 0.9 * ratio
    return chain, fb.assembly_modes(chain, [start])[0]


def planetary_train(joint: type = pin.JointModelRUBZ, driven: str = "sun") -> fb.ClosedChain:
    """Return sun, carrier and a planet on it in a fixed ring: two couplings, one freedom."""
    model = pin.Model()
    model.name = "planetary"
    model.gravity.linear = np.array([0.0, -9.81, 0.0])
    add(model, 0, joint(), at(), "sun", body(1))
    carrier = add(model, 0, joint(), at(), "carrier", body(2))
    add(model, carrier, joint(), at(0.1), "planet", body(3))
    mesh = Coupling({"sun": SUN, "carrier": -SUN, "planet": PLANET}, name="sun mesh")
    ring = Coupling({"planet": PLANET, "carrier": RING}, name="ring mesh")
    return fb.ClosedChain(model, (mesh, ring), (driven,))


def rack_and_pinion() -> tuple[fb.ClosedChain, np.ndarray]:
    """Return a pinion of 0.05 m on the ground that drives a rack, metres and radians in one row."""
    model = pin.Model()
    model.name = "rack and pinion"
    model.gravity.linear = np.array([0.0, -9.81, 0.0])
    add(model, 0, pin.JointModelRZ(), at(), "pinion", body(1))
    add(model, 0, pin.JointModelPX(), at(0.0, 0.05, 0.0, (0.0, 0.0, 0.4)), "rack", body(2))
    chain = fb.ClosedChain(model, (Coupling({"rack": 1.0, "pinion": 0.05}, 0.02, name="teeth"),), ("pinion",))
    return chain, fb.assemble(chain, [0.3])


def rod_four_bar(*, base: pin.SE3 = AT_ORIGIN) -> tuple[fb.ClosedChain, np.ndarray]:
    """Return the four-bar with a rod without mass for its coupler."""
    full = four_bar(base=base)
    model = pin.Model()
    model.name = "rod four-bar"
    model.gravity.linear = np.array([0.3, -9.81, 0.4])
    crank = add(model, 0, pin.JointModelRZ(), base, "crank", body(1))
    rocker = add(model, 0, pin.JointModelRZ(), base * at(1.0), "rocker", body(3))
    ends = point(model, crank, "crank_end", at(0.4)), point(model, rocker, "rocker_end", at(0.9))
    chain = fb.ClosedChain(model, (Distance(ends, 1.1, name="rod"),), ("crank",))
    q = fb.assembly_modes(full, [0.9])[0]
    return chain, np.array([q[0], q[2]])


def spatial_rod() -> tuple[fb.ClosedChain, np.ndarray]:
    """Return two cranks about skew axes with a rod between them, RSSR, frames in arbitrary poses."""
    model = pin.Model()
    model.name = "RSSR with a rod"
    crank = add(model, 0, pin.JointModelRZ(), TILTED, "crank", body(1))
    where = TILTED * at(0.9, 0.3, -0.2, (0.9, 0.1, 0.2))
    rocker = add(model, 0, pin.JointModelRX(), where, "rocker", body(2))
    ends = (
        point(model, crank, "one", at(0.12, 0.06, 0.05, (0.3, 0.5, 0.1))),
        point(model, rocker, "two", at(0.1, 0.6, 0.4, (0.7, 0.2, 0.4))),
    )
    q = np.array([0.3, -1.5])
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    p1, p2 = (
        data.oMi[j].act(model.frames[model.getFrameId(f)].placement.translation)
        for j, f in zip((1, 2), ends, strict=True)
    )
    return fb.ClosedChain(model, (Distance(ends, float(np.linalg.norm(p2 - p1))),), ("crank",)), q


def sliding_hinge(*, explicit: bool = False) -> tuple[fb.ClosedChain, np.ndarray]:
    """Return the spatial loop crank, ball, cylindrical pair, rocker, closed at the cylindrical pair.

    With `explicit` the pair is a hinge and a slide of the tree without mass, closed by a weld.
    """
    model = pin.Model()
    model.name = "RSCR"
    model.gravity.linear = np.array([0.3, -9.81, 0.4])
    base = TILTED
    crank = add(model, 0, pin.JointModelRZ(), base, "crank", body(1))
    ball = add(model, crank, pin.JointModelSpherical(), at(0.3, 0.1, 0.0, (0.2, 0.5, 0.1)), "ball", body(2))
    rocker = add(model, 0, pin.JointModelRX(), base * at(0.8, 0.5, 0.1, (0.1, 0.4, 0.9)), "rocker", body(3))
    q = np.r_[0.4, pin.Quaternion(pin.rpy.rpyToMatrix(-0.3, 0.6, 0.2)).coeffs(), 0.7]
    turn, slide = 0.5, 0.12
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    on_ball = at(0.2, 0.15, 0.1, (0.5, 0.8, -0.6))
    there = data.oMi[ball] * on_ball * at(0.0, 0.0, slide, (0.0, 0.0, turn))
    on_rocker = data.oMi[rocker].actInv(there)
    if not explicit:
        frames = point(model, ball, "sleeve", on_ball), point(model, rocker, "shaft", on_rocker)
        return fb.ClosedChain(model, (Cylindrical(frames, name="pair"),), ("crank",)), q
    hinge = model.addJoint(ball, pin.JointModelRZ(), on_ball, "pair turn")
    sleeve = model.addJoint(hinge, pin.JointModelPZ(), at(), "pair slide")
    frames = point(model, sleeve, "sleeve", at()), point(model, rocker, "shaft", on_rocker)
    order = [model.idx_qs[model.getJointId(name)] for name in ("crank", "ball", "pair turn", "pair slide", "rocker")]
    q_all = np.zeros(model.nq)
    for start, values in zip(order, (q[:1], q[1:5], [turn], [slide], q[5:]), strict=True):
        q_all[start : start + len(values)] = values
    return fb.ClosedChain(model, (Weld(frames, name="pair"),), ("crank",)), q_all


def planar_sliding(offset: float = 0.3) -> tuple[fb.ClosedChain, np.ndarray]:
    """Return the planar four-bar whose last hinge may slide, its links offset along it."""
    full = four_bar()
    model = full.model.copy()
    model.gravity.linear = np.array([0.3, -9.81, 0.4])
    names = full.closures[0].ends[0], point(model, 3, "rocker_end_above", at(0.9, 0.0, offset))
    chain = fb.ClosedChain(model, (Cylindrical(names, name="pin"),), ("crank",))
    return chain, fb.assembly_modes(full, [0.9])[0]


EXAMPLES: dict[str, Callable[[], tuple[fb.ClosedChain, np.ndarray]]] = {
    "geared five-bar": geared_five_bar,
    "geared five-bar, tilted, driven from the right": lambda: geared_five_bar(
        3.7, base=TILTED, joint=pin.JointModelRUBZ, driven="right"
    ),
    "planetary train": lambda: (planetary_train(), np.zeros(3)),
    "rack and pinion": rack_and_pinion,
    "rod four-bar": rod_four_bar,
    "rod four-bar, tilted": lambda: rod_four_bar(base=TILTED),
    "rod in space": spatial_rod,
    "sliding hinge": sliding_hinge,
    "planar sliding hinge": planar_sliding,
}
