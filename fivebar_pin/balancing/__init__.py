"""Balancing of closed chains as one convex problem."""

from __future__ import annotations

from fivebar_pin.balancing.conditions import BalanceConditions, balance_conditions
from fivebar_pin.balancing.regressors import QUANTITIES, Regressor, regressor

__all__ = ["QUANTITIES", "BalanceConditions", "Regressor", "balance_conditions", "regressor"]
