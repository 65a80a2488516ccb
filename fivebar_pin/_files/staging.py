"""Stages: hidden folders in which files become complete before anybody sees them.

A stage belongs to one folder. It lies beside the folder when the two are to be exchanged, and inside it when files are
to be moved one by one. What a killed writer left of it is put right by the next one:

    new/     the files, or after an exchange the folder that they replaced
    made     names of the set, and the number by which the system knows new/: another one there means "exchanged"
    moving   there once every file is complete and they go into place one by one: what remains has to follow
    old/     what they replace, until all are in place
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

try:
    import fcntl
except ImportError:  # no such locks: writers do not wait for each other, and stages of killed ones stay
    fcntl = None  # type: ignore[assignment]

__all__ = ["Staging", "flush", "held", "strays"]

_PATIENCE = 10.0
"""How long a writer waits for another one that is at the same folder [s]; a set is written in far less."""
_PAUSE = 0.02  # between two looks [s]


class Staging:
    """A hidden folder for the files of one set."""

    def __init__(self, path: Path) -> None:
        self.path, self.new, self.old = path, path / "new", path / "old"

    @classmethod
    def holding(cls, files: Mapping[str, bytes], place: Path, folder: Path) -> Staging:
        """Return a stage in a place, with the files complete and flushed."""
        stage = cls(Path(tempfile.mkdtemp(prefix=_prefix(place, folder), dir=place)))
        try:
            stage.new.mkdir()
            for name, content in files.items():
                with (stage.new / name).open("xb") as stream:
                    stream.write(content)
                    stream.flush()
                    os.fsync(stream.fileno())
            made = {"names": sorted(files), "number": stage.new.stat().st_ino}
            (stage.path / "made").write_text(json.dumps(made), encoding="ascii")
            flush(stage.new)
        except BaseException:
            shutil.rmtree(stage.path, ignore_errors=True)
            raise
        return stage

    def settle(self, folder: Path) -> None:
        """Finish what was begun for a folder and remove the stage, whatever state a kill left it in."""
        if (self.path / "moving").exists():
            for name in sorted(os.listdir(self.new)):
                with contextlib.suppress(OSError):
                    os.replace(self.new / name, folder / name)
        else:
            self._bring_home(folder)
        shutil.rmtree(self.path, ignore_errors=True)

    def _bring_home(self, folder: Path) -> None:
        """Move what somebody put into a replaced folder while it was replaced to where it belongs."""
        try:
            made = json.loads((self.path / "made").read_text(encoding="ascii"))
            if made["number"] == self.new.stat().st_ino:
                return
        except (OSError, ValueError):  # killed before the stage was complete: nothing of it was ever in place
            return
        for name in os.listdir(self.new):
            if name not in made["names"] and not os.path.lexists(folder / name):
                os.replace(self.new / name, folder / name)


def strays(place: Path, folder: Path) -> list[Staging]:
    """Return the stages of a folder that lie in a place; to be asked while the folder is held."""
    prefix = _prefix(place, folder)
    try:
        with os.scandir(place) as entries:
            found = [e.path for e in entries if e.name.startswith(prefix) and e.is_dir(follow_symlinks=False)]
    except OSError:
        return []
    return [Staging(Path(path)) for path in found if Path(path).stat().st_uid == os.geteuid()]


@contextlib.contextmanager
def held(folder: Path) -> Iterator[bool]:
    """Keep other writers of this library away from a folder; yields False where that cannot be had."""
    descriptor, got = _hold(folder, time.monotonic() + _PATIENCE)
    try:
        yield got
    finally:
        os.close(descriptor)


def flush(folder: Path) -> None:
    """Flush the names of a folder to the disk, where the system knows such a thing."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _hold(folder: Path, until: float) -> tuple[int, bool]:
    while True:
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            if fcntl is None:
                return descriptor, False
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.path.samestat(os.fstat(descriptor), os.stat(folder)):
                return descriptor, True
        except BlockingIOError:
            if time.monotonic() > until:
                return descriptor, False
            time.sleep(_PAUSE)
        except OSError:  # a file system without locks
            return descriptor, False
        os.close(descriptor)


def _prefix(place: Path, folder: Path) -> str:
    """Return how the names of a folder's stages begin in a place: beside it or inside it."""
    key = "." if place == folder else folder.name
    return f".fivebar_pin-{hashlib.sha256(os.fsencode(key)).hexdigest()[:12]}-"
