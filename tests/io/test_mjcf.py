"""MJCF: what is saved comes back, and MuJoCo, which nobody here wrote, sees the same mechanism."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from random_chains import assert_same, mass_matrix, random_chain, random_inertia, random_placement

from fivebar_pin import io, paper
from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import FileFormatError, InvalidInputError

mujoco = pytest.importorskip("mujoco")

MIXED = """<mujoco model="mixed"><compiler {compiler}/>
<option gravity="0.5 -1 -9.81"/>
<default><joint armature="0.01"/><default class="soft"><joint damping="0.3"/><geom density="500"/></default></default>
<worldbody>
  <body name="a" pos="0.1 0.2 0" euler="{euler}">
    <joint name="ja" axis="0 1 1" pos="0.1 0.2 0.3" range="{range}" frictionloss="0.2"/>
    <inertial pos="0.1 0 0" quat="1 2 3 4" mass="1" diaginertia="0.3 0.31 0.32"/>
    <geom type="sphere" size="1"/>
    <body name="b" pos="0.3 0 0" quat="1 1 0 0" childclass="soft">
      <joint type="slide" axis="1 2 0" name="jb"/><geom type="capsule" fromto="0 0 0 0.2 0.1 0.3" size="0.02"/>
      <geom type="box" size="0.1 0.2 0.3" axisangle="1 2 3 {turn}"/><site name="tip" pos="0.2 0.1 0" zaxis="1 1 1"/>
      <body name="c" xyaxes="1 2 0 0 1 1"><joint type="ball" name="jc" pos="0.1 0 0.2"/>
        <geom size="0.1 0.3" type="cylinder" pos="0.1 0.2 0.3" mass="0.7"/>
        <body name="welded" pos="0 0.1 0"><geom type="ellipsoid" size="0.1 0.2 0.3" group="3"/></body></body>
      <body name="f" pos="0.1 0 0"><inertial pos="0.1 0 0" mass="1" fullinertia="0.3 0.31 0.32 0.01 0.02 0.03"/></body>
    </body>
  </body>
  <body name="d" pos="0 1 0" zaxis="0 -1 0.5">
    <joint name="jd1" axis="1 0 0" pos="0 0 0.1"/><joint name="jd2" axis="0 1 0" pos="0.2 0 0"/>
    <joint name="jd3" type="slide" axis="0 1 1"/><geom size="0.1"/><geom type="box" size="0.05" fromto="0 0 0 0 1 1"/>
  </body>
</worldbody>
<equality><connect name="pin" body1="b" body2="d" anchor="0.1 0.2 0"/>
<weld name="glue" body1="c" body2="d" anchor="0 0.1 0"/><connect name="sites" site1="tip" site2="base"/></equality>
<actuator><motor joint="ja"/><position joint="jd2"/></actuator>
</mujoco>""".replace('<geom size="0.1"/>', '<geom size="0.1"/><site name="base" pos="0.1 0 0"/>')


def mixed(tmp_path: Path, unit: str = "degree") -> Path:
    s = 1.0 if unit == "radian" else 180.0 / np.pi
    numbers = {
        "euler": f"{0.1 * s!r} {0.2 * s!r} {0.3 * s!r}",
        "range": f"{-s!r} {2.0 * s!r}",
        "turn": repr(0.4 * s),
    }
    path = tmp_path / "mixed.xml"
    path.write_text(MIXED.format(compiler="" if unit == "degree" else 'angle="radian" eulerseq="xyz"', **numbers))
    return path


def to_qpos(model: pin.Model, q: Array) -> Array:
    """Quaternions (x, y, z, w) to (w, x, y, z); the rest is the same."""
    parts = [q[i : i + n] for i, n in zip(list(model.idx_qs)[1:], list(model.nqs)[1:], strict=True)]
    return np.concatenate([np.roll(p, 1) if p.size == 4 else p for p in parts])


def witness(path: Path, model: pin.Model, q: Array, v: Array) -> tuple[Array, Array, Array]:
    """MuJoCo's mass matrix, bias force and equality residual of the same file."""
    m = mujoco.MjModel.from_xml_path(str(path))
    d = mujoco.MjData(m)
    d.qpos[:], d.qvel[:] = to_qpos(model, q), v
    mujoco.mj_forward(m, d)
    columns = []
    for unit in np.eye(m.nv):
        column = np.zeros(m.nv)
        mujoco.mj_mulM(m, d, column, unit)
        columns.append(column)
    equality = d.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
    return np.array(columns), np.array(d.qfrc_bias), np.array(d.efc_pos[equality])


@pytest.mark.parametrize("unit", ["degree", "radian"])
@pytest.mark.parametrize("seed", range(3))
def test_mujoco_and_we_read_the_same_dynamics(tmp_path: Path, unit: str, seed: int) -> None:
    """Mass matrix and bias force of a file with every joint, geom and orientation agree with MuJoCo's."""
    path = mixed(tmp_path, unit)
    model = io.load(path).model
    rng = np.random.default_rng(seed)
    q = pin.integrate(model, pin.neutral(model), rng.normal(size=model.nv))
    v = rng.normal(size=model.nv)
    M, bias, _ = witness(path, model, q, v)
    np.testing.assert_allclose(mass_matrix(model, q), M, rtol=0.0, atol=1e-12 * np.abs(M).max())
    ours = pin.nle(model, model.createData(), q, v)
    np.testing.assert_allclose(ours, bias, rtol=0.0, atol=1e-12 * np.abs(bias).max())


def test_mujoco_and_we_read_the_same_closures(tmp_path: Path) -> None:
    """The distance between the frames of each closure is the length of MuJoCo's constraint error."""
    path = mixed(tmp_path)
    chain = io.load(path)
    model, data = chain.model, chain.model.createData()
    q = pin.integrate(model, pin.neutral(model), np.random.default_rng(4).normal(size=model.nv))
    _, _, error = witness(path, model, q, np.zeros(model.nv))
    pin.framesForwardKinematics(model, data, q)
    assert [(c.name, c.kind.value) for c in chain.closures] == [("pin", "3d"), ("glue", "6d"), ("sites", "3d")]
    for closure, rows in zip(chain.closures, (slice(0, 3), slice(3, 6), slice(9, 12)), strict=True):
        p1, p2 = (data.oMf[model.getFrameId(f)].translation for f in closure.frames)
        assert np.linalg.norm(p2 - p1) > 0.1
        np.testing.assert_allclose(np.linalg.norm(p2 - p1), np.linalg.norm(error[rows]), rtol=1e-12)


def test_limits_losses_gravity_and_motors_are_read(tmp_path: Path) -> None:
    """Ranges come in radians whatever the file's unit; losses, gravity and motors as stated."""
    chain = io.load(mixed(tmp_path))
    model = chain.model
    assert chain.actuated == ("ja", "jd2")
    assert chain.joints == ("ja", "jb", "jc", "jd1", "jd2", "jd3")
    np.testing.assert_allclose([model.lowerPositionLimit[0], model.upperPositionLimit[0]], [-1.0, 2.0], rtol=1e-15)
    np.testing.assert_array_equal(model.armature, np.full(8, 0.01))
    np.testing.assert_array_equal(model.damping, [0.0, 0.3, 0.3, 0.3, 0.3, 0.0, 0.0, 0.0][: model.nv])
    assert model.upperDryFrictionLimit[0] == 0.2
    np.testing.assert_array_equal(model.gravity.linear, [0.5, -1.0, -9.81])


@pytest.mark.parametrize("seed", range(4))
def test_a_saved_chain_comes_back_from_mjcf(tmp_path: Path, seed: int) -> None:
    """Order, numbers and closures, the hinge among them, are the same after a round through MJCF."""
    chain = random_chain(seed)
    chain.model.lowerPositionLimit[3:5], chain.model.upperPositionLimit[3:5] = -1.01, 1.01  # cosine and sine
    (path,) = io.save(chain, tmp_path, formats=("mjcf",))
    assert_same(chain, io.load(path), rtol=2e-15)


def _massless_ends() -> ClosedChain:
    """Return a hinge, a massless hinge apart from it, a heavy hinge, and a massless slide at the end."""
    model, parent = pin.Model(), 0
    rng = np.random.default_rng(3)
    joints = (pin.JointModelRZ(), pin.JointModelRY(), pin.JointModelRX(), pin.JointModelPX())
    for k, joint in enumerate(joints):
        parent = model.addJoint(parent, joint, random_placement(rng), f"j{k}")
        model.appendBodyToJoint(parent, pin.Inertia.Zero() if k % 2 else random_inertia(rng), pin.SE3.Identity())
    return ClosedChain(model, (), ("j0",))


def test_mujoco_takes_bodies_without_mass_and_they_come_back_without(tmp_path: Path) -> None:
    """MuJoCo asks every moving body for a mass; the grain that it gets does not show in the mass matrix."""
    chain = _massless_ends()
    (path,) = io.save(chain, tmp_path, formats=("mjcf",))
    again = io.load(path)
    np.testing.assert_allclose(again.inertial_parameters, chain.inertial_parameters, rtol=0.0, atol=1e-15)
    assert not again.inertial_parameters[1::2].any()
    rng = np.random.default_rng(4)
    q, v = rng.normal(size=(2, 4))
    M, bias, _ = witness(path, chain.model, q, v)
    np.testing.assert_allclose(M, mass_matrix(chain.model, q), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(bias, pin.nle(chain.model, chain.model.createData(), q, v), rtol=0.0, atol=1e-11)


def test_a_mass_stated_after_the_note_that_there_is_none_counts(tmp_path: Path) -> None:
    (path,) = io.save(_massless_ends(), tmp_path, formats=("mjcf",))
    text = path.read_text()
    path.write_text(text.replace('mass="1e-14"', 'mass="0.5"', 1))
    assert io.load(path).inertial_parameters[1, 0] == 0.5
    path.write_text(text.replace("massless j", "massless k", 1))
    with pytest.raises(FileFormatError, match=r"custom 'massless k\w+': names no body of this file"):
        io.load(path)


def test_mujoco_agrees_with_the_papers_linkage(tmp_path: Path) -> None:
    """The five-bar written as MJCF has the same mass matrix, bias and closure error in MuJoCo."""
    chain = paper.table_1("I", "unbalanced").chain(gravity=(0.0, -9.81, 0.0))
    (path,) = io.save(chain, tmp_path, formats=("mjcf",))
    rng = np.random.default_rng(2)
    q, v = rng.normal(size=4), rng.normal(size=4)
    M, bias, error = witness(path, chain.model, q, v)
    np.testing.assert_allclose(mass_matrix(chain.model, q), M, rtol=0.0, atol=1e-12 * np.abs(M).max())
    data = chain.model.createData()
    np.testing.assert_allclose(pin.nle(chain.model, data, q, v), bias, rtol=0.0, atol=1e-12 * np.abs(bias).max())
    pin.framesForwardKinematics(chain.model, data, q)
    p1, p2 = (data.oMf[chain.model.getFrameId(f)].translation for f in chain.closures[0].frames)
    np.testing.assert_allclose(np.linalg.norm(error), np.linalg.norm(p2 - p1), rtol=1e-12)


def test_a_free_joint_and_its_keyframe_come_back(tmp_path: Path) -> None:
    """A floating base keeps its coordinates; its keyframe is MuJoCo's world pose."""
    rng = np.random.default_rng(1)
    model = pin.Model()
    j = model.addJoint(0, pin.JointModelFreeFlyer(), random_placement(rng), "base")
    k = model.addJoint(j, pin.JointModelSpherical(), random_placement(rng), "ball")
    for i in (j, k):
        model.appendBodyToJoint(i, random_inertia(rng), pin.SE3.Identity())
    home = pin.integrate(model, pin.neutral(model), rng.normal(size=model.nv))
    model.referenceConfigurations["home"] = home
    (path,) = io.save(ClosedChain(model, (), (), name="free"), tmp_path, formats=("mjcf",))
    back = io.load(path).model
    np.testing.assert_allclose(back.referenceConfigurations["home"], home, rtol=0.0, atol=1e-14)
    m = mujoco.MjModel.from_xml_path(str(path))
    d = mujoco.MjData(m)
    mujoco.mj_resetDataKeyframe(m, d, 0)
    mujoco.mj_forward(m, d)
    data = model.createData()
    pin.forwardKinematics(model, data, home)
    np.testing.assert_allclose(d.xpos[1:], [data.oMi[i].translation for i in (j, k)], rtol=0.0, atol=1e-14)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "<option",
            '<tendon><fixed stiffness="3"><joint joint="ja" coef="1"/><joint joint="jb" coef="1"/></fixed></tendon>'
            "<option",
            "stiffness and damping across 2 joints are not supported; state them at the joints",
        ),
        (
            "<option",
            '<tendon><fixed damping="3"><joint joint="jc" coef="1"/></fixed></tendon><option',
            "fixed '0': is a spring on 'jc', which has several degrees of freedom",
        ),
        (
            "<option",
            '<tendon><fixed range="-0.1 0.1"><joint joint="ja" coef="1"/></fixed></tendon><option',
            "fixed '0': range: limits that tie bodies are not supported; remove it, or state an <equality>",
        ),
        ("<option", "<tendon><cord/></tendon><option", "Unknown tendon 'cord'; known: fixed, spatial"),
        ('name="jb"', 'name="jb" springyield="1"', "springyield is not supported"),
        (
            '<connect name="pin"',
            '<joint joint1="ja" joint2="jb" polycoef="0 1 0.5 0 0"/><connect name="pin"',
            "is not linear; only a0 + a1 x is supported",
        ),
        ('name="jc"', 'name="jc" stiffness="3"', "stiffness of a ball joint is not supported"),
        ('name="jb"', 'name="jb" springdamper="1 1"', "springdamper is not supported"),
        ('name="jb"', 'name="jb" dampig="3"', "Did you mean 'damping'"),
        ('name="jb"', 'name="jb" class="hard"', "Unknown default class 'hard'"),
        ('joint="jd2"', 'joint="jd9"', "Unknown joint 'jd9'; known: ja, jb, jc, jd1, jd2, jd3. Did you mean"),
        ('site2="base"', 'site2="bass"', "Unknown site 'bass'"),
        ('body2="d" anchor="0.1', 'body2="e" anchor="0.1', "Unknown body 'e'"),
        ('body2="d" anchor="0.1', 'body2="b" anchor="0.1', "to itself"),
        ('anchor="0.1 0.2 0"', 'anchor="0.1 nan 0"', "'nan', which is not a finite number"),
        ('mass="1"', 'mass="-1"', "mass = -1.0 must be positive"),
        ('mass="1"', 'mass="0"', "mass = 0.0 must be positive"),
        ('type="ball"', 'type="bell"', "Unknown joint type 'bell'; known: hinge, slide, ball, free"),
        ('type="box"', 'type="bix"', "Unknown geom type 'bix'"),
        ('<body name="c"', '<composite/><body name="c"', "Unknown element of a body 'composite'"),
        ('name="jd1"', 'name="ja"', "is defined twice"),
        ('<body name="c"', '<body name="a"', "is defined twice"),
        ('quat="1 1 0 0"', 'quat="0 0 0 0"', "has no direction"),
        ('quat="1 1 0 0"', 'quat="1 1 0 0" zaxis="1 0 0"', "states its orientation 2 times"),
        ('type="ellipsoid" size="0.1 0.2 0.3"', 'type="mesh" mesh="m" mass="0"', "Unknown mesh 'm'"),
        ('type="ellipsoid" size="0.1 0.2 0.3"', 'type="mesh" mesh="m"', "Unknown mesh 'm'"),
        ('mass="1" full', 'mass="1" quat="1 1 0 0" full', "fullinertia, which excludes quat"),
        ("<compiler ", '<compiler angle="grad" ', "Unknown angle unit 'grad'"),
        ("<compiler ", '<compiler eulerseq="xy" ', "eulerseq = 'xy' must be three of x, y, z"),
        ("<compiler ", '<compiler eulerseq="xyzx" ', "eulerseq = 'xyzx' must be three of x, y, z"),
        ("<compiler ", '<compiler eulerseq="xyw" ', "eulerseq = 'xyw' must be three of x, y, z"),
        ('size="0.1 0.2 0.3" axis', 'size="0.1 0.2 0.3 0.4" axis', "must be 3 number(s)"),
        ('size="0.1 0.2 0.3" axis', 'size="0.1 0.2" axis', "must be 3 number(s)"),
        ('size="0.1 0.2 0.3" axis', 'size="0.1 0.0 0.3" axis', "must be positive [m]"),
        ("<option", '<compiler coordinate="global"/><option', "global coordinates are not supported"),
        ("<option", '<compiler inertiafromgeom="yes"/><option', "inertiafromgeom must be auto, true or false"),
        ("<option", '<compiler agle="radian"/><option', "Unknown attribute of <compiler> 'agle'"),
        ("<option", '<compiler boundmass="-"/><option', "boundmass holds '-', which is not a finite number"),
        ("<option", '<option><flag passive="disable"/></option><option', "damper is disabled, but the file states it"),
        ("<option", '<option><flag constraint="disable"/></option><option', "frictionloss is disabled, but the file"),
        ("<option", '<deformable><flex name="f"/></deformable><option', "flex 'f': deformable bodies"),
        ("<worldbody>", '<default class="x"/><worldbody>', "is a class of its own at the top"),
        ('<body name="f"', '<freejoint/><body name="f"', "a free joint must be the only one of its body"),
        ('<body name="f"', '<frame colour="1"/><body name="f"', "Unknown attribute of <frame> 'colour'"),
        ('<body name="d"', '<body><freejoint align="true"/></body><body name="d"', "remove align or alignfree"),
        ('<weld name="glue"', '<weld torquescale="x" name="glue"', "torquescale holds 'x'"),
        ("<worldbody>", "<worldbdy/><worldbody>", "Did you mean 'worldbody'"),
    ],
)
def test_what_mjcf_says_and_we_cannot_do_is_refused_by_name(tmp_path: Path, old: str, new: str, message: str) -> None:
    """Nothing that acts on the mechanism is passed over; the error names the file and what to do."""
    path = mixed(tmp_path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(FileFormatError) as caught:
        io.load(path)
    assert message in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_joint_that_mjcf_lacks_is_refused_when_writing(tmp_path: Path) -> None:
    """A planar joint has no word in MJCF; the error offers URDF."""
    model = pin.Model()
    model.appendBodyToJoint(
        model.addJoint(0, pin.JointModelPlanar(), pin.SE3.Identity(), "plane"),
        pin.Inertia.Identity(),
        pin.SE3.Identity(),
    )
    with pytest.raises(InvalidInputError, match="formats="):
        io.save(ClosedChain(model, (), ()), tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_an_orientation_of_an_element_replaces_the_one_of_its_class(tmp_path: Path) -> None:
    """Whichever of the five ways either of them is stated in."""
    (tmp_path / "m.xml").write_text(
        '<mujoco><default><geom euler="0 0 90" type="box" size="0.1 0.2 0.3"/></default><worldbody><body name="a">'
        '<joint name="ja" type="hinge" axis="0 1 0"/><geom quat="0.9238795325112867 0.3826834323650898 0 0"/></body>'
        '<body name="b"><joint name="jb" type="hinge" axis="0 1 0"/><geom/></body></worldbody></mujoco>'
    )
    chain = io.load(tmp_path / "m.xml")
    mass = 1000.0 * 8.0 * 0.1 * 0.2 * 0.3
    own = mass / 3.0 * np.diag([0.2**2 + 0.3**2, 0.1**2 + 0.3**2, 0.1**2 + 0.2**2])
    for k, turn in (
        (1, pin.exp3(np.array([0.25 * np.pi, 0.0, 0.0]))),
        (2, pin.exp3(np.array([0.0, 0.0, 0.5 * np.pi]))),
    ):
        np.testing.assert_allclose(chain.model.inertias[k].inertia, turn @ own @ turn.T, rtol=0.0, atol=1e-12)
