"""Proposals: a mechanism whose sidecar is lost comes back the same, and an accident is not taken for a loop."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin.diagnosis import Evidence, Proposal, diagnose, propose_closures, propose_motors
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.shipped.mechanisms import solo_legs
from tests import mechanisms
from tests.mechanisms import add, at, body, point

SHIPPED = fb.io.shipped()


def shipped(name: str) -> fb.ClosedChain:
    return fb.load(fb.io.shipped_path(name))


def opened(chain: fb.ClosedChain, *, references: bool = False) -> fb.ClosedChain:
    """Return the tree alone: no closures, no motors and, unless kept, no configuration at which the loops close."""
    model = chain.model.copy()
    for name in () if references else chain.references:
        del model.referenceConfigurations[name]
    return replace(chain, model=model, closures=(), actuated=())


def renamed(chain: fb.ClosedChain, names: dict[str, str]) -> fb.ClosedChain:
    model = chain.model.copy()
    for frame in model.frames:
        frame.name = names.get(frame.name, frame.name)
    return replace(chain, model=model, closures=(), visuals=())


def anonymous(chain: fb.ClosedChain) -> tuple[fb.ClosedChain, dict[str, str]]:
    """Return a tree whose closing frames are called so that their names say nothing."""
    ends = [frame for closure in chain.closures for frame in closure.frames]
    names = {frame: f"{'qwertyuiop'[k]}{'qwertyuiop'[-k]}" for k, frame in enumerate(sorted(ends))}
    return renamed(opened(chain, references=True), names), names


def chosen(proposals: tuple[Proposal, ...]) -> dict[frozenset[str], str]:
    return {frozenset(p.closure.frames): p.closure.kind.value for p in proposals if p.chosen}


def loops(chain: fb.ClosedChain, names: dict[str, str] | None = None) -> dict[frozenset[str], str]:
    called = names or {}
    return {frozenset(called.get(f, f) for f in c.frames): c.kind.value for c in chain.closures}


def closing(chain: fb.ClosedChain, proposals: tuple[Proposal, ...]) -> fb.ClosedChain:
    return replace(chain, closures=tuple(p.closure for p in proposals if p.chosen))


@pytest.mark.parametrize("name", SHIPPED)
def test_a_mechanism_without_its_sidecar_is_closed_and_driven_as_it_was(name: str) -> None:
    chain = shipped(name)
    tree = opened(chain)
    proposals = propose_closures(tree)
    assert chosen(proposals) == loops(chain)
    again = closing(tree, proposals)
    assert {c.name for c in again.closures} == {c.name for c in chain.closures}
    assert {m.joint for m in propose_motors(again)} == set(chain.actuated)
    before, after = diagnose(chain), diagnose(again.with_actuated(chain.actuated))
    assert (after.generic_mobility, after.generic_rank, after.ok) == (
        before.generic_mobility,
        before.generic_rank,
        True,
    )


@pytest.mark.parametrize("name", ["four_bar_crank_rocker", "five_bar_case_I", "spatial_rssr", "six_bar_watt"])
def test_a_mechanism_without_its_sidecar_has_the_same_balancing_conditions(name: str) -> None:
    chain = shipped(name)
    again = closing(opened(chain), propose_closures(opened(chain))).with_actuated(chain.actuated)
    for kind in ("force", "dynamic"):
        assert fb.balance_conditions(again, kind).rank == fb.balance_conditions(chain, kind).rank


@pytest.mark.parametrize("name", SHIPPED)
def test_without_names_the_frames_that_coincide_at_home_tell_the_loops(name: str) -> None:
    chain = shipped(name)
    tree, names = anonymous(chain)
    proposals = propose_closures(tree)
    assert chosen(proposals) == loops(chain, names)
    for p in proposals:
        assert p.evidence is Evidence.COINCIDE
        assert p.gap < 1e-12 or not p.chosen


@pytest.mark.parametrize("sides", [("left",), ("left", "right")])
def test_legs_that_meet_at_home_are_joined_at_their_feet(sides: tuple[str, ...]) -> None:
    legs = solo_legs(sides)
    assert chosen(propose_closures(opened(legs, references=True))) == loops(legs)


def test_a_given_configuration_is_looked_at_instead_of_the_neutral_one() -> None:
    chain = shipped("planar_3rrr")
    tree, names = anonymous(chain)
    tree = opened(tree)
    assert not chosen(propose_closures(tree))
    proposals = propose_closures(tree, chain.references["home"])
    assert chosen(proposals) == loops(chain, names)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("closedloop1_A", "closedloop1_B"), ("closedloop3D_1A", "closedloop3D_1B"), ("loop_a", "loop_b"),
        ("closing_knee_1", "closing_knee_2"), ("closedloop3_A_3D", "closedloop3_B_3D"), ("closure_A", "closure_B"),
        ("loop_first", "loop_second"), ("left_closed_loop_start", "left_closed_loop_end"),
    ],
)  # fmt: skip
def test_names_of_two_sides_of_a_loop_are_sure(one: str, other: str) -> None:
    chain = mechanisms.five_bar(base=mechanisms.TILTED)
    tree = renamed(opened(chain), {"tip_left": one, "tip_right": other})
    (proposal,) = propose_closures(tree)
    assert proposal.closure.frames == (one, other)
    assert (proposal.evidence, proposal.sure, proposal.chosen) == (Evidence.NAMED, "sure", True)


@pytest.mark.parametrize(
    ("one", "other"), [("loop_1", "loop_3"), ("loop_A", "loop_C"), ("gripper_a", "gripper_b"), ("loopA1", "loopB1")]
)
def test_other_names_say_nothing(one: str, other: str) -> None:
    chain = mechanisms.five_bar()
    tree = renamed(opened(chain), {"tip_left": one, "tip_right": other})
    assert all(p.evidence is not Evidence.NAMED for p in propose_closures(tree))


@pytest.mark.parametrize(("word", "mobility"), [("3D", 2), ("6D", 1)])
def test_the_kind_that_names_state_is_taken(word: str, mobility: int) -> None:
    chain = mechanisms.five_bar()
    tree = renamed(opened(chain), {"tip_left": f"closedloop{word}_A", "tip_right": f"closedloop{word}_B"})
    (proposal,) = propose_closures(tree)
    assert proposal.closure.kind.value == word.lower()
    assert diagnose(closing(tree, (proposal,))).generic_mobility == mobility


def test_two_names_for_one_loop_close_it_once() -> None:
    model = mechanisms.five_bar().model.copy()
    for side, joint, x in (("A", "left_elbow", 1.2), ("B", "right_elbow", 1.0)):
        for k in (1, 2):
            point(model, model.getJointId(joint), f"closedloop{k}_{side}", at(x))
    one, other = propose_closures(fb.ClosedChain(model, (), ()))
    assert (one.chosen, other.chosen) == (True, False)
    assert other.reason == "it follows from the other closures: it takes no freedom away"


def test_names_on_one_body_and_points_named_otherwise_say_nothing() -> None:
    tree = opened(mechanisms.five_bar())
    model = tree.model.copy()
    elbow = model.getJointId("left_elbow")
    for name, joint in (
        ("closedloop_A", elbow), ("closedloop_B", elbow), ("D_one", elbow), ("D_two", elbow),
        ("E_one", 1), ("E_two", 2), ("E_three", 3), ("L_one", 1), ("L_two", 2),
    ):  # fmt: skip
        point(model, joint, name, at(0.1 * joint))
    model = renamed(replace(tree, model=model), {"left_body": "F_one", "right_body": "F_two"}).model
    proposals = propose_closures(replace(tree, model=model))
    assert {p.evidence for p in proposals} <= {Evidence.ENDS, Evidence.COINCIDE}


def test_the_frame_of_a_fixed_joint_is_no_second_end(tmp_path: Path) -> None:
    """URDF gives a marker's link and the fixed joint that carries it nearly one name."""
    text = fb.io.shipped_path("slider_crank").read_text()
    for old, new in (("B_rod", "closedloop_A"), ("B_slider", "closedloop_B")):
        text = text.replace(f'"{old}"', f'"{new}"').replace(f'"{old}_joint"', f'"{new}_joint"')
    (tmp_path / "one.urdf").write_text(text)
    (proposal,) = propose_closures(fb.load(tmp_path / "one.urdf", closures=(), actuated=()))
    assert set(proposal.closure.frames) == {"closedloop_A", "closedloop_B"}


def test_a_ball_of_three_hinges_is_joined_at_its_last_body() -> None:
    """The usual way to write a ball joint in a URDF: two crosses, and a stub that the rest is fixed to."""
    tree = two_arms(at(), joints=3)
    model = tree.model.copy()
    j, place = model.getJointId("other2"), model.frames[model.getFrameId("hand_other")].placement
    for kind, name in ((X(), "cross1"), (pin.JointModelRY(), "cross2"), (Z(), "stub")):
        j, place = add(model, j, kind, pin.SE3(place), name, body(8)), at()
    model.frames[model.getFrameId("hand_other")].name = "socket"
    tree = fb.ClosedChain(model, (), ())
    proposals = propose_closures(tree)
    assert chosen(proposals) == {frozenset(("hand_one", "stub_body")): "6d"}
    assert diagnose(closing(tree, proposals)).generic_mobility == 3


def test_only_the_loop_that_is_overconstrained_is_called_so() -> None:
    """Bennett's loop and a five-bar on one frame, both named: the five-bar is as good as alone."""
    chain, q = mechanisms.bennett()
    model = renamed(chain, {"hinge_ground": "closedloop1_A", "hinge_moving": "closedloop1_B"}).model
    for k, x in enumerate((3.0, 4.0)):
        j = add(model, 0, Z(), at(x), f"bar{k}", body(k))
        j = add(model, j, Z(), at(0.7), f"rod{k}", body(k))
        point(model, j, f"closedloop2_{'AB'[k]}", at(0.9))
    proposals = propose_closures(fb.ClosedChain(model, (), ()), np.r_[q, np.zeros(4)], kind="revolute")
    assert [p.chosen for p in proposals] == [True, True]
    assert ["overconstrained" in p.reason for p in proposals] == [True, False]


def two_bars(*, more: bool = False) -> fb.ClosedChain:
    """Two bars from the ground whose tips touch in neutral; with `more`, an arm that moves freely besides."""
    model = pin.Model()
    one = add(model, 0, pin.JointModelRZ(), at(), "one", body(1))
    other = add(model, 0, pin.JointModelRZ(), at(1.0), "other", body(2))
    point(model, one, "tip_one", at(0.4, 0.3))
    point(model, other, "tip_other", at(-0.6, 0.3))
    if more:
        arm = add(model, 0, pin.JointModelRY(), at(5.0), "arm", body(3))
        add(model, arm, pin.JointModelRX(), at(0.5), "hand", body(4))
    return fb.ClosedChain(model, (), ())


@pytest.mark.parametrize("more", [False, True])
def test_frames_that_touch_by_accident_are_not_joined_where_that_would_lock_them(more: bool) -> None:
    proposals = propose_closures(two_bars(more=more))
    (proposal,) = [p for p in proposals if set(p.closure.frames) == {"tip_one", "tip_other"}]
    assert proposal.gap < 1e-15
    assert not proposal.chosen
    assert proposal.reason == "it would lock one, other"


def test_an_accident_beside_a_real_loop_is_told_apart() -> None:
    """The coupler's middle happens to lie on a bar of the frame where the mechanism stands; joining it would lock."""
    chain = mechanisms.four_bar()
    q = fb.assembly_modes(chain, [0.8])[0]
    model, data = chain.model.copy(), chain.model.createData()
    pin.forwardKinematics(model, data, q)
    coupler = model.getJointId("coupler")
    point(model, coupler, "coupler_hole", at(0.5, 0.1))
    point(model, 0, "frame_hole", pin.SE3(data.oMi[coupler] * at(0.5, 0.1)))
    proposals = propose_closures(replace(chain, model=model, closures=()), q)
    assert chosen(proposals) == loops(chain)
    (left,) = [p for p in proposals if not p.chosen]
    assert set(left.closure.frames) == {"coupler_hole", "frame_hole"}
    assert left.reason.startswith("it would lock crank")


def branches(*joints: tuple[int, object, pin.SE3], marks: dict[str, tuple[int, pin.SE3]]) -> fb.ClosedChain:
    """Return a tree of joints (parent, kind, placement) with markers (joint, placement)."""
    model = pin.Model()
    model.addBodyFrame("base", 0, at(), 0)
    for k, (parent, kind, placement) in enumerate(joints):
        add(model, parent, kind, placement, f"j{k + 1}", body(k))
    for name, (joint, placement) in marks.items():
        point(model, joint, name, placement)
    return fb.ClosedChain(model, (), ())


Z, X, SLIDE = pin.JointModelRZ, pin.JointModelRX, pin.JointModelPX


def test_what_always_coincides_is_no_loop() -> None:
    """Two arms on one shaft, marked there: their frames meet whatever the joints do, and a closure holds nothing."""
    tree = branches((0, Z(), at()), (0, Z(), at()), marks={"u": (1, at(z=0.2)), "v": (2, at(z=0.2))})
    assert all(p.evidence is not Evidence.COINCIDE for p in propose_closures(tree))
    (proposal,) = propose_closures(tree, pairs=[("u", "v")])
    assert proposal.reason.endswith("no joint moves the two frames apart: it would hold nothing")


def test_joints_that_start_at_one_place_are_no_loop() -> None:
    """A telescope on a turret, the two jaws of a gripper, an arm folded back to its base where the file stands."""
    turret = branches((0, Z(), at()), (1, SLIDE(), at()), marks={})
    jaws = branches((0, SLIDE(), at()), (0, pin.JointModelPY(), at()), marks={})
    folded = branches((0, X(), at(x=1.0)), (1, Z(), at(y=1.0)), (2, X(), at(x=-1.0)), marks={"u": (3, at(y=-1.0))})
    for tree in (turret, jaws, folded):
        assert propose_closures(tree) == ()


def test_no_end_is_joined_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three spatial arms meet in one place where the file stands: two of them are joined, which two is a guess."""
    tree = two_arms(at(rpy=(0.4, 0.0, 0.7)))
    model = tree.model.copy()
    j = 0
    for k in range(4):
        j = add(
            model,
            j,
            Z(),
            pin.SE3(pin.exp3(np.array([0.3, k, 1.0])), np.array([0.4, 0.2, 0.1 * k])),
            f"third{k}",
            body(k),
        )
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    here = data.oMf[model.getFrameId("hand_one")]
    point(model, j, "hand_third", data.oMi[j].actInv(here * at(rpy=(0.7, 0.5, 0.0))))
    proposals = propose_closures(replace(tree, model=model))
    assert sum(p.chosen for p in proposals) == 1
    assert [p.reason for p in proposals if not p.chosen] == ["one of its ends is joined already"] * 2
    monkeypatch.setattr("fivebar_pin.diagnosis.proposals._MOST_JUDGED", 2)  # each takes a search: not of hundreds
    assert len(propose_closures(replace(tree, model=model))) == 2


def three_bars_on_a_pin(*names: str, aside: float = 0.0) -> fb.ClosedChain:
    """Return a bar and two telescopes on the ground whose tips meet in neutral; the third one's may lie aside."""
    joints = [(0, Z(), at()), (0, Z(), at(x=1.0)), (2, SLIDE(), at()), (0, Z(), at(y=-1.0)), (4, SLIDE(), at())]
    tips = [(1, at(x=0.4, y=0.3)), (3, at(x=-0.6, y=0.3)), (5, at(x=0.4, y=1.3 + aside))]
    return branches(*joints, marks=dict(zip(names, tips, strict=True)))


@pytest.mark.parametrize("names", [("P_bar", "P_rod", "P_strut"), ("one", "two", "three")])
def test_a_pin_that_three_bars_share_in_a_plane_is_closed_twice(names: tuple[str, ...]) -> None:
    tree = three_bars_on_a_pin(*names)
    proposals = propose_closures(tree)
    assert chosen(proposals) == {frozenset((names[0], other)): "3d" for other in names[1:]}
    assert diagnose(closing(tree, proposals)).generic_mobility == 1


def test_points_of_three_bodies_that_do_not_meet_are_not_one_pin() -> None:
    """A_leg1, A_leg2, A_leg3 are a point of each leg; two of these happen to meet here."""
    proposals = propose_closures(three_bars_on_a_pin("P_one", "P_two", "P_three", aside=0.5))
    assert chosen(proposals) == {frozenset(("P_one", "P_two")): "3d"}


def test_one_point_of_a_left_and_a_right_leg_is_no_loop_unless_they_meet() -> None:
    """S_left and S_right are two soles; the loops are where frames coincide. P_left and P_right may be a five-bar's."""
    bars = [(0, Z(), at()), (1, Z(), at(x=0.4)), (0, Z(), at(x=1.0)), (3, Z(), at(x=-0.4))]
    for one, other in (("S_left", "S_right"), ("S_fl", "S_fr"), ("S1_leftfoot", "S1_rightfoot")):
        marks = {one: (2, at(x=0.1)), other: (4, at(x=0.1)), "u": (2, at(0.2)), "v": (4, at())}
        (proposal,) = [p for p in propose_closures(branches(*bars, marks=marks)) if p.chosen]
        assert proposal.evidence is not Evidence.POINT and set(proposal.closure.frames) == {"u", "v"}
    meeting = branches(*bars, marks={"P_left": (2, at(x=0.2, y=0.3)), "P_right": (4, at(x=0.0, y=0.3))})
    assert chosen(propose_closures(meeting)) == {frozenset(("P_left", "P_right")): "3d"}


def test_a_third_bar_on_a_pin_that_goes_on_to_another_loop_is_pinned_not_welded() -> None:
    """Jansen's leg has such pins: the bar hangs on its hinge at the pin, and its other end belongs to a loop too."""
    made = fb.planar.Linkage("leg")
    made.ground(A=(0, 0), B=(0.4, 0), F=(0.9, 0.1))
    made.points(C=(0.05, 0.09), D=(0.36, 0.3), E=(0.8, 0.35))
    for name, points in (("crank", "AC"), ("coupler", "CD"), ("rocker", "BD"), ("link", "DE"), ("output", "FE")):
        made.bar(name, *points)
    made.motor("crank", at="A")
    chain = made.chain()
    tree = opened(chain)
    proposals = propose_closures(tree, chain.references["home"])
    assert sorted(chosen(proposals).values()) == ["3d", "3d"]
    assert diagnose(closing(tree, proposals)).generic_mobility == 1


def two_arms(turn: pin.SE3, *, joints: int = 4, marks: bool = True) -> fb.ClosedChain:
    """Two spatial arms whose hands meet in neutral, the second one's frame turned against the first one's."""
    rng = np.random.default_rng(3)
    model, hands = pin.Model(), []
    for side in ("one", "other"):
        j = 0
        for k in range(joints):
            place = pin.SE3(pin.exp3(rng.normal(size=3)), rng.normal(size=3))
            j = add(model, j, pin.JointModelRZ(), place, f"{side}{k}", body(k))
        hands.append(j)
    data = model.createData()
    pin.forwardKinematics(model, data, pin.neutral(model))
    here = pin.SE3(pin.exp3(rng.normal(size=3)), rng.normal(size=3))
    point(model, hands[0], "hand_one", data.oMi[hands[0]].actInv(here))
    point(model, hands[1], "hand_other", data.oMi[hands[1]].actInv(here * turn))
    return fb.ClosedChain(model, (), ())


@pytest.mark.parametrize(
    ("turn", "kind", "rows"),
    [
        (at(), "6d", 6),
        (at(rpy=(0.0, 0.0, 0.7)), "revolute", 5),
        (at(rpy=(1e-3, 0.0, 0.7)), "revolute", 5),  # the rounding of a file
        (at(rpy=(0.02, 0.0, 0.7)), "3d", 3),
        (at(rpy=(0.4, 0.0, 0.7)), "3d", 3),
    ],
)
def test_a_spatial_loop_gets_what_its_frames_share(turn: pin.SE3, kind: str, rows: int) -> None:
    """A weld where the halves of a body meet, a hinge where one axis is shared, a point where none is."""
    tree = two_arms(turn)
    proposals = propose_closures(tree)
    assert chosen(proposals) == {frozenset(("hand_one", "hand_other")): kind}
    assert diagnose(closing(tree, proposals)).generic_mobility == tree.nv - rows


def test_frames_that_are_apart_share_no_axis() -> None:
    """Parallel where the file stands, but a metre apart: the halves of a rod where a loop is named, else a point."""
    tree = two_arms(at(x=1.0))
    for names, kind in ((("closing_1", "closing_2"), "6d"), (("P_one", "P_other"), "3d")):
        (proposal,) = propose_closures(renamed(tree, dict(zip(("hand_one", "hand_other"), names, strict=True))))
        assert (proposal.chosen, proposal.closure.kind.value) == (True, kind)


def test_a_hand_on_the_ground_shares_a_hinge_with_it() -> None:
    """The ground is no half of a body."""
    tree = two_arms(at(), joints=7)
    model = pin.buildReducedModel(tree.model, list(range(8, 15)), pin.neutral(tree.model))
    (proposal,) = propose_closures(fb.ClosedChain(model, (), ()))
    assert proposal.closure.kind.value == "revolute"
    assert diagnose(closing(fb.ClosedChain(model, (), ()), (proposal,))).generic_mobility == 2


@pytest.mark.parametrize(("slide", "kind"), [(pin.JointModelPZ(), "revolute"), (pin.JointModelPX(), "3d")])
def test_a_slide_across_the_plane_makes_a_loop_spatial(slide: object, kind: str) -> None:
    bend = at(0.5, rpy=(0.0, 0.0, 0.5 * np.pi))
    marks = {"u": (3, at(0.3)), "v": (4, at(-0.5, 0.5))}
    tree = branches((0, Z(), at()), (1, Z(), bend), (2, Z(), bend), (0, slide, at(0.7)), marks=marks)
    assert chosen(propose_closures(tree)) == {frozenset("uv"): kind}


def test_a_weaker_kind_is_taken_where_the_stronger_one_would_lock() -> None:
    """Five hinges and a shared axis: a hinge leaves nothing, a point two freedoms."""
    tree = two_arms(at(rpy=(0.0, 0.0, 0.7)), joints=2)
    proposals = propose_closures(tree)
    assert chosen(proposals) == {frozenset(("hand_one", "hand_other")): "3d"}
    assert diagnose(closing(tree, proposals)).generic_mobility == 1


def stubbed(*, aside: float = 0.0) -> fb.ClosedChain:
    """A four-bar cut so that its rocker keeps the pin: a stub on a hinge of its own; the coupler's end may be aside."""
    model = pin.Model()
    crank = add(model, 0, pin.JointModelRZ(), at(), "crank", body(1))
    coupler = add(model, crank, pin.JointModelRZ(), at(0.4), "coupler", body(2))
    rocker = add(model, 0, pin.JointModelRZ(), at(1.0), "rocker", body(3))
    add(model, rocker, pin.JointModelRZ(), at(0.9), "stub", body(7))
    point(model, coupler, "end", at(1.1, 0.0, aside))
    return fb.ClosedChain(model, (), ())


def test_a_pin_that_is_there_already_is_welded() -> None:
    """The tree ends in a short pin on its own hinge: a weld makes that hinge the joint, a point would let it spin."""
    q = fb.assembly_modes(mechanisms.four_bar(), [0.8])[0]
    tree = stubbed()
    proposals = propose_closures(tree, np.r_[q, 0.0])
    assert chosen(proposals) == {frozenset(("end", "stub_body")): "6d"}
    assert diagnose(closing(tree, proposals)).generic_mobility == 1


def test_nothing_overconstrained_is_proposed_unless_its_name_says_so() -> None:
    """Bennett's loop moves only thanks to its exact dimensions, which an accident may have as well."""
    chain, q = mechanisms.bennett()
    tree = opened(chain)
    (proposal, *_) = propose_closures(tree, q)
    assert not proposal.chosen
    assert proposal.reason == "the loop is overconstrained: it closes only with these exact dimensions"
    names = {"hinge_ground": "closedloop_A", "hinge_moving": "closedloop_B"}
    (proposal,) = propose_closures(renamed(tree, names), q, kind="revolute")
    assert proposal.chosen and proposal.closure.kind.value == "revolute"
    assert proposal.reason.endswith("overconstrained: it closes only with these exact dimensions")


def test_a_named_loop_that_cannot_be_closed_is_proposed_and_says_so() -> None:
    chain = mechanisms.four_bar((0.4, 1.1, 0.9, 9.0))
    tree = renamed(opened(chain), {"coupler_end": "closedloop_A", "rocker_end": "closedloop_B"})
    (proposal,) = propose_closures(tree)
    assert proposal.chosen
    assert "the loop cannot be closed; it stays open by" in proposal.reason
    assert not diagnose(closing(tree, (proposal,))).ok


def test_the_only_two_open_ends_may_be_one_joint_but_two_arms_are_not() -> None:
    (proposal,) = propose_closures(opened(mechanisms.five_bar()))
    assert (proposal.chosen, proposal.evidence, proposal.sure) == (True, Evidence.ENDS, "possible")
    arms = two_arms(at())
    (proposal,) = propose_closures(arms, np.full(8, 0.7))
    assert not proposal.chosen
    assert "5 freedoms would be left: two arms rather than a loop" in proposal.reason


def test_of_several_open_ends_none_are_joined() -> None:
    proposals = propose_closures(opened(solo_legs(("left", "right"))))
    assert len(proposals) == 6
    assert all(p.reason == "one of 6 pairs of open ends; nothing says which belong together" for p in proposals)


def test_too_many_open_ends_are_not_even_told() -> None:
    joints = [(0, Z(), at(float(k))) for k in range(5)]
    assert propose_closures(branches(*joints, marks={f"tip{k}": (k + 1, at(0.3)) for k in range(5)})) == ()


def test_ends_that_nearly_meet_are_told_of() -> None:
    """Bars side by side: their ends are 4 mm apart across the plane, which no joint closes."""
    q = fb.assembly_modes(mechanisms.four_bar(), [0.8])[0]
    (near,) = propose_closures(stubbed(aside=0.004), np.r_[q, 0.0])
    assert set(near.closure.frames) == {"end", "stub_body"}
    assert not near.chosen
    assert near.reason.startswith("they come within 0.004 m only")


def test_what_is_closed_already_is_kept_and_what_is_missing_is_found() -> None:
    chain = shipped("six_bar_watt")
    half = replace(chain, closures=chain.closures[:1])
    assert chosen(propose_closures(half)) == loops(replace(chain, closures=chain.closures[1:]))
    assert propose_closures(chain) == ()


def test_given_pairs_are_joined_whatever_else_there_is() -> None:
    tree = opened(shipped("six_bar_watt"))
    given = ("B_coupler", "G_output")
    (proposal,) = propose_closures(tree, pairs=[given], kind="3D")
    assert (proposal.closure.frames, proposal.evidence, proposal.chosen) == (given, Evidence.GIVEN, True)


def test_a_given_pair_that_locks_is_joined_and_says_so() -> None:
    (proposal,) = propose_closures(two_bars(), pairs=[("tip_one", "tip_other")])
    assert proposal.chosen
    assert proposal.reason == "given; they meet already; it would lock one, other"


def test_a_name_that_is_taken_is_not_given_again() -> None:
    chain = shipped("six_bar_watt")
    first = replace(chain, closures=(fb.Closure(chain.closures[0].frames, name="G"),))
    (proposal,) = propose_closures(first)
    assert proposal.closure.name == "G_strut~G_output" or proposal.closure.name == "G_output~G_strut"
    assert diagnose(replace(first, closures=(*first.closures, proposal.closure))).generic_mobility == 1


def test_what_is_given_wrongly_is_refused() -> None:
    tree = opened(shipped("six_bar_watt"))
    with pytest.raises(UnknownNameError, match=r"Unknown frame 'B_couple'.*Did you mean 'B_coupler'"):
        propose_closures(tree, pairs=[("B_couple", "B_rocker")])
    with pytest.raises(InvalidInputError, match=r"must be on two bodies; these are on one"):
        propose_closures(tree, pairs=[("coupler_link", "B_coupler")])
    for pair in ("B_coupler", ("B_coupler",), ("B_coupler", "B_rocker", "G_strut")):
        with pytest.raises(InvalidInputError, match="must be two frame names"):
            propose_closures(tree, pairs=[pair])  # type: ignore[list-item]
    with pytest.raises(UnknownNameError, match="Unknown closure kind 'ball'"):
        propose_closures(tree, kind="ball")
    with pytest.raises(InvalidInputError, match="shape of q"):
        propose_closures(tree, np.zeros(3))
    with pytest.raises(InvalidInputError, match="shape of q"):
        propose_motors(tree, np.zeros(3))


def motors(
    names: dict[str, str], *, effort: str = "", limit: float = 5.0, mass_of: dict[str, float] | None = None
) -> list[str]:
    """Return what is proposed to drive a five-bar with other names of joints, one effort limit or other masses."""
    chain = mechanisms.five_bar()
    model = chain.model.copy()
    for joint, mass in (mass_of or {}).items():
        j = model.getJointId(joint)
        model.inertias[j] = body(j, mass=mass) if mass else pin.Inertia.Zero()
    limits = np.full(model.nv, np.inf)
    if effort:
        limits[model.idx_vs[model.getJointId(effort)]] = limit
    model.upperEffortLimit = limits
    for j, name in enumerate(model.names):
        model.names[j] = names.get(name, name)
    return [m.joint for m in propose_motors(replace(chain, model=model, actuated=()))]


def test_motors_stand_on_the_ground_unless_names_or_limits_say_otherwise() -> None:
    assert motors({}) == ["left", "right"]
    assert motors({"left_elbow": "elbow_motor"}) == ["elbow_motor", "right"]
    assert motors({"left": "free_left"}) == ["left_elbow", "right"]
    assert motors({}, effort="right_elbow", limit=0.0) == ["left", "right"]
    assert motors({}, effort="right_elbow") == ["left", "right_elbow"]
    assert motors({}, mass_of={"left": 0.0}) == ["right", "right_elbow"]


def test_a_freedom_that_moves_nothing_else_gets_no_motor() -> None:
    """A pin on the closing point of a five-bar spins without anything to turn: two motors, not three."""
    chain = mechanisms.five_bar()
    model = chain.model.copy()
    add(model, model.getJointId("left_elbow"), pin.JointModelRZ(), at(1.2), "spin", body(9))
    spun = replace(chain, model=model, closures=(fb.Closure(("spin_body", "tip_right")),), actuated=())
    d = diagnose(spun)
    assert d.generic_mobility == 2
    assert [x.joint for x in d.idle] == ["spin"]
    assert not any("never let" in p.text for p in d.problems)
    assert [m.joint for m in propose_motors(spun)] == ["left", "right"]


def test_a_motor_says_what_speaks_for_it() -> None:
    """Where only joints are left that are free by their names, they have to be held rather than driven."""
    tree = two_arms(at())
    closed = closing(tree, propose_closures(tree))
    model = closed.model.copy()
    for j, name in ((1, "waist_motor"), (2, "ball_x"), (5, "free_base")):
        model.names[j] = name
    model.upperEffortLimit = np.r_[5.0, np.full(7, np.inf)]
    first, *_ = propose_motors(replace(closed, model=model))
    assert (first.joint, first.reason) == ("waist_motor", "its name, an effort limit, on the ground")
    spun = replace(mechanisms.five_bar(), actuated=())
    names = spun.model.copy()
    for j in range(1, 5):
        names.names[j] = f"free_{j}"
    reasons = {m.reason for m in propose_motors(replace(spun, model=names))}
    assert reasons == {"nothing else determines what is left; hold it where it is"}
