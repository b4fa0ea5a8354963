"""Finds what must obey the rules of the law rooms: a new law is covered when it is added."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pamsim
from pamsim.core.parameters import ParameterGroup

SOURCE = Path(pamsim.__file__).parent


def rooms() -> list[str]:
    """Packages that pyproject's import contract calls law rooms."""
    project = tomllib.loads((SOURCE.parent / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = project["tool"]["importlinter"]["contracts"]
    (laws,) = (contract for contract in contracts if contract["id"] == "laws")
    return sorted(laws["source_modules"])


def modules() -> list[str]:
    """Names of all modules in the law rooms."""
    found: list[str] = []
    for room in rooms():
        package = importlib.import_module(room)
        found += [room, *(m.name for m in pkgutil.walk_packages(package.__path__, f"{room}."))]
    return found


def public_functions() -> dict[str, Callable[..., Any]]:
    """Every public function that a law room defines, by its full name."""
    return {
        f"{module}.{name}": function
        for module in modules()
        for name, function in inspect.getmembers(
            importlib.import_module(module), inspect.isfunction
        )
        if function.__module__ == module and not name.startswith("_")
    }


def parameter_groups() -> dict[str, type[ParameterGroup]]:
    """Every parameter group of the whole package; modules without one are not imported."""
    classes = [  # by their text: to parse every file takes seconds of each start of the tests
        (path, name, set(re.findall(r"\w+(?=[,\s]|$)", bases)))
        for path in sorted(SOURCE.rglob("*.py"))
        for name, bases in re.findall(
            r"^class (\w+)\(([^)]*)\)", path.read_text(encoding="utf-8"), re.MULTILINE
        )
    ]
    names = {ParameterGroup.__name__}
    while more := {name for _, name, bases in classes if bases & names} - names:
        names |= more  # groups of groups as well
    return {
        name: getattr(importlib.import_module(_module(path)), name)
        for path, name, bases in classes
        if bases & names
    }


def _module(path: Path) -> str:
    return ".".join(path.relative_to(SOURCE.parent).with_suffix("").parts)
