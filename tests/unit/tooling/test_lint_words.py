"""lint_words.py catches each phrase of its table, where it stands, and nothing beside it."""

from __future__ import annotations

import runpy
import tomllib
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[3]
LINT: dict[str, Any] = runpy.run_path(str(ROOT / "scripts/lint_words.py"))
TABLE = tomllib.loads((ROOT / "scripts/lint_words.toml").read_text())


def caught(rules: list[Any], path: Path) -> list[tuple[int, str]]:
    return [(line, phrase) for line, phrase, _ in LINT["phrases"](path, rules)]


def test_each_rule_catches_its_bad_sentence_and_spares_the_good_one(tmp_path: Path):
    page, code = tmp_path / "page.md", tmp_path / "code.py"
    for row in TABLE["rule"]:
        rule = LINT["Rule"].of(row)
        for key, wanted in (("bad", True), ("good", False)):
            page.write_text(row[key].capitalize())
            code.write_text(f"{row[key]} = 0\n")
            where = code if row.get("names") == "only" else page
            assert bool(caught([rule], where)) is wanted, row[key]
    for row in TABLE.get("exception", []):  # narrow, and with a reason
        assert set(row) == {"file", "phrase", "reason"}
        assert "*" not in row["file"] or row["phrase"] != ".*"
        assert len(row["reason"]) > 10


def test_prose_and_names_of_python_are_searched_but_not_its_code(tmp_path: Path):
    file = tmp_path / "some_wheels.py"
    file.write_text(
        '"""Two effects are\n    alike."""\n'
        "wheelRadius = doubt * 2  # a truth\n"
        "message = (\n    f'foreign '\n    f'truth {wheelRadius}'\n)\n"
    )
    rules, _ = LINT["read_table"]()
    assert sorted(caught(rules, file)) == [
        (1, "some_wheels"),
        (2, "alike"),
        (3, "a truth"),
        (3, "doubt"),
        (3, "wheelRadius"),
        (5, "foreign '\n    f'truth"),
    ]
