"""Numbers for the errata: the error of each printed form, and that of its repair, along one generic solution."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array
from fivebar_pin.motion import Motion
from fivebar_pin.paper import matrices
from fivebar_pin.paper.closed_form import solve, solve_states
from fivebar_pin.paper.equations import conditions
from fivebar_pin.paper.linkage import FiveBar
from fivebar_pin.paper.optimum import balance_mass_centres
from fivebar_pin.paper.solution import Solution
from fivebar_pin.paper.table import default_motion, table_1
from fivebar_pin.paper.velocity_ratios import phi_loop, printed_theta_slopes, ratio_rates, ratios, theta_loop

__all__ = [
    "arcsine",
    "at_rest",
    "balanced",
    "complement",
    "crank",
    "dropped_turn",
    "error",
    "first_row",
    "frame_force",
    "generic",
    "guess",
    "inertia",
    "loop_slope",
    "negligible",
    "neighbours",
    "ratio",
    "ratio_slope",
    "torque",
]

_STEP = 1e-30  # of the complex step: no difference is taken, so that it may be as small as numbers are [rad, rad/s]

Pair = tuple[float, float]
Angles = npt.NDArray[Any]  # real, or complex for a complex step


def generic() -> Solution:
    """Return samples with nonzero values in every term; both ends, where psi' = 0, are left out."""
    case = table_1("I", "unbalanced")
    linkage = FiveBar(case.lengths, case.masses, case.inertias, (0.4, 0.6, 0.3, 0.7), (0.3, -0.5, 0.8, -0.2))
    return solve(linkage, _inner(default_motion(samples=41)))


def _inner(m: Motion) -> Motion:
    return Motion(m.t[1:-1], m.q[1:-1], m.v[1:-1], m.a[1:-1])


def error(value: Array, exact: Array) -> float:
    """Largest error over the largest exact value."""
    return float(np.abs(value - exact).max() / np.abs(exact).max())


def arcsine(s: Solution) -> Pair:
    a1, a2, a3, a4, a5 = s.linkage.lengths.tolist()
    psi, theta, phi, gamma = s.angles.T
    y = a3 * np.sin(phi) + a4 * np.sin(gamma) - a1 * np.sin(psi)
    x = a3 * np.cos(phi) + a4 * np.cos(gamma) + a5 - a1 * np.cos(psi)  # (3)
    return float(np.abs(np.arcsin(y / a2) - theta).max()), float(np.abs(np.arctan2(y, x) - theta).max())


def loop_slope(which: str, k: int) -> Callable[[Solution], Pair]:
    """Compare derivative k of (13), "phi", or (A5), "theta", with the complex step of the function itself."""
    index, slopes, function = {"phi": (2, phi_loop, _f13), "theta": (1, theta_loop, _fA5)}[which]

    def evidence(s: Solution) -> Pair:
        x = [s.angles[:, 0], s.angles[:, 3], s.angles[:, index]]
        step = [angle + (1j * _STEP if j == k else 0.0) for j, angle in enumerate(x)]
        exact = function(s.linkage, *step).imag / _STEP
        printed, repaired = (slopes(s.linkage, *x, form=form)[k] for form in ("printed", "repaired"))
        return error(printed, exact), error(repaired, exact)

    return evidence


def _f13(linkage: FiveBar, psi: Angles, gamma: Angles, phi: Angles) -> Angles:
    """|a5 + a4 + a3 - a1|^2 - a2^2, (13), analytic in its angles."""
    a1, a2, a3, a4, a5 = linkage.lengths.tolist()
    x = a5 + a4 * np.cos(gamma) + a3 * np.cos(phi) - a1 * np.cos(psi)
    y = a4 * np.sin(gamma) + a3 * np.sin(phi) - a1 * np.sin(psi)
    return np.asarray(x * x + y * y - a2 * a2)


def _fA5(linkage: FiveBar, psi: Angles, gamma: Angles, theta: Angles) -> Angles:
    """|a1 + a2 - a4 - a5|^2 - a3^2, (A5)."""
    a1, a2, a3, a4, a5 = linkage.lengths.tolist()
    x = a1 * np.cos(psi) + a2 * np.cos(theta) - a4 * np.cos(gamma) - a5
    y = a1 * np.sin(psi) + a2 * np.sin(theta) - a4 * np.sin(gamma)
    return np.asarray(x * x + y * y - a3 * a3)


def ratio(which: str) -> Callable[[Solution], Pair]:
    """Compare r_phi or r_theta from printed and repaired derivatives with the rates of the closed loop."""

    def evidence(s: Solution) -> Pair:
        exact = s.rates[:, {"theta": 1, "phi": 2}[which]] / s.rates[:, 0]
        printed, repaired = (getattr(ratios(s, form=form), which) for form in ("printed", "repaired"))
        return error(printed, exact), error(repaired, exact)

    return evidence


def ratio_slope(name: str) -> Callable[[Solution], Pair]:
    """Compare (A15) with the complex step of the printed (A11); repaired: the rate of r_theta, (A13)."""

    def evidence(s: Solution) -> Pair:
        x: dict[str, Angles] = {"psi": s.angles[:, 0], "gamma": s.angles[:, 3], "theta": s.angles[:, 1]}
        x |= {"psi'": s.rates[:, 0], "gamma'": s.rates[:, 3]}
        x[name] = x[name] + 1j * _STEP
        f = theta_loop(s.linkage, x["psi"], x["gamma"], x["theta"], form="printed")
        exact = (-(f.psi + f.gamma * x["gamma'"] / x["psi'"]) / f.x).imag / _STEP
        rate = (s.accelerations[:, 1] - ratios(s).theta * s.accelerations[:, 0]) / s.rates[:, 0]
        return error(printed_theta_slopes(s)[name], exact), error(ratio_rates(s).theta, rate)

    return evidence


def neighbours(s: Solution) -> Pair:
    t = matrices.twist(s)
    scale = np.abs(t.reshape(-1, 4, 3)[..., 1:]).max()
    repaired = (matrices.A(s)[:, 2:8] @ t[..., None])[..., 0]
    return float(np.abs(matrices.printed_neighbours(s)).max() / scale), float(np.abs(repaired).max() / scale)


def first_row(s: Solution) -> Pair:
    B = np.swapaxes(matrices.B(s), 1, 2)
    return float(np.abs(matrices.A(s, form="printed") - B).max()), float(np.abs(matrices.A(s) - B).max())


def complement(s: Solution) -> Pair:
    A = matrices.A(s)
    return float(np.abs(A @ matrices.u(s, form="printed")).max()), float(np.abs(A @ matrices.u(s)).max())


def at_rest(s: Solution) -> Pair:
    """Evaluate the complement where psi' = 0: the printed ratios divide by it."""
    v = s.rates[:, ::3] * np.array([0.0, 1.0])
    still = solve_states(s.linkage, s.angles[:, ::3], v, s.accelerations[:, ::3])
    with np.errstate(divide="ignore"):
        ratio = np.abs(np.divide(still.rates[:, 3], still.rates[:, 0])).max()
    return float(ratio), float(np.abs(matrices.A(still) @ matrices.u(still)).max())


def inertia(s: Solution) -> Pair:
    """Compare u^T M u with the kinetic energy of unit rates."""
    q, a = s.angles[:, ::3], s.accelerations[:, ::3]
    psi, gamma, both = (solve_states(s.linkage, q, np.zeros_like(q) + v, a).energy for v in ((1, 0), (0, 1), (1, 1)))
    exact = np.stack([2.0 * psi, both - psi - gamma, both - psi - gamma, 2.0 * gamma], axis=1).reshape(-1, 2, 2)
    return error(matrices.inertia(s, form="printed"), exact), error(matrices.inertia(s), exact)


def torque(s: Solution) -> Pair:
    return error(matrices.tau(s, form="printed"), s.torque), error(matrices.tau(s), s.torque)


def dropped_turn(s: Solution) -> Pair:
    """Compare psi' times (52), as printed and turned by E, with the velocity of the mass centre."""
    t, mu = matrices.twist(s).reshape(-1, 4, 3), s.linkage.mass_ratios
    r, b, z = matrices.vectors(s)
    w = s.rates[..., None]
    printed = mu[0] * w[:, 0] * r[:, 0] + mu[1] * (w[:, 0] * z[:, 0] + w[:, 1] * r[:, 1])
    printed += mu[2] * (-w[:, 2] * b[:, 2] - w[:, 3] * z[:, 3]) - mu[3] * w[:, 3] * b[:, 3]
    exact = np.einsum("i,nij->nj", mu, t[..., 1:])
    turned = np.stack([-printed[:, 1], printed[:, 0]], axis=1)
    return error(printed, exact), error(turned, exact)


def frame_force(_: Solution) -> Pair:
    motion = default_motion(samples=41)
    f = solve(balance_mass_centres(table_1("I", "balanced")).linkage, motion).joint_forces
    scale = np.abs(solve(table_1("I", "unbalanced"), motion).shaking_force).max()
    return float(np.abs(f[:, 0] + f[:, 4]).max() / scale), float(np.abs(f[:, 4] - f[:, 0]).max() / scale)


def guess(_: Solution) -> Pair:
    printed, repaired = (0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.5), (0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.5, 0.5)
    return float(abs(len(printed) - 8)), float(abs(len(repaired) - 8))


def crank(_: Solution) -> Pair:
    """Compare I_1 with that of a uniform rod; without |r_12| there is no rod at all."""
    errors = []
    for case in ("I", "II"):
        x = table_1(case, "unbalanced")
        errors.append(abs(x.masses[0] * x.lengths[0] ** 2 / 12.0 / x.inertias[0] - 1.0))
    return 1.0, float(max(errors))


def balanced(case: str, reading: str) -> Callable[[Solution], Pair]:
    def evidence(_: Solution) -> Pair:
        printed = table_1(case, "balanced", reading=reading)
        return conditions(printed).worst, balance_mass_centres(printed).conditions.worst

    return evidence


def negligible(_: Solution) -> Pair:
    motion = default_motion(samples=201)
    before = solve(table_1("I", "unbalanced"), motion)
    after = solve(balance_mass_centres(table_1("I", "balanced")).linkage, motion)
    torque = np.abs(after.torque[:, 0]).max() / np.abs(before.torque[:, 0]).max()
    return float(torque), float(np.abs(after.shaking_force).max() / np.abs(before.shaking_force).max())
