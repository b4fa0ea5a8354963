"""Read the printed tables of the source papers that ship with pamsim, as the papers print them.

A file is named after its paper, author and year. Numbers keep their digits where they are compared
digit by digit with what is recomputed: see `Printed`.
"""

from __future__ import annotations

import csv
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA, FloatArray

BRANCHES = ("up", "down")
"""Rising and falling pressure of the loop of Alraouf 2025."""


@dataclass(frozen=True)
class Printed:
    """A number with the digits it was printed with: ``half_unit`` is half one of its last digit."""

    value: float
    half_unit: float

    @classmethod
    def read(cls, text: str) -> Printed:
        """Read a decimal number such as ``-0.0083212``."""
        return cls(float(text), 0.5 * 10.0 ** -len(text.partition(".")[2]))


def printed_table(name: str) -> list[dict[str, str]]:
    """Rows of a shipped CSV file, column -> text; lines that start with ``#`` are left out."""
    lines = _text(name).splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def printed_document(name: str, *, digits: bool = False) -> Mapping[str, Any]:
    """A shipped TOML file; with ``digits``, its decimal numbers are `Printed`."""
    return tomllib.loads(_text(name), parse_float=Printed.read if digits else float)


def _text(name: str) -> str:
    return (resources.files("pamsim") / "data" / name).read_text(encoding="utf-8")


@dataclass(frozen=True, kw_only=True)
class PrintedStep:
    """One row of Tables 1 and 2 of Matiskova 2021, in SI."""

    row: int  # number, 1 to 24
    table: int  # 1 or 2
    size: str  # ``large``, ``medium`` or ``small`` step
    pressure: tuple[float, float]  # final gauge pressures of muscles 1 and 2 [Pa]
    load: float  # [kg]
    angle: float  # measured final angle [rad], the printed degrees
    increments: float  # the printed encoder count
    repeats: int | None  # the row this one repeats, or None
    slip: str  # what is misprinted, or empty


def mas20_steps() -> tuple[PrintedStep, ...]:
    """The 24 printed rows (Matiskova 2021, Tables 1 and 2)."""
    return tuple(
        PrintedStep(
            row=int(row["row"]),
            table=int(row["table"]),
            size=row["size"],
            pressure=(float(row["p1_kpa"]) * PA_PER_KPA, float(row["p2_kpa"]) * PA_PER_KPA),
            load=float(row["load_kg"]),
            angle=float(row["beta_deg"]) / DEG_PER_RAD,
            increments=float(row["beta_increment"]),
            repeats=int(row["repeats"]) if row["repeats"] else None,
            slip=row["slip"],
        )
        for row in printed_table("matiskova2021_steps.csv")
    )


def distinct_steps() -> tuple[PrintedStep, ...]:
    """The 21 rows that are not copies of others."""
    return tuple(step for step in mas20_steps() if step.repeats is None)


def mas20_models() -> Mapping[str, Any]:
    """Printed models of the MAS-20 rig (Matiskova 2021, (23), (30), (31))."""
    return printed_document("matiskova2021.toml")


class LoopRow(NamedTuple):
    """Length of the muscle at one pressure on one branch, from three runs (Alraouf 2025, Table 2).

    Mean, standard deviation and half the 95 % confidence interval of the mean are in cm.
    """

    branch: str
    pressure_kpa: float  # gauge
    mean: Printed
    deviation: Printed
    half_interval: Printed


def loop_rows(branch: str) -> tuple[LoopRow, ...]:
    """The 11 rows of one branch, ``up`` or ``down``, by rising pressure."""
    columns = [f"{branch}_{of}_cm" for of in ("mean", "sd", "ci")]
    return tuple(
        LoopRow(branch, float(row["pressure_kpa"]), *(Printed.read(row[c]) for c in columns))
        for row in printed_table("alraouf2025_table2.csv")
    )


def loop_equation(branch: str) -> tuple[Printed, ...]:
    """Coefficients of (3) for ``up``, (4) for ``down`` of Alraouf 2025: cm, 1/kPa, 1, cm."""
    return tuple(printed_document("alraouf2025.toml", digits=True)["arctangent"][branch])


def arctangent_law(x: ArrayLike, a0: float, a1: float, a2: float, a3: float) -> FloatArray:
    """One branch of the length-pressure loop, y = a0 arctan(a1 x + a2) + a3: no memory, no rate.

    Of pressures x (n,): half-height over pi/2 a0 and value in the middle a3 [unit of y], steepness
    a1 [1 / unit of x], shift a2 [-].

    Source: Alraouf 2025, equations (1) and (2); its "b0 +" read as "b0".
    """
    return a0 * np.arctan(a1 * np.asarray(x, dtype=np.float64) + a2) + a3
