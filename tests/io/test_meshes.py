"""Meshes are found where packages are, and those that cannot be drawn are told in one line."""

from __future__ import annotations

from pathlib import Path

import pytest

from fivebar_pin import io
from fivebar_pin.chain import Visual
from fivebar_pin.errors import LeftOutWarning
from fivebar_pin.io._meshes import find_file, unreadable


def mesh_in(folder: Path) -> Path:
    folder.mkdir(parents=True)
    (folder / "bar.stl").write_text("solid bar\nendsolid bar\n")
    return folder / "bar.stl"


@pytest.mark.parametrize("scheme", ["package", "model"])
@pytest.mark.parametrize(
    ("variable", "stated", "place"),
    [
        ("ROS_PACKAGE_PATH", "ws", "ws/arm"),
        ("ROS_PACKAGE_PATH", "ws/arm", "ws/arm"),
        ("ROS_PACKAGE_PATH", "nowhere:ws", "ws/arm"),
        ("AMENT_PREFIX_PATH", "install", "install/share/arm"),
        ("GZ_SIM_RESOURCE_PATH", "models", "models/arm"),
        ("IGN_GAZEBO_RESOURCE_PATH", "models", "models/arm"),
        ("GAZEBO_MODEL_PATH", "models", "models/arm"),
        ("SDF_PATH", "models", "models/arm"),
    ],
)
def test_a_package_is_found_where_the_environment_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, variable: str, stated: str, place: str, scheme: str
) -> None:
    mesh = mesh_in(tmp_path / place / "meshes")
    urdf = tmp_path / "elsewhere" / "arm.urdf"
    name = f"{scheme}://arm/meshes/bar.stl"
    assert find_file(urdf, name) == name
    monkeypatch.setenv(variable, ":".join(str(tmp_path / folder) for folder in stated.split(":")))
    assert find_file(urdf, name) == str(mesh)


@pytest.mark.parametrize("mark", ["package.xml", "model.config", None])
def test_a_package_around_the_file_may_lie_under_another_name(tmp_path: Path, mark: str | None) -> None:
    mesh = mesh_in(tmp_path / "clone" / "meshes")
    name = "package://arm/meshes/bar.stl"
    if mark:
        (tmp_path / "clone" / mark).touch()
    assert find_file(tmp_path / "clone" / "urdf" / "arm.urdf", name) == (str(mesh) if mark else name)


def test_a_file_is_named_by_its_place_too(tmp_path: Path) -> None:
    mesh = mesh_in(tmp_path / "meshes")
    for name in ("meshes/bar.stl", f"file://{mesh}"):
        assert find_file(tmp_path / "arm.urdf", name) == str(mesh)


def test_meshes_of_robots_that_are_installed_are_found(tmp_path: Path) -> None:
    name = "package://example-robot-data/robots/cassie_description/meshes/foot.stl"
    assert Path(find_file(tmp_path / "mine.urdf", name)).is_file()


def test_a_git_lfs_pointer_is_told(tmp_path: Path) -> None:
    """A text of git-lfs in place of the mesh is no mesh."""
    mesh = mesh_in(tmp_path / "meshes")
    (tmp_path / "r.urdf").write_text(
        '<robot name="r"><link name="a"><visual><geometry><mesh filename="meshes/bar.stl"/></geometry></visual>'
        "</link></robot>"
    )
    assert io.load(tmp_path, closures=(), actuated=()).visuals[0].mesh == str(mesh)
    mesh.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\n")
    with pytest.warns(LeftOutWarning, match=r"mesh .*bar.stl \(a git-lfs pointer; `git lfs pull` brings it\)"):
        io.load(tmp_path, closures=(), actuated=())


def test_many_meshes_are_one_line() -> None:
    visuals = [Visual("a", "mesh", (1.0, 1.0, 1.0), mesh=f"{name}.stl") for name in "abcdaa"]
    (told,) = unreadable(visuals)
    assert told.startswith("mesh a.stl, b.stl, c.stl and 1 more (not found")
    assert unreadable([Visual("a", "sphere", (1.0,))]) == []
    (told,) = unreadable([Visual("a", "mesh", (1.0, 1.0, 1.0), mesh="x" * 5000)])
    assert "not found" in told
