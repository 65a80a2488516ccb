"""Writing: all files of a set or none, and never a half of one, even when the process is killed meanwhile.

Files become complete and are flushed in a hidden stage on the same file system. A single file then takes its place by
one renaming. Of a set, no file may be seen before the others: the stage receives further names of everything else that
lies in the folder, and folder and stage trade places in one step. Then the folder itself is brought up to date out of
sight and takes its old place in the same way, so that it keeps its identity for terminals and watchers.

Where that cannot be done (a folder that holds folders, a mount point, a parent that cannot be written, a file system
that cannot exchange) the files of a set are renamed one right after the other. What a kill among these renamings
leaves to be done the next writer does first.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

from fivebar_pin._files.exchange import exchange
from fivebar_pin._files.reading import as_path
from fivebar_pin._files.staging import Staging, flush, held, strays
from fivebar_pin.errors import InvalidInputError, OutputError

__all__ = ["check_folder", "check_new", "write_file", "write_set"]

_MOST_NAMES = 1000
"""Other files in a folder above which it is not exchanged: each costs a second name for a moment [-]."""


def write_file(path: object, content: str | bytes, *, overwrite: bool) -> Path:
    """Write one file, whole or not at all.

    Raises:
        OutputError: it exists and `overwrite` is off, or it cannot be written.
    """
    target = as_path(path)
    return write_set(target.parent, {target.name: content}, overwrite=overwrite)[0]


def write_set(folder: object, files: Mapping[str, str | bytes], *, overwrite: bool) -> tuple[Path, ...]:
    """Write files of one folder, which is made when missing: all of them or none.

    Args:
        folder: where they go; whatever else lies there stays.
        files: content of each by name; text is written as UTF-8.
        overwrite: whether existing files may be replaced.

    Returns:
        Their paths, in the order given.

    Raises:
        OutputError: a file exists and `overwrite` is off, or the files cannot be written; then nothing has changed.
    """
    shown = as_path(folder)
    contents = {name: _encoded(name, content) for name, content in files.items()}
    made: list[Path] = []
    try:
        made = _missing(shown)
        shown.mkdir(parents=True, exist_ok=True)
        target = Path(os.path.realpath(shown))
        with held(target) as alone:
            if alone:
                for stray in (*strays(target, target), *strays(target.parent, target)):
                    stray.settle(target)
            for name in contents:
                check_new(shown / name, overwrite=overwrite)
            _commit(target, contents)
    except BaseException as error:
        for empty in made:
            with contextlib.suppress(OSError):
                empty.rmdir()
        if isinstance(error, OSError):
            raise _refusal(shown, contents, error) from error
        raise
    return tuple(shown / name for name in contents)


def check_new(path: object, *, overwrite: bool) -> Path:
    """Return the path of a file that may be written; refuse what exists, and what is no file.

    Raises:
        OutputError: there is something already, or the name is none that the system takes.
    """
    target = as_path(path)
    try:
        if not os.path.lexists(target):
            os.stat(target.parent)
        elif target.exists() and not target.is_file():
            kind = "folder" if target.is_dir() else "pipe or a device"
            raise OutputError(target, f"cannot be written: it is a {kind}; choose another name")
        elif not overwrite:
            raise OutputError(
                target, "exists already; pass overwrite=True (--overwrite) to replace it, or choose another name"
            )
    except FileNotFoundError as error:
        raise OutputError(target, "cannot be written: its folder does not exist; make it first") from error
    except OSError as error:
        raise OutputError(target, f"cannot be written ({error.strerror or error})") from error
    return target


def check_folder(folder: object, *, overwrite: bool) -> Path:
    """Return a folder that can be written into, before the work is done that is to be written there.

    Raises:
        OutputError: it is a file, cannot be written, or holds something and `overwrite` is off.
    """
    shown = as_path(folder)
    try:
        missing = _missing(shown)
        place = missing[-1].parent if missing else shown
        tempfile.TemporaryFile(dir=place).close()
        there = [] if missing else sorted(name for name in os.listdir(shown) if not name.startswith(".fivebar_pin-"))
    except OSError as error:
        raise _refusal(shown, {}, error) from error
    if there and not overwrite:
        raise OutputError(shown, f"is not empty (holds {there[0]}); choose another --out, or pass --overwrite")
    return shown


def _missing(folder: Path) -> list[Path]:
    """Return the folders that will have to be made, the innermost first."""
    out = []
    for one in (folder, *folder.parents):
        try:
            os.lstat(one)
        except FileNotFoundError:
            out.append(one)
        else:
            break
    return out


def _commit(folder: Path, contents: Mapping[str, bytes]) -> None:
    if len(contents) > 1 and _can_exchange(folder, contents):
        stage = Staging.holding(contents, folder.parent, folder)
        with held(stage.new):  # for a moment it has the folder's name: whoever opens it then has to wait as well
            try:
                if _exchanged(folder, stage, contents):
                    flush(folder.parent)
                    return
            finally:
                stage.settle(folder)
    stage = Staging.holding(contents, folder, folder)
    try:
        _move(folder, stage, contents)
    finally:
        stage.settle(folder)
    flush(folder)


def _can_exchange(folder: Path, names: Mapping[str, bytes]) -> bool:
    """Whether everything else in the folder can be given a second name, which folders cannot."""
    if os.path.ismount(folder) or not all(os.access(one, os.W_OK | os.X_OK) for one in (folder, folder.parent)):
        return False
    with os.scandir(folder) as entries:
        others = [e for e in entries if e.name not in names]
    return len(others) <= _MOST_NAMES and not any(e.is_dir(follow_symlinks=False) for e in others)


def _exchanged(folder: Path, stage: Staging, names: Mapping[str, bytes]) -> bool:
    """Let folder and stage trade places, and back once the folder itself has the files; False where it cannot be."""
    try:
        _share(folder, stage.new, leave=names)
        shutil.copystat(folder, stage.new)
        owner = folder.stat()
        if (owner.st_uid, owner.st_gid) != (os.geteuid(), os.getegid()):
            os.chown(stage.new, owner.st_uid, owner.st_gid)
        flush(stage.new)
    except OSError:
        return False
    if not exchange(folder, stage.new):
        return False
    with contextlib.suppress(OSError):  # the set is in place; what follows only keeps the folder's identity
        for name in names:
            (stage.new / name).unlink(missing_ok=True)
        _share(folder, stage.new, leave={})
        flush(stage.new)
        exchange(folder, stage.new)
    return True


def _share(source: Path, other: Path, *, leave: Mapping[str, bytes]) -> None:
    """Give every file of a folder a second name in another one, but for some and those that are there."""
    for name in os.listdir(source):
        if name not in leave:
            with contextlib.suppress(FileExistsError):
                os.link(source / name, other / name, follow_symlinks=False)


def _move(folder: Path, stage: Staging, names: Mapping[str, bytes]) -> None:
    """Rename the files into place one right after the other; undo that when one of them cannot be."""
    stage.old.mkdir()
    for name in names if len(names) > 1 else ():
        if os.path.lexists(folder / name):
            _keep(folder / name, stage.old / name)
    marker = stage.path / "moving"
    marker.touch()
    flush(stage.path)
    moved: list[str] = []
    try:
        for name in names:
            os.replace(stage.new / name, folder / name)
            moved.append(name)
    except OSError:
        marker.unlink()
        for name in moved:
            if os.path.lexists(stage.old / name):
                os.replace(stage.old / name, folder / name)
            else:
                (folder / name).unlink()
        raise


def _keep(path: Path, copy: Path) -> None:
    try:
        os.link(path, copy, follow_symlinks=False)
    except OSError:
        shutil.copy2(path, copy, follow_symlinks=False)


def _encoded(name: str, content: str | bytes) -> bytes:
    if isinstance(content, bytes):
        return content
    try:
        return content.encode("utf-8")
    except UnicodeEncodeError as error:
        part = content[max(error.start - 20, 0) : error.end + 20]
        raise InvalidInputError(
            f"text of {name}", part, "holds half a character (a lone surrogate), which no text file holds"
        ) from error


def _refusal(folder: Path, names: Mapping[str, bytes], error: OSError) -> OutputError:
    """Return the error of a folder or file that cannot be written."""
    path = folder / next(iter(names)) if len(names) == 1 else folder
    with contextlib.suppress(OSError):
        if isinstance(error, (FileExistsError, NotADirectoryError)) and folder.exists() and not folder.is_dir():
            return OutputError(folder, "cannot be written into: it is a file; name a folder")
    return OutputError(path, f"cannot be written ({error.strerror or error})")
