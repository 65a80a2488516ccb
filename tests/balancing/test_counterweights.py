"""Counterweights that can be made: solved as what they are, within their regions, arms and all, never promised away."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import balance_problems
import mechanisms
import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin import paper
from fivebar_pin.balancing import (
    Ball,
    Bar,
    Box,
    Design,
    Disc,
    Ellipsoid,
    Sphere,
    balance,
    balance_conditions,
    balance_problem,
    realise,
)
from fivebar_pin.balancing.change import Change
from fivebar_pin.balancing.finishing import finished, made
from fivebar_pin.balancing.parameters import from_pseudo_inertia, pseudo_inertia
from fivebar_pin.balancing.pieces.materials import Density
from fivebar_pin.dynamics import inverse_dynamics
from fivebar_pin.errors import InfeasibleError, InvalidInputError, UnknownNameError

STEEL = Disc(7850.0, 0.01)
BARE = Disc(7850.0, 0.01, arm=0.0)


def case_I() -> tuple[fb.ClosedChain, fb.Trajectory]:
    linkage = paper.table_1("I", "unbalanced")
    motion = paper.default_motion(samples=31)
    return linkage.chain(), fb.drive(linkage.chain(), motion, near=linkage.configuration(*motion.q[0]))


def crank_rocker() -> tuple[fb.ClosedChain, fb.Trajectory]:
    chain = fb.load(fb.io.shipped_path("four_bar_crank_rocker"))
    motion = fb.motion.cycloidal(np.linspace(0.0, 1.0, 101), 0.5, 0.5 + 2.0 * np.pi)
    return chain, fb.drive(chain, motion, near=next(iter(chain.references.values())))


def shaken(chain: fb.ClosedChain, rng: np.random.Generator, size: float) -> fb.ClosedChain:
    """The chain with the inertia of each body scaled at random, by a relative size."""
    return chain.with_inertial_parameters(
        chain.inertial_parameters * (1.0 + size * rng.standard_normal((len(chain.joints), 1)))
    )


def sampled(shape: str, size: tuple[float, ...], density: float, n: int = 400) -> tuple[float, float]:
    """Mass and polar inertia of a flat piece, by summing over a grid."""
    a, b, t = size
    half = a if shape == "disc" else 0.5 * a
    edge = np.linspace(-half, half, n + 1)
    x, y = np.meshgrid(0.5 * (edge[1:] + edge[:-1]), 0.5 * (edge[1:] + edge[:-1]))
    r2 = x * x + y * y
    inside = (r2 <= a * a) & (r2 >= b * b) if shape == "disc" else np.abs(y) <= 0.5 * b
    cell = density * t * (edge[1] - edge[0]) ** 2
    return float(cell * inside.sum()), float(cell * r2[inside].sum())


def rms_torque(chain: fb.ClosedChain, path: fb.Trajectory) -> float:
    return float(np.sqrt((inverse_dynamics(chain, path).torque ** 2).sum(axis=1).mean()))


@pytest.mark.parametrize("line", [None, (1.0, 0.0, 0.0)])
def test_discs_made_for_the_design_carry_exactly_its_parameters(line: tuple[float, ...] | None) -> None:
    chain, path = case_I()
    disc = Disc(STEEL.density, STEEL.thickness, line)
    design = balance(
        chain,
        "force",
        region=Ball(0.1),
        counterweight=disc,
        motions=path,
        minimise={"rms_torque": 1.0, "added_mass": 0.2},
    )
    made = realise(design, material=STEEL.density, thickness=STEEL.thickness)
    assert made.design is design
    assert (made.deviation <= 1e-9).all()
    for w, change in zip(made.weights, (c for c in design.added if c.mass), strict=True):
        mass, inertia = sampled("disc", w.size, w.density)
        assert mass == pytest.approx(change.mass, rel=2e-2)
        assert inertia == pytest.approx(change.inertia[2, 2], rel=4e-2)
        np.testing.assert_allclose(w.pose[:3, 3], change.place, atol=1e-15)
        if line:
            assert abs(change.place[1]) < 1e-9
    assert np.abs(inverse_dynamics(made.chain, path).shaking_force).max() < 1e-13
    assert rms_torque(made.chain, path) == pytest.approx(design.terms["rms_torque"], rel=1e-6)


@pytest.mark.parametrize("piece", [Disc("steel", 0.008), Bar("steel", 0.008), Sphere("steel")])
@pytest.mark.parametrize("term", ["rms_torque", "added_mass"])
def test_what_is_made_has_what_is_promised_and_lies_within_reach(piece: object, term: str) -> None:
    """Torque from Pinocchio, reach from the corners and rims of the pieces: nothing is taken from the optimum."""
    chain, path = crank_rocker()
    reach = 0.15
    design = balance(chain, "force", minimise=term, region=Ball(reach), counterweight=piece, motions=path)
    made = realise(design)
    assert made.attained and made.residual < 1e-12
    for w in made.weights:
        assert np.linalg.norm(w.pose[:3, 3]) + w.radius <= reach * (1.0 + 1e-6)
        assert w.overhang <= 1e-6 * reach
    assert rms_torque(made.chain, path) == pytest.approx(made.terms["rms_torque"], rel=1e-9)
    assert made.chain.mass - chain.mass == pytest.approx(design.added_mass, rel=1e-9)
    assert np.abs(inverse_dynamics(made.chain.with_gravity((0.0, 0.0, 0.0)), path).shaking_force).max() < 1e-12


@pytest.mark.parametrize("reach", [0.1, 0.12, 0.2])
def test_least_mass_of_solid_discs_agrees_with_the_problem_written_out_in_cvxpy(reach: float) -> None:
    """|h| + m^1.5 / sqrt(pi rho t) <= R m, the conditions as equalities; too little reach is proved."""
    import cvxpy as cp

    chain, _ = crank_rocker()
    conditions = balance_conditions(chain, "force")
    M = conditions.matrix.reshape(conditions.rank, 3, 10)
    m, h = cp.Variable(3), cp.Variable((3, 2))
    left = conditions.residual() + sum(M[:, b, 0] * m[b] + M[:, b, 1:3] @ h[b] for b in range(3))
    k = 1.0 / np.sqrt(np.pi * 7850.0 * 0.008)
    fit = [cp.norm(h[b]) + k * cp.power(m[b], 1.5) <= reach * m[b] for b in range(3)]
    other = cp.Problem(cp.Minimize(cp.sum(m)), [*fit, 100.0 * left == 0])
    other.solve(solver="CLARABEL")
    design = balance(chain, "force", region=Ball(reach), counterweight=Disc("steel", 0.008, arm=0.0))
    assert design.feasible == (other.status == "optimal")
    if design.feasible:
        assert design.status == "optimal"
        assert design.dual_bound == pytest.approx(other.value, rel=1e-6)
        assert design.objective == pytest.approx(other.value, rel=1e-5)
        assert realise(design).attained


@pytest.mark.parametrize("region", [Box((0.3, 0.26, 0.1)), Ellipsoid((0.2, 0.13, 0.1)), Ball(0.14, (0.03, 0.01, 0.0))])
def test_discs_lie_as_a_whole_in_regions_of_every_kind(region: Box | Ellipsoid | Ball) -> None:
    chain, path = crank_rocker()
    design = balance(chain, "force", minimise="rms_torque", region=region, counterweight=STEEL, motions=path)
    made = realise(design)
    assert made.weights and made.attained
    slim = type(region)(
        *((0.999 * region.radius, region.center) if isinstance(region, Ball) else ()),
        **({} if isinstance(region, Ball) else _smaller(region)),
    )
    shrunk = balance(chain, "force", minimise="rms_torque", region=slim, counterweight=STEEL, motions=path)
    assert not shrunk.feasible or shrunk.objective >= design.objective * (1.0 - 1e-6)


@pytest.mark.parametrize("kind", [Box, Ellipsoid])
def test_all_sides_of_a_region_hold_a_disc(kind: type) -> None:
    """The same region named by its frame in four positions: each time another of its sides is the one that binds."""
    chain, _ = crank_rocker()
    bodies, objective = ["crank", "rocker"], []
    for quarter in range(4):
        model = chain.model.copy()
        turn = pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, 0.5 * np.pi * quarter), np.zeros(3))
        for name in bodies:
            model.addFrame(pin.Frame(f"turned_{name}", model.getJointId(name), 0, turn, pin.FrameType.OP_FRAME))
        same = fb.ClosedChain(model, chain.closures, chain.actuated)
        edges = np.roll([0.24, 0.25], quarter % 2)
        extent = np.append(edges if kind is Box else 0.5 * edges, 1.0)
        region = {name: kind(extent, frame=f"turned_{name}") for name in bodies}
        design = balance(same, "force", region=region, counterweight=BARE, bodies=bodies)
        assert all(w.overhang < 1e-9 for w in realise(design).weights)
        objective.append(design.objective)
    assert objective[0] > 0.99 if kind is Box else objective[0] > 0.9
    np.testing.assert_allclose(objective, objective[0], rtol=1e-6)


def test_the_bound_on_balls_is_that_of_the_balls_themselves() -> None:
    """Torque feels their inertia, 2 m r^2 / 5 about their centres; what is found attains the bound on all of them."""
    chain, path = crank_rocker()
    design = balance(
        chain, "force", minimise="rms_torque", region=Ball(0.3), counterweight=Sphere("steel", 0.0), motions=path
    )
    assert abs(design.gap) < 1e-6 * design.objective
    for c in design.added:
        radius = np.cbrt(3.0 * c.mass / (4.0 * np.pi * 7850.0))
        assert c.inertia[2, 2] == pytest.approx(0.4 * c.mass * radius**2, rel=1e-6, abs=1e-15)
    assert realise(design).attained


@pytest.mark.parametrize("line", [(1.0, 0.5, 0.0), (1.0, -2.0, 0.0)])
def test_discs_on_a_line_have_their_centres_on_it(line: tuple[float, float, float]) -> None:
    """Through the joint, in its axes."""
    chain, path = crank_rocker()
    design = balance(
        chain,
        None,
        minimise="rms_shaking_force",
        region=Ball(0.3),
        counterweight=Disc(7850.0, 0.01, line=line, arm=0.0),
        motions=path,
    )
    placed = [c for c in design.added if c.mass > 1e-3]
    assert placed and max(np.linalg.norm(c.place) for c in placed) > 1e-2
    for c in placed:
        assert np.cross(line, c.place)[2] == pytest.approx(0.0, abs=1e-9)


def test_an_arm_is_a_square_bar_of_its_material_from_the_joint_to_the_rim() -> None:
    """Mass d w^2 l and inertia m (l^2 + w^2) / 12, w a fifth of the radius of the disc that it carries."""
    chain, _ = crank_rocker()
    design = balance(chain, "force", region=Ball(0.3), counterweight=Disc(7850.0, 0.01))
    assert len(design.arms) == 2
    for arm in design.arms:
        disc = next(c for c in design.added if c.body == arm.body)
        radius = np.sqrt(disc.mass / (np.pi * 7850.0 * 0.01))  # solid, as the least mass asks
        length, width = float(np.linalg.norm(disc.place[:2])) - radius, 0.2 * radius
        assert np.linalg.norm(arm.place[:2]) == pytest.approx(0.5 * length, rel=1e-3)
        assert arm.mass == pytest.approx(7850.0 * width**2 * length, rel=1e-3)
        assert arm.inertia[2, 2] == pytest.approx(arm.mass * (length**2 + width**2) / 12.0, rel=1e-3)


def _smaller(region: Box | Ellipsoid) -> dict[str, object]:
    name = "size" if isinstance(region, Box) else "semi_axes"
    return {name: 0.999 * np.array(getattr(region, name)), "center": region.center}


def test_optimality_is_claimed_only_where_what_is_made_attains_the_bound() -> None:
    """Under the moment conditions the inertia is felt: bores and bounds differ, and the gap is stated."""
    chain, path = crank_rocker()
    for term in ("rms_torque", "added_mass"):
        design = balance(
            chain,
            None,
            minimise={"rms_shaking_moment": 1.0, term: 0.1},
            region=Ball(0.3),
            counterweight=BARE,
            motions=path,
        )
        made = realise(design)
        assert made.attained
        assert design.dual_bound <= design.objective * (1.0 + 1e-8)
        assert (design.status == "optimal") == (design.gap <= 1e-6 * design.objective)
        assert ("not proved optimal" in made.claim) == (design.status == "feasible")


def test_arms_are_weighed_drawn_and_part_of_the_balance() -> None:
    chain, _ = crank_rocker()
    design = balance(chain, "force", region=Ball(0.2), counterweight=Disc("steel", 0.008))
    made = realise(design)
    carried = [w for w in made.weights if w.arm is not None]
    assert carried
    for w in carried:
        length, width, thickness = w.arm_size
        assert w.arm.mass == pytest.approx(7850.0 * length * width * thickness, rel=1e-9)
        assert length == pytest.approx(np.linalg.norm(w.pose[:3, 3]) - w.radius, abs=1e-5 * chain.length)
    discs = sum(w.parameters[0] for w in made.weights)
    arms = sum(w.arm.mass for w in carried)
    assert made.chain.mass == pytest.approx(chain.mass + discs + arms, rel=1e-12)
    assert np.abs(design.conditions.residual(made.chain)).max() < 1e-13
    own = made.chain.visuals[len(chain.visuals) :]
    assert sorted(v.shape for v in own) == ["box"] * len(carried) + ["cylinder"] * len(made.weights)
    bare = balance(chain, "force", region=Ball(0.2), counterweight=Disc("steel", 0.008, arm=0.0))
    assert bare.objective < design.objective and not bare.arms


def test_discs_cost_more_than_point_masses_and_less_the_denser_they_are() -> None:
    chain, _ = case_I()
    points = balance(chain, "force", region=Ball(0.1), material=None)
    steel = balance(chain, "force", region=Ball(0.1), counterweight=BARE)
    lead = balance(chain, "force", region=Ball(0.1), counterweight=Disc("lead", 0.01, arm=0.0))
    assert points.objective < lead.objective < steel.objective


@pytest.mark.parametrize("shape", ["disc", "bar"])
def test_a_design_that_was_not_made_of_pieces_is_solved_again_in_them(shape: str) -> None:
    chain, path = case_I()
    design = balance(chain, "force", region=Ball(0.1), material=None)
    made = realise(design, shape=shape, thickness=0.01)
    assert made.design is not design and made.design.objective > design.objective
    assert made.attained
    for w in made.weights:
        mass, _ = sampled(shape, w.size, w.density)
        assert mass == pytest.approx(w.parameters[0], rel=2e-2)
        assert w.overhang < 1e-7
    assert np.abs(inverse_dynamics(made.chain, path).shaking_force).max() < 1e-13
    assert "promised" in str(made) and "realised" in str(made)


def test_counterweights_are_drawn_in_their_own_colour_where_they_are() -> None:
    chain, _ = case_I()
    made = realise(balance(chain, "force", region=Ball(0.1)), thickness=0.01, arm=0.0)
    own = made.chain.visuals[len(chain.visuals) :]
    assert [v.shape for v in own] == ["cylinder"] * len(made.weights)
    assert all(v.rgba != w.rgba for v in own for w in chain.visuals)
    np.testing.assert_allclose(own[0].placement[:3, 3], made.weights[0].pose[:3, 3], atol=1e-12)


def test_spatial_mechanisms_get_balls() -> None:
    chain = mechanisms.rssr()
    design = balance(chain, "force", region=Ball(1.0))
    made = realise(design, shape="ball", material="tungsten")
    assert made.attained and (made.deviation <= 1e-9).all()
    assert all(w.overhang < 1e-6 for w in made.weights)
    assert np.abs(design.conditions.residual(made.chain)).max() < 1e-13
    assert realise(design).weights[0].shape == "ball"
    with pytest.raises(InvalidInputError, match="ball"):
        realise(design, shape="disc")
    with pytest.raises(InvalidInputError, match="planar"):
        balance(chain, "force", counterweight=STEEL)


def test_balls_that_cannot_have_the_inertia_asked_for_are_not_called_balanced() -> None:
    """The angular momentum feels the inertia of a ball, which has only its own."""
    chain, path = crank_rocker()
    chain = chain.with_gravity((0.0, 0.0, 0.0))
    design = balance(
        chain, None, minimise="rms_shaking_moment", region=Ball(0.5), counterweight=Sphere("steel", 0.0), motions=path
    )
    made = realise(design)
    differs = any(w.deviation[2] > 1e-6 for w in made.weights)
    assert made.attained != differs
    assert made.terms["rms_shaking_moment"] == pytest.approx(
        np.sqrt(np.mean(inverse_dynamics(made.chain, path).shaking_moment[:, 2] ** 2)), rel=1e-6
    )
    assert "take the realised figures" in made.claim or not differs


def leftover(design: Design) -> list[np.ndarray]:
    out = []
    for c in design.removed:
        b = design.original.joints.index(c.body)
        out.append(design.original.inertial_parameters[b] - c.parameters)
    return out


@pytest.mark.parametrize("seed", range(6))
def test_what_is_left_after_removing_is_a_body_in_space(seed: int) -> None:
    """Every entry of the pseudo-inertia counts, not only the ones that planar motion feels."""
    rng = np.random.default_rng(seed)
    chain = mechanisms.four_bar(np.array([0.4, 1.1, 0.9, 1.0]) + rng.uniform(-0.1, 0.1, 4))
    flat = {
        joint: pin.Inertia(1.0, np.array([0.3, 0.1, 0.0]), np.diag([0.01, 0.02, 0.03]))
        for joint in ("crank", "coupler", "rocker")
    }
    for one in (chain, chain.with_inertias(flat)):
        design = balance(one, "force", remove=["crank", "coupler", "rocker"], region=Ball(1.0))
        assert design.feasible and any(c.mass > 1e-3 for c in design.removed)
        for pi in (*leftover(design), *(c.parameters for c in (*design.added, *design.removed)), *design.parameters):
            assert np.linalg.eigvalsh(pseudo_inertia(pi))[0] >= -1e-12


def test_material_cannot_be_taken_from_a_body_that_exists_in_the_plane_only() -> None:
    chain = mechanisms.four_bar()
    pi = np.array(chain.inertial_parameters)
    pi[1, [4, 5, 6, 7, 8]] = 0.0
    with pytest.raises(InvalidInputError, match=r"coupler.*not that of a body in space"):
        balance(chain.with_inertial_parameters(pi), "force", remove=["coupler"])


@pytest.mark.parametrize("mode", ["add", "redesign"])
def test_no_planar_material_is_denser_than_stated(mode: str) -> None:
    chain, path = crank_rocker()
    thickness = 0.01
    design = balance(
        chain,
        "force",
        mode=mode,  # type: ignore[arg-type]
        minimise="rms_torque",
        motions=path,
        region=Ball(0.3),
        material="aluminium",
        thickness=thickness,
    )
    free = balance(chain, "force", mode=mode, minimise="rms_torque", motions=path, region=Ball(0.3), material=None)  # type: ignore[arg-type]
    assert design.objective >= free.objective - 1e-9
    for c in design.added:
        assert c.inertia[2, 2] >= c.mass**2 / (2.0 * np.pi * 2700.0 * thickness) * (1.0 - 1e-6)
    assert any(
        c.inertia[2, 2] < 0.5 * c.mass**2 / (2.0 * np.pi * 2700.0 * thickness) for c in free.added if c.mass > 1e-6
    )


@pytest.mark.parametrize("mode", ["add", "redesign"])
def test_no_spatial_material_is_denser_than_stated(mode: str) -> None:
    """Of all bodies of a density, the ball has the least determinant of second moments: (3 / (4 pi rho))^(2/3) / 5."""
    chain = mechanisms.rssr()
    k = 0.2 * (3.0 / (4.0 * np.pi * 7850.0)) ** (2.0 / 3.0)
    design = balance(chain, "force", mode=mode, region=Ball(1.0))  # type: ignore[arg-type]
    points = balance(chain, "force", mode=mode, region=Ball(1.0), material=None)  # type: ignore[arg-type]
    assert design.feasible and design.objective >= points.objective * (1.0 - 1e-7)
    for c in design.added:
        if c.mass > 1e-6:
            second = 0.5 * np.trace(c.inertia) * np.eye(3) - c.inertia
            assert np.cbrt(np.linalg.det(second)) >= k * c.mass ** (5.0 / 3.0) * (1.0 - 1e-5)


@pytest.mark.parametrize("seed", range(12))
def test_no_round_off_makes_material_denser_than_stated(seed: int) -> None:
    chain = shaken(mechanisms.rssr(), np.random.default_rng(seed), 1e-9)
    design = balance(chain, "force", mode="redesign", region=Ball(1.0))
    assert design.status == "optimal" and design.added
    assert_no_ball_is_denser(design.added)


@pytest.mark.parametrize("flat", [0.0, -1e-9, 1e-9])
def test_sheets_that_a_solver_takes_for_bodies_are_finished_as_bodies(flat: float) -> None:
    """Second moments that miss their bound by a solver's absolute error, which is all of them."""
    rng = np.random.default_rng(5)
    form = balance_problem(mechanisms.rssr(), "force", mode="redesign", region=Ball(1.0)).form
    y = np.zeros(form.n)
    for p in form.parts:
        h = np.append(0.1 * rng.standard_normal(3), 1.0)
        P = 0.2 * (np.outer(h, h) + np.diag([flat, 0.01, 0.02, 0.0]))
        y[p.where][:10] = from_pseudo_inertia(P)
    y, residual = finished(form, y, 0.0, np.ones(form.n, dtype=bool))
    assert residual < 1e-13
    _, added, _, lowest = made(form, y)
    assert lowest > 0.0 and added
    assert_no_ball_is_denser(added)


def assert_no_ball_is_denser(added: Sequence[Change]) -> None:
    k = 0.2 * (3.0 / (4.0 * np.pi * 7850.0)) ** (2.0 / 3.0)
    for c in added:
        second = 0.5 * np.trace(c.inertia) * np.eye(3) - c.inertia
        assert np.cbrt(np.linalg.det(second)) >= k * c.mass ** (5.0 / 3.0) * (1.0 - 1e-6)


def test_bodies_too_dense_are_raised_by_the_least_that_makes_them_their_material() -> None:
    """Second moments with all, two or one of them too small; those that suffice are left as they are."""
    bound = Density(1.0)
    for own, raised in (
        ([-1e-9, 0.0, 0.0], [1.0, 1.0, 1.0]),
        ([1e-3, 1e-2, 4.0], [0.5, 0.5, 4.0]),
        ([-1e-9, 2.0, 4.0], [0.125, 2.0, 4.0]),
        ([0.5, 1.0, 4.0], [0.5, 1.0, 4.0]),
    ):
        np.testing.assert_allclose(bound.raised(1.0, np.array(own)), raised, rtol=1e-14)
    assert bound.lacking(2.0, 1.0) == 3.0 and bound.lacking(2.0, 5.0) == 0.0


def test_bad_requests_are_refused_with_what_is_known() -> None:
    chain, _ = case_I()
    design = balance(chain, "force", region=Ball(0.1))
    with pytest.raises(UnknownNameError, match="bar, disc, ball"):
        realise(design, shape="cone")
    with pytest.raises(UnknownNameError, match="steel"):
        realise(design, material="stel")
    with pytest.raises(UnknownNameError, match="steel"):
        balance(chain, "force", material="stel")
    with pytest.raises(InvalidInputError, match="density"):
        realise(design, material=-1.0)
    with pytest.raises(InvalidInputError, match="thickness"):
        realise(design, thickness=0.0)
    with pytest.raises(InvalidInputError, match="thickness"):
        balance(chain, "force", thickness=float("nan"))
    with pytest.raises(InvalidInputError, match="side of the arm"):
        realise(design, arm=-1.0)
    with pytest.raises(InvalidInputError, match="must be a Disc, a Bar or a Sphere"):
        balance(chain, "force", counterweight="disc")  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="must not leave the plane"):
        balance(chain, "force", counterweight=Disc(7850.0, 0.01, (0.0, 0.0, 1.0)))
    with pytest.raises(InvalidInputError, match="mode 'add'"):
        realise(balance(chain, "force", mode="redesign", region=Ball(0.1)))
    with pytest.raises(InvalidInputError, match="mode 'add'"):
        balance(chain, "force", mode="redesign", counterweight=STEEL)
    with pytest.raises(InfeasibleError, match="Farkas"):
        realise(balance(chain, "dynamic", region=Ball(0.1)))


def test_discs_are_found_where_the_bound_lies_far_from_any() -> None:
    """Moments that ask for bored discs, where only solid ones fit at the place of the bound: pieces are drawn in."""
    rng = np.random.default_rng((21, 292))

    case = balance_problems.draw(rng)
    design = balance_problem(case.chain, case.kind, **case.arguments).solve(case.minimise)
    assert design.status == "feasible" and design.gap < 2e-3 * design.objective
    assert realise(design).attained


def test_where_conditions_leave_no_material_the_empty_mechanism_is_the_design() -> None:
    """A six-bar whose bodies may all vanish is reactionless without any, and with nothing else."""

    case = balance_problems.draw(np.random.default_rng((21, 121)))
    design = balance_problem(case.chain, case.kind, **case.arguments).solve(case.minimise)
    assert design.feasible and not design.parameters.any()
    assert 0.0 <= design.gap <= 1e-3 * design.objective


@pytest.mark.parametrize("seed", range(8))
def test_no_round_off_leaves_traces_of_material_where_there_is_to_be_none(seed: int) -> None:
    case, rng = balance_problems.draw(np.random.default_rng((21, 121))), np.random.default_rng(seed)
    chain = shaken(case.chain, rng, 10.0 ** rng.uniform(-12.0, -9.0))
    design = balance_problem(chain, case.kind, **case.arguments).solve(case.minimise)
    assert design.feasible and not design.parameters.any()
    assert 0.0 <= design.gap <= 1e-3 * design.objective


@pytest.mark.parametrize("kind", [Disc, Bar])
@pytest.mark.parametrize("name", ["six_bar_watt", "six_bar_stephenson", "planar_3rrr", "slider_crank"])
def test_long_arms_with_light_weights_come_to_rest(name: str, kind: type[Disc] | type[Bar]) -> None:
    """Far out, an arm weighs as much as what it carries: pieces and arms must find each other."""
    chain = fb.load(name)
    piece = kind("steel", 0.2 * chain.length)
    design = balance(chain, "force", region=Ball(3.0 * chain.length), counterweight=piece)
    made = realise(design)
    assert design.status == "optimal" and made.attained and design.arms
    for w in made.weights:
        if w.arm is not None:
            gap = np.linalg.norm(w.pose[:3, 3]) - w.radius - w.arm_size[0]
            assert abs(gap) < 1e-3 * chain.length
    assert np.abs(design.conditions.residual(made.chain)).max() < 1e-12


@pytest.mark.parametrize("piece", [Disc("steel", 1e308), Bar(1e-300, 0.01), Sphere(1e300)])
def test_densities_beyond_use_are_refused(piece: object) -> None:
    with pytest.raises(InvalidInputError, match=r"density.*beyond"):
        balance(case_I()[0], "force", counterweight=piece)
    with pytest.raises(InvalidInputError, match=r"density and thickness.*beyond"):
        balance(case_I()[0], "force", thickness=1e308)


def test_what_differs_from_the_promise_is_not_called_attained() -> None:
    chain, _ = crank_rocker()
    made = realise(balance(chain, "force", region=Ball(0.2), counterweight=BARE))
    assert made.attained
    heavier = replace(made.weights[0], parameters=made.weights[0].parameters * 1.01)
    moved = replace(made, weights=(heavier, *made.weights[1:]))
    assert not moved.attained and moved.residual > 1e-6 and "take the realised figures" in moved.claim
    out = replace(made.weights[0], overhang=1e-3)
    assert not replace(made, weights=(out, *made.weights[1:])).attained


def test_a_gap_that_proves_nothing_is_not_called_optimal(monkeypatch: pytest.MonkeyPatch) -> None:
    from fivebar_pin.balancing import solve

    chain, _ = crank_rocker()
    assert balance(chain, "force", region=Ball(0.2)).status == "optimal"
    monkeypatch.setattr(solve, "PROVED", -1.0)
    assert balance(chain, "force", region=Ball(0.2)).status == "feasible"


def test_pieces_that_wander_are_held_until_they_rest() -> None:
    from fivebar_pin.cli._moving import motion_along

    chain = fb.load("planar_3rrr")
    design = balance(
        chain,
        None,
        minimise={"rms_shaking_moment": 1.0, "added_mass": 0.1},
        region=Ball(3.0 * chain.length),
        counterweight=Bar("brass", 0.2 * chain.length),
        motions=motion_along(chain, None),
    )
    assert realise(design).attained


def test_no_piece_sticks_out_of_its_region_even_by_round_off() -> None:
    """Discs that fill their regions to the rim: they are looked for in a millionth less."""
    chain, path = case_I()
    design = balance(chain, "force", minimise="rms_torque", motions=path, region=Ball(0.07), counterweight=BARE)
    made = realise(design).weights
    assert max(np.linalg.norm(w.pose[:2, 3]) + w.radius for w in made) > 0.07 * (1.0 - 1e-5)
    assert [w.overhang for w in made] == [0.0] * len(made)
