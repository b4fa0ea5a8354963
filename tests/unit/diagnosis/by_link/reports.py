"""Small hand-made results of diagnoses by link: an arm of two links, one effect in each."""

import numpy as np

from pamsim.comparison.compared_signal import Comparison
from pamsim.diagnosis.by_link.effect_entry import EffectEntry, RivalEntry, SizeEntry
from pamsim.diagnosis.by_link.judged import LEVELS
from pamsim.diagnosis.by_link.result import (
    LinkEntry,
    LinkReport,
    NextExperiment,
    NuisanceEntry,
    Run,
)
from pamsim.diagnosis.by_link.whole_chain import ChannelGap
from pamsim.diagnosis.fitted_rig import repair
from pamsim.diagnosis.physical_size import PhysicalSize
from pamsim.engine.rig import load_rig

ARM = load_rig("mas20_arm")
NOISE = {"pressure_1": 400.0, "angle": 1e-3}
LEAK = "chamber.leak_conductance"


def size(value, ends, unit, *, si=1.0):
    """A fitted parameter and its interval, in a unit of so many SI units."""
    low, high = ends
    return SizeEntry(
        value=value,
        interval95=ends,
        unit=unit,
        value_si=si * value,
        interval95_si=(si * low, si * high),
        unit_si="SI",
    )


def effect(level, *, exact=True, ties=False):
    """A leak whose name is certain down to a level."""
    certain = LEVELS[: LEVELS.index(level) + 1] if level else ()
    return EffectEntry(
        effect="air_leak",
        name="air_leak",
        form="",
        place="the valves and the air",
        family="leak",
        level=level,
        certain={one: one in certain for one in LEVELS},
        exact=exact,
        left=0.06,
        links=("valves and air",),
        share=0.93,
        p_value=0.001,
        missing="a leak of air from the muscles",
        sizes={LEAK: size(1.98, (1.92, 2.07), "mm^3/(s*kPa)", si=1e-12)},
        physical={"mass_flow": PhysicalSize(value=5e-7, unit="kg/s", interval95=(4.5e-7, 5.5e-7))},
        rivals=(
            RivalEntry(
                effect="supply_sag",
                family="supply",
                missing="a supply that sags",
                worse=0.01,
                p_value=0.4 if ties else 0.001,
                ties=ties,
            ),
        ),
    )


def link(name, signals, before, after, *, more_left=False):
    return LinkEntry(
        link=name,
        signals=signals,
        before=before,
        after=after,
        left=0.001 if more_left is False else 0.4,
        p_value={True: 0.001, False: 0.6, None: 1.0}[more_left],
        more_left=more_left,
    )


def report(*effects, more_left=False, following=None):
    """A result with effects of the air, and perhaps something left in the arm."""
    after = 1.03 if effects else 7.5
    return LinkReport(
        rig="mas20_arm",
        links=(
            link("valves and air", ("command", "pressure"), 7.5 if effects else 1.02, 1.02),
            link("muscle and joint", ("pressure", "position"), 1.4, 1.4, more_left=more_left),
        ),
        effects=effects,
        gap={
            "pressure_1": ChannelGap(unit="kPa", floor=0.4, before=2.0, after=after),
            "angle": ChannelGap(unit="deg", floor=0.06, before=0.1, after=None),
        },
        nuisance=(
            NuisanceEntry(
                parameter="force.scale",
                unit="1",
                stated=1.0,
                by_link={"muscle and joint": 1.02},
                whole=1.02,
            ),
        ),
        next_experiment=following,
        warnings=("forces were not measured",),
        run=Run(
            data=("some/bench",),
            held_out=("swing_check_1", "swing_check_2"),
            effects_tried=2,
            skipped={"load_torque": "no body's tilt is stated"},
            seed=3,
            seconds=1.5,
        ),
        comparisons=comparisons(repaired=bool(effects)),
        repair=repair(ARM, {LEAK: 2e-12}, {LEAK: (1.92e-12, 2.07e-12)}, {LEAK: "air_leak"}, "bench")
        if effects
        else None,
    )


def comparisons(*, repaired):
    """Two repeats of a held-out swing; the second is missed by more."""
    rng = np.random.default_rng(0)
    time = np.arange(100) / 50.0
    swing = np.sin(2.0 * np.pi * time)
    parts = []
    for repeat in (1, 2):
        for channel, sd in NOISE.items():
            clean = 300.0 * sd * swing
            parts.append(
                Comparison(
                    trial=f"swing_check_{repeat}",
                    protocol="swing_check",
                    channel=channel,
                    held_out=True,
                    time=time,
                    measured=clean + sd * rng.standard_normal(time.size),
                    before=clean + 5.0 * repeat * sd,
                    after=clean if repaired else None,
                )
            )
    return tuple(parts)


def following():
    return NextExperiment(
        advice="shut the valves",
        protocol="shut_hold",
        shows="leaks, as the pressure that a chamber loses while its valves are shut",
        between=("air_leak", "supply_sag"),
        before=0.3,
        after=7.1,
        menu={"shut_hold": 7.1, "bursts": 2.0},
    )


VERDICTS = {
    "no_gap": report(),
    "named": report(effect("form")),
    "named_with_remainder": report(effect("form"), more_left=True),
    "ambiguous": report(effect("place", ties=True), following=following()),
    "unexplained": report(more_left=True),
    "undecided": report(more_left=None),
}
"""Verdict -> a result that comes to it."""
