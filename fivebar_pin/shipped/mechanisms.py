"""The mechanisms that ship, as functions; `save_mechanisms` makes the files of the urdf folder from them.

Every one has an assembled configuration "home" among its model's reference configurations. Planar mechanisms lie in
the x-y plane with gravity along -y, unless they say otherwise.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import pinocchio as pin

from fivebar_pin import paper
from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain
from fivebar_pin.closures import Closure
from fivebar_pin.errors import FileFormatError, UnknownNameError
from fivebar_pin.io import load, save
from fivebar_pin.shipped.tree_builder import TreeBuilder, dyad, universal_angles, wrapped

__all__ = [
    "MECHANISMS",
    "delta",
    "five_bar_case_I",
    "five_bar_case_II",
    "four_bar_antiparallelogram",
    "four_bar_crank_rocker",
    "four_bar_parallelogram",
    "four_bar_reactionless",
    "planar_3rrr",
    "save_mechanisms",
    "six_bar_stephenson",
    "six_bar_watt",
    "slider_crank",
    "solo_legs",
    "spatial_rssr",
]


def five_bar_case_I() -> ClosedChain:
    """Return the paper's five-bar, case I, before balancing."""
    return _five_bar("I")


def five_bar_case_II() -> ClosedChain:
    """Return the paper's five-bar, case II, before balancing."""
    return _five_bar("II")


def _five_bar(case: str) -> ClosedChain:
    linkage = paper.table_1(case, "unbalanced")
    chain = linkage.chain()
    model = chain.model.copy()
    model.referenceConfigurations["home"] = linkage.configuration(0.0, np.pi / 3.0, mode=paper.AssemblyMode.LEFT)
    return ClosedChain(model, chain.closures, chain.actuated, name=f"five_bar_case_{case}", visuals=chain.visuals)


def four_bar_crank_rocker() -> ClosedChain:
    """Return a crank-rocker four-bar: the crank turns right round (0.1 + 0.4 < 0.35 + 0.3 m, Grashof)."""
    return _four_bar("four_bar_crank_rocker", (0.1, 0.35, 0.3, 0.4), side=1.0)


def four_bar_parallelogram() -> ClosedChain:
    """Return a parallelogram four-bar; it branches where its bars lie in line."""
    return _four_bar("four_bar_parallelogram", (0.15, 0.4, 0.15, 0.4), side=1.0)


def four_bar_antiparallelogram() -> ClosedChain:
    """Return an antiparallelogram (crossed) four-bar of uniform bars."""
    return _four_bar("four_bar_antiparallelogram", (0.1, 0.3, 0.1, 0.3), side=-1.0)


def four_bar_reactionless() -> ClosedChain:
    """Return the antiparallelogram whose shaking force and moment vanish without any counter-rotation.

    The bars have 1, 0.6, 1 kg, mass centres at -0.03, 0.15, -0.03 m along them, and 0.0051, 0.0045, 0.0051 kg m2
    about these; they are taken as flat bodies.
    """
    chain = _four_bar("four_bar_reactionless", (0.1, 0.3, 0.1, 0.3), side=-1.0)
    bodies = {"crank": (1.0, -0.03, 0.0051), "coupler": (0.6, 0.15, 0.0045), "rocker": (1.0, -0.03, 0.0051)}
    return chain.with_inertias(
        {
            joint: pin.Inertia(mass, np.array([x, 0.0, 0.0]), np.diag([0.5 * inertia, 0.5 * inertia, inertia]))
            for joint, (mass, x, inertia) in bodies.items()
        }
    )


def _four_bar(name: str, lengths: tuple[float, float, float, float], side: float) -> ClosedChain:
    crank, coupler, rocker, ground = lengths
    m = TreeBuilder(name)
    m.bar("crank", "", (0.0, 0.0, 0.0), crank)
    m.bar("coupler", "crank", (crank, 0.0, 0.0), coupler)
    m.bar("rocker", "", (ground, 0.0, 0.0), rocker)
    m.point("B_coupler", "coupler", (coupler, 0.0, 0.0))
    m.point("B_rocker", "rocker", (rocker, 0.0, 0.0))
    angle = np.pi / 3.0
    along, back = dyad(crank * np.exp(1j * angle), ground, coupler, rocker, side)
    return m.chain(
        [("B", "B_coupler", "B_rocker")], ("crank",), {"crank": angle, "coupler": along - angle, "rocker": back}
    )


def slider_crank() -> ClosedChain:
    """Return an offset slider-crank: the slider runs along x, 0.02 m above the crank's pivot."""
    crank, rod, offset, angle = 0.1, 0.3, 0.02, np.pi / 3.0
    m = TreeBuilder("slider_crank")
    m.bar("crank", "", (0.0, 0.0, 0.0), crank)
    m.bar("rod", "crank", (crank, 0.0, 0.0), rod)
    m.joint("slider", at=(0.0, offset, 0.0), kind=pin.JointModelPX(), limit=1.0)
    m.box("slider", (-0.03, 0.0, 0.0), (0.03, 0.0, 0.0), width=0.04, thickness=0.03)
    m.point("B_rod", "rod", (rod, 0.0, 0.0))
    m.point("B_slider", "slider", (0.0, 0.0, 0.0))
    x, y = crank * np.cos(angle), crank * np.sin(angle) - offset
    lean = -float(np.arcsin(y / rod))
    home = {"crank": angle, "rod": lean - angle, "slider": float(x + rod * np.cos(lean))}
    return m.chain([("B", "B_rod", "B_slider")], ("crank",), home)


def six_bar_watt() -> ClosedChain:
    """Return a Watt six-bar: a four-bar whose coupler and rocker, neighbours, each carry one bar of a dyad."""
    m, home, start = _crank_and_coupler("six_bar_watt")
    m.bar("strut", "coupler", (*_CORNER, 0.0), 0.22)
    m.joint("rocker", at=(0.4, 0.0, 0.0))
    _plate(m, "rocker", 0.3, (0.2, -0.16))
    m.bar("output", "rocker", (0.2, -0.16, 0.0), 0.2)
    end = 0.4 + np.exp(1j * home["rocker"]) * complex(0.2, -0.16)
    first, second = dyad(start, end, 0.22, 0.2, 1.0)
    home |= {"strut": first - home["crank"] - home["coupler"], "output": second - home["rocker"]}
    return _six_bar(m, home, 0.22, 0.2)


def six_bar_stephenson() -> ClosedChain:
    """Return a Stephenson six-bar: a four-bar whose coupler drives a rocker on the ground through one more bar."""
    m, home, start = _crank_and_coupler("six_bar_stephenson")
    m.bar("strut", "coupler", (*_CORNER, 0.0), 0.3)
    m.bar("output", "", (0.55, 0.2, 0.0), 0.18)
    m.bar("rocker", "", (0.4, 0.0, 0.0), 0.3)
    first, second = dyad(start, complex(0.55, 0.2), 0.3, 0.18, 1.0)
    home |= {"strut": first - home["crank"] - home["coupler"], "output": second}
    return _six_bar(m, home, 0.3, 0.18)


_CORNER = (0.2, 0.12)
"""Third point of the six-bars' coupler, in its axes [m]."""


def _crank_and_coupler(name: str) -> tuple[TreeBuilder, dict[str, float], complex]:
    """Return crank and ternary coupler, the home of the four-bar they belong to, and where the third point then is."""
    angle = np.pi / 3.0
    m = TreeBuilder(name)
    m.bar("crank", "", (0.0, 0.0, 0.0), 0.1)
    m.joint("coupler", "crank", at=(0.1, 0.0, 0.0))
    _plate(m, "coupler", 0.35, _CORNER)
    elbow = complex(0.1 * np.exp(1j * angle))
    along, back = dyad(elbow, 0.4, 0.35, 0.3, 1.0)
    corner = elbow + complex(np.exp(1j * along)) * complex(*_CORNER)
    return m, {"crank": angle, "coupler": along - angle, "rocker": back}, corner


def _plate(m: TreeBuilder, joint: str, length: float, corner: tuple[float, float]) -> None:
    """Give a joint's link a bar along x and an arm from its middle to a third point."""
    m.box(joint, (0.0, 0.0, 0.0), (length, 0.0, 0.0), width=0.02, thickness=0.01)
    m.box(joint, (corner[0], 0.0, 0.0), (*corner, 0.0), width=0.02, thickness=0.01)


def _six_bar(m: TreeBuilder, home: dict[str, float], strut: float, output: float) -> ClosedChain:
    ends = {"B_coupler": 0.35, "B_rocker": 0.3, "G_strut": strut, "G_output": output}
    for name, length in ends.items():
        m.point(name, name[2:], (length, 0.0, 0.0))
    return m.chain([("B", "B_coupler", "B_rocker"), ("G", "G_strut", "G_output")], ("crank",), home)


def planar_3rrr() -> ClosedChain:
    """Return the planar 3-RRR parallel robot, lying flat (gravity along -z), its three base joints driven."""
    corners = [0.35 * np.exp(1j * (np.pi / 2.0 + 2.0 * np.pi * k / 3.0)) for k in range(3)]
    arms = [0.12 * np.exp(1j * (np.pi / 2.0 + 2.0 * np.pi * k / 3.0)) for k in range(3)]
    heading, centre = 0.2, complex(0.02, 0.01)
    m = TreeBuilder("planar_3rrr", gravity=(0.0, 0.0, -9.81))
    home: dict[str, float] = {}
    loops = []
    for k, corner in enumerate(corners):
        upper, lower = f"upper_{k + 1}", f"lower_{k + 1}"
        m.bar(upper, "", (corner.real, corner.imag, 0.0), 0.2)
        m.bar(lower, upper, (0.2, 0.0, 0.0), 0.22)
        target = centre + np.exp(1j * heading) * arms[k]
        first, second = dyad(corner, target, 0.2, 0.22, 1.0)
        home |= {upper: first, lower: second + np.pi - first}
        if k == 0:
            m.joint("platform", lower, at=(0.22, 0.0, 0.0))
            home["platform"] = heading - (second + np.pi)
            for arm in arms:
                end = arm - arms[0]
                if end:
                    m.box("platform", (0.0, 0.0, 0.0), (end.real, end.imag, 0.0), width=0.03, thickness=0.01)
        else:
            end = arms[k] - arms[0]
            m.point(f"P{k + 1}_platform", "platform", (end.real, end.imag, 0.0))
            m.point(f"P{k + 1}_{lower}", lower, (0.22, 0.0, 0.0))
            loops.append((f"P{k + 1}", f"P{k + 1}_platform", f"P{k + 1}_{lower}"))
    return m.chain(loops, ("upper_1", "upper_2", "upper_3"), home)


def spatial_rssr() -> ClosedChain:
    """Return a spatial four-bar RSSR: crank about z, rocker about a skew axis, a rod with a ball joint at its end.

    At the crank the rod sits on a universal joint in place of a ball, so that it cannot spin about itself.
    """
    crank, rod, rocker = 0.1, 0.35, 0.25
    base, axes = np.array([0.3, 0.05, 0.1]), np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    m = TreeBuilder("spatial_rssr", gravity=(0.0, 0.0, -9.81))
    m.bar("crank", "", (0.0, 0.0, 0.0), crank)
    m.joint("rod_y", "crank", at=(crank, 0.0, 0.0), kind=pin.JointModelRY())
    m.joint("rod_z", "rod_y")
    m.box("rod_z", (0.0, 0.0, 0.0), (rod, 0.0, 0.0), width=0.015, thickness=0.015)
    m.joint("rocker", at=base, axes=axes)
    m.box("rocker", (0.0, 0.0, 0.0), (rocker, 0.0, 0.0), width=0.02, thickness=0.01)
    m.point("B_rod", "rod_z", (rod, 0.0, 0.0))
    m.point("B_rocker", "rocker", (rocker, 0.0, 0.0))
    angle = 0.8
    ball = crank * np.array([np.cos(angle), np.sin(angle), 0.0])
    # |base + rocker (c x + s y) - ball| = rod is  a c + b s = h
    gap = base - ball
    a, b = 2.0 * rocker * gap @ axes[:, 0], 2.0 * rocker * gap @ axes[:, 1]
    h = rod**2 - rocker**2 - gap @ gap
    swing = float(np.arctan2(b, a) + np.arccos(h / np.hypot(a, b)))
    tip = base + rocker * (np.cos(swing) * axes[:, 0] + np.sin(swing) * axes[:, 1])
    turned = np.array([[np.cos(angle), np.sin(angle), 0.0], [-np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    y, z = universal_angles(turned @ (tip - ball) / rod)
    return m.chain([("B", "B_rod", "B_rocker")], ("crank",), {"crank": angle, "rod_y": y, "rod_z": z, "rocker": swing})


def delta() -> ClosedChain:
    """Return a Delta robot: three driven arms, three rods, a platform that only translates.

    The two parallel bars of a forearm count as one rod on a universal joint; that the platform keeps its orientation,
    which they enforce in the machine, is built in: it hangs on three sliding joints.
    """
    base, arm, rod, plate, drop = 0.15, 0.2, 0.4, 0.05, 0.4
    m = TreeBuilder("delta", gravity=(0.0, 0.0, -9.81))
    start, end = complex(base, 0.0), complex(plate, drop)  # radius and depth of a leg's ends
    angle, _ = dyad(start, end, arm, rod, -1.0)
    lean = float(np.angle(end - start - arm * np.exp(1j * angle)))
    home: dict[str, float] = {}
    swing = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # x outwards, y down
    around = [_about_z(2.0 * np.pi * k / 3.0) for k in range(3)]
    for k, R in enumerate(around, start=1):
        m.joint(f"arm_{k}", at=R[:, 0] * base, axes=R @ swing)
        m.box(f"arm_{k}", (0.0, 0.0, 0.0), (arm, 0.0, 0.0), width=0.03, thickness=0.015)
        m.joint(f"rod_{k}_swing", f"arm_{k}", at=(arm, 0.0, 0.0))
        m.joint(f"rod_{k}_tilt", f"rod_{k}_swing", kind=pin.JointModelRY())
        m.box(f"rod_{k}_tilt", (0.0, 0.0, 0.0), (rod, 0.0, 0.0), width=0.012, thickness=0.012)
        m.point(f"P{k}_rod", f"rod_{k}_tilt", (rod, 0.0, 0.0))
        home |= {f"arm_{k}": angle, f"rod_{k}_swing": lean - angle, f"rod_{k}_tilt": 0.0}
    m.joint("slide_x", kind=pin.JointModelPX(), limit=1.0)
    m.joint("slide_y", "slide_x", kind=pin.JointModelPY(), limit=1.0)
    m.joint("slide_z", "slide_y", kind=pin.JointModelPZ(), limit=1.0)
    m.box("slide_z", (-plate, 0.0, 0.0), (plate, 0.0, 0.0), width=2.0 * plate, thickness=0.01)
    for k, R in enumerate(around, start=1):
        m.point(f"P{k}_platform", "slide_z", R[:, 0] * plate)
    home |= {"slide_x": 0.0, "slide_y": 0.0, "slide_z": -drop}
    loops = [(f"P{k}", f"P{k}_platform", f"P{k}_rod") for k in (1, 2, 3)]
    return m.chain(loops, ("arm_1", "arm_2", "arm_3"), home)


def _about_z(angle: float) -> Array:
    c, s = float(np.cos(angle)), float(np.sin(angle))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def solo_legs(sides: Iterable[str] = ("left",), *, urdf: object = None) -> ClosedChain:
    """Return legs of the Solo robot as five-bars: front and hind leg of a side joined at their feet, base fixed.

    Hips 0.38 m apart, links of 0.16 m, inertias of the robot's own file; every other joint is locked. The hips are
    driven. Gravity is along -z.

    Args:
        sides: "left", "right" or both; both give one chain with two loops.
        urdf: the robot's 8-joint URDF; the one of the package example-robot-data unless given.

    Raises:
        UnknownNameError: another side.
        FileFormatError: example-robot-data is not installed, or the file is another robot.
    """
    wanted = (sides,) if isinstance(sides, str) else tuple(sides)
    for side in wanted:
        if side not in ("left", "right"):
            raise UnknownNameError("side", side, ("left", "right"))
    robot = load(_solo_urdf() if urdf is None else urdf, closures=(), actuated=())
    letters = [side[0].upper() for side in ("left", "right") if side in wanted]
    legs = [(f"F{letter}", f"H{letter}") for letter in letters]
    keep = {f"{leg}_{joint}" for pair in legs for leg in pair for joint in ("HFE", "KFE")}
    missing = sorted(keep - set(robot.joints))
    if missing or not wanted:
        raise UnknownNameError("joint of the robot", missing or wanted, robot.joints)
    locked = [robot.model.getJointId(name) for name in robot.joints if name not in keep]
    model = pin.buildReducedModel(robot.model, locked, pin.neutral(robot.model))
    model.name = "solo_" + "_".join(side for side in ("left", "right") if side in wanted)
    closures = [Closure((f"{front}_FOOT", f"{hind}_FOOT"), name=f"{front}_{hind}") for front, hind in legs]
    model.referenceConfigurations["home"] = _solo_home(model, legs)
    actuated = tuple(f"{leg}_HFE" for pair in legs for leg in pair)
    return ClosedChain(model, tuple(closures), actuated, visuals=robot.visuals)


def _solo_urdf() -> Path:
    inside = Path("share", "example-robot-data", "robots", "solo_description", "robots", "solo.urdf")
    for folder in Path(pin.__file__).resolve().parents:
        if (folder / inside).is_file():
            return folder / inside
    raise FileFormatError(inside, "is not installed; install example-robot-data, or pass urdf=...")


def _solo_home(model: pin.Model, legs: list[tuple[str, str]], *, depth: float = 0.22) -> Array:
    """Return both feet below the middle of the hips, knees apart; a leg hangs straight down at zero."""
    data = model.createData()
    q = np.array(pin.neutral(model))
    pin.framesForwardKinematics(model, data, q)
    for pair in legs:
        hips = [np.array(data.oMi[model.getJointId(f"{leg}_HFE")].translation) for leg in pair]
        for leg, sign, (hip, other) in zip(pair, (1.0, -1.0), (hips, hips[::-1]), strict=True):
            knee = np.array(data.oMi[model.getJointId(f"{leg}_KFE")].translation)
            foot = np.array(data.oMf[model.getFrameId(f"{leg}_FOOT")].translation)
            upper, lower = abs(hip[2] - knee[2]), abs(knee[2] - foot[2])
            reach = complex(depth, 0.5 * (hip[0] - other[0]))  # down and, turning about y, backwards
            thigh, shank = dyad(0.0, reach, upper, lower, -sign)
            q[model.idx_qs[model.getJointId(f"{leg}_HFE")]] = thigh
            q[model.idx_qs[model.getJointId(f"{leg}_KFE")]] = wrapped(shank + np.pi - thigh)
    return q


MECHANISMS: dict[str, Callable[[], ClosedChain]] = {
    "delta": delta,
    "five_bar_case_I": five_bar_case_I,
    "five_bar_case_II": five_bar_case_II,
    "four_bar_antiparallelogram": four_bar_antiparallelogram,
    "four_bar_crank_rocker": four_bar_crank_rocker,
    "four_bar_parallelogram": four_bar_parallelogram,
    "four_bar_reactionless": four_bar_reactionless,
    "planar_3rrr": planar_3rrr,
    "six_bar_stephenson": six_bar_stephenson,
    "six_bar_watt": six_bar_watt,
    "slider_crank": slider_crank,
    "spatial_rssr": spatial_rssr,
}
"""The mechanisms that ship as files, by name."""


def save_mechanisms(folder: object, *, overwrite: bool = False) -> tuple[Path, ...]:
    """Write URDF and sidecar of every mechanism that ships."""
    paths: tuple[Path, ...] = ()
    for name, make in MECHANISMS.items():
        paths += save(make(), folder, name=name, formats=("urdf",), overwrite=overwrite)
    return paths
