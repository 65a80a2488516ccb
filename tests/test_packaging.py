"""What a stranger gets: a wheel that works elsewhere, shipped mechanisms included, and a README that runs."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel and unpack it into an empty folder."""
    out, target = tmp_path_factory.mktemp("wheel"), tmp_path_factory.mktemp("elsewhere")
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(out), str(ROOT)]
    subprocess.run(build, check=True, capture_output=True)
    (wheel,) = out.glob("fivebar_pin-*.whl")
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", str(target), str(wheel)]
    subprocess.run(pip, check=True, capture_output=True)
    return target


def _python(code: str, *, path: Path, cwd: Path) -> str:
    environment = {**os.environ, "PYTHONPATH": str(path)}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=cwd, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_wheel_loads_every_shipped_mechanism_elsewhere(installed: Path, tmp_path: Path) -> None:
    """The mechanisms travel inside the wheel and load from there, not from the source tree."""
    code = (
        "import fivebar_pin as fb, pathlib\n"
        "names = fb.io.shipped()\n"
        "paths = [fb.io.shipped_path(n) for n in names]\n"
        "[fb.load(p) for p in paths]\n"
        "print(len(names)); print(fb.__file__); print(paths[0])\n"
    )
    count, package, first = _python(code, path=installed, cwd=tmp_path).split("\n")[:3]
    assert int(count) == len({p.stem for p in (ROOT / "urdf").rglob("*.urdf")}) > 0
    assert Path(package).is_relative_to(installed)
    assert Path(first).is_relative_to(installed)


def test_wheel_runs_the_command_line_elsewhere(installed: Path, tmp_path: Path) -> None:
    """The console entry point of the wheel answers."""
    out = _python(
        "from fivebar_pin.cli import main; raise SystemExit(main(['check', 'five_bar_case_I']))",
        path=installed,
        cwd=tmp_path,
    )
    assert "mobility" in out.lower()


def _readme_blocks() -> list[str]:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    return re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)


@pytest.mark.parametrize("block", _readme_blocks(), ids=lambda b: b.strip().splitlines()[0][:40])
def test_readme_code_runs(block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every Python block of the README runs as it stands."""
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "README.md", "exec"), {"__name__": "readme"})
