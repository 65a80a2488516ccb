"""`fivebar-pin view` of mechanisms whose files name no motor: they sway by joints that could drive them, or stand."""

from __future__ import annotations

from pathlib import Path

import pinocchio as pin
import pytest

from fivebar_pin import viz
from fivebar_pin.cli import main

SLIDER = """<sdf version="1.7"><model name="square"><link name="crank"/><link name="rod"><pose>0 1 0 0 0 0</pose></link>
<link name="rocker"><pose>1 0 0 0 0 0</pose></link>
<joint name="a" type="revolute"><parent>world</parent><child>crank</child><axis/></joint>
<joint name="b" type="revolute"><parent>crank</parent><child>rod</child><axis/></joint>
<joint name="d" type="revolute"><parent>world</parent><child>rocker</child><axis/></joint>
<joint name="c" type="ball"><pose>0 1 0 0 0 0</pose><parent>rod</parent><child>rocker</child></joint></model></sdf>"""
CASSIE = Path(pin.__file__).parents[4] / "share/example-robot-data/robots/cassie_description/robots/cassie_simple.sdf"


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch) -> list[viz.Shown]:
    """What was given to be drawn."""
    given: list[viz.Shown] = []
    monkeypatch.setattr(viz, "html", lambda file, scene, **_: given.extend(scene) or file)
    return given


def test_joints_sway_that_could_drive_it(tmp_path: Path, shown: list[viz.Shown]) -> None:
    file = tmp_path / "square.sdf"
    file.write_text(SLIDER)
    assert main(["view", str(file), "--html", str(tmp_path / "x.html")]) == 0
    (one,) = shown
    assert one.chain.actuated == ("a",)
    assert len(one.trajectory) > 1 and one.loads is not None
    (tmp_path / "m.csv").write_text("t,q_a\n0,0\n")
    assert main(["view", str(file), "--html", str(tmp_path / "x.html"), "--motion", str(tmp_path / "m.csv")]) == 1


@pytest.mark.filterwarnings("ignore::fivebar_pin.errors.LeftOutWarning")
def test_what_cannot_be_driven_stands(tmp_path: Path, shown: list[viz.Shown]) -> None:
    """Cassie's feet are singular where its file puts them."""
    assert main(["view", str(CASSIE), "--html", str(tmp_path / "x.html")]) == 0
    (one,) = shown
    assert (len(one.trajectory), one.loads) == (1, None)
