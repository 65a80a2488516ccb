"""One MJCF file in our hands and in MuJoCo's: the quantities to compare, in MuJoCo's order of coordinates."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
from random_chains import mass_matrix

import fivebar_pin as fb
from fivebar_pin.dynamics.elastic import spring_forces
from fivebar_pin.mechanism.loops import loops_of

_SPACING = 1e-3
_FIVE_POINTS = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12.0  # first derivative, error of the fourth order


class Twin:
    """A chain of hinges and slides, and MuJoCo's model of the same file."""

    def __init__(self, path: Path) -> None:
        self.chain = fb.load(path)
        self.model = mujoco.MjModel.from_xml_path(str(path))
        self.data = mujoco.MjData(self.model)

    def at(self, q: np.ndarray, v: np.ndarray) -> None:
        self.data.qpos[:], self.data.qvel[:] = q, v
        mujoco.mj_forward(self.model, self.data)

    def masses(self) -> np.ndarray:
        """MuJoCo's mass matrix."""
        M = np.zeros((self.model.nv, self.model.nv))
        for row, unit in zip(M, np.eye(self.model.nv), strict=True):
            mujoco.mj_mulM(self.model, self.data, row, unit)
        return M

    def equality(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residual and Jacobian of MuJoCo's equality constraints."""
        self.at(q, np.zeros(self.model.nv))
        rows = self.data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
        return self.data.efc_pos[rows].copy(), self.data.efc_J.reshape(-1, self.model.nv)[rows].copy()

    def acceleration(self, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """Solve M a - J^T f = tau + passive - bias, J a = -dJ/dt v, all of them MuJoCo's."""
        _, J = self.equality(q)
        steps = (np.arange(5) - 2) * _SPACING
        rate = sum(c * self.equality(q + h * v)[1] for c, h in zip(_FIVE_POINTS, steps, strict=True)) / _SPACING
        self.at(q, v)
        k = len(J)
        A = np.block([[self.masses(), -J.T], [J, np.zeros((k, k))]])
        right = np.concatenate([tau + self.data.qfrc_passive - self.data.qfrc_bias, -rate @ v])
        return np.linalg.lstsq(A, right, rcond=1e-11)[0][: len(q)]

    def passive(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Our forces of springs and dampers."""
        loops = loops_of(self.chain)
        springs = spring_forces(self.chain, loops, q[None], v[None], loops.tree.poses(q[None])).force[0]
        return np.asarray(springs - np.array(self.chain.model.damping) * v)

    def assert_same(self, seed: int = 0, rtol: float = 1e-13) -> None:
        """Mass matrix, bias and passive forces agree at a random state."""
        rng, model = np.random.default_rng(seed), self.chain.model
        q, v = rng.normal(size=(2, model.nv))
        self.at(q, v)
        scale = np.abs(self.masses()).max()
        np.testing.assert_allclose(mass_matrix(model, q), self.masses(), rtol=0.0, atol=rtol * scale)
        bias = pin.nle(model, model.createData(), q, v)
        scale = max(np.abs(bias).max(), 1.0)
        np.testing.assert_allclose(bias, self.data.qfrc_bias, rtol=0.0, atol=10.0 * rtol * scale)
        scale = max(np.abs(self.data.qfrc_passive).max(), 1.0)
        np.testing.assert_allclose(self.passive(q, v), self.data.qfrc_passive, rtol=0.0, atol=10.0 * rtol * scale)
