"""Fresh cases for the diagnosis by link: what is hidden in each, of which size, under which noise.

    python scripts/link_study_cases.py [--seed N] [--to N] [--tiers TIER ...] [--json FILE]
        [--workers 2]

Cases that judge rules are drawn once the rules are frozen, by a seed that no case has been drawn
with, and before any of them is run. Cases to make rules with have other seeds; 60 of them take two
minutes. All cases of a file are drawn from one seed; each tier is spread evenly
over them, so that any beginning is a fair sample.

How sizes are drawn: first the excess E that an effect shall leave, log-uniformly; then the size
that leaves about that much, from runs of the independent plant with and without the effect. No
diagnosis has a part in it. E of a case, before any diagnosis, is a mean square over a variance: the
difference of the two recordings (without noise, inputs of `INPUT_SEED`, in both settings), less
what a linear refit of the nuisance parameters takes away, over the variance by which repeats
differ (of the sensors' noise, and of what varies from trial to trial), averaged over angle,
pressures and, where they are measured, forces. Each of several effects has its own. Some leave more
than the E drawn at any size, such as a nozzle, whose law differs from that of ISO 6358 at the same
flow: their size is then the middle one of `GRID`. Others leave less up to its largest, which is
then their size. The E that a size leaves is written beside it (``excess``).

A tier belongs to the family of what is hidden, which is the name that a diagnosis gives; with
``removed`` the diagnosis tries no effect of the right families. Two and three effects together are
of different families. In the tier ``two_links`` one of them acts between command and pressure, the
other between pressure and angle; in ``one_link`` both act on the same side; of ``three`` at least
one acts on each. Every effect of these is by a formula that the library has not with a probability
of a half.
"""

from __future__ import annotations

import functools
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from link_study_scores import OUTSIDE
from records import parser, write_rows
from tqdm import tqdm

import pamsim
from pamsim.core.errors import SimulationError
from pamsim.core.units import FloatArray
from pamsim.diagnosis.options import NUISANCE
from pamsim.effects.catalog import EFFECTS, TRIAL_EFFECTS
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.twins.noise import ANGLE_NOISE, FORCE_NOISE, PRESSURE_NOISE
from pamsim.twins.synthetic_recording import SyntheticRecording

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests.plant.hidden.catalog import PLANT_EFFECTS
from tests.plant.hide import hide

FILE = Path("out/link_study_cases.json")
RIG = "mas20_arm"
INPUTS = ("levels", "ramps", "tones", "pulses", "loaded_levels")
DURATION = 5.0

SEED = 20261218
"""Of all that is drawn here, for cases to make rules with."""

INPUT_SEED = 20261126
"""Of the inputs with which sizes are found: another than that of any case."""

OWN = (
    "coulomb_friction", "stribeck_friction", "viscous_friction", "quadratic_damping",
    "load_dependent_friction",
    "load_torque", "added_inertia", "muscle_hysteresis", "viscoelastic_creep", "braid_friction",
    "threshold_pressure", "passive_stiffness", "end_shape", "muscle_mismatch", "air_leak",
    "supply_sag", "valve_dead_zone", "valve_flow", "valve_asymmetry",
    "thermal_relaxation", "valve_delay", "line_lag",  "chain_backlash",
    "chain_compliance", "sprocket_ripple", "angle_bias", "angle_scale", "angle_lag",
    "pressure_bias", "pressure_scale", "pressure_lag", "softening",
)  # fmt: skip
"""Effects of the library that draws are made from: those that the independent plant has, too."""

OTHERS = (
    "dahl_friction", "tanh_friction", "sticking_friction", "lugre_friction", "loaded_friction",
    "play_hysteresis", "slip_hysteresis", "duhem_hysteresis", "constant_hysteresis",
    "power_drag", "tilted_ground", "cogging_torque", "two_branch_creep",
    "power_law_creep", "smooth_threshold", "stiffening_spring", "cone_ends", "unequal_muscles",
    "hardening_chain", "round_teeth", "laminar_leak", "cross_leak", "small_reservoir",
    "air_temperature", "nozzle_flow", "asymmetric_dead_zone", "stuck_valve", "bus_delay",
    "slewing_line", "two_lags", "angle_filter", "unequal_channels", "warming_encoder",
    "eccentric_encoder", "pressure_filter", "power_pressure_scale", "drifting_pressure_zero",
)  # fmt: skip
"""Effects by another formula that belong to a family of the library."""

TIERS = {
    "nothing": 60, "library": 40, "other_formula": 40, "outside": 20, "removed": 20,
    "two_links": 50, "one_link": 50, "three": 40,
}  # fmt: skip
"""Cases of each tier."""

EXCESS = {"two_links": (1.5, 10.0), "one_link": (1.5, 10.0), "three": (1.5, 10.0)}
"""Tier -> least and largest E that are drawn, of each effect [noise variance]."""
_EXCESS = (1.0, 20.0)  # of the others

NOISES = [
    (noise, variation)
    for noise in ("white", "drifting", "quantised")
    for variation in (0.0, 0.003, 0.01)
][1:]
"""Kinds of noise, and by how much trials of one input vary, in turn; without white noise alone,
which all tests assume."""

_AIR = frozenset({"command", "supply", "air"})  # links between command and pressure

MIDDLE, _RATIO, _BELOW = 0.5, 4.0, 6
GRID = tuple(MIDDLE * _RATIO ** (k - _BELOW) for k in range(_BELOW + 3))
"""Sizes at which the plant is run, from 1.2e-4 to 8 typical sizes, the one that comes first, and
their ratio; in between, log E is linear in log size."""

_STEP = 2e-3
"""Of the integrator [s]; at 1.7e-4 s E is the same within 0.1 %."""

_REPEATS = 12  # of each input, from which the variance of what varies is taken

_CHANNELS = {"angle": ANGLE_NOISE, "pressure": PRESSURE_NOISE, "tension": FORCE_NOISE}

ABOUT = """Cases of scripts/link_study.py, all drawn by the rule of scripts/link_study_cases.py
before any of them was run. Sizes are in typical sizes of the effect; excess is the E that each
effect leaves by itself, in units of the variance by which repeats differ."""

Case = dict[str, Any]
Signals = Mapping[str, FloatArray]


def families(effect: str) -> set[str]:
    """Families of the library that are right names for an effect."""
    if effect in PLANT_EFFECTS:
        return set(PLANT_EFFECTS[effect].families)
    return {EFFECTS[effect].family}


def of_air(effect: str) -> bool:
    """Whether an effect acts between command and pressure, or on what reads the pressure."""
    own = families(effect)
    links = {e.link for e in EFFECTS.values() if e.family in own}
    return bool(links & _AIR) or "pressure_sensor" in own


def planned(seed: int = SEED) -> list[Case]:
    """The cases, with the E of each effect that was drawn in place of its size."""
    rng = np.random.default_rng(seed)
    singles = {
        "nothing": (("",),),
        "library": tuple((name,) for name in OWN),
        "other_formula": tuple((name,) for name in OTHERS),
        "outside": tuple((name,) for name in OUTSIDE),
        "removed": tuple((name,) for name in (*OWN, *OTHERS)),
    }
    found: list[tuple[str, tuple[str, ...]]] = []
    for tier, count in TIERS.items():
        drawn = _in_turn(rng, singles[tier]) if tier in singles else _together(rng, tier)
        found += [(tier, next(drawn)) for _ in range(count)]
    seeds = iter(rng.permutation(np.arange(200_000, 300_000)).tolist())
    cases: list[Case] = []
    for number, (tier, effects) in enumerate(_spread(rng, found)):
        named = [effect for effect in effects if effect]
        gone = set[str]().union(*map(families, named)) if tier == "removed" else set[str]()
        noise, variation = NOISES[number % len(NOISES)]
        cases.append(
            {
                "name": f"{number + 1}_{tier}",
                "tier": tier,
                "effects": {effect: _drawn(rng, tier) for effect in named},
                "removed": [name for name in TRIAL_EFFECTS if EFFECTS[name].family in gone],
                "noise": noise,
                "variation": variation,
                "forces": bool(rng.uniform() < 0.5),
                "seed": next(seeds),
                "rig": RIG,
            }
        )
    return cases


def _in_turn(
    rng: np.random.Generator, choices: Sequence[tuple[str, ...]]
) -> Iterator[tuple[str, ...]]:
    """All choices in a random order, again and again."""
    while True:
        yield from (choices[k] for k in rng.permutation(len(choices)))


def _together(rng: np.random.Generator, tier: str) -> Iterator[tuple[str, ...]]:
    """Two or three effects of different families, on the sides that a tier asks for."""
    pools = (OWN, OTHERS)
    count = 3 if tier == "three" else 2
    while True:
        found = tuple(str(rng.choice(pools[rng.integers(2)])) for _ in range(count))
        air = sum(map(of_air, found))
        own = [families(effect) for effect in found]
        apart = len(set[str]().union(*own)) == sum(map(len, own))
        if apart and (air in (0, count)) == (tier == "one_link"):
            yield found


def _drawn(rng: np.random.Generator, tier: str) -> float:
    low, high = EXCESS.get(tier, _EXCESS)
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


def _spread(
    rng: np.random.Generator, found: Sequence[tuple[str, tuple[str, ...]]]
) -> list[tuple[str, tuple[str, ...]]]:
    """In a random order in which each tier is spread evenly."""
    places = [
        (k + rng.uniform()) / count for count in TIERS.values() for k in range(count)
    ]  # fmt: skip
    return [found[k] for k in np.argsort(places)]


def plant_recording(
    rig: Rig, effects: Mapping[str, float], step: float, **settings: Any
) -> SyntheticRecording:
    """A recording of the independent plant in steps [s] that are longer than its own."""
    try:
        return hide(rig, effects, **settings, step=step)
    except SimulationError:  # a lag so short needs the plant's own step
        return hide(rig, effects, **settings)


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
    runs = plant_recording(
        there, effects, _STEP, protocols=INPUTS, duration=DURATION, repeats=repeats,
        variation=variation, noise=0.0, formulation="plant", seed=INPUT_SEED,
    ).trials.values()  # fmt: skip
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


def answered(asked: tuple[str, Sequence[Case]]) -> list[tuple[float, float]]:
    """Size of an effect in each case that leaves about the E drawn, and the E that it leaves."""
    effect, cases = asked
    found: list[tuple[float, float]] = []
    for case in cases:
        where = (case["forces"], case["rig"], case["variation"])
        size = float(f"{size_that_leaves(effect, case['effects'][effect], *where):.3g}")
        found.append((size, float(f"{between(effect, size, *where):.3g}")))
    return found


def write_cases(file: Path, planned: Sequence[Case], workers: int) -> None:
    """Size the effects of planned cases in some processes, and write the cases."""
    cases: list[Case] = [{**case, "excess": {}} for case in planned]
    asked: dict[str, list[Case]] = {}
    for case in cases:
        for effect in case["effects"]:
            asked.setdefault(effect, []).append(case)
    with ProcessPoolExecutor(workers) as pool:
        results = tqdm(pool.map(answered, asked.items()), total=len(asked), desc="effects")
        for (effect, those), found in zip(asked.items(), results, strict=True):
            for case, (size, left) in zip(those, found, strict=True):
                case["effects"][effect], case["excess"][effect] = size, left
    write_rows({"about": ABOUT.replace("\n", " "), "cases": cases}, file, rows="cases")


def main() -> None:
    """Draw the cases, size them, write them."""
    asked = parser(__doc__, FILE, seed=SEED, workers=2)
    asked.add_argument("--to", type=int, help="number of the last case; all if left out")
    asked.add_argument("--tiers", nargs="+", default=TIERS, choices=TIERS, help="all if left out")
    options = asked.parse_args()
    cases = [case for case in planned(options.seed) if case["tier"] in options.tiers][: options.to]
    write_cases(options.json, cases, options.workers)


if __name__ == "__main__":
    main()
