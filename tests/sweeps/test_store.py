"""Chunks in a folder: a sweep that was stopped goes on; and on the workers of a cluster."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import fivebar_pin as fb
from fivebar_pin.errors import InvalidInputError, OutputError
from fivebar_pin.sweeps import spread
from fivebar_pin.sweeps.problem import Problem
from fivebar_pin.sweeps.terms import terms_of
from tests.sweeps.test_sweep import alike, five_bar, many, motion_of

N = 600  # designs, in three chunks


def swept(**more) -> fb.sweeps.Sweep:
    asked = {"of": ("rms_torque", "peak_shaking_force"), "threads": 1} | more
    return fb.sweep(five_bar(), motion_of(five_bar(), 11), parameters=many(N), **asked)


@pytest.fixture
def runs(monkeypatch):
    """Note every chunk that is computed."""
    done: list[slice] = []
    run = spread.run

    def noted(problem, k):
        done.append(k)
        return run(problem, k)

    monkeypatch.setattr(spread, "run", noted)
    return done


def test_what_is_there_is_not_computed_again(tmp_path, runs):
    one = swept(store=tmp_path / "kept")
    assert len(runs) == 3 and len(list((tmp_path / "kept").iterdir())) == 3
    alike(one, swept(store=tmp_path / "kept"))
    assert len(runs) == 3


def test_a_sweep_that_was_stopped_goes_on(tmp_path, runs):
    def stop(done: int, n: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        swept(store=tmp_path, progress=stop)
    assert len(runs) == 1
    told: list[int] = []
    alike(swept(), swept(store=tmp_path, progress=lambda done, n: told.append(done)))
    assert len(runs) == 1 + 3 + 2 and told[-1] == N


def test_files_that_are_damaged_are_computed_again(tmp_path, runs):
    one = swept(store=tmp_path)
    first, second, third = sorted(tmp_path.iterdir())
    third.write_bytes(first.read_bytes())
    first.write_bytes(b"PK not a chunk")
    second.write_bytes(second.read_bytes()[:200])
    alike(one, swept(store=tmp_path))
    assert len(runs) == 6


def test_other_problems_lie_beside(tmp_path, runs):
    swept(store=tmp_path)
    for other in ({"of": "rms_torque"}, {"about": (0.1, 0.0, 0.0), "of": "rms_shaking_moment"}, {"limits": "ignore"}):
        before = len(runs)
        swept(store=tmp_path, **other)
        assert len(runs) == before + 3
    heavy = five_bar().with_gravity((0.0, -1.0, 0.0))
    before = len(runs)
    fb.sweep(heavy, motion_of(heavy, 11), parameters=many(N), of="rms_torque", store=tmp_path)
    assert len(runs) == before + 3


def test_a_folder_that_cannot_be_one_is_refused(tmp_path):
    (tmp_path / "file").write_text("here")
    with pytest.raises(OutputError, match="is a file"):
        swept(store=tmp_path / "file")


@pytest.fixture(scope="module")
def client():
    distributed = pytest.importorskip("distributed")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # ports in use and the like are Dask's affair
        where = {"n_workers": 2, "threads_per_worker": 1, "processes": True, "host": "127.0.0.1"}
        with (
            distributed.LocalCluster(**where, dashboard_address=None) as cluster,
            distributed.Client(cluster, timeout=60) as found,
        ):
            yield found


def test_a_cluster_finds_the_same_to_the_last_digit(client, tmp_path):
    told: list[int] = []
    one = swept()
    alike(one, swept(client=client, store=tmp_path, progress=lambda done, n: told.append(done)))
    assert told[-1] == N and len(list(tmp_path.iterdir())) == 3
    alike(one, swept(store=tmp_path))


def test_what_was_kept_is_not_sent_to_a_cluster(client, tmp_path, monkeypatch):
    one = swept(store=tmp_path)
    monkeypatch.setattr(client, "submit", None)
    alike(one, swept(store=tmp_path, client=client))


def test_something_else_than_a_client_is_refused():
    pytest.importorskip("distributed")
    with pytest.raises(InvalidInputError, match=r"client = .* must be a dask\.distributed\.Client"):
        swept(client="tcp://127.0.0.1:8786")


def test_without_dask_it_is_told_what_to_install(monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InvalidInputError, match=r"needs dask\.distributed.*pip install fivebar-pin\[cluster\]"):
        swept(client=object())


def test_designs_are_counted_in_chunks_that_fit_into_memory():
    chain = five_bar()
    long = motion_of(chain, 20_000)
    asked = (chain, np.zeros(4), long, 100, {"left": np.full(100, 0.15)}, None, terms_of("q"))
    problem = Problem(*asked, np.zeros(3), (np.zeros(4), np.zeros(4)))
    assert problem.chunk == 4 and len(problem.chunks) == 25 and problem.chunks[-1].stop == 100
