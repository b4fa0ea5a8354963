"""Matiskova 2021, Tables 1 and 2: does their own arithmetic hold?"""

from __future__ import annotations

from statistics import median

from pamsim.papers.claim import Recomputed, half_unit, recomputes
from pamsim.store.printed import Printed, mas20_models, mas20_steps, printed_table

_FIGURES = ("p1_kpa", "p2_kpa", "p_svd_kpa", "load_kg", "beta_increment", "beta_deg")
# The tables print 183.3 and 253 beside each other: counts are meant to one decimal in Table 1.
_COUNT_HALF_UNIT = {"1": half_unit(1), "2": half_unit(2)}


def _rows() -> list[dict[str, str]]:
    return printed_table("matiskova2021_steps.csv")


def _increment_deg() -> float:
    return 360.0 / float(mas20_models()["encoder"]["increments_per_revolution"])


def _excess(row: dict[str, str]) -> float:
    """Size of the counted angle minus size of the printed degrees [deg]."""
    return abs(float(row["beta_increment"])) * _increment_deg() - abs(float(row["beta_deg"]))


@recomputes("matiskova2021-01")
def _difference() -> Recomputed:
    rows = _rows()
    off = [float(r["p1_kpa"]) - float(r["p2_kpa"]) - float(r["p_svd_kpa"]) for r in rows]
    return Recomputed(max(map(abs, off)), rows=len(rows))


@recomputes("matiskova2021-02")
def _increment() -> Recomputed:
    ratios = [abs(float(r["beta_deg"]) / float(r["beta_increment"])) for r in _rows()]
    printed = float(mas20_models()["encoder"]["increments_per_revolution"])
    spread = (max(ratios) - min(ratios)) / median(ratios)
    # The shortest angle, 6.94 deg, is printed to 0.07 %: a ratio is no better than that.
    tolerance = printed * half_unit(2) / min(abs(float(r["beta_deg"])) for r in _rows())
    return Recomputed(
        360.0 / median(ratios), tolerance=tolerance, median=median(ratios), spread=100.0 * spread
    )


@recomputes("matiskova2021-03")
def _degrees_rounded() -> Recomputed:
    rows = [row for row in _rows() if row["table"] == "1"]
    worst = max(rows, key=lambda row: abs(_excess(row)))
    tolerance = half_unit(2) + _COUNT_HALF_UNIT["1"] * _increment_deg()
    return Recomputed(abs(_excess(worst)), tolerance=tolerance, rows=len(rows), worst=worst["row"])


@recomputes("matiskova2021-04")
def _degrees_cut() -> Recomputed:
    rows = [row for row in _rows() if row["table"] == "2"]
    excess = [_excess(row) for row in rows]
    slack = _COUNT_HALF_UNIT["2"] * _increment_deg()
    rounded = sum(abs(value) <= half_unit(2) + slack for value in excess)
    cut = sum(-slack <= value < 2.0 * half_unit(2) + slack for value in excess)
    worst = max(excess, key=abs)
    return Recomputed(
        worst,
        holds=cut == len(rows),
        tolerance=2.0 * half_unit(2) + slack,
        cut=cut,
        rows=len(rows),
        rounded=rounded,
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
    count, angle = float(row["beta_increment"]), float(row["beta_deg"])
    same = count * angle > 0.0
    return Recomputed(angle / _increment_deg(), holds=same)


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
