"""Printed u, repaired u and the complement N of Pinocchio's constraint Jacobian, side by side.

u maps (psi', gamma') to the twists of the four links (12,); N maps them to the joint rates of the tree (4,). With T the
tree's Jacobian of the twists, T N is comparable with u, and N^T M N with u^T M u.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array, Immutable, finite, frozen
from fivebar_pin.chain import ClosedChain, find_frame
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.motion import Motion
from fivebar_pin.paper import matrices
from fivebar_pin.paper.assembly_mode import AssemblyMode
from fivebar_pin.paper.closed_form import solve
from fivebar_pin.paper.linkage import FiveBar
from fivebar_pin.paper.solution import Solution
from fivebar_pin.paper.table import default_motion

__all__ = ["ComplementComparison", "compare_complements"]


@dataclass(frozen=True, slots=True, eq=False)
class ComplementComparison(Immutable):
    """Largest values over the samples at which psi' is not zero.

    Attributes:
        mode: assembly mode.
        samples: number of samples compared.
        skipped: number of samples left out because psi' = 0, where the printed u does not exist.
        A_u_printed: |A u| of the printed u [m].
        A_u: |A u| of the repaired u [m].
        J_N: |J N|, J and N from Pinocchio [m].
        twist_printed: |u q' - t| of the printed u, over the largest |t| [-].
        twist: the same of the repaired u [-].
        u_N: |u - T N|, repaired [m or -].
        columns: |u_printed - u| (12, 2), rows as `matrices.TWISTS`, columns psi and gamma [m or -].
        inertia_printed: |u^T M u - N^T M N| of the printed u, over the largest |N^T M N| [-].
        inertia: the same of the repaired u [-].
        torque_printed: |u^T M t' - tau| of the printed u, over the largest |tau| of the closed form [-].
        torque: the same of the repaired u [-].
    """

    mode: AssemblyMode
    samples: int
    skipped: int
    A_u_printed: float
    A_u: float
    J_N: float
    twist_printed: float
    twist: float
    u_N: float
    columns: Array
    inertia_printed: float
    inertia: float
    torque_printed: float
    torque: float

    def rows(self) -> tuple[tuple[str, float, float], ...]:
        """Return (quantity, printed, repaired) for a table."""
        return (
            ("twist u q' - t, relative", self.twist_printed, self.twist),
            ("A u [m]", self.A_u_printed, self.A_u),
            ("column psi of u - T N", float(self.columns[:, 0].max()), self.u_N),
            ("column gamma of u - T N", float(self.columns[:, 1].max()), self.u_N),
            ("u^T M u - N^T M N, relative", self.inertia_printed, self.inertia),
            ("u^T M t' - tau, relative", self.torque_printed, self.torque),
        )

    def __str__(self) -> str:
        head = f"{self.mode.value} mode, {self.samples} samples, {self.skipped} left out (psi' = 0), J N {self.J_N:.1e}"
        body = [f"{name:<30} printed {p:9.2e}   repaired {r:9.2e}" for name, p, r in self.rows()]
        return "\n".join([head, *body])


@finite()
def compare_complements(
    linkage: FiveBar, motion: Motion | None = None, *, mode: AssemblyMode = AssemblyMode.LEFT
) -> ComplementComparison:
    """Compare the printed u (41), the repaired u and N along a motion.

    Args:
        linkage: the linkage.
        motion: of psi and gamma; `default_motion` unless given.
        mode: assembly mode.

    Raises:
        InvalidInputError: psi' is zero throughout.
        AssemblyError, SingularityError: as `solve`.
    """
    whole = default_motion() if motion is None else motion
    moving = np.flatnonzero(whole.v[:, 0] != 0.0) if whole.na == 2 else np.arange(len(whole))
    if moving.size == 0:
        raise InvalidInputError("psi'", 0.0, "must differ from zero at some sample, where the printed u exists")
    full = solve(linkage, whole, mode=mode)
    picked = Motion(*(x[moving] for x in (whole.t, whole.q, whole.v, whole.a)))
    part = full if moving.size == len(whole) else _pick(full, moving, picked)
    return _compare(part, len(whole) - moving.size)


def _pick(solution: Solution, index: Array | np.ndarray[tuple[int], np.dtype[np.intp]], motion: Motion) -> Solution:
    """Return some samples of a solution."""
    rows = {
        name: getattr(solution, name)[index]
        for name in (
            "angles",
            "rates",
            "accelerations",
            "partials",
            "torque",
            "joint_forces",
            "shaking_force",
            "shaking_moment",
            "frame_force",
            "frame_moment",
            "com",
        )
    }
    return Solution(solution.linkage, solution.mode, motion.t, **rows)


def _compare(solution: Solution, skipped: int) -> ComplementComparison:
    U, printed = matrices.u(solution), matrices.u(solution, form="printed")
    A, M = matrices.A(solution), matrices.M(solution.linkage)
    t, v = matrices.twist(solution), solution.rates[:, ::3]
    TN, inertia, J_N = _pinocchio(solution.linkage.chain(), solution.trajectory.q)
    speed, weight, pull = (float(np.abs(x).max()) for x in (t, inertia, solution.torque))
    result = {}
    for name, u, form in (("_printed", printed, "printed"), ("", U, "repaired")):
        result[f"A_u{name}"] = _largest(A @ u)
        result[f"twist{name}"] = _largest((u @ v[..., None])[..., 0] - t) / speed
        result[f"inertia{name}"] = _largest(np.swapaxes(u, 1, 2) @ M @ u - inertia) / weight
        result[f"torque{name}"] = _largest(matrices.tau(solution, form=form) - solution.torque) / pull
    return ComplementComparison(
        mode=solution.mode,
        samples=len(solution),
        skipped=skipped,
        J_N=J_N,
        u_N=_largest(U - TN),
        columns=frozen(np.abs(printed - TN).max(axis=0)),
        **result,
    )


def _pinocchio(chain: ClosedChain, q: Array) -> tuple[Array, Array, float]:
    """Return T N (n, 12, 2), N^T M N (n, 2, 2) and the largest |J N|, all from Pinocchio."""
    model = chain.model
    data = model.createData()
    first, second = (find_frame(model, f) for f in chain.closures[0].ends)
    cm = pin.PointAnchorConstraintModel(model, first.parentJoint, first.placement, second.parentJoint, second.placement)
    cdata = cm.createData()
    driven, passive = chain.actuated_index, chain.passive_index
    twists, inertias, worst = np.empty((len(q), 12, 2)), np.empty((len(q), 2, 2)), 0.0
    for k, qk in enumerate(q):
        pin.computeJointJacobians(model, data, qk)
        cm.calc(model, data, cdata)  # without it the Jacobian is that of an earlier configuration
        J = np.asarray(cm.jacobian(model, data, cdata))
        N = np.zeros((4, 2))
        N[driven] = np.eye(2)
        N[passive] = -np.linalg.lstsq(J[:, passive], J[:, driven], rcond=None)[0]
        worst = max(worst, float(np.abs(J @ N).max()))
        twists[k] = _twist_jacobian(model, data) @ N
        mass = np.triu(pin.crba(model, data, qk))
        inertias[k] = N.T @ (mass + np.triu(mass, 1).T) @ N
    return twists, inertias, worst


def _twist_jacobian(model: pin.Model, data: pin.Data) -> Array:
    """Return T (12, 4): joint rates to (omega_i, c_i') of the links 1 to 4."""
    rows = []
    for joint in ("psi", "theta_psi", "phi_gamma", "gamma"):
        j = model.getJointId(joint)
        J = pin.getJointJacobian(model, data, j, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        x, y, _ = data.oMi[j].rotation @ model.inertias[j].lever
        rows += [J[5], J[0] - y * J[5], J[1] + x * J[5]]
    return np.array(rows)


def _largest(x: Array) -> float:
    return float(np.abs(x).max())
