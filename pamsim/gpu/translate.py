"""The source of a law, rewritten into a part of Python as strict as C.

The laws are ordinary Python. Warp takes the same text but for a few points: it has no records of
numbers that are written, does not mix integers with floats, a variable that a loop changes
may not begin as a literal, and a loop runs over a range. The formula stays what the law states:
this file adds casts, replaces a record's names by places in its row, writes short loops out and
gives each call its full arguments.
"""

from __future__ import annotations

import ast
import inspect
import math
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from types import FunctionType
from typing import Any, NoReturn

from pamsim.core.errors import InputError
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.muscle import PLAIN_GROUPS
from pamsim.physics.record import STATE_NAMES, places_in_row

FLOAT, INT, BOOL, ROW, ROWS, NOTHING = "float", "int", "bool", "row", "rows", "none"

_KINDS = {
    "float": FLOAT,
    "int": INT,
    "bool": BOOL,
    "Row": ROW,
    "MutableRow": ROW,
    "Parameters": ROW,
    "States": ROW,
    "Valves": ROWS,
    "None": NOTHING,
}
"""Kind of an argument or a result by its annotation."""

_TYPES = {FLOAT: "_float", INT: "_int", BOOL: "_bool", ROW: "_row", ROWS: "_rows"}
"""Name, in the rewritten source, of the type of each kind."""

_GROUPS = {
    group.__name__: group
    for group in (*PLAIN_GROUPS, *(operator.group for operator in OPERATORS.values()))
}
"""Groups of parameters that functions take, by their names in annotations."""

_CONSTANTS = {"pi": math.pi, "inf": math.inf, "nan": math.nan}
_TESTS = frozenset({"isnan", "isfinite", "isinf"})


@dataclass(frozen=True, kw_only=True)
class Translation:
    """A function in the strict source.

    Attributes:
        name: of the function in it.
        source: its text. Types are ``_float``, ``_int``, ``_bool``, ``_row`` (n,) and ``_rows``
            (n, k), functions of `math` are ``_math_sin`` and so on.
        callees: name in the source -> Python function.
    """

    name: str
    source: str
    callees: dict[str, FunctionType]


def translate(function: FunctionType) -> Translation:
    """Rewrite a function of numbers and of rows of them.

    Args:
        function: its arguments and result are annotated; it calls `math`, and functions like
            itself.

    Raises:
        InputError: if it uses something that has no counterpart.
    """
    return _Translator(function).translation()


def translated_name(function: FunctionType) -> str:
    """Name of a function in rewritten sources, where functions of all modules meet."""
    return f"{function.__module__}.{function.__qualname__}".replace(".", "_")


def kind_of(annotation: Any, where: str) -> str | tuple[str, ...]:
    """Kind of an argument or a result by its annotation; of several results each one's.

    Args:
        annotation: of the argument or the result.
        where: it stands, for the message.

    Raises:
        InputError: if it has no counterpart.
    """
    text = annotation if isinstance(annotation, str) else getattr(annotation, "__name__", "")
    if text.startswith("tuple["):
        inner = text.removeprefix("tuple[").removesuffix("]").split(",")
        return tuple(_KINDS[one.strip()] for one in inner)
    if text in _GROUPS:
        return ROW
    if text not in _KINDS:
        raise InputError(
            f"{where}: {annotation!r} has no counterpart in compiled code; use float or int"
        )
    return _KINDS[text]


@dataclass(frozen=True)
class _Typed:
    """An expression and what it is."""

    node: ast.expr
    kind: str


class _Translator:
    def __init__(self, function: FunctionType) -> None:
        self._function = function
        self._name = translated_name(function)
        self._globals = function.__globals__
        self._callees: dict[str, FunctionType] = {}
        self._kinds: dict[str, str] = {}
        self._returned = kind_of(
            inspect.signature(function).return_annotation, function.__qualname__
        )
        self._before: list[ast.stmt] = []
        self._temporaries = 0

    def translation(self) -> Translation:
        source = textwrap.dedent(inspect.getsource(self._function))
        definition = ast.parse(source).body[0]
        if not isinstance(definition, ast.FunctionDef):
            raise InputError(f"{self._function.__qualname__} is no function that can be compiled")
        arguments: list[ast.arg] = []
        for name, parameter in inspect.signature(self._function).parameters.items():
            kind = kind_of(parameter.annotation, f"{self._function.__qualname__}({name})")
            assert isinstance(kind, str)
            self._kinds[name] = kind
            arguments.append(ast.arg(arg=name, annotation=_name(_TYPES[kind])))
        _Places(self._function).visit(definition)
        body = list(self._block(definition.body)) or [ast.Pass()]
        result = ast.FunctionDef(
            name=self._name,
            args=ast.arguments(
                posonlyargs=[], args=arguments, kwonlyargs=[], kw_defaults=[], defaults=[]
            ),
            body=body,
            decorator_list=[],
        )
        text = ast.unparse(ast.fix_missing_locations(ast.Module(body=[result], type_ignores=[])))
        return Translation(name=self._name, source=text + "\n", callees=self._callees)

    def _refuse(self, node: ast.AST, why: str = "has no counterpart in compiled code") -> NoReturn:
        text = ast.unparse(node).splitlines()[0]
        raise InputError(f"{self._function.__qualname__}: {text!r} {why}")

    # --- statements ---

    def _block(self, statements: list[ast.stmt]) -> Iterator[ast.stmt]:
        for statement in statements:
            made = list(self._statement(statement))
            before, self._before = self._before, []
            yield from before
            yield from made

    def _statement(self, statement: ast.stmt) -> Iterator[ast.stmt]:
        match statement:
            case ast.Expr(value=ast.Constant()):
                return
            case ast.Expr(value=value):
                yield ast.Expr(self._expression(value).node)
            case ast.Assign(targets=targets, value=value):
                for target in targets:
                    yield from self._assign(target, value)
            case ast.AugAssign(target=target, op=op, value=value):
                yield from self._assign(target, ast.BinOp(_loaded(target), op, value))
            case ast.If(test=test, body=body, orelse=orelse):
                asked = self._expression(test).node
                before, self._before = self._before, []
                yield from before
                yield ast.If(asked, self._nonempty(body), list(self._block(orelse)))
            case ast.For():
                yield from self._loop(statement)
            case ast.While(test=test, body=body):
                asked = self._expression(test).node
                if self._before:
                    self._refuse(test, "cannot be a loop's condition in compiled code")
                yield ast.While(asked, self._nonempty(body), [])
            case ast.Return(value=value):
                yield from self._return(value)
            case ast.Break() | ast.Continue() | ast.Pass():
                yield statement
            case _:
                self._refuse(statement)

    def _nonempty(self, body: list[ast.stmt]) -> list[ast.stmt]:
        return list(self._block(body)) or [ast.Pass()]

    def _assign(self, target: ast.expr, value: ast.expr) -> Iterator[ast.stmt]:
        match target, value:
            case ast.Tuple(elts=names), ast.Tuple(elts=values):
                # All values are taken before the first name changes.
                kept = [self._kept(self._expression(one)) for one in values]
                for statements, _ in kept:
                    yield from statements
                for name, (_, one) in zip(names, kept, strict=True):
                    yield from self._set(name, one)
            case ast.Tuple(elts=names), ast.Call():
                for name, one in zip(names, self._unpacked(value), strict=True):
                    if not (isinstance(name, ast.Name) and name.id == "_"):
                        yield from self._set(name, one)
            case _:
                yield from self._set(target, self._expression(value))

    def _set(self, target: ast.expr, value: _Typed) -> Iterator[ast.stmt]:
        if isinstance(target, ast.Subscript):
            place = self._expression(_loaded(target))
            assert isinstance(place.node, ast.Subscript)
            written = ast.Subscript(place.node.value, place.node.slice, ast.Store())
            yield _assignment(written, self._as(value, place.kind))
            return
        if not isinstance(target, ast.Name):
            self._refuse(target)
        kind = self._kinds.setdefault(target.id, value.kind)
        # The cast makes a variable of its own, which a loop may change.
        yield _assignment(ast.Name(target.id, ast.Store()), self._cast(value, kind))

    def _kept(self, value: _Typed) -> tuple[list[ast.stmt], _Typed]:
        name = self._temporary()
        made = _assignment(ast.Name(name, ast.Store()), self._cast(value, value.kind))
        return [made], _Typed(_name(name), value.kind)

    def _temporary(self) -> str:
        self._temporaries += 1
        return f"_t{self._temporaries}"

    def _unpacked(self, call: ast.expr) -> list[_Typed]:
        """Results of a call that returns several; the call is made before the statement."""
        made = self._call(call) if isinstance(call, ast.Call) else self._refuse(call)
        kinds = self._result_of(call)
        if not isinstance(kinds, tuple):
            self._refuse(call, "returns no tuple")
        names = [self._temporary() for _ in kinds]
        targets: list[ast.expr] = [ast.Name(name, ast.Store()) for name in names]
        self._before.append(_assignment(ast.Tuple(targets, ast.Store()), made.node))
        return [_Typed(_name(name), kind) for name, kind in zip(names, kinds, strict=True)]

    def _return(self, value: ast.expr | None) -> Iterator[ast.stmt]:
        if value is None:
            yield ast.Return()
        elif isinstance(self._returned, str):
            yield ast.Return(self._cast(self._expression(value), self._returned))
        elif isinstance(value, ast.Tuple):
            pairs = zip(value.elts, self._returned, strict=True)
            elements = [self._cast(self._expression(one), kind) for one, kind in pairs]
            yield ast.Return(ast.Tuple(elements, ast.Load()))
        else:
            pairs = zip(self._unpacked(value), self._returned, strict=True)
            elements = [self._cast(one, kind) for one, kind in pairs]
            yield ast.Return(ast.Tuple(elements, ast.Load()))

    def _loop(self, loop: ast.For) -> Iterator[ast.stmt]:
        match loop.iter, loop.target:
            case ast.Call(func=ast.Name(id="range"), args=bounds), ast.Name(id=counter):
                self._kinds[counter] = INT
                limits = [self._as(self._expression(one), INT) for one in bounds]
                over = ast.Call(_name("range"), limits, [])
                before, self._before = self._before, []
                yield from before
                yield ast.For(ast.Name(counter, ast.Store()), over, self._nonempty(loop.body), [])
            case ast.Tuple(elts=rounds), target:
                for one in rounds:
                    yield from self._round(target, one, loop.body)
            case ast.Name(id=name), target if isinstance(self._globals.get(name), tuple):
                for one in self._globals[name]:
                    yield from self._round(
                        target, ast.parse(repr(one), mode="eval").body, loop.body
                    )
            case ast.Name(id=name), ast.Name(id=row) if self._kinds.get(name) == ROWS:
                self._kinds[row] = ROW
                counter = self._temporary()
                over = ast.parse(f"range(len({name}))", mode="eval").body
                taken = ast.parse(f"{row} = {name}[{counter}]").body
                body = [*taken, *self._block(loop.body)]
                yield ast.For(ast.Name(counter, ast.Store()), over, body, [])
            case _:
                self._refuse(loop, "loops over something else than a range or a tuple")

    def _round(self, target: ast.expr, value: ast.expr, body: list[ast.stmt]) -> Iterator[ast.stmt]:
        """One round of a loop that is written out."""
        for statement in body:
            for inner in ast.walk(statement):
                if isinstance(inner, ast.Break | ast.Continue):
                    self._refuse(inner, "cannot leave a loop over a tuple in compiled code")
        if isinstance(target, ast.Name) and isinstance(value, ast.Constant | ast.Name):
            # An index stays a constant.
            body = [
                _Replaced(target.id, value).visit(ast.parse(ast.unparse(s)).body[0]) for s in body
            ]
        else:
            yield from self._block([ast.Assign([target], value)])
        yield from self._block(body)

    # --- expressions ---

    def _expression(self, node: ast.expr) -> _Typed:
        match node:
            case ast.Constant(value=value):
                return self._number(value, node)
            case ast.Name(id=name) if name in self._kinds:
                return _Typed(_name(name), self._kinds[name])
            case ast.Name(id=name):
                return self._number(self._globals.get(name), node)
            case ast.Attribute(value=ast.Name(id="math"), attr=constant):
                return self._number(_CONSTANTS.get(constant), node)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return _Typed(ast.UnaryOp(ast.Not(), self._expression(operand).node), BOOL)
            case ast.UnaryOp(op=op, operand=operand):
                inner = self._expression(operand)
                return _Typed(ast.UnaryOp(op, inner.node), inner.kind)
            case ast.BinOp():
                return self._operation(node)
            case ast.BoolOp(op=op, values=values):
                return _Typed(ast.BoolOp(op, [self._expression(one).node for one in values]), BOOL)
            case ast.Compare():
                return self._comparison(node)
            case ast.IfExp(test=test, body=body, orelse=orelse):
                left, right, kind = self._common(self._expression(body), self._expression(orelse))
                asked = self._expression(test).node
                return _Typed(ast.IfExp(asked, left, right), kind)
            case ast.Call():
                return self._call(node)
            case ast.Subscript(value=ast.Call() as call, slice=ast.Constant(value=int(place))):
                return self._unpacked(call)[place]
            case ast.Subscript(value=ast.Name(id=name), slice=ast.Constant(value=int(place))) if (
                isinstance(self._globals.get(name), tuple)
            ):
                return self._number(self._globals[name][place], node)
            case ast.Subscript(value=value, slice=place):
                row = self._expression(value)
                if row.kind not in (ROW, ROWS):
                    self._refuse(node)
                index = self._as(self._expression(place), INT)
                inner = FLOAT if row.kind == ROW else ROW
                return _Typed(ast.Subscript(row.node, index, ast.Load()), inner)
            case _:
                self._refuse(node)

    def _number(self, value: Any, node: ast.expr) -> _Typed:
        if isinstance(value, bool):
            return _Typed(ast.Constant(value), BOOL)
        if isinstance(value, int):
            return _Typed(ast.Constant(value), INT)
        if isinstance(value, float):
            written = ast.Constant(value)
            if not math.isfinite(value):
                written = _name("_nan" if math.isnan(value) else "_inf")
                if value == -math.inf:
                    written = ast.UnaryOp(ast.USub(), written)
            return _Typed(ast.Call(_name(_TYPES[FLOAT]), [written], []), FLOAT)
        self._refuse(node)

    def _operation(self, node: ast.BinOp) -> _Typed:
        left, right = self._expression(node.left), self._expression(node.right)
        if isinstance(node.op, ast.Div | ast.Pow):
            kind, a, b = FLOAT, self._as(left, FLOAT), self._as(right, FLOAT)
        else:
            a, b, kind = self._common(left, right)
        match node.op:
            case ast.Pow():
                return _Typed(ast.Call(_name("_math_pow"), [a, b], []), kind)
            case ast.Mod():
                return _Typed(ast.Call(_name(f"_modulo_{kind}"), [a, b], []), kind)
            case ast.Add() | ast.Sub() | ast.Mult() | ast.Div():
                return _Typed(ast.BinOp(a, node.op, b), kind)
            case _:
                self._refuse(node)

    def _comparison(self, node: ast.Compare) -> _Typed:
        sides = [self._expression(one) for one in (node.left, *node.comparators)]
        tests: list[ast.expr] = []
        for op, left, right in zip(node.ops, sides, sides[1:], strict=False):
            a, b, _ = self._common(left, right)
            tests.append(ast.Compare(a, [op], [b]))
        return _Typed(tests[0] if len(tests) == 1 else ast.BoolOp(ast.And(), tests), BOOL)

    def _call(self, node: ast.Call) -> _Typed:
        arguments = [self._expression(one) for one in node.args]
        match node.func:
            case ast.Attribute(value=ast.Name(id="math"), attr=name):
                numbers = [self._as(one, FLOAT) for one in arguments]
                if name == "floor":
                    call = ast.Call(_name("_math_floor"), numbers, [])
                    return _Typed(ast.Call(_name(_TYPES[INT]), [call], []), INT)
                kind = BOOL if name in _TESTS else FLOAT
                return _Typed(ast.Call(_name(f"_math_{name}"), numbers, []), kind)
            case ast.Name(id="abs"):
                (one,) = arguments
                return _Typed(ast.Call(_name("abs"), [one.node], []), one.kind)
            case ast.Name(id="len"):
                return _Typed(ast.Call(_name("len"), [arguments[0].node], []), INT)
            case ast.Name(id="int" | "float" as name):
                return _Typed(self._cast(arguments[0], name), name)
            case ast.Name(id="min" | "max" as name):
                whole = arguments[0]
                for one in arguments[1:]:
                    a, b, kind = self._common(whole, one)
                    whole = _Typed(ast.Call(_name(name), [a, b], []), kind)
                return whole
            case ast.Name(id=name):
                return self._law(node, name, arguments)
            case _:
                self._refuse(node)

    def _law(self, node: ast.Call, name: str, arguments: list[_Typed]) -> _Typed:
        callee = self._callee(name, node)
        given = dict(zip(inspect.signature(callee).parameters, arguments, strict=False))
        given |= {str(k.arg): self._expression(k.value) for k in node.keywords}
        numbers: list[ast.expr] = []
        for parameter in inspect.signature(callee).parameters.values():
            kind = kind_of(parameter.annotation, callee.__qualname__)
            assert isinstance(kind, str)
            default = parameter.default
            value = given.get(parameter.name) or self._number(default, node)
            numbers.append(self._as(value, kind))
        self._callees[translated_name(callee)] = callee
        result = self._result_of(node)
        kind = result if isinstance(result, str) else NOTHING
        return _Typed(ast.Call(_name(translated_name(callee)), numbers, []), kind)

    def _callee(self, name: str, node: ast.AST) -> FunctionType:
        callee = self._globals.get(name)
        if not isinstance(callee, FunctionType):
            self._refuse(node)
        return callee

    def _result_of(self, call: ast.expr) -> str | tuple[str, ...]:
        assert isinstance(call, ast.Call)
        if not isinstance(call.func, ast.Name):
            self._refuse(call)
        callee = self._callee(call.func.id, call)
        return kind_of(inspect.signature(callee).return_annotation, callee.__qualname__)

    def _common(self, left: _Typed, right: _Typed) -> tuple[ast.expr, ast.expr, str]:
        """Two operands as one kind, which is float if either is."""
        kind = FLOAT if FLOAT in (left.kind, right.kind) else left.kind
        return self._as(left, kind), self._as(right, kind), kind

    def _as(self, value: _Typed, kind: str) -> ast.expr:
        """A value as a kind; no float becomes an integer by this."""
        if value.kind == kind:
            return value.node
        if (value.kind, kind) == (INT, FLOAT):
            return self._cast(value, kind)
        self._refuse(value.node, f"is {value.kind}, not {kind}")

    def _cast(self, value: _Typed, kind: str) -> ast.expr:
        if kind in (ROW, ROWS, NOTHING):
            return value.node
        return ast.Call(_name(_TYPES[kind]), [value.node], [])


class _Places(ast.NodeTransformer):
    """Names of parameters and states replaced by their places in the rows."""

    def __init__(self, function: FunctionType) -> None:
        self._rows: dict[str, dict[str, int]] = {}
        laws = getattr(function, "laws", (None, None))
        for name, one in inspect.signature(function).parameters.items():
            text = one.annotation if isinstance(one.annotation, str) else ""
            if text == "Parameters":
                self._rows[name] = places_in_row(*laws)
            elif text == "States":
                self._rows[name] = {state: place for place, state in enumerate(STATE_NAMES)}
            elif text in _GROUPS:
                head = f"{_GROUPS[text].group}."
                every = places_in_row(None, _GROUPS[text] if head == "hysteresis." else None)
                own = {k: v for k, v in every.items() if k.startswith(head)}
                self._rows[name] = {k.removeprefix(head): v for k, v in own.items()}

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        """A number's place; the row itself for the record of a group."""
        parts: list[str] = [node.attr]
        inner = node.value
        while isinstance(inner, ast.Attribute):
            parts.insert(0, inner.attr)
            inner = inner.value
        if not isinstance(inner, ast.Name) or inner.id not in self._rows:
            return node
        row = ast.Name(inner.id, ast.Load())
        place = self._rows[inner.id].get(".".join(parts))
        return row if place is None else ast.Subscript(row, ast.Constant(place), node.ctx)


class _Replaced(ast.NodeTransformer):
    """A name replaced by an expression."""

    def __init__(self, name: str, value: ast.expr) -> None:
        self._replaced, self._value = name, value

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """The expression, where the name is the replaced one."""
        return self._value if node.id == self._replaced else node


def _name(name: str) -> ast.Name:
    return ast.Name(name, ast.Load())


def _loaded(node: ast.expr) -> ast.expr:
    return ast.parse(ast.unparse(node), mode="eval").body


def _assignment(target: ast.expr, value: ast.expr) -> ast.Assign:
    return ast.Assign([target], value, lineno=0)
