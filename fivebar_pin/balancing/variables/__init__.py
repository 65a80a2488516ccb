"""What the optimiser may change; one file each.

A `Variable` is what the user says; on a mechanism it has `Part`s: a few variables each, what they do to the ten
parameters of the bodies, and the cones that they lie in. `balance` does not know which there are: `mode` is the word
that a class is registered under, and `variables` takes any.
"""

from __future__ import annotations

from fivebar_pin.balancing.variables.added import AddedMaterial
from fivebar_pin.balancing.variables.part import Made, Part
from fivebar_pin.balancing.variables.redesigned import RedesignedBodies
from fivebar_pin.balancing.variables.removed import RemovedMaterial
from fivebar_pin.balancing.variables.variable import MODES, Stated, Variable, register

__all__ = [
    "MODES",
    "AddedMaterial",
    "Made",
    "Part",
    "RedesignedBodies",
    "RemovedMaterial",
    "Stated",
    "Variable",
    "register",
]
