"""What people and continuous integration type, import and install."""

import ast
import importlib
import os
import re
import subprocess
import sys
import time
import tomllib
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import pamsim
import pamsim.controllers
import pamsim.envs

ROOT = Path(__file__).parents[3]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
PROJECT = PYPROJECT["project"]

# What the declared `pamsim` command does, with a look at what it loaded.
HELP = """
import sys
from importlib.metadata import entry_points

(script,) = entry_points(group="console_scripts", name="pamsim")
sys.argv = ["pamsim", "--help"]
try:
    code = script.load()()
except SystemExit as stop:
    code = stop.code
print("loaded:", *sorted({name.partition(".")[0] for name in sys.modules}))
sys.exit(code)
"""
HEAVY = {"mujoco", "numba", "matplotlib", "scipy", "control"}
IMPORT = "import pamsim, sys; dir(pamsim); print('numpy' in sys.modules, 'mujoco' in sys.modules)"


def run(*command, **options):
    # MAKEFLAGS of the `make test` around this test are not for this one.
    env = {k: v for k, v in os.environ.items() if not k.startswith(("MAKE", "MFLAGS"))}
    options = {"env": env, "capture_output": True, "text": True, "check": False, **options}
    return subprocess.run(command, **options)


def test_help_and_import_are_quick_and_load_nothing_heavy():
    # The best of three: the other test process may keep the machine busy during one of them.
    best = 1e9
    for _ in range(3):
        start = time.perf_counter()
        done = run(sys.executable, "-c", HELP)
        best = min(best, time.perf_counter() - start)
        assert done.returncode == 0, done.stderr
        *shown, loaded = done.stdout.splitlines()
        assert any("reproduce" in line for line in shown)
        assert HEAVY.isdisjoint(loaded.split())
    assert best < 1.5
    assert run(sys.executable, "-c", IMPORT).stdout.split() == ["False", "False"]


def test_the_front_door_lists_what_it_has_and_no_room_hides_a_function():
    for name in pamsim.__all__:
        assert getattr(pamsim, name).__name__ == name
        assert name in dir(pamsim)
        assert importlib.util.find_spec(f"pamsim.{name}") is None
    assert not hasattr(pamsim, "identfy")
    for room in (pamsim.controllers, pamsim.envs):
        assert set(room.__all__) <= set(dir(room))
        assert all(callable(getattr(room, name)) or name.isupper() for name in room.__all__)
        assert not hasattr(room, "Suiet")


def test_ci_and_the_workflow_run_the_commands_of_the_readme_and_targets_that_exist():
    readme = (ROOT / "README.md").read_text().splitlines()
    script = ROOT / ".ci" / "run"
    lines = script.read_text().splitlines()
    assert [line for line in lines if line.startswith("make ")] == [
        "make test", "make test-slow", "make lint", "make docs",
        'make test-lowest ARGS="tests/unit tests/properties"',
    ]  # fmt: skip
    # It stops at the first failure.
    assert os.access(script, os.X_OK)
    assert "set -euo pipefail" in lines
    assert run("bash", "-n", str(script)).returncode == 0
    workflow = (ROOT / ".github/workflows/check.yml").read_text()
    commands = re.findall(r"^ *(?:- run: )?((?:make|pamsim) [^\n]+)$", workflow, re.MULTILINE)
    assert {"make reproduce", "make test", "pamsim demo --no-open"} <= {*commands} & {*readme}
    # `make` alone only explains.
    targets = set(re.findall(r"^  make ([a-z-]+)", run("make", cwd=ROOT).stdout, re.M))
    assert {"reproduce", "test", "lint", "lock", "test-lowest", "wheel"} <= targets
    assert {words.split()[1] for words in commands if words.startswith("make ")} <= targets
    for lock in re.findall(r"-r (\S+)", workflow):
        assert (ROOT / lock).is_file()
    templates = list((ROOT / ".github/ISSUE_TEMPLATE").glob("*.md"))
    assert len(templates) == 3
    for template in templates:
        for wanted in ("`pamsim --version`", "command", "rig folder"):
            assert wanted in template.read_text(), template.name


def test_make_without_a_good_python_says_so_in_one_line(tmp_path):
    for name in ("Makefile", "requirements.lock", "requirements-dev.lock", "pyproject.toml"):
        (tmp_path / name).write_bytes((ROOT / name).read_bytes())
    for python in ("no-such-python", "false"):
        done = run("make", "test", f"PYTHON={python}", cwd=tmp_path)
        assert done.returncode == 2
        assert done.stderr.splitlines()[0].startswith("pamsim needs Python 3.11 or newer")
        assert not (tmp_path / ".venv").exists()


def locked(name):
    """Package -> (version, number of hashes)."""
    text = (ROOT / name).read_text()
    for line in text.splitlines():
        outside = r"://|\.(org|com|io|net)\b|(^|[\s'\"=])/|--find-links|index-url"
        assert not re.search(outside, line), f"{name} depends on where it was made: {line}"
    found = {}
    for line in text.replace("\\\n", " ").splitlines():
        if line and not line.lstrip().startswith("#"):
            match = re.match(r"([a-z0-9-]+)==(\S+)", line)
            assert match, f"{name}: not a pinned package: {line[:80]!r}"
            found[match[1]] = (match[2], len(re.findall(r"--hash=sha256:[0-9a-f]{64}\b", line)))
    return found


def declared(*groups):
    """What pyproject.toml asks for: the run-time packages and those of the groups."""
    wanted = list(PROJECT["dependencies"])
    for group in groups:
        wanted += [one for one in PYPROJECT["dependency-groups"][group] if isinstance(one, str)]
    return [Requirement(one) for one in wanted]


def test_the_locks_have_hashes_answer_pyproject_and_agree():
    wanted = {"": ["build"], "-dev": ["build", "dev"], "-lowest": ["build", "dev"]}
    locks = {kind: locked(f"requirements{kind}.lock") for kind in wanted}
    for kind, packages in locks.items():
        assert len(packages) > 10
        assert [name for name, (_, hashes) in packages.items() if hashes == 0] == []
        for one in declared(*wanted[kind]):
            version, _ = packages.get(canonicalize_name(one.name), ("none", 0))
            assert version != "none", f"no {one.name} in {kind}: run `make lock`"
            assert one.specifier.contains(version), f"{kind}: {one}: run `make lock`"
    assert locks[""].items() <= locks["-dev"].items()
    for one in declared("build", "dev"):
        (bound,) = [spec.version for spec in one.specifier if spec.operator == ">="]
        version, _ = locks["-lowest"][canonicalize_name(one.name)]
        # A bound of two numbers stands for the first version that begins with them.
        assert version == bound or version.startswith(f"{bound}."), f"{one}: run `make lock`"


def test_version_licence_and_requirements_are_the_same_everywhere():
    lines = (ROOT / "CITATION.cff").read_text().splitlines()
    citation = dict(line.split(": ", 1) for line in lines if ": " in line)
    assert PROJECT["version"] == pamsim.__version__ == citation["version"]
    assert PROJECT["license"] == citation["license"] == "Apache-2.0"
    assert "Version 2.0, January 2004" in (ROOT / "LICENSE").read_text()
    assert (ROOT / "pamsim/py.typed").is_file()
    recipe = (ROOT / "conda/recipe.yaml").read_text()
    for entry in (
        f'version: "{PROJECT["version"]}"',
        f"license: {PROJECT['license']}",
        f"pamsim = {PROJECT['scripts']['pamsim']}",
        PROJECT["description"],
    ):
        assert entry in recipe
    renamed = {"mujoco": "mujoco-python", "matplotlib": "matplotlib-base"}  # as conda-forge does
    asked = {"host": PYPROJECT["build-system"]["requires"], "run": PROJECT["dependencies"]}
    for part, requirements in asked.items():
        wanted = {
            (renamed.get(one.name, one.name), frozenset(str(one.specifier).split(",")))
            for one in map(Requirement, requirements)
        }
        listed = re.search(rf"  {part}:\n((?:    - .*\n)+)", recipe)
        assert listed
        python, *lines = re.findall(r"- (.*)", listed[1])
        assert python == f"python {PROJECT['requires-python']}"
        given = [line.split() for line in lines if line != "pip"]
        assert {(name, frozenset(bounds.split(","))) for name, bounds in given} == wanted


def test_what_a_script_imports_from_the_package_is_there():
    """Studies are run by hand, so that nothing else would show that what they import has moved."""
    for path in sorted((ROOT / "scripts").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            module = node.module or "" if isinstance(node, ast.ImportFrom) else ""
            if module.split(".")[0] != "pamsim":
                continue
            try:
                found = importlib.import_module(module)
            except ModuleNotFoundError as error:
                if (error.name or "").startswith("pamsim"):
                    raise
                continue  # an extra that is not installed
            for alias in node.names:
                if not hasattr(found, alias.name):
                    importlib.import_module(f"{module}.{alias.name}")
