"""Loading a mechanism from files: a URDF with its sidecar, or an MJCF file."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import checked
from fivebar_pin._files import MAX_BYTES, as_path, read_bounded
from fivebar_pin.chain import ClosedChain, Geometry, Visual, frames_by_name
from fivebar_pin.chain.spring_checks import checked_springs
from fivebar_pin.closures import Closure
from fivebar_pin.errors import FileFormatError, FiveBarPinError, InvalidInputError, UnknownNameError
from fivebar_pin.io._build import build_model
from fivebar_pin.io._entries import UNLIMITED, TreeEntry
from fivebar_pin.io._mjcf_include import mechanism_files
from fivebar_pin.io._shipped import shipped, shipped_path
from fivebar_pin.io._sidecar import MAX_SIDECAR_BYTES, Sidecar, read_sidecar
from fivebar_pin.io._urdf import read_urdf
from fivebar_pin.springs import JointSpring, Spring

__all__ = ["load"]

_LINKAGE = re.compile(rb"^linkage\s*:", re.MULTILINE)


def load(
    path: object,
    *,
    free_flyer: bool = False,
    closures: Iterable[Closure] | None = None,
    actuated: Iterable[str] | None = None,
    gravity: npt.ArrayLike | None = None,
    max_bytes: int = MAX_BYTES,
) -> ClosedChain:
    """Load a closed chain.

    Args:
        path: a folder with one URDF (and its sidecar) or one MJCF mechanism beside its scenes; a .urdf file whose
            sidecar lies beside it under the same name (.yaml or .yml), or as the folder's only sidecar; an MJCF .xml
            file; or the name of a mechanism that ships (`shipped`), where no file or folder is called so.
        free_flyer: put the root of a URDF on a free-flying base.
        closures: use these instead of the file's closures, among them the couplings that <mimic> states in a URDF;
            with `actuated`, no sidecar is needed.
        actuated: drive these joints instead of the file's.
        gravity: use this (3,) [m/s2] instead of the file's.
        max_bytes: size above which a URDF or MJCF file is not read.

    Returns:
        The chain; meshes are named in its visuals, and read where an MJCF file takes a mass from them.

    Warns:
        LeftOutWarning: the file states things that the chain goes without; names them in one line.

    Raises:
        FileFormatError: a file is missing, malformed or states something impossible; names file, element, way out.
        InvalidInputError, UnknownNameError: an argument of this call is wrong, or no file and no mechanism that ships
            has this name.
    """
    where = _named(as_path(path))
    file = mechanism_file(where)
    given_closures = None if closures is None else _closures(closures)
    given_actuated = None if actuated is None else _names(actuated)
    if file.suffix.lower() == ".xml":
        from fivebar_pin.io._mjcf import read_mjcf

        if free_flyer:
            raise InvalidInputError(
                "free_flyer", free_flyer, "is for URDF files; an MJCF file states <freejoint/> itself"
            )
        chain = read_mjcf(file, closures=given_closures, actuated=given_actuated, max_bytes=max_bytes)
    else:
        chain = _load_urdf(file, free_flyer, given_closures, given_actuated, max_bytes)
    return chain if gravity is None else chain.with_gravity(checked("gravity", gravity, (3,)))


def _closures(closures: Iterable[Closure]) -> tuple[Closure, ...]:
    given = tuple(closures)
    for closure in given:
        if not isinstance(closure, Closure):
            raise InvalidInputError("closures", closure, "must be Closure objects")
    return given


def _names(actuated: Iterable[str]) -> tuple[str, ...]:
    names = (actuated,) if isinstance(actuated, str) else tuple(actuated)
    for name in names:
        if not isinstance(name, str):
            raise InvalidInputError("actuated", name, "must be joint names")
    return names


def _named(path: Path) -> Path:
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
    """Return the URDF or MJCF file that `path` means."""
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
        if path.suffix.lower() not in (".urdf", ".xml"):
            raise FileFormatError(path, "has an unknown ending; expected a .urdf or MJCF .xml file, or a folder")
        return path
    for ending in (".urdf", ".xml"):
        found = _in_folder(path, (ending,))
        named = [f for f in found if f.stem in ("robot", path.name)]
        if len(found) > 1 and ending == ".xml" and not named:
            found = mechanism_files(found)
        if len(found) == 1 or len(named) == 1:
            return (named or found)[0]
        if found:
            names = ", ".join(f.name for f in found[:8])
            raise FileFormatError(path, f"holds {len(found)} {ending} files ({names}); name the one to load")
    raise FileFormatError(path, "holds no .urdf and no MJCF .xml file")


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


def sidecar_file(urdf: Path) -> Path | None:
    """Return the sidecar that is read with a URDF: of the same name, or the only one of a folder with one URDF.

    Linkage files are YAML too, and no sidecars.
    """
    beside = [file for file in _in_folder(urdf.parent, (".yaml", ".yml")) if not is_linkage_file(file)]
    same = [f for f in beside if f.stem == urdf.stem]
    if len(same) > 1:
        raise FileFormatError(urdf, f"has two sidecars ({', '.join(f.name for f in same)}); keep one")
    if same:
        return same[0]
    alone = len(beside) == 1 and len(_in_folder(urdf.parent, (".urdf",))) == 1
    return beside[0] if alone else None


def _load_urdf(
    urdf: Path,
    free_flyer: bool,
    closures: tuple[Closure, ...] | None,
    actuated: tuple[str, ...] | None,
    max_bytes: int,
) -> ClosedChain:
    tree = read_urdf(urdf, max_bytes=max_bytes)
    beside = sidecar_file(urdf)
    if beside is None and (closures is None or actuated is None):
        raise FileFormatError(
            urdf,
            f"has no sidecar: put {urdf.stem}.yaml beside it with closed_loop, type and name_mot, or pass closures=... "
            "and actuated=... (closures=() for an open tree); `fivebar-pin close` proposes one",
        )
    sidecar = Sidecar() if beside is None else read_sidecar(beside)
    note = beside or urdf
    stated = (*sidecar.closures, *_mimics(tree, sidecar))
    tree = _counting(tree, stated if closures is None else closures)
    model = build_model(tree, sidecar, free_flyer=free_flyer, urdf=urdf, beside=note)
    if closures is None:
        check_file_closures(model, sidecar.closures, note, "closed_loop")
        check_file_closures(model, stated[len(sidecar.closures) :], urdf, "mimic")
    if actuated is None:
        check_file_actuated(model, tree, sidecar, note)
    check_springs(model, sidecar.springs, note)
    visuals = tuple(v for link in tree.links.values() for v in link.visuals)
    return make_chain(
        model,
        stated if closures is None else closures,
        sidecar.actuated if actuated is None else actuated,
        visuals,
        urdf,
        argument=closures is not None or actuated is not None,
        springs=sidecar.springs,
        geometry=sidecar.geometry,
    )


def _mimics(tree: TreeEntry, sidecar: Sidecar) -> tuple[Closure, ...]:
    """Return the couplings of joints that mimic others, unless the joint does not move."""
    fixed = {name for name, word in sidecar.joint_types.items() if word == "FIXED"}
    moving = [j for j in tree.joints.values() if j.kind != "fixed" and j.name not in fixed]
    return tuple(j.mimic for j in moving if j.mimic is not None)


def stated_couplings(urdf: Path, *, max_bytes: int = MAX_BYTES) -> tuple[tuple[Closure, ...], tuple[Closure, ...]]:
    """Return the couplings of joints that a URDF states as <mimic>, and those of the sidecar beside it."""
    beside = sidecar_file(urdf)
    sidecar = Sidecar() if beside is None else read_sidecar(beside)
    return _mimics(read_urdf(urdf, max_bytes=max_bytes), sidecar), tuple(c for c in sidecar.closures if c.counted)


def _counting(tree: TreeEntry, closures: tuple[Closure, ...]) -> TreeEntry:
    """Return the tree with the continuous joints of couplings counting their turns: revolute, without limits."""
    joints = dict(tree.joints)
    for name in {name for closure in closures for name in closure.counted}:
        if name in joints and joints[name].kind == "continuous":
            data = {**joints[name].data, "lower": [-UNLIMITED], "upper": [UNLIMITED]}
            joints[name] = replace(joints[name], kind="revolute", data=data)
    return replace(tree, joints=joints)


def make_chain(
    model: pin.Model,
    closures: tuple[Closure, ...],
    actuated: tuple[str, ...],
    visuals: tuple[Visual, ...],
    file: Path,
    *,
    argument: bool,
    springs: tuple[Spring | JointSpring, ...] = (),
    geometry: Geometry | None = None,
) -> ClosedChain:
    """Return the chain; what is wrong with the file's own content is told as an error of the file."""
    named = Geometry() if geometry is None else geometry
    try:
        return ClosedChain(model, closures, actuated, name=model.name, visuals=visuals, springs=springs, geometry=named)
    except FileFormatError:
        raise
    except FiveBarPinError as error:
        if argument:
            raise
        raise FileFormatError(file, str(error)) from error


def check_file_closures(model: pin.Model, closures: tuple[Closure, ...], file: Path, key: str) -> None:
    """Refuse closures that do not fit the model, or name frames that are ambiguous (a link's name never is)."""
    frames: dict[str, list[pin.Frame]] = {}
    named = frames_by_name(model) if closures else {}
    for frame in model.frames:
        frames.setdefault(frame.name, []).append(frame)
    for k, closure in enumerate(closures):
        try:
            closure.check(model, named)
        except FiveBarPinError as error:
            raise FileFormatError(file, f"{key}[{k}]: {error}") from error
        for name in closure.ends:
            same = [f for f in frames[name] if f.type not in (pin.FrameType.JOINT, pin.FrameType.FIXED_JOINT)]
            if len(same) > 1:
                raise FileFormatError(file, f"{key}[{k}]: {name!r} is the name of {len(same)} frames; rename one")


def check_file_actuated(model: pin.Model, tree: TreeEntry, sidecar: Sidecar, file: Path) -> None:
    """Refuse driven joints that the files do not have, fix, or give several degrees of freedom."""
    joints = list(model.names)[1:]
    for k, name in enumerate(sidecar.actuated):
        if name in sidecar.actuated[:k]:
            raise FileFormatError(file, f"name_mot: {name!r} is named twice")
        if name in joints:
            nv = model.nvs[model.getJointId(name)]
            if nv != 1:
                raise FileFormatError(file, f"name_mot: {name!r} has {nv} degrees of freedom; a motor drives one")
        elif name in tree.joints:
            how = sidecar.joint_types.get(name, tree.joints[name].kind)
            raise FileFormatError(file, f"name_mot: {name!r} is not a joint that moves ({how}); it cannot be driven")
        else:
            raise FileFormatError(file, "name_mot: " + str(UnknownNameError("joint", name, joints)))


def check_springs(model: pin.Model, springs: tuple[Spring | JointSpring, ...], file: Path) -> None:
    """Refuse springs on frames or joints that do not exist, or that a chain cannot have."""
    for k, spring in enumerate(springs):
        try:
            checked_springs(model, (spring,))
        except FiveBarPinError as error:
            raise FileFormatError(file, f"springs[{k}]: {error}") from error
