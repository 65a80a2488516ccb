"""The function that sweeps."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain
from fivebar_pin.engine.threads import threads_of
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.motion import Motion
from fivebar_pin.sweeps.chunk import Chunk
from fivebar_pin.sweeps.given import designs_of, posed
from fivebar_pin.sweeps.problem import Problem
from fivebar_pin.sweeps.result import Status, Sweep
from fivebar_pin.sweeps.spread import by_client, by_threads
from fivebar_pin.sweeps.store import Store

if TYPE_CHECKING:
    import os

__all__ = ["sweep"]


def sweep(
    chain: ClosedChain,
    motion: Motion,
    *,
    parameters: Mapping[str, npt.ArrayLike] | None = None,
    inertias: npt.ArrayLike | None = None,
    of: str | Iterable[str] = ("peak_torque", "rms_torque", "peak_shaking_force", "peak_shaking_moment"),
    near: npt.ArrayLike | None = None,
    about: npt.ArrayLike = (0.0, 0.0, 0.0),
    limits: Literal["check", "ignore"] = "check",
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    client: Any = None,
    store: str | os.PathLike[str] | None = None,
) -> Sweep:
    """Drive many designs of a mechanism along one motion and compute their loads.

    Every design starts on the assembly mode of the chain: its lengths are followed from those of the chain to its own
    with the loops closed. What cannot be assembled, meets a singularity or has bodies that are none is no error but a
    `Status`, and nan. Units of steps and rows are lengths of the chain, whatever those of a design.

    Args:
        chain: the mechanism that all are designs of.
        motion: of the actuated joints, the same for all.
        parameters: values (n,) of named lengths and placements (`chain.parameters`) [m or rad]; one number for all.
            Bodies follow by their rules, as in `with_parameters`.
        inertias: inertial parameters of all bodies (n, nb, 10) instead of those.
        of: what is told: "torque", "power" (of each motor), "shaking_force", "shaking_moment", "frame_force",
            "frame_moment", "q", "v", "a" along the motion (n, samples, k); with "peak_", "rms_" or "mean_square_" in
            front one number a design, vectors by their length, the peak of torques that of any motor, means of all
            together; "work": what motors give that take nothing back [J].
        near: configuration (nq,) of the chain that picks the assembly mode, see `assemble`.
        about: point (3,) of the moments [m].
        limits: whether the joint limits of the model are checked.
        threads: at most so many at once; as many as there are processors unless given. The result is the same to the
            last digit.
        progress: called with (designs done, designs in all) after every chunk.
        client: a `dask.distributed.Client`; its workers do the work instead of threads.
        store: a folder: chunks are saved there when they are done, and a second call with the same problem goes on
            from them.

    Returns:
        Status and values of every design.

    Raises:
        UnknownNameError: a parameter or quantity that there is not; lists those there are.
        InvalidInputError: arrays of the wrong shape or not finite, lengths that are not positive.
        AssemblyError, SingularityError: the chain itself cannot be assembled at the first sample.
    """
    with np.errstate(all="ignore"):
        designs = designs_of(chain, parameters, inertias)
        problem = posed(chain, motion, designs, of=of, near=near, about=about, limits=limits)
        workers = threads_of(threads)
        kept = None if store is None else Store(store, problem)
        chunks = by_threads(problem, workers, kept) if client is None else by_client(problem, client, kept)
        return _gathered(problem, chunks, progress)


def _gathered(
    problem: Problem, chunks: Iterable[tuple[slice, Chunk]], progress: Callable[[int, int], None] | None
) -> Sweep:
    """Return the chunks in one."""
    n, samples = problem.n, len(problem.motion)
    status, reached = np.zeros(n, dtype=np.int8), np.zeros(n, dtype=np.int64)
    values = {term.name: np.empty((n, *term.shape(problem.chain, samples))) for term in problem.terms}
    done = 0
    for k, chunk in chunks:
        status[k], reached[k] = chunk.status, chunk.reached
        for name, x in chunk.values.items():
            values[name][k] = x
        done += k.stop - k.start
        if progress is not None:
            progress(done, n)
    _require_numbers(status, values)
    return Sweep(status, reached, MappingProxyType(values), MappingProxyType(dict(problem.parameters)))


def _require_numbers(status: npt.NDArray[np.int8], values: Mapping[str, Array]) -> None:
    """Raise where numbers too large for it were computed with."""
    for name, x in values.items():
        bad = (status == Status.OK) & ~np.isfinite(x).all(axis=tuple(range(1, x.ndim)))
        if bad.any():
            i = int(np.argmax(bad))
            rule = "is beyond what can be computed in double precision"
            raise InvalidInputError(
                f"{name} of design {i}", "infinite", rule, "Check the units and sizes of what was given."
            )
