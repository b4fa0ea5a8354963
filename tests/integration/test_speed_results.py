"""What the documents state about speed is what the benchmarks recorded."""

from __future__ import annotations

from tests.records import page, recorded, script, words

TEXT = words("callback")
HIGHEST = 1.1
"""No cost is meant to grow by a higher power of the work."""


def test_the_ratios_of_a_step_are_those_of_the_benchmark():
    result = recorded("benchmarks/results/steps_per_second")
    full = result["full_law_over_builtin_muscle"]
    python, bound = (
        result["full_law_over_python_callback"],
        result["c_library_alone_over_builtin_muscle"],
    )
    assert f"The arm takes {full:.2f} times as many steps per second" in TEXT
    assert f"and {python:.0f} times as many as with the laws in Python" in TEXT
    assert f"More than {bound:.2f} times is out of reach" in TEXT
    assert f"reaches {result['empty_law_over_builtin_muscle']:.2f} times" in TEXT
    assert f"bring that down to {bound:.2f}" in TEXT
    assert full < bound < result["empty_law_over_builtin_muscle"]
    assert len(result["runs"]) == 3
    assert result["rounds"] >= 15


def test_no_cost_grows_faster_than_the_work():
    result = recorded("benchmarks/results/scaling")
    rows = result["rows"]
    assert {row["work"] for row in rows} == {
        "muscles",
        "joints",
        "simulations",
        "trials",
        "preisach_levels",
        "fractional_branches",
    }
    for row in rows:
        assert len(row["sizes"]) == len(row["seconds"]) >= 5
        assert row["exponent"] <= HIGHEST, row["work"]
    assert result["two_threads_over_one"] > 0.0
    assert result["load_average"] >= 0.0


def test_the_page_of_benchmarks_is_that_of_the_records():
    written = script("benchmark_page").page()
    assert page("benchmarks") == written, "python scripts/benchmark_page.py"


def test_what_the_checks_cost_is_that_of_the_record():
    cost = recorded("benchmarks/results/checked_steps")["on_over_off"]
    assert f"takes {cost:.2f} times as long" in TEXT


def test_what_compiling_costs_is_that_of_the_record():
    result = recorded("benchmarks/results/compile_times")
    assert f"first command of an installation takes {result['command']['cold_s']:.0f} s" in TEXT
    assert result["command"]["warm_s"] < result["command"]["cold_s"]
