"""Small mechanisms built in memory, for tests.

Every builder takes `base`, the pose of the whole mechanism in the world, so that each can be tilted and moved; the
bodies have inertias without any symmetry. Closures made by `close_at` join frames in arbitrary poses on both bodies.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

import fivebar_pin as fb

AT_ORIGIN = pin.SE3.Identity()
TILTED = pin.SE3(pin.rpy.rpyToMatrix(0.7, -0.4, 1.1), np.array([0.3, -0.2, 0.5]))
_FAR = 1e4


def body(seed: int = 0, *, mass: float = 1.0, size: float = 0.3) -> pin.Inertia:
    """Return the inertia of a body without symmetry: a few point masses near the joint."""
    rng = np.random.default_rng(seed)
    total = pin.Inertia.Zero()
    for _ in range(6):
        at = size * rng.uniform(-1.0, 1.0, 3)
        total = total + pin.Inertia(mass / 6.0, at, np.zeros((3, 3)))
    return total


def at(x: float = 0.0, y: float = 0.0, z: float = 0.0, rpy: Sequence[float] = (0.0, 0.0, 0.0)) -> pin.SE3:
    """Return a pose."""
    return pin.SE3(pin.rpy.rpyToMatrix(*rpy), np.array([x, y, z]))


def add(model: pin.Model, parent: int, joint: object, placement: pin.SE3, name: str, inertia: pin.Inertia) -> int:
    """Add a joint with wide limits and its body; the body's frame is `<name>_body`."""
    nq, nv = joint.nq, joint.nv  # type: ignore[attr-defined]
    index = model.addJoint(
        parent, joint, placement, name, np.full(nv, 1e6), np.full(nv, 1e6), np.full(nq, -_FAR), np.full(nq, _FAR)
    )
    model.appendBodyToJoint(index, inertia, pin.SE3.Identity())
    model.addBodyFrame(f"{name}_body", index, pin.SE3.Identity(), model.addJointFrame(index))
    return int(index)


def point(model: pin.Model, joint: int, name: str, placement: pin.SE3) -> str:
    """Add a frame that a closure can use."""
    model.addFrame(pin.Frame(name, joint, 0, placement, pin.FrameType.OP_FRAME))
    return name


def close_at(
    model: pin.Model, q: np.ndarray, joints: tuple[int, int], kind: str, where: pin.SE3, seed: int = 5
) -> fb.Closure:
    """Return a closure that is closed at q: its frames meet at the world pose `where`, but for what it leaves free."""
    rng = np.random.default_rng(seed)
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    axis = np.array([0.0, 0.0, 1.0])
    free = {"6d": np.eye(3), "revolute": pin.exp3(axis * rng.uniform(0.3, 1.0))}.get(kind, pin.exp3(rng.normal(size=3)))
    names = []
    for k, (joint, turn) in enumerate(zip(joints, (np.eye(3), free), strict=True)):
        target = pin.SE3(where.rotation @ turn, where.translation)
        names.append(point(model, joint, f"cut{k}_{joint}_{len(model.frames)}", data.oMi[joint].actInv(target)))
    return fb.Closure((names[0], names[1]), kind, axis)


def five_bar(
    lengths: Sequence[float] = (0.5, 1.2, 1.0, 0.6, 0.9),
    *,
    base: pin.SE3 = AT_ORIGIN,
    kind: str = "3d",
    gravity: Sequence[float] = (0.3, -9.81, 0.4),
    joint: type = pin.JointModelRZ,
) -> fb.ClosedChain:
    """Return a planar five-bar, a1 .. a5, driven at both grounded joints `left` and `right`."""
    a1, a2, a3, a4, a5 = lengths
    model = pin.Model()
    model.name = "five_bar"
    left = add(model, 0, joint(), base, "left", body(1))
    left2 = add(model, left, joint(), at(a1), "left_elbow", body(2))
    right = add(model, 0, joint(), base * at(a5), "right", body(3))
    right2 = add(model, right, joint(), at(a4), "right_elbow", body(4))
    point(model, left2, "tip_left", at(a2))
    point(model, right2, "tip_right", at(a3))
    model.gravity.linear = np.array(gravity)
    return fb.ClosedChain(model, (fb.Closure(("tip_left", "tip_right"), kind, name="tip"),), ("left", "right"))


def four_bar(
    lengths: Sequence[float] = (0.4, 1.1, 0.9, 1.0),
    *,
    base: pin.SE3 = AT_ORIGIN,
    kind: str = "3d",
    joint: type = pin.JointModelRZ,
) -> fb.ClosedChain:
    """Return a planar four-bar (crank, coupler, rocker, ground), driven at the crank; a crank-rocker by default."""
    a, b, c, d = lengths
    model = pin.Model()
    model.name = "four_bar"
    crank = add(model, 0, joint(), base, "crank", body(1))
    coupler = add(model, crank, joint(), at(a), "coupler", body(2))
    rocker = add(model, 0, joint(), base * at(d), "rocker", body(3))
    point(model, coupler, "coupler_end", at(b))
    point(model, rocker, "rocker_end", at(c))
    return fb.ClosedChain(model, (fb.Closure(("coupler_end", "rocker_end"), kind, name="pin"),), ("crank",))


def parallelogram() -> fb.ClosedChain:
    """Return a four-bar with equal opposite sides: it lies flat at crank = 0, where two assembly modes meet."""
    return four_bar((0.5, 1.0, 0.5, 1.0))


def welded_four_bar(*, base: pin.SE3 = AT_ORIGIN) -> fb.ClosedChain:
    """Return the four-bar as a serial chain of four hinges whose last body is welded to the ground (6d)."""
    model = pin.Model()
    model.name = "welded_four_bar"
    joint, where = 0, base
    for k, (name, x) in enumerate((("crank", 0.0), ("coupler", 0.4), ("rocker", 1.1), ("ground", 0.9))):
        joint = add(model, joint, pin.JointModelRZ(), where if k == 0 else at(x), name, body(k + 1))
    q = four_bar_angles(0.8)
    closure = close_at(model, q, (0, joint), "6d", base * at(1.0, 0.0, 0.0, (0.4, 0.9, -0.3)))
    return fb.ClosedChain(model, (closure,), ("crank",))


def four_bar_angles(crank: float, lengths: Sequence[float] = (0.4, 1.1, 0.9, 1.0)) -> np.ndarray:
    """Return the four relative angles of the serial four-bar, by elementary geometry."""
    a, b, c, d = lengths
    A, D = a * np.exp(1j * crank), complex(d)
    r = abs(D - A)
    along = (r * r + b * b - c * c) / (2.0 * r)
    B = A + (D - A) / r * (along + 1j * np.sqrt(b * b - along * along))
    coupler, rocker = np.angle(B - A), np.angle(D - B)
    return np.array([crank, coupler - crank, rocker - coupler, -rocker])


def slider_crank(*, base: pin.SE3 = AT_ORIGIN, kind: str = "3d") -> fb.ClosedChain:
    """Return a slider-crank with an offset, driven at the crank; the slider is a prismatic joint of the tree."""
    model = pin.Model()
    model.name = "slider_crank"
    crank = add(model, 0, pin.JointModelRZ(), base, "crank", body(1))
    rod = add(model, crank, pin.JointModelRZ(), at(0.3), "rod", body(2))
    slider = add(model, 0, pin.JointModelPX(), base * at(0.1, 0.05), "slider", body(3))
    point(model, rod, "rod_end", at(0.8))
    point(model, slider, "slider_pin", at(0.2))
    return fb.ClosedChain(model, (fb.Closure(("rod_end", "slider_pin"), kind, name="wrist"),), ("crank",))


def rssr(*, base: pin.SE3 = AT_ORIGIN, ball: bool = False) -> fb.ClosedChain:
    """Return a spatial four-bar with skew axes and a point closure.

    The coupler hangs on the crank by a universal joint (mobility 1) or, with `ball`, by a spherical joint: then it
    may spin about its own length (mobility 2).
    """
    model = pin.Model()
    model.name = "rssr"
    crank = add(model, 0, pin.JointModelRZ(), base, "crank", body(1))
    if ball:
        coupler = add(model, crank, pin.JointModelSpherical(), at(0.2, 0.0, 0.05), "coupler", body(2))
        q = np.r_[0.3, pin.Quaternion(pin.rpy.rpyToMatrix(0.2, 0.3, 0.4)).coeffs(), 0.5]
    else:
        cross = add(model, crank, pin.JointModelRY(), at(0.2, 0.0, 0.05), "cross", body(5, mass=0.1))
        coupler = add(model, cross, pin.JointModelRZ(), at(), "coupler", body(2))
        q = np.array([0.3, 0.2, 0.4, 0.5])
    rocker = add(
        model,
        0,
        pin.JointModelRevoluteUnaligned(np.array([0.0, 0.6, 0.8])),
        base * at(0.9, 0.3, -0.2, (0.3, 0.1, 0.2)),
        "rocker",
        body(3),
    )
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    end = data.oMi[coupler].act(np.array([0.9, 0.05, 0.1]))
    closure = close_at(model, q, (coupler, rocker), "3d", pin.SE3(np.array(TILTED.rotation), end))
    return fb.ClosedChain(model, (closure,), ("crank",))


def rscr(*, base: pin.SE3 = AT_ORIGIN) -> tuple[fb.ClosedChain, np.ndarray]:
    """Return a spatial loop crank, ball, cylindrical pair, closed by a hinge (revolute closure), and a closed q."""
    model = pin.Model()
    model.name = "rscr"
    crank = add(model, 0, pin.JointModelRZ(), base, "crank", body(1))
    ball = add(model, crank, pin.JointModelSpherical(), at(0.3, 0.1, 0.0, (0.2, 0.5, 0.1)), "ball", body(2))
    turn = add(model, 0, pin.JointModelRX(), base * at(0.8, 0.5, 0.1, (0.1, 0.4, 0.9)), "turn", body(3))
    slide = add(model, turn, pin.JointModelPX(), at(0.1), "slide", body(4))
    q = np.r_[0.4, pin.Quaternion(pin.rpy.rpyToMatrix(-0.3, 0.6, 0.2)).coeffs(), 0.7, 0.15]
    closure = close_at(model, q, (ball, slide), "revolute", base * at(0.7, 0.2, 0.3, (0.5, 0.8, -0.6)))
    return fb.ClosedChain(model, (closure,), ("crank",)), q


def scapula(*, base: pin.SE3 = AT_ORIGIN) -> tuple[fb.ClosedChain, np.ndarray]:
    """Return a plate that rolls on an ellipsoid, held by three driven legs (universal joint, slide, ball), and q."""
    model = pin.Model()
    model.name = "scapula"
    plate = add(model, 0, pin.JointModelEllipsoid(0.3, 0.2, 0.45), base, "plate", body(1))
    q, legs = [0.2, -0.3, 0.4], []
    for k in range(3):
        foot = base * at(0.87 * np.cos(2.1 * k), 0.87 * np.sin(2.1 * k), -0.09, (0.8, 0.0, 2.1 * k + 0.1))
        cross = add(model, 0, pin.JointModelUniversal(*np.eye(3)[:2]), foot, f"foot{k}", body(2 + k))
        legs.append(add(model, cross, pin.JointModelPZ(), at(), f"leg{k}", body(5 + k)))
        q += [0.1, 0.2, 0.7]
    q = np.array(q)
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    ends = [pin.SE3(np.eye(3), np.array(data.oMi[leg].translation)) for leg in legs]
    closures = [close_at(model, q, (leg, plate), "3d", end) for leg, end in zip(legs, ends, strict=True)]
    return fb.ClosedChain(model, closures, tuple(f"leg{k}" for k in range(3))), q


def bennett() -> tuple[fb.ClosedChain, np.ndarray]:
    """Return Bennett's overconstrained 4R loop (mobility 1 against -2 by count), and a closed q.

    Opposite sides are equal, a / sin(alpha) = b / sin(beta); the last hinge is the closure.
    """
    a, alpha, beta = 1.0, 0.9, 0.5
    b = a * np.sin(beta) / np.sin(alpha)
    model = pin.Model()
    model.name = "bennett"
    joint, where = 0, at()
    for k, name in enumerate(("first", "second", "third")):
        joint = add(model, joint, pin.JointModelRZ(), where, name, body(k + 1))
        length, twist = ((a, alpha), (b, beta))[k % 2]
        where = at(length, 0.0, 0.0, (twist, 0.0, 0.0))
    point(model, joint, "hinge_moving", at(a, 0.0, 0.0, (alpha, 0.0, 0.0)))
    # The fourth link carries the first hinge: ground frame of the fourth hinge seen from the first one.
    point(model, 0, "hinge_ground", at(b, 0.0, 0.0, (beta, 0.0, 0.0)).inverse())
    theta = 1.1
    other = 2.0 * np.arctan2(np.sin(0.5 * (beta + alpha)), np.sin(0.5 * (beta - alpha)) * np.tan(0.5 * theta))
    q = np.array([theta, other, -theta])
    closure = fb.Closure(("hinge_ground", "hinge_moving"), "revolute", name="hinge")
    return fb.ClosedChain(model, (closure,), ("first",)), q


def spherical_four_bar(arcs: Sequence[float], *, kind: str = "3d", base: pin.SE3 = AT_ORIGIN) -> fb.ClosedChain:
    """Return a spherical four-bar of the given arcs (crank, coupler, rocker, ground) [rad], driven at the crank.

    Its closure has three rows that are independent off the sphere for two passive coordinates.
    """
    a, b, c, d = arcs
    out = at(z=0.5)
    model = pin.Model()
    model.name = "spherical_four_bar"
    crank = add(model, 0, pin.JointModelRZ(), base, "crank", body(1))
    coupler = add(model, crank, pin.JointModelRZ(), at(rpy=(a, 0.0, 0.0)), "coupler", body(2))
    rocker = add(model, 0, pin.JointModelRZ(), base * at(rpy=(d, 0.0, 0.0)), "rocker", body(3))
    point(model, coupler, "coupler_end", at(rpy=(b, 0.0, 0.0)) * out)
    point(model, rocker, "rocker_end", at(rpy=(c, 0.0, 0.0)) * out)
    return fb.ClosedChain(model, (fb.Closure(("coupler_end", "rocker_end"), kind, name="pin"),), ("crank",))


def double_four_bar() -> fb.ClosedChain:
    """Return the double four-bar: three uprights 1 m apart, two couplers, uniform rods of 1 m and 1 kg, two loops.

    Upright at uprights = pi / 2, couplers relative -pi / 2; flat at q = 0.
    """
    rod = pin.Inertia(1.0, np.array([0.5, 0.0, 0.0]), np.diag([0.0, 1.0, 1.0]) / 12.0)
    model = pin.Model()
    model.name = "double_four_bar"
    model.gravity.linear = np.array([0.0, -9.81, 0.0])
    uprights = [add(model, 0, pin.JointModelRZ(), at(float(k)), f"upright{k}", rod) for k in range(2)]
    closures = []
    for k in range(2):
        coupler = add(model, uprights[k], pin.JointModelRZ(), at(1.0), f"coupler{k}", rod)
        point(model, coupler, f"coupler{k}_end", at(1.0))
    uprights.append(add(model, 0, pin.JointModelRZ(), at(2.0), "upright2", rod))
    for k in range(2):
        point(model, uprights[k + 1], f"upright{k + 1}_end", at(1.0))
        closures.append(fb.Closure((f"coupler{k}_end", f"upright{k + 1}_end"), "3d", name=f"pin{k}"))
    return fb.ClosedChain(model, closures, ("upright0",))


def side_by_side(*lengths: Sequence[float], apart: float = 3.0, tilt: pin.SE3 = AT_ORIGIN) -> fb.ClosedChain:
    """Return planar four-bars in one model that share nothing but the ground, `apart` from each other [m]."""
    model = pin.Model()
    model.name = "side_by_side"
    closures, cranks = [], []
    for k, (a, b, c, d) in enumerate(lengths):
        base = tilt * at(apart * k)
        crank = add(model, 0, pin.JointModelRZ(), base, f"crank{k}", body(3 * k + 1))
        coupler = add(model, crank, pin.JointModelRZ(), at(a), f"coupler{k}", body(3 * k + 2))
        rocker = add(model, 0, pin.JointModelRZ(), base * at(d), f"rocker{k}", body(3 * k + 3))
        point(model, coupler, f"coupler_end{k}", at(b))
        point(model, rocker, f"rocker_end{k}", at(c))
        closures.append(fb.Closure((f"coupler_end{k}", f"rocker_end{k}"), "3d", name=f"pin{k}"))
        cranks.append(f"crank{k}")
    return fb.ClosedChain(model, tuple(closures), tuple(cranks))
