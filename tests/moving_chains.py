"""Mechanisms in motion, bare or with everything that can act on them, for tests of forces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
from mechanisms import (
    TILTED,
    bennett,
    double_four_bar,
    five_bar,
    rscr,
    rssr,
    scapula,
    slider_crank,
    welded_four_bar,
)
from tied_chains import EXAMPLES

import fivebar_pin as fb
from fivebar_pin import JointSpring, Spring
from fivebar_pin.cli._moving import sway

GRAVITY = (0.4, -9.81, 0.7)
BUILT = {
    "five-bar, tilted, hinge closure": lambda: (five_bar(base=TILTED, kind="revolute"), None),
    "four-bar, welded": lambda: (welded_four_bar(base=TILTED), None),
    "slider-crank": lambda: (slider_crank(base=TILTED), None),
    "RSSR": lambda: (rssr(base=TILTED), None),
    "RSCR": rscr,
    "plate on an ellipsoid": lambda: scapula(base=TILTED),
    "Bennett": bennett,
    "double four-bar": lambda: (double_four_bar(), np.array([1.4, 1.4, -1.4, -1.4, 1.4])),
    **EXAMPLES,
}


def shipped(name: str) -> tuple[fb.ClosedChain, np.ndarray]:
    chain = fb.load(fb.io.shipped_path(name))
    return chain, chain.references["home"]


def loaded(chain: fb.ClosedChain) -> fb.ClosedChain:
    """Return the chain under a tilted gravity, with armature, damping and friction in every joint, and with springs."""
    model = chain.model.copy()
    model.gravity.linear = np.array(GRAVITY)
    model.armature, model.damping = np.linspace(0.1, 0.3, model.nv), np.linspace(0.2, 0.5, model.nv)
    model.upperDryFrictionLimit = np.linspace(0.3, 0.7, model.nv)
    model.lowerDryFrictionLimit = -model.upperDryFrictionLimit
    model.addFrame(pin.Frame("hook", 0, 0, pin.SE3(np.eye(3), np.array([0.3, 2.0, 0.4])), pin.FrameType.OP_FRAME))
    where = pin.SE3(np.eye(3), np.array([0.1, 0.2, 0.3]))
    model.addFrame(pin.Frame("eye", model.njoints - 1, 0, where, pin.FrameType.OP_FRAME))
    simple = [model.names[j] for j in range(1, model.njoints) if model.nvs[j] == 1]
    springs = [Spring("hook", "eye", 40.0, 0.2, 3.0), *(JointSpring(name, 7.0, 0.4, 0.6) for name in simple[:2])]
    return replace(chain, model=model, springs=tuple(springs))


def pushed(chain: fb.ClosedChain) -> dict[str, np.ndarray]:
    """Return forces from outside on the ground, and on a point of every other body."""
    names = {int(f.parentJoint): f.name for f in chain.model.frames}
    return {names[j]: np.cos(np.arange(6.0) + j) for j in names if j % 2 == 0}


NAMES = [*fb.io.shipped(), *BUILT]


def moving(name: str, samples: int = 12) -> tuple[fb.ClosedChain, fb.Trajectory]:
    """Return a mechanism that swings."""
    chain, near = BUILT[name]() if name in BUILT else shipped(name)
    near = fb.diagnose(chain).q if near is None else near
    path = sway(chain, near, samples=samples)
    assert path is not None
    return chain, path
