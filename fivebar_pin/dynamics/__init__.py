"""Constrained dynamics: torques, what shakes the frame and what it carries, reactions, accelerations, energy."""

from fivebar_pin.dynamics.energy import EnergyBalance, energy_balance
from fivebar_pin.dynamics.forward import forward_dynamics
from fivebar_pin.dynamics.inverse import inverse_dynamics
from fivebar_pin.dynamics.loads import Loads
from fivebar_pin.dynamics.reactions import Reactions
from fivebar_pin.dynamics.reduced import reduced_dynamics

__all__ = [
    "EnergyBalance",
    "Loads",
    "Reactions",
    "energy_balance",
    "forward_dynamics",
    "inverse_dynamics",
    "reduced_dynamics",
]
