"""Which file a path means, and which sidecar is read with it."""

from __future__ import annotations

import re
from pathlib import Path

from fivebar_pin._files import read_bounded
from fivebar_pin.errors import FileFormatError, UnknownNameError
from fivebar_pin.io._mjcf_include import mechanism_files
from fivebar_pin.io._shipped import shipped, shipped_path
from fivebar_pin.io._sidecar import MAX_SIDECAR_BYTES

__all__ = ["TREES", "is_linkage_file", "mechanism_file", "named", "sidecar_file", "stem", "title"]

TREES = (".urdf", ".sdf", ".world", ".xacro")
"""Endings of files that are read with a sidecar."""
_IN_A_FOLDER = (".urdf", ".xml", ".sdf", ".world", ".xacro")
"""Endings looked for in a folder, the first that is there counts."""
_NO_MECHANISMS = ("package.xml",)
_USUAL = ("robot", "model")
_NAMELESS = {
    *_USUAL, "assembly", "default", "description", "mjcf", "models", "mujoco", "mujoco model", "my_robot", "myrobot",
    "onshape", "robots", "scene", "sdf", "solidworks", "src", "sw2urdf", "unnamed", "untitled", "urdf", "world", "xml",
}  # fmt: skip
"""What files call a mechanism that nobody has named, in small letters."""
_LINKAGE = re.compile(rb"^linkage\s*:", re.MULTILINE)


def named(path: Path) -> Path:
    """Return the path, or the mechanism that ships under a bare name that is no file."""
    try:
        if path.name != str(path) or path.suffix or path.exists():
            return path
    except OSError as error:
        raise FileFormatError(path, f"cannot be looked at ({error.strerror or error})") from error
    if path.name not in shipped():
        raise UnknownNameError("file, folder or shipped mechanism", path.name, shipped())
    return shipped_path(path.name)


def mechanism_file(path: Path) -> Path:
    """Return the URDF, SDF, xacro or MJCF file that `path` means."""
    try:
        is_folder, exists = path.is_dir(), path.exists()
    except OSError as error:
        raise FileFormatError(path, f"cannot be looked at ({error.strerror or error})") from error
    if not exists:
        raise FileFormatError(path, "there is no such file or folder")
    if not is_folder:
        if is_linkage_file(path):
            raise FileFormatError(path, "is a linkage file, not a tree: its points close its loops; `fb.load` reads it")
        if path.suffix.lower() in (".yaml", ".yml"):
            rule = "is no linkage file, which states linkage: NAME, and a sidecar is read with its tree: name the .urdf"
            raise FileFormatError(path, rule)
        if path.suffix.lower() not in _IN_A_FOLDER:
            known = "a .urdf, .sdf, .world, .xacro or MJCF .xml file, or a folder"
            raise FileFormatError(path, f"has an unknown ending; expected {known}")
        return path
    for ending in _IN_A_FOLDER:
        found = [file for file in _in_folder(path, (ending,)) if file.name not in _NO_MECHANISMS]
        usual = [file for file in found if stem(file) in (*_USUAL, path.name)]
        if len(found) > 1 and ending == ".xml" and not usual:
            found = mechanism_files(found)
        if len(found) == 1 or len(usual) == 1:
            return (usual or found)[0]
        if found:
            names = ", ".join(f.name for f in found[:8])
            raise FileFormatError(path, f"holds {len(found)} {ending} files ({names}); name the one to load")
    raise FileFormatError(path, "holds no .urdf, .sdf, .world, .xacro and no MJCF .xml file")


def _in_folder(folder: Path, endings: tuple[str, ...]) -> list[Path]:
    try:
        return sorted(f for f in folder.iterdir() if f.suffix.lower() in endings and f.is_file())
    except OSError as error:
        raise FileFormatError(folder, f"cannot be listed ({error.strerror or error})") from error


def is_linkage_file(path: Path) -> bool:
    """Tell whether a file is a linkage, see `fivebar_pin.planar`: YAML with the key `linkage`, which no sidecar has."""
    if path.suffix.lower() not in (".yaml", ".yml") or not path.is_file():
        return False
    try:
        return _LINKAGE.search(read_bounded(path, MAX_SIDECAR_BYTES)) is not None
    except FileFormatError:
        return False  # whoever reads it says why it cannot be read


def sidecar_file(tree: Path) -> Path | None:
    """Return the sidecar that is read with a tree: of the same name, or the only one of a folder with one such tree.

    The only one counts where no other tree is called like it. Linkage files are YAML too, and no sidecars.
    """
    beside = [file for file in _in_folder(tree.parent, (".yaml", ".yml")) if not is_linkage_file(file)]
    same = [file for file in beside if file.stem in (tree.stem, stem(tree))]
    if len(same) > 1:
        raise FileFormatError(tree, f"has two sidecars ({', '.join(f.name for f in same)}); keep one")
    if same:
        return same[0]
    alone = len(beside) == 1 and len(_in_folder(tree.parent, (tree.suffix.lower(),))) == 1
    taken = {name for other in _in_folder(tree.parent, TREES) for name in (other.stem, stem(other))}
    return beside[0] if alone and beside[0].stem not in taken else None


def title(stated: str | None, file: Path) -> str:
    """Return what a mechanism is called: as its file says, unless that is the name of the program that wrote it.

    Then it is the file's name or, where that says as little, that of the nearest folder that says more.
    """
    names = [stated or "", stem(file), *(folder.name for folder in file.resolve().parents)]
    said = (name.strip() for name in names if name.strip() and name.strip().lower() not in _NAMELESS)
    return next(said, stated or stem(file))


def stem(tree: Path) -> str:
    """Return a file's name without its endings: "robot" of robot.urdf.xacro."""
    name = tree.name
    while Path(name).suffix.lower() in _IN_A_FOLDER:
        name = Path(name).stem
    return name
