"""Scores of the blind study: every share with its count and exact 95 % interval."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from blind_study_conditions import Condition
from scipy.stats import binomtest

from pamsim.effects.catalog import EFFECTS

Row = dict[str, Any]
Case = tuple[Condition, Row]

NAMED, LIKE = "named", "named_with_remainder"
SEPARABLE = 0.95


def share(cases: Sequence[Case], hit: Callable[[Condition, Row], bool]) -> dict[str, Any]:
    """Share of cases that hit, its exact (Clopper-Pearson) 95 % interval, and which do not."""
    hits = [hit(*case) for case in cases]
    if not hits:
        return {"count": 0}
    return {
        **_plain(hits),
        "others": [c.name for (c, _), h in zip(cases, hits, strict=True) if not h][:40]
        if sum(hits) > len(hits) / 2
        else [c.name for (c, _), h in zip(cases, hits, strict=True) if h][:40],
    }


def member(row: Row) -> bool:
    """Whether an effect is claimed, and not only as a resemblance."""
    return row["verdict"] == NAMED


def claims(row: Row) -> bool:
    """Whether an effect is claimed, be it only as a resemblance."""
    return row["verdict"] in (NAMED, LIKE)


def suggested(row: Row) -> set[str]:
    """All names in the verdict: claimed, resembled, or among the alternatives."""
    if not (claims(row) or row["verdict"] == "ambiguous"):
        return set()
    return {*row["named"], *(name for model in row["tied"] for name in model)}


def truths(one: Condition) -> set[str]:
    """Names of what is hidden."""
    return {name for name, _ in one.effects}


def families(names: set[str]) -> set[str]:
    """Families of effects."""
    return {EFFECTS[name].family for name in names if name in EFFECTS}


def scores(cases: Sequence[Case]) -> dict[str, Any]:
    """All quantities of the study.

    Args:
        cases: conditions and their rows.
    """

    def of(*kinds: str, low: float = -np.inf, high: float = np.inf) -> list[Case]:
        return [(c, r) for c, r in cases if c.kind in kinds and low <= r["excess"] < high]

    def right_names(c: Condition, r: Row) -> bool:
        return claims(r) and set(r["named"]) == truths(c)

    def unique(c: Condition, r: Row) -> bool:
        return member(r) and right_names(c, r)

    singles = of("single")
    right = [(c, r) for c, r in singles if right_names(c, r)]
    separable = [
        (c, r)
        for c, r in of("single", low=0.5)
        if all(r["likest"].get(n, 0.0) < SEPARABLE for n in truths(c))
    ]
    errors = [e for _, r in right for e in _errors(r)[:1]]
    covered = [inside for _, r in right for inside in _covered(r)]
    return {
        "none: effect claimed or suggested": share(of("none"), lambda c, r: bool(suggested(r))),
        "none: verdict no_gap": share(of("none"), lambda c, r: r["verdict"] == "no_gap"),
        "single: wrong confident name": share(
            singles, lambda c, r: claims(r) and not truths(c) & set(r["named"])
        ),
        "single, E >= 0.5: named or in the set": share(
            of("single", low=0.5), lambda c, r: truths(c) <= suggested(r)
        ),
        "single, E >= 0.5, separable: unique correct name": share(separable, unique),
        "single, E >= 0.5: right effect, but only as a resemblance": share(
            of("single", low=0.5), lambda c, r: right_names(c, r) and not member(r)
        ),
        "single, 0.1 <= E < 0.5: detected": share(
            of("single", low=0.1, high=0.5), lambda c, r: r["verdict"] != "no_gap"
        ),
        "single: spurious second effect": share(
            singles,
            lambda c, r: claims(r) and len(r["named"]) > 1 and bool(truths(c) & set(r["named"])),
        ),
        "pair: both named or in the set": share(of("pair"), lambda c, r: truths(c) <= suggested(r)),
        "pair: wrong confident name": share(
            of("pair"), lambda c, r: claims(r) and not truths(c) & set(r["named"])
        ),
        "outside, E >= 0.1: unexplained": share(
            of("outside", low=0.1), lambda c, r: r["verdict"] == "unexplained"
        ),
        "outside, in span: no member claimed": share(
            of("in_span", low=0.1), lambda c, r: not member(r)
        ),
        "true effect removed from the library, E >= 0.5: no other name claimed": share(
            of("removed", low=0.5), lambda c, r: not member(r)
        ),
        "intervals that contain the hidden value": _plain(covered),
        "region among the two top cells, E >= 0.5": share(of("single", low=0.5), _region),
        "named: held-out RMS after the repair <= 1.05 floor": share(
            right, lambda c, r: r["rms_after"] <= 1.05
        ),
        "named: median held-out RMS after the repair": _median(r["rms_after"] for _, r in right),
        "named: median error of the main parameter": _median(errors),
        "different formulation: right family": share(
            of("different", low=0.1),
            lambda c, r: bool(families(truths(c)) & families(suggested(r))),
        ),
        "different formulation: wrong family claimed": share(
            of("different", low=0.1),
            lambda c, r: claims(r) and not families(truths(c)) & families(set(r["named"])),
        ),
        "resembles what is named: true cause of that family": share(
            [
                (c, r)
                for c, r in of("single", "pair", "different", "removed")
                if r["verdict"] == LIKE
            ],
            lambda c, r: bool(families(truths(c)) & families(set(r["named"]))),
        ),
        "seconds on one of two busy cores, median": _median(r["seconds"] for _, r in cases),
        "data sets": len(cases),
    }


def _region(c: Condition, r: Row) -> bool:
    """Whether the cell where the hidden effect appears most is among the first two of the map.

    The two muscles, and the two settings of a protocol, count as one.
    """
    if not r.get("true_cells"):
        return False
    found = {(_kind(channel), _protocol(protocol)) for channel, protocol, _ in r["cells"][:2]}
    channel, protocol, _ = r["true_cells"][0]
    return (_kind(channel), _protocol(protocol)) in found


def _kind(channel: str) -> str:
    return channel.split("_")[0]


def _protocol(name: str) -> str:
    return name.removesuffix("_check")


def _errors(r: Row) -> list[float]:
    """Error of each parameter, relative to the hidden value's distance from neutral."""
    return [
        abs(p["value"] - p["truth"]) / abs(p["truth"] - p["neutral"])
        for p in r["parameters"].values()
        if p["truth"] is not None and p["neutral"] is not None and p["truth"] != p["neutral"]
    ]


def _covered(r: Row) -> list[bool]:
    return [
        p["interval95"][0] <= p["truth"] <= p["interval95"][1]
        for p in r["parameters"].values()
        if p["truth"] is not None
    ]


def _plain(hits: Sequence[bool]) -> dict[str, Any]:
    if not hits:
        return {"count": 0}
    interval = binomtest(sum(hits), len(hits)).proportion_ci(method="exact")
    return {
        "share": round(sum(hits) / len(hits), 4),
        "hits": sum(hits),
        "count": len(hits),
        "interval95": [round(float(interval.low), 4), round(float(interval.high), 4)],
    }


def _median(values: Any) -> dict[str, Any]:
    found = np.array(list(values), dtype=float)
    if not found.size:
        return {"count": 0}
    return {
        "median": round(float(np.median(found)), 4),
        "p90": round(float(np.quantile(found, 0.9)), 4),
        "count": int(found.size),
    }
