"""Samples and conditions of whole families of mechanisms: laws they keep, what is refused, and that it is done once."""

from __future__ import annotations

import gc
import weakref
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import families
import mechanisms
import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin.balancing import balance, balance_conditions, balance_problem, conditions, pareto, sampling
from fivebar_pin.balancing.branches import branches
from fivebar_pin.balancing.sampling import random_samples
from fivebar_pin.cli import main
from fivebar_pin.errors import AssemblyError, InvalidInputError, SolverError
from fivebar_pin.mechanism.per_chain import once_per_chain
from fivebar_pin.shipped import mechanisms as shipped

HUGE = float(np.finfo(np.float64).max)


def planar_rule(chain: fb.ClosedChain) -> list[int]:
    """Return the number of force and dynamic conditions of a planar linkage of hinges without special lengths."""
    links, loops = len(chain.joints), len(chain.closures)
    return [2 * (links - loops), 4 * links - (links + loops)]


def ranks(chain: fb.ClosedChain, seed: int = 0) -> list[int]:
    return [balance_conditions(chain, kind, seed=seed).rank for kind in ("force", "dynamic")]


def limited(chain: fb.ClosedChain, low: object, high: object) -> fb.ClosedChain:
    """Return the chain with other limits of its joints, one for all or (nq,)."""
    model = chain.model.copy()
    model.lowerPositionLimit = np.array(np.broadcast_to(low, model.nq), dtype=np.float64)
    model.upperPositionLimit = np.array(np.broadcast_to(high, model.nq), dtype=np.float64)
    return fb.ClosedChain(model, chain.closures, chain.actuated)


def actuated_of(chain: fb.ClosedChain, q: np.ndarray) -> np.ndarray:
    return q[:, [chain.model.joints[chain.model.getJointId(name)].idx_q for name in chain.actuated]]


@pytest.mark.parametrize("kind", ["watt", "stephenson"])
@pytest.mark.parametrize("seed", [1, 2, 3, 20, 56, 62])
def test_random_six_bars_follow_the_planar_rule(kind: str, seed: int) -> None:
    chain = families.six_bar(kind, seed)
    assert ranks(chain) == planar_rule(chain) == [6, 13]


@pytest.mark.parametrize(("legs", "seed", "home"), [(3, 0, False), (4, 0, True), (10, 0, False), (14, 1, False)])
def test_planar_platforms_on_many_legs_follow_the_rule(legs: int, seed: int, home: bool) -> None:
    chain = families.planar_rrr(legs, seed, home=home)
    assert ranks(chain) == planar_rule(chain)


@pytest.mark.parametrize(
    ("make", "known"),
    [(families.six_ups, [28, 100]), (families.six_rus, [34, 118]), (families.bricard, [8, 28])],
    ids=["6-UPS", "6-RUS", "Bricard"],
)
@pytest.mark.parametrize("home", [False, True])
def test_known_ranks_of_spatial_mechanisms(make: object, known: list[int], home: bool) -> None:
    assert ranks(make(3, home=home)) == known  # type: ignore[operator]


def test_bennetts_loop_has_four_and_thirteen_conditions() -> None:
    assert ranks(mechanisms.bennett()[0]) == [4, 13]


@pytest.mark.parametrize("make", [lambda: families.planar_rrr(10, 4), lambda: families.six_ups(5)], ids=["10R", "6U"])
def test_conditions_do_not_depend_on_the_samples(make: object) -> None:
    """The row spaces found from two seeds are one."""
    chain = make()  # type: ignore[operator]
    one, two = (balance_conditions(chain, "dynamic", seed=seed) for seed in (0, 1))
    np.testing.assert_allclose(two.basis.T @ (two.basis @ one.basis.T), one.basis.T, atol=1e-9)


@pytest.mark.parametrize(
    "make",
    [
        mechanisms.four_bar,
        mechanisms.slider_crank,
        lambda: mechanisms.rssr(),
        lambda: mechanisms.bennett()[0],
        lambda: families.six_ups(2),
        lambda: families.planar_rrr(4, 2),
    ],
)
def test_samples_are_closed_and_their_velocities_keep_them_so(make: object) -> None:
    from fivebar_pin.mechanism.loops import loops_of

    chain = make()  # type: ignore[operator]
    samples, loops = random_samples(chain, 60), loops_of(chain)
    assert len(samples) == 60
    assert np.abs(fb.closure_residual(chain, samples.q)).max() <= 1e-12 * max(1.0, chain.length)
    rate = np.matmul(loops.see(samples.poses.q).J, samples.N)
    assert np.abs(rate).max() < 1e-10 * max(1.0, chain.length)
    unit = samples.N / loops.column_scale[:, None]
    np.testing.assert_allclose(
        np.matmul(np.swapaxes(unit, 1, 2), unit), np.broadcast_to(np.eye(chain.na), (60, chain.na, chain.na)), atol=1e-9
    )


@pytest.mark.parametrize(
    ("low", "high"),
    [
        (-np.inf, np.inf),
        (-HUGE, HUGE),
        (-1e300, 1e300),
        (0.0, np.inf),
        (-HUGE, -2.0),
        (5.0, 6.0),
        (1.0, 1.2),
        (100.0, 101.0),
    ],
)
def test_limits_are_kept_where_they_are_real_and_huge_ones_are_none(low: float, high: float) -> None:
    """Warnings are errors here, overflow is one."""
    for plain, known in ((mechanisms.five_bar(), [6, 11]), (mechanisms.slider_crank(), [4, 7])):
        chain = limited(plain, low, high)
        assert ranks(chain) == known
        x = actuated_of(chain, random_samples(chain, 200).q)
        assert x.min() >= low and x.max() <= high
        assert np.ptp(x) > 0.5 * min(high - low, 2.0)


def test_a_stewart_platform_moves_within_the_strokes_of_its_legs() -> None:
    plain = families.six_ups(3, home=True)
    q = plain.references["home"]
    low, high = np.full(plain.nq, -np.inf), np.full(plain.nq, np.inf)
    rods = [plain.model.joints[plain.model.getJointId(name)].idx_q for name in plain.actuated]
    low[rods], high[rods] = q[rods] - 0.01, q[rods] + 0.01
    chain = limited(plain, low, high)
    assert ranks(chain) == [28, 100]
    assert sampling._shelf_of(chain)._draws[b"", 0]._closed > 40  # of 98 starts
    x = random_samples(chain, 200).q[:, rods]
    assert (x >= low[rods]).all() and (x <= high[rods]).all()


def test_samples_reach_every_assembly_mode() -> None:
    """All eight combinations of elbows of a 3-RRR, and both curves of a parallelogram's configurations."""
    chain = shipped.planar_3rrr()
    lower = [chain.model.joints[chain.model.getJointId(f"lower_{k}")].idx_q for k in (1, 2, 3)]
    q = random_samples(chain, 200).q
    assert len(np.unique(np.sign(np.sin(q[:, lower])), axis=0)) == 8
    q = random_samples(mechanisms.parallelogram(), 200).q
    assert 0.2 < np.mean(np.abs(np.sin(q[:, 0] + q[:, 1])) < 1e-9) < 0.8


@pytest.mark.parametrize("make", [families.six_bar, families.planar_rrr], ids=["six-bar", "14-RRR"])
def test_one_reference_configuration_is_enough_to_walk_from(make: object, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sampling, "_STARTS", 0)
    kind = {families.six_bar: "watt", families.planar_rrr: 14}[make]  # type: ignore[index]
    chain = make(kind, 5, home=True)  # type: ignore[operator]
    model = chain.model.copy()
    for joint in list(model.joints)[1:]:  # the neutral configuration is far beyond the limits
        at = chain.references["home"][joint.idx_q]
        model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q] = at - 0.05, at + 0.05
    chain = fb.ClosedChain(model, chain.closures, chain.actuated)
    assert ranks(chain) == planar_rule(chain)
    draw = sampling._shelf_of(chain)._draws[b"", 0]
    assert draw._tried == 2


def test_samples_lie_where_the_motors_hold_the_mechanism() -> None:
    """Next to a singularity a velocity of one at the motors moves some joint hundreds of times as fast."""
    for chain in (mechanisms.five_bar(), mechanisms.four_bar((1.0, 0.6, 0.8, 0.9)), families.six_bar("watt", 3)):
        speed = np.abs(fb.complement(chain, random_samples(chain, 1000).q)).max(axis=(1, 2))
        assert speed.max() < 30.0 * np.median(speed)


def test_a_hinge_does_not_close_with_its_axes_against_each_other() -> None:
    chain, _ = mechanisms.rscr()
    q = random_samples(chain, 200).q
    data, model = chain.model.createData(), chain.model
    first, second = (model.getFrameId(name) for name in chain.closures[0].frames)
    for one in q:
        pin.framesForwardKinematics(model, data, one)
        axes = [data.oMf[k].rotation @ chain.closures[0].axis for k in (first, second)]
        assert axes[0] @ axes[1] > 1.0 - 1e-9


@pytest.mark.parametrize("seed", range(4))
def test_walks_from_a_configuration_stay_on_its_branch(seed: int) -> None:
    """The two curves cross where the parallelogram lies flat; no walker changes over, and none passes by."""
    chain = mechanisms.parallelogram()
    for near in fb.assembly_modes(chain, [1.0]):
        q = random_samples(chain, 1000, near=near, seed=seed).q
        flat = np.abs(np.sin(q[:, 0] + q[:, 1])) < 1e-9
        assert flat.all() == flat.any() == (abs(np.sin(near[0] + near[1])) < 1e-9)
        assert (np.sign(np.sin(q[:, 0])) == np.sign(np.sin(near[0]))).all()
        assert np.ptp(q[:, 0]) > 2.0


def test_walks_from_a_configuration_turn_round_where_the_motor_loses_control() -> None:
    """A four-bar driven at its rocker has dead points, where coupler and crank lie in line."""
    chain = mechanisms.four_bar((0.9, 1.1, 0.4, 1.0))
    near = fb.assembly_modes(chain, [1.0])[0]
    sides = [
        np.sign(np.sin(q[:, 0] + q[:, 1] - q[:, 2])) for q in (near[None], random_samples(chain, 500, near=near).q)
    ]
    assert (sides[1] == sides[0]).all()
    everywhere = random_samples(chain, 500).q
    assert len(np.unique(np.sign(np.sin(everywhere[:, 0] + everywhere[:, 1] - everywhere[:, 2])))) == 2


def test_no_sample_has_more_motors_than_it_can_move() -> None:
    locked = mechanisms.five_bar().with_actuated(("left", "right", "left_elbow"))
    with pytest.raises(AssemblyError, match="too many joints are actuated"):
        random_samples(locked, 20)


def test_more_samples_begin_with_the_same_ones_whatever_was_asked_before() -> None:
    chain, again = mechanisms.five_bar(), mechanisms.five_bar()
    few = random_samples(chain, 50)
    many = random_samples(chain, 700)
    rest = random_samples(chain, 700, skip=650)
    np.testing.assert_array_equal(many.q[:50], few.q)
    np.testing.assert_array_equal(many.q[650:], rest.q)
    np.testing.assert_array_equal(random_samples(again, 700).N, many.N)
    assert not np.array_equal(random_samples(chain, 50, seed=1).q, few.q)
    assert len(np.unique(many.q, axis=0)) == 700


def test_a_walker_that_cannot_move_gives_no_samples() -> None:
    chain = limited(mechanisms.four_bar(), 1.0, 1.0)
    with pytest.raises(AssemblyError, match=r"only 9\d of 200 .* within the limits .* starts .* closed"):
        balance_conditions(chain, "force")


def test_evidence_when_nothing_closes() -> None:
    with pytest.raises(AssemblyError, match=r"1\d\d\d starts .*closed 0, smallest closure residual") as caught:
        balance_conditions(mechanisms.four_bar((0.1, 0.1, 0.1, 5.0)), "force")
    assert caught.value.closure == "pin"
    assert 4.7 / np.sqrt(2.0) - 1e-6 <= caught.value.residual <= 4.7 + 1e-6  # the larger of two rows of the gap


def test_near_must_keep_the_limits() -> None:
    chain = limited(mechanisms.four_bar(), 0.0, 0.5)
    near = fb.assembly_modes(chain, [1.0])[0]
    with pytest.raises(InvalidInputError, match=r"crank in near = 1\.0 but must lie within its limits \[0, 0\.5\]"):
        balance_conditions(chain, "force", near=near)


def test_a_rank_as_large_as_the_number_of_rows_asks_for_more_samples() -> None:
    """Ten samples give ten rows; thirteen conditions cannot show in them."""
    chain = families.six_bar("watt", 3)
    few, many = (balance_conditions(chain, "moment", samples=n) for n in (10, 400))
    assert few.rank == many.rank > 10
    assert many.samples == 400 and 10 < few.samples < 400


def test_an_unclear_rank_asks_for_more_samples_before_it_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(conditions, "_CLEAR", 1e30)
    with pytest.raises(SolverError, match="over 3200 configurations") as caught:
        balance_conditions(mechanisms.four_bar(), "force")
    assert caught.value.residual > 1e12


class Counted:
    """How often conditions were decided, and walks set out, for each set of arguments."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.decided: Counter[tuple[object, ...]] = Counter()
        self.drawn: Counter[tuple[object, ...]] = Counter()
        find, draw = conditions._conditions, sampling._Draw.__init__

        def decide(chain: fb.ClosedChain, kind: str, *rest: object) -> object:
            found = find(chain, kind, *rest)  # type: ignore[arg-type]
            self.decided[id(chain), kind, str(found.near), str(found.gravity), str(found.about)] += 1
            return found

        def drew(own: object, chain: fb.ClosedChain, near: np.ndarray | None, seed: int) -> None:
            self.drawn[id(chain), str(near), seed] += 1
            draw(own, chain, near, seed)  # type: ignore[arg-type]

        monkeypatch.setattr(conditions, "_conditions", decide)
        monkeypatch.setattr(sampling._Draw, "__init__", drew)

    def once(self, decided: int, drawn: int) -> None:
        """Assert so many sets of arguments, each asked once."""
        assert set(self.decided.values()) <= {1} and set(self.drawn.values()) <= {1}
        assert (len(self.decided), len(self.drawn)) == (decided, drawn)


def test_one_balance_finds_its_conditions_once(monkeypatch: pytest.MonkeyPatch) -> None:
    counted = Counted(monkeypatch)
    assert balance(shipped.five_bar_case_I(), "force").feasible
    counted.once(1, 1)


def test_a_balance_of_one_branch_finds_the_conditions_of_each_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """All modes, the named configuration, four tries."""
    chain = shipped.four_bar_antiparallelogram()
    counted = Counted(monkeypatch)
    design = balance(chain, "dynamic")
    assert design.feasible and design.branch is not None
    counted.once(6, 6)


def test_discs_for_a_design_find_no_conditions_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not in any of the steps in which they are looked for, nor when a design is solved in pieces afterwards."""
    counted = Counted(monkeypatch)
    design = balance(shipped.four_bar_crank_rocker(), "force", region=fb.balancing.Ball(0.3))
    assert fb.balancing.realise(design, shape="disc").attained
    assert fb.balancing.realise(design, shape="bar").weights
    counted.once(1, 1)


def test_near_and_the_sum_of_squares_find_conditions_once(monkeypatch: pytest.MonkeyPatch) -> None:
    chain = shipped.four_bar_crank_rocker()
    motion = fb.motion.harmonic(np.linspace(0.0, 1.0, 21), 0.5, 0.3, period=1.0)
    counted = Counted(monkeypatch)
    balance(chain, "force", near=chain.references["home"])
    fb.balancing.alici_shirinzadeh(chain, motion, region=fb.balancing.Ball(0.3))
    counted.once(2, 2)


def test_one_problem_finds_its_conditions_once_for_all_its_objectives(monkeypatch: pytest.MonkeyPatch) -> None:
    counted = Counted(monkeypatch)
    problem = balance_problem(shipped.four_bar_crank_rocker(), "force", objectives=("added_mass", "distance"))
    for minimise in ("added_mass", "distance", {"added_mass": 1.0, "distance": 0.1}):
        for solver in ("clarabel", "scipy"):
            assert problem.solve(minimise, solver=solver).feasible
    counted.once(1, 1)


def test_a_front_finds_its_conditions_once(monkeypatch: pytest.MonkeyPatch) -> None:
    chain = shipped.four_bar_crank_rocker()
    motion = fb.motion.harmonic(np.linspace(0.0, 1.0, 21), 0.5, 0.3, period=1.0)
    counted = Counted(monkeypatch)
    assert len(pareto(chain, "force", "added_mass", "rms_torque", 3, motions=motion)) == 3
    counted.once(1, 1)


@pytest.mark.parametrize(
    ("words", "times"),
    [
        (["conditions", "five_bar_case_I"], 1),
        (["balance", "four_bar_crank_rocker", "--out", "OUT"], 1),
        (["balance", "four_bar_antiparallelogram", "--kind", "dynamic", "--branch", "motion"], 1),
        (["balance", "four_bar_antiparallelogram", "--kind", "dynamic"], 6),
        (["pareto", "four_bar_crank_rocker", "added_mass", "rms_torque", "--points", "3"], 1),
        (["score", "four_bar_crank_rocker", "--random", "5"], 0),
    ],
)
def test_the_command_line_finds_conditions_once(
    words: list[str], times: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    counted = Counted(monkeypatch)
    assert main([str(tmp_path / "o") if word == "OUT" else word for word in words]) == 0
    counted.once(times, times)


def test_kinds_share_the_samples_of_a_chain(monkeypatch: pytest.MonkeyPatch) -> None:
    chain = mechanisms.five_bar()
    counted = Counted(monkeypatch)
    for kind in ("force", "moment", "dynamic", "static"):
        balance_conditions(chain, kind)
    balance(chain, None, bodies=["left"])
    counted.once(4, 1)


def test_threads_that_ask_at_once_draw_once(monkeypatch: pytest.MonkeyPatch) -> None:
    chain = mechanisms.five_bar()
    counted = Counted(monkeypatch)
    with ThreadPoolExecutor(4) as pool:
        drawn = list(pool.map(lambda _: random_samples(chain, 100).q, range(8)))
    assert all(np.array_equal(q, drawn[0]) for q in drawn)
    counted.once(0, 1)


def test_what_is_made_twice_at_once_is_one_for_all() -> None:
    chain, inner = mechanisms.five_bar(), []

    @once_per_chain
    def make(of: fb.ClosedChain) -> object:
        if not inner:
            inner.append(None)
            inner[0] = make(of)  # as another thread would
        return object()

    assert make(chain) is inner[0] is make(chain)


def test_draws_are_bounded_and_let_go_with_their_chain() -> None:
    chain = mechanisms.parallelogram()
    for seed in range(sampling._SHELF + 3):
        random_samples(chain, 10, seed=seed)
    assert len(sampling._shelf_of(chain)._draws) == sampling._SHELF
    gone = weakref.ref(chain)
    balance_conditions(chain, "force", near=[1.0, -1.0, 1.0])
    del chain
    gc.collect()
    assert gone() is None


def test_conditions_found_before_serve_a_sweep(monkeypatch: pytest.MonkeyPatch) -> None:
    chain = shipped.four_bar_crank_rocker()
    found = balance_conditions(chain, "force")
    alone = balance(chain, "force", region=fb.balancing.Ball(0.2))
    counted = Counted(monkeypatch)
    for reach in (0.1, 0.2):
        design = balance(chain, "force", region=fb.balancing.Ball(reach), conditions=found)
        assert design.conditions is found
    assert design.objective == pytest.approx(alone.objective, rel=1e-9)
    lighter = chain.with_inertial_parameters(0.5 * chain.inertial_parameters)
    assert balance(lighter, "force", conditions=found).feasible
    assert balance_problem(chain, "force", conditions=found).conditions is found
    counted.once(0, 0)


def test_conditions_of_one_branch_balance_that_branch() -> None:
    chain = shipped.four_bar_antiparallelogram()
    home = chain.references["home"]
    found = balance_conditions(chain, "dynamic", near=home)
    np.testing.assert_array_equal(found.near, home)
    design = balance(chain, "dynamic", conditions=found)
    assert design.feasible
    np.testing.assert_array_equal(design.branch, home)


def test_conditions_of_something_else_are_refused() -> None:
    chain, other = shipped.four_bar_crank_rocker(), mechanisms.four_bar()
    force = balance_conditions(chain, "force")
    down = balance_conditions(chain, "static", gravity=(0.0, -1.0, 0.0))
    moment = balance_conditions(chain, "moment")
    longer = shipped._four_bar(chain.name, (0.1, 0.36, 0.3, 0.4), side=1.0)
    refused = [
        (other, "force", {"conditions": force}, "must belong to four_bar"),
        (longer, "force", {"conditions": force}, "must belong to"),
        (chain, "dynamic", {"conditions": force}, "must be of kind 'dynamic'"),
        (chain, "force", {"conditions": force, "space": "spatial"}, "must be spatial"),
        (chain, "force", {"conditions": force, "near": chain.references["home"]}, "branch of near"),
        (chain, "static", {"conditions": down}, "must hold for gravity = 'any'"),
        (chain, "static", {"conditions": down, "gravity": (1.0, 0.0, 0.0)}, "must hold for gravity"),
        (chain, "moment", {"conditions": moment, "about": (1.0, 0.0, 0.0)}, "must be about"),
        (chain, None, {"conditions": force}, "no meaning where kind is None"),
    ]
    for one, kind, options, match in refused:
        with pytest.raises(InvalidInputError, match=match):
            balance(one, kind, **options)
        with pytest.raises(InvalidInputError, match=match):
            balance_problem(one, kind, **options)
    assert balance(chain, "static", conditions=down, gravity=(0.0, -9.81, 0.0)).feasible


def test_branches_states_its_arguments() -> None:
    chain = shipped.four_bar_antiparallelogram()
    with pytest.raises(TypeError, match="unexpected keyword"):
        branches(chain, balance_conditions(chain, "dynamic"), samples=3)  # type: ignore[call-arg]


@pytest.mark.parametrize("change", ["joint", "frame", "kind", "axis"])
def test_conditions_belong_to_all_lengths_and_closures_of_their_mechanism(change: str) -> None:
    """A joint moved, a closure's frame moved, another kind or axis of closure: each is another mechanism."""
    lengths = (0.4, 1.1, 0.9, 1.0)
    own = mechanisms.four_bar(lengths, kind="revolute")
    found = balance_conditions(own, "force")
    (closure,) = own.closures
    other = {
        "joint": mechanisms.four_bar((0.4, 1.1, 0.9, 1.001), kind="revolute"),
        "frame": mechanisms.four_bar((0.4, 1.101, 0.9, 1.0), kind="revolute"),
        "kind": mechanisms.four_bar(lengths),
        "axis": fb.ClosedChain(own.model, (fb.Closure(closure.frames, "revolute", (0.0, 0.0, -1.0)),), own.actuated),
    }[change]
    with pytest.raises(InvalidInputError, match="must belong to four_bar"):
        balance_problem(other, "force", conditions=found)
    again = mechanisms.four_bar(lengths, kind="revolute").with_actuated(["rocker"])
    assert balance_problem(again, "force", conditions=found).conditions is found
