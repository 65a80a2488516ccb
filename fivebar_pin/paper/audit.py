"""What the columns of the paper's Table 1 do: residuals of the conditions, and the loads they cause."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from fivebar_pin._arrays import Immutable
from fivebar_pin.motion import Motion
from fivebar_pin.paper.assembly_mode import AssemblyMode
from fivebar_pin.paper.closed_form import solve
from fivebar_pin.paper.equations import Conditions, conditions
from fivebar_pin.paper.linkage import FiveBar
from fivebar_pin.paper.optimum import balance_mass_centres
from fivebar_pin.paper.table import default_motion, table_1

__all__ = ["READINGS", "AuditRow", "Loading", "audit_table_1", "loading"]

READINGS: dict[str, Callable[[complex], complex]] = {
    "rho": lambda k: k,
    "-rho": lambda k: -k,
    "1 - rho": lambda k: 1.0 - k,
    "1 + rho": lambda k: 1.0 + k,
}


@dataclass(frozen=True, slots=True)
class Loading(Immutable):
    """Largest absolute values along a motion: torques [N m], shaking force [N] and moment about O1 [N m]."""

    torque_1: float
    torque_4: float
    shaking_force: float
    shaking_moment: float


@dataclass(frozen=True, slots=True, eq=False)
class AuditRow(Immutable):
    """A printed balanced column beside the unbalanced one and the exact optimum for its masses.

    Attributes:
        case, reading: as for `table_1`.
        conditions: residuals of the printed balanced column.
        closest_reading: how each r_i / r_{i,i+1} would have to be read to come closest to the conditions, out of
            `READINGS`: rho towards either side, from either end of the link.
        closest: largest residual with this reading [kg].
        unbalanced, printed, optimum: loads of the three linkages.
        balanced: the exact optimum, with the masses and inertias of the printed column.
    """

    case: str
    reading: str
    conditions: Conditions
    closest_reading: tuple[str, ...]
    closest: float
    unbalanced: Loading
    printed: Loading
    optimum: Loading
    balanced: FiveBar


def loading(linkage: FiveBar, motion: Motion, *, mode: AssemblyMode = AssemblyMode.LEFT) -> Loading:
    """Return the peaks of torque, shaking force and shaking moment along a motion, without gravity."""
    s = solve(linkage, motion, mode=mode)
    peaks = np.abs(s.torque).max(axis=0)
    force = np.linalg.norm(s.shaking_force, axis=1).max()
    return Loading(float(peaks[0]), float(peaks[1]), float(force), float(np.abs(s.shaking_moment).max()))


def audit_table_1(motion: Motion | None = None, *, mode: AssemblyMode = AssemblyMode.LEFT) -> tuple[AuditRow, ...]:
    """Audit the balanced columns of Table 1: case I, case II as printed, case II with the likely masses.

    Args:
        motion: of psi and gamma; `default_motion` unless given.
        mode: assembly mode.
    """
    path = default_motion() if motion is None else motion
    return tuple(_audit(*key, path, mode) for key in (("I", "printed"), ("II", "printed"), ("II", "corrected")))


def _audit(case: str, reading: str, motion: Motion, mode: AssemblyMode) -> AuditRow:
    printed = table_1(case, "balanced", reading=reading)
    optimum = balance_mass_centres(printed).linkage
    reading_, closest = _closest_reading(printed)
    return AuditRow(
        case=case,
        reading=reading,
        conditions=conditions(printed),
        closest_reading=reading_,
        closest=closest,
        unbalanced=loading(table_1(case, "unbalanced"), motion, mode=mode),
        printed=loading(printed, motion, mode=mode),
        optimum=loading(optimum, motion, mode=mode),
        balanced=optimum,
    )


def _closest_reading(linkage: FiveBar) -> tuple[tuple[str, ...], float]:
    """Return the reading of the four rho whose largest residual is least, and that residual [kg]."""
    kappa, found = linkage.kappa, []
    for words in product(READINGS, repeat=4):
        read = np.array([READINGS[word](k) for word, k in zip(words, kappa, strict=True)])
        tried = replace(linkage, rho=np.abs(read), alpha=np.angle(read))
        found.append((float(np.abs(conditions(tried).mass_residuals).max()), words))
    worst, best = min(found, key=lambda pair: pair[0])
    return best, worst
