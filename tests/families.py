"""Random members of families of mechanisms, for tests that ask a law of many.

Every builder draws where the joints lie in one closed configuration, so that its mechanism can be assembled, and then
turns each joint's zero by a random angle, so that the neutral configuration is not that one. With `home` the closed
configuration is a reference of the model, else the library has to find one.
"""

from __future__ import annotations

import mechanisms
import numpy as np
import pinocchio as pin

import fivebar_pin as fb

ORIGIN = pin.SE3.Identity()
CHAINS = {  # links by the joints they carry; a joint joins two links
    "watt": ("1 2 3", "1 4 5", "2 6", "4 6", "3 7", "5 7"),  # the ternary links share joint 1
    "stephenson": ("1 2 3", "4 5 6", "1 4", "2 5", "3 7", "6 7"),  # the ternary links do not meet
}


def six_bar(kind: str, seed: int, *, home: bool = False) -> fb.ClosedChain:
    """Return a six-bar of kind "watt" or "stephenson" on a random one of its six links, driven next to the ground.

    Seven hinges lie anywhere in the unit square.
    """
    rng = np.random.default_rng(seed)
    links = [tuple(map(int, text.split())) for text in CHAINS[kind]]
    points = dict(zip(range(1, 8), rng.uniform(0.0, 1.0, (7, 2)), strict=True))
    return _planar(f"{kind}_{seed}", links, points, int(rng.integers(6)), rng, home=home)


def _planar(name: str, links: list, points: dict, ground: int, rng: np.random.Generator, *, home: bool):
    """Build a planar linkage of one degree of freedom from its graph, breadth first from the ground."""
    b = _Builder(name, rng)
    owner, used = {ground: 0}, set()
    queue = [ground]
    while queue:
        link = queue.pop(0)
        for j in links[link]:
            (other,) = (k for k, joints in enumerate(links) if j in joints and k != link)
            if other in owner:
                continue
            used.add(j)
            where = pin.SE3(np.eye(3), np.r_[points[j], 0.0])
            owner[other] = b.joint(owner[link], pin.JointModelRZ(), where, f"hinge{j}")
            queue.append(other)
    for j in sorted(set(points) - used):
        first, second = (owner[k] for k, joints in enumerate(links) if j in joints)
        b.close(first, second, np.r_[points[j], 0.0], f"pin{j}")
    driven = next(n for n in list(b.model.names)[1:] if b.model.parents[b.model.getJointId(n)] == 0)
    return b.chain((driven,), home=home)


class _Builder:
    """An open tree grown in its closed configuration, where joint frames are given in the world."""

    def __init__(self, name: str, rng: np.random.Generator) -> None:
        self.model = pin.Model()
        self.model.name = name
        self.rng = rng
        self.world: list[pin.SE3] = [ORIGIN]  # frames of the joints in the closed configuration
        self.home: list[np.ndarray] = []
        self.closures: list[fb.Closure] = []

    def joint(self, parent: int, joint: object, where: pin.SE3, name: str) -> int:
        """Add a joint whose moving frame lies at `where` when the loops are closed."""
        alone = pin.Model()
        alone.addJoint(0, joint, ORIGIN, "j")
        turn = 2.0 if joint.shortname().startswith("JointModelR") else 0.3  # type: ignore[attr-defined]
        q = pin.integrate(alone, pin.neutral(alone), self.rng.uniform(-turn, turn, alone.nv))
        data = alone.createData()
        pin.forwardKinematics(alone, data, q)
        placement = self.world[parent].inverse() * where * data.oMi[1].inverse()
        index = mechanisms.add(self.model, parent, joint, placement, name, mechanisms.body(len(self.world)))
        self.world.append(where)
        self.home.append(q)
        return index

    def close(self, first: int, second: int, point: np.ndarray, name: str) -> None:
        """Close two bodies at a point of the world."""
        frames = []
        for k, body in enumerate((first, second)):
            local = pin.SE3(np.eye(3), self.world[body].actInv(point))
            frames.append(mechanisms.point(self.model, body, f"{name}_{k}", local))
        self.closures.append(fb.Closure((frames[0], frames[1]), "3d", name=name))

    def chain(self, actuated: tuple[str, ...], *, home: bool) -> fb.ClosedChain:
        """Return the mechanism; `home` keeps the closed configuration as a reference."""
        if home:
            self.model.referenceConfigurations["home"] = np.concatenate(self.home)
        return fb.ClosedChain(self.model, tuple(self.closures), actuated)


def planar_rrr(legs: int, seed: int, *, home: bool = False) -> fb.ClosedChain:
    """Return a planar platform on legs of three hinges each, mobility 3, driven at the bases of the first three.

    Bases lie about the unit circle, the platform's hinges about one of a third of it, elbows off the middle.
    """
    rng = np.random.default_rng(seed)
    b = _Builder(f"planar_{legs}rrr_{seed}", rng)
    turn = 2.0 * np.pi * (np.arange(legs) + rng.uniform(-0.3, 0.3, legs)) / legs
    bases = np.exp(1j * turn) * rng.uniform(0.8, 1.2, legs)
    ends = np.exp(1j * (turn + rng.uniform(-0.5, 0.5))) * rng.uniform(0.2, 0.45, legs) + complex(
        *rng.normal(0, 0.05, 2)
    )
    away = ends - bases
    elbows = bases + 0.5 * away + 1j * away * rng.choice([-1.0, 1.0], legs) * rng.uniform(0.3, 0.7, legs)
    platform = 0
    for k in range(legs):
        upper = b.joint(0, pin.JointModelRZ(), _flat(bases[k]), f"upper{k}")
        lower = b.joint(upper, pin.JointModelRZ(), _flat(elbows[k]), f"lower{k}")
        if k == 0:
            platform = b.joint(lower, pin.JointModelRZ(), _flat(ends[0]), "platform")
        else:
            b.close(platform, lower, np.r_[ends[k].real, ends[k].imag, 0.0], f"leg{k}")
    return b.chain(("upper0", "upper1", "upper2"), home=home)


def _flat(point: complex) -> pin.SE3:
    return pin.SE3(np.eye(3), np.array([point.real, point.imag, 0.0]))


def six_ups(seed: int, *, home: bool = False) -> fb.ClosedChain:
    """Return a Stewart-Gough platform: six legs of universal, sliding and ball joint, driven at the slides.

    A universal joint is two hinges with a cross that has a mass of its own; the platform hangs on the ball joint of the
    first leg, the other balls are closures. No leg can spin about itself.
    """
    rng = np.random.default_rng(seed)
    b = _Builder(f"six_ups_{seed}", rng)
    bases, ends, pose = _platform(rng)
    platform = 0
    for k in range(6):
        direction = (ends[k] - bases[k]) / np.linalg.norm(ends[k] - bases[k])
        y, z = float(np.arctan2(-direction[2], direction[0])), float(np.arcsin(direction[1]))
        first = pin.SE3(pin.rpy.rpyToMatrix(0.0, y, 0.0), bases[k])
        second = first * pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, z), np.zeros(3))
        cross = b.joint(0, pin.JointModelRY(), first, f"cross{k}")
        barrel = b.joint(cross, pin.JointModelRZ(), second, f"barrel{k}")
        middle = pin.SE3(second.rotation, 0.5 * (bases[k] + ends[k]))
        rod = b.joint(barrel, pin.JointModelPX(), middle, f"rod{k}")
        if k == 0:
            platform = b.joint(rod, pin.JointModelSpherical(), pin.SE3(pose.rotation, ends[0]), "platform")
        else:
            b.close(platform, rod, ends[k], f"ball{k}")
    return b.chain(tuple(f"rod{k}" for k in range(6)), home=home)


def six_rus(seed: int, *, home: bool = False) -> fb.ClosedChain:
    """Return a platform on six legs of hinge, universal and ball joint, driven at the hinges; no leg can spin."""
    rng = np.random.default_rng(seed)
    b = _Builder(f"six_rus_{seed}", rng)
    bases, ends, pose = _platform(rng)
    platform = 0
    for k in range(6):
        out = np.r_[bases[k, :2], 0.0] / np.linalg.norm(bases[k, :2])
        side = np.cross([0.0, 0.0, 1.0], out)
        turn = np.stack([out, np.array([0.0, 0.0, 1.0]), -side], axis=1)  # the hinge turns about the ring
        turn = turn @ pin.exp3(np.array([0.0, 0.0, 1.0]) * rng.uniform(-0.5, 0.5))
        elbow = bases[k] + turn[:, 0] * rng.uniform(0.25, 0.4)
        arm = b.joint(0, pin.JointModelRZ(), pin.SE3(turn, bases[k]), f"arm{k}")
        direction = turn.T @ (ends[k] - elbow) / np.linalg.norm(ends[k] - elbow)
        y, z = float(np.arctan2(-direction[2], direction[0])), float(np.arcsin(direction[1]))
        first = pin.SE3(turn @ pin.rpy.rpyToMatrix(0.0, y, 0.0), elbow)
        second = first * pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, z), np.zeros(3))
        cross = b.joint(arm, pin.JointModelRY(), first, f"cross{k}")
        rod = b.joint(cross, pin.JointModelRZ(), second, f"rod{k}")
        if k == 0:
            platform = b.joint(rod, pin.JointModelSpherical(), pin.SE3(pose.rotation, ends[0]), "platform")
        else:
            b.close(platform, rod, ends[k], f"ball{k}")
    return b.chain(tuple(f"arm{k}" for k in range(6)), home=home)


def _platform(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, pin.SE3]:
    """Return six points about a unit circle, six of a smaller tilted one above, and its pose."""
    turn = np.pi / 3.0 * (np.arange(6) + rng.uniform(-0.35, 0.35, 6))
    ring = np.stack([np.cos(turn), np.sin(turn), np.zeros(6)], axis=1)
    bases = ring * rng.uniform(0.8, 1.2, (6, 1)) + rng.uniform(-0.05, 0.05, (6, 3))
    own = 0.5 * ring * rng.uniform(0.8, 1.2, (6, 1)) + rng.uniform(-0.05, 0.05, (6, 3))
    pose = pin.SE3(pin.rpy.rpyToMatrix(*rng.uniform(-0.2, 0.2, 2), rng.uniform(0.2, 0.5)), np.array([0.0, 0.0, 0.9]))
    return bases, np.array([pose.act(p) for p in own]), pose


def bricard(seed: int, *, home: bool = False) -> fb.ClosedChain:
    """Return a line-symmetric Bricard loop: six hinges, mobility one against nil by count.

    Hinges 4 to 6 are hinges 1 to 3 turned by half a turn about a line; the last one is the closure.
    """
    rng = np.random.default_rng(seed)
    b = _Builder(f"bricard_{seed}", rng)
    half = pin.SE3(np.diag([-1.0, -1.0, 1.0]), np.zeros(3))
    axes = [pin.SE3(pin.rpy.rpyToMatrix(*rng.uniform(-1.5, 1.5, 3)), rng.uniform(-0.5, 0.5, 3)) for _ in range(3)]
    axes += [half * axis for axis in axes]
    joint = 0
    for k, axis in enumerate(axes[:5]):
        joint = b.joint(joint, pin.JointModelRZ(), axis, f"hinge{k}")
    frames = [mechanisms.point(b.model, body, f"last_{body}", b.world[body].inverse() * axes[5]) for body in (0, joint)]
    b.closures.append(fb.Closure((frames[0], frames[1]), "revolute", name="last"))
    return b.chain(("hinge0",), home=home)
