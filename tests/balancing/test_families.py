"""One class is enough: an objective, a region, a variable and a solver that the library has never seen."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog

import fivebar_pin as fb
from fivebar_pin.balancing import (
    Ball,
    Disc,
    balance,
    balance_problem,
    objectives,
    pareto,
    realise,
    score,
    solvers,
    variables,
)
from fivebar_pin.balancing.conditions import balance_conditions
from fivebar_pin.balancing.objectives import objective as registry
from fivebar_pin.balancing.regressors import MEASURES
from fivebar_pin.balancing.variables import AddedMaterial
from fivebar_pin.errors import InvalidInputError, SolverError, UnknownNameError

PAGE = Path(__file__).parents[2] / "docs" / "extending.md"


@pytest.fixture(autouse=True)
def forgotten(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Forget at the end of a test what it registered."""
    monkeypatch.setattr(registry, "_PLAIN", list(registry._PLAIN))
    before = [(table, dict(table)) for table in (variables.MODES, solvers.SOLVERS)]
    yield
    for table, content in before:
        table.clear()  # type: ignore[attr-defined]
        table.update(content)  # type: ignore[attr-defined]


def blocks(section: str) -> list[str]:
    """Return the code of one section of the page."""
    parts = re.split(r"^## (.+)$", PAGE.read_text(), flags=re.M)
    text = dict(zip(parts[1::2], parts[2::2], strict=True))[section]
    return re.findall(r"```python\n(.*?)```", text, flags=re.S)


def run(section: str) -> dict[str, Any]:
    """Run the code of one section and return its names."""
    names: dict[str, Any] = {}
    for code in blocks(section):
        exec(compile(code, f"{PAGE.name}: {section}", "exec"), names)
    return names


def five_bar() -> fb.ClosedChain:
    return fb.load(fb.io.shipped_path("five_bar_case_I"))


def cheapest(reach: float) -> float:
    """Return the least mass of points at the ends of a cross on every body that balances, by linear programming."""
    conditions = balance_conditions(five_bar(), "force")
    nb, ends = len(five_bar().joints), reach * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    points = np.zeros((10 * nb, 4 * nb))
    for b in range(nb):
        points[10 * b, 4 * b : 4 * b + 4] = 1.0
        points[10 * b + 1 : 10 * b + 3, 4 * b : 4 * b + 4] = ends.T
    found = linprog(np.ones(4 * nb), A_eq=conditions.matrix @ points, b_eq=-conditions.residual())
    return float(found.fun)


def swaying() -> tuple[fb.ClosedChain, fb.Motion]:
    chain = fb.load(fb.io.shipped_path("four_bar_crank_rocker"))
    return chain, fb.motion.harmonic(np.linspace(0.0, 1.0, 17), 0.5, 0.3, period=1.0)


def test_a_new_objective_is_minimised_bounded_and_scored_by_its_word() -> None:
    """No lighter heaviest body exists: with all masses bounded a little below it there is a proof."""
    design = run("An objective")["design"]
    chain, least = five_bar(), design.objective
    present = chain.inertial_parameters[:, 0]
    assert design.status == "optimal" and least == pytest.approx(design.parameters[:, 0].max(), rel=1e-12)
    assert least > present.max() * 1.01
    for share, feasible in ((1.0 + 1e-4, True), (1.0 - 1e-4, False)):
        room = {j: (0.0, share * least - m) for j, m in zip(chain.joints, present, strict=True)}
        assert balance(chain, "force", region=Ball(0.1), masses=room).feasible == feasible
    bounded = balance(chain, "force", region=Ball(0.1), limits={"heaviest_body": 1.1 * least})
    assert least * (1.0 - 1e-6) <= bounded.parameters[:, 0].max() <= 1.1 * least * (1.0 + 1e-9)
    other, motion = swaying()
    found = score(other, motion, other.inertial_parameters, terms="heaviest_body")["heaviest_body"]
    assert found == [other.inertial_parameters[:, 0].max()]


@pytest.mark.parametrize(
    ("apart", "reach"), [((0.0, 0.12, 0.0), 0.08), ((0.1, 0.0, 0.0), 0.05), ((0.0, 0.0, 0.0), 0.1)]
)
def test_a_new_region_holds_material(apart: tuple[float, float, float], reach: float) -> None:
    """The lens reaches sqrt(r^2 - a^2 / 4) across and r - a / 2 along the line of its centres."""
    lens = run("A region")["Lens"](0.1, apart)
    design = balance(five_bar(), "force", region=lens, material=None)
    assert design.status == "optimal"
    assert design.objective == pytest.approx(cheapest(reach), rel=1e-5)


def test_a_new_region_holds_discs_as_a_whole() -> None:
    """A lens that is all but a ball gives the discs of the ball, and those of a thin one lie within both balls."""
    lens = run("A region")["Lens"]
    chain, _ = swaying()
    ball, same, thin = (
        balance(chain, "force", region=region, counterweight=Disc("steel", 0.02, arm=0.0))
        for region in (Ball(0.2), lens(0.2, (0.0, 0.0, 0.0)), lens(0.2, (0.0, 0.1, 0.0)))
    )
    assert same.objective == pytest.approx(ball.objective, rel=1e-5)
    assert thin.objective > ball.objective * 1.01
    made = realise(thin)
    assert made.attained
    for w in made.weights:
        for y in (-0.05, 0.05):
            assert np.linalg.norm(w.pose[:2, 3] - [0.0, y]) + w.radius <= 0.2 + 2e-5 * chain.length


def test_a_new_variable_balances_and_is_a_mode_by_its_word() -> None:
    """Points at the ends of a cross lie where the least material of a ball does: the moments are along the links."""
    names = run("A variable")
    design = balance(five_bar(), "force", variables=names["points"])
    assert design.status == "optimal" and design.residual < 1e-14
    assert design.objective == pytest.approx(cheapest(0.1), rel=1e-6)

    @variables.register("points")
    @dataclass(frozen=True, slots=True, eq=False)
    class Crosses(variables.Variable):
        reach: float

        @classmethod
        def of(cls, stated: variables.Stated) -> Crosses:
            assert isinstance(stated.region, Ball)
            return cls(stated.region.radius)

        def parts(self, setting: Any) -> list[variables.Part]:
            ends = self.reach * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
            each = (names["PointMasses"](joint, tuple(map(tuple, ends))) for joint in setting.chain.joints)
            return [part for one in each for part in one.parts(setting)]

    by_word = balance(five_bar(), "force", mode="points", region=Ball(0.05))
    assert by_word.mode == "points" and by_word.objective == pytest.approx(cheapest(0.05), rel=1e-6)
    far = tuple((0.01 * x, 0.01 * y, 0.0) for x, y, _ in names["cross"])
    none = balance(five_bar(), "force", variables=[names["PointMasses"](j, far) for j in five_bar().joints])
    assert not none.feasible and none.certificate is not None and none.certificate.size > 100.0


def test_a_new_solver_is_asked_by_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """Point masses and their sum are a linear program; no other solver has a word in it."""
    points = run("A variable")["points"]
    run("A solver")

    def refuses(problem: object, tolerance: float) -> Iterator[solvers.Answer]:
        raise SolverError("asked the wrong solver")
        yield

    for other in ("clarabel", "scipy"):
        monkeypatch.setitem(solvers.SOLVERS, other, refuses)
    design = balance(five_bar(), "force", variables=points, solver="simplex")
    assert design.status == "optimal" and design.objective == pytest.approx(cheapest(0.1), rel=1e-6)
    with pytest.raises(SolverError, match="wrong solver"):
        balance(five_bar(), "force", variables=points)


def test_a_word_stands_for_its_atom() -> None:
    """Names, atoms and mixtures of both are the same problem; an atom of no quantity is refused."""
    chain, motion = swaying()
    given: tuple[Any, ...] = (
        {"rms_torque": 1.0, "added_mass": 0.1},
        {objectives.Rms("torque"): 1.0, objectives.AddedMass(): 0.1},
        objectives.Rms("torque") + 0.1 * objectives.AddedMass(),
        2.0 * (objectives.Rms("torque") * 0.25 + 0.25 * objectives.Rms("torque") + 0.05 * objectives.AddedMass()),
        {"rms_torque": 0.5, objectives.Rms("torque"): 0.5, objectives.AddedMass(): 0.1},
    )
    designs = [balance(chain, "force", minimise=m, region=Ball(0.3), motions=motion) for m in given]
    assert len({d.objective for d in designs}) == 1 and len({tuple(d.terms) for d in designs}) == 1
    top = 1.2 * designs[0].terms["rms_torque"]
    by_name, by_atom = (
        balance(chain, "force", region=Ball(0.3), motions=motion, limits=limits)
        for limits in ({"rms_torque": top}, {objectives.Rms("torque"): top})
    )
    assert by_name.objective == by_atom.objective
    front = pareto(chain, "force", objectives.MeanSquare("torque"), "added_mass", 3, region=Ball(0.3), motions=motion)
    assert front.first == "mean_square_torque"
    with pytest.raises(UnknownNameError, match="shaking_force"):
        objectives.Rms("shaking")


def test_every_atom_is_known_by_its_name() -> None:
    known: Mapping[str, objectives.Objective] = objectives.known()
    assert {"added_mass", "inertia", "distance"} <= {*known}
    assert {f"{word}_{m}" for m in MEASURES for word in ("rms", "peak", "mean_square")} <= {*known}
    assert all(objectives.named(name, "term") == atom and atom.name == name for name, atom in known.items())


def test_variables_say_all_that_may_change() -> None:
    """The shorthand and what it stands for are one problem; both together are refused."""
    chain = five_bar()
    short = balance(chain, "force", region=Ball(0.1), material=None)
    full = balance(chain, "force", variables=[AddedMaterial(region=Ball(0.1))])
    assert full.objective == short.objective
    np.testing.assert_array_equal(full.parameters, short.parameters)
    with pytest.raises(InvalidInputError, match="say all that may change"):
        balance(chain, "force", variables=[AddedMaterial()], region=Ball(0.1))
    with pytest.raises(InvalidInputError, match="sequence of variables"):
        balance(chain, "force", variables=AddedMaterial())  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="no meaning for a redesign"):
        balance(chain, "force", mode="redesign", remove=["psi"])
    with pytest.raises(InvalidInputError, match="another Region"):
        balance(chain, "force", region=0.1)  # type: ignore[arg-type]


def test_a_further_limit_is_in_the_unit_of_its_atom() -> None:
    """Of a mean square too: the bound on the rms is its root."""
    chain, motion = swaying()
    problem = balance_problem(chain, "force", objectives=("added_mass", "rms_torque"), region=Ball(0.3), motions=motion)
    free = problem.solve("added_mass").after["rms_torque"]
    least = problem.solve("rms_torque").objective
    top = 0.5 * (free + least)
    by_rms = problem.solve("added_mass", limits={"rms_torque": top})
    by_square = problem.solve("added_mass", limits={"mean_square_torque": top**2})
    assert by_rms.after["rms_torque"] == pytest.approx(top, rel=1e-6)
    assert by_square.objective == pytest.approx(by_rms.objective, rel=1e-9)
