"""Loop closures: the family of constraints that make a closed chain of an open tree, one file for each kind.

    3d           `Point`        two points coincide                              three rows
    6d           `Weld`         two frames coincide                              six rows
    revolute     `Revolute`     a hinge                                          five rows
    cylindrical  `Cylindrical`  a hinge that may slide along its axis            four rows
    distance     `Distance`     a rod without mass between two points            one row
    coupling     `Coupling`     joint coordinates tied by numbers: gears, belts  one row

`Closure(frames, kind, ...)` makes one of any kind by its word. A class that derives from `FrameClosure` (or from
`Closure`) and names its word is a kind from then on.
"""

from fivebar_pin.closures.anchored import Anchored
from fivebar_pin.closures.closure import Closure, ClosureKind
from fivebar_pin.closures.coupling import Coupling
from fivebar_pin.closures.cylindrical import Cylindrical
from fivebar_pin.closures.distance import Distance
from fivebar_pin.closures.frame_closure import FrameClosure
from fivebar_pin.closures.point import Point
from fivebar_pin.closures.revolute import Revolute
from fivebar_pin.closures.weld import Weld

__all__ = [
    "Anchored",
    "Closure",
    "ClosureKind",
    "Coupling",
    "Cylindrical",
    "Distance",
    "FrameClosure",
    "Point",
    "Revolute",
    "Weld",
]
