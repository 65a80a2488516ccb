"""A chain in the tables of the engine: links, rows of closures, and the blocks that are solved one after the other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from graphlib import TopologicalSorter
from typing import Protocol

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain import find_frame
from fivebar_pin.chain.masses import turned
from fivebar_pin.closures.anchored import Anchored
from fivebar_pin.closures.frame_closure import AnchoredFrames
from fivebar_pin.closures.rest import AnchoredStill
from fivebar_pin.closures.rows import Row
from fivebar_pin.engine import tables as e
from fivebar_pin.mechanism.dimensions import Dimensions, dimensions_of
from fivebar_pin.mechanism.links import Link
from fivebar_pin.springs import JointSpring, Spring

__all__ = ["SORTS", "Block", "Parts", "blocks_of", "constants_of", "joined_rows", "layout_of"]

SORTS = {"along": e.ALONG, "tilt": e.TILT, "turned": e.TURNED, "length": e.LENGTH, "spin": e.SPIN}
"""Sorts of rows between frames, by their word."""
_TOGETHER = 1e-12  # distance of a spring's ends that is round-off: they lie on one point [chain lengths]

Index = npt.NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Rows that determine some passive coordinates, those of earlier blocks being known.

    Attributes:
        rows: numbers of the rows of the engine.
        columns: velocity coordinates.
        inputs: numbers of the actuated coordinates that move them.
        mix: combinations of the rows (height, rows); None for the rows as they are.
    """

    rows: Index
    columns: Index
    inputs: Index
    mix: Array | None

    @property
    def height(self) -> int:
        return int(self.rows.size if self.mix is None else self.mix.shape[0])

    @property
    def factors(self) -> int:
        """Numbers that hold its factors: those of a tall block have a tail."""
        n = self.columns.size
        return int(self.height * n + (n if self.height > n else 0))


def joined_rows(rows: Sequence[Row], mix: Array) -> tuple[Row, ...]:
    """Return combinations (k, rows) of rows of one sort: rows of the same sort."""
    b, x0 = np.stack([row.direction for row in rows]), np.array([row.number for row in rows])
    return tuple(
        Row(rows[0].sort, direction, rows[0].other, float(number))
        for direction, number in zip(mix @ b, mix @ x0, strict=True)
    )


def split(pattern: npt.NDArray[np.bool_]) -> list[tuple[Index, Index]]:
    """Split a square system into blocks, rows and columns each, that can be solved one after the other.

    They are the strongly connected parts of a matching of rows and columns [Dulmage and Mendelsohn 1958].

    Args:
        pattern: which rows may depend on which columns (n, n).

    Returns:
        The blocks in order; the whole where there is no matching.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components, maximum_bipartite_matching

    n = pattern.shape[0]
    match = np.asarray(maximum_bipartite_matching(csr_array(pattern), perm_type="column"), dtype=np.intp)
    if np.any(match < 0):
        return [(np.arange(n), np.arange(n))]
    needs = pattern[:, match]  # row i needs the column that row k is matched with
    _, label = connected_components(csr_array(needs.astype(np.float64)), connection="strong")
    before: dict[int, set[int]] = {int(k): set() for k in np.unique(label)}
    for i, k in zip(*np.nonzero(needs), strict=True):
        if label[i] != label[k]:
            before[int(label[i])].add(int(label[k]))
    parts = (np.flatnonzero(label == k) for k in TopologicalSorter(before).static_order())
    return [(rows, np.sort(match[rows])) for rows in parts]


def blocks_of(
    groups: Sequence[tuple[Index, Index, Array | None]], touched: Sequence[Index], actuated: Index
) -> list[Block]:
    """Return the blocks of independent groups of closures, in the order they are solved in.

    Args:
        groups: rows, passive velocity coordinates and combinations of the rows of each.
        touched: velocity coordinates that every row may depend on.
        actuated: velocity coordinates of the motors.
    """
    found: list[Block] = []
    moved: dict[int, set[int]] = {int(k): {a} for a, k in enumerate(actuated)}
    for rows, columns, mix in groups:
        parts = [(np.arange(rows.size), np.arange(columns.size))]
        if mix is None and rows.size == columns.size:
            parts = split(np.array([np.isin(columns, touched[r]) for r in rows]).reshape(rows.size, columns.size))
        for some_rows, some_columns in parts:
            own = columns[some_columns]
            others = {int(k) for r in rows[some_rows] for k in touched[r]} - set(own.tolist())
            inputs = set().union(*(moved.get(k, set()) for k in others))
            moved.update({int(k): inputs for k in own})
            found.append(Block(rows[some_rows], own, np.array(sorted(inputs), dtype=np.intp), mix))
    return found


class Described(Protocol):
    """What is asked of a chain, see `ClosedChain`."""

    @property
    def model(self) -> pin.Model: ...
    @property
    def nq(self) -> int: ...
    @property
    def nv(self) -> int: ...
    @property
    def na(self) -> int: ...
    @property
    def actuated_index(self) -> Index: ...
    @property
    def springs(self) -> Sequence[Spring | JointSpring]: ...


@dataclass(frozen=True, slots=True, eq=False)
class Parts:
    """What the tables of a chain are made of.

    Attributes:
        chain: the mechanism.
        links: of the tree, without the ground.
        anchored: closures with their frames found.
        rows: of every closure between frames, what is kept of its rows.
        blocks: in order.
        scale: unit of every velocity (nv,).
        length: of the chain [m].
        left: of every closure, combinations of its rows that say nothing anywhere, where they are known.
        dimensions: of other designs, one or many, in place of its own.
        misfit: scaled residual up to which closures count as met [-].
        bodiless: whether bodies that weigh nothing get a place as well: in other designs they may be some.
    """

    chain: Described
    links: Sequence[Link]
    anchored: Sequence[Anchored]
    rows: Sequence[Sequence[Row]]
    blocks: Sequence[Block]
    scale: Array
    length: float
    left: Sequence[Sequence[Row]] = ()
    dimensions: Dimensions | None = None
    bodiless: bool = False
    misfit: float = 0.0


def layout_of(parts: Parts) -> tuple[e.Integers, Array]:
    """Return I and W of a chain: its constants, and working memory as it is before the first sample."""
    return _Layout(parts).vectors()


def constants_of(parts: Parts) -> Array:
    """Return the constants of n designs as they stand in front of W (n, constants).

    Units and rows are those of the chain of the parts: another design is measured in its lengths, too.
    """
    layout = _Layout(parts)
    layout.constants()
    return layout.written()


class _Layout:
    """Writes the records of a chain, and gives out places in W to what they are about."""

    def __init__(self, parts: Parts) -> None:
        self.parts, self.model = parts, parts.chain.model
        self.head = np.zeros(e.HEADER, dtype=np.int64)
        self.records: list[int] = []
        self.numbers: list[Array] = []  # (1 or n, k) each
        self.filled = 0
        self.last = {0: 0, **{x.joint: j for j, x in enumerate(parts.links, start=1)}}  # link of a joint's body
        self.axes = {0: np.eye(3), **{x.joint: x.axes for x in parts.links}}
        self.dimensions = parts.dimensions or dimensions_of(self.model, self._frame_names())

    def _frame_names(self) -> Iterator[str]:
        """Yield the frames that closures and springs are at."""
        for anchored in self.parts.anchored:
            yield from anchored.closure.frames if isinstance(anchored, AnchoredFrames) else ()
        for one in self.parts.chain.springs:
            yield from (one.frame1, one.frame2) if isinstance(one, Spring) else ()

    def vectors(self) -> tuple[e.Integers, Array]:
        chain = self.parts.chain
        self.head[[e.NQ, e.NV, e.NA]] = chain.nq, chain.nv, chain.na
        constants = self.constants()
        self.head[e.CONSTANTS] = self.filled
        memory = self._memory()
        self.head[e.MEMORY] = self.filled
        self.head[e.MOTORS] = self._write(chain.actuated_index.tolist())
        lists = [self._block_lists(block) for block in self.parts.blocks]
        reached = self._reached()
        blocks = self._begin(e.BLOCKS, e.BLOCK_SIZE, len(lists))
        columns = self._begin(e.COLUMNS, e.COLUMN_SIZE, chain.nv)
        self._links(constants, memory, reached, columns)
        self._columns(constants, memory, blocks, columns)
        rows = self._closures(constants, memory)
        self._fill_blocks(constants, memory, blocks, lists, rows)
        self._springs(constants, memory)
        return np.concatenate([self.head, self.records]).astype(np.int64), self.written()[0]

    def written(self) -> Array:
        """Return what stands in W so far, of every design (n, filled)."""
        n = max(len(x) for x in self.numbers)
        return np.concatenate([np.broadcast_to(x, (n, x.shape[1])) for x in self.numbers], axis=1)

    def _put(self, values: npt.ArrayLike) -> int:
        """Put numbers that all designs have in common into W and return their place."""
        return self._put_each(np.ravel(np.asarray(values, dtype=np.float64))[None])

    def _put_each(self, values: Array) -> int:
        """Put numbers (n, ...) of every design into W and return their place."""
        at = self.filled
        self.numbers.append(values.reshape(len(values), -1))
        self.filled += self.numbers[-1].shape[1]
        return at

    def _room(self, count: int, value: float = 0.0) -> int:
        """Make room in W for numbers that are still to come."""
        return self._put(np.full(count, value))

    def _write(self, integers: Sequence[int]) -> int:
        """Write integers behind those that there are and return where they begin."""
        at = e.HEADER + len(self.records)
        self.records.extend(integers)
        return at

    def _begin(self, field: int, size: int, count: int) -> int:
        """Make room for so many records and note where they begin and end."""
        at = self._write([0] * (size * count))
        self.head[field], self.head[field + 1] = at, at + size * count
        return at

    def _set(self, at: int, fields: dict[int, int]) -> None:
        for field, value in fields.items():
            self.records[at - e.HEADER + field] = int(value)

    def constants(self) -> dict[str, list[int]]:
        """Put the constants of the design into W and return their places, by what they are."""
        parts, model = self.parts, self.model
        self.head[e.GRAVITY] = self._put(model.gravity.linear)
        self.head[e.SCALE] = self._put(parts.scale)
        losses = (model.armature, model.damping, model.upperDryFrictionLimit)
        self.head[e.LOSSES] = self._put(np.column_stack([np.array(x) for x in losses]))
        self.head[e.MISFIT] = self._put([parts.misfit])
        return {
            "fixed": [self._put(np.zeros(14)), *(self._put_each(self._fixed(x)) for x in parts.links)],
            "mass": [-1, *(self._mass(j) for j in range(1, len(parts.links) + 1))],
            "frames": [self._put_each(self._frames(c)) for c in parts.anchored],
            "direction": [self._put(row) for c, rows in self._with_rows() for row in self._directions(c, rows)],
            "ratio": [self._put(r) for c in parts.anchored for r in self._ratios(c)],
            "mix": [-1 if b.mix is None else self._put(b.mix) for b in parts.blocks],
            "coil": [self._put_each(x) for x in self._coils()],
        }

    def _with_rows(self) -> Iterator[tuple[Anchored, Sequence[Row]]]:
        return zip(self.parts.anchored, self.parts.rows, strict=True)

    def _fixed(self, x: Link) -> Array:
        """Return of a link axes and origin on its parent, pitch, and whether its axes are not turned (n, 14)."""
        R, p = x.R[None], x.p[None]
        if x.first:
            R, p = x.placed(self.axes[int(self.model.parents[x.joint])], self.dimensions.joints[x.joint])
        R = R.reshape(-1, 9)
        aligned = np.all(np.eye(3).ravel() == R, axis=1)
        shape = np.broadcast_to(x.radii, (len(p), len(x.radii)))
        return np.column_stack([R, p, np.full(len(p), x.pitch), aligned, shape])

    def _mass(self, j: int) -> int:
        """Return the place of mass, mass centre and moments about it in the axes of a link, or -1 where it has none."""
        joint, axes = self.parts.links[j - 1].joint, self.parts.links[j - 1].axes
        rows = self.dimensions.masses[joint]
        if self.last[joint] != j or not (self.parts.bodiless or rows[:, 0].any() or rows[:, 4:].any()):
            return -1
        return self._put_each(turned(rows, axes))

    def _frames(self, anchored: Anchored) -> Array:
        """Return the placements of both frames on their links (n, 24)."""
        if not isinstance(anchored, AnchoredFrames):
            return np.zeros((1, 24))
        sides = [self._frame(j, name) for j, name in zip(anchored.joints, anchored.closure.frames, strict=True)]
        n = max(len(x) for pair in sides for x in pair)
        return np.concatenate(
            [np.broadcast_to(x.reshape(len(x), -1), (n, x[0].size)) for s in sides for x in s], axis=1
        )

    def _frame(self, joint: int, name: str) -> tuple[Array, Array]:
        """Return axes (n, 3, 3) and origin (n, 3) of a frame on the link of a joint."""
        M, back = self.dimensions.frames[name], self.axes[joint].T
        return np.matmul(back, M[:, :3, :3]), np.matmul(back, M[:, :3, 3, None])[..., 0]

    def _directions(self, anchored: Anchored, rows: Sequence[Row]) -> list[list[float]]:
        if not isinstance(anchored, AnchoredFrames):
            scale = anchored.row_scale(self.parts.length, self.parts.scale)
            return [[0.0] * 6 + [anchored.numbers()[-1], scale[0]]]
        units = {"along": 1.0 / self.parts.length, "length": 1.0 / self.parts.length}
        return [[*x.direction, *x.other, x.number, units.get(x.sort, 1.0)] for x in rows]

    def _ratios(self, anchored: Anchored) -> Array:
        tied = not isinstance(anchored, AnchoredFrames)
        return anchored.numbers()[:-1] if tied else np.zeros(anchored.columns.size)

    def _coils(self) -> Iterator[Array]:
        """Yield the numbers of every spring (n, 10)."""
        for one in self.parts.chain.springs:
            if isinstance(one, JointSpring):
                yield np.array([[*np.zeros(6), one.stiffness, one.rest, one.damping, 0.0]])
            else:
                points = np.broadcast_arrays(*(p for _, p in self._ends(one)))
                own = [one.stiffness, one.length, one.damping, _TOGETHER * self.parts.length]
                yield np.concatenate([*points, np.broadcast_to(own, (len(points[0]), 4))], axis=1)

    def _ends(self, spring: Spring) -> list[tuple[int, Array]]:
        """Return the links at the ends of a spring and its points in their axes (n, 3)."""
        names = (spring.frame1, spring.frame2)
        joints = [int(find_frame(self.model, name).parentJoint) for name in names]
        return [(self.last[j], self._frame(j, name)[1]) for j, name in zip(joints, names, strict=True)]

    def _memory(self) -> dict[str, list[int]]:
        """Make room in W for what is known of a sample and return the places, by what they are."""
        parts, head = self.parts, self.head
        nq, nv, na, nb = parts.chain.nq, parts.chain.nv, parts.chain.na, len(parts.blocks)
        links, tall = len(parts.links) + 1, max((max(b.rows.size, b.columns.size) for b in parts.blocks), default=0)
        per_row = [c.columns.size for c, rows in self._with_rows() for _ in self._directions(c, rows)]
        jacobian = sum(per_row)
        head[e.JACOBIAN] = jacobian
        sizes = {
            e.Q_HERE: nq, e.V_HERE: nv, e.A_HERE: nv, e.X: nv, e.MOVED: nv, e.TARGET: na, e.JOINT: nv, e.TAU: na,
            e.SHAKING: 6, e.CARRIED: 6, e.RHS: tall, e.RAW_RHS: tall, e.RESIDUALS: len(per_row), e.Q_BEFORE: nq,
            e.J_HERE: jacobian,
            e.J_BEFORE: jacobian, e.SIGNS: nb, e.NORMS: nb, e.SIGNS_BEFORE: nb, e.NORMS_BEFORE: nb, e.REACH: 1,
            e.LAST_STEP: 1, e.SECOND_STEP: 1, e.CLOSED: 1, e.GOING: 1, e.STATUS: 1, e.TO: na, e.M_BAR: na * na,
            e.TO_V: na, e.TO_A: na, e.SETTLED: 1,
        }  # fmt: skip
        for field, count in sizes.items():
            head[field] = self._room(count)
        N = np.zeros((nv, na))
        N[parts.chain.actuated_index, np.arange(na)] = 1.0
        for field in (e.N_HERE, e.N_LAST, e.N_SECOND):
            head[field] = self._put(N)
        ground = [*np.eye(3).ravel(), 0.0, 0.0, 0.0]
        starts = head[e.J_HERE] + np.cumsum([0, *per_row])
        places = {
            "pose": [self._put(ground), *(self._room(12) for _ in parts.links)],
            "rate": [self._room(12) for _ in range(links)],
            "load": [self._room(6) for _ in range(links)],
            "twist": [self._room(6 * na) for _ in range(links)],
            "residual": [int(head[e.RESIDUALS]) + r for r in range(len(per_row))],
            "lead": [self._room(1) for _ in per_row],
            "wrench": [self._room(9) for _ in per_row],
            "jacobian": starts.tolist(),
            "factors": [self._room(b.factors) for b in parts.blocks],
            "pivots": [self._room(b.columns.size) for b in parts.blocks],
            "weak": [self._room(b.columns.size, 1.0) for b in parts.blocks],
        }
        for name in ("turns", "ways"):  # axes that joints turn about and slide along: mostly those of their links
            own = [
                self._room(9) if x.kind == e.EGG else pose
                for x, pose in zip(parts.links, places["pose"][1:], strict=True)
            ]
            places[name] = [-1, *own]
        head[[e.POSES, e.RATES, e.LOADS]] = places["pose"][0], places["rate"][0], places["load"][0]
        return places

    def _block_lists(self, block: Block) -> tuple[int, int]:
        """Write the columns and the motors of a block."""
        return self._write(block.columns.tolist()), self._write(block.inputs.tolist())

    def _reached(self) -> list[tuple[int, int]]:
        """Write for every link the motors that move it, and return where they begin and end."""
        told = {int(k): set(b.inputs.tolist()) for b in self.parts.blocks for k in b.columns}
        told.update({int(k): {a} for a, k in enumerate(self.parts.chain.actuated_index)})
        moves: list[set[int]] = [set()]
        for x in self.parts.links:
            own = (told.get(k, set()) for k in range(x.v, x.v + len(x.columns)))
            moves.append(moves[x.parent].union(*own))
        starts = [self._write(sorted(x)) for x in moves]
        return [(start, start + len(x)) for start, x in zip(starts, moves, strict=True)]

    def _links(
        self,
        constants: dict[str, list[int]],
        memory: dict[str, list[int]],
        reached: list[tuple[int, int]],
        columns: int,
    ) -> None:
        at = self._begin(e.LINKS, e.LINK_SIZE, len(self.parts.links) + 1)
        ground = Link(0, 0, 0, 0, 0, np.eye(3), np.zeros(3), np.eye(3), 0.0, (), np.eye(4), True, ())
        for j, x in enumerate([ground, *self.parts.links]):
            self._set(
                at + e.LINK_SIZE * j,
                {
                    e.KIND: x.kind, e.Q: self.head[e.Q_HERE] + x.q, e.V: x.v, e.DOF: len(x.columns),
                    e.COLUMN0: columns + e.COLUMN_SIZE * x.v, e.PARENT_POSE: memory["pose"][x.parent],
                    e.POSE: memory["pose"][j], e.FIXED: constants["fixed"][j], e.PARENT_RATE: memory["rate"][x.parent],
                    e.RATE: memory["rate"][j], e.PARENT_LOAD: memory["load"][x.parent], e.LOAD: memory["load"][j],
                    e.PARENT_TWIST: memory["twist"][x.parent], e.TWIST: memory["twist"][j],
                    e.MASS: constants["mass"][j],
                    e.REACHED: reached[j][0], e.REACHED_END: reached[j][1],
                },
            )  # fmt: skip

    def _columns(
        self, constants: dict[str, list[int]], memory: dict[str, list[int]], blocks: int, columns: int
    ) -> None:
        owner = {int(k): blocks + e.BLOCK_SIZE * g for g, b in enumerate(self.parts.blocks) for k in b.columns}
        owner.update({int(k): -1 - a for a, k in enumerate(self.parts.chain.actuated_index)})
        for j, x in enumerate(self.parts.links, start=1):
            for k, (axis, motion) in enumerate(x.columns, start=x.v):
                self._set(
                    columns + e.COLUMN_SIZE * k,
                    {
                        e.AXIS: memory["turns"][j] + axis, e.WAY: memory["ways"][j] + axis,
                        e.CENTRE: memory["pose"][j] + e.ORIGIN, e.MOTION: motion,
                        e.PITCH: constants["fixed"][j] + e.LEADING, e.OWNER: owner.get(k, blocks),
                        e.QS: self.head[e.Q_HERE] + x.q, e.QS_KIND: x.kind,
                    },
                )  # fmt: skip

    def _closures(self, constants: dict[str, list[int]], memory: dict[str, list[int]]) -> list[int]:
        """Write the records of closures, their entries and rows; return those of the rows."""
        parts, ratios, found = self.parts, iter(constants["ratio"]), list[int]()
        at = self._begin(e.CLOSURES, e.CLOSURE_SIZE, len(parts.anchored))
        entries = [self._entries(c, ratios, r) for c, r in zip(parts.anchored, self._first_rows(), strict=True)]
        first = self._begin(e.ROWS, e.ROW_SIZE, len(constants["direction"]))
        for n, (anchored, rows) in enumerate(self._with_rows()):
            between = isinstance(anchored, AnchoredFrames)
            count = len(rows) if between else 1
            start = first + e.ROW_SIZE * len(found)
            end = entries[n] + e.ENTRY_SIZE * anchored.columns.size
            i, j = (self.last[k] for k in anchored.joints)
            closure = at + e.CLOSURE_SIZE * n
            self._set(
                closure,
                {
                    e.POSE1: memory["pose"][i], e.POSE2: memory["pose"][j], e.RATE1: memory["rate"][i],
                    e.RATE2: memory["rate"][j], e.FRAMES: constants["frames"][n], e.ROW0: start,
                    e.ROW0_END: start + e.ROW_SIZE * count, e.ENTRY0: entries[n], e.ENTRY0_END: end,
                    e.TIES: 0 if between else 2 if isinstance(anchored, AnchoredStill) else 1,
                },
            )  # fmt: skip
            for row in range(count):
                r = len(found)
                self._set(
                    first + e.ROW_SIZE * r,
                    {
                        e.SORT: SORTS[rows[row].sort] if between else e.RATIOS, e.DIRECTION: constants["direction"][r],
                        e.RESIDUAL: memory["residual"][r], e.LEAD: memory["lead"][r], e.WRENCH: memory["wrench"][r],
                        e.JACOBIAN0: memory["jacobian"][r], e.ENTRIES: entries[n], e.ENTRIES_END: end,
                        e.CLOSURE: closure,
                    },
                )  # fmt: skip
                found.append(first + e.ROW_SIZE * r)
        return found

    def _first_rows(self) -> list[int]:
        """Return the number of the first row of every closure."""
        counts = [len(self._directions(c, rows)) for c, rows in self._with_rows()]
        return [sum(counts[:k]) for k in range(len(counts))]

    def _entries(self, anchored: Anchored, ratios: Iterator[int], row: int) -> int:
        """Write which columns move a closure."""
        own = next((b for b in self.parts.blocks if row in b.rows), None)
        places = {} if own is None else {int(k): i for i, k in enumerate(own.columns)}
        signs = anchored.sign if isinstance(anchored, AnchoredFrames) else np.ones(anchored.columns.size)
        at = e.HEADER + len(self.records)
        for k, sign in zip(anchored.columns, signs, strict=True):
            c = self.head[e.COLUMNS] - e.HEADER + e.COLUMN_SIZE * int(k)
            axis, way, centre, motion, pitch = self.records[c : c + 5]
            self._write([int(k), int(sign), places.get(int(k), -1), axis, way, centre, motion, pitch, next(ratios)])
        return at

    def _fill_blocks(
        self, constants: dict[str, list[int]], memory: dict[str, list[int]], at: int, lists: list[tuple[int, int]],
        rows: list[int],
    ) -> None:  # fmt: skip
        for g, (block, (columns, motors)) in enumerate(zip(self.parts.blocks, lists, strict=True)):
            self._set(
                at + e.BLOCK_SIZE * g,
                {
                    e.ROW_LIST: self._write([rows[r] for r in block.rows]), e.RAW: block.rows.size,
                    e.COLUMN_LIST: columns, e.WIDTH: block.columns.size, e.MOTOR_LIST: motors,
                    e.MOTOR_COUNT: block.inputs.size, e.FACTORS: memory["factors"][g], e.PIVOTS: memory["pivots"][g],
                    e.WEAK: memory["weak"][g], e.MIX: constants["mix"][g], e.HEIGHT: block.height, e.NUMBER: g,
                },
            )  # fmt: skip

    def _springs(self, constants: dict[str, list[int]], memory: dict[str, list[int]]) -> None:
        springs = self.parts.chain.springs
        at = self._begin(e.SPRINGS, e.SPRING_SIZE, len(springs))
        for n, one in enumerate(springs):
            fields = {e.COIL: constants["coil"][n]}
            if isinstance(one, JointSpring):
                j = self.model.getJointId(one.joint)
                turning = self.model.nqs[j] == 2
                fields |= {e.SPRING_SORT: e.AT_TURNING if turning else e.AT_JOINT, e.POSE_A: int(self.model.idx_vs[j])}
            else:
                (i, _), (j, _) = self._ends(one)
                fields |= {
                    e.SPRING_SORT: e.BETWEEN, e.POSE_A: memory["pose"][i], e.RATE_A: memory["rate"][i],
                    e.LOAD_A: memory["load"][i], e.POSE_B: memory["pose"][j], e.RATE_B: memory["rate"][j],
                    e.LOAD_B: memory["load"][j],
                }  # fmt: skip
            self._set(at + e.SPRING_SIZE * n, fields)
