"""From a conic program to a design: solve a hair inside the cones, move onto the conditions, check, compare bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fivebar_pin._arrays import Array, Immutable, frozen
from fivebar_pin.balancing.conic import ConicForm, Cost
from fivebar_pin.balancing.design import PROVED, Design
from fivebar_pin.balancing.finishing import compact, finished, made
from fivebar_pin.balancing.objectives.objective import Objective
from fivebar_pin.balancing.solvers import SECOND, Block, Certificate, Outcome, Program, solve
from fivebar_pin.balancing.solvers.cones import outside
from fivebar_pin.errors import SolverError

__all__ = ["Question", "optimum"]

_MARGINS = (1e-9, 1e-8, 1e-7, 1e-6)  # how far inside the cones a design is kept, as a share of the moving mass
_GIVE = ((1e-9, 1e-8), (1e-8, 1e-7))  # margin, and how far regions give way where nothing else is left, the same
_ROUGH = 1e-3  # residual of a rough answer, and gap that it may leave to the design without material [-]
_NEGLIGIBLE = 1e-7  # share of the moving mass that is not worth a piece of material
_EXACT = 1e-13  # residual of the conditions of a finished design [of its largest mass or the moving mass]
_FELT = 1e-9  # factor of an inertia that counts as zero in the conditions and terms of a scaled problem [-]
_PHYSICAL = 1e-12  # smallest eigenvalue of a pseudo-inertia that counts as zero [kg, kg m, kg m2]


@dataclass(frozen=True, slots=True, eq=False)
class Question(Immutable):
    """One objective over a program.

    Attributes:
        form: the program, without the objective.
        weights: of the atoms.
        limits: upper bounds besides those of the form.
        solver: who is asked first.
        design: the one that is not: what is answered where there is none, and what all others are made from.
        near: configuration (nq,) of the one branch that is balanced, or None.
    """

    form: ConicForm
    weights: Mapping[Objective, float]
    limits: tuple[Block, ...]
    solver: str
    design: Design
    near: Array | None

    @property
    def bounds(self) -> tuple[Block, ...]:
        """Return everything that is asked but for the caps."""
        return (*self.form.program.blocks, *self.limits)


@dataclass(frozen=True, slots=True, eq=False)
class _Task:
    """A question as a program, with the solver that answers it."""

    question: Question
    cost: Cost
    program: Program
    solver: str

    def size(self, design: Design) -> float:
        """Return the size of the objective that gaps are measured by."""
        return max(abs(design.objective), self.cost.unit)

    def proved(self, design: Design) -> bool:
        """Return whether the bound of a design says that it is optimal."""
        return design.gap <= PROVED * self.size(design)

    def graded(self, design: Design) -> Design:
        """Call a design optimal where its bound says so."""
        return design if self.proved(design) else replace(design, status="feasible")

    def solved(self, margin: float = 0.0, give: float = 0.0) -> Outcome:
        """Solve, the cones tightened by a margin, or soft bounds given way."""
        return solve(self.program, self.cost.P, self.cost.q, margin=margin, give=give, solver=self.solver)


def optimum(question: Question) -> Design:
    """Return the optimum, or the proof that there is none.

    The second solver is asked where the first has no acceptable answer, or leaves a gap; here and nowhere else.

    Raises:
        SolverError: neither, by any solver.
    """
    cost = question.form.cost(question.weights)
    program = Program(cost.P.size, [*question.bounds, *question.form.caps, *cost.epigraphs], cost.sizes)
    tasks = [_Task(question, cost, program, name) for name in dict.fromkeys((question.solver, SECOND))]
    design = _best_inside(tasks)
    if design is not None:
        return design
    failure = SolverError("the problem was not solved")
    for task in tasks:
        try:
            return _or_nothing(_at_the_boundary(task), task)
        except SolverError as error:
            if _missing(error):
                raise
            failure = error
    design = _no_material(tasks[0])
    if design is None:
        raise failure
    return design


def _missing(error: SolverError) -> bool:
    """Return whether a solver is not there at all: it is to be installed, and no other asked in its place."""
    return isinstance(error.__cause__, ImportError)


def _best_inside(tasks: Sequence[_Task]) -> Design | None:
    """Return the better of the solvers' designs inside the cones, with the better bound; one is enough if it proves."""
    best = None
    for task in tasks:
        try:
            design = _inside(task)
        except SolverError as error:
            if _missing(error):
                raise
            continue  # to be tried on the boundary, where it says why if it fails again
        if design is None and best is None:
            return None
        if design is not None:
            below = design.dual_bound if best is None else max(best.dual_bound, design.dual_bound)
            better = design if best is None else min(best, design, key=lambda d: d.objective)
            best = replace(better, dual_bound=below)
            if task.proved(best):
                break
    return None if best is None else tasks[0].graded(best)


def _inside(task: _Task) -> Design | None:
    """Return the design that is kept a hair inside the cones, by the least margin that makes it physical."""
    for margin in _MARGINS:
        outcome = task.solved(margin=margin)
        if outcome.x is None:
            return None
        design, _ = _finished(outcome, task)
        if design is not None:
            return design
    return None


def _at_the_boundary(task: _Task) -> Design:
    """Return a design where bodies are points or sheets on the boundary of their regions, or the proof of none.

    Regions give way by a hair.

    Raises:
        SolverError: neither.
    """
    outcome = task.solved()
    if outcome.x is None:
        return replace(task.question.design, certificate=_proof(task) or outcome.certificate)
    design, problem = _finished(outcome, task)
    for margin, give in _GIVE:
        if design is not None:
            return task.graded(design)
        outcome = task.solved(margin=margin, give=give)
        if outcome.x is not None:
            design, problem = _finished(outcome, task)
    if design is not None:
        return task.graded(design)
    raise SolverError(
        f"neither a design nor a proof that there is none: the closest one {problem}. It may exist only where "
        "bodies shrink to points, or only as a limit. Loosen the bounds or the regions."
    )


def _or_nothing(design: Design, task: _Task) -> Design:
    """Return the design without any material instead, where it is as good as far as the bound can tell.

    Next to the apex of all cones a solver's material is made of its own errors: none meets everything exactly.
    """
    nothing = _nothing(task, design.dual_bound / task.cost.unit) if design.feasible else None
    if nothing is None or nothing.objective - design.objective > max(design.gap, PROVED * task.size(design)):
        return design
    return task.graded(nothing)


def _no_material(task: _Task) -> Design | None:
    """Return the design without any material, where it is one and a rough answer proves it all but optimal.

    Conditions can leave nothing else, at the apex of all cones, where no solver comes to an end.
    """
    try:
        rough = solve(task.program, task.cost.P, task.cost.q, tolerance=_ROUGH, solver=task.solver)
    except SolverError:
        return None
    design = _nothing(task, rough.bound)
    near = design is not None and design.gap <= _ROUGH * task.size(design)
    return task.graded(design) if design is not None and near else None


def _nothing(task: _Task, bound: float) -> Design | None:
    """Return the design without any material, where it is one, with a bound on its objective in the task's unit."""
    if max((outside(b.cone, b.g) for b in task.question.bounds), default=0.0) > _EXACT:
        return None
    n = task.cost.P.size
    zero = Outcome(np.zeros(n), np.zeros(0), float("nan"), float("nan"), bound, None)
    return _finished(zero, task)[0]


def _proof(task: _Task) -> Certificate | None:
    """Return a proof that does without the caps on masses, which says more, if there is one."""
    form = task.question.form
    nothing = np.zeros(form.n)
    try:
        program = Program(form.n, task.question.bounds, form.sizes)
        return solve(program, nothing, nothing, solver=task.solver).certificate
    except SolverError:
        return None


def _finished(outcome: Outcome, task: _Task) -> tuple[Design | None, str]:
    """Make a solution exact and check it; None and the reason when it is not physical."""
    assert outcome.x is not None
    question, form = task.question, task.question.form
    felt = form.felt(list(question.weights), question.limits) > _FELT
    x = compact(form, outcome.x[: form.n], felt)
    for drop in (_NEGLIGIBLE, 0.0):  # without what only keeps a body strictly physical, if that can be
        y, residual = finished(form, x, drop, felt)
        parameters, added, removed, lowest = made(form, y)
        if residual <= _EXACT and lowest >= -_PHYSICAL:
            break
    else:
        return None, (
            f"misses the conditions by {residual:.2g} ({_EXACT:g} is allowed) and its least physical body by "
            f"{max(0.0, -lowest):.2g} ({_PHYSICAL:g})"
        )
    values = {atom: atom.value(form.measurement, parameters) for atom in question.weights}
    design = replace(
        question.design,
        status="optimal",
        objective=sum(question.weights[atom] * value for atom, value in values.items()),
        dual_bound=task.cost.unit * outcome.bound,
        terms={atom.name: value for atom, value in values.items()},
        parameters=frozen(parameters),
        added=added,
        removed=removed,
        measurement=form.measurement,
        branch=question.near,
    )
    return design, ""
