"""Frames of a mechanism on the links of the engine: their motion, and forces from outside that act at them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain, find_frame
from fivebar_pin.engine.tables import Integers
from fivebar_pin.kinematics import FrameMotion
from fivebar_pin.mechanism.links import bodies_of, links_of

__all__ = ["FrameRoom", "Pushes", "frame_room", "pushes_at"]


@dataclass(frozen=True, slots=True, eq=False)
class Pushes:
    """Room for the wrenches of one sample from outside, as the engine takes them.

    Attributes:
        names: of the frames (k).
        links: that carry them (k,).
        points: their origins, in the axes of the link (k, 3) [m].
        wrenches: (1, k, 6) [N, N m].
    """

    names: tuple[str, ...]
    links: Integers
    points: Array
    wrenches: Array


@dataclass(frozen=True, slots=True, eq=False)
class FrameRoom:
    """Room for the motion of a frame.

    Attributes:
        link: that carries it.
        numbers: see `engine.single.frame` (36,).
        motion: views of them.
    """

    link: int
    numbers: Array
    motion: FrameMotion


def pushes_at(chain: ClosedChain, names: Iterable[str]) -> Pushes:
    """Make room for wrenches at frames."""
    at = [_placed(chain, name) for name in names]
    links = np.array([link for link, _, _ in at], dtype=np.int64)
    points = np.array([p for _, _, p in at]).reshape(-1, 3)
    return Pushes(tuple(names), links, points, np.zeros((1, len(at), 6)))


def frame_room(chain: ClosedChain, name: str) -> FrameRoom:
    """Make room for the motion of a frame.

    Raises:
        UnknownNameError: there is no such frame.
    """
    from fivebar_pin.engine import single

    link, R, p = _placed(chain, name)
    numbers = np.zeros(single.FRAME_SIZE)
    numbers[:9], numbers[9:12] = R.ravel(), p
    starts = {
        "position": single.PLACE,
        "velocity": single.SPEED,
        "acceleration": single.RATE_OF_SPEED,
        "angular_velocity": single.SPIN,
        "angular_acceleration": single.RATE_OF_SPIN,
    }
    views = {word: numbers[k : k + 3] for word, k in starts.items()}
    return FrameRoom(link, numbers, FrameMotion(rotation=numbers[single.AXES : single.PLACE].reshape(3, 3), **views))


def _placed(chain: ClosedChain, name: str) -> tuple[int, Array, Array]:
    """Return the link that carries a frame, and the frame's axes (3, 3) and origin (3,) on it.

    Raises:
        UnknownNameError: there is no such frame.
    """
    found = find_frame(chain.model, name)
    link, axes = bodies_of(links_of(chain.model))[int(found.parentJoint)]
    return link, axes.T @ np.array(found.placement.rotation), axes.T @ np.array(found.placement.translation)
