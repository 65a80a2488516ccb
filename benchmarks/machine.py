"""Where figures were measured."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = ("pin", "numpy", "numba", "mujoco", "drake", "exudyn")
"""Packages whose versions matter to the figures."""


def machine() -> str:
    """Return processor, threads and versions on one line."""
    versions = ", ".join(f"{name} {found}" for name in PACKAGES if (found := _version(name)))
    threads = os.environ["OMP_NUM_THREADS"]
    many = "one thread" if threads == "1" else f"{threads} threads"
    return f"{_processor()}, {os.cpu_count()} cores, {many}; Python {platform.python_version()}, {versions}"


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    named = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.processor() or platform.machine()
