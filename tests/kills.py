"""Processes killed while they replace files: what somebody who lists and reads the folder afterwards finds.

    python tests/kills.py save 200 [seed]       # also: balance, demo; prints how many kills left what

A writer replaces the files of one set again and again, by turns with those of two different jobs. After a kill the
folder has to hold all files of one of the two jobs, whole, and whatever else lay there.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import itertools
import os
import shutil
import signal
import sys
import tempfile
import time
import uuid
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from unittest import mock

import numpy as np

import fivebar_pin as fb
from fivebar_pin.cli import main

MINE = "notes of mine.txt"
"""A file of the user beside the results, which has to stay."""

Writer = Callable[[Path, int], None]


def save(folder: Path, job: int) -> None:
    """Save one of two mechanisms of the same name; all three files differ."""
    chain = fb.load(fb.io.shipped_path("five_bar_case_I"))
    gravity = (0.0, 0.0, 0.0) if job else (0.0, -9.81, 0.0)
    masses = np.array(chain.inertial_parameters) * (1.0 + job)
    fb.save(chain.with_gravity(gravity).with_inertial_parameters(masses), folder, name="bar", overwrite=True)


def balance(folder: Path, job: int) -> None:
    """Balance within one of two radii."""
    words = ["balance", "four_bar_crank_rocker", "--radius", ("0.1", "0.2")[job], "--minimise", "rms_torque"]
    assert main([*words, "--limit", "added_mass=9", "--out", str(folder), "--overwrite"]) == 0


def demo(folder: Path, job: int) -> None:
    """Do the paper's job for one of its two cases: eleven files."""
    words = ["demo", "--case", ("I", "II")[job], "--samples", "31", "--gravity", "0", f"-{job}", "0"]
    assert main([*words, "--out", str(folder), "--overwrite"]) == 0


def quietly(writer: Writer, folder: Path, job: int) -> None:
    """Write without a word, and the same bytes for the same job: a page holds the ids that its objects drew."""
    ids = itertools.count()
    with contextlib.redirect_stdout(io.StringIO()), mock.patch("uuid.uuid1", lambda: uuid.UUID(int=next(ids))):
        writer(folder, job)


WRITERS: dict[str, Writer] = {"balance": balance, "demo": demo, "save": save}


def seen(folder: Path) -> dict[str, str]:
    """Return the digest of every file that a user sees in the folder."""
    return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in folder.iterdir() if not p.name.startswith(".")}


def verdict(now: dict[str, str], wholes: list[dict[str, str]]) -> str:
    """Say what a folder holds: "whole", or what is wrong with it."""
    if now in wholes:
        return "whole"
    if set(now) != set(wholes[0]):
        return "lost"
    known = all(now[name] in [whole[name] for whole in wholes] for name in now)
    return "mixed" if known else "half-written"


def campaign(writer: Writer, kills: int, seed: int, place: Path) -> Counter[str]:
    """Kill a writer at random moments; count what the folder holds afterwards."""
    folder, wholes = place / "results", []
    folder.mkdir(parents=True)
    (folder / MINE).write_text("mine")
    started = time.monotonic()
    for job in (1, 0, 1, 0):  # twice: the first round imports on its way
        quietly(writer, folder, job)
        wholes.append(seen(folder))
    longest, wholes = 0.5 * (time.monotonic() - started), wholes[2:]
    assert sum(wholes[0][name] != wholes[1][name] for name in wholes[0]) > 1
    found: Counter[str] = Counter()
    rng = np.random.default_rng(seed)
    for _ in range(kills):
        child = fork()
        if child == 0:
            _write_for_ever(writer, folder)
        time.sleep(rng.uniform(0.0, longest))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        found[verdict(seen(folder), wholes)] += 1
        if found["half-written"] + found["lost"] + found["mixed"]:  # a faulty folder would be found again
            quietly(writer, folder, 0)
    quietly(writer, folder, 0)
    hidden = [p for p in (*folder.iterdir(), *place.iterdir()) if p.name.startswith(".")]
    found["strays left"] += len(hidden)
    return found


def fork() -> int:
    """Fork, which newer Pythons warn of where numerical libraries keep threads; the child here needs none of them."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return os.fork()


def _write_for_ever(writer: Writer, folder: Path) -> None:
    try:
        for turn in range(10**6):
            quietly(writer, folder, 1 - turn % 2)
    finally:
        os._exit(1)


if __name__ == "__main__":
    name, count = sys.argv[1], int(sys.argv[2])
    scratch = Path(tempfile.mkdtemp(prefix="kills-"))
    found = campaign(WRITERS[name], count, int(sys.argv[3]) if len(sys.argv) > 3 else 0, scratch)
    shutil.rmtree(scratch)
    print(f"{name}: {count} kills:", ", ".join(f"{n} {what}" for what, n in sorted(found.items())))  # noqa: T201
