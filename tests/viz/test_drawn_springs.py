"""Springs in the page: a coil between two frames that stretches and turns with them."""

from __future__ import annotations

import mechanisms
import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

import fivebar_pin as fb
from fivebar_pin import JointSpring, Spring, viz
from fivebar_pin import motion as laws
from fivebar_pin._arrays import Array
from fivebar_pin.viz import scene
from fivebar_pin.viz._springs import draw_springs

ENDS = ("universe", "right_elbow_body")


class Notes:
    """Takes a recorder's place and keeps what is drawn and how it moves."""

    def __init__(self) -> None:
        self.drawn: dict[str, Array] = {}
        self.moved: dict[str, dict[str, Array]] = {}

    def triangles(self, path: str, vertices: Array, faces: Array, colour: object) -> None:
        assert faces.min() == 0 and faces.max() == len(vertices) - 1
        self.drawn[path] = vertices

    def sphere(self, path: str, radius: float, colour: object, matrix: Array) -> None:
        self.drawn[path] = matrix[:3, 3]

    def place(self, path: str, matrix: Array) -> None:
        assert np.isfinite(matrix).all()

    def animate(self, path: str, times: Array, **tracks: Array) -> None:
        assert all(len(x) == len(times) and np.isfinite(x).all() for x in tracks.values())
        self.moved[path] = tracks


def shown(*springs: Spring | JointSpring) -> viz.Shown:
    chain = mechanisms.five_bar(base=mechanisms.TILTED).with_springs(springs)
    t = np.linspace(0.0, 1.0, 25)
    motion = laws.combine(laws.harmonic(t, 2.0, 0.3, period=1.0), laws.harmonic(t, 1.0, 0.2, period=1.0))
    return viz.Shown(chain, fb.drive(chain, motion))


def test_the_coil_and_its_eyes_move_with_the_two_frames() -> None:
    what = shown(Spring(*ENDS, 10.0, 0.1), JointSpring("left", 1.0, 0.0))
    notes, chain = Notes(), what.chain
    draw_springs(notes, "/m", scene._drawings([what], 1.0, True)[0])  # type: ignore[arg-type]
    node = "/m/spring 0 universe~right_elbow_body"
    assert set(notes.moved) == {f"{node}/{part}" for part in ("coil", "start", "end")}
    data, points = chain.model.createData(), []
    for q in what.trajectory.q:
        pin.framesForwardKinematics(chain.model, data, q)
        points.append([data.oMf[chain.model.getFrameId(f)].translation.copy() for f in ENDS])
    first, second = np.swapaxes(points, 0, 1)
    assert np.ptp(np.linalg.norm(second - first, axis=1)) > 0.01
    for part, end in (("start", first), ("end", second)):
        np.testing.assert_allclose(notes.moved[f"{node}/{part}"]["position"], end, atol=1e-13)
    coil, wire = notes.moved[f"{node}/coil"], notes.drawn[f"{node}/coil/wire"]
    turn = Rotation.from_quat(coil["quaternion"])
    length = wire[:, 2].max() + wire[:, 2].min()  # the wire is as thick at both ends
    tip = coil["position"] + turn.apply(coil["scale"] * [0.0, 0.0, length])
    np.testing.assert_allclose(coil["position"], first, atol=1e-13)
    np.testing.assert_allclose(tip, second, atol=1e-12)


def test_a_spring_whose_ends_meet_is_drawn_all_the_same() -> None:
    notes = Notes()
    what = shown(Spring("tip_left", "tip_right", 10.0, 0.0))
    draw_springs(notes, "/m", scene._drawings([what], 1.0, True)[0])  # type: ignore[arg-type]
    assert notes.moved["/m/spring 0 tip_left~tip_right/coil"]["scale"].min() > 0.0


@pytest.mark.parametrize("springs", [(), (JointSpring("left", 1.0, 0.0),), (Spring(*ENDS, 10.0, 0.1),)])
def test_the_legend_names_springs_where_some_are_drawn(springs: tuple[Spring | JointSpring, ...]) -> None:
    assert ('"spring"' in viz.page([shown(*springs)])) == any(isinstance(s, Spring) for s in springs)


def test_the_picture_holds_the_ends_of_springs() -> None:
    """A spring that is anchored far away makes the scene larger."""
    small, large = shown(), shown(Spring(*ENDS, 10.0, 0.1))
    model = large.chain.model.copy()
    mechanisms.point(model, 0, "far", mechanisms.at(9.0))
    far = fb.ClosedChain(model, large.chain.closures, large.chain.actuated, springs=[Spring("far", ENDS[1], 1.0, 0.0)])
    sizes = [scene._drawings([s], 1.0, True)[0].size for s in (small, viz.Shown(far, large.trajectory))]
    assert sizes[1] > sizes[0] + 5.0


def test_a_spring_whose_ends_never_part_is_drawn_all_the_same() -> None:
    model = pin.Model()
    mechanisms.add(model, 0, pin.JointModelRZ(), mechanisms.at(), "hinge", mechanisms.body(1))
    chain = fb.ClosedChain(model, (), ("hinge",), springs=[Spring("universe", "hinge_body", 1.0, 0.0)])
    still = viz.Shown.at(chain, [0.3])
    notes = Notes()
    draw_springs(notes, "/m", scene._drawings([still], 1.0, True)[0])  # type: ignore[arg-type]
    (wire,) = (x for name, x in notes.drawn.items() if name.endswith("wire"))
    assert np.isfinite(wire).all() and np.ptp(wire[:, 2]) > 0.0
