"""The API pages have every public name, and all that readers are shown to import."""

from __future__ import annotations

import importlib
import inspect
import re
from importlib.util import find_spec
from pathlib import Path

import pamsim

ROOT = Path(__file__).parents[3]
DOCS = [*(ROOT / "docs").glob("*.md"), *(ROOT / "docs" / "notebooks").glob("*.py")]
DIRECTIVES = [
    match
    for page in (ROOT / "docs" / "api.md", ROOT / "docs" / "api_rooms.md")
    for match in re.findall(r"^\.\. auto(\w+):: (\S+)$", page.read_text("utf-8"), re.MULTILINE)
]
MODULES = {name for kind, name in DIRECTIVES if kind == "module"}
OUTSIDE = ("Any", "Figure", "FloatArray", "None", "Path")
NAMES = {name for kind, name in DIRECTIVES if kind != "module"}


def documented(name):
    return name in NAMES or name.rpartition(".")[0] in MODULES


def test_every_public_name_is_there_once():
    top = [name for _, name in DIRECTIVES if re.fullmatch(r"pamsim\.\w+", name)]
    assert sorted(top) == [f"pamsim.{name}" for name in pamsim.__all__]


def test_the_class_of_every_result_is_there():
    classes = {name.rpartition(".")[2] for name in NAMES} | set(OUTSIDE)
    for job in (name for name in pamsim.__all__ if name[0].islower()):
        returned = inspect.signature(getattr(pamsim, job)).return_annotation
        assert not re.fullmatch(r"[A-Z]\w+", returned) or returned in classes, (job, returned)


def test_all_that_readers_are_shown_to_import_is_there():
    shown = {
        f"{module}.{name.strip()}"
        for page in (ROOT / "README.md", *DOCS)
        for module, names in re.findall(
            r"^from (pamsim[\w.]*) import (.+)$", page.read_text("utf-8"), re.MULTILINE
        )
        for name in names.split(",")
    }
    assert len(shown) > 10
    missing = {name for name in shown if not documented(name)}
    public = {f"pamsim.{name}" for name in pamsim.__all__}
    again = {f"{getattr(pamsim, name).__module__}.{name}" for name in pamsim.__all__}
    assert missing <= public | again, missing - public - again


def test_every_controller_is_there():
    files = (ROOT / "pamsim" / "controllers").glob("[!_]*.py")
    assert {f"pamsim.controllers.{path.stem}" for path in files} <= MODULES


def test_what_a_page_names_exists_and_says_what_it_is():
    for kind, name in DIRECTIVES:
        if name.endswith("sb3_adapter") and find_spec("stable_baselines3") is None:
            continue
        if kind == "module":
            found = importlib.import_module(name)
        else:
            module, _, own = name.rpartition(".")
            found = getattr(importlib.import_module(module), own)
        assert kind == "data" or inspect.getdoc(found), name
