"""What commands about any mechanism write: one table, the plots and the page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fivebar_pin._arrays import Array, figures, table_text
from fivebar_pin.chain import ClosedChain
from fivebar_pin.cli import _tables
from fivebar_pin.dynamics import Loads
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.motion import Motion
from fivebar_pin.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.figure import Figure


MOST_SAMPLES = 1_000_000
"""Samples above which no command computes: they would not fit into the memory of most machines."""


def columns_text(columns: list[tuple[str, Array]]) -> str:
    """Return named columns as csv, every digit kept."""
    for name, values in columns:
        if not np.isfinite(values).all():
            hint = "The numbers given are beyond what can be computed."
            raise InvalidInputError(name, float("nan"), "must be finite", hint)
    return table_text(",".join(name for name, _ in columns), np.column_stack([x for _, x in columns]))


def motion_columns(chain: ClosedChain, trajectory: Trajectory) -> list[tuple[str, Array]]:
    """Return time, coordinates, velocities and accelerations of every joint with their units."""
    columns: list[tuple[str, Array]] = [("t [s]", trajectory.t)]
    for name in chain.joints:
        joint = chain.model.joints[chain.model.getJointId(name)]
        unit = joint_unit(chain, name)
        for k in range(joint.nq):
            tail = f".{k}" if joint.nq > 1 else ""
            columns.append(
                (f"q {name}{tail} [{unit if joint.nq == joint.nv else '-'}]", trajectory.q[:, joint.idx_q + k])
            )
        for x, values in (("v", trajectory.v), ("a", trajectory.a)):
            for k in range(joint.nv):
                tail = f".{k}" if joint.nv > 1 else ""
                rate = f"{unit}/s" if x == "v" else f"{unit}/s2"
                columns.append((f"{x} {name}{tail} [{rate}]", values[:, joint.idx_v + k]))
    return columns


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """One quantity along a motion, for tables.

    Attributes:
        name: with its unit.
        values: (n,) or vectors (n, k).
        scale: sum of the sizes of what adds up to it: far below is round-off.
    """

    name: str
    values: Array
    scale: float

    @property
    def cells(self) -> list[str]:
        """Peak and RMS in figures."""
        return [figures(of(self.values), self.scale) for of in (_tables.peak, _tables.rms)]


def curves(chain: ClosedChain, loads: Loads, *, frame: bool) -> list[Curve]:
    """Return torques, shaking force and moment, and with `frame` what the frame carries."""
    out = [
        Curve(f"drive at {name} [{torque_unit(chain, name)}]", loads.torque[:, k], loads.scale("torque"))
        for k, name in enumerate(chain.actuated)
    ]
    about = ", ".join(f"{x:g}" for x in loads.about)
    for word in ("shaking", "frame") if frame else ("shaking",):
        force, moment = f"{word}_force", f"{word}_moment"
        out.append(Curve(f"{word} force [N]", getattr(loads, force), loads.scale(force)))
        out.append(Curve(f"{word} moment at ({about}) [N m]", getattr(loads, moment), loads.scale(moment)))
    return out


def torque_unit(chain: ClosedChain, name: str) -> str:
    """Return the unit of what a motor exerts."""
    return "N" if joint_unit(chain, name) == "m" else "N m"


def load_columns(chain: ClosedChain, loads: Loads) -> list[tuple[str, Array]]:
    """Return torques, shaking and frame force and moment and the centre of mass with their units, every digit kept."""
    columns = [
        (f"tau {name} [{torque_unit(chain, name)}]", loads.torque[:, k]) for k, name in enumerate(chain.actuated)
    ]
    for word, unit, values in (
        ("F", "N", loads.shaking_force),
        ("M", "N m", loads.shaking_moment),
        ("frame F", "N", loads.frame_force),
        ("frame M", "N m", loads.frame_moment),
        ("com", "m", loads.com),
    ):
        columns += [(f"{word} {axis} [{unit}]", values[:, k]) for k, axis in enumerate("xyz")]
    return columns


def joint_unit(chain: ClosedChain, name: str) -> str:
    """Return the unit of a joint's coordinate: m for slides, rad for hinges, - for mixed ones."""
    joint = chain.model.joints[chain.model.getJointId(name)]
    if joint.nv != 1:
        return "rad" if "Spherical" in joint.shortname() else "-"
    return "m" if joint.shortname().startswith("JointModelP") else "rad"


def all_figures(chain: ClosedChain, trajectory: Trajectory, loads: Loads, motion: Motion | None) -> dict[str, Figure]:
    """Return the plots of one mechanism by file name."""
    from fivebar_pin.viz import plots

    made = load_figures({chain.name: loads}, trajectory.t)
    if motion is not None and chain.na:
        made["motion"] = plots.motion(motion, chain.actuated)
    return made


def load_figures(loads: Mapping[str, Loads], t: Array) -> dict[str, Figure]:
    """Return the plots of the loads of mechanisms, one over the other, by file name."""
    from fivebar_pin.viz import plots

    made: dict[str, Figure] = {"shaking": plots.shaking(loads, t=t), "mass_centre": plots.com(loads)}
    if any(one.loaded for one in loads.values()):
        made["frame"] = plots.frame(loads, t=t)
    actuated = next(iter(loads.values())).chain.actuated
    if actuated:
        made["torques"] = plots.torques(loads, actuated, t=t)
    return made
