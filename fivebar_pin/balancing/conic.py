"""A balancing problem as a conic program: its variables, what they do, and everything that is asked of them.

With x the scaled parameters of the mechanism and y the variables of all parts, x = X0 + E y; conditions are B x = 0,
bodies and regions are cones, every term of an objective is linear or a length of vectors linear in y.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, frozen
from fivebar_pin.balancing.facial_reduction import empty, without
from fivebar_pin.balancing.objectives.objective import Designs, Objective
from fivebar_pin.balancing.objectives.term import Term
from fivebar_pin.balancing.regressors.measures import Measurement
from fivebar_pin.balancing.setting import Setting
from fivebar_pin.balancing.solvers import Block, Program
from fivebar_pin.balancing.variables.part import Part, Placed
from fivebar_pin.balancing.variables.sizes import stated
from fivebar_pin.balancing.variables.variable import Variable

__all__ = ["ConicForm", "Cost", "conic_form"]


@dataclass(frozen=True, slots=True, eq=False)
class Cost(Immutable):
    """One objective: x.P x / 2 + q.x in a unit, over the variables and one for each term that counts.

    Attributes:
        P, q: over all variables (n + terms,).
        unit: what they were divided by.
        epigraphs: cones that put each of the last variables above its term.
        sizes: bounds on all variables.
    """

    P: Array
    q: Array
    unit: float
    epigraphs: tuple[Block, ...]
    sizes: Array


@dataclass(frozen=True, slots=True, eq=False)
class ConicForm(Immutable):
    """The program of a problem, to be solved for any weights of its terms.

    Attributes:
        setting, measurement: the mechanism, and what its bodies are measured by.
        parts: what the variables are.
        gone: for each of them, whether the conditions leave none of it.
        terms: by the atom that is their root.
        E, X0: scaled parameters (nb * width,) = X0 + E y, y the variables (n,).
        program: conditions, physical bodies, regions, bounds.
        fixed: rows (k, n + 1) of what is given exactly.
        limited: upper bounds on terms, part of the program.
        caps: bounds on variables that have none of their own.
        sizes: bounds on the variables (n,) that follow from those on masses and the regions.
    """

    setting: Setting
    measurement: Measurement
    parts: tuple[Placed, ...]
    gone: tuple[bool, ...]
    terms: Mapping[Objective, Term]
    E: Array
    X0: Array
    program: Program
    fixed: Array
    limited: tuple[Block, ...]
    caps: tuple[Block, ...]
    sizes: Array

    @property
    def n(self) -> int:
        """Number of variables."""
        return sum(p.part.size for p in self.parts)

    def cost(self, weights: Mapping[Objective, float]) -> Cost:
        """Return a weighted sum of terms; every root that counts gets one variable after those of the parts."""
        used = list(dict.fromkeys(atom.root for atom, weight in weights.items() if weight > 0.0))
        P, q = np.zeros(self.n + len(used)), np.zeros(self.n + len(used))
        for atom, weight in weights.items():
            if weight > 0.0:
                term, column = self.terms[atom.root], self.n + used.index(atom.root)
                if atom.squared:
                    P[column] += 2.0 * weight * term.scale**2
                else:
                    q[column] += weight * term.scale
        unit = float(max(P.max(initial=0.0), q.max(initial=0.0))) or 1.0
        epigraphs = tuple(b for k, root in enumerate(used) for b in self.terms[root].epigraph(self.n + k))
        sizes = np.concatenate([self.sizes, [self.terms[root].largest(self.sizes) for root in used]])
        return Cost(P / unit, q / unit, unit, epigraphs, sizes)

    def felt(self, atoms: Sequence[Objective], limits: Sequence[Block]) -> Array:
        """Return the largest factor of each variable (n,) in the conditions, in terms and in limits."""
        rows = [b.G for b in (*self.limited, *limits)]
        rows += [G for atom in atoms for G, _ in self.terms[atom.root].vectors]
        if self.setting.conditions is not None:
            rows.append(self.setting.conditions.rows @ self.E)
        return np.asarray(np.max([np.abs(G).max(axis=0, initial=0.0) for G in rows], axis=0))


def conic_form(
    setting: Setting,
    variables: Sequence[Variable],
    objectives: Sequence[Objective],
    limits: Mapping[Objective, npt.ArrayLike],
    measurement: Measurement,
) -> ConicForm:
    """Put the program together.

    Args:
        setting: the mechanism, with the conditions and the arms that are part of its bodies.
        variables: what may change.
        objectives: atoms that can be minimised or bounded later.
        limits: upper bounds on atoms.
        measurement: the motions that atoms refer to.
    """
    parts = _placed([part for variable in variables for part in variable.parts(setting)])
    n = sum(p.part.size for p in parts)
    E, X0 = _scaled(setting, parts)
    designs = Designs(setting, measurement, parts, E, X0, _full(setting, parts), _present(setting, parts))
    terms = {atom.root: atom.root.term(designs) for atom in objectives}
    limited = [block for atom, top in limits.items() for block in atom.limits(designs, top)]
    blocks = _constraints(setting, parts, E, X0)
    caps = [p.widened(block, n) for p in parts for block in p.part.caps(setting)]
    gone = empty(blocks, parts, n)
    most = stated([*blocks, *caps], n)
    sizes = [np.zeros(p.part.size) if g else p.part.sizes(most[p.where]) for p, g in zip(parts, gone, strict=True)]
    return ConicForm(
        setting=setting,
        measurement=measurement,
        parts=parts,
        gone=gone,
        terms=terms,
        E=frozen(E),
        X0=frozen(X0),
        program=Program(n, without([*blocks, *limited], parts, gone, n)),
        fixed=frozen(_fixed(setting, parts, n)),
        limited=tuple(limited),
        caps=tuple(caps),
        sizes=frozen(np.concatenate(sizes) if sizes else np.zeros(0)),
    )


def _placed(parts: Sequence[Part]) -> tuple[Placed, ...]:
    starts = np.cumsum([0, *(part.size for part in parts)])
    return tuple(Placed(part, int(start)) for part, start in zip(parts, starts[:-1], strict=True))


def _scaled(setting: Setting, parts: Sequence[Placed]) -> tuple[Array, Array]:
    """Return E, X0 with scaled parameters = X0 + E y."""
    X0 = setting.present()
    for p in parts:
        X0[list(p.part.replaces())] = 0.0
    maps = [p.part.scaled_map(setting) for p in parts]
    return np.concatenate([np.zeros((X0.size, 0)), *maps], axis=1), X0.reshape(-1)


def _full(setting: Setting, parts: Sequence[Placed]) -> Array:
    """Return what the variables change in the ten parameters of all bodies (10 nb, n), SI units."""
    maps = [p.part.map(setting) for p in parts]
    return np.concatenate([np.zeros((10 * len(setting.chain.joints), 0)), *maps], axis=1)


def _present(setting: Setting, parts: Sequence[Placed]) -> Array:
    """Return the ten parameters of all bodies (10 nb,) that have no variables."""
    present = setting.chain.inertial_parameters + setting.arms
    for p in parts:
        present[list(p.part.replaces())] = 0.0
    return np.asarray(present.reshape(-1))


def _constraints(setting: Setting, parts: Sequence[Placed], E: Array, X0: Array) -> list[Block]:
    """Return conditions, what the parts ask, and what the user asks of them."""
    n, blocks, conditions = E.shape[1], [], setting.conditions
    if conditions is not None and conditions.equations:
        R, labels = conditions.rows, tuple(f"[{text}]" for text in conditions.equations)
        held = conditions.constants(R) / setting.mass  # what springs ask of the masses, none without springs
        if len(R):
            blocks.append(Block(labels[: len(R)], "zero", R @ E, R @ X0 + held))
        if conditions.unheld:
            blocks.append(Block(labels[-1], "zero", np.zeros((1, n)), np.array([conditions.unheld / setting.mass])))
    blocks += [p.widened(block, n) for p in parts for block in p.part.cones]
    return blocks + [p.widened(block, n) for p in parts for block in p.part.bounds(setting)]


def _fixed(setting: Setting, parts: Sequence[Placed], n: int) -> Array:
    """Return rows (k, n + 1) of what is given exactly: row @ y = last entry."""
    rows = [np.zeros((0, n + 1))]
    for p in parts:
        own = p.part.fixed(setting)
        wide = np.zeros((len(own), n + 1))
        wide[:, p.where], wide[:, -1] = own[:, :-1], own[:, -1]
        rows.append(wide)
    return np.concatenate(rows)
