"""Write docs/benchmarks.md from the records of scripts/benchmarks.

python scripts/benchmark_page.py
"""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from records import RESULTS, read

from pamsim.core.limits import SWEEP_RUNS

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "benchmarks.md"

INTRODUCTION = """# How fast it is

Ratios compare two things timed in turn, so they hold on other machines, too. Above 1, pamsim is
quicker; for frames the ratio is that of times, and above 1 it is slower. The machine was shared,
with two cores: spreads are wide, and 1.1 may be chance. `make benchmark` runs all scripts,
`scripts/benchmark_page.py` writes this page.

| what | against | ratio | spread | script |
|---|---|---|---|---|
"""

NOTES = """
- **Time step**: [what a step costs](callback.md#what-a-step-costs).
- **LSODA** integrates the [independent plant](validation.md#diagnosis-of-an-independent-plant),
  compiled by numba, at the loosest tolerance whose median error is no larger than pamsim's.
- **Relays one by one** are quicker, because their weights are tabulated beforehand; the engine's
  parameters may change in each step.
- **Gruenwald-Letnikov sum**: over {seconds} at 1 ms. The relative error of the branches' complex
  stiffness is {branches:.0e}, that of the sum {sum:.0e}.
- **`mujoco.sysid`**: {own} simulations against {other}; both find the same optimum.
- Worlds on a GPU: [gpu.md](gpu.md). Five whole tasks beside public tools:
  [compared.md](compared.md).
"""


LARGE = """
## What a large study costs

On paper, from {rate:,.0f} steps per second and core at 2,000 steps to the second of an arm, 10^9
seconds of an arm take {hours:,.0f} core-hours. As a sweep of runs of 2 s they take {swept:,.0f},
or {days:.2g} days on 64 cores, and {gigabytes:,.0f} GB of memory: a run also takes its {rest:g} s
to rest, {more:.0f} % more time and {memory:.1f} kB. They are {studies:,} studies, since a sweep
takes {most:,} runs at most. Two threads of one process are {gain:.2g} times as quick as one;
worker processes do not wait for each other.
"""

REST = 1.8
"""Time until `mas20_arm` is at rest (docs/architecture.md) [s]."""


def recorded(name: str) -> dict[str, Any]:
    """A record."""
    return read(ROOT / "scripts" / "benchmarks" / "results" / f"{name}.json")


def row(
    what: str, peer: str, ratio: float, script: str, each: Sequence[float] = ()
) -> tuple[str, str, float, str, str]:
    """Of the table: what, against what, ratio, spread of several, script."""
    spread = f"{min(each):.3g} to {max(each):.3g}" if each else ""
    return what, peer, ratio, spread, f"{script}.py"


def rows() -> Iterator[tuple[str, str, float, str, str]]:
    """All of the table."""
    steps = recorded("steps_per_second")
    for key, peer in (
        ("full_law_over_builtin_muscle", "MuJoCo's `<muscle>`, the same arm"),
        ("full_law_over_python_callback", "the same laws as a Python callback"),
    ):
        each = [run[key] for run in steps["runs"]]
        yield row("time step, full law", peer, steps[key], "steps_per_second", each)
    batch = recorded("scaling")
    what, gain = "batch of 16 step responses on two threads", batch["two_threads_over_one"]
    yield row(what, "on one", gain, "scaling", batch["range"])
    lsoda = recorded("batch_vs_lsoda")
    for one in lsoda["rows"]:
        what = f"{lsoda['simulations']} step responses in steps of {one['timestep_ms']:g} ms"
        peer = f"scipy's LSODA at equal error, {one['error_deg']:.0e} deg"
        yield row(what, peer, one["lsoda_over_pamsim"], "batch_vs_lsoda", one["range"])
    for one in recorded("operator_steps")["rows"]:
        what = f"{one['operator'].replace('_', ' ')}, {one['size']}"
        yield row(what, one["peer"], one["ratio"], "operator_steps")
    each = [one["ratio"] for one in recorded("environment_steps")["rows"]]
    what, peer = (
        f"environment's step, {len(each)} cases",
        "`InvertedPendulum-v5` at equal frame skip",
    )
    yield row(what, peer, statistics.median(each), "environment_steps", each)
    task = recorded("myosuite_steps")
    each, peer = task["ratios"], f"MyoSuite's `{task['peer']}` at equal frame skip"
    yield row("environment's step", peer, statistics.median(each), "myosuite_steps", each)
    each = [one["ratio"] for one in recorded("frames")["rows"]]
    what = f"frame of 480 x 480 pixels, {len(each)} environments"
    yield row(what, "`InvertedPendulum-v5`, time", statistics.median(each), "frames", each)
    script = "calibrate_vs_mujoco_sysid"
    runs, summary = recorded(script)["white_noise"], recorded(script)["summary"]
    pairs = zip(runs["pamsim"], runs["mujoco.sysid"], strict=True)
    each = [theirs["seconds"] / own["seconds"] for own, theirs in pairs]
    ratio = 1.0 / summary["seconds_pamsim_over_sysid"]
    yield row("calibration of 8 parameters", "`mujoco.sysid`", ratio, script, each)
    ratio = 1.0 / recorded("checked_steps")["on_over_off"]
    yield row("time step with `pamsim.checks`", "without", ratio, "checked_steps")


def large() -> str:
    """What 10^9 seconds of an arm cost."""
    runs = recorded("steps_per_second")["runs"]
    rate = statistics.median(run["steps_per_second"]["pamsim, compiled"] for run in runs)
    sweep = read(RESULTS / "sweeps.json")
    grown = sweep["memory_mb"] - sweep["memory_mb_quarter_of_the_runs"]
    memory = 1e3 * grown / (0.75 * sweep["runs"])
    cost = statistics.mean(sweep["cost"]["sweep_over_batch"])
    hours = 2000.0 * 1e9 / rate / 3600.0
    swept = hours * cost * (2.0 + REST) / 2.0
    return LARGE.format(
        rate=rate,
        hours=hours,
        swept=swept,
        days=swept / 64 / 24,
        gigabytes=0.5e9 * memory / 1e6,
        rest=REST,
        more=100.0 * (cost - 1.0),
        memory=memory,
        most=SWEEP_RUNS,
        studies=-(-(10**9 // 2) // SWEEP_RUNS),
        gain=recorded("scaling")["two_threads_over_one"],
    )


def page() -> str:
    """The page."""
    table = "".join(
        f"| {what} | {peer} | {ratio:.2g} | {spread} | `{script}` |\n"
        for what, peer, ratio, spread, script in rows()
    )
    summary = recorded("calibrate_vs_mujoco_sysid")["summary"]
    fractional = recorded("operator_steps")["rows"][-1]
    return (
        INTRODUCTION
        + table
        + NOTES.format(
            seconds=fractional["size"].split(", ")[1],
            branches=fractional["engine_error"],
            sum=fractional["peer_error"],
            own=summary["pamsim"]["simulations"],
            other=summary["mujoco.sysid"]["simulations"],
        )
        + large()
    )


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
