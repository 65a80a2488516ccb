"""Building in space: a spatial four-bar from its parts, and what cannot be built."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin.closures import Closure
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.shipped import TreeBuilder

LIE = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]


def rssr() -> TreeBuilder:
    """Return the spatial four-bar of the class's own example."""
    m = TreeBuilder("rssr", gravity=(0, 0, -9.81))
    m.bar("crank", "", (0, 0, 0), 0.1)
    m.joint("rod_y", "crank", at=(0.1, 0, 0), kind=pin.JointModelRY())
    m.joint("rod_z", "rod_y")
    m.box("rod_z", (0, 0, 0), (0.35, 0, 0), width=0.015, thickness=0.015)
    m.joint("rocker", at=(0.3, 0, 0), axes=LIE)
    m.box("rocker", (0, 0, 0), (0.25, 0, 0), width=0.02, thickness=0.01)
    m.point("B_rod", "rod_z", (0.35, 0, 0))
    m.point("B_rocker", "rocker", (0.25, 0, 0))
    return m


def test_a_spatial_four_bar_closes_where_geometry_says() -> None:
    """Rod of 0.35 m between the crank's ball and the rocker's; one freedom; 7 force conditions as any RSSR."""
    chain = rssr().chain([("B", "B_rod", "B_rocker")], ("crank",))
    assert fb.diagnose(chain).mobility == 1
    assert fb.balance_conditions(chain, "force").rank == 7
    q = fb.assemble(chain, [0.8])
    swing = q[chain.model.idx_qs[chain.model.getJointId("rocker")]]
    tip = np.array([0.3, 0.0, 0.0]) + np.array(LIE) @ [0.25 * np.cos(swing), 0.25 * np.sin(swing), 0.0]
    ball = 0.1 * np.array([np.cos(0.8), np.sin(0.8), 0.0])
    assert np.linalg.norm(tip - ball) == pytest.approx(0.35, abs=1e-12)


def test_masses_are_those_of_the_boxes_and_points() -> None:
    m = rssr()
    m.mass("rocker", (0.25, 0.0, 0.0), 0.5)
    m.box("rocker", (0, 0, 0), (0, 0.1, 0), width=0.01, thickness=0.01, density=7800.0)
    chain = m.chain([("B", "B_rod", "B_rocker")], ("crank",))
    body = chain.model.inertias[chain.model.getJointId("rocker")]
    assert body.mass == pytest.approx(2700 * 0.25 * 0.02 * 0.01 + 0.5 + 0.078, rel=1e-14)
    first = 2700 * 0.25 * 0.02 * 0.01 * 0.125 + 0.5 * 0.25
    np.testing.assert_allclose(body.mass * body.lever, [first, 0.078 * 0.05, 0.0], atol=1e-15)


def test_any_closure_may_be_given_and_home_is_kept() -> None:
    m = TreeBuilder("welded")
    for name in ("a", "b"):
        m.joint(name, kind=pin.JointModelPX())
        m.mass(name, (0, 0, 0), 1.0)
        m.point(f"{name}_end", name, (0, 0, 0))
    chain = m.chain([Closure(("a_end", "b_end"), "6d")], ["a"], home={"a": 4.0, "b": 4.0})
    assert np.array_equal(chain.references["home"], [4.0, 4.0])  # lengths are no angles
    assert chain.closures[0].kind.value == "6d"


@pytest.mark.parametrize(
    ("say", "kind", "message"),
    [
        (lambda m: m.joint("x", "cronk"), UnknownNameError, "joint 'cronk'.*mean 'crank'"),
        (lambda m: m.joint("x", "universe"), UnknownNameError, "joint 'universe'"),
        (lambda m: m.joint("crank"), InvalidInputError, "must be new"),
        (lambda m: m.joint(""), InvalidInputError, "not empty"),
        (lambda m: m.joint("x", axes=np.diag([1.0, 1.0, -1.0])), InvalidInputError, "right-handed"),
        (lambda m: m.joint("x", axes=2.0 * np.eye(3)), InvalidInputError, "must be a rotation"),
        (lambda m: m.joint("x", at=(0, 0)), InvalidInputError, "position of joint x"),
        (lambda m: m.joint("x", kind=pin.JointModelSpherical()), InvalidInputError, "must have one coordinate"),
        (lambda m: m.point("B_rod", "crank", (0, 0, 0)), InvalidInputError, "must be new"),
        (lambda m: m.point("P", "cronk", (0, 0, 0)), UnknownNameError, "joint 'cronk'"),
        (
            lambda m: m.box("crank", (0, 0, 0), (0, 0, 0), width=0.1, thickness=0.1),
            InvalidInputError,
            "length of a box",
        ),
        (lambda m: m.mass("crank", (0, 0, 0), -1.0), InvalidInputError, "mass on crank"),
        (lambda m: m.chain([], ("crank",), {"crank": 0.0}), InvalidInputError, "rod_y, rod_z, rocker missing"),
        (lambda m: m.chain([], ("crank",), {"cronk": 0.0}), UnknownNameError, "joint of home"),
        (lambda m: m.chain([("B", "B_rod", "C")], ("crank",)), UnknownNameError, "frame of closure B"),
    ],
)
def test_what_cannot_be_built_is_refused_by_name(say, kind, message) -> None:
    with pytest.raises(kind, match=message):
        say(rssr())
