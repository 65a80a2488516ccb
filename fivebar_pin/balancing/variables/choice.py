"""What may change, from the words of `balance`."""

from __future__ import annotations

from collections.abc import Sequence

from fivebar_pin.balancing.variables.removed import RemovedMaterial
from fivebar_pin.balancing.variables.variable import MODES, Stated, Variable
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["aim_of", "chosen"]

_WORD = "variables"  # the mode of a design whose variables were said in full


def aim_of(mode: str, variables: Sequence[Variable]) -> str:
    """Return what is minimised unless said otherwise.

    Raises:
        UnknownNameError: a mode that does not exist.
        InvalidInputError: variables that are none.
    """
    if mode not in MODES:
        raise UnknownNameError("mode", mode, MODES)
    return _checked(variables)[0].aim if variables else MODES[mode].aim


def _checked(variables: Sequence[Variable]) -> tuple[Variable, ...]:
    if isinstance(variables, Variable) or not all(isinstance(v, Variable) for v in variables):
        raise InvalidInputError("variables", variables, "must be a sequence of variables")
    return tuple(variables)


def chosen(mode: str, stated: Stated, variables: Sequence[Variable]) -> tuple[str, tuple[Variable, ...]]:
    """Return what may change, and the word for it.

    Raises:
        UnknownNameError: a mode that does not exist.
        InvalidInputError: variables said in full, and bodies besides.
    """
    if mode not in MODES:
        raise UnknownNameError("mode", mode, MODES)
    if not variables:
        removed = (RemovedMaterial(stated.remove, stated.region, stated.density),) if stated.remove else ()
        return mode, (MODES[mode].of(stated), *removed)
    besides = (stated.bodies, stated.region, stated.masses, stated.counterweight, stated.remove or None)
    if any(given is not None for given in besides):
        rule = "must say all that may change: bodies, region, masses, counterweight and remove have no meaning besides"
        raise InvalidInputError("variables", list(variables), rule)
    return _WORD, _checked(variables)
