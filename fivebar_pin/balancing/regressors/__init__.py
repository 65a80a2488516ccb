"""Quantities along a motion as matrices times the inertial parameters."""

from __future__ import annotations

from fivebar_pin.balancing.regressors.regressor import QUANTITIES, Regressor, regressor

__all__ = ["QUANTITIES", "Regressor", "regressor"]
