"""Plots of motions and loads, one or several mechanisms in the same axes.

They stand for the figures 5 to 12 of the paper: input motions (5, 6), driving torques of the links 1 and 4 (7, 8 and
10, 11), shaking force components (9, 12). Every function returns a `matplotlib` figure of its own and leaves the
global state of pyplot alone.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, figures, integer, settled
from fivebar_pin._files import write_set
from fivebar_pin.errors import InvalidInputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fivebar_pin.dynamics import Loads
    from fivebar_pin.motion import Motion

__all__ = ["com", "forces", "frame", "motion", "png", "save", "shaking", "torques"]

_T = TypeVar("_T")

_VISIBLE = 1e-9
"""Share of the largest component below which another one cannot be seen [-]."""
_MOST_DPI = 1000
"""More makes pictures larger than can be drawn [dots per inch]."""

_STYLES = (
    ("#D55E00", "-", 2.0),
    ("#0072B2", "--", 2.0),
    ("#009E73", "-.", 2.0),
    ("#CC79A7", ":", 2.4),
    ("#56B4E9", "-", 1.4),
    ("#000000", "--", 1.4),
)
"""Colour, dash and width of each mechanism in turn: told apart by colour (any colour vision) and in grey."""


def motion(motion: Motion, names: Sequence[str], *, unit: str = "rad", title: str = "Input motion") -> Figure:
    """Plot position, velocity and acceleration of the actuated coordinates over time.

    Args:
        motion: the motion.
        names: name of each coordinate, in their order.
        unit: unit of the coordinates; "m" for slides, "rad or m" where both occur.
        title: what the figure is called.
    """
    _check_names(names, motion.na)
    rates = (unit, f"({unit})/s", f"({unit})/s²") if " " in unit else (unit, f"{unit}/s", f"{unit}/s²")
    words = ("position", "velocity", "acceleration")
    rows = [(f"{w} [{u}]", x) for w, u, x in zip(words, rates, (motion.q, motion.v, motion.a), strict=True)]
    figure, axes = _sheet(3, 1, title, height=7.0)
    for ax, (what, values) in zip(axes, rows, strict=True):
        for k, name in enumerate(names):
            _draw(ax, motion.t, values[:, k], name, k)
        ax.set_ylabel(what)
    axes[-1].set_xlabel("time [s]")
    axes[0].legend(loc="best")
    return figure


def torques(
    loads: Mapping[str, Loads],
    names: Sequence[str],
    *,
    t: npt.ArrayLike,
    unit: str = "N m",
    title: str = "Driving torques",
) -> Figure:
    """Plot the driving torque of each actuated joint over time, one mechanism over the other.

    Args:
        loads: loads of each mechanism, by label.
        names: name of each actuated joint, in their order.
        t: times (n,) [s].
        unit: unit of the torques; "N" for slides.
        title: what the figure is called.
    """
    series = _series("torque", loads, lambda one: one.torque, t, (len(names),))
    panels = [f"torque at {name} [{unit}]" for name in names]
    return _over_time(title, panels, series, t, [_scale("torque", loads)] * len(panels))


def shaking(loads: Mapping[str, Loads], *, t: npt.ArrayLike, title: str = "Shaking force and moment") -> Figure:
    """Plot the shaking force on the frame and the shaking moment over time, components that vanish left out.

    Args:
        loads: loads of each mechanism, by label.
        t: times (n,) [s].
        title: what the figure is called.
    """
    return _on_frame("shaking", loads, t, title)


def frame(loads: Mapping[str, Loads], *, t: npt.ArrayLike, title: str = "What the frame carries") -> Figure:
    """Plot the frame force and moment, weight and applied forces among them, over time; arguments as for `shaking`."""
    return _on_frame("frame", loads, t, title)


def _on_frame(what: str, loads: Mapping[str, Loads], t: npt.ArrayLike, title: str) -> Figure:
    panels, columns, scales = [], [], []
    for word, unit in (("force", "N"), ("moment", "N m")):
        name = f"{what}_{word}"
        series = _series(name, loads, attrgetter(name), t, (3,))
        scale = _scale(name, loads)
        for axis in _present(series, scale):
            panels.append(f"{what} {word} {'xyz'[axis]} [{unit}]")
            columns.append({label: values[:, axis] for label, values in series.items()})
            scales.append(scale)
    stacked = {label: np.stack([column[label] for column in columns], axis=1) for label in loads}
    return _over_time(title, panels, stacked, t, scales)


def forces(
    forces: Mapping[str, npt.ArrayLike],
    names: Sequence[str],
    *,
    t: npt.ArrayLike,
    title: str = "Joint forces",
) -> Figure:
    """Plot the magnitude of the force in each joint over time.

    Args:
        forces: joint forces (n, joints, 2 or 3) [N] of each mechanism, by label.
        names: name of each joint force, in their order.
        t: times (n,) [s].
        title: what the figure is called.
    """
    n = len(checked("t", t, (None,)))
    series = {}
    for label, values in _some(forces).items():
        vectors = checked(f"forces of {label}", values, (n, len(names), None))
        series[label] = np.linalg.norm(vectors, axis=2)
    largest = max(float(values.max(initial=0.0)) for values in series.values())
    return _over_time(title, [f"|{name}| [N]" for name in names], series, t, [largest] * len(names))


def com(loads: Mapping[str, Loads], *, title: str = "Path of the total mass centre") -> Figure:
    """Plot the path of the total mass centre of each mechanism in the plane of its largest travel.

    A dot marks where it starts; the legend tells the largest distance from there.

    Args:
        loads: loads of each mechanism, by label.
        title: what the figure is called.
    """
    paths = {label: checked(f"com of {label}", one.com, (None, 3)) for label, one in _some(loads).items()}
    travel = np.max([np.ptp(path, axis=0) for path in paths.values()], axis=0)
    i, j = sorted(np.argsort(-travel, kind="stable")[:2])
    figure, (ax,) = _sheet(1, 1, title, height=5.5)
    for k, (label, path) in enumerate(paths.items()):
        colour, dash, width = _STYLES[k % len(_STYLES)]
        words = f"{label}: travel {figures(1e3 * loads[label].peak('travel'), digits=3)} mm"
        ax.plot(1e3 * path[:, i], 1e3 * path[:, j], color=colour, linestyle=dash, linewidth=width, label=words)
        ax.plot(1e3 * path[0, i], 1e3 * path[0, j], marker="o", color=colour, markersize=7, linestyle="none")
    ax.set_xlabel(f"{'xyz'[i]} [mm]")
    ax.set_ylabel(f"{'xyz'[j]} [mm]")
    ax.set_aspect("equal", adjustable="datalim")
    ax.margins(0.15)
    ax.legend(loc="best")
    return figure


def save(figures: Mapping[str, Figure], folder: str | Path, *, overwrite: bool = False, dpi: int = 130) -> list[Path]:
    """Write figures as PNG files into a folder, which is made when missing.

    Args:
        figures: figures by file name, without ending.
        folder: where they go.
        overwrite: whether existing files may be replaced; all are written or, after an error, none.
        dpi: dots per inch.

    Returns:
        The paths, in the order of the figures.

    Raises:
        OutputError: a file exists, or cannot be written.
    """
    return list(write_set(folder, png(figures, dpi=dpi), overwrite=overwrite))


def png(figures: Mapping[str, Figure], *, dpi: int = 130) -> dict[str, bytes]:
    """Return each figure as the content of a PNG file, by file name.

    Args:
        figures: figures by file name, without ending.
        dpi: dots per inch.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    integer("dpi", dpi, least=1, most=_MOST_DPI)
    out = {}
    for name, figure in figures.items():
        FigureCanvasAgg(figure)
        content = io.BytesIO()
        figure.savefig(content, dpi=dpi, format="png")
        out[f"{name}.png"] = content.getvalue()
    return out


def _over_time(
    title: str, panels: Sequence[str], series: Mapping[str, Array], t: npt.ArrayLike, scales: Sequence[float]
) -> Figure:
    """Plot columns of (n, panels) arrays, a panel each, a curve per label; scales tell what is round-off in each."""
    times = checked("t", t, (None,))
    columns = 1 if len(panels) <= 3 else 2
    rows = -(-len(panels) // columns)
    figure, axes = _sheet(rows, columns, title, height=1.2 + 2.2 * rows)
    for k, (ax, panel) in enumerate(zip(axes, panels, strict=False)):
        for number, (label, values) in enumerate(series.items()):
            _draw(ax, times, values[:, k], label, number)
        ax.set_ylabel(panel)
        _show_round_off(ax, [values[:, k] for values in series.values()], scales[k])
    for ax in axes[len(panels) :]:
        ax.set_visible(False)
    for ax in axes[max(len(panels) - columns, 0) : len(panels)]:
        ax.set_xlabel("time [s]")
        ax.tick_params(labelbottom=True)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    return figure


def _show_round_off(ax: Axes, curves: Sequence[Array], scale: float) -> None:
    """Keep an axis of nothing but zeros from being blown up."""
    largest = max(float(np.max(np.abs(c))) for c in curves)
    if settled(largest, scale) == 0.0:
        ax.set_ylim(-1.0, 1.0)


def _figure_class() -> type[Figure]:
    """Return matplotlib's figure; it looks at the environment when it is imported, though no window is needed here."""
    try:
        from matplotlib.figure import Figure
    except ValueError as error:
        name = os.environ.get("MPLBACKEND", "")
        raise InvalidInputError("MPLBACKEND", name, f"matplotlib refuses it ({error})", "Unset it.") from error
    return Figure


def _sheet(rows: int, columns: int, title: str, *, height: float) -> tuple[Figure, list[Axes]]:
    figure = _figure_class()(figsize=(7.5 if columns == 1 else 10.0, height), layout="constrained")
    grid = figure.subplots(rows, columns, sharex=True, squeeze=False)
    figure.suptitle(title, fontweight="bold")
    axes = list(grid.flat)
    for ax in axes:
        ax.grid(True, color="0.88", linewidth=0.8)
        ax.spines[["top", "right"]].set_visible(False)
    return figure, axes


def _draw(ax: Axes, t: Array, values: Array, label: str, number: int) -> None:
    colour, dash, width = _STYLES[number % len(_STYLES)]
    marker = "o" if len(t) == 1 else None  # a line of one point cannot be seen
    ax.plot(t, values, color=colour, linestyle=dash, linewidth=width, marker=marker, label=label)


def _series(
    name: str, loads: Mapping[str, Loads], pick: Callable[[Loads], Array], t: npt.ArrayLike, tail: tuple[int, ...]
) -> dict[str, Array]:
    n = len(checked("t", t, (None,)))
    return {label: checked(f"{name} of {label}", pick(one), (n, *tail)) for label, one in _some(loads).items()}


def _scale(name: str, loads: Mapping[str, Loads]) -> float:
    """Return the largest sum of the sizes of what adds up to a quantity of any mechanism."""
    return max(one.scale(name) for one in loads.values())


def _present(series: Mapping[str, Array], scale: float) -> list[int]:
    """Return the components that can be seen in any of the mechanisms, beyond round-off; x where none can."""
    peaks = np.max([np.max(np.abs(values), axis=0) for values in series.values()], axis=0)
    seen = [k for k, x in enumerate(peaks) if settled(float(x), scale) and x > _VISIBLE * peaks.max()]
    return seen or [0]


def _some(mapping: Mapping[str, _T]) -> Mapping[str, _T]:
    if not mapping:
        raise InvalidInputError("loads", dict(mapping), "must hold at least one labelled mechanism")
    return mapping


def _check_names(names: Sequence[str], count: int) -> None:
    if len(names) != count:
        raise InvalidInputError("names", list(names), f"must be {count}, one per coordinate")
