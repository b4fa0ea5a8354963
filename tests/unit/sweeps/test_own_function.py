"""A sweep of one's own function has a row for every call, however it was computed."""

from __future__ import annotations

import functools
import math
import multiprocessing
import re
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.sweeps.sweep import finished_rows, is_begun, sweep
from tests.unit.core.refusals import refused

RUNS = [{"gain": gain, "name": name} for gain in (1.0, 2.0, 4.0) for name in ("p", "pd")]
COLUMNS = {"error": "deg", "note": "text"}
calls: list[float] = []


def closed_loop(gain, name):
    """Error of an imagined loop; one of its runs is refused, and none is of gain 0."""
    calls.append(gain)
    if gain == 4.0 and name == "pd":
        raise InputError("gain too high")
    assert gain, "a fault of the function's own"
    return {"error": (1.0 if name == "p" else 0.5) / gain, "note": f"{name} {gain:g}"}


def study(runs=RUNS, columns=COLUMNS, **options):
    return pamsim.function_study(closed_loop, runs, columns=columns, **options)


def test_a_row_is_what_the_function_returns_also_in_processes(tmp_path):
    here = sweep(study(units={"gain": "kPa/deg"}), out=tmp_path / "here")
    found = pamsim.table(here)
    assert found["error"][:5].tolist() == [1.0, 0.5, 0.5, 0.25, 0.25]
    assert found["note"][3] == "pd 2"
    assert found["outcome"].tolist() == ["completed"] * 5 + ["refused"]
    assert math.isnan(found["error"][5])
    assert found["message"][5] == "gain too high"
    assert here.failed == 1
    assert here.factors == {"gain": "kPa/deg", "name": ""}
    assert here.rank_correlations["error"]["gain"] < -0.5
    assert here.outputs["error"].unit == "deg"
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        there = sweep(study(units={"gain": "kPa/deg"}), out=tmp_path / "there", executor=pool)
    assert there.table.read_bytes() == here.table.read_bytes()


def test_numbers_of_numpy_and_anything_that_can_be_called_will_do(tmp_path):
    runs = [{"gain": gain, "name": "p"} for gain in np.arange(1, 4)]
    called = functools.partial(closed_loop)
    found = sweep(pamsim.function_study(called, runs, columns=COLUMNS), out=tmp_path).columns()
    assert found["error"] == pytest.approx([1.0, 1.0 / 2.0, 1.0 / 3.0])


def test_what_is_finished_is_kept_where_the_function_fails(tmp_path):
    runs = [*RUNS[:3], {"gain": 0.0, "name": "p"}]
    with pytest.raises(AssertionError, match="fault of the function"):
        sweep(study(runs), out=tmp_path)
    rows = finished_rows(study(runs), tmp_path)
    assert [(row["run"], row["gain"], row["error"]) for row in rows] == [
        (0, 1.0, 1.0), (1, 1.0, 0.5), (2, 2.0, 0.5),
    ]  # fmt: skip
    calls.clear()
    with pytest.raises(AssertionError):
        sweep(study(runs), out=tmp_path, resume=True)
    assert calls == [0.0]  # nothing else is run again


def scaled(factor):
    return lambda gain: {"error": factor * gain}


def test_numbers_bound_to_a_function_are_part_of_its_study():
    def made(function):
        return pamsim.function_study(function, [{"gain": 1.0}], columns={"error": "deg"})

    two = [functools.partial(closed_loop, name=name) for name in ("p", "pd")]
    two += [scaled(factor) for factor in (1.0, 2.0)]
    two += [lambda gain, factor=factor: {"error": factor * gain} for factor in (1.0, 2.0)]
    assert len({made(function).fingerprint for function in two}) == 6
    assert made(scaled(2.0)).fingerprint == made(scaled(2.0)).fingerprint


def test_a_pure_number_is_written_without_a_unit(tmp_path):
    runs = [{"gain": float(gain)} for gain in range(5)]
    made = pamsim.function_study(scaled(2.0), runs, columns={"error": "1"})
    found = sweep(made, out=tmp_path)
    assert "error: 0 to 8, median 4;" in found.summary()
    assert pamsim.plot(found).axes[0].get_ylabel() == "error"


def weighted(**factors):
    return {"sum": sum(int(name[1]) * value for name, value in factors.items())}


def test_a_summary_names_the_three_factors_that_matter_most(tmp_path):
    draws = np.random.default_rng(0).random((60, 5))
    runs = [{f"f{i}": float(x) for i, x in enumerate(row)} for row in draws]
    found = sweep(pamsim.function_study(weighted, runs, columns={"sum": "1"}), out=tmp_path)
    ranks = found.rank_correlations["sum"]
    assert re.findall(r"(f\d) ([+-][\d.]+)", found.summary()) == [
        (name, f"{ranks[name]:+.2f}") for name in ("f4", "f3", "f2")
    ]


def test_rows_of_another_study_are_not_taken_for_its_own(tmp_path):
    sweep(study(), out=tmp_path)
    assert is_begun(study(), tmp_path)
    assert len(finished_rows(study(), tmp_path)) == len(RUNS)
    for other in (study(RUNS[:2]), study(depends="other data"), study(columns={"error": "rad"})):
        assert not is_begun(other, tmp_path)
        assert finished_rows(other, tmp_path) == []
        with refused("of another study"):
            sweep(other, out=tmp_path, resume=True)


def test_a_study_that_cannot_be_run_is_refused(tmp_path):
    for runs, columns, message in (
        ([], COLUMNS, "`runs` is empty"),
        ([{"gain": 1.0}, {"load": 1.0}], COLUMNS, "runs[1] has the factors load"),
        ([{"gain": 1.0}, {"gain": "high"}], COLUMNS, "gain is a number in some and text"),
        (RUNS, {"gain": "1"}, "columns: gain is taken"),
        (RUNS, {"outcome": "text"}, "columns: outcome is taken"),
    ):
        with refused(message):
            study(runs, columns)
    with refused("closed_loop returned error, note (text); `columns` states err"):
        sweep(study(columns={"err": "deg"}), out=tmp_path)
    for function, message in (
        (functools.partial(closed_loop, name="p"), "closed_loop returned error, note (text); "),
        (lambda gain: None, "returned nothing; "),
        (lambda gain: {"error": "none"}, "returned error (text); "),
    ):
        other = pamsim.function_study(function, [{"gain": 1.0}], columns={"error": "deg"})
        with refused(message, "`columns` states error"):
            sweep(other, out=tmp_path)
