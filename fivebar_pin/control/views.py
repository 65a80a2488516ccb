"""Where results and what is asked for stand in the memory of an evaluator."""

from __future__ import annotations

from fivebar_pin._arrays import Array
from fivebar_pin.engine import single
from fivebar_pin.engine.tables import (
    A_HERE,
    CONSTANTS,
    N_HERE,
    NA,
    NQ,
    NV,
    Q_HERE,
    SHAKING,
    TARGET,
    TAU,
    TO,
    TO_A,
    TO_V,
    V_HERE,
    Integers,
)  # fmt: skip

__all__ = ["asked", "results"]


def results(I: Integers, W: Array) -> dict[str, Array]:
    """Return read-only views of the results, by name."""
    nq, nv, na = (int(I[k]) for k in (NQ, NV, NA))
    s = I.size - single.RECORD_SIZE
    frame, gap, bias, inertia = (int(I[s + k]) for k in (single.FRAME, single.GAP, single.BIAS, single.INERTIA))
    shaking = int(I[SHAKING])
    found = {
        "q": _view(W, I[Q_HERE], nq),
        "v": _view(W, I[V_HERE], nv),
        "a": _view(W, I[A_HERE], nv),
        "N": _view(W, I[N_HERE], nv, na),
        "residual": _view(W, gap, 1).reshape(()),
        "q_actuated": _view(W, I[TARGET], na),
        "v_actuated": _view(W, I[TO_V], na),
        "a_actuated": _view(W, I[TO_A], na),
        "torque": _view(W, I[TAU], na),
        "bias": _view(W, bias, na),
        "mass_matrix": _view(W, inertia, na, na),
        "shaking_force": _view(W, shaking, 3),
        "shaking_moment": _view(W, shaking + 3, 3),
        "frame_force": _view(W, frame, 3),
        "frame_moment": _view(W, frame + 3, 3),
    }
    for view in found.values():
        view.setflags(write=False)
    return found


def asked(I: Integers, W: Array) -> dict[str, Array]:
    """Return views of what is asked for, of all that changes with a sample, and of its copy from after the last one."""
    na, before = int(I[NA]), int(I[I.size - single.RECORD_SIZE + single.BEFORE])
    return {
        "_q": _view(W, I[Q_HERE], int(I[NQ])),
        "_x": _view(W, I[TO], na),
        "_v": _view(W, I[TO_V], na),
        "_third": _view(W, I[I.size - single.RECORD_SIZE + single.GIVEN], na),
        "_now": W[I[CONSTANTS] : before],
        "_then": W[before:],
    }


def _view(W: Array, at: int, *shape: int) -> Array:
    """Return numbers from a place on, the same memory."""
    count = shape[0] * shape[1] if len(shape) > 1 else shape[0]
    return W[int(at) : int(at) + count].reshape(shape)
