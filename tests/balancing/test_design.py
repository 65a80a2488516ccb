"""Balanced designs: global optima checked by independent programs, physical bodies, certificates, honest refusals."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import mechanisms
import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin import paper
from fivebar_pin.balancing import Ball, Box, Design, Ellipsoid, balance, balance_conditions, balance_problem
from fivebar_pin.balancing.parameters import pseudo_inertia
from fivebar_pin.balancing.solvers import solve
from fivebar_pin.balancing.solvers.certificate import polished
from fivebar_pin.dynamics import inverse_dynamics
from fivebar_pin.errors import InfeasibleError, InvalidInputError, SolverError, UnknownNameError

REACH = 0.1


@cache
def case_I() -> tuple[fb.ClosedChain, fb.Trajectory]:
    linkage = paper.table_1("I", "unbalanced")
    motion = paper.default_motion(samples=101)
    chain = linkage.chain()
    return chain, fb.drive(chain, motion, near=linkage.configuration(*motion.q[0]))


def random_trajectory(chain: fb.ClosedChain, near: np.ndarray, seed: int, speed: float) -> fb.Trajectory:
    """A random smooth motion about a configuration, at any speed."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, 101)
    x = near[chain.actuated_index]
    columns = [
        fb.motion.harmonic(t, x[k] - s * np.cos(p), s, period=float(rng.uniform(0.5, 2.0)), phase=p)
        for k, (s, p) in enumerate(zip(rng.uniform(0.1, 0.4, x.size), rng.uniform(-3, 3, x.size), strict=True))
    ]
    return fb.drive(chain, fb.motion.combine(*columns).scaled(speed), near=near)


def planar(chain: fb.ClosedChain) -> np.ndarray:
    """Parameters (m, mcx, mcy, Izz) of all bodies."""
    return chain.inertial_parameters[:, [0, 1, 2, 9]]


def test_case_I_least_added_mass_is_270_grams() -> None:
    """Each link needs its balance at 0.1 m: 0.042 + 0.078 + 0.15 kg."""
    chain, _ = case_I()
    design = balance(chain, "force", material=None, region=Ball(REACH))
    assert design.feasible
    assert design.objective == pytest.approx(0.27, abs=1e-6)
    assert design.added_mass == pytest.approx(0.27, abs=1e-6)
    assert design.dual_bound <= design.objective + 1e-12
    assert design.gap < 1e-7
    assert "0.15 kg" in str(design)


@pytest.mark.parametrize("speed", [1e-2, 1.0, 1e2])
def test_a_force_balanced_design_keeps_its_mass_centre_still_at_any_speed(speed: float) -> None:
    chain, path = case_I()
    design = balance(chain, "force", region=Ball(REACH))
    for seed in range(3):
        for index in (0, 40):
            loads = inverse_dynamics(design.chain, random_trajectory(design.chain, path.q[index], seed, speed))
            assert np.ptp(loads.com, axis=0).max() <= 1e-9
            forces = np.abs(loads.reactions.bodies.rate[..., :3]).max()
            assert np.abs(loads.shaking_force).max() <= 1e-12 * forces
    unbalanced = inverse_dynamics(chain, random_trajectory(chain, path.q[0], 0, speed))
    assert np.ptp(unbalanced.com, axis=0).max() > 1e-3


def test_every_body_that_comes_back_is_physical() -> None:
    chain, path = case_I()
    designs = [
        balance(chain, "force", region=Ball(REACH)),
        balance(chain, "force", region=Box((0.2, 0.1, 0.1)), motions=path, minimise="rms_torque"),
        balance(chain, "force", mode="redesign", region=Ball(REACH)),
        balance(mechanisms.rssr(), "force", region=Ball(1.0)),
        balance(mechanisms.rssr(), "static", region=Ellipsoid((0.5, 0.4, 0.3)), gravity=(0.0, 0.0, -1.0)),
        balance(mechanisms.rssr(), "force", region=Box((1.0, 1.2, 1.4), center=(0.1, 0.0, 0.0))),
    ]
    for design in designs:
        assert design.residual < 1e-14
        for pi in (*design.parameters, *(c.parameters for c in design.added)):
            assert np.linalg.eigvalsh(pseudo_inertia(pi))[0] >= -1e-12


def test_least_added_mass_agrees_with_a_linear_program_over_point_masses() -> None:
    """Independent of cones: point masses on a fine grid in every region, conditions as equalities."""
    from scipy.optimize import linprog

    chain, _ = case_I()
    conditions = balance_conditions(chain, "force")
    for region, inside in (
        (Ball(REACH), lambda x, y: np.hypot(x, y) <= REACH + 1e-12),
        (
            Box((0.12, 0.08, 1.0), center=(-0.01, 0.02, 0.0)),
            lambda x, y: (abs(x + 0.01) < 0.0601) & (abs(y - 0.02) < 0.0401),
        ),
        (Ellipsoid((0.1, 0.05, 1.0)), lambda x, y: (x / 0.1) ** 2 + (y / 0.05) ** 2 <= 1.0 + 1e-12),
    ):
        x, y = (v.ravel() for v in np.meshgrid(np.linspace(-0.1, 0.1, 81), np.linspace(-0.1, 0.1, 81)))
        keep = inside(x, y)
        column = np.zeros((10, int(keep.sum())))
        column[0], column[1], column[2], column[9] = 1.0, x[keep], y[keep], x[keep] ** 2 + y[keep] ** 2
        A = np.hstack([conditions.matrix[:, 10 * b : 10 * b + 10] @ column for b in range(4)])
        found = linprog(np.ones(A.shape[1]), A_eq=A, b_eq=-conditions.residual())
        design = balance(chain, "force", material=None, region=region)
        assert design.objective == pytest.approx(found.fun, rel=1e-6)


def test_optimum_agrees_with_the_same_problem_written_in_cvxpy() -> None:
    """Least rms torque under force balance: conditions from the paper, torque from Pinocchio, cones by cvxpy."""
    import cvxpy as cp

    chain, path = case_I()
    base = inverse_dynamics(chain, path).torque
    unit = np.zeros((4, 4))
    columns = []
    for b in range(4):
        for k, i in enumerate((0, 1, 2, 9)):
            pi = chain.inertial_parameters.copy()
            pi[b, i] += (1.0, 1e-2, 1e-2, 1e-4)[k]
            columns.append((inverse_dynamics(chain.with_inertial_parameters(pi), path).torque - base).ravel())
    unit = np.tile([1.0, 1e-2, 1e-2, 1e-4], 4)
    delta = cp.Variable(16)
    x = planar(chain).ravel() + cp.multiply(unit, delta)
    a1, a2, a3, a4 = 0.02, 0.1, 0.1, 0.04
    gamma, phi, psi, theta = 0, 4, 8, 12
    constraints = []
    for part in (1, 2):
        m = 1.0 if part == 1 else 0.0
        right = x[theta + part] / a2
        constraints += [
            x[psi + part] / a1 + m * x[theta] == right,
            -x[phi + part] / a3 == right,
            -x[gamma + part] / a4 - m * x[phi] == right,
        ]
    for b in range(4):
        m, hx, hy, inertia = (delta[4 * b + k] for k in range(4))  # kg, cm, cm2
        constraints += [
            cp.norm(cp.hstack([m - inertia, 2 * hx, 2 * hy])) <= m + inertia,
            inertia <= 100.0 * m,
            m <= 1.0,
        ]
    torque = base.ravel() + np.array(columns).T @ delta
    rms = cp.norm(torque) / np.sqrt(len(path))
    wanted = cp.Problem(cp.Minimize(1e2 * rms), constraints).solve(solver="CLARABEL") / 1e2
    design = balance(
        chain, "force", material=None, region=Ball(REACH), masses=(0.0, 1.0), motions=path, minimise="rms_torque"
    )
    assert design.objective == pytest.approx(wanted, rel=1e-6)
    torque = inverse_dynamics(design.chain, path).torque
    assert np.sqrt((torque**2).sum(axis=1).mean()) == pytest.approx(design.objective, rel=1e-9)


def test_terms_of_the_objective_are_what_the_designed_chain_measures() -> None:
    """rms, peak and reflected inertia by inverse dynamics of the design."""
    chain, path = case_I()
    weights = {
        "added_mass": 0.1,
        "peak_torque": 1.0,
        "rms_shaking_moment": 0.5,
        "inertia": 3.0,
        "peak_bearing_force": 0.01,
    }
    design = balance(chain, "force", region=Ball(REACH), motions=path, minimise=weights)
    loads = inverse_dynamics(design.chain, path)
    forces = [loads.joint_reactions[:, :, :2], loads.closure_reactions[:, :, :2]]
    mass_matrices = [pin.crba(design.chain.model, design.chain.model.createData(), q) for q in path.q]
    full = [np.triu(M) + np.triu(M, 1).T for M in mass_matrices]
    inertia = np.mean([np.trace(N.T @ M @ N) for N, M in zip(path.N, full, strict=True)])
    measured = {
        "added_mass": design.chain.mass - chain.mass,
        "peak_torque": np.abs(loads.torque).max(),
        "rms_shaking_moment": np.sqrt((loads.shaking_moment**2).sum(axis=1).mean()),
        "inertia": inertia,
        "peak_bearing_force": max(np.linalg.norm(f, axis=2).max() for f in forces),
    }
    for name, value in measured.items():
        assert design.terms[name] == pytest.approx(value, rel=1e-9), name
    assert design.objective == pytest.approx(sum(weights[k] * measured[k] for k in weights), rel=1e-9)
    assert design.gap < 1e-6 * design.objective
    assert design.after["peak_torque"] == pytest.approx(measured["peak_torque"], rel=1e-12)
    assert design.before["peak_torque"] == pytest.approx(np.abs(inverse_dynamics(chain, path).torque).max(), rel=1e-12)


def test_no_random_feasible_design_beats_the_optimum() -> None:
    """Designs balanced by other means cost at least the dual bound."""
    chain, path = case_I()
    weights = {"added_mass": 1.0, "rms_torque": 1.0, "mean_square_shaking_moment": 2.0}
    problem = balance_problem(chain, "force", region=Ball(REACH), motions=path, objectives=(*weights, "distance"))
    best = problem.solve(weights)
    rng = np.random.default_rng(0)
    for _ in range(20):
        other = problem.solve({k: float(rng.uniform(0.0, 3.0)) for k in (*weights, "distance")})
        torque = inverse_dynamics(other.chain, path)
        cost = (
            other.added_mass
            + np.sqrt((torque.torque**2).sum(axis=1).mean())
            + 2.0 * (torque.shaking_moment**2).sum(axis=1).mean()
        )
        assert cost >= best.dual_bound - 1e-12


def check_certificate(design: Design) -> None:
    assert not design.feasible
    assert design.certificate is not None
    assert design.certificate.size > 1e5  # times the bounds on the variables
    assert np.isnan(design.parameters).all()
    with pytest.raises(InfeasibleError, match="Farkas"):
        _ = design.chain


def test_case_I_dynamic_balance_by_adding_material_is_impossible() -> None:
    """The moment condition of link 2 asks for less inertia than adding can leave; the proof names it."""
    chain, _ = case_I()
    design = balance(chain, "dynamic", region=Ball(REACH))
    check_certificate(design)
    assert any("Izz(theta_psi)" in c for c in design.certificate.conflict)


def test_farkas_certificate_holds_when_recomputed_here() -> None:
    """z with G^T z = 0, g.z < 0 and z in the dual cone, block by block, from the raw program."""
    chain, _ = case_I()
    problem = balance_problem(chain, "dynamic", region=Ball(REACH))
    program = problem.form.program
    outcome = solve(program, np.zeros(program.n), np.zeros(program.n))
    assert outcome.certificate is not None
    z = polished(program, outcome.z, program.g)
    assert program.g @ z == pytest.approx(-1.0)
    assert np.abs(program.G.T @ z).max() < 1e-8
    for block, part in zip(program.blocks, program.slices, strict=True):
        if block.cone == "nonneg":
            assert z[part].min() >= -1e-8
        elif block.cone == "soc":
            assert z[part][0] - np.linalg.norm(z[part][1:]) >= -1e-8


def test_limits_are_kept_or_proved_contradictory() -> None:
    chain, path = case_I()
    free = balance(chain, "force", material=None, region=Ball(REACH), motions=path)
    limits = {"peak_torque": 0.8 * free.after["peak_torque"]}
    bounded = balance(chain, "force", material=None, region=Ball(REACH), motions=path, limits=limits)
    assert bounded.feasible
    assert np.abs(inverse_dynamics(bounded.chain, path).torque).max() <= limits["peak_torque"]
    assert bounded.objective > free.objective + 1e-4
    each = balance(chain, "force", material=None, region=Ball(REACH), motions=path, limits={"peak_torque": [0.05, 0.2]})
    assert (np.abs(inverse_dynamics(each.chain, path).torque).max(axis=0) <= [0.05, 0.2]).all()
    never = balance(chain, "force", material=None, region=Ball(REACH), motions=path, limits={"peak_torque": 0.01})
    check_certificate(never)
    assert any("peak_torque" in c for c in never.certificate.conflict)


def test_mass_bounds_that_contradict_the_conditions_are_named() -> None:
    chain, _ = case_I()
    design = balance(chain, "force", region=Ball(REACH), masses={"theta_psi": (0.0, 0.1), "phi_gamma": (0.0, 0.01)})
    check_certificate(design)
    assert any("theta_psi <= 0.1 kg" in c for c in design.certificate.conflict)


def test_removing_material_needs_no_more_mass_than_adding_alone() -> None:
    chain, _ = case_I()
    added = balance(chain, "force", region=Ball(REACH))
    drilled = balance(chain, "force", region=Ball(REACH), remove=["theta_psi", "phi_gamma"])
    assert drilled.objective < added.objective - 0.01
    assert any(c.mass > 0.01 for c in drilled.removed)
    assert drilled.residual < 1e-14
    for x in planar(drilled.chain):
        assert x[0] * x[3] >= x[1] ** 2 + x[2] ** 2


def test_redesign_keeps_mass_bounds_and_exact_masses() -> None:
    chain, _ = case_I()
    masses = chain.inertial_parameters[:, 0]
    design = balance(
        chain,
        "force",
        mode="redesign",
        region=Ball(REACH),
        material=None,
        masses={j: (m, m) for j, m in zip(chain.joints, masses, strict=True)},
    )
    np.testing.assert_allclose(design.parameters[:, 0], masses, rtol=1e-12)
    assert design.residual < 1e-14


def test_chosen_bodies_only_change() -> None:
    chain, _ = case_I()
    design = balance(chain, "force", material=None, region=Ball(REACH), bodies=["psi", "theta_psi", "gamma"])
    np.testing.assert_array_equal(design.parameters[1], chain.inertial_parameters[1])
    assert design.objective == pytest.approx(0.27, abs=1e-6)


def test_tilted_mechanism_has_the_same_optimum() -> None:
    """Nothing depends on where the plane lies."""
    flat = balance(mechanisms.five_bar(), "force", region=Ball(0.5))
    tilted = balance(mechanisms.five_bar(base=mechanisms.TILTED), "force", region=Ball(0.5))
    assert tilted.objective == pytest.approx(flat.objective, rel=1e-6)


@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_optimum_scales_with_the_unit_of_length(size: float) -> None:
    lengths = np.array([0.4, 1.1, 0.9, 1.0])
    bodies = {j: mechanisms.body(k + 1) for k, j in enumerate(("crank", "coupler", "rocker"))}
    large = {j: pin.Inertia(I.mass, np.array(I.lever) * size, np.array(I.inertia) * size**2) for j, I in bodies.items()}
    one = balance(mechanisms.four_bar(lengths), "force", material=None, region=Ball(0.5))
    other = balance(
        mechanisms.four_bar(lengths * size).with_inertias(large), "force", material=None, region=Ball(0.5 * size)
    )
    assert other.objective == pytest.approx(one.objective, rel=1e-6)


def test_generic_four_bar_has_no_reactionless_design() -> None:
    """Whatever the mass distribution, once the coupler has mass: proved, and the coupler's mass is named."""
    for seed in range(3):
        lengths = np.array([0.4, 1.1, 0.9, 1.0]) + np.random.default_rng(seed).uniform(-0.1, 0.1, 4)
        chain = mechanisms.four_bar(lengths)
        design = balance(chain, "dynamic", mode="redesign", region=Ball(5.0), masses=(0.01, 100.0))
        check_certificate(design)
        assert any("coupler >= 0.01 kg" in c for c in design.certificate.conflict)


def test_bad_requests_are_refused_with_what_is_known() -> None:
    chain, path = case_I()
    with pytest.raises(UnknownNameError, match="force, moment"):
        balance(chain, "shaking")
    with pytest.raises(UnknownNameError, match="rms_torque"):
        balance(chain, "force", minimise="torque")
    with pytest.raises(UnknownNameError, match="theta_psi"):
        balance(chain, "force", bodies=["link2"])
    with pytest.raises(UnknownNameError, match="add, redesign"):
        balance(chain, "force", mode="drill")  # type: ignore[arg-type]
    with pytest.raises(UnknownNameError, match="peak_torque"):
        balance(chain, "force", limits={"torque": 1.0})
    with pytest.raises(UnknownNameError, match="frame of body"):
        balance(chain, "force", region=Ball(0.1, frame="nowhere"))
    with pytest.raises(InvalidInputError, match="empty region"):
        Ball(0.0)
    with pytest.raises(InvalidInputError, match="size"):
        Box((0.1, -0.1, 0.1))
    with pytest.raises(InvalidInputError, match="low <= high"):
        balance(chain, "force", masses=(1.0, 0.5))
    with pytest.raises(InvalidInputError, match="at least one motion"):
        balance(chain, "force", minimise="rms_torque")
    with pytest.raises(InvalidInputError, match="positive weight"):
        balance(chain, "force", minimise={"added_mass": 0.0})
    with pytest.raises(InvalidInputError, match="positive and finite"):
        balance(chain, "force", motions=path, limits={"rms_torque": -1.0})
    with pytest.raises(InvalidInputError, match="not that of a physical body"):
        broken = chain.inertial_parameters.copy()
        broken[3, 9] = 1e-9
        balance(chain.with_inertial_parameters(broken), "force")
    with pytest.raises(InvalidInputError, match="cannot influence"):
        balance(mechanisms.slider_crank(), "static", gravity=(0.0, -1.0, 0.0), bodies=["slider", "rod"])
    with pytest.raises(InvalidInputError, match="at least one name"):
        balance(chain, "force", bodies=[])
    problem = balance_problem(chain, "force")
    with pytest.raises(UnknownNameError, match="prepared objective"):
        problem.solve("distance")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"limits": {"peak_torque": [1.0, 2.0, 3.0]}}, "one number, or 2"),
        ({"limits": {"peak_torque": "much"}}, "numbers only"),
        ({"limits": {"rms_torque": [1.0, 2.0]}}, "one positive and finite number"),
        ({"minimise": {"added_mass": "much"}}, "numbers only"),
        ({"minimise": ["added_mass"]}, "terms with their weights"),
        ({"remove": "psi"}, "sequence of names"),
        ({"region": 0.1}, "a Ball, a Box or an Ellipsoid"),
        ({"motions": 3}, "motions or trajectories"),
        ({"seed": -1}, "not negative"),
    ],
)
def test_arguments_of_the_wrong_type_or_shape_are_named(options: dict[str, object], said: str) -> None:
    """No numpy error leaks out of a public function."""
    chain, path = case_I()
    with pytest.raises(InvalidInputError, match=said):
        balance(chain, "force", **{"motions": path, **options})  # type: ignore[arg-type]


def test_a_mechanism_without_mass_is_balanced_as_it_is() -> None:
    chain = mechanisms.four_bar()
    nothing = chain.with_inertial_parameters(np.zeros_like(chain.inertial_parameters))
    design = balance(nothing, "force")
    assert design.objective == 0.0 and design.residual == 0.0


def test_objectives_without_weight_do_not_slow_or_change_a_solve() -> None:
    """A problem prepared for many objectives answers as one prepared for a single one."""
    chain, path = case_I()
    many = ("added_mass", "peak_torque", "rms_shaking_moment", "distance")
    problem = balance_problem(chain, "force", material=None, region=Ball(REACH), motions=path, objectives=many)
    design = problem.solve({"added_mass": 1.0, "peak_torque": 0.0})
    assert design.objective == pytest.approx(0.27, abs=1e-6)
    assert design.terms["peak_torque"] == pytest.approx(np.abs(inverse_dynamics(design.chain, path).torque).max())


def test_a_motion_that_leaves_the_range_says_where() -> None:
    chain, path = case_I()
    t = np.linspace(0.0, 1.0, 11)
    away = fb.motion.combine(fb.motion.constant(t, 0.0), fb.motion.polynomial(t, path.q[0, 0], np.pi))
    far = chain.with_actuated(("theta_psi", "gamma"))
    with pytest.raises((fb.errors.AssemblyError, fb.errors.SingularityError), match="sample"):
        balance(far, "force", motions=away, near=path.q[0])


def test_a_solver_that_is_not_installed_names_its_package(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "clarabel", None)
    with pytest.raises(SolverError, match="pip install clarabel"):
        balance(case_I()[0], "force")


@pytest.mark.parametrize("region", [Ball(1e308), Ball(0.1, (1e200, 0.0, 0.0)), Box((1e300, 1.0, 1.0))], ids=str)
def test_regions_beyond_what_can_be_told_from_round_off_are_refused(region: Ball | Box) -> None:
    with pytest.raises(InvalidInputError, match=r"region of body .* must lie within 60000 m"):
        balance(case_I()[0], "force", region=region)


def test_no_body_loses_more_than_half_of_its_mass() -> None:
    """Drilling both distal links evenly makes everything lighter without end: the bound is what stops it."""
    chain, _ = case_I()
    bodies = ["theta_psi", "phi_gamma"]
    design = balance(chain, "force", region=Ball(REACH), remove=bodies)
    taken = {c.body: c.mass for c in design.removed}
    for body in bodies:
        whole = chain.inertial_parameters[chain.joints.index(body), 0]
        assert taken[body] == pytest.approx(0.5 * whole, rel=1e-6)


def gimbal(side: tuple[float, float]) -> fb.ClosedChain:
    """Return a body of 1 kg on three crossing hinges; 1 kg at (0.5, 0, 0.5) times `side` balances its force."""
    lever = -0.5 * np.array([side[0], 0.0, side[1]])
    inertia = np.diag([3.0, 3.0, 3.0])
    inertia[0, 2] = inertia[2, 0] = -0.5 * side[0] * side[1]
    model = pin.Model()
    model.gravity.linear = np.zeros(3)
    joint = 0
    for name, kind in (("x", pin.JointModelRX), ("y", pin.JointModelRY), ("z", pin.JointModelRZ)):
        own = pin.Inertia(1.0, lever, inertia) if name == "z" else pin.Inertia(1.0, np.zeros(3), np.eye(3))
        joint = mechanisms.add(model, joint, kind(), mechanisms.at(), name, own)
    return fb.ClosedChain(model, (), ("x", "y", "z"))


@pytest.mark.parametrize("side", [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)])
def test_material_in_a_box_lies_within_its_corners(side: tuple[float, float]) -> None:
    """Spinning about z the body shakes by w^2 I_xz, 0.75 w^2 as it is.

    Half-way to a corner of a box of half lengths one, the mean of (1 - x)(1 - z) >= 0 leaves the added kilogram no
    product of inertia against it; extents along the edges alone would let it take 0.5 away.
    """
    chain = gimbal(side)
    t = np.linspace(0.0, 1.0, 5)
    spin = fb.Motion(t, np.outer(t, [0.0, 0.0, 2.0]), np.tile([0.0, 0.0, 2.0], (5, 1)), np.zeros((5, 3)))
    design = balance(
        chain,
        "force",
        minimise="rms_shaking_moment",
        motions=spin,
        bodies=["z"],
        region=Box((2.0, 2.0, 2.0)),
        masses=(0.0, 1.0),
        material=None,
    )
    assert design.objective == pytest.approx(0.75 * 4.0, rel=1e-6)
    assert design.residual < 1e-14


def with_frame(rotation: np.ndarray, place: tuple[float, float, float]) -> fb.ClosedChain:
    """Return case I with a frame `askew` on the link psi."""
    chain, _ = case_I()
    model = chain.model.copy()
    psi = model.getJointId("psi")
    model.addFrame(pin.Frame("askew", psi, 0, pin.SE3(rotation, np.array(place)), pin.FrameType.OP_FRAME))
    return fb.ClosedChain(model, chain.closures, chain.actuated)


@pytest.mark.parametrize("kind", [Box, Ellipsoid])
def test_a_region_means_the_same_in_the_axes_of_any_frame_of_its_body(kind: type) -> None:
    """Edges and centre are those of the frame, wherever the normal of the plane lies among them."""
    turn = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    chain = with_frame(turn, (0.01, -0.02, 0.0))
    edges, center = np.array([0.09, 0.03, 0.5]), np.array([-0.03, 0.01, 0.0])
    own = kind(edges, center)
    other = kind(turn.T @ edges, turn.T @ (center - [0.01, -0.02, 0.0]), frame="askew")
    one, two = (
        balance(
            chain, "force", material=None, region={"psi": region}, bodies=["psi", "theta_psi", "phi_gamma", "gamma"]
        )
        for region in (own, other)
    )
    assert one.feasible
    assert two.objective == pytest.approx(one.objective, rel=1e-6)
    np.testing.assert_allclose(two.parameters[2, :3], one.parameters[2, :3], atol=1e-5)


@pytest.mark.parametrize("tilt", [1e-3, 0.1, 1.2])
def test_a_box_that_stands_askew_to_the_plane_is_refused(tilt: float) -> None:
    chain = with_frame(pin.rpy.rpyToMatrix(tilt, 0.0, 0.0), (0.0, 0.0, 0.0))
    with pytest.raises(InvalidInputError, match="must have one edge along the normal"):
        balance(chain, "force", region={"psi": Box((0.2, 0.2, 0.2), frame="askew")})
    turned = with_frame(pin.rpy.rpyToMatrix(0.0, 0.0, tilt), (0.0, 0.0, 0.0))
    assert balance(turned, "force", region={"psi": Box((0.2, 0.2, 0.2), frame="askew")}).feasible


def test_a_bound_on_a_mean_square_bounds_the_mean_of_the_squares() -> None:
    chain, path = case_I()
    free = balance(chain, "force", material=None, region=Ball(REACH), motions=path)
    limit = 0.9 * free.after["rms_torque"] ** 2
    bounded = balance(
        chain, "force", material=None, region=Ball(REACH), motions=path, limits={"mean_square_torque": limit}
    )
    assert bounded.after["rms_torque"] ** 2 == pytest.approx(limit, rel=1e-5)
    both = inverse_dynamics(bounded.chain, path).torque
    assert (both**2).sum(axis=1).mean() == pytest.approx(limit, rel=1e-5)


def test_torque_is_bounded_in_both_directions() -> None:
    """A motion and its mirror in time need opposite torques; neither passes the bound."""
    chain, path = case_I()
    free = balance(chain, "force", material=None, region=Ball(REACH), motions=path)
    tau = inverse_dynamics(free.chain, path).torque
    for k, name in enumerate(("least", "largest")):
        limit = 0.9 * abs(tau[:, 0].min() if name == "least" else tau[:, 0].max())
        design = balance(
            chain, "force", material=None, region=Ball(REACH), motions=path, limits={"peak_torque": [limit, 10.0]}
        )
        assert np.abs(inverse_dynamics(design.chain, path).torque[:, 0]).max() <= limit, k


def test_a_redesigned_body_keeps_between_half_and_twice_its_mass() -> None:
    chain, _ = case_I()
    design = balance(chain, "force", mode="redesign", minimise="added_mass", material=None, region=Ball(REACH))
    ratio = design.parameters[:, 0] / chain.inertial_parameters[:, 0]
    assert ratio.min() == pytest.approx(0.5, abs=1e-6)
    assert (ratio >= 0.5 - 1e-9).all() and (ratio <= 2.0 + 1e-9).all()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"masses": (-1.0, 1.0)}, "0 <= low <= high"),
        ({"minimise": {"added_mass": 1.0, "distance": -1.0}}, "one finite number from 0"),
        ({"minimise": {"added_mass": 1e31}}, "one finite number from 0"),
        ({"limits": {"peak_torque": 0.0}}, "positive and finite"),
        ({"limits": {"rms_torque": 0.0}}, "positive and finite"),
        ({"limits": {"added_mass": np.inf}}, "positive and finite"),
        ({"mode": "redesign", "remove": ["psi"]}, "no meaning for a redesign"),
    ],
)
def test_numbers_out_of_their_bounds_are_named(options: dict[str, object], said: str) -> None:
    chain, path = case_I()
    with pytest.raises(InvalidInputError, match=said):
        balance(chain, "force", **{"motions": path, **options})  # type: ignore[arg-type]


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_the_residual_of_a_design_does_not_depend_on_the_unit_of_mass(unit: float) -> None:
    """It is a share of the moving mass, whatever conditions it is taken of."""
    chain, _ = case_I()
    heavy = chain.with_inertial_parameters(unit * chain.inertial_parameters)
    design = balance(heavy, "force", material=None, region=Ball(REACH))
    assert design.objective == pytest.approx(0.27 * unit, rel=1e-5)
    assert design.residual < 1e-14
    unbalanced = replace(design, parameters=heavy.inertial_parameters)
    mine = balance(chain, "force", material=None, region=Ball(REACH))
    assert unbalanced.residual == pytest.approx(replace(mine, parameters=chain.inertial_parameters).residual, rel=1e-9)
