"""A catalog of laws: the package's own, those of other installed packages, and those of rigs.

A package adds its laws by an entry point of the group ``pamsim.laws``, a rig by a file
``effects.py`` in its folder. What is in the package has small codes in the compiled kernel; what is
added has one that follows from its name, its parameters and the text of its file, so that a saved
model never runs with another law than the one it was made with.
"""

from __future__ import annotations

import functools
import importlib.metadata
import inspect
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import FunctionType
from typing import Any, Generic, Protocol, TypeVar, cast

from pamsim.core.errors import EngineError, InputError
from pamsim.core.parameters import ParameterGroup, specs
from pamsim.core.reached_code import constants_of, functions_reached, held, source_of

USER_DEFINED = 2.0**20
"""Codes from here on belong to laws that are not part of the package."""

MOST_PARAMETERS = 12
"""Room for the parameters of a law in the row of a muscle, the common ones included."""


class Card(Protocol):
    """What a catalog holds."""

    @property
    def name(self) -> str:
        """As in files."""
        ...

    @property
    def group(self) -> type[ParameterGroup]:
        """The law's parameters."""
        ...

    @property
    def functions(self) -> tuple[Callable[..., Any], ...]:
        """The functions that the kernel calls."""
        ...


AnyCard = TypeVar("AnyCard", bound=Card)


class Catalog(Mapping[str, AnyCard], Generic[AnyCard]):
    """Name -> law, in order, the package's own first.

    Args:
        kind: class of the laws in it.
        laws: of the package.
        slot: name of the place in the rows of muscles that holds the codes.
        first: code of the first of them.
    """

    def __init__(
        self, kind: type[AnyCard], laws: Sequence[AnyCard], *, slot: str, first: int = 0
    ) -> None:
        self._kind, self._slot, self._own = kind, slot, tuple(laws)
        self._laws = {law.name: law for law in laws}
        self._by_code = {float(code): law for code, law in enumerate(laws, start=first)}
        self._codes = {law.group: code for code, law in self._by_code.items()}
        self._asked = False

    def __getitem__(self, name: str) -> AnyCard:
        return self._with_installed(name, self._laws)[name]

    def __iter__(self) -> Iterator[str]:
        return iter(tuple(self._with_installed(None, self._laws)))

    def __len__(self) -> int:
        return len(self._with_installed(None, self._laws))

    def own(self) -> tuple[AnyCard, ...]:
        """The package's own laws."""
        return self._own

    def add(self, law: AnyCard, where: str) -> None:
        """Add a law from outside the package; the newest of a name counts for new muscles.

        ``where`` it was found is named in errors.

        Raises:
            InputError: if its name is one of the package's, or it has too many parameters.
        """
        if any(law.name == one.name for one in self._own):
            raise InputError(f"{where}: pamsim has a law {law.name!r} of its own; rename yours")
        count = len(specs(law.group))
        if count > MOST_PARAMETERS:
            raise InputError(
                f"{where}: the law {law.name!r} has {count} parameters; there is room for"
                f" {MOST_PARAMETERS}"
            )
        self._laws[law.name] = law
        self._codes[law.group] = user_code(law)
        self._by_code[self._codes[law.group]] = law

    def code(self, group: type[ParameterGroup]) -> float:
        """Code in the rows of muscles of the law with a parameter group; EngineError if none is."""
        if group not in self._with_installed(group, self._codes):
            raise EngineError(f"{group.__name__} belongs to no known {self._kind.__name__}")
        return self._codes[group]

    def group(self, code: float) -> type[ParameterGroup]:
        """Parameter group of the law with a code, also one that a newer of its name has replaced.

        EngineError if there is none, such as one of a package that is not installed here.
        """
        if code not in self._with_installed(code, self._by_code):
            raise EngineError(
                f"{self._slot} = {code:g} in an actuator's user data stands for no law known here;"
                " load the rig or install the package that it comes from"
            )
        return self._by_code[code].group

    def card(self, group: type[ParameterGroup]) -> AnyCard:
        """The law with a parameter group; EngineError if there is none."""
        return self._by_code[self.code(group)]

    def _with_installed(self, key: Any, table: dict[Any, Any]) -> dict[Any, Any]:
        """The table, filled by installed packages where it does not hold the key."""
        if key not in table and not self._asked:
            self._asked = True
            for law, where in installed("pamsim.laws"):
                if isinstance(law, self._kind):
                    self.add(law, where)
        return table


def user_code(law: Card) -> float:
    """Code of a law from outside, a pure number: even if it only pulls, odd if it may push."""
    text = [law.name, *(f"{name} {spec.unit}" for name, spec in specs(law.group))]
    text += [_source(function) for function in law.functions]
    own = zlib.crc32("\n".join(text).encode())
    return USER_DEFINED + 2.0 * own + float(getattr(law, "pushes", False))


def _source(function: Callable[..., Any]) -> str:
    """Text of the function and of its whole file, as what it calls counts as well; its numbers."""
    holder = getattr(function, "__self__", function)
    plain = getattr(function, "__func__", function)
    code = plain if isinstance(plain, FunctionType) else inspect.getattr_static(plain, "__call__")
    reached = functions_reached([code]) if isinstance(code, FunctionType) else []
    try:
        file = inspect.getsource(inspect.getmodule(function) or function)
    except (OSError, TypeError):  # typed at a prompt
        file = ""
    own = getattr(holder, "__dict__", {}).values()
    return "".join([file, *map(source_of, reached), *map(constants_of, reached), *map(held, own)])


@functools.cache
def installed(group: str) -> tuple[tuple[Any, str], ...]:
    """What installed packages add to pamsim by entry points of a group, and by which.

    An entry point names an object or a sequence of objects; InputError if it cannot be loaded.
    """
    found: list[tuple[Any, str]] = []
    for point in importlib.metadata.entry_points(group=group):
        where = f"entry point {point.name} = {point.value}"
        try:
            named = point.load()
        except Exception as error:  # whatever the code of others raises when it is imported
            raise InputError(f"{where} cannot be loaded: {error}") from error
        each = cast("Sequence[Any]", named if isinstance(named, list | tuple) else [named])
        found += [(one, where) for one in each]
    return tuple(found)
