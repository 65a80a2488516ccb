"""The errata of the paper, each with a number for the printed form and one for the repaired form, computed here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array
from fivebar_pin.motion import Motion
from fivebar_pin.paper import matrices
from fivebar_pin.paper.equations import conditions
from fivebar_pin.paper.linkage import FiveBar, default_motion, table_1
from fivebar_pin.paper.optimum import balance
from fivebar_pin.paper.solution import Solution, solve, solve_states
from fivebar_pin.paper.velocity_ratios import phi_loop, printed_theta_slopes, ratio_rates, ratios, theta_loop

__all__ = ["Erratum", "errata"]

Pair = tuple[float, float]
Angles = npt.NDArray[Any]  # real, or complex for a complex step


@dataclass(frozen=True, slots=True)
class Erratum:
    """A slip of the paper and the evidence for it.

    Attributes:
        equation: where.
        printed: what stands there.
        repaired: what holds.
        measure: what the two errors are.
        printed_error: error of the printed form.
        repaired_error: error of the repaired form.
        tolerance: what the repaired error must stay below; round-off unless the paper's own digits limit it.
    """

    equation: str
    printed: str
    repaired: str
    measure: str
    printed_error: float
    repaired_error: float
    tolerance: float = 1e-12


def errata() -> tuple[Erratum, ...]:
    """Compute the table of errata, on case I with mass centres off the links, along `default_motion`."""
    s = _generic()
    return tuple(
        Erratum(equation, printed, repaired, measure, *evidence(s), tolerance=tolerance)
        for equation, printed, repaired, measure, evidence, tolerance in _TABLE
    )


def _generic() -> Solution:
    """Return samples with nonzero values in every term; both ends, where psi' = 0, are left out."""
    case = table_1("I", "unbalanced")
    linkage = FiveBar(case.lengths, case.masses, case.inertias, (0.4, 0.6, 0.3, 0.7), (0.3, -0.5, 0.8, -0.2))
    return solve(linkage, _inner(default_motion(samples=41)))


def _inner(m: Motion) -> Motion:
    return Motion(m.t[1:-1], m.q[1:-1], m.v[1:-1], m.a[1:-1])


def _error(value: Array, exact: Array) -> float:
    """Largest error over the largest exact value."""
    return float(np.abs(value - exact).max() / np.abs(exact).max())


def _arcsine(s: Solution) -> Pair:
    a1, a2, a3, a4, a5 = s.linkage.lengths.tolist()
    psi, theta, phi, gamma = s.angles.T
    y = a3 * np.sin(phi) + a4 * np.sin(gamma) - a1 * np.sin(psi)
    x = a3 * np.cos(phi) + a4 * np.cos(gamma) + a5 - a1 * np.cos(psi)  # (3)
    return float(np.abs(np.arcsin(y / a2) - theta).max()), float(np.abs(np.arctan2(y, x) - theta).max())


def _loop_slope(which: str, k: int) -> Callable[[Solution], Pair]:
    """Compare derivative k of (13), "phi", or (A5), "theta", with the complex step of the function itself."""
    index, slopes, function = {"phi": (2, phi_loop, _f13), "theta": (1, theta_loop, _fA5)}[which]

    def evidence(s: Solution) -> Pair:
        x = [s.angles[:, 0], s.angles[:, 3], s.angles[:, index]]
        step = [angle + (1e-30j if j == k else 0.0) for j, angle in enumerate(x)]
        exact = function(s.linkage, *step).imag / 1e-30
        printed, repaired = (slopes(s.linkage, *x, form=form)[k] for form in ("printed", "repaired"))
        return _error(printed, exact), _error(repaired, exact)

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


def _ratio(which: str) -> Callable[[Solution], Pair]:
    """Compare r_phi or r_theta from printed and repaired derivatives with the rates of the closed loop."""

    def evidence(s: Solution) -> Pair:
        exact = s.rates[:, {"theta": 1, "phi": 2}[which]] / s.rates[:, 0]
        printed, repaired = (getattr(ratios(s, form=form), which) for form in ("printed", "repaired"))
        return _error(printed, exact), _error(repaired, exact)

    return evidence


def _ratio_slope(name: str) -> Callable[[Solution], Pair]:
    """Compare (A15) with the complex step of the printed (A11); repaired: the rate of r_theta, (A13)."""

    def evidence(s: Solution) -> Pair:
        x: dict[str, Angles] = {"psi": s.angles[:, 0], "gamma": s.angles[:, 3], "theta": s.angles[:, 1]}
        x |= {"psi'": s.rates[:, 0], "gamma'": s.rates[:, 3]}
        x[name] = x[name] + 1e-30j
        f = theta_loop(s.linkage, x["psi"], x["gamma"], x["theta"], form="printed")
        exact = (-(f.psi + f.gamma * x["gamma'"] / x["psi'"]) / f.x).imag / 1e-30
        rate = (s.accelerations[:, 1] - ratios(s).theta * s.accelerations[:, 0]) / s.rates[:, 0]
        return _error(printed_theta_slopes(s)[name], exact), _error(ratio_rates(s).theta, rate)

    return evidence


def _neighbours(s: Solution) -> Pair:
    t = matrices.twist(s)
    scale = np.abs(t.reshape(-1, 4, 3)[..., 1:]).max()
    repaired = (matrices.A(s)[:, 2:8] @ t[..., None])[..., 0]
    return float(np.abs(matrices.printed_neighbours(s)).max() / scale), float(np.abs(repaired).max() / scale)


def _first_row(s: Solution) -> Pair:
    B = np.swapaxes(matrices.B(s), 1, 2)
    return float(np.abs(matrices.A(s, form="printed") - B).max()), float(np.abs(matrices.A(s) - B).max())


def _complement(s: Solution) -> Pair:
    A = matrices.A(s)
    return float(np.abs(A @ matrices.u(s, form="printed")).max()), float(np.abs(A @ matrices.u(s)).max())


def _at_rest(s: Solution) -> Pair:
    """Evaluate the complement where psi' = 0: the printed ratios divide by it."""
    v = s.rates[:, ::3] * np.array([0.0, 1.0])
    still = solve_states(s.linkage, s.angles[:, ::3], v, s.accelerations[:, ::3])
    with np.errstate(divide="ignore"):
        ratio = np.abs(np.divide(still.rates[:, 3], still.rates[:, 0])).max()
    return float(ratio), float(np.abs(matrices.A(still) @ matrices.u(still)).max())


def _inertia(s: Solution) -> Pair:
    """Compare u^T M u with the kinetic energy of unit rates."""
    q, a = s.angles[:, ::3], s.accelerations[:, ::3]
    psi, gamma, both = (solve_states(s.linkage, q, np.zeros_like(q) + v, a).energy for v in ((1, 0), (0, 1), (1, 1)))
    exact = np.stack([2.0 * psi, both - psi - gamma, both - psi - gamma, 2.0 * gamma], axis=1).reshape(-1, 2, 2)
    return _error(matrices.inertia(s, form="printed"), exact), _error(matrices.inertia(s), exact)


def _torque(s: Solution) -> Pair:
    return _error(matrices.tau(s, form="printed"), s.torque), _error(matrices.tau(s), s.torque)


def _dropped_turn(s: Solution) -> Pair:
    """Compare psi' times (52), as printed and turned by E, with the velocity of the mass centre."""
    t, mu = matrices.twist(s).reshape(-1, 4, 3), s.linkage.mass_ratios
    r, b, z = matrices.vectors(s)
    w = s.rates[..., None]
    printed = mu[0] * w[:, 0] * r[:, 0] + mu[1] * (w[:, 0] * z[:, 0] + w[:, 1] * r[:, 1])
    printed += mu[2] * (-w[:, 2] * b[:, 2] - w[:, 3] * z[:, 3]) - mu[3] * w[:, 3] * b[:, 3]
    exact = np.einsum("i,nij->nj", mu, t[..., 1:])
    turned = np.stack([-printed[:, 1], printed[:, 0]], axis=1)
    return _error(printed, exact), _error(turned, exact)


def _frame_force(_: Solution) -> Pair:
    motion = default_motion(samples=41)
    f = solve(balance(table_1("I", "balanced")).linkage, motion).joint_forces
    scale = np.abs(solve(table_1("I", "unbalanced"), motion).shaking_force).max()
    return float(np.abs(f[:, 0] + f[:, 4]).max() / scale), float(np.abs(f[:, 4] - f[:, 0]).max() / scale)


def _guess(_: Solution) -> Pair:
    printed, repaired = (0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.5), (0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.5, 0.5)
    return float(abs(len(printed) - 8)), float(abs(len(repaired) - 8))


def _crank(_: Solution) -> Pair:
    """Compare I_1 with that of a uniform rod; without |r_12| there is no rod at all."""
    errors = []
    for case in ("I", "II"):
        x = table_1(case, "unbalanced")
        errors.append(abs(x.masses[0] * x.lengths[0] ** 2 / 12.0 / x.inertias[0] - 1.0))
    return 1.0, float(max(errors))


def _balanced(case: str, reading: str) -> Callable[[Solution], Pair]:
    def evidence(_: Solution) -> Pair:
        printed = table_1(case, "balanced", reading=reading)
        return conditions(printed).worst, balance(printed).conditions.worst

    return evidence


def _negligible(_: Solution) -> Pair:
    motion = default_motion(samples=201)
    before = solve(table_1("I", "unbalanced"), motion)
    after = solve(balance(table_1("I", "balanced")).linkage, motion)
    torque = np.abs(after.torque[:, 0]).max() / np.abs(before.torque[:, 0]).max()
    return float(torque), float(np.abs(after.shaking_force).max() / np.abs(before.shaking_force).max())


_SLOPE = "relative error against the complex step of the function"
_RATE = "relative error against the complex step of (A11); repaired: of the rate of r_theta"
_TABLE: tuple[tuple[str, str, str, str, Callable[[Solution], Pair], float], ...] = (
    ("(7)", "theta = arcsin(y / a2)", "theta = atan2(y, x), x and y from (3)", "error of theta [rad]", _arcsine, 1e-12),
    ("(18a)", "+k4 sin(phi - psi) + k6 sin(gamma - psi)", "both terms negative", _SLOPE, _loop_slope("phi", 0), 1e-12),
    ("(18c)", "-k2 sin(gamma - phi)", "+k2 sin(gamma - phi)", _SLOPE, _loop_slope("phi", 2), 1e-12),
    ("(17)", "r_phi from the printed (18)", "r_phi from the repaired (18)", "relative error", _ratio("phi"), 1e-12),
    ("(A10b)", "+k3 sin(psi - gamma)", "-k3 sin(psi - gamma)", _SLOPE, _loop_slope("theta", 1), 1e-12),
    (
        "(A10c)",
        "-k2 sin(psi - theta) + k5 sin(gamma - theta)",
        "both with the other sign",
        _SLOPE,
        _loop_slope("theta", 2),
        1e-12,
    ),
    (
        "(A11)",
        "r_theta from the printed (A10)",
        "r_theta from the repaired (A10)",
        "relative error",
        _ratio("theta"),
        1e-12,
    ),
    ("(A15b)", "+k3 cos(psi - gamma), twice", "-k3 cos(psi - gamma)", _RATE, _ratio_slope("gamma"), 1e-12),
    (
        "(A15c)",
        "signs of k2, k5; a bracket closed early",
        "derivative of m / n by theta",
        _RATE,
        _ratio_slope("theta"),
        1e-12,
    ),
    ("(A15d)", "carries a factor psi''", "without it: (A13) multiplies by psi''", _RATE, _ratio_slope("psi'"), 1e-12),
    (
        "(A15e)",
        "carries a factor gamma''",
        "without it; (A13) multiplies by gamma''",
        _RATE,
        _ratio_slope("gamma'"),
        1e-12,
    ),
    (
        "(34)",
        "A_{i,i-1} = [E b, 1]",
        "A_{i,i-1} = [-E b, -1], as in (36)",
        "residual of (33) over the speed",
        _neighbours,
        1e-12,
    ),
    ("(36)", "an identity block at link 3 in row 1", "zero there", "|A - B^T|", _first_row, 1e-15),
    (
        "(41)",
        "r_theta, r_phi in the column of psi, zeros in that of gamma",
        "d(theta, phi)/d(psi, gamma) in both",
        "|A u|",
        _complement,
        1e-14,
    ),
    (
        "(41), psi' = 0",
        "divides by psi'",
        "partial derivatives exist there",
        "|r_gamma|; repaired: |A u|",
        _at_rest,
        1e-14,
    ),
    (
        "(46)",
        "I(q) = u^T M u with the printed u",
        "with the repaired u",
        "relative error against the energy",
        _inertia,
        1e-12,
    ),
    (
        "(72)",
        "tau = u^T M t' with the printed u",
        "with the repaired u",
        "relative error against Newton-Euler",
        _torque,
        1e-12,
    ),
    (
        "(52)",
        "E is dropped",
        "E times (52); it vanishes for the same linkages",
        "relative error of the COM velocity",
        _dropped_turn,
        1e-12,
    ),
    ("(75)", "F = f01 + f40", "F = f40 - f01", "peak for the balanced linkage over unbalanced", _frame_force, 1e-12),
    ("(80)", "seven numbers", "eight: four angles, four ratios", "numbers missing", _guess, 0.0),
    (
        "Table 1, |r_12|",
        "no row",
        "0.02 m, 0.035 m: the rods of I_1",
        "relative error of I_1 = m a^2 / 12",
        _crank,
        1e-3,
    ),
    (
        "Table 1, I balanced",
        "rho as printed",
        "the optimum of (77)",
        "residual of the conditions",
        _balanced("I", "printed"),
        1e-14,
    ),
    (
        "Table 1, II balanced",
        "rho, alpha as printed",
        "the optimum of (77)",
        "residual of the conditions",
        _balanced("II", "printed"),
        1e-14,
    ),
    (
        "Table 1, II balanced",
        "the same with m2 = 0.24, m3 = 0.31 kg",
        "the optimum of (77)",
        "residual of the conditions",
        _balanced("II", "corrected"),
        1e-14,
    ),
    (
        "Section 5",
        "torques become negligible",
        "the shaking force does; the torques grow",
        "peak of tau_1, repaired: of the force, over unbalanced",
        _negligible,
        1e-12,
    ),
)
