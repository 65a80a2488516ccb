"""How a command ends when what surrounds it fails: closed streams, readers that leave, interrupts, full disks."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from fivebar_pin.cli import _command, main
from fivebar_pin.cli._output import columns_text
from fivebar_pin.errors import InvalidInputError

PROGRAM = [sys.executable, "-m", "fivebar_pin"]
CHECK = ["check", "four_bar_crank_rocker"]
DEMO = ["demo", "--samples", "5"]


def shell(line: str) -> subprocess.CompletedProcess[str]:
    """Run a line of the shell in which fb stands for the program."""
    program = f'fb() {{ {sys.executable} -m fivebar_pin "$@"; }}; '
    return subprocess.run(["bash", "-c", program + line], capture_output=True, text=True, check=False, timeout=60)


@pytest.mark.parametrize(
    ("line", "code", "said"),
    [
        ("fb conditions five_bar_case_I | head -1; exit ${PIPESTATUS[0]}", 0, ""),
        ("fb --help | true; exit ${PIPESTATUS[0]}", 0, ""),
        ("fb check five_bar_case_I >&-", 0, ""),
        ("fb check nope 2>&-", 1, ""),
        ("fb check five_bar_case_I > /dev/full", 1, "fivebar-pin check: the output cannot be written (No space"),
    ],
)
def test_output_that_nobody_takes_is_no_traceback(line: str, code: int, said: str) -> None:
    if "/dev/full" in line and not Path("/dev/full").exists():
        pytest.skip("no device that is always full")
    done = shell(line)
    assert done.returncode == code and done.stderr.startswith(said) and done.stderr.count("\n") == bool(said)


READY = "import sys, fivebar_pin.cli as cli; print('ready', flush=True); cli.script()"


@pytest.mark.parametrize("wait", [0.0, 0.02, 0.1, 0.3, 0.7, 1.2])
def test_an_interrupt_at_any_moment_is_one_line_and_130(wait: float, tmp_path: Path) -> None:
    """While it imports, computes or writes: all is written or nothing. Before, it is Python itself that starts."""
    out = tmp_path / "out"
    words = ["demo", "--samples", "20001", "--out", str(out)]
    process = subprocess.Popen(
        [sys.executable, "-c", READY, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None and process.stdout.readline() == "ready\n"
    time.sleep(wait)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert (process.returncode, err) in ((130, "interrupted\n"), (0, ""))
    assert not out.exists() or len(list(out.iterdir())) == 11
    assert not [p for p in tmp_path.iterdir() if p.name.startswith(".")]


def test_importing_the_command_line_takes_no_time_in_which_an_interrupt_would_be_a_traceback() -> None:
    code = "import sys; before = set(sys.modules); import fivebar_pin.cli; print(*(set(sys.modules) - before))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert {name.partition(".")[0] for name in done.stdout.split()} <= {
        "fivebar_pin",
        "importlib",
        "warnings",
        "__future__",
    }


def test_an_interrupt_while_the_command_is_imported_is_one_line() -> None:
    code = (
        "import sys, fivebar_pin.cli as cli\n"
        "class Interrupted:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == 'argparse': raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Interrupted()); cli.script()"
    )
    done = subprocess.run([sys.executable, "-c", code, "check"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "interrupted\n")


def test_names_with_brackets_and_colons_are_printed_as_they_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither markup nor emoji: "[/x]" once ended the command after everything had been written."""
    monkeypatch.chdir(tmp_path)
    name = "[/x] [bold]:smile: caf\udce9"
    for command in (DEMO, ["loads", "four_bar_crank_rocker"], ["simulate", "slider_crank", "--time", "0.01"]):
        assert main([*command, "--out", f"{name}/{command[0]}"]) == 0
        said = capsys.readouterr()
        assert f"{name}/{command[0]}/animation.html" in said.out.replace("\\udce9", "\udce9") and not said.err
        assert Path(name, command[0], "animation.html").exists()


def test_errors_are_one_line_whatever_they_repeat(capsys: pytest.CaptureFixture[str]) -> None:
    """Line breaks, control signs, half characters and 20 kB in what is repeated."""
    for name in ("x\ny.urdf", "x\x1b[31m.urdf", "caf\udce9.urdf", "\ud800", "x\0y", "n" * 300, "a" * 20_000, ""):
        assert main(["check", name]) == 1
        said = capsys.readouterr().err
        assert said.count("\n") == 1 and said.startswith("fivebar-pin check: ") and len(said) < 2100
        assert said.rstrip("\n").isprintable()
    assert main(["check", "x\ny.urdf"]) == 1
    assert "x y.urdf: there is no such file" in capsys.readouterr().err
    with pytest.raises(SystemExit) as ended:
        main(["demo", "--samples", "9" * 20_000])
    assert ended.value.code == 2 and len(capsys.readouterr().err.splitlines()[-1]) < 2100


def test_a_full_disk_keeps_earlier_results_and_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main([*DEMO, "--out", str(out)]) == 0
    before = {p.name: p.read_bytes() for p in out.iterdir()}
    capsys.readouterr()

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    assert main(["demo", "--samples", "7", "--out", str(out), "--overwrite"]) == 1
    said = capsys.readouterr().err
    assert said == f"fivebar-pin demo: {out}: cannot be written (No space left on device)\n"
    assert {p.name: p.read_bytes() for p in out.iterdir()} == before
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


def test_memory_that_is_not_there_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def short(_: object) -> int:
        raise MemoryError("Unable to allocate 9 TiB")

    monkeypatch.setattr(_command, "_run", short)
    assert main(CHECK) == 1
    assert capsys.readouterr().err.startswith("fivebar-pin check: there is not enough memory for this (Unable")


def test_results_beyond_the_range_of_numbers_are_not_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """No warnings between the lines, and no table of nan."""
    (tmp_path / "fast.csv").write_text("t,q_x,v_x,a_x\n0,1,1e200,0\n1,1,1e200,0\n")
    words = ["loads", "four_bar_crank_rocker", "--motion", str(tmp_path / "fast.csv"), "--out", str(tmp_path / "o")]
    assert main(words) == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and not (tmp_path / "o").exists()
    with pytest.raises(InvalidInputError, match="x = nan but must be finite"):
        columns_text([("t", np.zeros(1)), ("x", np.array([np.inf]))])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["demo", "--samples", "1000000000"], "--samples = 1000000000 but must be an integer from 2 to 1000000"),
        (["simulate", "slider_crank", "--samples", "1"], "--samples = 1 but must be"),
        (["simulate", "slider_crank", "--time", "1e308"], "--time = 1e+308 but must be positive and finite"),
        (["pareto", "slider_crank", "added_mass", "rms_torque", "--points", "100000"], "--points = 100000 but"),
        (["score", "slider_crank", "--random", "100000000000"], "GB of memory"),
        (["view", "slider_crank", "--port", "70000"], "--port = 70000 but must be an integer from 0 to 65535"),
        (["view", "slider_crank", "--speed", "nan"], "--speed = nan but must be positive"),
        (["loads", "slider_crank", "--motion", ""], "path = '' but must be the name"),
        (["score", "slider_crank", "--designs", ""], "path = '' but must be the name"),
        (["score", "slider_crank", "--random", "9" * 400], "GB of memory"),
        (["demo", "--samples", "3", "--period", "1e308"], "beyond what can be computed"),
        (["demo", "--out", ""], "path = '' but must be the name"),
    ],
)
def test_requests_without_sense_are_refused_at_once(
    words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    started = time.monotonic()
    assert main(words) == 1
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1
    assert time.monotonic() - started < 10.0


def test_files_are_written_before_anything_is_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A reader that has gone must not cost the results."""

    class Gone:
        encoding = "utf-8"

        def write(self, _: str) -> int:
            raise BrokenPipeError

        def flush(self) -> None:
            pass

    for words in (
        ["loads", "four_bar_crank_rocker", "--out", str(tmp_path / "loads")],
        [
            "balance",
            "four_bar_crank_rocker",
            "--radius",
            "0.1",
            "--realise",
            "disc",
            "--out",
            str(tmp_path / "balance"),
        ],
        ["simulate", "slider_crank", "--time", "0.01", "--out", str(tmp_path / "simulate")],
        [*DEMO, "--out", str(tmp_path / "demo")],
    ):
        with monkeypatch.context() as patch:
            patch.setattr(sys, "stdout", Gone())
            assert main(words) == 0
        assert (tmp_path / words[0] / "animation.html").exists()
    assert not [p for p in tmp_path.rglob("*") if p.name.startswith(".")]
