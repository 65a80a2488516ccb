"""Random balancing problems, and the same problems written for cvxpy from the mathematics alone.

`draw` makes the arguments of `balance_problem`; `decided` says what an independent program thinks of them: bodies by
their second moments (S, h, m), regions as moment bounds, loads by inverse dynamics of unit changes. Nothing of the
library's cones is used. A new argument is drawn in one place and written in one place.
"""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import mechanisms
import numpy as np

import fivebar_pin as fb
from fivebar_pin.balancing import BalanceConditions, Ball, Box, Disc, Ellipsoid
from fivebar_pin.dynamics import inverse_dynamics

PAIRS = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))  # order of the inertia entries in ten parameters
CAP = 10.0  # the documented bound on an added mass that has none of its own [moving masses]
SAMPLES = 17
TIGHT = {"tol_gap_abs": 1e-10, "tol_gap_rel": 1e-10, "tol_feas": 1e-10}  # bounds on density are small numbers


@dataclass(frozen=True, eq=False)
class Case:
    """One problem: `balance_problem(chain, kind, **arguments)`, solved for `minimise`."""

    name: str
    chain: fb.ClosedChain
    kind: str | None
    minimise: dict[str, float]
    arguments: dict[str, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        shown = {k: v for k, v in self.arguments.items() if k not in ("motions", "objectives")}
        return f"{self.name} {self.kind} {self.minimise} {shown}"


@cache
def moved(name: str) -> tuple[fb.ClosedChain, fb.Trajectory]:
    """Return a shipped mechanism swaying about its home."""
    chain = fb.load(fb.io.shipped_path(name))
    q0 = next(iter(chain.references.values()))
    t = np.linspace(0.0, 1.0, SAMPLES)
    at = q0[chain.actuated_index]
    size = 0.3 * chain.length if name == "slider_crank_" else 0.3
    swings = [fb.motion.harmonic(t, x, size, period=1.0 / (k + 1), phase=-0.5 * np.pi) for k, x in enumerate(at)]
    return chain, fb.drive(chain, fb.motion.combine(*swings), near=q0)


SHIPPED = (
    "four_bar_crank_rocker",
    "five_bar_case_I",
    "six_bar_watt",
    "six_bar_stephenson",
    "planar_3rrr",
    "delta",
    "spatial_rssr",
)


def mechanism(rng: np.random.Generator) -> tuple[str, fb.ClosedChain, fb.Trajectory]:
    """Draw a mechanism, its masses and a motion of it."""
    k = int(rng.integers(len(SHIPPED) + 2))
    if k < len(SHIPPED):
        name = SHIPPED[k]
        chain, path = moved(name)
    else:
        name, chain, path = "random four-bar", *_four_bar(rng)
    factors = rng.uniform(0.3, 3.0, (len(chain.joints), 1))
    return name, chain.with_inertial_parameters(chain.inertial_parameters * factors), path


def _four_bar(rng: np.random.Generator) -> tuple[fb.ClosedChain, fb.Trajectory]:
    lengths = np.array([0.4, 1.1, 0.9, 1.0]) + rng.uniform(-0.08, 0.08, 4)  # the crank turns fully
    chain = mechanisms.four_bar(lengths)
    t = np.linspace(0.0, 1.0, SAMPLES)
    q0 = fb.assembly_modes(chain, [0.5])[0]
    return chain, fb.drive(chain, fb.motion.harmonic(t, 0.5, 0.3, period=1.0), near=q0)


def draw(rng: np.random.Generator) -> Case:
    """Draw a problem."""
    name, chain, path = mechanism(rng)
    mode = "add" if rng.random() < 0.7 else "redesign"
    kind = str(rng.choice(["force", "force", "force", "dynamic", "static", "none"]))
    arguments: dict[str, Any] = {"mode": mode, "motions": [path], "region": _region(rng, chain)}
    if rng.random() < 0.3:
        low = 0.0 if rng.random() < 0.7 else float(rng.uniform(0.0, 0.1)) * chain.mass
        arguments["masses"] = (low, float(low + chain.mass * 10.0 ** rng.uniform(-1.0, 1.0)))
    if mode == "add":
        heavy = [j for j, m in zip(chain.joints, chain.inertial_parameters[:, 0], strict=True) if m > 0.0]
        if rng.random() < 0.35:
            arguments["remove"] = [str(j) for j in rng.choice(heavy, int(rng.integers(1, len(heavy) + 1)), False)]
    arguments["material"] = None if rng.random() < 0.5 else float(10.0 ** rng.uniform(3.0, 4.5))
    arguments["thickness"] = float(rng.uniform(0.05, 0.4)) * chain.length
    round_off = isinstance(arguments["region"], Ellipsoid)  # a disc within an ellipse takes more to write down
    if mode == "add" and _planar(name) and not round_off and rng.random() < 0.3:
        arguments["counterweight"] = Disc(float(rng.uniform(2e3, 2e4)), 0.1 * chain.length, arm=0.0)
    loads = inverse_dynamics(chain, path)
    if rng.random() < 0.25:
        peak = float(np.abs(loads.torque).max())
        arguments["limits"] = {"peak_torque": peak * float(10.0 ** rng.uniform(-0.7, 1.0))}
    terms = ["added_mass", "rms_torque", "peak_torque", "rms_shaking_moment", "distance"]
    chosen = [str(t) for t in rng.choice(terms, int(rng.integers(1, 3)), False)]
    weights = {t: float(rng.uniform(0.3, 3.0)) for t in chosen}
    arguments["objectives"] = tuple(weights)
    return Case(name, chain, None if kind == "none" else kind, weights, arguments)


def _planar(name: str) -> bool:
    return name not in ("delta", "spatial_rssr")


def _region(rng: np.random.Generator, chain: fb.ClosedChain) -> Ball | Box | Ellipsoid | None:
    L = chain.length
    center = L * rng.uniform(-0.2, 0.2, 3) if rng.random() < 0.5 else np.zeros(3)
    size = L * rng.uniform(0.3, 3.0, 3)
    choice = int(rng.integers(4))
    if choice == 0:
        return None
    if choice == 1:
        return Ball(float(size[0]), center)
    return Box(2.0 * size, center) if choice == 2 else Ellipsoid(size, center)


def decided(case: Case, conditions: BalanceConditions | None, *, solver: str = "CLARABEL") -> tuple[str, float, float]:
    """Return "optimal" and the optimum, or "infeasible" and infinity, or what else cvxpy says; and the typical size."""
    import cvxpy as cp

    written = Written(case, conditions)
    problem = cp.Problem(cp.Minimize(written.cost), written.constraints)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of inaccurate solutions: the status says so too
        for settings in (TIGHT, {}) if solver == "CLARABEL" else ({},):
            with contextlib.suppress(cp.error.SolverError):
                problem.solve(solver=solver, **settings)
                break
        else:
            return "unsolved", float("nan"), written.size()
    return problem.status, float("inf") if problem.value is None else float(problem.value), written.size()


class Written:
    """The problem in cvxpy: masses in moving masses, lengths in chain lengths."""

    def __init__(self, case: Case, conditions: BalanceConditions | None) -> None:
        import cvxpy as cp

        self.cp, self.case, self.chain = cp, case, case.chain
        self.M, self.L = self.chain.mass or 1.0, self.chain.length
        self.conditions = conditions
        self.planar = _planar(case.name)
        self.d = 2 if self.planar else 3
        self.constraints: list[Any] = []
        nb = len(self.chain.joints)
        self.present = self.chain.inertial_parameters / self.units()
        add = case.arguments["mode"] == "add"
        removed = case.arguments.get("remove", ())
        self.pi = []
        for b in range(nb):
            pi = self.present[b] if add or not self.chosen(b) else np.zeros(10)
            if self.chosen(b):
                pi = pi + self.material(b)
            if self.chain.joints[b] in removed:
                pi = pi - self.removed(b)
            self.pi.append(pi)
        self.all = cp.hstack(self.pi)
        scaled_all = cp.multiply(self.all, np.tile(self.units(), nb))
        self.conditions_hold(scaled_all)
        self.loads(scaled_all)
        self.cost = sum(w * self.term(t) for t, w in case.minimise.items())

    def units(self) -> np.ndarray:
        return self.M * self.L ** np.array([0.0, 1, 1, 1, 2, 2, 2, 2, 2, 2])

    def axes(self, b: int) -> np.ndarray:
        """In-plane directions in joint axes (2, 3), or all three."""
        if not self.planar:
            return np.eye(3)
        return np.asarray(self.plane().axes[b, :2])

    def plane(self) -> Any:
        from fivebar_pin.balancing import balance_conditions

        if self.conditions is not None:
            return self.conditions.space
        return balance_conditions(self.chain, "force", near=self.case.arguments["motions"][0].q[0]).space

    def chosen(self, b: int) -> bool:
        """Whether the body influences the conditions."""
        if self.conditions is None:
            return True
        own = self.conditions.matrix[:, 10 * b : 10 * b + 10] * self.units() / self.M
        return bool(np.abs(own).max(initial=0.0) > 1e-9)

    def body(self, b: int) -> tuple[Any, Any, Any, Any]:
        """Variables m, h, S of a body with P = [[S, h], [h, m]] >= 0, and its ten parameters."""
        cp, d = self.cp, self.d
        P = cp.Variable((d + 1, d + 1), PSD=True)
        S, h, m = P[:d, :d], P[:d, d], P[d, d]
        E = self.axes(b)
        lift = np.zeros((4, d + 1))  # planar material is flat, at the height of the present mass centre
        lift[:3, :d], lift[3, d] = E.T, 1.0
        if self.planar and self.present[b, 0] > 0.0:
            n = np.asarray(self.plane().axes[b, 2])
            lift[:3, d] = n * float(n @ self.present[b, 1:4]) / self.present[b, 0]
        whole = lift @ P @ lift.T
        h3, S3 = whole[:3, 3], whole[:3, :3]
        I3 = cp.trace(S3) * np.eye(3) - S3
        return m, h, S, cp.hstack([m, h3, *(I3[i, j] for i, j in PAIRS)])

    def material(self, b: int) -> Any:
        m, h, S, pi = self.body(b)
        self.inside(b, m, h, S)
        masses = self.case.arguments.get("masses")
        if masses is None and self.case.arguments["mode"] == "redesign":
            masses = tuple(k * self.present[b, 0] * self.M for k in (0.5, 2.0))
        low, high = (0.0, CAP) if masses is None else np.array(masses) / self.M
        self.constraints += [m >= low, m <= high]
        disc = self.case.arguments.get("counterweight")
        if disc is None:
            self.no_denser(m, h, S)
        else:
            self.disc(disc, b, m, h, S)
        return pi

    def removed(self, b: int) -> Any:
        """What is taken from a body is a body in space, and so is what is left, of planar mechanisms too."""
        cp, E = self.cp, self.axes(b)
        P = cp.Variable((4, 4), PSD=True)
        S3, h3, m = P[:3, :3], P[:3, 3], P[3, 3]
        I3 = cp.trace(S3) * np.eye(3) - S3
        h, S = E @ h3, E @ S3 @ E.T
        self.inside(b, m, h, S)
        self.no_denser(m, h, S)
        self.constraints += [m <= 0.5 * self.present[b, 0], self.pseudo(self.present[b]) - P >> 0]
        return cp.hstack([m, h3, *(I3[i, j] for i, j in PAIRS)])

    def pseudo(self, pi: Any) -> Any:
        cp = self.cp
        I = {}
        for k, (i, j) in enumerate(PAIRS):
            I[i, j] = I[j, i] = pi[4 + k]
        half = 0.5 * (I[0, 0] + I[1, 1] + I[2, 2])
        rows = [[(half if i == j else 0.0) - I[i, j] for j in range(3)] + [pi[1 + i]] for i in range(3)]
        rows.append([pi[1], pi[2], pi[3], pi[0]])
        return cp.bmat(rows)

    def no_denser(self, m: Any, h: Any, S: Any) -> None:
        """At least the inertia of the disc, or the determinant of the ball, of that density."""
        cp, density = self.cp, self.case.arguments["material"]
        if density is None:
            return
        if self.planar:
            least = self.M / (2.0 * np.pi * density * self.case.arguments["thickness"] * self.L**2)
            self.constraints.append(cp.quad_over_lin(h, m) + least * cp.square(m) <= cp.trace(S))
            return
        least = 0.2 * (3.0 * self.M / (4.0 * np.pi * density)) ** (2.0 / 3.0) / self.L**2
        W, Z = cp.Variable((3, 3), PSD=True), cp.Variable((3, 3))
        column = cp.reshape(h, (3, 1), order="C")
        self.constraints += [
            cp.bmat([[S - W, column], [column.T, cp.reshape(m, (1, 1), order="C")]]) >> 0,
            cp.bmat([[W, Z], [Z.T, cp.diag(cp.diag(Z))]]) >> 0,
            cp.upper_tri(Z) == 0,
            cp.geo_mean(cp.diag(Z)) >= least * cp.power(m, 5.0 / 3.0),
        ]

    def disc(self, disc: Disc, b: int, m: Any, h: Any, S: Any) -> None:
        """The bound from below on what discs can be: the solid radius within reach, at least the solid inertia."""
        cp = self.cp
        least = self.M / (2.0 * np.pi * disc.density * disc.thickness * self.L**2)
        self.constraints.append(cp.quad_over_lin(h, m) + least * cp.square(m) <= cp.trace(S))
        region, E = self.case.arguments["region"] or Ball(self.L), self.axes(b)
        semi, off = np.asarray(region.half_extents()) / self.L, h - E @ np.asarray(region.center) / self.L * m
        w = np.sqrt(2.0 * least) * cp.power(m, 1.5)
        if isinstance(region, Ball):
            self.constraints.append(cp.norm(off) + w <= semi[0] * m)
            return
        for k in range(3):
            d = E @ np.eye(3)[k]
            if np.linalg.norm(d) > 0.5:
                self.constraints.append(cp.abs(d @ off) + w <= semi[k] * m)

    def inside(self, b: int, m: Any, h: Any, S: Any) -> None:
        """Second moments about the centre of the region, in its axes: those of the joint."""
        cp, E = self.cp, self.axes(b)
        region = self.case.arguments["region"] or Ball(self.L)
        c3 = np.asarray(region.center) / self.L
        semi = np.asarray(region.half_extents()) / self.L
        c = E @ c3
        about = S - cp.reshape(c, (self.d, 1), order="C") @ cp.reshape(h, (1, self.d), order="C")
        about = about - cp.reshape(h, (self.d, 1), order="C") @ c[None] + np.outer(c, c) * m
        if isinstance(region, Ball):
            self.constraints.append(cp.trace(about) <= semi[0] ** 2 * m)
        elif isinstance(region, Ellipsoid):
            shape = np.linalg.inv(E @ np.diag(semi**2) @ E.T)
            self.constraints.append(cp.trace(shape @ about) <= m)
        else:
            for k in range(3):
                d = E @ np.eye(3)[k]
                if np.linalg.norm(d) > 0.5:
                    self.constraints.append(d @ about @ d <= semi[k] ** 2 * m)
            if not self.planar:
                self.corners(about, m, h - c * m, semi)

    def corners(self, about: Any, m: Any, first: Any, semi: np.ndarray) -> None:
        for i in range(3):
            for j in range(i):
                for s in (1.0, -1.0):
                    for t in (1.0, -1.0):
                        both = s * t * about[i, j] / (semi[i] * semi[j])
                        self.constraints.append(m + s * first[i] / semi[i] + t * first[j] / semi[j] + both >= 0)

    def conditions_hold(self, pi: Any) -> None:
        if self.conditions is not None and self.conditions.rank:
            self.constraints.append(self.conditions.matrix @ pi / self.M == 0)

    def loads(self, pi: Any) -> None:
        """Loads along the motion are affine in the parameters: values at the present ones and at unit changes."""
        wanted = {t.split("_", 1)[1] for t in self.case.minimise if t[:3] in ("rms", "pea")}
        wanted |= {"torque"} if "limits" in self.case.arguments else set()
        self.values = {}
        if not wanted:
            return
        path = self.case.arguments["motions"][0]
        unit = self.units()
        present = self.chain.inertial_parameters + np.eye(10)[0] * unit  # a body without mass has no first moment
        base = inverse_dynamics(self.chain.with_inertial_parameters(present), path)
        change = {name: [] for name in wanted}
        for k in range(present.size):
            other = present.copy().ravel()
            other[k] += unit[k % 10]
            loads = inverse_dynamics(self.chain.with_inertial_parameters(other.reshape(-1, 10)), path)
            for name in wanted:
                change[name].append((getattr(loads, name) - getattr(base, name)) / unit[k % 10])
        for name in wanted:
            start = np.asarray(getattr(base, name))
            Y = np.stack(change[name], axis=-1)
            flat = start.ravel() + Y.reshape(-1, present.size) @ (pi - present.ravel())
            self.values[name] = flat, start.shape
        if "limits" in self.case.arguments:
            top = self.case.arguments["limits"]["peak_torque"]
            self.constraints.append(self.cp.abs(self.values["torque"][0]) / top <= 1)

    def size(self) -> float:
        """Typical size of the objective: its terms at the present mechanism, or what moves them."""
        out = 0.0
        for name, weight in self.case.minimise.items():
            typical = {"added_mass": self.M, "distance": 1.0}.get(name)
            if typical is None:
                loads = inverse_dynamics(self.chain, self.case.arguments["motions"][0])
                typical = float(np.abs(getattr(loads, name.split("_", 1)[1])).max())
            out += weight * typical
        return out

    def term(self, name: str) -> Any:
        cp = self.cp
        if name == "added_mass":
            return self.M * (sum(pi[0] for pi in self.pi) - self.present[:, 0].sum())
        if name == "distance":
            return cp.norm(cp.hstack([self.seen(b, self.pi[b] - self.present[b]) for b in range(len(self.pi))]))
        flat, shape = self.values[name.split("_", 1)[1]]
        if name.startswith("rms"):
            return cp.norm(flat) / np.sqrt(shape[0])
        return cp.max(cp.abs(flat))  # torques: every motor by itself

    def seen(self, b: int, pi: Any) -> Any:
        """The parameters that count: m, in-plane h, moment about the normal; or all ten."""
        if not self.planar:
            return pi
        E, n = self.axes(b), np.asarray(self.plane().axes[b, 2])
        weight = np.array([n[i] * n[j] * (1.0 if i == j else 2.0) for i, j in PAIRS])
        return self.cp.hstack([pi[0], E @ pi[1:4], weight @ pi[4:10]])


def cases(seed: int, count: int) -> Iterator[Case]:
    """Yield problems; the k-th does not depend on how many are asked for."""
    for k in range(count):
        yield draw(np.random.default_rng((seed, k)))
