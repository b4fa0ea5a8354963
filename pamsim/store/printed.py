"""Read the papers' printed tables that ship with pamsim."""

from __future__ import annotations

import csv
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Any

from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA


@dataclass(frozen=True, kw_only=True)
class PrintedStep:
    """One row of Matiskova 2021's Tables 1 and 2, in SI.

    Attributes:
        row: number, 1 to 24.
        table: 1 or 2.
        size: ``large``, ``medium`` or ``small`` step.
        pressure: final gauge pressures of muscles 1 and 2 [Pa].
        load: [kg].
        angle: measured final angle [rad], the printed degrees.
        increments: the printed encoder count.
        repeats: the row this one repeats, or None.
        slip: what is misprinted, or empty.
    """

    row: int
    table: int
    size: str
    pressure: tuple[float, float]
    load: float
    angle: float
    increments: float
    repeats: int | None
    slip: str


def mas20_steps() -> tuple[PrintedStep, ...]:
    """The 24 printed rows (Matiskova 2021, Tables 1 and 2)."""
    lines = _text("mas20_steps.csv").splitlines()
    rows = csv.DictReader(line for line in lines if not line.startswith("#"))
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
        for row in rows
    )


def distinct_steps() -> tuple[PrintedStep, ...]:
    """The 21 rows that are not copies of others."""
    return tuple(step for step in mas20_steps() if step.repeats is None)


def mas20_models() -> Mapping[str, Any]:
    """Printed models of the rig, as in ``mas20_models.toml`` (Matiskova 2021, (23), (30), (31))."""
    return tomllib.loads(_text("mas20_models.toml"))


def _text(name: str) -> str:
    return (resources.files("pamsim") / "data" / name).read_text(encoding="utf-8")
