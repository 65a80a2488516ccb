"""Compiling the engine, said once: the first use on a machine takes longer than all later ones."""

from __future__ import annotations

from pathlib import Path

__all__ = ["compile_once"]


def compile_once() -> None:
    """Compile what nearly every command uses, with a line that says so, unless it was compiled before."""
    from fivebar_pin import engine
    from fivebar_pin._files.kept_code import kept_code
    from fivebar_pin.cli import _tables

    place = kept_code((Path(engine.__file__).parent,))
    if place is not None and any(place.rglob("*.nbi")):
        return
    kept = "kept for the next time" if place is not None else "no folder can be written, so that nothing is kept"
    with _tables.progress().status(f"compiling the engine, which takes some twenty seconds ({kept})"):
        _use()


def _use() -> None:
    import numpy as np

    import fivebar_pin as fb

    chain, still = fb.load("four_bar_crank_rocker"), np.zeros((2, 1))
    motion = fb.Motion(np.array([0.0, 1.0]), np.array([[0.7], [0.8]]), still, still)
    fb.drive(chain, motion, fb.drive(chain, motion).q[0])
