"""Rows of closures that say nothing of one design may say something of another: records for looking at them.

In a planar loop nothing happens across the plane, and the rows there are left out. A design whose links leave the
plane is found by what these rows leave open.
"""

from __future__ import annotations

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.engine import tables as e
from fivebar_pin.mechanism.layout import SORTS, Parts

__all__ = ["left_out"]


def left_out(I: e.Integers, W: Array, parts: Parts) -> tuple[e.Integers | None, Array]:
    """Return records with the rows that were left out in place of those of the chain, and W with room for them.

    Args:
        I, W: of the chain.
        parts: what they were made of.

    Returns:
        The records, None where no rows were left out, and W. Both sets of records work on it.
    """
    closures, rows, numbers = list[int](), list[int](), [W]
    count = sum(len(some) > 0 for some in parts.left)
    first_row, free = I.size + e.CLOSURE_SIZE * count, W.size
    for n, some in enumerate(parts.left):
        if not some:
            continue
        record = I[I[e.CLOSURES] + e.CLOSURE_SIZE * n :][: e.CLOSURE_SIZE].copy()
        at = I.size + len(closures)
        record[[e.ROW0, e.ROW0_END]] = first_row + len(rows), first_row + len(rows) + e.ROW_SIZE * len(some)
        closures += record.tolist()
        for row in some:
            unit = 1.0 / parts.length if row.sort in ("along", "length") else 1.0
            entries = int(record[e.ENTRY0_END] - record[e.ENTRY0]) // e.ENTRY_SIZE
            fields = np.zeros(e.ROW_SIZE, dtype=np.int64)
            fields[[e.SORT, e.DIRECTION, e.CLOSURE]] = SORTS[row.sort], free, at
            fields[[e.RESIDUAL, e.LEAD, e.WRENCH, e.JACOBIAN0]] = free + np.array([8, 9, 10, 19])
            fields[[e.ENTRIES, e.ENTRIES_END]] = record[e.ENTRY0], record[e.ENTRY0_END]
            rows += fields.tolist()
            numbers.append(np.array([*row.direction, *row.other, row.number, unit, *np.zeros(11 + entries)]))
            free += numbers[-1].size
    if not rows:
        return None, W
    records = np.concatenate([I, closures, rows]).astype(np.int64)
    records[[e.CLOSURES, e.CLOSURES_END]] = I.size, first_row
    records[[e.ROWS, e.ROWS_END]] = first_row, records.size
    return records, np.concatenate(numbers)
