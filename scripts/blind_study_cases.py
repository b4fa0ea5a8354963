"""The cases of the blind study: what is hidden in each, of which size, under which noise.

    python scripts/blind_study_cases.py [--workers 2]

writes blind_study_cases.json. All cases are drawn from one seed before any is run, each tier spread
evenly over them, so that any beginning is a fair sample. Earlier studies had other seeds: the rules
of the diagnosis were made with those cases, and none of them returns.

A tier belongs to the family of what is hidden, which is the name that a diagnosis gives. Of another
formula are all that belong to a family of the library; outside are those that belong to none; with
``removed`` the diagnosis tries no effect of the right families.

How sizes are drawn: first the excess E that an effect shall leave, log-uniformly within the range
of its tier (`RANGES`); then the size that leaves about that much, from runs of the independent
plant with and without the effect. No diagnosis has a part in it. E of a case, before any
diagnosis, is a mean square over a noise variance: the difference of the two recordings (without
noise, inputs of `SEED`, in both settings), less what a linear refit of the nuisance parameters
takes away, over the variances of the sensors' noise, averaged over angle, pressures and, where they
are measured, forces. Each effect of a pair has its own. The study's scores use E of the refitted
model on held-out data, which the diagnosis states.

Some effects leave more than the E drawn at any size, such as a nozzle, whose law differs from that
of ISO 6358 at the same flow: their size is then the middle one of `GRID`. Others leave less up to
its largest, which is then their size. The E that a size leaves is written beside it (``excess``).
"""

from __future__ import annotations

import argparse
import functools
import json
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

import pamsim
from pamsim.core.errors import SimulationError
from pamsim.core.units import FloatArray
from pamsim.diagnosis.options import NUISANCE
from pamsim.effects.catalog import EFFECTS, TRIAL_EFFECTS
from pamsim.engine.parameters import rig_parameter
from pamsim.twins.noise import ANGLE_NOISE, FORCE_NOISE, PRESSURE_NOISE

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests.plant.hidden.catalog import PLANT_EFFECTS
from tests.plant.hide import hide

FILE = Path(__file__).parent / "blind_study_cases.json"
INPUTS = ("levels", "ramps", "tones", "pulses", "loaded_levels")
DURATION = 5.0

SEED = 20261126
"""Of all that is drawn here."""

RIG = "mas20_arm"

LIBRARY = (
    "coulomb_friction", "stribeck_friction", "viscous_friction", "load_dependent_friction",
    "load_torque", "added_inertia", "muscle_hysteresis", "viscoelastic_creep", "braid_friction",
    "threshold_pressure", "passive_stiffness", "end_shape", "muscle_mismatch", "air_leak",
    "supply_sag", "valve_dead_zone", "valve_flow", "valve_asymmetry",
    "thermal_relaxation", "valve_delay", "line_lag",  "chain_backlash",
    "chain_compliance", "sprocket_ripple", "angle_bias", "angle_scale", "angle_lag",
    "pressure_bias", "pressure_scale", "pressure_lag",
)  # fmt: skip
"""Effects of the library that draws are made from: those that the independent plant has, too."""

SIZED = (
    "dahl_friction", "tanh_friction", "sticking_friction", "lugre_friction", "loaded_friction",
    "play_hysteresis", "slip_hysteresis", "duhem_hysteresis", "constant_hysteresis",
)  # fmt: skip
"""Friction and hysteresis of another formula, whose size is scored."""

OTHER = (
    "power_drag", "quadratic_drag", "tilted_ground", "cogging_torque", "two_branch_creep",
    "power_law_creep", "smooth_threshold", "cubic_spring", "cone_ends", "unequal_muscles",
    "hardening_chain", "elastic_teeth", "laminar_leak", "cross_leak", "small_reservoir",
    "air_temperature", "nozzle_flow", "asymmetric_dead_zone", "stuck_valve", "bus_delay",
    "slewing_line", "two_lags", "angle_filter", "bent_angle_scale", "warming_encoder",
    "eccentric_encoder", "pressure_filter", "bent_pressure_scale", "drifting_pressure_zero",
)  # fmt: skip
"""The other effects that belong to a family of the library."""

OUTSIDE = ("soft_stop", "ageing_drift", "slow_clock")
SIMILAR = ("cable_spring", "cold_air")
"""Effects of no family of the library; those that some of it cannot be distinguished from."""

RANGES = {
    "library": (1.0, 20.0),
    "other_formula": (1.0, 20.0),
    "outside": (1.0, 20.0),
    "resembles": (1.0, 20.0),
    "removed": (1.5, 10.0),
    "pair": (1.5, 10.0),
}
"""Tier -> least and largest E that are drawn, of each effect [noise variance]."""

MIDDLE, _RATIO, _BELOW = 0.5, 4.0, 6
GRID = tuple(MIDDLE * _RATIO ** (k - _BELOW) for k in range(_BELOW + 3))
"""Sizes at which the plant is run, from 1.2e-4 to 8 typical sizes, the one that comes first, and
their ratio; in between, log E is linear in log size."""

NOTHING, PAIRS, REMOVED = 60, 24, 30
"""Cases of these tiers."""

OF_EACH = {"library": 2, "sized": 5, "other": 2, "outside": 10, "similar": 1}
"""Cases of each effect of these kinds."""

ABOUT = """Cases of scripts/link_study.py, all drawn by the rule of scripts/blind_study_cases.py
before any of them was run. Sizes are in typical sizes of the effect; excess is the E that each
effect leaves by itself, in units of the noise variance."""

_STEP = 2e-3
"""Of the integrator [s]; at 1.7e-4 s E is the same within 0.1 %."""

_REPEATS = 12  # of each input, from which the variance of what varies is taken

_CHANNELS = {"angle": ANGLE_NOISE, "pressure": PRESSURE_NOISE, "tension": FORCE_NOISE}

Case = dict[str, Any]
Signals = Mapping[str, FloatArray]


def families(effect: str) -> set[str]:
    """Families of the library that are right names for an effect."""
    if effect in PLANT_EFFECTS:
        return set(PLANT_EFFECTS[effect].families)
    return {EFFECTS[effect].family}


def planned() -> list[Case]:
    """The cases, with the E of each effect that was drawn in place of its size."""
    rng = np.random.default_rng(SEED)
    found: list[tuple[str, tuple[str, ...]]] = [("nothing", ())] * NOTHING
    found += [("library", (name,)) for name in LIBRARY for _ in range(OF_EACH["library"])]
    found += [("other_formula", (name,)) for name in SIZED for _ in range(OF_EACH["sized"])]
    found += [("other_formula", (name,)) for name in OTHER for _ in range(OF_EACH["other"])]
    found += [("outside", (name,)) for name in OUTSIDE for _ in range(OF_EACH["outside"])]
    found += [("resembles", (name,)) for name in SIMILAR for _ in range(OF_EACH["similar"])]
    found += [("removed", (name,)) for name in _to_remove(rng)]
    found += [("pair", pair) for pair in _pairs(rng)]
    seeds = iter(rng.permutation(np.arange(90_000, 120_000)).tolist())
    count: dict[str, int] = {}
    cases: list[Case] = []
    for number, (tier, effects) in enumerate(_spread(rng, found)):
        stem = f"{tier}_{'_and_'.join(effects) or 'is_hidden'}"
        count[stem] = count.get(stem, 0) + 1
        gone = set[str]().union(*map(families, effects)) if tier == "removed" else set[str]()
        cases.append(
            {
                "name": f"{stem}_{count[stem]}",
                "tier": tier,
                "effects": {effect: _drawn(rng, tier) for effect in effects},
                "removed": [name for name in TRIAL_EFFECTS if EFFECTS[name].family in gone],
                "noise": ("white", "drifting", "quantised")[number % 3],
                "variation": 0.003 if rng.uniform() < 0.75 else 0.0,
                "forces": bool(rng.uniform() < 2.0 / 3.0),
                "seed": next(seeds),
                "rig": RIG,
            }
        )
    return cases


def _drawn(rng: np.random.Generator, tier: str) -> float:
    low, high = RANGES[tier]
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


def _to_remove(rng: np.random.Generator) -> list[str]:
    """Effects for the tier ``removed``: half by other formulas, half the library's."""
    other = rng.permutation((*SIZED, *OTHER)).tolist()[: REMOVED // 2]
    return [*other, *rng.permutation(LIBRARY).tolist()[: REMOVED - len(other)]]


def _pairs(rng: np.random.Generator) -> Iterator[tuple[str, str]]:
    """Pairs of two families, the first by another formula, every second time the other too."""
    other = (*SIZED, *OTHER)
    for number, first in enumerate(rng.permutation(other).tolist()[:PAIRS]):
        fellows = rng.permutation(other if number % 2 else LIBRARY).tolist()
        yield next((first, fellow) for fellow in fellows if not families(first) & families(fellow))


def _spread(
    rng: np.random.Generator, found: Sequence[tuple[str, tuple[str, ...]]]
) -> list[tuple[str, tuple[str, ...]]]:
    """In a random order in which each tier is spread evenly."""
    at: dict[str, Iterator[float]] = {}
    for tier in dict.fromkeys(tier for tier, _ in found):
        count = sum(one == tier for one, _ in found)
        at[tier] = iter(((np.arange(count) + rng.uniform(size=count)) / count).tolist())
    shuffled = [found[k] for k in rng.permutation(len(found))]
    return [one for _, one in sorted((next(at[one[0]]), one) for one in shuffled)]


def signals(
    effects: Mapping[str, float],
    values: Mapping[str, float],
    rig: str,
    *,
    repeats: int = 1,
    variation: float = 0.0,
) -> Signals:
    """Noise-free recordings of a rig: channel -> all samples over their noise.

    Args:
        effects: hidden, name -> size.
        values: parameters that the rig has in place of its own.
        rig: name.
        repeats: of every input, one after the other.
        variation: by which they differ.
    """
    there = pamsim.load_rig(rig).with_parameters(values)
    made = functools.partial(
        hide, there, effects, protocols=INPUTS, duration=DURATION, repeats=repeats,
        variation=variation, noise=0.0, formulation="plant", seed=SEED,
    )  # fmt: skip
    try:
        runs = made(step=_STEP).trials.values()
    except SimulationError:  # a lag so short needs the plant's own step
        runs = made().trials.values()
    return {
        name: np.concatenate([np.ravel(getattr(run, name)) for run in runs]) / noise
        for name, noise in _CHANNELS.items()
    }


@functools.cache
def without(rig: str) -> tuple[Signals, tuple[Signals, ...]]:
    """Signals of a rig as it is, and what a per cent of each nuisance parameter changes."""
    own = signals({}, {}, rig)
    moved = [
        signals({}, {name: 1.01 * rig_parameter(pamsim.load_rig(rig), name).value}, rig)
        for name in NUISANCE
    ]
    return own, tuple({c: one[c] - own[c] for c in own} for one in moved)


@functools.cache
def repeated(rig: str, variation: float) -> Mapping[str, float]:
    """Channel -> variance of what repeats differ by: sensors' noise and a variation of trials."""
    if variation == 0.0:
        return dict.fromkeys(_CHANNELS, 1.0)
    runs = signals({}, {}, rig, repeats=_REPEATS, variation=variation)
    return {
        c: 1.0 + float(np.var(one.reshape(2 * len(INPUTS), _REPEATS, -1), axis=1, ddof=1).mean())
        for c, one in runs.items()
    }


@functools.cache
def excess(effect: str, size: float, forces: bool, rig: str, variation: float) -> float:
    """E that an effect leaves on a rig, see above [noise variance]."""
    own, nuisance = without(rig)
    found = _signals_of(effect, size, rig)
    measured = list(_CHANNELS) if forces else list(_CHANNELS)[:2]
    variance = repeated(rig, variation)

    def stacked(change: Signals) -> FloatArray:
        return np.concatenate(
            [change[c] / math.sqrt(change[c].size * variance[c]) for c in measured]
        )

    change = stacked({c: found[c] - own[c] for c in own})
    columns = np.stack([stacked(one) for one in nuisance], axis=1)
    left = change - columns @ np.linalg.lstsq(columns, change)[0]
    return max(float(left @ left) / len(measured), 1e-9)


@functools.lru_cache(maxsize=8)
def _signals_of(effect: str, size: float, rig: str) -> Signals:
    return signals({effect: size}, {}, rig)


def between(effect: str, size: float, *where: Any) -> float:
    """E of any size, from runs at the two sizes of `GRID` beside it."""
    k = min(max(int(np.searchsorted(GRID, size)), 1), len(GRID) - 1)
    low, high = (math.log(excess(effect, GRID[i], *where)) for i in (k - 1, k))
    return math.exp(low + (high - low) * math.log(size / GRID[k - 1]) / math.log(_RATIO))


def size_that_leaves(effect: str, wanted: float, *where: Any) -> float:
    """Size of an effect that leaves an E, as far as `GRID` goes [typical sizes]."""
    up, down = range(_BELOW, len(GRID) - 1), range(_BELOW - 1, -1, -1)
    first = excess(effect, MIDDLE, *where) < wanted
    for k in (*up, *down) if first else (*down, *up):
        try:
            low, high = (math.log(excess(effect, GRID[i], *where)) for i in (k, k + 1))
        except SimulationError:  # a lag too short for the plant's steps
            break
        share = (math.log(wanted) - low) / (high - low) if high != low else -1.0
        if 0.0 <= share <= 1.0:
            return GRID[k] * _RATIO**share
    return GRID[-1] if first else MIDDLE


def answered(asked: tuple[str, Sequence[Case], bool]) -> list[tuple[float, float]]:
    """Size of an effect in each case that leaves about the E drawn, and the E that it leaves."""
    effect, cases, varying = asked
    found: list[tuple[float, float]] = []
    for case in cases:
        where = (case["forces"], case["rig"], case["variation"] if varying else 0.0)
        size = float(f"{size_that_leaves(effect, case['effects'][effect], *where):.3g}")
        found.append((size, float(f"{between(effect, size, *where):.3g}")))
    return found


def write_cases(
    file: Path, planned: Sequence[Case], about: str, workers: int, *, varying: bool = False
) -> None:
    """Size the effects of planned cases in some processes, and write the cases.

    With ``varying`` the variance that E is stated in holds what trials vary by, not noise alone.
    """
    cases: list[Case] = [{**case, "excess": {}} for case in planned]
    asked: dict[str, list[Case]] = {}
    for case in cases:
        for effect in case["effects"]:
            asked.setdefault(effect, []).append(case)
    with ProcessPoolExecutor(workers) as pool:
        tasks = [(effect, those, varying) for effect, those in asked.items()]
        results = tqdm(pool.map(answered, tasks), total=len(asked), desc="effects")
        for (effect, those), found in zip(asked.items(), results, strict=True):
            for case, (size, left) in zip(those, found, strict=True):
                case["effects"][effect], case["excess"][effect] = size, left
    lines = ",\n".join("  " + json.dumps(case) for case in cases)
    head = json.dumps(about.replace("\n", " "))
    file.write_text(f'{{\n "about": {head},\n "cases": [\n{lines}\n ]\n}}\n', encoding="utf-8")


def main() -> None:
    """Draw the cases, size them, write them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    write_cases(FILE, planned(), ABOUT, options.workers)


if __name__ == "__main__":
    main()
