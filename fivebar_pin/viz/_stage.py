"""The stage: mechanisms in a row, a grid behind or below them, light, and what the camera has to hold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.viz._drawing import Drawing, amid_ground, points_reached
from fivebar_pin.viz._geometry import View
from fivebar_pin.viz._recording import Colour, Recorder

__all__ = ["MECHANISMS", "Stage"]

MECHANISMS = "/mechanisms"
"""Scene node of the mechanisms: below it everything is in metres and world axes."""

_ROUND = 1e-9  # a number this little above a round one is that [of the number]
_GRID = "/surroundings/grid"
_GRID_COLOUR: Colour = (0.84, 0.86, 0.89, 1.0)
_MARGIN = 6.0
"""Room around a mechanism, in radii of its links [-]."""
_SIZE = 2.0
"""Size of the scene in the viewer's own units, which suit its lights and its camera."""


@dataclass(frozen=True, slots=True, eq=False)
class Stage:
    """Where things stand.

    Attributes:
        view: axes of the picture.
        boxes: extent of each mechanism once shifted, lower and upper corner along right, up, normal (k, 2, 3) [m].
        shifts: shift of each mechanism from its own place (k, 3), world axes [m].
        cell: edge of a grid cell [m].
        outline: points (k, 3) along right, up, normal that the picture has to hold [m].
    """

    view: View
    boxes: Array
    shifts: Array
    cell: float
    outline: Array

    @classmethod
    def around(cls, drawings: Sequence[Drawing]) -> Stage:
        """Return the stage that holds all mechanisms in a row from left to right, a gap between neighbours.

        Shifts are whole grid cells, so that the grid means the same for each of them.
        """
        view = drawings[0].view
        outlines = [_outline(d) for d in drawings]
        margins = [_MARGIN * d.radius for d in drawings]
        boxes = np.array([(o.min(axis=0) - m, o.max(axis=0) + m) for o, m in zip(outlines, margins, strict=True)])
        cell = _round_number(0.08 * float(np.max(boxes[:, 1] - boxes[:, 0])))
        steps = np.zeros(len(drawings))
        for k in range(1, len(drawings)):
            gap = 0.1 * float(np.max(boxes[:, 1, 0] - boxes[:, 0, 0]))
            wanted = boxes[k - 1, 1, 0] + gap - boxes[k, 0, 0]
            steps[k] = cell * np.ceil(wanted / cell)
            boxes[k, :, 0] += steps[k]
        outline = np.concatenate([o + np.array([step, 0.0, 0.0]) for o, step in zip(outlines, steps, strict=True)])
        return cls(view, boxes, steps[:, None] * view.right, cell, outline)

    @property
    def axes(self) -> Array:
        """Rows right, up and normal (3, 3)."""
        return np.array([self.view.right, self.view.up, self.view.normal])

    @property
    def low(self) -> Array:
        """Lowest corner of everything along right, up, normal (3,) [m]."""
        return np.asarray(self.boxes[:, 0].min(axis=0))

    @property
    def high(self) -> Array:
        """Highest corner of everything along right, up, normal (3,) [m]."""
        return np.asarray(self.boxes[:, 1].max(axis=0))

    @property
    def scale(self) -> float:
        """Viewer units per metre."""
        return _SIZE / float(np.max(self.high - self.low))

    def seen(self, point: Array) -> Array:
        """Return where a point (3,) along right, up, normal [m] is on the stage, in viewer units."""
        return np.asarray(self.scale * (point - 0.5 * (self.low + self.high)))

    def dress(self, recorder: Recorder) -> None:
        """Set background, light and grid, and the pose of everything: the picture's axes onto the viewer's."""
        recorder.hide("/Axes")
        recorder.hide("/Grid")
        recorder.set("/Background", "top_color", [0.97, 0.98, 1.0])
        recorder.set("/Background", "bottom_color", [0.97, 0.98, 1.0])
        recorder.set("/Lights/AmbientLight/<object>", "intensity", 0.55)
        # The viewer's axes are x to the right, z up, and y away from the camera.
        turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
        matrix = np.eye(4)
        matrix[:3, :3] = self.scale * turn @ self.axes
        matrix[:3, 3] = -self.scale * turn @ (0.5 * (self.low + self.high))
        recorder.place(MECHANISMS, matrix)
        recorder.place(_GRID, matrix)
        recorder.line(f"{_GRID}/lines", self._grid() @ self.axes, _GRID_COLOUR, pairs=True)

    def _grid(self) -> Array:
        """Return the ends (2 k, 3) of the grid lines along right, up, normal: a wall behind, or a floor below."""
        low, high, across = self.low - self.cell, self.high + self.cell, 1 if self.view.planar else 2
        first, last = np.floor(low / self.cell), np.ceil(high / self.cell)
        depth = 3 - across  # the remaining of up and normal
        ends = []
        for axis, other in ((0, across), (across, 0)):
            for number in np.arange(first[axis], last[axis] + 1.0):
                for end in (first[other], last[other]):
                    point = np.empty(3)
                    point[axis], point[other] = self.cell * number, self.cell * end
                    point[depth] = self.low[depth]
                    ends.append(point)
        return np.array(ends)


def _outline(drawing: Drawing) -> Array:
    """Return the outermost points (k, 3) that a mechanism passes, along right, up, normal; its arrow included."""
    view = drawing.view
    points = points_reached(drawing.chain, drawing.poses)
    if drawing.force is not None:
        points = np.concatenate([points, amid_ground(drawing.chain) + drawing.arrow * drawing.force])
    points = points @ np.array([view.right, view.up, view.normal]).T
    directions = np.random.default_rng(0).normal(size=(64, 3))
    directions = np.concatenate([directions, np.eye(3), -np.eye(3)])
    return np.asarray(points[np.unique(np.argmax(directions @ points.T, axis=1))])


def _round_number(x: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that is not above x."""
    power = 10.0 ** np.floor(np.log10(x))
    return float(power * max(m for m in (1.0, 2.0, 5.0) if m * power <= x * (1.0 + _ROUND)))
