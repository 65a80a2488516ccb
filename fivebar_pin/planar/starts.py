"""Linkage files to start from, with the comments that a first reader needs."""

from __future__ import annotations

from fivebar_pin.errors import UnknownNameError

__all__ = ["STARTS", "start_text"]

_FOUR_BAR = """\
# A four-bar linkage. Change the numbers and names, add bars; then look at it again with `fivebar-pin check`.
linkage: my_four_bar
# gravity: [0, -9.81]       # in the plane [m/s2]; [0, 0, -9.81] for a linkage that lies flat

# A sketch: where the points lie in one position, x and y [m]. All lengths come from it, unless a bar states its own:
# then the sketch may be a rough one.
points:
  A: [0, 0]
  B: [0.4, 0]
  C: [0.05, 0.087]
  D: [0.33, 0.29]
  P: [0.2, 0.28]            # a point of one bar alone is a tracer

ground: [A, B]              # points that do not move

# Bars by the points that they join; bars that share a point are pinned together there. Uniform bars of aluminium,
# 20 x 10 mm, unless something else is said.
bars:
  crank: {points: [A, C], length: 0.1}                  # the length [m] wins over the sketch
  coupler: {points: [C, D, P], density: 2700, width: 0.02, thickness: 0.01}      # [kg/m3, m, m]
  rocker: [B, D]

# plates:                   # the polygon through three or more points
#   coupler: {points: [C, D, P], density: 2700, thickness: 0.01}
# masses:                   # beside what the bars are made of [kg]
#   - {bar: coupler, at: P, mass: 0.2}
# springs:                  # between points [N/m, m]
#   - {between: [P, B], stiffness: 100, length: 0.1}

motors: [crank at A]        # as many as the linkage has degrees of freedom
"""

_FIVE_BAR = """\
# A five-bar linkage: two cranks on the ground carry the point P anywhere in the plane.
linkage: my_five_bar
gravity: [0, 0, -9.81]      # it lies flat [m/s2]

points:                     # a sketch, x and y [m]
  A: [0, 0]
  B: [0.2, 0]
  C: [-0.06, 0.14]
  D: [0.26, 0.14]
  P: [0.1, 0.28]

ground: [A, B]

bars:                       # by the points that they join; bars that share a point are pinned together there
  left: [A, C]
  left_rod: {points: [C, P], width: 0.015}
  right: [B, D]
  right_rod: {points: [D, P], width: 0.015}

masses:                     # the tool [kg]
  - {bar: left_rod, at: P, mass: 0.1}

motors: [left at A, right at B]
"""

_SIX_BAR = """\
# A Watt six-bar: a four-bar whose coupler and rocker each carry one more bar.
linkage: my_six_bar

points:                     # a sketch, x and y [m]
  A: [0, 0]
  B: [0.4, 0]
  C: [0.05, 0.09]
  D: [0.36, 0.3]
  E: [0.2, 0.28]
  F: [0.52, 0.2]
  G: [0.4, 0.42]

ground: [A, B]

bars:                       # by the points that they join; three points make a ternary link
  crank: [A, C]
  coupler: [C, D, E]
  rocker: [B, D, F]
  strut: [E, G]
  output: [F, G]

motors: [crank at A]
"""

_SLIDER_CRANK = """\
# A slider-crank. The slider runs along x, 0.02 m above the crank's pivot.
linkage: my_slider_crank

points:                     # a sketch, x and y [m]
  A: [0, 0]
  C: [0.05, 0.087]
  B: [0.34, 0.02]

ground: [A]

bars:                       # lengths that are stated win over the sketch [m]
  crank: {points: [A, C], length: 0.1}
  rod: {points: [C, B], length: 0.3}

slides:                     # a block with points of its own on a line: of the ground, or on: another bar
  slider: {points: [B], through: [0, 0.02], angle: 0 deg, mass: 0.2}

motors: [crank at A]
"""

STARTS = {"five-bar": _FIVE_BAR, "four-bar": _FOUR_BAR, "six-bar": _SIX_BAR, "slider-crank": _SLIDER_CRANK}
"""Texts of linkage files by the name of the kind."""


def start_text(kind: str) -> str:
    """Return the text of a file to start from.

    Raises:
        UnknownNameError: there is none of this kind; lists those there are.
    """
    if kind not in STARTS:
        raise UnknownNameError("kind of linkage", kind, STARTS)
    return STARTS[kind]
