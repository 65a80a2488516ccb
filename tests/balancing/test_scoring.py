"""Scores of many designs are what each design's own chain measures."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import mechanisms
import numpy as np
import pytest

import fivebar_pin as fb
from fivebar_pin import paper
from fivebar_pin.balancing import balance, score
from fivebar_pin.dynamics import inverse_dynamics
from fivebar_pin.errors import InvalidInputError, UnknownNameError


def five_bar() -> tuple[fb.ClosedChain, tuple[fb.Trajectory, fb.Trajectory]]:
    linkage = paper.table_1("I", "unbalanced")
    chain = linkage.chain(gravity=(0.5, -9.0, 1.0))
    model = chain.model.copy()
    model.damping[:] = 1e-3
    chain = fb.ClosedChain(model, chain.closures, chain.actuated)
    fast, slow = paper.default_motion(samples=31), paper.default_motion(samples=21, period=2.0)
    near = linkage.configuration(*fast.q[0])
    return chain, (fb.drive(chain, fast, near=near), fb.drive(chain, slow, near=near))


def designs(chain: fb.ClosedChain, k: int) -> np.ndarray:
    return np.stack(
        [
            [mechanisms.body(100 * i + b, size=0.05).toDynamicParameters() for b in range(len(chain.joints))]
            for i in range(k)
        ]
    )


def test_scores_agree_with_inverse_dynamics_design_by_design() -> None:
    """rms over all samples of both motions, peaks over samples and motors; gravity and damping included, 1e-12."""
    chain, paths = five_bar()
    X = designs(chain, 5)
    names = ("torque", "shaking_force", "shaking_moment")
    found = score(chain, paths, X, terms=[f"{s}_{m}" for m in names for s in ("rms", "peak", "mean_square")])
    for k, x in enumerate(X):
        loads = [inverse_dynamics(chain.with_inertial_parameters(x), path) for path in paths]
        for name in names:
            values = np.concatenate([getattr(load, name) for load in loads])
            rms = np.sqrt((values**2).sum(axis=1).mean())
            peak = np.abs(values).max() if name == "torque" else np.linalg.norm(values, axis=1).max()
            assert found[f"rms_{name}"][k] == pytest.approx(rms, rel=1e-12)
            assert found[f"mean_square_{name}"][k] == pytest.approx(rms**2, rel=1e-12)
            assert found[f"peak_{name}"][k] == pytest.approx(peak, rel=1e-12)


def test_bearing_forces_momentum_and_linear_terms_agree_too() -> None:
    chain, paths = five_bar()
    X = designs(chain, 3)
    found = score(
        chain,
        paths[0],
        X,
        terms=("peak_bearing_force", "rms_angular_momentum", "added_mass", "inertia"),
        about=(0.1, 0, 0),
    )
    for k, x in enumerate(X):
        loads = inverse_dynamics(chain.with_inertial_parameters(x), paths[0])
        forces = np.concatenate([loads.joint_reactions[:, :, :2], loads.closure_reactions[:, :, :2]], axis=1)
        assert found["peak_bearing_force"][k] >= np.linalg.norm(forces, axis=2).max() * (1 - 1e-12)
        momentum = loads.reactions.bodies.momentum.sum(axis=1)
        angular = momentum[:, 3:] - np.cross((0.1, 0, 0), momentum[:, :3])
        deviation = angular - angular.mean(axis=0)
        assert found["rms_angular_momentum"][k] == pytest.approx(np.sqrt((deviation**2).sum(axis=1).mean()), rel=1e-12)
        assert found["added_mass"][k] == pytest.approx(x[:, 0].sum() - chain.mass)
    assert (found["inertia"] > 0).all()


def test_blocks_and_progress_do_not_change_the_scores() -> None:
    chain, paths = five_bar()
    X = np.repeat(designs(chain, 3), 4000, axis=0)
    seen: list[tuple[int, int]] = []
    found = score(chain, paths[0], X, progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (12000, 12000) and len(seen) > 1
    np.testing.assert_allclose(found["rms_torque"][::4000], score(chain, paths[0], X[::4000])["rms_torque"], rtol=1e-13)
    assert found["rms_torque"][found.best("rms_torque")] == found["rms_torque"].min()


def test_a_balanced_design_scores_zero_shaking_force() -> None:
    linkage = paper.table_1("I", "unbalanced")
    chain, motion = linkage.chain(), paper.default_motion(samples=31)
    near = linkage.configuration(*motion.q[0])
    design = balance(chain, "force")
    found = score(chain, motion, np.stack([chain.inertial_parameters, design.parameters]), near=near)
    assert found["rms_shaking_force"][0] > 0.5
    assert found["rms_shaking_force"][1] < 1e-13


def test_designs_that_cannot_be_scored_are_named() -> None:
    chain, paths = five_bar()
    X = designs(chain, 4)
    with pytest.raises(InvalidInputError, match=r"must be \(k, 4, 10\)"):
        score(chain, paths, X[:, :3])
    with pytest.raises(UnknownNameError, match="rms_torque"):
        score(chain, paths, X, terms=("torque",))
    for entry, value in (((2, 1, 0), -0.1), ((2, 1, 9), 1e-9), ((2, 1, 5), np.nan), ((2, 1, 0), np.inf)):
        bad = X.copy()
        bad[entry] = value
        with pytest.raises(InvalidInputError, match="design 2, body phi_gamma"):
            score(chain, paths, bad)


def test_what_stands_still_scores_zero() -> None:
    """At rest without gravity nothing depends on the masses: no factor is left, and every score is zero."""
    linkage = paper.table_1("I", "unbalanced")
    chain, motion = linkage.chain(), paper.default_motion(samples=3)
    rest = fb.Motion(motion.t[:1], motion.q[:1], 0.0 * motion.v[:1], 0.0 * motion.a[:1])
    path = fb.drive(chain, rest, near=linkage.configuration(*motion.q[0]))
    found = score(chain, path, designs(chain, 4), terms=("rms_torque", "peak_shaking_force"))
    assert len(found) == 4
    assert not found["rms_torque"].any() and not found["peak_shaking_force"].any()


@pytest.mark.parametrize("count", [1, 63, 64, 65, 297, 298, 2049, 9000])
def test_scores_do_not_depend_on_how_the_designs_are_cut_into_pieces(count: int) -> None:
    chain, paths = five_bar()
    X = np.repeat(designs(chain, 3), -(-count // 3), axis=0)[:count]
    together = score(chain, paths, X)
    for k in {0, count // 2, count - 1}:
        alone = score(chain, paths, X[k])
        for term in ("rms_shaking_force", "rms_shaking_moment", "rms_torque"):
            assert together[term][k] == pytest.approx(alone[term][0], rel=1e-13)


@pytest.mark.parametrize(
    ("mass", "moment", "second"),
    [
        (1.0, 0.0, (-1.0, 0.0, 0.0)),  # the trace
        (1.0, 0.0, (-1.0, -1.0, 3.0)),  # two negative ones, which a determinant does not see
        (1.0, 0.0, (-0.1, 10.0, 10.0)),  # one negative one, which only the determinant sees
        (0.0, 1.0, (1.0, 0.0, 0.0)),  # a first moment without mass
        (-1e-6, 0.0, (1.0, 1.0, 1.0)),
    ],
)
def test_a_body_is_physical_by_its_mass_and_all_its_second_moments(
    mass: float, moment: float, second: tuple[float, float, float]
) -> None:
    """Whichever axis the wrong moment lies along."""
    chain, paths = five_bar()
    good = designs(chain, 1)[0]
    score(chain, paths[0], good, terms="added_mass")
    for turn in range(3):
        x, y, z = np.roll(second, turn)
        bad = good.copy()
        bad[2] = [mass, *np.roll([moment, 0.0, 0.0], turn), y + z, 0.0, x + z, 0.0, 0.0, x + y]
        with pytest.raises(InvalidInputError, match="design 0, body psi"):
            score(chain, paths[0], bad, terms="added_mass")


@pytest.mark.parametrize("share", [0.99, 1.01])
@pytest.mark.parametrize(
    ("arm", "second", "bound"),
    [
        (1.0, (-1.0, 0.0, 0.0), 2.0),  # the trace, -t, of the size 2 m arm^2 = 2
        (0.0, (1.0, -1.0, 0.0), 1.0),  # the minors, -t, of the size 1 squared
        (0.0, (0.5, 0.5, -1.0), 4.0),  # the determinant, -t / 4, of the size 1 cubed
    ],
)
def test_a_body_is_physical_up_to_a_billionth_of_its_size(
    arm: float, second: tuple[float, float, float], bound: float, share: float
) -> None:
    """A negative second moment -t passes below the bound on its invariant and fails above it.

    So it is whatever the axis, and for a body of three times everything.
    """
    chain, paths = five_bar()
    moments = np.array(second)
    moments[moments < 0.0] = -1e-9 * bound * share
    for turn in range(3):
        x, y, z = np.roll(moments, turn)
        xx, yy, zz = np.array([y + z, x + z, x + y]) + np.roll([0.0, arm**2, arm**2], turn)
        border = designs(chain, 1)[0]
        border[2] = 3.0 * np.array([1.0, *np.roll([arm, 0.0, 0.0], turn), xx, 0.0, yy, 0.0, 0.0, zz])
        if share < 1.0:
            assert len(score(chain, paths[0], border, terms="added_mass")) == 1
        else:
            with pytest.raises(InvalidInputError, match="design 0, body psi"):
                score(chain, paths[0], border, terms="added_mass")


def test_the_first_body_that_is_not_physical_is_named_among_many() -> None:
    chain, paths = five_bar()
    X = np.repeat(designs(chain, 1), 5000, axis=0)
    X[4321, 2, 0] = X[4321, 3, 0] = X[4322, 0, 0] = -1.0
    with pytest.raises(InvalidInputError, match=f"design 4321, body {chain.joints[2]}"):
        score(chain, paths[0], X, terms="added_mass")


def test_a_body_whose_invariants_overflow_is_not_physical() -> None:
    """Infinity less infinity is no number, and is not made one by joining a product and a difference."""
    chain, paths = five_bar()
    X = designs(chain, 1)[0]
    X[2] = [1.0, 0.0, 0.0, 0.0, 2.0, -0.5, 2.0, 0.0, 0.0, 2.0]
    score(chain, paths[0], X, terms="added_mass")
    X[2] *= 1e120
    with pytest.raises(InvalidInputError, match="design 0, body psi"):
        score(chain, paths[0], X, terms="added_mass")


def test_scales_are_those_of_the_largest_numbers_among_all_designs() -> None:
    chain, paths = five_bar()
    X = np.repeat(designs(chain, 1), 5000, axis=0)
    most = X[:1] * np.array([3.0, 2.0, 1.0, 1.0])[:, None]
    X[17, 0], X[4321, 1] = most[0, 0], most[0, 1]
    X[4321, 1, 1:4] *= -1.0
    terms = ("added_mass", "rms_torque")
    assert score(chain, paths[0], X, terms=terms).scales == score(chain, paths[0], most, terms=terms).scales


def test_scores_do_not_depend_on_how_the_designs_lie_in_memory() -> None:
    chain, paths = five_bar()
    X = designs(chain, 6)
    expected = score(chain, paths[0], X)["rms_torque"]
    sealed = X.copy()
    sealed.flags.writeable = False
    for same in (np.asfortranarray(X), np.repeat(X, 2, axis=0)[::2], sealed, X.tolist()):
        np.testing.assert_array_equal(score(chain, paths[0], same)["rms_torque"], expected)
    assert len(score(chain, paths[0], np.zeros((0, 4, 10)))) == 0


def test_scores_are_the_same_uncompiled() -> None:
    """Every number but for round-off, and the same body refused."""
    code = (
        "import numpy as np, test_scoring as t\n"
        "chain, paths = t.five_bar()\n"
        "X = t.designs(chain, 3)\n"
        "print(*t.score(chain, paths[0], X)['rms_torque'].tolist())\n"
        "X[2, 1, 9] = 1e-9\n"
        "try:\n    t.score(chain, paths[0], X)\nexcept t.InvalidInputError as error:\n    print(error)\n"
    )
    here = Path(__file__).parent
    path = os.pathsep.join([str(here), str(here.parent), str(here.parent.parent)])
    environment = {**os.environ, "PYTHONPATH": path, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    numbers, refused = done.stdout.split("\n", 1)
    chain, paths = five_bar()
    expected = score(chain, paths[0], designs(chain, 3))["rms_torque"]
    np.testing.assert_allclose([float(x) for x in numbers.split()], expected, rtol=1e-13)
    assert "design 2, body phi_gamma" in refused


def test_the_mass_gained_is_small_against_the_masses_it_is_the_difference_of() -> None:
    chain, paths = five_bar()
    found = score(chain, paths[0], chain.inertial_parameters, terms=("added_mass", "inertia"))
    assert abs(found["added_mass"][0]) <= 1e-15 * found.scales["added_mass"]
    assert found.scales["added_mass"] == pytest.approx(2.0 * chain.mass)
    assert "added_mass from 0;" in repr(found) or "added_mass from 0," in repr(found)


def test_a_distance_is_a_term_of_designs_and_not_of_scores() -> None:
    chain, paths = five_bar()
    for terms in (("distance",), ("rms_torque", "distance"), ()):
        with pytest.raises(InvalidInputError, match="must be some of"):
            score(chain, paths[0], designs(chain, 1), terms=terms)
