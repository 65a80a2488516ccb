"""What the compiler element of an MJCF file does to masses: least ones, balanced moments of inertia, the total.

boundmass, boundinertia   every body has at least this mass [kg] and these principal moments [kg m2]
balanceinertia            principal moments with A + B < C become their mean, thrice
settotalmass              then all masses and inertias are scaled to this sum [kg]
"""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from fivebar_pin.io._build import bare_inertia
from fivebar_pin.io._mjcf_reader import MjcfReader
from fivebar_pin.io._mjcf_tree import WORLD, BodyTree

__all__ = ["adjust_masses"]


def adjust_masses(reader: MjcfReader, bodies: BodyTree) -> None:
    """Adjust the inertias of all bodies as the compiler element says."""
    compiler = ElementTree.Element("compiler", reader.compiler)
    (least,), (moment,), (total,) = (
        reader.numbers(compiler, word, 1, "<compiler>", [default])
        for word, default in (("boundmass", 0.0), ("boundinertia", 0.0), ("settotalmass", -1.0))
    )
    balance = reader.flag(compiler, "balanceinertia", "<compiler>", "false") == "true"
    links = [link for link in bodies.bodies.values() if link != WORLD]
    if least or moment or balance:
        for link in links:
            inertia = bodies.links[link].inertia or bare_inertia(0.0, bodies.places[link][:3, 3], np.zeros((3, 3)))
            bodies.links[link] = replace(bodies.links[link], inertia=_bounded(inertia, least, moment, balance))
    if total > 0.0:
        inertias = {link: bodies.links[link].inertia or pin.Inertia.Zero() for link in links}
        factor = total / sum(inertia.mass for inertia in inertias.values())
        for link, inertia in inertias.items():
            if inertia.mass:
                scaled = bare_inertia(factor * inertia.mass, inertia.lever, factor * np.array(inertia.inertia))
                bodies.links[link] = replace(bodies.links[link], inertia=scaled)


def _bounded(inertia: pin.Inertia, least: float, moment: float, balance: bool) -> pin.Inertia | None:
    moments, R = np.linalg.eigh(np.array(inertia.inertia))
    moments = np.maximum(moments, moment)
    if balance and moments[0] + moments[1] < moments[2]:
        moments[:] = moments.mean()
    mass = max(inertia.mass, least)
    return bare_inertia(mass, inertia.lever, R * moments @ R.T) if mass or moments.any() else None
