"""A pass of the compiler: numbers are looked up at places, which are never negative.

Python counts negative indices from the end. Numba asks for it wherever an index has a sign, which took more than a
third of the time of a sample. Here every index of an array loses its sign.
Uncompiled code is as Python reads it.
"""

from __future__ import annotations

from typing import Any

from numba.core import ir as _ir
from numba.core import types
from numba.core.compiler import CompilerBase
from numba.core.compiler import DefaultPassBuilder as _Builder
from numba.core.compiler_machinery import FunctionPass
from numba.core.compiler_machinery import register_pass as _register_pass
from numba.core.typed_passes import NopythonTypeInference
from numba.core.typing.templates import signature as _signature

__all__ = ["Places"]

ir: Any = _ir  # Numba has no annotations
signature: Any = _signature
Builder: Any = _Builder
register_pass: Any = _register_pass


class Places(CompilerBase):
    """Numba's compiler of functions, with this pass behind the one that finds types."""

    def define_pipelines(self) -> list[Any]:
        manager = Builder.define_nopython_pipeline(self.state)
        manager.add_pass_after(_Unsigned, NopythonTypeInference)
        manager.finalize()
        return [manager]


@register_pass(mutates_CFG=False, analysis_only=False)
class _Unsigned(FunctionPass):
    """Takes the sign off the indices of arrays of one axis."""

    _name = "unsigned_places"

    def __init__(self) -> None:
        """Do nothing: the base class asks for it."""

    def run_pass(self, state: Any) -> bool:
        for block in state.func_ir.blocks.values():
            block.body = [new for old in block.body for new in self._rewritten(state, block.scope, old)]
        return True

    def _rewritten(self, state: Any, scope: Any, old: Any) -> list[Any]:
        """Return a statement behind one that takes the sign off its index, where it has one."""
        user = old.value if isinstance(old, ir.Assign) else old
        if not (isinstance(user, ir.SetItem) or (isinstance(user, ir.Expr) and user.op == "getitem")):
            return [old]
        table = user.target if isinstance(user, ir.SetItem) else user.value
        if not isinstance(state.typemap[table.name], types.Array) or state.typemap[user.index.name] != types.int64:
            return [old]
        place = scope.redefine("place", old.loc)
        state.typemap[place.name] = types.uint64
        cast = ir.Assign(ir.Expr.cast(user.index, old.loc), place, old.loc)
        user.index = place
        state.calltypes[user] = _unsigned(state.calltypes.pop(user))
        return [cast, old]


def _unsigned(found: Any) -> Any:
    """Return the signature of a look-up with an index that has no sign."""
    table, _, *value = found.args
    return signature(found.return_type, table, types.uint64, *value)
