"""The paper's planar five-bar in closed form: parameters, dynamics, matrices, balancing, errata."""

from fivebar_pin.paper import matrices
from fivebar_pin.paper.assembly_mode import AssemblyMode
from fivebar_pin.paper.audit import audit_table_1
from fivebar_pin.paper.closed_form import solve, solve_states
from fivebar_pin.paper.compare import ComplementComparison, compare_complements
from fivebar_pin.paper.equations import Conditions, conditions
from fivebar_pin.paper.erratum import Erratum, errata
from fivebar_pin.paper.linkage import FiveBar
from fivebar_pin.paper.optimum import Optimum, balance_mass_centres, balance_masses
from fivebar_pin.paper.solution import Solution
from fivebar_pin.paper.table import default_motion, table_1
from fivebar_pin.paper.velocity_ratios import ratio_rates, ratios

__all__ = [
    "AssemblyMode",
    "ComplementComparison",
    "Conditions",
    "Erratum",
    "FiveBar",
    "Optimum",
    "Solution",
    "audit_table_1",
    "balance_mass_centres",
    "balance_masses",
    "compare_complements",
    "conditions",
    "default_motion",
    "errata",
    "matrices",
    "ratio_rates",
    "ratios",
    "solve",
    "solve_states",
    "table_1",
]
