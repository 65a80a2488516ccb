"""`fivebar-pin balance` and `conditions` on branches, directions of gravity, mass bounds and removal."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import fivebar_pin as fb
from fivebar_pin.cli import main


def test_balance_finds_the_reactionless_antiparallelogram_and_writes_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Dynamic balance on the crossed branch, still there after the files have been read back."""
    assert main(["balance", "four_bar_antiparallelogram", "--kind", "dynamic", "--out", str(tmp_path / "o")]) == 0
    assert "on the branch of the motion" in capsys.readouterr().out
    chain = fb.load(tmp_path / "o" / "four_bar_antiparallelogram_balanced.urdf").with_gravity((0.0, 0.0, 0.0))
    home = fb.load(fb.io.shipped_path("four_bar_antiparallelogram")).references["home"]
    state = fb.Motion(np.zeros(1), home[None, :1], np.array([[5.0]]), np.array([[-20.0]]))
    loads = fb.inverse_dynamics(chain, fb.drive(chain, state, near=home))
    assert np.abs(loads.torque).max() > 1e-3
    assert np.abs(loads.shaking_force).max() <= 1e-12
    assert np.abs(loads.shaking_moment).max() <= 1e-12


def test_gravity_in_one_direction_asks_for_less(capsys: pytest.CaptureFixture[str]) -> None:
    """The slider may keep its weight when gravity is across its way: one condition falls away."""
    assert main(["conditions", "slider_crank", "--kind", "static"]) == 0
    assert "rank 4" in capsys.readouterr().out
    assert main(["conditions", "slider_crank", "--kind", "static", "--along", "0", "-1", "0"]) == 0
    assert "rank 3" in capsys.readouterr().out
    assert main(["conditions", "slider_crank", "--along", "0", "-1", "0"]) == 1
    assert "--kind static only" in capsys.readouterr().err


def test_mass_bounds_and_removal_reach_the_library(capsys: pytest.CaptureFixture[str]) -> None:
    """0.05 kg on each link is too little even where material is taken away, and the proof names the bound."""
    words = ["balance", "five_bar_case_I", "--radius", "0.1", "--remove", "theta_psi"]
    assert main(words) == 0
    said = capsys.readouterr().out
    assert "removed" in said and "…" not in said
    assert main([*words, "--masses", "0", "0.01"]) == 1
    assert "<= 0.01 kg" in capsys.readouterr().out


def test_pareto_traces_the_front_of_one_branch(capsys: pytest.CaptureFixture[str]) -> None:
    """Dynamic balance of the antiparallelogram: no front over all assembly modes, one on the branch of the motion."""
    words = ["pareto", "four_bar_antiparallelogram", "added_mass", "rms_torque", "--kind", "dynamic", "--points", "3"]
    assert main(words) == 1
    assert main([*words, "--branch", "motion"]) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    front = np.array([[float(x) for x in row] for row in rows if len(row) == 2 and row[0][:1].isdigit()])
    assert front.shape == (3, 2)
    assert np.all(np.diff(front[:, 0]) > 0.0) and np.all(np.diff(front[:, 1]) < 0.0)
