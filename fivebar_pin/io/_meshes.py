"""Where the meshes of a file are: beside it, in the packages around it, and in those that the environment names."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

import pinocchio as pin

from fivebar_pin.chain import Visual

__all__ = ["find_file", "is_pointer", "is_there", "unreadable"]

_PACKAGES = ("package://", "model://")
_FOLDERS = ("ROS_PACKAGE_PATH", "GZ_SIM_RESOURCE_PATH", "IGN_GAZEBO_RESOURCE_PATH", "GAZEBO_MODEL_PATH", "SDF_PATH")
"""Variables that list folders of packages or models, or packages themselves."""
_PREFIXES = "AMENT_PREFIX_PATH"
"""Variable that lists folders with share/PACKAGE in them."""
_MARKS = ("package.xml", "model.config")
"""Files by which a folder is a package or model, whatever it is called."""
_POINTER = b"version https://git-lfs"
"""How a file begins that stands for one kept in git's large file storage."""
_MOST_NAMED = 3


def find_file(file: Path, name: str) -> str:
    """Return where the file is that `file` calls so, when it can be found; else the name itself."""
    for scheme in _PACKAGES:
        if name.startswith(scheme):
            candidates = _in_packages(file, name[len(scheme) :].lstrip("/"))
            break
    else:
        candidates = iter([file.parent / name.removeprefix("file://")])
    try:
        return next((str(c) for c in candidates if c.is_file()), name)
    except (OSError, ValueError):
        return name


def _in_packages(file: Path, inside: str) -> Iterator[Path]:
    """Yield where PACKAGE/REST may be."""
    above = file.resolve().parents
    for folder in (*above, *_stated_folders(), *_robot_data()):
        yield folder / inside
        yield folder.parent / inside  # where the folder is the package itself
    rest = inside.partition("/")[2]
    for folder in above:  # a package that lies under another name
        if rest and any((folder / mark).is_file() for mark in _MARKS):
            yield folder / rest


def _stated_folders() -> Iterator[Path]:
    for variable in _FOLDERS:
        yield from map(Path, filter(None, os.environ.get(variable, "").split(os.pathsep)))
    for prefix in filter(None, os.environ.get(_PREFIXES, "").split(os.pathsep)):
        yield Path(prefix, "share")


def _robot_data() -> Iterator[Path]:
    """Yield the folder that holds example-robot-data, which is installed beside Pinocchio."""
    inside = Path("share", "example-robot-data")
    yield from (folder / "share" for folder in Path(pin.__file__).resolve().parents if (folder / inside).is_dir())


def unreadable(visuals: Iterable[Visual]) -> list[str]:
    """Return, in words, the meshes that cannot be drawn: not found, or pointers that git-lfs left in their place."""
    meshes = dict.fromkeys(v.mesh for v in visuals if v.shape == "mesh")
    missing = [mesh for mesh in meshes if not _is_file(mesh)]
    pointers = [mesh for mesh in meshes if mesh not in missing and not is_there(mesh)]
    reasons = {
        "not found; ROS_PACKAGE_PATH or GZ_SIM_RESOURCE_PATH may name the folder of its package": missing,
        "a git-lfs pointer; `git lfs pull` brings it": pointers,
    }
    return [f"{_named(found)} ({why})" for why, found in reasons.items() if found]


def _named(meshes: list[str]) -> str:
    some = ", ".join(meshes[:_MOST_NAMED])
    more = f" and {len(meshes) - _MOST_NAMED} more" if len(meshes) > _MOST_NAMED else ""
    return f"mesh {some}{more}"


def _is_file(mesh: str) -> bool:
    try:
        return Path(mesh).is_file()
    except (OSError, ValueError):
        return False


def is_there(mesh: str) -> bool:
    """Return whether there is such a file, and not a pointer that git-lfs left in its place."""
    try:
        return _is_file(mesh) and not is_pointer(mesh)
    except OSError:  # whoever reads it says why it cannot be read
        return True


def is_pointer(mesh: str | Path) -> bool:
    """Return whether a file is a pointer that git-lfs left in the place of a mesh.

    Raises:
        OSError: it cannot be read.
    """
    with open(mesh, "rb") as stream:
        return stream.read(len(_POINTER)) == _POINTER
