"""Springs in files: what is saved comes back, and MuJoCo pulls as we do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mechanisms
import numpy as np
import pinocchio as pin
import pytest
from random_chains import assert_same, random_chain

import fivebar_pin as fb
from fivebar_pin import JointSpring, Spring, io
from fivebar_pin.dynamics.elastic import spring_forces
from fivebar_pin.errors import FileFormatError, InvalidInputError, LeftOutWarning
from fivebar_pin.mechanism.loops import loops_of

PULLS = (
    Spring("tip_d", "universe", 31.25, 0.1, 1.5),
    Spring("link_c", "tip_e", 7.1, 0.0),
    JointSpring("c", 3.3, -0.7),
    Spring("tip_c", "tip_d", 0.0, 0.2, 0.4),
    JointSpring("a", 2.5, 0.3),
)


def sprung(seed: int = 0, springs: tuple[Spring | JointSpring, ...] = PULLS) -> fb.ClosedChain:
    return random_chain(seed).with_springs(springs)


def forces(chain: fb.ClosedChain, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """All passive forces (nv,): springs and viscous damping of the joints."""
    loops = loops_of(chain)
    springs = spring_forces(chain, loops, q[None], v[None], loops.tree.poses(q[None])).force[0]
    return np.asarray(springs - np.array(chain.model.damping) * v)


@pytest.mark.parametrize("seed", range(3))
def test_springs_come_back_from_the_sidecar_to_the_last_digit(tmp_path: Path, seed: int) -> None:
    chain = sprung(seed, (*PULLS, JointSpring("b", 1.0 / 3.0, 0.1, 0.7)))  # b does not count its turns
    path, beside = io.save(chain, tmp_path, formats=("urdf",))
    back = io.load(path)
    assert_same(chain, back)
    assert back.springs == chain.springs
    text = beside.read_text()
    assert "springs: [{damping: 1.5, frames: [tip_d, universe], length: 0.1, stiffness: 31.25}" in text
    assert "{joint: c, rest: -0.7, stiffness: 3.3}" in text


def test_a_chain_without_springs_has_no_word_of_them_in_its_files(tmp_path: Path) -> None:
    chain = random_chain(0).with_springs(())
    for file in io.save(chain, tmp_path):
        text = file.read_text()
        assert "spring" not in text and "tendon" not in text


@pytest.mark.parametrize("seed", range(3))
def test_springs_come_back_from_mjcf(tmp_path: Path, seed: int) -> None:
    chain = sprung(seed)
    chain.model.lowerPositionLimit[3:5], chain.model.upperPositionLimit[3:5] = -1.01, 1.01  # cosine and sine
    (path,) = io.save(chain, tmp_path, formats=("mjcf",))
    back = io.load(path)
    assert_same(chain, back, rtol=2e-15)
    assert set(back.springs) == set(chain.springs)


def test_the_damper_of_a_joints_spring_comes_back_as_the_joints_own(tmp_path: Path) -> None:
    chain = mechanisms.five_bar().with_springs([JointSpring("left", 5.0, 0.25, 0.5)])
    model = chain.model.copy()
    model.damping[:] = 0.25
    chain = replace(chain, model=model)
    (path,) = io.save(chain, tmp_path, formats=("mjcf",))
    back = io.load(path)
    assert back.springs == (JointSpring("left", 5.0, 0.25),)
    assert back.model.damping[model.joints[model.getJointId("left")].idx_v] == 0.75
    rng = np.random.default_rng(0)
    q, v = rng.normal(size=4), rng.normal(size=4)
    np.testing.assert_allclose(forces(back, q, v), forces(chain, q, v), rtol=1e-14)


@pytest.mark.parametrize("seed", range(4))
def test_mujoco_pulls_as_we_do(tmp_path: Path, seed: int) -> None:
    """Forces of springs and dampers, of joints and tendons, in the file that we write."""
    mujoco = pytest.importorskip("mujoco")
    chain = sprung(seed, (*PULLS, JointSpring("d", 4.0, 0.2, 0.6)))
    (path,) = io.save(chain, tmp_path, formats=("mjcf",))
    m = mujoco.MjModel.from_xml_path(str(path))
    d = mujoco.MjData(m)
    rng = np.random.default_rng(seed)
    assert m.ntendon == 3
    for _ in range(5):
        q = pin.integrate(chain.model, pin.neutral(chain.model), rng.normal(size=chain.nv))
        v = rng.normal(size=chain.nv)
        angles = [q[i] if n == 1 else np.arctan2(q[i + 1], q[i]) for i, n in _places(chain.model)]
        d.qpos[:], d.qvel[:] = angles, v
        mujoco.mj_forward(m, d)
        ours = forces(chain, q, v)
        np.testing.assert_allclose(ours, d.qfrc_passive, rtol=0.0, atol=1e-12 * np.abs(ours).max())
        assert np.abs(ours - forces(chain.with_springs(()), q, v)).max() > 1.0


def _places(model: pin.Model) -> list[tuple[int, int]]:
    return list(zip(list(model.idx_qs)[1:], list(model.nqs)[1:], strict=True))


MJCF = """<mujoco model="rope"><compiler angle="degree"/>
<default><joint stiffness="2"/><tendon stiffness="30"/><default class="soft"><tendon stiffness="3" damping="0.5"/>
</default></default>
<worldbody><site name="roof" pos="0 0 2"/>
<body name="a" pos="0 0 1"><joint name="ja" axis="0 1 0" springref="90"/><geom size="0.1"/>
<site name="s" pos="0.3 0 0"/><body name="b" pos="0.5 0 0" euler="0 0 90">
<joint name="jb" type="slide" axis="1 0 0" springref="0.2"/><geom size="0.1"/>
<site name="t" pos="0.1 0.2 0"/></body></body></worldbody>
<tendon><spatial name="first"><site site="roof"/><site site="t"/></spatial>
<spatial class="soft" springlength="0.25"><site site="s"/><site site="roof"/></spatial>
<spatial stiffness="0" width="0.1"><site site="s"/><site site="roof"/></spatial></tendon>
<actuator><motor joint="ja"/></actuator></mujoco>"""


def test_springs_are_read_with_defaults_angles_and_automatic_lengths(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    path = tmp_path / "rope.xml"
    path.write_text(MJCF)
    with pytest.warns(LeftOutWarning, match="left out: idle tendon$"):
        chain = io.load(path)
    first, second, on_a, on_b = chain.springs
    assert second == Spring("s", "roof", 3.0, 0.25, 0.5)
    assert on_a == JointSpring("ja", 2.0, np.pi / 2.0)
    assert on_b == JointSpring("jb", 2.0, 0.2)
    assert isinstance(first, Spring)
    assert (first.frame1, first.frame2, first.stiffness, first.damping) == ("roof", "t", 30.0, 0.0)
    # at ja = 90 degrees and jb = 0.2 m the axis x of body a points down
    assert first.length == pytest.approx(np.linalg.norm([0.0, 0.3, 1.0 + 0.3]), rel=1e-15)
    m = mujoco.MjModel.from_xml_path(str(path))
    d = mujoco.MjData(m)
    q, v = np.array([0.3, -0.15]), np.array([0.7, 0.4])
    d.qpos[:], d.qvel[:] = q, v
    mujoco.mj_forward(m, d)
    np.testing.assert_allclose(forces(chain, q, v), d.qfrc_passive, rtol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('site="t"/>', 'site="u"/>', "spatial 'first': Unknown site 'u'"),
        ('<site site="t"/>', '<site site="t"/><site site="s"/>', "goes over 3 sites; a spring joins two"),
        ('<site site="t"/>', '<geom geom="t"/>', "goes over a <geom>; a spring joins two sites in a straight line"),
        (
            'name="first"',
            'name="first" range="0 1"',
            "spatial 'first': range: limits that tie bodies are not supported",
        ),
        ('name="first"', 'name="first" limited="true"', "spatial 'first': needs the attribute 'range'"),
        ('name="first"', 'name="first" frictionloss="1"', "frictionloss of tendons is not supported"),
        ('name="first"', 'name="first" stifness="1"', "Did you mean 'stiffness'"),
        ('springlength="0.25"', 'springlength="0.2 0.3"', "a dead band is not supported"),
        ('springlength="0.25"', 'springlength="-0.5"', "must be >= 0 [m]"),
        ('<joint stiffness="2"/>', '<joint stiffness="-2"/>', "joint 'ja': stiffness of spring on ja = -2.0"),
        ('type="slide" axis="1 0 0"', 'type="ball"', "joint 'jb': stiffness of a ball joint is not supported"),
        ('site="roof"/><site site="t"', 'site="s"/><site site="s"', "spring frames"),
        (
            "<actuator>",
            '<custom><numeric name="unbounded ja" data="1"/></custom><actuator>',
            "stiffness of a hinge that does not count its turns",
        ),
        (
            "<actuator>",
            '<custom><numeric name="unbounded jc" data="1"/></custom><worldbody><body><joint name="jc" ref="1" '
            'stiffness="0"/></body></worldbody><actuator>',
            "joint 'jc': ref of a hinge that does not count its turns",
        ),
    ],
)
def test_springs_of_mjcf_that_we_cannot_have_are_refused_by_name(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    path = tmp_path / "rope.xml"
    assert old in MJCF
    path.write_text(MJCF.replace(old, new, 1))
    with pytest.raises(FileFormatError) as caught:
        io.load(path)
    assert message in str(caught.value)
    assert str(caught.value).count(str(path)) == 1


@pytest.mark.parametrize(
    ("springs", "message"),
    [
        ((JointSpring("b", 1.0, 0.0),), r"spring on joint b.*continuous.*has no word in MJCF.*formats=\('urdf',\)"),
        ((JointSpring("c", 1.0, 0.0), JointSpring("c", 2.0, 0.1)), r"springs on joint c = 2 but must be at most one"),
    ],
)
def test_springs_that_mjcf_cannot_say_are_refused_when_writing(tmp_path: Path, springs: tuple, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        io.save(sprung(0, springs), tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("{frames: [tip_d, tip_c], stiffness: 1}", "springs[0]: length is missing"),
        ("{joint: c, stiffness: 1, length: 2}", "Unknown spring data 'length'; known: joint, stiffness, rest, damping"),
        ("{joint: c, stiffness: soft, rest: 2}", "springs[0], stiffness: 'soft' must be a finite number"),
        ("{joint: 3, stiffness: 1, rest: 2}", "springs[0], joint: 3 must be a name"),
        ("{frames: [tip_d], stiffness: 1, length: 1}", "springs[0], frames: has 1 entries; expected 2"),
        ("{frames: [tip_d, tip_d], stiffness: 1, length: 1}", "springs[0]: spring frames"),
        ("{frames: [tip_d, tip_x], stiffness: 1, length: 1}", "springs[0]: Unknown frame of a spring 'tip_x'"),
        ("{frames: [tip_d, link_d], stiffness: 1, length: 1}", "joins two frames of one body (d)"),
        ("{joint: f, stiffness: 1, rest: 1}", "springs[0]: Unknown joint of a spring 'f'"),
        ("{joint: c, stiffness: -1, rest: 1}", "springs[0]: stiffness of spring on c"),
        ("{}", "springs[0]: frames is missing"),
        ("3", "springs[0]: must map names to values"),
    ],
)
def test_springs_of_a_sidecar_that_make_no_sense_are_refused_by_name(tmp_path: Path, entry: str, message: str) -> None:
    path, beside = io.save(random_chain(0), tmp_path, formats=("urdf",))
    beside.write_text(beside.read_text() + f"springs: [{entry}]\n")
    with pytest.raises(FileFormatError) as caught:
        io.load(path)
    assert message in str(caught.value)
    assert str(beside) in str(caught.value)
    beside.write_text(beside.read_text().replace(f"[{entry}]", "{}"))
    with pytest.raises(FileFormatError, match="springs: must be a list"):
        io.load(path)


def test_springs_of_the_file_stay_when_closures_and_motors_are_given(tmp_path: Path) -> None:
    path, _ = io.save(sprung(0), tmp_path, formats=("urdf",))
    assert io.load(path, closures=(), actuated=("c",), gravity=(0.0, 0.0, 0.0)).springs == PULLS
