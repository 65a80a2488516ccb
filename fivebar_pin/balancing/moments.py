"""The moments of a mass distribution as affine forms of its variables, and what can be asked of them in cones.

In scaled parameters: lengths in chain lengths, masses in moving masses. The variables are the parameters themselves,
(m, h_1, h_2, I) in the plane or the ten of a body in space, then what the cones need besides.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.forms import Cones, fixed_form
from fivebar_pin.balancing.parameters import INERTIA_PAIRS
from fivebar_pin.balancing.solvers import svec

__all__ = ["FIVE_THIRDS", "SPREAD", "TWO", "Moments"]

SPREAD = 0.3  # of the anchor's unit mass, as a share of the region (of the chain's length without one) [-]
TWO, FIVE_THIRDS = 2.0, 5.0 / 3.0  # powers of the mass in the least inertia of a flat piece and of a ball [-]
_RANK = 1e-9  # eigenvalue of a body's pseudo-inertia, as a share of the largest, that counts as flat [-]


class Moments:
    """Mass m, first moments h (d,), second moments S (d, d) of one piece, as forms; d = 2 in the plane, 3 in space.

    Attributes:
        cones: the variables and what is asked of them.
        m, h, S: the forms; S is None in the plane unless asked for.
        inertia: the trace of the second moments, in the plane the polar inertia.
        spread: of the anchor, a unit mass well inside all bounds.
    """

    def __init__(self, *, planar: bool, center: Array | None, spread: float, by_direction: bool) -> None:
        """Make the variables.

        Args:
            planar: whether there are four parameters.
            center: of the anchor (d,); the origin unless given.
            spread: of the anchor.
            by_direction: whether a planar piece needs its second moments one by one.
        """
        self.planar, self.spread = planar, spread
        self.cones = Cones()
        d = 2 if planar else 3
        self.d = d
        c = np.zeros(d) if center is None else center
        S = np.outer(c, c) + spread**2 * np.eye(d)
        new = self.cones.variable
        self.m = new(1.0)
        self.h = [new(float(x)) for x in c]
        if planar:
            self.inertia = new(float(np.trace(S)))
            self.S: list[list[Array]] | None = None
            if by_direction:
                a, b = new(float(S[0, 0])), new(float(S[0, 1]))
                self.S = [[a, b], [b, self.inertia - a]]
            return
        I = np.trace(S) * np.eye(3) - S
        entry = {(i, j): new(float(I[i, j])) for i, j in INERTIA_PAIRS}
        half = 0.5 * (entry[0, 0] + entry[1, 1] + entry[2, 2])
        self.S = [[half - entry[i, i] if i == j else -entry[min(i, j), max(i, j)] for j in range(3)] for i in range(3)]
        self.inertia = half  # trace of the second moments

    def first(self, d: Array) -> Array:
        """Form d.h."""
        return np.asarray(sum((float(x) * h for x, h in zip(d, self.h, strict=True)), fixed_form(0.0)))

    def second(self, d: Array, f: Array) -> Array:
        """Form d.S f."""
        assert self.S is not None
        rows = range(self.d)
        return np.asarray(sum((float(d[i] * f[j]) * self.S[i][j] for i in rows for j in rows), fixed_form(0.0)))

    def off(self, center: Array) -> list[Array]:
        """Forms h - m c."""
        return [h - float(c) * self.m for h, c in zip(self.h, center, strict=True)]

    def inertia_about(self, c: Array) -> Array:
        """Form of the trace of the second moments about a point (d,)."""
        return np.asarray(self.inertia - 2.0 * self.first(c) + float(c @ c) * self.m)

    def pseudo_inertia(self, S: Sequence[Sequence[Array]]) -> list[list[Array]]:
        """Return [[S, h], [h^T, m]] as forms."""
        return [[*row, h] for row, h in zip(S, self.h, strict=True)] + [[*self.h, self.m]]

    def physical(self, label: str) -> None:
        """Ask for a physical body."""
        text = f"{label} is a physical body"
        if self.S is None:
            self.cones.square(text, self.h, self.m, self.inertia)
        else:
            self.cones.semidefinite(text, self.pseudo_inertia(self.S))

    def taken_from(self, label: str, present: Array) -> None:
        """Ask P and present - P to be semidefinite, within the range of a present body that is flat or a rod."""
        assert self.S is not None
        S, h = self.S, self.h
        if self.planar:
            hn, S1n, S2n = (self.cones.variable(0.0) for _ in range(3))
            S = [[*S[0], S1n], [*S[1], S2n], [S1n, S2n, self.cones.variable(self.spread**2)]]
            h = [*h, hn]
        P = [[*row, x] for row, x in zip(S, h, strict=True)] + [[*h, self.m]]
        values, V = np.linalg.eigh(present)
        keep = values > _RANK * values[-1]
        V, off = V[:, keep], V[:, ~keep]
        inside = _congruence(P, V, V)
        way = svec(
            [list(row) for row in np.diag(values[keep] / float(np.trace(present)))]
        )  # in step with the body, however flat
        self.cones.semidefinite(f"{label} is a physical body", inside, way)
        left = [
            [fixed_form(float(values[keep][i] if i == j else 0.0)) - inside[i][j] for j in range(len(inside))]
            for i in range(len(inside))
        ]
        self.cones.semidefinite(f"what is left by {label} is a physical body", left, way)
        if off.size:
            zero = [form for row in _congruence(P, off, np.eye(4)) for form in row]
            self.cones.add(f"{label} lies where the body is", "zero", zero, np.zeros(len(zero)))

    def no_denser(self, label: str, least: float) -> None:
        """Ask for at least the inertia of the most compact body of a density; `least` as in `pieces.Density`."""
        text = f"{label} is no denser than its material"
        if self.planar:
            self.own_inertia(text, least, TWO)
            return
        self._determinant(text, least)

    def _determinant(self, text: str, least: float) -> None:
        """Ask det(S_c)^(1/3) >= least m^(5/3): S - h h^T / m >= least Z D^-1 Z^T, D = diag(Z), Z lower triangular."""
        assert self.S is not None
        zero, one, anchor = fixed_form(0.0), fixed_form(1.0), min(1.0, 0.5 * self.spread**2 / least)
        new = self.cones.variable
        Z = [[new(anchor if i == j else 0.0) if j <= i else zero for j in range(3)] for i in range(3)]
        root = float(np.sqrt(least))
        top = [[*self.S[i], self.h[i], *(root * z for z in Z[i])] for i in range(3)]
        middle = [[*self.h, self.m, zero, zero, zero]]
        corner = [[Z[j][j] if i == j else zero for i in range(3)] for j in range(3)]
        bottom = [[*(root * Z[i][j] for i in range(3)), zero, *corner[j]] for j in range(3)]
        self.cones.semidefinite(text, top + middle + bottom)
        self.cones.mean(text, self.m, [Z[0][0], Z[1][1], Z[2][2], one, one, self.m, self.m, self.m])

    def own_inertia(self, text: str, least: float, power: float) -> Array:
        """Ask I_c >= least u and u >= m^power; return the form least u."""
        u = self.cones.variable(min(1.0, self.spread**2 / least))  # the anchor has I_c = 2 spread^2
        self.cones.square(text, self.h, self.m, self.inertia - least * u)
        if power == TWO:
            self.cones.square(text, self.m, u, fixed_form(1.0))
        else:
            self._five_thirds(text, u)
        return np.asarray(least * u)

    def own_second_moments(self, text: str, least: float) -> None:
        """Ask S_c >= least m^(5/3) in every direction of space."""
        assert self.S is not None
        s = self.cones.variable(min(1.0, 0.5 * self.spread**2 / least))
        less = [[self.S[i][j] - (least * s if i == j else 0.0) for j in range(3)] for i in range(3)]
        self.cones.semidefinite(text, self.pseudo_inertia(less))
        self._five_thirds(text, s)

    def _five_thirds(self, text: str, t: Array) -> None:
        """Ask m^(5/3) <= t."""
        one = fixed_form(1.0)
        self.cones.mean(text, self.m, [t, t, t, one, one, self.m, self.m, self.m])


def _congruence(P: Sequence[Sequence[Array]], U: Array, V: Array) -> list[list[Array]]:
    """Return U^T P V of a matrix of forms."""
    stacked = np.stack([np.stack(row) for row in P])
    out = np.einsum("ia,ijf,jb->abf", U, stacked, V)
    return [list(row) for row in out]
