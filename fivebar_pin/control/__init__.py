"""For controllers: a mechanism evaluated one sample at a time, within a loop."""

from fivebar_pin.control.evaluator import Evaluator

__all__ = ["Evaluator"]
