"""Scores of the blind study: every share with its count and exact 95 % interval.

Terms, none of which depends on a threshold of the study:

- name: the physical cause, which is the family of an effect, such as joint friction; its kind, such
  as Coulomb friction, is a detail that is scored by itself where the library has the formula.
- claim: the name of an effect in a verdict ``named`` or ``named_with_remainder``, or of one that
  all tied models share (``certain``). No confident name: no claim.
- right name: a family of an effect that was hidden (``families`` of the ground truth) of which the
  diagnosis could try an effect.
- wrong confident name: something is claimed that is neither right nor similar to what was hidden
  (``resembles`` of the ground truth), and nothing right is claimed beside it. With nothing hidden,
  or with the true family removed from the library, every claim is wrong, unless it is similar.
- spurious extra effect: such a name beside a right one; over all claims where something was hidden.
- right effect or family: a claim, or else what the diagnosis says that the gap resembles, is of a
  right name. Of a pair, for both.
- unique correct name, for the library's formulas the harder way: every hidden effect is claimed by
  its own kind (``stands_for`` of the ground truth), and nothing else, in a verdict that claims.
  Separable: all cases but those in which the verdict is ``ambiguous`` and the right kind is among
  the tied; with these counted as misses the share stands below the table.
- pairs: each of the two effects has a right name among those claimed or tied. Both claimed and
  nothing else, which is harder, stands below the table.
- size: in physical terms, by one quantity per family that was chosen before any run. Friction by
  the torque in sliding, since every law of friction has one, while one that is smooth in speed has
  no breakaway; hysteresis by the half-width of the loop, from which its energy follows but for the
  shape. An ambiguous verdict that is certain of the right family counts by the size that it states
  for the family. A case without a right name or family, or whose diagnosis states no such quantity,
  is a miss. If several right names share a torque or a width, theirs is the sum.
- intervals: of an effect by another formula that of this quantity, or else of the first physical
  quantity of its family, since a formula's parameter is not the same number in another; of an
  effect by the library's formula those of its parameters.
- limits of absent effects: of those that were hidden but are not claimed. The limit holds if it is
  no smaller than what was hidden; ``cannot_tell`` counts as holding.
- E: mean square misfit of the refitted model over the noise variance, minus 1, on held-out data; of
  a diagnosis without a noise floor, that of the case before any refit (blind_study_cases.py).

With that, as usual in fault diagnosis:

- localisation F1 = 2 TP / (2 TP + FP + FN) over all claims and all hidden effects that have a right
  name;
- false discovery rate = FP / (FP + TP);
- isolation = of the cases in which something was detected, those with exactly the right names;
- coverage = of all cases with a right name, those in which it is claimed or an alternative.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import binomtest

from pamsim.effects.catalog import EFFECTS, TRIAL_EFFECTS

Row = Mapping[str, Any]
Case = tuple[Mapping[str, Any], Row]

CLAIMING = ("named", "named_with_remainder")
SILENT = ("no_gap", "refused")
"""Verdicts that detect nothing; data that the diagnosis takes for an error are refused."""

WITH_NAME = ("library", "other_formula", "pair")
"""Tiers in which the library holds a right name for every hidden effect."""

LEADING = {"joint_friction": "sliding_torque", "muscle_hysteresis": "loop_half_width"}
"""Family -> quantity by which its size is scored."""

SIZE_ERROR = 0.15


@dataclass(frozen=True, kw_only=True)
class Bar:
    """What a quantity of the study must reach.

    Attributes:
        quantity: in words.
        low: least share, or number, that is enough.
        high: largest that is enough.
        aim: what is aimed at; None for nothing beyond the bar.
        count: fewest cases that the share must be counted from.
        unit: ``%`` for a share, which is stated as a number from 0 to 1.
    """

    quantity: str
    low: float = -math.inf
    high: float = math.inf
    aim: float | None = None
    count: int = 1
    unit: str = "%"

    def judged(self, found: Mapping[str, Any]) -> dict[str, Any]:
        """A share or median with this bar, and whether it meets it."""
        value = found.get("share", found.get("median"))
        inside = value is not None and self.low <= value <= self.high
        ends = {"at_least": self.low, "at_most": self.high}
        bar = {name: end for name, end in ends.items() if math.isfinite(end)}
        met = inside and found["count"] >= self.count
        return {
            "quantity": self.quantity, **bar, "aim": self.aim, "of_at_least": self.count,
            "unit": self.unit, **found, "met": met,
        }  # fmt: skip


def plain(name: str) -> str:
    """Name of an effect without its form."""
    return name.partition(":")[0]


def claims(row: Row) -> set[str]:
    """Effects that a diagnosis claims."""
    names = row["claimed"] if row["verdict"] in CLAIMING else row["certain"]
    return {plain(name) for name in names}


def suggested(row: Row) -> set[str]:
    """Effects that it claims or gives as alternatives."""
    if row["verdict"] in ("unexplained", "not_identifiable", *SILENT):
        return claims(row)
    return claims(row) | {plain(name) for name in row["suggested"]}


def family_of(names: Iterable[str]) -> set[str]:
    """Families of effects."""
    return {EFFECTS[name].family for name in names if name in EFFECTS}


def right_families(case: Mapping[str, Any], row: Row) -> list[set[str]]:
    """Right names of each hidden effect, of those with one that the diagnosis tried."""
    tried = family_of(set(TRIAL_EFFECTS) - set(case["removed"]))
    sets = [set(hidden["families"]) & tried for hidden in row["hidden"]]
    return [families for families in sets if families]


def counts(case: Mapping[str, Any], row: Row) -> tuple[int, int, int]:
    """True positives, false positives and false negatives of a case."""
    found, wanted = family_of(claims(row)), right_families(case, row)
    right = set[str]().union(*wanted)
    similar = family_of(name for hidden in row["hidden"] for name in hidden["resembles"])
    hit = sum(bool(families & found) for families in wanted)
    return hit, len(found - right - similar), len(wanted) - hit


def kinds(case: Mapping[str, Any], row: Row) -> list[set[str]]:
    """Right kinds of each hidden effect, of those with one that the diagnosis tried."""
    sets = [set(hidden["stands_for"]) - set(case["removed"]) for hidden in row["hidden"]]
    return [names for names in sets if names & set(TRIAL_EFFECTS)]


def wrong(case: Mapping[str, Any], row: Row) -> bool:
    """Whether a wrong name is claimed, and no right one."""
    hit, false, _ = counts(case, row)
    return false > 0 and hit == 0


def exact(case: Mapping[str, Any], row: Row) -> bool:
    """Whether every hidden effect is claimed by a right name, and nothing else is claimed."""
    hit, _, missed = counts(case, row)
    right = set[str]().union(*right_families(case, row))
    return hit > 0 and missed == 0 and family_of(claims(row)) <= right


def unique(case: Mapping[str, Any], row: Row) -> bool:
    """Whether the verdict claims exactly the hidden effects."""
    return row["verdict"] in CLAIMING and exact(case, row)


def unique_kind(case: Mapping[str, Any], row: Row) -> bool:
    """Whether the verdict claims exactly the hidden effects, each by a right kind."""
    wanted = kinds(case, row)
    right = set[str]().union(*wanted)
    all_there = bool(wanted) and all(names & claims(row) for names in wanted)
    return row["verdict"] in CLAIMING and all_there and claims(row) <= right


def tied(case: Mapping[str, Any], row: Row) -> bool:
    """Whether right kinds are among several that an ambiguous verdict leaves."""
    left = all(names & suggested(row) for names in kinds(case, row))
    return row["verdict"] == "ambiguous" and left


def covered(case: Mapping[str, Any], row: Row) -> bool:
    """Whether every hidden effect has a right name among those suggested."""
    found = family_of(suggested(row))
    return all(families & found for families in right_families(case, row))


def near(case: Mapping[str, Any], row: Row) -> bool:
    """Whether every hidden effect's family is claimed, or else what the gap resembles."""
    nearest = {plain(name) for name in (row["nearest"] or "").split("+")}
    found = family_of(claims(row) or nearest)
    return all(families & found for families in right_families(case, row))


def leading(hidden: Mapping[str, Any]) -> str | None:
    """Quantity by which the size of a hidden effect is scored; None if its family has none."""
    (quantity,) = {LEADING.get(family) for family in hidden["families"]} or {None}
    return quantity if quantity in hidden["physical"] else None


def compared_quantity(hidden: Mapping[str, Any]) -> str | None:
    """Quantity by which the interval of an effect is scored; None if none was tested."""
    return leading(hidden) or next(iter(hidden["physical"]), None)


def physical_size(row: Row, hidden: Mapping[str, Any]) -> tuple[float, Any, float] | None:
    """Size found by the quantity to compare, its interval or None, and the size hidden."""
    quantity = compared_quantity(hidden)
    if quantity is None:
        return None
    truth = hidden["physical"][quantity]["value"]
    if row["verdict"] == "ambiguous":
        of_right = set(hidden["families"]) & set(row.get("families", {}))
        sizes = [row["families"][family].get(quantity) for family in of_right]
        found = [size for size in sizes if size is not None]
        return (found[0]["value"], found[0]["interval95"], truth) if found else None
    found = [
        effect["quantities"][quantity]
        for effect in row["physical"]
        if quantity in effect["quantities"]
        and family_of(map(plain, effect["names"])) & set(hidden["families"])
    ]
    if not found or row["verdict"] not in CLAIMING:
        return None
    interval = found[0]["interval95"] if len(found) == 1 else None
    return sum(one["value"] for one in found), interval, truth


def sized_right(case: Mapping[str, Any], row: Row) -> bool:
    """Whether a single hidden effect is claimed by a right name or family with the right size."""
    (hidden,) = row["hidden"]
    found = physical_size(row, hidden)
    if (counts(case, row)[0] == 0 and row["verdict"] in CLAIMING) or found is None:
        return False
    value, _, truth = found
    return abs(value - truth) <= SIZE_ERROR * abs(truth)


def excess(case: Mapping[str, Any], row: Row) -> float:
    """E, see above."""
    before = row["gap"]["before"]
    return sum(case["excess"].values()) if before is None else before**2 - 1.0


def must_show(cases: Sequence[Case], repeats: int) -> list[dict[str, Any]]:
    """The quantities that have a bar, each with its share, count, interval and bar.

    Args:
        cases: cases and their rows.
        repeats: of each recording; 1 for a single log.
    """

    def of(*tiers: str, low: float = -math.inf) -> list[Case]:
        return [(c, r) for c, r in cases if c["tier"] in tiers and excess(c, r) >= low]

    other = of("other_formula", low=0.5)
    pairs = [(c, r) for c, r in of("pair") if any(map(_other_formula, r["hidden"]))]
    rows = [
        Bar(quantity="claim on data without effect", high=0.02, aim=0.0, count=60).judged(
            share(of("nothing"), lambda _, r: bool(claims(r)))
        ),
        Bar(quantity="wrong confident name, all tiers", high=0.02, aim=0.01, count=200).judged(
            share(cases, wrong)
        ),
        Bar(
            quantity="library's formula, E >= 0.5: unique correct name, separable",
            low=0.95,
            aim=0.98,
        ).judged(share([x for x in of("library", low=0.5) if not tied(*x)], unique_kind)),
        Bar(
            quantity="another formula, E >= 0.5: right effect or family",
            low=0.90,
            aim=0.97,
            count=80,
        ).judged(share(other, near)),
        Bar(
            quantity="friction and hysteresis of another formula, E >= 0.5:"
            " named with size within 15 %",
            low=0.85,
            aim=0.95,
            count=40,
        ).judged(share([(c, r) for c, r in other if leading(r["hidden"][0])], sized_right)),
        Bar(quantity="outside the library: no confident name", low=0.95, aim=0.98, count=30).judged(
            share(of("outside"), lambda _, r: not claims(r))
        ),
        Bar(
            quantity="true effect removed from the library: no confident name", low=0.95, count=30
        ).judged(share(of("removed"), lambda _, r: not claims(r))),
        Bar(quantity="pairs, at least one of another formula", low=0.70, aim=0.85, count=24).judged(
            share(pairs, covered)
        ),
        Bar(quantity="spurious extra effect", high=0.03, aim=0.01).judged(
            plain_share([one for c, r in cases for one in _extra(c, r)])
        ),
        Bar(quantity="intervals that contain the hidden value", low=0.92, high=0.98).judged(
            plain_share([one for c, r in cases for one in _intervals(c, r)])
        ),
        Bar(quantity="limits of absent effects that are above the hidden value", low=0.98).judged(
            plain_share([_holds(entry) for _, r in cases for entry in _limits(r)])
        ),
        Bar(quantity="median seconds per diagnosis", high=30.0, aim=15.0, unit="s").judged(
            median(r["seconds"] for _, r in cases)
        ),
    ]
    if repeats < 3:
        data = "one log without repeats" if repeats == 1 else "2 repeats only"
        rows.append(
            Bar(quantity=f"{data}: right family", low=0.80, aim=0.90).judged(
                share(of("library", "other_formula", low=0.5), near)
            )
        )
    return rows


def scores(cases: Sequence[Case]) -> dict[str, Any]:
    """What has no bar.

    Args:
        cases: cases and their rows.
    """

    def of(*tiers: str, low: float = -math.inf) -> list[Case]:
        return [(c, r) for c, r in cases if c["tier"] in tiers and excess(c, r) >= low]

    named = of(*WITH_NAME)
    detected = [(c, r) for c, r in named if r["verdict"] not in SILENT]
    sizes = [size for _, r in cases for size in _sizes(r)]
    return {
        "data sets": len(cases),
        "localisation F1": _f1([counts(c, r) for c, r in cases]),
        "false discovery rate": _rate([counts(c, r) for c, r in cases]),
        "detection": share(named, lambda _, r: r["verdict"] not in SILENT),
        "isolation": share(detected, exact),
        "coverage": share(named, covered),
        "nothing hidden: effect claimed or suggested": share(
            of("nothing"), lambda _, r: bool(suggested(r))
        ),
        "nothing hidden: verdict no_gap": share(
            of("nothing"), lambda _, r: r["verdict"] == "no_gap"
        ),
        "library's formula, E >= 0.5: unique correct name, tied counted as misses": share(
            of("library", low=0.5), unique_kind
        ),
        "another formula, E >= 0.5: right kind, of those named by the right family": share(
            [
                (c, r)
                for c, r in of("other_formula", low=0.5)
                if r["verdict"] in CLAIMING and counts(c, r)[0] and kinds(c, r)
            ],
            unique_kind,
        ),
        "pairs: exactly the hidden effects claimed": share(of("pair"), unique),
        **{
            f"{tier}: {what}": share(of(tier, low=low), hit)
            for tier in WITH_NAME
            for what, low, hit in (
                ("exactly the hidden effects claimed", -math.inf, exact),
                ("right name claimed or an alternative, E >= 0.5", 0.5, covered),
                ("wrong confident name", -math.inf, wrong),
            )
        },
        "friction and hysteresis of another formula, any E: named with size within 15 %": share(
            [(c, r) for c, r in of("other_formula") if leading(r["hidden"][0])], sized_right
        ),
        "outside, E >= 0.1: unexplained": share(
            of("outside", low=0.1), lambda _, r: r["verdict"] == "unexplained"
        ),
        "resembles: no name, or a similar one": share(
            of("resembles"), lambda c, r: counts(c, r)[1] == 0
        ),
        "parameters within 15 %": plain_share([error <= SIZE_ERROR for error in sizes]),
        "error of the parameters": median(sizes),
        "intervals that contain the hidden value, library's formula": plain_share(
            [one for c, r in of("library") for one in _intervals(c, r)]
        ),
        "limits of absent effects that are stated": plain_share(
            [entry["limit"] is not None for _, r in cases for entry in _limits(r)]
        ),
    }


def printed(rows: Sequence[Mapping[str, Any]]) -> str:
    """The quantities that have a bar as lines of text: found, count, interval, bar."""
    lines: list[str] = []
    for row in rows:
        factor = 100.0 if row["unit"] == "%" else 1.0
        bar = [f"{sign} {factor * row[name]:g}" for name, sign in _SIGNS.items() if name in row]
        value = row.get("share", row.get("median"))
        found = "no data" if value is None else f"{factor * value:.1f} {row['unit']}"
        if "hits" in row:
            low, high = row["interval95"]
            found += f" ({row['hits']} of {row['count']}, {100 * low:.1f} to {100 * high:.1f} %)"
        few = "" if row["count"] >= row["of_at_least"] else f" of >= {row['of_at_least']}"
        verdict = "met" if row["met"] else "NOT MET"
        need = f"{' and '.join(bar)} {row['unit']}{few}"
        lines.append(f"{verdict:8}{row['quantity']}: {found}; must be {need}")
    return "\n".join(lines)


_SIGNS = {"at_least": ">=", "at_most": "<="}


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


def _other_formula(hidden: Mapping[str, Any]) -> bool:
    return hidden["formulation"] != "library"


def _extra(case: Mapping[str, Any], row: Row) -> list[bool]:
    """Of each claim where something was hidden, whether it is wrong beside a right one."""
    hit, false, _ = counts(case, row)
    extra = false if hit else 0
    return [k < extra for k in range(len(claims(row)))] if row["hidden"] else []


def _limits(row: Row) -> list[Mapping[str, Any]]:
    """Limits of the effects that were hidden; others may share a parameter with one of these."""
    hidden = {name for effect in row["hidden"] for name in effect["stands_for"]}
    return [entry for name, entry in row["limits"].items() if name in hidden]


def _holds(entry: Mapping[str, Any]) -> bool:
    return entry["limit"] is None or entry["limit"] >= entry["truth"]


def _intervals(case: Mapping[str, Any], row: Row) -> Iterator[bool]:
    """Whether each interval of what is claimed by a right name or family holds what was hidden."""
    for hidden in row["hidden"]:
        tried = family_of(set(TRIAL_EFFECTS) - set(case["removed"]))
        right = set(hidden["families"]) & tried
        if row["verdict"] in CLAIMING and not right & family_of(claims(row)):
            continue
        if _other_formula(hidden) or row["verdict"] == "ambiguous":
            found = physical_size(row, hidden)
            pairs = [] if found is None else [found[1:]]
        elif row["verdict"] not in CLAIMING:
            continue
        else:
            own = [one for one in row["sizes"].values() if one["hidden"] == hidden["name"]]
            pairs = [(one["interval95"], one["truth"]) for one in own]
        yield from (ends[0] <= truth <= ends[1] for ends, truth in pairs if ends is not None)


def _sizes(row: Row) -> Iterator[float]:
    """Relative error of each parameter of an effect that is claimed, from neutral."""
    if row["verdict"] not in CLAIMING:
        return
    for size in row["sizes"].values():
        away = abs(size["truth"] - size["neutral"])
        if away > 0.0:
            yield abs(size["value"] - size["truth"]) / away


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


def median(values: Any) -> dict[str, Any]:
    """Median of numbers, their 90 % quantile, and how many they are."""
    found = np.array(list(values), dtype=float)
    if not found.size:
        return {"count": 0}
    return {
        "median": round(float(np.median(found)), 4),
        "p90": round(float(np.quantile(found, 0.9)), 4),
        "count": int(found.size),
    }
