"""Where the coordinates of a joint stand in q and in v."""

from __future__ import annotations

import pinocchio as pin

__all__ = ["q_slice", "v_slice"]


def q_slice(model: pin.Model, j: int) -> slice:
    """Return the places of joint j in a configuration (nq,)."""
    return slice(int(model.idx_qs[j]), int(model.idx_qs[j] + model.nqs[j]))


def v_slice(model: pin.Model, j: int) -> slice:
    """Return the places of joint j in a velocity (nv,)."""
    return slice(int(model.idx_vs[j]), int(model.idx_vs[j] + model.nvs[j]))
