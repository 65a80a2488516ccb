"""What the joints lose: viscous damping and dry friction."""

from __future__ import annotations

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain

__all__ = ["friction_torque"]


def friction_torque(chain: ClosedChain, v: Array) -> Array:
    """Return the torque that viscous damping and dry friction take from the joints (n, nv): b v + f sign(v)."""
    b, f = np.array(chain.model.damping), np.array(chain.model.upperDryFrictionLimit)
    return np.asarray(b * v + f * np.sign(v))
