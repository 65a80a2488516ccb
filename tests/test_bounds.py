"""What is too much: messages that nobody reads to their end, integers out of range, memory that is not there."""

from __future__ import annotations

import os

import numpy as np
import pytest

import fivebar_pin as fb
from fivebar_pin import paper
from fivebar_pin._arrays import integer, numeric, require_memory
from fivebar_pin.balancing import variations
from fivebar_pin.errors import FileFormatError, FiveBarPinError, InvalidInputError, OutputError, UnknownNameError
from fivebar_pin.viz import plots

HUGE = 10**400


@pytest.fixture(scope="module")
def chain() -> fb.ClosedChain:
    return fb.load(fb.io.shipped_path("five_bar_case_I"))


class Unwritable:
    def __repr__(self) -> str:
        raise RuntimeError("no")


@pytest.mark.parametrize(
    "error",
    [
        InvalidInputError("name", "x" * 20_000, "must be short"),
        InvalidInputError("name", list(range(9000)), "must be short"),
        InvalidInputError("name", np.arange(600.0).reshape(-1, 2), "must be short"),
        InvalidInputError("name", 10**5000, "must be short"),
        InvalidInputError("name", Unwritable(), "must be short"),
        UnknownNameError("joint", "x" * 20_000, [f"joint_{k}" for k in range(5000)]),
        UnknownNameError("joint", "x", ["y" * 20_000]),
        FileFormatError("p" * 4000, "is wrong"),
        OutputError("place", "cannot be written" + "!" * 20_000),
        FiveBarPinError("x" * 20_000),
    ],
    ids=lambda error: type(error).__name__,
)
def test_no_message_is_longer_than_a_terminal(error: FiveBarPinError) -> None:
    """The middle is left out and counted; beginning, end and the evidence stay."""
    assert len(str(error)) < 2200 and "\n" not in str(error)


def test_what_is_left_out_is_counted_and_the_evidence_stays_whole() -> None:
    names = [f"joint_{k}" for k in range(100)]
    error = UnknownNameError("joint", "joint_999", names)
    assert "joint_39 ... and 60 more. Did you mean" in str(error) and error.known == tuple(names)
    long = InvalidInputError("name", "x" * 20_000, "must be short", "Do this.")
    assert "more characters) ..." in str(long) and str(long).endswith("must be short. Do this.")
    assert len(str(long.value)) == 20_000
    assert str(UnknownNameError("joint", "a", ["b"])) == "Unknown joint 'a'; known: b."


@pytest.mark.parametrize(
    ("value", "low", "high"),
    [
        (0, 1, None),
        (-1, 0, None),
        (10, 0, 9),
        (HUGE, 0, 9),
        (1.0, 0, None),
        (True, 0, None),
        ("3", 0, None),
        (None, 0, None),
    ],
)
def test_integers_out_of_bounds_are_refused(value: object, low: int, high: int | None) -> None:
    with pytest.raises(InvalidInputError, match=r"count = .* must be an integer"):
        integer("count", value, least=low, most=high)
    assert integer("count", np.int32(5), least=low) == 5
    assert integer("count", 9, least=9, most=9) == 9


def test_integers_out_of_bounds_are_refused_where_they_are_given(chain: fb.ClosedChain) -> None:
    """No start, a negative seed, half a point: each is named."""
    q, rest = [0.3, 1.2], np.zeros(chain.nv)
    figure = plots.motion(paper.default_motion(samples=5), ("a", "b"))
    for call, name in (
        (lambda: fb.assemble(chain, q, starts=0), "starts"),
        (lambda: fb.assemble(chain, q, seed=-1), "seed"),
        (lambda: fb.assemble(chain, q, starts=2.5), "starts"),
        (lambda: fb.assembly_modes(chain, q, starts=0), "starts"),
        (lambda: fb.assembly_modes(chain, q, seed="x"), "seed"),
        (lambda: fb.diagnose(chain, seed=-1), "seed"),
        (lambda: fb.balance_conditions(chain, "force", seed=-1), "seed"),
        (lambda: fb.balance_conditions(chain, "force", samples=9), "samples"),
        (lambda: fb.balance(chain, "force", seed=-1), "seed"),
        (lambda: fb.pareto(chain, "force", "added_mass", "rms_torque", 1), "n"),
        (lambda: fb.simulate(chain, rest, rest, None, [0.0, 1.0], max_steps=0), "max_steps"),
        (lambda: variations(chain, 0), "count"),
        (lambda: variations(chain, 5, seed=-1), "seed"),
        (lambda: paper.default_motion(samples=1), "samples"),
        (lambda: plots.png({"x": figure}, dpi=0), "dpi"),
    ):
        with pytest.raises(InvalidInputError, match=f"{name} = .* must be an integer"):
            call()


def test_integers_beyond_the_range_of_numbers_are_refused(chain: fb.ClosedChain) -> None:
    for call in (
        lambda: numeric("x", [HUGE]),
        lambda: fb.motion.constant([0.0, 1.0], HUGE),
        lambda: fb.motion.constant([0, HUGE], 1.0),
        lambda: fb.assemble(chain, [HUGE, 0]),
        lambda: chain.with_gravity([0, HUGE, 0]),
        lambda: paper.default_motion(period=HUGE),
        lambda: variations(chain, 3, spread=HUGE),
    ):
        with pytest.raises(InvalidInputError):
            call()


def test_more_than_the_memory_of_the_machine_is_refused(chain: fb.ClosedChain, monkeypatch: pytest.MonkeyPatch) -> None:
    """It would be given by the system, and end other programs when it is used."""
    with pytest.raises(InvalidInputError, match=r"count = 100000000000 but needs .* GB of memory.*Ask for less"):
        variations(chain, 10**11)
    monkeypatch.setattr(os, "sysconf", lambda _: 10)  # a machine of 100 bytes
    require_memory("count", 1, 100.0)
    with pytest.raises(InvalidInputError, match="Ask for less"):
        require_memory("count", 1, 101.0)


def test_a_plotting_backend_that_does_not_exist_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Matplotlib looks at the environment when it is imported, though no window is needed."""

    def refuse(name: str, *args: object) -> object:
        if name == "matplotlib.figure":
            raise ValueError("Key backend: 'nope' is not a valid value")
        return real(name, *args)

    import builtins

    real = builtins.__import__
    monkeypatch.setenv("MPLBACKEND", "nope")
    monkeypatch.setattr(builtins, "__import__", refuse)
    with pytest.raises(InvalidInputError, match=r"MPLBACKEND = 'nope' .*Unset it"):
        plots.motion(paper.default_motion(samples=5), ("a", "b"))
