"""Momentum, its rate and the energy of every body over a batch: Newton and Euler, body by body.

An independent road beside Pinocchio's recursive Newton-Euler algorithm. Wrenches are linear-before-angular (force,
moment), in world axes at the world origin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array, Immutable, cross
from fivebar_pin.chain import ClosedChain
from fivebar_pin.mechanism.tree import Poses, Rates, Tree

__all__ = [
    "Bodies",
    "BodyRates",
    "accelerations",
    "body_rates",
    "centres",
    "gravity_wrenches",
    "inner",
    "rotor_energy",
    "sizes",
    "speeds",
    "total_centre",
]


@dataclass(frozen=True, slots=True, eq=False)
class Bodies(Immutable):
    """Masses, mass centres and inertias of the moving bodies, one for each joint."""

    mass: Array  # (nb,)
    lever: Array  # mass centre in the joint frame (nb, 3)
    inertia: Array  # about the mass centre, joint axes (nb, 3, 3)

    @staticmethod
    def of(chain: ClosedChain) -> Bodies:
        """Read them off the chain's model."""
        inertias = list(chain.model.inertias)[1:]
        return Bodies(
            np.array([I.mass for I in inertias]),
            np.array([I.lever for I in inertias]),
            np.array([I.inertia for I in inertias]),
        )


@dataclass(frozen=True, slots=True, eq=False)
class BodyRates(Immutable):
    """Per sample and body.

    Attributes:
        centre: mass centres (n, nb, 3) [m].
        twist: spatial velocities (n, nb, 6).
        momentum: spatial momenta (n, nb, 6).
        rate: rates of the spatial momenta (n, nb, 6) [N, N m].
    """

    centre: Array
    twist: Array
    momentum: Array
    rate: Array

    @property
    def kinetic_energy(self) -> Array:
        """Kinetic energy of all bodies together (n,) [J]; rotors have their own, see `rotor_energy`."""
        return np.asarray(0.5 * np.sum(self.twist * self.momentum, axis=(1, 2)))


def rotor_energy(chain: ClosedChain, v: Array) -> Array:
    """Return the kinetic energy of the rotors where joints have an armature, at velocities v (n, nv) -> (n,) [J]."""
    return np.asarray(0.5 * np.sum(np.array(chain.model.armature) * v**2, axis=1))


def centres(bodies: Bodies, poses: Poses) -> Array:
    """Return the world positions of the mass centres (n, nb, 3)."""
    R, p = np.swapaxes(poses.R[1:], 0, 1), np.swapaxes(poses.p[1:], 0, 1)
    return np.asarray(p + np.matmul(R, bodies.lever[..., None])[..., 0])


def total_centre(bodies: Bodies, poses: Poses) -> Array:
    """Return the world position of the centre of mass of all moving bodies (n, 3)."""
    total = np.sum(bodies.mass)
    return np.asarray(np.einsum("b,nbi->ni", bodies.mass / total, centres(bodies, poses)))


def accelerations(tree: Tree, poses: Poses, rates: Rates, a: Array) -> Array:
    """Return the spatial accelerations of all bodies (n, nb, 6) from the joint accelerations a (n, nv)."""
    out: list[Array] = [np.zeros_like(rates.A[0])]
    for joint in tree.joints:
        if joint is not None:
            out.append(out[joint.parent] + np.matmul(poses.S[:, :, joint.v], a[:, joint.v, None])[..., 0])
    return np.asarray(np.stack(out[1:], axis=1) + np.swapaxes(rates.A[1:], 0, 1))


def body_rates(tree: Tree, bodies: Bodies, poses: Poses, rates: Rates, a: Array) -> BodyRates:
    """Return momenta and their rates (Newton and Euler for every body)."""
    c, R = centres(bodies, poses), np.swapaxes(poses.R[1:], 0, 1)
    V, A = np.swapaxes(rates.V[1:], 0, 1), accelerations(tree, poses, rates, a)
    w, alpha = V[..., 3:], A[..., 3:]
    vc = V[..., :3] + cross(w, c)
    ac = A[..., :3] + cross(alpha, c) + cross(w, vc)
    m = bodies.mass[:, None]
    RT = np.swapaxes(R, -1, -2)

    def about_centre(x: Array) -> Array:
        local = np.matmul(bodies.inertia, np.matmul(RT, x[..., None]))
        return np.asarray(np.matmul(R, local)[..., 0])

    L = about_centre(w)
    force = m * ac
    moment = about_centre(alpha) + cross(w, L) + cross(c, force)
    return BodyRates(
        c,
        V,
        np.concatenate([m * vc, L + cross(c, m * vc)], axis=-1),
        np.concatenate([force, moment], axis=-1),
    )


def gravity_wrenches(bodies: Bodies, centre: Array, gravity: Array) -> Array:
    """Return the gravity wrench on every body (n, nb, 6)."""
    force = np.broadcast_to(bodies.mass[:, None] * gravity, centre.shape)
    return np.concatenate([force, cross(centre, force)], axis=-1)


def sizes(moving: BodyRates, about: Array) -> tuple[Array, Array, Array]:
    """Return of every body |rate of momentum|, |its moment about the mass centre|, |arm to a point| (n, nb) each."""
    force, centre = moving.rate[..., :3], moving.centre
    moment = moving.rate[..., 3:] - cross(centre, force)
    return tuple(np.linalg.norm(x, axis=2) for x in (force, moment, centre - about))


def inner(bodies: Bodies, moving: BodyRates, moment: Array) -> Array:
    """Return what the points of a body pull on each other, m k w^2 + |M| / k with its radius of gyration k (n, nb) [N].

    It adds up to nothing, but the round-off of it is left where the mass centre lies on an axis at rest.
    """
    mk = np.sqrt(0.5 * np.trace(bodies.inertia, axis1=1, axis2=2) * bodies.mass)
    spin = np.sum(moving.twist[..., 3:] ** 2, axis=2)
    return np.asarray(mk * spin + np.divide(bodies.mass * moment, mk, out=np.zeros_like(moment), where=mk > 0.0))


def speeds(tree: Tree, q: Array, centre: Array, N: Array) -> tuple[Array, Array]:
    """Return the speeds of mass centres and the angular speeds of bodies (n, nb, k) at velocities N (n, nv, k)."""
    twist = np.einsum("niv,bv,nvk->nbki", tree.poses(q).S, tree.support[1:], N)
    linear = twist[..., :3] + cross(twist[..., 3:], centre[:, :, None])
    return np.linalg.norm(linear, axis=3), np.linalg.norm(twist[..., 3:], axis=3)
