"""The guard in tests/conftest.py catches a callback left behind; only the guilty test fails."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

CONFTEST = Path(__file__).parents[2] / "conftest.py"

TESTS = """
import mujoco

def test_guilty():
    mujoco.set_mjcb_control(lambda model, data: None)

def test_tidy():
    mujoco.set_mjcb_control(lambda model, data: None)
    mujoco.set_mjcb_control(None)

def test_innocent():
    assert mujoco.get_mjcb_control() is None
"""


def test_only_the_guilty_test_fails(tmp_path: Path) -> None:
    (tmp_path / "conftest.py").write_bytes(CONFTEST.read_bytes())
    (tmp_path / "test_three.py").write_text(TESTS)
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-p",
            "no:cacheprovider",
            "--rootdir",
            str(tmp_path),
        ],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert "ERROR test_three.py::test_guilty" in done.stdout, done.stdout
    assert "callbacks installed: mjcb_control" in done.stdout
    assert "3 passed, 1 error" in done.stdout
