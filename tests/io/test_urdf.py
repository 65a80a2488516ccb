"""URDF and sidecar: what is saved comes back, and what Pinocchio reads we read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from random_chains import VECTORS, assert_same, mass_matrix, random_chain, random_inertia, random_placement

from fivebar_pin import closure_residual, io, paper
from fivebar_pin.chain import ClosedChain, Visual
from fivebar_pin.closures import Closure
from fivebar_pin.errors import FileFormatError, LeftOutWarning
from fivebar_pin.io._entries import matrix_to_rpy, rpy_to_matrix
from fivebar_pin.io._find import title

ROBOTS = Path(pin.__file__).parents[4] / "share" / "example-robot-data" / "robots"


@pytest.mark.parametrize("case", ["I", "II"])
@pytest.mark.parametrize("column", ["unbalanced", "balanced"])
def test_the_papers_linkage_comes_back_to_the_last_digit(tmp_path: Path, case: str, column: str) -> None:
    """Every number of the saved five-bar is the one that was saved."""
    chain = paper.table_1(case, column).chain()
    io.save(chain, tmp_path, formats=("urdf",))
    back = io.load(tmp_path)
    assert_same(chain, back)
    q = np.array([0.3, 1.1, -0.4, 2.0])
    np.testing.assert_allclose(mass_matrix(back.model, q), mass_matrix(chain.model, q), rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("seed", range(8))
def test_every_joint_kind_order_and_loss_comes_back(tmp_path: Path, seed: int) -> None:
    """Saving and loading is the identity on every kind of joint, in any depth-first order."""
    chain = random_chain(seed)
    io.save(chain, tmp_path, formats=("urdf",))
    back = io.load(tmp_path)
    assert_same(chain, back)
    q = np.array(pin.integrate(chain.model, pin.neutral(chain.model), np.linspace(-1.0, 1.0, chain.nv)))
    M = mass_matrix(chain.model, q)
    np.testing.assert_allclose(mass_matrix(back.model, q), M, rtol=0.0, atol=1e-13 * np.abs(M).max())
    np.testing.assert_array_equal(back.model.referenceConfigurations["home"], pin.neutral(chain.model))


@pytest.mark.parametrize(
    "kind",
    [pin.JointModelSpherical(), pin.JointModelSphericalZYX(), pin.JointModelTranslation(), pin.JointModelFreeFlyer()],
    ids=lambda k: k.shortname(),
)
def test_joints_of_several_freedoms_come_back(tmp_path: Path, kind: object) -> None:
    """Spherical, translating and free joints are saved with the sidecar's words."""
    rng = np.random.default_rng(3)
    model = pin.Model()
    a = model.addJoint(0, kind, random_placement(rng), "many")
    b = model.addJoint(a, pin.JointModelRX(), random_placement(rng), "one")
    for j in (a, b):
        model.appendBodyToJoint(j, random_inertia(rng), pin.SE3.Identity())
    model.addFrame(pin.Frame("tip", b, 0, random_placement(rng), pin.FrameType.OP_FRAME))
    model.damping[:] = rng.uniform(size=model.nv)
    chain = ClosedChain(model, (Closure(("universe", "tip")),), ("one",), name="many freedoms")
    io.save(chain, tmp_path, formats=("urdf",))
    back = io.load(tmp_path)
    assert [j.shortname() for j in back.model.joints] == [j.shortname() for j in chain.model.joints]
    assert back.name == "many freedoms"
    np.testing.assert_array_equal(back.model.damping, chain.model.damping)
    q = np.array(pin.integrate(model, pin.neutral(model), np.linspace(-1.0, 1.0, model.nv)))
    np.testing.assert_allclose(mass_matrix(back.model, q), mass_matrix(model, q), rtol=0.0, atol=1e-12)


def test_saving_what_was_loaded_writes_the_same_files(tmp_path: Path) -> None:
    """The writer is stable: a second round changes nothing."""
    chain = random_chain(5)
    first = io.save(chain, tmp_path / "a", formats=("urdf",))
    second = io.save(io.load(first[0]), tmp_path / "b", formats=("urdf",))
    assert first[1].read_text() == second[1].read_text()
    third = io.save(io.load(second[0]), tmp_path / "c", formats=("urdf",))
    assert [p.read_text().count("<link") for p in (first[0], second[0], third[0])] == [11] * 3


@pytest.mark.parametrize("formats", ["urdf", "mjcf"])
def test_joints_in_breadth_first_order_come_back(tmp_path: Path, formats: str) -> None:
    """Any order in which parents come before children is kept, in both formats, with its home."""
    rng = np.random.default_rng(7)
    model = pin.Model()
    for name, parent in (("b", ""), ("a", ""), ("d", "b"), ("c", "a"), ("e", "b")):
        j = model.addJoint(model.getJointId(parent) if parent else 0, pin.JointModelRZ(), random_placement(rng), name)
        model.appendBodyToJoint(j, random_inertia(rng), pin.SE3.Identity())
        model.addFrame(pin.Frame(f"{name}_tip", j, 0, random_placement(rng), pin.FrameType.OP_FRAME))
    home = rng.normal(size=5)
    model.referenceConfigurations["home"] = home
    chain = ClosedChain(model, (Closure(("d_tip", "c_tip")),), ("a", "e"))
    path = io.save(chain, tmp_path, formats=formats)[0]
    back = io.load(path)
    assert_same(chain, back, rtol=2e-15)
    np.testing.assert_array_equal(back.model.referenceConfigurations["home"], home)


def test_visuals_come_back(tmp_path: Path) -> None:
    """Shapes keep their frame, size, pose and colour; a capsule comes back as the cylinder and spheres it is."""
    plain = paper.table_1("I", "unbalanced").chain()
    M = np.eye(4)
    M[:3, :3], M[:3, 3] = rpy_to_matrix([0.3, -0.4, 0.5]), (0.1, 0.2, 0.3)
    colour = (0.1, 0.2, 0.3, 0.4)
    visuals = (
        Visual("link1", "box", (0.1, 0.2, 0.3), M, colour),
        Visual("link2", "cylinder", (0.01, 0.2), M, colour),
        Visual("link3", "sphere", (0.05,), np.eye(4), colour),
        Visual("O3_link2", "mesh", (1.0, 2.0, 3.0), M, colour, "parts/bar.stl"),
        Visual("link4", "capsule", (0.01, 0.2), M, colour),
    )
    chain = ClosedChain(plain.model, plain.closures, plain.actuated, visuals=visuals)
    io.save(chain, tmp_path, formats=("urdf",))
    with pytest.warns(LeftOutWarning, match="parts/bar.stl"):
        loaded = io.load(tmp_path)
    back = {(v.frame, v.shape): v for v in loaded.visuals}
    for visual in visuals[:4]:
        twin = back[visual.frame, visual.shape]
        assert (twin.size, twin.rgba, twin.mesh) == (visual.size, visual.rgba, visual.mesh)
        np.testing.assert_allclose(twin.placement, visual.placement, rtol=0.0, atol=1e-15)
    assert back["link4", "cylinder"].size == (0.01, 0.2)
    assert back["link4", "sphere"].size == (0.01,)


@pytest.mark.filterwarnings("ignore::fivebar_pin.errors.LeftOutWarning")
@pytest.mark.parametrize("free_flyer", [False, True])
@pytest.mark.parametrize(
    "name", ["solo.urdf", "solo12.urdf", "ur5_robot.urdf", "bolt.urdf", "anymal.urdf", "double_pendulum.urdf"]
)
def test_a_urdf_is_read_as_pinocchio_reads_it(name: str, free_flyer: bool) -> None:
    """Our reader and Pinocchio's, which share no code, give the same model."""
    path = sorted(ROBOTS.rglob(name))[0]
    root = (pin.JointModelFreeFlyer(),) if free_flyer else ()
    theirs = pin.buildModelFromUrdf(str(path), *root)
    ours = io.load(path, free_flyer=free_flyer, closures=(), actuated=()).model
    assert list(ours.names) == list(theirs.names)
    described = [[(f.name, f.type, f.parentJoint, f.parentFrame) for f in m.frames] for m in (ours, theirs)]
    assert described[0] == described[1]
    for f, g in zip(ours.frames, theirs.frames, strict=True):
        np.testing.assert_allclose(f.placement.homogeneous, g.placement.homogeneous, rtol=0.0, atol=1e-14)
    for word in ("jointPlacements", "inertias"):
        for x, y in zip(getattr(ours, word), getattr(theirs, word), strict=True):
            numbers = [z.homogeneous if word == "jointPlacements" else z.toDynamicParameters() for z in (x, y)]
            np.testing.assert_allclose(numbers[0], numbers[1], rtol=0.0, atol=1e-14)
    for word in VECTORS:
        np.testing.assert_array_equal(getattr(ours, word), getattr(theirs, word), err_msg=word)


def test_angles_give_the_rotation_back_at_the_gimbal_singularity_too() -> None:
    """R -> roll, pitch, yaw -> R is exact to round-off at and next to pitch = ±π/2."""
    rng = np.random.default_rng(1)
    near = np.concatenate([[0.0], 10.0 ** np.arange(-17.0, 0.0)])
    angles = [[r, s * np.pi / 2 - s * d, y] for r, y in rng.normal(size=(20, 2)) for s in (-1, 1) for d in near]
    for rpy in [*angles, *rng.uniform(-3.2, 3.2, size=(200, 3)).tolist()]:
        R = rpy_to_matrix(rpy)
        np.testing.assert_allclose(rpy_to_matrix(matrix_to_rpy(R)), R, rtol=0.0, atol=1e-15)


def test_the_order_inside_a_pair_does_not_matter(tmp_path: Path) -> None:
    """A closure names its two frames in either order."""
    urdf, sidecar = io.save(paper.table_1("I", "unbalanced").chain(), tmp_path, formats=("urdf",))
    text = sidecar.read_text()
    assert "[[O3_link2, O3_link3]]" in text
    sidecar.write_text(text.replace("[[O3_link2, O3_link3]]", "[[O3_link3, O3_link2]]").replace("3d", "3D"))
    assert io.load(urdf).closures[0].frames == ("O3_link3", "O3_link2")


def test_a_continuous_joint_turns_about_any_axis(tmp_path: Path) -> None:
    """An oblique axis in the file is the axis the joint turns about; q holds its cosine and sine."""
    link = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    (tmp_path / "r.urdf").write_text(
        f'<robot name="r"><link name="b"/><link name="l">{link}</link><joint name="j" type="continuous">'
        '<parent link="b"/><child link="l"/><origin xyz="0 0 1"/><axis xyz="1 2 -2"/></joint></robot>'
    )
    chain = io.load(tmp_path / "r.urdf", closures=(), actuated=("j",))
    assert (chain.nq, chain.nv) == (2, 1)
    data = chain.model.createData()
    pin.forwardKinematics(chain.model, data, np.array([np.cos(0.7), np.sin(0.7)]))
    np.testing.assert_allclose(data.oMi[1].rotation, pin.exp3(0.7 * np.array([1.0, 2.0, -2.0]) / 3.0), atol=1e-15)


def test_closure_frames_named_like_their_joints_survive_the_files(tmp_path):
    """A link and its joint may share a name: the link's frame closes the loop, in memory and after save and load."""
    model = four_bar_names()
    chain = ClosedChain(model, (Closure(("tip", "end")),), ("crank",))
    q = np.array([0.3, -0.2, 1.1])
    written = [file for file in io.save(chain, tmp_path) if file.suffix in (".urdf", ".xml")]
    assert len(written) == 2
    for file in written:
        again = closure_residual(io.load(file), q)
        np.testing.assert_allclose(again, closure_residual(chain, q), rtol=0.0, atol=1e-12)


def four_bar_names() -> pin.Model:
    """Return a four-bar whose links, joints and fixed joints share their names, as many exporters write them."""
    model = pin.Model()
    joint = 0
    for name, parent, x, tip in (("crank", 0, 0.0, None), ("coupler", 1, 0.4, "tip"), ("rocker", 0, 1.0, "end")):
        at = pin.SE3(np.eye(3), np.array([x, 0.0, 0.0]))
        joint = model.addJoint(parent, pin.JointModelRZ(), at, name)
        model.appendBodyToJoint(joint, random_inertia(np.random.default_rng(joint)), pin.SE3.Identity())
        link = model.addBodyFrame(name, joint, pin.SE3.Identity(), model.addJointFrame(joint))
        if tip:
            out = pin.SE3(np.eye(3), np.array([0.9, 0.0, 0.0]))
            fixed = model.addFrame(pin.Frame(tip, joint, link, out, pin.FrameType.FIXED_JOINT))
            model.addBodyFrame(tip, joint, out, fixed)
    return model


@pytest.mark.parametrize(
    ("stated", "file", "name"),
    [
        ("delta", "robot.urdf", "delta"),
        ("onshape", "delta.urdf", "delta"),
        ("onshape", "robot.urdf", "leg_of_mine"),
        ("MuJoCo Model", "scene.xml", "leg_of_mine"),
        (" ", "delta.urdf.xacro", "delta"),
    ],
)
def test_a_mechanism_is_not_called_after_the_program_that_wrote_it(tmp_path, stated, file, name):
    folder = tmp_path / "leg_of_mine" / "urdf"
    assert title(stated, folder / file) == name
    text = f'<robot name="{stated}"><link name="a"/></robot>'
    assert title(None, folder / "urdf.urdf") == "leg_of_mine"
    if file.endswith(".urdf"):
        folder.mkdir(parents=True)
        (folder / file).write_text(text.replace("<link", '<link name="b"/><joint name="j" type="continuous">'
            '<parent link="a"/><child link="b"/></joint><link'))  # fmt: skip
        assert io.load(folder / file, closures=(), actuated=()).name == name


@pytest.mark.parametrize("name", ["chain.urdf", "chain.xml"])
def test_how_far_loops_may_stay_open_is_written_and_read(tmp_path, name):
    chain = io.load("five_bar_case_I").with_tolerance(3.2e-7)
    io.save(chain, tmp_path / name)
    again = io.load(tmp_path / name)
    assert again.closure_tolerance == 3.2e-7
    io.save(chain.with_tolerance(0.0), tmp_path / "exact" / name)
    assert "tolerance" not in "".join(f.read_text() for f in (tmp_path / "exact").iterdir())


def test_a_closure_tolerance_of_a_sidecar_is_one_of_rounding(tmp_path):
    io.save(io.load("five_bar_case_I"), tmp_path / "chain.urdf")
    sidecar = tmp_path / "chain.yaml"
    text = sidecar.read_text()
    for value, told in (("0.5", "must be from 0 to 0.001"), ("much", "closure_tolerance")):
        sidecar.write_text(text + f"closure_tolerance: {value}\n")
        with pytest.raises(FileFormatError, match=told):
            io.load(tmp_path / "chain.urdf")
