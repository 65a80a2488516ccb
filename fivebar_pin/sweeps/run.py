"""The function that sweeps."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, frozen, reals, require_memory
from fivebar_pin.chain import ClosedChain
from fivebar_pin.engine.threads import threads_of
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.kinematics import assemble
from fivebar_pin.kinematics.follow import require_near
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.motion import Motion
from fivebar_pin.sweeps.chunk import Chunk
from fivebar_pin.sweeps.problem import Problem
from fivebar_pin.sweeps.result import Sweep
from fivebar_pin.sweeps.spread import by_client, by_threads
from fivebar_pin.sweeps.store import Store
from fivebar_pin.sweeps.terms import terms_of

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
    values, pi, n = _designs(chain, parameters, inertias)
    terms = terms_of(of)
    if limits not in ("check", "ignore"):
        raise InvalidInputError("limits", limits, "must be 'check' or 'ignore'")
    loops = loops_of(chain)
    loops.require_determined()
    if motion.na != chain.na:
        names = ", ".join(chain.actuated)
        raise InvalidInputError("motion columns", motion.na, f"must be {chain.na}, one for each of {names}")
    require_near(loops, motion.q)
    size = sum(float(np.prod(term.shape(chain, len(motion)))) for term in terms)
    require_memory("of", [term.name for term in terms], 8.0 * n * size)
    workers, point = threads_of(threads), checked("about", about, (3,))
    q0 = assemble(chain, motion.q[0], near)
    problem = Problem(chain, frozen(q0), motion, n, values, pi, terms, point, _limits(chain, limits))
    kept = None if store is None else Store(store, problem)
    chunks = by_threads(problem, workers, kept) if client is None else by_client(problem, client, kept)
    return _gathered(problem, chunks, progress)


def _designs(
    chain: ClosedChain, parameters: Mapping[str, npt.ArrayLike] | None, inertias: npt.ArrayLike | None
) -> tuple[dict[str, Array], Array | None, int]:
    """Return parameters (n,), inertial parameters (n, nb, 10) and the number of designs."""
    if parameters is None and inertias is None:
        raise InvalidInputError("designs", None, "must be given by parameters, by inertias, or both")
    if not isinstance(parameters, Mapping | None):
        raise InvalidInputError("parameters", parameters, "must map names to arrays, as {'crank': [0.1, 0.2]}")
    values = {str(name): _values(chain, str(name), x) for name, x in (parameters or {}).items()}
    pi = None
    if inertias is not None:
        pi = _bodies(chain, inertias)
    counts = {name: x.size for name, x in values.items() if x.ndim} | ({} if pi is None else {"inertias": len(pi)})
    if len(set(counts.values())) > 1:
        raise InvalidInputError("numbers of designs", counts, "must be the same for all")
    n = next(iter(counts.values()), 1)
    return {name: frozen(np.broadcast_to(x, (n,))) for name, x in values.items()}, pi, n


def _values(chain: ClosedChain, name: str, given: npt.ArrayLike) -> Array:
    """Return the values of one parameter, (n,) or one number."""
    if name not in chain.parameters:
        raise UnknownNameError("parameter", name, chain.parameters)
    what = f"parameter {name}"
    shape: tuple[int | None, ...] = (None,) if reals(what, given).ndim else ()
    x = checked(what, given, shape)
    bad = np.flatnonzero(x <= 0.0)
    if bad.size and name in chain.geometry.lengths:
        i = int(bad[0])
        rule = "must be positive [m]: the bar would turn over"
        raise InvalidInputError(f"length {name} of design {i}", float(x.flat[i]), rule)
    return x


def _bodies(chain: ClosedChain, inertias: npt.ArrayLike) -> Array:
    """Return inertial parameters (n, nb, 10) that can be those of bodies."""
    pi = checked("inertias", inertias, (None, len(chain.joints), 10))
    bad = (pi[..., 0] < 0.0) | ((pi[..., 0] == 0.0) & pi[..., 1:4].any(axis=-1))
    if bad.any():
        i, body = (int(x) for x in np.argwhere(bad)[0])
        rule = "is no body: its mass must not be negative, and what has none has no first moment"
        raise InvalidInputError(f"inertias of design {i}, joint {chain.joints[body]}", pi[i, body].tolist(), rule)
    return pi


def _limits(chain: ClosedChain, limits: str) -> tuple[Array, Array]:
    if limits == "check":
        return frozen(chain.model.lowerPositionLimit), frozen(chain.model.upperPositionLimit)
    return frozen(np.full(chain.nq, -np.inf)), frozen(np.full(chain.nq, np.inf))


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
    return Sweep(status, reached, MappingProxyType(values), MappingProxyType(dict(problem.parameters)))
