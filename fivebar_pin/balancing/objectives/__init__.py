"""What a design is judged by; one atom a file.

    balance(chain, "force", minimise=Rms("torque"))           # or "rms_torque"
    balance(chain, "force", minimise={AddedMass(): 1.0, Peak("shaking_moment"): 0.1})
    balance(chain, "force", minimise=AddedMass() + 0.1 * Peak("shaking_moment"))

An atom is a linear function of the bodies or a length of vectors that are linear in them, or the square of one. A new
one is an `Objective` with its `word`, and is known by it once it is registered.
"""

from __future__ import annotations

from fivebar_pin.balancing.objectives.added_mass import AddedMass
from fivebar_pin.balancing.objectives.distance import DistanceMoved
from fivebar_pin.balancing.objectives.inertia import Inertia
from fivebar_pin.balancing.objectives.linear import Linear
from fivebar_pin.balancing.objectives.mean_square import MeanSquare
from fivebar_pin.balancing.objectives.objective import (
    AlongMotions,
    Designs,
    Objective,
    Weighted,
    known,
    named,
    register,
)
from fivebar_pin.balancing.objectives.peak import Peak
from fivebar_pin.balancing.objectives.rms import Rms
from fivebar_pin.balancing.objectives.term import Term

__all__ = [
    "AddedMass",
    "AlongMotions",
    "Designs",
    "DistanceMoved",
    "Inertia",
    "Linear",
    "MeanSquare",
    "Objective",
    "Peak",
    "Rms",
    "Term",
    "Weighted",
    "known",
    "named",
    "register",
]
