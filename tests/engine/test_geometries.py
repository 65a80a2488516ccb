"""Four-bars and five-bars of any lengths: what is followed is what elementary geometry finds, in either mode."""

from __future__ import annotations

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from mechanisms import five_bar, four_bar
from sampled import Driven

from fivebar_pin.engine.tables import BLOCKED, FOLLOWED

LENGTH = st.floats(0.2, 3.0)
ANGLE = st.floats(-np.pi, np.pi)
CLEAR = 0.05
"""Least sine of the angle between the two links that close [-]."""
SAMPLES = 200

few = settings(max_examples=60, deadline=None, derandomize=True)


def closing(A: np.ndarray, B: np.ndarray, b: float, c: float, mode: int) -> tuple[np.ndarray, ...]:
    """Return directions of links b from A and c from B (complex) to where they meet, and the sine between them."""
    d = B - A
    r = np.abs(d)
    along = (r**2 + b**2 - c**2) / (2.0 * r)
    height = np.sqrt(np.maximum(b**2 - along**2, 0.0))
    meet = A + d / r * (along + 1j * mode * height)
    return np.angle(meet - A), np.angle(meet - B), (b**2 - along**2) * r**2 / (b * c) ** 2


def check(chain, x: np.ndarray, q: np.ndarray, sine2: np.ndarray) -> None:
    """Drive along x and compare with q (n, nq), as far as the links that close are not straight."""
    assume(sine2[0] > CLEAR**2)
    clear = np.append(sine2 > CLEAR**2, False)
    n = int(np.argmin(clear))
    d = Driven(chain, x, q[0])
    assert d.done >= n
    np.testing.assert_allclose(np.exp(1j * d.q[:n]), np.exp(1j * q[:n]), rtol=0.0, atol=1e-11)
    for k in (n - 1, n // 2):  # the same in one step, where all of the line is clear
        if k > 0 and np.all(np.abs(np.diff(x[:k], 2, axis=0)) < 1e-12):
            one = Driven(chain, x[[0, k]], q[0])
            assert one.status == FOLLOWED
            np.testing.assert_allclose(one.q[1], d.q[k], rtol=0.0, atol=1e-9)
    if np.any(sine2 < 0.0):
        assert d.status == BLOCKED and d.done <= int(np.argmax(sine2 < 0.0))


@few
@given(a=LENGTH, b=LENGTH, c=LENGTH, d=LENGTH, start=ANGLE, way=st.floats(-7.0, 7.0), mode=st.sampled_from([-1, 1]))
def test_four_bars(a, b, c, d, start, way, mode):
    crank = np.linspace(start, start + way, SAMPLES)
    assume(np.abs(a * np.exp(1j * crank) - d).min() > 1e-3)
    beta, gamma, sine2 = closing(a * np.exp(1j * crank), np.full(SAMPLES, d + 0j), b, c, mode)
    check(four_bar((a, b, c, d)), crank[:, None], np.column_stack([crank, beta - crank, gamma]), sine2)


@few
@given(
    lengths=st.tuples(*[LENGTH] * 5),
    start=st.tuples(ANGLE, ANGLE),
    way=st.tuples(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0)),
    mode=st.sampled_from([-1, 1]),
    kind=st.sampled_from(["3d", "revolute"]),
)
def test_five_bars(lengths, start, way, mode, kind):
    a1, a2, a3, a4, a5 = lengths
    x = np.array(start) + np.linspace(0.0, 1.0, SAMPLES)[:, None] * np.array(way)
    left, right = a1 * np.exp(1j * x[:, 0]), a5 + a4 * np.exp(1j * x[:, 1])
    assume(np.abs(left - right).min() > 1e-3)
    beta, gamma, sine2 = closing(left, right, a2, a3, mode)
    q = np.column_stack([x[:, 0], beta - x[:, 0], x[:, 1], gamma - x[:, 1]])
    check(five_bar(lengths, kind=kind), x, q, sine2)
