"""Scores of the blind study: every share with its count and exact 95 % interval.

A claim is a name in a verdict ``named`` or ``named_with_remainder``, or one that all tied models
share. It is right if it stands for an effect that was hidden (``stands_for`` of the ground truth).
Names that only resemble what was hidden, while no effect of the library is its cause, count as
neither right nor wrong. With that, as usual in fault diagnosis:

- localisation F1 = 2 TP / (2 TP + FP + FN) over all claims and all hidden effects that have a right
  name which was not removed from the library;
- false discovery rate = FP / (FP + TP);
- isolation = of the cases in which something was detected, those with exactly the right names;
- coverage = of all cases with a right name, those in which it is claimed or an alternative.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.stats import binomtest

from pamsim.effects.catalog import EFFECTS, TRIAL_EFFECTS

Row = Mapping[str, Any]
Case = tuple[Mapping[str, Any], Row]

CLAIMING = ("named", "named_with_remainder")
WITH_NAME = ("library", "other_formula", "pair")
"""Tiers in which the library holds a right name for every hidden effect."""


def plain(name: str) -> str:
    """Name of an effect without its form."""
    return name.partition(":")[0]


def claims(row: Row) -> set[str]:
    """Effects that a diagnosis claims."""
    names = row["claimed"] if row["verdict"] in CLAIMING else row["certain"]
    return {plain(name) for name in names}


def suggested(row: Row) -> set[str]:
    """Effects that it claims or gives as alternatives."""
    if row["verdict"] in ("unexplained", "no_gap", "not_identifiable"):
        return claims(row)
    return claims(row) | {plain(name) for name in row["suggested"]}


def right_names(case: Mapping[str, Any], row: Row) -> list[set[str]]:
    """Right names of each hidden effect, of those with one that the diagnosis tried."""
    sets = [set(hidden["stands_for"]) - set(case["removed"]) for hidden in row["hidden"]]
    return [names for names in sets if names & set(TRIAL_EFFECTS)]


def counts(case: Mapping[str, Any], row: Row) -> tuple[int, int, int]:
    """True positives, false positives and false negatives of a case."""
    found, wanted = claims(row), right_names(case, row)
    right = set[str]().union(*wanted)
    similar = {name for hidden in row["hidden"] for name in hidden["resembles"]}
    hit = sum(bool(names & found) for names in wanted)
    return hit, len(found - right - similar), len(wanted) - hit


def wrong(case: Mapping[str, Any], row: Row) -> bool:
    """Whether only wrong names are claimed with confidence."""
    hit, false, _ = counts(case, row)
    return false > 0 and hit == 0 and row["verdict"] in CLAIMING


def exact(case: Mapping[str, Any], row: Row) -> bool:
    """Whether every hidden effect is claimed by a right name, and nothing else is claimed."""
    hit, _, missed = counts(case, row)
    right = set[str]().union(*right_names(case, row))
    return hit > 0 and missed == 0 and claims(row) <= right


def covered(case: Mapping[str, Any], row: Row) -> bool:
    """Whether every hidden effect has a right name among those suggested."""
    return all(names & suggested(row) for names in right_names(case, row))


def families(case: Mapping[str, Any], row: Row) -> tuple[int, int, int]:
    """The same as `counts`, of families of effects."""

    def of(names: set[str]) -> set[str]:
        return {EFFECTS[name].family for name in names if name in EFFECTS}

    found, wanted = of(claims(row)), [of(names) for names in right_names(case, row)]
    similar = of({name for hidden in row["hidden"] for name in hidden["resembles"]})
    hit = sum(bool(names & found) for names in wanted)
    return hit, len(found - set[str]().union(*wanted) - similar), len(wanted) - hit


def excess(row: Row) -> float:
    """Mean square misfit of the refitted base over the noise variance, minus 1; 0 if unknown."""
    before = row["gap"]["before"]
    return 0.0 if before is None else before**2 - 1.0


def scores(cases: Sequence[Case]) -> dict[str, Any]:
    """All quantities of the study.

    Args:
        cases: cases and their rows.
    """

    def of(*tiers: str, low: float = -np.inf, high: float = np.inf) -> list[Case]:
        return [(c, r) for c, r in cases if c["tier"] in tiers and low <= excess(r) < high]

    named = of(*WITH_NAME)
    detected = [(c, r) for c, r in named if r["verdict"] != "no_gap"]
    sizes = [size for _, r in cases for size in _sizes(r)]
    limits = [entry for _, r in cases for entry in r["limits"].values()]
    return {
        "data sets": len(cases),
        "localisation F1": _f1([counts(c, r) for c, r in cases]),
        "localisation F1 of families": _f1([families(c, r) for c, r in cases]),
        "false discovery rate": _rate([counts(c, r) for c, r in cases]),
        "detection": share(named, lambda _, r: r["verdict"] != "no_gap"),
        "isolation": share(detected, exact),
        "coverage": share(named, covered),
        "wrong confident name": share(cases, wrong),
        "nothing hidden: effect claimed or suggested": share(
            of("nothing"), lambda _, r: bool(suggested(r))
        ),
        "nothing hidden: verdict no_gap": share(
            of("nothing"), lambda _, r: r["verdict"] == "no_gap"
        ),
        **{
            f"{tier}: {what}": share(of(tier, low=low), hit)
            for tier in WITH_NAME
            for what, low, hit in (
                ("exactly the hidden effects claimed", -np.inf, exact),
                ("exactly the hidden effects claimed, E >= 0.5", 0.5, exact),
                ("right name claimed or an alternative, E >= 0.5", 0.5, covered),
                ("wrong confident name", -np.inf, wrong),
            )
        },
        "outside: no name claimed": share(of("outside"), lambda _, r: not claims(r)),
        "outside, E >= 0.1: unexplained": share(
            of("outside", low=0.1), lambda _, r: r["verdict"] == "unexplained"
        ),
        "resembles: no name, or a similar one": share(
            of("resembles"), lambda c, r: counts(c, r)[1] == 0
        ),
        "removed from the library, E >= 0.5: no name claimed": share(
            of("removed", low=0.5), lambda _, r: not claims(r)
        ),
        "sizes within 15 %": plain_share([error <= 0.15 for error, _ in sizes]),
        "error of the size": _median(error for error, _ in sizes),
        "intervals that contain the hidden value": plain_share(
            [inside for _, inside in sizes if inside is not None]
        ),
        "limits of effects not claimed that hold": plain_share(
            [entry["limit"] >= entry["truth"] for entry in limits]
        ),
        "seconds per diagnosis": _median(r["seconds"] for _, r in cases),
    }


def share(cases: Sequence[Case], hit: Callable[[Any, Row], bool]) -> dict[str, Any]:
    """Share of cases that hit, its interval, and the fewer of those that do and do not."""
    hits = [hit(*case) for case in cases]
    if not hits:
        return {"count": 0}
    few = sum(hits) <= len(hits) / 2
    names = [c["name"] for (c, _), h in zip(cases, hits, strict=True) if h == few]
    return {**plain_share(hits), "others": names[:40]}


def plain_share(hits: Sequence[bool]) -> dict[str, Any]:
    """Share with its exact (Clopper-Pearson) 95 % interval."""
    if not hits:
        return {"count": 0}
    interval = binomtest(sum(hits), len(hits)).proportion_ci(method="exact")
    return {
        "share": round(sum(hits) / len(hits), 4),
        "hits": sum(hits),
        "count": len(hits),
        "interval95": [round(float(interval.low), 4), round(float(interval.high), 4)],
    }


def _sizes(row: Row) -> Iterator[tuple[float, bool | None]]:
    """Relative error of each size of an effect that is claimed, and whether its interval holds."""
    if row["verdict"] not in CLAIMING:
        return
    for size in row["sizes"].values():
        away = abs(size["truth"] - size["neutral"])
        ends = size["interval95"]
        inside = None if ends is None else ends[0] <= size["truth"] <= ends[1]
        if away > 0.0:
            yield abs(size["value"] - size["truth"]) / away, inside


def _f1(found: Sequence[tuple[int, int, int]]) -> dict[str, Any]:
    """F1, and the counts it is made of."""
    right, false, missed = (sum(row[k] for row in found) for k in range(3))
    whole = 2 * right + false + missed
    return {
        "value": round(2 * right / whole, 4) if whole else None,
        "true_positives": right,
        "false_positives": false,
        "false_negatives": missed,
    }


def _rate(found: Sequence[tuple[int, int, int]]) -> dict[str, Any]:
    right, false = (sum(row[k] for row in found) for k in range(2))
    return plain_share([True] * false + [False] * right)


def _median(values: Any) -> dict[str, Any]:
    found = np.array(list(values), dtype=float)
    if not found.size:
        return {"count": 0}
    return {
        "median": round(float(np.median(found)), 4),
        "p90": round(float(np.quantile(found, 0.9)), 4),
        "count": int(found.size),
    }
