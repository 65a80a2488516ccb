"""Loading a mechanism from files: a tree (URDF, SDF) with its sidecar, or an MJCF file."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import checked
from fivebar_pin._files import MAX_BYTES, as_path
from fivebar_pin.chain import ClosedChain, Geometry, Visual, frames_by_name
from fivebar_pin.chain.spring_checks import checked_springs
from fivebar_pin.closures import Closure
from fivebar_pin.errors import FileFormatError, FiveBarPinError, InvalidInputError, UnknownNameError
from fivebar_pin.io._build import build_model
from fivebar_pin.io._entries import UNLIMITED, TreeEntry
from fivebar_pin.io._find import mechanism_file, named, sidecar_file, stem
from fivebar_pin.io._left_out import left_out
from fivebar_pin.io._meshes import unreadable
from fivebar_pin.io._sidecar import Sidecar, read_sidecar
from fivebar_pin.io._stated import Stated
from fivebar_pin.io._tree_file import read_tree
from fivebar_pin.springs import JointSpring, Spring

__all__ = ["load"]


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
        path: a folder with one URDF (and its sidecar) or one file of another format, MJCF scenes that include it left
            aside; a .urdf, .sdf, .world or .xacro file whose sidecar lies beside it under the same name (.yaml or
            .yml), or as the folder's only sidecar; an MJCF .xml file; or the name of a mechanism that ships
            (`shipped`), where no file or folder is called so. A file that closes its loops itself needs no sidecar.
        free_flyer: put the root of a URDF or SDF on a free-flying base.
        closures: use these instead of the file's closures, among them the couplings that <mimic> states in a URDF;
            with `actuated`, no sidecar is needed.
        actuated: drive these joints instead of the file's.
        gravity: use this (3,) [m/s2] instead of the file's.
        max_bytes: size above which a file is not read.

    Returns:
        The chain; meshes are named in its visuals, and read where an MJCF file takes a mass from them.

    Warns:
        LeftOutWarning: what a file states and the mechanism goes without, in one line.

    Raises:
        FileFormatError: a file is missing, malformed or states something impossible; names file, element, way out.
        InvalidInputError, UnknownNameError: an argument of this call is wrong, or no file and no mechanism that ships
            has this name.
    """
    where = named(as_path(path))
    file = mechanism_file(where)
    given_closures = None if closures is None else _closures(closures)
    given_actuated = None if actuated is None else _names(actuated)
    if file.suffix.lower() == ".xml":
        from fivebar_pin.io._mjcf import read_mjcf

        if free_flyer:
            raise InvalidInputError(
                "free_flyer", free_flyer, "is for URDF and SDF files; an MJCF file states <freejoint/> itself"
            )
        chain = read_mjcf(file, closures=given_closures, actuated=given_actuated, max_bytes=max_bytes)
    else:
        chain = _load_tree(file, free_flyer, given_closures, given_actuated, max_bytes)
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


def _load_tree(
    file: Path,
    free_flyer: bool,
    closures: tuple[Closure, ...] | None,
    actuated: tuple[str, ...] | None,
    max_bytes: int,
) -> ClosedChain:
    """Load a tree and what its sidecar says of it."""
    beside = sidecar_file(file)
    stated = read_tree(file, named_loops=beside is None and closures is None, max_bytes=max_bytes)
    closes = beside is not None or bool(stated.closures)
    if not (closes or closures is not None) or not (closes or actuated is not None or stated.motors):
        raise FileFormatError(
            file,
            f"has no sidecar: put {stem(file)}.yaml beside it with closed_loop, type and name_mot, or pass "
            "closures=... and actuated=... (closures=() for an open tree); `fivebar-pin close` proposes one",
        )
    sidecar = Sidecar(actuated=stated.motors) if beside is None else read_sidecar(beside)
    note = beside or file
    loops, mimics = _loops(stated, sidecar), _mimics(stated.tree, sidecar)
    used = (*sidecar.closures, *loops, *mimics) if closures is None else closures
    tree = _counting(stated.tree, used)
    sidecar = replace(sidecar, gravity=sidecar.gravity or stated.gravity)
    model = build_model(tree, sidecar, free_flyer=free_flyer, urdf=file, beside=note)
    if closures is None:
        check_file_closures(model, sidecar.closures, note, "closed_loop")
        check_file_closures(model, loops, file, "loop")
        check_file_closures(model, mimics, file, "mimic")
    if actuated is None:
        check_file_actuated(model, tree, sidecar, note)
    check_springs(model, sidecar.springs, note)
    visuals = tuple(v for link in tree.links.values() for v in link.visuals)
    chain = make_chain(
        model,
        used,
        sidecar.actuated if actuated is None else actuated,
        visuals,
        file,
        argument=closures is not None or actuated is not None,
        springs=(*stated.springs, *sidecar.springs),
        geometry=sidecar.geometry,
        closure_tolerance=sidecar.closure_tolerance,
    )
    left_out(file, (*stated.left_out, *unreadable(visuals)))
    absent = [name for name in sidecar.joint_types if name not in tree.joints]
    left_out(note, [f"joint_type of joint {name!r}, which the tree does not have" for name in absent])
    return chain


def _loops(stated: Stated, sidecar: Sidecar) -> tuple[Closure, ...]:
    """Return the loops that the file closes itself, without those that the sidecar closes at the same frames."""
    held = [set(closure.joins) for closure in sidecar.closures]
    return tuple(closure for closure in stated.closures if set(closure.joins) not in held)


def _mimics(tree: TreeEntry, sidecar: Sidecar) -> tuple[Closure, ...]:
    """Return the couplings of joints that mimic others, unless the joint does not move."""
    fixed = {name for name, word in sidecar.joint_types.items() if word == "FIXED"}
    moving = [j for j in tree.joints.values() if j.kind != "fixed" and j.name not in fixed]
    return tuple(j.mimic for j in moving if j.mimic is not None)


def stated_closures(file: Path, *, max_bytes: int = MAX_BYTES) -> tuple[tuple[Closure, ...], tuple[Closure, ...]]:
    """Return what a tree closes itself: loops and the couplings of <mimic>; and the couplings of its sidecar."""
    beside = sidecar_file(file)
    sidecar = Sidecar() if beside is None else read_sidecar(beside)
    stated = read_tree(file, max_bytes=max_bytes)
    own = (*_loops(stated, sidecar), *_mimics(stated.tree, sidecar))
    return own, tuple(c for c in sidecar.closures if c.counted)


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
    closure_tolerance: float = 0.0,
) -> ClosedChain:
    """Return the chain; what is wrong with the file's own content is told as an error of the file."""
    named = Geometry() if geometry is None else geometry
    try:
        return ClosedChain(
            model,
            closures,
            actuated,
            name=model.name,
            visuals=visuals,
            springs=springs,
            geometry=named,
            closure_tolerance=closure_tolerance,
        )
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
