"""Array habits: check once at the boundary, copy in, freeze; write round-off as what it is."""

from fivebar_pin._arrays.algebra import block_svd, cross, inverse, skew
from fivebar_pin._arrays.checks import all_of, checked, integer, number, numeric, reals, require_memory
from fivebar_pin._arrays.immutable import Array, Immutable, frozen, seal
from fivebar_pin._arrays.lazy import lazy
from fivebar_pin._arrays.results import finite, require_finite
from fivebar_pin._arrays.rounding import ROUND_OFF, TINY, figures, settled, table_text

__all__ = [
    "ROUND_OFF",
    "TINY",
    "Array",
    "Immutable",
    "all_of",
    "block_svd",
    "checked",
    "cross",
    "figures",
    "finite",
    "frozen",
    "integer",
    "inverse",
    "lazy",
    "number",
    "numeric",
    "reals",
    "require_finite",
    "require_memory",
    "seal",
    "settled",
    "skew",
    "table_text",
]
