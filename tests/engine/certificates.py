"""Steps of any size by random mechanisms: whatever is certified has to be where a fine subdivision arrives.

python tests/engine/certificates.py 20000 [seed]
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

import calls
import numpy as np
import pinocchio as pin
from mechanisms import add, at, body, close_at, point
from sampled import Driven, Sampled

import fivebar_pin as fb
from fivebar_pin.closures import Coupling, Cylindrical, Distance
from fivebar_pin.engine import tables as e
from fivebar_pin.errors import FiveBarPinError
from fivebar_pin.mechanism.loops import loops_of

FINE = 200
"""Parts that the straight line to a certified place is cut into."""
SAME = 1e-7
"""Distance of two configurations that are one [rad, or chain lengths]."""
_REGULAR = 1e-2
"""Least scaled singular value of the passive columns where a step begins [-]."""

JOINTS = (
    lambda rng: pin.JointModelRZ(),
    lambda rng: pin.JointModelRevoluteUnaligned(unit(rng)),
    lambda rng: pin.JointModelRUBX(),
    lambda rng: pin.JointModelPX(),
    lambda rng: pin.JointModelHelicalUnaligned(unit(rng), rng.uniform(-0.3, 0.3)),
)
ROWS = {"3d": 3, "6d": 6, "revolute": 5, "cylindrical": 4, "distance": 1}


@dataclass
class Found:
    """What became of steps: how many closed, how many were certified, and those that were so wrongly."""

    counts: Counter[str] = field(default_factory=Counter)
    largest: list[float] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)


def unit(rng: np.random.Generator) -> np.ndarray:
    x = rng.normal(size=3)
    return np.asarray(x / np.linalg.norm(x))


def placed(rng: np.random.Generator, planar: bool) -> pin.SE3:
    """Return a placement about one away; of planar mechanisms in the plane."""
    size = np.exp(rng.uniform(-1.0, 0.7))
    if planar:
        x, y = size * np.exp(1j * rng.uniform(-np.pi, np.pi)) * np.array([1.0, -1j])
        return at(x.real, y.real, 0.0, (0.0, 0.0, rng.uniform(-np.pi, np.pi)))
    return at(*size * unit(rng), rng.uniform(-np.pi, np.pi, 3))


def planar_mechanism(rng: np.random.Generator) -> tuple[fb.ClosedChain, np.ndarray]:
    """Return hinges and slides in a plane with one to three loops through whatever bodies, by points and rods."""
    return _mechanism(rng, planar=True, kinds=("3d", "3d", "distance", "6d"), most=3)


def spatial_mechanism(rng: np.random.Generator) -> tuple[fb.ClosedChain, np.ndarray]:
    """Return one or two loops in space, closed by whatever kind."""
    return _mechanism(rng, planar=False, kinds=tuple(ROWS), most=2)


def _mechanism(
    rng: np.random.Generator, *, planar: bool, kinds: tuple[str, ...], most: int
) -> tuple[fb.ClosedChain, np.ndarray]:
    chosen = [str(rng.choice(kinds)) for _ in range(rng.integers(1, most + 1))]
    rows = sum({"3d": 2, "6d": 3}.get(kind, 1) if planar else ROWS[kind] for kind in chosen)
    motors = int(rng.integers(1, 3))
    model, parents = pin.Model(), []
    for k in range(rows + motors):
        parents.append(int(rng.integers(max(0, k - 2), k + 1)) if rng.random() < 0.8 else 0)
        if planar:
            joint = pin.JointModelRZ() if rng.random() < 0.85 else pin.JointModelPX()
        else:
            joint = JOINTS[min(int(rng.geometric(0.5)) - 1, len(JOINTS) - 1)](rng)
        add(model, parents[-1], joint, placed(rng, planar), f"j{k}", body(k))
    q = pin.integrate(model, pin.neutral(model), rng.uniform(-np.pi, np.pi, model.nv))
    closures = [_closure(model, q, rng, kind, planar) for kind in chosen]
    driven = sorted(rng.choice(model.njoints - 1, motors, replace=False).tolist())
    return fb.ClosedChain(model, closures, [f"j{k}" for k in driven]), q


def _closure(model: pin.Model, q: np.ndarray, rng: np.random.Generator, kind: str, planar: bool) -> fb.Closure:
    """Return a closure between two random bodies that is closed at q."""
    joints = tuple(int(j) for j in rng.choice(model.njoints, 2, replace=False))
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    where = data.oMi[joints[0]] * placed(rng, planar)
    if kind == "distance":
        other = data.oMi[joints[1]] * placed(rng, planar)
        names = [
            point(model, j, f"rod{model.nframes}", data.oMi[j].actInv(M))
            for j, M in zip(joints, (where, other), strict=True)
        ]
        return Distance(names, float(np.linalg.norm(where.translation - other.translation)), name=names[0])
    if kind == "cylindrical":
        names = [point(model, j, f"pin{model.nframes}", data.oMi[j].actInv(where)) for j in joints]
        return Cylindrical(names, name=names[0])
    return close_at(model, q, joints, kind, where, int(rng.integers(1 << 30)))


def geared(rng: np.random.Generator) -> tuple[fb.ClosedChain, np.ndarray]:
    """Return a planar five-bar of any lengths whose cranks are geared."""
    a, b, d, g = np.exp(rng.uniform(-1.0, 0.7, 4))
    model = pin.Model()
    left = add(model, 0, pin.JointModelRZ(), at(), "left", body(1))
    left2 = add(model, left, pin.JointModelRZ(), at(a), "left2", body(2))
    right = add(model, 0, pin.JointModelRZ(), at(g), "right", body(3))
    right2 = add(model, right, pin.JointModelRZ(), at(d), "right2", body(4))
    q = rng.uniform(-np.pi, np.pi, 4)
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    meet = data.oMi[left2].act(np.array([b, 0.0, 0.0]))
    names = (
        point(model, left2, "one", at(b)),
        point(model, right2, "two", pin.SE3(np.eye(3), data.oMi[right2].actInv(meet))),
    )
    ratio = float(rng.choice([-1, 1]) * rng.choice([0.5, 1.0, 2.0, 3.0]))
    gears = Coupling({"right": 1.0, "left": ratio}, float(q[2] + ratio * q[0]))
    return fb.ClosedChain(model, (fb.Closure(names, "3d"), gears), ("left",)), q


def platform(rng: np.random.Generator) -> tuple[fb.ClosedChain, np.ndarray]:
    """Return a free body on six rods to six cranks."""
    model, closures = pin.Model(), []
    body_ = add(model, 0, pin.JointModelFreeFlyer(), at(), "platform", body(0))
    cranks = [
        add(model, 0, pin.JointModelRZ(), at(*2.0 * unit(rng), rng.uniform(-np.pi, np.pi, 3)), f"crank{k}", body(k + 1))
        for k in range(6)
    ]
    q = pin.integrate(model, pin.neutral(model), rng.uniform(-0.6, 0.6, model.nv))
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    for k, crank in enumerate(cranks):
        names = (
            point(model, crank, f"tip{k}", at(np.exp(rng.uniform(-2.0, 0.0)))),
            point(model, body_, f"ball{k}", at(*unit(rng))),
        )
        p1, p2 = (data.oMi[j].act(model.frames[model.getFrameId(n)].placement.translation)
                  for j, n in zip((crank, body_), names, strict=True))  # fmt: skip
        closures.append(Distance(names, float(np.linalg.norm(p2 - p1)), name=f"rod{k}"))
    return fb.ClosedChain(model, closures, [f"crank{k}" for k in range(6)]), q


FAMILIES: dict[str, Callable[[np.random.Generator], tuple[fb.ClosedChain, np.ndarray]]] = {
    "planar": planar_mechanism,
    "spatial": spatial_mechanism,
    "geared": geared,
    "platform": platform,
}


def prepared(family: str, rng: np.random.Generator) -> tuple[Sampled, np.ndarray] | None:
    """Return a random mechanism and a closed configuration that is regular, or None."""
    try:
        chain, q = FAMILIES[family](rng)
        loops_of(chain).require_determined()
        s = Sampled(chain)
    except FiveBarPinError:
        return None
    if not s.blocks or not s.close(q):
        return None
    norms = [calls.inverse_norm(s.I, s.W, g) for g in s.blocks for _ in range(8)]
    return (s, s.q) if max(norms) < 1.0 / _REGULAR else None


def step(s: Sampled, q: np.ndarray, rng: np.random.Generator, found: Found) -> bool:
    """Take one step of any size from q, by the tangent or astray from it, and judge it where it is certified.

    Returns:
        Whether it closed.
    """
    chain, loops = s.chain, loops_of(s.chain)
    x0 = loops.actuated_of(q[None])[0]
    s.numbers(e.TO, chain.na)[:] = x0
    s.set(q)
    calls.advance(s.I, s.W, True)
    if s.numbers(e.STATUS, 1)[0] != 0.0:
        return False
    size = np.exp(rng.uniform(np.log(1e-2), np.log(2.0)))
    way = rng.normal(size=chain.na) * loops.column_scale[chain.actuated_index]
    x1 = x0 + size * way / max(1.0, np.abs(way / loops.column_scale[chain.actuated_index]).max())
    N = s.numbers(e.N_HERE, chain.nv * chain.na).reshape(chain.nv, chain.na)
    tangent = N @ (x1 - x0)
    if rng.random() < 0.5:
        astray = size * np.exp(rng.uniform(-3.0, 1.0)) * rng.normal(size=chain.nv) * loops.column_scale
        astray[chain.actuated_index] = 0.0
        tangent = tangent + astray
    s.numbers(e.TO, chain.na)[:] = x1
    closed, certified = calls.attempt(s.I, s.W, tangent)
    found.counts["steps"] += 1
    found.counts["closed"] += closed
    if certified:
        found.counts["certified"] += 1
        moved = np.abs(s.numbers(e.MOVED, chain.nv) / loops.column_scale).max()
        found.largest.append(float(moved))
        arrived, at_end = finely(s, q, x0, x1, FINE)
        if not arrived or apart(s, s.q, at_end) > SAME:
            found.counts["not where 200 parts arrive"] += 1
            arrived, at_end = finely(s, q, x0, x1, 50 * FINE)
            if not arrived or apart(s, s.q, at_end) > SAME:
                found.wrong.append(f"arrived {arrived}, moved {moved:.3g}, {chain}")
    return bool(closed)


def finely(s: Sampled, q: np.ndarray, x0: np.ndarray, x1: np.ndarray, parts: int) -> tuple[bool, np.ndarray]:
    """Follow the straight line in so many parts and return whether it was followed, and to where."""
    X = x0 + np.linspace(0.0, 1.0, parts + 1)[:, None] * (x1 - x0)
    X[-1] = x1
    found = Driven(s.chain, X, q)
    return found.done == len(X), found.q[-1]


def apart(s: Sampled, q0: np.ndarray, q1: np.ndarray) -> float:
    loops = loops_of(s.chain)
    return float(np.abs(loops.tree.difference(q0[None], q1[None])[0] / loops.column_scale).max())


def judge(family: str, count: int, seed: int, per_mechanism: int = 40) -> Found:
    """Take so many steps by mechanisms of a family."""
    found, k = Found(), 0
    while found.counts["steps"] < count:
        rng = np.random.default_rng([seed, k])
        made = prepared(family, rng)
        found.counts["mechanisms" if made else "not usable"] += 1
        k += 1
        for _ in range(per_mechanism if made else 0):
            step(*made, rng, found)
    return found


def main(count: str, seed: str = "0") -> None:
    for family in FAMILIES:
        found = judge(family, int(count), int(seed))
        parts = ", ".join(f"{n} {what}" for what, n in found.counts.items())
        tenths = np.quantile(found.largest or [0.0], [0.5, 0.9, 1.0])
        sys.stdout.write(f"{family}: {parts}; steps certified, half, nine tenths and all up to {tenths}\n")
        for what in found.wrong:
            sys.stdout.write(f"    WRONG: {what}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(*sys.argv[1:])
