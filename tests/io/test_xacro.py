"""A .xacro file is expanded by the tool of that name, or the error says how to get it."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from fivebar_pin import io
from fivebar_pin.errors import FileFormatError
from fivebar_pin.io import _xacro

XACRO = """<robot name="bar" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:property name="l" value="0.3"/>
<link name="base"/><link name="tip"/><joint name="j" type="revolute"><origin xyz="${l * 2} 0 0"/><parent link="base"/>
<child link="tip"/><axis xyz="0 0 1"/></joint></robot>"""
PROGRAM = f"#!{sys.executable}\nimport sys\ntext = open(sys.argv[1]).read()\n"


def tool(folder: Path, monkeypatch: pytest.MonkeyPatch, does: str) -> Path:
    """Put a xacro first on the path that does as told, and return a file for it."""
    program = folder / "bin" / "xacro"
    program.parent.mkdir()
    program.write_text(PROGRAM + does)
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(program.parent))
    (folder / "bar.urdf.xacro").write_text(XACRO)
    (folder / "bar.yaml").write_text("closed_loop: []\ntype: []\nname_mot: [j]\n")
    return folder / "bar.urdf.xacro"


def test_what_the_tool_prints_is_loaded_with_the_sidecar(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the file, and from its folder."""
    path = tool(tmp_path, monkeypatch, "print(text.replace('${l * 2}', '0.6').replace('xacro:property', 'material'))")
    for where in (path, tmp_path):
        chain = io.load(where)
        assert (chain.actuated, chain.model.jointPlacements[1].translation[0]) == (("j",), 0.6)


def test_the_module_serves_where_no_program_is_on_the_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("xacro")
    path = tool(tmp_path, monkeypatch, "")
    monkeypatch.setenv("PATH", "")
    assert io.load(path).model.jointPlacements[1].translation[0] == 0.6


def test_without_the_tool_the_error_says_how_to_get_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tool(tmp_path, monkeypatch, "")
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(_xacro, "find_spec", lambda name: None)
    with pytest.raises(
        FileFormatError, match=r"`pip install xacro`, or where ROS is, `xacro bar.urdf.xacro > bar.urdf`"
    ):
        io.load(path)


@pytest.mark.parametrize(
    ("does", "message"),
    [
        ("sys.exit('error: package\\n not found: arm')", r"xacro cannot expand it \(error: package not found: arm\)"),
        ("print('x' * 40000)", "expands to more than 1000 bytes; pass a larger max_bytes"),
        ("import time; time.sleep(5)", r"xacro cannot expand it \(.*timed out"),
        ("print('<sdf/>')", "<sdf>: <sdf> needs the attribute 'version'"),
        ("print('<mujoco/>')", "has the root element <mujoco>; expected <robot> or <sdf>"),
    ],
)
def test_what_the_tool_cannot_do_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, does: str, message: str
) -> None:
    monkeypatch.setattr(_xacro, "_PATIENCE", 1.0)
    path = tool(tmp_path, monkeypatch, does)
    with pytest.raises(FileFormatError, match=message) as caught:
        io.load(path, max_bytes=1000)
    assert str(path) in str(caught.value)


def test_a_program_that_does_not_run_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tool(tmp_path, monkeypatch, "")
    (tmp_path / "bin" / "xacro").write_text("#!/nowhere/python\n")
    with pytest.raises(FileFormatError, match="xacro cannot expand it"):
        io.load(path)
    with pytest.raises(FileFormatError, match="larger than 10 bytes"):
        io.load(path, max_bytes=10)


def test_a_xacro_under_another_ending_is_no_tree(tmp_path: Path) -> None:
    """Its macros would be missing."""
    (tmp_path / "bar.urdf").write_text(XACRO)
    with pytest.raises(FileFormatError, match="holds <xacro:property>, which xacro expands: give the file the ending"):
        io.load(tmp_path)
