"""From the chain of a sketch to one that is closed at home, and what to say when it cannot be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain
from fivebar_pin.diagnosis import Actuation, Diagnosis, diagnose
from fivebar_pin.errors import AssemblyError, InvalidInputError, SingularityError
from fivebar_pin.kinematics import assemble, closure_residual
from fivebar_pin.mechanism.closing import CLOSED
from fivebar_pin.planar._build import HOME
from fivebar_pin.planar._parts import GROUND, Link

__all__ = ["closed_at_home"]

_SETS = 4
"""How many sets of motors an error proposes."""


def closed_at_home(chain: ClosedChain, links: Mapping[str, Link]) -> ClosedChain:
    """Return the chain with its configuration "home" closed: with the motors where they are, as far as that goes.

    Args:
        chain: as it lies in the sketch.
        links: that it is made of, by name.

    Raises:
        AssemblyError: the lengths do not close; names the point that stays open.
        InvalidInputError: the motors are not as many as the mobility, or do not determine the motion.
    """
    home = chain.references[HOME]
    found = diagnose(chain, home)
    _check_closed(chain, found)
    _check_motors(chain, found, links)
    model = chain.model.copy()
    model.referenceConfigurations[HOME] = _closed(chain, home, found)
    return replace(chain, model=model)


def _check_closed(chain: ClosedChain, found: Diagnosis) -> None:
    if not chain.closures:
        return
    gaps = np.abs(closure_residual(chain, found.q))
    if gaps.max() <= CLOSED * max(1.0, chain.length):
        return
    rows = [closure.name for closure in chain.closures for _ in closure.row_names]
    worst = rows[int(np.argmax(gaps))]
    raise AssemblyError(
        f"The lengths of {chain.name} do not close: at point {worst} the bars stay {gaps.max():.3g} m "
        "apart at best. Change a length, or sketch the points nearer to how they are to lie.",
        closure=worst,
        residual=float(gaps.max()),
    )


def _check_motors(chain: ClosedChain, found: Diagnosis, links: Mapping[str, Link]) -> None:
    mobility = found.generic_mobility
    if mobility <= 0:
        raise InvalidInputError(
            f"mobility of {chain.name}", mobility, "leaves nothing to drive: it is a structure", "Take a bar out."
        )
    if mobility == chain.na and found.actuation is Actuation.EXACT:
        return
    sets = [" and ".join(_words(chain, links, joint) for joint in s.joints) for s in found.actuated_sets[:_SETS]]
    could = f"Drive {'; or '.join(sets)}." if sets else ""
    if mobility != chain.na:
        rule = f"must be {mobility}: that is the mobility of {chain.name}"
        raise InvalidInputError("number of motors", chain.na, rule, could)
    free = ", ".join(found.undetermined)
    raise InvalidInputError("motors", chain.actuated, f"do not determine the motion: they leave {free} free", could)


def _words(chain: ClosedChain, links: Mapping[str, Link], joint: str) -> str:
    """Return a joint in the words of a motor: `crank at A`, or the name alone of a slide."""
    model, link = chain.model, links.get(joint)
    j = model.parents[model.getJointId(joint)]
    parent = links.get(str(model.names[j]) if j else GROUND)
    if link is None or parent is None or (link.guide is not None and link.guide.on == parent.name):
        return joint
    shared = [point for point in link.points if point in parent.points]
    return f"{joint} at {shared[0]}" if shared else joint


def _closed(chain: ClosedChain, home: Array, found: Diagnosis) -> Array:
    """Return home closed: as it is, with the motors held there, or else as near as it comes."""
    if not chain.closures or np.abs(closure_residual(chain, home)).max() <= CLOSED:
        return home
    try:
        return assemble(chain, home[chain.actuated_index], near=home)
    except (AssemblyError, SingularityError):
        return found.q
