"""How MJCF says each kind of closure; `_mjcf_equality` reads it back.

A revolute closure becomes two connects, at the closure's frames and at a second point of the hinge axis; a
<custom><numeric> entry with the axis marks the pair, so that reading gives the one revolute closure back. A coupling of
one or two joints becomes a joint equality, of more joints an equality of a fixed tendon; a distance the equality of a
spatial tendon between two sites.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain, find_frame
from fivebar_pin.closures import Closure, Coupling, Distance, Point, Revolute, Weld
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.io._mjcf_equality import FACTOR, HINGE
from fivebar_pin.io._urdf_text import numbers, quoted

__all__ = ["Writer", "equality_lines"]


class Writer(Protocol):
    """What is written: the chain, its sites, and the lines of two other sections."""

    chain: ClosedChain
    numeric: list[str]
    tendons: list[str]

    def site(self, frame: str) -> str:
        """Return the name of the site of a frame, which is written."""

    def second_site(self, frame: str, offset: Array) -> str:
        """Return the name of a site away from a frame, which is written."""


def equality_lines(writer: Writer, closure: Closure) -> list[str]:
    """Return the lines of the equality section for one closure.

    Raises:
        InvalidInputError: a kind that MJCF has no word for.
    """
    say = _WORDS.get(type(closure))
    if say is None:
        hint = "Save it as URDF only: formats=('urdf',)."
        raise InvalidInputError(f"closure {closure.name}", closure.kind.value, "has no word in MJCF", hint)
    return say(writer, closure)


def _connect(writer: Writer, closure: Point) -> list[str]:
    return [_between("connect", closure.name, [writer.site(name) for name in closure.frames])]


def _weld(writer: Writer, closure: Weld) -> list[str]:
    return [_between("weld", closure.name, [writer.site(name) for name in closure.frames])]


def _hinge(writer: Writer, closure: Revolute) -> list[str]:
    axis, offset = np.asarray(closure.axis), np.eye(4)
    offset[:3, 3] = axis * writer.chain.length
    sites = [writer.site(name) for name in closure.frames]
    seconds = [writer.second_site(name, offset) for name in closure.frames]
    writer.numeric.append(f'    <numeric name={quoted(HINGE + closure.name)} data="{numbers(axis)}"/>')
    return [
        _between("connect", closure.name, sites),
        _between("connect", f"{closure.name} axis", seconds),
    ]


def _rod(writer: Writer, closure: Distance) -> list[str]:
    """Hold a tendon at its length; MuJoCo counts from the length in the file's configuration, all joints at zero."""
    model, sites = writer.chain.model, [writer.site(name) for name in closure.frames]
    data = model.createData()
    pin.forwardKinematics(model, data, pin.neutral(model))
    frames = [find_frame(model, name) for name in closure.frames]
    one, two = (data.oMi[f.parentJoint].act(f.placement.translation) for f in frames)
    longer = float(closure.length or 0.0) - float(np.linalg.norm(two - one))
    name = quoted(closure.name)
    ends = "".join(f"<site site={quoted(site)}/>" for site in sites)
    writer.tendons.append(f"    <spatial name={name}>{ends}</spatial>")
    return [f'    <tendon name={name} tendon1={name} polycoef="{numbers([longer, 0.0, 0.0, 0.0, 0.0])}"/>']


def _coupling(writer: Writer, closure: Coupling) -> list[str]:
    name, joints, offset = quoted(closure.name), list(closure.ratios), closure.offset
    if len(joints) > 2:
        parts = "".join(f'<joint joint={quoted(j)} coef="{numbers([c])}"/>' for j, c in closure.ratios.items())
        writer.tendons.append(f"    <fixed name={name}>{parts}</fixed>")
        return [f'    <tendon name={name} tendon1={name} polycoef="{numbers([offset, 0.0, 0.0, 0.0, 0.0])}"/>']
    first, *rest = closure.ratios.values()
    if first != 1.0:
        writer.numeric.append(f'    <numeric name={quoted(FACTOR + closure.name)} data="{numbers([first])}"/>')
    terms = numbers([offset / first, *[-c / first for c in rest or (0.0,)], 0.0, 0.0, 0.0])
    tied = " ".join(f"joint{k}={quoted(joint)}" for k, joint in enumerate(joints, start=1))
    return [f'    <joint name={name} {tied} polycoef="{terms}"/>']


_WORDS: dict[type[Closure], Callable[[Writer, Any], list[str]]] = {
    Coupling: _coupling,
    Distance: _rod,
    Point: _connect,
    Revolute: _hinge,
    Weld: _weld,
}


def _between(tag: str, name: str, sites: list[str]) -> str:
    return f"    <{tag} name={quoted(name)} site1={quoted(sites[0])} site2={quoted(sites[1])}/>"
