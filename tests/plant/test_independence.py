"""The plant shares no law with the package: from a rig it takes the numbers."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

LAWS = sorted(f for f in Path(__file__).parent.glob("*.py") if not f.name.startswith("test_"))
FORBIDDEN = (
    "mujoco", "pamsim.physics", "pamsim.linear", "pamsim.engine.simulate", "pamsim.engine.batch",
)  # fmt: skip


def imported(source: str) -> set[str]:
    """Full names of the modules, and of what is taken from them."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {one.name for one in node.names}
        elif isinstance(node, ast.ImportFrom):
            names |= {f"{node.module}.{one.name}" for one in node.names}
    return names


@pytest.mark.parametrize("path", LAWS, ids=lambda path: path.stem)
def test_no_file_of_the_plant_imports_a_law_or_the_engine(path):
    for name in imported(path.read_text(encoding="utf-8")):
        assert not f"{name}.".startswith(tuple(f"{one}." for one in FORBIDDEN)), name


def test_an_import_of_a_law_is_seen():
    text = "import mujoco\ndef f():\n    from pamsim.physics import air"
    assert imported(text) == {"mujoco", "pamsim.physics.air"}
