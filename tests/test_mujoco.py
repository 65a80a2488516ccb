"""MuJoCo, a witness nobody here wrote: the same file loaded by both gives the same masses and the same torques."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

import fivebar_pin as fb
from fivebar_pin.cli._moving import sway
from fivebar_pin.io import _mjcf_text
from fivebar_pin.io._build import bare_inertia

GRAVITY = (0.4, -9.81, 0.7)
PLANAR_OR_SPATIAL = [name for name in fb.io.shipped() if fb.load(fb.io.shipped_path(name)).na]


def _both(name: str, folder: Path) -> tuple[fb.ClosedChain, mujoco.MjModel]:
    chain = fb.load(fb.io.shipped_path(name)).with_gravity(GRAVITY)
    fb.save(chain, folder / "same.xml")
    chain = fb.load(folder / "same.xml")
    return chain, mujoco.MjModel.from_xml_path(str(folder / "same.xml"))


def _columns(chain: fb.ClosedChain, model: mujoco.MjModel) -> np.ndarray:
    """Our velocity index of every MuJoCo velocity."""
    out: list[int] = []
    for j in range(model.njnt):
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, j)
        joint = chain.model.joints[chain.model.getJointId(name)]
        out += range(joint.idx_v, joint.idx_v + joint.nv)
    return np.array(out)


def _mujoco_q(chain: fb.ClosedChain, model: mujoco.MjModel, q: np.ndarray) -> np.ndarray:
    """MuJoCo's configuration: angles as they are, ball joints with the scalar of the quaternion first."""
    out = np.zeros(model.nq)
    for j in range(model.njnt):
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, j)
        joint = chain.model.joints[chain.model.getJointId(name)]
        mine, at = q[joint.idx_q : joint.idx_q + joint.nq], model.jnt_qposadr[j]
        if joint.nq == 4:
            out[at : at + 4] = mine[[3, 0, 1, 2]]
        elif joint.nq == 2:
            out[at] = np.arctan2(mine[1], mine[0])
        else:
            out[at] = mine[0]
    return out


@pytest.mark.parametrize("name", PLANAR_OR_SPATIAL)
def test_torque_and_mass_matrix_agree_with_mujoco(name: str, tmp_path: Path) -> None:
    """[S^T J^T] [tau; lambda] = qfrc_inverse + qfrc_constraint of MuJoCo gives our tau; the mass matrices are equal."""
    chain, model = _both(name, tmp_path)
    data = mujoco.MjData(model)
    trajectory = sway(chain, fb.assemble(chain, _home(chain)), samples=25)
    assert trajectory is not None
    loads = fb.inverse_dynamics(chain, trajectory)
    columns = _columns(chain, model)
    actuated = [int(np.flatnonzero(columns == k)[0]) for k in chain.actuated_index]
    scale = np.abs(loads.torque).max()
    for k in range(len(trajectory)):
        data.qpos[:] = _mujoco_q(chain, model, trajectory.q[k])
        data.qvel[:], data.qacc[:] = trajectory.v[k][columns], trajectory.a[k][columns]
        mujoco.mj_inverse(model, data)
        S = np.zeros((chain.na, model.nv))
        S[np.arange(chain.na), actuated] = 1.0
        A = np.concatenate([S, data.efc_J.reshape(-1, model.nv)]).T
        right = data.qfrc_inverse + data.qfrc_constraint
        x = np.linalg.lstsq(A, right, rcond=1e-10)[0]
        np.testing.assert_allclose(A @ x, right, rtol=0, atol=1e-9 * scale)
        np.testing.assert_allclose(x[: chain.na], loads.torque[k], rtol=0, atol=1e-9 * scale)
    M = np.zeros((model.nv, model.nv))
    for k in range(model.nv):
        mujoco.mj_mulM(model, data, M[k], np.eye(model.nv)[k])
    ours = pin.crba(chain.model, chain.model.createData(), trajectory.q[-1])
    ours = np.triu(ours) + np.triu(ours, 1).T
    np.testing.assert_allclose(ours[np.ix_(columns, columns)], M, rtol=0, atol=1e-12 * np.abs(M).max())


def _home(chain: fb.ClosedChain) -> np.ndarray:
    q = next(iter(chain.references.values()))
    at = [chain.model.joints[chain.model.getJointId(name)].idx_q for name in chain.actuated]
    return q[at]


EQUALITIES = {
    "connect": '<connect body1="b" body2="d" anchor="0.1 0.2 -0.3"/>',
    "connect to the world": '<connect body1="b" anchor="0.1 0.2 -0.3"/>',
    "weld as they are": '<weld body1="d" body2="b"/>',
    "weld with relpose": '<weld body1="b" body2="d" relpose="0.3 -0.2 0.5 0.7 0.1 -0.4 0.2"/>',
    "weld at an anchor": '<weld body1="b" body2="d" anchor="0.2 0.1 0.4"/>',
    "weld with both": '<weld body1="b" body2="d" anchor="0.2 0.1 0.4" relpose="0.3 -0.2 0.5 0.7 0.1 -0.4 0.2"/>',
}


@pytest.mark.parametrize("equality", EQUALITIES.values(), ids=EQUALITIES.keys())
def test_closures_are_open_by_what_mujoco_says(equality: str, tmp_path: Path) -> None:
    """At any configuration the gap of an equality is the one MuJoCo finds, under nested classes and other units."""
    inertial = '<inertial pos="0.1 0.2 0" euler="10 20 30" mass="2" diaginertia="0.1 0.2 0.25"/>'
    text = f"""<mujoco><compiler angle="degree" eulerseq="ZyX"/>
    <default><joint armature="0.1"/><default class="outer"><joint damping="0.3"/>
      <default class="inner"><joint frictionloss="0.2"/></default></default></default>
    <worldbody><body name="a" pos="0.1 0 0.3" euler="20 30 40" childclass="outer">{inertial}
      <joint name="ja" axis="0 1 2"/>
      <body name="b" pos="0.4 0.1 0" axisangle="1 2 3 50">{inertial}
        <joint name="jb" class="inner" pos="0.1 0 0.2"/></body></body>
    <body name="c" pos="1 0 0" xyaxes="0 1 0 -1 0 1">{inertial}<joint name="jc" type="slide" axis="1 0 1"/>
      <body name="d" childclass="inner" pos="0.2 0 0.3" zaxis="1 1 1">{inertial}
        <joint name="jd"/></body></body></worldbody>
    <equality>{equality}</equality><actuator><motor joint="ja"/></actuator></mujoco>"""
    (tmp_path / "model.xml").write_text(text)
    chain, model = fb.load(tmp_path / "model.xml"), mujoco.MjModel.from_xml_string(text)
    data, columns = mujoco.MjData(model), _columns(chain, model)
    data.qpos[:], data.qvel[:] = [0.3, -0.7, 0.2, 1.1], [1.0, -0.5, 0.4, 0.8]
    mujoco.mj_forward(model, data)
    q, v = np.zeros(4), np.zeros(4)
    q[columns], v[columns] = data.qpos, data.qvel
    gap = fb.closure_residual(chain, q)
    rows = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
    theirs = data.efc_pos[rows]
    assert gap.shape == theirs.shape
    assert np.linalg.norm(gap[:3]) == pytest.approx(np.linalg.norm(theirs[:3]), abs=1e-14)
    # MuJoCo measures a turn by the vector part of the quaternion; the sine of half of ours is its length.
    assert np.sin(0.5 * np.linalg.norm(gap[3:])) == pytest.approx(np.linalg.norm(theirs[3:]), abs=1e-14)
    for ours, theirs in (
        (chain.model.damping, model.dof_damping),
        (chain.model.armature, model.dof_armature),
        (chain.model.upperDryFrictionLimit, model.dof_frictionloss),
    ):
        np.testing.assert_array_equal(np.array(ours)[columns], theirs)


def _body(points: np.ndarray, masses: np.ndarray) -> pin.Inertia:
    total = pin.Inertia.Zero()
    for x, m in zip(points, masses, strict=True):
        total = total + pin.Inertia(float(m), x, np.zeros((3, 3)))
    return total


@pytest.mark.parametrize("kind", ["flat", "rod", "point", "solid", "flat in x-y"])
def test_mujoco_takes_every_body_that_can_be(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """300 random bodies of each kind, in any orientation: loaded, and the inertia is the same within round-off."""
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its log where it stands
    rng = np.random.default_rng(sum(map(ord, kind)))
    for _ in range(300):
        points = rng.normal(size=(6, 3)) * 10.0 ** rng.uniform(-3.0, 0.5)
        flattened = {"flat": [1, 1, 0], "flat in x-y": [1, 1, 0], "rod": [1, 0, 0], "point": [0, 0, 0]}
        turn = np.eye(3) if kind == "flat in x-y" else Rotation.random(random_state=rng).as_matrix()
        masses = rng.uniform(0.1, 1.0, 6) * 10.0 ** rng.uniform(-2.0, 2.0)
        points = (points * flattened.get(kind, [1, 1, 1])) @ turn.T + rng.normal(size=3)
        inertia = _body(points, masses)
        stated = f'pos="0 0 0" mass="{inertia.mass!r}" {_mjcf_text._inertia(inertia)}'
        body = f"<body><freejoint/><inertial {stated}/></body>"
        text = f'<mujoco><compiler inertiafromgeom="false"/><worldbody>{body}</worldbody></mujoco>'
        model = mujoco.MjModel.from_xml_string(text)
        R = np.empty(9)
        mujoco.mju_quat2Mat(R, model.body_iquat[1])
        R = R.reshape(3, 3)
        scale = inertia.mass * float(inertia.lever @ inertia.lever) + np.trace(inertia.inertia)
        read = R @ np.diag(model.body_inertia[1]) @ R.T
        np.testing.assert_allclose(read, inertia.inertia, rtol=0, atol=2e-14 * scale + 5e-15)


def test_an_impossible_body_is_written_as_it_is() -> None:
    """MuJoCo refuses it, and so does the diagnosis: the file does not hide what is wrong."""
    wrong = bare_inertia(1.0, np.zeros(3), np.diag([1.0, 1.0, 3.0]))
    assert 'fullinertia="1 1 3 0 0 0"' in _mjcf_text._inertia(wrong).replace(".0", "")


@pytest.mark.parametrize("mode", ["add", "redesign"])
@pytest.mark.parametrize("name", PLANAR_OR_SPATIAL)
def test_the_momentum_of_a_balanced_design_vanishes_in_mujoco_too(name: str, mode: str, tmp_path: Path) -> None:
    chain = fb.load(fb.io.shipped_path(name))
    near = fb.assemble(chain, _home(chain))
    design = fb.balance(chain, "force", mode=mode, region=fb.balancing.Ball(1.0), near=near)
    assert design.feasible
    unbalanced, balanced = (_momentum(c, tmp_path / f"{k}.xml") for k, c in enumerate((chain, design.chain)))
    assert balanced < 1e-11 * max(unbalanced, 1e-3)


def _momentum(chain: fb.ClosedChain, file: Path) -> float:
    """Return the largest linear momentum along a driven motion, as MuJoCo computes it [N s]."""
    fb.save(chain, file)
    chain, model = fb.load(file), mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    trajectory = sway(chain, fb.assemble(chain, _home(chain)), samples=25)
    assert trajectory is not None
    columns, worst = _columns(chain, model), 0.0
    for k in range(len(trajectory)):
        data.qpos[:] = _mujoco_q(chain, model, trajectory.q[k])
        data.qvel[:] = trajectory.v[k][columns]
        mujoco.mj_forward(model, data)
        mujoco.mj_subtreeVel(model, data)
        worst = max(worst, float(np.abs(data.subtree_linvel[0]).max()) * float(model.body_subtreemass[0]))
    return worst
