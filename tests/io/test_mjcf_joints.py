"""Joints, couplings, tendons and motors of MJCF move as they do in MuJoCo."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin import JointSpring
from fivebar_pin.closures import Coupling, Point, Weld
from fivebar_pin.errors import FileFormatError, LeftOutWarning

mujoco = pytest.importorskip("mujoco")
from mujoco_twin import Twin  # noqa: E402

LINKAGE = """<mujoco model="linkage"><compiler angle="degree"/><option gravity="0.3 0 -9.81"/>
<default><joint axis="0 1 0" damping="0.1" armature="0.02"/><equality solref="0.01 1"/>
<default class="bar"><geom type="capsule" size="0.02" density="800"/>
<default class="soft"><joint damping="0.4" stiffness="3" springref="25"/></default></default></default>
<worldbody>
  <body name="a" childclass="bar"><joint name="crank" ref="30" class="soft" range="-400 400"/>
    <geom fromto="0 0 0 0.1 0 0.17"/>
    <body name="b" pos="0.1 0 0.17"><joint name="coupler" ref="-20"/><geom fromto="0 0 0 0.4 0 0"/></body></body>
  <body name="c" pos="0.45 0 0" childclass="bar"><joint name="rocker" ref="100"/><geom fromto="0 0 0 0.05 0 0.3"/>
  </body>
  <body name="w" pos="0 0.2 0"><joint name="wheel" ref="15" pos="0.01 0 0"/><geom size="0.05"/>
    <body name="s" euler="0 20 0"><joint name="slide" type="slide" axis="1 0 1" ref="0.1" stiffness="5"/>
      <joint name="turn" pos="0 0 0.1" ref="200"/><geom type="box" size="0.02 0.03 0.04"/></body></body>
</worldbody>
<tendon><fixed name="t1"><joint joint="slide" coef="2"/></fixed><fixed name="t2"><joint joint="wheel" coef="0.3"/>
</fixed><fixed name="t3"><joint joint="turn" coef="-1"/><joint joint="slide" coef="0.7"/><joint joint="crank" coef="1"/>
</fixed></tendon>
<equality><connect name="loop" body1="b" body2="c" anchor="0.4 0 0"/>
<joint name="gear" joint1="wheel" joint2="crank" polycoef="0.2 -1.5 0 0 0"/>
<tendon name="rack" tendon1="t1" tendon2="t2" polycoef="0.05 0.5 0 0 0"/><tendon name="sum" tendon1="t3"/></equality>
<actuator><motor joint="crank" gear="3" ctrlrange="-2 2"/></actuator>
<keyframe><key name="bent" qpos="0.9 -0.2 1.6 0.1 0.2 3"/></keyframe></mujoco>"""


def write(folder: Path, text: str) -> Path:
    (folder / "m.xml").write_text(text)
    return folder / "m.xml"


@pytest.mark.parametrize("seed", range(3))
def test_coordinates_count_from_ref_as_in_mujoco(tmp_path: Path, seed: int) -> None:
    """Mass matrix, bias and springs agree at MuJoCo's own coordinates."""
    Twin(write(tmp_path, LINKAGE)).assert_same(seed)


@pytest.mark.parametrize("angle", [0.1, 0.6, 0.9])
def test_couplings_and_closures_with_ref_hold_as_in_mujoco(tmp_path: Path, angle: float) -> None:
    """Where we close the loops MuJoCo's equalities are met, and both accelerate alike."""
    twin = Twin(write(tmp_path, LINKAGE))
    chain = twin.chain
    q = fb.assemble(chain, [angle], near=chain.references["qpos0"])
    residual, J = twin.equality(q)
    assert len(residual) == 6
    np.testing.assert_allclose(residual, 0.0, atol=1e-12)
    v = fb.complement(chain, q) @ [1.3]
    np.testing.assert_allclose(J @ v, 0.0, atol=1e-11)
    tau = np.array([0.7])
    ours = fb.forward_dynamics(chain, q, v, tau)
    theirs = twin.acceleration(q, v, np.eye(6)[0] * tau)
    np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=1e-9 * np.abs(theirs).max())


def test_ref_limits_keyframes_and_springs_are_in_the_same_coordinate(tmp_path: Path) -> None:
    chain = fb.load(write(tmp_path, LINKAGE))
    m = mujoco.MjModel.from_xml_path(str(tmp_path / "m.xml"))
    np.testing.assert_allclose(chain.references["qpos0"], m.qpos0, rtol=1e-15)
    np.testing.assert_array_equal(chain.references["bent"], m.key_qpos[0])
    np.testing.assert_allclose(chain.model.upperPositionLimit[0], m.jnt_range[0, 1], rtol=1e-15)
    assert chain.springs == (JointSpring("crank", 3.0, np.deg2rad(25.0)), JointSpring("slide", 5.0, 0.0))


def test_hinges_of_two_coordinates_are_neutral_in_the_stated_pose(tmp_path: Path) -> None:
    text = '<mujoco><worldbody><body><joint name="ja" ref="90"/><joint name="jb"/><geom size="0.1"/></body></worldbody>'
    chain = fb.load(write(tmp_path, text + '<custom><numeric name="unbounded jb" data="1"/></custom></mujoco>'))
    np.testing.assert_array_equal(chain.references["qpos0"], [np.pi / 2.0, 1.0, 0.0])


@pytest.mark.parametrize("formats", [("mjcf",), ("urdf",)])
def test_what_was_read_comes_back_from_a_saved_file(tmp_path: Path, formats: tuple[str, ...]) -> None:
    twin = Twin(write(tmp_path, LINKAGE))
    twin.chain = fb.load(fb.save(twin.chain, tmp_path / "again", formats=formats)[0])
    twin.assert_same()
    np.testing.assert_array_equal(twin.chain.model.upperEffortLimit[0], 6.0)
    near = twin.chain.references["qpos0"]
    residual, _ = twin.equality(fb.assemble(twin.chain, [0.6], near=near))
    np.testing.assert_allclose(residual, 0.0, atol=1e-12)


def gap(twin: Twin, q: np.ndarray) -> float:
    """Distance of the two frames of our first closure."""
    model, data = twin.chain.model, twin.chain.model.createData()
    pin.framesForwardKinematics(model, data, q)
    one, two = (data.oMf[model.getFrameId(name)].translation for name in twin.chain.closures[0].frames)
    return float(np.linalg.norm(two - one))


FRAMES = """<mujoco><default><default class="x"><geom size="0.2"/>
<joint armature="0.3"/></default><default class="y"><geom size="0.4"/></default></default><worldbody>
<frame pos="0.1 0.2 0.3" euler="10 20 30" childclass="x"><frame euler="0 0 40">
<body name="a" pos="1 0 0" euler="5 0 0"><frame pos="0.1 0 0.2" euler="0 60 0">
<joint name="ja" axis="1 2 3" pos="0 0.1 0"/><geom/><site name="tip" pos="0.3 0 0"/></frame>
<geom type="capsule" size="0.1" fromto="0 0 0 1 1 1"/>
<frame pos="0 0 0.1" euler="0 0 20"><inertial mass="2" pos="0.1 0 0" diaginertia="0.1 0.2 0.25"/></frame>
<frame zaxis="1 1 0"><body name="b"><joint name="jb" axis="0 1 0"/>
<frame childclass="x"><geom class="y"/></frame>
<frame zaxis="1 0 0"><geom type="capsule" size="0.1" fromto="0 0 0 1 1 1"/></frame></body></frame></body></frame>
</frame></worldbody><equality><connect site1="tip" site2="tip2"/></equality></mujoco>""".replace(
    "<worldbody>", '<worldbody><site name="tip2" pos="1 2 3"/>'
)


def test_frames_move_what_stands_in_them(tmp_path: Path) -> None:
    twin = Twin(write(tmp_path, FRAMES))
    twin.assert_same()
    q = np.array([0.4, -0.9])
    assert gap(twin, q) == pytest.approx(np.linalg.norm(twin.equality(q)[0]), rel=1e-13)


TENDONS = """<mujoco><default><tendon stiffness="7"/><motor armature="0.1"/></default><worldbody>
<body name="a"><joint name="ja" axis="0 1 0" springref="30" actuatorfrcrange="-1 9"/><geom size="0.1" pos="0.2 0 0"/>
<body name="b"><joint name="jb" type="slide"/><geom size="0.1" pos="0.2 0 0"/></body></body></worldbody>
<tendon><fixed name="t" springlength="0.4" damping="0.3"><joint joint="ja" coef="0.5"/></fixed>
<fixed><joint joint="ja" coef="-2"/></fixed><fixed stiffness="0" actuatorfrcrange="-1 1" name="u">
<joint joint="jb" coef="4"/></fixed></tendon>
<actuator><motor tendon="t" gear="3" forcerange="-1 2"/><motor tendon="t" gear="-1" forcerange="-1 2"/>
<motor tendon="u" damping="0.2" ctrlrange="-1 1" forcerange="-0.5 3" armature="0"/></actuator></mujoco>"""


def test_fixed_tendons_of_one_joint_are_its_springs_and_their_motors_its_own(tmp_path: Path) -> None:
    with pytest.warns(LeftOutWarning, match="left out: actuatorfrcrange of fixed 'u'$"):
        twin = Twin(write(tmp_path, TENDONS))
    twin.assert_same()
    chain = twin.chain
    assert chain.actuated == ("ja", "jb")
    on_a, automatic = chain.springs
    assert on_a == JointSpring("ja", 7.0 * 0.25, 0.8, 0.3 * 0.25)
    assert automatic == JointSpring("ja", 28.0, np.deg2rad(30.0))
    np.testing.assert_allclose(chain.model.armature, [0.1 * (1.5**2 + 0.5**2), 0.0], rtol=1e-15)
    np.testing.assert_allclose(chain.model.damping, [0.0, 0.2 * 16.0], rtol=1e-15)
    np.testing.assert_array_equal(chain.model.lowerEffortLimit, [-1.0, -2.0])
    np.testing.assert_array_equal(chain.model.upperEffortLimit, [3.5, 4.0])


TIMED = """<mujoco><worldbody><body name="a"><joint name="ja" axis="0 1 0" springdamper="0.2 0.7" armature="0.1"
ref="20" damping="3"/>{}<body name="b" pos="0.5 0 0"><joint name="jb" axis="0 1 0" springdamper="0.5 1.7" stiffness="9"
springref="5"/><geom size="0.1" pos="0 0.1 0.3"/></body></body></worldbody></mujoco>"""


def test_springs_stated_by_their_time_are_those_of_mujoco(tmp_path: Path) -> None:
    Twin(write(tmp_path, TIMED.format('<geom size="0.1" pos="0.3 0 0"/>'))).assert_same()
    bare = TIMED.format("").replace('<geom size="0.1" pos="0 0.1 0.3"/>', "")
    with pytest.raises(FileFormatError, match="joint 'ja': springdamper needs bodies of mass; state stiffness"):
        fb.load(write(tmp_path, bare))


SPLIT = """<mujoco><worldbody><body name="a"><joint name="ja"/><geom size="0.1"/></body>
<body name="b"><joint name="jb"/><geom size="0.1"/></body><body name="c"><joint name="jc"/><geom size="0.1"/></body>
<body name="d"><joint name="jd" type="ball"/><geom size="0.1"/></body><site name="s"/></worldbody>
<tendon><fixed name="split"><joint joint="ja" coef="0.5"/><joint joint="jb" coef="0.5"/></fixed></tendon>
<equality><joint joint1="ja" joint2="jc" polycoef="0 2 0 0 0"/><joint joint1="jb" joint2="jc" polycoef="0 2 0 0 0"/>
</equality><actuator><general name="grip" tendon="split"/></actuator></mujoco>"""


def test_a_motor_on_a_tendon_of_joints_that_couplings_tie_drives_the_first(tmp_path: Path) -> None:
    """Its force is spread over several joints: it bounds the effort of none of them."""
    bounded = SPLIT.replace('tendon="split"/>', 'tendon="split" forcerange="-1 1" ctrlrange="-1 1"/>')
    chain = fb.load(write(tmp_path, bounded))
    assert chain.actuated == ("ja",)
    assert chain.model.upperEffortLimit[0] > 1e300


def test_only_a_motors_control_is_its_force(tmp_path: Path) -> None:
    for tag, bound in (("motor", 6.0), ("general", np.finfo(float).max)):
        text = LINKAGE.replace("<motor", f"<{tag}")
        assert fb.load(write(tmp_path, text)).model.upperEffortLimit[0] == bound


def test_equalities_and_their_defaults_may_be_off(tmp_path: Path) -> None:
    text = LINKAGE.replace('<equality solref="0.01 1"/>', '<equality active="false"/>')
    with pytest.warns(LeftOutWarning, match="connect 'loop', which is not active, joint 'gear', which is not active"):
        assert fb.load(write(tmp_path, text)).closures == ()


@pytest.mark.parametrize("flag", ["equality", "constraint"])
def test_equalities_that_a_flag_takes_away_are_off(tmp_path: Path, flag: str) -> None:
    path = write(tmp_path, LINKAGE.replace("<worldbody>", f'<option><flag {flag}="disable"/></option><worldbody>'))
    with pytest.warns(LeftOutWarning, match="connect 'loop', which is not active"):
        assert fb.load(path).closures == ()


def test_a_wide_range_of_a_fixed_tendon_is_a_bound_and_is_told(tmp_path: Path) -> None:
    """The crank's limits let it go 13.96 rad, and the tendon twice as far."""
    tied = '<tendon><fixed name="far" range="-1.4 {}"><joint joint="crank" coef="-2"/></fixed>'
    path = write(tmp_path, LINKAGE.replace("<tendon>", tied.format(1.4), 1))
    with pytest.warns(LeftOutWarning, match="left out: range of fixed 'far'$"):
        fb.load(path)
    with pytest.raises(FileFormatError, match="fixed 'far': range: limits that tie bodies"):
        fb.load(write(tmp_path, LINKAGE.replace("<tendon>", tied.format(1.39), 1)))


def test_a_keyframe_without_an_orientation_has_the_neutral_one(tmp_path: Path) -> None:
    text = '<mujoco><worldbody><body><freejoint name="f"/><geom size="0.1"/></body></worldbody><keyframe>'
    chain = fb.load(write(tmp_path, text + '<key name="k" qpos="1 2 3 0 0 0 0"/></keyframe></mujoco>'))
    np.testing.assert_array_equal(chain.references["k"], [1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0])
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "m.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    np.testing.assert_array_equal(data.xquat[1], [1.0, 0.0, 0.0, 0.0])
    with pytest.raises(FileFormatError, match="remove align or alignfree"):
        text = text.replace("<worldbody>", '<compiler alignfree="true"/><worldbody>')
        fb.load(write(tmp_path, text + "</keyframe></mujoco>"))


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("0 2 0 0 0", "0 -2 0 0 0", "general 'grip', which pulls the tendon 'split' of joints that no coupling ties"),
        (
            '<joint joint1="jb" joint2="jc"',
            '<joint active="false" joint1="jb" joint2="jc"',
            "joint 'joint_1', which is",
        ),
        ('tendon="split"/>', 'joint="jd"/>', "general 'grip', which drives 'jd' of several degrees of freedom"),
        ('coef="0.5"/></fixed>', 'coef="-0.5"/></fixed>', "general 'grip', which pulls the tendon 'split' of joints"),
        ('tendon="split"/>', 'site="s"/>', "general 'grip', which drives no joint"),
        ('<general name="grip" tendon="split"/>', '<adhesion body="a"/>', "adhesion '0', which drives no joint"),
    ],
)
def test_what_drives_no_joint_is_told_and_left_out(tmp_path: Path, old: str, new: str, told: str) -> None:
    assert old in SPLIT
    path = write(tmp_path, SPLIT.replace(old, new, 1))
    with pytest.warns(LeftOutWarning) as caught:
        chain = fb.load(path)
    assert told in str(caught[0].message)
    assert chain.actuated == ()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('tendon="split"/>', 'tendon="splat"/>', "Unknown tendon 'splat'; known: split. Did you mean 'split'?"),
        ('tendon="split"/>', 'tendon="split" armature="1"/>', "armature at a tendon of several joints"),
        ('tendon="split"/>', 'site="s" damping="1"/>', "drives no joint, and its damping acts on the mechanism"),
        ('tendon="split"/>', 'tendon="split" geer="1"/>', "Unknown attribute of <general> 'geer'"),
        ('joint="jb" coef', 'joint="jx" coef', "Unknown joint 'jx'"),
        ("general", "engine", "Unknown actuator 'engine'"),
    ],
)
def test_motors_that_cannot_be_are_refused_by_name(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in SPLIT
    with pytest.raises(FileFormatError) as caught:
        fb.load(write(tmp_path, SPLIT.replace(old, new)))
    assert message in str(caught.value)


WELD = """<mujoco><worldbody><body name="a" pos="0 0 1"><joint/><geom size="0.1"/></body>
<body name="b" quat="1 0 1 0"><joint axis="1 1 0"/><geom size="0.1"/></body></worldbody><equality>
<weld body1="a" body2="b" relpose="0.1 0.2 0.3 1 1 0 0" anchor="0 0.1 0" torquescale="{}"/></equality></mujoco>"""


@pytest.mark.parametrize(("scale", "kind"), [("0", Point), ("0.3", Weld), ("1", Weld)])
def test_a_weld_that_weighs_no_turns_holds_its_point_alone(tmp_path: Path, scale: str, kind: type) -> None:
    twin = Twin(write(tmp_path, WELD.format(scale)))
    assert type(twin.chain.closures[0]) is kind
    q = np.array([0.3, -0.4])
    assert gap(twin, q) == pytest.approx(np.linalg.norm(twin.equality(q)[0][:3]), rel=1e-13)


def test_a_coupling_is_told_with_its_offset(tmp_path: Path) -> None:
    """q_1 - 15 degrees = 0.2 - 1.5 (q_2 - 30 degrees)."""
    gear = next(c for c in fb.load(write(tmp_path, LINKAGE)).closures if c.name == "gear")
    assert isinstance(gear, Coupling)
    assert dict(gear.ratios) == {"wheel": 1.0, "crank": 1.5}
    assert gear.offset == pytest.approx(0.2 + np.deg2rad(15.0 + 1.5 * 30.0))
