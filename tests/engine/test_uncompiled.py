"""The same kernels uncompiled: for stepping through them, and because Python raises where compiled code is silent."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
CHOSEN = (
    "test_blocks.py and not 12",
    "test_links.py and (helical or composite or planar or ZYX or RUBX or rotations) and not far",
    "test_rows.py and (nested or half or told or rod or everything or say or RSCR)",
    "test_newton.py and (RSCR or Bennett or rod or open or reach or flat or told or correct or rack)",
    "test_following.py and (RSCR or Bennett or tie or number or last_ or parabolas or repeated or 7-0.1) and not any",
    "test_following.py and spatial and certificate",
    "test_loads.py and (RSCR or Bennett or meet or joints or outside or carried) and not nested",
)
"""Tests that come to every line of the kernels, in a few seconds; infinities are left out, whose cosine raises."""


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="it would start itself")
def test_uncompiled_the_kernels_pass_the_same_tests():
    """Some of those of this folder, in a process that does not compile; warnings of NumPy are errors there."""
    words = f"({' or '.join(f'({chosen})' for chosen in CHOSEN)}) and not inf"
    command = [sys.executable, "-m", "pytest", "-x", "-p", "no:cacheprovider", str(HERE), "-k", words]
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, cwd=HERE.parents[1])
    assert done.returncode == 0, done.stdout + done.stderr
    assert "passed" in done.stdout
