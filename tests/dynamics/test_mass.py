"""The mass matrix does not depend on the order in which the joints were added."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin.dynamics.mass import composite_mass_matrix, depth_first, mass_matrix
from fivebar_pin.mechanism.tree import Tree

PARENTS = {"a": "", "b": "", "c": "a", "d": "b", "e": "a"}
DEPTH_FIRST, BREADTH_FIRST = "acebd", "abcde"


def tree(order: str) -> fb.ClosedChain:
    """Five hinges on two branches, numbers by name."""
    model = pin.Model()
    for name in order:
        rng = np.random.default_rng(ord(name))
        S = np.diag(rng.uniform(0.1, 1.0, 3))
        R = pin.exp3(rng.normal(size=3))
        parent = model.getJointId(PARENTS[name]) if PARENTS[name] else 0
        j = model.addJoint(parent, pin.JointModelRZ(), pin.SE3(R, rng.normal(size=3)), name)
        body = pin.Inertia(rng.uniform(0.5, 2.0), rng.normal(size=3), np.trace(S) * np.eye(3) - S)
        model.appendBodyToJoint(j, body, pin.SE3.Identity())
        model.armature[model.idx_vs[j]] = rng.uniform(0.1, 0.5)
    return fb.ClosedChain(model, (), tuple(sorted(order)))


def by_name(order: str, values: np.ndarray) -> np.ndarray:
    """Values that belong to a, b, c, d, e, in the tree's order."""
    return values[..., ["abcde".index(name) for name in order]]


def test_the_order_is_recognised() -> None:
    """Depth first is told from breadth first."""
    assert depth_first(tree(DEPTH_FIRST).model)
    assert depth_first(tree("bdaec").model)
    assert not depth_first(tree(BREADTH_FIRST).model)


@pytest.mark.parametrize("order", [BREADTH_FIRST, "abecd", "bdaec"])
def test_mass_matrix_and_accelerations_do_not_depend_on_the_order(order: str) -> None:
    """M and forward dynamics of the same tree in another order are the same numbers, permuted."""
    rng = np.random.default_rng(0)
    q, v, tau = rng.normal(size=(3, 5))
    chains = {o: tree(o) for o in (DEPTH_FIRST, order)}
    matrices, accelerations = [], []
    for o, chain in chains.items():
        back = [o.index(name) for name in "abcde"]
        data = chain.model.createData()
        M = mass_matrix(chain.model, data, by_name(o, q), ordered=depth_first(chain.model))
        matrices.append(M[np.ix_(back, back)])
        accelerations.append(fb.forward_dynamics(chain, by_name(o, q), by_name(o, v), tau)[back])
    np.testing.assert_allclose(matrices[1], matrices[0], rtol=0.0, atol=1e-13 * np.abs(matrices[0]).max())
    np.testing.assert_allclose(
        accelerations[1], accelerations[0], rtol=0.0, atol=1e-12 * np.abs(accelerations[0]).max()
    )


@pytest.mark.parametrize("order", [DEPTH_FIRST, BREADTH_FIRST, "bdaec"])
def test_composite_bodies_give_the_same_mass_matrix(order: str) -> None:
    """Two roads, one through Pinocchio, one through the inertia of all that each joint carries."""
    model = tree(order).model
    q = np.random.default_rng(5).normal(size=model.nq)
    M = mass_matrix(model, model.createData(), q, ordered=depth_first(model))
    np.testing.assert_allclose(composite_mass_matrix(Tree(model), model, q), M, rtol=0, atol=1e-13 * np.abs(M).max())
