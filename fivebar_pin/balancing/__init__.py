"""Balancing of closed chains as one convex problem.

    conditions = balance_conditions(chain, "force")        # what must hold, found numerically, readable
    design = balance(chain, "force", region=Ball(0.1))     # the least mass that makes it hold, or a proof
    design.chain, design.added, design.gap                 # a ClosedChain like any other

**Everything is linear in the inertial parameters.** Collect the ten parameters of every moving body, its mass m, first
moment m c and inertia about the joint origin, in one vector pi. Along any motion q(t) of the closed chain

    linear momentum p = Y_p(q, v) pi,       angular momentum L = Y_L(q, v) pi,
    shaking force and moment                F = -dp/dt = Y_F(q, v, a) pi,     M = -dL/dt = Y_M(q, v, a) pi,
    frame force and moment                  the same with the weight,
    motor torque                            tau = N^T Y_t(q, v, a) pi + (friction, rotors, springs),

and so are joint reactions and energies: none of these matrices knows the masses (`regressor`). N is the complement,
v = N v_a. The closures enter through N alone, so nothing below depends on the kind of mechanism.

**Conditions** (`balance_conditions`). The frame feels no force, whatever the motion, when the centre of mass stays
where it is [Berkof and Lowen 1969], that is when the linear momentum is zero for every closed q and every v = N v_a. At
a given q momentum is linear in v_a, so it is enough to ask it for the unit velocities e_1 .. e_na:

    Y_p(q, N(q) e_k) pi = 0    for all closed q, all k        ("force")
    Y_L(q, N(q) e_k) pi = 0    the same for moments           ("moment"; both: "dynamic")
    g . Y_p(q, N(q) e_k) pi + f(q) . N(q) e_k = 0             ("static": no torque at rest, with f by springs)

Springs are inner forces and play a part in the last alone, as constants: B pi + b = 0.
Rows for a few hundred random q are stacked and their row space B taken from a singular value decomposition. Lengths are
divided by the chain's own, masses do not enter, and the gap between the singular values that count and those that do
not is reported. A planar mechanism feels four parameters per body, (m, m c_x, m c_y, I): the four-bar has 4 conditions
for the force and 8 with the moment, the five-bar 6 and 11, and the six are those of the paper, (60)-(63), (68), (69).
Where lengths are special the closed configurations fall into branches with fewer conditions: an antiparallelogram needs
7, and can be balanced without counter-rotation, while a generic four-bar cannot.

**Bodies.** Ten numbers are those of a body if and only if its pseudo-inertia is positive semidefinite
[Wensing, Kim, Slotine 2018],

    P(pi) = [[S, m c], [m c^T, m]] >= 0,    S = tr(I)/2 1 - I,        in the plane: m >= 0, |m c|^2 <= m I,

and the body fits into an ellipsoid (x - c)^T A (x - c) <= 1 if and only if besides tr(A S) - 2 c^T A (m c) +
(c^T A c - 1) m <= 0: a linear bound. Flat discs of density d and thickness t have I_c >= m^2 / (2 pi d t), convex too.

**Designs** (`balance`). With material delta added in given regions, rho taken away, or whole bodies redesigned,

    minimise    w_1 f_1(pi) + w_2 f_2(pi) + ...
    subject to  B pi = 0,   pi = pi_0 + delta - rho,   delta, rho, pi_0 - rho bodies in their regions,   limits,

where every f is linear (added mass, inertia reflected at the motors) or a norm of something linear (rms and peak of
torque, shaking force and moment, bearing forces, deviation of the angular momentum, distance to the present design).
It is a conic program. Its optimum is global and its dual is a lower bound that comes with the design. If there is no
design, a vector z of the dual cone with G^T z = 0 and g.z < 0 proves it (Farkas); the proof is checked here again and
names the conditions and bounds that contradict each other. Both are rigorous: what r = P x + q - G^T z leaves over is
charged with bounds b on the variables, sum |r_i| b_i, and these follow from the problem (masses by their bounds, ten
moving masses where there is none; moments by the regions; see `solvers.bound`). Solutions are kept a hair inside the
cones, moved onto the conditions exactly, and refused if a body is outside the physical ones by more than 1e-12. Where
material has no volume to be in, points and sheets on the border of a region, the region gives way by a hair: up to
1e-7 of the moving mass and its size squared; the bound stays that of the region as given, so the gap may be as far
below zero. Clarabel solves (`solver="clarabel"`); SciPy (`solver="scipy"`) shares nothing with it.

The objective of Alici and Shirinzadeh (2004), the sum of squares of bearing forces, torques, shaking moment and angular
momentum deviation under the force balance equalities, is one such problem (`alici_shirinzadeh`), and so is every
point of a Pareto front (`pareto`). A finished design is measured by small matrix products, |R (pi, 1)| with a
triangular R that is computed once for a motion: a million designs take seconds (`score`; `variations` draws some).
`realise` turns added parameters into discs, bars or balls.

References:
    R. S. Berkof, G. G. Lowen: A new method for completely force balancing simple linkages. J. Eng. Ind. 91 (1969).
    G. Alici, B. Shirinzadeh: Optimum dynamic balancing of planar parallel manipulators. ICRA (2004).
    P. M. Wensing, S. Kim, J.-J. E. Slotine: Linear matrix inequalities for physically consistent inertial parameter
        identification. IEEE Robotics and Automation Letters 3 (2018).
    The paper on the dynamic balancing of five-bar linkages that `fivebar_pin.paper` works through.
"""

from __future__ import annotations

from fivebar_pin.balancing import objectives, regions, solvers, variables
from fivebar_pin.balancing.balanced import balance
from fivebar_pin.balancing.change import Change
from fivebar_pin.balancing.comparison import Comparison, compare
from fivebar_pin.balancing.conditions import BalanceConditions, balance_conditions
from fivebar_pin.balancing.counterweights import Counterweight
from fivebar_pin.balancing.design import Certificate, Design
from fivebar_pin.balancing.fronts import ParetoFront, pareto
from fivebar_pin.balancing.pieces import MATERIALS, Bar, Disc, Sphere
from fivebar_pin.balancing.problem import BalanceProblem, balance_problem
from fivebar_pin.balancing.realisation import Realisation, realise
from fivebar_pin.balancing.regions import Ball, Box, Ellipsoid
from fivebar_pin.balancing.regressors import QUANTITIES, Regressor, regressor
from fivebar_pin.balancing.scoring import Scores, score
from fivebar_pin.balancing.sum_of_squares import alici_shirinzadeh
from fivebar_pin.balancing.variations import variations

__all__ = [
    "MATERIALS",
    "QUANTITIES",
    "BalanceConditions",
    "BalanceProblem",
    "Ball",
    "Bar",
    "Box",
    "Certificate",
    "Change",
    "Comparison",
    "Counterweight",
    "Design",
    "Disc",
    "Ellipsoid",
    "ParetoFront",
    "Realisation",
    "Regressor",
    "Scores",
    "Sphere",
    "alici_shirinzadeh",
    "balance",
    "balance_conditions",
    "balance_problem",
    "compare",
    "objectives",
    "pareto",
    "realise",
    "regions",
    "regressor",
    "score",
    "solvers",
    "variables",
    "variations",
]
