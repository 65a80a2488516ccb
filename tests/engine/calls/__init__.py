"""Kernels of the engine as Python calls them in tests: each does one thing to the sample at hand.

They stand in a folder of their own because machine code is kept for as long as the files beside it stay the same.
"""

from __future__ import annotations

from fivebar_pin.engine import blocks, closing, following, rows
from fivebar_pin.engine import tree as trees
from fivebar_pin.engine.bodies import reduced_inertia, twists
from fivebar_pin.engine.compiled import entry
from fivebar_pin.engine.entries import open_by, read
from fivebar_pin.engine.tables import (
    CLOSED,
    COLUMN_SIZE,
    COLUMNS,
    GOING,
    J_BEFORE,
    J_HERE,
    M_BAR,
    MOTORS,
    MOVED,
    NA,
    NQ,
    NV,
    Q_BEFORE,
    Q_HERE,
    SIGNS,
    SIGNS_BEFORE,
    TO,
)


@entry
def tree(I, W):
    """Write poses, velocities and accelerations of all links."""
    trees.place(I, W)
    trees.move(I, W)
    trees.accelerate(I, W)


@entry
def integrate(I, W, x):
    """Move q along the tangent that stands from W[x] on."""
    trees.integrate(I, W, x)


@entry
def closures(I, W):
    """Write residuals, Jacobian and, as leads, the drift of all rows."""
    trees.place(I, W)
    rows.look(I, W)
    rows.jacobian(I, W)
    trees.move(I, W)
    trees.accelerate(I, W)
    rows.drifts(I, W)


@entry
def factorise(I, W):
    """Factorise all blocks and tell whether none is singular."""
    return blocks.factorise(I, W)


@entry
def solve(I, W):
    """Solve J x = lead for the passive part of x."""
    blocks.solve(I, W)


@entry
def inverse_norm(I, W, g):
    """Return the size of the inverse of the block whose record begins at g."""
    return blocks.inverse_norm(I, W, g)


@entry
def close(I, W):
    """Close q by its passive coordinates and tell whether it is closed."""
    closing.close(I, W)
    return W[I[CLOSED]] == 1.0


@entry
def advance(I, W, first):
    """Go on along the straight line to `TO`."""
    following.advance(I, W, first)


@entry
def mass_matrix(I, W, M):
    """Write the reduced inertia M (na, na) of the poses and the complement that stand there."""
    twists(I, W)
    reduced_inertia(I, W, I[M_BAR])
    for a in range(I[NA]):
        for b in range(I[NA]):
            M[a, b] = W[I[M_BAR] + a * I[NA] + b]


@entry
def step(I, W):
    """Take one step of Newton and return the largest residuals before and after it."""
    trees.place(I, W)
    rows.look(I, W)
    rows.jacobian(I, W)
    blocks.factorise(I, W)
    before = closing.largest_residual(I, W)
    W[I[GOING]] = 1.0
    closing._step(I, W)
    trees.place(I, W)
    rows.look(I, W)
    return before, closing.largest_residual(I, W)


@entry
def largest(I, W):
    """Return the largest residual that stands there."""
    return closing.largest_residual(I, W)


@entry
def residual(I, W, q):
    """Return the largest closure residual at q[0]."""
    read(W, I[Q_HERE], q, 0, I[NQ])
    trees.place(I, W)
    rows.look(I, W)
    return open_by(I, W)


@entry
def attempt(I, W, tangent):
    """Take one step from a point of the branch, along any tangent (nv,), the motors to `TO`, as `advance` would.

    Returns:
        Whether it closed, and whether that is certified to be the same branch.
    """
    following.copy_state(I, W, I[Q_HERE], I[Q_BEFORE], I[J_HERE], I[J_BEFORE], I[SIGNS], I[SIGNS_BEFORE])
    W[I[CLOSED]] = 1.0
    for k in range(I[NV]):
        W[I[MOVED] + k] = tangent[k]
    trees.integrate(I, W, I[MOVED])
    for a in range(I[NA]):
        trees.set_coordinate(I, W, I[COLUMNS] + COLUMN_SIZE * I[I[MOTORS] + a], W[I[TO] + a])
    closing.close(I, W)
    closed = W[I[CLOSED]] == 1.0
    if closed:
        following._certify(I, W, False)
    return closed, W[I[CLOSED]] == 1.0


@entry
def certify(I, W):
    """Tell whether this point and the one before, as they stand there, are certified to be on one branch."""
    W[I[CLOSED]] = 1.0
    following._certify(I, W, False)
    return W[I[CLOSED]] == 1.0


@entry
def contraction(I, W, g, beta):
    """Return the largest β_s K η of a block along the chord."""
    return following._contraction(I, W, g, beta)


@entry
def weights(h, h1, h2):
    """Return the weights of N at this point and at the two before."""
    return following._weights(h, h1, h2)
