"""Printed laws and tables, and the numerics that recompute them, against formulas written out."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pamsim.papers.alraouf2025 import loop as alraouf
from pamsim.papers.alraouf2025.sensors import ranger_speed, speed_of_sound
from pamsim.papers.matiskova2021.equations import (
    ideal_muscle,
    ideal_stiffness,
    rig_muscle,
    sprocket_radius,
    stiffness_over_pressure,
)
from pamsim.papers.numerics import derivative, jacobian, root
from pamsim.papers.sarosi.equations import _rank
from pamsim.papers.vandamme2008.shape import fit_pleated, worst_relative_error
from pamsim.physics.antagonist import antagonist_torque
from pamsim.physics.force_laws.force_law import coefficients_of
from pamsim.physics.force_laws.pleated import FIT_RANGE, SLENDERNESS_6
from pamsim.physics.hysteresis.bouc_wen import bouc_wen_rate
from pamsim.physics.record import COMMON, parameters
from pamsim.recordings.printed import (
    BRANCHES,
    Printed,
    arctangent_law,
    loop_equation,
    loop_rows,
    printed_document,
)
from tests.unit.physics.flat import charged_air_state, gauge_pressure, muscle_stiffness

LOOP = (2.7378, -0.0083212, 1.3402, 27.759)  # Alraouf 2025, equation (3)


def test_complex_steps_give_derivatives_and_a_root_is_found_to_its_tolerance():
    pressure = np.linspace(0.0, 500.0, 11)
    columns = jacobian(lambda a: arctangent_law(pressure, *a), LOOP)
    inner = LOOP[1] * pressure + LOOP[2]
    steep = LOOP[0] / (1.0 + inner**2)
    exact = [np.arctan(inner), steep * pressure, steep, np.ones_like(pressure)]
    assert columns == pytest.approx(np.stack(exact, axis=1), rel=1e-13)
    assert derivative(lambda x: x**3 - 2.0 * x, 1.5) == pytest.approx(4.75, rel=1e-15)
    found = root(lambda x: x**3 - 2.0, 0.0, 2.0, 1e-12)
    assert found == pytest.approx(2.0 ** (1.0 / 3.0), abs=1e-11)


def test_constants_without_redundancy_count_as_determined():
    assert _rank(lambda v, p, kappa: v[0] * p + v[1] * kappa, (1.0, 2.0)) == 2.0


def test_equation_5_is_the_stiffness_of_the_kernel_under_the_ideal_law():
    muscle = ideal_muscle()
    par, air = parameters(muscle), muscle.chamber.atmosphere
    for length, pressure in ((0.0, 3e5), (-0.01, 5e5), (0.004, 1.5e5)):
        closed = ideal_stiffness(par, length, pressure)
        numeric = muscle_stiffness(par, length, pressure)
        assert closed.compressibility == pytest.approx(numeric.compressibility, rel=1e-8)
        assert closed.geometric == pytest.approx(numeric.geometric, rel=1e-8)
    # The geometric part goes with gauge pressure, compressibility with the absolute one.
    one, two = (ideal_stiffness(par, 0.0, pressure) for pressure in (2e5, 4e5))
    assert two.geometric == pytest.approx(2.0 * one.geometric, rel=1e-12)
    ratio = (4e5 + air) / (2e5 + air)
    assert two.compressibility == pytest.approx(ratio * one.compressibility, rel=1e-12)


def test_stiffness_curves_are_the_change_of_torque_of_the_turned_pair():
    """Turn the joint of the rig and of the ideal pair, pressures held and chambers shut."""
    curves, h = stiffness_over_pressure(), 1e-4
    radius = sprocket_radius()
    for kind, muscle in (("", rig_muscle()), ("ideal_", ideal_muscle())):
        par = parameters(dataclasses.replace(muscle, hysteresis=None))
        for place in (0, 20, -1):
            pressure = 500.0 * curves["sum_kpa"][place]
            air = [*[0.0] * (COMMON - 1), charged_air_state(par, [], 0.0, pressure)]

            def torque(angle, shut, par=par, air=air, pressure=pressure):
                ways = -radius * angle, radius * angle
                now = [gauge_pressure(par, air, way) if shut else pressure for way in ways]
                return antagonist_torque((par, par), radius, angle, now)

            for name, shut in (("held", False), ("shut", True)):
                change = (torque(-h, shut) - torque(h, shut)) / (2.0 * h)
                assert curves[kind + name][place] == pytest.approx(change, rel=1e-4)


def test_the_fit_of_a_pleated_muscle_s_force_is_as_good_as_stated():
    assert FIT_RANGE == (0.05, 0.35)
    assert 2.0e-3 < worst_relative_error(SLENDERNESS_6, 6.0) < 2.1e-3  # as documented
    stored = coefficients_of(SLENDERNESS_6)
    assert coefficients_of(fit_pleated(6.0)) == pytest.approx(stored, rel=1e-7)
    assert worst_relative_error(fit_pleated(10.0), 10.0) < 3e-3


def test_the_printed_tables_of_the_loop_are_whole_and_keep_their_digits():
    for branch in BRANCHES:
        assert [row.pressure_kpa for row in loop_rows(branch)] == list(range(0, 501, 50))
        coefficients = alraouf.loop_coefficients(branch)
        assert [row.symbol[-1] for row in coefficients] == ["0", "1", "2", "3"]
        for row in coefficients:  # Table 1's intervals are symmetric
            middle = 0.5 * (row.low.value + row.high.value)
            assert middle == pytest.approx(row.estimate.value, rel=2e-4)
        for model in ("arctangent", "bouc_wen"):
            found = alraouf.loop_scores(branch, model)
            assert found["MAE"].value < found["RMSE"].value
    for name in ("transducer", "ranger", "converter"):
        assert all(entry["source"] for entry in printed_document("alraouf2025.toml")[name].values())
    assert Printed.read("-0.0083212") == Printed(-0.0083212, 0.5e-7)
    assert Printed.read("0.995290").half_unit == pytest.approx(0.5e-6)
    assert Printed.read("30").half_unit == 0.5
    assert loop_equation("up")[0].half_unit == pytest.approx(0.5e-4)


def test_bouc_wen_is_no_worse_in_either_branch_but_has_no_memory():
    free, passive = alraouf.fit_bouc_wen(), alraouf.fit_bouc_wen(0.5)
    expected = {
        "up": (2.4343, -0.010457, 1.6881, 27.620),
        "down": (2.6164, -0.0099168, 1.4041, 27.817),
    }
    for branch in BRANCHES:
        a = alraouf.fit_arctangent(branch)
        assert a == pytest.approx(expected[branch], rel=3e-5)
        pressure, length = alraouf.branch_data(branch)
        arctangent = a[0] * np.arctan(a[1] * pressure + a[2]) + a[3] - length
        error = alraouf.scores(free.residual[branch], length)["MSE"]
        assert error <= float(np.mean(arctangent**2))
        # With memory it opens a loop and fits worse.
        assert float(np.mean(passive.residual[branch] ** 2)) > 5.0 * error
    assert free.width < 0.05
    assert passive.sigma >= 0.5
    assert passive.width > 0.1


def test_a_static_loop_obeys_the_operators_rate():
    pressure = np.linspace(0.0, 500.0, 2001)
    for case in ((300.0, 0.5, 2.4, -0.99), (60.0, 0.9, 8.0, 0.3), (90.0, 0.1, 4.0, -0.9)):
        travel, sigma, sharpness, start = case
        up, down = np.split(alraouf._path(*case, pressure), 2)
        for z, way in ((up, 1.0), (down[::-1], -1.0)):
            slope = (z[2:] - z[:-2]) / 0.5  # per kPa travelled
            rate = [bouc_wen_rate(at, way, travel, sigma, sharpness) for at in z[1:-1].tolist()]
            # Cells of 0.005 are chords of z; differences over 0.5 kPa miss the kink at z = 0.
            assert np.max(np.abs(slope - rate)) < 0.02 / travel, case
            assert np.mean(np.abs(slope - rate)) < 0.001 / travel, case
        assert up[0] == pytest.approx(start, abs=1e-5)
        assert up[-1] == pytest.approx(down[-1], abs=1e-5)


def test_scores_are_matlabs():
    found = alraouf.scores(np.array([1.0, -1.0, 2.0, 0.0]), np.array([0.0, 2.0, 4.0, 6.0]))
    assert found == pytest.approx({"MSE": 1.5, "R2": 1.0 - 1.5 / 5.0, "RMSE": 1.5**0.5, "MAE": 1.0})


def test_the_speed_of_sound_is_that_of_textbooks_and_of_the_ranger():
    assert speed_of_sound(20.0) == pytest.approx(343.2, abs=0.1)
    own = 273.15 * ((2.0 / 58e-4 / 331.3) ** 2 - 1.0)  # deg C at which the ranger reads right
    assert speed_of_sound(own) == pytest.approx(ranger_speed(58.0), rel=1e-12)
