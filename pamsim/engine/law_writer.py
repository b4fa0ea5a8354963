"""Write one law as an LLVM function.

Arithmetic is Python's, operation by operation, and functions of `math` are those of the C library
that Python calls: results are Python's to the last bit.
"""

from __future__ import annotations

import ast
import inspect
import math
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import FunctionType

from pamsim.engine.translate import (
    BOOL,
    FLOAT,
    INT,
    NOTHING,
    ROW,
    ROWS,
    kind_of,
    translate,
    translated_name,
)

TYPES: Mapping[str, tuple[str, ...]] = {
    FLOAT: ("double",),
    INT: ("i64",),
    BOOL: ("i1",),
    ROW: ("ptr", "i64"),  # of the first number; how many
    ROWS: ("ptr", "i64", "i64"),  # how many rows; numbers from one row to the next
    NOTHING: (),
}
"""LLVM types that a value of each kind consists of."""

_ARITHMETIC = {
    ast.Add: ("fadd", "add"),
    ast.Sub: ("fsub", "sub"),
    ast.Mult: ("fmul", "mul"),
    ast.Div: ("fdiv", ""),
}
"""Operations on floats, and on whole numbers."""

_TESTS = {
    ast.Lt: ("olt", "slt"),
    ast.LtE: ("ole", "sle"),
    ast.Gt: ("ogt", "sgt"),
    ast.GtE: ("oge", "sge"),
    ast.Eq: ("oeq", "eq"),
    ast.NotEq: ("une", "ne"),
}
"""The same of comparisons."""

INTRINSIC = {"sqrt": 1, "floor": 1, "copysign": 2, "fabs": 1}
"""Functions that processors compute exactly, with their number of arguments."""

LIBRARY = {
    "acos": 1, "acosh": 1, "asin": 1, "asinh": 1, "atan": 1, "atan2": 2, "atanh": 1, "cos": 1,
    "cosh": 1, "exp": 1, "expm1": 1, "fmod": 2, "hypot": 2, "log": 1, "log10": 1, "log1p": 1,
    "log2": 1, "pow": 2, "sin": 1, "sinh": 1, "tan": 1, "tanh": 1,
}  # fmt: skip
"""Functions of the C library, with their number of arguments."""

_NAMES = {"_inf": math.inf, "_nan": math.nan}


@dataclass(frozen=True)
class _Value:
    kind: str
    parts: tuple[str, ...]


@dataclass(frozen=True)
class WrittenLaw:
    """A function as LLVM code.

    Attributes:
        text: of it.
        reads: slots of the row ``par`` that it reads.
        callees: what it calls.
    """

    text: str
    reads: frozenset[int]
    callees: tuple[FunctionType, ...]


def full_name(law: FunctionType) -> str:
    """Name by which machine code calls a law of which nothing is known beforehand."""
    return f"{translated_name(law)}.full"


def usual_name(law: FunctionType) -> str:
    """Name of its copy for what is known."""
    return f"{translated_name(law)}.usual"


def _number(value: float) -> str:
    return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"


def results(kinds: str | tuple[str, ...]) -> str:
    """LLVM type of a result."""
    if isinstance(kinds, str):
        return (*TYPES[kinds], "void")[0]
    return "{ " + ", ".join(TYPES[kind][0] for kind in kinds) + " }"


class LawWriter:
    """Writes one law.

    Args:
        law: see `pamsim.engine.translate.translate`.
        known: slot of the row ``par`` -> number.
        has_usual: whether a callee has a copy for what is known.
    """

    def __init__(
        self,
        law: FunctionType,
        known: Mapping[int, float],
        has_usual: Callable[[FunctionType], bool],
    ) -> None:
        self._law, self._known, self._has_usual = law, known, has_usual
        self._translation = translate(law)
        self._variables: dict[str, str] = {}
        self._slots: list[str] = []
        self._lines: list[str] = []
        self._count = 0
        self._ended = False
        self._loops: list[tuple[str, str]] = []
        self._reads: set[int] = set()
        returned = inspect.signature(law).return_annotation
        self._returned = kind_of(returned, law.__qualname__)

    def written(self) -> WrittenLaw:
        """The law as LLVM code."""
        arguments: list[str] = []
        for name, parameter in inspect.signature(self._law).parameters.items():
            kind = kind_of(parameter.annotation, self._law.__qualname__)
            assert isinstance(kind, str)
            parts: list[str] = []
            for type_ in TYPES[kind]:
                part = f"%a{len(arguments)}"
                # No law is given one row twice and writes it.
                apart = " noalias" if (kind, type_) == (ROW, "ptr") else ""
                arguments.append(f"{type_}{apart} {part}")
                parts.append(part)
            self._store(name, _Value(kind, tuple(parts)))
        definition = ast.parse(self._translation.source).body[0]
        assert isinstance(definition, ast.FunctionDef)
        self._block(definition.body)
        if not self._ended:
            self._emit("ret void" if self._result() == "void" else "unreachable")
        # Several numbers are not returned in registers, and what is known must reach all callees.
        inline = " alwaysinline" if self._known or not isinstance(self._returned, str) else ""
        name = usual_name(self._law) if self._known else full_name(self._law)
        head = f"define internal {self._result()} @{name}({', '.join(arguments)})"
        text = "\n".join([f"{head} nounwind{inline} {{", "entry:", *self._slots, *self._lines, "}"])
        callees = tuple(self._translation.callees.values())
        return WrittenLaw(text, frozenset(self._reads), callees)

    def _result(self) -> str:
        return results(self._returned)

    # --- text ---

    def _fresh(self) -> str:
        self._count += 1
        return f"%t{self._count}"

    def _emit(self, text: str) -> None:
        if self._ended:  # what follows a return or a break is never reached
            self._label(self._new_label())
        self._lines.append(f"  {text}")
        self._ended = text.startswith(("ret ", "br ", "unreachable"))

    def _made(self, text: str) -> str:
        name = self._fresh()
        self._emit(f"{name} = {text}")
        return name

    def _new_label(self) -> str:
        self._count += 1
        return f"b{self._count}"

    def _label(self, name: str) -> None:
        if not self._ended:
            self._lines.append(f"  br label %{name}")
        self._lines.append(f"{name}:")
        self._ended = False

    def _branch(self, asked: ast.expr, yes: str, no: str) -> None:
        """Go on at one of two labels; the second operand of "and" is asked only if need be."""
        match asked:
            case ast.BoolOp(op=op, values=values):
                for value in values[:-1]:
                    following = self._new_label()
                    if isinstance(op, ast.And):
                        self._branch(value, following, no)
                    else:
                        self._branch(value, yes, following)
                    self._label(following)
                self._branch(values[-1], yes, no)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                self._branch(operand, no, yes)
            case _:
                self._emit(f"br i1 {self._one(asked)}, label %{yes}, label %{no}")

    # --- variables ---

    def _store(self, name: str, value: _Value) -> None:
        if name not in self._variables:
            self._variables[name] = value.kind
            for i, type_ in enumerate(TYPES[value.kind]):
                self._slots.append(f"  %v.{name}.{i} = alloca {type_}")
        for i, (type_, part) in enumerate(zip(TYPES[value.kind], value.parts, strict=True)):
            self._emit(f"store {type_} {part}, ptr %v.{name}.{i}")

    def _load(self, name: str) -> _Value:
        kind = self._variables[name]
        parts = [
            self._made(f"load {type_}, ptr %v.{name}.{i}") for i, type_ in enumerate(TYPES[kind])
        ]
        return _Value(kind, tuple(parts))

    # --- statements ---

    def _block(self, statements: list[ast.stmt]) -> None:
        for statement in statements:
            self._statement(statement)

    def _statement(self, statement: ast.stmt) -> None:
        match statement:
            case ast.Expr(value=value):
                self._value(value)
            case ast.Assign(targets=[ast.Tuple(elts=names)], value=ast.Call() as call):
                self._several(names, call)
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                self._store(name, self._value(value))
            case ast.Assign(targets=[ast.Subscript() as place], value=value):
                given = self._one(value)
                self._emit(f"store double {given}, ptr {self._address(place)}")
            case ast.If(test=test, body=body, orelse=orelse):
                yes, no, after = (self._new_label() for _ in range(3))
                self._branch(test, yes, no)
                self._label(yes)
                self._block(body)
                if not self._ended:
                    self._emit(f"br label %{after}")
                self._label(no)
                self._block(orelse)
                self._label(after)
            case ast.While(test=test, body=body):
                head, inside, after = (self._new_label() for _ in range(3))
                self._label(head)
                self._branch(test, inside, after)
                self._label(inside)
                self._loop_body(body, head, after)
                self._label(after)
            case ast.For(target=ast.Name(id=name), iter=ast.Call(args=limits), body=body):
                self._range(name, limits, body)
            case ast.Break():
                self._emit(f"br label %{self._loops[-1][1]}")
            case ast.Continue():
                self._emit(f"br label %{self._loops[-1][0]}")
            case ast.Return(value=None):
                self._emit("ret void")
            case ast.Return(value=ast.Tuple(elts=values)):
                self._return_several(values)
            case ast.Return(value=ast.expr() as value):
                self._emit(f"ret {self._result()} {self._one(value)}")
            case _:
                assert isinstance(statement, ast.Pass), ast.unparse(statement)

    def _loop_body(self, body: list[ast.stmt], again: str, after: str) -> None:
        self._loops.append((again, after))
        self._block(body)
        self._loops.pop()
        if not self._ended:
            self._emit(f"br label %{again}")

    def _range(self, name: str, limits: list[ast.expr], body: list[ast.stmt]) -> None:
        first, last = ("0", self._one(limits[0])) if len(limits) == 1 else map(self._one, limits)
        counter = self._made_slot("i64")
        self._emit(f"store i64 {first}, ptr {counter}")
        head, inside, again, after = (self._new_label() for _ in range(4))
        self._label(head)
        now = self._made(f"load i64, ptr {counter}")
        going = self._made(f"icmp slt i64 {now}, {last}")
        self._emit(f"br i1 {going}, label %{inside}, label %{after}")
        self._label(inside)
        self._store(name, _Value(INT, (now,)))
        self._loop_body(body, again, after)
        self._label(again)
        now = self._made(f"load i64, ptr {counter}")
        self._emit(f"store i64 {self._made(f'add nsw i64 {now}, 1')}, ptr {counter}")
        self._emit(f"br label %{head}")
        self._label(after)

    def _made_slot(self, type_: str) -> str:
        name = self._fresh()
        self._slots.append(f"  {name} = alloca {type_}")
        return name

    def _several(self, names: list[ast.expr], call: ast.Call) -> None:
        made, kinds = self._called(call)
        assert isinstance(kinds, tuple)
        for i, (name, kind) in enumerate(zip(names, kinds, strict=True)):
            assert isinstance(name, ast.Name)
            part = self._made(f"extractvalue {results(kinds)} {made}, {i}")
            self._store(name.id, _Value(kind, (part,)))

    def _return_several(self, values: list[ast.expr]) -> None:
        whole = "poison"
        for i, value in enumerate(values):
            one = self._value(value)
            given = f"{TYPES[one.kind][0]} {one.parts[0]}"
            whole = self._made(f"insertvalue {self._result()} {whole}, {given}, {i}")
        self._emit(f"ret {self._result()} {whole}")

    # --- expressions ---

    def _one(self, node: ast.expr) -> str:
        return self._value(node).parts[0]

    def _value(self, node: ast.expr) -> _Value:
        match node:
            case ast.Constant(value=bool(value)):
                return _Value(BOOL, ("true" if value else "false",))
            case ast.Constant(value=int(value)):
                return _Value(INT, (str(value),))
            case ast.Name(id=name):
                return self._load(name)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return _Value(BOOL, (self._made(f"xor i1 {self._one(operand)}, true"),))
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                inner = self._value(operand)
                made = f"fneg double {inner.parts[0]}"
                if inner.kind == INT:
                    made = f"sub i64 0, {inner.parts[0]}"
                return _Value(inner.kind, (self._made(made),))
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return self._value(operand)
            case ast.BinOp(left=left, op=op, right=right):
                a, b = self._value(left), self._value(right)
                floats, whole = _ARITHMETIC[type(op)]
                made = f"{floats} double" if a.kind == FLOAT else f"{whole} i64"
                return _Value(a.kind, (self._made(f"{made} {a.parts[0]}, {b.parts[0]}"),))
            case ast.Compare(left=left, ops=[op], comparators=[right]):
                return self._comparison(self._value(left), op, self._value(right))
            case ast.BoolOp():
                return self._chosen(node, ast.Constant(True), ast.Constant(False))
            case ast.IfExp(test=test, body=body, orelse=orelse):
                return self._chosen(test, body, orelse)
            case ast.Subscript(value=ast.Name(id=name), slice=place):
                return self._entry_of(node, name, place)
            case ast.Call():
                return self._function(node)
            case _:
                raise AssertionError(ast.unparse(node))

    def _comparison(self, a: _Value, op: ast.cmpop, b: _Value) -> _Value:
        ordered, whole = _TESTS[type(op)]
        test = f"fcmp {ordered} double" if a.kind == FLOAT else f"icmp {whole} {TYPES[a.kind][0]}"
        return _Value(BOOL, (self._made(f"{test} {a.parts[0]}, {b.parts[0]}"),))

    def _chosen(self, test: ast.expr, body: ast.expr, orelse: ast.expr) -> _Value:
        yes, no, after = (self._new_label() for _ in range(3))
        self._branch(test, yes, no)
        self._label(yes)
        value = self._value(body)
        type_ = TYPES[value.kind][0]
        kept = self._made_slot(type_)
        self._emit(f"store {type_} {value.parts[0]}, ptr {kept}")
        self._emit(f"br label %{after}")
        self._label(no)
        self._emit(f"store {type_} {self._one(orelse)}, ptr {kept}")
        self._label(after)
        return _Value(value.kind, (self._made(f"load {type_}, ptr {kept}"),))

    def _entry_of(self, node: ast.Subscript, name: str, place: ast.expr) -> _Value:
        if name == "par" and isinstance(place, ast.Constant):
            self._reads.add(int(str(place.value)))
            if place.value in self._known:
                return _Value(FLOAT, (_number(self._known[int(str(place.value))]),))
        if self._variables[name] == ROW:
            return _Value(FLOAT, (self._made(f"load double, ptr {self._address(node)}"),))
        start, _, pitch = self._load(name).parts
        far = self._made(f"mul i64 {self._one(place)}, {pitch}")
        row = self._made(f"getelementptr double, ptr {start}, i64 {far}")
        return _Value(ROW, (row, pitch))

    def _address(self, node: ast.Subscript) -> str:
        start = self._one(node.value)
        return self._made(
            f"getelementptr inbounds double, ptr {start}, i64 {self._one(node.slice)}"
        )

    def _function(self, node: ast.Call) -> _Value:
        assert isinstance(node.func, ast.Name)
        name = node.func.id
        if name in self._translation.callees:
            made, kinds = self._called(node)
            assert isinstance(kinds, str)
            return _Value(kinds, () if kinds == NOTHING else (made,))
        if name == "_float":
            return self._as_float(node.args[0])
        values = [self._value(one) for one in node.args]
        parts = [value.parts[0] for value in values]
        numbers = ", ".join(f"double {part}" for part in parts)
        match name:
            case "_int":
                return self._whole(values[0])
            case "_bool":
                return values[0]
            case "len":
                return _Value(INT, (values[0].parts[1],))
            case "abs" if values[0].kind == FLOAT:
                return _Value(FLOAT, (self._made(f"call double @llvm.fabs.f64({numbers})"),))
            case "abs":
                away = self._made(f"sub i64 0, {parts[0]}")
                below = self._made(f"icmp slt i64 {parts[0]}, 0")
                return _Value(INT, (self._made(f"select i1 {below}, i64 {away}, i64 {parts[0]}"),))
            case "min" | "max":
                op = ast.Lt() if name == "min" else ast.Gt()
                better = self._comparison(values[1], op, values[0]).parts[0]
                type_ = TYPES[values[0].kind][0]
                made = f"select i1 {better}, {type_} {parts[1]}, {type_} {parts[0]}"
                return _Value(values[0].kind, (self._made(made),))
            case "_modulo_float":
                return _Value(FLOAT, (self._made(f"call double @_modulo_float({numbers})"),))
            case "_modulo_int":
                given = ", ".join(f"i64 {part}" for part in parts)
                return _Value(INT, (self._made(f"call i64 @_modulo_int({given})"),))
            case "_math_isnan":
                return _Value(BOOL, (self._made(f"fcmp uno double {parts[0]}, {parts[0]}"),))
            case "_math_isfinite" | "_math_isinf":
                size = self._made(f"call double @llvm.fabs.f64({numbers})")
                test = "olt" if name == "_math_isfinite" else "oeq"
                return _Value(
                    BOOL, (self._made(f"fcmp {test} double {size}, {_number(math.inf)}"),)
                )
            case _:
                plain = name.removeprefix("_math_")
                called = f"@llvm.{plain}.f64" if plain in INTRINSIC else f"@{plain}"
                return _Value(FLOAT, (self._made(f"call double {called}({numbers})"),))

    def _as_float(self, node: ast.expr) -> _Value:
        match node:
            case ast.Constant(value=int() | float() as value):
                return _Value(FLOAT, (_number(float(value)),))
            case ast.Name(id="_inf" | "_nan" as name):
                return _Value(FLOAT, (_number(_NAMES[name]),))
            case ast.UnaryOp(op=ast.USub(), operand=ast.Name(id="_inf")):
                return _Value(FLOAT, (_number(-math.inf),))
            case _:
                value = self._value(node)
                if value.kind == FLOAT:
                    return value
                kind = "uitofp i1" if value.kind == BOOL else "sitofp i64"
                return _Value(FLOAT, (self._made(f"{kind} {value.parts[0]} to double"),))

    def _whole(self, value: _Value) -> _Value:
        part = value.parts[0]
        if value.kind == FLOAT:
            part = self._made(f"call i64 @llvm.fptosi.sat.i64.f64(double {part})")
        elif value.kind == BOOL:
            part = self._made(f"zext i1 {part} to i64")
        return _Value(INT, (part,))

    def _called(self, node: ast.Call) -> tuple[str, str | tuple[str, ...]]:
        """Call of a law: its result, and of what kind it is."""
        assert isinstance(node.func, ast.Name)
        law = self._translation.callees[node.func.id]
        given = ", ".join(
            f"{type_} {part}"
            for value in map(self._value, node.args)
            for type_, part in zip(TYPES[value.kind], value.parts, strict=True)
        )
        kinds = kind_of(inspect.signature(law).return_annotation, law.__qualname__)
        result = results(kinds)
        name = usual_name(law) if self._has_usual(law) else full_name(law)
        call = f"call {result} @{name}({given})"
        if result == "void":
            self._emit(call)
            return "", kinds
        return self._made(call), kinds
