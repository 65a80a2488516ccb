"""Quantities along a motion as matrices times the inertial parameters."""

from __future__ import annotations

from fivebar_pin.balancing.regressors.regressor import MEASURES, QUANTITIES, Regressor, regressor

__all__ = ["MEASURES", "QUANTITIES", "Regressor", "regressor"]
