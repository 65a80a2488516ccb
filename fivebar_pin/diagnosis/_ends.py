"""Where a loop may have been cut: pairs of frames of an open tree that could be the two sides of one joint."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain, frames_by_name

__all__ = [
    "COINCIDE",
    "NEAR",
    "End",
    "Evidence",
    "Pair",
    "Sight",
    "coinciding_pairs",
    "ends_of",
    "lone_pairs",
    "place_of",
]


COINCIDE = 1e-3
"""Distance up to which two origins count as one: files state lengths to about a thousandth [chain lengths]."""
NEAR = 0.02
"""Distance up to which origins that nearly meet are told of: bars side by side, not in one plane [chain lengths]."""
_ALWAYS = 1e-7
"""Distance below which two origins are one whatever the joints do; round-off only [chain lengths]."""
_PROBES = 3
"""Random configurations at which origins that always coincide show it [-]."""
_MOST_FRAMES = 5000
"""Frames above which coincidences are not looked for: every pair of them is measured [-]."""
_MOST_ENDS = 6
"""Pairs of open ends up to which they are worth telling [-]."""


class Evidence(Enum):
    """What speaks for a closure, the strongest first."""

    GIVEN = "given"
    NAMED = "named as a loop"
    POINT = "one point named on two bodies"
    COINCIDE = "the frames coincide"
    HINGE = "the hinges coincide"
    ENDS = "the only two open ends"


@dataclass(frozen=True, slots=True, eq=False)
class End:
    """A frame that a closure may hold.

    Attributes:
        name: of the frame.
        joint: that carries it.
        placement: of the frame in the joint, homogeneous (4, 4).
        is_marker: it is a link of its own on a fixed joint, put there to name a place.
        is_link: it is a link of its own rather than the frame of a joint.
        is_leaf: no joint hangs on its body.
        hinge: axis of the hinge that its body hangs on, in the axes of the frame, where the hinge is at the frame (3,).
    """

    name: str
    joint: int
    placement: Array
    is_marker: bool
    is_link: bool
    is_leaf: bool
    hinge: Array | None


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """Two ends and why they may belong together."""

    ends: tuple[End, End]
    evidence: Evidence
    label: str = ""


def ends_of(chain: ClosedChain) -> dict[str, End]:
    """Return the frames of links and moving joints by the name that closures know them by."""
    model = chain.model
    carries = {int(parent) for parent in list(model.parents)[1:]}
    fixed = {k for k, f in enumerate(model.frames) if f.type == pin.FrameType.FIXED_JOINT}
    found = {}
    for name, frame in frames_by_name(model).items():
        if frame.type == pin.FrameType.FIXED_JOINT:  # its link is in the same place
            continue
        at = np.array(frame.placement.homogeneous)
        tip = frame.type == pin.FrameType.BODY and frame.parentFrame in fixed and frame.parentFrame != 0
        marker = tip or frame.type == pin.FrameType.OP_FRAME
        j = int(frame.parentJoint)
        link = frame.type != pin.FrameType.JOINT
        found[name] = End(name, j, at, marker, link, j not in carries, _hinge(model, j, at))
    return found


def _hinge(model: pin.Model, j: int, placement: Array) -> Array | None:
    """Return the axis of a body's own hinge, in the axes of a frame of it that lies on the hinge's origin."""
    joint = model.joints[j]
    if not j or joint.nv != 1 or placement[:3, 3].any():
        return None
    data = joint.createData()
    joint.calc(data, pin.neutral(model))
    axis = np.array(data.S, dtype=np.float64).reshape(6)[3:]
    return placement[:3, :3].T @ axis if axis.any() else None


class Sight:
    """The frames of a chain in the world at some configurations.

    Attributes:
        M: pose of each frame at each configuration, (frames, n, 4, 4).
    """

    def __init__(self, chain: ClosedChain, ends: Iterable[End], q: Iterable[Array]) -> None:
        model, data = chain.model, chain.model.createData()
        self.ends = list(ends)
        poses = []
        for one in q:
            pin.forwardKinematics(model, data, np.array(one))
            poses.append([np.array(M.homogeneous) for M in data.oMi])
        self.M = np.array([[pose[end.joint] @ end.placement for pose in poses] for end in self.ends])

    def gaps(self, k: int, others: npt.NDArray[np.intp]) -> Array:
        """Return the distances of the origin of frame k from those of others (others, n) [m]."""
        return np.asarray(np.linalg.norm(self.M[others, :, :3, 3] - self.M[k, :, :3, 3], axis=-1))


def coinciding_pairs(
    chain: ClosedChain, ends: Iterable[End], starts: list[Array], *, within: float = COINCIDE
) -> list[Pair]:
    """Return frames of different bodies that coincide at one of the configurations, but not at every one.

    One of the bodies must carry nothing further, for something ends where a loop is cut, or both frames be markers.
    Trees of more than 5000 frames are not looked at.
    """
    ends = [end for end in ends if end.joint or end.is_marker]
    if len(ends) > _MOST_FRAMES or len(ends) < 2:
        return []
    rng = np.random.default_rng(0)
    neutral = pin.neutral(chain.model)
    probes = [pin.integrate(chain.model, neutral, rng.uniform(-1.0, 1.0, chain.nv)) for _ in range(_PROBES)]
    here, anywhere = Sight(chain, ends, starts), Sight(chain, ends, probes)
    best: dict[tuple[int, int, tuple[float, ...], tuple[float, ...]], Pair] = {}
    for k, end in enumerate(ends):
        others = np.array([i for i in range(k + 1, len(ends)) if ends[i].joint != end.joint], dtype=np.intp)
        if not others.size:
            continue
        near = here.gaps(k, others).min(axis=1) <= within * chain.length
        apart = anywhere.gaps(k, others).max(axis=1) > _ALWAYS * chain.length
        for i in others[near & apart]:
            pair = _met(end, ends[i])
            if pair is None or _is_stack(chain.model, pair):
                continue
            key = (*sorted((end.joint, ends[i].joint)), *sorted((place_of(end), place_of(ends[i]))))
            if key not in best or _rank(pair) < _rank(best[key]):
                best[key] = pair
    return sorted(best.values(), key=_rank)


def _met(one: End, other: End) -> Pair | None:
    """Return a pair of coinciding frames, or nothing where neither body is an end and the frames name no place."""
    if not (one.is_leaf or other.is_leaf or (one.is_marker and other.is_marker)):
        return None
    hinges = [end.hinge is not None for end in (one, other)]
    if not (
        any(hinges) or one.placement[:3, 3].any() or other.placement[:3, 3].any() or one.is_marker or other.is_marker
    ):
        return None  # two slides that start at one place
    return Pair((one, other), Evidence.HINGE if all(hinges) else Evidence.COINCIDE)


def _is_stack(model: pin.Model, pair: Pair) -> bool:
    """Whether two joints of one branch only start at one place, as the three slides of a body that moves freely."""
    low, high = sorted(pair.ends, key=lambda end: end.joint)
    above = high.joint
    while above > low.joint:
        above = int(model.parents[above])
    return above == low.joint and not any(end.placement[:3, 3].any() for end in pair.ends)


def place_of(end: End) -> tuple[float, ...]:
    """Return where an end is on its body, to a micrometre (3,) [m]."""
    return tuple(float(x) for x in np.round(end.placement[:3, 3], 6))


def _rank(pair: Pair) -> tuple[int, int, int, int]:
    """Return a key that sorts coincidences, the most telling first."""
    return (
        list(Evidence).index(pair.evidence),
        -sum(end.is_leaf for end in pair.ends),
        -sum(end.is_marker for end in pair.ends),
        -sum(end.is_link for end in pair.ends),
    )


def lone_pairs(ends: Iterable[End]) -> list[Pair]:
    """Return the pairs of markers at which branches of the tree end; none where they are too many to choose from."""
    tips: dict[tuple[int, tuple[float, ...]], End] = {}
    for end in ends:
        if end.is_marker and end.is_leaf and end.joint:
            tips.setdefault((end.joint, place_of(end)), end)
    pairs = itertools.combinations(tips.values(), 2)
    found = [Pair(pair, Evidence.ENDS) for pair in pairs if pair[0].joint != pair[1].joint]
    return found if len(found) <= _MOST_ENDS else []
