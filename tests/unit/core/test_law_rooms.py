"""Rules for every module and function of the law rooms, found by walking them."""

from __future__ import annotations

import importlib
import inspect
import json
import pkgutil
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pamsim

SOURCE = Path(pamsim.__file__).parent

FORBIDDEN = ("numba", "mujoco", "scipy.optimize", "control", "matplotlib", "jinja2", "pint")
"""Compilers, engines and fits are no part of a law; pint is loaded when a file is read."""

IMPORTS = """
import importlib, json, sys
names, forbidden = json.loads(sys.argv[1])
guilty = {}
for name in names:
    importlib.import_module(name)
    found = [f for f in forbidden if f in sys.modules and f not in sum(guilty.values(), [])]
    if found:
        guilty[name] = found
print(json.dumps(guilty))
"""

UNIT = re.compile(r"\[(?!,)(?:-|1/|[A-Za-z(])[^\[\]]*\]")
PURE = re.compile(
    r"pure number|\bof [\w-]+ numbers\b|\b(?:ratio|share|fraction)\b"  # has no unit
    r"|\bin SI\b|\bunits? of\b|\b(?:one|any) unit\b",  # has that of its arguments
    re.IGNORECASE,
)


def rooms():
    """Packages that pyproject's import contract calls law rooms."""
    project = tomllib.loads((SOURCE.parent / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = project["tool"]["importlinter"]["contracts"]
    (laws,) = (contract for contract in contracts if contract["id"] == "laws")
    return sorted(laws["source_modules"])


def modules():
    """Names of all modules in the law rooms: a new law is covered when it is added."""
    found = []
    for room in rooms():
        package = importlib.import_module(room)
        found += [room, *(m.name for m in pkgutil.walk_packages(package.__path__, f"{room}."))]
    return found


FUNCTIONS = {
    f"{module}.{name}": function
    for module in modules()
    for name, function in inspect.getmembers(importlib.import_module(module), inspect.isfunction)
    if function.__module__ == module and not name.startswith("_")
}


def gives_numbers(function) -> bool:
    given = str(inspect.signature(function).return_annotation)
    return given == "None" or re.search(r"float|ndarray|NDArray", given) is not None


def takes_its_unit(function) -> bool:
    """Conversions and checks work in the unit that they are given."""
    return bool({"unit", "si_unit", "spec"} & set(inspect.signature(function).parameters))


def test_the_walk_finds_the_rooms():
    assert {"pamsim.core", "pamsim.physics"} <= set(rooms())
    assert {"pamsim.physics.braid", "pamsim.physics.kernel"} <= set(modules())
    assert len(FUNCTIONS) > 30


def test_laws_load_no_compiler_no_engine_and_no_fit():
    job = json.dumps([modules(), FORBIDDEN])
    done = subprocess.run(
        [sys.executable, "-c", IMPORTS, job],
        cwd=SOURCE.parent,
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    assert json.loads(done.stdout) == {}


def test_public_functions_state_what_they_give_in_which_unit():
    for name, function in FUNCTIONS.items():
        text = inspect.getdoc(function) or ""
        assert len(text) > 20, name
        if gives_numbers(function) and not takes_its_unit(function):
            assert UNIT.search(text) or PURE.search(text), f"{name} states no unit in [brackets]"


def test_arguments_are_described_all_or_none():
    for name, function in FUNCTIONS.items():
        text = inspect.getdoc(function) or ""
        if "Args:" in text:
            described = set(re.findall(r"^\s+(\w+):", text, re.MULTILINE))
            assert set(inspect.signature(function).parameters) <= described, name
