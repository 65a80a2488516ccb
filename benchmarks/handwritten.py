"""What a competent user writes without this library: Pinocchio's own calls in a loop over the samples.

Torque and shaking wrench of a chain with `3d` closures, straight from the motion of the actuated joints. Every object
is made once, the redundant rows are left out by hand, each sample starts from the last one.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import scipy.linalg


def prepare(chain, q0):
    """Make the Pinocchio objects once, and pick the closure rows that are independent."""
    model = chain.model.copy()
    data = model.createData()
    pairs, models = [], []
    for closure in chain.closures:
        f1, f2 = (model.frames[model.getFrameId(f)] for f in closure.frames)
        pairs.append((f1, f2))
        models.append(pin.PointAnchorConstraintModel(model, f1.parentJoint, f1.placement, f2.parentJoint, f2.placement))
    datas = [cm.createData() for cm in models]
    prepared = [model, data, pairs, models, datas, None, chain.actuated_index, chain.passive_index]
    _, J = _rows(prepared, np.array(q0))
    _, _, order = scipy.linalg.qr(J[:, chain.passive_index].T, pivoting=True)
    prepared[5] = np.sort(order[: chain.passive_index.size])
    return prepared


def _rows(prepared, q):
    model, data, pairs, models, datas = prepared[:5]
    pin.computeJointJacobians(model, data, q)
    r, J = [], []
    for (f1, f2), cm, cd in zip(pairs, models, datas, strict=True):
        cm.calc(model, data, cd)
        J.append(cm.jacobian(model, data, cd))
        r.append((data.oMi[f1.parentJoint] * f1.placement).actInv(data.oMi[f2.parentJoint] * f2.placement).translation)
    if len(r) == 1:
        return r[0], J[0]
    return np.concatenate(r), np.concatenate(J)


def torque_and_shaking(prepared, q0, motion, *, joint_forces=False):
    """Return torque (n, na), shaking force and moment about the origin (n, 3) each and, if asked, joint forces."""
    model, data, pairs, models, datas, keep, act, pas = prepared
    n = len(motion)
    torque, force, moment = np.empty((n, act.size)), np.empty((n, 3)), np.empty((n, 3))
    reactions = np.empty((n, model.njoints, 6)) if joint_forces else None
    q, v, a, zero = np.array(q0), np.zeros(model.nv), np.zeros(model.nv), np.zeros(model.nv)
    N = np.zeros((model.nv, act.size))
    N[act, np.arange(act.size)] = 1.0
    last = np.array(motion.q[0])
    for k in range(n):
        q[act] = motion.q[k]
        q[pas] += N[pas] @ (motion.q[k] - last)
        last = motion.q[k]
        for _ in range(10):
            r, J = _rows(prepared, q)
            r, J = r[keep], J[keep]
            if np.abs(r).max() < 1e-14:
                break
            q[pas] -= np.linalg.solve(J[:, pas], r)
        N[pas] = -np.linalg.solve(J[:, pas], J[:, act])
        v[:] = N @ motion.v[k]
        pin.forwardKinematics(model, data, q, v, zero)
        drift = []
        for cm, cd in zip(models, datas, strict=True):
            cm.calc(model, data, cd)
            drift.append(cd.constraint_acceleration_error)
        a[act] = motion.a[k]
        a[pas] = N[pas] @ motion.a[k] - np.linalg.solve(J[:, pas], np.concatenate(drift)[keep])
        tau = pin.rnea(model, data, q, v, a)
        torque[k] = N.T @ tau
        pin.computeCentroidalMomentumTimeVariation(model, data, q, v, a)
        rate, com = data.dhg, data.com[0]
        force[k] = -rate.linear
        moment[k] = -rate.angular + np.cross(com, force[k])
        if reactions is not None:
            tau[act] -= torque[k]
            load = np.zeros(3 * len(pairs))
            load[keep] = np.linalg.solve(J[:, pas].T, tau[pas])
            reactions[k] = _joint_forces(prepared, q, v, a, load.reshape(-1, 3))
    return torque, force, moment, reactions


def _joint_forces(prepared, q, v, a, load):
    model, data, pairs = prepared[:3]
    fext = [pin.Force.Zero() for _ in range(model.njoints)]
    for (f1, f2), lam in zip(pairs, load, strict=True):
        w = data.oMi[f1.parentJoint].rotation @ (f1.placement.rotation @ lam)
        for f, sign in ((f1, -1.0), (f2, 1.0)):
            local = data.oMi[f.parentJoint].rotation.T @ (sign * w)
            fext[f.parentJoint] = fext[f.parentJoint] + pin.Force(local, np.cross(f.placement.translation, local))
    pin.rnea(model, data, q, v, a, fext)
    return [np.zeros(6), *(data.oMi[j].act(data.f[j]).vector for j in range(1, model.njoints))]
