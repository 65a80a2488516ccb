"""Closure residual, Jacobian and drift are each other's derivatives, and Pinocchio's where it has them."""

from __future__ import annotations

import copy
import inspect
import pickle
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import (
    AT_ORIGIN,
    TILTED,
    add,
    at,
    bennett,
    body,
    double_four_bar,
    five_bar,
    four_bar,
    point,
    rscr,
    rssr,
    slider_crank,
    welded_four_bar,
)

import fivebar_pin as fb
from fivebar_pin import viz
from fivebar_pin.closures import ClosureKind
from fivebar_pin.closures.closure import Entry
from fivebar_pin.closures.rows import along
from fivebar_pin.errors import AssemblyError, FileFormatError, InvalidInputError, UnknownNameError
from fivebar_pin.mechanism.loops import Loops, loops_of
from fivebar_pin.viz._mechanism import _draw_closures
from fivebar_pin.viz.scene import _drawings

KINDS = ("3d", "6d", "revolute", "cylindrical", "distance")


def spatial_pair(kind: str, seed: int = 0) -> fb.ClosedChain:
    """Return two spatial arms on one moving body whose tips are joined, frames and axis in arbitrary poses."""
    rng = np.random.default_rng(seed)
    model = pin.Model()
    trunk = add(model, 0, pin.JointModelSpherical(), at(0.1, 0.2, 0.3), "trunk", body(1))
    tips = []
    for k in range(2):
        joint = trunk
        for i, kin in enumerate((pin.JointModelRX, pin.JointModelRUBZ, pin.JointModelPY, pin.JointModelSpherical)):
            joint = add(model, joint, kin(), at(*rng.uniform(-0.4, 0.4, 3), rng.normal(size=3)), f"arm{k}{i}", body(i))
        tips.append(point(model, joint, f"tip{k}", at(*rng.uniform(-0.3, 0.3, 3), rng.normal(size=3))))
    return fb.ClosedChain(model, (made(tuple(tips), kind, rng.normal(size=3)),), ())


def made(frames: tuple[str, str], kind: str, axis: np.ndarray | None = None) -> fb.Closure:
    """Return a closure of any kind between two frames."""
    values = {"length": 0.7} if kind == "distance" else {}
    return fb.Closure(frames, kind, axis, **values)


def planar(kind: str) -> fb.ClosedChain:
    chain = five_bar(base=TILTED)
    return fb.ClosedChain(chain.model, (made(chain.closures[0].frames, kind),), chain.actuated)


def states(chain: fb.ClosedChain, n: int = 9, size: float = 0.9) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(4)
    q = loops_of(chain).tree.integrate(
        np.repeat(pin.neutral(chain.model)[None], n, axis=0), rng.uniform(-size, size, (n, chain.nv))
    )
    return q, rng.normal(size=(n, chain.nv))


def residual(loops: Loops, q: np.ndarray) -> np.ndarray:
    return loops.see(q).residual


def jacobian(loops: Loops, q: np.ndarray) -> np.ndarray:
    poses = loops.tree.poses(q)
    return loops.see(poses.q).J


def central(function, h: float = 2e-3) -> np.ndarray:
    """Return the derivative of a function of one number at zero, to h^6."""
    d1, d2, d3 = (function(k * h) - function(-k * h) for k in (1, 2, 3))
    return (45.0 * d1 - 9.0 * d2 + d3) / (60.0 * h)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("build", [spatial_pair, planar], ids=["spatial", "planar"])
def test_jacobian_is_the_derivative_of_the_residual(build, kind):
    chain = build(kind)
    loops = loops_of(chain)
    q, v = states(chain)
    rate = central(lambda h: residual(loops, loops.tree.integrate(q, h * v)))
    np.testing.assert_allclose(np.einsum("nmk,nk->nm", jacobian(loops, q), v), rate, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("kind", ["3d", "revolute", "cylindrical", "distance"])
@pytest.mark.parametrize("build", [spatial_pair, planar], ids=["spatial", "planar"])
def test_drift_is_the_rate_of_the_jacobian_times_the_velocity_anywhere(build, kind):
    chain = build(kind)
    loops = loops_of(chain)
    q, v = states(chain)
    own = loops.drift(q, v)
    rate = central(lambda h: np.einsum("nmk,nk->nm", jacobian(loops, loops.tree.integrate(q, h * v)), v))
    np.testing.assert_allclose(own, rate, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("base", [AT_ORIGIN, TILTED], ids=["at origin", "tilted"])
def test_drift_of_a_weld_is_exact_on_the_closed_loop(base):
    chain = welded_four_bar(base=base)
    loops = loops_of(chain)
    q = fb.assemble(chain, [0.9])[None]
    v = fb.complement(chain, q)[..., 0] * 1.7
    own = loops.drift(q, v)
    rate = central(lambda h: np.einsum("nmk,nk->nm", jacobian(loops, loops.tree.integrate(q, h * v)), v))
    np.testing.assert_allclose(own, rate, rtol=0.0, atol=1e-9)


def pinocchio_jacobian(chain: fb.ClosedChain, k: int, q: np.ndarray, model_of: type) -> np.ndarray:
    """Return Pinocchio's own Jacobian of closure k, in the axes of anchor 1."""
    model, closure = chain.model, chain.closures[k]
    first, second = (model.frames[model.getFrameId(f)] for f in closure.frames)
    cm = model_of(model, first.parentJoint, first.placement, second.parentJoint, second.placement)
    data, cdata = model.createData(), cm.createData()
    pin.computeJointJacobians(model, data, q)
    cm.calc(model, data, cdata)
    return np.asarray(cm.jacobian(model, data, cdata))


CLOSED = [
    five_bar(),
    five_bar(base=TILTED),
    four_bar(base=TILTED, joint=pin.JointModelRUBZ),
    slider_crank(base=TILTED),
    rssr(base=TILTED),
    double_four_bar(),
    welded_four_bar(base=TILTED),
]


@pytest.mark.parametrize("chain", CLOSED, ids=lambda c: c.name)
def test_jacobian_equals_pinocchio_on_closed_configurations(chain):
    q = fb.assemble(chain, [0.9, 1.7][: chain.na])
    J = jacobian(loops_of(chain), q[None])[0]
    start = 0
    for k, closure in enumerate(chain.closures):
        weld = closure.kind is ClosureKind.WELD
        theirs = pinocchio_jacobian(
            chain, k, q, pin.FrameAnchorConstraintModel if weld else pin.PointAnchorConstraintModel
        )
        own = J[start : start + closure.kind.rows]
        np.testing.assert_allclose(own, theirs, rtol=0.0, atol=1e-11)
        start += closure.kind.rows


@pytest.mark.parametrize(("chain", "q"), [rscr(), bennett(), rscr(base=TILTED)], ids=["rscr", "bennett", "tilted"])
def test_revolute_closure_is_the_weld_of_pinocchio_without_the_turn_about_the_axis(chain, q):
    J = jacobian(loops_of(chain), q[None])[0]
    weld = pinocchio_jacobian(chain, 0, q, pin.FrameAnchorConstraintModel)
    # On the closed loop relative angular velocity is what Pinocchio's rows 3..5 give, in the axes of frame 1.
    n = np.asarray(chain.closures[0].axis)
    np.testing.assert_allclose(J[:3], weld[:3], rtol=0.0, atol=1e-12)
    across = weld[3:] - np.outer(n, n @ weld[3:])
    assert np.linalg.matrix_rank(np.vstack([J[3:], across]), tol=1e-9) == np.linalg.matrix_rank(J[3:], tol=1e-9)
    np.testing.assert_allclose(np.linalg.svd(J[3:])[1], np.linalg.svd(across)[1][:2], rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("kind", KINDS)
def test_rows_are_named_in_their_order(kind):
    closure = made(("a", "b"), kind)
    assert len(closure.row_names) == len(closure.rows) == closure.kind.rows
    first = {"cylindrical": ("across 1", "across 2", "tilt 1"), "distance": ("length",)}
    assert closure.row_names[:3] == first.get(kind, ("x", "y", "z"))


@pytest.mark.parametrize("kind", ["3d", "6d", "revolute", "cylindrical"])
def test_order_of_the_frames_does_not_change_the_mechanism(kind):
    chain = planar(kind)
    swapped = fb.ClosedChain(chain.model, (made(chain.closures[0].frames[::-1], kind),), chain.actuated)
    q = fb.assemble(five_bar(base=TILTED), [2.0, 1.0])
    for c in (chain, swapped):
        assert np.abs(fb.closure_residual(c, q)[:3]).max() < 1e-12
    if kind == "3d":
        np.testing.assert_allclose(fb.complement(chain, q), fb.complement(swapped, q), rtol=0.0, atol=1e-12)


def test_planar_loops_keep_two_rows_of_three_five_and_three_of_six():
    assert loops_of(five_bar(base=TILTED)).r == 2
    assert loops_of(five_bar(base=TILTED, kind="revolute")).r == 2
    assert loops_of(welded_four_bar(base=TILTED)).r == 3
    assert loops_of(rssr(base=TILTED)).r == 3


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e4])
def test_rank_does_not_depend_on_the_size_of_the_mechanism(scale):
    chain = five_bar(tuple(scale * a for a in (0.5, 1.2, 1.0, 0.6, 0.9)))
    loops = loops_of(chain)
    q = fb.assemble(chain, [2.0, 1.0], tolerance=1e-12)
    assert loops.rank(jacobian(loops, q[None])[0]) == 2


def test_hinge_closed_back_to_front_is_told_apart():
    model = pin.Model()
    arm = add(model, 0, pin.JointModelRX(), at(), "arm", body())
    names = (point(model, 0, "ground", at()), point(model, arm, "moving", at()))
    chain = fb.ClosedChain(model, (fb.Closure(names, "revolute"),), ())
    loops = loops_of(chain)
    q = np.array([[0.0], [np.pi]])
    seen = loops.see(q)
    assert np.abs(seen.residual).max() < 1e-15
    assert loops.opposed(seen).tolist() == [False, True]


def test_logarithm_holds_near_zero_and_near_half_a_turn():
    rng = np.random.default_rng(2)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    model = pin.Model()
    point(model, add(model, 0, pin.JointModelSpherical(), at(), "ball", body(1)), "turned", at())
    loops = loops_of(fb.ClosedChain(model, (fb.Closure(("universe", "turned"), "6d"),), ()))
    for angle in (0.0, 1e-12, 1e-6, 0.1, 2.0, np.pi - 1e-6):
        turn = loops.see(pin.Quaternion(pin.exp3(angle * axis)).coeffs()[None]).residual[0, 3:]
        np.testing.assert_allclose(turn, angle * axis, rtol=0.0, atol=1e-9 * max(angle, 1e-3))


@pytest.mark.parametrize("kind", [fb.Closure, *fb.Closure.family.values()], ids=lambda kind: kind.__name__)
def test_help_shows_the_arguments_that_a_closure_takes(kind) -> None:
    words = inspect.signature(kind).parameters
    assert next(iter(words)) in ("frames", "ratios") and "self" not in words and "args" not in words


def test_closures_reject_what_they_cannot_be():
    with pytest.raises(InvalidInputError, match="must be two frame names"):
        fb.Closure(("a",))  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="must be two frame names"):
        fb.Closure("ab")  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="must be two frame names"):
        fb.Closure()
    with pytest.raises(
        UnknownNameError, match=r"Unknown closure kind '4d'; known: 3d, 6d, coupling, cylindrical, distance, revolute"
    ):
        fb.Closure(("a", "b"), "4d")  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="must not be zero"):
        fb.Closure(("a", "b"), "revolute", (0.0, 0.0, 0.0))
    with pytest.raises(InvalidInputError, match="must be finite"):
        fb.Closure(("a", "b"), "revolute", (0.0, np.nan, 1.0))


def test_closures_accept_the_words_of_a_sidecar_in_any_case_and_normalise_the_axis():
    closure = fb.Closure(["a", "b"], " Revolute ", (0.0, 3.0, 4.0))  # type: ignore[arg-type]
    assert closure.kind is ClosureKind.REVOLUTE
    assert closure.frames == ("a", "b")
    assert closure.name == "a~b"
    np.testing.assert_allclose(closure.axis, [0.0, 0.6, 0.8], rtol=0.0, atol=1e-15)
    assert not closure.axis.flags.writeable  # type: ignore[union-attr]


def hinged_arms(count: int) -> fb.ClosedChain:
    """Return arms on the ground, each closed to it by a hinge that is met at 0 and, back to front, at half a turn."""
    model = pin.Model()
    closures = []
    for k in range(count):
        arm = add(model, 0, pin.JointModelRX(), at(float(k)), f"arm{k}", body())
        names = (point(model, 0, f"ground{k}", at(float(k))), point(model, arm, f"moving{k}", at()))
        closures.append(fb.Closure(names, "revolute", name=f"hinge{k}"))
    return fb.ClosedChain(model, tuple(closures), ())


@pytest.mark.parametrize("turned", [(), (0,), (1,), (0, 1)])
def test_one_hinge_back_to_front_is_enough_whichever_it_is(turned):
    chain = hinged_arms(2)
    q = np.array([np.pi if k in turned else 0.0 for k in range(2)])
    assert np.abs(fb.closure_residual(chain, q)).max() < 1e-15
    said = any("back to front" in p.text for p in fb.diagnose(chain, q).problems)
    assert said == bool(turned)


@pytest.mark.parametrize("start", [0.0, 0.4, 2.9, -2.9])
def test_no_search_ends_with_a_hinge_back_to_front(start):
    chain = hinged_arms(1)
    try:
        q = fb.assemble(chain, [], [start])
    except AssemblyError:
        assert abs(start) > 2.0, "the hinge closes near by"
    else:
        assert np.cos(q[0]) > 0.999
    modes = fb.assembly_modes(chain, [])
    np.testing.assert_allclose(np.cos(modes), [[1.0]], rtol=0.0, atol=1e-12)


def test_a_diagnosis_looks_beyond_a_neutral_configuration_that_is_back_to_front():
    """At zero the arm lies on its hinge the wrong way round; the right way is half a turn off."""
    model = pin.Model()
    arm = add(model, 0, pin.JointModelRX(), at(), "arm", body())
    names = (point(model, 0, "ground", at()), point(model, arm, "moving", at(rpy=(np.pi, 0.0, 0.0))))
    found = fb.diagnose(fb.ClosedChain(model, (fb.Closure(names, "revolute"),), ()))
    assert not any("back to front" in p.text for p in found.problems)
    np.testing.assert_allclose(np.cos(found.q), [-1.0], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("angle", [1e-5, 5e-4, 9e-4, 1.1e-3])
def test_jacobian_of_a_weld_is_the_derivative_of_its_residual_where_it_is_nearly_closed(angle):
    """The rotation rows are nearly linear there; what is left of the second order still counts."""
    model = pin.Model()
    arm = add(model, 0, pin.JointModelSpherical(), at(), "arm", body())
    names = (point(model, 0, "ground", at(rpy=(0.3, -0.2, 0.5))), point(model, arm, "moving", at(rpy=(0.3, -0.2, 0.5))))
    loops = loops_of(fb.ClosedChain(model, (fb.Closure(names, "6d"),), ()))
    turn = angle * np.array([0.6, 0.0, 0.8])
    q, v = pin.Quaternion(pin.exp3(turn)).coeffs()[None], np.array([[-0.7, 0.9, 0.4]])
    rate = central(lambda h: residual(loops, loops.tree.integrate(q, h * v)), h=1e-4)
    np.testing.assert_allclose(jacobian(loops, q)[0] @ v[0], rate[0], rtol=0.0, atol=3e-11)


@pytest.mark.parametrize("word", ["3d", "3D", " 6d ", "REVOLUTE", "Cylindrical"])
def test_every_word_makes_a_member_of_the_family_that_travels_as_one(word):
    closure = fb.Closure(("a", "b"), word)
    assert type(closure) is not fb.Closure and isinstance(closure, fb.Closure)
    assert closure.kind == word.strip().lower() == closure.kind.value
    assert type(closure) is fb.Closure.family[closure.kind] is fb.Closure.of_kind(closure.kind)
    for other in (pickle.loads(pickle.dumps(closure.kind)), copy.copy(closure.kind), fb.ClosureKind.parse(word)):
        assert other is closure.kind


def test_the_classes_and_the_words_make_the_same():
    assert type(fb.Closure(("a", "b"))) is fb.closures.Point
    rod = fb.Closure(("a", "b"), "distance", length=0.7, name="rod")
    assert (type(rod), rod.length, rod.name) == (fb.closures.Distance, 0.7, "rod")
    gear = fb.Closure(("wheel", "crank"), fb.ClosureKind.COUPLING, ratio=(1.0, 3.7), offset=0.2)
    assert (dict(gear.ratios), gear.offset, gear.name) == ({"wheel": 1.0, "crank": 3.7}, 0.2, "wheel~crank")
    assert gear.joins == ("wheel", "crank") and gear.ends == ()


def test_a_value_that_the_kind_does_not_take_is_refused():
    with pytest.raises(UnknownNameError, match=r"Unknown value of a 3d closure 'length'; known: \(none\)"):
        fb.Closure(("a", "b"), "3d", length=0.7)
    with pytest.raises(UnknownNameError, match=r"value of a coupling closure 'ratios'; known: ratio, offset. Did you"):
        fb.Closure(("a", "b"), "coupling", ratios=(1.0, 2.0))


def test_a_second_kind_cannot_take_the_word_of_another():
    with pytest.raises(InvalidInputError, match="closure kind 3d = 'Other' but is Point already"):
        type("Other", (fb.closures.FrameClosure,), {"__qualname__": "Other"}, word="3d")
    assert fb.Closure.family["3d"] is fb.closures.Point


@pytest.fixture
def slot():
    """A kind of one row with a value of its own, defined as a user would, and forgotten afterwards."""

    @dataclass(frozen=True, eq=False)
    class Slot(fb.closures.FrameClosure, word="slot"):
        depth: float = 0.0
        row_names = ("x",)
        entries = (Entry("depth", None, "a slot needs its depth, e.g. 0.1"),)

        @property
        def rows(self):
            return (along((1.0, 0.0, 0.0), self.depth),)

    yield Slot
    del fb.Closure.family["slot"]


def test_a_kind_of_the_users_own_goes_the_whole_road(slot, tmp_path):
    """Defined in one place it drives, balances its power, is diagnosed, drawn, saved and read."""
    model = pin.Model()
    crank = add(model, 0, pin.JointModelRZ(), TILTED, "crank", body(1))
    yoke = add(model, 0, pin.JointModelPX(), TILTED, "yoke", body(2))
    names = point(model, yoke, "groove", at()), point(model, crank, "pin", at(0.2))
    chain = fb.ClosedChain(model, (fb.Closure(names, "SLOT", depth=0.1),), ("crank",))
    assert type(chain.closures[0]) is slot and slot.kind is fb.ClosureKind.parse("slot")
    fb.save(chain, tmp_path / "yoke.urdf")
    again = fb.load(tmp_path / "yoke.urdf")
    path = fb.drive(again, fb.motion.cycloidal(np.linspace(0.0, 1.0, 51), 0.0, 5.0))
    np.testing.assert_allclose(path.q[:, 1], 0.2 * np.cos(path.q[:, 0]) - 0.1, rtol=0.0, atol=1e-12)
    loads = fb.inverse_dynamics(again, path)
    assert loads.power_residual() < 1e-12 and loads.momentum_residual() < 1e-12
    assert fb.diagnose(again).ok and fb.balance_conditions(again, "force").rank == 3
    assert len(viz.page([viz.Shown(again, path)])) > 1e5
    with pytest.raises(InvalidInputError, match=r"closure groove~pin = 'slot' but has no word in MJCF"):
        fb.save(again, tmp_path / "yoke.xml")
    sidecar = tmp_path / "yoke.yaml"
    sidecar.write_text(re.sub("depth: .*\n", "", sidecar.read_text()))
    with pytest.raises(FileFormatError, match=r"depth\[0\]: is missing; a slot needs its depth, e.g. 0.1"):
        fb.load(tmp_path / "yoke.urdf")


def test_nothing_outside_the_family_knows_its_kinds():
    """One file a kind: the library asks closures what they do, and only MJCF has words for some of them."""
    root = Path(fb.__file__).parent
    words = re.compile(r"kind is|ClosureKind|\b(Point|Weld|Revolute|Cylindrical|Distance|Coupling)\(")
    tables = {"io/_mjcf_equality.py", "paper/linkage.py"}  # which build closures, as a user does
    tables |= {"diagnosis/_candidate.py", "diagnosis/proposals.py", "planar/_build.py"}
    for path in root.rglob("*.py"):
        where = path.relative_to(root).as_posix()
        if where.startswith(("closures/", "io/")) or where in tables or where == "__init__.py":
            continue
        text = path.read_text()
        if "fivebar_pin.closures" in text:
            assert not words.search(text), where


SIGNS = {"3d": "sphere", "6d": "box", "revolute": "cylinder", "cylindrical": "cylinder", "distance": "sphere"}


@pytest.mark.parametrize("kind", KINDS)
def test_both_frames_are_drawn_as_the_kind_is(kind):
    """A ball, a box, or a pin along the axis, that of a hinge which may slide longer than that of one which may not."""
    chain = spatial_pair(kind)
    drawing = _drawings([viz.Shown.at(chain, pin.neutral(chain.model))], 1.0, False)[0]

    class Spy:
        def __init__(self):
            self.drawn = []

        def __getattr__(self, name):
            return lambda *args, **named: self.drawn.append((name, args))

    spy = Spy()
    _draw_closures(spy, "m", drawing)
    marks = [(name, args) for name, args in spy.drawn if name != "place"]
    assert [name for name, _ in marks] == [SIGNS[kind]] * 2
    if SIGNS[kind] == "cylinder":
        _, (_, _, long, _, M) = marks[0]
        np.testing.assert_allclose(M[:3, 2], chain.closures[0].axis, rtol=0.0, atol=1e-15)
        assert (long > 5.0 * drawing.radius) == (kind == "cylindrical")


def test_no_way_is_followed_from_a_hinge_back_to_front():
    """Its axes point against each other: it is met, and yet no configuration to go on from."""
    chain = hinged_arms(1)
    with pytest.raises(AssemblyError):
        fb.assemble(chain, [], [np.pi])
    np.testing.assert_allclose(fb.assemble(chain, [], [0.0]), [0.0], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("kind", [fb.closures.Point, fb.closures.Weld, fb.closures.Distance, fb.closures.Coupling])
def test_the_name_of_a_closure_is_text(kind):
    values = {fb.closures.Distance: (("a", "b"), 1.0), fb.closures.Coupling: ({"a": 1.0, "b": 2.0},)}
    with pytest.raises(InvalidInputError, match=r"name of a .* closure = 3 but must be text"):
        kind(*values.get(kind, (("a", "b"),)), name=3)
