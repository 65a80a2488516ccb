"""Motions that keep clear of singularities go through, and end where small steps along the same lines end."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import islice

import drives
import numpy as np
import pytest

import fivebar_pin as fb
from benchmarks.positions import closed_form
from fivebar_pin.errors import SingularityError
from fivebar_pin.mechanism.loops import loops_of

EACH = 3


def shipped(name: str) -> fb.ClosedChain:
    return fb.load(fb.io.shipped_path(name))


@pytest.mark.parametrize("name", fb.io.shipped())
def test_random_drives_that_keep_clear_of_singularities_are_followed(name):
    chain, rng = shipped(name), np.random.default_rng(fb.io.shipped().index(name))
    tally = drives.judge(chain, list(islice(drives.random_drives(chain, rng), EACH)))
    assert (tally.drives, tally.alarms, tally.flips) == (EACH, [], [])


@pytest.mark.parametrize("name", [name for name in fb.io.shipped() if name != "planar_3rrr"])
def test_references_are_the_ways_of_closed_forms_and_are_refused_where_these_end_or_come_near_a_singularity(name):
    """Closed forms know no steps: they find what both the motion and its reference might get wrong alike."""
    chain, rng = shipped(name), np.random.default_rng(100 + fb.io.shipped().index(name))
    home, loops = chain.references["home"], loops_of(chain)
    position = closed_form(chain, home)
    for _ in range(EACH):
        motion = drives.random_motion(chain, home, rng)
        found = drives.reference(chain, home, motion, drives.CLEAR)
        X, fine = drives.lines(chain, home, motion)
        try:
            q = np.array([position(x) for x in X.tolist()])
        except ValueError:  # out of reach
            assert not isinstance(found, drives.Drive)
            continue
        if isinstance(found, drives.Drive):
            assert drives.apart(loops, q[drives.LEAD :: fine], found.q) < drives.SAME
        else:
            assert drives.smallest_singular_value(loops, q).min() < drives.CLEAR


def test_drives_as_wide_as_they_may_be_come_near_the_bound_and_are_followed():
    chain, rng = shipped("four_bar_antiparallelogram"), np.random.default_rng(0)
    found = list(islice(drives.random_drives(chain, rng, tight=True), EACH))
    assert all(drives.CLEAR <= drive.clearance < 2.5 * drives.CLEAR for drive in found)
    tally = drives.judge(chain, found)
    assert (tally.alarms, tally.flips) == ([], [])


def test_motions_that_come_near_a_singularity_are_not_kept():
    chain, refused = shipped("four_bar_parallelogram"), Counter[str]()
    found = list(islice(drives.random_drives(chain, np.random.default_rng(1), clear=0.2, refused=refused), 6))
    assert refused["too near to a singularity"] and refused["SingularityError"]
    assert all(drive.clearance >= 0.2 for drive in found)


def test_a_bound_that_no_motion_keeps_is_given_up():
    chain = shipped("four_bar_parallelogram")
    with pytest.raises(RuntimeError, match="none of 100 motions keeps 2 away"):
        next(drives.random_drives(chain, np.random.default_rng(1), clear=2.0))


ROUND = ("five_bar_case_I", "four_bar_crank_rocker", "six_bar_watt", "slider_crank")
"""Mechanisms whose motors may turn as they like."""
BLOCKED = [name for name in fb.io.shipped() if name not in ROUND]


@pytest.mark.parametrize("name", BLOCKED)
def test_motions_that_are_blocked_between_their_samples_are_refused(name):
    chain, rng = shipped(name), np.random.default_rng(200 + fb.io.shipped().index(name))
    blocked = list(islice(drives.blocked_motions(chain, rng), EACH))
    assert len(blocked) == EACH and drives.passed(chain, blocked) == []


def test_a_blocked_motion_that_is_driven_has_passed(one):
    chain, drive = one
    assert drives.passed(chain, [(drive.motion, drive.q[0])]) == [0]


@pytest.fixture
def one() -> tuple[fb.ClosedChain, drives.Drive]:
    chain = shipped("five_bar_case_I")
    return chain, next(drives.random_drives(chain, np.random.default_rng(0)))


def test_an_error_on_a_clear_way_is_a_false_alarm(one, monkeypatch):
    def refuse(*_, **__):
        raise SingularityError("no", sigma=0.0)

    monkeypatch.setattr(fb, "drive", refuse)
    tally = drives.judge(one[0], [one[1]])
    assert [(k, str(error)) for k, error in tally.alarms] == [(0, "no")] and tally.flips == []


@pytest.mark.parametrize(("added", "flipped"), [(1e-6, True), (2.0 * np.pi, False), (0.0, False)])
def test_a_configuration_elsewhere_is_a_flip_unless_whole_turns_lie_between(one, monkeypatch, added, flipped):
    chain, drive = one
    driven = fb.drive(chain, drive.motion, near=drive.q[0], limits="ignore")
    q = np.array(driven.q)
    q[-1, -1] += added
    monkeypatch.setattr(fb, "drive", lambda *_, **__: replace(driven, q=q))
    assert drives.judge(chain, [drive]).flips == ([0] if flipped else [])


def test_a_reference_that_jumps_to_another_mode_is_not_one_way(one, monkeypatch):
    chain, drive = one
    honest, home = fb.drive, chain.references["home"]
    mode = next(q for q in fb.assembly_modes(chain, home[chain.actuated_index]) if np.abs(q - home).max() > 0.1)

    def jumping(*arguments, **keywords):
        path = honest(*arguments, **keywords)
        other = honest(chain, fb.Motion(path.t, *(getattr(path, x)[:, chain.actuated_index] for x in "qva")), mode)
        half = (np.arange(len(path)) > len(path) // 2)[:, None]
        return replace(path, q=np.where(half, other.q, path.q), N=np.where(half[..., None], other.N, path.N))

    monkeypatch.setattr(fb, "drive", jumping)
    assert drives.reference(chain, home, drive.motion, drives.CLEAR) == "too coarse to be sure"
