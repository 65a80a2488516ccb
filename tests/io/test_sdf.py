"""SDF: poses, joints and loops against the product of exponentials, read from the same text on another road."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

import fivebar_pin as fb
from fivebar_pin import io
from fivebar_pin.chain import find_frame
from fivebar_pin.errors import FileFormatError, LeftOutWarning

CASSIE = Path(pin.__file__).parents[4] / "share" / "example-robot-data" / "robots" / "cassie_description" / "robots"
FILES = ("cassie", "cassie_reduced", "cassie_simple", "cassie_v2", "cassie_wo_gearbox_spring")

MASS = (
    "<inertial><pose>0.1 0 0 0 0 0.3</pose><mass>{}</mass>"
    "<inertia><ixx>0.1</ixx><iyy>0.2</iyy><izz>0.25</izz></inertia></inertial>"
)
ARM = f"""<sdf version="1.7"><model name="arm">
  <link name="base"><pose>0 0 1 0 0 0</pose>{MASS.format(2)}</link>
  <link name="upper"><pose>0.2 0 1 0 0 0.5</pose>{MASS.format(1.5)}</link>
  <link name="lower"><pose>0.6 0.3 1.1 0.2 0 1</pose>{MASS.format(0.5)}</link>
  <joint name="foot" type="fixed"><parent>world</parent><child>base</child></joint>
  <joint name="shoulder" type="revolute"><parent>base</parent><child>upper</child>
    <axis><xyz>0 0 1</xyz><limit><lower>-1</lower><upper>2</upper><effort>5</effort><velocity>-1</velocity></limit>
    <dynamics><damping>0.1</damping><friction>0.2</friction></dynamics></axis></joint>
  <joint name="elbow" type="revolute"><pose>0.05 0 0 0 0.3 0</pose><parent>upper</parent><child>lower</child>
    <axis><xyz>0 1 1</xyz></axis></joint>
</model></sdf>"""


def write(folder: Path, text: str, name: str = "arm.sdf") -> Path:
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def load(folder: Path, text: str) -> fb.ClosedChain:
    return io.load(write(folder, text), closures=(), actuated=())


def pose_of(text: str | None) -> np.ndarray:
    x, y, z, *rpy = map(float, (text or "0 0 0 0 0 0").split())
    M = np.eye(4)
    M[:3, :3], M[:3, 3] = Rotation.from_euler("xyz", rpy).as_matrix(), (x, y, z)
    return M


def turned(text: str, q: dict[str, float]) -> dict[str, np.ndarray]:
    """Return the pose of every link in a file from 1.5 on without relative_to: exp(S1 q1) exp(S2 q2) ... M."""
    model = ElementTree.fromstring(text).find(".//model")
    at_zero = {link.get("name"): pose_of(link.findtext("pose")) for link in model.findall("link")}
    above = {}
    for joint in model.findall("joint"):
        above.setdefault(joint.findtext("child"), joint)
    moved: dict[str, np.ndarray] = {"world": np.eye(4)}

    def motion(link: str) -> np.ndarray:
        if link in moved or link not in above:
            return moved.get(link, np.eye(4))
        joint = above[link]
        M = at_zero[link] @ pose_of(joint.findtext("pose"))
        axis = np.array([float(x) for x in joint.findtext("axis/xyz", "0 0 1").split()])
        if joint.findtext("axis/use_parent_model_frame") != "1":
            axis = M[:3, :3] @ axis
        axis, S = axis / np.linalg.norm(axis), np.zeros((4, 4))
        if joint.get("type") == "prismatic":
            S[:3, 3] = axis
        else:
            S[:3, :3] = np.cross(np.eye(3), axis)
            S[:3, 3] = -S[:3, :3] @ M[:3, 3]
        moved[link] = motion(joint.findtext("parent")) @ expm(S * q.get(joint.get("name"), 0.0))
        return moved[link]

    return {link: motion(link) @ M for link, M in at_zero.items()}


def placed(chain: fb.ClosedChain, q: dict[str, float]) -> dict[str, np.ndarray]:
    """Return the pose of every link of a chain."""
    model, vector = chain.model, np.array(pin.neutral(chain.model))
    for name, value in q.items():
        vector[chain.columns(name)[0]] = value
    data = model.createData()
    pin.framesForwardKinematics(model, data, vector)
    return {f.name: data.oMf[k].homogeneous for k, f in enumerate(model.frames) if f.type == pin.FrameType.BODY}


@pytest.mark.parametrize("seed", range(3))
def test_links_move_as_the_product_of_exponentials_says(tmp_path: Path, seed: int) -> None:
    """Joints away from their child's origin, oblique axes, links in any pose."""
    q = dict(zip(("shoulder", "elbow"), np.random.default_rng(seed).uniform(-2.0, 2.0, 2), strict=True))
    chain = load(tmp_path, ARM)
    ours, theirs = placed(chain, q), turned(ARM, q)
    for link, M in theirs.items():
        np.testing.assert_allclose(ours[link], M, atol=1e-14)
    assert chain.mass == 2.0  # the base is on the ground


def test_limits_losses_and_inertias_are_the_files(tmp_path: Path) -> None:
    chain = load(tmp_path, ARM)
    model = chain.model
    assert (model.lowerPositionLimit[0], model.upperPositionLimit[0], model.upperEffortLimit[0]) == (-1.0, 2.0, 5.0)
    assert model.upperVelocityLimit[0] == model.upperPositionLimit[1] == np.finfo(float).max
    assert (model.damping[0], model.upperDryFrictionLimit[0]) == (0.1, 0.2)
    R = Rotation.from_euler("z", 0.3).as_matrix()
    np.testing.assert_allclose(model.inertias[1].inertia, R @ np.diag([0.1, 0.2, 0.25]) @ R.T, atol=1e-16)
    lower = find_frame(model, "lower").placement
    np.testing.assert_allclose(model.inertias[2].lever, lower.act(np.array([0.1, 0.0, 0.0])), atol=1e-16)


SAME = {
    "relative_to a link": (
        "<pose>0.2 0 1 0 0 0.5</pose>",
        '<pose relative_to="base">0.2 0 0 0 0 0.5</pose>',
    ),
    "relative_to a frame on a frame": (
        '<link name="upper"><pose>0.2 0 1 0 0 0.5</pose>',
        '<frame name="a" attached_to="base"><pose>0.1 0 0 0 0 0</pose></frame><frame name="b" attached_to="a"/>'
        '<link name="upper"><pose relative_to="b">0.1 0 0 0 0 0.5</pose>',
    ),
    "in a frame, as up to 1.6": ("<pose>0.2 0 1 0 0 0.5</pose>", '<pose frame="base">0.2 0 0 0 0 0.5</pose>'),
    "relative_to the model": ("<pose>0.2 0 1", '<pose relative_to="__model__">0.2 0 1'),
    "degrees": ("<pose>0.2 0 1 0 0 0.5</pose>", f'<pose degrees="true">0.2 0 1 0 0 {float(np.degrees(0.5))!r}</pose>'),
    "quaternion": (
        "<pose>0.2 0 1 0 0 0.5</pose>",
        f'<pose rotation_format="quat_xyzw">0.2 0 1 0 0 {2 * float(np.sin(0.25))!r} {2 * float(np.cos(0.25))!r}</pose>',
    ),
    "ends on frames": (
        "<parent>upper</parent><child>lower</child>",
        "<parent>on_upper</parent><child>shin</child>",
    ),
    "expressed_in": ("<xyz>0 0 1</xyz>", '<xyz expressed_in="base">0 0 1</xyz>'),
    "a model frame": ("<xyz>0 0 1</xyz>", "<xyz>0 0 1</xyz><use_parent_model_frame>true</use_parent_model_frame>"),
    "pose of the model": (
        '<model name="arm">',
        '<model name="arm"><pose>0 0 0 0 0 0</pose>',
    ),
    "a joint relative to a link": (
        '<joint name="shoulder" type="revolute">',
        '<joint name="shoulder" type="revolute"><pose relative_to="base">0.2 0 0 0 0 0.5</pose>',
    ),
}


@pytest.mark.parametrize("way", SAME)
def test_a_pose_is_the_same_in_every_way_to_say_it(tmp_path: Path, way: str) -> None:
    old, new = SAME[way]
    assert old in ARM
    text = ARM.replace(old, new, 1)
    if way == "ends on frames":
        frames = '<frame name="on_upper" attached_to="upper"/><frame name="shin" attached_to="lower"/>'
        text = text.replace("</model>", f"{frames}</model>")
    q = {"shoulder": 0.7, "elbow": -0.4}
    ours, theirs = placed(load(tmp_path, text), q), turned(ARM, q)
    for link, M in theirs.items():
        np.testing.assert_allclose(ours[link], M, atol=1e-14)


def test_axes_up_to_version_1_4_are_in_the_axes_of_the_model(tmp_path: Path) -> None:
    q = {"shoulder": 0.7, "elbow": -0.4}
    old = ARM.replace('version="1.7"', 'version="1.4"')
    said = "</xyz><use_parent_model_frame>1</use_parent_model_frame>"
    theirs = turned(ARM.replace("</xyz>", said), q)
    assert np.abs(theirs["lower"] - turned(ARM, q)["lower"]).max() > 0.1
    for link, M in theirs.items():
        np.testing.assert_allclose(placed(load(tmp_path, old), q)[link], M, atol=1e-14)


def test_the_pose_of_a_model_moves_all_that_is_in_it(tmp_path: Path) -> None:
    """The outer one's the inner one too; what is said in the axes of the world stays."""
    start, end = ARM.index('<link name="lower">'), ARM.index('<joint name="foot"')
    lower = ARM[start:end].replace('name="lower"><pose>', 'name="lower"><pose relative_to="__model__">')
    text = ARM.replace(ARM[start:end], f'<model name="low">{lower}</model>')
    text = text.replace("<child>lower</child>", "<child>low::lower</child>")
    moved = placed(load(tmp_path, text.replace('name="arm">', 'name="arm"><pose>0.3 0 0 0 0 1</pose>')), {})
    at_zero, X = turned(ARM, {}), pose_of("0.3 0 0 0 0 1")
    for ours, theirs in (("base", "base"), ("upper", "upper"), ("low::lower", "lower")):
        np.testing.assert_allclose(moved[ours], X @ at_zero[theirs], atol=1e-15)


def test_a_nested_model_is_part_of_the_tree(tmp_path: Path) -> None:
    """Its pose carries its links; names inside are NESTED::NAME outside."""
    start, end = ARM.index('<link name="lower">'), ARM.index('<joint name="foot"')
    lower = ARM[start:end].replace("<pose>0.6 0.3 1.1 0.2 0 1</pose>", '<pose relative_to="here"/>')
    here = '<frame name="here"><pose>0 0 0 0.2 0 1</pose></frame>'
    nested = f'<model name="low"><pose>0.6 0.3 1.1 0 0 0</pose>{here}{lower}</model>'
    text = ARM.replace(ARM[start:end], nested).replace("<child>lower</child>", "<child>low::lower</child>")
    q = {"shoulder": 0.7, "elbow": -0.4}
    np.testing.assert_allclose(placed(load(tmp_path, text), q)["low::lower"], turned(ARM, q)["lower"], atol=1e-14)
    whole = text.replace("<child>low::lower</child>", "<child>low</child>")  # the model's first link
    whole = whole.replace("<pose>0.05 0 0 0 0.3 0</pose>", '<pose relative_to="low::lower">0.05 0 0 0 0.3 0</pose>')
    np.testing.assert_allclose(placed(load(tmp_path, whole), q)["low::lower"], turned(ARM, q)["lower"], atol=1e-14)
    named = whole.replace('name="low">', 'name="low" canonical_link="lower"><link name="ring"/>').replace(
        "</model></sdf>",
        '<joint name="on" type="fixed"><parent>low</parent><child>low::ring</child></joint></model></sdf>',
    )
    np.testing.assert_allclose(placed(load(tmp_path, named), q)["low::lower"], turned(ARM, q)["lower"], atol=1e-14)


def test_a_frame_on_a_world_that_nothing_hangs_on_is_passed_over(tmp_path: Path) -> None:
    """The root of a free model has no place in the world that lasts."""
    start, end = ARM.index('<joint name="foot"'), ARM.index('<joint name="shoulder"')
    text = ARM.replace(ARM[start:end], '<frame name="far" attached_to="world"/>')
    assert "far" not in placed(load(tmp_path, text), {})
    assert "far" in placed(
        load(tmp_path, ARM.replace("</model>", '<frame name="far" attached_to="world"/></model>')), {}
    )


def test_a_link_without_joints_is_no_root(tmp_path: Path) -> None:
    """It is refused for itself, not the rest because of it."""
    start, end = ARM.index('<joint name="foot"'), ARM.index('<joint name="shoulder"')
    text = ARM.replace(ARM[start:end], "").replace('<link name="base">', '<link name="prop"/><link name="base">')
    with pytest.raises(FileFormatError, match="link 'base': no joint leads from it to link prop; join it"):
        load(tmp_path, text)


def test_without_a_joint_to_the_world_the_root_is_where_its_pose_is(tmp_path: Path) -> None:
    """Held there, or free to fly from there; its mass counts then."""
    start, end = ARM.index('<joint name="foot"'), ARM.index('<joint name="shoulder"')
    path = write(tmp_path, ARM.replace(ARM[start:end], ""))
    for free in (False, True):
        chain = io.load(path, closures=(), actuated=(), free_flyer=free)
        np.testing.assert_allclose(placed(chain, {})["base"], turned(ARM, {})["base"], atol=1e-15)
        assert chain.mass == (4.0 if free else 2.0)


KINDS = {
    "universal": ([("elbow_1", (0, 1, 1)), ("elbow_2", (1, 0, 0))], "<axis2><xyz>1 0 0</xyz></axis2>"),
    "revolute2": ([("elbow_1", (0, 1, 1)), ("elbow_2", (1, 0, 0))], "<axis2><xyz>1 0 0</xyz></axis2>"),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("turn", [False, True])
def test_a_joint_of_two_hinges_turns_about_both(tmp_path: Path, kind: str, turn: bool) -> None:
    """Either way round: child in parent = X exp(axis) exp(axis2) Y."""
    parts, more = KINDS[kind]
    text = ARM.replace('name="elbow" type="revolute"', f'name="elbow" type="{kind}"').replace(
        "<xyz>0 1 1</xyz></axis>", f"<xyz>0 1 1</xyz></axis>{more}"
    )
    if turn:  # lower hangs on upper by a joint from lower to upper
        text = text.replace("<parent>upper</parent><child>lower</child>", "<parent>lower</parent><child>upper</child>")
    angles = {"elbow_1": 0.4, "elbow_2": -0.7}
    ours = placed(load(tmp_path, text), angles)
    at_zero = turned(ARM, {})
    X = at_zero["upper" if turn else "lower"] @ pose_of("0.05 0 0 0 0.3 0")
    turns = np.eye(4)
    for name, axis in parts:
        turns[:3, :3] = (
            turns[:3, :3] @ Rotation.from_rotvec(angles[name] * np.array(axis) / np.linalg.norm(axis)).as_matrix()
        )
    parent, child = ("lower", "upper") if turn else ("upper", "lower")
    expected = np.linalg.inv(at_zero[parent]) @ X @ turns @ np.linalg.inv(X) @ at_zero[child]
    np.testing.assert_allclose(np.linalg.inv(ours[parent]) @ ours[child], expected, atol=1e-14)


@pytest.mark.parametrize("kind", ["revolute", "prismatic", "continuous"])
def test_a_joint_turned_round_keeps_its_coordinate(tmp_path: Path, kind: str) -> None:
    """The elbow from lower to upper: lower is the parent, and hangs all the same."""
    text = ARM.replace('"elbow" type="revolute"', f'"elbow" type="{kind}"')
    text = text.replace("<parent>upper</parent><child>lower</child>", "<parent>lower</parent><child>upper</child>")
    value = np.array([np.cos(0.3), np.sin(0.3)]) if kind == "continuous" else 0.3
    chain, at_zero = load(tmp_path, text), turned(ARM, {})
    if kind == "continuous":  # the bounds of a cosine and a sine
        np.testing.assert_array_equal(chain.model.upperPositionLimit[chain.columns("elbow")[0]], [1.01, 1.01])
    ours = placed(chain, {"elbow": value})
    X = at_zero["upper"] @ pose_of("0.05 0 0 0 0.3 0")
    step, axis = np.eye(4), 0.3 * np.array([0.0, 1.0, 1.0]) / np.sqrt(2.0)
    if kind == "prismatic":
        step[:3, 3] = axis
    else:
        step[:3, :3] = Rotation.from_rotvec(axis).as_matrix()
    expected = np.linalg.inv(at_zero["lower"]) @ X @ step @ np.linalg.inv(X) @ at_zero["upper"]
    np.testing.assert_allclose(np.linalg.inv(ours["lower"]) @ ours["upper"], expected, atol=1e-14)


def test_a_fixed_joint_and_one_of_the_sidecar_leave_links_where_they_are(tmp_path: Path) -> None:
    """The joint is away from its child's origin."""
    fixed = load(tmp_path, ARM.replace('"elbow" type="revolute"', '"elbow" type="fixed"'))
    (tmp_path / "arm.yaml").write_text(
        "closed_loop: []\ntype: []\nname_mot: [shoulder]\njoint_name: [elbow]\njoint_type: [CARDAN]\n"
    )
    cardan = io.load(write(tmp_path, ARM))
    assert (fixed.joints, cardan.joints) == (("shoulder",), ("shoulder", "elbow_X", "elbow_Y"))
    for chain in (fixed, cardan):
        theirs = turned(ARM, {"shoulder": 0.7})["lower"]
        np.testing.assert_allclose(placed(chain, {"shoulder": 0.7})["lower"], theirs, atol=1e-14)


@pytest.mark.parametrize(
    ("stated", "advance"),
    [
        ("<screw_thread_pitch>0.02</screw_thread_pitch>", 0.02),
        (f"<thread_pitch>{-2 * np.pi / 0.02!r}</thread_pitch>", 0.02),
        ("<screw_thread_pitch>0.02</screw_thread_pitch><thread_pitch>1</thread_pitch>", 0.02),
    ],
)
def test_a_screw_advances_by_its_pitch_in_a_turn(tmp_path: Path, stated: str, advance: float) -> None:
    text = ARM.replace('"elbow" type="revolute">', f'"elbow" type="screw">{stated}')
    chain = io.load(write(tmp_path, text), actuated=["shoulder", "elbow"])
    q = fb.assemble(chain, [0.0, 2.0 * np.pi], near=np.zeros(3))
    np.testing.assert_allclose(q[chain.columns("elbow_slide")[0]], advance, atol=1e-12)


def test_a_ball_joint_is_spherical_and_keeps_its_damping(tmp_path: Path) -> None:
    text = ARM.replace('"elbow" type="revolute"', '"elbow" type="ball"').replace(
        "<xyz>0 1 1</xyz>", "<xyz>0 1 1</xyz><dynamics><damping>0.3</damping></dynamics>"
    )
    chain = load(tmp_path, text)
    assert [joint.shortname() for joint in chain.model.joints][2:] == ["JointModelSpherical"]
    np.testing.assert_array_equal(chain.model.damping, [0.1, 0.3, 0.3, 0.3])


def test_springs_mimics_and_gravity_are_taken(tmp_path: Path) -> None:
    spring = "<dynamics><spring_stiffness>3</spring_stiffness><spring_reference>0.5</spring_reference></dynamics>"
    mimic = '<mimic joint="shoulder"><multiplier>2</multiplier><offset>0.1</offset><reference>0.3</reference></mimic>'
    text = ARM.replace("<xyz>0 1 1</xyz>", f"<xyz>0 1 1</xyz>{spring}{mimic}")
    world = text.replace('<model name="arm">', '<world name="w"><gravity>0 0 -3</gravity><model name="arm">')
    path = write(tmp_path, world.replace("</model>", "</model></world>"), "arm.world")
    (tmp_path / "arm.yaml").write_text("closed_loop: []\ntype: []\nname_mot: [shoulder]\n")
    chain = io.load(path)
    (one,) = chain.springs
    assert (one.joint, one.stiffness, one.rest) == ("elbow", 3.0, 0.5)
    np.testing.assert_array_equal(chain.model.gravity.linear, [0.0, 0.0, -3.0])
    np.testing.assert_allclose(fb.assemble(chain, [1.0], near=np.zeros(2)), [1.0, 2.0 * 0.7 + 0.1])


def test_shapes_are_drawn_where_the_file_says(tmp_path: Path) -> None:
    def visual(pose: str, shape: str, more: str = "") -> str:
        return f'<visual name="v">{pose}<geometry>{shape}</geometry>{more}</visual>'

    shapes = (
        visual("<pose>0.1 0 0 0 0 0.2</pose>", "<box><size>1 2 3</size></box>")
        + visual("", "<cylinder><radius>0.1</radius><length>0.2</length></cylinder>")
        + visual(
            "",
            "<mesh><uri>model://a/b.stl</uri><scale>1 1 -1</scale></mesh>",
            "<material><ambient>0 0 1 1</ambient><diffuse>1 0 0</diffuse></material>",
        )
        + visual(
            '<pose relative_to="base"/>',
            "<sphere><radius>0.3</radius></sphere>",
            "<material><ambient>0 1 0 0.5</ambient></material>",
        )
        + visual("", "<plane/>")
    )
    text = ARM.replace('<link name="upper">', f'<link name="upper">{shapes}')
    with pytest.warns(LeftOutWarning, match=r"plane to draw, mesh model://a/b.stl \(not found"):
        box, cylinder, mesh, sphere = load(tmp_path, text).visuals
    assert (box.shape, box.size, box.frame) == ("box", (1.0, 2.0, 3.0), "upper")
    np.testing.assert_allclose(box.placement, pose_of("0.1 0 0 0 0 0.2"), atol=1e-16)
    assert (cylinder.shape, cylinder.size) == ("cylinder", (0.1, 0.2))
    assert (mesh.mesh, mesh.size, mesh.rgba) == ("model://a/b.stl", (1.0, 1.0, -1.0), (1.0, 0.0, 0.0, 1.0))
    assert (sphere.size, sphere.rgba) == ((0.3,), (0.0, 1.0, 0.0, 0.5))
    at_zero = turned(ARM, {})
    np.testing.assert_allclose(sphere.placement, np.linalg.inv(at_zero["upper"]) @ at_zero["base"], atol=1e-15)


def test_a_declaration_after_a_comment_is_passed_over(tmp_path: Path) -> None:
    """A licence before the declaration is no XML, and many models have it."""
    text = f'<!-- mine -->\n<?xml version="1.0"?>\n{ARM}'
    assert load(tmp_path, text).joints == ("shoulder", "elbow")


def test_a_joint_may_be_called_like_a_link_and_like_the_world(tmp_path: Path) -> None:
    """Up to 1.6; ends and frames are those of the link then."""
    text = ARM.replace('name="foot"', 'name="world"').replace('name="shoulder"', 'name="upper"')
    q = {"shoulder": 0.7, "elbow": -0.4}
    ours = placed(load(tmp_path, text), {"upper": q["shoulder"], "elbow": q["elbow"]})
    for link, M in turned(ARM, q).items():
        np.testing.assert_allclose(ours[link], M, atol=1e-14)


@pytest.mark.parametrize("none", ["1e16", "inf", "+Infinity", "1e20", "1.79769e+308"])
def test_a_limit_beyond_all_motion_is_none(tmp_path: Path, none: str) -> None:
    text = ARM.replace("<lower>-1</lower><upper>2</upper>", f"<lower>-{none.strip('+')}</lower><upper>{none}</upper>")
    model = load(tmp_path, text).model
    assert (-model.lowerPositionLimit[0], model.upperPositionLimit[0]) == (np.finfo(float).max,) * 2


def test_an_empty_element_says_nothing(tmp_path: Path) -> None:
    """As <ixy></ixy>, which generators of files write."""
    text = ARM.replace("<ixx>0.1</ixx>", "<ixx>0.1</ixx><ixy></ixy><ixz> </ixz>").replace(
        "<lower>-1</lower>", "<lower/>"
    )
    model = load(tmp_path, text).model
    np.testing.assert_array_equal(model.inertias[1].inertia, load(tmp_path, ARM).model.inertias[1].inertia)
    assert model.lowerPositionLimit[0] == -np.finfo(float).max


def test_a_link_without_inertial_has_the_mass_that_sdf_says(tmp_path: Path) -> None:
    """One kilogram and one kg m2; with a mass of zero and no moments none."""
    plain = load(tmp_path, ARM.replace(MASS.format(0.5), "").replace("<pose>0.05 0 0 0 0.3 0</pose>", ""))
    stated = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 1.0]
    np.testing.assert_array_equal(plain.model.inertias[2].toDynamicParameters(), stated)
    none = "<inertial><mass>0</mass><inertia><ixx>0</ixx><iyy>0</iyy><izz>0</izz></inertia></inertial>"
    assert load(tmp_path, ARM.replace(MASS.format(0.5), none)).model.inertias[2].mass == 0.0


@pytest.mark.filterwarnings("ignore::fivebar_pin.errors.LeftOutWarning")
@pytest.mark.parametrize("name", FILES)
def test_cassie_stands_at_zero_where_its_file_puts_it(name: str) -> None:
    """Every link is where the file says, the masses add up, the loops are closed, and the legs mirror each other."""
    text = (CASSIE / f"{name}.sdf").read_text()
    chain = io.load(CASSIE / f"{name}.sdf", free_flyer=name == "cassie_v2")
    ours, theirs = placed(chain, {}), turned(text, {})
    for link, M in theirs.items():
        np.testing.assert_allclose(ours[link], M, atol=1e-12)
    masses = [float(mass.text) for mass in ElementTree.fromstring(text).iter("mass")]
    pelvis = 0.0 if name == "cassie" else masses[0]  # held, where nothing carries it
    np.testing.assert_allclose(chain.mass, sum(masses) - masses[0] + pelvis, rtol=1e-12)
    q = pin.neutral(chain.model)
    np.testing.assert_allclose(fb.closure_residual(chain, q), 0.0, atol=1e-12)
    assert sorted(spring.stiffness for spring in chain.springs) == [1250.0, 1250.0, 1500.0, 1500.0]
    sides = {side: [c.kind for c in chain.closures if side in c.name] for side in ("left", "right")}
    assert sorted(sides["left"]) == sorted(sides["right"]) and len(chain.closures) == 2 * len(sides["left"])
    for joint in (name for name in chain.joints if name.startswith("left")):
        one, other = (chain.model.inertias[chain.model.getJointId(x)] for x in (joint, joint.replace("left", "right")))
        assert one.mass == other.mass


@pytest.mark.filterwarnings("ignore::fivebar_pin.errors.LeftOutWarning")
@pytest.mark.parametrize("name", ["cassie_v2", "cassie_wo_gearbox_spring"])
def test_cassie_moves_as_the_product_of_exponentials_says(name: str) -> None:
    """Every hinge of the tree, at random; loops are left open."""
    text = (CASSIE / f"{name}.sdf").read_text()
    chain = io.load(CASSIE / f"{name}.sdf")
    rng = np.random.default_rng(1)
    q = {j: rng.uniform(-1.0, 1.0) for j in chain.joints if chain.model.nqs[chain.model.getJointId(j)] == 1}
    cut = {closure.name for closure in chain.closures}
    tree = ElementTree.fromstring(text)
    for joint in [j for j in tree.iter("joint") if j.get("name") in cut]:
        tree.find(".//model").remove(joint)
    theirs = turned(ElementTree.tostring(tree, encoding="unicode"), q)
    for link, M in placed(chain, q).items():
        if link in theirs:
            np.testing.assert_allclose(M, theirs[link], atol=1e-12)


@pytest.mark.filterwarnings("ignore::fivebar_pin.errors.LeftOutWarning")
def test_cassie_closes_and_drives(tmp_path: Path) -> None:
    """Ten motors and the shin springs held: the loops stay closed, power balances, and saved it is the same."""
    legs = [f"{side}-{joint}" for side in ("left", "right") for joint in ("roll-op", "yaw-op", "pitch-op", "knee-op")]
    feet = [f"{side}-{joint}" for side in ("left", "right") for joint in ("foot-op", "knee-shin-joint")]
    chain = io.load(CASSIE / "cassie_v2.sdf", actuated=[*legs, *feet])
    diagnosis = fb.diagnose(chain)
    assert (diagnosis.mobility, diagnosis.actuation.value) == (12, "exactly actuated")
    t = np.linspace(0.0, 1.0, 11)
    swings = [
        fb.motion.harmonic(t, 0.0, 0.1 if name.endswith("pitch-op") else 0.0, period=1.0) for name in chain.actuated
    ]
    trajectory = fb.drive(chain, fb.motion.combine(*swings), near=np.zeros(chain.nq), limits="ignore")
    assert trajectory.worst_closure < 1e-9
    loads = fb.inverse_dynamics(chain, trajectory)
    assert loads.power_residual() < 1e-9
    again = io.load(io.save(chain, tmp_path, formats="urdf")[0])
    np.testing.assert_allclose(fb.inverse_dynamics(again, trajectory).torque, loads.torque, atol=1e-9)


def test_a_gearbox_turns_the_other_way_by_its_ratio() -> None:
    """Cassie's hip motors: 25 turns of the reference body for one of the hip; its feet 50."""
    with pytest.warns(LeftOutWarning, match="plugin"):
        chain = io.load(CASSIE / "cassie.sdf")
    ties = {c.name: dict(c.ratios) for c in chain.closures if c.kind == "coupling"}
    assert ties["left-roll-joint"] == {"left-roll-op": 1.0, "left-roll-ip": 0.04}
    assert ties["right-foot-joint"] == {"right-foot-op": 1.0, "right-foot-ip": 0.02}
    assert len(ties) == 10


FOUR_BAR = f"""<sdf version="1.7"><model name="square">
  <link name="crank">{MASS.format(1)}</link>
  <link name="coupler"><pose>0 1 0 0 0 0</pose>{MASS.format(1)}</link>
  <link name="rocker"><pose>1 0 0 0 0 0</pose>{MASS.format(1)}</link>
  <joint name="a" type="revolute"><parent>world</parent><child>crank</child><axis><xyz>0 0 1</xyz></axis></joint>
  <joint name="b" type="revolute"><parent>crank</parent><child>coupler</child><axis><xyz>0 0 1</xyz></axis></joint>
  <joint name="d" type="revolute"><parent>world</parent><child>rocker</child><axis><xyz>0 0 1</xyz></axis></joint>
  <joint name="c" type="revolute"><pose>0 1 0 0 0 0</pose><parent>coupler</parent><child>rocker</child>
    <axis><xyz>0 0 1</xyz></axis></joint>
</model></sdf>"""
LAST = '<joint name="c" type="revolute">'
SPRING = "<dynamics><spring_stiffness>2</spring_stiffness></dynamics>"
PLUGIN = "<plugin filename='lib{0}.so' name='{0}'>{1}</plugin>"
WELDED = "<parent_link>coupler</parent_link><child_model>square</child_model><child_link>rocker</child_link>"


@pytest.mark.parametrize(
    ("kind", "word", "mobility"),
    [("revolute", "revolute", 1), ("continuous", "revolute", 1), ("ball", "3d", 1), ("fixed", "6d", 0)],
)
def test_a_joint_whose_child_hangs_already_closes_a_loop(tmp_path: Path, kind: str, word: str, mobility: int) -> None:
    """Closed at zero, and a parallelogram where it can move."""
    chain = io.load(write(tmp_path, FOUR_BAR.replace(LAST, LAST.replace("revolute", kind))))
    assert [(c.name, c.kind) for c in chain.closures] == [("c", word)]
    assert (chain.joints, chain.actuated) == (("a", "b", "d"), ())
    np.testing.assert_allclose(fb.closure_residual(chain, np.zeros(3)), 0.0, atol=1e-15)
    assert fb.diagnose(chain).mobility == mobility
    if mobility:
        q = fb.assemble(chain.with_actuated(["a"]), [0.3], near=np.zeros(3))
        np.testing.assert_allclose(q, [0.3, -0.3, 0.3], atol=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "cut"),
    [
        (LAST, LAST.replace("revolute", "prismatic"), "d"),  # only it can carry the rocker
        (
            "<axis><xyz>0 0 1</xyz></axis></joint>\n</model>",
            f"<axis><xyz>0 0 1</xyz>{SPRING}</axis></joint></model>",
            "d",
        ),
        ("<parent>coupler</parent><child>rocker</child>", "<parent>rocker</parent><child>coupler</child>", "c"),
    ],
)
def test_a_loop_is_cut_where_a_closure_can_stand_for_the_joint(tmp_path: Path, old: str, new: str, cut: str) -> None:
    assert old in FOUR_BAR
    chain = io.load(write(tmp_path, FOUR_BAR.replace(old, new)))
    assert [c.name for c in chain.closures] == [cut]
    np.testing.assert_allclose(fb.closure_residual(chain, np.zeros(3)), 0.0, atol=1e-15)


def test_a_joint_that_must_carry_is_turned_round_where_only_its_child_is_reached(tmp_path: Path) -> None:
    """The crank slides on the rocker, which is reached from the crank alone: a loop of a - b - c and the slide."""
    text = FOUR_BAR.replace(
        '<joint name="d" type="revolute"><parent>world</parent><child>rocker</child>',
        "<joint name='d' type='prismatic'><parent>rocker</parent><child>crank</child>",
    )
    chain = io.load(write(tmp_path, text))
    assert [c.name for c in chain.closures] == ["c"]
    assert chain.model.joints[chain.model.getJointId("d")].shortname() == "JointModelPrismaticUnaligned"  # along -z


def test_what_a_closing_joint_cannot_keep_is_told(tmp_path: Path) -> None:
    more = "<limit><lower>-1</lower></limit><dynamics><damping>1</damping></dynamics>"
    text = FOUR_BAR.replace(
        "<axis><xyz>0 0 1</xyz></axis></joint>\n</model>",
        f"<axis><xyz>0 0 1</xyz>{more}<mimic joint='a'><multiplier>1</multiplier></mimic></axis></joint></model>",
    )
    with pytest.warns(LeftOutWarning, match=r"damping and lower and mimic of joint 'c' \(it closes a loop\)"):
        io.load(write(tmp_path, text))


def test_plugins_state_welds_and_motors(tmp_path: Path) -> None:
    """The joint that Gazebo makes at the start, and the joints that its controllers drive; others are told."""
    start, end = FOUR_BAR.index(LAST), FOUR_BAR.index("</model>")
    names = "<joint_name>a</joint_name><joint_name>gone</joint_name>"
    plugins = (
        PLUGIN.format("gz-sim-detachable-joint-system", WELDED)
        + PLUGIN.format("gz-sim-joint-position-controller-system", names)
        + PLUGIN.format("gz-sim-joint-state-publisher-system", "<joint_name>b</joint_name>")
    )
    with pytest.warns(LeftOutWarning, match="left out: plugin$"):
        chain = io.load(write(tmp_path, FOUR_BAR[:start] + plugins + FOUR_BAR[end:]))
    assert [(c.name, c.kind) for c in chain.closures] == [("coupler~rocker", "6d")]
    assert chain.actuated == ("a",)
    np.testing.assert_allclose(fb.closure_residual(chain, np.zeros(3)), 0.0, atol=1e-15)


DRAKE = (
    "<drake:ball_constraint><drake:ball_constraint_body_A>coupler</drake:ball_constraint_body_A>"
    "<drake:ball_constraint_body_B>rocker</drake:ball_constraint_body_B><drake:ball_constraint_p_AP>1 0 0"
    "</drake:ball_constraint_p_AP><drake:ball_constraint_p_BQ>0 1 0</drake:ball_constraint_p_BQ>"
    "</drake:ball_constraint>"
)
WELD = "<drake:weld_constraint><parent>tip</parent><child>end</child></drake:weld_constraint>"
ENDS = (
    '<frame name="tip" attached_to="coupler"><pose>1 0 0 0 0 0</pose></frame>'
    '<frame name="end" attached_to="rocker"><pose>0 1 0 0 0 0</pose></frame>'
)


@pytest.mark.parametrize(("more", "kind"), [(DRAKE, "3d"), (ENDS + WELD, "6d")])
def test_constraints_of_drake_close_loops(tmp_path: Path, more: str, kind: str) -> None:
    """Their prefix may be declared or not."""
    text = FOUR_BAR[: FOUR_BAR.index(LAST)] + more + "</model></sdf>"
    for declared in ("", ' xmlns:drake="http://drake.mit.edu"'):
        chain = io.load(write(tmp_path, text.replace('version="1.7"', f'version="1.7"{declared}')))
        assert [c.kind for c in chain.closures] == [kind]
        np.testing.assert_allclose(fb.closure_residual(chain, np.zeros(3)), 0.0, atol=1e-15)
    with pytest.raises(FileFormatError, match=r"needs <drake:ball_constraint_p_BQ>|model ''"):
        io.load(
            write(
                tmp_path,
                text.replace("p_BQ>", "p_BR>").replace("<child>end", "<kid>end").replace("end</child>", "end</kid>"),
            )
        )
    with pytest.raises(FileFormatError, match=r"Unknown link, joint, frame or model '(end|rocker)s'"):
        io.load(write(tmp_path, text.replace(">end<", ">ends<").replace(">rocker</drake", ">rockers</drake")))


def test_forces_of_drake_that_are_not_read_are_refused(tmp_path: Path) -> None:
    text = FOUR_BAR.replace("</model>", "<drake:linear_bushing_rpy/></model>")
    with pytest.raises(FileFormatError, match="<drake:linear_bushing_rpy>: acts on the mechanism and is not read"):
        io.load(write(tmp_path, text))


GEARED = FOUR_BAR.replace(
    LAST,
    '<joint name="g" type="gearbox"><parent>crank</parent><child>rocker</child><gearbox_ratio>2</gearbox_ratio>'
    "<gearbox_reference_body>world</gearbox_reference_body><axis><xyz>0 0 1</xyz></axis>"
    f"<axis2><xyz>0 0 -1</xyz></axis2></joint>{LAST}",
)


def test_a_gearbox_counts_about_its_own_axes(tmp_path: Path) -> None:
    """theta_child = -2 theta_parent about axes against each other: the rocker turns twice as far, the same way."""
    chain = io.load(write(tmp_path, GEARED))
    (gears,) = (c for c in chain.closures if c.kind == "coupling")
    assert dict(gears.ratios) == {"d": -1.0, "a": 2.0}
    turned_round = GEARED[: GEARED.index(LAST)] + "</model></sdf>"
    old, new = "<parent>world</parent><child>rocker</child>", "<parent>rocker</parent><child>world</child>"
    (gears,) = io.load(write(tmp_path, turned_round.replace(old, new))).closures
    assert dict(gears.ratios) == {"d": 1.0, "a": 2.0}


def test_what_is_beside_the_model_is_told(tmp_path: Path) -> None:
    sun = "<light name='sun'/><include><uri>model://sun</uri></include>"
    around = f"<world name='w'>{sun}<model name='ground'><static>true</static></model>"
    sensors = ARM.replace(
        '<link name="base">', '<link name="base"><sensor name="s"/><light/><gravity>0</gravity>'
    ).replace("<parent>base</parent>", "<parent>base</parent><sensor name='t'/>")
    sensors = sensors.replace("<xyz>0 1 1</xyz>", "<xyz>0 1 1</xyz><initial_position>1</initial_position>")
    text = sensors.replace('<model name="arm">', f'{around}<model name="arm"><audio/>').replace(
        "</sdf>", "</world></sdf>"
    )
    with pytest.warns(LeftOutWarning) as caught:
        load(tmp_path, text)
    (one,) = caught
    told = (
        "static model 'ground', include of model://sun, light of the world, light element, 2 sensors, "
        "absence of gravity on link 'base', audio element, initial position"
    )
    assert sorted(str(one.message).partition("left out: ")[2].split(", ")) == sorted(told.split(", "))


BAD = [
    ('version="1.7"', "", "<sdf>: <sdf> needs the attribute 'version'"),
    ('version="1.7"', 'version="new"', "<sdf>: version holds 'new', which is not a finite number"),
    ("<sdf ", "<sdx ", "mismatched tag"),
    ("<mass>1.5</mass>", "<mass>-1.5</mass>", "link 'upper': mass = -1.5 must not be negative"),
    ("<mass>1.5</mass>", "<mas>1.5</mas>", "link 'upper': has an unknown element 'mas'; did you mean 'mass'?"),
    ("<ixx>0.1</ixx>", "<ixx>a</ixx>", "link 'base': <ixx> holds 'a', which is not a finite number"),
    ("<inertial>", '<inertial auto="true">', "link 'base': inertia from collision shapes"),
    ("<pose>0.2 0 1 0 0 0.5</pose>", "<pose>0.2 0 1</pose>", "link 'upper': <pose> = '0.2 0 1' must be 6 number"),
    ("<pose>0.2", '<pose relative_to="nothing">0.2', "link 'upper': Unknown link, joint, frame or model 'nothing'"),
    ("<pose>0.2", '<pose relative_to="upper">0.2', "link 'upper': is placed relative to itself in a circle"),
    ("<pose>0.2", '<pose rotation_format="axis">0.2', "Unknown rotation_format 'axis'; known: euler_rpy, quat_xyzw"),
    (
        "<pose>0.2 0 1 0 0 0.5",
        '<pose rotation_format="quat_xyzw">0 0 0 0 0 0 0',
        "link 'upper': <pose>: the quaternion is zero",
    ),
    ('<link name="lower">', '<link name="upper">', "link 'upper': is the name of a link already"),
    ('name="elbow"', 'name="universe"', "'universe': is the name of the fixed world in Pinocchio"),
    ("<child>lower</child>", "<child>low</child>", "joint 'elbow': Unknown link, joint, frame or model 'low'"),
    ("<child>lower</child>", "", "joint 'elbow': needs <child>"),
    ("<child>lower</child>", "<child>upper</child>", "joint 'elbow': joins link 'upper' to itself"),
    ("<child>lower</child>", "<child>elbow</child>", "joint 'elbow': 'elbow' is attached to itself in a circle"),
    ('"elbow" type="revolute"', '"elbow" type="hinge"', "joint 'elbow': Unknown joint type 'hinge'; known: ball"),
    ('"elbow" type="revolute"', '"elbow" type="screw"', "joint 'elbow': needs <screw_thread_pitch>"),
    ('"elbow" type="revolute"', '"elbow" type="universal"', "joint 'elbow': needs <axis2>"),
    ("<xyz>0 1 1</xyz>", "<xyz>0 0 0</xyz>", r"joint 'elbow': <axis>: \[0.0, 0.0, 0.0\] has no direction"),
    ("<xyz>0 1 1</xyz>", "<xyz>0 1</xyz>", "joint 'elbow': <xyz> = '0 1' must be 3 number"),
    ("<lower>-1</lower>", "<lower>3</lower>", "joint 'shoulder': lower limit 3.0 is above upper 2.0"),
    ("<lower>-1</lower>", "<lowr>-1</lowr>", "did you mean 'lower'"),
    ("<damping>0.1</damping>", "<damping>-1</damping>", "joint 'shoulder': damping = -1.0 must not be negative"),
    ("<xyz>0 1 1</xyz>", "<xyz>0 1 1</xyz><mimic joint='elbow'/>", "joint 'elbow': mimics itself"),
    ("<xyz>0 1 1</xyz>", "<xyz>0 1 1</xyz><mimic joint='shoulder'/>", "joint 'elbow': needs <multiplier>"),
    (
        "<xyz>0 1 1</xyz>",
        "<xyz>0 1 1</xyz><mimic joint='shoulder' axis='axis2'/>",
        "joint 'elbow': <mimic> follows the second axis of a joint",
    ),
    ("</model>", "</model><model name='b'/>", r"holds 2 models that move \('arm', 'b'\); put the one to load"),
    ('"arm">', '"arm"><static>1</static>', "holds no model that moves; its models are <static>"),
    ("</model>", "<include><uri>model://x</uri></include></model>", "<include> of 'model://x': is not read inside"),
    ("</model>", "<frame name='f'/><frame name='f'/></model>", "frame 'f': is the name of a frame already"),
    ("</model>", "<joint name='elbow' type='fixed'/></model>", "joint 'elbow': is the name of a joint already"),
    (ARM[ARM.index("<link") : ARM.index("</model>")], "", "has no <link>"),
    ("</model>", "<link name='apart'/></model>", "link 'world': no joint leads from it to link apart; join it"),
    (
        '<link name="lower">',
        '<link name="lower"><visual name="v"><geometry><mesh/></geometry></visual>',
        "visual of link 'lower': needs <uri>",
    ),
    (
        '<link name="lower">',
        '<link name="lower"><visual name="v"><geometry><sphere><radius>-1</radius></sphere></geometry></visual>',
        "visual of link 'lower': .*must not be negative",
    ),
]


@pytest.mark.parametrize(("old", "new", "message"), BAD)
def test_a_bad_sdf_is_refused_by_element(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in ARM
    text = ARM.replace(old, new) if old == "<sdf " else ARM.replace(old, new, 1)
    path = write(tmp_path, text)
    with pytest.raises(FileFormatError, match=message) as caught:
        io.load(path, closures=(), actuated=())
    assert str(path) in str(caught.value)


AXIS = "<axis><xyz>0 0 1</xyz>"
BAD_LOOPS = [
    (
        'type="revolute"',
        'type="prismatic"',
        "joint 'b': closes a loop, and no closure does what a prismatic joint does",
    ),
    (AXIS, AXIS + SPRING, "joint 'b': closes a loop and has a spring, which no closure has"),
]


@pytest.mark.parametrize(("old", "new", "message"), BAD_LOOPS)
def test_a_loop_that_no_closure_can_close_is_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    """Where every joint of the loop slides, or has a spring, none can be replaced."""
    with pytest.raises(FileFormatError, match=message):
        io.load(write(tmp_path, FOUR_BAR.replace(old, new)))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "<gearbox_reference_body>world",
            "<gearbox_reference_body>coupler",
            "no hinge of the tree joins 'rocker' to its",
        ),
        ("<xyz>0 0 -1</xyz>", "<xyz>0 1 0</xyz>", "joint 'g': is a gearbox about another axis than its hinge 'd'"),
        ("<gearbox_reference_body>world</gearbox_reference_body>", "", "joint 'g': needs <gearbox_reference_body>"),
    ],
)
def test_a_gearbox_without_its_hinges_is_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    with pytest.raises(FileFormatError, match=message):
        io.load(write(tmp_path, GEARED.replace(old, new)))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('name="shoulder"', 'name="elbow_1"', "joint 'elbow': needs the name 'elbow_1', which is taken"),
        ('<link name="base">', '<link name="elbow_cross"/><link name="base">', "link 'world': no joint leads from it"),
        ("<child>lower</child>", "<child>n</child>", "joint 'elbow': model 'n' has no <link>"),
    ],
)
def test_names_that_are_needed_and_taken_are_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    text = ARM.replace('"elbow" type="revolute">', '"elbow" type="universal"><axis2><xyz>1 0 0</xyz></axis2>')
    with pytest.raises(FileFormatError, match=message):
        load(tmp_path, text.replace(old, new).replace("</model>", "<model name='n'/></model>"))


def test_a_plugin_that_joins_what_is_not_there_is_refused(tmp_path: Path) -> None:
    plugin = PLUGIN.format("DetachableJoint", WELDED.replace("rocker", "rock"))
    with pytest.raises(FileFormatError, match="plugin DetachableJoint: Unknown link 'rock'; known: crank"):
        io.load(write(tmp_path, FOUR_BAR.replace("</model>", f"{plugin}</model>")))


def test_frames_are_there_for_sidecars_and_close_loops_by_their_names(tmp_path: Path) -> None:
    """The open square with a frame at the end of either side; one of the frames hangs on another."""
    ends = (
        '<frame name="tip" attached_to="coupler"/><frame name="closing_c_1" attached_to="tip"><pose>1 0 0 0 0 0</pose>'
        '</frame><frame name="closing_c_2" attached_to="rocker"><pose>0 1 0 0 0 0</pose></frame><frame name="o"/>'
    )
    path = write(tmp_path, FOUR_BAR[: FOUR_BAR.index(LAST)] + ends + "</model></sdf>")
    chain = io.load(path)
    assert [(c.name, c.kind, c.frames) for c in chain.closures] == [("closing_c", "3d", ("closing_c_1", "closing_c_2"))]
    np.testing.assert_allclose(fb.closure_residual(chain, np.zeros(3)), 0.0, atol=1e-15)
    np.testing.assert_allclose(placed(chain, {"a": np.pi / 2})["closing_c_1"][:3, 3], [-1.0, 1.0, 0.0], atol=1e-15)
    (tmp_path / "arm.yaml").write_text(
        "closed_loop: [[tip, closing_c_2]]\ntype: [distance]\nlength: [1.0]\nname_mot: [a]\n"
    )
    assert [c.kind for c in io.load(path).closures] == ["distance"]
    with pytest.raises(FileFormatError, match="frame 'tip': 'tip' is attached to itself in a circle"):
        io.load(write(tmp_path, path.read_text().replace('attached_to="coupler"', 'attached_to="closing_c_1"')))


def test_an_open_tree_asks_for_a_sidecar_and_takes_one(tmp_path: Path) -> None:
    path = write(tmp_path, ARM)
    with pytest.raises(FileFormatError, match=r"has no sidecar: put arm\.yaml beside it"):
        io.load(path)
    (tmp_path / "arm.yaml").write_text("closed_loop: []\ntype: []\nname_mot: [elbow]\n")
    assert io.load(tmp_path).actuated == ("elbow",)
    (tmp_path / "arm.yaml").rename(tmp_path / "sidecar.yaml")
    assert io.load(tmp_path).actuated == ("elbow",)
    (tmp_path / "sidecar.urdf").write_text("<robot/>")  # now it is the sidecar of another one
    with pytest.raises(FileFormatError, match="has no sidecar"):
        io.load(path)


def test_a_folder_means_its_model(tmp_path: Path) -> None:
    """model.sdf among others; a linkage file beside it does not count, nor does the package's own XML."""
    write(tmp_path, FOUR_BAR, "model.sdf")
    write(tmp_path, ARM, "other.sdf")
    (tmp_path / "package.xml").write_text("<package/>")
    (tmp_path / "four.yaml").write_text("linkage: four\n")
    assert fb.load(tmp_path).name == "square"
    (tmp_path / "model.sdf").rename(tmp_path / "mine.sdf")
    with pytest.raises(FileFormatError, match=r"holds 2 \.sdf files \(mine\.sdf, other\.sdf\); name the one to load"):
        fb.load(tmp_path)
