"""Balancing of closed chains as one convex problem."""

from __future__ import annotations

from fivebar_pin.balancing.conditions import BalanceConditions, balance_conditions
from fivebar_pin.balancing.counterweights import MATERIALS, Counterweight, Realisation, realise
from fivebar_pin.balancing.design import Certificate, Change, Design
from fivebar_pin.balancing.front import Comparison, ParetoFront, alici_shirinzadeh, compare, pareto
from fivebar_pin.balancing.optimum import balance
from fivebar_pin.balancing.problem import BalanceProblem, balance_problem
from fivebar_pin.balancing.regions import Ball, Box, Disc, Ellipsoid
from fivebar_pin.balancing.regressors import QUANTITIES, Regressor, regressor
from fivebar_pin.balancing.scoring import Scores, score

__all__ = [
    "MATERIALS",
    "QUANTITIES",
    "BalanceConditions",
    "BalanceProblem",
    "Ball",
    "Box",
    "Certificate",
    "Change",
    "Comparison",
    "Counterweight",
    "Design",
    "Disc",
    "Ellipsoid",
    "ParetoFront",
    "Realisation",
    "Regressor",
    "Scores",
    "alici_shirinzadeh",
    "balance",
    "balance_conditions",
    "balance_problem",
    "compare",
    "pareto",
    "realise",
    "regressor",
    "score",
]
