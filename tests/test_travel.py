"""What travels: errors between processes with their evidence, results with their arrays read-only."""

from __future__ import annotations

import copy
import importlib
import inspect
import multiprocessing
import pickle
import pkgutil
import threading
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from dataclasses import fields, is_dataclass
from functools import cache, cached_property

import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
import fivebar_pin.chain
from fivebar_pin import balancing, errors, paper
from fivebar_pin._arrays import Immutable
from fivebar_pin.balancing import objectives, solvers
from fivebar_pin.balancing.branches import Branch
from fivebar_pin.balancing.objectives.overreach import Overreach
from fivebar_pin.balancing.pieces.trial import Size, Trial
from fivebar_pin.balancing.solvers.answer import Answer
from fivebar_pin.balancing.solvers.program import ConicProblem
from fivebar_pin.balancing.variables import Stated
from fivebar_pin.paper import polar
from fivebar_pin.paper.positions import position
from fivebar_pin.springs import JointSpring, Spring
from tests import mechanisms

WAYS = {
    "pickle": lambda x: pickle.loads(pickle.dumps(x)),
    "pickle, oldest": lambda x: pickle.loads(pickle.dumps(x, protocol=2)),
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
}
ABSTRACT = (fb.Closure, fb.closures.Anchored, fb.closures.FrameClosure)  # of which no value is made
WORKSHOPS = (
    "walk",
    "sampling",
    "solve",
    "counterweight_search",
    "regressors.body_motion",
    "regressors.quantity",
    "solvers.barrier",
)
ELLIPSOID = balancing.Ellipsoid((0.1, 0.2, 0.3))
INNER = ("viz", "cli", "io", "__main__", *(f"balancing.{m}" for m in WORKSHOPS))  # whose values no result holds
EXAMPLES = {"float": 1.5e-3, "int | None": 7, "float | None": 0.25, "Iterable[str]": ("a", "b"), "object": "motor 1"}


CLOSURES = (
    fb.Closure(("a", "b")),
    fb.Closure(("a", "b"), "6d"),
    fb.Closure(("a", "b"), "revolute", axis=(0.0, 1.0, 2.0), name="hinge"),
    fb.Closure(("a", "b"), "cylindrical", axis=(0.0, 1.0, 2.0)),
    fb.Closure(("a", "b"), "distance", length=0.7),
    fb.Closure(("a", "b"), "coupling", ratio=(1.0, 3.7), offset=0.2),
)


class Strange(errors.AssemblyError):
    """A new member of the family whose author forgot about pickling: three arguments, one message."""

    def __init__(self, first: int, *, second: float, third: str) -> None:
        self.first, self.second = first, second
        super().__init__(f"{first}, {second}, {third}", closure=third, residual=second)


def family(root: type = errors.FiveBarPinError) -> list[type]:
    return [root, *(kind for child in root.__subclasses__() for kind in family(child))]


def example(kind: type) -> errors.FiveBarPinError:
    """Make an error by what its class asks for."""
    wanted = inspect.signature(kind.__init__).parameters.values()
    positional, named = [], {}
    for p in list(wanted)[1:]:
        if p.kind in (p.VAR_POSITIONAL, p.VAR_KEYWORD):
            continue
        value = EXAMPLES.get(p.annotation, f"the {p.name}")
        if p.kind is p.KEYWORD_ONLY:
            named[p.name] = value
        else:
            positional.append(value)
    return kind(*positional, **named) if named or positional else kind("a message")


def fail(kind_index: int) -> None:
    raise example(family()[kind_index])


@pytest.mark.parametrize("kind", family(), ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("way", WAYS)
def test_every_error_keeps_message_and_evidence(kind, way):
    error = example(kind)
    error.__notes__ = ["met on the way"]
    other = WAYS[way](error)
    assert type(other) is kind and other is not error
    assert str(other) == str(error) and other.args == error.args
    assert vars(other) == vars(error)


def test_the_whole_family_is_looked_at():
    stated = {name for name in errors.__all__ if not issubclass(getattr(errors, name), Warning)}
    assert {kind.__name__ for kind in family()} >= {*stated, "Strange"}


def test_evidence_that_cannot_travel_is_written_down():
    lock = threading.Lock()
    error = pickle.loads(pickle.dumps(errors.InvalidInputError("lock", lock, "must be a number")))
    assert error.value == repr(lock) and error.name == "lock"


def test_a_process_pool_passes_every_error_on():
    context = multiprocessing.get_context("spawn")
    kinds = family()
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        for k, kind in enumerate(kinds):
            with pytest.raises(kind) as caught:
                pool.submit(fail, k).result(timeout=60)
            assert str(caught.value) == str(example(kind)) and vars(caught.value).items() >= vars(example(kind)).items()


def test_a_multiprocessing_pool_passes_every_error_on():
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        for k, kind in enumerate(family()):
            with pytest.raises(kind):
                pool.apply_async(fail, (k,)).get(timeout=60)


def modules() -> Iterator[object]:
    for info in pkgutil.walk_packages(fb.__path__, "fivebar_pin."):
        outer = (
            info.ispkg
            or info.name.count(".") == 1
            or info.name.startswith(("fivebar_pin.balancing", "fivebar_pin.paper"))
        )
        if outer and not info.name.startswith(tuple(f"fivebar_pin.{room}" for room in INNER)):
            yield importlib.import_module(info.name)


@cache
def public_values() -> frozenset[type]:
    """Return every dataclass that a module of the library offers under its `__all__`."""
    offered = [getattr(m, name) for m in modules() for name in getattr(m, "__all__", ())]
    made = [x for x in offered if is_dataclass(x) and isinstance(x, type) and x not in ABSTRACT]
    return frozenset(x for x in made if x.__dataclass_params__.frozen)


@cache
def specimens() -> tuple[object, ...]:
    """Return results of every kind, as a user gets them."""
    chain = mechanisms.four_bar()
    q0 = fb.assembly_modes(chain, [0.5])[0]
    t = np.linspace(0.0, 1.0, 21)
    trajectory = fb.drive(chain, fb.motion.cycloidal(t, 0.5, 1.5), near=q0)
    motion = fb.motion.cycloidal(t, 0.5, 1.5)
    loads = fb.inverse_dynamics(chain, trajectory)
    loads.joint_reactions, loads.shaking_force  # noqa: B018  cached
    free = fb.simulate(chain, q0, np.zeros(chain.nv), np.zeros(chain.na), t)
    energy = fb.energy_balance(chain, free)
    linkage = paper.table_1("I", "unbalanced")
    five = linkage.chain()
    moved = paper.default_motion(samples=21)
    solution = paper.solve(linkage, moved, mode=paper.AssemblyMode.LEFT)
    problem = balancing.balance_problem(five, "force", region=balancing.Ball(0.1), motions=[moved])
    design = fb.balance(five, "force", region=balancing.Ball(0.1), motions=[moved])
    none = fb.balance(five, "dynamic", region=balancing.Ball(0.1))
    front = fb.pareto(five, "force", "added_mass", "rms_torque", 2, region=balancing.Ball(0.1), motions=[moved])
    bodies_of_three = np.stack([five.inertial_parameters] * 3)
    score = fb.score(five, moved, bodies_of_three)
    both = balancing.compare({"a": five, "b": design}, moved)
    paths = fb.drive(five, moved, near=linkage.configuration(*moved.q[0], mode=paper.AssemblyMode.LEFT))
    regions = (
        balancing.Box((0.1, 0.2, 0.3)),
        balancing.Ellipsoid((0.1, 0.2, 0.3)),
        balancing.Disc(0.1, thickness=0.01),
    )
    crossed = mechanisms.parallelogram()
    split = (Branch(np.zeros(crossed.nq), fb.balance_conditions(crossed, "force"), True),)
    more = (balancing.realise(design), balancing.regressor(five, paths, "torque"), fb.diagnose(five), *split)
    task = polar.Problem((1.0, 1.0), np.r_[np.full(4, -1.0), np.zeros(4), np.ones(4)], np.full(12, 2.0))
    angles = (moved.q[:, 0], moved.q[:, 1])
    inner = (balancing.Ball(0.1), task, polar.alone(task, np.ones(12)), position(linkage.lengths, *angles))
    program = solvers.Program(1, [solvers.Block("x >= 1", "nonneg", np.eye(1), -np.ones(1))])
    conic = solvers.solve(program, np.zeros(1), np.ones(1))
    small = (
        conic,
        ConicProblem(program, np.zeros(1), np.ones(1), -np.ones(1)),
        Answer("solved", np.ones(1), np.ones(1), ""),
    )
    inner += (*small, balancing.pieces.Bar("steel", 0.01), balancing.pieces.Sphere("steel"))
    own = (
        *inner,
        *forms(five, moved),
        paper.balance_mass_centres(linkage),
        paper.conditions(linkage),
        paper.audit_table_1(),
        paper.errata(),
        loads.reactions,
        fb.diagnosis.propose_closures(fb.ClosedChain(five.model, (), ())),
        fb.diagnosis.propose_motors(five),
        fb.frame_motion(chain, trajectory, "coupler_end"),
        fb.sweep(five, moved, inertias=bodies_of_three, of=("torque", "peak_torque")),
    )
    bodies = (fb.chain.BarBody(("a", "b"), 0.5), fb.chain.LumpBody(("a",), 1.0))
    plate = fb.chain.PlateBody(("a", "b", "c"), 2700.0, 0.01)
    elbow = fb.chain.Placement("elbow", (("l", np.eye(6)[0]),))
    own += (fb.chain.Geometry({"l": 0.3}, (elbow,), (*bodies, plate), ("l",)),)
    return (
        *(chain, motion, trajectory, loads, free, energy, linkage, five, solution, problem, design, none, front, score),
        *CLOSURES,
        *(both, *regions, *more, *own, fb.Visual("crank_body", "sphere", (0.1,)), Spring("a", "b", 1.0, 0.5)),
        *(JointSpring("a", 1.0, 0.0), paper.compare_complements(linkage, moved, mode="left")),
    )


def forms(chain: fb.ClosedChain, motion: fb.Motion) -> Iterator[object]:
    """Yield conic programs with variables, regions and pieces of every kind, and what they are made of."""
    where = {"psi": balancing.Ball(0.1), "gamma": balancing.Box((0.2, 0.2, 0.2)), "phi_gamma": ELLIPSOID}
    kinds = {"psi": balancing.Disc("steel", 0.01), "gamma": balancing.Sphere("steel")}
    names = list(objectives.known())
    every = {"region": where, "motions": [motion], "objectives": names}
    first = balancing.balance_problem(chain, "force", counterweight=kinds, remove=["psi"], **every)
    for problem in (first, balancing.balance_problem(chain, "force", mode="redesign", **every)):
        form = problem.form
        yield from (problem, form, form.cost({atom: 1.0 for atom in problem.objectives}))
        yield objectives.Designs(form.setting, form.measurement, form.parts, form.E, form.X0, form.E, form.X0)
        yield form.parts[0].part.make(form.setting, np.ones(form.parts[0].part.size), chain.inertial_parameters)
    sizes = {0: Size(0.1, np.zeros(2))}
    yield from (Trial(sizes), Stated(), Overreach())


def graph(root: object, seen: dict[int, object] | None = None) -> dict[int, object]:
    """Return everything of ours, and every array, that hangs on an object."""
    seen = {} if seen is None else seen
    if id(root) in seen:
        return seen
    if isinstance(root, (np.ndarray, Immutable)):
        seen[id(root)] = root
    if is_dataclass(root) and not isinstance(root, type):
        for f in fields(root):
            graph(getattr(root, f.name), seen)
    elif isinstance(root, Mapping):
        for value in root.values():
            graph(value, seen)
    elif isinstance(root, (tuple, list)):
        for value in root:
            graph(value, seen)
    return seen


def alike(one: object, other: object) -> None:
    """Compare two results field by field; arrays exactly, and read-only."""
    assert type(one) is type(other)
    if isinstance(one, np.ndarray):
        assert np.array_equal(one, other, equal_nan=one.dtype.kind == "f") and one.dtype == other.dtype
        assert not other.flags.writeable
    elif is_dataclass(one):
        for f in fields(one):
            alike(getattr(one, f.name), getattr(other, f.name))
    elif isinstance(one, Mapping):
        assert list(one) == list(other)
        for key in one:
            alike(one[key], other[key])
    elif isinstance(one, (tuple, list)):
        for a, b in zip(one, other, strict=True):
            alike(a, b)
    elif isinstance(one, pin.Model):
        assert one == other
    elif not callable(one) and type(one).__eq__ is not object.__eq__:
        assert one == other or (one != one and other != other)


def test_every_public_value_is_of_the_kind_that_stays_read_only():
    assert len(public_values()) > 25
    assert [kind.__name__ for kind in public_values() if not issubclass(kind, Immutable)] == []


def test_a_specimen_of_every_public_value_is_looked_at():
    met = {type(x) for root in specimens() for x in graph(root).values()}
    left = [kind.__name__ for kind in public_values() - met if not inspect.isabstract(kind)]
    assert sorted(left) == []


@pytest.mark.parametrize("way", WAYS)
def test_results_keep_numbers_and_stay_read_only(way):
    for root in specimens():
        other = WAYS[way](root)
        alike(root, other)
        for x in graph(other).values():
            if isinstance(x, np.ndarray):
                with pytest.raises(ValueError, match="read-only"):
                    x[...] = 0


def test_a_pickled_chain_gives_the_same_numbers():
    chain = fb.load(fb.io.shipped_path("six_bar_watt"))
    q0 = fb.assembly_modes(chain, [0.5])[0]
    motion = fb.motion.cycloidal(np.linspace(0.0, 1.0, 11), 0.5, 0.9)
    one, other = (
        fb.inverse_dynamics(c, fb.drive(c, motion, near=q0)) for c in (chain, pickle.loads(pickle.dumps(chain)))
    )
    for name in ("torque", "shaking_force", "shaking_moment", "joint_reactions", "com"):
        assert np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True)
        assert not getattr(other, name).flags.writeable


def computed_once(value: object) -> Iterator[tuple[str, object]]:
    """Yield what a result computes when it is first asked for and keeps."""
    for name in dir(type(value)):
        if not name.startswith("_") and isinstance(inspect.getattr_static(type(value), name), cached_property):
            with suppress(errors.FiveBarPinError):
                yield name, getattr(value, name)


def test_what_is_computed_once_is_read_only_too():
    looked = [
        (name, part)
        for root in specimens()
        for x in (root, pickle.loads(pickle.dumps(root)))
        for name, found in computed_once(x)
        for part in graph((found,)).values()
    ]
    assert len(looked) > 30
    assert [name for name, part in looked if isinstance(part, np.ndarray) and part.flags.writeable] == []
