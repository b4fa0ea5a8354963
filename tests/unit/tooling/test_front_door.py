"""`import pamsim` is quick, and offers functions and classes under the names that it lists."""

from __future__ import annotations

import inspect
import pkgutil
import re
import subprocess
import sys
import time
import tomllib
from pathlib import Path

from packaging.requirements import Requirement

import pamsim

ROOT = Path(__file__).parents[3]


def test_every_name_is_a_function_or_a_class_with_a_docstring_and_listed():
    for name in pamsim.__all__:
        value = getattr(pamsim, name)
        assert inspect.isfunction(value) or inspect.isclass(value), name
        assert inspect.getdoc(value), name
        assert value.__name__ == name
        assert name in dir(pamsim)


def test_no_room_has_the_name_of_a_function():
    rooms = {module.name for module in pkgutil.iter_modules(pamsim.__path__)}
    assert not rooms & set(pamsim.__all__)


def test_the_import_loads_nothing():
    code = "import pamsim, sys; dir(pamsim); print('numpy' in sys.modules, 'mujoco' in sys.modules)"
    begin = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]
    assert time.perf_counter() - begin < 5.0  # a started interpreter on a busy machine


def test_an_unknown_name_is_an_attribute_error():
    assert not hasattr(pamsim, "identfy")


def test_version_and_licence_are_the_same_everywhere():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    citation = dict(
        line.split(": ", 1)
        for line in (ROOT / "CITATION.cff").read_text().splitlines()
        if ": " in line
    )
    assert project["version"] == pamsim.__version__ == citation["version"]
    assert project["license"] == citation["license"] == "Apache-2.0"
    assert "Version 2.0, January 2004" in (ROOT / "LICENSE").read_text()
    assert (ROOT / "pamsim/py.typed").is_file()


def test_the_conda_recipe_asks_for_what_pyproject_asks_for():
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text())
    project, backend = declared["project"], declared["build-system"]["requires"]
    recipe = (ROOT / "conda/recipe.yaml").read_text()
    assert f'version: "{project["version"]}"' in recipe
    assert f"license: {project['license']}" in recipe
    for entry in (f"pamsim = {project['scripts']['pamsim']}", project["description"]):
        assert entry in recipe
    renamed = {"mujoco": "mujoco-python", "matplotlib": "matplotlib-base"}  # as conda-forge does
    python = f"python {project['requires-python']}"

    def asked(requirements):
        found = [Requirement(text) for text in requirements]
        return {
            (renamed.get(r.name, r.name), frozenset(str(r.specifier).split(","))) for r in found
        }

    for part, wanted in (("host", backend), ("run", project["dependencies"])):
        listed = re.search(rf"  {part}:\n((?:    - .*\n)+)", recipe)
        assert listed
        lines = re.findall(r"- (.*)", listed[1])
        assert lines.pop(0) == python
        given = {
            (name, frozenset(bounds.split(",")))
            for name, bounds in map(str.split, set(lines) - {"pip"})
        }
        assert given == asked(wanted)


def test_the_workflow_runs_the_commands_of_the_readme_and_targets_that_exist():
    workflow = (ROOT / ".github/workflows/check.yml").read_text()
    commands = re.findall(r"^ *(?:- run: )?((?:make|pamsim) [^\n]+)$", workflow, re.MULTILINE)
    readme = (ROOT / "README.md").read_text().splitlines()
    assert {"make reproduce", "make test", "pamsim demo --no-open"} <= {*commands} & {*readme}
    targets = {words.split()[1] for words in commands if words.startswith("make ")}
    makefile = (ROOT / "Makefile").read_text()
    assert all(re.search(rf"^{target}:", makefile, re.MULTILINE) for target in targets)
    for lock in re.findall(r"-r (\S+)", workflow):
        assert (ROOT / lock).is_file()


def test_every_issue_template_asks_for_version_command_and_rig():
    templates = list((ROOT / ".github/ISSUE_TEMPLATE").glob("*.md"))
    assert len(templates) == 3
    for template in templates:
        for wanted in ("`pamsim --version`", "command", "rig folder"):
            assert wanted in template.read_text(), template.name
