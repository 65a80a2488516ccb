"""Whether inertias can belong to bodies, and whether they give every motion of the mechanism an inertia."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics.mass import composite_mass_matrix
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.mechanism.plane import plane_normal

__all__ = ["inertia_problems", "mass_problem", "massless_bodies", "normals"]


_ROUND_OFF = 1e-9  # of the largest entry [-]
_SINGULAR_MASS = 1e-12  # smallest to largest eigenvalue of the reduced mass matrix [-]
_MOVES = 1e-6  # share of a joint in the motion without inertia from which on it is named [-]
_FAR = 20.0  # chain lengths beyond which a mass centre counts as misplaced


def inertia_problems(chain: ClosedChain, normal: Array | None) -> list[tuple[str, str]]:
    """Return (severity, text) for every body that cannot be, or is unlikely.

    Args:
        normal: normal of the plane of motion in every joint's own axes (njoints - 1, 3), None when not planar.
    """
    out = []
    for k, (joint, inertia) in enumerate(zip(chain.joints, list(chain.model.inertias)[1:], strict=True)):
        problem = _one_body(inertia)
        if problem:
            own = None if normal is None else normal[k]
            planar = own is not None and inertia.mass >= 0.0 and own @ inertia.inertia @ own >= 0.0
            out.append(
                (
                    "warning" if planar else "error",
                    f"no body has the inertia of joint {joint}: {problem}."
                    + (" The planar motion does not feel it." if planar else "")
                    + " Give the inertia about the mass centre of a real body.",
                )
            )
        far = float(np.linalg.norm(inertia.lever)) / chain.length
        if inertia.mass > 0.0 and far > _FAR:
            out.append(
                (
                    "warning",
                    f"the mass centre of the body of joint {joint} lies {far:.3g} chain lengths from the joint. "
                    "Check its units.",
                )
            )
    return out


def massless_bodies(chain: ClosedChain) -> tuple[str, ...]:
    """Return the joints whose bodies have neither mass nor moments of inertia, where others have some."""
    bare = [
        j for j, I in zip(chain.joints, list(chain.model.inertias)[1:], strict=True) if not (I.mass or I.inertia.any())
    ]
    return tuple(bare) if len(bare) < len(chain.joints) else ()


def _one_body(inertia: pin.Inertia) -> str:
    """Say what is wrong with one inertia, or nothing."""
    mass, I = float(inertia.mass), np.array(inertia.inertia)
    moments = np.linalg.eigvalsh(I)
    if mass == 0.0:
        return "it has moments of inertia but no mass" if np.abs(I).max() > 0.0 else ""
    if moments[0] < -_ROUND_OFF * np.abs(moments).max():
        return f"its least principal moment {moments[0]:.4g} kg m2 is negative"
    if moments[2] > (moments[0] + moments[1]) * (1.0 + _ROUND_OFF):
        listed = ", ".join(f"{x:.4g}" for x in moments)
        return f"its principal moments {listed} kg m2 break the triangle inequality"
    return ""


def mass_problem(chain: ClosedChain, site: Configurations) -> str:
    """Say which joints move without inertia at a site, or nothing."""
    model = chain.model
    if not site.free.shape[2]:
        return ""
    loops = loops_of(chain)
    M = composite_mass_matrix(loops.tree, model, site.q[0])
    free = loops.column_scale[:, None] * site.free[0]
    values, vectors = np.linalg.eigh(free.T @ M @ free)
    if values[0] > _SINGULAR_MASS * max(float(np.abs(values).max()), 0.0):
        return ""
    moving = np.abs(site.free[0] @ vectors[:, 0])
    names = [
        chain.joints[j - 1] for j in range(1, model.njoints) if moving[_columns(model, j)].max(initial=0.0) > _MOVES
    ]
    how = "negative" if values[0] < -_SINGULAR_MASS * float(np.abs(values).max()) else "no"
    return (
        f"the mechanism can move with {how} kinetic energy (joints {', '.join(names)}): accelerations do not follow "
        "from forces there. Give the bodies these joints carry a mass and an inertia."
    )


def normals(chain: ClosedChain, site: Configurations) -> Array | None:
    """Return the normal of the plane of motion in every joint's own axes (njoints - 1, 3), None when not planar."""
    n = plane_normal(site.poses.S, chain.length)
    return None if n is None else np.stack([R[0].T @ n for R in site.poses.R[1:]])


def _columns(model: pin.Model, j: int) -> slice:
    return slice(int(model.idx_vs[j]), int(model.idx_vs[j]) + int(model.joints[j].nv))
