"""The page around a scene: what it says, and its text."""

from __future__ import annotations

import html
import json
import string
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import TYPE_CHECKING, Any

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.chain import find_frame
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.springs import Spring
from fivebar_pin.viz._drawing import COLOURS, LINK_COLOURS, Drawing, body_names, ground_closures, is_counterweight
from fivebar_pin.viz._recording import Colour, Recorder
from fivebar_pin.viz._stage import Stage

if TYPE_CHECKING:
    from fivebar_pin.chain import ClosedChain

__all__ = ["describe", "render"]

_MARGIN = 6.0
"""Room around everything, in radii of the links [-]."""
_MOST_LINKS = 10
"""Links that the legend names; more are counted only."""


def describe(
    recorder: Recorder, names: Sequence[str], drawings: Sequence[Drawing], stage: Stage, *, speed: float
) -> dict[str, Any]:
    """Return all that the page needs to know, as plain data."""
    start = min(float(d.poses.t[0]) for d in drawings)
    duration = max(float(d.poses.t[-1]) for d in drawings) - start
    camera = {
        "direction": [0.0, 0.0, 1.0] if stage.view.planar else [0.55, 0.42, 1.0],
        "outline": [[float(x) for x in stage.seen(point)] for point in stage.outline],
        "margin": stage.scale * max(_MARGIN * d.radius for d in drawings),
    }
    return {
        "commands": recorder.packed(duration=duration / speed),
        "camera": camera,
        "start": start,
        "duration": duration,
        "speed": speed,
        "labels": [_label(*x, stage) for x in zip(names, drawings, stage.boxes, strict=True)],
        "legend": _legend(drawings),
        "notes": _notes(drawings, stage),
    }


def render(title: str, scene: Mapping[str, Any], *, live: bool = False) -> str:
    """Return the whole page, the viewer's own program included."""
    viewer = resources.files("meshcat").joinpath("viewer/dist/main.min.js").read_text(encoding="utf-8")
    try:
        text = json.dumps(scene, allow_nan=False)
    except ValueError as error:
        raise InvalidInputError("scene", float("nan"), "a page shows finite numbers only") from error
    template = resources.files("fivebar_pin.viz").joinpath("page.html").read_text(encoding="utf-8")
    return string.Template(template).substitute(
        title=html.escape(title),
        viewer=viewer.replace("</script", "<\\/script"),
        scene=text.replace("<", "\\u003c"),
        connect="'self'" if live else "'none'",
        live="true" if live else "false",
    )


def _label(name: str, drawing: Drawing, box: Array, stage: Stage) -> dict[str, Any]:
    """Return the words below a mechanism, where they stand, and the forces that run with the time."""
    front = 0.5 * (box[0, 2] + box[1, 2]) if stage.view.planar else box[1, 2]
    below = np.array([0.5 * (box[0, 0] + box[1, 0]), stage.low[1], front])
    label: dict[str, Any] = {"text": name, "at": [float(x) for x in stage.seen(below)], "times": [], "forces": []}
    label["times"] = [float(t) for t in drawing.times]
    for words, force in (("shaking force", drawing.force), ("frame force", drawing.frame_force)):
        if force is not None:
            size = np.linalg.norm(force, axis=1)
            values = [float(f"{x:.4g}") for x in size[drawing.keys]]
            label["forces"].append({"text": words, "values": values, "peak": float(np.max(size))})
    return label


def _legend(drawings: Sequence[Drawing]) -> list[dict[str, str]]:
    """Return the entries of the legend: kind of sign, colour, words."""
    links = sorted(dict.fromkeys(entry for d in drawings for entry in _link_entries(d)))
    entries = [_entry("block", colour, name) for name, colour in links[:_MOST_LINKS]]
    if len(links) > _MOST_LINKS:
        entries.append(_entry("", COLOURS["joint"], f"and {len(links) - _MOST_LINKS} more links"))
    entries += _counterweight_entry(drawings)
    if any(d.chain.closures for d in drawings):
        entries.append(_entry("ring", COLOURS["closure"], "loop closure"))
    if any(isinstance(spring, Spring) for d in drawings for spring in d.chain.springs):
        entries.append(_entry("trace", COLOURS["spring"], "spring"))
    if any(_stands(d.chain) for d in drawings):
        entries.append(_entry("block", COLOURS["ground"], "ground"))
    entries.append(_entry("rim", COLOURS["body com"], "mass centre of a link"))
    if any(len(d.poses.com) for d in drawings):
        entries.append(_entry("trace", COLOURS["com"], "total mass centre and its path"))
    if any(d.force is not None for d in drawings):
        entries.append(_entry("arrow", COLOURS["force"], "shaking force on the frame"))
    return entries


def _stands(chain: ClosedChain) -> bool:
    """Return whether anything but a free-flying base joins the mechanism to the ground."""
    model = chain.model
    held = any(model.parents[j] == 0 and model.nvs[j] < 6 for j in range(1, model.njoints))
    return held or bool(ground_closures(chain))


def _link_entries(drawing: Drawing) -> list[tuple[str, Colour]]:
    """Return name and colour of every link as drawn: of its visuals in their order, dark pins left out."""
    model = drawing.chain.model
    entries = []
    for j, name in enumerate(body_names(drawing.chain), start=1):
        mine = [v for v in drawing.visuals if find_frame(model, v.frame).parentJoint == j]
        visuals = [v for v in mine if not is_counterweight(v)]
        if not visuals:
            entries.append((name, LINK_COLOURS[(j - 1) % len(LINK_COLOURS)]))
        coloured = dict.fromkeys((v.frame, v.rgba) for v in visuals if max(v.rgba[:3]) > 0.3)
        entries += list(coloured or dict.fromkeys((v.frame, v.rgba) for v in visuals))
    return entries


def _counterweight_entry(drawings: Sequence[Drawing]) -> list[dict[str, str]]:
    """Return the entry of all counterweights, which share a colour: on which bodies they are; none without any."""
    weights = [(d.chain, v) for d in drawings for v in d.visuals if is_counterweight(v)]
    if not weights:
        return []
    joints = [(chain, find_frame(chain.model, v.frame).parentJoint) for chain, v in weights]
    bodies = sorted({body_names(chain)[j - 1] for chain, j in joints if j})
    named = ", ".join(bodies) if len(bodies) <= _MOST_LINKS else f"{len(bodies)} links"
    return [_entry("block", weights[0][1].rgba, f"counterweight on {named}")]


def _entry(sign: str, colour: Colour, text: str) -> dict[str, str]:
    r, g, b = (round(255 * min(max(c, 0.0), 1.0)) for c in colour[:3])
    return {"sign": sign, "colour": f"rgb({r}, {g}, {b})", "text": text}


def _notes(drawings: Sequence[Drawing], stage: Stage) -> list[str]:
    """Return the scales of the picture in words."""
    notes = [f"grid {_length(stage.cell)}"]
    forces = [float(np.max(np.linalg.norm(d.force, axis=1))) for d in drawings if d.force is not None]
    if forces and drawings[0].arrow > 0.0:
        notes.append(f"arrow of one grid cell = {stage.cell / drawings[0].arrow:.3g} N, longest {max(forces):.3g} N")
    elif forces:
        notes.append("no arrow: the shaking force is zero to round-off")
    missing = {v.mesh for d in drawings for v in d.chain.visuals} - {v.mesh for d in drawings for v in d.visuals}
    if missing:
        notes.append(f"{len(missing)} mesh file{'s' if len(missing) > 1 else ''} not found, drawn without")
    return notes


def _length(metres: float) -> str:
    """Return a length with the unit that suits it."""
    for unit, factor in (("m", 1.0), ("cm", 1e2), ("mm", 1e3)):
        if metres * factor >= 0.999:
            return f"{metres * factor:g} {unit}"
    return f"{metres:.3g} m"
