"""Laws that functions compiled by numba call: machine code made by `pamsim.engine.machine_code`."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Iterable, Mapping
from types import FunctionType, MappingProxyType
from typing import Any

import llvmlite.binding as llvm
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin

from pamsim.engine import law_writer, machine_code, translate
from pamsim.engine.jit import fingerprint, reached_functions
from pamsim.engine.user_laws import OUTSIDE

_NUMBA: dict[str, Any] = {
    translate.FLOAT: types.float64,
    translate.INT: types.int64,
    translate.BOOL: types.boolean,
    translate.NOTHING: types.void,
}
_LLVM: dict[str, ir.Type] = {
    "double": ir.DoubleType(),
    "i64": ir.IntType(64),
    "i1": ir.IntType(1),
    "ptr": ir.DoubleType().as_pointer(),
}


_declared: set[FunctionType] = set()


class Laws:
    """Laws of one module, for functions that numba compiles to call by name.

    To numba it is a library that others link.

    Args:
        laws: their arguments are numbers and rows of them, and all are given in a call.
        known: slot of the row ``par`` -> number with which they are compiled a second time.

    Attributes:
        key: what the machine code depends on.
    """

    _reload_init = frozenset[str]()

    def __init__(
        self,
        laws: Iterable[FunctionType],
        known: Mapping[int, float] = MappingProxyType({}),
    ) -> None:
        self._laws, self._known = tuple(laws), dict(known)
        self._module: Any = None
        parts = (
            fingerprint(reached_functions(*self._laws)),
            *OUTSIDE.values(),
            repr(self._known),
            *(inspect.getsource(module) for module in (law_writer, machine_code, translate)),
        )
        self.key = hashlib.sha256("\n".join(parts).encode()).hexdigest()
        for law in self._laws:
            if law not in _declared:
                _declared.add(law)
                self._declare(law)

    def _ensure_finalized(self) -> None:
        if self._module is None:
            text = machine_code.module(self._laws, OUTSIDE, self._known)
            self._module = llvm.parse_assembly(text)

    def _get_module_for_linking(self) -> Any:
        return self._module

    def _declare(self, law: FunctionType) -> None:
        """Teach numba the types of a law's call, and how it is made."""
        kinds, returned = machine_code.signature(law)

        class Template(AbstractTemplate):
            key = law

            def generic(self, args: Any, kws: Any) -> Any:
                if kws or len(args) != len(kinds) or not all(map(_fits, kinds, args)):
                    return None
                taken = [_NUMBA.get(kind, one) for kind, one in zip(kinds, args, strict=True)]
                return signature(_NUMBA[returned], *taken)

        infer_global(law, types.Function(Template))

        @lower_builtin(law, *[types.Any] * len(kinds))
        def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            context.active_code_library.add_linking_library(self)
            given: list[Any] = []
            for kind, type_, value in zip(kinds, sig.args, args, strict=True):
                given += _parts(context, builder, kind, type_, value)
            result = ir.VoidType()
            if returned != translate.NOTHING:
                result = _LLVM[law_writer.TYPES[returned][0]]
            taken = [_LLVM[part] for kind in kinds for part in law_writer.TYPES[kind]]
            callee = cgutils.get_or_insert_function(
                builder.module, ir.FunctionType(result, taken), translate.translated_name(law)
            )
            made = builder.call(callee, given)
            return context.get_dummy_value() if returned == translate.NOTHING else made


def _fits(kind: str, type_: Any) -> bool:
    """Whether numba's type can be handed over; the numbers of a row lie one after the other."""
    if kind in (translate.ROW, translate.ROWS):
        dimensions = 1 if kind == translate.ROW else 2
        return isinstance(type_, types.Array) and (type_.ndim, type_.layout) == (dimensions, "C")
    return isinstance(type_, types.Number | types.Boolean)


def _parts(context: Any, builder: Any, kind: str, type_: Any, value: Any) -> list[Any]:
    """A value as machine code takes it: of an array its address and size."""
    if kind not in (translate.ROW, translate.ROWS):
        return [value]
    array = context.make_array(type_)(context, builder, value)
    shape = cgutils.unpack_tuple(builder, array.shape)
    if kind == translate.ROW:
        return [array.data, shape[0]]
    strides = cgutils.unpack_tuple(builder, array.strides)
    return [array.data, shape[0], builder.sdiv(strides[0], array.itemsize)]
