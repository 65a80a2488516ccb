"""One name, one quantity: objectives, designs, scores, comparisons and inverse dynamics give the same numbers."""

from __future__ import annotations

from functools import cache

import mechanisms
import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin import motion as laws
from fivebar_pin._arrays import settled
from fivebar_pin.balancing import Ball, Box, Design, balance, balance_problem, compare, score
from fivebar_pin.balancing.regressors.measures import MEASURES
from fivebar_pin.cli._moving import standing, sway
from fivebar_pin.dynamics import Loads, inverse_dynamics
from fivebar_pin.errors import InvalidInputError

ABOUT = (0.07, -0.11, 0.05)
OBJECTIVES = ("inertia", *(f"{s}_{m}" for m in MEASURES for s in ("rms", "peak", "mean_square")))
TERMS = ("added_mass", *OBJECTIVES)
OFF_PLANE = ("five_bar", "five_bar, tilted", "slider_crank, tilted", "rssr")  # bodies at different heights
SPRUNG = ("five_bar, tilted, sprung", "slider_crank, sprung", "rssr, sprung")
GRAVITY = (3.0, -8.0, 4.0)


def springs_of(kind: str) -> tuple[fb.Spring | fb.JointSpring, ...]:
    """Springs and dampers to the ground, between bodies and on joints."""
    return {
        "five_bar": (
            fb.Spring("universe", "left_elbow_body", 30.0, 0.1, 2.0),
            fb.Spring("left_body", "right_elbow_body", 20.0, 0.0),
            fb.JointSpring("right_elbow", 3.0, 0.4, 0.6),
        ),
        "slider_crank": (fb.Spring("slider_body", "crank_body", 30.0, 0.3, 2.0), fb.JointSpring("slider", 11.0, 0.2)),
        "rssr": (fb.Spring("universe", "coupler_body", 30.0, 0.05), fb.JointSpring("crank", 4.0, 1.0, 0.1)),
    }[kind]


@cache
def moving(name: str) -> tuple[fb.ClosedChain, fb.Trajectory]:
    """A mechanism with drive train and gravity in a motion of few samples."""
    if name in fb.io.shipped():
        chain = fb.load(fb.io.shipped_path(name))
    else:
        kind, *how = name.split(", ")
        base = mechanisms.TILTED if "tilted" in how else mechanisms.AT_ORIGIN
        chain = {
            "five_bar": mechanisms.five_bar,
            "slider_crank": mechanisms.slider_crank,
            "rssr": mechanisms.rssr,
        }[kind](base=base).with_gravity(GRAVITY)
    model = chain.model.copy()
    model.armature[:], model.damping[:] = 1e-4, 1e-3
    chain = fb.ClosedChain(model, chain.closures, chain.actuated, chain.name)
    if name.endswith("sprung"):
        chain = chain.with_springs(springs_of(kind))
    if name in fb.io.shipped():
        path = sway(chain, standing(chain), samples=13)
        assert path is not None
        return chain, path
    t = np.linspace(0.0, 1.0, 13)
    start = {"five_bar": (2.0, 1.0), "slider_crank": (0.9,), "rssr": (0.3,)}[kind]
    swing = [laws.harmonic(t, x - 0.1, 0.1, period=0.9 + 0.2 * k) for k, x in enumerate(start)]
    return chain, fb.drive(chain, laws.combine(*swing))


def measured(chain: fb.ClosedChain, loads: Loads) -> dict[str, float]:
    """All terms from the loads of a mechanism."""
    momentum = loads.reactions.bodies.momentum.sum(axis=1)
    angular = momentum[:, 3:] - np.cross(ABOUT, momentum[:, :3])
    curves: dict[str, np.ndarray] = {x: getattr(loads, x) for x in MEASURES if x != "angular_momentum"}
    curves["torque"] = loads.torque[:, :, None]
    curves["angular_momentum"] = angular - angular.mean(axis=0)
    out = {}
    for name, values in curves.items():
        grouped = values if values.ndim == 3 else values[:, None]
        square = float((grouped**2).sum(axis=(1, 2)).mean())
        out |= {f"mean_square_{name}": square, f"rms_{name}": square**0.5}
        out[f"peak_{name}"] = float(np.linalg.norm(grouped, axis=2).max())
    data, N = chain.model.createData(), loads.trajectory.N
    bare = chain.model.copy()
    bare.armature[:] = 0.0
    columns = [[pin.rnea(bare, data, q, 0.0 * e, e) for e in np.eye(chain.nv)] for q in loads.trajectory.q]
    rest = np.array([pin.rnea(bare, data, q, np.zeros(chain.nv), np.zeros(chain.nv)) for q in loads.trajectory.q])
    M = np.array(columns) - rest[:, None]
    out["inertia"] = float(np.einsum("nik,nij,njk->n", N, M, N).mean())
    return out


def assert_same(found: float, wanted: float, scale: float, what: str) -> None:
    assert found == pytest.approx(wanted, rel=1e-10, abs=1e-12 * scale), what


@pytest.mark.parametrize("kind", ["force", None])
@pytest.mark.parametrize("name", [*fb.io.shipped(), *OFF_PLANE, *SPRUNG])
def test_every_road_gives_a_term_the_same_value(name: str, kind: str | None) -> None:
    chain, path = moving(name)
    region, bodies = Ball(0.5 * chain.length), None if kind else list(chain.joints)
    problem = balance_problem(
        chain,
        kind,
        objectives=TERMS,
        region=region,
        bodies=bodies,
        material=None,
        motions=path,
        about=ABOUT,
        near=path.q[0],
    )
    design = problem.solve({"added_mass": 1.0} if kind else {"rms_torque": 1.0, "added_mass": 1e-3})
    assert design.feasible
    check(design, path, tuple(dict.fromkeys(TERMS)))
    assert design.chain.springs == chain.springs
    if chain.springs:  # they are felt: without them the same bodies take another torque and load other bearings
        bare = inverse_dynamics(design.chain.with_springs(()), path, about=ABOUT)
        sprung = inverse_dynamics(design.chain, path, about=ABOUT)
        assert np.abs(sprung.torque - bare.torque).max() > 0.1
        assert np.abs(sprung.bearing_force - bare.bearing_force).max() > 0.1


@pytest.mark.parametrize("name", OFF_PLANE)
@pytest.mark.parametrize(
    "term", ["rms_shaking_moment", "peak_shaking_moment", "peak_bearing_force", "mean_square_frame_moment"]
)
@pytest.mark.parametrize("mode", ["add", "redesign"])
@pytest.mark.parametrize("shape", ["ball", "box"])
def test_what_is_promised_is_what_the_designed_bodies_do(name: str, term: str, mode: str, shape: str) -> None:
    """Bodies at different heights, planes that are tilted, material added and taken away, new bodies."""
    chain, path = moving(name)
    half = 0.5 * chain.length
    region = Ball(half) if shape == "ball" else Box(2.0 * half * np.ones(3))
    design = balance(
        chain,
        None,
        minimise={term: 1.0, "distance": 1e-6},
        mode=mode,  # type: ignore[arg-type]
        region=region,
        remove=(chain.joints[-1],) if mode == "add" else (),
        motions=path,
        about=ABOUT,
        near=path.q[0],
    )
    assert design.feasible
    before = measured(chain, inverse_dynamics(chain, path, about=ABOUT))[term]
    assert design.terms[term] <= before * (1.0 + 1e-9)
    assert abs(design.gap) < 1e-5 * before  # what a design leaves open and still calls itself optimal
    check(design, path, (term,))


def check(design: Design, path: fb.Trajectory, terms: tuple[str, ...]) -> None:
    loads = inverse_dynamics(design.chain, path, about=ABOUT)
    wanted = measured(design.chain, loads) | {"added_mass": design.chain.mass - design.original.mass}
    scores = score(design.original, path, design.parameters, terms=terms, about=ABOUT)
    table = compare({"before": design.original, "after": design}, path, terms=terms, about=ABOUT)
    before = measured(design.original, inverse_dynamics(design.original, path, about=ABOUT))
    for term in terms:
        size = max(design.scale(term), abs(wanted[term]))
        assert_same(scores[term][0], wanted[term], size, f"score {term}")
        assert_same(table.values[term][1], wanted[term], size, f"compare {term}")
        if term in design.terms:
            assert_same(design.terms[term], wanted[term], size, f"terms {term}")
        if term in design.after:
            assert_same(design.after[term], wanted[term], size, f"after {term}")
            assert_same(design.before[term], before[term], size + before[term], f"before {term}")


def test_a_force_balanced_four_bar_under_gravity_does_not_shake_in_words_either() -> None:
    """Nothing is stripped for it: its weight is on the frame, not among what shakes; round-off is written as 0."""
    chain = fb.load(fb.io.shipped_path("four_bar_crank_rocker"))
    path = sway(chain, standing(chain), samples=41)
    design = balance(chain, "force", motions=path)
    assert chain.model.gravity.linear.any()
    assert 0.0 <= design.after["rms_shaking_force"] < 1e-14 < 0.1 < design.before["rms_shaking_force"]
    lines = str(design).splitlines()
    assert any(line.startswith("  rms_shaking_force: 0.1") and line.endswith("-> 0") for line in lines), lines
    assert any(line.startswith("  peak_shaking_force: 0.") and line.endswith("-> 0") for line in lines), lines
    weight = 9.81 * design.chain.mass
    assert f"  rms_frame_force: {design.before['rms_frame_force']:.5g} -> {weight:.5g}" in lines
    assert "shaking_force 0," in repr(inverse_dynamics(design.chain, path))
    table = str(compare({"before": chain, "after": design}, path))
    assert next(line for line in table.splitlines() if line.startswith("rms_shaking_force")).split()[-1] == "0"
    found = score(chain, path, design.parameters, terms=("mean_square_shaking_force", "added_mass"))
    assert "mean_square_shaking_force from 0," in repr(found) and found["mean_square_shaking_force"][0] > 0.0
    least = balance(chain, "force", motions=path, minimise="rms_shaking_force")
    assert "objective 0," in repr(least)


def test_without_gravity_the_frame_carries_what_shakes_it_and_is_not_told_apart() -> None:
    chain, path = moving("five_bar_case_I")
    design = balance(chain, "force", motions=path)
    assert not any("frame" in name for name in design.before)
    design = balance(chain, "force", motions=path, minimise={"rms_frame_force": 1.0, "added_mass": 1.0})
    assert design.after["peak_frame_force"] == pytest.approx(design.after["peak_shaking_force"], abs=1e-15)


def test_a_comparison_refers_to_the_same_point_as_the_design() -> None:
    chain, path = moving("five_bar")
    terms = ("rms_shaking_moment", "peak_frame_moment")
    here, there = (compare({"a": chain}, path, terms=terms, about=about) for about in ((0.0, 0.0, 0.0), ABOUT))
    for term in terms:
        loads = inverse_dynamics(chain, path, about=ABOUT)
        assert there.values[term][0] == pytest.approx(measured(chain, loads)[term], rel=1e-12)
        assert here.values[term][0] != pytest.approx(there.values[term][0], rel=1e-3)


def test_a_mean_square_is_round_off_when_its_root_is() -> None:
    """A root of 1e-7 of what adds up to it is a result; its square, 1e-14, is one too."""
    chain, path = moving("five_bar_case_I")
    design = balance(chain, "force", motions=path)
    root = design.scale("rms_shaking_force")
    for share, gone in ((1e-7, False), (1e-13, True)):
        assert (settled(share * root, root) == 0.0) == gone
        assert (settled((share * root) ** 2, design.scale("mean_square_shaking_force")) == 0.0) == gone


def test_what_is_compared_has_names() -> None:
    chain = fb.load("four_bar_crank_rocker")
    for chains, message in (([chain], "must map names to mechanisms"), ({}, "must hold at least one mechanism")):
        with pytest.raises(InvalidInputError, match=message):
            compare(chains, ())
