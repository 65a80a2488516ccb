"""What is no number is refused, and numbers too large to compute with end in an error that names the thing."""

from __future__ import annotations

import warnings
from dataclasses import replace
from fractions import Fraction
from functools import cache

import numpy as np
import pytest

import fivebar_pin as fb
from fivebar_pin import balancing, errors, paper
from fivebar_pin._arrays import checked, integer, number, numeric, reals
from fivebar_pin.errors import FiveBarPinError, InvalidInputError
from tests import mechanisms

NO_NUMBERS = {
    "complex": lambda x: x.astype(complex) + 1e-3j,
    "complex without imaginary parts": lambda x: x.astype(complex),
    "masked": lambda x: np.ma.masked_invalid(x),
    "masked, a value missing": lambda x: np.ma.masked_equal(x, x.flat[0]),
    "masked in a list": lambda x: [np.ma.masked_equal(x, x.flat[0])],
    "a missing value in a list": lambda x: [np.ma.masked, 1.0],
    "instants": lambda x: x.astype("datetime64[s]"),
    "spans": lambda x: x.astype("timedelta64[s]"),
    "digits": lambda x: x.astype(str),
    "bytes": lambda x: x.astype(bytes),
    "truth values": lambda x: x > 0.0,
    "objects": lambda x: np.full(x.shape, object()),
    "complex objects": lambda x: x.astype(complex).astype(object),
    "truth objects": lambda x: (x > 0.0).astype(object),
    "nothing": lambda x: None,
    "ragged": lambda x: [[1.0], [1.0, 2.0]],
    "records": lambda x: np.zeros(x.shape, dtype=[("a", float)]),
    "a set": lambda x: {1.0, 2.0},
    "beyond float": lambda x: np.full(x.shape, 10**400),
    "text": lambda x: "abc",
}
NUMBERS = {
    "integers": lambda x: np.round(x).astype(int),
    "short floats": lambda x: x.astype(np.float32),
    "long floats": lambda x: x.astype(np.longdouble),
    "fractions": lambda x: np.array([Fraction(float(v)) for v in x.flat], dtype=object).reshape(x.shape),
    "unsigned": lambda x: np.abs(np.round(x)).astype(np.uint8),
    "lists": lambda x: x.tolist(),
}
X = np.array([[0.5, -1.25], [3.0, 0.0]])


@pytest.mark.parametrize("what", NO_NUMBERS)
def test_what_is_no_number_is_refused_and_never_stripped(what):
    for take in (
        lambda x: reals("x", x),
        lambda x: numeric("x", x),
        lambda x: checked("x", x, (2, 2)),
        lambda x: number("x", x),
    ):
        with pytest.raises(InvalidInputError, match=r"(?s)^x = .* but must be"):
            take(NO_NUMBERS[what](X))
    if what not in ("ragged", "a set", "text", "nothing", "a missing value in a list", "masked in a list"):
        with pytest.raises(InvalidInputError, match="must be one number"):
            number("x", NO_NUMBERS[what](np.array(0.5)))


@pytest.mark.parametrize("what", NUMBERS)
def test_numbers_of_every_make_are_taken_for_what_they_are(what):
    given = NUMBERS[what](X)
    taken = checked("x", given, (2, 2))
    assert taken.dtype == np.float64 and not taken.flags.writeable
    assert np.array_equal(taken, np.array(given, dtype=float))


@pytest.mark.parametrize(
    "value", ["3.5", True, np.True_, [1.0], np.array([1.0]), 1j, None, np.datetime64(3, "s"), b"1"]
)
def test_one_number_is_one_real_number(value):
    with pytest.raises(InvalidInputError, match=r"(?s)x = .* must be one number"):
        number("x", value)


@pytest.mark.parametrize("value", [2.5, 2.0, True, "3", -1, None, np.array([1]), 1j])
def test_a_count_is_a_whole_number(value):
    with pytest.raises(InvalidInputError, match=r"(?s)count = .* must be an integer of at least 0"):
        integer("count", value)
    assert integer("count", np.int16(3)) == 3
    with pytest.raises(InvalidInputError, match=r"(?s)count = 10+ .* must be an integer from 0 to 100"):
        integer("count", 10**400, most=100)


def test_the_callers_array_stays_his():
    mine = np.ones(3)
    taken = numeric("x", mine)
    mine[0] = 5.0
    assert taken[0] == 1.0 and mine.flags.writeable


@cache
def case():
    chain = mechanisms.four_bar()
    q = fb.assembly_modes(chain, [0.5])[0]
    t = np.linspace(0.0, 1.0, 11)
    motion = fb.motion.cycloidal(t, 0.5, 1.5)
    return chain, q, t, motion, fb.drive(chain, motion, near=q)


def entries():
    """Yield every way in for an array or number: a name, a good value, and what takes it."""
    chain, q, t, motion, path = case()
    linkage = paper.table_1("I", "unbalanced")
    one, v, wrench = np.array([0.5]), np.zeros(chain.nv), np.zeros(6)
    moves, pi = paper.default_motion(samples=11), chain.inertial_parameters[None]
    yield from {
        "assemble": (one, lambda x: fb.assemble(chain, x)),
        "assemble near": (q, lambda x: fb.assemble(chain, one, x)),
        "assemble tolerance": (np.array(1e-12), lambda x: fb.assemble(chain, one, tolerance=x)),
        "assembly_modes": (one, lambda x: fb.assembly_modes(chain, x)),
        "complement": (q, lambda x: fb.complement(chain, x)),
        "closure_residual": (q, lambda x: fb.closure_residual(chain, x)),
        "drive near": (q, lambda x: fb.drive(chain, motion, x)),
        "motion t": (t, lambda x: fb.Motion(x, motion.q, motion.v, motion.a)),
        "motion q": (motion.q, lambda x: fb.Motion(t, x, motion.v, motion.a)),
        "motion scaled": (np.array(2.0), motion.scaled),
        "cycloidal": (np.array(0.5), lambda x: fb.motion.cycloidal(t, x, 2.0)),
        "harmonic": (np.array(0.5), lambda x: fb.motion.harmonic(t, 0.0, x, period=1.0)),
        "spline": (t, lambda x: fb.motion.spline(t, t, x)),
        "trajectory": (path.v, lambda x: fb.Trajectory(path.t, path.q, x, path.a, path.N, path.closure_residual)),
        "about": (np.zeros(3), lambda x: fb.inverse_dynamics(chain, path, about=x)),
        "external": (wrench, lambda x: fb.inverse_dynamics(chain, path, external={"rocker_body": x})),
        "forward q": (q, lambda x: fb.forward_dynamics(chain, x, v, None)),
        "forward v": (v, lambda x: fb.forward_dynamics(chain, q, x, None)),
        "forward tau": (one, lambda x: fb.forward_dynamics(chain, q, v, x)),
        "forward external": (wrench, lambda x: fb.forward_dynamics(chain, q, v, one, external={"rocker_body": x})),
        "evaluator near": (q, lambda x: fb.Evaluator(chain, x)),
        "evaluator about": (np.zeros(3), lambda x: fb.Evaluator(chain, about=x).inverse(one, one, one)),
        "evaluator jump": (q, lambda x: fb.Evaluator(chain, q).jump(x)),
        "evaluator q": (motion.q[0], lambda x: fb.Evaluator(chain, q).kinematics(x, motion.v[0], motion.a[0])),
        "evaluator v": (motion.v[0], lambda x: fb.Evaluator(chain, q).inverse(motion.q[0], x, motion.a[0])),
        "evaluator a": (motion.a[0], lambda x: fb.Evaluator(chain, q).inverse(motion.q[0], motion.v[0], x)),
        "evaluator tau": (one, lambda x: fb.Evaluator(chain, q).forward(motion.q[0], motion.v[0], x)),
        "evaluator external": (
            wrench,
            lambda x: fb.Evaluator(chain, q).forward(motion.q[0], motion.v[0], one, {"rocker_body": x}),
        ),
        "simulate q": (q, lambda x: fb.simulate(chain, x, v, None, t)),
        "simulate tau": (one, lambda x: fb.simulate(chain, q, v, x, t)),
        "simulate tau, called": (one, lambda x: fb.simulate(chain, q, v, lambda *_: x, t)),
        "simulate external": (wrench, lambda x: fb.simulate(chain, q, v, one, t, external={"rocker_body": x})),
        "simulate t": (t, lambda x: fb.simulate(chain, q, v, None, x)),
        "simulate rtol": (np.array(1e-9), lambda x: fb.simulate(chain, q, v, None, t[:2], rtol=x)),
        "spring": (np.array(1.0), lambda x: fb.Spring("a", "b", x, 1.0)),
        "joint spring": (np.array(1.0), lambda x: fb.JointSpring("a", 1.0, x)),
        "gravity": (np.zeros(3), chain.with_gravity),
        "inertial parameters": (chain.inertial_parameters, chain.with_inertial_parameters),
        "closure axis": (np.ones(3), lambda x: fb.Closure(("a", "b"), "revolute", x)),
        "visual": (np.ones(3), lambda x: fb.Visual("crank_body", "box", x)),
        "diagnose": (q, lambda x: fb.diagnose(chain, x)),
        "score": (chain.inertial_parameters, lambda x: fb.score(chain, path, x)),
        "sweep": (chain.inertial_parameters[None], lambda x: fb.sweep(chain, motion, inertias=x, near=q)),
        "sweep about": (np.zeros(3), lambda x: fb.sweep(chain, motion, inertias=pi, near=q, about=x)),
        "regressor about": (np.zeros(3), lambda x: balancing.regressor(chain, path, "shaking_moment", about=x)),
        "conditions about": (np.zeros(3), lambda x: fb.balance_conditions(chain, "force", about=x)),
        "ball": (np.array(0.1), lambda x: balancing.Ball(x)),
        "box": (np.ones(3), lambda x: balancing.Box(x)),
        "limit": (np.array(9.0), lambda x: fb.balance(chain, "force", motions=path, limits={"peak_torque": x})),
        "weight": (np.array(1.0), lambda x: fb.balance(chain, "force", minimise={"added_mass": x})),
        "linkage": (linkage.lengths, lambda x: replace(linkage, lengths=x)),
        "paper gravity": (np.zeros(3), lambda x: paper.solve(linkage, moves, gravity=x)),
        "variations": (np.array(0.2), lambda x: balancing.variations(chain, 2, spread=x)),
    }.items()


ENTRIES = dict(entries())


@pytest.mark.parametrize("what", ["complex", "masked", "masked, a value missing", "instants", "digits", "truth values"])
@pytest.mark.parametrize("entry", ENTRIES)
def test_every_way_in_refuses_what_is_no_number(entry, what):
    good, take = ENTRIES[entry]
    take(good)
    with pytest.raises(InvalidInputError):
        take(NO_NUMBERS[what](good))


@pytest.mark.parametrize("entry", ENTRIES)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_every_way_in_refuses_nan_and_infinity(entry, value):
    good, take = ENTRIES[entry]
    bad = np.array(good, dtype=float)
    bad.flat[-1] = value
    if entry == "trajectory":
        pytest.skip("a simulated trajectory has an N of nan where the motors do not determine the motion")
    with pytest.raises(FiveBarPinError):
        take(bad)


def plain(result: object) -> bool:
    """Tell whether an answer holds numbers only."""
    arrays = (
        [result] if isinstance(result, np.ndarray) else [getattr(result, n) for n in getattr(result, "__slots__", ())]
    )
    return all(np.isfinite(x).all() for x in arrays if isinstance(x, np.ndarray))


@pytest.mark.parametrize("size", [1e155, 1e200, 1.7e308])
@pytest.mark.parametrize("entry", ENTRIES)
def test_huge_numbers_give_numbers_or_an_error_and_no_warning(entry, size):
    good, take = ENTRIES[entry]
    for huge in (np.clip(good, -1.0, 1.0) * size, np.full_like(good, -size, dtype=float)):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                assert plain(take(huge))
            except FiveBarPinError as error:
                assert len(str(error)) > 20


def test_one_motor_takes_one_number_and_none_is_no_torque():
    chain, q, t, *_ = case()
    v = np.zeros(chain.nv)
    a = fb.forward_dynamics(chain, q, v, [0.1])
    assert np.array_equal(fb.forward_dynamics(chain, q, v, 0.1), a)
    assert np.array_equal(fb.forward_dynamics(chain, q, v), fb.forward_dynamics(chain, q, v, [0.0]))
    moved = fb.simulate(chain, q, v, [0.1], t)
    assert np.array_equal(fb.simulate(chain, q, v, 0.1, t).q, moved.q)
    assert np.array_equal(fb.simulate(chain, q, v, lambda *_: 0.1, t).q, moved.q)
    assert np.array_equal(fb.simulate(chain, q, v, t=t).q, fb.simulate(chain, q, v, [0.0], t).q)
    with pytest.raises(InvalidInputError, match="output times"):
        fb.simulate(chain, q, v, 0.1)


def test_two_motors_want_two_torques():
    chain = mechanisms.five_bar()
    q = fb.assemble(chain, [1.0, 2.0])
    for call in (
        lambda: fb.forward_dynamics(chain, q, q * 0.0, 0.1),
        lambda: fb.simulate(chain, q, q * 0.0, 0.1, [0.0, 1.0]),
    ):
        with pytest.raises(InvalidInputError, match=r"tau.* must be"):
            call()


def test_a_simulation_that_gets_nowhere_says_so_soon():
    chain, q, t, *_ = case()
    with pytest.raises(errors.SolverError, match=r"took 100 steps \(of 1000000\) to get to t"):
        fb.simulate(chain, q, np.zeros(chain.nv), 1e120, t)
