"""What commands about any mechanism write: one table, the plots and the page."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics import Loads
from fivebar_pin.errors import OutputError
from fivebar_pin.motion import Motion
from fivebar_pin.trajectory import Trajectory


def prepared_folder(folder: Path, *, overwrite: bool) -> Path:
    """Make the folder; refuse one that holds results already."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / ".writable"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise OutputError(folder, f"cannot be written ({error.strerror or error}); choose another --out") from error
    there = sorted(path.name for path in folder.iterdir())
    if there and not overwrite:
        raise OutputError(folder, f"is not empty (holds {there[0]}); choose another --out, or pass --overwrite")
    return folder


def write_columns(file: Path, columns: list[tuple[str, Array]]) -> Path:
    """Write named columns as csv, every digit kept."""
    header = ",".join(name for name, _ in columns)
    table = np.column_stack([x for _, x in columns])
    try:
        np.savetxt(file, table, delimiter=",", header=header, comments="", fmt="%.17g", encoding="utf-8")
    except OSError as error:
        raise OutputError(file, f"cannot be written ({error.strerror or error})") from error
    return file


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


def load_columns(chain: ClosedChain, loads: Loads) -> list[tuple[str, Array]]:
    """Return torques, shaking force and moment and the centre of mass with their units."""
    columns = [
        (f"tau {name} [{'N' if joint_unit(chain, name) == 'm' else 'N m'}]", loads.torque[:, k])
        for k, name in enumerate(chain.actuated)
    ]
    for word, unit, values in (
        ("F", "N", loads.shaking_force),
        ("M", "N m", loads.shaking_moment),
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


def figures(chain: ClosedChain, trajectory: Trajectory, loads: Loads, motion: Motion | None) -> dict[str, object]:
    """Return the plots of one mechanism by file name."""
    from fivebar_pin.viz import plots

    one = {chain.name: loads}
    made: dict[str, object] = {
        "shaking": plots.shaking(one, t=trajectory.t),
        "mass_centre": plots.com(one),
    }
    if chain.na:
        made["torques"] = plots.torques(one, chain.actuated, t=trajectory.t)
    if motion is not None and chain.na:
        made["motion"] = plots.motion(motion, chain.actuated)
    return made


def fresh_file(file: Path) -> Path:
    """Return the path of a file that is to be written; refuse one that exists."""
    if file.exists():
        raise OutputError(file, "exists already; choose another --out")
    if not file.parent.is_dir():
        raise OutputError(file, "lies in a folder that does not exist; make it first")
    return file
