"""Linear systems of any shape as mechanisms: hinges and slides on the ground, tied by couplings."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from mechanisms import add, at, body

import fivebar_pin as fb
from fivebar_pin.closures import Coupling


def coupled(ratios: np.ndarray, motors: int) -> fb.ClosedChain:
    """Return a chain whose closure rows are these ratios (rows, columns), before they are scaled.

    The last columns belong to the motors. Every third joint is a slide, so that units differ.
    """
    model = pin.Model()
    names = [f"x{k}" for k in range(ratios.shape[1])]
    for k, name in enumerate(names):
        joint = pin.JointModelPX() if k % 3 == 2 else pin.JointModelRZ()
        add(model, 0, joint, at(2.0 * k, 0.3 * (k % 2), 0.1), name, body(k))
    rows = [
        Coupling({name: c for name, c in zip(names, row, strict=True) if c != 0.0}, name=f"row{i}")
        for i, row in enumerate(ratios)
    ]
    return fb.ClosedChain(model, rows, tuple(names[len(names) - motors :]))


def random_ratios(rng: np.random.Generator, rows: int, columns: int, rank: int) -> np.ndarray:
    """Return a matrix of this rank without zeros."""
    return rng.normal(size=(rows, rank)) @ rng.normal(size=(rank, columns)) / np.sqrt(rank)
