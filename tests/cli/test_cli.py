"""The command line: what it writes, what it says, and its exit codes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from mechanisms import five_bar, four_bar

import fivebar_pin as fb
from fivebar_pin.cli import main
from fivebar_pin.cli._moving import motion_along, standing


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run the main job once."""
    folder = tmp_path_factory.mktemp("demo") / "out"
    assert main(["demo", "--out", str(folder), "--samples", "101"]) == 0
    return folder


def test_demo_writes_all_it_names(results: Path) -> None:
    """The balanced mechanism, the table, the plots and the page are there."""
    names = {p.name for p in results.iterdir()}
    assert {"five_bar_balanced.urdf", "five_bar_balanced.yaml", "results.csv", "animation.html"} <= names
    motion = fb.motion.from_file(results / "results.csv", ("psi", "gamma"))
    np.testing.assert_array_equal(motion.q, fb.paper.default_motion(samples=101).q)
    assert {"motion.png", "torques.png", "shaking.png", "joint_forces.png", "mass_centre.png"} <= names


def test_demo_results_table_is_named_and_balanced(results: Path) -> None:
    """The table has named columns with units, and the balanced linkage does not shake in it."""
    header = (results / "results.csv").read_text().splitlines()[0].split(",")
    data = np.loadtxt(results / "results.csv", delimiter=",", skiprows=1)
    assert data.shape == (101, len(header))
    assert all("[" in name for name in header)
    column = dict(zip(header, data.T, strict=True))
    assert np.abs(column["unbalanced F x [N]"]).max() > 0.1
    assert np.abs(column["balanced F x [N]"]).max() < 1e-13
    assert np.ptp(column["balanced com y [m]"]) < 1e-15
    f = column["unbalanced f40 x [N]"] - column["unbalanced f01 x [N]"]
    np.testing.assert_allclose(f, column["unbalanced F x [N]"], rtol=0, atol=1e-14)


def test_demo_balanced_file_is_a_balanced_mechanism(results: Path) -> None:
    """What the user takes away still balances after it has been read back."""
    chain = fb.load(results / "five_bar_balanced.urdf")
    motion = fb.paper.default_motion(samples=31)
    loads = fb.inverse_dynamics(chain, fb.drive(chain, motion))
    assert np.abs(loads.shaking_force).max() < 1e-12
    assert np.abs(loads.torque).max() > 1e-3


def test_demo_refuses_a_playing_speed_before_it_writes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """No half of the results is left behind."""
    for word in ("0", "-1", "nan"):
        assert main(["demo", "--out", str(tmp_path / "out"), "--speed", word]) == 1
        assert "speed" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_demo_leaves_no_folder_behind_for_bad_input_and_names_a_file_it_cannot_write(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line each, no traceback."""
    assert main(["demo", "--out", str(tmp_path / "out"), "--case", "III"]) == 1
    assert not (tmp_path / "out").exists()
    (tmp_path / "out" / "results.csv").mkdir(parents=True)
    capsys.readouterr()
    assert main(["demo", "--out", str(tmp_path / "out"), "--samples", "11", "--overwrite"]) == 1
    said = capsys.readouterr().err
    assert "results.csv: cannot be written" in said and said.count("\n") == 1


def test_demo_takes_the_other_reading_of_case_II(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Masses of 0.24 and 0.31 kg, on the other assembly mode and under gravity."""
    words = ["--case", "II", "--reading", "corrected", "--mode", "right", "--gravity", "0", "-9.81", "0"]
    assert main(["demo", "--out", str(tmp_path / "out"), "--samples", "11", *words]) == 0
    said = capsys.readouterr().out
    assert "0.24" in said and "0.31" in said
    chain = fb.load(tmp_path / "out" / "five_bar_balanced.urdf")
    np.testing.assert_allclose(sorted(b.mass for b in chain.model.inertias)[1:], [0.03, 0.075, 0.24, 0.31])


def test_demo_does_not_overwrite(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A folder with results is refused in one line that says the way out."""
    before = (results / "results.csv").read_bytes()
    assert main(["demo", "--out", str(results)]) == 1
    said = capsys.readouterr().err
    assert "--overwrite" in said and said.count("\n") == 1
    assert (results / "results.csv").read_bytes() == before


def test_demo_says_which_case_exists(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An unknown case lists the known ones."""
    assert main(["demo", "--case", "III", "--out", str(tmp_path / "x")]) == 1
    assert "known: I, II" in capsys.readouterr().err


def test_demo_names_a_folder_it_cannot_write(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A file in the way of the output folder is an error of one line, not a traceback."""
    (tmp_path / "file").write_text("")
    assert main(["demo", "--out", str(tmp_path / "file" / "sub")]) == 1
    assert "cannot be written" in capsys.readouterr().err


def test_demo_names_the_sample_out_of_reach(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A motion out of reach names the sample and the gap."""
    t = np.linspace(0.0, 1.0, 11)
    fb.motion.to_file(
        fb.motion.combine(fb.motion.constant(t, 0.0), fb.motion.cycloidal(t, 1.0, -6.0)),
        tmp_path / "m.csv",
        ("psi", "gamma"),
    )
    far = main(["demo", "--case", "II", "--motion", str(tmp_path / "m.csv"), "--out", str(tmp_path / "o")])
    said = capsys.readouterr().err
    assert far == 1 and "sample" in said and " m" in said


def test_check_passes_a_shipped_mechanism_and_fails_a_broken_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 0 for a sound mechanism, 1 for one with too few motors."""
    assert main(["check", "five_bar_case_I"]) == 0
    chain = fb.load(fb.io.shipped_path("five_bar_case_I")).with_actuated(["psi"])
    fb.save(chain, tmp_path, name="lame")
    assert main(["check", str(tmp_path / "lame.urdf")]) == 1
    assert "under-actuated" in capsys.readouterr().out.lower()


def test_check_names_the_shipped_mechanisms_when_asked_for_an_unknown_one(capsys: pytest.CaptureFixture[str]) -> None:
    """A bare name that is no file lists what ships."""
    assert main(["check", "six_bar"]) == 1
    assert "five_bar_case_I" in capsys.readouterr().err


def test_view_writes_a_page(tmp_path: Path) -> None:
    """Any mechanism can be written as one HTML page."""
    page = tmp_path / "page.html"
    assert main(["view", "four_bar_crank_rocker", "--html", str(page)]) == 0
    assert "<html" in page.read_text(encoding="utf-8")[:200].lower()


def test_wrong_words_exit_with_two() -> None:
    """A wrong command line is exit code 2 with usage, from a real process."""
    done = subprocess.run([sys.executable, "-m", "fivebar_pin", "dance"], capture_output=True, text=True, check=False)
    assert done.returncode == 2 and "usage" in done.stderr


def test_loads_prints_checks_and_writes_named_columns(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Any mechanism along a motion file: units follow the joints, the table holds what the library computes."""
    chain = fb.load(fb.io.shipped_path("slider_crank"))
    t = np.linspace(0.0, 1.0, 51)
    start = float(chain.references["home"][chain.model.idx_qs[chain.model.getJointId("crank")]])
    motion = fb.motion.cycloidal(t, start, start + 1.0)
    fb.motion.to_file(motion, tmp_path / "m.csv", chain.actuated)
    out = tmp_path / "out"
    assert main(["loads", "slider_crank", "--motion", str(tmp_path / "m.csv"), "--out", str(out)]) == 0
    assert "rate of energy" in capsys.readouterr().out
    header = (out / "loads.csv").read_text().splitlines()[0].split(",")
    data = dict(zip(header, np.loadtxt(out / "loads.csv", delimiter=",", skiprows=1).T, strict=True))
    assert {"q slider [m]", "v crank [rad/s]", "tau crank [N m]", "F x [N]"} <= set(header)
    loads = fb.inverse_dynamics(chain, fb.drive(chain, motion))
    np.testing.assert_allclose(data["tau crank [N m]"], loads.torque[:, 0], rtol=0, atol=1e-15)
    assert (out / "animation.html").exists() and (out / "torques.png").exists()


def test_simulate_reports_the_energy(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Free motion from rest under gravity keeps its energy and moves."""
    words = ["simulate", "four_bar_crank_rocker", "--time", "0.5", "--samples", "26", "--gravity", "0", "-9.81", "0"]
    assert main([*words, "--out", str(tmp_path / "o")]) == 0
    assert "total energy" in capsys.readouterr().out
    motion = np.loadtxt(tmp_path / "o" / "motion.csv", delimiter=",", skiprows=1)
    assert motion.shape[0] == 26 and np.ptp(motion[:, 1]) > 0.1


def test_simulate_refuses_a_span_without_sense(capsys: pytest.CaptureFixture[str]) -> None:
    """A negative time is one line that names it."""
    assert main(["simulate", "slider_crank", "--time", "-1"]) == 1
    assert "--time = -1.0 but must be positive" in capsys.readouterr().err


def test_conditions_prints_the_rank(capsys: pytest.CaptureFixture[str]) -> None:
    """Six force conditions for the five-bar, eleven with the moment."""
    assert main(["conditions", "five_bar_case_I"]) == 0
    assert "rank 6" in capsys.readouterr().out
    assert main(["conditions", "five_bar_case_I", "--kind", "dynamic"]) == 0
    assert "rank 11" in capsys.readouterr().out


def test_balance_writes_a_balanced_mechanism(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """0.27 kg balance case I; what is written balances after it has been read back."""
    words = ["balance", "five_bar_case_I", "--radius", "0.1", "--material", "none", "--out", str(tmp_path / "o")]
    assert main(words) == 0
    assert "+0.27 kg" in capsys.readouterr().out
    chain = fb.load(tmp_path / "o" / "five_bar_case_I_balanced.urdf").with_gravity((0.0, 0.0, 0.0))
    loads = fb.inverse_dynamics(chain, fb.drive(chain, fb.paper.default_motion(samples=21)))
    assert np.abs(loads.shaking_force).max() < 1e-12
    assert main(words) == 1
    assert "--overwrite" in capsys.readouterr().err


def test_balance_says_when_it_is_impossible(capsys: pytest.CaptureFixture[str]) -> None:
    """Dynamic balance by added material is impossible there: exit code 1 and the certificate."""
    assert main(["balance", "five_bar_case_I", "--kind", "dynamic", "--radius", "0.1"]) == 1
    said = capsys.readouterr().out
    assert "infeasible" in said and "certificate" in said


def test_balance_refuses_words_it_does_not_know(capsys: pytest.CaptureFixture[str]) -> None:
    """Unknown terms list the known ones; a limit needs a number."""
    assert main(["balance", "five_bar_case_I", "--minimise", "beauty"]) == 1
    assert "added_mass" in capsys.readouterr().err
    assert main(["balance", "five_bar_case_I", "--limit", "peak_torque=much"]) == 1
    assert "NAME=NUMBER" in capsys.readouterr().err


def test_pareto_writes_the_front(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Along the front the first objective rises and the second falls."""
    file = tmp_path / "front.csv"
    words = ["pareto", "five_bar_case_I", "added_mass", "rms_torque", "--radius", "0.1", "--points", "4"]
    assert main([*words, "--out", str(file)]) == 0
    front = np.loadtxt(file, delimiter=",", skiprows=1)
    assert front.shape == (4, 2)
    assert np.all(np.diff(front[:, 0]) > 0.0) and np.all(np.diff(front[:, 1]) < 0.0)
    assert main([*words, "--out", str(file)]) == 1
    assert "exists already" in capsys.readouterr().err


def _cells(said: str, name: str) -> list[str]:
    """Return the numbers of a table row."""
    return next(line for line in said.splitlines() if line.strip().startswith(name)).split()[-4:]


def test_balance_shows_what_shakes_beside_what_the_frame_carries(capsys: pytest.CaptureFixture[str]) -> None:
    """Under gravity: 0 shakes after, the frame carries the weight; with one motor the RMS is rms_torque."""
    assert main(["balance", "four_bar_crank_rocker"]) == 0
    said = capsys.readouterr().out
    assert _cells(said, "shaking force [N]")[2:] == ["0", "0"]
    design = fb.balance(
        fb.load(fb.io.shipped_path("four_bar_crank_rocker")),
        "force",
        motions=motion_along(fb.load(fb.io.shipped_path("four_bar_crank_rocker")), None),
    )
    wanted = [design.before["peak_frame_force"], design.before["rms_frame_force"]]
    assert _cells(said, "frame force [N]")[:2] == [f"{x:.4g}" for x in wanted]
    assert _cells(said, "frame force [N]")[2:] == [f"{9.81 * design.chain.mass:.4g}"] * 2
    assert _cells(said, "drive at crank [N m]")[3] == f"{design.after['rms_torque']:.4g}"
    assert "left out" not in said


def test_what_is_balanced_reads_as_zero_and_is_written_with_every_digit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["balance", "four_bar_crank_rocker", "--out", str(tmp_path / "o")]) == 0
    capsys.readouterr()
    file = tmp_path / "o" / "four_bar_crank_rocker_balanced.urdf"
    assert main(["loads", str(file), "--out", str(tmp_path / "l")]) == 0
    said = capsys.readouterr().out
    assert _cells(said, "shaking force [N]")[-2:] == ["0", "0"]
    assert _cells(said, "travel of the mass centre [m]")[-1] == "0"
    assert float(_cells(said, "closure residual [m or rad]")[-1]) > 0.0  # an accuracy stays what it is
    header = (tmp_path / "l" / "loads.csv").read_text().splitlines()[0].split(",")
    data = dict(zip(header, np.loadtxt(tmp_path / "l" / "loads.csv", delimiter=",", skiprows=1).T, strict=True))
    assert 0.0 < np.abs(data["F x [N]"]).max() < 1e-14
    np.testing.assert_allclose(data["frame F y [N]"], -9.81 * fb.load(file).mass, rtol=1e-12)
    page = (tmp_path / "l" / "animation.html").read_text(encoding="utf-8")
    assert '"text": "frame force"' in page and "no arrow: the shaking force is zero to round-off" in page
    assert main(["conditions", str(file)]) == 0
    assert "as it is: 0 kg" in capsys.readouterr().out
    assert main(["loads", "five_bar_case_I"]) == 0
    assert "frame force" not in capsys.readouterr().out  # no weight, nothing to tell apart


@pytest.mark.parametrize("actuated", [(), ("left", "right", "left_elbow", "right_elbow")])
def test_view_shows_a_mechanism_standing_whose_motors_do_not_tell_how_it_moves(tmp_path, actuated) -> None:
    """No motors, or one in every joint, so that no joint is passive."""
    chain = five_bar().with_actuated(actuated)
    file = tmp_path / "chain.urdf"
    fb.save(chain, file)
    page = tmp_path / "page.html"
    assert main(["view", str(file), "--html", str(page)]) == 0
    assert page.stat().st_size > 10_000


FLOATING = """<mujoco model="arm on a float">
  <worldbody><body name="float" pos="0 0 1"><freejoint name="root"/><geom size="0.2" mass="3"/>
    <body name="arm" pos="0.2 0 0"><joint name="shoulder" axis="0 1 0"/>
      <geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.02" mass="0.5"/></body></body></worldbody>
  <actuator><motor joint="shoulder"/></actuator>
</mujoco>"""


def test_a_floating_base_is_held_where_it_stands_or_fixed_by_a_flag(tmp_path, capsys) -> None:
    file = tmp_path / "float.xml"
    file.write_text(FLOATING)
    assert main(["check", str(file)]) == 0
    printed = capsys.readouterr().out
    assert "mobility     1, and 6 held at rest" in printed
    assert "note: the base floats on root: held where it stands unless it is simulated" in printed
    assert main(["loads", str(file), "--out", str(tmp_path / "free")]) == 0
    capsys.readouterr()
    assert main(["check", str(file), "--fixed-base"]) == 0
    printed = capsys.readouterr().out
    assert "mobility     1\n" in printed and "root" not in printed
    chain = fb.load(file, fixed_base=True)
    assert chain.joints == ("shoulder",)
    held = fb.load(file)
    t = np.linspace(0.0, 1.0, 11)
    motion = fb.motion.harmonic(t, 0.2, 0.3, period=1.0)
    free, fixed = (fb.inverse_dynamics(c, fb.drive(c, motion)) for c in (held, chain))
    np.testing.assert_allclose(free.torque, fixed.torque, rtol=0.0, atol=1e-12)
    weight = 9.81 * 3.0  # of the float, which is part of the ground where it is fixed
    np.testing.assert_allclose(free.frame_force - fixed.frame_force, np.tile([0.0, 0.0, -weight], (11, 1)), atol=1e-11)
    base = free.tree_torque[:, :3]  # what holds the base, in its axes
    np.testing.assert_allclose(base, -free.frame_force, rtol=0.0, atol=1e-11)


def test_a_tolerance_is_taken_on_the_command_line(tmp_path, capsys) -> None:
    file = tmp_path / "chain.urdf"
    fb.save(five_bar(), file)
    assert main(["check", str(file), "--tolerance", "1e-6"]) == 0
    assert fb.load(file, closure_tolerance=1e-6).closure_tolerance == 1e-6
    capsys.readouterr()
    assert main(["check", str(file), "--tolerance", "0.5"]) != 0
    assert "closure tolerance = 0.5 but must be from 0 to 0.001 m or rad" in capsys.readouterr().err


def test_a_mechanism_stands_within_its_joint_limits() -> None:
    """A four-bar whose limits allow one of its two assembly modes only, not the one next to the neutral pose."""
    chain = four_bar()
    modes = fb.assembly_modes(chain, [0.5])
    near = standing(chain)
    other = next(mode for mode in modes if np.sign(np.sin(mode[1] + mode[0])) != np.sign(np.sin(near[1] + near[0])))
    model = chain.model.copy()
    model.lowerPositionLimit[1], model.upperPositionLimit[1] = other[1] - 0.4, other[1] + 0.4
    bounded = fb.ClosedChain(model, chain.closures, chain.actuated)
    for q in (standing(bounded), fb.diagnose(bounded).q):
        assert other[1] - 0.4 <= q[1] <= other[1] + 0.4
        assert np.abs(fb.closure_residual(bounded, q)).max() < 1e-12
