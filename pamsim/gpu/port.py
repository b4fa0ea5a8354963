"""Laws as functions of Warp, an extra, from the source that the CPU's kernel compiles."""

from __future__ import annotations

import functools
import inspect
import itertools
import math
import sys
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from types import BuiltinFunctionType, FunctionType
from typing import Any

from pamsim.core.compilation import function_of_text
from pamsim.core.errors import InputError
from pamsim.gpu.translate import translate, translated_name, with_body
from pamsim.physics.chosen_law import OF_LAW, OF_OPERATOR, law_functions, operator_functions
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.hysteresis.catalog import OPERATORS

PRECISIONS = ("float32", "float64")
"""Arithmetic and memory of the muscles."""

_MATH = {"atan", "atan2", "copysign", "cos", "exp", "isfinite", "isinf", "isnan", "log", "pow"} | {
    *("sin", "sqrt", "tan", "tanh")
}
"""Functions that Warp calls as Python's `math` does."""


def warp() -> Any:
    """Warp; it stays silent about what it compiles, unless the caller has imported it before.

    Raises:
        InputError: if it is not installed.
    """
    new = "warp" not in sys.modules
    with _installed():
        import warp as package
    if new:
        package.config.log_level = package.LOG_WARNING
    return package


def mujoco_warp() -> Any:
    """MuJoCo's engine in Warp; errors as of `warp`."""
    warp()
    with _installed():
        import mujoco_warp as package
    return package


def find_device(name: str | None) -> Any:
    """A device of Warp, by name; its own choice for None.

    Raises:
        InputError: if Warp is not installed, or finds no such device.
    """
    wp = warp()
    try:
        return wp.get_device(name)
    except (RuntimeError, ValueError):
        known = ", ".join(device.alias for device in wp.get_devices())
        raise InputError(f"no device {name!r}; Warp finds: {known}") from None


@contextmanager
def _installed() -> Generator[None]:
    try:
        yield
    except ModuleNotFoundError as error:
        message = f"a GPU needs the package {error.name}: pip install 'pamsim[gpu]'"
        raise InputError(message) from None


class Port:
    """Laws as functions of one Warp module, to whose name the precision is added.

    All that is in a module is compiled again whenever something is added to it.

    Attributes:
        module: the Warp module.
        scalar: type of its numbers.

    Raises:
        InputError: for a precision that is none of `PRECISIONS`, or if Warp is not installed.
    """

    def __init__(self, precision: str, name: str = "pamsim.gpu") -> None:
        if precision not in PRECISIONS:
            raise InputError(f"no precision {precision!r}; give {' or '.join(PRECISIONS)}")
        self._wp = wp = warp()
        self.scalar: Any = getattr(wp, precision)
        self.module: Any = wp.get_module(f"{name}.{precision}")
        # Nobody differentiates the steps, and the code for it doubles the time to compile.
        wp.set_module_options({"enable_backward": False}, module=self.module)
        self._known: dict[str, Any] = {}
        self._names: dict[str, Any] = {
            "_float": self.scalar,
            "_int": wp.int32,
            "_bool": wp.bool,
            "_row": wp.array(dtype=self.scalar),
            "_rows": wp.array2d(dtype=self.scalar),
        }
        # Warp has no operators of a whole number and another, and its quotient of two is whole.
        signs = {"add": "+", "sub": "-", "mul": "*", "pow": "**", "div": "/"}
        mixed = itertools.product(signs, ("a: _int, b: _float", "a: _float, b: _int"))
        for operator, given in (*mixed, ("div", "a: _int, b: _int")):
            made = self._relay(operator, given, f"_float(a) {signs[operator]} _float(b)")
            self._names.setdefault(operator, made).add_overload(made)
        self._replaced: dict[Any, Any] = {
            **ladders(),
            **{getattr(math, one): getattr(wp, one) for one in _MATH},
            math.floor: self._relay("floor", "x: _float", "_int(whole(x))", whole=wp.floor),
            math.fmod: wp.mod,
            math.expm1: expm1,
        }
        self._names["mod"] = self.function(modulo)

    def _relay(self, name: str, arguments: str, result: str, **names: Any) -> Any:
        text = f"def {name}({arguments}):\n    return {result}\n"
        return self._compiled(name, text, f"{name}({arguments})", names)

    def _compiled(self, name: str, text: str, where: str, names: Mapping[str, Any]) -> Any:
        where = f"<{where} in {self.scalar.__name__}>"
        python = function_of_text(name, text, where, {**self._names, **names}, typed=True)
        return self._wp.func(python, name=name, module=self.module)

    def function(self, law: FunctionType) -> Any:
        """A law and all that it calls as a Warp function.

        Raises:
            InputError: if it uses something that has no counterpart.
        """
        law = self._replaced.get(law, law)
        name = translated_name(law)
        if name not in self._known:
            text, used = translate(law)
            names = {one: self._counterpart(value) for one, value in used.items()}
            self._known[name] = self._compiled(name, text, name, names)
        return self._known[name]

    def _counterpart(self, value: Any) -> Any:
        """What stands in Warp for a number or a function that a law refers to."""
        value = self._replaced.get(value, value)
        if isinstance(value, FunctionType):
            return self.function(value)
        if isinstance(value, BuiltinFunctionType):
            raise InputError(
                f"math.{value.__name__} has no counterpart in compiled code; use another function"
            )
        return self.scalar(value) if isinstance(value, float) else value


port = functools.cache(Port)
"""The only port of a precision in the process; errors as of `Port`."""


@functools.cache
def ladders() -> dict[Callable[..., Any], FunctionType]:
    """Function of `CHOICES` -> one that asks for the code of each law of the package in turn."""
    laws = sorted({FORCE_LAWS.code(law.group) for law in FORCE_LAWS.own()})
    operators = sorted({OPERATORS.code(operator.group) for operator in OPERATORS.own()})
    of_law = {code: law_functions(code) for code in laws}
    of_operator = {code: operator_functions(code) for code in (*operators, 0.0)}
    return {place: _ladder(place, "m.force.law", of_law) for place in OF_LAW} | {
        place: _ladder(place, "m.hysteresis.law", of_operator) for place in OF_OPERATOR
    }


def _ladder(
    place: Any, asked: str, by_code: Mapping[float, Mapping[Callable[..., Any], FunctionType]]
) -> FunctionType:
    given = ", ".join(inspect.signature(place).parameters)
    word = "" if inspect.signature(place).return_annotation == "None" else "return "
    *codes, last = by_code
    tests = [f"if {asked} == {code!r}:\n    {word}own_{code:.0f}({given})\nel" for code in codes]
    # The last one answers for codes that no law has.
    body = f"{''.join(tests)}se:\n    {word}own_{last:.0f}({given})"
    names = {f"own_{code:.0f}": functions[place] for code, functions in by_code.items()}
    return with_body(place, "_of_law", body, **names)


def expm1(x: float) -> float:
    """Exponential minus 1, with all digits for small x (Kahan)."""
    grown = math.exp(x)
    if grown == 1.0:
        return x
    gained = grown - 1.0
    if gained == -1.0 or not math.isfinite(grown):
        return gained
    return gained * x / math.log(grown)


def modulo(a: float, b: float) -> float:
    """Remainder with the sign of the divisor, as Python's."""
    rest = math.fmod(a, b)
    if rest != 0.0 and (rest < 0.0) != (b < 0.0):
        return rest + b
    return rest
