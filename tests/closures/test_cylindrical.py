"""A hinge that may slide, against the same pair made of a hinge and a slide, and against a hinge."""

from __future__ import annotations

import numpy as np
import pytest
from mechanisms import four_bar, rscr
from tied_chains import planar_sliding, sliding_hinge

import fivebar_pin as fb
from fivebar_pin.closures import Cylindrical
from fivebar_pin.closures.anchored import FramePair
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.mechanism.loops import loops_of

MOTION = fb.motion.cycloidal(np.linspace(0.0, 0.8, 41), 0.4, 1.0)


def test_it_is_a_hinge_and_a_slide_of_the_tree_closed_by_a_weld():
    """Two roads: four rows between two bodies, or two more joints without mass and six rows."""
    (chain, q), (other, q_other) = sliding_hinge(), sliding_hinge(explicit=True)
    one = fb.inverse_dynamics(chain, fb.drive(chain, MOTION, near=q))
    two = fb.inverse_dynamics(other, fb.drive(other, MOTION, near=q_other))
    for name in ("torque", "shaking_force", "shaking_moment", "frame_force", "closure_reactions"):
        x, y = getattr(one, name), getattr(two, name)
        np.testing.assert_allclose(x, y, rtol=0.0, atol=1e-10 * np.abs(y).max(), err_msg=name)
    shared = [other.joints.index(name) for name in chain.joints]
    x, y = one.joint_reactions, two.joint_reactions[:, shared]
    np.testing.assert_allclose(x, y, rtol=0.0, atol=1e-10 * np.abs(y).max())
    slide = two.trajectory.q[:, other.model.idx_qs[other.model.getJointId("pair slide")]]
    assert np.ptp(slide) > 0.01, "nothing slides, so that the test shows nothing"


def test_it_carries_no_force_along_the_axis_and_no_moment_about_it():
    chain, q = sliding_hinge()
    loads = fb.inverse_dynamics(chain, fb.drive(chain, MOTION, near=q))
    local = loads.closure_reactions_local[:, 0]
    scale = np.abs(local).max()
    assert np.abs(local[:, [2, 5]]).max() < 1e-12 * scale  # the axis is z of frame 1
    assert np.abs(local[:, [0, 1, 3, 4]]).min(axis=0).max() > 1e-3 * scale
    assert fb.diagnose(chain, q).determinate("pair") == "fx fy fz mx my mz"


@pytest.mark.parametrize("kind", ["force", "dynamic"])
def test_it_has_the_conditions_of_the_explicit_pair(kind):
    """What a hinge and a slide without mass leave of the conditions on the other bodies: the same rows."""
    (chain, _), (other, _) = sliding_hinge(), sliding_hinge(explicit=True)
    one, two = (fb.balance_conditions(c, kind) for c in (chain, other))
    shared = [two.space.names.index(name) for name in one.space.names]
    rows = two.reduced[:, shared]
    assert np.linalg.matrix_rank(rows * one.space.scale, tol=1e-8) == one.rank
    assert one.angles(rows).max() < 1e-8


def test_where_nothing_slides_it_moves_as_a_hinge_does():
    chain, q = planar_sliding()
    hinge = four_bar(kind="revolute").with_gravity(np.array(chain.model.gravity.linear))
    motion = fb.motion.cycloidal(np.linspace(0.0, 0.8, 41), 0.9, 4.0)
    one, two = (fb.inverse_dynamics(c, fb.drive(c, motion, near=q)) for c in (chain, hinge))
    for name in ("torque", "shaking_force", "shaking_moment"):
        np.testing.assert_allclose(getattr(one, name), getattr(two, name), rtol=0.0, atol=1e-11)


def test_links_may_be_offset_along_the_hinge_where_a_hinge_stays_open():
    chain, q = planar_sliding(offset=0.3)
    assert np.abs(fb.closure_residual(chain, q)).max() < 1e-12
    hinge = fb.ClosedChain(chain.model, (fb.Closure(chain.closures[0].ends, "revolute"),), chain.actuated)
    assert np.abs(fb.closure_residual(hinge, q)).max() == pytest.approx(0.3)


def test_in_a_plane_the_tilts_are_redundant_and_named():
    chain, q = planar_sliding()
    found = fb.diagnose(chain, q)
    assert (found.rows, found.rank, found.mobility) == (4, 2, 1)
    assert sorted((row.row, row.scope) for row in found.redundant) == [("tilt 1", "always"), ("tilt 2", "always")]
    assert found.determinate("pin") == "fx fy fz mz"
    assert found.determinate_rows == (("across 1", "across 2"),)


def test_a_hinge_has_the_rows_of_a_sliding_one_and_one_more():
    """The rank of the spatial loop with the hinge is one more, and its motion is one of the sliding hinge's."""
    chain, q = rscr()
    closure = chain.closures[0]
    free = fb.ClosedChain(chain.model, (Cylindrical(closure.ends, closure.axis),), ("crank", "slide"))
    N = fb.complement(chain, q)
    J = loops_of(free).see(q[None]).J[0]
    assert np.abs(J @ N).max() < 1e-12
    assert fb.diagnose(free, q).mobility == fb.diagnose(chain, q).mobility + 1


def test_axes_against_each_other_are_told_apart():
    chain, q = planar_sliding()
    loops = loops_of(chain)
    seen = loops.see(q[None])
    pair = seen.pair(0)
    turned = FramePair(pair.R1, pair.p1, pair.R2 @ np.diag([1.0, -1.0, -1.0]), pair.p2)
    assert (loops.opposed(seen)[0], loops.anchored[0].opposed(turned)[0]) == (False, True)


def test_the_axis_must_have_a_direction():
    with pytest.raises(InvalidInputError, match=r"closure axis = .* but must not be zero"):
        Cylindrical(("a", "b"), (0.0, 0.0, 0.0))
