"""Sweeps: many designs at once are what each is as a chain of its own."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin.chain import Geometry, Placement
from fivebar_pin.engine import tables as e
from fivebar_pin.engine.sweeping import lead
from fivebar_pin.errors import AssemblyError, InvalidInputError, UnknownNameError
from fivebar_pin.mechanism.dimensions import with_values
from fivebar_pin.mechanism.layout import constants_of
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.mechanism.prepared import parts_of, prepared_of
from fivebar_pin.planar import Linkage
from fivebar_pin.sweeps import Status, Sweep
from fivebar_pin.sweeps.problem import Problem
from fivebar_pin.sweeps.terms import QUANTITIES, terms_of
from tests.chain.test_parameters import six_bar

SAME = 1e-12
EVERY = ("torque", "shaking_force", "shaking_moment", "frame_force", "frame_moment", "q", "v", "a")


def five_bar() -> fb.ClosedChain:
    made = Linkage("five")
    made.points({"A": (0, 0), "B": (0.2, 0), "C": (-0.06, 0.14), "D": (0.26, 0.14), "P": (0.1, 0.28)})
    made.ground("A", "B")
    for name, one, other in (("left", "A", "C"), ("left_rod", "C", "P"), ("right", "B", "D"), ("right_rod", "D", "P")):
        made.bar(name, one, other)
    made.motor("left", at="A")
    made.motor("right", at="B")
    return made.chain()


def slider() -> fb.ClosedChain:
    made = Linkage("slider")
    made.points({"A": (0, 0), "C": (0.05, 0.087), "B": (0.34, 0.02)})
    made.ground("A")
    made.bar("crank", "A", "C")
    made.bar("rod", "C", "B")
    made.slide("slider", "B", through=(0, 0.02), angle=0.0, mass=0.2)
    made.motor("crank", at="A")
    return made.chain()


def placed(chain: fb.ClosedChain, moves: dict[str, list[tuple[str, list[float]]]], **values: float) -> fb.ClosedChain:
    """Return a chain some of whose joints and frames move with parameters, as they are at these values."""
    model, placements = chain.model, []
    for name, ways in moves.items():
        frame = next((f for f in model.frames if f.name == name), None)
        M = model.jointPlacements[model.getJointId(name)] if model.existJointName(name) else frame.placement
        way = pin.SE3.Identity()
        for parameter, twist in ways:
            way = way * pin.exp6(pin.Motion(values[parameter] * np.array(twist)))
        twists = tuple((parameter, np.array(twist, dtype=float)) for parameter, twist in ways)
        placements.append(Placement(name, twists, np.array((M * way.inverse()).homogeneous)))
    return replace(chain, geometry=Geometry(values, tuple(placements)))


def tilted_delta() -> fb.ClosedChain:
    """Return the Delta with a forearm that varies, and an arm that stands askew by an angle."""
    chain = fb.load("delta")
    first = chain.joints[0]
    elbow = next(chain.model.names[j] for j in range(1, chain.model.njoints) if chain.model.parents[j] == 1)
    moves = {first: [("askew", [0, 0, 0, 0, 0, 1.0])], elbow: [("arm", [1.0, 0, 0, 0, 0, 0])]}
    return placed(chain, moves, askew=0.3, arm=0.07)


CHAINS = {"five": five_bar, "six": six_bar, "slider": slider, "delta": tilted_delta}
CHANGES = {
    "five": {"left": 0.1, "left_rod": -0.1, "B_x": 0.15},
    "six": {"crank": 0.1, "coupler_E_y": 0.2, "rocker_F_x": 0.1},
    "slider": {"crank": 0.2, "rod": -0.1},
    "delta": {"askew": 0.25, "arm": 0.02},
}


def home(chain: fb.ClosedChain) -> np.ndarray:
    return next(iter(chain.references.values()))


def motion_of(chain: fb.ClosedChain, samples: int = 21, size: float = 0.2) -> fb.Motion:
    t = np.linspace(0.0, 1.0, samples)
    start = loops_of(chain).actuated_of(home(chain)[None])[0]
    way = size * np.array([1.0, -0.7, 0.4])[: chain.na]
    w = 2.0 * np.pi
    return fb.Motion(
        t,
        start + np.outer(np.sin(w * t), way),
        w * np.outer(np.cos(w * t), way),
        -w * w * np.outer(np.sin(w * t), way),
    )


def designs(name: str, n: int = 5) -> dict[str, np.ndarray]:
    chain, share = CHAINS[name](), np.linspace(-1.0, 1.0, n)
    found = {}
    for k, (parameter, change) in enumerate(CHANGES[name].items()):
        value = chain.parameters[parameter]
        by = change * (abs(value) if name != "delta" else 1.0)
        found[parameter] = value + by * np.roll(share, k)
    return found


@pytest.mark.parametrize("name", CHAINS)
def test_a_sweep_is_the_loop_over_chains(name):
    chain, values = CHAINS[name](), designs(name)
    motion = motion_of(chain)
    found = fb.sweep(chain, motion, parameters=values, of=EVERY, near=home(chain), threads=1)
    assert found.ok.all() and np.all(found.reached == len(motion))
    for i in range(len(found)):
        one = chain.with_parameters({k: float(x[i]) for k, x in values.items()})
        path = fb.drive(one, motion, near=found["q"][i, 0])
        loads = fb.inverse_dynamics(one, path)
        for quantity in EVERY:
            wanted = getattr(path if quantity in ("q", "v", "a") else loads, quantity)
            scale = max(np.abs(wanted).max(), 1e-3 if quantity == "q" else 1e-9)
            np.testing.assert_allclose(found[quantity][i], wanted, rtol=0.0, atol=SAME * scale, err_msg=quantity)


@pytest.mark.parametrize("name", CHAINS)
def test_designs_have_the_constants_of_their_chains_to_the_last_digit(name):
    """In units of the chain that they are designs of."""
    chain, values = CHAINS[name](), designs(name)
    base = parts_of(chain)
    every = {k: np.broadcast_to(values.get(k, x), (5,)) for k, x in chain.parameters.items()}
    C = constants_of(replace(base, dimensions=with_values(chain, every)))
    for i in range(len(C)):
        own = parts_of(chain.with_parameters({k: float(x[i]) for k, x in values.items()}))
        same = replace(own, scale=base.scale, length=base.length)
        if name == "delta":  # whose rows are mixed: any mixture will do
            same = replace(same, blocks=base.blocks, rows=base.rows)
        np.testing.assert_array_equal(C[i], constants_of(same)[0])


def test_the_last_point_of_the_way_to_a_design_is_the_design():
    chain = CHAINS["delta"]()
    rng = np.random.default_rng(2)
    values = {"askew": rng.uniform(-1.0, 1.0, 50), "arm": rng.uniform(0.03, 0.1, 50)}
    nothing = (np.full(chain.nq, -np.inf), np.full(chain.nq, np.inf))
    asked = (chain, home(chain), motion_of(chain), 50, values, None, terms_of("q"), np.zeros(3), nothing)
    problem = Problem(*asked)
    assert problem.knots > 5
    C = constants_of(replace(parts_of(chain), bodiless=True, dimensions=with_values(chain, values)))
    np.testing.assert_array_equal(problem.constants(slice(0, 50))[:, -1], C)


def test_the_chain_itself_has_the_constants_that_it_is_prepared_with():
    for make in CHAINS.values():
        chain = make()
        ready = prepared_of(chain)
        np.testing.assert_array_equal(constants_of(parts_of(chain))[0], ready.W[: ready.I[e.CONSTANTS]])


def side(chain: fb.ClosedChain, q: np.ndarray) -> float:
    """Return the sign of the determinant of the passive Jacobian, which tells the two assembly modes of a five-bar."""
    loops = loops_of(chain)
    J = loops.reduce @ loops.see(q[None]).J[0][:, loops.passive]
    return float(np.sign(np.linalg.det(J) * np.linalg.det(loops.reduce[:, :2])))


def stretched(slack: float) -> fb.ClosedChain:
    """Return a five-bar whose rods are almost in line at home."""
    chain = five_bar()
    reach = 0.5 * 0.32 * (1.0 + slack)  # C and D are 0.32 m apart
    return chain.with_parameters(left_rod=reach, right_rod=reach)


@pytest.mark.parametrize("slack", [1e-4, 1e-2, 0.3])
def test_every_design_stays_on_the_assembly_mode_of_the_chain(slack):
    """Also from where the modes almost meet, where Newton's method alone would take the one or the other."""
    chain = stretched(slack)
    rng, motion = np.random.default_rng(3), motion_of(chain, 3, 1e-9)
    values = {k: chain.parameters[k] * rng.uniform(0.95, 2.0, 60) for k in ("left", "left_rod", "right", "right_rod")}
    modes = fb.assembly_modes(chain, motion.q[0])
    assert len(modes) == 2
    for q0 in modes:
        found = fb.sweep(chain, motion, parameters=values, of="q", near=q0, limits="ignore")
        assert found.ok.sum() > 30
        for i in np.flatnonzero(found.ok):
            one = chain.with_parameters({k: float(x[i]) for k, x in values.items()})
            assert side(one, found["q"][i, 0]) == side(chain, q0)


def test_between_knots_constants_go_straight_from_one_to_the_next():
    """From almost stretched rods to slack ones and back, where steps have to be short again."""
    chain = stretched(1e-4)
    rods = chain.parameters["left_rod"] * np.array([1.5, 1.0 + 1e-6])
    nothing = (np.full(chain.nq, -np.inf), np.full(chain.nq, np.inf))
    q0 = fb.assemble(chain, home(chain)[chain.actuated_index], home(chain))
    asked = (chain, q0, motion_of(chain), 2, {"left_rod": rods}, None, terms_of("q"), np.zeros(3), nothing)
    problem = Problem(*asked)
    I, W, q = problem.tables.I, np.array(problem.tables.W), q0[None].copy()
    lead(I, W, problem.tables.before, problem.constants(slice(0, 2))[:, 0], q)
    assert W[I[e.STATUS]] == 0.0
    there = chain.with_parameters(left_rod=float(rods[1]))
    assert np.abs(fb.closure_residual(there, q[0])).max() < 1e-14 and side(there, q[0]) == side(chain, q0)


def test_what_cannot_be_assembled_or_followed_is_data():
    chain = five_bar()
    motion = motion_of(chain, size=0.5)
    values = {"left_rod": [0.2126, 0.01, 0.13, 0.22]}
    found = fb.sweep(chain, motion, parameters=values, of=("torque", "peak_torque"))
    assert found.status.tolist() == [Status.OK, Status.OPEN, Status.SINGULAR, Status.OK]
    assert found.reached.tolist() == [21, 0, found.reached[2], 21] and 0 < found.reached[2] < 21
    assert np.isnan(found["peak_torque"][[1, 2]]).all() and np.isnan(found["torque"][[1, 2]]).all()
    assert np.isfinite(found["torque"][[0, 3]]).all() and found.best("peak_torque") in (0, 3)
    for i in (1, 2):
        with pytest.raises(AssemblyError):
            one = chain.with_parameters(left_rod=values["left_rod"][i])
            fb.drive(one, motion, near=fb.assemble(one, motion.q[0], near=home(chain)))


@pytest.mark.parametrize("side", ["upper", "lower"])
def test_a_design_out_of_its_limits_says_so_unless_they_are_ignored(side):
    chain, sign = five_bar(), 1.0 if side == "upper" else -1.0
    model, values = chain.model.copy(), {"left": [0.15, 0.19]}
    place = chain.columns("left_rod")[0].start
    q = sign * fb.sweep(chain, motion_of(chain), parameters=values, of="q")["q"][:, :, place]
    bound = 0.5 * (q[0].max() + q[1].max())
    limit = np.array(getattr(model, f"{side}PositionLimit"))
    limit[place] = sign * bound
    setattr(model, f"{side}PositionLimit", limit)
    tight = replace(chain, model=model)
    found = fb.sweep(tight, motion_of(chain), parameters=values)
    assert sorted(found.status.tolist()) == [Status.OK, Status.LIMITS]
    bad = int(np.argmax(found.status))
    assert found.reached[bad] == int(np.argmax(q[bad] > bound))
    assert fb.sweep(tight, motion_of(chain), parameters=values, limits="ignore").ok.all()


def test_a_spring_whose_ends_meet_has_no_direction():
    chain = five_bar()
    sprung = chain.with_springs([fb.Spring("left_rod_P", "right_rod_P", 10.0, 0.1)])
    assert (
        fb.sweep(sprung, motion_of(chain), parameters={"left": [0.15, 0.16]}).status.tolist() == [Status.SINGULAR] * 2
    )


def test_a_placement_that_turns_once_takes_its_joints_along():
    """The way goes round with it, by points in between; both ends look the same."""
    chain = five_bar().with_parameters(left=0.05)
    turned = placed(chain, {"left": [("turn", [0, 0, 0, 0, 0, 1.0])]}, turn=0.0)
    found = fb.sweep(
        turned, motion_of(chain, 3, 0.01), parameters={"turn": [0.0, 2.0 * np.pi]}, of="q", limits="ignore"
    )
    assert found.ok.all()
    way = found["q"][1] - found["q"][0]
    place = chain.columns("left_rod")[0].start
    wanted = np.zeros_like(way)
    wanted[:, place] = -2.0 * np.pi
    np.testing.assert_allclose(way, wanted, rtol=0.0, atol=1e-12)


def test_a_design_that_leaves_the_plane_is_told():
    chain = five_bar()
    lifted = placed(
        chain, {"left_rod": [("lift", [0, 0, 1.0, 0, 0, 0]), ("turn", [0, 0, 0, 0, 1.0, 0])]}, lift=0.0, turn=0.0
    )
    values = {"lift": [0.0, 0.01, 0.0], "turn": [0.0, 0.0, 0.3]}
    found = fb.sweep(lifted, motion_of(chain), parameters=values)
    assert found.status.tolist() == [Status.OK, Status.UNLIKE, Status.UNLIKE]


def test_a_link_cut_down_to_less_than_nothing_is_data():
    light = six_bar().with_inertias({"strut": pin.Inertia(0.01, np.zeros(3), np.eye(3) * 1e-5)})
    length = light.parameters["strut"]
    found = fb.sweep(light, motion_of(light), parameters={"strut": [length, 0.05]}, near=home(light))
    assert found.status.tolist() == [Status.OK, Status.UNREAL]


def test_bodies_of_their_own_are_what_score_makes_of_them():
    chain = five_bar()
    motion, rng = motion_of(chain), np.random.default_rng(1)
    pi = chain.inertial_parameters * rng.uniform(0.5, 1.5, (7, 4, 1))
    names = ("rms_torque", "peak_torque", "rms_shaking_force", "mean_square_shaking_moment", "peak_frame_force")
    found = fb.sweep(chain, motion, inertias=pi, of=names, about=(0.1, 0.2, 0.0))
    wanted = fb.score(chain, motion, pi, terms=names, about=(0.1, 0.2, 0.0))
    for name in names:
        np.testing.assert_allclose(found[name], wanted[name], rtol=1e-11)


def test_bodies_of_their_own_on_other_lengths():
    chain, motion = five_bar(), motion_of(five_bar())
    pi = np.stack([chain.inertial_parameters * s for s in (0.7, 1.3)])
    found = fb.sweep(chain, motion, parameters={"left": [0.14, 0.17]}, inertias=pi, of="torque")
    for i, left in enumerate((0.14, 0.17)):
        one = chain.with_parameters(left=left).with_inertial_parameters(pi[i])
        torque = fb.inverse_dynamics(one, fb.drive(one, motion, near=home(chain))).torque
        np.testing.assert_allclose(found["torque"][i], torque, rtol=0.0, atol=SAME * np.abs(torque).max())


def test_a_body_that_the_chain_does_not_have_may_come_in():
    chain = five_bar()
    bare = chain.with_inertias({"left": pin.Inertia.Zero()})
    found = fb.sweep(bare, motion_of(chain), inertias=chain.inertial_parameters[None], of="torque")
    wanted = fb.sweep(chain, motion_of(chain), inertias=chain.inertial_parameters[None], of="torque")
    np.testing.assert_array_equal(found["torque"], wanted["torque"])


def test_numbers_are_those_of_their_series():
    chain, motion = five_bar(), motion_of(five_bar())
    of = [f"{r}{q}" for r in ("", "peak_", "rms_", "mean_square_") for q in QUANTITIES] + ["work"]
    found = fb.sweep(chain, motion, parameters={"left": [0.14, 0.17]}, of=of)
    for q in QUANTITIES:
        x = found[q]
        np.testing.assert_allclose(found[f"mean_square_{q}"], (x**2).sum(axis=2).mean(axis=1), rtol=SAME)
        np.testing.assert_allclose(found[f"rms_{q}"] ** 2, found[f"mean_square_{q}"], rtol=SAME)
        size = np.linalg.norm(x, axis=2) if "force" in q or "moment" in q else np.abs(x).max(axis=2)
        np.testing.assert_allclose(found[f"peak_{q}"], size.max(axis=1), rtol=SAME)
    va = found["v"][:, :, chain.actuated_index]
    np.testing.assert_array_equal(found["power"], found["torque"] * va)
    spent = np.maximum(found["power"], 0.0).sum(axis=2)
    np.testing.assert_allclose(found["work"], np.trapezoid(spent, motion.t, axis=1), rtol=SAME)


def many(n: int = 1200) -> dict[str, np.ndarray]:
    rng, chain = np.random.default_rng(5), five_bar()
    return {k: chain.parameters[k] * rng.uniform(0.5, 1.5, n) for k in ("left", "left_rod", "right_rod")}


def alike(one: Sweep, other: Sweep) -> None:
    assert np.array_equal(one.status, other.status) and np.array_equal(one.reached, other.reached)
    for name in one.values:
        assert np.array_equal(one[name], other[name], equal_nan=True)


def test_threads_and_neighbours_change_no_digit():
    chain, motion, values = five_bar(), motion_of(five_bar(), 11), many()
    one = fb.sweep(chain, motion, parameters=values, threads=1)
    assert 0 < one.ok.sum() < len(one)
    alike(one, fb.sweep(chain, motion, parameters=values, threads=3))
    order = np.random.default_rng(0).permutation(len(one))
    mixed = fb.sweep(chain, motion, parameters={k: x[order] for k, x in values.items()}, threads=2)
    assert np.array_equal(mixed["rms_torque"], one["rms_torque"][order], equal_nan=True)


def test_blocks_of_any_size_know_nothing_of_the_design_before():
    chain = tilted_delta()
    values = {"askew": np.linspace(0.1, 0.5, 12), "arm": np.linspace(0.1, 0.04, 12)}
    one = fb.sweep(chain, motion_of(chain), parameters=values, of="torque", near=home(chain))
    back = fb.sweep(chain, motion_of(chain), parameters={k: x[::-1] for k, x in values.items()}, of="torque")
    assert one.ok.all() and np.array_equal(one["torque"], back["torque"][::-1])


def test_progress_tells_how_many_are_done():
    told: list[tuple[int, int]] = []
    fb.sweep(five_bar(), motion_of(five_bar(), 11), parameters=many(600), progress=lambda *x: told.append(x))
    assert told[-1] == (600, 600) and len(told) > 1
    assert all(a < b for (a, _), (b, _) in pairwise(told))


def test_a_sweep_is_short_to_look_at_and_its_arrays_are_read_only():
    found = fb.sweep(
        five_bar(), motion_of(five_bar()), parameters={"left_rod": [0.21, 0.01, 0.02]}, of=("torque", "work")
    )
    assert repr(found).startswith("Sweep(3 designs: 1 ok, ") and "work from" in repr(found) and len(repr(found)) < 200
    assert not found["torque"].flags.writeable and found.parameters["left_rod"].tolist() == [0.21, 0.01, 0.02]
    nothing = fb.sweep(five_bar(), motion_of(five_bar()), parameters={"left": []})
    assert len(nothing) == 0 and repr(nothing) == "Sweep(0 designs: none)"


@pytest.mark.parametrize(
    ("change", "kind", "message"),
    [
        ({"parameters": {"lfet": [0.1]}}, UnknownNameError, r"Unknown parameter 'lfet'; known: .*left.* mean 'left'"),
        ({"of": "rms_torqe"}, UnknownNameError, r"Unknown quantity of a sweep 'rms_torqe'; known: .*rms_torque"),
        ({"of": ()}, InvalidInputError, "of = .* must name what is wanted, some of torque, "),
        (
            {"parameters": None},
            InvalidInputError,
            "designs = None but must be given by parameters, by inertias, or both",
        ),
        ({"parameters": [0.1]}, InvalidInputError, "parameters = .* must map names to arrays"),
        ({"parameters": {"left": [0.1, np.nan]}}, InvalidInputError, r"parameter left\[1\] = nan but must be finite"),
        ({"parameters": {"left": [[0.1]]}}, InvalidInputError, r"shape of parameter left = .* must be \(n,\)"),
        (
            {"parameters": {"left": [0.1, -0.1]}},
            InvalidInputError,
            "length left of design 1 = -0.1 but must be positive",
        ),
        (
            {"parameters": {"left": [0.1, 0.2], "right": [0.1, 0.2, 0.3]}},
            InvalidInputError,
            "numbers of designs = {'left': 2, 'right': 3} but must be the same for all",
        ),
        ({"inertias": np.zeros((2, 3, 10))}, InvalidInputError, r"shape of inertias = .* must be \(n, 4, 10\)"),
        ({"inertias": -np.ones((1, 4, 10))}, InvalidInputError, "inertias of design 0, joint left .* is no body"),
        ({"inertias": np.eye(10)[[1] * 4][None]}, InvalidInputError, "inertias of design 0, joint left .* is no body"),
        ({"threads": 0}, InvalidInputError, "threads = 0 but must be an integer of at least 1"),
        ({"limits": "loose"}, InvalidInputError, "limits = loose|limits = 'loose'"),
        ({"client": "tcp://"}, InvalidInputError, "client = .*dask.distributed"),
    ],
)
def test_what_is_wrong_is_said_at_once(change, kind, message):
    with pytest.raises(kind, match=message):
        fb.sweep(five_bar(), motion_of(five_bar()), **({"parameters": {"left": [0.15]}} | change))


def test_a_motion_that_leaps_is_refused():
    leap = fb.Motion([0.0, 1.0], [[0.0, 0.0], [1e7, 0.0]], np.zeros((2, 2)), np.zeros((2, 2)))
    with pytest.raises(InvalidInputError, match=r"step of motor 0 to sample 1 = .* Take more samples"):
        fb.sweep(five_bar(), leap, parameters={"left": [0.15]})


def test_a_chain_that_cannot_be_assembled_is_an_error():
    chain = five_bar()
    motion = motion_of(chain)
    far = chain.with_parameters(left_rod=0.01)
    with pytest.raises(AssemblyError):
        fb.sweep(far, motion, parameters={"left": [0.15]}, near=home(chain))


@pytest.mark.parametrize("name", ["five", "six"])
def test_a_chain_read_from_its_file_is_swept_alike(name, tmp_path):
    """There every point is a link of its own on a fixed joint, which moves with it."""
    chain, values = CHAINS[name](), designs(name)
    read = fb.load(fb.save(chain, tmp_path / "chain.urdf")[0])
    one, other = (fb.sweep(c, motion_of(chain), parameters=values, of=EVERY, near=home(chain)) for c in (chain, read))
    for quantity in EVERY:
        np.testing.assert_allclose(other[quantity], one[quantity], rtol=0.0, atol=1e-9 * np.abs(one[quantity]).max())


def test_a_motion_of_other_motors_is_refused():
    with pytest.raises(InvalidInputError, match=r"motion columns = 1 but must be 2, one for each of left, right"):
        fb.sweep(five_bar(), motion_of(slider()), parameters={"left": [0.15]})


def test_numbers_beyond_what_can_be_computed_are_refused():
    with pytest.raises(InvalidInputError, match=r"mean_square_power of design 0 = .* is beyond what can be computed"):
        pi = 1e160 * five_bar().inertial_parameters[None]
        fb.sweep(five_bar(), motion_of(five_bar()), inertias=pi, of="mean_square_power")


def test_a_plate_whose_sides_cross_is_no_body():
    made = Linkage("plated")
    made.points({"A": (0, 0), "B": (0.4, 0), "C": (0.05, 0.087), "D": (0.33, 0.29), "E": (0.36, 0.4), "F": (0.1, 0.3)})
    made.ground("A", "B")
    made.bar("crank", "A", "C")
    made.plate("coupler", "C", "D", "E", "F")
    made.bar("rocker", "B", "D")
    made.motor("crank", at="A")
    chain = made.chain()
    across = chain.parameters["coupler_E_y"]
    found = fb.sweep(chain, motion_of(chain), parameters={"coupler_E_y": [across, -across]}, of="peak_torque")
    assert found.status.tolist() == [Status.OK, Status.UNREAL]
    with pytest.raises(InvalidInputError, match="sides that cross"):
        chain.with_parameters(coupler_E_y=-across)


def test_a_fixed_joint_moves_with_its_link():
    """As read from a file, where a point is a link on a fixed joint: a closure may be at either."""
    chain = five_bar()
    model, old = chain.model.copy(), next(f for f in chain.model.frames if f.name == "left_rod_P")
    fixed = model.addFrame(pin.Frame("fixed", old.parentJoint, 0, old.placement, pin.FrameType.FIXED_JOINT), False)
    model.frames[model.getFrameId("left_rod_P")].parentFrame = fixed
    other = replace(chain, model=model, closures=(fb.Closure(("fixed", "right_rod_P"), name="P"),))
    values = {"left_rod": [0.2, 0.22]}
    one, two = (fb.sweep(c, motion_of(chain), parameters=values, of="torque", near=home(chain)) for c in (chain, other))
    assert one.ok.all() and np.array_equal(one["torque"], two["torque"])
