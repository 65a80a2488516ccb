"""Balancing conditions of any closed chain, found numerically.

Momentum is linear in the velocities and in the inertial parameters. It can be constant along all motions only if it is
zero for every closed configuration q and every actuated velocity, so the conditions are the row space of

    Y_k(q) pi = 0,     Y_k(q): momentum regressor at the velocity N(q) e_k,     k = 1 .. na,

over samples q of the constraint manifold. Lengths are divided by the chain's length and masses drop out, so no rank
depends on the units. Springs add constants to the conditions of static balance, B pi + b = 0 (`_at_rest`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, checked, finite, frozen, integer, skew
from fivebar_pin.balancing.parameters import Space, plane_axes
from fivebar_pin.balancing.regressors.body_motion import BodyMotion
from fivebar_pin.balancing.sameness import ALIKE, alike, same_gravity, same_mechanism
from fivebar_pin.balancing.sampling import Samples, SpaceName, random_samples, space_of
from fivebar_pin.balancing.static import held_by_masses, required_gravity, same_springs, spring_rows, springs_act
from fivebar_pin.balancing.written import echelon_form, equation_text, readable_form
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError, SolverError, UnknownNameError
from fivebar_pin.mechanism.loops import loops_of

__all__ = ["KINDS", "BalanceConditions", "balance_conditions"]

KINDS = ("force", "moment", "dynamic", "static")
_SMALL = 1e-6  # a singular value this far below the largest may be counted as zero [-]
_MOST_SAMPLES = 1_000_000  # configurations; their rows are held in memory at once
_MOMENTS = ("moment", "dynamic")  # kinds that ask for the moment
_CLEAR = 1e3  # ratio of neighbouring singular values that counts as a clear decision [-]
_WAYS = 4  # velocities that a configuration is looked at with: a basis of them, or so many at random
_DOUBLINGS = 4  # how often the samples are doubled while the decision is not clear
_NOTHING = 1e-12  # a largest singular value below this is that of a mechanism that cannot be felt at all [-]
_ZERO = 1e-17  # what a singular value of zero counts as, so that a full rank is a gap too [of the largest]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BalanceConditions(Immutable):
    """Linear conditions on the inertial parameters under which a chain is balanced; affine where springs are held.

    Attributes:
        chain: the mechanism.
        kind: "force", "moment", "dynamic" or "static".
        space: the parameters the conditions are written in (four per body when planar, else ten).
        rank: number of independent conditions.
        basis: orthonormal rows (rank, nb * width) on the scaled parameters, see `Space.scale`.
        matrix: the same rows on the stacked ten parameters of all bodies (rank, 10 nb), in kg.
        rows: the reduced form, scaled and with rows of length one (rank, nb * width).
        reduced: reduced row echelon form on the parameters in SI units (rank, nb * width).
        singular_values: of the stacked regressor, scaled, relative to the largest.
        gap: ratio of the last singular value that counts to the first that does not.
        samples: number of configurations used.
        gravity: acceleration (3,) that static conditions hold for, or None for any [m/s2]; its size plays a part only
            where springs do.
        about: point (3,) of the angular momentum [m].
        near: closed configuration (nq,) whose branch alone they hold on, or None for all assembly modes.
        offset: constants (rank,) of the affine conditions basis x + offset = 0, zero without springs [kg].
        unheld: torque of the springs that no masses hold, its root mean square over the sampled configurations at unit
            velocity, over gravity and the chain's length; zero where some do [kg].
    """

    chain: ClosedChain
    kind: str
    space: Space
    rank: int
    basis: Array
    matrix: Array
    rows: Array
    reduced: Array
    singular_values: Array
    gap: float
    samples: int
    gravity: Array | None
    about: Array
    near: Array | None
    offset: Array
    unheld: float

    def __repr__(self) -> str:
        where = "planar" if self.space.planar else "spatial"
        modes = "in all assembly modes" if self.near is None else "on one branch"
        return (
            f"BalanceConditions({self.chain.name!r}, {self.kind}: rank {self.rank} of {self.basis.shape[1]} {where} "
            f"parameters {modes}, gap {self.gap:.1e}{', impossible with these springs' if self.unheld else ''})"
        )

    def __str__(self) -> str:
        return "\n".join([repr(self), *(f"  {equation}" for equation in self.equations)])

    @property
    def freedom(self) -> int:
        """Number of parameters that stay free."""
        return int(self.basis.shape[1]) - self.rank

    @property
    def equations(self) -> tuple[str, ...]:
        """The reduced form in words, SI units: which link's mass, first moments and inertia enter with what factor.

        Where no masses hold the springs, the last one says so.
        """
        names, constants = self.space.names, self.constants(self.reduced * self.space.scale)
        real = np.abs(self.constants(self.rows)) > ALIKE * np.abs(self.offset).max(initial=0.0)
        found = tuple(equation_text(row, names, c) for row, c in zip(self.reduced, real * constants, strict=True))
        return (*found, f"{self.unheld:.4g} (springs, whatever the masses) = 0") if self.unheld else found

    def constants(self, rows: Array) -> Array:
        """Return the constants c of combinations of the conditions, rows x + c = 0 on scaled parameters (k, P) [kg]."""
        return np.asarray(rows @ self.basis.T @ self.offset)

    def residual(self, chain: ClosedChain | npt.ArrayLike | None = None) -> Array:
        """Return the rows at a chain, or at parameters (nb, 10): zero when balanced (rank,) [kg].

        First moments count as masses at the chain's length, inertias as masses at its square. Where no masses hold the
        springs, `unheld` is one entry more.
        """
        if chain is None or isinstance(chain, ClosedChain):
            pi = (self.chain if chain is None else chain).inertial_parameters
        else:
            pi = checked("parameters", chain, (None, 10))
        if pi.size != self.matrix.shape[1]:
            raise InvalidInputError("parameters", pi.shape, f"must belong to {len(self.space.bodies)} bodies")
        left = self.matrix @ pi.reshape(-1) + self.offset
        return np.append(left, self.unheld) if self.unheld else np.asarray(left)

    def angles(self, equations: npt.ArrayLike) -> Array:
        """Return the principal angles [rad] between these conditions and other equations on the same parameters.

        Args:
            equations: rows (k, nb * width) on `space.names`, SI units.
        """
        from scipy.linalg import subspace_angles

        rows = checked("equations", equations, (None, self.basis.shape[1])) * self.space.scale
        return np.asarray(subspace_angles(self.basis.T, rows.T))


@finite(open=("gap",))
def balance_conditions(
    chain: ClosedChain,
    kind: str,
    *,
    gravity: npt.ArrayLike | Literal["any", "model"] = "any",
    about: npt.ArrayLike = (0.0, 0.0, 0.0),
    near: npt.ArrayLike | None = None,
    space: SpaceName = "auto",
    samples: int | None = None,
    seed: int = 0,
) -> BalanceConditions:
    """Find the conditions under which a closed chain is balanced.

    Args:
        chain: the mechanism; its present masses play no part.
        kind: "force" (centre of mass stationary), "moment" (angular momentum about `about` constant), "dynamic"
            (both) or "static" (no torque at the actuated joints at rest, from gravity and the chain's springs
            together). Springs play no part in the others: they are inner forces.
        gravity: for "static": "any" direction, the model's own, or a vector (3,); with springs that act its size
            matters too [m/s2].
        about: point (3,) of the angular momentum; plays no part when the force is balanced too.
        near: closed configuration (nq,): balance only the branch that it can reach. By default the conditions hold on
            every assembly mode; they differ only for special lengths (parallelograms and the like).
        space: "planar" (four parameters per body, force in the plane and moment about its normal), "spatial" (ten, all
            components: of a planar mechanism too, whose bodies shake out of the plane where they lie at different
            heights), or "auto".
        samples: number of configurations; from the number of bodies unless given, and more while the rank is not
            clear.
        seed: of the samples.

    Raises:
        UnknownNameError: a kind that does not exist.
        InvalidInputError: static balance of springs under "any" gravity.
        AssemblyError: too few configurations close.
        SolverError: the singular values show no clear gap, however many samples are taken.
    """
    if kind not in KINDS:
        raise UnknownNameError("kind of balance", kind, KINDS)
    wanted = max(200, 20 * len(chain.joints)) if samples is None else samples
    count = integer("samples", wanted, least=10, most=_MOST_SAMPLES)
    integer("seed", seed)
    point = checked("about", about, (3,))
    weight = _gravity(chain, gravity) if kind == "static" else None
    drawn = _few_ways(random_samples(chain, int(count), near=near, seed=seed))
    found = space_of(chain, drawn, space)
    acting = kind == "static" and springs_act(chain, drawn)
    pull = required_gravity(chain, weight) if acting else 1.0
    P = found.scale.size
    used, stacked, R, parts = 0, 0, np.zeros((0, P + acting)), 0.0
    for _ in range(_DOUBLINGS + 1):
        rows = _rows(chain, drawn, found, kind, weight, point)
        if acting:
            column, sizes = (x / (pull * found.length) for x in spring_rows(chain, drawn))
            rows, parts = np.column_stack([rows, column]), float(np.hypot(parts, np.linalg.norm(sizes)))
        used, stacked, R = used + len(drawn), stacked + rows.shape[0], _triangle(R, rows)
        U, s, Vt = np.linalg.svd(R[:, :P])
        rank, gap = _gap(s)
        if not rank or (gap >= _CLEAR and stacked > rank):
            break
        drawn = _few_ways(random_samples(chain, 2 * used, near=near, seed=seed, skip=used))
    else:
        raise SolverError(
            f"the singular values of the {kind} conditions of {chain.name} show no clear gap (best ratio {gap:.3g} "
            f"after {rank}, must reach {_CLEAR:g}) over {used} configurations. Use more samples, or a range of motion "
            "away from singularities.",
            residual=gap,
            tolerance=_CLEAR,
        )
    offset, outside = held_by_masses(U, s, rank, R[:, P], parts) if acting else (np.zeros(rank), 0.0)
    unheld = outside / float(np.sqrt(stacked))
    return _conditions(chain, kind, found, s, Vt[:rank], gap, used, weight, point, near, offset, unheld)


def conditions_for(
    chain: ClosedChain,
    kind: str,
    given: BalanceConditions | None,
    *,
    gravity: npt.ArrayLike | Literal["any", "model"],
    about: npt.ArrayLike,
    near: npt.ArrayLike | None,
    space: SpaceName,
    seed: int,
) -> BalanceConditions:
    """Return given conditions once it is checked that they are the ones asked for, or find them.

    Args:
        given: conditions found before, for the same mechanism with whatever masses, or None.
        chain, kind, gravity, about, near, space, seed: as for `balance_conditions`. Given conditions of one branch
            need no `near`.

    Raises:
        InvalidInputError: the given conditions belong to another mechanism or other arguments.
    """
    if given is None:
        return balance_conditions(chain, kind, gravity=gravity, about=about, near=near, space=space, seed=seed)
    if not same_mechanism(chain, given.chain):
        raise InvalidInputError("conditions", given, f"must belong to {chain.name}: its joints, lengths and closures")
    if given.kind != kind:
        raise InvalidInputError("conditions", given, f"must be of kind {kind!r}")
    if space != "auto" and given.space.planar != (space == "planar"):
        raise InvalidInputError("conditions", given, f"must be {space}")
    if near is not None and not alike(given.near, checked("near", near, (chain.nq,))):
        raise InvalidInputError("conditions", given, "must be those of the branch of near")
    if kind == "static":
        sprung = bool(given.unheld or given.offset.any())
        if not same_gravity(given.gravity, _gravity(chain, gravity), sized=sprung):
            raise InvalidInputError("conditions", given, f"must hold for gravity = {gravity!r}")
        if not same_springs(chain, given.chain):
            raise InvalidInputError("conditions", given, f"must hold the springs of {chain.name}")
    if kind == "moment" and not alike(given.about, checked("about", about, (3,))):
        raise InvalidInputError("conditions", given, f"must be about {about!r}")
    return given


def momentum_rows(
    chain: ClosedChain, samples: Samples, space: Space, about: Array, *, force: bool, moment: bool
) -> tuple[Array, Array]:
    """Return scaled momentum regressors for each of the velocities N, none of those that are not asked for.

    Linear (k, 2 or 3, P) and angular (k, 1 or 3, P).
    """
    loops = loops_of(chain)
    to_space = space.injection() * space.scale
    ways, axes = (np.eye(3), np.eye(3)) if space.normal is None else np.split(plane_axes(space.normal), [2])
    linear, angular = [], []
    for k in range(samples.N.shape[2]):
        v = samples.N[:, :, k]
        unit = np.abs(v / loops.column_scale).max(axis=1, keepdims=True)
        Y = BodyMotion.of(loops, samples.q, v / unit, poses=samples.poses).momentum()
        Y = np.swapaxes(Y, 1, 2).reshape(len(samples), 6, -1)
        if force:
            linear.append(np.matmul(ways, Y[:, :3] / space.length) @ to_space)
        if moment:
            about_point = (Y[:, 3:] - np.matmul(skew(about), Y[:, :3])) / space.length**2
            angular.append(np.matmul(axes, about_point) @ to_space)
    none = np.zeros((0, 3, to_space.shape[1]))
    return np.concatenate(linear or [none]), np.concatenate(angular or [none])


def _few_ways(samples: Samples) -> Samples:
    """Return samples with some random velocities instead of a basis where that is large: other samples have others."""
    n, _, na = samples.N.shape
    if na <= _WAYS:
        return samples
    mix = np.random.default_rng(n).normal(size=(n, na, _WAYS))
    return replace(samples, N=frozen(np.matmul(samples.N, mix / np.linalg.norm(mix, axis=1, keepdims=True))))


def _gravity(chain: ClosedChain, gravity: npt.ArrayLike | str) -> Array | None:
    """Return the acceleration of gravity (3,) [m/s2], or None for any."""
    if isinstance(gravity, str):
        if gravity == "any":
            return None
        if gravity != "model":
            raise UnknownNameError("gravity", gravity, ("any", "model", "a vector of three"))
        gravity = np.array(chain.model.gravity.linear)
    g = checked("gravity", gravity, (3,))
    if float(np.linalg.norm(g)) == 0.0:
        raise InvalidInputError("gravity", g.tolist(), "must not be zero for static balance")
    return g


def _rows(chain: ClosedChain, samples: Samples, space: Space, kind: str, gravity: Array | None, about: Array) -> Array:
    """Stack the scaled rows that must vanish, (rows, P)."""
    linear, angular = momentum_rows(chain, samples, space, about, force=kind != "moment", moment=kind in _MOMENTS)
    if kind == "static" and gravity is not None:  # N^T g(q) = -g . (linear momentum at N e_k)
        axes = np.eye(3) if space.normal is None else plane_axes(space.normal)[:2]
        linear = np.matmul(axes @ (gravity / float(np.linalg.norm(gravity))), linear)[:, None]
    parts = {"force": [linear], "static": [linear], "moment": [angular], "dynamic": [linear, angular]}[kind]
    return np.concatenate([p.reshape(-1, p.shape[-1]) for p in parts])


def _triangle(R: Array, rows: Array) -> Array:
    """Return rows that span the same as both, at most as many as there are columns."""
    stacked = np.concatenate([R, rows])
    return np.asarray(np.linalg.qr(stacked, mode="r")) if stacked.shape[0] > stacked.shape[1] else stacked


def _conditions(
    chain: ClosedChain,
    kind: str,
    space: Space,
    s: Array,
    basis: Array,
    gap: float,
    samples: int,
    gravity: Array | None,
    about: Array,
    near: npt.ArrayLike | None,
    offset: Array,
    unheld: float,
) -> BalanceConditions:
    echelon = echelon_form(basis, space)
    return BalanceConditions(
        chain=chain,
        kind=kind,
        space=space,
        rank=basis.shape[0],
        basis=frozen(basis),
        matrix=frozen((basis / space.scale) @ space.selection()),
        rows=frozen(echelon / np.linalg.norm(echelon, axis=1, keepdims=True)),
        reduced=frozen(readable_form(echelon, space)),
        singular_values=frozen(s / s[0] if s.size and s[0] > 0.0 else s),
        gap=gap,
        samples=samples,
        gravity=None if gravity is None else frozen(gravity),
        about=frozen(about),
        near=None if near is None else frozen(np.array(near, dtype=np.float64)),
        offset=frozen(offset),
        unheld=unheld,
    )


def _gap(s: Array) -> tuple[int, float]:
    """Return the rank at the widest gap below the allowed size, and the gap."""
    if not s.size or s[0] < _NOTHING:
        return 0, float("inf")
    floor = np.maximum(s / s[0], _ZERO)
    extended = np.append(floor, _ZERO)  # a full rank is a gap to zero
    ratio = extended[:-1] / extended[1:]
    allowed = extended[1:] < _SMALL
    if floor[-1] > _SMALL:
        return int(s.size), float("inf")
    ratio = np.where(allowed[: ratio.size], ratio, 0.0)
    rank = int(np.argmax(ratio)) + 1
    return rank, float(ratio[rank - 1])
