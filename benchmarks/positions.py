"""Positions in closed form, written for each mechanism by hand: actuated coordinates to a configuration.

Two bars that meet in a knee are an intersection of circles; all planar mechanisms here but one are a row of them. The
3-RRR has no closed form (its platform is a root of a polynomial of degree six). Lengths are read off the model once,
and the sides of the knees off an assembled configuration.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Sequence

import numpy as np

import fivebar_pin as fb

Position = Callable[[Sequence[float]], Sequence[float]]
"""From the actuated coordinates (na,) to the configuration (nq,)."""


def closed_form(chain: fb.ClosedChain, q0: np.ndarray) -> Position | None:
    """Return the closed form of a mechanism that ships, on the assembly mode of q0; None where there is none."""
    for word, make in FORMS.items():
        if word in chain.name:
            return make(chain, dict(zip(chain.joints, q0, strict=True)))
    return None


def knee(start: complex, end: complex, first: float, second: float, side: float) -> complex:
    """Return where two bars from `start` and `end` meet, left (+1) or right (-1) of the ray between them [m]."""
    ray = end - start
    d2 = ray.real * ray.real + ray.imag * ray.imag
    x = 0.5 + 0.5 * (first * first - second * second) / d2
    return start + ray * complex(x, side * math.sqrt(first * first / d2 - x * x))


def side_of(start: complex, end: complex, at: complex) -> float:
    """Return on which side of a ray a point lies, +1 for left."""
    return math.copysign(1.0, ((end - start).conjugate() * (at - start)).imag)


def _joint(chain: fb.ClosedChain, name: str) -> complex:
    """Return where a joint stands on its parent's link."""
    x, y, _ = chain.model.jointPlacements[chain.model.getJointId(name)].translation
    return complex(x, y)


def _frame(chain: fb.ClosedChain, name: str) -> complex:
    """Return where a point stands on its joint's link."""
    x, y, _ = chain.model.frames[chain.model.getFrameId(name)].placement.translation
    return complex(x, y)


def _five_bar(chain, home):
    a1, a4, pivot = _joint(chain, "theta_psi").real, _joint(chain, "phi_gamma").real, _joint(chain, "gamma")
    a2, a3 = _frame(chain, "O3_link2").real, _frame(chain, "O3_link3").real
    rect, phase = cmath.rect, cmath.phase
    elbows = rect(a1, home["psi"]), pivot + rect(a4, home["gamma"])
    side = side_of(*elbows, elbows[0] + rect(a2, home["psi"] + home["theta_psi"]))

    def position(x):
        psi, gamma = x
        start, end = rect(a1, psi), pivot + rect(a4, gamma)
        at = knee(start, end, a2, a3, side)
        return gamma, phase(at - end) - gamma, psi, phase(at - start) - psi

    return position


def _four_bar(chain, home):
    a, pivot = _joint(chain, "coupler").real, _joint(chain, "rocker")
    b, c = _frame(chain, "B_coupler").real, _frame(chain, "B_rocker").real
    rect, phase = cmath.rect, cmath.phase
    side = side_of(rect(a, home["crank"]), pivot, pivot + rect(c, home["rocker"]))

    def position(x):
        crank = x[0]
        start = rect(a, crank)
        at = knee(start, pivot, b, c, side)
        return crank, phase(at - start) - crank, phase(at - pivot)

    return position


def _slider_crank(chain, home):
    crank, rod, offset = _joint(chain, "rod").real, _frame(chain, "B_rod").real, _joint(chain, "slider").imag
    side = math.copysign(1.0, math.cos(home["crank"] + home["rod"]))

    def position(x):
        start = cmath.rect(crank, x[0])
        drop = offset - start.imag
        along = side * math.sqrt(rod * rod - drop * drop)
        return x[0], math.atan2(drop, along) - x[0], start.real + along

    return position


def _six_bar(chain, home):
    """A crank's four-bar, then a dyad from the coupler's third point to the output, which the rocker may carry."""
    first = _four_bar(chain, home)
    a, carried = _joint(chain, "coupler").real, chain.model.parents[chain.model.getJointId("output")] != 0
    corner, foot, pivot = _joint(chain, "strut"), _joint(chain, "output"), _joint(chain, "rocker")
    strut, output = _frame(chain, "G_strut").real, _frame(chain, "G_output").real
    rect, phase = cmath.rect, cmath.phase

    def ends(crank, coupler, rocker):
        start = rect(a, crank) + corner * rect(1.0, crank + coupler)
        return start, pivot + foot * rect(1.0, rocker) if carried else foot

    start, end = ends(home["crank"], home["coupler"], home["rocker"])
    side = side_of(start, end, start + rect(strut, home["crank"] + home["coupler"] + home["strut"]))

    def position(x):
        crank, coupler, rocker = first(x)
        start, end = ends(crank, coupler, rocker)
        at = knee(start, end, strut, output, side)
        swing, last = phase(at - start) - crank - coupler, phase(at - end)
        if carried:
            return crank, coupler, swing, rocker, last - rocker
        return crank, coupler, swing, last, rocker

    return position


def _rssr(chain, home):
    """|base + rocker (c x + s y) - ball| = rod is A c + B s = C in the rocker's angle."""
    model = chain.model
    placement = model.jointPlacements[model.getJointId("rocker")]
    crank, rod, rocker = _joint(chain, "rod_y").real, _frame(chain, "B_rod").real, _frame(chain, "B_rocker").real
    (x0, y0, z0), R = placement.translation.tolist(), placement.rotation.tolist()
    (xx, xy), (yx, yy), (zx, zy) = (row[:2] for row in R)

    def gap_of(angle):
        c, s = math.cos(angle), math.sin(angle)
        gx, gy = x0 - crank * c, y0 - crank * s
        A, B = gx * xx + gy * yx + z0 * zx, gx * xy + gy * yy + z0 * zy
        C = 0.5 * (rod * rod - rocker * rocker - gx * gx - gy * gy - z0 * z0) / rocker
        return c, s, gx, gy, math.atan2(B, A), math.acos(C / math.hypot(A, B))

    side = math.copysign(1.0, math.sin(home["rocker"] - gap_of(home["crank"])[4]))

    def position(x):
        c, s, gx, gy, middle, half = gap_of(x[0])
        swing = middle + side * half
        u, w = rocker * math.cos(swing), rocker * math.sin(swing)
        dx, dy, dz = gx + u * xx + w * xy, gy + u * yx + w * yy, z0 + u * zx + w * zy
        along, up = c * dx + s * dy, c * dy - s * dx
        return x[0], math.atan2(-dz, along), math.asin(up / rod), swing

    return position


def _delta(chain, home):
    """The platform's centre is where three spheres of the rods' length meet."""
    model, rod = chain.model, _frame(chain, "P1_rod").real
    arm, plate = _joint(chain, "rod_1_swing").real, abs(_frame(chain, "P1_platform"))
    base = abs(_joint(chain, "arm_1")) - plate
    outwards = [model.jointPlacements[model.getJointId(f"arm_{k}")].rotation[:, 0].tolist() for k in (1, 2, 3)]
    down = math.copysign(1.0, -home["slide_z"])

    def position(x):
        reach = [(base + arm * math.cos(a), -arm * math.sin(a)) for a in x]
        centres = [(r * ox, r * oy, z) for (r, z), (ox, oy, _) in zip(reach, outwards, strict=True)]
        px, py, pz = _three_spheres(*centres, rod, down)
        q = []
        for a, (r, z), (ox, oy, _) in zip(x, reach, outwards, strict=True):
            out, aside = px * ox + py * oy - r, py * ox - px * oy
            q += [a, math.atan2(z - pz, out) - a, -math.asin(aside / rod)]
        return (*q, px, py, pz)

    return position


def _three_spheres(c1, c2, c3, radius, down):
    """Return the point at one distance from three, below (+1) or above (-1) the plane that they turn round in."""
    (x, y, z), (x2, y2, z2), (x3, y3, z3) = c1, c2, c3
    bx, by, bz, cx, cy, cz = x2 - x, y2 - y, z2 - z, x3 - x, y3 - y, z3 - z
    nx, ny, nz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    bb, cc, bc = bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz, bx * cx + by * cy + bz * cz
    nn = nx * nx + ny * ny + nz * nz
    u, w = 0.5 * (bb - bc) * cc / nn, 0.5 * (cc - bc) * bb / nn
    fx, fy, fz = u * bx + w * cx, u * by + w * cy, u * bz + w * cz
    h = -down * math.sqrt((radius * radius - fx * fx - fy * fy - fz * fz) / nn)
    return x + fx + h * nx, y + fy + h * ny, z + fz + h * nz


FORMS = {
    "five_bar": _five_bar,
    "four_bar": _four_bar,
    "slider_crank": _slider_crank,
    "six_bar": _six_bar,
    "rssr": _rssr,
    "delta": _delta,
}
"""Closed forms by a word of the mechanism's name."""
