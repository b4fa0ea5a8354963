"""Matiskova 2021, Tables 1 and 2: does their own arithmetic hold?"""

from __future__ import annotations

from statistics import median_high

from pamsim.papers.claim import Recomputed, recomputes
from pamsim.papers.numerics import half_unit, propagated
from pamsim.recordings.printed import Printed, mas20_models, mas20_steps, printed_table

_FIGURES = ("p1_kpa", "p2_kpa", "p_svd_kpa", "load_kg", "beta_increment", "beta_deg")
# The tables print 183.3 and 253 beside each other: counts are meant to one decimal in Table 1.
_COUNT_HALF_UNIT = {"1": half_unit(1), "2": half_unit(2)}


def _rows() -> list[dict[str, str]]:
    return printed_table("matiskova2021_steps.csv")


def _increment_deg() -> float:
    return 360.0 / float(mas20_models()["encoder"]["increments_per_revolution"])


def _counted_deg(row: dict[str, str]) -> Printed:
    """Size of the counted angle [deg]."""
    size = abs(float(row["beta_increment"]))
    return Printed(size * _increment_deg(), _COUNT_HALF_UNIT[row["table"]] * _increment_deg())


def _printed_deg(row: dict[str, str]) -> Printed:
    """Size of the printed angle [deg]."""
    return Printed.read(row["beta_deg"].lstrip("-"))


@recomputes("matiskova2021-01")
def _difference() -> Recomputed:
    rows = _rows()
    off = [float(r["p1_kpa"]) - float(r["p2_kpa"]) - float(r["p_svd_kpa"]) for r in rows]
    return Recomputed(max(map(abs, off)), rows=len(rows))


@recomputes("matiskova2021-02")
def _increment() -> Recomputed:
    rows = _rows()
    ratios = [abs(float(r["beta_deg"]) / float(r["beta_increment"])) for r in rows]
    middle = rows[ratios.index(median_high(ratios))]
    spread = (max(ratios) - min(ratios)) / median_high(ratios)
    count = Printed(abs(float(middle["beta_increment"])), _COUNT_HALF_UNIT[middle["table"]])
    result = propagated(lambda angle, n: 360.0 * n / angle, _printed_deg(middle), count)
    return Recomputed(result, median=median_high(ratios), spread=100.0 * spread)


@recomputes("matiskova2021-03", "1")
@recomputes("matiskova2021-04", "2")
def _degrees(table: str) -> Recomputed:
    rows = [row for row in _rows() if row["table"] == table]
    excess = [_counted_deg(row).value - _printed_deg(row).value for row in rows]
    slack = half_unit(2) + _COUNT_HALF_UNIT[table] * _increment_deg()
    cut = sum(-slack <= off - half_unit(2) <= slack for off in excess)
    return Recomputed(
        [_counted_deg(row) for row in rows],
        printed=[_printed_deg(row) for row in rows],
        rows=len(rows),
        worst=rows[excess.index(max(excess, key=abs))]["row"],
        excess=max(excess, key=abs),
        rounded=sum(abs(off) <= slack for off in excess),
        cut=cut,
    )


@recomputes("matiskova2021-05")
def _whole_counts() -> Recomputed:
    counts = [float(row["beta_increment"]) for row in _rows()]
    # Four-fold evaluation of both encoder tracks could give quarters, nothing finer.
    broken = [c for c in counts if abs(4.0 * c - round(4.0 * c)) > 4.0 * half_unit(2)]
    return Recomputed(
        float(len(counts) - len(broken)),
        broken=len(broken),
        counts=len(counts),
        examples=", ".join(f"{c:g}" for c in broken[:4]),
    )


@recomputes("matiskova2021-06")
def _row_4() -> Recomputed:
    row = next(row for row in _rows() if row["row"] == "4")
    return Recomputed(
        propagated(lambda angle: angle / _increment_deg(), Printed.read(row["beta_deg"]))
    )


@recomputes("matiskova2021-07")
def _repeats() -> Recomputed:
    rows = _rows()
    figures = [tuple(Printed.read(row[name]).value for name in _FIGURES) for row in rows]
    copies = [row["row"] for i, row in enumerate(rows) if figures[i] in figures[:i]]
    distinct = len(rows) - len(copies)
    return Recomputed(float(distinct), copies=", ".join(copies))


@recomputes("matiskova2021-08")
def _signs() -> Recomputed:
    steps = mas20_steps()
    right = sum(step.angle * (step.pressure[0] - step.pressure[1]) > 0.0 for step in steps)
    return Recomputed(float(right))
