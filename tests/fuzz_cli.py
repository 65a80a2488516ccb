"""The command line under random words: what ends otherwise than documented.

    python tests/fuzz_cli.py 20000 [seed]             # in process, through `main`
    python tests/fuzz_cli.py 300 [seed] processes     # as processes of their own

Words are drawn from what fits and from what does not: numbers out of every range, names that no file can have, pipes
and devices, brackets, half characters, long texts. A command may end with one of the documented codes, says what is
wrong on one line, never shows a traceback, and writes all of its files or none.
"""

from __future__ import annotations

import contextlib
import io
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import traceback
import warnings
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

import numpy as np

import fivebar_pin as fb
from fivebar_pin import simulation, viz
from fivebar_pin.cli import main

CODES = (0, 1, 2, 130)
LONGEST = 60  # a command takes no longer [s]
LONGEST_LINE = 2200  # of an error [characters]
SMALL = ("four_bar_crank_rocker", "slider_crank", "five_bar_case_I", "four_bar_antiparallelogram")
NUMBERS = (
    "nan", "inf", "-inf", "1e308", "-1e308", "1e200", "1e-308", "0", "-0", "-1", "1e400", "9" * 400, "9" * 5000, "1_0",
    "0x10", "", " ", "1e", "٣", "1,5", "1e5", "abc", "\ud800", "1e-9", "1e9", "100000000000", "-5", "0.5", "3",
)  # fmt: skip
NAMES = (
    "", " ", "[/x]", "[bold]x[/bold]", ":smile:",
    "n" * 300, "a" * 20000, "../..", "x\0y", "x\ny", "caf\udce9", "\ud800",
    "é", "-", "--", "--help", "%s", "{}", "x\x1b[31m", "/dev/null", "/dev/zero", "/dev/full", "/proc/self/mem", "/proc",
    "/", ".", "nan", "None", "five_bar", "psi", "rms_torque", "added_mass",
)  # fmt: skip


class TooLong(BaseException):
    """A command does not come to an end."""


class Workplace:
    """A folder with good and spoilt files, and random command lines about them."""

    def __init__(self, place: Path, seed: int) -> None:
        self.place, self.random = place, random.Random(seed)
        place.mkdir(parents=True, exist_ok=True)
        names = {"five_bar_case_I": ("psi", "gamma")}
        for name in SMALL:
            chain = fb.load(fb.io.shipped_path(name))
            names[name] = chain.actuated
        t = np.linspace(0.0, 1.0, 11)
        one, two = fb.motion.cycloidal(t, 1.0, 1.5), fb.paper.default_motion(samples=11)
        fb.motion.to_file(one, place / "one.csv", ("crank",))
        fb.motion.to_file(two, place / "two.csv", ("psi", "gamma"))
        np.save(place / "designs.npy", fb.balancing.variations(fb.load(fb.io.shipped_path(SMALL[0])), 5))
        texts = {
            "empty.csv": "", "words.csv": "a,b\nc,d\n", "nan.csv": "t,q_x,v_x,a_x\n0,nan,0,0\n",
            "huge.csv": "t,q_x,v_x,a_x\n0,1e308,1e308,1e308\n1,-1e308,0,0\n", "short.csv": "t,q_x,v_x,a_x\n0,1\n",
            "still.csv": "t,q_x,v_x,a_x\n0,1,0,0\n", "back.csv": "t,q_x,v_x,a_x\n1,1,0,0\n0,1,0,0\n",
            "bad.urdf": "<robot>", "bad.xml": "<mujoco/>", "long.csv": "x" * 20000 + ",t\n1,2\n",
            "many.csv": ",".join(f"c{k}" for k in range(3000)) + "\n",
            "digits.csv": f"t,q_x,v_x,a_x\n{'9' * 5000},0,0,0\n",
        }  # fmt: skip
        texts["tree.urdf"] = fb.io.shipped_path("slider_crank").read_text()
        for name, text in texts.items():
            (place / name).write_text(text)
        (place / "noise.csv").write_bytes(bytes(range(256)))
        (place / "noise.npy").write_bytes(b"\x93NUMPY\x01\x00" + bytes(range(100)))
        np.save(place / "complex.npy", np.zeros((2, 4, 10), dtype=complex))
        (place / "folder").mkdir(exist_ok=True)
        for name in ("pipe.csv", "pipe.npy", "pipe.urdf"):
            with contextlib.suppress(FileExistsError):
                os.mkfifo(place / name)
        fb.save(fb.load(fb.io.shipped_path(SMALL[0])), place / "mine")
        self.files = sorted(str(p) for p in place.iterdir())
        self.count = 0

    def chance(self, share: float) -> bool:
        return self.random.random() < share

    def name(self) -> str:
        return self.random.choice(NAMES) if self.chance(0.6) else self.random.choice(self.files)

    def number(self, *good: str) -> str:
        return self.random.choice(good) if self.chance(0.6) else self.random.choice(NUMBERS)

    def word(self, *good: str) -> str:
        return self.random.choice(good) if self.chance(0.85) else self.name()

    def path(self) -> str:
        if self.chance(0.5):
            return self.random.choice(SMALL)
        return self.name() if self.chance(0.7) else str(self.place / "mine")

    def table(self) -> str:
        if self.chance(0.5):
            return str(self.place / self.random.choice(("one.csv", "two.csv")))
        return self.name()

    def out(self) -> str:
        if self.chance(0.6):
            self.count += 1
            return str(self.place / "out" / f"{self.count % 7}")
        return str(self.place / "out" / self.name().lstrip("/")) if self.chance(0.5) else self.name_inside()

    def name_inside(self) -> str:
        """A hostile name that leads nowhere but into the workplace or to what cannot be written."""
        name = self.name()
        free = name.startswith(("/dev/", "/proc")) or name in self.files or not name
        return name if free else str(self.place / "out") + "/" + name

    def gravity(self) -> list[str]:
        return ["--gravity", *(self.number("0", "-9.81", "1") for _ in range(self.random.choice((3, 3, 3, 2))))]

    def line(self) -> list[str]:
        """Return the words of one command."""
        command = self.random.choice(
            ("demo", "check", "close", "loads", "simulate", "conditions", "balance", "pareto", "score", "view", "other")
        )
        if command == "other":
            return [
                self.word("demo", "--help", "--version", "check"),
                *(self.name() for _ in range(self.random.randrange(3))),
            ]
        options = getattr(self, f"_{command}")()
        positional = [] if command == "demo" else [self.path()]
        if command == "close":
            positional = [self.word(str(self.place / "tree.urdf"))]
        if command == "pareto":
            terms = ("added_mass", "rms_torque", "peak_torque", "rms_shaking_moment", "beauty")
            positional += [self.word(*terms), self.word(*terms)]
        chosen = [option for option in options if self.chance(0.35)]
        if command == "simulate":
            chosen += [["--time", self.number("0.1", "0.01")], ["--samples", self.number("3", "5")]]
        if command == "demo":
            chosen += [["--samples", self.number("3", "5")], ["--out", self.out()]]
        if command == "view" and self.chance(0.8):
            chosen.append(["--html", self.out()])
        self.random.shuffle(chosen)
        words = [command, *positional, *(word for option in chosen for word in option)]
        if self.chance(0.05):
            words.insert(self.random.randrange(len(words) + 1), self.name())
        return words

    def _demo(self) -> list[list[str]]:
        return [
            ["--case", self.word("I", "II")], ["--reading", self.word("printed", "corrected")],
            ["--mode", self.word("left", "right")], ["--motion", self.table()],
            ["--period", self.number("1", "0.5")], self.gravity(), ["--overwrite"], ["--speed", self.number("1", "2")],
            ["--view"],
        ]  # fmt: skip

    def _check(self) -> list[list[str]]:
        return []

    def _close(self) -> list[list[str]]:
        return [
            ["--out", self.out()], ["--overwrite"], ["--kind", self.word("3d", "6d", "revolute")],
            ["--pair", self.word("B_rod", "B_coupler"), self.word("B_slider", "B_rocker")],
            ["--motor", self.word("crank", "psi", "slider")], ["--dry-run"],
        ]  # fmt: skip

    def _loads(self) -> list[list[str]]:
        about = ["--about", *(self.number("0", "1") for _ in range(3))]
        return [["--motion", self.table()], about, self.gravity(), ["--out", self.out()], ["--overwrite"]]

    def _simulate(self) -> list[list[str]]:
        return [
            self.gravity(),
            ["--torque", *(self.number("0", "0.1") for _ in range(self.random.choice((1, 1, 2))))],
            ["--out", self.out()], ["--overwrite"],
        ]  # fmt: skip

    def _conditions(self) -> list[list[str]]:
        return [["--kind", self.word("force", "moment", "dynamic", "static")], self.gravity()]

    def _designing(self) -> list[list[str]]:
        return [
            *self._conditions(), ["--mode", self.word("add", "redesign")], ["--bodies", self.word("crank", "psi")],
            ["--radius", self.number("0.1", "1")], ["--masses", self.number("0", "0.1"), self.number("1", "5")],
            ["--remove", self.word("crank", "psi", "coupler")], ["--motion", self.table()],
            ["--branch", self.word("all", "motion")],
        ]  # fmt: skip

    def _balance(self) -> list[list[str]]:
        terms = ("rms_torque", "added_mass=1", "added_mass", "peak_torque=0.1", "rms_torque=x", "rms_torque=nan")
        return [
            *self._designing(), ["--minimise", self.word(*terms)], ["--limit", self.word(*terms)],
            ["--realise", self.word("disc", "bar", "ball")],
            ["--material", self.word("steel", "lead", "7800", "-1", "nan")],
            ["--thickness", self.number("0.01", "0.1")], ["--out", self.out()], ["--overwrite"], ["--view"],
        ]  # fmt: skip

    def _pareto(self) -> list[list[str]]:
        return [*self._designing(), ["--points", self.number("2", "3")], ["--out", self.out()]]

    def _score(self) -> list[list[str]]:
        designs = [["--designs", self.word(str(self.place / "designs.npy"))], ["--random", self.number("3", "20")]]
        return [
            self.random.choice(designs), self.random.choice(designs), ["--spread", self.number("0.1", "0.9")],
            ["--seed", self.number("1", "7")], ["--terms", self.word("rms_torque", "added_mass", "peak_torque")],
            ["--motion", self.table()], ["--best", self.number("1", "5")], ["--out", self.out()],
        ]  # fmt: skip

    def _view(self) -> list[list[str]]:
        port = ["--port", self.number("0", "70000")]
        return [["--motion", self.table()], ["--speed", self.number("1", "2")], port, ["--overwrite"]]

    def written(self) -> dict[str, int]:
        """Return every file below the workplace with what tells whether it has been touched."""
        found = {}
        for folder, _, names in os.walk(self.place):
            for name in names:
                found[os.path.join(folder, name)] = os.lstat(os.path.join(folder, name)).st_mtime_ns
        return found


def in_process(words: list[str]) -> tuple[int, str, str]:
    """Run `main` and return its exit code and what it printed."""
    out, err = io.StringIO(), io.StringIO()

    def late(*_: object) -> None:
        raise TooLong(f"took more than {LONGEST} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(LONGEST)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                code = main(words)
            except SystemExit as ended:
                code = int(ended.code or 0)
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
    return code, out.getvalue(), err.getvalue()


def as_process(words: list[str]) -> tuple[int, str, str]:
    """Run the command line as a process of its own."""
    command = [sys.executable, "-m", "fivebar_pin", *words]
    done = subprocess.run(command, capture_output=True, timeout=LONGEST, check=False, stdin=subprocess.DEVNULL)
    return done.returncode, done.stdout.decode("utf-8", "replace"), done.stderr.decode("utf-8", "replace")


def fault(code: int, out: str, err: str, before: dict[str, int], after: dict[str, int]) -> str:
    """Return what is wrong with how a command ended, nothing if it is as documented."""
    lines = [line for line in err.splitlines() if line.strip()]
    if code not in CODES:
        return f"exit code {code}"
    if "Traceback" in err or "Warning" in err or "the output cannot be written" in err:
        return "foreign error shown"
    if code == 1 and not (len(lines) == 1 or (not lines and out.strip())):
        return f"{len(lines)} lines of error"
    if code == 2 and "error: " not in lines[-1]:
        return "the last line does not tell the error"
    if code == 0 and lines:
        return "errors of a command that succeeded"
    if any(len(line) > LONGEST_LINE for line in lines):
        return "an error that nobody reads to its end"
    if code != 0 and before != after:
        return "files of a command that failed"
    if any(".fivebar_pin-" in path for path in after):
        return "temporary files left"
    if any(not os.path.getsize(path) for path in after.keys() - before.keys()):
        return "an empty file"
    return ""


def tried(count: int, seed: int, place: Path, *, processes: bool = False) -> list[str]:
    """Try random command lines; return one report for each that ended wrongly."""
    workplace, faults = Workplace(place, seed), []
    few_steps = {**simulation.simulate.__wrapped__.__kwdefaults__, "max_steps": 200}  # a long simulation is no hang
    interrupt = mock.Mock(side_effect=KeyboardInterrupt)
    with contextlib.ExitStack() as stack:
        stack.enter_context(mock.patch.object(viz.Server, "wait", interrupt))
        stack.enter_context(mock.patch("webbrowser.open"))
        stack.enter_context(mock.patch.object(simulation.simulate.__wrapped__, "__kwdefaults__", few_steps))
        stack.enter_context(_inside(place))
        for number in range(count):
            words = workplace.line()
            if processes:
                words = [word for word in words if _can_be_passed(word) and word != "--view"]
                if words[:1] == ["view"] and "--html" not in words:
                    words.append("--html=page.html")
            before = workplace.written()
            try:
                code, out, err = (as_process if processes else in_process)(words)
                wrong = fault(code, out, err, before, workplace.written())
            except (Exception, TooLong) as error:
                last = traceback.extract_tb(error.__traceback__)[-1]
                wrong, err = f"{type(error).__name__}: {str(error)[:200]} at {last.filename}:{last.lineno}", ""
            if wrong:
                faults.append(f"{number}: {wrong}: {[word[:60] for word in words]} {err[:300]!r}")
            if number % 50 == 49:
                shutil.rmtree(place / "out", ignore_errors=True)
    return faults


@contextlib.contextmanager
def _inside(place: Path) -> Iterator[None]:
    before = Path.cwd()
    os.chdir(place)
    try:
        yield
    finally:
        os.chdir(before)


def _can_be_passed(word: str) -> bool:
    try:
        return "\0" not in word and len(os.fsencode(word)) < 100_000
    except UnicodeEncodeError:
        return False


if __name__ == "__main__":
    scratch = Path(tempfile.mkdtemp(prefix="fuzz-"))
    start = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    found = tried(int(sys.argv[1]), start, scratch / "place", processes="processes" in sys.argv)
    shutil.rmtree(scratch, ignore_errors=True)
    print(*found, sep="\n")  # noqa: T201
    print(f"{sys.argv[1]} command lines from seed {start}: {len(found)} ended wrongly")  # noqa: T201
