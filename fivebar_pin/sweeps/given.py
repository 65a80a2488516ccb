"""What a sweep is given, looked at."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, frozen, reals, require_memory
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.kinematics import assemble
from fivebar_pin.kinematics.follow import require_near
from fivebar_pin.mechanism.idle import at_rest
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.motion import Motion
from fivebar_pin.sweeps.problem import Problem
from fivebar_pin.sweeps.terms import terms_of

__all__ = ["Designs", "designs_of", "posed"]

Designs = tuple[dict[str, Array], Array | None, int]


def posed(
    chain: ClosedChain,
    motion: Motion,
    designs: Designs,
    *,
    of: str | Iterable[str],
    near: npt.ArrayLike | None,
    about: npt.ArrayLike,
    limits: str,
) -> Problem:
    """Return the problem of a sweep.

    Raises:
        UnknownNameError, InvalidInputError, AssemblyError, SingularityError: see `sweep`.
    """
    (values, pi, n), terms, point = designs, terms_of(of), checked("about", about, (3,))
    if limits not in ("check", "ignore"):
        raise InvalidInputError("limits", limits, "must be 'check' or 'ignore'")
    chain = at_rest(chain)
    loops = loops_of(chain)
    loops.require_determined()
    if motion.na != chain.na:
        names = ", ".join(chain.actuated)
        raise InvalidInputError("motion columns", motion.na, f"must be {chain.na}, one for each of {names}")
    require_near(loops, motion.q)
    size = sum(float(np.prod(term.shape(chain, len(motion)))) for term in terms)
    require_memory("of", [term.name for term in terms], 8.0 * n * size)
    q0 = assemble(chain, motion.q[0], near)
    return Problem(chain, frozen(q0), motion, n, values, pi, terms, point, _limits(chain, limits))


def designs_of(
    chain: ClosedChain, parameters: Mapping[str, npt.ArrayLike] | None, inertias: npt.ArrayLike | None
) -> Designs:
    """Return parameters (n,), inertial parameters (n, nb, 10) and the number of designs, looked at.

    Raises:
        UnknownNameError, InvalidInputError: see `sweep`.
    """
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
