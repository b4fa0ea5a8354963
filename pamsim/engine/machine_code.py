"""Laws as LLVM code, from the source that Python runs.

Numba compiles every function of a kernel on its own, and again in each that calls it. Here all are
one module, which takes a quarter of the time. The formula stays what the law states, see
`pamsim.engine.translate`, and results are Python's to the last bit, see `pamsim.engine.law_writer`.

Most muscles have the same law and few effects. What is called from elsewhere may be compiled a
second time with some parameters known, which leaves out all else; the row's numbers decide at each
call which of the two runs.
"""

from __future__ import annotations

import inspect
import struct
from collections.abc import Iterable, Iterator, Mapping
from types import FunctionType

from pamsim.engine.law_writer import (
    INTRINSIC,
    LIBRARY,
    TYPES,
    LawWriter,
    WrittenLaw,
    full_name,
    results,
    usual_name,
)
from pamsim.engine.translate import (
    kind_of,
    translated_name,
)

_PRELUDE = """
define internal double @_modulo_float(double %a, double %b) alwaysinline {
  %rest = call double @fmod(double %a, double %b)
  %none = fcmp oeq double %rest, 0.0
  %zero = call double @llvm.copysign.f64(double 0.0, double %b)
  %down = fcmp olt double %rest, 0.0
  %against = fcmp olt double %b, 0.0
  %other = xor i1 %down, %against
  %moved = fadd double %rest, %b
  %kept = select i1 %other, double %moved, double %rest
  %result = select i1 %none, double %zero, double %kept
  ret double %result
}
define internal i64 @_modulo_int(i64 %a, i64 %b) alwaysinline {
  %rest = srem i64 %a, %b
  %none = icmp eq i64 %rest, 0
  %signs = xor i64 %rest, %b
  %other = icmp slt i64 %signs, 0
  %moved = add i64 %rest, %b
  %kept = select i1 %other, i64 %moved, i64 %rest
  %result = select i1 %none, i64 0, i64 %kept
  ret i64 %result
}
declare i64 @llvm.fptosi.sat.i64.f64(double)
"""


def module(
    laws: Iterable[FunctionType],
    outside: Mapping[FunctionType, str],
    known: Mapping[int, float],
) -> str:
    """Text of an LLVM module with some laws and all that they call.

    Args:
        laws: called from elsewhere, by `translated_name`; their first argument is the row ``par``
            if anything is known of it.
        outside: function -> text that defines it in another way, by its `full_name`.
        known: slot of the row -> number with which the laws are compiled a second time.
    """
    return _Module(outside, known).text(tuple(laws))


def signature(law: FunctionType) -> tuple[list[str], str]:
    """Kinds of a law's arguments, and of its result if that is a single one."""
    parameters = inspect.signature(law).parameters.values()
    kinds = [kind_of(one.annotation, law.__qualname__) for one in parameters]
    returned = kind_of(inspect.signature(law).return_annotation, law.__qualname__)
    assert isinstance(returned, str)
    return [str(kind) for kind in kinds], returned


class _Module:
    def __init__(self, outside: Mapping[FunctionType, str], known: Mapping[int, float]) -> None:
        self._outside, self._known = outside, known
        self._written: dict[FunctionType, WrittenLaw] = {}
        self._specialised: dict[FunctionType, bool] = {}

    def text(self, laws: tuple[FunctionType, ...]) -> str:
        for law in laws:
            self._write(law)
        parts = [_PRELUDE, *_declarations()]
        for law, written in self._written.items():
            parts.append(written.text)
            if self._has_usual(law):
                parts.append(LawWriter(law, self._known, self._has_usual).written().text)
        return "\n".join([*parts, *map(self._entry, laws)])

    def _write(self, law: FunctionType) -> None:
        if law in self._written:
            return
        if law in self._outside:
            self._written[law] = WrittenLaw(self._outside[law], frozenset(), ())
        else:
            written = LawWriter(law, {}, lambda _: False).written()
            for callee in written.callees:
                self._write(callee)
            self._written[law] = written

    def _has_usual(self, law: FunctionType) -> bool:
        """Whether a law, or one that it calls, reads a slot that is known."""
        if law not in self._specialised:
            written = self._written[law]
            reads = not written.reads.isdisjoint(self._known)
            self._specialised[law] = reads or any(map(self._has_usual, written.callees))
        return self._specialised[law]

    def _entry(self, law: FunctionType) -> str:
        """What is called from elsewhere: one of the two copies."""
        kinds, returned = signature(law)
        types = [one for kind in kinds for one in TYPES[kind]]
        arguments = ", ".join(f"{one} %a{i}" for i, one in enumerate(types))
        result = results(returned)
        lines = [f"define linkonce_odr {result} @{translated_name(law)}({arguments}) nounwind {{"]
        copies = {"full": full_name(law)}
        if self._has_usual(law):
            copies["usual"] = usual_name(law)
            different = "0"
            for slot, number in self._known.items():
                lines += [
                    f"  %p{slot} = getelementptr i64, ptr %a0, i64 {slot}",
                    f"  %n{slot} = load i64, ptr %p{slot}",
                    f"  %x{slot} = xor i64 %n{slot}, {_bits(number)}",
                    f"  %d{slot} = or i64 {different}, %x{slot}",
                ]
                different = f"%d{slot}"
            lines += [f"  %same = icmp eq i64 {different}, 0"]
            lines += ["  br i1 %same, label %usual, label %full", "full:"]
        for label, name in copies.items():
            lines += ["usual:"] if label == "usual" else []
            call = f"call {result} @{name}({arguments})"
            if result == "void":
                lines += [f"  {call}", "  ret void"]
            else:
                lines += [f"  %{label}.r = {call}", f"  ret {result} %{label}.r"]
        return "\n".join([*lines, "}"])


def _declarations() -> Iterator[str]:
    for name, count in INTRINSIC.items():
        yield f"declare double @llvm.{name}.f64({', '.join(['double'] * count)})"
    for name, count in LIBRARY.items():
        # Nobody reads the error number that C keeps: a call may be left out if nobody uses it.
        arguments = ", ".join(["double"] * count)
        yield f"declare double @{name}({arguments}) nobuiltin nounwind willreturn readnone"


def _bits(value: float) -> int:
    return struct.unpack("<q", struct.pack("<d", value))[0]
