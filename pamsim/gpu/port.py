"""Laws as Warp functions, from the source that the CPU's kernel compiles."""

from __future__ import annotations

import functools
from types import FunctionType
from typing import Any

from pamsim.core.compilation import function_of_text
from pamsim.core.errors import InputError
from pamsim.gpu import arithmetic
from pamsim.gpu.replaced_functions import IN_SINGLE, ladders
from pamsim.gpu.translate import translate, translated_name
from pamsim.gpu.warp_package import warp

PRECISIONS = ("float32", "float64")
"""Arithmetic and memory of the muscles."""

_MATH = (
    "atan",
    "atan2",
    "copysign",
    "cos",
    "exp",
    "floor",
    "isfinite",
    "isinf",
    "isnan",
    "log",
    "pow",
    "sin",
    "sqrt",
    "tan",
    "tanh",
)
"""Functions that Warp calls as Python's `math` does."""


class Port:
    """Laws as functions of one Warp module.

    Args:
        precision: one of `PRECISIONS`.
        name: of the Warp module, to which the precision is added. All that is in a module is
            compiled again whenever something is added to it.

    Attributes:
        module: the Warp module.
        scalar: type of its numbers.

    Raises:
        InputError: for another precision, or if Warp is not installed.
    """

    def __init__(self, precision: str, name: str = "pamsim.gpu") -> None:
        if precision not in PRECISIONS:
            raise InputError(f"no precision {precision!r}; give {' or '.join(PRECISIONS)}")
        self._wp = wp = warp()
        self.scalar: Any = getattr(wp, precision)
        self.module: Any = wp.get_module(f"{name}.{precision}")
        # Nobody differentiates the steps, and the code for it doubles the time to compile.
        wp.set_module_options({"enable_backward": False}, module=self.module)
        self._replaced = {**ladders(), **(IN_SINGLE if precision == "float32" else {})}
        self._known: dict[str, Any] = {}
        self._names: dict[str, Any] = {
            "_float": self.scalar,
            "_int": wp.int32,
            "_bool": wp.bool,
            "_row": wp.array(dtype=self.scalar),
            "_rows": wp.array2d(dtype=self.scalar),
            "_inf": wp.inf,
            "_nan": wp.nan,
            "_math_fmod": wp.mod,
            **{f"_math_{name}": getattr(wp, name) for name in _MATH},
        }
        for name in ("modulo_float", "modulo_int"):
            self._names[f"_{name}"] = self.function(getattr(arithmetic, name))
        self._names["_math_expm1"] = self.function(arithmetic.expm1)

    def function(self, law: FunctionType) -> Any:
        """A law and all that it calls as a Warp function.

        Raises:
            InputError: if it uses something that has no counterpart.
        """
        law = self._replaced.get(law, law)
        name = translated_name(law)
        if name not in self._known:
            translation = translate(law)
            callees = {one: self.function(callee) for one, callee in translation.callees.items()}
            where = f"<{translation.name} in {self.scalar.__name__}>"
            names = {**self._names, **callees}
            python = function_of_text(
                translation.name, translation.source, where, names, typed=True
            )
            self._known[name] = self._wp.func(python, name=name, module=self.module)
        return self._known[name]


@functools.cache
def port(precision: str) -> Port:
    """The only port of a precision in the process.

    Raises:
        InputError: for an unknown precision, or if Warp is not installed.
    """
    return Port(precision)
