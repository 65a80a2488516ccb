"""Named lengths: a chain with other values is the chain that is built with them."""

from __future__ import annotations

import pickle
from pathlib import Path

import mechanisms
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fivebar_pin as fb
from fivebar_pin.chain import BarBody, Geometry, LumpBody, Placement, PlateBody
from fivebar_pin.chain.bodies import axes_along
from fivebar_pin.errors import FileFormatError, InvalidInputError, UnknownNameError
from fivebar_pin.planar import Linkage

X, Y, TURN = np.eye(6)[0], np.eye(6)[1], np.eye(6)[5]
POINTS = {"A": (0.0, 0.0), "B": (0.4, 0.0), "C": (0.05, 0.09), "D": (0.36, 0.3)}
POINTS |= {"E": (0.2, 0.28), "F": (0.52, 0.2), "G": (0.4, 0.42)}


def six_bar(values: dict[str, float] | None = None) -> fb.ClosedChain:
    """Return a six-bar of bars, a plate and lumps; with values, every length is stated instead of sketched."""
    v = values or {}

    def said(name: str, *further: str) -> dict[str, object]:
        if not v:
            return {}
        return {"length": v[name], "places": {p: (v[f"{name}_{p}_x"], v[f"{name}_{p}_y"]) for p in further}}

    made = Linkage("six_bar")
    made.points(POINTS | ({p: (v[f"{p}_x"], v[f"{p}_y"]) for p in "AB"} if v else {}))
    made.ground("A", "B")
    made.bar("crank", "A", "C", **said("crank"))
    made.plate("coupler", "C", "D", "E", **said("coupler", "E"))
    made.bar("rocker", "B", "D", "F", linear_density=0.7, **said("rocker", "F"))
    made.bar("strut", "E", "G", **said("strut"))
    made.bar("output", "F", "G", **said("output"))
    made.mass("rocker", at="F", mass=0.2, centre=(0.01, 0.02), inertia=1e-4)
    made.spring("C", "F", stiffness=50.0, length=0.1)
    made.motor("crank", at="A")
    return made.chain()


def same(one: fb.ClosedChain, other: fb.ClosedChain) -> None:
    """Assert that two chains are equal to the last digit, visuals too."""
    assert one.model == other.model and dict(one.parameters) == dict(other.parameters)
    for a, b in zip(one.visuals, other.visuals, strict=True):
        assert a.size == b.size and np.array_equal(a.placement, b.placement) and a.frame == b.frame


def loads(chain: fb.ClosedChain, start: np.ndarray) -> fb.Loads:
    t = np.linspace(0.0, 1.0, 11)
    at = fb.assemble(chain, start[chain.actuated_index], near=start)
    angle = at[chain.actuated_index[0]]
    return fb.inverse_dynamics(chain, fb.drive(chain, fb.motion.cycloidal(t, angle, angle + 0.4), near=at))


CHAIN = six_bar()
VALUES = dict(CHAIN.parameters)


def test_present_values_change_nothing_to_the_last_digit() -> None:
    same(CHAIN.with_parameters(VALUES), CHAIN)
    same(CHAIN.with_parameters(), CHAIN)


def test_a_length_changed_and_changed_back_is_the_same_to_the_last_digit() -> None:
    for name, value in VALUES.items():
        other = CHAIN.with_parameters({name: value + 0.013})
        assert other.model != CHAIN.model and other.parameters[name] == value + 0.013
        same(other.with_parameters({name: value}), CHAIN)


@settings(max_examples=12, deadline=None)
@given(st.lists(st.floats(-0.01, 0.01), min_size=len(VALUES), max_size=len(VALUES)))
def test_other_values_give_the_linkage_that_is_built_with_them(changes) -> None:
    values = {name: value + by for (name, value), by in zip(VALUES.items(), changes, strict=True)}
    one, two = CHAIN.with_parameters(values), six_bar(values)
    assert dict(one.parameters) == pytest.approx(dict(two.parameters), rel=1e-15, abs=1e-15)
    np.testing.assert_allclose(one.inertial_parameters, two.inertial_parameters, rtol=0.0, atol=1e-13)
    for a, b in zip(one.model.jointPlacements, two.model.jointPlacements, strict=True):
        np.testing.assert_allclose(a.homogeneous, b.homogeneous, rtol=0.0, atol=1e-15)
    for a, b in zip(one.visuals, two.visuals, strict=True):
        np.testing.assert_allclose([*a.size], [*b.size], rtol=0.0, atol=1e-14)
        np.testing.assert_allclose(a.placement, b.placement, rtol=0.0, atol=1e-14)
    start = two.references["home"]
    mine, theirs = loads(one, start), loads(two, start)
    for word in ("torque", "shaking_force", "shaking_moment", "com"):
        size = max(1.0, float(np.abs(getattr(theirs, word)).max()))
        np.testing.assert_allclose(getattr(mine, word), getattr(theirs, word), rtol=0.0, atol=1e-13 * size)


def test_conditions_follow_the_lengths() -> None:
    values = VALUES | {"coupler": 0.4, "coupler_E_y": 0.1}
    one, two = (fb.balance_conditions(c, "force") for c in (CHAIN.with_parameters(values), six_bar(values)))
    assert one.rank == two.rank == 6
    rows = [np.linalg.svd(c.matrix, full_matrices=False)[2][: c.rank] for c in (one, two)]
    np.testing.assert_allclose(rows[0].T @ rows[0], rows[1].T @ rows[1], rtol=0.0, atol=1e-11)


def test_named_configurations_stay_and_are_starts_for_assemble() -> None:
    other = CHAIN.with_parameters(coupler=0.41)
    home = other.references["home"]
    assert np.array_equal(home, CHAIN.references["home"])
    assert np.abs(fb.closure_residual(other, home)).max() > 1e-2
    q = fb.assemble(other, home[other.actuated_index])
    assert np.abs(fb.closure_residual(other, q)).max() < 1e-12
    assert np.abs(q - home).max() < 0.3


def test_a_counterweight_stays_where_it_is_on_a_link_that_changes() -> None:
    weight = pin.Inertia(0.5, np.array([-0.03, 0.0, 0.0]), np.diag([1e-4, 1e-4, 2e-4]))
    crank = CHAIN.model.getJointId("crank")
    heavy = CHAIN.with_inertias({"crank": CHAIN.model.inertias[crank] + weight})
    one = heavy.with_parameters(crank=0.15).inertial_parameters[crank - 1]
    two = CHAIN.with_parameters(crank=0.15).model.inertias[crank] + weight
    np.testing.assert_allclose(one, two.toDynamicParameters(), rtol=0.0, atol=1e-15)


def test_a_link_cannot_be_cut_down_to_nothing() -> None:
    light = CHAIN.with_inertias({"strut": pin.Inertia(0.01, np.zeros(3), np.eye(3) * 1e-5)})
    with pytest.raises(
        InvalidInputError, match=r"mass of the body of joint strut = .* weighs 0\.01 kg, what it is .* Cut off less"
    ):
        light.with_parameters(strut=0.05)


def test_a_link_cannot_be_cut_down_to_exactly_nothing() -> None:
    bar = arm(0.5, bodies=(BarBody(("start", "end"), 1.0),))
    light = bar.with_inertias({"one": pin.Inertia(0.25, np.zeros(3), np.eye(3) * 1e-5)})
    with pytest.raises(InvalidInputError, match=r"mass of the body of joint one = 0\.0 but must stay positive"):
        light.with_parameters(l=0.25)


def test_a_flat_lump_has_the_moments_of_a_lamina() -> None:
    moments = LumpBody(("a",), 2.0, inertia_z=0.3).inertia(np.eye(4)[None]).inertia
    np.testing.assert_allclose(moments, np.diag([0.15, 0.15, 0.3]), rtol=0.0, atol=1e-16)


@pytest.mark.parametrize("along", [(1.0, 0.0, 0.0), (0.0, 0.6, 0.8), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)])
def test_axes_along_a_direction_are_axes_whichever_it_is(along: tuple[float, float, float]) -> None:
    axes = axes_along(np.array(along))
    np.testing.assert_array_equal(axes[:, 0], along)
    np.testing.assert_allclose(axes.T @ axes, np.eye(3), rtol=0.0, atol=1e-15)
    assert np.linalg.det(axes) > 0.0


def test_a_placement_from_a_base_comes_back_from_a_file(tmp_path: Path) -> None:
    base = pin.SE3(pin.rpy.rpyToMatrix(0.1, 0.2, 0.3), np.array([0.4, -0.5, 0.6])).homogeneous
    there = Placement("stop", (("l", X),), base)
    model = arm().model.copy()
    mechanisms.point(model, 1, "stop", there.at({"l": 0.3}))
    old = arm().geometry
    chain = fb.ClosedChain(
        model, (), ("one", "two"), "arm", geometry=Geometry(old.parameters, (*old.placements, there), old.bodies)
    )
    fb.save(chain, tmp_path, formats=("urdf",))
    moved = fb.load(tmp_path / "arm.urdf").with_parameters(l=0.7)
    np.testing.assert_allclose(
        find(moved, "stop").placement.homogeneous, there.at({"l": 0.7}).homogeneous, rtol=0.0, atol=1e-15
    )


def test_a_link_that_was_made_lighter_cannot_be_cut_down_to_moments_that_no_body_has() -> None:
    """A point of the strut's mass has none of its moment of inertia: a shorter strut would have less than none."""
    strut = CHAIN.model.inertias[CHAIN.model.getJointId("strut")]
    point = CHAIN.with_inertias({"strut": pin.Inertia(strut.mass, strut.lever, np.eye(3) * 1e-9)})
    with pytest.raises(InvalidInputError, match=r"moments of inertia of the body of joint strut = .* Cut off less"):
        point.with_parameters(strut=0.8 * VALUES["strut"])
    longer = point.with_parameters(strut=1.2 * VALUES["strut"])
    assert np.linalg.eigvalsh(longer.model.inertias[CHAIN.model.getJointId("strut")].inertia).min() > 0.0


def test_points_of_mass_may_move_onto_each_other() -> None:
    """Their moment of inertia about the mass centre is round-off then, of either sign."""
    made = fb.planar.Linkage("pendulum")
    made.ground(A=(0, 0))
    made.points(B=(0.3, 0.4))
    made.bar("rod", "A", "B", density=0.0)
    made.mass("rod", at="B", mass=0.3)
    made.motor("rod", at="A")
    pendulum = made.chain()
    for length in np.linspace(0.1, 0.4, 31):
        tip = pin.Inertia(0.1, np.array([length, 0.0, 0.0]), np.zeros((3, 3)))
        heavy = pendulum.with_inertias({"rod": pendulum.model.inertias[1] + tip})
        assert heavy.with_parameters(rod=length).mass == pytest.approx(0.4)


def test_a_saved_chain_keeps_its_parameters_to_the_last_digit(tmp_path: Path) -> None:
    other = CHAIN.with_parameters(coupler=0.4)
    fb.save(other, tmp_path)
    read = fb.load(tmp_path / "six_bar.urdf")
    assert dict(read.parameters) == dict(other.parameters)
    back = read.with_parameters(coupler=VALUES["coupler"])
    fb.save(CHAIN, tmp_path / "first")
    first = fb.load(tmp_path / "first" / "six_bar.urdf")
    assert back.model == first.model and back.model != read.model
    for one, two in zip(back.visuals, first.visuals, strict=True):
        np.testing.assert_allclose(one.size, two.size, rtol=1e-14)
        np.testing.assert_allclose(one.placement, two.placement, rtol=0.0, atol=1e-14)


def test_mjcf_is_the_mechanism_at_its_present_values(tmp_path: Path) -> None:
    other = CHAIN.with_parameters(coupler=0.4)
    (path,) = fb.save(other, tmp_path, formats=("mjcf",))
    read = fb.load(path)
    assert not read.parameters
    np.testing.assert_allclose(read.inertial_parameters, other.inertial_parameters, rtol=0.0, atol=1e-15)


def test_chains_with_parameters_travel() -> None:
    same(pickle.loads(pickle.dumps(CHAIN)), CHAIN)
    with pytest.raises(TypeError):
        CHAIN.parameters["crank"] = 1.0  # type: ignore[index]


def arm(value: float = 0.3, *, at: float | None = None, **more: object) -> fb.ClosedChain:
    """Return two links, the second placed at the end of the first by l and turned by alpha."""
    model = pin.Model()
    model.name = "arm"
    place = pin.SE3(np.eye(3), np.array([value if at is None else at, 0.0, 0.0]))
    for name, parent, where in (("one", 0, pin.SE3.Identity()), ("two", 1, place)):
        j = model.addJoint(parent, pin.JointModelRZ(), where, name)
        model.addJointFrame(j, -1)
        model.addBodyFrame(f"{name}_link", j, pin.SE3.Identity(), -1)
    for name, where in (("start", pin.SE3.Identity()), ("end", place)):
        model.addFrame(pin.Frame(name, 1, 0, where, pin.FrameType.OP_FRAME), False)
    said = {
        "parameters": {"l": value, "alpha": 0.0},
        "placements": (Placement("two", (("l", X), ("alpha", TURN))), Placement("end", (("l", X),))),
        "lengths": ("l",),
    }
    return fb.ClosedChain(model, (), ("one", "two"), geometry=Geometry(**{**said, **more}))


def test_angles_turn_what_comes_after_them() -> None:
    moved = arm().with_parameters(alpha=np.pi / 2.0, l=0.2)
    np.testing.assert_allclose(
        moved.model.jointPlacements[2].homogeneous,
        [[0, -1, 0, 0.2], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
        atol=1e-16,
    )
    np.testing.assert_array_equal(find(moved, "end").placement.translation, [0.2, 0.0, 0.0])


def find(chain: fb.ClosedChain, frame: str) -> pin.Frame:
    return chain.model.frames[chain.model.getFrameId(frame)]


@pytest.mark.parametrize(
    ("make", "kind", "message"),
    [
        (lambda: arm().with_parameters(k=1.0), UnknownNameError, "parameter 'k'; known: l, alpha"),
        (lambda: arm().with_parameters([("l", 1.0)]), InvalidInputError, "must map names to numbers"),
        (lambda: arm().with_parameters(l=np.inf), InvalidInputError, "parameter l = inf but must be finite"),
        (lambda: arm().with_parameters(l=0.0), InvalidInputError, "the bar would turn over"),
        (lambda: arm(at=0.31), InvalidInputError, "placement of two = .* lies that far from"),
        (lambda: arm(at=0.3 + 1e-7), InvalidInputError, "placement of two = .* lies that far from"),
        (lambda: arm(lengths=("k",)), UnknownNameError, "parameter 'k'"),
        (lambda: arm(placements=(Placement("three", (("l", X),)),)), UnknownNameError, "joint or frame of a placement"),
        (lambda: arm(placements=(Placement("end", (("l", X),)),) * 2), InvalidInputError, "once"),
        (lambda: arm(placements=(Placement("end", (("k", X),)),)), UnknownNameError, "parameter 'k'"),
        (lambda: arm(bodies=(BarBody(("start", "stop"), 1.0),)), UnknownNameError, "frame of a body 'stop'"),
        (lambda: arm(bodies=(BarBody(("start", "two_link"), 1.0),)), InvalidInputError, "frames of one link"),
        (lambda: Placement("end", (("l", np.zeros(3)),)), InvalidInputError, "twist of l"),
        (lambda: Placement("end", ("l", X)), InvalidInputError, "must be pairs of a parameter and its twist"),
        (lambda: Placement("end", (), np.diag([2.0, 1, 1, 1])), InvalidInputError, "a rotation and a translation"),
        (lambda: Placement("end", (), np.diag([-1.0, 1, 1, 1])), InvalidInputError, "a rotation and a translation"),
        (lambda: Placement("end", (), np.diag([1.0, 1, 1, 0])), InvalidInputError, "a rotation and a translation"),
        (lambda: BarBody(("a", "b", "c"), 1.0), InvalidInputError, "must be 2 different names"),
        (lambda: BarBody(("a", "a"), 1.0), InvalidInputError, "different names"),
        (lambda: BarBody(("a", "b"), -1.0), InvalidInputError, "linear_density of the body a-b"),
        (lambda: PlateBody(("a", "b"), 1.0, 1.0), InvalidInputError, "at least 3"),
        (lambda: PlateBody(("a", "b", "c"), 1.0, 0.0), InvalidInputError, "thickness of the body"),
        (lambda: LumpBody(("a",), -1.0), InvalidInputError, "mass of the body a"),
        (lambda: fb.ClosedChain(pin.Model(), (), (), geometry={"l": 1.0}), InvalidInputError, "must be a Geometry"),
    ],
)
def test_what_cannot_be_is_refused_by_name(make, kind, message) -> None:
    with pytest.raises(kind, match=message):
        make()


def corners(*points: tuple[float, float]) -> np.ndarray:
    poses = np.stack([np.eye(4)] * len(points))
    poses[:, :2, 3] = points
    return poses


def test_a_plate_has_the_inertia_of_the_box_it_is() -> None:
    plate = PlateBody(("a", "b", "c", "d"), 1000.0, 0.01)
    box = pin.SE3(np.eye(3), np.array([0.25, 0.05, 0.0])).act(pin.Inertia.FromBox(0.3, 0.3, 0.1, 0.01))
    around = [(0.1, 0.0), (0.4, 0.0), (0.4, 0.1), (0.1, 0.1)]
    for order in (around, around[::-1]):
        found = plate.inertia(corners(*order)).toDynamicParameters()
        np.testing.assert_allclose(found, box.toDynamicParameters(), rtol=0.0, atol=1e-15)


def test_a_plate_is_the_sum_of_the_triangles_it_is_cut_into() -> None:
    a, b, c, d = (0.0, 0.0), (0.3, 0.02), (0.25, 0.2), (-0.05, 0.1)
    whole = PlateBody(("a", "b", "c", "d"), 2700.0, 0.008).inertia(corners(a, b, c, d)).toDynamicParameters()
    parts = [PlateBody(("a", "b", "c"), 2700.0, 0.008).inertia(corners(*t)) for t in ((a, b, c), (a, c, d))]
    total = sum(part.toDynamicParameters() for part in parts)
    np.testing.assert_allclose(whole, total, rtol=0.0, atol=1e-15)


def test_plates_that_are_none_are_refused() -> None:
    with pytest.raises(InvalidInputError, match="make sides that cross"):
        PlateBody(("a", "b", "c", "d"), 1.0, 0.1).inertia(corners((0, 0), (1, 1), (1, 0), (0, 1)))
    with pytest.raises(InvalidInputError, match="make sides that cross"):  # or touch
        PlateBody(("a", "b", "c", "d"), 1.0, 0.1).inertia(corners((0, 0), (2, 0), (2, 1), (1, 0)))
    for direction in (1.0, 1.0), (0.1, 0.3), (0.7, 0.1):  # round-off of such corners has an area
        with pytest.raises(InvalidInputError, match="lie on one line"):
            PlateBody(("a", "b", "c"), 1.0, 0.1).inertia(corners(*(tuple(k * np.array(direction)) for k in range(3))))


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ("parameters: 3", "parameters: must map names"),
        ("parameters: {vals: {l: 1}}", "Unknown key 'vals'"),
        ("parameters: {values: {l: x}}", "parameter l: 'x' must be a finite number"),
        ("parameters: {values: {l: 1}, lengths: [k]}", "Unknown parameter 'k'"),
        ("parameters: {values: {l: 1}, placements: {end: {move: []}}}", "Unknown key 'move'"),
        ("parameters: {values: {l: 1}, placements: {end: {moves: [[l]]}}}", "has 1 entries; expected 2"),
        ("parameters: {values: {l: 1}, placements: {end: {base: [[1]]}}}", "base: has 1 entries; expected 4"),
        ("parameters: {values: {l: 1}, bodies: [{rod: [a, b]}]}", "must have one of the keys bar, lump, plate"),
        ("parameters: {values: {l: 1}, bodies: [{bar: [a, b]}]}", "linear_density is missing"),
        ("parameters: {values: {l: 1}, bodies: [{bar: [a, b], lump: [a]}]}", "must have one of the keys bar, lump"),
        ("parameters: {values: {l: 1}, bodies: [{bar: [a, b], mass: 1}]}", "Unknown key 'mass'"),
        ("parameters: {values: {l: 1}, bodies: [{bar: [a], linear_density: 1}]}", "must be 2 different names"),
        ("parameters: {values: {l: 1}, placements: {nowhere: {moves: []}}}", "joint or frame of a placement"),
    ],
)
def test_what_a_sidecar_says_of_parameters_is_checked(tmp_path: Path, said: str, message: str) -> None:
    fb.save(arm(), tmp_path, formats=("urdf",))
    sidecar = tmp_path / "arm.yaml"
    kept = [line for line in sidecar.read_text().splitlines() if not line.startswith("parameters:")]
    sidecar.write_text("\n".join([*kept, said]))
    with pytest.raises(FileFormatError, match=message):
        fb.load(tmp_path / "arm.urdf")
