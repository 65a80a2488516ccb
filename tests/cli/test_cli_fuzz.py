"""The command line under random words ends as documented: see `fuzz_cli`, which runs as many as one likes."""

from __future__ import annotations

import os
from pathlib import Path

from fuzz_cli import tried

LINES = int(os.environ.get("FUZZ_LINES", "120"))


def test_random_command_lines_end_as_documented(tmp_path: Path) -> None:
    """A documented exit code, one line of error, no traceback, no hang, all files or none."""
    assert tried(LINES, 0, tmp_path / "place") == []
