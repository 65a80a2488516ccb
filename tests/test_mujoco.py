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
