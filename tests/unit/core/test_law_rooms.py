"""The law rooms load no compiler, engine or fit; BLAS has one thread; steps are counted."""

import importlib
import json
import pkgutil
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
import threadpoolctl

import pamsim
from pamsim.core.computation import Steps, one_blas_thread

SOURCE = Path(pamsim.__file__).parent

# Compilers, engines and fits are no part of a law; pint is loaded when a file is read.
FORBIDDEN = ("numba", "mujoco", "scipy.optimize", "control", "matplotlib", "jinja2", "pint")

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


def test_laws_load_no_compiler_no_engine_and_no_fit():
    project = tomllib.loads((SOURCE.parent / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = project["tool"]["importlinter"]["contracts"]
    (laws,) = (contract for contract in contracts if contract["id"] == "laws")
    modules = []  # a new law is covered when it is added
    for room in laws["source_modules"]:
        package = importlib.import_module(room)
        modules += [room, *(m.name for m in pkgutil.walk_packages(package.__path__, f"{room}."))]
    assert {"pamsim.core", "pamsim.physics.braid", "pamsim.physics.kernel"} <= set(modules)
    done = subprocess.run(
        [sys.executable, "-c", IMPORTS, json.dumps([modules, FORBIDDEN])],
        cwd=SOURCE.parent,
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    assert json.loads(done.stdout) == {}


def threads():
    return {p["num_threads"] for p in threadpoolctl.threadpool_info() if p["user_api"] == "blas"}


def test_blas_has_one_thread_inside_and_what_it_had_afterwards():
    np.ones((2, 2)) @ np.ones((2, 2))
    with threadpoolctl.threadpool_limits(2, "blas"):
        if threads() != {2}:
            pytest.skip("this BLAS cannot have two threads")
        assert one_blas_thread()(threads)() == {1}
        with pytest.raises(ZeroDivisionError), one_blas_thread():
            raise ZeroDivisionError
        assert threads() == {2}


def test_steps_are_counted_and_the_total_is_never_behind():
    seen = []
    steps = Steps(lambda *now: seen.append(now), 3)
    for what in "ab":
        steps.begin(what)
    steps.expect(1)
    for what in "cd":
        steps.begin(what)
    assert seen == [(0, 3, "a"), (1, 3, "b"), (2, 3, "c"), (3, 4, "d")]
