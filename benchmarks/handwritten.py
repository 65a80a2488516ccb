"""What a competent user writes without this library: Pinocchio's own calls in a loop over the samples.

Torque and shaking wrench of a chain with one planar `3d` closure, straight from the motion of the actuated joints.
Every object is made once, nothing is recomputed, each sample starts from the last one.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin


def prepare(chain):
    """Make the Pinocchio objects once."""
    model = chain.model.copy()
    data = model.createData()
    f1, f2 = (model.frames[model.getFrameId(f)] for f in chain.closures[0].frames)
    cm = pin.PointAnchorConstraintModel(model, f1.parentJoint, f1.placement, f2.parentJoint, f2.placement)
    return model, data, cm, cm.createData(), chain.actuated_index, chain.passive_index, f1, f2


def torque_and_shaking(prepared, q0, motion, *, joint_forces=False):
    """Return torque (n, na), shaking force (n, 3), moment about the origin (n, 3) and, if asked, joint forces."""
    model, data, cm, cd, act, pas, f1, f2 = prepared
    n, mass = len(motion), sum(I.mass for I in model.inertias)
    torque, force, moment = np.empty((n, act.size)), np.empty((n, 3)), np.empty((n, 3))
    reactions = np.empty((n, model.njoints, 6)) if joint_forces else None
    q, v, a, zero = np.array(q0), np.zeros(model.nv), np.zeros(model.nv), np.zeros(model.nv)
    N = np.zeros((model.nv, act.size))
    N[act, np.arange(act.size)] = 1.0
    last = np.array(motion.q[0])
    fext = [pin.Force.Zero() for _ in range(model.njoints)]
    gravity = model.gravity.linear
    for k in range(n):
        q[act] = motion.q[k]
        q[pas] += N[pas] @ (motion.q[k] - last)
        last = motion.q[k]
        for _ in range(10):
            pin.computeJointJacobians(model, data, q)
            cm.calc(model, data, cd)
            J = cm.jacobian(model, data, cd)[:2]
            r = (data.oMi[f1.parentJoint] * f1.placement).actInv(data.oMi[f2.parentJoint] * f2.placement).translation
            if abs(r[0]) + abs(r[1]) < 1e-14:
                break
            q[pas] -= np.linalg.solve(J[:, pas], r[:2])
        N[pas] = -np.linalg.solve(J[:, pas], J[:, act])
        v[:] = N @ motion.v[k]
        pin.forwardKinematics(model, data, q, v, zero)
        cm.calc(model, data, cd)
        drift = cd.constraint_acceleration_error[:2]
        a[act] = motion.a[k]
        a[pas] = N[pas] @ motion.a[k] - np.linalg.solve(J[:, pas], drift)
        tau = pin.rnea(model, data, q, v, a)
        torque[k] = N.T @ tau
        pin.computeCentroidalMomentumTimeVariation(model, data, q, v, a)
        rate, com = data.dhg, data.com[0]
        force[k] = mass * gravity - rate.linear
        moment[k] = -rate.angular + np.cross(com, force[k])
        if reactions is not None:
            tau[act] -= torque[k]
            lam = np.linalg.solve(J[:, pas].T, tau[pas])
            w = data.oMi[f1.parentJoint].rotation @ f1.placement.rotation @ np.r_[lam, 0.0]
            for f, sign in ((f1, -1.0), (f2, 1.0)):
                local = data.oMi[f.parentJoint].rotation.T @ (sign * w)
                fext[f.parentJoint] = pin.Force(local, np.cross(f.placement.translation, local))
            pin.rnea(model, data, q, v, a, fext)
            for j in range(1, model.njoints):
                reactions[k, j] = data.oMi[j].act(data.f[j]).vector
    return torque, force, moment, reactions
