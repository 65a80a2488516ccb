"""Following an assembly mode along a motion: a few careful steps first, all samples in between at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import TINY, Array
from fivebar_pin.errors import AssemblyError, BranchError, SingularityError
from fivebar_pin.mechanism.closing import Closed, closed_enough, polish, residual_of, search
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.loops import Loops, open_message
from fivebar_pin.mechanism.rank import SINGULAR, same_side

__all__ = ["LONGEST", "follow", "node_at", "track"]


LONGEST = 0.4  # longest predictor step of any coordinate [rad, or chain lengths]
_SHORTEST = 1e-7  # fraction of a step below which the search for a way on is given up
_TRUST = 0.3  # largest correction, as a fraction of the step that was predicted
_DROP = 0.2  # part of the singular value that a step must leave: a longer one may jump over a bifurcation unseen [-]
_NOISE = 1e-9  # correction that needs no step to explain it: nodes are closed about as far [rad, or chain lengths]
_APART = 1e-6  # distance of two closed configurations from which on they are two [rad, or chain lengths]
_OUT_OF_REACH = 1e-8  # closure residual that a search leaves where nothing closes, at least [m or rad]
_CORRECTIONS = 6  # Newton steps before a step counts as too long
_GUIDED = 1e-6  # scaled residual good enough for a node on the way [-]
_RESOLVED = 1e-2  # the same over the squared singular value: a residual r cannot tell branches sqrt(r) apart [-]


@dataclass(slots=True)
class _Node:
    """A nearly closed configuration on the branch, and how the passive coordinates move on from it."""

    x: Array  # actuated coordinates (na,)
    q: Array  # (nq,)
    N: Array  # (np, na)
    bend: Array  # change of N per unit of the last step (np, na)
    sign: Array  # of the passive determinant, per group of closures
    tall: list[Array]  # passive Jacobians of the groups without a determinant (r, k)
    several: list[Array]  # inverses of those of the groups of several closures that have one (k, k)
    sigma: float


@dataclass(slots=True)
class _Corrector:
    """The closure rows and the passive map at one configuration."""

    error: float  # largest scaled residual
    step: Array  # passive tangent of a Newton step (np,)
    N: Array
    sign: Array  # per group of closures
    tall: list[Array]
    several: list[Array]
    sigma: float


def _correct(loops: Loops, q: Array) -> _Corrector:
    here = Configurations(loops, q)
    passive = here.passive
    return _Corrector(
        float(here.error[0]),
        -passive.solve(here.residual)[0],
        passive.complement(here.blocks)[0],
        passive.sign[0],
        [A[0] for A in passive.tall],
        [X[0] for g, X in zip(passive.groups, passive.X, strict=True) if g.is_square and len(g.members) > 1],
        float(passive.sigma[0]),
    )


def node_at(loops: Loops, q: Array, x: Array) -> _Node:
    """Prepare a closed configuration q (nq,) with actuated coordinates x (na,)."""
    here = _correct(loops, q[None])
    return _Node(
        np.array(x), np.array(q), here.N, np.zeros_like(here.N), here.sign, here.tall, here.several, here.sigma
    )


def follow(loops: Loops, node: _Node, target: Array) -> _Node:
    """Go from one node to the actuated coordinates `target` (na,) along the straight line, on the same branch.

    The node reached is a guide, closed to about 1e-6: polish it.

    Raises:
        SingularityError, AssemblyError: the way is blocked; without sample and time.
    """
    done, step = 0.0, 1.0
    start = node.x
    while done < 1.0:
        step = min(step, 1.0 - done)
        x = start + (done + step) * (target - start)
        reached = _try(loops, node, x)
        if reached is None:
            step *= 0.5
            if step < _SHORTEST:
                raise _blocked(loops, node, target)
            continue
        node, done = reached, done + step
        step *= 2.0
    return node


def track(loops: Loops, q0: Array, X: Array, tolerance: float) -> Closed:
    """Follow the branch of q0 along all samples.

    Args:
        q0: closed configuration at X[0] (nq,), at round-off as `assemble` returns it.
        X: actuated coordinates (n, na).
        tolerance: closure residual counted as closed [m or rad, times the chain's length above 1 m].

    Returns:
        Closed configurations at every sample.

    Raises:
        AssemblyError, BranchError, SingularityError: with an attribute `sample` at the first sample not reached.
    """
    n = X.shape[0]
    node = node_at(loops, q0, X[0])
    if node.sigma < SINGULAR:
        raise _located(_singular(node.sigma), 0)
    if n == 1 and loops.m:
        gap = np.abs(residual_of(loops, node.q[None])).max(axis=1)
        return Closed(node.q[None], gap, np.zeros(1), np.array([node.sigma]), node.sign[None])
    path = np.r_[0.0, np.cumsum(np.abs(np.diff(X, axis=0)).max(axis=1))] if X.shape[1] else np.zeros(n)
    index, nodes = [0], [node]
    reach = 0.5 * LONGEST
    while index[-1] < n - 1:
        i = index[-1]
        k = min(n - 1, max(i + 1, int(np.searchsorted(path, path[i] + reach, side="right")) - 1))
        reached = _try(loops, nodes[-1], X[k])
        if reached is None and k > i + 1:
            reach *= 0.5
            continue
        if reached is None:
            try:
                reached = follow(loops, nodes[-1], X[k])
            except (AssemblyError, SingularityError) as error:
                raise _located(error, k) from None
        else:
            reach = min(1.5 * reach, 4.0 * LONGEST)
        index.append(k)
        nodes.append(reached)
    return _fill(loops, np.array(index), nodes, X, tolerance)


def _try(loops: Loops, node: _Node, x: Array) -> _Node | None:
    """Take one predictor-corrector step; None when it is not clearly on the same branch.

    The corrector stops at a residual that one more Newton step would take to round-off: nodes only guide the way.
    """
    dx = x - node.x
    length = float(np.abs(dx).max(initial=0.0))
    tangent = np.zeros(loops.tree.nv)
    tangent[loops.actuated], tangent[loops.passive] = dx, (node.N + 0.5 * length * node.bend) @ dx
    scale = loops.column_scale
    size = float(np.abs(tangent / scale).max(initial=0.0))
    if not size <= LONGEST:
        return None
    q = loops.tree.integrate(node.q[None], tangent[None])
    loops.set_actuated(q, x)
    correction, least = 0.0, max(SINGULAR, _DROP * node.sigma)
    for _ in range(_CORRECTIONS):
        here = _correct(loops, q)
        if np.any(here.sign != node.sign) or not here.sigma >= least or not same_side(node.tall, here.tall):
            return None
        if here.error < min(_GUIDED, _RESOLVED * here.sigma**2):
            if _crossed_together(node.several, here.several):
                return None
            bend = (here.N - node.N) / length if length > 0.0 else node.bend
            return _Node(np.array(x), q[0], here.N, bend, here.sign, here.tall, here.several, here.sigma)
        step = np.zeros(loops.tree.nv)
        step[loops.passive] = here.step
        correction += float(np.abs(step / scale).max())
        if not correction <= _TRUST * size + _NOISE:
            return None
        q = loops.tree.integrate(q, step[None])
    return None


def _crossed_together(before: list[Array], after: list[Array]) -> bool:
    """Tell whether two loops passed a singularity in one step, which the sign of their common determinant hides.

    (1 - s) A + s B is singular for some s between 0 and 1 where A^-1 B has a negative eigenvalue. Loops that act on
    each other may mix two of them into a pair: those nearer to the negative axis than to any other count.

    Args:
        before, after: A^-1 and B^-1 of each group (k, k); scaling the rows of both does not change the eigenvalues.
    """
    for A, B in zip(before, after, strict=True):
        values = np.linalg.eigvals(np.linalg.solve(B, A))
        if np.any(np.abs(values.imag) < -values.real):
            return True
    return False


def _fill(loops: Loops, index: np.ndarray, nodes: list[_Node], X: Array, tolerance: float) -> Closed:
    """Close every sample between the nodes at once, starting from a cubic through the nodes on either side."""
    n = X.shape[0]
    guess = _between(loops, index, nodes, X)
    sign = nodes[0].sign
    closed = polish(loops, guess)
    trusted = (
        closed_enough(loops, closed.residual, tolerance)
        & (closed.sign == sign).all(axis=1)
        & (closed.sigma >= SINGULAR)
    )
    trusted &= closed.correction <= _TRUST * LONGEST
    if nodes[0].tall:
        trusted &= _on_the_side_of(loops, nodes, np.searchsorted(index, np.arange(n), side="right") - 1, closed.q)
    if trusted.all():
        return closed
    return _mend(loops, index, nodes, X, closed, trusted, tolerance)


def _on_the_side_of(loops: Loops, nodes: list[_Node], which: np.ndarray, q: Array) -> np.ndarray:
    """Tell whether every sample q (n, nq) lies on the side of its node where no determinant tells it (n,)."""
    tall = Configurations(loops, q).passive.tall
    return same_side([np.stack([node.tall[g] for node in nodes])[which] for g in range(len(tall))], tall)


def _mend(
    loops: Loops, index: np.ndarray, nodes: list[_Node], X: Array, closed: Closed, trusted: np.ndarray, tolerance: float
) -> Closed:
    """Redo, sample by sample, the stretches between nodes where something looked wrong."""
    bad = np.unique(np.searchsorted(index, np.flatnonzero(~trusted), side="right") - 1)
    parts = {name: np.array(getattr(closed, name)) for name in Closed.__slots__}
    for b in bad:
        node = nodes[b]
        for k in range(index[b], index[b + 1] + 1 if b + 1 < index.size else index[b] + 1):
            try:
                node = follow(loops, node, X[k])
            except (AssemblyError, SingularityError) as error:
                raise _located(error, k) from None
            again = polish(loops, node.q[None])
            for name, values in parts.items():
                values[k] = getattr(again, name)[0]
        if b + 1 < index.size and _apart(loops, polish(loops, np.stack([node.q, nodes[b + 1].q])).q):
            raise _located(
                BranchError(
                    "the motion passes another assembly mode between two samples; refine the motion",
                    closure=loops.closures[0].name,
                    residual=0.0,
                ),
                int(index[b + 1]),
            )
    return Closed(**parts)


def _between(loops: Loops, index: np.ndarray, nodes: list[_Node], X: Array) -> Array:
    """Interpolate configurations at every sample from the nodes: cubic along the chord, linear across it."""
    n = X.shape[0]
    Q = np.stack([node.q for node in nodes])
    if len(nodes) == 1:
        return np.repeat(Q, n, axis=0)
    b = np.minimum(np.searchsorted(index, np.arange(n), side="right") - 1, index.size - 2)
    XN, N = X[index], np.stack([node.N for node in nodes])
    chord = XN[b + 1] - XN[b]
    length2 = np.maximum(np.einsum("ni,ni->n", chord, chord), TINY)
    s = np.clip(np.einsum("ni,ni->n", X - XN[b], chord) / length2, 0.0, 1.0)[:, None]
    span = loops.tree.difference(Q[:-1], Q[1:])[b][:, loops.passive]
    m0, m1 = (np.einsum("npa,na->np", N[b + k], chord) for k in (0, 1))
    off = X - XN[b] - s * chord
    across = (1.0 - s) * np.einsum("npa,na->np", N[b], off) + s * np.einsum("npa,na->np", N[b + 1], off)
    tangent = np.zeros((n, loops.tree.nv))
    tangent[:, loops.passive] = (
        s * s * (3.0 - 2.0 * s) * span + s * (1.0 - s) ** 2 * m0 - s * s * (1.0 - s) * m1 + across
    )
    guess = loops.tree.integrate(Q[b], tangent)
    loops.set_actuated(guess, X)
    return guess


def _apart(loops: Loops, q: Array) -> bool:
    """Tell whether two closed configurations (2, nq) are two; nodes themselves differ by what is left of their gaps."""
    d = loops.tree.difference(q[:1], q[1:])[0] / loops.column_scale
    return bool(np.abs(d).max(initial=0.0) > _APART)


def _blocked(loops: Loops, node: _Node, x: Array) -> AssemblyError | SingularityError:
    """Say why there is no way from a node to x: x is out of reach, or a singularity lies in between."""
    q = np.array(node.q[None])
    loops.set_actuated(q, x)
    found = search(loops, q)
    residual = residual_of(loops, found)[0]
    if not closed_enough(loops, np.abs(residual).max(initial=0.0), _OUT_OF_REACH):
        return open_message(loops, residual, "at these actuated coordinates")
    return _singular(node.sigma)


def _singular(sigma: float) -> SingularityError:
    return SingularityError(
        "the motion meets a type 2 singularity: the actuated joints do not determine the passive ones there "
        f"(smallest scaled singular value {sigma:.2g}). Choose a motion that keeps away from it.",
        sigma=sigma,
    )


def _located(error: AssemblyError | SingularityError, sample: int) -> AssemblyError | SingularityError:
    error.sample = sample
    return error
