"""Whether a mechanism moves in a plane is decided once, for diagnosis, balancing and pictures alike."""

from __future__ import annotations

import mechanisms
import numpy as np
import pinocchio as pin
import pytest
from mechanisms import TILTED, add, at, body, point

import fivebar_pin as fb
from fivebar_pin.diagnosis import inertias
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.mechanism.mobility import site_at
from fivebar_pin.mechanism.plane import PARALLEL, plane_normal
from fivebar_pin.viz._geometry import find_view


def gantry(*, base: pin.SE3 = mechanisms.AT_ORIGIN) -> fb.ClosedChain:
    """Return a portal: two slides along x carry one along y. Nothing turns."""
    model = pin.Model()
    first = add(model, 0, pin.JointModelPX(), base, "along_x", body(1))
    add(model, first, pin.JointModelPY(), at(0.1, 0.2), "along_y", body(2))
    second = add(model, 0, pin.JointModelPX(), base * at(0.0, 1.0), "along_x_too", body(3))
    names = point(model, first, "beam", at(0.0, 0.5)), point(model, second, "carriage", at(0.0, -0.5))
    return fb.ClosedChain(model, (fb.Closure(names, "3d"),), ("along_x", "along_y"))


def two_four_bars(tilt: float, *, base: pin.SE3 = mechanisms.AT_ORIGIN) -> fb.ClosedChain:
    """Return two four-bars 0.3 m apart, the second turned out of the plane of the first by `tilt`."""
    model, closures = pin.Model(), []
    for k, where in enumerate((base, base * at(0.2, 0.1, 0.3, (tilt, 0.0, 0.0)))):
        crank = add(model, 0, pin.JointModelRZ(), where, f"crank{k}", body(10 * k + 1))
        coupler = add(model, crank, pin.JointModelRZ(), at(0.4), f"coupler{k}", body(10 * k + 2))
        rocker = add(model, 0, pin.JointModelRZ(), where * at(1.0), f"rocker{k}", body(10 * k + 3))
        ends = point(model, coupler, f"coupler{k}_end", at(1.1)), point(model, rocker, f"rocker{k}_end", at(0.9))
        closures.append(fb.Closure(ends, "3d", name=f"pin{k}"))
    return fb.ClosedChain(model, closures, ("crank0", "crank1"))


def joints(*kinds: object) -> fb.ClosedChain:
    """Return an open tree of these joints, each on the one before."""
    model, parent = pin.Model(), 0
    for k, kind in enumerate(kinds):
        parent = add(model, parent, kind, at(0.3, 0.1), f"joint{k}", body(k))
    return fb.ClosedChain(model, (), tuple(f"joint{k}" for k, kind in enumerate(kinds) if kind.nv == 1))


FAR = pin.SE3(TILTED.rotation, np.array([3e4, -2e4, 1e4]))  # where a lever of the world's origin would swamp the rest
PLANAR = {
    "four-bar": mechanisms.four_bar(),
    "four-bar in a tilted plane": mechanisms.four_bar(base=TILTED),
    "four-bar far away": mechanisms.four_bar(base=FAR),
    "slider-crank": mechanisms.slider_crank(base=TILTED),
    "gantry": gantry(),
    "gantry in a tilted plane": gantry(base=TILTED),
    "two linkages in parallel planes": two_four_bars(0.0),
    "the same far away": two_four_bars(0.0, base=FAR),
    "a tilt of 1e-8 rad": two_four_bars(1e-8),
    "a tilt of 1e-8 rad far away": two_four_bars(1e-8, base=FAR),
    "a slide tilted by 1e-8 rad": joints(
        pin.JointModelRZ(), pin.JointModelPrismaticUnaligned(np.array([1.0, 0, 1e-8]))
    ),
}
SPATIAL = {
    "a tilt of 1e-3 rad": two_four_bars(1e-3),
    "a tilt of 1e-5 rad": two_four_bars(1e-5),
    "a spatial four-bar": mechanisms.rssr(),
    "a screw": joints(pin.JointModelRZ(), pin.JointModelHZ(0.01)),
    "a slide along the hinge": joints(pin.JointModelRZ(), pin.JointModelPZ()),
    "a slide tilted by 1e-3 rad": joints(
        pin.JointModelRZ(), pin.JointModelPrismaticUnaligned(np.array([1.0, 0, 1e-3]))
    ),
    "three slides": joints(pin.JointModelPX(), pin.JointModelPY(), pin.JointModelPZ()),
    "one slide, in no plane more than in another": joints(pin.JointModelPX()),
    "a ball": joints(pin.JointModelSpherical()),
}


def verdicts(chain: fb.ClosedChain) -> tuple[bool, bool, bool]:
    """Return what diagnosis, balancing and pictures make of a chain."""
    q = pin.neutral(chain.model)
    return (
        inertias.normals(chain, site_at(loops_of(chain), q)) is not None,
        bool(fb.balance_conditions(chain, "force").space.planar),
        find_view(chain, q).planar,
    )


@pytest.mark.parametrize("chain", PLANAR.values(), ids=PLANAR.keys())
def test_planar_is_planar_for_all(chain):
    assert verdicts(chain) == (True, True, True)


@pytest.mark.parametrize("name", SPATIAL)
def test_spatial_is_spatial_for_all(name):
    if name == "a ball":  # nothing to drive: no conditions to ask for
        chain = SPATIAL[name]
        assert inertias.normals(chain, site_at(loops_of(chain), pin.neutral(chain.model))) is None
        assert not find_view(chain, pin.neutral(chain.model)).planar
    else:
        assert verdicts(SPATIAL[name]) == (False, False, False)


@pytest.mark.parametrize("make", [mechanisms.four_bar, gantry], ids=["hinges", "slides"])
def test_the_normal_is_that_of_the_plane_largest_component_positive(make):
    for base in (TILTED, FAR, pin.SE3(pin.rpy.rpyToMatrix(np.pi, 0.0, 0.0), np.zeros(3))):
        chain = make(base=base)
        n = plane_normal(loops_of(chain).tree.poses(pin.neutral(chain.model)[None]).S, chain.length)
        z = base.rotation[:, 2]
        np.testing.assert_allclose(n, z * np.sign(z[np.argmax(np.abs(z))]), atol=1e-15)


def test_the_bound_on_tilts_is_the_one_that_is_written_down():
    below, above = (two_four_bars(factor * PARALLEL) for factor in (0.9, 1.1))
    assert verdicts(below) == (True, True, True)
    assert verdicts(above) == (False, False, False)


def test_a_gantry_has_the_conditions_of_its_two_masses_in_the_plane():
    """What slides along x moves all three masses, what slides along y the second alone: two conditions."""
    assert (
        fb.balance_conditions(gantry(), "force").rank == fb.balance_conditions(gantry(base=TILTED), "force").rank == 2
    )


@pytest.mark.parametrize("length", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize(("advance", "planar"), [(0.5, True), (2.0, False)])
def test_a_screw_leaves_the_plane_by_its_advance_over_the_length_of_the_chain(length, advance, planar):
    """What a turn lifts out of the plane is judged like the tilt of an axis, whatever the unit of length."""
    S = np.zeros((1, 6, 1))
    S[0, 2, 0], S[0, 5, 0] = advance * PARALLEL * length, 1.0
    assert (plane_normal(S, length) is not None) is planar
