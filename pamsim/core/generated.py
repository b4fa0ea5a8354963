"""Functions that are made from a text."""

from __future__ import annotations
import __future__

import linecache
from collections.abc import Mapping
from types import FunctionType
from typing import Any


def function_of_text(
    name: str, text: str, where: str, names: Mapping[str, Any], *, typed: bool = False
) -> FunctionType:
    """The function that a text defines, which debuggers and compilers read as that of a file.

    Args:
        name: of the function.
        text: its definition.
        where: name of the file that it seems to stand in.
        names: what the text refers to.
        typed: whether its annotations are evaluated, for a compiler that asks for types.
    """
    linecache.cache[where] = (len(text), None, text.splitlines(keepends=True), where)
    space = dict(names)
    flags = 0 if typed else __future__.annotations.compiler_flag
    exec(compile(text, where, "exec", dont_inherit=True, flags=flags), space)
    return space[name]
