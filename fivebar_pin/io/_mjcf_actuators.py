"""The actuators of an MJCF file as driven joints.

An actuator drives the joint that it names, or that of a fixed tendon; of a tendon over several joints the first, where
couplings tie them so that one motor moves all. One that acts elsewhere (at a site, on a body, between a crank and a
slider, on a joint of several degrees of freedom) is told and left out. What an actuator adds to its joint, armature and
damping times the square of its gear, moves the mechanism and is kept; so are the bounds of its force.
"""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.closures import Closure, Coupling
from fivebar_pin.errors import UnknownNameError
from fivebar_pin.io._entries import UNLIMITED
from fivebar_pin.io._mjcf_attributes import DRIVES
from fivebar_pin.io._mjcf_equality import fixed_ratios
from fivebar_pin.io._mjcf_reader import MjcfReader
from fivebar_pin.io._mjcf_tree import BodyTree

__all__ = ["driven_joints"]

_ADDED = ("armature", "damping")
_ONE_AXIS = ("revolute", "prismatic", "continuous")


def driven_joints(
    reader: MjcfReader, root: ElementTree.Element, bodies: BodyTree, closures: tuple[Closure, ...]
) -> tuple[str, ...]:
    """Return the joints that the actuators drive, each once, and note what is left out."""
    tendons = {tendon.get("name", ""): tendon for tendon in root.findall("tendon/*")}
    forces: dict[str, tuple[float, float]] = {}
    for k, element in enumerate(root.findall("actuator/*")):
        where = f"{element.tag} {element.get('name', str(k))!r}"
        if element.tag not in DRIVES:
            raise reader.fail(where, str(UnknownNameError("actuator", element.tag, DRIVES)))
        full = reader.with_defaults(element, None)
        joint, ratio = _joint(reader, full, tendons, bodies, closures, where)
        if joint is None:
            continue
        _add(reader, full, bodies, joint, ratio, where)
        low, high = _force_range(reader, full, bodies, ratio, where)
        least, most = forces.get(joint, (0.0, 0.0))
        forces[joint] = least + low, most + high
    for joint, force in forces.items():
        _limit(bodies, joint, force)
    return tuple(forces)


def _joint(
    reader: MjcfReader,
    actuator: ElementTree.Element,
    tendons: dict[str, ElementTree.Element],
    bodies: BodyTree,
    closures: tuple[Closure, ...],
    where: str,
) -> tuple[str | None, float]:
    """Return the joint that an actuator drives and by how much its length grows with it; None leaves it out."""
    joint, tendon = actuator.get("joint") or actuator.get("jointinparent"), actuator.get("tendon")
    if joint is not None:
        if joint not in bodies.order:
            raise reader.fail(where, str(UnknownNameError("joint", joint, bodies.order)))
        if bodies.joints[joint].kind in _ONE_AXIS:
            return joint, 1.0
        return _left_out(reader, actuator, where, f"drives {joint!r} of several degrees of freedom")
    if tendon is None:
        return _left_out(reader, actuator, where, "drives no joint")
    if tendon not in tendons:
        raise reader.fail(where, str(UnknownNameError("tendon", tendon, tendons)))
    if tendons[tendon].tag != "fixed":
        return _left_out(reader, actuator, where, f"pulls the spatial tendon {tendon!r}")
    ratios = fixed_ratios(reader, bodies, tendons[tendon], where)
    first = next(iter(ratios), None)
    if first is not None and (len(ratios) == 1 or _tied(ratios, closures)):
        return first, ratios[first] if len(ratios) == 1 else 0.0
    return _left_out(reader, actuator, where, f"pulls the tendon {tendon!r} of joints that no coupling ties")


def _left_out(reader: MjcfReader, actuator: ElementTree.Element, where: str, why: str) -> tuple[None, float]:
    for word in _ADDED:
        if any(reader.number(x, word, where) for x in actuator.get(word, "").split()):
            raise reader.fail(where, f"{why}, and its {word} acts on the mechanism; remove the {word}")
    reader.left_out.append(f"{where}, which {why}")
    return None, 0.0


def _add(
    reader: MjcfReader, actuator: ElementTree.Element, bodies: BodyTree, joint: str, ratio: float, where: str
) -> None:
    """Add armature and damping of an actuator, seen through its gear, to the joint that it drives."""
    gear = _gear(reader, actuator, where)
    for word in _ADDED:
        (value,) = reader.numbers(actuator, word, 1, where, [0.0])
        if value and not ratio:
            raise reader.fail(where, f"{word} at a tendon of several joints is not supported; state it at the joints")
        if value:
            old = bodies.data.setdefault(joint, {}).get(word, [0.0])[0]
            bodies.data[joint][word] = [old + value * (gear * ratio) ** 2]


def _gear(reader: MjcfReader, actuator: ElementTree.Element, where: str) -> float:
    return reader.number(actuator.get("gear", "1").split()[0], "gear", where)


def _force_range(
    reader: MjcfReader, actuator: ElementTree.Element, bodies: BodyTree, ratio: float, where: str
) -> tuple[float, float]:
    """Return the least and largest force that an actuator lays on its joint; a motor's control is its force."""
    gear = _gear(reader, actuator, where) * ratio
    stated = [("forcelimited", "forcerange")] + [("ctrllimited", "ctrlrange")] * (actuator.tag == "motor")
    ranges = [
        sorted(gear * x for x in reader.numbers(actuator, bounds, 2, where, None))
        for limited, bounds in stated
        if bodies.limited(actuator, limited, bounds, where)
    ]
    if not ranges or not gear:
        return -np.inf, np.inf
    return max(low for low, _ in ranges), min(high for _, high in ranges)


def _limit(bodies: BodyTree, joint: str, force: tuple[float, float]) -> None:
    """Let the effort limits of a joint be those of its actuators where these are narrower."""
    entry = bodies.joints[joint]
    low = entry.data.get("effort_lower", [-UNLIMITED])[0]
    high = entry.data["effort"][0]
    if force[0] > low or force[1] < high:
        data = {**entry.data, "effort": [min(high, force[1])], "effort_lower": [max(low, force[0])]}
        bodies.joints[joint] = replace(entry, data=data)


def _tied(ratios: dict[str, float], closures: tuple[Closure, ...]) -> bool:
    """Tell whether couplings leave the joints of a tendon one motion, and the tendon moves with it."""
    rows = [closure.ratios for closure in closures if isinstance(closure, Coupling)]
    names = list(dict.fromkeys([*ratios, *(joint for row in rows for joint in row)]))
    A = np.array([[row.get(joint, 0.0) for joint in names] for row in rows]).reshape(-1, len(names))
    free: Array = np.linalg.svd(A)[2][np.linalg.matrix_rank(A) if len(A) else 0 :].T
    mine = free[: len(ratios)]
    moves = np.array(list(ratios.values())) @ mine
    return bool(np.linalg.matrix_rank(mine) == 1 and np.linalg.norm(moves) > _LEAST * np.linalg.norm(mine))


_LEAST = 1e-9
"""Change of a tendon's length against that of its joints below which they do not move it [-]."""
