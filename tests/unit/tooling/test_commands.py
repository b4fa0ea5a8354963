"""The commands that people and continuous integration type."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
CI = ROOT / ".ci" / "run"

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


def run_help() -> tuple[subprocess.CompletedProcess[str], float]:
    start = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", HELP], capture_output=True, text=True, check=False)
    return done, time.perf_counter() - start


def test_help_loads_nothing_heavy() -> None:
    done, _ = run_help()
    assert done.returncode == 0, done.stderr
    *shown, loaded = done.stdout.splitlines()
    assert any("reproduce" in line for line in shown)
    assert HEAVY.isdisjoint(loaded.split())


def test_help_is_quick() -> None:
    # The best of three: the other test process may keep the machine busy during one of them.
    best = 1e9
    for _ in range(3):
        done, seconds = run_help()
        assert done.returncode == 0, done.stderr
        best = min(best, seconds)
    assert best < 1.5


def test_ci_runs_the_command_of_the_readme() -> None:
    fenced = re.findall(r"^```[^\n]*\n(.*?)^```", (ROOT / "README.md").read_text(), re.M | re.S)
    in_readme = {line.strip().removeprefix("$ ") for block in fenced for line in block.splitlines()}
    assert "make test" in in_readme, "README.md shows no fenced `make test`"
    commands = [line for line in CI.read_text().splitlines() if line.startswith("make ")]
    lowest = 'make test-lowest ARGS="tests/unit tests/properties"'
    assert commands == ["make test", "make test-slow", "make lint", "make docs", lowest]


def test_ci_script_stops_at_the_first_failure() -> None:
    assert os.access(CI, os.X_OK)
    assert "set -euo pipefail" in CI.read_text().splitlines()
    subprocess.run(["bash", "-n", str(CI)], check=True)


def test_make_alone_only_explains() -> None:
    # MAKEFLAGS of the `make test` around this test are not for this one.
    env = {
        key: value for key, value in os.environ.items() if not key.startswith(("MAKE", "MFLAGS"))
    }
    done = subprocess.run(["make"], cwd=ROOT, env=env, capture_output=True, text=True, check=True)
    targets = re.findall(r"^  make ([a-z-]+)", done.stdout, re.M)
    assert {"reproduce", "test", "lint", "lock", "test-lowest", "wheel"} <= set(targets)


@pytest.mark.parametrize("python", ["no-such-python", "false"])
def test_make_without_a_good_python_says_so_in_one_line(tmp_path: Path, python: str) -> None:
    for name in ("Makefile", "requirements.lock", "requirements-dev.lock", "pyproject.toml"):
        (tmp_path / name).write_bytes((ROOT / name).read_bytes())
    env = {
        key: value for key, value in os.environ.items() if not key.startswith(("MAKE", "MFLAGS"))
    }
    done = subprocess.run(
        ["make", "test", f"PYTHON={python}"],
        cwd=tmp_path,
        env=env,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.splitlines()[0].startswith("pamsim needs Python 3.11 or newer")
    assert not (tmp_path / ".venv").exists()
