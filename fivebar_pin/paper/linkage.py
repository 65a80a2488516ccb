"""The paper's five-bar as parameters, as a ClosedChain, and as configurations of that chain.

Pivots O1 = (0, 0) and O0 = (a5, 0); links O1-O2 (a1, psi), O2-O3 (a2, theta), O4-O3 (a3, phi), O0-O4 (a4, gamma);
absolute angles from the x axis, plane x-y. The open tree is cut at O3. With kappa_i = rho_i exp(i alpha_i), the
vector from O_i to the mass centre C_i is r_i = kappa_i r_{i,i+1}, (54)-(57); link 3 starts at O3, link 4 at O4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, Immutable, checked, frozen, numeric
from fivebar_pin.chain import ClosedChain, Visual
from fivebar_pin.closures import Point
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.paper.assembly_mode import AssemblyMode
from fivebar_pin.paper.positions import CArray, position

__all__ = ["FiveBar"]

_STRONG = 1e6  # effort and velocity limit [N m, rad/s]: none that matters
_WIDE = 1e4  # joint limit [rad]: the angles may turn many times
_COLOURS = ((0.16, 0.44, 0.70), (0.90, 0.62, 0.10), (0.34, 0.62, 0.32), (0.76, 0.30, 0.28))


@dataclass(frozen=True, slots=True, eq=False)
class FiveBar(Immutable):
    """Parameters of the planar five-bar linkage.

    Attributes:
        lengths: a1 .. a5 (5,) [m]; a5 is the distance of the fixed pivots.
        masses: m1 .. m4 (4,) [kg].
        inertias: polar inertia of each link about its own mass centre (4,) [kg m2].
        rho: |r_i| / |r_{i,i+1}| (4,) [-], (56); a negative value puts the mass centre behind O_i.
        alpha: angle from r_{i,i+1} to r_i (4,) [rad], (57).

    Raises:
        InvalidInputError: wrong shapes; values that are not finite; lengths or masses that are not positive; an
            inertia too small for its mass. The inertia is taken about the mass centre, where every body of positive
            mass and extent has I > 0, however small: this is the only bound, so slender and nearly point-like
            bodies are allowed.
    """

    lengths: Array
    masses: Array
    inertias: Array
    rho: Array
    alpha: Array

    def __init__(
        self,
        lengths: npt.ArrayLike,
        masses: npt.ArrayLike,
        inertias: npt.ArrayLike,
        rho: npt.ArrayLike,
        alpha: npt.ArrayLike,
    ) -> None:
        given = {"lengths": lengths, "masses": masses, "inertias": inertias, "rho": rho, "alpha": alpha}
        for name, values in given.items():
            object.__setattr__(self, name, checked(name, values, (5,) if name == "lengths" else (4,)))
        _all_positive("lengths", self.lengths, "must be positive [m]")
        _all_positive("masses", self.masses, "must be positive [kg]")
        for k, inertia in enumerate(self.inertias):
            if inertia <= 0.0:
                raise InvalidInputError(
                    f"inertias[{k}]",
                    float(inertia),
                    f"is too small for a mass of {self.masses[k]:g} kg: the inertia about the mass centre must be "
                    "positive [kg m2]",
                )

    def __repr__(self) -> str:
        fields = ", ".join(f"{name}={getattr(self, name).tolist()}" for name in FiveBar.__slots__)
        return f"FiveBar({fields})"

    @property
    def kappa(self) -> CArray:
        """rho_i exp(i alpha_i) (4,) [-]: r_i over r_{i,i+1} as complex numbers, (55)."""
        return np.asarray(self.rho * np.exp(1j * self.alpha))

    @property
    def mass_ratios(self) -> Array:
        """mu_i = m_i / m (4,) [-], (53)."""
        return np.asarray(self.masses / self.masses.sum())

    @property
    def offsets(self) -> CArray:
        """Mass centre of each link in its own axes, x along the link, seen from its joint in the tree (4,) [m].

        The joints are O1, O2, O4, O0 for the links 1 to 4; the paper measures links 3 and 4 from their other end.
        """
        kappa = self.kappa
        return np.asarray(self.lengths[:4] * np.array([kappa[0], kappa[1], 1.0 - kappa[2], 1.0 - kappa[3]]))

    def chain(self, *, gravity: npt.ArrayLike = (0.0, 0.0, 0.0)) -> ClosedChain:
        """Return the linkage as an open tree cut at O3, with its closure and its motors at psi and gamma.

        The joints are gamma, phi_gamma, psi, theta_psi in this order, q = (gamma, phi - gamma, psi, theta - psi).
        The bodies are flat in the x-y plane: Izz is the given inertia about the mass centre and Ixx = Iyy = Izz / 2,
        which every flat body with equal spread along and across satisfies; the planar motion never feels Ixx, Iyy.

        Args:
            gravity: (3,) [m/s2].
        """
        model = pin.Model()
        model.name = "five_bar"
        model.gravity.linear = np.array(checked("gravity", gravity, (3,)))
        a1, a2, a3, a4, a5 = (float(a) for a in self.lengths)
        gamma = _add_link(model, 0, "gamma", a5, self._body(4), "link4")
        phi = _add_link(model, gamma, "phi_gamma", a4, self._body(3), "link3")
        psi = _add_link(model, 0, "psi", 0.0, self._body(1), "link1")
        theta = _add_link(model, psi, "theta_psi", a1, self._body(2), "link2")
        _add_point(model, theta, "O3_link2", a2, "link2")
        _add_point(model, phi, "O3_link3", a3, "link3")
        closure = Point(("O3_link2", "O3_link3"), name="O3")
        return ClosedChain(model, (closure,), ("psi", "gamma"), name="five_bar", visuals=_visuals(self.lengths))

    def configuration(
        self, psi: npt.ArrayLike, gamma: npt.ArrayLike, *, mode: AssemblyMode = AssemblyMode.LEFT
    ) -> Array:
        """Return the configuration of `chain` in which the loop is closed.

        Args:
            psi, gamma: input angles, scalars or (n,) [rad]; a scalar goes with every value of the other.
            mode: which of the two closures.

        Returns:
            q = (gamma, phi - gamma, psi, theta - psi), (4,) or (n, 4) [rad]; theta and phi in (-pi, pi].

        Raises:
            AssemblyError: the loop cannot be closed (which sample, and by how much).
            SingularityError: O2, O3 and O4 lie on a line.
        """
        given = numeric("psi", psi), numeric("gamma", gamma)
        single = all(x.ndim == 0 for x in given)
        count = max((x.size for x in given if x.ndim), default=1)
        first, second = (np.full(count, x) if x.ndim == 0 else x for x in given)
        x = checked("psi", first, (None,))
        y = checked("gamma", second, x.shape)
        pose = position(self.lengths, x, y, mode=mode)
        q = np.stack([y, pose.phi - y, x, pose.theta - x], axis=-1)
        return np.asarray(q[0] if single else q)

    def _body(self, link: int) -> pin.Inertia:
        c, inertia = complex(self.offsets[link - 1]), float(self.inertias[link - 1])
        spread = np.diag([0.5 * inertia, 0.5 * inertia, inertia])
        return pin.Inertia(float(self.masses[link - 1]), np.array([c.real, c.imag, 0.0]), spread)


def _all_positive(name: str, values: Array, bound: str) -> None:
    for k in np.flatnonzero(values <= 0.0):
        raise InvalidInputError(f"{name}[{k}]", float(values[k]), bound)


def _add_link(model: pin.Model, parent: int, joint: str, x: float, body: pin.Inertia, link: str) -> int:
    """Add a hinge about z at x on the parent's x axis, and the body that it carries."""
    limit, far = np.full(1, _STRONG), np.full(1, _WIDE)
    placement = pin.SE3(np.eye(3), np.array([x, 0.0, 0.0]))
    index = int(model.addJoint(parent, pin.JointModelRZ(), placement, joint, limit, limit, -far, far))
    model.appendBodyToJoint(index, body, pin.SE3.Identity())
    frame = model.addJointFrame(index)
    model.addBodyFrame(link, index, pin.SE3.Identity(), int(frame))
    return index


def _add_point(model: pin.Model, joint: int, name: str, x: float, link: str) -> None:
    placement = pin.SE3(np.eye(3), np.array([x, 0.0, 0.0]))
    frame = pin.Frame(name, joint, model.getFrameId(link), placement, pin.FrameType.OP_FRAME)
    model.addFrame(frame)


def _visuals(lengths: Array) -> tuple[Visual, ...]:
    """Return a capsule along each link and a pin at its far end; the radii follow the mean link length."""
    radius = 0.04 * float(np.mean(lengths[:4]))
    visuals = []
    for k, colour in enumerate(_COLOURS):
        length = float(lengths[k])
        along = np.array([[0.0, 0.0, 1.0, 0.5 * length], [0.0, 1.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0, 0, 0, 1.0]])
        pivot = np.eye(4)
        pivot[0, 3] = length
        visuals.append(Visual(f"link{k + 1}", "capsule", (radius, length), frozen(along), (*colour, 1.0)))
        pin_size = (1.25 * radius, 3.0 * radius)
        visuals.append(Visual(f"link{k + 1}", "cylinder", pin_size, frozen(pivot), (0.2, 0.2, 0.22, 1.0)))
    return tuple(visuals)
