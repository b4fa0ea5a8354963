"""Fresh cases for the diagnosis by link: what is hidden in each, of which size, under which noise.

    python scripts/link_study_cases.py [--seed N --to N --json FILE] [--workers 2]

writes link_study_cases.json, which is to be drawn once the rules of the diagnosis are frozen, and
before any case is run. Cases to make rules with are drawn by another seed, into another file; 60
of them take two minutes. All cases of a file are drawn from one seed; each tier is spread evenly
over them, so that any beginning is a fair sample. Sizes are drawn as in
scripts/blind_study_cases.py: first the excess E that an effect shall leave, log-uniformly, then the
size that leaves about that much. E is stated in the variance by which repeats differ: of the
sensors' noise, and of what varies from trial to trial.

Two and three effects together are of different families. In the tier ``two_links`` one of them acts
between command and pressure, the other between pressure and angle; in ``one_link`` both act on the
same side; of ``three`` at least one acts on each. Every effect of these is by a formula that the
library has not with a probability of a half.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from blind_study_cases import LIBRARY, OTHER, RIG, SIZED, Case, families, write_cases
from link_study_scores import OUTSIDE

from pamsim.effects.catalog import EFFECTS, TRIAL_EFFECTS

FILE = Path(__file__).parent / "link_study_cases.json"

SEED = 20261218
"""Of all that is drawn here. Cases that rules are made with have others."""

REPLACED = {
    "cubic_spring": "stiffening_spring",
    "elastic_teeth": "round_teeth",
    "bent_angle_scale": "unequal_channels",
    "bent_pressure_scale": "power_pressure_scale",
}
"""Effects whose formula the library has had since the draws before -> those in their place."""

OWN, OTHERS = (
    (*LIBRARY, "softening"),
    tuple(REPLACED.get(name, name) for name in (*SIZED, *OTHER)),
)
"""Effects that are hidden by the library's formulas, and by others."""

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

ABOUT = """Cases of scripts/link_study.py, all drawn by the rule of scripts/link_study_cases.py
before any of them was run. Sizes are in typical sizes of the effect; excess is the E that each
effect leaves by itself, in units of the variance by which repeats differ."""


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


def main() -> None:
    """Draw the cases, size them, write them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--to", type=int, help="number of the last case; all if left out")
    parser.add_argument("--json", type=Path, default=FILE)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    if options.json == FILE and (options.seed != SEED or options.to is not None):
        parser.error(f"{FILE.name} holds all cases of seed {SEED}; give another file by --json")
    cases = planned(options.seed)[: options.to]
    write_cases(options.json, cases, ABOUT, options.workers, varying=True)


if __name__ == "__main__":
    main()
