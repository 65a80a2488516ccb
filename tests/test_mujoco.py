"""MuJoCo, a witness nobody here wrote: the same file loaded by both gives the same masses and the same torques."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

import fivebar_pin as fb
from fivebar_pin.cli._moving import sway

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
    import pinocchio as pin

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
