"""Springs against gravity: lamps and levers that stay where they are put."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import mechanisms
import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin import JointSpring, Spring
from fivebar_pin import motion as laws
from fivebar_pin.balancing import Box, Disc, balance, balance_conditions, realise
from fivebar_pin.balancing.branches import _alike, branches
from fivebar_pin.errors import InvalidInputError, SolverError

G = 9.81
DOWN = (0.0, -G, 0.0)


def lever(*springs: Spring | JointSpring, mass: float = 2.0, length: float = 0.5) -> fb.ClosedChain:
    """A point mass on a lever; `high` is 0.3 m above the hinge, `arm` 0.2 m along the lever."""
    model = pin.Model()
    model.gravity.linear = np.array(DOWN)
    inertia = pin.Inertia(mass, np.array([length, 0.0, 0.0]), np.zeros((3, 3)))
    joint = mechanisms.add(model, 0, pin.JointModelRZ(), mechanisms.at(), "lever", inertia)
    mechanisms.point(model, 0, "high", mechanisms.at(0.0, 0.3))
    mechanisms.point(model, joint, "arm", mechanisms.at(0.2))
    return fb.ClosedChain(model, (), ("lever",), "lever", springs=springs)


def lamp(*springs: Spring | JointSpring) -> fb.ClosedChain:
    """A parallelogram that carries a head: pivots one above the other, arms 0.5 m; `arm` on one, `high` above both."""
    chain = mechanisms.four_bar((0.5, 0.2, 0.5, 0.2), base=mechanisms.at(0.1, 0.2, 0.0, (0.0, 0.0, np.pi / 2)))
    model = chain.model.copy()
    mechanisms.point(model, 0, "high", mechanisms.at(0.1, 0.6))
    mechanisms.point(model, model.getJointId("crank"), "arm", mechanisms.at(0.25))
    mechanisms.point(model, model.getJointId("coupler"), "head", mechanisms.at(0.1, 0.05))
    model.gravity.linear = np.array(DOWN)
    return fb.ClosedChain(model, chain.closures, chain.actuated, "lamp", springs=springs)


def resting(chain: fb.ClosedChain, places: np.ndarray, near: np.ndarray | None = None) -> np.ndarray:
    """Return the torque (n, na) at rest at many places of the actuated joints."""
    t = np.linspace(0.0, 1.0, len(places))
    still = np.zeros_like(places)
    path = fb.drive(chain, fb.Motion(t, places, still, still), near=near)
    return fb.inverse_dynamics(chain, path).torque


def test_a_zero_length_spring_carries_a_lever_where_k_a_b_is_m_g_l():
    k, a, b, length = 400.0, 0.3, 0.2, 0.5
    chain = lever(Spring("high", "arm", k, 0.0), mass=k * a * b / (G * length), length=length)
    found = balance_conditions(chain, "static", gravity="model")
    assert found.rank == 2
    np.testing.assert_allclose(found.residual(), 0.0, atol=1e-14 * chain.mass)
    assert np.abs(found.residual(lever(mass=2.0))).max() > 0.1
    places = np.linspace(-3.0, 3.0, 50)[:, None]
    assert np.abs(resting(chain, places)).max() < 1e-13 * k * a * b
    assert np.abs(resting(chain.with_springs(()), places)).max() > 0.9 * k * a * b
    assert set(found.equations) == {f"mcx(lever) - {k * a * b / G:.10g} = 0", "mcy(lever) = 0"}
    np.testing.assert_allclose(
        balance_conditions(chain, "static", gravity=[0.0, -2 * G, 0.0]).offset, 0.5 * found.offset
    )


def test_without_springs_that_act_the_conditions_have_no_constants():
    chain = lever()
    for gravity in ("any", "model"):
        found = balance_conditions(chain, "static", gravity=gravity)
        np.testing.assert_array_equal(found.offset, 0.0)
        assert found.unheld == 0.0
    parallel = mechanisms.four_bar((0.5, 0.2, 0.5, 0.2))
    near = fb.assemble(parallel, [1.0])
    idle = parallel.with_springs(
        [Spring("crank_body", "rocker_body", 50.0, 0.1)]
    )  # between the two hinges in the frame
    bare, found = (balance_conditions(c, "static", near=near) for c in (parallel, idle))
    np.testing.assert_array_equal(found.offset, 0.0)
    np.testing.assert_array_equal(found.basis, bare.basis)


def test_damping_plays_no_part_at_rest():
    still, damped = (
        balance_conditions(lever(Spring("high", "arm", 400.0, 0.0, c)), "static", gravity="model") for c in (0.0, 7.0)
    )
    np.testing.assert_array_equal(still.offset, damped.offset)


@pytest.mark.parametrize("kind", ["force", "moment", "dynamic"])
def test_springs_are_inner_forces_and_leave_the_other_conditions_alone(kind):
    plain, sprung = lamp(), lamp(Spring("high", "arm", 300.0, 0.05), JointSpring("crank", 2.0, 0.1))
    bare, found = balance_conditions(plain, kind), balance_conditions(sprung, kind)
    np.testing.assert_array_equal(bare.basis, found.basis)
    np.testing.assert_array_equal(found.offset, 0.0)
    np.testing.assert_array_equal(bare.residual(), found.residual())


def test_springs_under_any_gravity_are_refused():
    with pytest.raises(InvalidInputError, match=r"gravity = 'any'.*springs \(high~arm\) act.*gravity='model'"):
        balance_conditions(lever(Spring("high", "arm", 400.0, 0.0)), "static")


@pytest.mark.parametrize("solver", ["clarabel", "scipy"])
@pytest.mark.parametrize("mode", ["add", "redesign"])
def test_the_balanced_lever_stays_where_it_is_put(mode, solver):
    chain = lever(Spring("high", "arm", 400.0, 0.0))
    bounds = {"region": Box((2.0, 2.0, 2.0)), "masses": (0.0, 50.0), "material": None}
    design = balance(chain, "static", gravity="model", mode=mode, minimise="added_mass", solver=solver, **bounds)
    assert design.feasible
    assert design.residual < 1e-12
    assert design.chain.springs == chain.springs
    assert np.abs(resting(design.chain, np.linspace(-3.0, 3.0, 50)[:, None])).max() < 1e-11 * 24.0
    first = 400.0 * 0.3 * 0.2 / G  # kg m; what is there is 1 kg m, what is added lies at most 1 m from the hinge
    wanted = first - 1.0 if mode == "add" else first - 2.0
    assert design.added_mass == pytest.approx(wanted, rel=1e-5)


@cache
def sprung_lamp() -> tuple[fb.ClosedChain, np.ndarray]:
    chain = lamp(Spring("high", "arm", 300.0, 0.0))
    return chain, fb.assemble(chain, [-1.2])


def test_a_parallelogram_lamp_stays_where_it_is_put():
    chain, near = sprung_lamp()
    design = balance(
        chain, "static", gravity="model", near=near, bodies=["crank", "coupler"], masses=(0.0, 100.0), material=None
    )
    assert design.feasible
    places = np.linspace(-2.4, -0.5, 60)[:, None]
    assert np.abs(resting(design.chain, places, near)).max() < 1e-9
    assert np.abs(resting(chain, places, near)).max() > 1.0
    here, gone = (c.with_springs(()) for c in (chain, design.chain))
    assert np.abs(resting(gone, places, near)).max() > np.abs(resting(here, places, near)).max()


def test_a_lamp_that_all_assembly_modes_make_impossible_is_balanced_on_the_one_meant():
    """On the antiparallelogram the spring's torque is none of gravity's; the proof says so, and the branch is found."""
    _, near = sprung_lamp()
    chain = lamp(Spring("high", "head", 300.0, 0.0))
    motion = laws.harmonic(np.linspace(0.0, 1.0, 9), -1.3, 0.1, period=1.0)
    path = fb.drive(chain, motion, near=near)
    together = balance_conditions(chain, "static", gravity="model")
    assert together.unheld > 0.0
    design = balance(chain, "static", gravity="model", masses=(0.0, 100.0), material=None, motions=path)
    assert design.feasible and design.branch is not None
    assert design.certificate is not None
    assert np.abs(resting(design.chain, np.linspace(-2.4, -0.5, 60)[:, None], near)).max() < 1e-9


@pytest.mark.parametrize(
    "spring", [Spring("high", "arm", 400.0, 0.05), JointSpring("lever", 20.0, 0.3)], ids=["length", "joint"]
)
def test_springs_that_no_masses_hold_are_told_and_proved(spring):
    """A free length, or a spring on the joint, pulls by other functions of the angle than weight does."""
    chain = lever(spring)
    found = balance_conditions(chain, "static", gravity="model")
    assert found.unheld > 0.01
    assert found.rank == 2
    assert "impossible with these springs" in repr(found)
    assert found.equations[-1].endswith("(springs, whatever the masses) = 0")
    assert found.residual().shape == (3,)
    for solver in ("clarabel", "scipy"):
        design = balance(chain, "static", gravity="model", material=None, solver=solver)
        assert not design.feasible
        assert "springs, whatever the masses" in str(design.certificate)


def test_masses_that_would_have_to_be_negative_are_proved_impossible():
    """The spring is too weak for the mass that is there: no counterweight fits on the other side."""
    chain = lever(Spring("high", "arm", 10.0, 0.0))
    design = balance(chain, "static", gravity="model", region=Box((0.1, 0.1, 0.1), (0.3, 0.0, 0.0)), material=None)
    assert not design.feasible
    assert design.certificate is not None
    assert "mcx(lever)" in str(design.certificate)


def test_conditions_of_other_springs_are_not_taken():
    chain = lever(Spring("high", "arm", 400.0, 0.0))
    found = balance_conditions(chain, "static", gravity="model")
    again = balance(chain, "static", gravity="model", conditions=found, material=None, masses=(0.0, 50.0))
    assert again.feasible
    softer = chain.with_springs([Spring("high", "arm", 300.0, 0.0)])
    with pytest.raises(InvalidInputError, match="must hold the springs of lever"):
        balance(softer, "static", gravity="model", conditions=found)
    with pytest.raises(InvalidInputError, match="must hold for gravity"):
        balance(chain, "static", gravity=(0.0, -5.0, 0.0), conditions=found)
    moved = lever(Spring("high", "arm", 400.0, 0.0))
    model = moved.model.copy()
    model.frames[model.getFrameId("arm")].placement = mechanisms.at(0.25)
    other = fb.ClosedChain(model, (), ("lever",), "lever", springs=moved.springs)
    with pytest.raises(InvalidInputError, match="must hold the springs of lever"):
        balance(other, "static", gravity="model", conditions=found)
    bare = balance_conditions(lever(), "static", gravity="model")
    heavier = balance(lever(), "static", gravity=(0.0, -5.0, 0.0), conditions=bare, material=None)
    assert heavier.feasible  # without springs the direction alone plays a part


@pytest.mark.parametrize("seed", range(6))
def test_any_springs_of_no_length_on_a_lever_ask_for_one_first_moment(seed):
    """In complex numbers, springs k from h in the ground to c on the lever: m z = sum i k conj(h) c / g."""
    rng = np.random.default_rng(seed)
    model = lever().model.copy()
    wanted, springs = 0.0, []
    for n in range(3):
        k, (h, c) = rng.uniform(10.0, 500.0), rng.normal(size=(2, 2))
        mechanisms.point(model, 0, f"h{n}", mechanisms.at(*h))
        mechanisms.point(model, 1, f"c{n}", mechanisms.at(*c, rng.normal()))  # what is out of the plane does no work
        springs.append(Spring(*rng.permutation([f"h{n}", f"c{n}"]), k, 0.0, rng.uniform()))
        wanted += 1j * k * np.conj(complex(*h)) * complex(*c) / G
    chain = fb.ClosedChain(model, (), ("lever",), springs=springs)
    found = balance_conditions(chain, "static", gravity="model")
    assert found.unheld == 0.0
    pi = np.array(chain.inertial_parameters)
    assert np.abs(found.residual(pi)).max() > 0.1
    pi[0, 1:3] = wanted.real, wanted.imag
    np.testing.assert_allclose(found.residual(pi), 0.0, atol=1e-12 * abs(wanted))
    constants = {name: -c for name, c in zip(("mcx", "mcy"), (wanted.real, wanted.imag), strict=True)}
    for equation in found.equations:
        name, _, number = equation.removesuffix(" = 0").partition("(lever) ")
        assert float(number.replace(" ", "")) == pytest.approx(constants[name], rel=1e-9)


def test_springs_where_weight_does_no_work_are_held_by_none():
    """A hinge along gravity: the conditions hold nothing but the springs, and say so."""
    chain = lever(Spring("high", "arm", 400.0, 0.0)).with_gravity((0.0, 0.0, -G))
    found = balance_conditions(chain, "static", gravity="model")
    assert found.rank == 0 and found.unheld > 0.1
    assert len(found.equations) == 1
    with pytest.raises(InvalidInputError, match="cannot influence the static conditions"):
        balance(chain, "static", gravity="model")


def test_realised_counterweights_keep_the_springs_and_hold_them():
    chain = lever(Spring("high", "arm", 400.0, 0.0))
    design = balance(chain, "static", gravity="model", counterweight=Disc("steel", 0.05))
    assert design.feasible
    made = realise(design)
    assert made.chain.springs == chain.springs
    assert made.residual < 1e-9
    assert np.abs(resting(made.chain, np.linspace(-3.0, 3.0, 50)[:, None])).max() < 1e-8


def test_torque_that_is_round_off_of_weight_and_springs_is_told_as_none():
    chain = lever(Spring("high", "arm", 400.0, 0.0), mass=400.0 * 0.3 * 0.2 / (G * 0.5))
    q = np.linspace(-3.0, 3.0, 50)[:, None]
    loads = fb.inverse_dynamics(chain, fb.drive(chain, fb.Motion(np.linspace(0.0, 1.0, 50), q, 0.0 * q, 0.0 * q)))
    assert np.abs(loads.torque).max() > 0.0
    assert loads.peak("torque") == 0.0


def test_a_damper_whose_ends_never_part_plays_no_part_at_rest():
    """Its force has no direction, which inverse dynamics refuses; at rest there is none."""
    chain = lever(Spring("universe", "lever_body", 100.0, 0.0, 2.0))
    np.testing.assert_array_equal(balance_conditions(chain, "static").offset, 0.0)
    with pytest.raises(SolverError, match="ends on one point"):
        resting(chain, np.zeros((1, 1)))


def test_conditions_with_springs_are_not_those_without():
    chain = lever(Spring("high", "arm", 400.0, 0.0))
    found = balance_conditions(chain, "static", gravity="model")
    for given, conditions in (
        (chain.with_springs(()), found),
        (chain, balance_conditions(lever(), "static", gravity="model")),
        (chain.with_springs([JointSpring("lever", 1.0, 0.0)]), found),
    ):
        with pytest.raises(InvalidInputError, match="must hold the springs of lever"):
            balance(given, "static", gravity="model", conditions=conditions)


def test_a_branch_that_holds_its_springs_asks_less_than_all_of_them_that_do_not():
    chain = lever(Spring("high", "arm", 400.0, 0.0))
    found = balance_conditions(chain, "static", gravity="model")
    assert branches(chain, found, gravity="model") == ()
    (one,) = branches(chain, replace(found, unheld=1.0), gravity="model")
    assert one.conditions.equations == found.equations


def test_branches_with_other_constants_are_two():
    soft, hard, again = (
        balance_conditions(lever(Spring("high", "arm", k, 0.0)), "static", gravity="model")
        for k in (300.0, 400.0, 400.0)
    )
    assert _alike(hard, again)
    assert not _alike(soft, hard)
