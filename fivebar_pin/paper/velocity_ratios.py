"""Velocity ratios r_phi = phi'/psi', r_theta = theta'/psi' and their rates, printed and repaired.

Eliminating theta or phi from the loop gives f(psi, gamma, phi) = 0, (13), and f(psi, gamma, theta) = 0, (A5). In both,

    r = -(f_psi + f_gamma r_gamma) / f_x,   r_gamma = gamma'/psi',   (17), (A9)

with x = phi or theta. (18a), (18c), (A10b), (A10c) and the rates (A15) carry slips; every function here takes
form="repaired" or form="printed". The ratios do not exist where psi' = 0; `Solution.partials` do.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fivebar_pin._arrays import Array, finite
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.paper.linkage import FiveBar
from fivebar_pin.paper.solution import Solution

__all__ = ["FORMS", "LoopDerivatives", "phi_loop", "ratio_rates", "ratios", "theta_loop"]

FORMS = ("repaired", "printed")


class LoopDerivatives(NamedTuple):
    """f_psi, f_gamma and f_x of (13), x = phi, or of (A5), x = theta. Each (n,) [m2]."""

    psi: Array
    gamma: Array
    x: Array


class Ratios(NamedTuple):
    """Values that belong to phi and to theta. Each (n,): ratios [-] or their rates [1/s]."""

    phi: Array
    theta: Array


def phi_loop(linkage: FiveBar, psi: Array, gamma: Array, phi: Array, *, form: str = "repaired") -> LoopDerivatives:
    """Return the partial derivatives (18) of (13)."""
    sign = _sign(form)
    a1, _, a3, a4, a5 = linkage.lengths.tolist()
    k2, k3, k4, k5, k6, k7 = (2.0 * k for k in (a4 * a3, a5 * a3, a1 * a3, a4 * a5, a1 * a4, a1 * a5))  # (14)
    sgf, sfp, sgp = np.sin(gamma - phi), np.sin(phi - psi), np.sin(gamma - psi)
    return LoopDerivatives(
        -sign * (k4 * sfp + k6 * sgp) + k7 * np.sin(psi),  # (18a)
        -k2 * sgf - k5 * np.sin(gamma) + k6 * sgp,  # (18b)
        sign * k2 * sgf - k3 * np.sin(phi) + k4 * sfp,  # (18c)
    )


def theta_loop(linkage: FiveBar, psi: Array, gamma: Array, theta: Array, *, form: str = "repaired") -> LoopDerivatives:
    """Return the partial derivatives (A10) of (A5)."""
    sign = _sign(form)
    a1, a2, _, a4, a5 = linkage.lengths.tolist()
    k2, k3, k4, k5, k6, k7 = (2.0 * k for k in (a1 * a2, a1 * a4, a5 * a2, a2 * a4, a5 * a4, a1 * a5))  # (A6)
    spt, sgt, spg = np.sin(psi - theta), np.sin(gamma - theta), np.sin(psi - gamma)
    return LoopDerivatives(
        -k2 * spt + k3 * spg + k7 * np.sin(psi),  # (A10a)
        -sign * k3 * spg + k5 * sgt - k6 * np.sin(gamma),  # (A10b)
        sign * (k2 * spt - k5 * sgt) + k4 * np.sin(theta),  # (A10c)
    )


@finite()
def ratios(solution: Solution, *, form: str = "repaired") -> Ratios:
    """Return r_phi, (17), and r_theta, (A9)-(A11).

    Raises:
        InvalidInputError: psi' = 0 at some sample.
    """
    psi, theta, phi, gamma = solution.angles.T
    r_gamma = _r_gamma(solution)
    found = []
    for f in (
        phi_loop(solution.linkage, psi, gamma, phi, form=form),
        theta_loop(solution.linkage, psi, gamma, theta, form=form),
    ):
        found.append(-(f.psi + f.gamma * r_gamma) / f.x)
    return Ratios(*found)


@finite()
def ratio_rates(solution: Solution) -> Ratios:
    """Return the time derivatives of r_phi, (20), and of r_theta, (A13), repaired.

    dr/dx_j = -(f_{psi,j} + r_gamma f_{gamma,j} + r f_{x,j}) / f_x for the angles, -f_gamma / (psi' f_x) for gamma' and
    its multiple by -r_gamma for psi'.

    Raises:
        InvalidInputError: psi' = 0 at some sample.
    """
    psi, theta, phi, gamma = solution.angles.T
    dpsi, dtheta, dphi, dgamma = solution.rates.T
    r_gamma = _r_gamma(solution)
    dr_gamma = (solution.accelerations[:, 3] - r_gamma * solution.accelerations[:, 0]) / dpsi
    found = []
    for f, hessian, r, dx in (
        (phi_loop(solution.linkage, psi, gamma, phi), _phi_hessian(solution), ratios(solution).phi, dphi),
        (theta_loop(solution.linkage, psi, gamma, theta), _theta_hessian(solution), ratios(solution).theta, dtheta),
    ):
        weights = np.stack([np.ones_like(r), r_gamma, r])
        slope = -np.einsum("in,ijn->jn", weights, hessian) / f.x  # dr/d(psi, gamma, x)
        found.append(slope[0] * dpsi + slope[1] * dgamma + slope[2] * dx - f.gamma * dr_gamma / f.x)
    return Ratios(*found)


def printed_theta_slopes(solution: Solution) -> dict[str, Array]:
    """Return (A15) as printed: derivatives of r_theta by psi, gamma, theta, psi', gamma', each (n,).

    They are to be compared with the derivatives of (A11) as printed, `ratios(solution, form="printed").theta`.
    """
    psi, theta, _, gamma = solution.angles.T
    dpsi, dgamma = solution.rates[:, 0], solution.rates[:, 3]
    ddpsi, ddgamma = solution.accelerations[:, 0], solution.accelerations[:, 3]
    a1, a2, _, a4, a5 = solution.linkage.lengths.tolist()
    k2, k3, k4, k5, k6, k7 = (2.0 * k for k in (a1 * a2, a1 * a4, a5 * a2, a2 * a4, a5 * a4, a1 * a5))
    f = theta_loop(solution.linkage, psi, gamma, theta, form="printed")
    rg = _r_gamma(solution)
    m, n = f.psi + f.gamma * rg, -f.x  # (A14)
    cpt, cgt, cpg = np.cos(psi - theta), np.cos(gamma - theta), np.cos(psi - gamma)
    return {
        "psi": (n * (k3 * cpg + k7 * np.cos(psi) - k2 * cpt + rg * k3 * cpg) - m * k2 * cpt) / n**2,
        "gamma": (n * (k3 * cpg + rg * (k3 * cpg + k5 * cgt - k6 * np.cos(gamma))) + m * k5 * cgt) / n**2,
        "theta": (n * (-k2 * cpt + rg * k5 * cgt) - m * (k2 * cpt - k4 * np.cos(theta)) - k5 * cgt) / n**2,
        "psi'": -dgamma * ddpsi * f.gamma / (n * dpsi**2),
        "gamma'": ddgamma * f.gamma / (n * dpsi),
    }


def _sign(form: str) -> float:
    if form not in FORMS:
        raise UnknownNameError("form", form, FORMS)
    return 1.0 if form == "repaired" else -1.0


def _r_gamma(solution: Solution) -> Array:
    """gamma' / psi' (n,) [-]."""
    still = np.flatnonzero(solution.rates[:, 0] == 0.0)
    if still.size:
        raise InvalidInputError(
            f"psi' at sample {int(still[0])}",
            0.0,
            "the velocity ratios divide by it [rad/s]",
            "Use the partial derivatives (Solution.partials), which exist everywhere.",
        )
    return np.asarray(solution.rates[:, 3] / solution.rates[:, 0])


def _phi_hessian(solution: Solution) -> Array:
    """Second derivatives of (13) by (psi, gamma, phi): row i differentiated by column j, (3, 3, n)."""
    psi, _, phi, gamma = solution.angles.T
    a1, _, a3, a4, a5 = solution.linkage.lengths.tolist()
    c_gf, c_fp, c_gp = 2.0 * a4 * a3 * np.cos(gamma - phi), 2.0 * a1 * a3 * np.cos(phi - psi), np.cos(gamma - psi)
    c_gp = 2.0 * a1 * a4 * c_gp
    c_p, c_g, c_f = (2.0 * a5 * a * np.cos(x) for a, x in ((a1, psi), (a4, gamma), (a3, phi)))
    return np.array(
        [
            [c_fp + c_gp + c_p, -c_gp, -c_fp],
            [-c_gp, -c_gf - c_g + c_gp, c_gf],
            [-c_fp, c_gf, -c_gf - c_f + c_fp],
        ]
    )


def _theta_hessian(solution: Solution) -> Array:
    """Second derivatives of (A5) by (psi, gamma, theta), (3, 3, n)."""
    psi, theta, _, gamma = solution.angles.T
    a1, a2, _, a4, a5 = solution.linkage.lengths.tolist()
    c_pt, c_pg, c_gt = (
        2.0 * a * np.cos(x) for a, x in ((a1 * a2, psi - theta), (a1 * a4, psi - gamma), (a2 * a4, gamma - theta))
    )
    c_p, c_g, c_t = (2.0 * a5 * a * np.cos(x) for a, x in ((a1, psi), (a4, gamma), (a2, theta)))
    return np.array(
        [
            [-c_pt + c_pg + c_p, -c_pg, c_pt],
            [-c_pg, c_pg + c_gt - c_g, -c_gt],
            [c_pt, -c_gt, -c_pt + c_t + c_gt],
        ]
    )
