"""Bad files: every refusal is one of our errors, names the file and the element, and says what to do."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fivebar_pin import io
from fivebar_pin.chain import ClosedChain
from fivebar_pin.closures import Closure
from fivebar_pin.errors import (
    FileFormatError,
    FiveBarPinError,
    InvalidInputError,
    LeftOutWarning,
    OutputError,
    UnknownNameError,
)

URDF = """<robot name="bar">
  <link name="base"/>
  <link name="one"><inertial><origin xyz="0.1 0 0"/><mass value="1.5"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.3"/></inertial>
    <visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual></link>
  <link name="two"><inertial><mass value="0.5"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <link name="tip"/><link name="peg"/>
  <joint name="j1" type="revolute"><parent link="base"/><child link="one"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="2" velocity="3"/><dynamics damping="0.1" friction="0.2"/></joint>
  <joint name="j2" type="continuous"><origin xyz="0.3 0 0" rpy="0 0 0.1"/><parent link="one"/><child link="two"/>
    <axis xyz="0 0 1"/></joint>
  <joint name="j_tip" type="fixed"><origin xyz="0.2 0 0"/><parent link="two"/><child link="tip"/></joint>
  <joint name="j_peg" type="fixed"><origin xyz="0.4 0 0"/><parent link="base"/><child link="peg"/></joint>
</robot>
"""
SIDECAR = """closed_loop: [[tip, peg]]
type: ['3D']
name_mot: [j1]
"""
MJCF = """<mujoco><compiler angle="radian"/><default><default class="d"><joint damping="1"/></default></default>
<worldbody><body name="a" pos="0 0 1"><joint name="ja" axis="0 0 1" class="d" range="-1 1"/>
<geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.02"/><site name="s" pos="0.2 0 0"/></body>
<body name="b" quat="1 0 0 1"><joint name="jb" type="slide"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
</body></worldbody>
<equality><connect name="c" body1="a" body2="b" anchor="0.1 0 0"/></equality>
<actuator><motor joint="ja"/></actuator><keyframe><key name="home" qpos="0.1 0.2"/></keyframe></mujoco>
"""


SDF = """<sdf version="1.7"><world name="w"><gravity>0 0 -9.81</gravity><model name="m"><pose>0 0 1 0 0 0</pose>
<link name="one"><pose relative_to="f">0.1 0 0 0 0 0.2</pose><inertial><mass>1</mass><inertia><ixx>0.1</ixx></inertia>
</inertial><visual name="v"><geometry><box><size>1 1 1</size></box></geometry></visual></link><frame name="f"/>
<model name="n"><link name="two"/></model><link name="three"/>
<joint name="a" type="revolute"><parent>world</parent><child>one</child><axis><xyz expressed_in="f">0 0 1</xyz><limit>
<lower>-1</lower><upper>inf</upper></limit><dynamics><damping>1</damping></dynamics></axis></joint>
<joint name="b" type="universal"><parent>one</parent><child>n::two</child><axis><xyz>1 0 0</xyz></axis><axis2/></joint>
<joint name="c" type="prismatic"><parent>n::two</parent><child>three</child><axis/></joint>
<joint name="d" type="ball"><parent>world</parent><child>three</child></joint></model></world></sdf>
"""


def write(folder: Path, urdf: str = URDF, sidecar: str | None = SIDECAR) -> Path:
    (folder / "robot.urdf").write_text(urdf, encoding="utf-8")
    if sidecar is not None:
        (folder / "robot.yaml").write_text(sidecar, encoding="utf-8")
    return folder / "robot.urdf"


def test_the_files_these_tests_spoil_are_good(tmp_path: Path) -> None:
    """Unspoilt, the example loads from its folder and from its file."""
    path = write(tmp_path)
    for where in (tmp_path, path, str(path)):
        chain = io.load(where)
        assert (chain.joints, chain.actuated) == (("j1", "j2"), ("j1",))
        assert chain.closures[0].kind.value == "3d"
        assert chain.model.damping[0] == 0.1


BAD_URDF = [
    ("<robot", "<!DOCTYPE r [<!ENTITY a 'b'>]><robot", "DOCTYPE or entities"),
    ("</robot>", "", "not well-formed XML"),
    ("<robot name", "<sdf name", "mismatched tag"),
    ('name="one"', 'name="two"', "link 'two': is defined twice"),
    ('name="j2"', 'name="j1"', "joint 'j1': is defined twice"),
    ('<child link="tip"', '<child link="one"', "hangs on two joints ('j1' and 'j_tip')"),
    ('<child link="one"', '<child link="base"', "joins link 'base' to itself"),
    ('<parent link="base"/><child link="one"', '<parent link="tip"/><child link="one"', "go round in a circle"),
    ('<link name="base"/>', '<link name="base"/><link name="apart"/>', "has 2 root links (base, apart)"),
    (
        '<parent link="one"',
        '<parent link="on"',
        "Unknown link 'on'; known: base, one, two, tip, peg. Did",
    ),
    ('type="revolute"', 'type="revolving"', "Unknown joint type 'revolving'"),
    ('type="revolute"', "", "needs the attribute 'type'"),
    ('value="1.5"', 'value="-1.5"', "mass = -1.5 must not be negative"),
    ('value="1.5"', 'value="nan"', "'nan', which is not a finite number"),
    ('value="1.5"', 'value="1e999"', "out of range"),
    ('value="1.5"', 'value="1_5"', "not a finite number"),
    ('value="1.5"', 'value=""', "must be 1 number(s)"),
    ('<mass value="1.5"/>', "", "<inertial> needs <mass> and <inertia>"),
    ('<mass value="1.5"/>', '<mas value="1.5"/>', "did you mean 'mass'"),
    ('ixx="0.1"', 'ix="0.1"', "Unknown attribute of <inertia> 'ix'; known: ixx, ixy"),
    ("<inertial>", "<inertal>", "mismatched tag"),
    ('xyz="0.3 0 0"', 'xyz="0.3 0"', "must be 3 number(s)"),
    ('xyz="0.3 0 0"', 'xyz="0.3 nan 0"', "'nan', which is not a finite number"),
    ('rpy="0 0 0.1"', 'rpi="0 0 0.1"', "Unknown attribute of <origin> 'rpi'"),
    ('<axis xyz="0 0 1"', '<axis xyz="0 0 0"', "has no direction"),
    ('effort="2"', 'effort="-2"', "effort limit = -2.0 must not be negative"),
    ('effort="2"', 'efort="2"', "did you mean 'effort'"),
    ('lower="-1"', 'lower="2"', "lower limit 2.0 is above upper 1.0"),
    ("<limit", "<limits", "did you mean 'limit'"),
    ('damping="0.1"', 'dampig="0.1"', "did you mean 'damping'"),
    ("<box ", "<bix ", "Unknown shape 'bix'"),
    ('size="0.1 0.1 0.1"', 'size="0.1 0.1"', "must be 3 number(s)"),
    ("</joint>", '<mimic joint="j9"/></joint>', "mimic[0]: Unknown joint of closure j1 mimic 'j9'; known: j1, j2"),
    ("</joint>", '<mimic joint="j1"/></joint>', "joint 'j1': mimics itself"),
    ("</joint>", '<mimic multiplier="2"/></joint>', "<mimic> needs the attribute 'joint'"),
    ("</joint>", '<mimic joint="j2" ratio="2"/></joint>', "Unknown attribute of <mimic> 'ratio'"),
    ("</joint>", '<mimic joint="j2" multiplier="two"/></joint>', "'two', which is not a finite number"),
    ('name="base"', 'name="universe"', "name of the fixed world"),
    ("<link name", "<lnk name", "did you mean 'link'"),
]


@pytest.mark.parametrize(("old", "new", "message"), BAD_URDF)
def test_a_bad_urdf_is_refused_by_element(tmp_path: Path, old: str, new: str, message: str) -> None:
    """The error names the file, the element and the fault."""
    assert old in URDF
    path = write(tmp_path, URDF.replace(old, new, 1))
    with pytest.raises(FileFormatError) as caught:
        io.load(path)
    assert message in str(caught.value)
    assert str(tmp_path) in str(caught.value)


BAD_SIDECAR = [
    ("", "is empty"),
    ("[1, 2]", "holds a list; expected the keys closed_loop, type, name_mot"),
    ("closed_loop: []\ntype: []\n", "name_mot: is missing"),
    ("type: []\nname_mot: []\n", "closed_loop: is missing"),
    (SIDECAR + "name_motor: [j1]\n", "Unknown sidecar key 'name_motor'; known: closed_loop"),
    (
        SIDECAR.replace("3D", "4d"),
        "Unknown closure kind '4d'; known: 3d, 6d, coupling, cylindrical, distance, revolute",
    ),
    (SIDECAR.replace("'3D'", "'3D', '6d'"), "type: has 2 entries; expected 1"),
    (SIDECAR.replace("'3D'", "3"), "3 must be a name (text); put it in quotes"),
    (SIDECAR.replace("'3D'", "revolute"), "axis[0]: is missing"),
    (SIDECAR.replace("'3D'", "revolute") + "axis: [[0, 0, 0]]", "must not be zero"),
    (SIDECAR.replace("'3D'", "revolute") + "axis: [[0, .nan, 0]]", "must be a finite number"),
    (SIDECAR.replace("'3D'", "revolute") + "axis: [[0, 0]]", "has 2 entries; expected 3"),
    (SIDECAR.replace("[tip, peg]", "[tip, peg, base]"), "closed_loop[0]: has 3 entries; expected 2"),
    (
        SIDECAR.replace("[tip, peg]", "[tip, peck]"),
        "Unknown frame of closure tip~peck 'peck'; known: universe, base, j1",
    ),
    (SIDECAR.replace("[tip, peg]", "[tip, two]"), "('tip', 'two') but joins two frames of one body (j2)"),
    (SIDECAR.replace("[tip, peg]", "[tip, tip]"), "joins two frames of one body"),
    (SIDECAR.replace("[[tip, peg]]", "[tip]"), "closed_loop[0]: must be a list, is a str"),
    (SIDECAR.replace("[[tip, peg]]", "on"), "closed_loop: must be a list, is a bool"),
    (SIDECAR.replace("[j1]", "[j9]"), "Unknown joint 'j9'; known: j1, j2"),
    (SIDECAR.replace("[j1]", "[j_tip]"), "'j_tip' is not a joint that moves (fixed)"),
    (SIDECAR.replace("[j1]", "[j1, j1]"), "'j1' is named twice"),
    (SIDECAR.replace("[j1]", "[j2]") + "joint_name: [j2]\njoint_type: [SPHERICAL]\n", "3 degrees of freedom"),
    (SIDECAR + "joint_name: [j1]\njoint_type: [FIXED]\n", "'j1' is not a joint that moves (FIXED)"),
    (SIDECAR + "joint_name: [j2]\njoint_type: [ROUND]\n", "Unknown joint type 'ROUND'; known: SPHERICAL"),
    (SIDECAR + "joint_name: [j2]\n", "joint_type: has 0 entries; expected 1"),
    (SIDECAR + "gravity: [0, 0]\n", "gravity: has 2 entries; expected 3"),
    (SIDECAR + "gravity: [0, true, 0]\n", "'True' must be a finite number"),
    (SIDECAR + "gravity: [0, 1.0e+200, 0]\n", "must be a finite number of sensible size"),
    (SIDECAR + "joint_name: [j2, j2]\njoint_type: [SPHERICAL, SPHERICAL]\n", "joint_name: names a joint twice"),
    (SIDECAR + "".join(f"key_{k}: 1\n" for k in range(1000)), "states too many keys more than once"),
    (SIDECAR + "gravity: down\n", "gravity: must be a list, is a str"),
    (SIDECAR + "gravity: [0, 0, 1.0e+999]\n", "must be a finite number"),
    (SIDECAR + "joint_order: [j2, j1]\n", "'j2' comes before 'j1', which carries it"),
    (SIDECAR + "joint_order: [j1]\n", "must name each of the 2 moving joints once"),
    (SIDECAR + "joint_order: [j1, j3]\n", "Unknown moving joint 'j3'"),
    (SIDECAR + "joint_data: {j3: {armature: [1]}}\n", "Unknown joint 'j3'"),
    (SIDECAR + "joint_data: {j1: {armour: [1]}}\n", "Did you mean 'armature'?"),
    (SIDECAR + "joint_data: {j1: {armature: [-1]}}\n", "must not be negative"),
    (SIDECAR + "joint_data: {j1: {armature: [1, 2]}}\n", "has 2 values; the joint has 1"),
    (SIDECAR + "joint_data: [j1]\n", "must map names to values, is a list"),
    (SIDECAR + "reference_configurations: {home: [1]}\n", "has 1 values; the mechanism has nq = 3"),
    (SIDECAR + "type: ['6d']\n", "states ['type'] more than once"),
    (SIDECAR + "gravity: *g\n", "uses YAML aliases"),
    ("closed_loop: &a []\ntype: *a\nname_mot: *a\n", "uses YAML aliases"),
    (SIDECAR + "gravity: !!python/object/apply:os.system ['true']\n", "not plain YAML"),
    (SIDECAR + "gravity: " + "[" * 60 + "]" * 60, "nested deeper than"),
    (SIDECAR + "gravity: " + "[" * 100_000, "nested deeper than"),
    (SIDECAR + "gravity: [", "not plain YAML"),
    (SIDECAR + "gravity: [0, 0, 2021-99-99]\n", "not plain YAML"),
    (SIDECAR + "gravity: [0, 0, " + "9" * 5000 + "]\n", "not plain YAML"),
    ("a: 1\n---\nb: 2\n", "not plain YAML"),
]


@pytest.mark.parametrize(("text", "message"), BAD_SIDECAR)
def test_a_bad_sidecar_is_refused_by_key(tmp_path: Path, text: str, message: str) -> None:
    """The error names the file, the key and the fault."""
    path = write(tmp_path, sidecar=text)
    with pytest.raises(FileFormatError) as caught:
        io.load(path)
    assert message in str(caught.value)
    assert str(tmp_path) in str(caught.value)


def test_an_entity_bomb_is_refused_at_its_declaration(tmp_path: Path) -> None:
    """Entities are refused before any of them is expanded."""
    bomb = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 12))
    path = write(tmp_path, f'<!DOCTYPE robot [<!ENTITY l0 "ha">{bomb}]>' + URDF.replace("bar", "&l11;"))
    with pytest.raises(FileFormatError, match="DOCTYPE or entities"):
        io.load(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"\xff\xfe\x00garbage", "not well-formed XML"),
        (URDF.replace("bar", "b\xe9").encode("latin-1"), "not well-formed XML"),
        (b"", "is empty"),
        (b"\x00" * 100, "not well-formed XML"),
        (b'<?xml version="1.0" encoding="nonsense"?>' + URDF.encode(), "not well-formed XML"),
        (b"<a>" * 1000, "nested deeper than 200"),
        (b"<robot>" + b"<link/>" * 200_001 + b"</robot>", "more than 200000 elements"),
        (b"<robot/>", "has no <link>"),
    ],
)
def test_files_that_are_no_text_or_no_urdf_are_refused(tmp_path: Path, content: bytes, message: str) -> None:
    """Bytes that are not UTF-8, not XML, too deep or too many."""
    write(tmp_path)
    (tmp_path / "robot.urdf").write_bytes(content)
    with pytest.raises(FileFormatError, match=message):
        io.load(tmp_path)


def test_a_sidecar_that_is_not_utf8_is_refused(tmp_path: Path) -> None:
    """Bytes that are not UTF-8 in YAML."""
    write(tmp_path)
    (tmp_path / "robot.yaml").write_bytes(b"closed_loop: [\xff]")
    with pytest.raises(FileFormatError, match="not UTF-8"):
        io.load(tmp_path)


def test_files_above_the_bound_are_not_read(tmp_path: Path) -> None:
    """The size bound is an argument, and the message names it."""
    path = write(tmp_path)
    with pytest.raises(FileFormatError, match="larger than 100 bytes; pass a larger max_bytes"):
        io.load(path, max_bytes=100)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda d: d / "none", "no such file or folder"),
        (lambda d: d, "holds no .urdf"),
        (lambda d: _touch(d / "robot.txt"), "unknown ending"),
        (lambda d: _touch(d / "robot.urdf"), "is empty"),
        (lambda d: _touch(d / "a.urdf", d / "b.urdf").parent, "holds 2 .urdf files"),
        (lambda d: _folder(d / "robot.urdf"), "holds no .urdf"),
        (lambda d: write(d, sidecar=None), "has no sidecar: put robot.yaml beside it"),
        (lambda d: _touch(d / "robot.yml", write(d)), "two sidecars"),
    ],
)
def test_a_path_that_leads_to_no_mechanism_says_why(tmp_path: Path, make: Callable[[Path], Path], message: str) -> None:
    """Missing, ambiguous, empty, a folder, another kind of file, no sidecar."""
    with pytest.raises(FileFormatError, match=message):
        io.load(make(tmp_path))


def _touch(*paths: Path) -> Path:
    for path in paths:
        path.touch()
    return paths[-1]


def _folder(path: Path) -> Path:
    path.mkdir()
    return path


@pytest.mark.parametrize("path", ["", None, 3, "a\0b", "x" * 5000])
def test_a_path_that_is_none_is_refused(path: object) -> None:
    """Not a name, an impossible name."""
    with pytest.raises(FiveBarPinError):
        io.load(path)


def test_arguments_stand_in_for_a_sidecar(tmp_path: Path) -> None:
    """With closures and actuated given no sidecar is needed; wrong ones are the caller's error, not the file's."""
    path = write(tmp_path, sidecar=None)
    chain = io.load(path, closures=[Closure(("tip", "peg"))], actuated="j1", gravity=(0, 1, 0), free_flyer=True)
    assert chain.joints == ("root_joint", "j1", "j2")
    np.testing.assert_array_equal(chain.model.gravity.linear, [0.0, 1.0, 0.0])
    with pytest.raises(UnknownNameError, match="Unknown actuated joint 'j7'"):
        io.load(path, closures=(), actuated=["j7"])
    with pytest.raises(InvalidInputError, match="must be Closure objects"):
        io.load(path, closures=[("tip", "peg")], actuated=["j1"])
    with pytest.raises(InvalidInputError, match="gravity"):
        io.load(path, closures=(), actuated=(), gravity=(0.0, np.nan, 0.0))


def test_the_sidecars_joint_types_are_taken(tmp_path: Path) -> None:
    """CARDAN gives two hinges, SPHERICAL a ball, FIXED takes the joint out of the coordinates."""
    kinds = {"CARDAN": 3, "ujoint_zy": 3, "spherical": 5, "FIXED": 1, "TRANSLATION": 4, "SPHERICAL_ZYX": 4}
    for word, nq in kinds.items():
        write(
            tmp_path,
            sidecar=SIDECAR.replace("tip", "base").replace("peg", "one") + f"joint_name: [j2]\njoint_type: [{word}]",
        )
        chain = io.load(tmp_path)
        assert chain.nq == nq
        np.testing.assert_allclose(chain.mass, 2.0)
    write(tmp_path, sidecar=SIDECAR + "joint_name: [j2]\njoint_type: [CARDAN]")
    assert io.load(tmp_path).joints == ("j1", "j2_X", "j2_Y")
    write(tmp_path, sidecar=SIDECAR + "joint_name: [j2]\njoint_type: [UJOINT_ZY]")
    chain = io.load(tmp_path)
    assert chain.joints == ("j1", "j2_Z", "j2_Y")
    assert [j.shortname() for j in chain.model.joints][2:] == ["JointModelRZ", "JointModelRY"]
    write(tmp_path, URDF.replace('name="j_tip"', 'name="j2_X"'), SIDECAR + "joint_name: [j2]\njoint_type: [CARDAN]")
    with pytest.raises(FileFormatError, match="would make a second j2_X"):
        io.load(tmp_path)


def test_a_limit_without_bounds_bounds_nothing(tmp_path: Path) -> None:
    """CAD exporters write <limit effort velocity> for a joint that turns freely; a closure may name a joint's frame."""
    write(tmp_path, URDF.replace('lower="-1" upper="1"', ""), SIDECAR.replace("[tip, peg]", "[j2, base]"))
    model = io.load(tmp_path).model
    assert model.upperPositionLimit[0] > 1e300
    assert model.lowerPositionLimit[0] < -1e300
    assert model.upperEffortLimit[0] == 2.0


def test_a_joint_without_limit_is_not_limited(tmp_path: Path) -> None:
    """No <limit>, or one without effort and velocity: nothing bounds the joint there."""
    limit = '<limit lower="-1" upper="1" effort="2" velocity="3"/>'
    model = io.load(write(tmp_path, URDF.replace(limit, ""))).model
    assert model.upperPositionLimit[0] > 1e300
    assert model.upperEffortLimit[0] > 1e300
    model = io.load(write(tmp_path, URDF.replace(limit, '<limit lower="-1" upper="1"/>'))).model
    assert (model.upperPositionLimit[0], model.upperVelocityLimit[0]) == (1.0, np.finfo(float).max)


def test_a_link_with_mass_zero_is_massless(tmp_path: Path) -> None:
    """No mass and no moments are none; moments without mass stay, without a mass centre, for the diagnosis to tell."""
    model = io.load(write(tmp_path, URDF.replace('value="1.5"', 'value="0"'))).model
    stated = [0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.2, 0.0, 0.0, 0.3]
    np.testing.assert_allclose(model.inertias[1].toDynamicParameters(), stated)
    tiny = URDF.replace('value="1.5"', 'value="0"').replace(
        'ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.3"',
        'ixx="1e-9" ixy="0" ixz="0" iyy="1e-9" iyz="0" izz="1e-9"',
    )
    model = io.load(write(tmp_path, tiny)).model
    np.testing.assert_array_equal(model.inertias[1].toDynamicParameters(), np.zeros(10))


def test_a_joint_type_for_a_joint_that_is_not_there_is_told(tmp_path: Path) -> None:
    """The rest of the sidecar counts."""
    sidecar = SIDECAR + "joint_name: [j9, j2]\njoint_type: [FIXED, SPHERICAL]\n"
    with pytest.warns(LeftOutWarning, match="joint_type of joint 'j9', which the tree does not have") as caught:
        chain = io.load(write(tmp_path, sidecar=sidecar))
    assert len(caught) == 1
    assert chain.nq == 5


def test_a_mesh_is_named_but_not_needed(tmp_path: Path) -> None:
    """A mesh that is nowhere keeps its name; one that is found is named by its path, and saved relative to it."""
    box = '<box size="0.1 0.1 0.1"/>'
    write(tmp_path, URDF.replace(box, '<mesh filename="package:///one.stl" scale="1 2 3"/>'))
    with pytest.warns(LeftOutWarning, match=r"mesh package:///one.stl \(not found; ROS_PACKAGE_PATH"):
        assert io.load(tmp_path).visuals[0].mesh == "package:///one.stl"
    (tmp_path / "one.stl").touch()
    chain = io.load(tmp_path)
    assert chain.visuals[0].mesh == str(tmp_path / "one.stl")
    assert chain.visuals[0].size == (1.0, 2.0, 3.0)
    urdf, _, xml = io.save(chain, tmp_path, name="again")
    assert 'filename="one.stl"' in urdf.read_text()
    assert 'file="one.stl"' in xml.read_text()
    assert io.load(xml).visuals[0].mesh == str(tmp_path / "one.stl")


def test_nothing_is_overwritten_unless_told(tmp_path: Path) -> None:
    """A second save raises before it writes anything; with overwrite it replaces all files."""
    write(tmp_path)
    chain = io.load(tmp_path)
    paths = io.save(chain, tmp_path / "out")
    assert [p.suffix for p in paths] == [".urdf", ".yaml", ".xml"]
    paths[0].unlink()
    paths[1].write_text("mine")
    with pytest.raises(OutputError, match="exists already; pass overwrite=True") as caught:
        io.save(chain, tmp_path / "out")
    assert caught.value.path == str(paths[1])
    assert not paths[0].exists()
    assert paths[1].read_text() == "mine"
    io.save(chain, tmp_path / "out", overwrite=True)
    assert "closed_loop" in paths[1].read_text()
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["bar.urdf", "bar.xml", "bar.yaml"]


def test_a_place_that_cannot_be_written_is_an_output_error(tmp_path: Path) -> None:
    """A file in the way of the folder, a folder in the way of the file, a device."""
    chain = io.load(write(tmp_path))
    with pytest.raises(OutputError, match="is a file"):
        io.save(chain, tmp_path / "robot.yaml")
    with pytest.raises(OutputError):
        io.save(chain, tmp_path / "robot.yaml" / "deeper")
    (tmp_path / "x.urdf").mkdir()
    with pytest.raises(OutputError, match="is a folder"):
        io.save(chain, tmp_path, name="x", overwrite=True)
    with pytest.raises(OutputError, match=r"cannot be (made|written)"):
        io.save(chain, "/proc/nowhere")


def test_save_refuses_what_no_file_can_say(tmp_path: Path) -> None:
    """Unknown formats, impossible names, joints and inertias without a word in URDF."""
    chain = io.load(write(tmp_path))
    with pytest.raises(UnknownNameError, match="Unknown format 'sdf'; known: urdf, mjcf"):
        io.save(chain, tmp_path, formats="sdf")
    for name in ("a/b", "..", ""):
        with pytest.raises(InvalidInputError, match="plain file name"):
            io.save(chain, tmp_path, name=name)
    with pytest.raises(InvalidInputError, match="names the file already"):
        io.save(chain, tmp_path / "a.urdf", name="b")
    model = pin.Model()
    axes = np.eye(3)
    model.addJoint(0, pin.JointModelUniversal(axes[0], axes[1]), pin.SE3.Identity(), "u")
    with pytest.raises(InvalidInputError, match="revolute and prismatic joints with massless links"):
        io.save(ClosedChain(model, (), ()), tmp_path / "u")
    model = pin.Model()
    model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "bad\x01name")
    with pytest.raises(InvalidInputError, match="printable text"):
        io.save(ClosedChain(model, (), ()), tmp_path / "u")
    assert not (tmp_path / "u").exists()


def test_names_that_xml_and_yaml_must_quote_come_back(tmp_path: Path) -> None:
    """Quotes, ampersands, YAML words and other alphabets in names survive both files."""
    names = ('a"b<&>', "on", "1.5", "gelenk ä 关节", "- x: [y]", "null")
    model = pin.Model()
    model.name = 'it\'s <a> & "b"'
    for k, name in enumerate(names):
        j = model.addJoint(k, pin.JointModelRX(), pin.SE3.Identity(), name)
        model.appendBodyToJoint(j, pin.Inertia.Identity(), pin.SE3.Identity())
        model.addFrame(pin.Frame(f"{name} tip", j, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    closure = Closure((f"{names[0]} tip", f"{names[2]} tip"), name="no")
    chain = ClosedChain(model, (closure,), names[::-1])
    for path in io.save(chain, tmp_path)[::2]:
        back = io.load(path)
        assert back.joints == names
        assert back.actuated == names[::-1]
        assert back.name == model.name
        assert (back.closures[0].frames, back.closures[0].name) == (closure.frames, "no")


PIECES = (
    "", "nan", "inf", "-1", "0", "1e400", "1e308", "-1e308", "1e29", "1e-320", "a", "<", ">", '"', "/>", "<joint",
    "one", "base", "j1", "\0", "&amp;", "&x;", "[", "]", "{", "}", ": ", "- ", "*a", "&a ", "'", "\n", "  ", "\t",
    "!!int", "~", "é", "3d", "revolute", "fixed", "ball", "free", "SPHERICAL", "universe",
)  # fmt: skip

MORE = """gravity: [0, 0, -1]
joint_order: [j1, j2]
joint_data: {j1: {armature: [1]}}
axis: [[0, 0, 1]]
reference_configurations: {home: [0, 1, 0]}
"""


@st.composite
def spoilt(draw: st.DrawFn, text: str) -> str:
    """The text with a few cuts, repeats and insertions."""
    for _ in range(draw(st.integers(1, 4))):
        i = draw(st.integers(0, len(text)))
        j = min(len(text), i + draw(st.integers(0, 12)))
        what = draw(st.sampled_from(["cut", "insert", "swap", "repeat"]))
        piece = draw(st.sampled_from(PIECES))
        middle = {"cut": "", "insert": piece + text[i:j], "swap": piece, "repeat": text[i:j] * 2}[what]
        text = text[:i] + middle + text[j:]
    return text


def accepted(path: Path) -> bool:
    """Load: True for a chain that computes finite dynamics, False for one of our errors."""
    try:
        chain = io.load(path)
    except FiveBarPinError as error:
        assert str(error)
        return False
    model = chain.model
    q = pin.neutral(model)
    assert np.all(np.isfinite(q))
    pin.crba(model, model.createData(), q)
    assert all(f in [g.name for g in model.frames] for c in chain.closures for f in c.frames)
    return True


EXAMPLES = int(os.environ.get("FUZZ_EXAMPLES", "300"))
FUZZ = settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.mark.filterwarnings("ignore::fivebar_pin.errors.LeftOutWarning")
@FUZZ
@given(text=spoilt(URDF))
def test_a_spoilt_urdf_is_a_chain_or_our_error(tmp_path: Path, text: str) -> None:
    """No crash, no hang, no foreign exception."""
    accepted(write(tmp_path, text))


@pytest.mark.filterwarnings("ignore::fivebar_pin.errors.LeftOutWarning")
@FUZZ
@given(
    text=spoilt(
        SIDECAR + "gravity: [0, 0, -1]\njoint_order: [j1, j2]\njoint_data: {j1: {armature: [1]}}\naxis: [[0, 0, 1]]\n"
    )
)
def test_a_spoilt_sidecar_is_a_chain_or_our_error(tmp_path: Path, text: str) -> None:
    """No crash, no hang, no foreign exception."""
    accepted(write(tmp_path, sidecar=text))


@pytest.mark.filterwarnings("ignore::fivebar_pin.errors.LeftOutWarning")
@FUZZ
@given(text=spoilt(SDF))
def test_a_spoilt_sdf_is_a_chain_or_our_error(tmp_path: Path, text: str) -> None:
    """No crash, no hang, no foreign exception."""
    (tmp_path / "robot.sdf").write_text(text, encoding="utf-8")
    accepted(tmp_path / "robot.sdf")


@FUZZ
@given(text=spoilt(MJCF))
def test_a_spoilt_mjcf_is_a_chain_or_our_error(tmp_path: Path, text: str) -> None:
    """No crash, no hang, no foreign exception."""
    (tmp_path / "robot.xml").write_text(text, encoding="utf-8")
    accepted(tmp_path / "robot.xml")


@FUZZ
@given(data=st.binary(max_size=300), which=st.sampled_from(["robot.urdf", "robot.yaml", "robot.xml", "robot.sdf"]))
def test_random_bytes_are_our_error(tmp_path: Path, data: bytes, which: str) -> None:
    """Noise in either file is refused."""
    write(tmp_path)
    (tmp_path / which).write_bytes(data)
    assert not accepted(tmp_path / ("robot.urdf" if which == "robot.yaml" else which))


def test_the_unspoilt_texts_of_the_fuzz_tests_are_accepted(tmp_path: Path) -> None:
    """The fuzz tests start from good files."""
    assert accepted(write(tmp_path))
    (tmp_path / "m.xml").write_text(MJCF)
    assert accepted(tmp_path / "m.xml")
    (tmp_path / "m.sdf").write_text(SDF)
    assert accepted(tmp_path / "m.sdf")
    chain = io.load(tmp_path / "m.xml")
    np.testing.assert_array_equal(chain.model.referenceConfigurations["home"], [0.1, 0.2])
    assert accepted(write(tmp_path, sidecar=SIDECAR + MORE))


LOSSES = """<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual></link>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="2" velocity="3"/><dynamics damping="0.1" friction="0.2"/></joint></robot>"""
SIDE = "closed_loop: []\ntype: []\nname_mot: [j]\n"


@pytest.mark.parametrize(
    ("old", "new", "data", "message"),
    [
        ('damping="0.1"', 'damping="-0.1"', "", "joint 'j': damping = -0.1 must not be negative"),
        ('friction="0.2"', 'friction="-1e-9"', "", "joint 'j': friction = -1e-09 must not be negative"),
        ('size="0.1 0.1 0.1"', 'size="0.1 -0.1 0.1"', "", "visual of link 'b'.*must not be negative"),
        ('<box size="0.1 0.1 0.1"/>', '<sphere radius="-1"/>', "", "visual of link 'b'.*must not be negative"),
        ('<box size="0.1 0.1 0.1"/>', '<cylinder radius="1" length="-1"/>', "", "visual of link 'b'.*negative"),
        ("", "", "effort: [-1]", "effort = .* must not be negative"),
        ("", "", "velocity: [-1]", "velocity = .* must not be negative"),
        ("", "", "damping: [-1]", "damping = .* must not be negative"),
        ("", "", "lower: [2], upper: [1]", r"lower = \[2.0\] and upper = \[1.0\]: the lower limit is above the upper"),
        ("", "", "lower: [2]", r"lower = \[2.0\] and upper = \[1.0\]: the lower limit is above the upper"),
        ("", "", "effort_lower: [3]", "effort_lower = .* the lower limit is above the upper"),
    ],
)
def test_losses_and_limits_that_no_joint_has_are_refused(
    tmp_path: Path, old: str, new: str, data: str, message: str
) -> None:
    (tmp_path / "r.urdf").write_text(LOSSES.replace(old, new) if old else LOSSES)
    (tmp_path / "r.yaml").write_text(SIDE + (f"joint_data: {{j: {{{data}}}}}\n" if data else ""))
    with pytest.raises(FileFormatError, match=message):
        io.load(tmp_path / "r.urdf")


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ('damping="-1"', "damping"),
        ('frictionloss="-1"', "friction"),
        ('armature="-1"', "armature"),
        ('range="2 1"', "range|limits"),
        ('actuatorfrcrange="2 1"', "actuatorfrcrange|limits"),
    ],
)
def test_the_same_is_refused_in_mjcf(tmp_path: Path, word: str, message: str) -> None:
    (tmp_path / "r.xml").write_text(
        '<mujoco><compiler autolimits="true"/><worldbody><body name="b"><inertial pos="0 0 0" mass="1" '
        f'diaginertia="1 1 1"/><joint name="j" axis="0 0 1" {word}/></body></worldbody></mujoco>'
    )
    with pytest.raises(FileFormatError, match=message):
        io.load(tmp_path / "r.xml")


@pytest.mark.parametrize("tag", ["!!int ''", "!!bool x", "!!int _", "!!float ''"])
def test_a_tag_that_does_not_fit_its_value_is_refused(tmp_path: Path, tag: str) -> None:
    (tmp_path / "r.urdf").write_text(LOSSES)
    (tmp_path / "r.yaml").write_text(SIDE + f"gravity: [0, 0, {tag}]\n")
    with pytest.raises(FileFormatError, match=r"is not plain YAML|gravity"):
        io.load(tmp_path / "r.urdf")
