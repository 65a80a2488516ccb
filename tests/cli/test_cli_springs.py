"""The command line sees the springs of a file without being told."""

from __future__ import annotations

import re
from pathlib import Path

import mechanisms
import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin import JointSpring, Spring
from fivebar_pin.cli import main
from fivebar_pin.cli._moving import motion_along

G, K = 9.81, 400.0


def lever(*springs: Spring | JointSpring) -> fb.ClosedChain:
    """2 kg at 0.5 m on a lever; `high` is 0.3 m above its hinge, `arm` 0.2 m along it."""
    model = pin.Model()
    model.name = "lever"
    model.gravity.linear = np.array([0.0, -G, 0.0])
    weight = pin.Inertia(2.0, np.array([0.5, 0.0, 0.0]), 1e-3 * np.eye(3))
    joint = mechanisms.add(model, 0, pin.JointModelRZ(), mechanisms.at(), "lever", weight)
    mechanisms.point(model, 0, "high", mechanisms.at(0.0, 0.3))
    mechanisms.point(model, joint, "arm", mechanisms.at(0.2))
    return fb.ClosedChain(model, (), ("lever",), springs=springs)


@pytest.fixture(params=["urdf", "xml"])
def file(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    path = tmp_path / f"lever.{request.param}"
    fb.save(lever(Spring("high", "arm", K, 0.0)), path)
    return str(path)


def said(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    capsys.readouterr()
    assert main(list(words)) == 0
    return capsys.readouterr().out


def test_check_names_the_springs(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert re.search(r"^  springs +high~arm$", said(capsys, "check", file), re.MULTILINE)
    plain = Path(file).with_name("plain.xml")
    fb.save(lever(), plain)
    assert "springs" not in said(capsys, "check", str(plain))


def test_loads_are_those_of_the_sprung_mechanism(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    chain = fb.load(file)
    loads = fb.inverse_dynamics(chain, motion_along(chain, None))
    assert np.abs(loads.torque).max() != pytest.approx(
        np.abs(fb.inverse_dynamics(chain.with_springs(()), loads.trajectory).torque).max(), rel=0.01
    )
    assert f"{np.abs(loads.torque).max():.4g}" in said(capsys, "loads", file)


def test_simulate_moves_by_the_springs(file: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """Without gravity the lever starts at zero and the spring alone pulls it up."""
    out = tmp_path / "out"
    text = said(capsys, "simulate", file, "--time", "0.1", "--gravity", "0", "0", "0", "--out", str(out))
    assert "does not move" not in text
    rows = np.loadtxt(out / "motion.csv", delimiter=",", skiprows=1)
    assert rows[-1, 1] > 0.01


def test_simulate_says_that_springs_hold_it(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    fb.save(lever(JointSpring("lever", 3.0, 0.0)), tmp_path / "still.urdf")
    text = said(capsys, "simulate", str(tmp_path / "still.urdf"), "--time", "0.1", "--gravity", "0", "0", "0")
    assert "It does not move: weight, torque, friction and springs (on lever) hold each other." in " ".join(
        text.split()
    )


def test_scores_are_those_with_springs(file: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    chain = fb.load(file)
    np.save(tmp_path / "own.npy", chain.inertial_parameters[None])
    rms = float(np.sqrt(np.mean(fb.inverse_dynamics(chain, motion_along(chain, None)).torque ** 2)))
    text = said(capsys, "score", file, "--designs", str(tmp_path / "own.npy"), "--terms", "rms_torque")
    assert f"{rms:.6g}" in text


def test_balance_holds_the_springs_by_the_weight_of_the_file(
    file: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    conditions = said(capsys, "conditions", file, "--kind", "static")
    assert f"mcx(lever) - {K * 0.3 * 0.2 / G:.10g} = 0" in conditions
    out = tmp_path / "out"
    said(capsys, "balance", file, "--kind", "static", "--material", "none", "--out", str(out))
    (design,) = out.glob("*.urdf")
    balanced = fb.load(design)
    assert balanced.springs == (Spring("high", "arm", K, 0.0),)
    t, q = np.linspace(0.0, 1.0, 20), np.linspace(-2.0, 2.0, 20)[:, None]
    still = fb.inverse_dynamics(balanced, fb.drive(balanced, fb.Motion(t, q, 0.0 * q, 0.0 * q)))
    assert np.abs(still.torque).max() < 1e-11
    assert main(["conditions", file, "--kind", "static", "--along", "0", "-1", "0"]) == 1
    assert "--along" in capsys.readouterr().err


LAMP = """\
linkage: lamp
points: {A: [0, 0], B: [0, 0.2], C: [0.44, 0.24], D: [0.44, 0.44], T: [0.7, 0.3]}
ground: [A, B]
bars: {lower: {points: [A, C], density: 0}, upper: {points: [B, D], density: 0}, head: {points: [C, D, T], density: 0}}
masses: [{bar: head, at: T, mass: 2}]
springs: [{between: [C, B], stiffness: 98.1}]
motors: [lower at A]
"""


def test_a_parallelogram_lamp_is_balanced_on_its_branch_and_said_not_to_be_when_crossed(tmp_path: Path, capsys) -> None:
    """V = m g y_T + k |CB|^2 / 2 is constant for k = m g / |AB| while the bars are parallel."""
    path = tmp_path / "lamp.yaml"
    path.write_text(LAMP)
    residuals = {}
    for branch in ("all", "motion"):
        text = said(capsys, "conditions", str(path), "--kind", "static", "--branch", branch)
        residuals[branch] = float(text.split("as it is: ")[1].split()[0])
        assert ("in all assembly modes" if branch == "all" else "on one branch") in text
    assert residuals["all"] > 0.1 and residuals["motion"] < 1e-12
