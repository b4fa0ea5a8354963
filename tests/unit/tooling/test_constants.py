"""Every number of the diagnosis has a reason beside it, and few decide what it concludes."""

from __future__ import annotations

import ast
import runpy
from pathlib import Path

SCRIPT = runpy.run_path(
    str(Path(__file__).parents[3] / "scripts/constants.py"), run_name="constants"
)
FOUND = list(SCRIPT["constants"]())


def test_every_number_has_a_reason():
    assert [f"{one.file}: {one.names}" for one in FOUND if not one.reason] == []


def test_fifteen_numbers_at_most_decide_what_a_diagnosis_concludes():
    rules = [one.names for one in FOUND if one.is_rule]
    assert sorted(rules) == sorted(name for names in SCRIPT["RULES"].values() for name in names)
    assert len(rules) <= 15


def test_no_number_of_the_method_hides_in_an_expression():
    """Numbers of the rules that stand in a function are 0, 1, 2 and one half."""
    for file in SCRIPT["RULES"]:
        path = Path(__file__).parents[3] / "pamsim/diagnosis" / file
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.FunctionDef):
                continue
            numbers = {n.value for n in ast.walk(node) if isinstance(n, ast.Constant)}
            plain = {n for n in numbers if isinstance(n, int | float)} - {0, 1, 2, 0.5, -1}
            assert not plain, f"{file}: {node.name}: {plain}"
