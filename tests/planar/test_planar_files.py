"""Linkages as files: what is written reads back, what is wrong is told with its line, every command takes them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import fivebar_pin as fb
from fivebar_pin import cli
from fivebar_pin.errors import FileFormatError, InvalidInputError, OutputError, UnknownNameError
from fivebar_pin.planar import Linkage, load
from fivebar_pin.planar.starts import STARTS, start_text

GOOD = """\
linkage: four
points: {A: [0, 0], B: [0.4, 0], C: [0.05, 9e-2], D: [0.36, 0.3], P: [0.2, 0.3]}
ground: [A, B]
bars:
  crank: [A, C]
  coupler: {points: [C, D, P], length: 0.37}
  rocker: [B, D]
motors: [crank at A]
"""


def rich() -> Linkage:
    """Return a linkage that has one of everything."""
    made = Linkage("rich", gravity=(0.0, 0.0, -9.81))
    made.ground(A=(0, 0), B=(0.4, 0))
    made.points({"C": (0.05, 0.09), "D": (0.36, 0.3), "E": (0.2, 0.28), "on": (0.5, 0.1), "7": (0.3, 0.5)})
    made.bar("crank", "A", "C", length=0.11, density=7800.0, width=0.03)
    made.bar("rocker", "B", "D", linear_density=0.5, thickness=0.02)
    made.bar("strut", "E", "on")
    made.plate("coupler", "C", "D", "E", places={"E": (0.2, 0.1)}, thickness=0.004)
    made.slide("block", "on", "7", on="rocker", angle=0.3, through=(0.4, 0.1), places={"7": (0.1, 0.0)}, mass=0.3)
    made.mass("crank", at="A", mass=0.2, centre=(-0.05, 0.0), inertia=1e-4)
    made.spring("C", "B", stiffness=120.0, length=0.1, damping=2.0)
    made.bar("wheel", "B", density=0.0)
    made.gear("crank", "wheel", ratio=-2.0)
    made.bar("planet", "D")
    made.gear("wheel", "planet", ratio=-0.5, carrier="rocker")
    made.motor("crank", at="A", on="ground")
    return made


def test_what_is_written_reads_back_as_the_same_linkage(tmp_path: Path) -> None:
    made = rich()
    path = made.save(tmp_path / "rich.yaml")
    read = load(path)
    assert vars(read) == vars(made)
    again = read.save(tmp_path / "again.yaml")
    assert again.read_text() == path.read_text()
    one, two = made.chain(), fb.load(path)
    assert one.model == two.model and one.actuated == two.actuated
    with pytest.raises(OutputError, match="exists already"):
        made.save(path)
    made.save(path, overwrite=True)


def test_a_linkage_file_loads_like_any_mechanism(tmp_path: Path) -> None:
    path = tmp_path / "four.yaml"
    path.write_text(GOOD)
    chain = fb.load(path)
    assert chain.name == "four" and chain.parameters["coupler"] == 0.37
    assert chain.references["home"][0] == pytest.approx(np.arctan2(0.09, 0.05), abs=1e-15)
    assert np.array_equal(fb.load(path, gravity=(0, 0, -1.0)).model.gravity.linear, [0.0, 0.0, -1.0])
    assert fb.load(path, actuated=["rocker"]).actuated == ("rocker",)
    for word, value in (("free_flyer", True), ("closures", ())):
        with pytest.raises(InvalidInputError, match=f"{word} = .* this is a linkage"):
            fb.load(path, **{word: value})
    fb.save(chain, tmp_path / "out")
    assert fb.load(tmp_path / "out").model.name == "four"


def test_other_yaml_is_not_taken_for_a_linkage(tmp_path: Path) -> None:
    fb.save(load_text(tmp_path, GOOD).chain(), tmp_path / "out", formats=("urdf",))
    with pytest.raises(FileFormatError, match=r"is no linkage file, .* name the .urdf"):
        fb.load(tmp_path / "out" / "four.yaml")
    with pytest.raises(FileFormatError, match="is no linkage file: it needs the key linkage"):
        load(tmp_path / "out" / "four.yaml")


def load_text(folder: Path, text: str) -> Linkage:
    path = folder / "some.yaml"
    path.write_text(text)
    return load(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("motors: [crank at A]", "motor: [crank at A]", r"motor \(line 8\): Unknown key 'motor'.*mean 'motors'"),
        ("motors: [crank at A]", "motors: [crank A]", r"motors\[0\] \(line 8\): 'crank A' must read like"),
        ("motors: [crank at A]", "motors: crank", r"motors \(line 8\): must be a list"),
        ("motors: [crank at A]", "motors: [3]", r"must read like 'crank at A'"),
        ("linkage: four", "linkage: a b", r"linkage \(line 1\): name of a linkage"),
        ("ground: [A, B]", "ground: [A, Q]", r"ground \(line 3\): Unknown point 'Q'"),
        ("ground: [A, B]", "ground: A", r"ground \(line 3\): 'A' must be a list of names"),
        ("ground: [A, B]", "ground: [A, 1]", r"quote numbers"),
        ("crank: [A, C]", "crank: A", r"bars, crank, points \(line 5\): 'A' must be a list of names"),
        ("crank: [A, C]", "crank: {length: 1}", r"bars, crank \(line 5\): points is missing"),
        ("length: 0.37", "lenght: 0.37", r"bars, coupler, lenght \(line 6\): Unknown key.*mean 'length'"),
        ("length: 0.37", "length: long", r"bars, coupler, length \(line 6\): 'long' must be a number"),
        ("length: 0.37", "length: true", r"'True' must be a number"),
        ("length: 0.37", "length: -0.37", r"bars, coupler \(line 6\): length of bar coupler = -0.37"),
        ("length: 0.37", "places: {Q: [1, 2]}", r"further point of coupler 'Q'"),
        ("length: 0.37", "places: 3", r"bars, coupler, places \(line 6\): must map names"),
        ("C: [0.05, 9e-2]", "C: [0.05, x]", r"points, C\[1\] \(line 2\): 'x' must be a number"),
        ("C: [0.05, 9e-2]", "C: 3", r"points, C \(line 2\): '3' must be a list of numbers"),
        ("C: [0.05, 9e-2]", "C: [0, 0, 0]", r"points, C \(line 2\): shape of point C"),
        ("motors", "masses: [{bar: crank, at: A, mass: -1}]\nmotors", r"masses\[0\] \(line 8\): mass on crank = -1"),
        ("motors", "masses: [crank]\nmotors", r"masses\[0\] \(line 8\): must map words to values, such as bar"),
        ("motors", "springs: [{between: [A], stiffness: 1}]\nmotors", r"between \(line 8\): .* must be two names"),
        ("motors", "gears: [{between: [crank], ratio: 2}]\nmotors", r"between \(line 8\): .* must be two names"),
        ("motors", "springs: [{between: [A, D], stiffness: -1}]\nmotors", r"springs\[0\] \(line 8\): stiffness"),
        ("rocker: [B, D]", "rocker: [B, Q]", r"bars, rocker \(line 7\): Unknown point of bar rocker 'Q'"),
        ("motors: [crank at A]", "motors: [cronk at A]", r"motors\[0\] \(line 8\): Unknown bar 'cronk'"),
        ("motors: [crank at A]", "motors: [crank at B]", r"motors\[0\] \(line 8\): Unknown point of crank 'B'"),
        ("motors", "gears: [{between: [crank, q], ratio: 2}]\nmotors", r"gears\[0\] \(line 8\): Unknown bar 'q'"),
        ("motors", "slides: {s: {points: [P], on: q}}\nmotors", r"slides, s \(line 8\): Unknown bar 'q'"),
        ("motors", "plates: {p: [A, D, Q]}\nmotors", r"plates, p \(line 8\): Unknown point of bar p 'Q'"),
        ("motors", "gravity: 9.81\nmotors", r"gravity \(line 8\): shape of gravity"),
        ("motors", "ground: [A]\nmotors", r"states \['ground'\] more than once \(lines 3, 8\)"),
        ("motors", "gears: [{between: [crank, rocker]}]\nmotors", r"gears\[0\] \(line 8\): ratio is missing"),
        ("motors", "slides: {s: {points: [P], angle: 3 dog}}\nmotors", r"slides, s, angle \(line 8\): '3 dog'"),
        ("motors", "slides: {s: {points: []}}\nmotors", r"slides, s \(line 8\): points of s"),
        ("linkage: four", "linkage: [", r"is not plain YAML"),
    ],
)
def test_what_is_wrong_in_a_file_is_told_with_key_and_line(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in GOOD
    with pytest.raises(FileFormatError, match=message):
        load_text(tmp_path, GOOD.replace(old, new, 1))


def test_what_is_wrong_with_the_linkage_names_its_file(tmp_path: Path) -> None:
    path = tmp_path / "four.yaml"
    path.write_text(GOOD.replace("motors: [crank at A]", ""))
    with pytest.raises(FileFormatError, match=r"four.yaml: number of motors = 0 but must be 1.*Drive crank at A"):
        fb.load(path)


def test_angles_may_be_degrees_and_a_bare_on_is_a_word(tmp_path: Path) -> None:
    text = GOOD.replace("motors", "slides: {s: {points: [P], on: crank, angle: 30 deg}}\nmotors")
    made = load_text(tmp_path, text)
    assert made.links["s"].guide.on == "crank"
    assert made.links["s"].guide.angle == pytest.approx(np.pi / 6.0, rel=1e-15)


@pytest.mark.parametrize("kind", sorted(STARTS))
def test_a_new_file_loads_checks_and_is_not_overwritten(tmp_path: Path, kind: str, capsys) -> None:
    assert cli.main(["new", kind, "--out", str(tmp_path)]) == 0
    path = tmp_path / f"{kind.replace('-', '_')}.yaml"
    assert f"fivebar-pin check {path}" in capsys.readouterr().out
    assert cli.main(["check", str(path)]) == 0
    assert capsys.readouterr().out.startswith(f"my_{path.stem}: ok")
    path.write_text(path.read_text() + "# mine\n")
    assert cli.main(["new", kind, "--out", str(tmp_path)]) == 1
    assert "exists already" in capsys.readouterr().err and path.read_text().endswith("# mine\n")
    assert cli.main(["new", kind, "--out", str(tmp_path), "--overwrite"]) == 0
    assert path.read_text() == start_text(kind)


def test_a_new_file_may_be_named_and_its_folder_loads(tmp_path: Path, capsys) -> None:
    assert cli.main(["new", "four-bar", "--out", str(tmp_path / "mine.yaml")]) == 0
    assert (tmp_path / "mine.yaml").read_text() == start_text("four-bar")
    assert fb.load(tmp_path).name == "my_four_bar"
    (tmp_path / "other.yaml").write_text(GOOD)
    with pytest.raises(FileFormatError, match=r"holds no .urdf"):
        fb.load(tmp_path)
    (tmp_path / "other.yaml").unlink()
    fb.save(fb.load("four_bar_crank_rocker"), tmp_path / "tree.urdf")
    assert fb.load(tmp_path).name == "four_bar_crank_rocker"


def test_what_is_written_beside_a_new_file_leaves_it_alone(tmp_path: Path) -> None:
    assert cli.main(["new", "four-bar", "--out", str(tmp_path)]) == 0
    fb.save(fb.load(tmp_path / "four_bar.yaml"), tmp_path)
    assert (tmp_path / "four_bar.yaml").read_text() == start_text("four-bar")


def test_the_lines_that_a_new_file_proposes_are_right_too(tmp_path: Path) -> None:
    """What stands behind a comment sign is a linkage as well once the sign is taken away."""
    text, count = re.subn(r"^# ( *- \{| *\w+: +[\[{#])", r"\1", start_text("four-bar"), flags=re.MULTILINE)
    assert count == 7
    text = text.replace("  coupler: {points: [C, D, P], density: 2700, width: 0.02, thickness: 0.01}", "")
    made = load_text(tmp_path, text)
    assert made.springs and made.lumps and made.links["coupler"].section.plate
    assert fb.diagnose(made.chain()).mobility == 1


def test_an_unknown_kind_lists_the_known_ones(capsys) -> None:
    assert cli.main(["new", "tri-bar"]) == 1
    assert "known: five-bar, four-bar, six-bar, slider-crank" in capsys.readouterr().err
    with pytest.raises(UnknownNameError, match="kind of linkage"):
        start_text("tri-bar")


def test_a_linkage_file_is_no_sidecar_of_the_tree_beside_it(tmp_path: Path) -> None:
    """Neither as the only YAML file of a folder nor by its name."""
    fb.save(fb.load("four_bar_crank_rocker"), tmp_path / "tree.urdf")
    (tmp_path / "tree.yaml").unlink()
    for name in ("other.yaml", "tree.yaml"):
        (tmp_path / name).write_text(GOOD)
        with pytest.raises(FileFormatError, match=r"has no sidecar: put tree\.yaml beside it"):
            fb.load(tmp_path / "tree.urdf")
        assert fb.load(tmp_path / "tree.urdf", closures=(), actuated=()).closures == ()
        (tmp_path / name).unlink()
