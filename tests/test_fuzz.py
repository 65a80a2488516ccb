"""Strange files and calls, drawn at random: only errors of the library come out, soon, and nothing strange is taken.

A few hundred of each kind run with the tests; FIVEBAR_FUZZ=10000 asks for more, FIVEBAR_FUZZ_SEED for others.
"""

from __future__ import annotations

import os
import re
import signal
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

import fivebar_pin as fb
from fivebar_pin import balancing, paper
from fivebar_pin.errors import FiveBarPinError, LeftOutWarning

COUNT = int(os.environ.get("FIVEBAR_FUZZ", "150"))
SEED = int(os.environ.get("FIVEBAR_FUZZ_SEED", "1"))
LONGEST = 20  # time of the processor that one input may take [s]
NUMBERS = (
    *(
        "0",
        "-1",
        "1",
        "-0.0",
        "1e-320",
        "1e308",
        "-1e308",
        "1e400",
        "nan",
        "inf",
        "-inf",
        "",
        " ",
        "1,5",
        "0x10",
        "abc",
    ),
    *(
        "1e-9",
        "-1e-9",
        "3.14",
        "1 2",
        "１",
        "1_0",
        "+1",
        "٣",
        "null",
        "~",
        "true",
        "[1]",
        "{a: 1}",
        "&a 1",
        "*a",
        "!!int 3",
    ),
)
WORDS = (
    "",
    " ",
    "universe",
    "root_joint",
    "a" * 300,
    "é",
    "\u202e",
    "a b",
    "../x",
    "%s",
    "[/x]",
    "-",
    "'",
    '"',
    "&",
    "<",
    "\t",
)
OBJECTS: tuple[Callable[[np.random.Generator], object], ...] = (
    *(lambda r: None, lambda r: float("nan"), lambda r: -float("inf"), lambda r: 1e200, lambda r: -1e-300, lambda r: 0),
    *(lambda r: 10**400, lambda r: True, lambda r: "abc", lambda r: b"x", lambda r: 1j, lambda r: [], lambda r: {}),
    *(lambda r: [[1.0], [1.0, 2.0]], lambda r: np.zeros((0, 3)), lambda r: np.array("2020", dtype="M8[s]")),
    *(lambda r: np.ma.masked_all(3), lambda r: r.normal(size=int(r.integers(0, 6))), lambda r: r.normal(size=(2, 3))),
    *(
        lambda r: 10.0 ** r.uniform(-320, 308) * r.normal(size=int(r.integers(1, 4))),
        lambda r: r.normal(size=(2, 2, 2)),
    ),
    *(lambda r: object(), lambda r: float(r.normal()), lambda r: int(r.integers(-5, 5)), lambda r: ("a", 1.0)),
)


@contextmanager
def watched() -> Iterator[None]:
    """Turn warnings into errors and end what takes too long."""

    def late(*_: object) -> None:
        raise AssertionError(f"takes more than {LONGEST} s")

    before = signal.signal(signal.SIGPROF, late)
    signal.setitimer(signal.ITIMER_PROF, LONGEST)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", LeftOutWarning)  # which is an answer, too
            yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def attempt(make: Callable[[], object], what: str) -> object | None:
    """Return what comes out; an error of the library is an answer, any other one fails."""
    try:
        with watched():
            return make()
    except FiveBarPinError as error:
        assert str(error).strip()
        return None
    except BaseException as error:
        raise AssertionError(f"{type(error).__name__}: {error}\nfrom {what}") from error


def mutated(text: str, rng: np.random.Generator) -> str:
    """Change numbers, words, attributes, lines or bytes of a text."""
    for _ in range(int(rng.integers(1, 4))):
        kind = int(rng.integers(0, 7))
        if kind <= 2:
            found = list(re.finditer(r"-?\d+\.?\d*(e-?\d+)?", text))
            new = str(rng.choice(NUMBERS))
        elif kind == 3:
            found = list(re.finditer(r"[A-Za-z_]\w*", text))
            words = [m.group() for m in found]
            new = str(rng.choice(np.array([*WORDS, *words[:30]], dtype=object)))
        elif kind == 4:
            found, new = list(re.finditer(r"<[^>]*>|[^\n]*\n", text)), ""
        elif kind == 5:
            found = list(re.finditer(r"<[^>]*>|[^\n]*\n", text))
            new = "" if not found else str(found[int(rng.integers(len(found)))].group()) * 2
        else:
            at = int(rng.integers(0, len(text) + 1))
            text = (
                text[:at]
                + str(rng.choice(np.array(["\0", "\ud800", "<", "}", ":", "\x1b", "𝟙"], dtype=object)))
                + text[at:]
            )
            continue
        if found:
            m = found[int(rng.integers(len(found)))]
            text = text[: m.start()] + new + text[m.end() :]
    return text


def sound(chain: fb.ClosedChain) -> None:
    """Assert that what was taken can be: no number that is none, no negative mass, loss or size, no reversed limit."""
    model = chain.model
    assert all(i.mass >= 0.0 and np.isfinite(i.toDynamicParameters()).all() for i in list(model.inertias)[1:])
    for name in ("armature", "damping", "upperDryFrictionLimit", "upperEffortLimit", "upperVelocityLimit"):
        assert (np.array(getattr(model, name)) >= 0.0).all(), name
    assert (np.array(model.lowerPositionLimit) <= np.array(model.upperPositionLimit)).all()
    assert np.isfinite(model.gravity.linear).all()
    assert all(v.shape == "mesh" or min(v.size) >= 0.0 for v in chain.visuals)


SOURCES = [fb.io.shipped_path(name) for name in ("four_bar_crank_rocker", "slider_crank", "spatial_rssr")]


@pytest.mark.parametrize("which", ["urdf", "yaml", "both"])
def test_mutated_urdf_and_sidecars(which: str, tmp_path: Path) -> None:
    rng = np.random.default_rng([SEED, 1, len(which)])
    for k in range(COUNT):
        source = SOURCES[k % len(SOURCES)]
        texts = {end: source.with_suffix(end).read_text() for end in (".urdf", ".yaml")}
        for end in texts:
            if which in (end[1:], "both"):
                texts[end] = mutated(texts[end], rng)
            (tmp_path / f"x{end}").write_bytes(texts[end].encode("utf-8", "surrogatepass"))
        chain = attempt(lambda: fb.load(tmp_path / "x.urdf"), texts[".urdf"] + texts[".yaml"])
        if isinstance(chain, fb.ClosedChain):
            sound(chain)
            if k % 10 == 0:
                attempt(lambda chain=chain: str(fb.diagnose(chain)), texts[".urdf"] + texts[".yaml"])


def test_mutated_mjcf(tmp_path: Path) -> None:
    rng = np.random.default_rng([SEED, 2])
    for k, source in enumerate(SOURCES):
        fb.save(fb.load(source), tmp_path / f"{k}.xml")
    for k in range(COUNT):
        text = mutated((tmp_path / f"{k % len(SOURCES)}.xml").read_text(), rng)
        (tmp_path / "x.xml").write_bytes(text.encode("utf-8", "surrogatepass"))
        chain = attempt(lambda: fb.load(tmp_path / "x.xml"), text)
        if isinstance(chain, fb.ClosedChain):
            sound(chain)


def test_mutated_motion_tables(tmp_path: Path) -> None:
    rng = np.random.default_rng([SEED, 3])
    t = np.linspace(0.0, 1.0, 8)
    fb.motion.to_file(fb.motion.cycloidal(t, 0.0, 1.0), tmp_path / "a.csv", ("crank",))
    texts = [(tmp_path / "a.csv").read_text()]
    texts.append("t [s],q crank [rad]\n" + "".join(f"{x},{x * x}\n" for x in t))
    for k in range(COUNT):
        text = mutated(texts[k % 2], rng)
        (tmp_path / "x.csv").write_bytes(text.encode("utf-8", "surrogatepass"))
        motion = attempt(lambda: fb.motion.from_file(tmp_path / "x.csv", ("crank",)), text)
        if isinstance(motion, fb.Motion):
            assert all(np.isfinite(getattr(motion, x)).all() for x in "tqva") and (np.diff(motion.t) > 0.0).all()


def calls() -> dict[str, Callable[..., object]]:
    """Return the public API as functions of one or two hostile values."""
    chain = fb.load("four_bar_crank_rocker")
    q = fb.assemble(chain, [0.5])
    t = np.linspace(0.0, 0.2, 5)
    v, motion = np.zeros(chain.nv), fb.motion.cycloidal(t, 0.5, 0.9)
    path = fb.drive(chain, motion, near=q)
    line = paper.table_1("I", "unbalanced")
    moved = paper.default_motion(samples=5)
    first = chain.joints[0]
    return {
        "assemble": lambda x, y: fb.assemble(chain, x, y),
        "assemble, search": lambda x, y: fb.assemble(chain, [0.5], starts=x, seed=y),
        "assembly_modes": lambda x, y: fb.assembly_modes(chain, x, tolerance=y),
        "drive": lambda x, y: fb.drive(chain, fb.Motion(t, motion.q, x, y), near=q),
        "drive near": lambda x, y: fb.drive(chain, motion, x, tolerance=y),
        "motion": lambda x, y: fb.Motion(x, y, y, y),
        "laws": lambda x, y: (
            fb.motion.harmonic(t, x, y, period=1.0),
            fb.motion.polynomial(t, x, y),
            fb.motion.constant(t, x),
        ),
        "spline": lambda x, y: fb.motion.spline(t, x, y),
        "scaled": lambda x, y: motion.scaled(x),
        "inverse": lambda x, y: fb.inverse_dynamics(chain, path, about=x, external={"coupler_link": y}),
        "forward": lambda x, y: fb.forward_dynamics(chain, q, x, y),
        "forward q": lambda x, y: fb.forward_dynamics(chain, x, v, y),
        "simulate": lambda x, y: fb.simulate(chain, q, v, x, t[:2], max_steps=50),
        "simulate t": lambda x, y: fb.simulate(chain, q, x, None, y, max_steps=50),
        "springs": lambda x, y: fb.forward_dynamics(chain.with_springs([fb.JointSpring(first, x, y)]), q, v),
        "gravity": lambda x, y: chain.with_gravity(x),
        "parameters": lambda x, y: chain.with_inertial_parameters(x),
        "closure": lambda x, y: fb.Closure(x, y, x),
        "visual": lambda x, y: fb.Visual("base", "box", x, y),
        "actuated": lambda x, y: chain.with_actuated(x),
        "diagnose": lambda x, y: fb.diagnose(chain, x, seed=y),
        "score": lambda x, y: fb.score(chain, path, x, about=y),
        "sweep": lambda x, y: fb.sweep(chain, motion, inertias=x, of="rms_torque", about=y),
        "sweep, asked": lambda x, y: fb.sweep(chain, motion, parameters=x, of=y),
        "regressor": lambda x, y: balancing.regressor(chain, path, "torque", about=x),
        "conditions": lambda x, y: fb.balance_conditions(chain, "force", samples=x, about=y),
        "regions": lambda x, y: (balancing.Ball(x, y), balancing.Box(x, y), balancing.Ellipsoid(x, y)),
        "variations": lambda x, y: balancing.variations(chain, 2, spread=x, seed=y),
        "linkage": lambda x, y: paper.FiveBar(x, line.masses, y, line.rho, line.alpha),
        "paper": lambda x, y: paper.solve(line, moved, gravity=x),
        "load": lambda x, y: fb.load(x),
        "complement": lambda x, y: (fb.complement(chain, x), fb.closure_residual(chain, y)),
    }


def test_hostile_values_in_the_public_api() -> None:
    rng = np.random.default_rng([SEED, 4])
    ways = calls()
    for _ in range(COUNT):
        for name, way in ways.items():
            x, y = (OBJECTS[int(rng.integers(len(OBJECTS)))](rng) for _ in range(2))
            attempt(lambda way=way, x=x, y=y: way(x, y), f"{name}({x!r}, {y!r})")
