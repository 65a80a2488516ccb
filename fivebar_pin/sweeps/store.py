"""Chunks kept in a folder, so that a sweep that was stopped goes on."""

from __future__ import annotations

import io
import os
import zipfile
from pathlib import Path

import numpy as np

from fivebar_pin._files import as_path, check_folder, write_file
from fivebar_pin.sweeps.chunk import Chunk
from fivebar_pin.sweeps.problem import Problem

__all__ = ["Store"]

_DIGITS = 16  # of the key of a problem in the names of its files


class Store:
    """A folder of chunks. Those of other problems may lie beside; a file that is none is computed again.

    Raises:
        OutputError: the folder cannot be written.
    """

    def __init__(self, folder: str | os.PathLike[str], problem: Problem) -> None:
        self.folder, self._key, self._problem = as_path(folder), problem.key[:_DIGITS], problem
        check_folder(self.folder, overwrite=True)

    def path(self, k: slice) -> Path:
        """Return the file of a chunk."""
        return self.folder / f"sweep-{self._key}-{k.start:09d}-{k.stop:09d}.npz"

    def read(self, k: slice) -> Chunk | None:
        """Return a chunk that is there."""
        names = [term.name for term in self._problem.terms]
        try:
            with np.load(io.BytesIO(self.path(k).read_bytes()), allow_pickle=False) as found:
                chunk = Chunk(found["status"], found["reached"], {name: found[f"of_{name}"] for name in names})
        except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile):
            return None
        return chunk if len(chunk.status) == k.stop - k.start else None

    def write(self, k: slice, chunk: Chunk) -> None:
        """Keep a chunk, whole or not at all."""
        content = io.BytesIO()
        values = {f"of_{name}": x for name, x in chunk.values.items()}
        np.savez(content, status=chunk.status, reached=chunk.reached, **values)  # type: ignore[arg-type]
        write_file(self.path(k), content.getvalue(), overwrite=True)
