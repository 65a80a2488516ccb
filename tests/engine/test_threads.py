"""Many threads on one chain: each has memory of its own, and finds what one alone finds, to the last digit."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from mechanisms import five_bar
from sampled import Driven
from test_following import swing
from test_newton import shipped

import fivebar_pin as fb
from fivebar_pin.mechanism.prepared import prepared_of

THREADS, TASKS = 8, 40


@pytest.mark.parametrize("name", ["five_bar_case_I", "delta", "six_bar_watt"])
def test_threads_find_what_one_alone_finds(name):
    """Motions of different lengths that all threads take at once, so that each memory sees another history."""
    chain, q = shipped(name)
    motions = [swing(chain, q, 20 + 7 * k, 0.02 * (1 + k % 9)) for k in range(TASKS)]
    begin = threading.Barrier(THREADS, timeout=30.0)
    ready = threading.local()

    def driven(k: int) -> Driven:
        if not hasattr(ready, "begun"):
            ready.begun = begin.wait()
        x, v, a = motions[k]
        return Driven(chain, x, q, v=v, a=a, W=prepared_of(chain).memory())

    with ThreadPoolExecutor(THREADS) as pool:
        together = list(pool.map(driven, range(TASKS)))
    alone = [Driven(chain, x, q, v=v, a=a) for x, v, a in motions]
    for one, other in zip(together, alone, strict=True):
        assert one.done == other.done
        for name in ("q", "v", "a", "N", "gap"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_every_thread_has_memory_of_its_own():
    chain = five_bar()
    begin = threading.Barrier(THREADS, timeout=30.0)

    def memory(_: int) -> np.ndarray:
        begin.wait()
        W = prepared_of(chain).memory()
        assert W is prepared_of(chain).memory()
        return W

    with ThreadPoolExecutor(THREADS) as pool:
        found = list(pool.map(memory, range(THREADS)))
    assert len({W.__array_interface__["data"][0] for W in found}) == THREADS


def test_memory_goes_with_its_chain():
    """A chain that is prepared anew has other memory; the old one is let go of with its chain."""
    first, second = five_bar(), five_bar((0.5, 1.2, 1.0, 0.6, 0.8))
    W = prepared_of(first).memory()
    assert prepared_of(second).memory() is not W
    assert not np.array_equal(prepared_of(second).W, prepared_of(first).W)
    q = fb.assemble(first, [2.0, 1.0])
    assert Driven(first, [[2.0, 1.0]], q, W=W).done == 1
