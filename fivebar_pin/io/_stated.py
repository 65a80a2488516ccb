"""What a file states of a mechanism, whatever its format: the tree, and what closes, drives and springs it."""

from __future__ import annotations

from dataclasses import dataclass, field

from fivebar_pin.closures import Closure
from fivebar_pin.io._entries import TreeEntry
from fivebar_pin.springs import JointSpring

__all__ = ["Stated"]


@dataclass(frozen=True, slots=True, eq=False)
class Stated:
    """A tree, and what a file states besides.

    Attributes:
        tree: links and joints; frames of the closures among the links.
        closures: loops that the file closes itself.
        motors: joints that it says are driven; none where it says nothing of motors.
        springs: on joints of the tree.
        gravity: (3,) [m/s2], or None.
        left_out: what it states and the mechanism goes without, in words.
    """

    tree: TreeEntry
    closures: tuple[Closure, ...] = ()
    motors: tuple[str, ...] = ()
    springs: tuple[JointSpring, ...] = ()
    gravity: tuple[float, ...] | None = None
    left_out: list[str] = field(default_factory=list)
