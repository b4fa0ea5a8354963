"""Read the printed pressure-length loop of seed 000: tables, equations, scores and sensors.

Numbers stay in the printed units (kPa, cm), each with half a unit of its last printed digit: they
are compared digit by digit with what is recomputed, and not used to simulate anything.
"""

from __future__ import annotations

import csv
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Any

from pamsim.core.parameters import Sourced

BRANCHES = ("up", "down")
"""Rising and falling pressure."""

SCORES = ("MSE", "R2", "RMSE", "MAE")
"""Printed measures of fit, in the order of the tables."""


@dataclass(frozen=True)
class Printed:
    """A number with the digits it was printed with.

    Attributes:
        value: the number.
        half_unit: half a unit of its last printed digit.
    """

    value: float
    half_unit: float

    @classmethod
    def read(cls, text: str) -> Printed:
        """Read a decimal number such as ``-0.0083212``."""
        return cls(float(text), 0.5 * 10.0 ** -len(text.partition(".")[2]))


@dataclass(frozen=True, kw_only=True)
class LoopRow:
    """Length of the muscle at one pressure on one branch, from three runs (seed 000, Table 2).

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
    """One coefficient with its 95 % interval (seed 000, Table 1)."""

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
        for row in _table("paper_b_table2.csv")
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
        for row in _table("paper_b_table1.csv")
        if row["branch"] == branch
    )


def loop_scores(branch: str, model: str) -> Mapping[str, Printed]:
    """Printed scores of one branch (seed 000, Tables 3 and 4).

    Args:
        branch: ``up`` or ``down``.
        model: ``arctangent`` or ``bouc_wen``.

    Returns:
        Score -> number; MSE in cm^2, RMSE and MAE in cm.
    """
    rows = _table("paper_b_scores.csv")
    return {row["score"]: Printed.read(row[model]) for row in rows if row["branch"] == branch}


def loop_equation(branch: str) -> tuple[Printed, ...]:
    """Coefficients of equation (3) for ``up``, (4) for ``down``: cm, 1/kPa, 1, cm."""
    return tuple(Printed.read(text) for text in _document()["arctangent"][branch])


def loop_instrument(name: str) -> Mapping[str, Sourced]:
    """Numbers of an instrument.

    Args:
        name: ``transducer``, ``ranger`` or ``converter``.

    Returns:
        Field -> number with its unit and source.
    """
    return {
        field: Sourced(where=f"paper_b_printed.toml, {name}.{field}", **entry)
        for field, entry in _document()[name].items()
    }


def _document() -> Mapping[str, Any]:
    return tomllib.loads(_text("paper_b_printed.toml"))


def _table(name: str) -> list[dict[str, str]]:
    lines = _text(name).splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def _text(name: str) -> str:
    return (resources.files("pamsim") / "data" / name).read_text(encoding="utf-8")
