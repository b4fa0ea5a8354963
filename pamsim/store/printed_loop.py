"""Read the printed pressure-length loop of Alraouf 2025: tables, equations, scores and sensors.

Numbers stay in the printed units (kPa, cm), each with half a unit of its last printed digit: they
are compared digit by digit with what is recomputed, and not used to simulate anything.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pamsim.core.parameters import Sourced
from pamsim.store.printed_table import Printed, printed_document, printed_table

_DOCUMENT = "paper_b_printed.toml"

BRANCHES = ("up", "down")
"""Rising and falling pressure."""

SCORES = ("MSE", "R2", "RMSE", "MAE")
"""Printed measures of fit, in the order of the tables."""


@dataclass(frozen=True, kw_only=True)
class LoopRow:
    """Length of the muscle at one pressure on one branch, from three runs (Alraouf 2025, Table 2).

    Attributes:
        branch: ``up`` or ``down``.
        pressure_kpa: gauge pressure [kPa].
        mean: [cm].
        deviation: standard deviation [cm].
        half_interval: half the 95 % confidence interval of the mean [cm].
    """

    branch: str
    pressure_kpa: float
    mean: Printed
    deviation: Printed
    half_interval: Printed


@dataclass(frozen=True, kw_only=True)
class LoopCoefficient:
    """One coefficient with its 95 % interval (Alraouf 2025, Table 1)."""

    branch: str
    symbol: str
    estimate: Printed
    low: Printed
    high: Printed


def loop_rows(branch: str) -> tuple[LoopRow, ...]:
    """The 11 rows of one branch, by rising pressure."""
    return tuple(
        LoopRow(
            branch=branch,
            pressure_kpa=float(row["pressure_kpa"]),
            mean=Printed.read(row[f"{branch}_mean_cm"]),
            deviation=Printed.read(row[f"{branch}_sd_cm"]),
            half_interval=Printed.read(row[f"{branch}_ci_cm"]),
        )
        for row in printed_table("paper_b_table2.csv")
    )


def loop_coefficients(branch: str) -> tuple[LoopCoefficient, ...]:
    """The four coefficients of one branch as Table 1 prints them."""
    return tuple(
        LoopCoefficient(
            branch=branch,
            symbol=row["symbol"],
            estimate=Printed.read(row["estimate"]),
            low=Printed.read(row["low"]),
            high=Printed.read(row["high"]),
        )
        for row in printed_table("paper_b_table1.csv")
        if row["branch"] == branch
    )


def loop_scores(branch: str, model: str) -> Mapping[str, Printed]:
    """Printed scores of one branch (Alraouf 2025, Tables 3 and 4).

    Args:
        branch: ``up`` or ``down``.
        model: ``arctangent`` or ``bouc_wen``.

    Returns:
        Score -> number; MSE in cm^2, RMSE and MAE in cm.
    """
    rows = printed_table("paper_b_scores.csv")
    return {row["score"]: Printed.read(row[model]) for row in rows if row["branch"] == branch}


def loop_equation(branch: str) -> tuple[Printed, ...]:
    """Coefficients of equation (3) for ``up``, (4) for ``down``: cm, 1/kPa, 1, cm."""
    return tuple(Printed.read(text) for text in printed_document(_DOCUMENT)["arctangent"][branch])


def loop_instrument(name: str) -> Mapping[str, Sourced]:
    """Numbers of an instrument.

    Args:
        name: ``transducer``, ``ranger`` or ``converter``.

    Returns:
        Field -> number with its unit and source.
    """
    return {
        field: Sourced(where=f"{_DOCUMENT}, {name}.{field}", **entry)
        for field, entry in printed_document(_DOCUMENT)[name].items()
    }
