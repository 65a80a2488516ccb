"""Solvers: standard problems with known optima, two solvers that agree, bounds and proofs that hold whatever z is."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import balance_problems
import mechanisms
import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin.balancing import Ball, Box, Design, balance, balance_problem, pareto
from fivebar_pin.balancing.finishing import exact
from fivebar_pin.balancing.parameters import pseudo_inertia
from fivebar_pin.balancing.solvers import SOLVERS, Block, Program, solve, solver_named
from fivebar_pin.balancing.solvers import answer as answers
from fivebar_pin.balancing.solvers.bound import lower_bound, reach
from fivebar_pin.balancing.solvers.certificate import certificate_of
from fivebar_pin.balancing.solvers.cones import outside, projected, scaling, smat, vector
from fivebar_pin.balancing.solvers.program import ConicProblem
from fivebar_pin.cli import main
from fivebar_pin.errors import SolverError, UnknownNameError

AGREE = 1e-6  # largest difference of two optima [of the objective's typical size]
ROUND = 1e-7  # how far an optimum may be below a bound: designs meet their bounds to the solver's tolerance [the same]


@dataclass(frozen=True)
class Standard:
    """A small program and its optimum; none where it has no solution."""

    name: str
    n: int
    blocks: tuple[Block, ...]
    q: tuple[float, ...]
    optimum: float | None
    P: tuple[float, ...] = ()


def block(cone: str, G: list[list[float]], g: list[float]) -> Block:
    return Block(cone, cone, np.array(G, dtype=float), np.array(g, dtype=float))


R2 = np.sqrt(2.0)
STANDARD = (
    Standard("corner of two half-planes", 2, (block("nonneg", [[1, 0], [0, 1], [1, 1]], [0, 0, -1]),), (1, 2), 1.0),
    Standard("length of (3, 4)", 1, (block("soc", [[1], [0], [0]], [0, 3, 4]),), (1,), 5.0),
    Standard(
        "least trace with ones off the diagonal", 2, (block("psd", [[1, 0], [0, 0], [0, 1]], [0, R2, 0]),), (1, 1), 2.0
    ),
    Standard(
        "closest point of a plane, squared",
        3,
        (block("zero", [[1, 1, 1]], [-3]), block("nonneg", np.eye(3).tolist(), [1, 1, 1])),
        (0, 0, 0),
        3.0,
        (2, 2, 2),
    ),
    Standard("linear over a disc", 2, (block("soc", [[0, 0], [1, 0], [0, 1]], [1, 0, 0]),), (3, 4), -5.0),
    Standard("no number above one and below zero", 1, (block("nonneg", [[1], [-1]], [-1, 0]),), (0,), None),
    Standard(
        "no point on a line that misses a disc",
        2,
        (block("zero", [[1, 0]], [-2]), block("soc", [[0, 0], [1, 0], [0, 1]], [1, 0, 0])),
        (0, 0),
        None,
    ),
    Standard(
        "no matrix with a large corner and a small trace",
        2,
        (block("psd", [[1, 0], [0, 0], [0, 1]], [0, R2, 0]), block("nonneg", [[-1, -1]], [1])),
        (0, 0),
        None,
    ),
    Standard("equalities that contradict each other", 2, (block("zero", [[1, 1], [2, 2]], [0, 1]),), (0, 0), None),
)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("one", STANDARD, ids=lambda s: s.name)
def test_standard_programs_end_at_their_optimum_or_a_proof(one: Standard, solver: str) -> None:
    program = Program(one.n, one.blocks, np.full(one.n, 10.0))
    P = np.array(one.P or np.zeros(one.n), dtype=float)
    outcome = solve(program, P, np.array(one.q, dtype=float), solver=solver)
    if one.optimum is None:
        assert outcome.x is None and outcome.certificate is not None
        assert outcome.certificate.size > 1e5
        return
    assert outcome.objective == pytest.approx(one.optimum, abs=1e-7)
    assert one.optimum - 1e-6 <= outcome.bound <= one.optimum + 1e-15


@pytest.mark.parametrize("k", range(12))
def test_both_solvers_agree_on_random_problems(k: int) -> None:
    """Four-bars to 3-RRR and Delta; each one's bound is below the other's optimum."""
    case = balance_problems.draw(np.random.default_rng((3, k)))
    problem = balance_problem(case.chain, case.kind, **case.arguments)
    one, other = (problem.solve(case.minimise, solver=solver) for solver in SOLVERS)
    assert one.status == other.status
    if not one.feasible:
        assert one.certificate is not None and other.certificate is not None
        assert min(one.certificate.size, other.certificate.size) > 100.0
        return
    size = max(abs(one.objective), sum(w * problem.size(t) for t, w in case.minimise.items()))
    assert one.objective == pytest.approx(other.objective, abs=AGREE * size)
    assert max(one.dual_bound, other.dual_bound) <= min(one.objective, other.objective) + ROUND * size


@pytest.mark.parametrize(
    "options",
    [
        {"minimise": "peak_torque"},
        {"minimise": "mean_square_torque", "region": Box((0.3, 0.2, 0.2))},
        {"minimise": {"rms_bearing_force": 1.0, "inertia": 0.1}, "mode": "redesign"},
        {"minimise": "distance", "mode": "redesign"},
        {"limits": {"peak_torque": 0.05}},
    ],
    ids=str,
)
def test_both_solvers_agree_on_every_kind_of_objective(options: dict[str, object]) -> None:
    chain, path = balance_problems.moved("five_bar_case_I")
    one, other = (balance(chain, "force", motions=path, solver=s, **options) for s in SOLVERS)  # type: ignore[arg-type]
    assert one.objective == pytest.approx(other.objective, rel=AGREE)
    assert max(one.dual_bound, other.dual_bound) <= min(one.objective, other.objective) * (1.0 + ROUND)


def test_a_bound_holds_for_any_dual_vector_where_the_dual_value_alone_does_not() -> None:
    """Perturbed multipliers of a linear, a quadratic and a semidefinite program: never above the optimum."""
    rng = np.random.default_rng(0)
    fooled = 0
    for one in STANDARD:
        if one.optimum is None:
            continue
        P, q = np.array(one.P or np.zeros(one.n), dtype=float), np.array(one.q, dtype=float)
        program = Program(one.n, one.blocks, np.full(one.n, 6.0))
        found = solve(program, P, q)
        assert found.x is not None
        for _ in range(50):
            x = found.x + 1e-3 * rng.normal(size=one.n)
            z = found.z + 1e-3 * rng.normal(size=found.z.size)
            assert lower_bound(program, P, q, x, z) <= one.optimum
            fooled += -program.g @ z - 0.5 * x @ (P * x) > one.optimum + 1e-5
    assert fooled > 10


def test_a_bound_of_a_design_counts_what_stationarity_leaves_over(monkeypatch: pytest.MonkeyPatch) -> None:
    """A solver that is off by what is accepted: the old value exceeds the optimum, `dual_bound` does not."""
    chain, _ = balance_problems.moved("five_bar_case_I")
    problem = balance_problem(chain, "force", region=Ball(0.1))
    best = problem.solve("added_mass")
    seen: list[float] = []

    def sloppy(given: object, tolerance: float) -> Iterator[answers.Answer]:
        for good in real(given, tolerance):  # type: ignore[arg-type]
            z = good.z.copy()
            z -= 2e-10 * np.sign(given.g)  # type: ignore[attr-defined]
            seen.append(float(-given.program.g @ z))  # type: ignore[attr-defined]
            yield answers.Answer(good.kind, good.x, z, good.status)

    real = solver_named("clarabel")
    monkeypatch.setitem(SOLVERS, "clarabel", sloppy)
    design = problem.solve("added_mass")
    assert design.dual_bound <= best.objective
    assert max(seen) * problem.form.setting.mass > best.dual_bound


def test_a_ray_proves_only_what_the_bounds_on_the_variables_let_it() -> None:
    """x >= 1 and -x >= -1 + 1e-3 contradict each other by 1e-3; a ray that is off by 1e-3 says nothing."""
    program = Program(1, [block("nonneg", [[1], [-1]], [-1, 1 - 1e-3])], np.full(1, 10.0))
    good, bad = np.array([1.0, 1.0]), np.array([1.0, 1.0 - 2e-3])
    assert reach(program, good / 1e-3, program.g) < 1e-9
    assert certificate_of(program, good, program.g).size > 1e9
    feasible = Program(1, [block("nonneg", [[1], [-1]], [-1, 1 + 1e-3])], np.full(1, 10.0))
    with pytest.raises(SolverError, match="bounds on the variables"):
        certificate_of(feasible, np.array([1.0, 1.0 - 3e-3]), feasible.g)
    assert float(feasible.g @ (bad / 1.0)) != 0.0


@pytest.mark.parametrize("cone", ["nonneg", "soc", "psd"])
def test_projection_on_a_cone_is_the_closest_point(cone: str) -> None:
    """z - p is normal to the cone at p: p in K, p - z in K* = K, and p.(p - z) = 0 (Moreau)."""
    rng = np.random.default_rng(1)
    for _ in range(50):
        z = rng.normal(size=6)
        p = projected(cone, z)
        assert outside(cone, p) < 1e-14 and outside(cone, p - z) < 1e-14
        assert p @ (p - z) == pytest.approx(0.0, abs=1e-13)
    np.testing.assert_allclose(vector(smat(z)), z, rtol=1e-15)


@pytest.mark.parametrize("kind", ["solved", "infeasible", "unbounded"])
def test_no_answer_is_believed_unchecked(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever a solver says: half-converged numbers are an error with their residual."""
    program = Program(1, STANDARD[1].blocks, np.full(1, 10.0))

    def half(problem: object, tolerance: float) -> Iterator[answers.Answer]:
        yield answers.Answer(kind, np.array([5.001]), np.array([1.0, -0.6, -0.8]), "said with confidence")

    monkeypatch.setitem(SOLVERS, "clarabel", half)
    with pytest.raises(SolverError) as caught:
        solve(program, np.zeros(1), np.ones(1))
    assert kind == "unbounded" or caught.value.residual > caught.value.tolerance


@pytest.mark.parametrize(
    ("x", "z", "q"),
    [
        (0.0, 0.0, 0.0),  # outside the cone, x >= 1; no slope, no gap
        (1.0, 0.0, 1.0),  # the optimum, without the multiplier that proves it: slope and gap
        (1.5, 1.0, 1.0),  # inside, with the right multiplier: a gap alone
    ],
)
def test_each_part_of_optimality_is_checked_by_itself(
    x: float, z: float, q: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = Program(1, (block("nonneg", [[1]], [-1]),), np.full(1, 10.0))

    def wrong(problem: object, tolerance: float) -> Iterator[answers.Answer]:
        yield answers.Answer("solved", np.array([x]), np.array([z]), "solved")

    monkeypatch.setitem(SOLVERS, "clarabel", wrong)
    with pytest.raises(SolverError, match="stopped at a residual"):
        solve(program, np.zeros(1), np.array([q]))


def test_a_slope_that_is_left_shows_where_there_is_no_gap(monkeypatch: pytest.MonkeyPatch) -> None:
    """x = 0 of -x over x >= 0: its value is that of z = 0, and yet it is no optimum."""
    program = Program(1, (block("nonneg", [[1]], [0]),), np.full(1, 10.0))

    def wrong(problem: object, tolerance: float) -> Iterator[answers.Answer]:
        yield answers.Answer("solved", np.zeros(1), np.zeros(1), "solved")

    monkeypatch.setitem(SOLVERS, "clarabel", wrong)
    with pytest.raises(SolverError, match=r"stopped at a residual of 0\.5"):
        solve(program, np.zeros(1), np.array([-1.0]))


def test_multipliers_outside_the_dual_cone_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """x = 6 is not the least; z = (1, -2, 0) has no residual and no gap to 6, but is no multiplier."""
    program = Program(1, STANDARD[1].blocks, np.full(1, 10.0))

    def wrong(problem: object, tolerance: float) -> Iterator[answers.Answer]:
        yield answers.Answer("solved", np.array([6.0]), np.array([1.0, -2.0, 0.0]), "solved")

    monkeypatch.setitem(SOLVERS, "clarabel", wrong)
    with pytest.raises(SolverError, match="residual"):
        solve(program, np.zeros(1), np.ones(1))


def test_a_panic_of_the_solver_is_an_answer_like_any_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """Clarabel's panics are no Exceptions; they end in an error of ours, an interrupt stays an interrupt."""
    import clarabel

    class PanicException(BaseException):
        pass

    program = Program(1, STANDARD[1].blocks, np.full(1, 10.0))
    for raised, expected in ((PanicException("eigenvalues"), SolverError), (KeyboardInterrupt(), KeyboardInterrupt)):

        def panics(*_: object, error: BaseException = raised) -> object:
            raise error

        monkeypatch.setattr(clarabel, "DefaultSolver", panics)
        with pytest.raises(expected):
            solve(program, np.zeros(1), np.ones(1))


def test_an_unknown_solver_is_refused_with_those_that_there_are() -> None:
    chain = mechanisms.four_bar()
    with pytest.raises(UnknownNameError, match="clarabel, scipy"):
        balance(chain, "force", solver="mosek")
    with pytest.raises(UnknownNameError, match="clarabel, scipy"):
        balance_problem(chain, "force").solve("added_mass", solver="ecos")


def test_the_command_line_knows_the_same_solvers(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["balance", "--help"])
    assert ", ".join(SOLVERS) in " ".join(capsys.readouterr().out.split())
    with pytest.raises(SystemExit):
        main(["balance", "five_bar_case_I", "--solver", "mosek"])
    said = capsys.readouterr().err
    assert all(name in said for name in SOLVERS)
    assert main(["balance", "five_bar_case_I", "--radius", "0.1", "--solver", "scipy"]) == 0
    assert "0.27" in capsys.readouterr().out


def test_balancing_needs_no_cvxpy() -> None:
    code = (
        "import sys; sys.modules['cvxpy'] = None\n"
        "import fivebar_pin as fb\n"
        "chain = fb.load(fb.io.shipped_path('four_bar_crank_rocker'))\n"
        "print([fb.balance(chain, 'force', solver=s).feasible for s in ('clarabel', 'scipy')])"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[True, True]"


@cache
def delta() -> fb.ClosedChain:
    return fb.load(fb.io.shipped_path("delta"))


@cache
def conditions_of_the_delta() -> fb.BalanceConditions:
    return fb.balance_conditions(delta(), "force")


def physical(design: Design) -> None:
    assert design.residual < 1e-14
    for pi in (*design.parameters, *(c.parameters for c in design.added)):
        assert np.linalg.eigvalsh(pseudo_inertia(pi))[0] >= -1e-12


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(
    "options",
    [
        {"region": Box((0.2, 0.2, 0.2))},
        {"region": Box((1.0, 1.0, 1.0))},
        {"mode": "redesign", "region": Box((0.6, 0.6, 0.6))},
        {"remove": ["arm_1", "rod_1_tilt", "slide_z"], "region": Box((0.6, 0.6, 0.6))},
    ],
    ids=str,
)
def test_bodies_that_the_conditions_leave_empty_do_not_stop_a_delta(options: dict[str, object], solver: str) -> None:
    """m(slide_x) = 0 and m(slide_y) = 0 leave their bodies at the apex of the cone."""
    found = conditions_of_the_delta()
    design = balance(delta(), "force", solver=solver, conditions=found, **options)  # type: ignore[arg-type]
    assert design.feasible
    assert design.gap < 1e-6 * (1.0 + design.objective)
    physical(design)
    changed = {c.body: c.mass for c in design.added}
    assert changed["slide_x"] == changed["slide_y"] == 0.0


def test_the_front_of_the_delta_is_traced() -> None:
    chain, path = balance_problems.moved("delta")
    front = pareto(chain, "force", "added_mass", "rms_torque", 5, motions=path)
    assert (np.diff(front.values[:, 0]) > 0).all() and (np.diff(front.values[:, 1]) < 0).all()


def test_an_empty_body_that_must_have_mass_is_a_proof() -> None:
    design = balance(delta(), "force", masses={"slide_x": (0.1, 1.0)})
    assert not design.feasible and design.certificate is not None
    assert any("slide_x >= 0.1 kg" in label for label in design.certificate.conflict)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("region", [Ball(0.5, (-0.5, 0.0, 0.0)), Box((1.0, 1.0, 1.0), (0.0, 0.5, 0.0))], ids=str)
def test_designs_that_exist_only_as_points_and_sheets_are_found(region: Ball | Box, solver: str) -> None:
    """mcy(arm) = 0 and mcx(rod_swing) = 0 on the border of a region: flat material, no volume to solve in."""
    design = balance(delta(), "force", region=region, material=None, solver=solver)
    assert design.feasible
    assert abs(design.gap) < 1e-6
    physical(design)


def test_bodies_left_empty_leave_the_program_without_a_trace() -> None:
    """No condition of round-off is left over, and moving a design onto the conditions gives them no material."""
    form = balance_problem(delta(), "force", material=None).form
    assert [p.part.label for p, gone in zip(form.parts, form.gone, strict=True) if gone] == [
        "material added to slide_x",
        "material added to slide_y",
    ]
    assert np.abs(form.program.G).max(axis=1).min() > 1e-3
    y, _ = exact(form, np.random.default_rng(0).uniform(0.1, 1.0, form.n), 0.0)
    for p, gone in zip(form.parts, form.gone, strict=True):
        assert y[p.where].any() != gone


def test_masses_that_cancel_in_pairs_are_left_empty() -> None:
    """m(a) + m(b) = 0 and m(c) - m(d) = 0 empty the first two bodies alone; a bound above zero empties none."""
    from fivebar_pin.balancing.facial_reduction import empty, without
    from fivebar_pin.balancing.variables.asked import material
    from fivebar_pin.balancing.variables.material import Bounds
    from fivebar_pin.balancing.variables.part import Placed

    materials = [Placed(material(b, 1, f"{b}", Bounds(), planar=True), 4 * b) for b in range(4)]
    rows = np.zeros((2, 16))
    rows[0, [0, 4]], rows[1, [8, 12]] = 1.0, (1.0, -1.0)
    own = [m.widened(b, 16) for m in materials for b in m.part.cones]
    equal = Block("equal", "zero", rows, np.zeros(2))
    assert empty([equal, *own], materials, 16) == (True, True, False, False)
    below = Block("below", "nonneg", -rows[:1], np.zeros(1))
    assert empty([below, *own], materials, 16) == (True, True, False, False)
    room = Block("below", "nonneg", -rows[:1], np.ones(1))
    assert not any(empty([room, *own], materials, 16))
    kept = without([equal, *own], materials, (True, True, False, False), 16)
    assert sum(b.cone == "soc" for b in kept) == 2
    assert [b.g.size for b in kept if b.cone == "zero"] == [8, 1]


def test_where_the_default_has_no_acceptable_answer_the_second_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    chain, _ = balance_problems.moved("five_bar_case_I")

    def nothing(problem: ConicProblem, tolerance: float) -> Iterator[answers.Answer]:
        yield answers.nothing(problem, "gave up")

    monkeypatch.setitem(SOLVERS, "clarabel", nothing)
    assert balance(chain, "force", region=Ball(0.1), material=None).objective == pytest.approx(0.27, abs=1e-6)
    monkeypatch.setitem(SOLVERS, "scipy", nothing)
    with pytest.raises(SolverError, match="gave up"):
        balance(chain, "force", region=Ball(0.1))


@pytest.mark.parametrize("cone", ["nonneg", "soc", "psd"])
def test_the_scaling_of_a_cone_takes_its_unit_to_the_point_and_stays_inside(cone: str) -> None:
    rng = np.random.default_rng(2)
    unit = {"nonneg": np.ones(6), "soc": np.eye(6)[0], "psd": vector(np.eye(3))}[cone]
    for _ in range(30):
        z = projected(cone, rng.normal(size=6))
        W = scaling(cone, z)
        np.testing.assert_allclose(W @ unit, z, atol=1e-7)
        assert outside(cone, W @ projected(cone, rng.normal(size=6))) < 1e-7


@pytest.mark.parametrize("region", [Ball(0.1, (0.02, -0.03, 0.0)), Box((0.2, 0.1, 0.1), center=(0.03, 0.0, 0.0))])
@pytest.mark.parametrize("remove", [(), ("theta_psi", "phi_gamma")], ids=["added", "removed"])
def test_no_solution_is_larger_than_the_sizes_that_bounds_are_taken_over(
    region: object, remove: tuple[str, ...]
) -> None:
    """In any direction: a proof within sizes that solutions do not keep would prove nothing."""
    chain, _ = balance_problems.moved("five_bar_case_I")
    form = balance_problem(chain, None, region=region, masses=(0.0, 0.5), remove=remove, material=None).form
    program, rng = form.program, np.random.default_rng(5)
    assert np.isfinite(form.sizes).all()
    largest = np.zeros(form.n)
    for _ in range(20):
        x = solve(program, np.zeros(program.n), rng.normal(size=program.n) * np.exp(rng.normal(size=program.n))).x
        assert x is not None
        largest = np.maximum(largest, np.abs(x[: form.n]))
    assert (largest <= form.sizes * (1.0 + 1e-6) + 1e-9).all()


def gimbal(present: pin.Inertia) -> fb.ClosedChain:
    """Three hinges through one point, the outer two bodies balanced on it."""
    model = pin.Model()
    joint = 0
    for k, (name, kind) in enumerate((("x", pin.JointModelRX()), ("y", pin.JointModelRY()), ("z", pin.JointModelRZ()))):
        body = pin.Inertia(1.0, np.zeros(3), np.eye(3)) if k < 2 else present
        joint = mechanisms.add(model, joint, kind, mechanisms.at(), name, body)
    return fb.ClosedChain(model, (), ("x", "y", "z"))


@pytest.mark.parametrize("masses", [(1.0, 1.0), (0.9, 1.1), (0.7, 0.7), (1.3, 1.3)])
def test_conditions_of_which_only_round_off_is_left_prove_nothing(masses: tuple[float, float]) -> None:
    """Bodies that lie balanced leave rows of 1e-17 to the one that may change: no proof of anything."""
    spread = 3.0 * np.eye(3)
    spread[0, 2] = spread[2, 0] = -0.5
    chain = gimbal(pin.Inertia(1.0, np.array([-0.5, 0.0, -0.5]), spread))
    design = balance(chain, "force", bodies=["z"], region=Ball(2.0), material=None, masses=masses)
    assert design.status == "optimal"
    (added,) = design.added
    np.testing.assert_allclose(added.mass * np.array(added.place), [0.5, 0.0, 0.5], rtol=0.0, atol=1e-9)
    assert masses[0] - 1e-9 <= added.mass <= masses[1] + 1e-9
