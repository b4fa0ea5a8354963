"""A made-up but realistic result: closed-form responses to the printed rows, no engine."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.recordings.printed import mas20_steps
from pamsim.recordings.recording import Outcome, Recording
from pamsim.report.page import PageImage
from tests.unit.report.page_laws import check_page

T, T1, T2 = 0.672, 0.0893, 0.5842  # of the made-up plant [s]
TIME = np.arange(501) / 100.0
START = "both muscles rest at the higher of the row's two pressures, and one is vented."


def _first(t: np.ndarray, lag: float) -> np.ndarray:
    return 1.0 - np.exp(-t / lag)


def _second(t: np.ndarray, fast: float, slow: float) -> np.ndarray:
    return 1.0 - (slow * np.exp(-t / slow) - fast * np.exp(-t / fast)) / (slow - fast)


def make_rows(seed: int) -> list[dict[str, Any]]:
    rng = np.random.default_rng(seed)
    errors = {step.row: float(rng.normal(0.0, 1.4)) for step in mas20_steps()}
    rows: list[dict[str, Any]] = []
    for step in mas20_steps():
        error, measured = errors[step.repeats or step.row], step.angle * DEG_PER_RAD
        first, second = (float(pressure / PA_PER_KPA) for pressure in step.pressure)
        swings = step.size == "small" and step.load > 0
        rows.append(
            {
                "row": step.row,
                "table": step.table,
                "size": step.size,
                "p1_kpa": first,
                "p2_kpa": second,
                "load_kg": step.load,
                "measured_deg": measured,
                "simulated_deg": measured + error,
                "error_deg": error,
                "start_p1_kpa": max(first, second),
                "start_p2_kpa": max(first, second),
                "repeats": step.repeats,
                "slip": step.slip,
                "settling_s": 1.9 if swings else 2.35,
                "overshoot_percent": 14.2 if swings else 0.0,
                "monotonic": not swings,
                "outcome": "completed",
                "message": "completed: 5 s simulated",
            }
        )
    return rows


def make_recording(row: dict[str, Any]) -> Recording:
    shape = _second(TIME, T1, T2)
    angle = np.radians(row["simulated_deg"]) * shape / shape[-1]
    start = np.array([row["start_p1_kpa"], row["start_p2_kpa"]])
    target = np.array([row["p1_kpa"], row["p2_kpa"]])
    pressure = 1e3 * (start + np.outer(_first(TIME, 0.3), target - start))
    return Recording(
        time=TIME,
        joints={"shaft": "angle"},
        positions=angle[:, np.newaxis],
        velocities=np.gradient(angle, TIME)[:, np.newaxis],
        pressure=pressure,
        tension=pressure * 3e-4,
        command=np.tile(np.sign(target - start), (TIME.size, 1)),
        drive="valve",
        load=row["load_kg"],
        muscles=("muscle_1", "muscle_2"),
        outcome=Outcome.COMPLETED,
        message="completed: 5 s simulated",
        final_state=np.zeros(8),
        meta={"rig": "mas20_arm"},
    )


def make_models() -> dict[str, Any]:
    t = TIME[:-1]
    lags = {
        "simulated": (0.09, 0.58), "g2_output_error": (T1, T2), "g2_arx": (0.103, 0.571),
        "g2_paper": (0.090314, 0.57873), "g1_output_error": (T,), "g1_arx": (0.745,),
        "g1_paper": (0.64595,),
    }  # fmt: skip
    responses = {n: _second(t, *lag) if lag[1:] else _first(t, *lag) for n, lag in lags.items()}
    return {"time_s": t.tolist(), **{name: y.tolist() for name, y in responses.items()}}


def make_static() -> dict[str, Any]:
    x = np.linspace(-500, 500, 201)
    return {
        "p_svd_kpa": x.tolist(), "eq23_bar_deg": (x / 12.0).tolist(),
        "eq23_scaled_deg": (x / 13.0).tolist(),
        "scale_kpa": 180.0, "rms_bar_deg": 6.03, "rms_scaled_deg": 2.04,
    }  # fmt: skip


def make_fit(constants: dict[str, float], fit_percent: float) -> dict[str, Any]:
    """A model with these time constants, by output error and by ARX."""
    arx = {"method": "arx", "status": "lags", "K": 1.0, "fit_percent": 90.12, **constants}
    return {
        "method": "output_error", "K": 1.0003, "fit_percent": fit_percent, "status": "converged",
        **constants,
        **{f"interval95_{name}": [0.99 * x, 1.01 * x] for name, x in constants.items()},
        "arx": {"unit_gain": arx, "free_gain": {**arx, "K": 1.021}},
    }  # fmt: skip


def make_parameters() -> list[dict[str, Any]]:
    names = ("name", "value", "unit", "source", "interval95", "note")
    lines = (
        ("braid.nominal_length", 250, "mm", "Matiskova 2021, Table 1 (MAS-20-250)", None, ""),
        ("mounting.length_at_zero", 255, "mm", "assumed", None, "never printed"),
        ("passive.stiffness", 24012.3817, "N", "identified", [22150.2, 25911.7], ""),
        ("valve.conductance_fill", 0.06, "dm^3/(s*bar)", "datasheet", None, "one of two orifices"),
    )
    return [dict(zip(names, line, strict=True)) for line in lines]


CALIBRATION = {
    "command": "python calibrate.py",
    "applies": True,
    "nested_leave_one_out": {"rms_deg": 1.234, "selected": {"one form": 20, "other": 1}},
    "small_steps_rms_deg": 1.357,
    "best_torque_laws": {"leave_one_out_rms_deg": 1.111, "small_steps_rms_deg": 2.222},
    "torque_laws": [
        {
            "coefficients": {"k1": 3.0, "c": 0.1},
            "rms_deg": 0.876,
            "leave_one_out_rms_deg": 1.111,
            "small_steps_rms_deg": None,
        }
    ],
}


@pytest.fixture
def result() -> dict[str, Any]:
    """A fresh result of schema ``pamsim-reproduce/1``; tests may change it."""
    rows = make_rows(seed=7)
    errors = {r["row"]: r["error_deg"] for r in rows if r["repeats"] is None}
    worst = max(errors, key=lambda row: abs(errors[row]))
    return {
        "schema": "pamsim-reproduce/1",
        "rig": "mas20_arm",
        "start": "vent",
        "start_meaning": START,
        "timestep_s": 0.002,
        "sample_hz": 500.0,
        "sensors": True,
        "wall_s": 12.34,
        "versions": {"pamsim": "0.1.0", "mujoco": "3.17.0", "numpy": "2.3.1"},
        "rows": rows,
        "rms_deg": float(np.sqrt(np.mean(np.square(list(errors.values()))))),
        "worst": {"row": worst, "error_deg": errors[worst]},
        "checks": [
            {"name": "angles", "ok": True, "sentence": "all angles lie within 3 deg"},
            {"name": "oscillation", "ok": False, "sentence": "small loaded steps oscillate"},
        ],
        "g1": make_fit({"T_s": T}, 94.83),
        "g2": make_fit({"T1_s": T1, "T2_s": T2}, 99.21),
        "fit_percent": 99.21,
        "identification": {"row": 1},
        "calibration": {**CALIBRATION},
        "static_models": None,
        "paper": {
            "source": "Matiskova et al., Appl. Sci. 2021, 11, 7288",
            "g1": {"T_s": 0.64595},
            "g2": {"T1_s": 0.090314, "T2_s": 0.57873},
            "notes": ["Rows 22-24 repeat rows 13-15 exactly."],
        },
        "figure9": make_models(),
        "figure6": make_static(),
        "parameters": make_parameters(),
    }


@pytest.fixture
def recordings(result: dict[str, Any]) -> dict[int, Recording]:
    """One recording per distinct row of ``result``."""
    return {row["row"]: make_recording(row) for row in result["rows"] if row["repeats"] is None}


@pytest.fixture(autouse=True)
def every_page_keeps_the_laws(request: pytest.FixtureRequest) -> Iterator[None]:
    """Hold every page that a test writes to `page_laws`."""
    folder = request.getfixturevalue("tmp_path") if "tmp_path" in request.fixturenames else None
    yield
    for page in folder.rglob("index.html") if folder else ():
        check_page(page.read_text(encoding="utf-8"))


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw the figures but leave out turning them into pixels, the slowest part by far."""

    def touch(figure: Figure, path: Path) -> PageImage:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"")
        return PageImage("data:image/png;base64,", 691, 400, [])

    monkeypatch.setattr("pamsim.report.page.page_image", touch)
