"""`fivebar-pin close`: a URDF that has lost its sidecar gets it back, and nothing is overwritten or hidden."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

import fivebar_pin as fb
from fivebar_pin.cli import main


def lone(folder: Path, name: str = "five_bar_case_I") -> Path:
    """Return a copy of a shipped URDF without its sidecar."""
    return Path(shutil.copy(fb.io.shipped_path(name), folder / f"{name}.urdf"))


@pytest.mark.parametrize("name", fb.io.shipped())
def test_what_is_written_is_the_mechanism_that_shipped(name: str, tmp_path: Path) -> None:
    assert main(["close", str(lone(tmp_path, name))]) == 0
    was, now = fb.load(fb.io.shipped_path(name)), fb.load(tmp_path / f"{name}.urdf")
    assert {frozenset(c.frames) for c in now.closures} == {frozenset(c.frames) for c in was.closures}
    assert [c.kind.value for c in now.closures] == ["3d"] * len(was.closures)
    assert set(now.actuated) == set(was.actuated)
    assert fb.diagnose(now).ok


def test_the_closed_configuration_is_written_beside_the_closures(tmp_path: Path) -> None:
    main(["close", str(lone(tmp_path))])
    chain = fb.load(tmp_path / "five_bar_case_I.urdf")
    assert np.abs(fb.closure_residual(chain, chain.references["closed"])).max() < 1e-12


def test_the_tables_name_closure_kind_frames_gap_and_motors(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["close", str(lone(tmp_path)), "--dry-run"]) == 0
    out = capsys.readouterr().out
    for words in ("closures of ", "gap [m]", "angle [rad]", "O3_link3 O3_link2", "likely", "psi", "on the ground"):
        assert words in out
    assert "check: ok, mobility 2, exactly actuated" in out
    assert [p.name for p in tmp_path.iterdir()] == ["five_bar_case_I.urdf"]


def test_an_existing_sidecar_is_refused_before_and_kept_in_what_it_says_besides(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    urdf = lone(tmp_path)
    sidecar = tmp_path / "five_bar_case_I.yaml"
    old = "closed_loop: []\ntype: []\nname_mot: []\ngravity: [0.0, -1.0, 0.0]\n"
    sidecar.write_text(old)
    assert main(["close", str(urdf)]) == 1
    assert "five_bar_case_I.yaml: exists already" in capsys.readouterr().err
    assert sidecar.read_text() == old
    assert main(["close", str(urdf), "--overwrite"]) == 0
    chain = fb.load(urdf)
    assert chain.na == 2 and len(chain.closures) == 1
    np.testing.assert_array_equal(chain.model.gravity.linear, [0.0, -1.0, 0.0])


MIMIC = '<mimic joint="{}" multiplier="-2" offset="0.3"/></joint>'
WHEEL = '<link name="wheel"/><joint name="turn" type="revolute"><parent link="{}"/><child link="wheel"/>'
LIMIT = '<axis xyz="0 0 1"/><limit lower="-9" upper="9" effort="1" velocity="1"/>'


def geared(folder: Path) -> Path:
    """Return a five-bar without a sidecar whose first crank turns a wheel that mimics it."""
    urdf = lone(folder)
    ground = fb.load(fb.io.shipped_path(urdf.stem)).model.frames[1].name
    more = WHEEL.format(ground) + LIMIT + MIMIC.format("psi")
    urdf.write_text(urdf.read_text().replace("</robot>", more + "</robot>"))
    return urdf


def test_a_joint_that_mimics_another_gets_no_motor_of_its_own(tmp_path: Path, capsys) -> None:
    urdf = geared(tmp_path)
    assert main(["close", str(urdf)]) == 0
    out = capsys.readouterr().out
    assert "stated already: turn mimic" in out and "mobility 2, exactly actuated" in out
    chain = fb.load(urdf)
    assert set(chain.actuated) == {"psi", "gamma"} and {c.kind.value for c in chain.closures} == {"3d", "coupling"}
    assert np.abs(fb.closure_residual(chain, chain.references["closed"])).max() < 1e-12
    assert main(["check", str(urdf)]) == 0


def test_the_couplings_of_a_sidecar_are_kept(tmp_path: Path) -> None:
    urdf = geared(tmp_path)
    urdf.write_text(urdf.read_text().replace(MIMIC.format("psi"), "</joint>"))
    old = "closed_loop: [[turn, psi]]\ntype: [coupling]\nratio: [[1, 2]]\noffset: [0.3]\nname_mot: []\n"
    urdf.with_suffix(".yaml").write_text(old)
    assert main(["close", str(urdf), "--overwrite"]) == 0
    chain = fb.load(urdf)
    assert set(chain.actuated) == {"psi", "gamma"} and {c.kind.value for c in chain.closures} == {"3d", "coupling"}


def test_a_train_of_gears_without_a_loop_gets_its_motor(tmp_path: Path, capsys) -> None:
    urdf = tmp_path / "train.urdf"
    body = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    drum = f'<link name="drum">{body}<joint name="axle" type="revolute"><parent link="base"/><child link="drum"/>'
    wheel = WHEEL.format("base").replace('<link name="wheel"/>', f'<link name="wheel">{body}')
    text = f"{drum}{LIMIT}</joint>{wheel}{LIMIT}{MIMIC.format('axle')}"
    urdf.write_text(f'<robot name="train"><link name="base"/>{text}</robot>')
    assert main(["close", str(urdf)]) == 0
    assert "check: ok, mobility 1" in capsys.readouterr().out
    assert fb.load(urdf).actuated == ("axle",)


def test_the_only_sidecar_of_a_folder_is_the_one_that_is_replaced(tmp_path: Path) -> None:
    """It is the one that load reads, whatever it is called."""
    lone(tmp_path)
    (tmp_path / "robot.yaml").write_text("closed_loop: []\ntype: []\nname_mot: []\n")
    assert main(["close", str(tmp_path)]) == 1
    assert main(["close", str(tmp_path), "--overwrite"]) == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["five_bar_case_I.urdf", "robot.yaml"]
    assert fb.load(tmp_path).na == 2


def test_pairs_kind_motors_and_place_can_be_given(tmp_path: Path) -> None:
    urdf, out = lone(tmp_path, "slider_crank"), tmp_path / "mine.yaml"
    words = ["--pair", "B_slider", "B_rod", "--kind", "revolute", "--motor", "slider", "--out", str(out)]
    assert main(["close", str(urdf), *words]) == 0
    text = out.read_text()
    for line in (
        "closed_loop: [[B_slider, B_rod]]",
        "type: [revolute]",
        "name_mot: [slider]",
        "axis: [[0.0, 0.0, 1.0]]",
    ):
        assert line in text


def test_what_check_refuses_is_said_and_the_exit_code_tells(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    urdf = lone(tmp_path)
    assert main(["close", str(urdf), "--motor", "psi"]) == 1
    assert "check: NOT ok: with psi held, gamma, phi_gamma, theta_psi can still move" in capsys.readouterr().out
    assert fb.load(urdf).actuated == ("psi",)
    assert main(["check", str(urdf)]) == 1


def test_hinges_that_are_called_balls_are_told_of_where_loops_do_not_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    urdf = tmp_path / "balls.urdf"
    text = fb.io.shipped_path("spatial_rssr").read_text()
    urdf.write_text(text.replace('"rod_y"', '"spherical_rod"'))
    assert main(["close", str(urdf), "--motor", "spherical_rod", "crank", "--dry-run"]) == 1
    assert "note: spherical_rod turn about one axis in the URDF; joint_name and joint_type" in capsys.readouterr().out


def test_where_there_is_no_loop_it_is_said_what_was_looked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(
        '<robot name="arm"><link name="ground"/><link name="arm"/><joint name="shoulder" type="revolute">'
        '<parent link="ground"/><child link="arm"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    assert main(["close", str(urdf)]) == 1
    said = capsys.readouterr().err
    assert said.startswith("fivebar-pin close: tree = 'arm' but shows no loop: frames named for one")
    assert said.endswith("State a pair by hand: --pair FRAME FRAME [--kind 3d|6d|revolute].\n")
    assert [p.name for p in tmp_path.iterdir()] == ["arm.urdf"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--pair", "B_rod", "B_slide"], "Unknown frame 'B_slide'"),
        (["--pair", "B_rod", "rod_link"], "must be on two bodies; these are on one"),
        (["--kind", "ball"], "Unknown closure kind 'ball'; known: 3d, 6d"),
        (["--motor", "crankk"], "Unknown actuated joint 'crankk'"),
        (["--out", "nowhere/x.yaml"], "its folder does not exist"),
    ],
)
def test_wrong_words_are_one_line_and_write_nothing(
    words: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    urdf = lone(tmp_path, "slider_crank")
    assert main(["close", str(urdf), *words]) == 1
    err = capsys.readouterr().err
    assert said in err and err.count("\n") == 1
    assert [p.name for p in tmp_path.iterdir()] == ["slider_crank.urdf"]


def test_only_a_urdf_can_be_closed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    fb.save(fb.load(fb.io.shipped_path("slider_crank")), tmp_path / "one.xml")
    assert main(["close", str(tmp_path / "one.xml")]) == 1
    assert (
        "is none of .urdf, .sdf, .world, .xacro; a sidecar closes the loops of such a tree only"
        in capsys.readouterr().err
    )
    assert main(["close", str(tmp_path / "none.urdf")]) == 1
    assert "there is no such file or folder" in capsys.readouterr().err
    assert main(["new", "four-bar", "--out", str(tmp_path / "mine.yaml")]) == 0
    assert main(["close", str(tmp_path / "mine.yaml")]) == 1
    assert "is a linkage file, not a tree: its points close its loops" in capsys.readouterr().err


SQUARE = """<sdf version="1.7"><model name="square"><link name="crank"/><link name="coupler"><pose>0 1 0 0 0 0</pose>
</link><link name="rocker"><pose>1 0 0 0 0 0</pose></link>
<frame name="end" attached_to="coupler"><pose>1 0 0 0 0 0</pose></frame>
<joint name="a" type="revolute"><parent>world</parent><child>crank</child><axis/></joint>
<joint name="b" type="revolute"><parent>crank</parent><child>coupler</child><axis/></joint>
<joint name="d" type="revolute"><parent>world</parent><child>rocker</child><axis/></joint>{}</model></sdf>
"""
OPEN = (
    '<frame name="loop_A" attached_to="end"/><frame name="loop_B" attached_to="rocker"><pose>0 1 0 0 0 0</pose></frame>'
)
CLOSED = '<joint name="c" type="ball"><pose>0 1 0 0 0 0</pose><parent>coupler</parent><child>rocker</child></joint>'


@pytest.mark.parametrize(("more", "loops"), [(OPEN, 1), (CLOSED, 0)])
@pytest.mark.parametrize("ending", [".sdf", ".urdf.xacro"])
def test_an_sdf_and_a_xacro_get_their_sidecar(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys, ending: str, more: str, loops: int
) -> None:
    """What the file closes itself does not stand in the sidecar again; a xacro is expanded first."""
    tool = tmp_path / "bin" / "xacro"
    tool.parent.mkdir()
    tool.write_text(f"#!{sys.executable}\nimport sys\nprint(open(sys.argv[1]).read())\n")
    tool.chmod(0o755)
    monkeypatch.setenv("PATH", str(tool.parent))
    file = tmp_path / f"square{ending}"
    file.write_text(SQUARE.format(more))
    assert main(["close", str(file)]) == 0
    assert "mobility 1, exactly actuated" in capsys.readouterr().out
    chain = fb.load(file)
    assert (len(chain.closures), chain.actuated) == (1, ("a",))
    assert (tmp_path / "square.yaml").read_text().count("loop_A") == loops


@pytest.mark.filterwarnings("always::fivebar_pin.errors.LeftOutWarning")
def test_what_a_file_is_taken_without_is_a_note_of_one_line(tmp_path: Path, capsys) -> None:
    file = tmp_path / "square.sdf"
    file.write_text(SQUARE.format(f"{CLOSED}<plugin name='p' filename='p.so'/>"))
    assert main(["check", str(file)]) == 0
    told = f"fivebar-pin check: note: {file}: left out: plugin\n"
    assert capsys.readouterr().err == told
