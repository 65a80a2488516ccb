"""Springs in MJCF: spatial tendons between two sites, fixed tendons of one joint, and the springs of hinges and slides.

MuJoCo's tendon pulls with k (L - l) + c dL/dt and its joint with -k (q - rest) - b dq/dt: the laws of `Spring` and
`JointSpring`. A fixed tendon of one joint has L = r q, and so the joint's spring r^2 k, r^2 c, resting at l / r. MuJoCo
has one damper for a joint: that of a joint's spring is read back as the joint's own.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from fivebar_pin.chain import ClosedChain, frames_by_name
from fivebar_pin.errors import FileFormatError, FiveBarPinError, InvalidInputError, UnknownNameError
from fivebar_pin.io._mjcf_equality import fixed_ratios
from fivebar_pin.io._mjcf_reader import MjcfReader
from fivebar_pin.io._mjcf_tree import BodyTree
from fivebar_pin.io._urdf_text import numbers, quoted
from fivebar_pin.springs import JointSpring, Spring

__all__ = ["joint_springs_to_write", "tendon_lines", "tendon_springs"]

_AUTOMATIC = -1.0
"""MuJoCo's springlength for the length where the springs of all joints are relaxed."""
_NARROW = 0.1
"""Share of the way that a fixed tendon goes within its joints' limits, below which its range ties them [-]."""
_URDF_ONLY = "Save it as URDF only: formats=('urdf',)."


def tendon_springs(
    reader: MjcfReader, root: ElementTree.Element, bodies: BodyTree, model: pin.Model
) -> tuple[Spring | JointSpring, ...]:
    """Return the springs that the tendons of a file are, and note the tendons that nothing acts in or through."""
    springs: list[Spring | JointSpring] = []
    used = {user.get(word) for user in root.iter() for word in ("tendon", "tendon1", "tendon2")}
    for k, element in enumerate(root.findall("tendon/*")):
        where = f"{element.tag} {element.get('name', str(k))!r}"
        if element.tag not in ("fixed", "spatial"):
            raise reader.fail(where, str(UnknownNameError("tendon", element.tag, ("fixed", "spatial"))))
        full = reader.with_defaults(element, None)
        _check_spring_alone(reader, bodies, element, full, where)
        (stiffness,), (damping,) = (reader.numbers(full, w, 1, where, [0.0]) for w in ("stiffness", "damping"))
        if not stiffness and not damping:
            if element.get("name", "") not in used and not bodies.limited(full, "limited", "range", where):
                reader.left_out.append("idle tendon")
            continue
        length = _stated_length(reader, full, where)
        try:
            if element.tag == "spatial":
                ends = _sites(reader, element, bodies, where)
                relaxed = _relaxed_length(model, bodies.rests, ends) if length == _AUTOMATIC else length
                springs.append(Spring(*ends, stiffness, relaxed, damping))
            else:
                joint, r = _only_joint(reader, element, bodies, where)
                rest = bodies.rests[joint] if length == _AUTOMATIC else length / r
                springs.append(JointSpring(joint, r * r * stiffness, rest, r * r * damping))
        except FileFormatError:
            raise
        except FiveBarPinError as error:
            raise reader.fail(where, str(error)) from error
    return tuple(springs)


def joint_springs_to_write(chain: ClosedChain) -> dict[str, JointSpring]:
    """Return the springs on joints by joint.

    Raises:
        InvalidInputError: two on one joint, or one on a joint that does not count its turns, which MJCF cannot say.
    """
    springs = [s for s in chain.springs if isinstance(s, JointSpring)]
    for joint, count in Counter(s.joint for s in springs).items():
        if count > 1:
            raise InvalidInputError(f"springs on joint {joint}", count, "must be at most one in MJCF", _URDF_ONLY)
        model: pin.Model = chain.model
        if model.nqs[model.getJointId(joint)] == 2:
            rule = "has no word in MJCF, whose hinges count their turns"
            raise InvalidInputError(f"spring on joint {joint}", "continuous", rule, _URDF_ONLY)
    return {s.joint: s for s in springs}


def tendon_lines(chain: ClosedChain, site: Callable[[str], str]) -> list[str]:
    """Return the tendons that the chain's springs between frames are; `site` makes a site of a frame."""
    lines = []
    for spring in chain.springs:
        if isinstance(spring, Spring):
            words = f'stiffness="{numbers([spring.stiffness])}" springlength="{numbers([spring.length])}"'
            if spring.damping:
                words += f' damping="{numbers([spring.damping])}"'
            ends = "".join(f"<site site={quoted(site(f))}/>" for f in (spring.frame1, spring.frame2))
            lines.append(f"    <spatial {words}>{ends}</spatial>")
    return lines


def _check_spring_alone(
    reader: MjcfReader, bodies: BodyTree, element: ElementTree.Element, full: ElementTree.Element, where: str
) -> None:
    """Refuse whatever else than a spring and a damper acts in a tendon.

    A wide range of a fixed one bounds its joints as their own limits do, and is noted; a narrow one ties them.
    """
    if bodies.limited(full, "limited", "range", where):
        low, high = reader.numbers(full, "range", 2, where, None)
        if element.tag != "fixed" or not high - low > _NARROW * _reach(reader, bodies, element, where):
            raise reader.fail(
                where, "range: limits that tie bodies are not supported; remove it, or state an <equality>"
            )
        reader.left_out.append(f"range of {where}")
    for word in ("frictionloss", "armature", "springyield"):
        if reader.numbers(full, word, 1, where, [0.0])[0]:
            raise reader.fail(where, f"{word} of tendons is not supported; remove it")
    if bodies.limited(full, "actuatorfrclimited", "actuatorfrcrange", where):
        reader.left_out.append(f"actuatorfrcrange of {where}")


def _reach(reader: MjcfReader, bodies: BodyTree, element: ElementTree.Element, where: str) -> float:
    """Return how far the length of a fixed tendon goes within the limits of its joints."""
    reach = 0.0
    for joint, r in fixed_ratios(reader, bodies, element, where).items():
        data = bodies.joints[joint].data
        reach += abs(r) * (data["upper"][0] - data["lower"][0]) if "upper" in data else np.inf
    return float(reach)


def _only_joint(reader: MjcfReader, element: ElementTree.Element, bodies: BodyTree, where: str) -> tuple[str, float]:
    """Return the joint of a fixed tendon and its coefficient."""
    ratios = {joint: r for joint, r in fixed_ratios(reader, bodies, element, where).items() if r}
    if len(ratios) != 1:
        rule = f"stiffness and damping across {len(ratios)} joints are not supported; state them at the joints"
        raise reader.fail(where, rule)
    ((joint, r),) = ratios.items()
    if joint not in bodies.rests:
        raise reader.fail(where, f"is a spring on {joint!r}, which has several degrees of freedom")
    return joint, r


def _sites(reader: MjcfReader, element: ElementTree.Element, bodies: BodyTree, where: str) -> tuple[str, str]:
    """Return the frames of the two sites that a tendon joins."""
    for child in element:
        if child.tag != "site":
            raise reader.fail(where, f"goes over a <{child.tag}>; a spring joins two sites in a straight line")
    if len(element) != 2:
        raise reader.fail(where, f"goes over {len(element)} sites; a spring joins two")
    names = [reader.text(child, "site", where) for child in element]
    for name in names:
        if name not in bodies.sites:
            raise reader.fail(where, str(UnknownNameError("site", name, bodies.sites)))
    return bodies.sites[names[0]], bodies.sites[names[1]]


def _stated_length(reader: MjcfReader, full: ElementTree.Element, where: str) -> float:
    words = full.get("springlength", str(_AUTOMATIC)).split()
    values = [reader.number(word, "springlength", where) for word in words]
    if len(values) not in (1, 2) or values[0] != values[-1]:
        raise reader.fail(where, f"springlength = {' '.join(words)!r}: a dead band is not supported; state one length")
    return values[0]


def _relaxed_length(model: pin.Model, rests: dict[str, float], ends: tuple[str, str]) -> float:
    """Return the distance of two frames where hinges and slides are at rest, other joints as the file places them."""
    dv, data = np.zeros(model.nv), model.createData()
    for joint, rest in rests.items():
        dv[model.idx_vs[model.getJointId(joint)]] = rest
    pin.framesForwardKinematics(model, data, pin.integrate(model, pin.neutral(model), dv))
    named = frames_by_name(model)
    first, second = (data.oMf[model.getFrameId(end, named[end].type)].translation for end in ends)
    return float(np.linalg.norm(second - first))
