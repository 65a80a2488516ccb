"""Gears: what is geared turns so, the mobility counts them, and wheels count on their carrier."""

from __future__ import annotations

import numpy as np
import pytest

import fivebar_pin as fb
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.planar import Linkage


def hinges(chain: fb.ClosedChain, link: str) -> list[int]:
    """Return the coordinates whose sum is the angle of a link; all joints are hinges."""
    model, j, out = chain.model, chain.model.getJointId(link), []
    while j:
        out.append(int(model.idx_qs[j]))
        j = model.parents[j]
    return out


def swing(chain: fb.ClosedChain, by: float) -> fb.Trajectory:
    home = chain.references["home"]
    t = np.linspace(0.0, 1.0, 41)
    start = home[chain.actuated_index[0]]
    return fb.drive(chain, fb.motion.cycloidal(t, start, start + by), near=home)


def train() -> Linkage:
    """Return an epicyclic train: a sun that is held, a driven arm, a planet on it; and a wheel geared to the arm."""
    made = Linkage("train")
    made.ground(O=(0, 0), W=(0.5, 0))
    made.points(P=(0.12, 0.05))
    made.bar("arm", "O", "P")
    made.bar("sun", "O")
    made.bar("planet", "P")
    made.bar("wheel", "W")
    for link, at, inertia in (("sun", "O", 1e-3), ("planet", "P", 2e-3), ("wheel", "W", 3e-3)):
        made.mass(link, at=at, mass=0.3, inertia=inertia)
    made.gear("sun", "planet", ratio=-1.5, carrier="arm")
    made.gear("arm", "wheel", ratio=-4.0)
    made.gear("arm", "sun", ratio=0.25)
    made.motor("arm", at="O")
    return made


def test_an_epicyclic_train_turns_by_willis() -> None:
    chain = train().chain()
    assert fb.diagnose(chain, chain.references["home"]).mobility == 1
    trajectory = swing(chain, 9.0)
    turn = {}
    for link in ("arm", "sun", "planet", "wheel"):
        angle = trajectory.q[:, hinges(chain, link)].sum(axis=1)
        turn[link] = angle - angle[0]
    assert turn["arm"][-1] == pytest.approx(9.0, abs=1e-14)
    np.testing.assert_allclose(turn["planet"] - turn["arm"], -1.5 * (turn["sun"] - turn["arm"]), rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(turn["wheel"], -4.0 * turn["arm"], rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(turn["sun"], 0.25 * turn["arm"], rtol=0.0, atol=1e-13)


def test_the_motor_feels_every_wheel_by_the_square_of_its_ratio() -> None:
    """Kinetic energy of the train as a function of the arm's rate, and with it the torque without gravity."""
    chain = train().chain().with_gravity((0.0, 0.0, 0.0))
    trajectory = swing(chain, 2.0)
    loads = fb.inverse_dynamics(chain, trajectory)
    planet = 1.0 - 1.5 * (0.25 - 1.0)
    length = np.hypot(0.12, 0.05)
    bar = 2700.0 * 0.02 * 0.01 * length
    effective = bar * (length**2 / 3.0 + 0.02**2 / 12.0) + 0.3 * length**2
    effective += 1e-3 * 0.25**2 + 2e-3 * planet**2 + 3e-3 * 16.0
    a = trajectory.a[:, chain.model.idx_vs[chain.model.getJointId("arm")]]
    np.testing.assert_allclose(loads.torque[:, 0], effective * a, rtol=0.0, atol=1e-13)


def test_a_geared_five_bar_has_one_motor_and_stays_in_mesh_when_lengths_change() -> None:
    made = Linkage("geared")
    made.ground(A=(0, 0), B=(0.3, 0))
    made.points(C=(-0.02, 0.12), D=(0.33, 0.1), P=(0.15, 0.3))
    for name, ends in {"left": "AC", "right": "BD", "left_rod": "CP", "right_rod": "DP"}.items():
        made.bar(name, *ends)
    made.gear("left", "right", ratio=-1.0)
    made.motor("left", at="A")
    chain = made.chain()
    found = fb.diagnose(chain, chain.references["home"])
    assert found.mobility == 1 and found.ok
    longer = chain.with_parameters(left_rod=0.27)
    home = longer.references["home"]
    q = fb.assemble(longer, home[longer.actuated_index], near=home)
    left, right = (q[hinges(longer, link)].sum() for link in ("left", "right"))
    before = [home[hinges(longer, link)].sum() for link in ("left", "right")]
    assert (right - before[1]) == pytest.approx(-(left - before[0]), abs=1e-13)
    assert np.abs(fb.closure_residual(longer, q)).max() < 1e-12


def test_a_gear_too_many_makes_a_structure() -> None:
    made = train()
    made.gear("sun", "wheel", ratio=3.0)
    with pytest.raises(InvalidInputError, match="it is a structure"):
        made.chain()


def test_a_gear_between_links_that_turn_alike_ties_nothing() -> None:
    made = train()
    made.slide("collar", "P", on="arm")
    made.gear("arm", "collar", ratio=1.0)
    with pytest.raises(InvalidInputError, match="ties nothing"):
        made.chain()


def test_a_geared_linkage_is_saved_and_read(tmp_path) -> None:
    chain = train().chain()
    fb.save(chain, tmp_path)
    for name in ("train.urdf", "train.xml"):
        read = fb.load(tmp_path / name)
        one, two = (fb.inverse_dynamics(c, swing(c, 2.0)) for c in (chain, read))
        np.testing.assert_allclose(one.torque, two.torque, rtol=0.0, atol=1e-13)


@pytest.mark.parametrize(
    ("say", "kind", "message"),
    [
        (lambda m: m.gear("arm", "wheel", ratio=0.0), InvalidInputError, "must not be zero"),
        (lambda m: m.gear("arm", "arm", ratio=1.0), InvalidInputError, "three different"),
        (lambda m: m.gear("arm", "wheel", ratio=1.0, carrier="arm"), InvalidInputError, "three different"),
        (lambda m: (m.gear("arm", "whel", ratio=1.0), m.chain()), UnknownNameError, "Did you mean 'wheel'"),
    ],
)
def test_gears_that_cannot_be_are_refused(say, kind, message) -> None:
    with pytest.raises(kind, match=message):
        say(train())
