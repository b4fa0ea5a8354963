"""A made-up but realistic result: closed-form responses to the printed rows, no engine."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from pamsim.recordings.recording import Outcome, Recording
from pamsim.report.page import PageImage
from tests.unit.report.page_laws import check_page

# row, p1 [kPa], p2 [kPa], load [kg], printed angle [deg]
PRINTED = (
    (1, 487, 0, 0.0, 36.43),
    (2, 0, 489, 0.0, -36.63),
    (3, 490, 0, 1.2, 36.80),
    (4, 0, 464, 1.2, -36.29),
    (5, 454, 0, 2.14, 36.00),
    (6, 0, 455, 2.14, -35.28),
    (7, 216, 0, 2.14, 26.40),
    (8, 0, 226, 2.14, -27.65),
    (9, 220, 0, 1.2, 26.39),
    (10, 0, 229, 1.2, -27.36),
    (11, 227, 0, 0.0, 26.39),
    (12, 0, 232, 0.0, -28.37),
    (13, 247, 160, 2.14, 17.48),
    (14, 155, 198, 2.14, -6.94),
    (15, 190, 123, 1.2, 10.32),
    (16, 121, 178, 1.2, -8.12),
    (17, 171, 108, 0.0, 9.70),
    (18, 105, 167, 0.0, -9.36),
    (19, 446, 339, 0.0, 17.99),
    (20, 332, 375, 0.0, -7.71),
    (21, 459, 371, 1.2, 17.44),
    (22, 247, 160, 2.14, 17.48),
    (23, 155, 198, 2.14, -6.94),
    (24, 190, 123, 1.2, 10.32),
)
REPEATS = {22: 13, 23: 14, 24: 15}
T, T1, T2 = 0.672, 0.0893, 0.5842  # of the made-up plant [s]
SAMPLE_HZ = 100.0
DURATION_S = 5.0


def _first(t: np.ndarray, lag: float) -> np.ndarray:
    return 1.0 - np.exp(-t / lag)


def _second(t: np.ndarray, fast: float, slow: float) -> np.ndarray:
    return 1.0 - (slow * np.exp(-t / slow) - fast * np.exp(-t / fast)) / (slow - fast)


def _swing(t: np.ndarray, lag: float, damping: float, omega: float) -> np.ndarray:
    """A first-order rise with a damped swing on top that starts at zero."""
    return _first(t, lag) + 0.35 * np.exp(-damping * t) * np.sin(omega * t)


def _size(row: int) -> str:
    return "large" if row <= 6 else "medium" if row <= 12 else "small"


def make_rows(seed: int) -> list[dict[str, Any]]:
    rng = np.random.default_rng(seed)
    errors = {row: float(rng.normal(0.0, 1.4)) for row, *_ in PRINTED}
    rows: list[dict[str, Any]] = []
    for row, p1, p2, load, measured in PRINTED:
        repeats = REPEATS.get(row)
        error = errors[repeats or row]
        slip = f"repeats row {repeats} in every figure" if repeats else ""
        if row == 4:
            slip = "the printed increment 252 has no minus sign"
        swings = _size(row) == "small" and load > 0
        rows.append(
            {
                "row": row,
                "table": 1 if row <= 12 else 2,
                "size": _size(row),
                "p1_kpa": float(p1),
                "p2_kpa": float(p2),
                "load_kg": load,
                "measured_deg": measured,
                "simulated_deg": measured + error,
                "error_deg": error,
                "start_p1_kpa": float(max(p1, p2)),
                "start_p2_kpa": float(max(p1, p2)),
                "repeats": repeats,
                "slip": slip,
                "settling_s": 1.9 if swings else 2.35,
                "overshoot_percent": 14.2 if swings else 0.0,
                "monotonic": not swings,
                "outcome": "completed",
                "message": "completed: 5 s simulated",
            }
        )
    return rows


def make_recordings(rows: list[dict[str, Any]]) -> dict[int, Recording]:
    t = np.arange(int(DURATION_S * SAMPLE_HZ) + 1) / SAMPLE_HZ
    recordings: dict[int, Recording] = {}
    for row in rows:
        if row["repeats"] is not None:
            continue
        swings = not row["monotonic"]
        shape = _swing(t, 0.25, 2.6, 14.0 - 3 * row["load_kg"]) if swings else _second(t, T1, T2)
        angle = np.radians(row["simulated_deg"]) * shape / shape[-1]
        start = np.array([row["start_p1_kpa"], row["start_p2_kpa"]])
        target = np.array([row["p1_kpa"], row["p2_kpa"]])
        pressure = 1e3 * (start + np.outer(_first(t, 0.3), target - start))
        recordings[row["row"]] = Recording(
            time=t,
            joints={"shaft": "angle"},
            positions=angle[:, np.newaxis],
            velocities=np.gradient(angle, t)[:, np.newaxis],
            pressure=pressure,
            tension=pressure * 3e-4,
            command=np.tile(np.sign(target - start), (t.size, 1)),
            drive="valve",
            load=row["load_kg"],
            muscles=("muscle_1", "muscle_2"),
            outcome=Outcome.COMPLETED,
            message="completed: 5 s simulated",
            final_state=np.zeros(8),
            meta={"rig": "mas20_arm"},
        )
    return recordings


def make_models() -> dict[str, Any]:
    t = np.arange(0.0, DURATION_S, 0.01)
    responses = {
        "simulated": _second(t, T1, T2) * (1 + 0.012 * np.sin(2 * t) * np.exp(-t)),
        "g1_output_error": _first(t, T),
        "g2_output_error": _second(t, T1, T2),
        "g1_arx": 1.004 * _first(t, 0.745),
        "g2_arx": _second(t, 0.103, 0.571),
        "g1_paper": _first(t, 0.64595),
        "g2_paper": _second(t, 0.090314, 0.57873),
    }
    return {"time_s": t.tolist(), **{name: y.tolist() for name, y in responses.items()}}


def make_static() -> dict[str, Any]:
    x = np.linspace(-500, 500, 201)

    def eq23(p: np.ndarray) -> np.ndarray:
        q = np.abs(p)
        return np.sign(p) * (35.135 - 34.4443 * np.exp(-q) + 5.470 * q * np.exp(-q))

    return {
        "p_svd_kpa": x.tolist(),
        "eq23_bar_deg": eq23(x / 100).tolist(),
        "eq23_scaled_deg": eq23(x / 180).tolist(),
        "scale_kpa": 180.0,
        "rms_bar_deg": 6.03,
        "rms_scaled_deg": 2.04,
    }


def make_parameters() -> list[dict[str, Any]]:
    names = ("name", "value", "unit", "source", "interval95", "note")
    lines = (
        ("braid.nominal_length", 250, "mm", "Matiskova 2021, Table 1 (MAS-20-250)", None, ""),
        ("braid.diameter", 20, "mm", "Matiskova 2021, Table 1 (MAS-20-250)", None, ""),
        ("mounting.length_at_zero", 255, "mm", "assumed", None, "never printed"),
        ("force.a", -4.00180705, "N/bar", "DMSP-20-200, same group as Sarosi", None, ""),
        ("passive.stiffness", 24012.3817, "N", "identified", [22150.2, 25911.7], ""),
        ("valve.conductance_fill", 0.06, "dm^3/(s*bar)", "datasheet", None, "one of two orifices"),
        (
            "tendon.chain.coef",
            12.4871,
            "mm",
            "identified",
            [11.92, 13.05],
            "pulley radius, not printed",
        ),
        ("sensor.encoder_increments", 2500, "1", "Matiskova 2021, section 2.3", None, ""),
    )
    return [dict(zip(names, line, strict=True)) for line in lines]


@pytest.fixture
def result() -> dict[str, Any]:
    """A fresh result of schema ``pamsim-reproduce/1``; tests may change it."""
    rows = make_rows(seed=7)
    errors = {r["row"]: r["error_deg"] for r in rows if r["repeats"] is None}
    worst = max(errors, key=lambda row: abs(errors[row]))
    arx = {"method": "arx", "status": "lags"}
    return {
        "schema": "pamsim-reproduce/1",
        "rig": "mas20_arm",
        "start": "vent",
        "start_meaning": "both muscles rest at the higher of the row's two pressures, and one is"
        " vented or throttled to its end value.",
        "timestep_s": 0.002,
        "sample_hz": 500.0,
        "sensors": True,
        "wall_s": 12.34,
        "versions": {"pamsim": "0.1.0", "mujoco": "3.17.0", "numpy": "2.3.1"},
        "rows": rows,
        "rms_deg": float(np.sqrt(np.mean(np.square(list(errors.values()))))),
        "worst": {"row": worst, "error_deg": errors[worst]},
        "checks": [
            {
                "name": "angles",
                "ok": True,
                "sentence": "all 21 angles lie within 3 deg of the printed ones",
            },
            {
                "name": "monotonic",
                "ok": True,
                "sentence": "large and medium steps are monotonic (12 of 12)",
            },
            {
                "name": "oscillation",
                "ok": False,
                "sentence": "small loaded steps oscillate before they settle (4 of 5)",
            },
        ],
        "g1": {
            "method": "output_error",
            "K": 1.0003,
            "T_s": T,
            "interval95_T_s": [0.668, 0.676],
            "fit_percent": 94.83,
            "status": "converged",
            "arx": {
                "unit_gain": {**arx, "K": 1.0, "T_s": 0.7453, "fit_percent": 90.12},
                "free_gain": {**arx, "K": 1.021, "T_s": 0.8117, "fit_percent": 86.4},
            },
        },
        "g2": {
            "method": "output_error",
            "K": 0.9998,
            "T1_s": T1,
            "T2_s": T2,
            "interval95_T1_s": [0.0881, 0.0905],
            "interval95_T2_s": [0.5829, 0.5855],
            "fit_percent": 99.21,
            "status": "converged",
            "arx": {
                "unit_gain": {**arx, "K": 1.0, "T1_s": 0.1034, "T2_s": 0.5713, "fit_percent": 98.0},
                "free_gain": {**arx, "K": 1.002, "T1_s": 0.104, "T2_s": 0.574, "fit_percent": 97.9},
            },
        },
        "fit_percent": 99.21,
        "identification": {"row": 1},
        "calibration": {
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
        },
        "static_models": None,
        "paper": {
            "source": "Matiskova et al., Appl. Sci. 2021, 11, 7288",
            "g1": {"T_s": 0.64595},
            "g2": {"T1_s": 0.090314, "T2_s": 0.57873},
            "notes": [
                "Rows 22-24 repeat rows 13-15 exactly: 21 operating points are distinct, not 24.",
                "Equation (23) gives beta(0) = 0.69 deg, not 0.",
                "A step of G2 fitted as G1 gives T = 0.675 s by output error, not 0.646 s.",
            ],
        },
        "figure9": make_models(),
        "figure6": make_static(),
        "parameters": make_parameters(),
    }


@pytest.fixture
def recordings(result: dict[str, Any]) -> dict[int, Recording]:
    """One recording per distinct row of ``result``."""
    return make_recordings(result["rows"])


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
        path.write_bytes(b"")
        return PageImage("data:image/png;base64,", 691, 400, [])

    monkeypatch.setattr("pamsim.report.page.page_image", touch)
