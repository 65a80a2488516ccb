"""Random five-bars that can be assembled, and their states, for the tests of `paper`."""

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st

from fivebar_pin import paper


@st.composite
def states(draw):
    """Return (linkage, mode, q, v, a): O3 is placed first, so that the loop always closes; sizes from mm to m."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    size = 10.0 ** draw(st.floats(-2.5, 0.5))
    a1, a4, a5 = size * rng.uniform(0.1, 1.0, 3)
    psi, gamma = rng.uniform(-np.pi, np.pi, 2)
    O2, O4 = a1 * np.exp(1j * psi), a5 + a4 * np.exp(1j * gamma)
    O3 = O2 + size * complex(*rng.normal(size=2))
    b2, b3 = O3 - O2, O3 - O4
    area = ((O4 - O2).conjugate() * b2).imag
    assume(min(abs(b2), abs(b3)) > 0.05 * size and abs(area) > 0.05 * abs(b2) * abs(b3))
    mode = paper.AssemblyMode.LEFT if area > 0.0 else paper.AssemblyMode.RIGHT
    masses = 10.0 ** rng.uniform(-2, 1, 4)
    lengths = (a1, abs(b2), abs(b3), a4, a5)
    inertias = masses * np.array(lengths[:4]) ** 2 * rng.uniform(0.01, 1.0, 4)
    linkage = paper.FiveBar(lengths, masses, inertias, rng.uniform(-1.5, 1.5, 4), rng.uniform(-3.0, 3.0, 4))
    v, a = rng.uniform(-8, 8, 2), rng.uniform(-50, 50, 2)
    return linkage, mode, np.array([[psi, gamma]]), v[None], a[None], O3
