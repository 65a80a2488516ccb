"""Proposals: a mechanism whose sidecar is lost comes back the same, and an accident is not taken for a loop."""

from __future__ import annotations

from dataclasses import replace

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


def test_what_always_coincides_is_no_loop() -> None:
    """Two arms on one shaft, and a wrist of three crossing axes: their frames meet whatever the joints do."""
    chain = mechanisms.five_bar((0.5, 1.2, 1.0, 0.6, 0.0))
    proposals = propose_closures(opened(chain), np.array([0.3, 0.4, 0.5, 0.6]))
    assert {frozenset(p.closure.frames) for p in proposals} == {frozenset(("tip_left", "tip_right"))}


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
    [(at(), "6d", 6), (at(rpy=(0.0, 0.0, 0.7)), "revolute", 5), (at(rpy=(0.4, 0.0, 0.7)), "3d", 3)],
)
def test_a_spatial_loop_gets_what_its_frames_share(turn: pin.SE3, kind: str, rows: int) -> None:
    """A weld where the halves of a body meet, a hinge where one axis is shared, a point where none is."""
    tree = two_arms(turn)
    proposals = propose_closures(tree)
    assert chosen(proposals) == {frozenset(("hand_one", "hand_other")): kind}
    assert diagnose(closing(tree, proposals)).generic_mobility == tree.nv - rows


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


def test_what_is_given_wrongly_is_refused() -> None:
    tree = opened(shipped("six_bar_watt"))
    with pytest.raises(UnknownNameError, match=r"Unknown frame 'B_couple'.*Did you mean 'B_coupler'"):
        propose_closures(tree, pairs=[("B_couple", "B_rocker")])
    with pytest.raises(InvalidInputError, match=r"must be on two bodies; these are on one"):
        propose_closures(tree, pairs=[("coupler_link", "B_coupler")])
    with pytest.raises(UnknownNameError, match="Unknown closure kind 'ball'"):
        propose_closures(tree, kind="ball")
    with pytest.raises(InvalidInputError, match="shape of q"):
        propose_closures(tree, np.zeros(3))
    with pytest.raises(InvalidInputError, match="shape of q"):
        propose_motors(tree, np.zeros(3))


def motors(names: dict[str, str], *, effort: str = "", mass_of: dict[str, float] | None = None) -> list[str]:
    """Return what is proposed to drive a five-bar with other names of joints, one effort limit or other masses."""
    chain = mechanisms.five_bar()
    model = chain.model.copy()
    for joint, mass in (mass_of or {}).items():
        j = model.getJointId(joint)
        model.inertias[j] = body(j, mass=mass) if mass else pin.Inertia.Zero()
    limits = np.full(model.nv, np.inf)
    if effort:
        limits[model.idx_vs[model.getJointId(effort)]] = 5.0
    model.upperEffortLimit = limits
    for j, name in enumerate(model.names):
        model.names[j] = names.get(name, name)
    return [m.joint for m in propose_motors(replace(chain, model=model, actuated=()))]


def test_motors_stand_on_the_ground_unless_names_or_limits_say_otherwise() -> None:
    assert motors({}) == ["left", "right"]
    assert motors({"left_elbow": "elbow_motor"}) == ["elbow_motor", "right"]
    assert motors({"left": "free_left"}) == ["left_elbow", "right"]
    assert motors({}, effort="right_elbow") == ["left", "right_elbow"]
    assert motors({}, mass_of={"left": 0.0}) == ["right", "right_elbow"]


def test_a_freedom_that_moves_nothing_else_gets_no_motor() -> None:
    """A pin on the closing point of a five-bar spins without anything to turn: two motors, not three."""
    chain = mechanisms.five_bar()
    model = chain.model.copy()
    add(model, model.getJointId("left_elbow"), pin.JointModelRZ(), at(1.2), "spin", body(9))
    spun = replace(chain, model=model, closures=(fb.Closure(("spin_body", "tip_right")),), actuated=())
    assert diagnose(spun).generic_mobility == 3
    assert [m.joint for m in propose_motors(spun)] == ["left", "right"]
