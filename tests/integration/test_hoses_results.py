"""The page on real data quotes the record of the hoses, whose one link is the package's tube."""

import math
import re

import numpy as np
import pytest

import pamsim
from tests.records import SCRIPTS, recorded, script, words

NAMES = {
    "volume, no resistance": "volume alone",
    "`tube_resistance`, laminar": "package's tube",
    "and `supply_sag`": "and a supply that sags",
    "and valves' delays by pressure*": "and delays by pressure",
    "the last, `tube_resistance` turbulent": "turbulent",
    "segments with inertia*, laminar": "laminar, segments with inertia",
    "segments with inertia*, turbulent": "turbulent, segments with inertia",
}
TUBE, BEST = "package's tube", "turbulent, segments with inertia"
LENGTHS = ("3 m", "6 m", "8 m")


@pytest.fixture(scope="module")
def hoses():
    return recorded("results/hoses")


def errors_over_scatter(hoses, group, model):
    part = [r for r in hoses["rows"] if r["group"] == group]
    return float(np.median([abs(r["models"][model][0] - r["time"]) / r["scatter"] for r in part]))


def slower(hoses, time):
    """By how much 6 m vent slower at 7 than at 2 bar [ms], of the times that a function reads."""
    vents = {r["bar"]: time(r) for r in hoses["rows"] if r["metres"] == 6 and not r["fills"]}
    return vents[7.0] - vents[2.0]


def test_the_table_is_the_record(hoses):
    for shown, model in NAMES.items():
        found = hoses["models"][model]
        groups = found["groups"]
        floors = " | ".join(f"{groups[g]['floors']:.1f}" for g in (*LENGTHS, "7 bar"))
        ways = " | ".join(
            ", ".join(f"{groups[g][way][0]:+.0f}" for g in LENGTHS) + " %"
            for way in ("fill", "vent")
        )
        assert f"| {shown} | {floors} | {ways} | {found['ms_a_metre']:.1f} |" in words("real_data")


def test_the_text_is_the_record(hoses):
    assert f"{sum(r['runs'] for r in hoses['rows'])} runs" in words("real_data")
    assert f"(measured: {hoses['ms_a_metre']:.1f})" in words("real_data")
    for model, text in (
        (TUBE, "by {:.1f} times their scatter between runs at 6 m, {:.1f} times at 8 m"),
        (BEST, "the last row by {:.1f} and {:.1f}."),
    ):
        assert text.format(
            *(errors_over_scatter(hoses, g, model) for g in ("6 m", "8 m"))
        ) in words("real_data")
    measured = slower(hoses, lambda r: r["time"])
    tube, best = (slower(hoses, lambda r, m=m: r["models"][m][0]) for m in (TUBE, BEST))
    text = f"by {measured:.0f} ms from 2 to 7 bar, laminar by {tube:.0f} ms"
    assert f"{text}, turbulent by {best:.0f} ms" in words("real_data")
    values = hoses["models"][BEST]["values"]
    speed = math.sqrt(values["index"] * 287.05 * 293.15)
    assert f"{speed:.0f} m/s are found" in words("real_data")
    vent = f"vent {values['delay_vent']:.1f} ms at 2 bar, {values['delay_vent_high']:.1f} at 6"
    assert vent in words("real_data")
    short = [
        100.0 * (r["models"][BEST][0] / r["time"] - 1.0)
        for r in hoses["rows"]
        if r["metres"] == 2 and r["fills"]
    ]
    assert f"2 m fill {min(short):.0f} to {max(short):.0f} % faster" in words("real_data")


@pytest.mark.parametrize("model", [TUBE, "turbulent"])
@pytest.mark.parametrize("fills", [True, False], ids=["fill", "vent"])
def test_one_link_of_the_script_is_the_package_s_tube(hoses, fills, model):
    module, values = script("hoses"), hoses["models"][model]["values"]
    values = {n: v for n, v in values.items() if not re.match("delay|supply", n)}
    ticks, bar, metres = np.arange(module.HORIZON), 4.0, 6
    log = module.Log(metres, bar, fills, ticks, 0 * ticks, np.full((ticks.size, 2), bar))
    near = module.predicted({**values, "delay_fill": 0.0, "delay_vent": 0.0}, log)[:, 0]
    half = 0.5 * module.AREA * (metres + values["end_length"])
    rig = pamsim.load_rig(SCRIPTS / "printed_cylinder").with_parameters(
        {f"valve.{name}": values[name] for name in module.BASE[:3]}
        | {
            "valve.supply_pressure": bar * 1e5,
            "valve.laminar_ratio": module.LAMINAR_RATIO,
            "valve.tube_volume": half,
            "valve.tube_resistance": values.get("resistance", 0.0) * metres,
            "valve.tube_friction": values.get("friction", 0.0) * metres,
            "chamber.dead_volume": half,
            "chamber.polytropic_index": 1.0,
            "force.area": 1e-9,  # the piston's own volume is next to none
        }
    )
    experiment = pamsim.Experiment(
        drive={"piston": "valve", "rod": "length"},
        command_time=np.array([0.0, 1.0]),
        command_value=np.array([[1.0 if fills else -1.0, 0.0]] * 2),
        start_pressure=np.array([0.0 if fills else bar * 1e5]),
        duration=1e-3 * (module.HORIZON - 1),
        sample_rate=1e3,
        settle=0.0,
    )
    run = pamsim.simulate(rig, experiment, timestep=module.STEP).completed()
    np.testing.assert_allclose(run.pressure[:, 0], near * 1e5, atol=200.0)
