"""The cases of the blind study: what is hidden in each, of which size, under which noise.

    python scripts/blind_study_cases.py [--workers 2]

writes blind_study_cases.json. Its first 168 cases were committed before this file and stay as they
are, but for tiers that change with the library (`placed`); those that `planned` draws from its seed
follow, each tier spread evenly over them, so that any beginning of either part is a fair sample.

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
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

import pamsim
from pamsim.core.errors import SimulationError
from pamsim.diagnosis.recordings import NUISANCE
from pamsim.effects.catalog import EFFECTS, TRIAL_EFFECTS
from pamsim.engine.rig_parameter import rig_parameter
from pamsim.twins.hidden.catalog import PLANT_EFFECTS
from pamsim.twins.hide import hide
from pamsim.twins.noise import ANGLE_NOISE, FORCE_NOISE, PRESSURE_NOISE

FILE = Path(__file__).parent / "blind_study_cases.json"
INPUTS = ("levels", "ramps", "tones", "pulses", "loaded_levels")
DURATION = 5.0

SEED = 20261122
"""Of all that is drawn here."""

FIRST = 168
"""Cases that were committed before this file."""

RIG = "mas20_arm"

LIBRARY = (
    "coulomb_friction",
    "stribeck_friction",
    "viscous_friction",
    "load_torque",
    "added_inertia",
    "muscle_hysteresis",
    "viscoelastic_creep",
    "threshold_pressure",
    "passive_stiffness",
    "end_shape",
    "muscle_mismatch",
    "air_leak",
    "supply_sag",
    "valve_dead_zone",
    "valve_flow",
    "thermal_relaxation",
    "valve_delay",
    "line_lag",
    "chain_backlash",
    "chain_compliance",
    "angle_bias",
    "angle_scale",
    "angle_lag",
    "pressure_bias",
    "pressure_scale",
    "pressure_lag",
)
"""Effects of the library that draws are made from: those tried when the cases were drawn."""

RANGES = {
    "other_formula": (1.0, 20.0),
    "outside": (1.0, 20.0),
    "resembles": (1.0, 20.0),
    "removed": (1.5, 10.0),
    "pair": (1.5, 10.0),
}
"""Tier -> least and largest E that are drawn, of each effect [noise variance]."""

GRID, _MIDDLE, _RATIO = (0.0078125, 0.03125, 0.125, 0.5, 2.0, 8.0), 3, 4.0
"""Sizes at which the plant is run [typical sizes], the one that comes first, and their ratio; in
between, log E is linear in log size."""

NOTHING, PAIRS, REMOVED = 44, 14, 22
"""Fresh cases of these tiers."""

SIZED = 5
"""Fresh cases of each friction and hysteresis of another formula; one of each other formula."""

ABOUT = """Cases of scripts/blind_study.py, all fixed before any of them was run. The first 168
were committed first: sizes in the library and of other formulas drawn log-uniformly between 0.4
and 20 times the noise variance that the effect leaves (1.5 to 10 for pairs and removed effects),
in a random order. scripts/blind_study_cases.py drew the others by its rule. Sizes are in typical
sizes of the effect; excess is the E that each effect leaves by itself, in units of the noise
variance."""

_STEP = 2e-3
"""Of the integrator [s]; at 1.7e-4 s E is the same within 0.1 %."""

_CHANNELS = {"angle": ANGLE_NOISE, "pressure": PRESSURE_NOISE, "tension": FORCE_NOISE}

FloatArray = NDArray[np.float64]
Case = dict[str, Any]
Signals = Mapping[str, FloatArray]


def right_names(effect: str) -> set[str]:
    """Names for a hidden effect among those that draws are made from."""
    return all_names(effect) & set(LIBRARY)


def all_names(effect: str) -> set[str]:
    """Names of the library for a hidden effect."""
    return set(PLANT_EFFECTS[effect].stands_for if effect in PLANT_EFFECTS else (effect,))


def placed(case: Mapping[str, Any]) -> Case:
    """A case in its tier under the library as it is now.

    An effect from outside the library, or that only resembles one of it, is one of another formula
    once a diagnosis tries a right name; where the true effect is removed, all right names are.
    """
    tier, removed = case["tier"], set(case["removed"])
    right = [all_names(effect) & set(TRIAL_EFFECTS) for effect in case["effects"]]
    if tier in ("outside", "resembles") and all(right):
        tier = "other_formula"
    if tier == "removed":
        removed = removed.union(*right)
    return {**case, "tier": tier, "removed": sorted(removed, key=TRIAL_EFFECTS.index)}


def families(effect: str) -> set[str]:
    """Families of these names."""
    return {EFFECTS[name].family for name in right_names(effect)}


def planned(before: Sequence[Mapping[str, Any]]) -> list[Case]:
    """The fresh cases, with the E of each effect that was drawn in place of its size.

    Args:
        before: cases whose names go on and whose pairs, removed effects and seeds do not return.
    """
    rng = np.random.default_rng(SEED)
    hidden = {name for case in before for name in case["effects"]}
    plant = [name for name in PLANT_EFFECTS if name in hidden]  # what comes later changes no draw
    other = [name for name in plant if right_names(name)]
    sized = [n for n in other if families(n) & {"joint_friction", "muscle_hysteresis"}]
    without_name = [name for name in plant if not right_names(name)]
    found = [("nothing", ())] * NOTHING
    found += [("other_formula", (n,)) for n in other for _ in range(SIZED if n in sized else 1)]
    for name in without_name:
        similar = bool(PLANT_EFFECTS[name].resembles)
        found += [("resembles", (name,))] if similar else [("outside", (name,))] * 3
    found += [("removed", (name,)) for name in _to_remove(rng, other, before)]
    found += [("pair", pair) for pair in _pairs(rng, other, before)]
    taken = {case["name"] for case in before}
    seeds = iter(rng.permutation(np.arange(60000, 90000)).tolist())
    cases: list[Case] = []
    for number, (tier, effects) in enumerate(_spread(rng, found)):
        stem = "_and_".join(effects) or "is_hidden"
        free = (f"{tier}_{stem}_{k}" for k in range(1, len(found) + FIRST))
        name = next(n for n in free if n not in taken)
        taken.add(name)
        cases.append(
            {
                "name": name,
                "tier": tier,
                "effects": {effect: _drawn(rng, tier) for effect in effects},
                "removed": [],
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


def _to_remove(
    rng: np.random.Generator, other: Sequence[str], before: Sequence[Mapping[str, Any]]
) -> list[str]:
    """Effects for the tier ``removed``: other formulas that were not in it, then the library's."""
    gone = {name for case in before if case["tier"] == "removed" for name in case["effects"]}
    fresh = [name for name in other if name not in gone]
    library = [name for name in LIBRARY if name not in gone]
    return [*rng.permutation(fresh).tolist(), *rng.permutation(library).tolist()][:REMOVED]


def _pairs(
    rng: np.random.Generator, other: Sequence[str], before: Sequence[Mapping[str, Any]]
) -> Iterator[tuple[str, str]]:
    """Pairs of two families, the first by another formula, every second time the other too."""
    known = {frozenset(case["effects"]) for case in before}
    for number, first in enumerate(rng.permutation(other).tolist()[:PAIRS]):
        fellows = rng.permutation(other if number % 2 else LIBRARY).tolist()
        yield next(
            (first, fellow)
            for fellow in fellows
            if not families(first) & families(fellow) and frozenset((first, fellow)) not in known
        )


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


def signals(effects: Mapping[str, float], values: Mapping[str, float], rig: str) -> Signals:
    """Noise-free recordings of a rig: channel -> all samples over their noise.

    Args:
        effects: hidden, name -> size.
        values: parameters that the rig has in place of its own.
        rig: name.
    """
    there = pamsim.load_rig(rig).with_parameters(values)
    made = functools.partial(
        hide, there, effects, protocols=INPUTS, duration=DURATION, repeats=1, variation=0.0,
        noise=0.0, formulation="plant", seed=SEED,
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
def excess(effect: str, size: float, forces: bool, rig: str) -> float:
    """E that an effect leaves on a rig, see above [noise variance]."""
    own, nuisance = without(rig)
    found = _signals_of(effect, size, rig)
    measured = list(_CHANNELS) if forces else list(_CHANNELS)[:2]

    def stacked(change: Signals) -> FloatArray:
        return np.concatenate([change[c] / math.sqrt(change[c].size) for c in measured])

    change = stacked({c: found[c] - own[c] for c in own})
    columns = np.stack([stacked(one) for one in nuisance], axis=1)
    left = change - columns @ np.linalg.lstsq(columns, change)[0]
    return max(float(left @ left) / len(measured), 1e-9)


@functools.lru_cache(maxsize=8)
def _signals_of(effect: str, size: float, rig: str) -> Signals:
    return signals({effect: size}, {}, rig)


def between(effect: str, size: float, forces: bool, rig: str) -> float:
    """E of any size, from runs at the two sizes of `GRID` beside it."""
    k = min(max(int(np.searchsorted(GRID, size)), 1), len(GRID) - 1)
    low, high = (math.log(excess(effect, GRID[i], forces, rig)) for i in (k - 1, k))
    return math.exp(low + (high - low) * math.log(size / GRID[k - 1]) / math.log(_RATIO))


def size_that_leaves(effect: str, wanted: float, forces: bool, rig: str) -> float:
    """Size of an effect that leaves an E, as far as `GRID` goes [typical sizes]."""
    up, down = range(_MIDDLE, len(GRID) - 1), range(_MIDDLE - 1, -1, -1)
    first = excess(effect, GRID[_MIDDLE], forces, rig) < wanted
    for k in (*up, *down) if first else (*down, *up):
        low, high = (math.log(excess(effect, GRID[i], forces, rig)) for i in (k, k + 1))
        share = (math.log(wanted) - low) / (high - low) if high != low else -1.0
        if 0.0 <= share <= 1.0:
            return GRID[k] * _RATIO**share
    least = min(excess(effect, size, forces, rig) for size in (GRID[0], GRID[-1]))
    return GRID[_MIDDLE] if least > wanted else GRID[-1]


def answered(asked: tuple[str, Sequence[tuple[bool, Case]]]) -> list[tuple[float, float]]:
    """Size and E of an effect in each case; with True the E is given and the size is sought."""
    effect, cases = asked
    found: list[tuple[float, float]] = []
    for sought, case in cases:
        size, where = case["effects"][effect], (case["forces"], case["rig"])
        if sought:
            size = float(f"{size_that_leaves(effect, size, *where):.3g}")
        found.append((size, float(f"{between(effect, size, *where):.3g}")))
    return found


def main() -> None:
    """Keep the first cases, draw the others, write all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    first = json.loads(FILE.read_text(encoding="utf-8"))["cases"][:FIRST]
    cases: list[Case] = [{**case, "rig": RIG, "excess": {}} for case in first]
    cases += [{**case, "excess": {}} for case in planned(first)]
    asked: dict[str, list[tuple[bool, Case]]] = {}
    for number, case in enumerate(cases):
        for effect in case["effects"]:
            asked.setdefault(effect, []).append((number >= FIRST, case))
    with ProcessPoolExecutor(options.workers) as pool:
        results = tqdm(pool.map(answered, asked.items()), total=len(asked), desc="effects")
        for (effect, those), found in zip(asked.items(), results, strict=True):
            for (_, case), (size, left) in zip(those, found, strict=True):
                case["effects"][effect], case["excess"][effect] = size, left
    lines = ",\n".join("  " + json.dumps(placed(case)) for case in cases)
    head = json.dumps(ABOUT.replace("\n", " "))
    FILE.write_text(f'{{\n "about": {head},\n "cases": [\n{lines}\n ]\n}}\n', encoding="utf-8")


if __name__ == "__main__":
    main()
