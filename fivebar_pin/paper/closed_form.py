"""The closed-form road: the whole inverse dynamics of the five-bar, sample by sample.

Forces f_ij are those of link i on link j (link 0 is the frame), so that (22b) reads f_{i-1,i} - f_{i,i+1} + m_i g =
m_i c_i''. With p_i = m_i (c_i'' - g) and n_i the rate of angular momentum of link i about its joint in the tree, the
moments of link 2 about O2 and of link 3 about O4 give f23 alone; the others follow link by link. No system of
equations is solved. All planar vectors are complex numbers inside and pairs of numbers outside.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, frozen, require_finite
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.motion import Motion
from fivebar_pin.paper.assembly_mode import AssemblyMode
from fivebar_pin.paper.linkage import FiveBar
from fivebar_pin.paper.path import check_path
from fivebar_pin.paper.positions import close, in_rows
from fivebar_pin.paper.solution import Solution

__all__ = ["solve", "solve_states"]


def solve(
    linkage: FiveBar,
    motion: Motion,
    *,
    mode: AssemblyMode = AssemblyMode.LEFT,
    gravity: npt.ArrayLike = (0.0, 0.0, 0.0),
) -> Solution:
    """Return the motion of all links and every force that it takes.

    Args:
        linkage: the linkage.
        motion: of psi and gamma; na = 2.
        mode: assembly mode, kept throughout.
        gravity: (3,) [m/s2]; the paper's linkage moves without.

    Raises:
        AssemblyError: the loop cannot be closed at some sample (which one, and by how much).
        SingularityError: O2, O3, O4 on a line at a sample, or between two of them.
        InvalidInputError: the motion does not have two columns.
    """
    if motion.na != 2:
        raise InvalidInputError("shape of motion.q", motion.q.shape, "must be (n, 2): psi and gamma")
    driven = motion.q, motion.v, motion.a
    return _solve(linkage, motion.t, driven, AssemblyMode.parse(mode), gravity, motion.t)


def solve_states(
    linkage: FiveBar,
    q: npt.ArrayLike,
    v: npt.ArrayLike,
    a: npt.ArrayLike,
    *,
    mode: AssemblyMode = AssemblyMode.LEFT,
    gravity: npt.ArrayLike = (0.0, 0.0, 0.0),
) -> Solution:
    """Return the same as `solve` for unrelated states: q, v, a (n, 2) of psi and gamma; t counts the samples."""
    x = checked("q", q, (None, 2))
    y, z = checked("v", v, x.shape), checked("a", a, x.shape)
    t = frozen(np.arange(len(x)))
    return _solve(linkage, t, (x, y, z), AssemblyMode.parse(mode), gravity, None)


def _solve(
    linkage: FiveBar,
    t: Array,
    driven: tuple[Array, Array, Array],
    mode: AssemblyMode,
    gravity: npt.ArrayLike,
    times: Array | None,
) -> Solution:
    """Solve a motion along its times, or unrelated states."""
    from fivebar_pin.paper.kernels import Linkage, Loads, Movement, load, move, unwind

    g, n = checked("gravity", gravity, (3,)), t.size
    q, v, a = given = in_rows(driven[0]), in_rows(driven[1]), in_rows(driven[2])
    moved, loads = Movement.empty(n), Loads.empty(n)
    with np.errstate(all="ignore"):  # numbers that are none are refused below
        b, triangle, passive = close(linkage.lengths, q, mode=mode, times=times)
        if times is not None:
            check_path(linkage, times, given, triangle)
            unwind(passive)
        move(b, triangle, passive, q, v, a, moved)
        parameters = Linkage(linkage.lengths, linkage.masses, linkage.inertias, linkage.rho, linkage.alpha)
        total = load(parameters, g, b, triangle, moved.rates, moved.accelerations, loads)
    forces = loads.joint_forces.view(np.float64).reshape(n, 5, 2)
    solution = Solution(linkage, mode, t, *moved, loads.torque, forces, *loads[2:])
    if not math.isfinite(total):
        require_finite("solution", solution)
    return solution
