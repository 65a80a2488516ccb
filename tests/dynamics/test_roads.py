"""The two roads of inverse dynamics, which share nothing but the trajectory, agree to round-off on whatever moves."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from joints import JOINTS
from mechanisms import TILTED, five_bar, slider_crank
from moving_chains import NAMES, loaded, moving, pushed
from random_chains import random_chain, random_inertia, random_placement

import fivebar_pin as fb
from fivebar_pin import JointSpring, Spring
from fivebar_pin.cli import main
from fivebar_pin.dynamics import inverse
from fivebar_pin.dynamics.compiled_calls import CHUNK
from fivebar_pin.dynamics.inverse import ROADS, roads_apart
from fivebar_pin.errors import InvalidInputError, SolverError, UnknownNameError

ABOUT = (0.2, -0.4, 0.3)
EQUAL = 1e-12  # of the sizes of what adds up
QUANTITIES = ("torque", "shaking_force", "shaking_moment", "frame_force", "frame_moment")


def assert_equal(one: fb.Loads, two: fb.Loads) -> None:
    for name in QUANTITIES:
        a, b = getattr(one, name), getattr(two, name)
        np.testing.assert_array_equal(np.isnan(a), np.isnan(b))
        assert np.nanmax(np.abs(a - b), initial=0.0) <= EQUAL * np.nan_to_num(one.scale(name)), name
    size = np.abs(one.tree_torque).max() + one.scale("frame_moment")
    assert np.abs(one.tree_torque - two.tree_torque).max(initial=0.0) <= EQUAL * size


def both(chain: fb.ClosedChain, path: fb.Trajectory, **given) -> tuple[fb.Loads, fb.Loads]:
    one, two = (fb.inverse_dynamics(chain, path, about=ABOUT, road=road, **given) for road in ROADS)
    return one, two


@pytest.mark.parametrize("name", NAMES)
def test_the_roads_agree_bare_and_with_gravity_losses_springs_and_forces_from_outside(name):
    chain, path = moving(name)
    assert_equal(*both(chain, path))
    heavy = loaded(chain)
    assert_equal(*both(heavy, path, external=pushed(heavy)))
    assert roads_apart(heavy, path) <= EQUAL


def anyhow(chain: fb.ClosedChain, rng: np.random.Generator, n: int = 5) -> fb.Trajectory:
    """Return a trajectory of random numbers: inverse dynamics asks for no more."""
    pin.seed(int(rng.integers(1000)))
    model = chain.model.copy()
    model.lowerPositionLimit[:], model.upperPositionLimit[:] = -2.0, 2.0
    q = np.array([pin.randomConfiguration(model) for _ in range(n)])
    v, a, N = (rng.normal(size=(n, chain.nv, *more)) for more in ((), (), (chain.na,)))
    return fb.Trajectory(np.arange(float(n)), q, v, a, N, np.zeros(n))


@pytest.mark.parametrize("kind", JOINTS)
def test_the_roads_agree_on_trees_of_every_joint(kind):
    rng, model = np.random.default_rng(3), pin.Model()
    for parent, joint in zip((0, 1, 2, 1, 0), (JOINTS[kind], pin.JointModelRX) * 3, strict=False):
        j = model.addJoint(parent, joint(), random_placement(rng), f"joint{model.njoints}")
        model.appendBodyToJoint(j, random_inertia(rng), pin.SE3.Identity())
        model.addBodyFrame(f"body{j}", j, random_placement(rng), 0)
    chain = loaded(fb.ClosedChain(model, (), ("joint2",)))
    assert_equal(*both(chain, anyhow(chain, rng), external=pushed(chain)))


@pytest.mark.parametrize("seed", range(6))
def test_the_roads_agree_whatever_complement_the_trajectory_brings(seed):
    """More closures than the passive coordinates take: N is as a simulation shares the load between the motors."""
    chain = random_chain(seed)
    assert_equal(*both(chain, anyhow(chain, np.random.default_rng(seed)), external=pushed(chain)))


def test_an_undetermined_motion_leaves_the_torques_open_on_both_roads():
    free = five_bar().with_actuated(("left",))
    path = fb.simulate(free, fb.diagnose(free).q, np.zeros(free.nv), None, np.linspace(0.0, 0.1, 3))
    one, two = both(free, path)
    assert np.isnan(one.torque).all()
    assert_equal(one, two)


def test_more_motors_than_mobility_share_the_load_on_both_roads():
    chain = five_bar().with_actuated(("left", "right", "left_elbow"))
    path = fb.simulate(chain, fb.diagnose(chain).q, np.zeros(chain.nv), [0.3, 0.1, 0.2], np.linspace(0.0, 0.1, 3))
    one, two = both(chain, path)
    assert np.isfinite(one.torque).all()
    assert_equal(one, two)


def path_of(samples: int) -> tuple[fb.ClosedChain, fb.Trajectory]:
    chain = five_bar(base=TILTED)
    t = np.linspace(0.0, 1.0, samples)
    swings = (fb.motion.harmonic(t, mean, 0.25, period=0.6, phase=k) for k, mean in enumerate((2.0, 1.0)))
    return chain, fb.drive(chain, fb.motion.combine(*swings))


def test_threads_change_no_bit_of_a_long_trajectory():
    chain, path = path_of(2 * CHUNK + 17)
    force = {"left_body": np.sin(np.arange(6.0 * len(path))).reshape(-1, 6)}
    for road in ROADS:
        one, three = (
            fb.inverse_dynamics(chain, path, road=road, external=force, threads=threads) for threads in (1, 3)
        )
        for name in (*QUANTITIES, "tree_torque"):
            np.testing.assert_array_equal(getattr(one, name), getattr(three, name))
    short = fb.Trajectory(*(getattr(path, name)[CHUNK : CHUNK + 3] for name in path.__slots__))
    few = fb.inverse_dynamics(chain, short, road="complement", external={"left_body": force["left_body"][CHUNK:][:3]})
    long = fb.inverse_dynamics(chain, path, road="complement", external=force)
    np.testing.assert_array_equal(few.torque, long.torque[CHUNK : CHUNK + 3])


def test_few_samples_take_the_complement_and_many_take_pinocchio():
    for samples, road in ((20, "complement"), (400, "pinocchio")):
        chain, path = path_of(samples)
        asked = fb.inverse_dynamics(chain, path, road=road).torque
        np.testing.assert_array_equal(fb.inverse_dynamics(chain, path).torque, asked)


def test_an_unknown_road_is_refused_with_those_there_are():
    chain, path = path_of(3)
    with pytest.raises(UnknownNameError, match="Unknown road 'complemnt'; known: pinocchio, complement") as info:
        fb.inverse_dynamics(chain, path, road="complemnt")
    assert info.value.known == ("pinocchio", "complement")
    with pytest.raises(InvalidInputError, match="threads = 0 but must be an integer of at least 1"):
        fb.inverse_dynamics(chain, path, threads=0)


@pytest.mark.parametrize("road", ROADS)
def test_both_roads_refuse_alike(road):
    chain, path = path_of(3)
    meeting = chain.with_springs((JointSpring("left", 1.0, 0.0), Spring("tip_left", "tip_right", 5.0, 0.1)))
    with pytest.raises(SolverError, match="spring tip_left~tip_right has its ends on one point"):
        fb.inverse_dynamics(meeting, path, road=road)
    fast = fb.Trajectory(path.t, path.q, path.v * 1e200, path.a, path.N, path.closure_residual)
    with pytest.raises(InvalidInputError, match=r"is beyond what can be computed in double precision"):
        fb.inverse_dynamics(chain, fast, road=road)
    with pytest.raises(InvalidInputError, match=r"external\['left_body'\]\[2\] = nan but must be finite"):
        fb.inverse_dynamics(chain, path, road=road, external={"left_body": np.r_[0.0, 0.0, np.nan, np.zeros(3)]})
    with pytest.raises(InvalidInputError, match="must belong to this chain"):
        fb.inverse_dynamics(slider_crank(), path, road=road)


@pytest.mark.parametrize("road", ROADS)
def test_columns_of_a_trajectory_may_stand_in_any_order_in_memory(road):
    chain, path = path_of(7)
    turned = fb.Trajectory(*(np.asfortranarray(getattr(path, name)) for name in path.__slots__))
    one, two = (fb.inverse_dynamics(chain, x, road=road) for x in (path, turned))
    for name in QUANTITIES:
        np.testing.assert_allclose(getattr(one, name), getattr(two, name), rtol=0, atol=EQUAL * one.scale(name))


@pytest.mark.parametrize("road", ROADS)
def test_the_results_cannot_be_written_to(road):
    loads = fb.inverse_dynamics(*path_of(3), road=road)
    for name in (*QUANTITIES, "tree_torque", "about"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(loads, name)[0] = 0.0


def test_a_diagnosis_says_how_far_the_roads_lie_apart():
    found = fb.diagnose(five_bar(base=TILTED))
    assert found.roads_apart is not None
    assert 0.0 < found.roads_apart < 1e-14
    told = re.search(r"torques +by Pinocchio and by the complement differ by (\S+) of what adds up to them", str(found))
    assert told is not None
    assert float(told[1]) == pytest.approx(found.roads_apart, rel=0.6)


@pytest.mark.parametrize("actuated", [(), ("left",), ("left", "right", "left_elbow")])
def test_it_compares_nothing_where_the_motors_do_not_determine_the_motion(actuated):
    found = fb.diagnose(five_bar().with_actuated(actuated))
    assert found.roads_apart is None
    assert "by the complement" not in str(found)


def test_it_compares_nothing_where_a_force_has_no_direction():
    found = fb.diagnose(five_bar().with_springs((Spring("tip_left", "tip_right", 5.0, 0.1),)))
    assert found.roads_apart is None
    assert found.ok


def test_roads_that_disagree_are_an_error_of_the_diagnosis(monkeypatch):
    def wrong(*given):
        loads = ROADS["complement"](*given)
        return replace(loads, torque=loads.torque * (1.0 + 1e-8))

    monkeypatch.setattr(inverse, "ROADS", {"pinocchio": wrong, "complement": ROADS["complement"]})
    found = fb.diagnose(five_bar())
    assert not found.ok
    assert "differ by" in str(found.problems[0])


def test_check_compares_the_roads_along_a_motion(capsys, tmp_path):
    chain, path = path_of(4)
    fb.save(chain, tmp_path / "five.xml")
    index = chain.actuated_index
    motion = fb.Motion(path.t, path.q[:, index], path.v[:, index], path.a[:, index])
    fb.motion.to_file(motion, tmp_path / "motion.csv", chain.actuated)
    assert main(["check", str(tmp_path / "five.xml"), "--motion", str(tmp_path / "motion.csv")]) == 0
    assert re.search(
        r"^along the motion, 4 samples: torques by Pinocchio .* differ by \de-1\d ", capsys.readouterr().out, re.M
    )
