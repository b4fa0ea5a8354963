"""freeze_results.py compares every value with its new place, and misses no difference."""

from __future__ import annotations

import json
import runpy
from pathlib import Path
from typing import Any

import click
import pytest
from click.testing import CliRunner

ROOT = Path(__file__).parents[3]
FREEZE: dict[str, Any] = runpy.run_path(str(ROOT / "scripts/freeze_results.py"))
BEFORE = {
    "verdict": "named",
    "claims": [{"id": "A-01", "shown": 1.0}, {"id": "A-02", "shown": 2.0}],
    "radius": 0.02,
    "reason": "in old words",
}
AFTER = {
    "verdict": "named",
    "claims": [{"id": "paper-01", "value": 1.0}, {"id": "paper-02", "value": 2.0}],
    "radius": {"value": 20.0, "interval95": None},
    "reason": "in new words",
}
RENAMED = {
    "result/claims[*]/id": {"place": "result/claims[*]/id", "values": {"A-*": "paper-*"}},
    "result/claims[*]/shown": "result/claims[*]/value",
    "result/radius": {"place": "result/radius/value", "factor": 1000},
    "result/reason": None,
}


def row(before: Any, after: Any, renamed: Any = RENAMED) -> dict[str, Any]:
    rules = FREEZE["rules_of"](renamed)
    sides = (dict(FREEZE["places"](side, "result")) for side in (before, after))
    values = (
        FREEZE["renamed_values"](side, rules, is_old=is_old)
        for side, is_old in zip(sides, (True, False), strict=True)
    )
    return FREEZE["table_row"](*values, 1e-9, 1e-12)


def test_renamed_keys_words_and_units_are_compared():
    same = row(BEFORE, AFTER)
    assert same["compared"] == 6
    assert (same["differ"], same["differences"], same["gone"], same["added"]) == (0, {}, {}, {})


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"radius": {"value": 20.001}}, "result/radius/value"),
        ({"verdict": "no_gap"}, "result/verdict"),
        (
            {"claims": [{"id": "paper-01", "value": 1.0}, {"id": "paper-02", "value": 2.1}]},
            "result/claims[*]/value",
        ),
    ],
    ids=["unit", "verdict", "list"],
)
def test_a_change_is_reported_at_its_new_place(change: dict[str, Any], place: str):
    assert list(row(BEFORE, {**AFTER, **change})["differences"]) == [place]


def test_what_is_gone_or_added_is_reported_but_for_empty_values():
    other = {k: v for k, v in AFTER.items() if k != "verdict"} | {"size": 3, "form": None}
    changed = row(BEFORE, other)
    assert changed["gone"] == {"result/verdict": 1}
    assert changed["added"] == {"result/size": 1}


def test_a_map_that_hides_one_value_by_another_or_has_an_unknown_key_is_refused():
    with pytest.raises(click.ClickException, match="two old places"):
        row(BEFORE, AFTER, {"result/claims[*]/shown": "result/claims[0]/value"})
    with pytest.raises(click.ClickException, match="unknown unit"):
        row(BEFORE, AFTER, {"result/radius": {"unit": "mm"}})


def test_the_command_writes_the_table(tmp_path: Path):
    for name, result in (("before", BEFORE), ("after", AFTER)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "job.json").write_text(json.dumps({"result": result}))
    (tmp_path / "map.json").write_text(json.dumps({"jo*": RENAMED}))
    arguments = ["compare", str(tmp_path / "before"), str(tmp_path / "after")]
    table = tmp_path / "table.json"
    mapped = [*arguments, "--renamed", str(tmp_path / "map.json"), "--json", str(table)]
    done = CliRunner().invoke(FREEZE["cli"], mapped)
    assert done.exit_code == 0, done.output
    assert json.loads(table.read_text())["commands"]["job"]["compared"] == 6
    assert CliRunner().invoke(FREEZE["cli"], arguments).exit_code == 1


def test_the_recorded_map_can_be_read():
    recorded = json.loads((ROOT / "scripts/results/frozen_renamed.json").read_text())
    assert all(FREEZE["rules_of"](rules) for rules in recorded.values())
