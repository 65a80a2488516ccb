"""Rods, sliding hinges and couplings on the whole road: drive, loads, simulation, files, diagnosis, drawing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tied_chains import EXAMPLES, OFFSET, RATIO

import fivebar_pin as fb
from fivebar_pin import viz
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.viz._mechanism import draw_mechanism
from fivebar_pin.viz._recording import Recorder
from fivebar_pin.viz.scene import _drawings

NAMES = pytest.mark.parametrize("name", EXAMPLES)


def moved(name: str, samples: int = 41, reach: float = 0.5) -> tuple[fb.ClosedChain, fb.Trajectory]:
    """Return an example on a motion of its own crank."""
    chain, q = EXAMPLES[name]()
    start = float(loops_of(chain).actuated_of(q[None])[0, 0])
    motion = fb.motion.cycloidal(np.linspace(0.0, 0.7, samples), start, start + reach)
    return chain, fb.drive(chain, motion, near=q)


@NAMES
def test_the_complement_spans_what_the_closures_allow(name):
    chain, path = moved(name)
    loops = loops_of(chain)
    poses = loops.tree.poses(path.q)
    J = loops.see(poses.q).J
    assert path.closure_residual.max() < 1e-13
    assert np.abs(np.matmul(J, path.N)).max() < 1e-11 * np.abs(J).max()
    assert np.linalg.matrix_rank(path.N[0]) == chain.na == chain.nv - loops.rank(J[0])


@NAMES
def test_velocities_and_accelerations_are_derivatives(name):
    chain, path = moved(name, samples=1401)
    tree, h, inner = loops_of(chain).tree, path.t[1] - path.t[0], slice(100, 1301)  # the law is not smooth at its ends
    d = [tree.difference(path.q[inner], path.q[100 + k : 1301 + k]) for k in (-3, -2, -1, 1, 2, 3)]
    v = (45.0 * (d[3] - d[2]) - 9.0 * (d[4] - d[1]) + (d[5] - d[0])) / (60.0 * h)
    np.testing.assert_allclose(v, path.v[inner], rtol=0.0, atol=1e-9 * np.abs(path.v).max())
    w = [path.v[100 + k : 1301 + k] for k in (-3, -2, -1, 1, 2, 3)]
    a = (45.0 * (w[3] - w[2]) - 9.0 * (w[4] - w[1]) + (w[5] - w[0])) / (60.0 * h)
    np.testing.assert_allclose(a, path.a[inner], rtol=0.0, atol=1e-8 * np.abs(path.a).max())


@NAMES
def test_power_and_momentum_balance(name):
    chain, path = moved(name)
    loads = fb.inverse_dynamics(chain, path)
    assert loads.power_residual() < 1e-11
    assert loads.momentum_residual() < 1e-12
    assert loads.reactions.mismatch < 1e-11 * np.abs(loads.tree_torque).max()


@NAMES
def test_forward_dynamics_gives_the_accelerations_back(name):
    chain, path = moved(name)
    loads = fb.inverse_dynamics(chain, path)
    a = fb.forward_dynamics(chain, path.q, path.v, loads.torque)
    np.testing.assert_allclose(a, path.a, rtol=0.0, atol=1e-10 * np.abs(path.a).max())
    # One sample takes another road through the drift of the closures than many.
    one = fb.forward_dynamics(chain, path.q[20], path.v[20], loads.torque[20])
    np.testing.assert_allclose(one, path.a[20], rtol=0.0, atol=1e-10 * np.abs(path.a).max())


@NAMES
def test_energy_is_kept_in_free_motion(name):
    chain, q = EXAMPLES[name]()
    t = np.linspace(0.0, 0.5, 26)
    free = fb.simulate(chain, q, np.zeros(chain.nv), np.zeros(chain.na), t)
    energy = fb.energy_balance(chain, free)
    total = energy.kinetic + energy.potential
    assert free.closure_residual.max() < 1e-13
    assert np.abs(total - total[0]).max() < 1e-10 * max(1.0, np.abs(energy.kinetic).max())
    assert energy.kinetic.max() > 1e-3


@NAMES
def test_the_joints_carry_what_the_bodies_need(name):
    """Newton and Euler for every body that nothing but its joint and closures holds, from the reactions as given."""
    chain, path = moved(name)
    loads = fb.inverse_dynamics(chain, path)
    r, loops = loads.reactions, loops_of(chain)
    seen = loops.see(path.q)
    need = np.array(r.bodies.rate - r.gravity)
    for c in loops.anchored:
        on_second = np.einsum("nmi,nm->ni", seen.T[:, c.rows], r.multipliers[:, c.rows])
        for j, sign in zip(c.joints, (1.0, -1.0), strict=True):
            if j:
                need[:, j - 1] += sign * on_second
    for j in range(chain.model.njoints - 1, 1, -1):
        if chain.model.parents[j]:
            need[:, chain.model.parents[j] - 1] += need[:, j - 1]
    force = need[..., :3]
    known = np.isfinite(r.joint[..., :3])
    np.testing.assert_allclose(r.joint[..., :3][known], force[known], rtol=0.0, atol=1e-9 * np.abs(force).max())


@NAMES
def test_regressors_give_the_loads(name):
    """Torque and reactions are matrices times the inertial parameters, whatever closes the loops."""
    chain, path = moved(name)
    loads = fb.inverse_dynamics(chain, path)
    for quantity in ("torque", "joint_reactions", "closure_reactions", "shaking_moment"):
        direct = np.asarray(getattr(loads, quantity)).reshape(len(path), -1)
        own = fb.balancing.regressor(chain, path, quantity)(chain.inertial_parameters)
        scale = np.abs(np.nan_to_num(direct)).max(initial=1e-3)
        np.testing.assert_allclose(own, direct, rtol=0.0, atol=1e-10 * scale, err_msg=quantity)


@NAMES
def test_the_diagnosis_finds_one_freedom_and_nothing_wrong(name):
    chain, path = moved(name)
    found = fb.diagnose(chain, path.q[0])
    assert found.ok, str(found)
    assert found.mobility == found.generic_mobility == 1
    assert found.actuation.name == "EXACT"
    assert found.gap < 1e-12


CHANGED = {
    "length": lambda name: fb.closures.Distance(("crank_end", "rocker_end"), 1.15, name=name),
    "ratio": lambda name: fb.closures.Coupling({"left": 2.6, "right": 1.0}, OFFSET, name=name),
    "offset": lambda name: fb.closures.Coupling({"left": RATIO, "right": 1.0}, 1.5, name=name),
    "joint": lambda name: fb.closures.Coupling({"left": RATIO, "right_elbow": 1.0}, OFFSET, name=name),
    "axis": lambda name: fb.closures.Cylindrical(("sleeve", "shaft"), (0.0, 0.1, 1.0), name=name),
    "kind": lambda name: fb.closures.Revolute(("sleeve", "shaft"), name=name),
}


@pytest.mark.parametrize(
    ("name", "what"),
    [
        ("rod four-bar", "length"),
        ("geared five-bar", "ratio"),
        ("geared five-bar", "offset"),
        ("geared five-bar", "joint"),
        ("sliding hinge", "axis"),
        ("sliding hinge", "kind"),
    ],
)
def test_conditions_of_another_closure_are_refused(name, what):
    chain, _ = EXAMPLES[name]()
    last = chain.closures[-1]
    conditions = fb.balance_conditions(chain, "force")
    heavier = chain.with_inertial_parameters(2.0 * chain.inertial_parameters)
    assert fb.balancing.balance_problem(heavier, "force", conditions=conditions).conditions is conditions
    other = replace(chain, closures=(*chain.closures[:-1], CHANGED[what](last.name)))
    with pytest.raises(fb.FiveBarPinError, match="must belong to"):
        fb.balancing.balance_problem(other, "force", conditions=conditions)


@NAMES
def test_urdf_and_sidecar_give_it_back(name, tmp_path):
    chain, path = moved(name)
    fb.save(chain, tmp_path / "same.urdf")
    again = fb.load(tmp_path / "same.urdf")
    same(chain, again, path, tolerance=1e-12)


@NAMES
def test_mjcf_gives_it_back_or_says_what_it_cannot(name, tmp_path):
    chain, path = moved(name)
    if any(c.kind == "cylindrical" for c in chain.closures):
        with pytest.raises(fb.FiveBarPinError, match=r"closure pi?n?\w+ = 'cylindrical' but has no word in MJCF"):
            fb.save(chain, tmp_path / "same.xml")
        return
    fb.save(chain, tmp_path / "same.xml")
    same(chain, fb.load(tmp_path / "same.xml"), path, tolerance=1e-11)


def same(chain: fb.ClosedChain, again: fb.ClosedChain, path: fb.Trajectory, *, tolerance: float) -> None:
    """Check that two chains have the same closures and loads."""
    assert [(type(c), c.name, c.joins) for c in again.closures] == [(type(c), c.name, c.joins) for c in chain.closures]
    for c, d in zip(chain.closures, again.closures, strict=True):
        assert c.values().keys() == d.values().keys()
        for key, value in c.values().items():
            np.testing.assert_allclose(d.values()[key], value, rtol=1e-14, atol=1e-14)
    assert (again.nq, again.nv, again.actuated) == (chain.nq, chain.nv, chain.actuated)
    driven = loops_of(chain).actuated_of(path.q)
    motion = fb.Motion(path.t, driven, *(x[:, chain.actuated_index] for x in (path.v, path.a)))
    other = fb.drive(again, motion, near=path.q[0])
    one, two = fb.inverse_dynamics(chain, path), fb.inverse_dynamics(again, other)
    scale = np.abs(one.torque).max()
    np.testing.assert_allclose(two.torque, one.torque, rtol=0.0, atol=tolerance * max(1.0, scale))
    np.testing.assert_allclose(other.q, path.q, rtol=0.0, atol=tolerance)


@NAMES
def test_the_viewer_draws_the_lines_from_end_to_end(name):
    """A rod, or a line between coupled axes, begins and ends where its two bodies have it at every keyframe."""
    chain, path = moved(name, samples=9)
    drawing = _drawings([viz.Shown(chain, path)], 1.0, False)[0]
    recorder = Recorder()
    draw_mechanism(recorder, "m", drawing)
    tracks = {(t["path"], t["name"]): np.asarray(t["values"]) for t in recorder._tracks}
    poses, drawn = loops_of(chain).tree.poses(path.q[drawing.keys]), 0
    for anchored in loops_of(chain).anchored:
        for number, s in enumerate(anchored.segments()):
            start, end = (poses.p[j] + poses.R[j] @ p for j, p in zip(s.joints, s.points, strict=True))
            node = f"m/closure {anchored.closure.name} line {number + 1}"
            if np.abs(end - start).max() < 1e-9:  # coupled joints on one axis
                assert (node, ".position") not in tracks
                continue
            R = Rotation.from_quat(tracks[node, ".quaternion"]).as_matrix()
            tip = tracks[node, ".position"] + R[:, :, 2] * tracks[f"{node}/stretch", ".scale"][:, 2:]
            np.testing.assert_allclose(tracks[node, ".position"], start, rtol=0.0, atol=1e-12)
            np.testing.assert_allclose(tip, end, rtol=0.0, atol=1e-12)
            drawn += 1
    assert drawn == {"planetary train": 2, "sliding hinge": 0, "planar sliding hinge": 0}.get(name, 1)
