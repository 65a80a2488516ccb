"""What a competent user writes without this library: Pinocchio's own calls in a loop over the samples.

Torque and shaking wrench of a chain with `3d` closures, straight from the motion of the actuated joints. Every object
is made once and the redundant rows are left out by hand. Positions come from a closed form; only a mechanism that has
none is closed by Newton's method, from the last sample.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

CLOSED = 1e-14
"""Gap at which the Newton loop stops [m]."""
STEPS = 10
"""Newton steps of a sample, at most."""


class HandLoop:
    """The loop, with its Pinocchio objects.

    Args:
        chain: the mechanism; every closure counts passive joints / closures rows, two of a plane x-y or three.
        q0: an assembled configuration near the first sample.
        position: closed form, actuated coordinates (na,) to configuration (nq,); a Newton loop when None.
    """

    def __init__(self, chain, q0, position=None):
        self.model = model = chain.model.copy()
        self.data = model.createData()
        self.actuated, self.passive, self.q0 = chain.actuated_index, chain.passive_index, np.array(q0)
        self.rows = self.passive.size // len(chain.closures)
        self.pairs = [[model.frames[model.getFrameId(f)] for f in closure.frames] for closure in chain.closures]
        self.closures = []
        for k, (f1, f2) in enumerate(self.pairs):
            ends = (f1.parentJoint, f1.placement, f2.parentJoint, f2.placement)
            closure = pin.PointAnchorConstraintModel(model, *ends)
            self.closures.append((closure, closure.createData(), slice(k * self.rows, (k + 1) * self.rows)))
        self.J = np.zeros((self.passive.size, model.nv))
        self.drift = np.zeros(self.passive.size)
        self.N = np.zeros((model.nv, self.actuated.size))
        self.N[self.actuated, np.arange(self.actuated.size)] = 1.0
        self.position = position

    def run(self, motion, *, joint_forces=False):
        """Return torque (n, na), shaking force and moment about the origin (n, 3) each and, if asked, joint forces."""
        model, data, actuated, passive, N = self.model, self.data, self.actuated, self.passive, self.N
        n = len(motion)
        torque, force, moment = np.empty((n, actuated.size)), np.empty((n, 3)), np.empty((n, 3))
        reactions = np.empty((n, model.njoints, 6)) if joint_forces else None
        q, v, a, zero = np.array(self.q0), np.zeros(model.nv), np.zeros(model.nv), np.zeros(model.nv)
        last = q[actuated]
        for k in range(n):
            x = motion.q[k]
            if self.position is None:
                q[passive] += N[passive] @ (x - last)
                q[actuated] = last = x
                self._newton(q)
            else:
                q[:] = self.position(x.tolist())
            J = self._jacobian(q)
            Jp = J[:, passive]
            N[passive] = -np.linalg.solve(Jp, J[:, actuated])
            v[:] = N @ motion.v[k]
            pin.forwardKinematics(model, data, q, v, zero)
            a[actuated] = motion.a[k]
            a[passive] = N[passive] @ motion.a[k] - np.linalg.solve(Jp, self._drift())
            tau = pin.rnea(model, data, q, v, a)
            torque[k] = N.T @ tau
            if reactions is not None:
                tau[actuated] -= torque[k]
                reactions[k] = self._joint_forces(q, v, a, np.linalg.solve(Jp.T, tau[passive]))
            pin.computeCentroidalMomentumTimeVariation(model, data, q, v, a)
            (x, y, z), (fx, fy, fz) = data.com[0], -data.dhg.linear
            force[k] = fx, fy, fz
            moment[k] = (y * fz - z * fy, z * fx - x * fz, x * fy - y * fx) - data.dhg.angular
        return torque, force, moment, reactions

    def accelerations(self, q, v, tau):
        """Return the accelerations (nv,) of a closed state: (N^T M N) a_actuated = tau - N^T (nle + M a_drift)."""
        model, data, actuated, passive, N = self.model, self.data, self.actuated, self.passive, self.N
        J = self._jacobian(q)
        Jp = J[:, passive]
        N[passive] = -np.linalg.solve(Jp, J[:, actuated])
        a = np.zeros(model.nv)
        pin.forwardKinematics(model, data, q, v, a)
        a[passive] = -np.linalg.solve(Jp, self._drift())
        bias = pin.rnea(model, data, q, v, a)
        M = np.triu(pin.crba(model, data, q))
        MN = M @ N + np.triu(M, 1).T @ N
        return a + N @ np.linalg.solve(N.T @ MN, tau - N.T @ bias)

    def _jacobian(self, q):
        model, data, J, rows = self.model, self.data, self.J, self.rows
        pin.computeJointJacobians(model, data, q)
        for closure, values, at in self.closures:
            closure.calc(model, data, values)
            J[at] = closure.jacobian(model, data, values)[:rows]
        return J

    def _drift(self):
        """Return the closures' accelerations at zero joint accelerations; the poses and rates are in the data."""
        for closure, values, at in self.closures:
            closure.calc(self.model, self.data, values)
            self.drift[at] = values.constraint_acceleration_error[: self.rows]
        return self.drift

    def _newton(self, q):
        passive, oMi = self.passive, self.data.oMi
        for _ in range(STEPS):
            J = self._jacobian(q)
            gaps = [
                (oMi[f1.parentJoint] * f1.placement).actInv(oMi[f2.parentJoint] * f2.placement).translation[: self.rows]
                for f1, f2 in self.pairs
            ]
            r = gaps[0] if len(gaps) == 1 else np.concatenate(gaps)
            if np.abs(r).max() < CLOSED:
                return
            q[passive] -= np.linalg.solve(J[:, passive], r)

    def _joint_forces(self, q, v, a, load):
        model, data, rows = self.model, self.data, self.rows
        fext = [pin.Force.Zero() for _ in range(model.njoints)]
        lam = np.zeros(3)
        for k, (f1, f2) in enumerate(self.pairs):
            lam[:rows] = load[k * rows : (k + 1) * rows]
            w = data.oMi[f1.parentJoint].rotation @ (f1.placement.rotation @ lam)
            for f, sign in ((f1, -1.0), (f2, 1.0)):
                local = data.oMi[f.parentJoint].rotation.T @ (sign * w)
                fext[f.parentJoint] = fext[f.parentJoint] + pin.Force(local, np.cross(f.placement.translation, local))
        pin.rnea(model, data, q, v, a, fext)
        return [np.zeros(6), *(data.oMi[j].act(data.f[j]).vector for j in range(1, model.njoints))]
