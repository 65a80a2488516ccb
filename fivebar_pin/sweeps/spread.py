"""Who does the work: threads of this process, or the workers of a cluster."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from fivebar_pin.errors import InvalidInputError
from fivebar_pin.sweeps.chunk import Chunk, run
from fivebar_pin.sweeps.problem import Problem
from fivebar_pin.sweeps.store import Store

__all__ = ["by_client", "by_threads"]

_AHEAD = 4  # chunks in the hands of every worker of a cluster, so that none waits


def by_threads(problem: Problem, threads: int, store: Store | None) -> Iterator[tuple[slice, Chunk]]:
    """Yield the chunks in order as they are done, by so many threads."""
    problem.tables  # noqa: B018  made once, before threads ask for them

    def work(k: slice) -> Chunk:
        found = None if store is None else store.read(k)
        if found is None:
            found = run(problem, k)
            if store is not None:
                store.write(k, found)
        return found

    if threads == 1 or len(problem.chunks) <= 1:
        yield from ((k, work(k)) for k in problem.chunks)
        return
    with ThreadPoolExecutor(min(threads, len(problem.chunks))) as pool:
        try:
            waiting = [(k, pool.submit(work, k)) for k in problem.chunks]
            while waiting:
                k, future = waiting.pop(0)
                yield k, future.result()
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def by_client(problem: Problem, client: Any, store: Store | None) -> Iterator[tuple[slice, Chunk]]:
    """Yield the chunks as they are done, by the workers of a `dask.distributed.Client`."""
    try:
        from distributed import Client, as_completed
    except ImportError as error:
        way = "Install Dask: pip install fivebar-pin[cluster]"
        raise InvalidInputError("client", client, "needs dask.distributed, which is not there", way) from error
    if not isinstance(client, Client):
        raise InvalidInputError("client", client, "must be a dask.distributed.Client")
    todo: list[slice] = []
    for k in problem.chunks:
        found = None if store is None else store.read(k)
        if found is None:
            todo.append(k)
        else:
            yield k, found
    given = client.scatter(problem, broadcast=True, hash=False)
    ahead = _AHEAD * max(1, sum(client.nthreads().values()))
    asked = {client.submit(run, given, k, pure=False): k for k in todo[:ahead]}
    rest = iter(todo[ahead:])
    done = as_completed(list(asked))
    for future in done:
        k, chunk = asked.pop(future), future.result()
        future.release()
        more = next(rest, None)
        if more is not None:
            further = client.submit(run, given, more, pure=False)
            asked[further] = more
            done.add(further)
        if store is not None:
            store.write(k, chunk)
        yield k, chunk
