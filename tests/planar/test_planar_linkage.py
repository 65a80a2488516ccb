"""A linkage in its own words is the mechanism that was built by hand."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import fivebar_pin as fb
from fivebar_pin.errors import AssemblyError, FiveBarPinError, InvalidInputError, UnknownNameError
from fivebar_pin.planar import Linkage
from fivebar_pin.planar._parts import Link, Motor
from fivebar_pin.planar._tree import spanning_tree
from fivebar_pin.shipped import mechanisms


def world(chain: fb.ClosedChain) -> dict[str, pin.SE3]:
    """Return the pose of every joint and frame at home."""
    model, data = chain.model, chain.model.createData()
    pin.framesForwardKinematics(model, data, np.array(chain.references["home"]))
    poses = {str(f.name): data.oMf[k] for k, f in enumerate(model.frames)}
    return poses | {name: data.oMi[model.getJointId(name)] for name in chain.joints}


def places(chain: fb.ClosedChain, **frames: str) -> dict[str, tuple[float, float]]:
    """Return where frames are at home, by the names of the points that they are to be."""
    poses = world(chain)
    return {point: tuple(poses[frame].translation[:2]) for point, frame in frames.items()}


def with_masses_of(chain: fb.ClosedChain, other: fb.ClosedChain) -> fb.ClosedChain:
    """Return the chain made of another's bodies, each where it lies at home."""
    mine, theirs = world(chain), world(other)
    return chain.with_inertias(
        {
            joint: mine[joint].actInv(theirs[joint]).act(other.model.inertias[other.model.getJointId(joint)])
            for joint in chain.joints
        }
    )


def four_bar(other: fb.ClosedChain) -> Linkage:
    made = Linkage("four_bar")
    p = places(other, A="crank", B="rocker", C="coupler", D="B_coupler")
    made.points(p)
    made.ground("A", "B")
    made.bar("crank", "A", "C")
    made.bar("coupler", "C", "D")
    made.bar("rocker", "B", "D")
    made.motor("crank", at="A")
    return made


def slider_crank(other: fb.ClosedChain) -> Linkage:
    made = Linkage("slider_crank")
    made.points(places(other, A="crank", C="rod", B="B_rod"))
    made.ground("A")
    made.bar("crank", "A", "C")
    made.bar("rod", "C", "B")
    made.slide("slider", "B", through=(0.0, 0.02))
    made.motor("crank", at="A")
    return made


def watt(other: fb.ClosedChain) -> Linkage:
    made = Linkage("watt")
    made.points(places(other, A="crank", B="rocker", C="coupler", D="B_coupler", E="strut", F="output", G="G_strut"))
    made.ground("A", "B")
    made.bar("crank", "A", "C")
    made.bar("coupler", "C", "D", "E")
    made.bar("rocker", "B", "D", "F")
    made.bar("strut", "E", "G")
    made.bar("output", "F", "G")
    made.motor("crank", at="A")
    return made


def stephenson(other: fb.ClosedChain) -> Linkage:
    made = Linkage("stephenson")
    made.points(places(other, A="crank", B="rocker", C="coupler", D="B_coupler", E="strut", F="output", G="G_strut"))
    made.ground("A", "B", "F")
    made.bar("crank", "A", "C")
    made.bar("coupler", "C", "D", "E")
    made.bar("rocker", "B", "D")
    made.bar("strut", "E", "G")
    made.bar("output", "F", "G")
    made.motor("crank", at="A")
    return made


def planar_3rrr(other: fb.ClosedChain) -> Linkage:
    made = Linkage("3rrr", gravity=(0.0, 0.0, -9.81))
    legs = {f"{p}{k}": f"{frame}_{k}" for k in (1, 2, 3) for p, frame in (("A", "upper"), ("B", "lower"))}
    made.points(places(other, **legs, P1="platform", P2="P2_platform", P3="P3_platform"))
    for k in (1, 2, 3):
        made.ground(f"A{k}")
        made.bar(f"upper_{k}", f"A{k}", f"B{k}")
        made.bar(f"lower_{k}", f"B{k}", f"P{k}")
        made.motor(f"upper_{k}", at=f"A{k}")
    made.plate("platform", "P1", "P2", "P3")
    return made


def five_bar(other: fb.ClosedChain) -> Linkage:
    made = Linkage("five_bar", gravity=np.array(other.model.gravity.linear))
    made.points(places(other, O1="psi", O2="theta_psi", O3="O3_link2", O4="phi_gamma", O0="gamma"))
    made.ground("O1", "O0")
    made.bar("psi", "O1", "O2")
    made.bar("theta_psi", "O2", "O3")
    made.bar("phi_gamma", "O4", "O3")
    made.bar("gamma", "O0", "O4")
    made.motor("psi", at="O1")
    made.motor("gamma", at="O0")
    return made


SHIPPED: dict[str, Callable[[fb.ClosedChain], Linkage]] = {
    "five_bar_case_I": five_bar,
    "five_bar_case_II": five_bar,
    "four_bar_antiparallelogram": four_bar,
    "four_bar_crank_rocker": four_bar,
    "four_bar_parallelogram": four_bar,
    "four_bar_reactionless": four_bar,
    "planar_3rrr": planar_3rrr,
    "six_bar_stephenson": stephenson,
    "six_bar_watt": watt,
    "slider_crank": slider_crank,
}


def loads_near_home(chain: fb.ClosedChain) -> fb.Loads:
    """Return the loads when the motors move a little about home."""
    t = np.linspace(0.0, 1.0, 21)
    start = np.array(chain.references["home"])
    at = start[chain.actuated_index]
    sweep = 0.15 * (1.0 - np.cos(np.pi * t)), 0.15 * np.pi * np.sin(np.pi * t), 0.15 * np.pi**2 * np.cos(np.pi * t)
    way = np.array([1.0, -0.7, 0.4])[: at.size]
    q, v, a = (np.outer(x, way) for x in sweep)
    motion = fb.Motion(t, at + q, v, a)
    return fb.inverse_dynamics(chain, fb.drive(chain, motion, near=start))


def test_every_planar_mechanism_that_ships_is_rebuilt() -> None:
    assert set(SHIPPED) == set(mechanisms.MECHANISMS) - {"delta", "spatial_rssr"}


@pytest.mark.parametrize("name", sorted(SHIPPED))
def test_a_shipped_mechanism_in_its_own_words_carries_the_same_loads(name: str) -> None:
    other = mechanisms.MECHANISMS[name]()
    chain = with_masses_of(SHIPPED[name](other).chain(), other)
    assert np.isclose(chain.mass, other.mass, rtol=1e-14)
    one, two = loads_near_home(chain), loads_near_home(other)
    order = [other.actuated.index(joint) for joint in chain.actuated]
    for word in ("torque", "shaking_force", "shaking_moment", "frame_force", "com"):
        mine, theirs = getattr(one, word), getattr(two, word)
        theirs = theirs[:, order] if word == "torque" else theirs
        np.testing.assert_allclose(mine, theirs, rtol=0.0, atol=1e-10 * max(1.0, np.abs(theirs).max()))
    assert np.abs(two.shaking_force).max() > 1e-3 or name == "four_bar_reactionless"


@pytest.mark.parametrize("name", sorted(SHIPPED))
def test_a_shipped_mechanism_in_its_own_words_has_the_same_conditions(name: str) -> None:
    other = mechanisms.MECHANISMS[name]()
    chain = SHIPPED[name](other).chain()
    for kind in ("force", "dynamic"):
        assert fb.balance_conditions(chain, kind).rank == fb.balance_conditions(other, kind).rank


def six_bar() -> Linkage:
    made = Linkage("watt")
    made.ground(A=(0, 0), B=(0.4, 0))
    made.points(C=(0.05, 0.09), D=(0.36, 0.3), E=(0.2, 0.28), F=(0.52, 0.2), G=(0.4, 0.42))
    made.bar("crank", "A", "C")
    made.bar("coupler", "C", "D", "E")
    made.bar("rocker", "B", "D", "F")
    made.bar("strut", "E", "G")
    made.bar("output", "F", "G")
    made.motor("crank", at="A")
    return made


def test_a_six_bar_takes_ten_lines_and_its_sketch_is_its_home() -> None:
    chain = six_bar().chain()
    found = fb.diagnose(chain, chain.references["home"])
    assert found.ok and found.mobility == 1 and found.gap < 1e-15
    poses = world(chain)
    for frame, place in (("coupler_E", (0.2, 0.28)), ("rocker_F", (0.52, 0.2)), ("output_G", (0.4, 0.42))):
        np.testing.assert_allclose(poses[frame].translation[:2], place, atol=1e-15)
    assert fb.balance_conditions(chain, "force").rank == 6 and fb.balance_conditions(chain, "dynamic").rank == 13


def test_stated_lengths_close_a_rough_sketch_with_the_motor_where_it_is() -> None:
    made = Linkage("rough")
    made.ground(A=(0, 0), B=(0.4, 0))
    made.points(C=(0.1, 0.1), D=(0.4, 0.4))
    made.bar("crank", "A", "C", length=0.1)
    made.bar("coupler", "C", "D", length=0.35)
    made.bar("rocker", "B", "D", length=0.3)
    made.motor("crank", at="A")
    chain = made.chain()
    home = chain.references["home"]
    assert np.abs(fb.closure_residual(chain, home)).max() < 1e-12
    assert home[chain.actuated_index[0]] == pytest.approx(np.pi / 4.0, abs=1e-15)
    assert {k: chain.parameters[k] for k in ("crank", "coupler", "rocker")} == {
        "crank": 0.1,
        "coupler": 0.35,
        "rocker": 0.3,
    }


def test_several_bars_at_one_point_are_joined_by_one_hinge_less() -> None:
    """Three bars meet at D: two hinges there; a five-bar with a third leg to the ground has one freedom less."""
    made = Linkage("three_legs")
    made.ground(A=(0, 0), B=(0.4, 0), K=(0.2, 0.5))
    made.points(C=(0.05, 0.15), E=(0.4, 0.18), D=(0.2, 0.3), L=(0.35, 0.45))
    for name, ends in {"a": "AC", "b": "CD", "c": "BE", "d": "ED", "e": "KL", "f": "LD"}.items():
        made.bar(name, *ends)
    made.motor("a", at="A")
    made.motor("c", at="B")
    chain = made.chain()
    assert sorted(c.name for c in chain.closures) == ["D", "D_2"]
    assert fb.diagnose(chain).mobility == 2


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(st.floats(-0.06, 0.06), st.floats(-0.06, 0.06)), min_size=7, max_size=7), st.booleans())
def test_random_sketches_have_the_mobility_of_their_kind_and_are_closed_at_home(moved, six) -> None:
    base = {"A": (0, 0), "B": (0.4, 0), "C": (0.05, 0.15), "D": (0.36, 0.32), "E": (0.2, 0.3), "F": (0.56, 0.2)}
    base["G"] = (0.42, 0.5)
    sketch = {p: np.add(at, by) for (p, at), by in zip(base.items(), moved, strict=True)}
    made = Linkage("random")
    made.points(sketch)
    made.ground("A", "B")
    made.bar("crank", "A", "C")
    made.bar("coupler", "C", "D", "E")
    made.bar("rocker", "B", "D", "F")
    if six:
        made.bar("strut", "E", "G")
        made.bar("output", "F", "G")
    made.motor("crank", at="A")
    chain = made.chain()
    assert np.abs(fb.closure_residual(chain, chain.references["home"])).max() < 1e-12
    found = fb.diagnose(chain, chain.references["home"])
    assume(found.rank == found.generic_rank)
    assert found.mobility == 1


def plain(name: str = "four") -> Linkage:
    made = Linkage(name)
    made.ground(A=(0, 0), B=(0.4, 0))
    made.points(C=(0.05, 0.09), D=(0.36, 0.3), X=(1.0, 1.0), Y=(1.1, 1.0))
    made.bar("crank", "A", "C")
    made.bar("coupler", "C", "D")
    made.bar("rocker", "B", "D")
    return made


def test_a_linkage_without_a_motor_is_told_what_could_be_driven() -> None:
    with pytest.raises(InvalidInputError, match=r"number of motors = 0 but must be 1.*crank at A") as caught:
        plain().chain()
    assert caught.value.value == 0
    assert str(caught.value).count("; or ") == 2, "each of the three joints of the tree would do"


def test_a_linkage_of_kilometres_is_closed_as_far_as_its_coordinates_are_exact() -> None:
    made = Linkage("large")
    made.points(A=(0.0, 0.0), B=(1e6 / 3.0, 0.0), C=(1e5 / 7.0, 1e6 / 9.0), D=(1e6 / 3.3, 1e6 / 5.1))
    made.ground("A", "B")
    for name, ends in {"crank": "AC", "coupler": "CD", "rocker": "BD"}.items():
        made.bar(name, *ends)
    made.motor("crank", at="A")
    chain = made.chain()
    assert np.abs(fb.closure_residual(chain, chain.references["home"])).max() <= 1e-12 * chain.length


def test_angles_at_home_are_those_of_less_than_half_a_turn() -> None:
    """A crank at 170 degrees and a coupler at -170: one turns by 20 against the other, not by -340."""
    made = Linkage("turned")
    crank, coupler = (np.exp(1j * np.radians(angle)) for angle in (170.0, -170.0))
    end = crank + 2.0 * coupler
    made.points(A=(0.0, 0.0), B=(-2.0, -2.0), C=(crank.real, crank.imag), D=(end.real, end.imag))
    made.ground("A", "B")
    for name, ends in {"crank": "AC", "coupler": "CD", "rocker": "BD"}.items():
        made.bar(name, *ends)
    made.motor("crank", at="A")
    chain = made.chain()
    home = dict(zip(chain.joints, np.degrees(chain.references["home"]), strict=True))
    assert home["crank"] == pytest.approx(170.0) and home["coupler"] == pytest.approx(20.0)


def test_a_link_hangs_on_the_neighbour_that_is_nearest_to_the_ground() -> None:
    """Driven joints come first, and so `far` is in the tree before `near`; `tip` hangs on `near` all the same."""
    links = [("ground", "OP"), ("crank", "OA"), ("far", "AB"), ("near", "PX"), ("tip", "BX")]
    made = {name: Link(name, tuple(points)) for name, points in links}
    motors = [Motor("crank", "O", "ground"), Motor("far", "A", "crank")]
    tree = spanning_tree("nearest", made, motors)
    assert {e.child: e.parent for e in tree.edges}["tip"] == "near"
    assert [(cut.first, cut.second, cut.at) for cut in tree.cuts] == [("far", "tip", "B")]


def test_too_many_motors_are_counted_against_the_mobility() -> None:
    made = plain()
    made.motor("crank", at="A")
    made.motor("rocker", at="B")
    with pytest.raises(InvalidInputError, match="number of motors = 2 but must be 1"):
        made.chain()


def test_motors_in_the_wrong_places_are_told_what_they_leave_free() -> None:
    made = plain("two")
    made.points(E=(0.1, -0.1), F=(0.4, -0.3))
    for name, ends in {"first": "AE", "second": "EF", "third": "BF"}.items():
        made.bar(name, *ends)
    made.motor("crank", at="A")
    made.motor("rocker", at="B")
    with pytest.raises(InvalidInputError, match=r"do not determine the motion: they leave .*first.* free.*Drive"):
        made.chain()


def test_a_loop_of_motors_is_refused() -> None:
    made = plain()
    for link, at in (("crank", "A"), ("crank", "C"), ("rocker", "D"), ("rocker", "B")):
        made.motor(link, at=at)
    with pytest.raises(InvalidInputError, match="closes a loop of motors"):
        made.chain()


def test_a_bar_on_its_own_is_named() -> None:
    made = plain()
    made.bar("lost", "X", "Y")
    with pytest.raises(InvalidInputError, match=r"bar lost of four .*connects to nothing"):
        made.chain()
    made.bar("more", "Y", "X")
    with pytest.raises(InvalidInputError, match="hangs together with more only"):
        made.chain()


def test_a_structure_has_nothing_to_drive() -> None:
    made = plain()
    made.bar("brace", "A", "D")
    with pytest.raises(InvalidInputError, match="it is a structure"):
        made.chain()


def test_lengths_that_do_not_close_name_the_point_and_the_gap() -> None:
    made = Linkage("short")
    made.ground(A=(0, 0), B=(1.0, 0))
    made.points(C=(0.1, 0.1), D=(0.4, 0.4))
    made.bar("crank", "A", "C", length=0.1)
    made.bar("coupler", "C", "D", length=0.2)
    made.bar("rocker", "B", "D", length=0.3)
    made.motor("crank", at="A")
    with pytest.raises(AssemblyError, match="lengths of short do not close: at point D") as caught:
        made.chain()
    assert caught.value.closure == "D" and 0.2 < caught.value.residual < 0.45


@pytest.mark.parametrize(
    ("say", "kind", "message"),
    [
        (lambda m: m.bar("crank", "A", "D"), InvalidInputError, "is there already"),
        (lambda m: m.bar("ground", "A", "D"), InvalidInputError, "name of a bar"),
        (lambda m: m.bar("two words", "A", "D"), InvalidInputError, "letters, digits"),
        (lambda m: m.bar("x", "A", "A"), InvalidInputError, "different points"),
        (lambda m: m.bar("x", "A", "D", length=-1.0), InvalidInputError, "positive"),
        (lambda m: m.bar("x", "A", length=1.0), InvalidInputError, "needs two points"),
        (lambda m: m.bar("x", "A", "D", density=-1.0), InvalidInputError, "must not be negative"),
        (lambda m: m.bar("x", "A", "D", places={"D": (0, 0)}), UnknownNameError, "further point of x"),
        (lambda m: m.plate("x", "A", "D"), InvalidInputError, "three or more"),
        (lambda m: m.points(A=(0, 0)), InvalidInputError, "sketched twice"),
        (lambda m: m.points(Q=(0, 0, 0)), InvalidInputError, r"must be \(2,\)"),
        (lambda m: Linkage("x", gravity=(0, 0, 0, 1)), InvalidInputError, "gravity"),
        (lambda m: m.slide("x", "C", angle=np.nan), InvalidInputError, "angle of slide x"),
        (lambda m: m.slide("x", "C", through=(1,)), InvalidInputError, "through of slide x"),
        (lambda m: m.slide("x"), InvalidInputError, "must be one or more"),
        (lambda m: m.ground("A"), InvalidInputError, "must be named once"),
        (lambda m: m.ground("Q"), UnknownNameError, "point 'Q'"),
        (lambda m: m.mass("crank", at="D", mass=1.0), UnknownNameError, "point of crank"),
        (lambda m: m.mass("crank", at="A", mass=-1.0), InvalidInputError, "must not be negative"),
        (lambda m: m.mass("cronk", at="A", mass=1.0), UnknownNameError, "Did you mean 'crank'"),
        (lambda m: m.spring("A", "Q", stiffness=1.0), UnknownNameError, "point 'Q'"),
        (lambda m: m.spring("A", "D", stiffness=-1.0), InvalidInputError, "stiffness of spring A-D = -1.0"),
        (lambda m: m.spring("A", "D", stiffness=1.0, damping=-1.0), InvalidInputError, "damping of spring A-D = -1.0"),
        (lambda m: m.bar("x", ["A", "D"]), InvalidInputError, "names, one after the other and not in a list"),
        (lambda m: m.ground(["A"]), InvalidInputError, "names, one after the other and not in a list"),
        (lambda m: m.points((0, 0)), InvalidInputError, "must map names to places"),
    ],
)
def test_what_is_wrong_is_said_at_once(say, kind, message) -> None:
    with pytest.raises(kind, match=message):
        say(plain())


@pytest.mark.parametrize(
    ("say", "kind", "message"),
    [
        (lambda m: m.bar("x", "A", "Q"), UnknownNameError, "point of bar x 'Q'"),
        (lambda m: m.gear("crank", "whel", ratio=2.0), UnknownNameError, "bar 'whel'"),
        (lambda m: m.spring("A", "A", stiffness=1.0), InvalidInputError, r"of one bar \(ground\): it does nothing"),
        (lambda m: m.spring("A", "B", stiffness=1.0), InvalidInputError, r"of one bar \(ground\): it does nothing"),
        (lambda m: m.spring("C", "D", stiffness=1.0), InvalidInputError, r"of one bar \(coupler\): it does nothing"),
        (lambda m: m.motor("cronk", at="A"), UnknownNameError, "Did you mean 'crank'"),
        (lambda m: m.motor("crank", at="B"), UnknownNameError, "point of crank"),
        (lambda m: m.motor("crank"), InvalidInputError, "needs the point where it turns"),
        (lambda m: m.motor("crank", at="A", on="rocker"), UnknownNameError, "link at A"),
        (lambda m: (m.bar("x", "C", "X"), m.motor("x", at="X")), InvalidInputError, "a point of this bar alone"),
        (lambda m: (m.bar("x", "C", "X"), m.motor("x", at="C")), InvalidInputError, "Say on="),
        (lambda m: m.slide("s", "C", on="nowhere"), UnknownNameError, "bar 'nowhere'"),
        (lambda m: m.slide("s", "C", on="s"), InvalidInputError, "slides on itself"),
        (lambda m: m.bar("crank_C", "C", "X"), InvalidInputError, "would name two frames"),
        (lambda m: m.bar("B_x", "C", "X"), InvalidInputError, "would name two lengths"),
        (lambda m: m.spring("A", "X", stiffness=1.0), InvalidInputError, "point X of a spring"),
        (lambda m: (m.points(Q=(0.05, 0.09)), m.bar("x", "C", "Q")), InvalidInputError, "lie on each other"),
        (lambda m: (m.bar("x", "C", "X", "Y"), m.spring("X", "Y", stiffness=1.0)), InvalidInputError, "of one bar"),
    ],
)
def test_what_is_wrong_with_the_whole_is_said_by_chain(say, kind, message) -> None:
    made = plain()
    say(made)
    with pytest.raises(kind, match=message):
        made.chain()


def test_a_linkage_that_stands_on_nothing_or_has_no_bars_is_told_so() -> None:
    made = Linkage("loose")
    with pytest.raises(InvalidInputError, match=r"points of the ground of loose = .* must be one at least"):
        made.chain()
    made.points(A=(0, 0), C=(1, 0))
    made.bar("crank", "A", "C")
    made.motor("crank", at="A")
    with pytest.raises(InvalidInputError, match=r"points of the ground of loose = .* must be one at least"):
        made.chain()
    made = Linkage("bare")
    made.ground(A=(0, 0))
    with pytest.raises(InvalidInputError, match=r"bars of bare = .* must be one at least"):
        made.chain()


def test_slides_on_the_ground_are_ground_enough() -> None:
    """An elliptic trammel has no pivot on the ground."""
    made = Linkage("trammel")
    made.points(X=(0.3, 0), Y=(0, 0.4))
    made.slide("along", "X", mass=0.1)
    made.slide("up", "Y", angle=0.5 * np.pi, mass=0.1)
    made.bar("rod", "X", "Y")
    made.motor("along")
    assert fb.diagnose(made.chain()).mobility == 1


def test_a_linkage_and_its_chain_show_what_they_are_made_of() -> None:
    made = plain()
    made.motor("crank", at="A")
    assert repr(made) == (
        "Linkage('four': ground A, B; bars: crank (A-C), coupler (C-D), rocker (B-D); motors: crank at A)"
    )
    assert "; parameters: A_x, A_y, B_x, B_y, crank, coupler, rocker)" in repr(made.chain())


def test_every_refusal_is_of_the_family() -> None:
    with pytest.raises(FiveBarPinError):
        Linkage("")
