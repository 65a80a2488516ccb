"""How counterweights are drawn: the pieces and their arms, on frames of the bodies that carry them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin

from fivebar_pin.balancing.counterweights import COLOUR, Counterweight
from fivebar_pin.balancing.parameters import plane_axes
from fivebar_pin.balancing.pieces.piece import SHAPES
from fivebar_pin.chain import ClosedChain, Visual

__all__ = ["visuals", "with_frames"]


def _frame_of(chain: ClosedChain, joint: str) -> pin.Frame | None:
    index = chain.model.getJointId(joint)
    return next((f for f in chain.model.frames if f.parentJoint == index), None)


def with_frames(chain: ClosedChain, joints: list[str]) -> ClosedChain:
    """Give the named bodies a frame to draw on where they have none."""
    bare = [j for j in joints if _frame_of(chain, j) is None]
    if not bare:
        return chain
    model = chain.model.copy()
    for j in bare:
        frame = pin.Frame(f"{j}_counterweight", model.getJointId(j), 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME)
        model.addFrame(frame)
    return replace(chain, model=model)


def visuals(chain: ClosedChain, w: Counterweight) -> list[Visual]:
    """Return the piece, and its arm up to the rim."""
    frame = _frame_of(chain, w.body)
    assert frame is not None
    into = np.asarray(frame.placement.inverse().homogeneous)
    kind = SHAPES[w.shape]
    out = [Visual(frame.name, *kind.visual(w.size), into @ w.pose, COLOUR)]
    if w.arm is not None:
        x = w.arm.place - w.pose[:3, 2] * float(w.pose[:3, 2] @ w.arm.place) if kind.flat else w.arm.place
        x = x / np.linalg.norm(x)
        z = w.pose[:3, 2] if kind.flat else plane_axes(x)[0]
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = np.column_stack([x, np.cross(z, x), z]), w.arm.place
        out.append(Visual(frame.name, "box", w.arm_size, into @ pose, COLOUR))
    return out
