"""Scenes: several moving mechanisms side by side, as one page that plays in any browser without a network."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import ROUND_OFF, Array, checked
from fivebar_pin._files import write_file
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.trajectory import Trajectory
from fivebar_pin.viz._drawing import Drawing, points_reached, safe
from fivebar_pin.viz._geometry import View, compute_poses, find_view
from fivebar_pin.viz._mechanism import draw_mechanism
from fivebar_pin.viz._page import describe, render
from fivebar_pin.viz._recording import Recorder, pose
from fivebar_pin.viz._stage import MECHANISMS, Stage

if TYPE_CHECKING:
    from fivebar_pin.chain import ClosedChain
    from fivebar_pin.dynamics import Loads

__all__ = ["Shown", "html", "page"]

_FRAMES_PER_SECOND = 60.0
_MOST_KEYFRAMES = 3000
_ARROW = 0.3
"""Length of the longest force arrow, as a part of the size of the scene [-]."""


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """One mechanism of a scene.

    Attributes:
        chain: the mechanism.
        trajectory: how it moves; times and configurations are used.
        loads: its loads; the shaking force is drawn as an arrow, and told beside the frame force where weight or
            applied forces act. Without them there is no arrow.
        label: what is written below it; the chain's name unless given.
    """

    chain: ClosedChain
    trajectory: Trajectory
    loads: Loads | None = None
    label: str = ""

    @classmethod
    def at(cls, chain: ClosedChain, q: npt.ArrayLike, *, label: str = "") -> Shown:
        """Return a mechanism that stands still at a configuration q (nq,)."""
        row = checked("q", q, (chain.nq,))[None, :]
        rest = np.zeros((1, chain.nv))
        still = Trajectory(np.zeros(1), row, rest, rest, np.zeros((1, chain.nv, chain.na)), np.zeros(1))
        return cls(chain, still, None, label)


def html(
    path: str | Path,
    shown: Sequence[Shown],
    *,
    speed: float = 1.0,
    title: str = "",
    overwrite: bool = False,
    spheres_by_mass: bool = True,
) -> Path:
    """Write a scene as one HTML file that needs nothing else.

    Args:
        path: the file to write; its folder is made when missing.
        shown: the mechanisms, from left to right; forces share one scale.
        speed: playing speed over real time [-].
        title: title of the page.
        overwrite: whether an existing file may be replaced.
        spheres_by_mass: whether a heavier body has a larger mass-centre mark (with the cube root of its mass).

    Returns:
        The path of the file.

    Raises:
        OutputError: the file exists, or cannot be written.
        InvalidInputError: nothing to show, a trajectory or loads that do not fit the chain, or a speed that is not
            positive.
    """
    text = page(shown, speed=speed, title=title, spheres_by_mass=spheres_by_mass)
    return write_file(path, text, overwrite=overwrite)


def page(
    shown: Sequence[Shown], *, speed: float = 1.0, title: str = "", spheres_by_mass: bool = True, live: bool = False
) -> str:
    """Return the text of the page that `html` writes; live: the page asks its server for news every second."""
    if not shown:
        raise InvalidInputError("shown", list(shown), "must hold at least one mechanism")
    if not (np.isfinite(speed) and speed > 0.0):
        raise InvalidInputError("speed", speed, "must be positive and finite")
    drawings = _drawings(shown, speed, spheres_by_mass)
    stage = Stage.around(drawings)
    names = _unique([s.label or s.chain.name for s in shown])
    recorder = Recorder()
    stage.dress(recorder)
    for name, drawing, shift in zip(names, drawings, stage.shifts, strict=True):
        node = f"{MECHANISMS}/{safe(name)}"
        recorder.place(node, pose(shift))
        draw_mechanism(recorder, node, drawing)
    title = title or ", ".join(dict.fromkeys(s.chain.name for s in shown))
    return render(title, describe(recorder, names, drawings, stage, speed=speed), live=live)


def _drawings(shown: Sequence[Shown], speed: float, spheres_by_mass: bool) -> list[Drawing]:
    """Return what is drawn of each mechanism: one clock, one size and one scale of forces for all."""
    everything = [compute_poses(s.chain, s.trajectory) for s in shown]
    forces = [_force(s, "shaking_force", len(p.t)) for s, p in zip(shown, everything, strict=True)]
    views = [find_view(s.chain, s.trajectory.q[0]) for s in shown]
    view = views[0] if all(v.planar for v in views) else View(views[0].right, views[0].up, planar=False)
    size = max(
        float(np.linalg.norm(np.ptp(points_reached(s.chain, p), axis=0)))
        for s, p in zip(shown, everything, strict=True)
    )
    size = size if size > 0.0 else 1.0
    largest = max((float(np.max(np.linalg.norm(f, axis=1))) for f in forces if f is not None), default=0.0)
    start = min(float(p.t[0]) for p in everything)
    heaviest = max(float(i.mass) for s in shown for i in s.chain.model.inertias) if spheres_by_mass else 0.0
    drawings = []
    for s, poses, force in zip(shown, everything, forces, strict=True):
        keys = _keyframes(poses.t, speed)
        drawings.append(
            Drawing(
                chain=s.chain,
                poses=poses,
                force=force,
                frame_force=_force(s, "frame_force", len(poses.t)) if s.loads is not None and s.loads.loaded else None,
                view=view,
                keys=keys,
                times=(poses.t[keys] - start) / speed,
                arrow=_ARROW * size / largest if largest > 0.0 else 0.0,
                size=size,
                mass_unit=heaviest,
            )
        )
    return drawings


def _force(shown: Shown, name: str, samples: int) -> Array | None:
    """Return a force (n, 3) [N] of the loads by name, zero where it is only round-off; None without loads."""
    if shown.loads is None:
        return None
    force = checked(f"loads.{name}", getattr(shown.loads, name), (samples, 3))
    real = np.linalg.norm(force, axis=1) > ROUND_OFF * shown.loads.scale(name)
    return np.asarray(force * real[:, None])


def _keyframes(t: Array, speed: float) -> npt.NDArray[np.intp]:
    """Return the samples to keep: all, or as many as the screen can show."""
    enough = min(_MOST_KEYFRAMES, 2 + math.ceil(_FRAMES_PER_SECOND * float(t[-1] - t[0]) / speed))
    if len(t) <= enough:
        return np.arange(len(t), dtype=np.intp)
    wanted = np.searchsorted(t, np.linspace(t[0], t[-1], enough))
    return np.unique(np.clip(wanted, 0, len(t) - 1)).astype(np.intp)


def _unique(names: Sequence[str]) -> list[str]:
    """Return the names, numbered where they repeat."""
    return [f"{name} ({names[: k + 1].count(name)})" if names.count(name) > 1 else name for k, name in enumerate(names)]
