"""What documents state of the studies in scripts/trust, and a few of their cells again."""

from __future__ import annotations

import numpy as np
import pytest

from tests.records import page, recorded, script, words

TEXT = words("callback")
PLACES = ["plain", "other callbacks", "two models", "copied model", "another thread"]


def test_no_function_gives_a_wrong_number():
    result = recorded("results/stepping_functions")
    assert not result["bad"]
    assert not result["missing_functions"]
    assert result["mjb_in_another_process"] == {"register": "right", "without": "crash"}
    for name, cells in result["functions"].items():
        assert list(cells) == PLACES, name
        assert all(cell.startswith(("right", "error", "no number")) for cell in cells.values())


@pytest.mark.usefixtures("unchecked")
@pytest.mark.parametrize("name", ["mj_step1, mj_step2", "mj_inverse", "mj_forward, mj_RungeKutta"])
def test_some_functions_again(name):
    study = script("trust/stepping_functions")
    expected = recorded("results/stepping_functions")["functions"][name]
    assert study.row(name, 1) == expected


@pytest.mark.usefixtures("unchecked")
def test_every_function_that_evaluates_muscles_is_in_the_table():
    study, table = script("trust/stepping_functions"), recorded("results/stepping_functions")
    found = study.evaluating_functions()
    assert {"mj_step", "mj_step2", "mj_forward", "mj_fwdActuation", "mj_Euler"} <= found
    for name in found:
        assert any(name in one for one in table["functions"]), name


def test_random_steps_reached_no_state_that_cannot_be():
    result = recorded("results/random_steps")
    assert not result["failed"]
    assert result["steps"] >= 1e8
    assert f"{result['steps']:,} steps" in TEXT
    assert f"{len(result['broke_down'])} of {sum(result['batches'].values())} batches" in TEXT
    assert f"{result['highest_pressure_over_supply']:.2f} of the supply's" in TEXT


@pytest.mark.parametrize("kind", ["simulate", "environment", "on_off"])
def test_random_steps_again(kind, monkeypatch):
    study = script("trust/random_steps")
    monkeypatch.setitem(study.one_batch.__globals__, "BATCH", 2000)
    row = study.one_batch((kind, "mas20_arm", 2), on=True)
    assert row["steps"] >= 2000
    assert not row["reported"]


def test_the_cost_of_the_checks_is_that_of_the_benchmark():
    result = recorded("benchmarks/results/checked_steps")
    assert f"{result['on_over_off']:.2f} times as long" in TEXT
    assert 0.95 <= result["off_over_bare"] <= 1.05


def test_the_record_of_the_readers_holds_those_that_there_are():
    found = recorded("results/readers")["readers"]
    text = page("files")
    assert f"None of the {len(found)} readers failed" in text
    assert set(found) <= set(script("trust/readers").READERS)


def test_the_page_counts_what_the_records_hold():
    text = page("validation").partition("## Wrong numbers")[2]
    rows = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| ")]
    shown = [(row[1], row[2]) for row in rows[1:]]
    threads, functions = (
        recorded("results/threads"),
        recorded("results/stepping_functions"),
    )
    steps, readers = recorded("results/random_steps"), recorded("results/readers")
    kills, disk = recorded("results/kills"), recorded("results/disk_full")
    slips, mutations = recorded("results/unit_slips"), recorded("results/mutation_check")
    read = readers["readers"].values()
    killed, filled = kills["commands"].values(), disk["commands"].values()
    counts = [
        (sum(threads["runs"].values()), sum(threads["failed"].values())),
        (sum(map(len, functions["functions"].values())), len(functions["bad"])),
        (steps["steps"], len(steps["failed"])),
        (sum(one["runs"] for one in read), sum(one["runs_failed"] for one in read)),
        (sum(one["subprocesses"] for one in read), sum(one["subprocesses_failed"] for one in read)),
        (sum(one["kills"] for one in killed), sum(one["failed"] for one in killed)),
        (sum(one["points"] for one in filled), sum(one["failed"] for one in filled)),
    ]
    assert not any(failed for _, failed in counts)  # docs/files.md: none did
    expected = [(f"{tried:,}", str(failed)) for tried, failed in counts]
    missed = slips["mistakes"] - slips["found"]
    expected.append((f"{slips['found']} of {slips['mistakes']}", str(missed)))
    expected.append((f"{slips['false_alarms']} of {slips['valid']}", "0"))
    tried, caught = (sum(part[key] for part in mutations.values()) for key in ("tried", "caught"))
    expected.append((str(tried), str(tried - caught)))
    assert shown == expected
    assert sum(one["subprocesses"] for one in read) >= 1000
    assert {one["runs"] for one in read} == {100_000}


def test_the_page_of_sweeps_is_that_of_its_study():
    result = recorded("results/sweeps")
    text = words("sweep")
    assert result["runs"] == 10_000
    assert result["killed_twice_equal"]
    assert result["dask_worker_killed_equal"]
    assert result["blocks_run_again"] == 0
    before, after = result["memory_mb_quarter_of_the_runs"], result["memory_mb"]
    assert f"grew from {before:.0f} to {after:.0f} MB" in text
    more = 100.0 * (np.mean(result["cost"]["sweep_over_batch"]) - 1.0)
    assert f"takes {more:.0f} % more processor time" in text
