"""Simulation of any closed chain: adaptive, on independent coordinates, with dry friction."""

from fivebar_pin.simulation.simulate import simulate

__all__ = [
    "simulate",
]
