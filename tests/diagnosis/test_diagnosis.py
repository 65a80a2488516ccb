"""Diagnosis: known mobilities, redundancies, singularities, motors and reactions; what is wrong is said."""

from __future__ import annotations

import dataclasses
import time

import families
import numpy as np
import pinocchio as pin
import pytest
from mechanisms import (
    TILTED,
    add,
    at,
    bennett,
    body,
    double_four_bar,
    five_bar,
    four_bar,
    parallelogram,
    point,
    rscr,
    rssr,
    side_by_side,
    slider_crank,
    welded_four_bar,
)

import fivebar_pin as fb
from fivebar_pin import paper
from fivebar_pin._arrays import block_svd
from fivebar_pin.closures import Coupling, Distance
from fivebar_pin.diagnosis import Actuation, diagnose
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.mechanism.idle import Kind

# Mechanism, mobility, rank of the closures, rows implied always, rows implied on the loop only.
KNOWN = {
    "five-bar": (five_bar(), 2, 2, 1, 0),
    "five-bar, tilted, hinge": (five_bar(base=TILTED, kind="revolute"), 2, 2, 3, 0),
    "the paper's": (paper.table_1("I", "unbalanced").chain(), 2, 2, 1, 0),
    "four-bar": (four_bar(), 1, 2, 1, 0),
    "four-bar, unbounded": (four_bar(joint=pin.JointModelRUBZ), 1, 2, 1, 0),
    "four-bar, welded": (welded_four_bar(base=TILTED), 1, 3, 3, 0),
    "slider-crank": (slider_crank(base=TILTED), 1, 2, 1, 0),
    "RSSR": (rssr(base=TILTED), 1, 3, 0, 0),
    "RSSR with two balls": (rssr(ball=True), 1, 3, 0, 0),
    "RSCR": (rscr()[0], 1, 5, 0, 0),
    "Bennett": (bennett()[0], 1, 2, 0, 3),
    "double four-bar": (double_four_bar(), 1, 4, 2, 0),
    "parallelogram": (parallelogram(), 1, 2, 1, 0),
}


def texts(diagnosis, severity: str) -> str:
    return "\n".join(p.text for p in diagnosis.problems if p.severity == severity)


@pytest.mark.parametrize(("chain", "mobility", "rank", "always", "closed"), KNOWN.values(), ids=KNOWN.keys())
def test_mobility_and_redundancy_of_known_mechanisms(chain, mobility, rank, always, closed):
    d = diagnose(chain)
    assert (d.mobility, d.generic_mobility) == (mobility, mobility)
    assert (d.rank, d.generic_rank, d.rows) == (rank, rank, rank + always + closed)
    assert [r.scope for r in d.redundant].count("always") == always
    assert [r.scope for r in d.redundant].count("closed") == closed
    assert len(d.redundant) == always + closed
    assert not d.is_singular
    assert d.gap <= 1e-12
    assert np.abs(fb.closure_residual(chain, d.q)).max() <= 1e-12
    assert np.sum(d.singular_values > 1e-9) == rank


@pytest.mark.parametrize("seed", range(5))
def test_verdicts_do_not_depend_on_the_seed(seed):
    for chain, mobility, rank, _, _ in KNOWN.values():
        d = diagnose(chain, seed=seed)
        assert (d.generic_mobility, d.generic_rank) == (mobility, rank)
        assert d.actuation is Actuation.EXACT


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_verdicts_do_not_depend_on_the_size(scale):
    d = diagnose(five_bar(tuple(scale * a for a in (0.5, 1.2, 1.0, 0.6, 0.9))))
    assert (d.mobility, d.rank) == (2, 2)
    # Five lengths grow alike, so the scaled distance to the singularity is a property of the shape.
    other = diagnose(five_bar(), np.array(d.q))
    assert d.sigma == pytest.approx(other.sigma, rel=1e-6)


@pytest.mark.parametrize(("chain", "mobility", "rank", "always", "closed"), KNOWN.values(), ids=KNOWN.keys())
def test_redundant_combinations_vanish(chain, mobility, rank, always, closed):
    from fivebar_pin.mechanism.loops import loops_of

    d, loops = diagnose(chain), loops_of(chain)
    names = [f"{c.name}.{row}" for c in chain.closures for row in c.row_names]
    everywhere = loops.tree.integrate(
        np.repeat(d.q[None], 5, axis=0), np.random.default_rng(0).normal(size=(5, chain.nv))
    )
    for row in d.redundant:
        assert row.weights[f"{row.closure}.{row.row}"] == pytest.approx(1.0)
        weights = np.array([row.weights.get(n, 0.0) for n in names])
        places = everywhere if row.scope == "always" else d.q[None]
        poses = loops.tree.poses(places)
        J = loops.row_scale[:, None] * loops.see(poses.q).J * loops.column_scale
        assert np.abs(np.einsum("m,nmk->nk", weights, J)).max() <= 1e-7


def test_planar_row_is_named():
    d = diagnose(five_bar())
    assert [str(r) for r in d.redundant] == ["tip.z always"]
    assert "redundant rows tip.z" in texts(d, "note")


def test_double_four_bar_lying_flat_has_mobility_three():
    d = diagnose(double_four_bar(), np.zeros(5))
    assert (d.mobility, d.generic_mobility) == (3, 1)
    assert (d.rank, d.generic_rank) == (2, 4)
    assert d.is_singular
    assert not d.ok
    assert {(r.closure, r.row) for r in d.redundant if r.scope == "here"} == {("pin0", "x"), ("pin1", "x")}
    assert "this configuration is singular: mobility 3 instead of 1" in texts(d, "error")
    assert "mobility     3 here, 1 in general (singular)" in str(d)
    assert d.sigma == 0.0
    upright = diagnose(double_four_bar(), np.array([1.2, 1.2, -1.2, -1.2, 1.2]))
    assert (upright.mobility, upright.ok) == (1, True)


def test_without_a_configuration_a_regular_one_is_taken_and_the_flat_one_is_mentioned():
    d = diagnose(double_four_bar())
    assert (d.mobility, d.is_singular, d.ok) == (1, False, True)
    assert "singular: mobility 3 instead of 1" in texts(d, "warning")


@pytest.mark.parametrize("rods", [False, True], ids=["a belt beside a coupler", "two rods"])
def test_what_shares_a_load_only_off_the_flat_neutral_configuration_is_not_called_determinate(rods):
    """At zero the pins lie on one line and pull nowhere; anywhere else the redundant members strain each other."""
    if rods:
        model = pin.Model()
        left, right = (add(model, 0, pin.JointModelRZ(), at(x), name, body(1)) for x, name in ((0.0, "a"), (1.0, "b")))
        ends = [
            (point(model, left, f"l{k}", p), point(model, right, f"r{k}", p))
            for k, p in enumerate((at(0.3), at(0.0, 0.3)))
        ]
        chain = fb.ClosedChain(model, [Distance(pair, 1.0) for pair in ends], ("a",))
        shared = [0, 1]
    else:
        plain = parallelogram()
        belt = Coupling({"crank": 1.0, "rocker": -1.0}, name="belt")
        chain, shared = fb.ClosedChain(plain.model, (*plain.closures, belt), ("crank",)), [1]
    for d in (diagnose(chain), diagnose(chain, fb.assemble(chain, [0.7], near=np.full(chain.nq, 0.7)))):
        assert all(not d.determinate_rows[k] for k in shared)
        assert len(next(r for r in d.redundant if r.scope == "closed").weights) == 2


def test_bennett_is_named_as_overconstrained():
    chain, q = bennett()
    d = diagnose(chain, q)
    assert "overconstrained" in texts(d, "warning")
    assert d.ok
    np.testing.assert_allclose(d.q, q, rtol=0.0, atol=1e-12)


def test_open_configuration_is_measured_and_the_nearest_closed_one_examined():
    d = diagnose(four_bar(), np.array([0.3, 0.2, 0.1]))
    start = fb.closure_residual(four_bar(), np.array([0.3, 0.2, 0.1]))
    assert d.gap == pytest.approx(np.abs(start).max(), rel=1e-12)
    assert f"closure pin by {d.gap:.3g} m or rad" in texts(d, "error")
    assert np.abs(fb.closure_residual(four_bar(), d.q)).max() <= 1e-12
    assert not d.ok


def test_loop_that_cannot_close_at_all_is_an_error_not_an_exception():
    d = diagnose(four_bar((0.1, 0.2, 0.3, 5.0)))
    assert "no configuration that closes the loops was found: closure pin stays open by" in texts(d, "error")
    gap = 5.0 - 0.6  # its largest component in the axes of the coupler
    assert gap / np.sqrt(2.0) * 0.999 <= d.gap <= gap * 1.001


def test_distance_to_the_type_2_singularity_is_the_smallest_passive_singular_value():
    chain = five_bar()
    q = fb.assemble(chain, [2.0, 1.0])
    d = diagnose(chain, q)
    # By hand: the passive columns are the tip seen from each elbow, turned; length scale from the chain.
    elbows = [0.5 * np.exp(2.0j), 0.9 + 0.6 * np.exp(1.0j)]
    tip = elbows[0] + 1.2 * np.exp(1j * (q[0] + q[1]))
    columns = np.array([[(1j * (tip - e)).real, (1j * (tip - e)).imag] for e in elbows]).T / chain.length
    s = np.linalg.svd(columns * [-1.0, 1.0], compute_uv=False)
    assert d.sigma == pytest.approx(s[-1], rel=1e-12)
    N = fb.complement(chain, q)
    assert d.amplification == pytest.approx(np.abs(N[chain.passive_index]).max(), rel=1e-10)


def test_type_2_singularity_is_found_and_nearness_warned_of():
    # The distal links in line: both cranks held, the elbow still moves.
    chain = five_bar((0.5, 0.8, 0.7, 0.6, 0.9))
    x = np.array([2.4, 0.0])
    from scipy.optimize import brentq

    stretch = lambda g: abs(0.9 + 0.6 * np.exp(1j * g) - 0.5 * np.exp(1j * x[0])) - 1.5  # noqa: E731
    x[1] = brentq(stretch, 0.2, 2.0, xtol=1e-15)
    elbows = 0.5 * np.exp(1j * x[0]), 0.9 + 0.6 * np.exp(1j * x[1])
    along = np.angle(elbows[1] - elbows[0])
    q = np.array([x[0], along - x[0], x[1], along + np.pi - x[1]])
    d = diagnose(chain, q)
    assert d.mobility == 2
    assert d.sigma < 1e-6
    assert "type 2 singularity" in texts(d, "error")
    assert "with left, right held" in texts(d, "error")
    bent = q + np.array([0.0, 3e-3, 0.0, -3e-3])
    near = diagnose(chain, fb.assemble(chain, x + np.array([0.0, 1e-5]), bent))
    assert 1e-6 < near.sigma < 1e-2
    assert near.ok
    assert "a type 2 singularity is near" in texts(near, "warning")


@pytest.mark.parametrize(
    ("actuated", "verdict", "free", "excess"),
    [
        (("left", "right"), Actuation.EXACT, (), 0),
        (("left",), Actuation.UNDER, ("left_elbow", "right", "right_elbow"), 0),
        (("left", "right", "left_elbow"), Actuation.OVER, (), 1),
        (("left", "right", "left_elbow", "right_elbow"), Actuation.OVER, (), 2),
        ((), Actuation.NONE, ("left", "left_elbow", "right", "right_elbow"), 0),
    ],
)
def test_actuation_of_a_five_bar(actuated, verdict, free, excess):
    d = diagnose(five_bar().with_actuated(actuated))
    assert (d.actuation, d.undetermined, d.excess) == (verdict, free, excess)
    assert d.ok is (verdict in (Actuation.EXACT, Actuation.NONE))
    if verdict is Actuation.UNDER:
        assert "with left held, left_elbow, right, right_elbow can still move. Actuate for example" in texts(d, "error")
    if verdict is Actuation.OVER:
        assert f"{excess} actuated joint(s) too many" in texts(d, "error")


def test_every_set_listed_determines_the_motion_and_the_best_is_first():
    chain = five_bar()
    d = diagnose(chain)
    assert len(d.actuated_sets) == 6  # any two of four
    sigmas = [s.sigma for s in d.actuated_sets]
    assert sigmas == sorted(sigmas, reverse=True)
    for option in d.actuated_sets:
        other = diagnose(chain.with_actuated(option.joints))
        assert other.actuation is Actuation.EXACT


def test_idle_spin_of_a_coupler_is_found():
    d = diagnose(rssr(ball=True))
    assert (d.actuation, d.undetermined, d.mobility) == (Actuation.EXACT, (), 1)
    assert [(x.kind, x.bodies) for x in d.idle] == [(Kind.SPIN, ("coupler_body",))]
    assert "coupler_body may spin about its own axis: held at rest unless it is simulated" in texts(d, "note")
    assert "mobility     1, and 1 held at rest" in str(d)


def test_motors_in_the_wrong_place_are_told_from_motors_too_few():
    # Two four-bars side by side, both motors on the first one.
    model = pin.Model()
    closures = []
    for k in range(2):
        crank = add(model, 0, pin.JointModelRZ(), at(3.0 * k), f"crank{k}", body(1))
        coupler = add(model, crank, pin.JointModelRZ(), at(0.4), f"coupler{k}", body(2))
        rocker = add(model, 0, pin.JointModelRZ(), at(3.0 * k + 1.0), f"rocker{k}", body(3))
        pair = (point(model, coupler, f"a{k}", at(1.1)), point(model, rocker, f"b{k}", at(0.9)))
        closures.append(fb.Closure(pair))
    d = diagnose(fb.ClosedChain(model, closures, ("crank0", "rocker0")))
    assert (d.actuation, d.excess) == (Actuation.CONFLICT, 1)
    assert d.undetermined == ("crank1", "coupler1", "rocker1")
    assert "2 parts that do not act on each other" in texts(d, "note")
    assert diagnose(fb.ClosedChain(model, closures, ("crank0", "crank1"))).ok


def with_pendulum() -> pin.Model:
    model = five_bar().model.copy()
    add(model, 0, pin.JointModelRY(), at(5.0), "pendulum", body(8))
    return model


def test_parts_that_nothing_holds_are_named():
    base = five_bar()
    d = diagnose(fb.ClosedChain(with_pendulum(), base.closures, base.actuated))
    assert "no closure and no motor touches pendulum: held at rest" in texts(d, "warning")
    assert "parts that do not act on each other's motion" in texts(d, "note")
    assert d.ok and d.mobility == 2


def test_locked_structure_and_locked_motor_are_named():
    model = pin.Model()
    joint = 0
    for k in range(3):
        joint = add(model, joint, pin.JointModelRZ(), at(0.0 if k == 0 else 1.0), f"j{k}", body(k))
    frames = (point(model, 0, "ground", at(2.0)), point(model, joint, "end", at(1.0)))
    d = diagnose(fb.ClosedChain(model, (fb.Closure(frames, "6d"),), ("j0",)))
    assert d.generic_mobility == 0
    assert "the mechanism cannot move: mobility 0" in texts(d, "error")
    assert "j0 cannot move at all" in texts(d, "error")


def test_closure_that_holds_nothing_is_named():
    model = five_bar().model.copy()
    point(model, 0, "here", at(0.1))
    elbow = model.getJointId("left")
    model.addFrame(pin.Frame("there", elbow, 0, at(), pin.FrameType.OP_FRAME))
    base = five_bar()
    point(model, 0, "pivot", at())
    idle = fb.Closure(("pivot", "there"), name="idle")  # the left crank's own pivot: closed at any angle
    d = diagnose(fb.ClosedChain(model, (*base.closures, idle), base.actuated))
    assert d.mobility == 2
    assert {(r.closure, r.row) for r in d.redundant if r.scope == "always"} >= {
        ("idle", "x"),
        ("idle", "y"),
        ("idle", "z"),
    }


def test_dead_point_is_noted():
    # Rod and crank in line: the slider of a slider-crank stands still whatever the crank does.
    chain = slider_crank()
    offset = np.arcsin(0.05 / 1.1)
    q = fb.assemble(chain, [offset], np.array([offset, 0.0, 0.7]))
    d = diagnose(chain, q)
    assert "slider stands still here (dead point)" in texts(d, "note")
    assert d.ok
    driven = diagnose(chain.with_actuated(["slider"]), q)
    assert "type 2 singularity" in texts(driven, "error")


def test_determinate_reactions_are_those_the_dynamics_does_not_mark():
    for chain, *_ in KNOWN.values():
        d = diagnose(chain)
        if d.actuation is not Actuation.EXACT:
            continue
        still = fb.motion.combine(*(fb.motion.constant([0.0], 0.0) for _ in chain.actuated))
        q = np.array(d.q)
        still = dataclasses.replace(still, q=[[_coordinate(chain, q, j) for j in chain.actuated]])
        loads = fb.inverse_dynamics(chain, fb.drive(chain, still, q))
        np.testing.assert_array_equal(d.determinate_joints, np.isfinite(loads.joint_reactions_local[0]))
        np.testing.assert_array_equal(d.determinate_closures, np.isfinite(loads.closure_reactions_local[0]))


def _coordinate(chain: fb.ClosedChain, q: np.ndarray, joint: str) -> float:
    from fivebar_pin.mechanism.loops import loops_of

    k = chain.actuated_index[chain.actuated.index(joint)]
    return float(loops_of(chain).tree.coordinate(q[None], int(k))[0])


def test_reactions_are_asked_by_name():
    d = diagnose(five_bar())
    assert d.determinate("left") == "fx fy mz"
    assert d.determinate("tip") == "fx fy mx my mz"
    assert diagnose(rscr()[0]).determinate("ball") == "fx fy fz mx my mz"
    with pytest.raises(UnknownNameError, match="joint or closure 'knee'; known: tip, left"):
        d.determinate("knee")


def test_bodies_that_cannot_be_are_named():
    base = rssr()

    def with_inertia(inertia: pin.Inertia):
        return diagnose(base.with_inertias({"rocker": inertia}))

    thin = with_inertia(pin.Inertia(1.0, np.zeros(3), np.diag([1.0, 0.1, 0.1])))
    assert "inertia of joint rocker: its principal moments 0.1, 0.1, 1 kg m2 break the triangle" in texts(thin, "error")
    parameters = np.array([1.0, 0.0, 0.0, 0.0, -0.1, 0.0, 0.1, 0.0, 0.0, 0.1])
    negative = with_inertia(pin.Inertia.FromDynamicParameters(parameters))
    assert "least principal moment -0.1 kg m2 is negative" in texts(negative, "error")
    ghost = with_inertia(pin.Inertia(0.0, np.zeros(3), np.eye(3)))
    assert "it has moments of inertia but no mass" in texts(ghost, "error")
    far = with_inertia(pin.Inertia(1.0, np.array([300.0, 0.0, 0.0]), np.eye(3)))
    assert "mass centre of the body of joint rocker lies" in texts(far, "warning")
    assert far.ok
    assert not (thin.ok or negative.ok or ghost.ok)


def test_planar_motion_does_not_mind_a_flat_body_without_moments_across():
    flat = pin.Inertia(1.0, np.array([0.2, 0.0, 0.0]), np.diag([0.0, 0.0, 0.3]))
    d = diagnose(four_bar(base=TILTED).with_inertias({"rocker": flat}))
    assert d.ok
    assert "The planar motion does not feel it" in texts(d, "warning")


def test_motion_without_inertia_is_an_error_unless_armature_gives_it_some():
    chain = five_bar().with_inertias({j: pin.Inertia.Zero() for j in ("left", "left_elbow", "right", "right_elbow")})
    assert "can move with no kinetic energy" in texts(diagnose(chain), "error")
    model = chain.model.copy()
    model.armature = np.full(4, 0.1)
    assert diagnose(fb.ClosedChain(model, chain.closures, chain.actuated)).ok
    held = five_bar().with_inertias({"left_elbow": pin.Inertia.Zero()})
    assert diagnose(held).ok  # the loop moves it, and the rest has inertia


def test_configuration_outside_the_limits_is_warned_of():
    base = five_bar()
    model = base.model.copy()
    model.upperPositionLimit[0] = 1.0
    d = diagnose(fb.ClosedChain(model, base.closures, base.actuated), fb.assemble(base, [2.0, 1.0]))
    assert "outside the limits of left" in texts(d, "warning")


def test_open_tree_is_called_one():
    d = diagnose(fb.ClosedChain(five_bar().model, (), ("left", "left_elbow", "right", "right_elbow")))
    assert (d.mobility, d.rank, d.rows, d.actuation) == (4, 0, 0, Actuation.EXACT)
    assert "there are no closures" in texts(d, "note")
    assert d.sigma == 1.0
    assert str(d).startswith("five_bar: ok\n")


def test_findings_come_gravest_first_and_print_in_full():
    d = diagnose(five_bar().with_actuated(["left"]), np.zeros(4))
    order = ["error", "warning", "note"]
    ranks = [order.index(p.severity) for p in d.problems]
    assert ranks == sorted(ranks)
    printed = str(d)
    assert printed.startswith("five_bar: NOT ok")
    for problem in d.problems:
        assert str(problem) in printed
    for field in ("mobility", "closures", "redundant", "actuated", "left free", "could drive", "determinate"):
        assert field in printed


def test_report_reads_as_documented():
    lines = str(diagnose(five_bar())).splitlines()
    assert lines[0] == "five_bar: ok"
    assert lines[1].split() == ["mobility", "2"]
    assert lines[2].split(maxsplit=1) == ["closures", "tip: 3 rows, rank 2"]
    assert "  actuated     left, right: exactly actuated" in lines


def test_diagnosis_is_frozen_and_arguments_are_checked():
    d = diagnose(five_bar())
    with pytest.raises(dataclasses.FrozenInstanceError):
        d.rank = 3  # type: ignore[misc]
    for name in ("q", "singular_values", "determinate_joints", "determinate_closures"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(d, name)[...] = 0
    with pytest.raises(InvalidInputError, match=r"shape of q = \(3,\) but must be \(4,\)"):
        diagnose(five_bar(), np.zeros(3))
    with pytest.raises(InvalidInputError, match=r"q\[2\] = nan but must be finite"):
        diagnose(five_bar(), [0.0, 0.0, np.nan, 0.0])


def row_of(count: int, *, loops: bool) -> fb.ClosedChain:
    """Return hinges one after the other, or as many four-bars side by side as have that many hinges."""
    model, closures = pin.Model(), []
    body, parent = pin.Inertia(1.0, np.array([0.2, 0.01, 0.0]), np.diag([0.01, 0.02, 0.03])), 0
    for k in range(count):
        place = pin.SE3(np.eye(3), np.array([0.4 if k % 3 == 1 else 0.1, 0.0, 0.0]))
        if loops and k % 3 != 1:
            parent, place = 0, pin.SE3(np.eye(3), np.array([2.0 * (k // 3) + 0.5 * (k % 3), 0.0, 0.0]))
        parent = model.addJoint(parent, pin.JointModelRZ(), place, f"j{k}")
        model.appendBodyToJoint(parent, body, pin.SE3.Identity())
        if loops and k % 3:
            tip = pin.SE3(np.eye(3), np.array([1.1 if k % 3 == 1 else 0.9, 0.0, 0.0]))
            model.addFrame(pin.Frame(f"f{k}", parent, 0, tip, pin.FrameType.OP_FRAME))
        if loops and k % 3 == 2:
            closures.append(fb.Closure((f"f{k - 1}", f"f{k}")))
    return fb.ClosedChain(model, closures, () if loops else tuple(f"j{k}" for k in range(count)))


@pytest.mark.parametrize("loops", [False, True])
def test_three_hundred_joints_are_diagnosed_soon(loops: bool) -> None:
    chain = row_of(300, loops=loops)
    before = time.process_time()
    found = fb.diagnose(chain)
    assert time.process_time() - before < 15.0  # 57 s and 4.4 GB with tables that grow with the cube of the joints
    assert found.mobility == (100 if loops else 300) and found.rank == (200 if loops else 0)
    assert len(found.redundant) == (100 if loops else 0) and found.gap < 1e-9


@pytest.mark.parametrize("shape", [(70, 90), (90, 70), (80, 80)])
def test_blocks_decompose_as_the_whole_does(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(3)
    A = np.zeros(shape)
    for k in range(0, 60, 6):
        A[k : k + 5, k : k + 4] = rng.normal(size=(5, 4)) @ np.diag([1.0, 1.0, 1.0, k % 4 > 0])
    A = A[rng.permutation(shape[0])][:, rng.permutation(shape[1])]
    U, s, Vt = block_svd(A)
    np.testing.assert_allclose(s, np.linalg.svd(A, compute_uv=False), rtol=0, atol=1e-13)
    np.testing.assert_allclose(U @ U.T, np.eye(shape[0]), rtol=0, atol=1e-13)
    np.testing.assert_allclose(Vt @ Vt.T, np.eye(shape[1]), rtol=0, atol=1e-13)
    np.testing.assert_allclose((U[:, : s.size] * s) @ Vt[: s.size], A, rtol=0, atol=1e-13)


@pytest.mark.parametrize("away", [1e-3, 1e-6, 1e-8])
def test_next_to_a_singular_configuration_the_rank_is_whole(away):
    """The flat parallelogram has lost a row; whatever lies beside it has not."""
    chain = parallelogram()
    beside, flat = (diagnose(chain, [x, -x, x]) for x in (away, 0.0))
    assert (beside.rank, beside.mobility, beside.is_singular) == (2, 1, False)
    assert 0.1 * away < beside.singular_values[1] < 10.0 * away
    assert (flat.rank, flat.mobility, flat.is_singular) == (1, 2, True)


def resized(chain: fb.ClosedChain, size: float) -> fb.ClosedChain:
    """Return the chain with all its lengths times a size."""
    model = chain.model.copy()
    for j in range(1, model.njoints):
        M, inertia = model.jointPlacements[j], model.inertias[j]
        model.jointPlacements[j] = pin.SE3(M.rotation, size * M.translation)
        model.inertias[j] = pin.Inertia(inertia.mass, size * inertia.lever, size**2 * inertia.inertia)
    for frame in model.frames:
        frame.placement = pin.SE3(frame.placement.rotation, size * frame.placement.translation)
    return fb.ClosedChain(model, chain.closures, chain.actuated)


@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_distances_to_singularities_do_not_depend_on_the_size_of_slides(size):
    """A slide counts in lengths of the mechanism as an angle counts in radians."""
    for chain, q in ((slider_crank(), fb.assemble(slider_crank(), [0.8])), rscr()):
        slides = np.array([j.nv == 1 and j.shortname().startswith("JointModelP") for j in list(chain.model.joints)[1:]])
        place = [j.idx_q for j, slide in zip(list(chain.model.joints)[1:], slides, strict=True) if slide]
        large = np.array(q)
        large[place] *= size
        one, other = diagnose(chain, q), diagnose(resized(chain, size), large)
        np.testing.assert_allclose(other.singular_values, one.singular_values, rtol=1e-9, atol=1e-12)
        assert other.sigma == pytest.approx(one.sigma, rel=1e-9)
        assert other.amplification == pytest.approx(one.amplification, rel=1e-9)


@pytest.mark.parametrize("off", [1e-3, 1e-6, 1e-8])
def test_a_configuration_that_is_all_but_closed_is_called_open(off):
    chain = five_bar()
    q, elbow = fb.assemble(chain, [2.0, 1.0]), np.array([0.0, 1.0, 0.0, 0.0])
    assert "loops are open at the given configuration" in texts(diagnose(chain, q + off * elbow), "error")
    assert diagnose(chain, q + 1e-11 * elbow).ok


@pytest.mark.parametrize("side", ["lower", "upper"])
def test_a_limit_on_either_side_is_told_with_its_joint(side):
    """The joint is the one whose coordinate it is, behind joints of several coordinates too."""
    chain, q = rscr()
    model = chain.model.copy()
    limit = getattr(model, f"{side}PositionLimit")
    limit[model.joints[model.getJointId("turn")].idx_q] = 0.7 + (0.1 if side == "lower" else -0.1)
    limited = fb.ClosedChain(model, chain.closures, chain.actuated)
    assert "outside the limits of turn" in texts(diagnose(limited, q), "warning")
    assert "outside the limits" not in texts(diagnose(chain, q), "warning")


def test_cosine_and_sine_of_any_size_are_the_same_angle():
    chain = four_bar(joint=pin.JointModelRUBZ)
    q = fb.assemble(chain, [0.8])
    one, other = diagnose(chain, q), diagnose(chain, 3.0 * q)
    assert other.ok
    np.testing.assert_allclose(other.q, one.q, rtol=0.0, atol=1e-12)


def test_a_motion_of_negative_energy_is_told_from_one_of_none():
    less = np.tile([0.01, 0.0, 0.0, 0.0, -1.0, 0.0, -1.0, 0.0, 0.0, -1.0], (4, 1))
    assert "can move with negative kinetic energy" in texts(
        diagnose(five_bar().with_inertial_parameters(less)), "error"
    )


def test_a_slide_out_of_the_plane_is_no_planar_motion():
    """Then a flat body is missed: it must be one in space."""
    model = pin.Model()
    arm = add(model, 0, pin.JointModelRZ(), at(), "arm", body(1))
    add(model, arm, pin.JointModelPZ(), at(0.5), "lift", pin.Inertia(1.0, np.zeros(3), np.diag([0.0, 0.0, 0.3])))
    d = diagnose(fb.ClosedChain(model, (), ("arm", "lift")))
    assert "no body has the inertia of joint lift" in texts(d, "error")
    assert "does not feel it" not in str(d)


def test_a_dozen_sets_are_listed_and_four_of_them_printed():
    d = diagnose(families.planar_rrr(3, 0, home=True))
    assert len(d.actuated_sets) == 12
    printed = str(d).splitlines()
    first = next(k for k, line in enumerate(printed) if "could drive" in line)
    assert "determinate reactions" in printed[first + 4]


def test_passive_speeds_are_without_bound_at_the_singularity():
    chain = parallelogram()
    flat, beside = diagnose(chain, np.zeros(3)), diagnose(chain, [0.01, -0.01, 0.01])
    assert (flat.sigma, flat.amplification) == (0.0, np.inf)
    assert 0.9 < beside.amplification < 1.1  # coupler and rocker turn as fast as the crank


def test_only_sets_that_determine_the_motion_are_listed():
    """Two four-bars that share nothing need a motor each, on any of their joints: nine pairs of fifteen."""
    d = diagnose(side_by_side((0.4, 1.1, 0.9, 1.0), (0.4, 1.1, 0.9, 1.0), tilt=TILTED))
    assert len(d.actuated_sets) == 9
    assert all({name[-1] for name in option.joints} == {"0", "1"} for option in d.actuated_sets)
    assert min(option.sigma for option in d.actuated_sets) > 1e-3


def test_of_many_joints_one_good_set_is_looked_for():
    """Six of eighteen joints can be chosen in 18564 ways: one set is built up, each joint the best of what is left.

    In three of the loops crank and coupler are in line and move faster than any joint of the other three: two of one
    loop are not taken for that.
    """
    rocking, even = (0.4, 1.1, 0.9, 1.0), (0.5, 1.0, 0.5, 1.0)
    in_line = fb.assemble(four_bar(rocking), [np.arccos((1.5**2 + 1.0 - 0.9**2) / 3.0)])
    q = np.concatenate([in_line, [0.8, -0.8, 0.8]] * 3)
    d = diagnose(side_by_side(*[rocking, even] * 3), q)
    (only,) = d.actuated_sets
    assert {name[-1] for name in only.joints} == set("012345")
    assert only.sigma > 0.01


@pytest.mark.parametrize(("largest", "ok"), [(0.2, True), (0.2001, False)])
def test_a_principal_moment_may_be_the_sum_of_the_other_two_and_no_more(largest, ok):
    """A flat body lies on the border; a body beyond it would have negative second moments."""
    flat = rssr().with_inertias({"rocker": pin.Inertia(1.0, np.zeros(3), np.diag([0.1, 0.1, largest]))})
    assert ("break the triangle" not in texts(diagnose(flat), "error")) == ok
