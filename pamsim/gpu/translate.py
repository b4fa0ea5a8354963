"""The source of a law in the Python that Warp compiles.

Warp takes the laws' own text but for a few points: numbers of a record are places in its row, a
literal has the precision of the others, a loop over a tuple is written out, and a variable that
begins as a literal or as another one is a copy, which a loop may change. Types are Warp's business.
"""

from __future__ import annotations

import ast
import copy
import functools
import inspect
import itertools
import math
import textwrap
from collections.abc import Mapping, Sequence
from types import FunctionType
from typing import Any, NoReturn

from pamsim.core.compilation import function_of_text
from pamsim.core.errors import InputError
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.muscle import PLAIN_GROUPS
from pamsim.physics.record import STATE_NAMES, places_in_row

_GROUPS = {
    group.__name__: group
    for group in (*PLAIN_GROUPS, *(operator.group for operator in OPERATORS.values()))
}
_TYPES = {
    **{name: f"_{name}" for name in ("float", "int", "bool")},
    **dict.fromkeys(("Row", "MutableRow", "Parameters", "States", *_GROUPS), "_row"),
    "Valves": "_rows",
}
"""Annotation of an argument -> name of its type in the translated source."""

_BUILTINS = frozenset({"abs", "int", "len", "max", "min", "range"})
_TAKEN = (
    *(ast.Assign, ast.AugAssign, ast.Break, ast.Continue, ast.Expr, ast.For, ast.If, ast.Pass),
    *(ast.Return, ast.While, ast.Attribute, ast.BinOp, ast.BoolOp, ast.Call, ast.Compare),
    *(ast.Constant, ast.IfExp, ast.Name, ast.Subscript, ast.Tuple, ast.UnaryOp, ast.keyword),
    *(ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Mod, ast.Pow, ast.USub, ast.Not, ast.boolop),
    *(ast.Eq, ast.NotEq, ast.Lt, ast.LtE, ast.Gt, ast.GtE, ast.expr_context),
)


def translate(function: FunctionType) -> tuple[str, dict[str, Any]]:
    """Rewrite a function of numbers and of rows of them, with annotated arguments.

    It may call `math`, and functions like itself.

    Returns:
        Text of a function called `translated_name`, with the types ``_float``, ``_int``, ``_bool``,
        ``_row`` (n,) and ``_rows`` (n, k); by their names, the numbers and functions that it refers
        to, among them those of `math`.

    Raises:
        InputError: if it uses something that has no counterpart.
    """
    where, source = function.__qualname__, textwrap.dedent(inspect.getsource(function))
    definition = ast.parse(source).body[0]
    if not isinstance(definition, ast.FunctionDef):
        raise InputError(f"{where} is no function that can be compiled")
    records: dict[str, dict[str, int]] = {}
    for argument in definition.args.args:
        name, kind = argument.arg, inspect.signature(function).parameters[argument.arg].annotation
        kind = kind if isinstance(kind, str) else getattr(kind, "__name__", repr(kind))
        if kind not in _TYPES:
            raise InputError(
                f"{where}({name}): {kind!r} has no counterpart in compiled code; use float or int"
            )
        argument.annotation = ast.Name(_TYPES[kind])
        records[name] = _places(kind, getattr(function, "laws", (None, None)))
    rewriter = _Rewriter(function, records)
    definition.name, definition.returns = translated_name(function), None
    definition.args.defaults = [rewriter.visit(one) for one in definition.args.defaults]
    definition.body = rewriter.block(definition.body)
    return ast.unparse(ast.fix_missing_locations(definition)) + "\n", rewriter.names


def translated_name(function: FunctionType) -> str:
    """Name of a function in translated sources, where functions of all modules meet."""
    return f"{function.__module__}.{function.__qualname__}".replace(".", "_")


def with_body(function: FunctionType, suffix: str, body: str, **names: Any) -> FunctionType:
    """A function with the arguments of another, its name with a suffix, and a body of its own."""
    head = f"def {function.__name__}{inspect.signature(function)}:\n".replace("'", "")
    where = f"<{translated_name(function)}{suffix}>"
    space = {"__name__": function.__module__, **names}
    text = head + textwrap.indent(body, "    ") + "\n"
    made = function_of_text(function.__name__, text, where, space)
    made.__qualname__ = f"{function.__qualname__}{suffix}"
    return made


@functools.cache
def _result(function: FunctionType, place: int) -> FunctionType:
    """A function that gives one of the results of another."""
    count = str(inspect.signature(function).return_annotation).count(",") + 1
    results = ", ".join(f"result_{i}" for i in range(count))
    given = ", ".join(inspect.signature(function).parameters)
    body = f"{results} = several({given})\nreturn result_{place}"
    return with_body(function, f"_{place}", body, several=function)


def _places(kind: str, laws: tuple[Any, Any]) -> dict[str, int]:
    """Places of the numbers of a record, by their names; none of an argument of another kind."""
    if kind == "Parameters":
        return places_in_row(*laws)
    if kind == "States":
        return {name: place for place, name in enumerate(STATE_NAMES)}
    if kind not in _GROUPS:
        return {}
    head = f"{_GROUPS[kind].group}."
    every = places_in_row(None, _GROUPS[kind] if head == "hysteresis." else None)
    return {k.removeprefix(head): place for k, place in every.items() if k.startswith(head)}


class _Rewriter(ast.NodeTransformer):
    def __init__(self, function: FunctionType, records: Mapping[str, Mapping[str, int]]) -> None:
        self._function, self._records, self.names = function, records, dict[str, Any]()
        self._globals, self._locals = function.__globals__, {*function.__code__.co_varnames}

    def block(self, statements: Sequence[ast.stmt]) -> list[ast.stmt]:
        """Statements rewritten."""
        rewritten: Any = self.generic_visit(ast.Module(list(statements), []))
        return rewritten.body

    def visit(self, node: ast.AST) -> Any:
        """A node rewritten, if it has a counterpart."""
        if not isinstance(node, _TAKEN):
            self._refuse(node)
        return super().visit(node)

    def _refuse(self, node: ast.AST, why: str = "has no counterpart in compiled code") -> NoReturn:
        text = ast.unparse(node).splitlines()[0]
        raise InputError(f"{self._function.__qualname__}: {text!r} {why}")

    def _unique(self) -> ast.Name:
        name = f"unnamed_{len(self._locals)}"
        self._locals.add(name)
        return ast.Name(name)

    def visit_Expr(self, node: ast.Expr) -> ast.AST | None:
        return None if isinstance(node.value, ast.Constant) else self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        if isinstance(node.value, float):
            return ast.Call(ast.Name("_float"), [node], [])
        return node if isinstance(node.value, int) else self._refuse(node)

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if node.id == "_":  # may stand for results of several types
            return self._unique()
        if node.id in self._locals or node.id in _BUILTINS:
            return node
        if node.id == "float":
            return ast.Name("_float")
        value = self._globals.get(node.id)
        if not isinstance(value, int | float | FunctionType):
            self._refuse(node)
        return self._named(value, node.id)

    def _named(self, value: Any, name: str = "") -> ast.Name:
        name = translated_name(value) if isinstance(value, FunctionType) else name
        self.names[name] = value
        return ast.Name(name)

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        first, _, name = ast.unparse(node).partition(".")
        if self._records.get(first):
            place = self._records[first].get(name)  # none for the record of a group
            row = ast.Name(first)
            return row if place is None else ast.Subscript(row, ast.Constant(place), node.ctx)
        if first != "math" or not hasattr(math, name):
            self._refuse(node)
        return self._named(getattr(math, name), f"math_{name}")

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        match node.value, node.slice:
            case ast.Call(func=ast.Name(id=name)) as call, ast.Constant(value=int(place)):
                self.generic_visit(call)
                call.func = self._named(_result(self._globals[name], place))
                return call
            case value, ast.Constant(value=int(place)) if elements := self._elements(value):
                return self.visit(elements[place])
            case _:
                return self.generic_visit(node)

    def _elements(self, node: ast.expr) -> list[ast.expr]:
        """Elements of a tuple, written out or a global one; none of something else."""
        if isinstance(node, ast.Name) and isinstance(self._globals.get(node.id), tuple):
            node = ast.parse(repr(self._globals[node.id]), mode="eval").body
        return node.elts if isinstance(node, ast.Tuple) else []

    def visit_Call(self, node: ast.Call) -> ast.expr:
        self.generic_visit(node)
        if isinstance(node.func, ast.Name) and node.func.id in ("min", "max"):
            return functools.reduce(lambda a, b: ast.Call(node.func, [a, b], []), node.args)
        return node

    def visit_Assign(self, node: ast.Assign) -> list[ast.stmt]:
        self.generic_visit(node)
        if isinstance(node.value, ast.Tuple):
            # All values are taken before the first variable changes.
            node.value.elts = [_copied(one) for one in node.value.elts]
        else:
            node.value = _copied(node.value)
        return [ast.Assign([target], node.value) for target in node.targets]

    def visit_For(self, node: ast.For) -> ast.AST | list[ast.stmt]:
        if isinstance(node.iter, ast.Call):
            return self.generic_visit(node)
        if isinstance(node.iter, ast.Name) and node.iter.id in self._locals:  # rows
            counter, rows = self._unique().id, node.iter.id
            node.iter = ast.parse(f"range(len({rows}))", mode="eval").body
            row = ast.parse(f"{rows}[{counter}]", mode="eval").body
            node.body.insert(0, ast.Assign([node.target], row))
            node.target = ast.Name(counter)
            return self.generic_visit(node)
        rounds, unrolled = self._elements(node.iter), list[ast.stmt]()
        if not rounds:
            self._refuse(node, "loops over something else than a range or a tuple")
        for inner in itertools.chain.from_iterable(map(ast.walk, node.body)):
            if isinstance(inner, ast.Break | ast.Continue):
                self._refuse(inner, "cannot leave a loop over a tuple in compiled code")
        for one in rounds:
            unrolled += copy.deepcopy([ast.Assign([node.target], one), *node.body])
        return self.block(unrolled)


def _copied(value: ast.expr) -> ast.expr:
    """A value as a variable of its own."""
    if isinstance(value, ast.Constant | ast.Name | ast.Subscript | ast.UnaryOp):
        return ast.Call(ast.Name("copy"), [value], [])
    return value
