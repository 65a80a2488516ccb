"""Draw springs between frames as coils that stretch and turn with their ends."""

from __future__ import annotations

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.springs import Spring
from fivebar_pin.viz._drawing import COLOURS, Drawing, safe
from fivebar_pin.viz._geometry import spring_ends
from fivebar_pin.viz._recording import Recorder, along, pose, quaternions

__all__ = ["draw_springs"]

_TURNS, _AROUND, _SIDES = 9, 14, 6
"""Turns of a coil, points of a turn, and sides of its wire."""
_STRAIGHT = 0.12
"""Part of the length at each end over which the coil opens from its axis [-]."""
_LEAST = 1e-6
"""Stretch of a coil whose ends meet, kept above zero [-]."""


def draw_springs(recorder: Recorder, path: str, drawing: Drawing) -> None:
    """Draw every spring between frames: a coil, and an eye at each end."""
    r = drawing.radius
    for number, spring in enumerate(s for s in drawing.chain.springs if isinstance(s, Spring)):
        first, second = spring_ends(drawing.chain, spring, drawing.poses.joints)
        node, d = f"{path}/spring {number} {safe(spring.name)}", second - first
        lengths = np.linalg.norm(d, axis=1)
        usual = float(lengths.mean()) or r
        recorder.triangles(f"{node}/coil/wire", *_coil(usual, 1.1 * r, 0.22 * r), COLOURS["spring"])
        for end in ("start", "end"):
            recorder.sphere(f"{node}/{end}/eye", 0.5 * r, COLOURS["spring"], np.eye(4))
        directions = np.where(lengths[:, None] > _LEAST * usual, d, drawing.view.up)
        turns = np.array([along(x) for x in directions])
        scale = np.ones_like(d)
        scale[:, 2] = np.maximum(lengths / usual, _LEAST)
        keys = drawing.keys
        coil = pose(first[0])
        coil[:3, :3] = turns[0] * scale[0]
        recorder.place(f"{node}/coil", coil)
        recorder.animate(
            f"{node}/coil", drawing.times, position=first[keys], quaternion=quaternions(turns[keys]), scale=scale[keys]
        )
        for end, points in (("start", first), ("end", second)):
            recorder.place(f"{node}/{end}", pose(points[0]))
            recorder.animate(f"{node}/{end}", drawing.times, position=points[keys])


def _coil(length: float, radius: float, wire: float) -> tuple[Array, Array]:
    """Return vertices (k, 3) and faces of a coil of round wire along z, from 0 to its length."""
    s = np.linspace(0.0, 1.0, _TURNS * _AROUND + 1)
    out = radius * np.minimum(1.0, np.minimum(s, 1.0 - s) / _STRAIGHT)
    angle = 2.0 * np.pi * _TURNS * s
    middle = np.stack([out * np.cos(angle), out * np.sin(angle), length * s], axis=1)
    outward = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(s)], axis=1)
    side = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
    ring = np.cos(side)[:, None, None] * outward + np.sin(side)[:, None, None] * np.array([0.0, 0.0, 1.0])
    vertices = np.swapaxes(middle + wire * ring, 0, 1).reshape(-1, 3)
    k, j = np.meshgrid(np.arange(len(s) - 1), np.arange(_SIDES), indexing="ij")
    a, b = _SIDES * k + j, _SIDES * k + (j + 1) % _SIDES
    c, d = a + _SIDES, b + _SIDES
    return vertices, np.concatenate([np.stack(x, axis=-1).reshape(-1, 3) for x in ((a, b, c), (b, d, c))])
