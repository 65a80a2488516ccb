"""Random samples of the closed configurations of a chain, and whether it moves in a plane."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, checked, frozen
from fivebar_pin._loops import Loops, loops_of
from fivebar_pin._newton import closed_enough, polish, residual_of, search
from fivebar_pin._tree import Poses
from fivebar_pin.balancing._parameters import Space, plane_axes
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import AssemblyError, InvalidInputError, UnknownNameError

SpaceName = Literal["auto", "planar", "spatial"]

_SEEDS = 48
_STEP = 0.35  # of a random walk [rad, or chain lengths]
_CAREFUL = 0.2  # step of a careful walk over the smallest singular value [rad, or chain lengths]
_LONG = 40  # half the steps of a careful walk
_REGULAR = 1e-3  # scaled smallest singular value of a sample worth keeping [-]
_WIDE = 50.0  # joint limits beyond this [rad, or chain lengths] do not bound the samples


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Closed, regular configurations: q (n, nq), complement N (n, nv, na), poses of the joints."""

    q: Array
    N: Array
    poses: Poses

    def __len__(self) -> int:
        return int(self.q.shape[0])


def random_samples(chain: ClosedChain, count: int, *, near: npt.ArrayLike | None = None, seed: int = 0) -> Samples:
    """Draw closed configurations: random starts, each followed by a random walk on its assembly mode.

    Args:
        chain: the mechanism.
        count: how many at least.
        near: closed configuration (nq,); when given, only configurations that can be reached from it without
            passing a singularity are drawn, else all assembly modes that the random starts lead to.
        seed: of the draw.

    Raises:
        AssemblyError: too few configurations close, or `near` is not closed.
    """
    loops = loops_of(chain)
    loops.require_determined()
    if not chain.na:
        raise InvalidInputError("actuated joints", [], "must be at least one, else nothing moves")
    if not isinstance(seed, (int, np.integer)) or seed < 0:
        raise InvalidInputError("seed", seed, "must be an integer, not negative")
    rng = np.random.default_rng(seed)
    if near is None:
        q, good = _starts(chain, loops, rng)
        walks = max(2, -(-count // max(1, q.shape[0])))
        if not q.shape[0]:
            raise _too_few(loops, 0, count, good)
    else:
        q = _near(chain, loops, near)
        walks = _LONG + -(-count // _SEEDS)
    out, N = _walk(chain, loops, q, rng, 2 * walks, careful=near is not None)
    if out.shape[0] < count:
        raise _too_few(loops, out.shape[0], count, float("nan"))
    pick = rng.permutation(out.shape[0])[: 2 * count]
    q, N = out[pick], N[pick]
    return Samples(q, N, loops.tree.poses(q))


def space_of(chain: ClosedChain, samples: Samples, space: SpaceName = "auto") -> Space:
    """Return the space of parameters: planar when every joint of the sampled chain moves in parallel planes.

    Raises:
        InvalidInputError: a spatial mechanism asked to be planar.
        UnknownNameError: a space that does not exist.
    """
    if space not in ("auto", "planar", "spatial"):
        raise UnknownNameError("space", space, ("auto", "planar", "spatial"))
    nb = chain.model.njoints - 1
    normal = None if space == "spatial" else _normal(samples.poses.S, chain.length)
    if normal is None:
        if space == "planar":
            raise InvalidInputError("space", space, f"{chain.name} does not move in parallel planes")
        return Space(chain.joints, None, frozen(np.broadcast_to(np.eye(3), (nb, 3, 3))), chain.length)
    axes = [plane_axes(samples.poses.R[j][0].T @ normal) for j in range(1, nb + 1)]
    return Space(chain.joints, frozen(normal), frozen(axes), chain.length)


def _normal(S: Array, length: float, tolerance: float = 1e-9) -> Array | None:
    """Return the common normal of the motion, or None.  S (n, 6, nv)."""
    columns = np.moveaxis(S, 1, 2).reshape(-1, 6)
    angular = columns[:, 3:]
    turning = angular[np.linalg.norm(angular, axis=1) > tolerance]
    if not turning.size:
        return None
    n = turning[0] / np.linalg.norm(turning[0])
    k = int(np.argmax(np.abs(n)))
    n = n * np.sign(n[k])
    if np.linalg.norm(np.cross(angular, n), axis=1).max() > tolerance:
        return None
    if np.abs(columns[:, :3] @ n).max() > tolerance * max(1.0, length):
        return None
    snapped = np.where(np.abs(n) < 1e-12, 0.0, n)
    return np.asarray(snapped / np.linalg.norm(snapped))


def _starts(chain: ClosedChain, loops: Loops, rng: np.random.Generator) -> tuple[Array, float]:
    """Return closed configurations from random starts (k, nq), and the smallest residual seen."""
    n = 3 * _SEEDS
    tangent = rng.uniform(-np.pi, np.pi, (n, loops.tree.nv)) * loops.column_scale
    q = loops.tree.integrate(np.repeat(pin.neutral(chain.model)[None], n, axis=0), tangent)
    for k, (low, high) in zip(loops.actuated, _limits(chain, loops), strict=True):
        if high - low < 2.0 * _WIDE * loops.column_scale[k]:
            loops.tree.set_coordinate(q, int(k), rng.uniform(low, high, n))
    if not loops.m:
        return q, 0.0
    closed = polish(loops, search(loops, q))
    good = closed_enough(loops, closed.residual, 1e-12) & ~loops.opposed(loops.pairs(loops.tree.poses(closed.q)))
    good &= closed.sigma > _REGULAR
    return closed.q[good], float(closed.residual.min())


def _limits(chain: ClosedChain, loops: Loops) -> Array:
    """Return the limits of the actuated coordinates (na, 2)."""
    model = chain.model
    out = np.full((chain.na, 2), [-np.inf, np.inf])
    for i, name in enumerate(chain.actuated):
        joint = model.joints[model.getJointId(name)]
        if joint.nq == 1:
            out[i] = model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]
    return out


def closed_at(loops: Loops, q: Array) -> bool:
    """Return whether a configuration (nq,) closes the loops, but for what rounding in a file leaves."""
    residual = residual_of(loops, q[None])[0] if loops.m else np.zeros(1)
    return bool(np.abs(residual).max() <= 1e-6 * max(1.0, loops.length))


def _near(chain: ClosedChain, loops: Loops, near: npt.ArrayLike) -> Array:
    q = np.array(checked("near", near, (chain.nq,)))[None]
    if loops.m:
        if not closed_at(loops, q[0]):
            name, size = loops.worst(residual_of(loops, q)[0])
            raise AssemblyError(
                f"the configuration near is not closed: closure {name} stays open by {size:.3g} m or rad. "
                "Use assemble(chain, q_actuated) to close it.",
                closure=name,
                residual=size,
            )
        q = polish(loops, q).q
    return np.repeat(q, _SEEDS, axis=0)


def _walk(
    chain: ClosedChain, loops: Loops, q: Array, rng: np.random.Generator, steps: int, *, careful: bool
) -> tuple[Array, Array]:
    """Walk at random from every q (k, nq); return all regular stops and their N.

    A careful walk makes steps so short that the smallest singular value cannot pass through zero on the way: where
    two branches of a mechanism meet, it does not jump from one to the other.
    """
    limits = _limits(chain, loops)
    actuated, passive = loops.actuated, loops.passive
    room = 0.5 * float((np.ptp(limits, axis=1) / loops.column_scale[actuated]).min())
    N, sigma, sign = _complement(loops, q)
    kept = [(q[sigma > _REGULAR], N[sigma > _REGULAR])]
    heading = rng.normal(size=(q.shape[0], actuated.size))
    for _ in range(steps):
        tangent = np.matmul(N, (heading * loops.column_scale[actuated])[..., None])[..., 0]
        size = np.abs(tangent / loops.column_scale).max(axis=1)
        longest = np.minimum(_STEP, _CAREFUL * sigma) if careful else np.full(q.shape[0], 2.0 * _STEP)
        longest = np.minimum(longest, room)
        tangent *= (rng.uniform(0.3, 1.0, size.size) * longest / np.maximum(size, 1e-12))[:, None]
        trial = loops.tree.integrate(q, tangent)
        ok = _within(loops, trial, limits)
        if loops.m:
            closed = polish(loops, trial)
            moved = np.abs(tangent[:, passive] / loops.column_scale[passive]).max(axis=1, initial=0.0)
            ok &= closed_enough(loops, closed.residual, 1e-12) & (closed.correction < 0.4 * np.maximum(moved, 0.01))
            trial = closed.q
        N_new, sigma_new, sign_new = _complement(loops, trial)
        ok &= (sign_new == sign).all(axis=1) & (sigma_new > _REGULAR)
        q, N = np.where(ok[:, None], trial, q), np.where(ok[:, None, None], N_new, N)
        sigma = np.where(ok, sigma_new, sigma)
        heading = np.where(ok[:, None], heading, -heading) + 0.3 * rng.normal(size=heading.shape)
        heading /= np.linalg.norm(heading, axis=1, keepdims=True)
        kept.append((q[ok], N[ok]))
    return np.concatenate([k[0] for k in kept]), np.concatenate([k[1] for k in kept])


def _within(loops: Loops, q: Array, limits: Array) -> npt.NDArray[np.bool_]:
    ok = np.ones(q.shape[0], dtype=np.bool_)
    for k, (low, high) in zip(loops.actuated, limits, strict=True):
        x = loops.tree.coordinate(q, int(k))
        if high - low < 2.0 * _WIDE * loops.column_scale[k]:
            ok &= (x >= low) & (x <= high)
    return ok


def _complement(loops: Loops, q: Array) -> tuple[Array, Array, Array]:
    """Return N (n, nv, na), zero where singular, with the singular value and the sign of the passive Jacobian."""
    n = q.shape[0]
    N = np.zeros((n, loops.tree.nv, loops.actuated.size))
    N[:, loops.actuated, np.arange(loops.actuated.size)] = 1.0
    if not loops.m:
        return N, np.ones(n), np.ones((n, 0))
    poses = loops.tree.poses(q)
    blocks = loops.blocks(poses, loops.pairs(poses))
    passive = loops.passive_map(blocks)
    block = passive.complement(blocks)
    N[:, loops.passive] = np.where(np.isfinite(block), block, 0.0)
    return N, passive.sigma, passive.sign


def _too_few(loops: Loops, found: int, wanted: int, residual: float) -> AssemblyError:
    name = loops.closures[0].name if loops.closures else "none"
    nearest = f" (smallest closure residual {residual:.3g})" if np.isfinite(residual) else ""
    return AssemblyError(
        f"only {found} of {wanted} random configurations close away from singularities and within the limits of the "
        f"actuated joints{nearest}. Give near=, a closed configuration to start from, or ask diagnose(chain) whether "
        "too many joints are actuated.",
        closure=name,
        residual=residual,
    )
