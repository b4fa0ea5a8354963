"""Scores of the study of the diagnosis by link: shares with their counts and exact 95 % intervals.

- Certain: what a diagnosis calls certain of an effect, down to its `level` (place, family, name,
  form). Of effects whose place is not certain nothing is claimed.
- Right place: the link of the chain in which a hidden effect acts. Right family: one of
  ``families`` of the ground truth that the diagnosis could try. Right name: one of ``stands_for``.
- Wrong: a certain level that is right for no hidden effect, and similar to none (``resembles``). A
  form is not judged by itself: by another formula none is right, by the library's there is one.
- Both certain: each hidden effect has a right family that is certain.
- Unique name: one effect is certain to its name, which is right, and no other is certain.
- Place of what is outside the library: an effect that is certain to its place alone or deeper, at
  the right place; or else a remainder that is certain, in a link that holds this place.
- Size: parameters of effects of a right name, for which the ground truth states a value; the error
  is a share of the distance between this and the value without effect. A size is certain if its
  interval does not hold the value without effect. The stated value is that of the usual form. Forms
  whose parameter of the same name means another quantity are left out (`OTHER_MEANING`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import records

from pamsim.effects.catalog import EFFECTS, TRIAL_EFFECTS

Row = Mapping[str, Any]

DEEP = ("place", "family", "name", "form")

OUTSIDE = {"soft_stop": "joint", "detent": "joint", "slow_clock": "sensor"}
"""Where effects act that are in no family of the library."""

PARTS = {
    "valves and air": ("command", "supply", "air", "sensor"),
    "muscle": ("muscle", "sensor"),
    "joint and transmission": ("joint", "transmission", "sensor"),
    "muscle and joint": ("muscle", "joint", "transmission", "sensor"),
}
"""Link of the diagnosis -> links of the chain that it holds."""

OTHER_MEANING = {
    "threshold_pressure:gradual",  # what is lost in the end, not at 3 bar
    "chain_compliance:hardening",  # without tension, not at 700 N
    "pressure_scale:bent",  # at no pressure, not at 3 bar
    "passive_stiffness:hardening",  # of a further spring
}
"""Forms whose size is not the quantity that the ground truth states."""

SIZE_ERROR = 0.15

_SIGNS = {"at_least": ">=", "at_most": "<="}


@dataclass(frozen=True)
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


def family_of(names: Iterable[str]) -> set[str]:
    """Families of effects."""
    return {EFFECTS[name].family for name in names if name in EFFECTS}


def certain(effect: Mapping[str, Any], level: str) -> bool:
    """Whether a level of an effect's name is certain."""
    return effect["level"] in DEEP[DEEP.index(level) :]


def right_families(row: Row) -> list[set[str]]:
    """Right families of each hidden effect that the diagnosis tried; an empty set for none."""
    tried = family_of(set(TRIAL_EFFECTS) - set(row["removed"]))
    return [set(one["families"]) & tried for one in row["hidden"]]


def places(row: Row) -> set[str]:
    """Links of the chain in which the hidden effects act."""
    found = {OUTSIDE[one["name"]] for one in row["hidden"] if one["name"] in OUTSIDE}
    families = set[str]().union(*(one["families"] for one in row["hidden"]))
    return found | {effect.link for effect in EFFECTS.values() if effect.family in families}


def wrong(row: Row) -> bool:
    """Whether a level that is called certain is wrong."""
    similar = {name for one in row["hidden"] for name in one["resembles"]}
    names = {name for one in row["hidden"] for name in one["stands_for"]} | similar
    families = set[str]().union(*right_families(row)) | family_of(similar)
    where = places(row) | {EFFECTS[name].link for name in similar}
    return any(
        (certain(one, "place") and one["place"] not in where)
        or (certain(one, "family") and one["family"] not in families)
        or (certain(one, "name") and plain(one["label"]) not in names)
        for one in row["effects"]
    )


def found_families(row: Row) -> int:
    """Hidden effects of which a right family is certain."""
    sure = {one["family"] for one in row["effects"] if certain(one, "family")}
    return sum(bool(families & sure) for families in right_families(row))


def all_found(row: Row) -> bool:
    """Whether a right family of every hidden effect is certain."""
    return found_families(row) == len(row["hidden"])


def unique(row: Row) -> bool:
    """Whether the name of the one hidden effect is certain, and nothing else."""
    claimed = [one for one in row["effects"] if certain(one, "place")]
    (hidden,) = row["hidden"]
    return (
        len(claimed) == 1
        and certain(claimed[0], "name")
        and plain(claimed[0]["label"]) in hidden["stands_for"]
    )


def placed(row: Row) -> bool:
    """Whether the place of what is outside the library is certain and right."""
    where, claimed = places(row), [one for one in row["effects"] if certain(one, "place")]
    if claimed:
        return all(one["place"] in where for one in claimed)
    left = [name for name, one in row["links"].items() if one["more_left"]]
    return bool(left) and all(where & set(PARTS[name]) for name in left)


def sizes(row: Row) -> Iterator[tuple[bool, float, bool, bool]]:
    """Sizes under a certain name: if by the library's formula, error, if held, if certain."""
    formulations = {one["name"]: one["formulation"] for one in row["hidden"]}
    names = {name: set(one["stands_for"]) for one in row["hidden"] for name in [one["name"]]}
    for effect in row["effects"]:
        if not certain(effect, "name") or effect["label"] in OTHER_MEANING:
            continue
        for parameter, (truth, neutral, hidden) in row["truth"].items():
            size = row["sizes"].get(parameter)
            if size is None or plain(effect["label"]) not in names[hidden] or truth == neutral:
                continue
            if parameter not in effect["parameters"]:
                continue
            value, (low, high) = size
            own = formulations[hidden] == "library"
            error = abs(value - truth) / abs(truth - neutral)
            yield own, error, low <= truth <= high, not low <= neutral <= high


BARS = (
    Bar("claim where nothing is hidden", high=0.02, aim=0.0, count=60),
    Bar("wrong at the level that is called certain", high=0.02, aim=0.01),
    Bar("one effect, library's formula: unique name", low=0.95, aim=0.98),
    Bar("one effect, another formula: family certain", low=0.90, aim=0.95),
    Bar("two effects, different links: both certain at family level", low=0.85, aim=0.95),
    Bar("two effects, same link: both certain at family level", low=0.65, aim=0.8),
    Bar("three effects: two or more certain, none wrong", low=0.75, aim=0.9),
    Bar("outside the library: place certain and right", low=0.70, aim=0.90),
    Bar("outside the library: a wrong family certain", high=0.0),
    Bar("size within 15 % where the size is certain", low=0.90),
    Bar("intervals that hold what was hidden, library's formula", low=0.92, high=0.98),
    Bar("intervals that hold what was hidden, another formula", low=0.0),
    Bar("median seconds per diagnosis", high=25.0, aim=15.0, unit="s"),
)


def must_show(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """The quantities that have a bar, each with its share, count, interval and bar."""

    def of(hit: Callable[[Row], bool], *tiers: str) -> dict[str, Any]:
        return share([r for r in rows if r["tier"] in tiers or not tiers], hit)

    stated = [one for r in rows for one in sizes(r)]
    found = (
        of(lambda r: any(certain(one, "place") for one in r["effects"]), "nothing"),
        of(wrong),
        of(unique, "library"),
        of(all_found, "other_formula"),
        of(all_found, "two_links"),
        of(all_found, "one_link"),
        of(lambda r: found_families(r) >= 2 and not wrong(r), "three"),
        of(placed, "outside", "removed"),
        of(lambda r: any(certain(o, "family") for o in r["effects"]), "outside", "removed"),
        plain_share([error <= SIZE_ERROR for _, error, _, sure in stated if sure]),
        plain_share([held for library, _, held, _ in stated if library]),
        plain_share([held for library, _, held, _ in stated if not library]),
        median(r["seconds"] for r in rows if "seconds" in r),
    )
    return [bar.judged(one) for bar, one in zip(BARS, found, strict=True)]


FLOOR_ERROR = 0.2
"""Share of the noise that was added, by which an estimate may be off."""

ONE_LOG = (
    Bar(f"one log: noise within {100.0 * FLOOR_ERROR:g} % of what was added", low=0.90),
    Bar("one log, one effect: family certain", low=0.75),
)


def must_show_of_one_log(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """The quantities that have a bar for a single log, of rows with its noise."""
    ratios = [ratio for row in rows for ratio in row["floor"].values()]
    found = (
        plain_share([abs(ratio - 1.0) <= FLOOR_ERROR for ratio in ratios]),
        share([row for row in rows if len(row["hidden"]) == 1], all_found),
    )
    return [bar.judged(one) for bar, one in zip(ONE_LOG, found, strict=True)]


def pooled(records: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Records of several draws as one."""
    rows = [row for one in records for row in one["rows"]]
    return {"rows": rows, "must_show": must_show(rows)}


def table(records: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """The quantities of some studies beside each other, as the Markdown table of the documents.

    Args:
        records: heading of the column -> what a study has written.
    """
    columns = [{row["quantity"]: row for row in one["must_show"]} for one in records.values()]
    lines = ["| cases of an independent plant | bar | " + " | ".join(records) + " |"]
    lines.append("|---|---|" + "---|" * len(records))
    for quantity, row in columns[0].items():
        factor = 100.0 if row["unit"] == "%" else 1.0
        ends = [
            f"{sign} {factor * row[name]:g}"
            for name, sign in _SIGNS.items()
            if name in row and (name, row[name]) != ("at_least", 0.0)
        ]
        bar = f"{' and '.join(ends)} {row['unit']}" if ends else ""
        cells = [quantity, bar, *(_cell(own.get(quantity, {})) for own in columns)]
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def _cell(row: Mapping[str, Any]) -> str:
    if "hits" in row:
        low, high = (100.0 * end for end in row["interval95"])
        hits = f"{row['hits']} of {row['count']}"
        return f"{hits}: {100.0 * row['share']:.1f} [{low:.1f}, {high:.1f}] %"
    return f"{row['median']:.1f} {row['unit']}" if "median" in row else ""


def share(rows: Sequence[Row], hit: Callable[[Row], bool]) -> dict[str, Any]:
    """Share of rows that hit, its interval, and the fewer of those that do and do not."""
    hits = [hit(row) for row in rows]
    if not hits:
        return {"count": 0}
    few = sum(hits) <= len(hits) / 2
    names = [row["name"] for row, h in zip(rows, hits, strict=True) if h == few]
    return {**plain_share(hits), "others": names[:40]}


def plain_share(hits: Sequence[bool]) -> dict[str, Any]:
    """Share with its exact (Clopper-Pearson) 95 % interval."""
    if not hits:
        return {"count": 0}
    found = records.share(sum(hits), len(hits))
    ends = [round(float(end), 4) for end in found["interval95"]]
    return {**found, "share": round(found["share"], 4), "interval95": ends}


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
