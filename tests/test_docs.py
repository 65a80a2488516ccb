"""What the pages under docs/ show runs as it stands."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"
PAGES = ("extending", "control", "sweeps")  # whose sections run each by itself


def sections(page: Path) -> dict[str, str]:
    """Return the Python blocks of every section of a page, joined, by the section's heading."""
    parts = re.split(r"^## (.+)$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]
    blocks = {
        heading: "\n".join(re.findall(r"^```python\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL))
        for heading, text in zip(parts[::2], parts[1::2], strict=True)
    }
    return {heading: code for heading, code in blocks.items() if code}


def test_the_pages_have_their_sections():
    assert "A closure kind" in sections(DOCS / "extending.md")
    assert "Computed torque" in sections(DOCS / "control.md")


@pytest.mark.parametrize(("page", "heading"), [(p, h) for p in PAGES for h in sections(DOCS / f"{p}.md")])
def test_every_section_runs_in_a_fresh_interpreter(page, heading, tmp_path):
    """Apart from each other and from the tests: what a section registers stays in its own process."""
    code = sections(DOCS / f"{page}.md")[heading]
    command = [sys.executable, "-W", "error", "-c", code]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
