"""Studies are run by hand, so that nothing else would show that what they import has moved."""

from __future__ import annotations

import ast
import importlib
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).parents[3] / "scripts"
PATHS = sorted(SCRIPTS.rglob("*.py"))


def imported(text):
    """Module and name of everything that a script takes from the package."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "pamsim":
            yield from ((node.module, alias.name) for alias in node.names)


@pytest.mark.parametrize("path", PATHS, ids=lambda path: str(path.relative_to(SCRIPTS)))
def test_what_a_script_imports_from_the_package_is_there(path):
    for module, name in imported(path.read_text(encoding="utf-8")):
        try:
            found = importlib.import_module(module)
        except ModuleNotFoundError as error:
            if (error.name or "").startswith("pamsim"):
                raise
            pytest.skip(f"{error.name} is not installed")
        if not hasattr(found, name):
            importlib.import_module(f"{module}.{name}")
