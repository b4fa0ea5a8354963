"""Alraouf 2025, recomputed: transcription, the checked numbers, and what the printed fit proves."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.papers.alraouf2025 import loop as printed_loop
from pamsim.papers.alraouf2025.loop import (
    branch_data,
    fit_arctangent,
    fit_bouc_wen,
    loop_coefficients,
    loop_scores,
    scores,
)
from pamsim.papers.alraouf2025.sensors import ranger_speed, speed_of_sound
from pamsim.physics.hysteresis.bouc_wen import bouc_wen_rate
from pamsim.recordings.printed import BRANCHES, Printed, loop_equation, loop_rows, printed_document
from tests.unit.papers.judged import judged

PAPER = "alraouf2025"


@pytest.fixture(scope="module")
def claims():
    return judged(PAPER).claims


def test_tables_are_whole():
    for branch in BRANCHES:
        assert [row.pressure_kpa for row in loop_rows(branch)] == list(range(0, 501, 50))
        assert [row.symbol[-1] for row in loop_coefficients(branch)] == ["0", "1", "2", "3"]
        for row in loop_coefficients(branch):  # Table 1's intervals are symmetric
            middle = 0.5 * (row.low.value + row.high.value)
            assert middle == pytest.approx(row.estimate.value, rel=2e-4)
        for model in ("arctangent", "bouc_wen"):
            found = loop_scores(branch, model)
            assert found["MAE"].value < found["RMSE"].value
    for name in ("transducer", "ranger", "converter"):
        assert all(entry["source"] for entry in printed_document("alraouf2025.toml")[name].values())


def test_printed_digits_are_kept():
    assert Printed.read("-0.0083212") == Printed(-0.0083212, 0.5e-7)
    assert Printed.read("0.995290").half_unit == pytest.approx(0.5e-6)
    assert Printed.read("30").half_unit == 0.5
    assert loop_equation("up")[0].half_unit == pytest.approx(0.5e-4)


def test_least_squares_and_printed_coefficients_on_table_2(claims):
    expected = {
        "up": (2.4343, -0.010457, 1.6881, 27.620),
        "down": (2.6164, -0.0099168, 1.4041, 27.817),
    }
    for branch, coefficients in expected.items():
        assert fit_arctangent(branch) == pytest.approx(coefficients, rel=3e-5)
    # MSE of the printed coefficients, up and down, then of ours.
    for number, mse in ((16, 0.04802), (20, 0.04238), (24, 0.03430), (25, 0.03678)):
        assert claims[f"alraouf2025-{number}"].recomputed == pytest.approx(mse, abs=5e-6)


def test_bouc_wen_is_no_worse_in_either_branch_but_has_no_memory(claims):
    loop = fit_bouc_wen()
    for branch in BRANCHES:
        pressure, length = branch_data(branch)
        a = fit_arctangent(branch)
        arctangent = a[0] * np.arctan(a[1] * pressure + a[2]) + a[3] - length
        assert scores(loop.residual[branch], length)["MSE"] <= float(np.mean(arctangent**2))
    assert loop.width < 0.05
    # Better on the printed means, but by less than their printed intervals.
    for number in (34, 35):
        claim = claims[f"alraouf2025-{number}"]
        assert 0.0 < claim.recomputed < claim.scatter[0]


@pytest.mark.parametrize(
    ("travel", "sigma", "sharpness", "start"),
    [(300.0, 0.5, 2.4, -0.99), (60.0, 0.9, 8.0, 0.3), (90.0, 0.1, 4.0, -0.9)],
)
def test_a_static_loop_obeys_the_operators_rate(travel, sigma, sharpness, start):
    pressure = np.linspace(0.0, 500.0, 2001)
    up, down = np.split(printed_loop._path(travel, sigma, sharpness, start, pressure), 2)
    for z, direction in ((up, 1.0), (down[::-1], -1.0)):
        slope = (z[2:] - z[:-2]) / 0.5  # per kPa travelled
        rate = [bouc_wen_rate(at, direction, travel, sigma, sharpness) for at in z[1:-1].tolist()]
        # Cells of 0.005 are chords of z; differences over 0.5 kPa miss the kink at z = 0.
        assert np.max(np.abs(slope - rate)) < 0.02 / travel
        assert np.mean(np.abs(slope - rate)) < 0.001 / travel
    assert up[0] == pytest.approx(start, abs=1e-5)
    assert up[-1] == pytest.approx(down[-1], abs=1e-5)


def test_bouc_wen_with_memory_opens_a_loop_and_fits_worse():
    free, passive = fit_bouc_wen(), fit_bouc_wen(0.5)
    assert passive.sigma >= 0.5
    assert passive.width > 0.1
    for branch in BRANCHES:
        square = [float(np.mean(loop.residual[branch] ** 2)) for loop in (free, passive)]
        assert square[1] > 5.0 * square[0]


def test_scores_are_matlabs():
    found = scores(np.array([1.0, -1.0, 2.0, 0.0]), np.array([0.0, 2.0, 4.0, 6.0]))
    assert found == pytest.approx({"MSE": 1.5, "R2": 1.0 - 1.5 / 5.0, "RMSE": 1.5**0.5, "MAE": 1.0})


@pytest.mark.parametrize(
    ("number", "expected"),
    [
        (54, (0.0, 500.0)),
        (55, 5.0 / 1024.0 / 4.0 * 500.0),  # kPa, ten bits over 5 V
        (56, 10.0),
        (57, 20.0),
        (58, 273.15 * ((2.0 / 58e-4 / 331.3) ** 2 - 1.0)),  # deg C
        (60, 100.0 * 0.606 / (331.3 + 0.606 * 25.0)),
        (64, (100.0 + (5.0 / 1024.0 / 4.0 * 500.0) ** 2) ** 0.5 - 10.0),
    ],
)
def test_sensors(claims, number, expected):
    assert claims[f"alraouf2025-{number}"].recomputed == pytest.approx(expected, rel=1e-12)


def test_the_ranger_reads_true_at_its_own_temperature_and_short_in_warm_air(claims):
    own = claims["alraouf2025-58"].recomputed
    assert speed_of_sound(own) == pytest.approx(ranger_speed(58.0), rel=1e-12)
    assert speed_of_sound(20.0) == pytest.approx(343.2, abs=0.1)  # textbooks
    change = judged(PAPER).notes["alraouf2025-61"].recomputed / 30.0
    assert change == pytest.approx(10.0 / (2.0 * 298.15), rel=0.01)  # an ideal gas
