"""Loops, motors and springs that a URDF states beside its tree, in the dialects of several simulators."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import fivebar_pin as fb
from fivebar_pin import io
from fivebar_pin.errors import FileFormatError, LeftOutWarning

LINK = (
    '<link name="{}"><inertial><origin xyz="{} 0 0"/><mass value="1"/>'
    '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
HINGE = (
    '<joint name="{}" type="revolute"><origin xyz="{}" rpy="0 0 {}"/><parent link="{}"/><child link="{}"/>'
    '<axis xyz="0 0 1"/></joint>'
)
HALF_PI = repr(np.pi / 2)
# A square four-bar of unit bars: crank up from (0, 0), coupler to the right, rocker up from (1, 0).
TREE = (
    '<link name="base"/>'
    + LINK.format("crank", 0.5)
    + LINK.format("coupler", 0.5)
    + LINK.format("rocker", 0.5)
    + HINGE.format("a", "0 0 0", HALF_PI, "base", "crank")
    + HINGE.format("b", "1 0 0", f"-{HALF_PI}", "crank", "coupler")
    + HINGE.format("d", "1 0 0", HALF_PI, "base", "rocker")
)
MOTOR = '<transmission name="t"><type>simple</type><joint name="a"/><actuator name="m"/></transmission>'
GAZEBO = (
    '<gazebo><joint name="c" type="revolute"><parent>coupler</parent><child>rocker</child><pose>1 0 0 0 0 0</pose>'
    "<axis><xyz>0 0 1</xyz></axis></joint></gazebo>"
)
LOOP_JOINT = (
    '<loop_joint name="c" type="revolute"><link1 link="coupler" xyz="1 0 0" rpy="0 0 0"/>'
    '<link2 link="rocker" xyz="1 0 0" rpy="0 0 0.3"/><axis xyz="0 0 1"/></loop_joint>'
)
CONSTRAINT = (
    '<constraint name="c" type="spherical_joint"><parent link="coupler"/><parent_origin xyz="1 0 0"/>'
    '<child link="rocker"/><child_origin xyz="1 0 0"/></constraint>'
)
TWICE = LOOP_JOINT.replace("link2 ", "link1 ").replace("revolute", "spherical")
BALL = (
    '<drake:ball_constraint xmlns:drake="http://drake.mit.edu"><drake:ball_constraint_body_A name="coupler"/>'
    '<drake:ball_constraint_body_B name="rocker"/><drake:ball_constraint_p_AP value="1 0 0"/>'
    '<drake:ball_constraint_p_BQ value="1 0 0"/></drake:ball_constraint>'
)
PIN = '<link name="closing_c_{}"/><joint name="p{}" type="fixed"><origin xyz="1 0 0"/><parent link="{}"/>'
NAMED = "".join(
    PIN.format(k, k, link) + f'<child link="closing_c_{k}"/></joint>' for k, link in ((1, "coupler"), (2, "rocker"))
)
DIALECTS = {
    "gazebo": (GAZEBO, "revolute"),
    "loop_joint": (LOOP_JOINT, "revolute"),
    "loop": (LOOP_JOINT.replace("loop_joint", "loop"), "revolute"),
    "constraint": (CONSTRAINT, "3d"),
    "link1 twice": (TWICE, "3d"),
    "ball": (BALL, "3d"),
    "names": (NAMED, "3d"),
}


def write(folder: Path, besides: str, sidecar: str | None = None) -> Path:
    path = folder / "square.urdf"
    path.write_text(f'<robot name="square">{TREE}{besides}</robot>', encoding="utf-8")
    if sidecar is not None:
        path.with_suffix(".yaml").write_text(sidecar, encoding="utf-8")
    return path


@pytest.mark.parametrize("dialect", DIALECTS)
def test_a_loop_is_closed_in_every_dialect(tmp_path: Path, dialect: str) -> None:
    """Closed as stated, and it moves as the parallelogram it is: the rocker turns with the crank."""
    besides, kind = DIALECTS[dialect]
    chain = io.load(write(tmp_path, besides + MOTOR))
    assert [c.kind for c in chain.closures] == [kind]
    assert chain.actuated == ("a",)
    np.testing.assert_allclose(fb.closure_residual(chain, np.zeros(3)), 0.0, atol=1e-15)
    q = fb.assemble(chain, [0.4], near=np.zeros(3))
    np.testing.assert_allclose(q, [0.4, -0.4, 0.4], atol=1e-10)


def test_a_gazebo_joint_keeps_its_axis_whichever_frame_states_it(tmp_path: Path) -> None:
    """In the joint's frame x is up here, in the model's frame y is."""
    one = io.load(write(tmp_path, GAZEBO.replace("0 0 1<", "1 0 0<"))).closures[0]
    model_frame = "0 1 0</xyz><use_parent_model_frame>1</use_parent_model_frame>"
    two = io.load(write(tmp_path, GAZEBO.replace("0 0 1</xyz>", model_frame))).closures[0]
    np.testing.assert_allclose(one.axis, [1.0, 0.0, 0.0])
    np.testing.assert_allclose(two.axis, [1.0, 0.0, 0.0], atol=1e-15)
    parent = '<parent link="base"/><axis xyz="0 1 0" frame="parent"/>'
    text = CONSTRAINT.replace('<parent link="coupler"/>', '<parent link="crank"/>').replace("spherical_joint", "hinge")
    text = text.replace('<parent_origin xyz="1 0 0"/>', f'<parent_origin xyz="1 0 0" rpy="0 0 {HALF_PI}"/>')
    text = text.replace("hinge", "revolute").replace(
        "</constraint>", parent[len('<parent link="base"/>') :] + "</constraint>"
    )
    np.testing.assert_allclose(io.load(write(tmp_path, text)).closures[0].axis, [1.0, 0.0, 0.0], atol=1e-15)


def test_a_closure_at_the_origin_of_a_link_is_at_the_link(tmp_path: Path) -> None:
    """No frame is made that is there already."""
    text = CONSTRAINT.replace('<child link="rocker"/><child_origin xyz="1 0 0"/>', '<child link="rocker"/>')
    assert io.load(write(tmp_path, text)).closures[0].frames == ("c_1", "rocker")


def test_a_file_that_closes_its_loops_and_names_no_motor_loads_undriven(tmp_path: Path) -> None:
    chain = io.load(write(tmp_path, GAZEBO))
    assert chain.actuated == ()
    assert fb.diagnose(chain).mobility == 1
    assert io.load(write(tmp_path, GAZEBO), actuated=["d"]).actuated == ("d",)


def test_motors_alone_do_not_close_a_loop(tmp_path: Path) -> None:
    """The file may be an open tree, or one whose loops stand nowhere; with closures=() it is the first."""
    path = write(tmp_path, MOTOR)
    with pytest.raises(FileFormatError, match=r"has no sidecar: put square\.yaml beside it"):
        io.load(path)
    assert io.load(path, closures=()).actuated == ("a",)
    with pytest.raises(FileFormatError, match=r"has no sidecar"):  # nothing says which joints are driven
        io.load(write(tmp_path, ""), closures=())


def test_motors_are_the_joints_of_transmissions_and_of_ros2_control(tmp_path: Path) -> None:
    """Once each; not what only reports a state, does not move, follows another joint or is not there."""
    mimic = HINGE.format("e", "0 0 0", "0", "base", "extra").replace("</joint>", '<mimic joint="a"/></joint>')
    control = (
        '<ros2_control name="r" type="system"><joint name="d"><command_interface name="position"/></joint>'
        '<joint name="b"><state_interface name="position"/></joint></ros2_control>'
    )
    more = MOTOR.replace('name="a"', 'name="e"') + MOTOR.replace('name="a"', 'name="gone"')
    more += NAMED + MOTOR.replace('name="a"', 'name="p1"')
    besides = LINK.format("extra", 0) + mimic + MOTOR + MOTOR + more + control
    assert io.load(write(tmp_path, besides)).actuated == ("a", "d")


def test_the_sidecar_wins_over_names_and_motors_and_adds_to_elements(tmp_path: Path) -> None:
    """Loops of elements stay, unless the sidecar closes the same frames; names count without a sidecar only."""
    open_tree = "closed_loop: []\ntype: []\nname_mot: [d]\n"
    chain = io.load(write(tmp_path, NAMED + MOTOR, open_tree))
    assert (chain.closures, chain.actuated) == ((), ("d",))
    chain = io.load(write(tmp_path, GAZEBO + MOTOR, open_tree))
    assert [c.name for c in chain.closures] == ["c"]
    same = open_tree.replace("[]", "[[c_2, c_1]]", 1).replace("[]", "[6d]", 1)
    assert [c.kind for c in io.load(write(tmp_path, GAZEBO, same)).closures] == ["6d"]


def test_what_was_loaded_is_saved_with_its_loops(tmp_path: Path) -> None:
    """The frames of the closure are links of the saved file, the closure stands in its sidecar."""
    for name, (besides, kind) in DIALECTS.items():
        folder = tmp_path / name.replace(" ", "_")
        folder.mkdir()
        chain = io.load(write(folder, besides + MOTOR))
        again = io.load(io.save(chain, folder / "out", formats="urdf")[0])
        assert ([c.kind for c in again.closures], again.actuated) == ([kind], ("a",))
        np.testing.assert_allclose(fb.closure_residual(again, np.zeros(3)), 0.0, atol=1e-15)


def test_forces_of_drake_that_are_not_read_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="<drake:joint>: acts on the mechanism and is not read"):
        io.load(write(tmp_path, GAZEBO + '<drake:joint name="x" type="ball"/>'))


def test_a_file_in_a_namespace_is_read_as_one_without(tmp_path: Path) -> None:
    """As Drake writes its own; what is in another namespace is not URDF."""
    path = write(tmp_path, LOOP_JOINT)
    other = '<view:camera xmlns:view="http://x"/>'
    path.write_text(path.read_text().replace('name="square">', f'name="square" xmlns="http://drake.mit.edu">{other}'))
    with pytest.warns(LeftOutWarning, match="camera element"):
        assert [c.name for c in io.load(path).closures] == ["c"]


def test_springs_that_gazebo_puts_on_joints_are_taken(tmp_path: Path) -> None:
    spring = (
        '<gazebo reference="{}"><springStiffness>3.0</springStiffness><springReference>0.5</springReference></gazebo>'
    )
    (one,) = io.load(write(tmp_path, GAZEBO + spring.format("b"))).springs
    assert (one.joint, one.stiffness, one.rest) == ("b", 3.0, 0.5)
    with pytest.raises(FileFormatError, match="<gazebo> of joint 'g': Unknown joint 'g'; known: a, b, d"):
        io.load(write(tmp_path, GAZEBO + spring.format("g")))


def test_plugins_of_gazebo_state_welds_and_motors(tmp_path: Path) -> None:
    """A weld where the links are with all joints at zero; the joints that controllers name."""
    ends = "<parent_link>{}</parent_link><child_model>square</child_model><child_link>{}</child_link>"
    weld = '<gazebo><plugin filename="f" name="gz::sim::systems::DetachableJoint">{}</plugin></gazebo>'
    drive = '<gazebo><plugin filename="joint-controller" name="c"><joint_name>d</joint_name></plugin></gazebo>'
    chain = io.load(write(tmp_path, weld.format(ends.format("coupler", "rocker")) + drive))
    assert [(c.name, c.kind) for c in chain.closures] == [("coupler~rocker", "6d")]
    assert chain.actuated == ("d",)
    np.testing.assert_allclose(fb.closure_residual(chain, np.zeros(3)), 0.0, atol=1e-15)
    with pytest.raises(FileFormatError, match="plugin DetachableJoint: Unknown link 'rock'"):
        io.load(write(tmp_path, weld.format(ends.format("coupler", "rock"))))


def test_what_moves_nothing_is_told_in_one_line(tmp_path: Path) -> None:
    besides = (
        '<gazebo><plugin name="p" filename="p.so"/></gazebo><gazebo reference="crank"><mu1>1</mu1><sensor/></gazebo>'
        + GAZEBO
        + '<sensor name="s"/><sensor name="t"/>'
    )
    tree = TREE.replace('<axis xyz="0 0 1"/></joint>', '<axis xyz="0 0 1"/><joint_properties friction="0"/></joint>', 1)
    tree = tree.replace('<axis xyz="0 0 1"/>', '<axis xyz="0 0 1" rpy="0 0 0"/>', 1)
    path = tmp_path / "square.urdf"
    path.write_text(f'<robot name="square">{tree}{besides}</robot>')
    with pytest.warns(LeftOutWarning) as caught:
        io.load(path)
    (one,) = caught
    told = "gazebo setting, gazebo sensor, gazebo plugin, 2 sensor elements, joint_properties element, axis rpy"
    assert str(one.message).endswith(told)


@pytest.mark.parametrize(
    ("besides", "message"),
    [
        (GAZEBO.replace("coupler", "coupling"), "joint 'c' in <gazebo>: Unknown link 'coupling'; known: base, "),
        (GAZEBO.replace('"revolute"', '"prismatic"'), "joint 'c': closes a loop, and no closure does what a prismatic"),
        (GAZEBO.replace("0 0 1<", "0 0 0<"), r"joint 'c' in <gazebo>: axis \[0.0, 0.0, 0.0\] has no direction"),
        (GAZEBO.replace("0 0 1<", "0 1<"), "joint 'c' in <gazebo>: <axis/xyz> = '0 1' must be 3 number"),
        (GAZEBO.replace("1 0 0 0 0 0", "1 0 0"), "joint 'c' in <gazebo>: <pose> = '1 0 0' must be 6 number"),
        (GAZEBO.replace('name="c" ', ""), "a <joint> in <gazebo>: <joint> needs the attribute 'name'"),
        (LOOP_JOINT.replace("link2", "link3"), "loop_joint 'c': needs its two links: <link1 link="),
        (LOOP_JOINT.replace('"rocker"', '"rock"'), "joint 'c': Unknown link 'rock'; known: base"),
        (CONSTRAINT.replace('<child link="rocker"/>', ""), "constraint 'c': needs its two links"),
        (
            BALL.replace('p_BQ value="1 0 0"', 'p_BR value="1 0 0"'),
            "<drake:ball_constraint>: needs <drake:ball_constraint_p_BQ>",
        ),
        (GAZEBO + LINK.format("c_1", 0) + HINGE.format("e", "0 0 0", "0", "base", "c_1"), "needs the name 'c_1' for a"),
        (GAZEBO.replace(">rocker<", ">coupler<"), r"loop\[0\]: .*joins two frames of one body"),
    ],
)
def test_a_loop_that_cannot_be_is_refused_by_element(tmp_path: Path, besides: str, message: str) -> None:
    path = write(tmp_path, besides)
    with pytest.raises(FileFormatError, match=message) as caught:
        io.load(path)
    assert str(path) in str(caught.value)
