"""Matiskova 2021, Tables 1 and 2: does their own arithmetic hold?"""

from __future__ import annotations

from statistics import median

from pamsim.core.units import DEG_PER_RAD
from pamsim.papers.claim import Claim, Verdict, compare, half_unit, holds
from pamsim.signals.instruments import IncrementalEncoder, encoder_step
from pamsim.store.printed import mas20_models, mas20_steps
from pamsim.store.printed_table import Printed, printed_table

_FIGURES = ("p1_kpa", "p2_kpa", "p_svd_kpa", "load_kg", "beta_increment", "beta_deg")
# The tables print 183.3 and 253 beside each other: counts are meant to one decimal in Table 1.
_COUNT_HALF_UNIT = {"1": half_unit(1), "2": half_unit(2)}


def claims() -> list[Claim]:
    """Claims A-01 to A-08."""
    return [
        _difference(),
        _increment(),
        _degrees_rounded(),
        _degrees_cut(),
        _whole_counts(),
        _row_4(),
        _repeats(),
        _signs(),
    ]


def _rows() -> list[dict[str, str]]:
    return printed_table("mas20_steps.csv")


def _increment_deg() -> float:
    count = float(mas20_models()["encoder"]["increments_per_revolution"])
    return encoder_step(IncrementalEncoder(increments=count)) * DEG_PER_RAD


def _excess(row: dict[str, str]) -> float:
    """Size of the counted angle minus size of the printed degrees [deg]."""
    return abs(float(row["beta_increment"])) * _increment_deg() - abs(float(row["beta_deg"]))


def _difference() -> Claim:
    rows = _rows()
    off = [float(r["p1_kpa"]) - float(r["p2_kpa"]) - float(r["p_svd_kpa"]) for r in rows]
    return compare(
        "A-01",
        "p_svd = p1 - p2 in every row of Tables 1 and 2; largest deviation (equation (19))",
        0.0,
        max(map(abs, off)),
        half_unit(0),
        unit="kPa",
        reason=f"p1 - p2 - p_svd over all {len(rows)} rows, from the printed whole kPa",
        otherwise=Verdict.INCONSISTENT,
    )


def _increment() -> Claim:
    ratios = [abs(float(r["beta_deg"]) / float(r["beta_increment"])) for r in _rows()]
    printed = float(mas20_models()["encoder"]["increments_per_revolution"])
    spread = (max(ratios) - min(ratios)) / median(ratios)
    # The shortest angle, 6.94 deg, is printed to 0.07 %: a ratio is no better than that.
    tolerance = printed * half_unit(2) / min(abs(float(r["beta_deg"])) for r in _rows())
    return compare(
        "A-02",
        "encoder with 2500 pulses per revolution: degrees per increment in the tables",
        printed,
        360.0 / median(ratios),
        tolerance,
        unit="1",
        reason=f"360 deg over the median of beta[deg]/beta[increment], {median(ratios):.5f} deg;"
        f" the ratios spread by {100.0 * spread:.2f} %; tolerance from half a unit of the smallest"
        " printed angle",
        otherwise=Verdict.INCONSISTENT,
    )


def _degrees_rounded() -> Claim:
    rows = [row for row in _rows() if row["table"] == "1"]
    worst = max(rows, key=lambda row: abs(_excess(row)))
    tolerance = half_unit(2) + _COUNT_HALF_UNIT["1"] * _increment_deg()
    return compare(
        "A-03",
        "Table 1: degrees are increments times 0.144 deg; largest deviation in size",
        0.0,
        abs(_excess(worst)),
        tolerance,
        unit="deg",
        reason=f"all {len(rows)} rows, worst row {worst['row']}; tolerance: half a unit of both"
        " printed numbers. Rows 7, 9 and 11 print 26.40, 26.39 and 26.39 deg for the same 183.3",
        otherwise=Verdict.INCONSISTENT,
    )


def _degrees_cut() -> Claim:
    rows = [row for row in _rows() if row["table"] == "2"]
    excess = [_excess(row) for row in rows]
    slack = _COUNT_HALF_UNIT["2"] * _increment_deg()
    rounded = sum(abs(value) <= half_unit(2) + slack for value in excess)
    cut = sum(-slack <= value < 2.0 * half_unit(2) + slack for value in excess)
    worst = max(excess, key=abs)
    return Claim(
        id="A-04",
        what="Table 2: degrees are increments times 0.144 deg; largest excess of the counted angle",
        printed=0.0,
        recomputed=worst,
        unit="deg",
        verdict=holds(cut == len(rows), Verdict.INCONSISTENT),
        reason=f"{cut} of {len(rows)} rows agree if the degrees were cut off after two digits,"
        f" {rounded} if they were rounded: Table 2 is cut, Table 1 is not. Tolerance: a whole unit"
        " of the last digit, upwards only",
        tolerance=2.0 * half_unit(2) + slack,
    )


def _whole_counts() -> Claim:
    counts = [float(row["beta_increment"]) for row in _rows()]
    # Four-fold evaluation of both encoder tracks could give quarters, nothing finer.
    broken = [c for c in counts if abs(4.0 * c - round(4.0 * c)) > 4.0 * half_unit(2)]
    return Claim(
        id="A-05",
        what="beta is counted by an incremental encoder: rows whose count an encoder can give",
        printed=float(len(counts)),
        recomputed=float(len(counts) - len(broken)),
        unit="1",
        verdict=holds(not broken, Verdict.NOT_REPRODUCIBLE),
        reason=f"{len(broken)} of {len(counts)} printed counts, such as"
        f" {', '.join(f'{c:g}' for c in broken[:4])}, are no quarter of an increment: they are"
        " means or were read off a plot, which the paper does not say",
        tolerance=0.0,
    )


def _row_4() -> Claim:
    row = next(row for row in _rows() if row["row"] == "4")
    count, angle = float(row["beta_increment"]), float(row["beta_deg"])
    same = count * angle > 0.0
    return Claim(
        id="A-06",
        what="Table 1, row 4: 252 increments belong to -36.29 deg",
        printed=count,
        recomputed=angle / _increment_deg(),
        unit="increments",
        verdict=holds(same, Verdict.INCONSISTENT),
        reason="the angle over 0.144 deg; all other rows give both columns one sign, so the count"
        " lost its minus in print",
        tolerance=_COUNT_HALF_UNIT["1"],
    )


def _repeats() -> Claim:
    rows = _rows()
    figures = [tuple(Printed.read(row[name]).value for name in _FIGURES) for row in rows]
    copies = [row["row"] for i, row in enumerate(rows) if figures[i] in figures[:i]]
    distinct = len(rows) - len(copies)

    return Claim(
        id="A-07",
        what="24 measured operating points",
        printed=float(len(rows)),
        recomputed=float(distinct),
        unit="1",
        verdict=holds(not copies, Verdict.INCONSISTENT),
        reason=f"rows {', '.join(copies)} repeat earlier rows in every figure, and repeated"
        " measurements do not agree in all digits of six columns",
        tolerance=0.0,
    )


def _signs() -> Claim:
    steps = mas20_steps()
    right = sum(step.angle * (step.pressure[0] - step.pressure[1]) > 0.0 for step in steps)
    return Claim(
        id="A-08",
        what="beta is positive where AM2 has the lower pressure, negative where AM1 has; rows",
        printed=float(len(steps)),
        recomputed=float(right),
        unit="1",
        verdict=holds(right == len(steps), Verdict.INCONSISTENT),
        reason="sign of beta in degrees against the sign of p1 - p2, all rows",
        tolerance=0.0,
    )
