"""Learned tensions: the splines of their control values, and the work of the air."""

import numpy as np
import pytest

import pamsim
from pamsim.physics.learned_tension import (
    CONTROLS,
    LearnedTension,
    learned_area,
    learned_derivatives,
    learned_gain,
    learned_pull,
    learned_work,
    learns_tension,
)
from pamsim.physics.record import view
from pamsim.physics.static_muscle import static_force, static_volume, volume_and_slope, work_ratio
from tests.unit.physics.splines import by_scipy

RNG = np.random.default_rng(7)
AREAS, PULLS = RNG.normal(size=CONTROLS) * 2e-5, RNG.normal(size=CONTROLS) * 20.0
NUMBERS = {f"area_{k}": float(c) for k, c in enumerate(AREAS, start=1)}
NUMBERS |= {f"pull_{k}": float(c) for k, c in enumerate(PULLS, start=1)}
LEARNED = LearnedTension(low=-0.02, high=0.12, **NUMBERS)


def test_each_curve_is_scipy_s_spline_and_stays_at_its_ends():
    for kappa in np.linspace(-0.02, 0.12, 23).tolist():
        assert learned_area(LEARNED, kappa) == pytest.approx(
            by_scipy(AREAS, (-0.02, 0.12), kappa), abs=1e-15
        )
        assert learned_pull(LEARNED, kappa) == pytest.approx(
            by_scipy(PULLS, (-0.02, 0.12), kappa), abs=1e-9
        )
    assert learned_area(LEARNED, -0.3) == pytest.approx(AREAS[0])
    assert learned_pull(LEARNED, 0.3) == pytest.approx(PULLS[-1])


def test_integrals_and_derivatives_are_those_of_the_curves():
    step = 1e-5
    for kappa in np.linspace(-0.1, 0.2, 31).tolist():
        gained = learned_gain(LEARNED, kappa + step) - learned_gain(LEARNED, kappa - step)
        worked = learned_work(LEARNED, kappa + step) - learned_work(LEARNED, kappa - step)
        assert gained / (2.0 * step) == pytest.approx(learned_area(LEARNED, kappa), abs=1e-8)
        assert worked / (2.0 * step) == pytest.approx(learned_pull(LEARNED, kappa), abs=1e-2)
        pulled = learned_pull(LEARNED, kappa + step) - learned_pull(LEARNED, kappa - step)
        if -0.019 < kappa < 0.119:  # at the ends they bend
            derivatives = learned_derivatives(LEARNED, kappa)
            assert derivatives[1] == pytest.approx(pulled / (2.0 * step), rel=1e-2, abs=1.0)
    assert learned_gain(LEARNED, 0.0) == 0.0


@pytest.mark.parametrize("extensibility", [0.0, 2e-8])
def test_force_and_volume_do_the_same_work(extensibility):
    """Virtual work: dV/dl = -dF/dp, at every length and pressure."""
    values = {f"learned_tension.{name}": value for name, value in NUMBERS.items()}
    values |= {"learned_tension.low": -0.02, "learned_tension.high": 0.12}
    rig = pamsim.load_rig("mas20_arm").with_parameters({"braid.extensibility": extensibility})
    without = view(rig.model.actuator_user[0])
    m = view(rig.with_parameters(values).model.actuator_user[0])
    free = m.braid.nominal_length * (1.0 + extensibility * 2e5)
    for kappa in np.linspace(-0.05, 0.2, 11).tolist():
        length = (1.0 - kappa) * m.braid.nominal_length - m.mounting.length_at_zero
        force = [static_force(m, length, p) for p in (2e5 - 10.0, 2e5 + 10.0)]
        space = [static_volume(m, at, 2e5) for at in (length - 1e-6, length + 1e-6)]
        assert np.diff(force)[0] / 20.0 == pytest.approx(-np.diff(space)[0] / 2e-6, rel=1e-6)
        strained = 1.0 - (length + m.mounting.length_at_zero) / free
        more = static_force(m, length, 2e5) - static_force(without, length, 2e5)
        expected = 2e5 * learned_area(LEARNED, strained) + learned_pull(LEARNED, strained)
        assert more == pytest.approx(expected)
    assert work_ratio(m, 3e5, 0.04) == pytest.approx(1.0, rel=1e-5)


@pytest.mark.parametrize("extensibility", [0.0, 2e-8])
def test_the_slope_of_the_volume_by_pressure_is_its_own(extensibility):
    values = {f"learned_tension.{name}": value for name, value in NUMBERS.items()}
    values |= {"learned_tension.low": -0.02, "learned_tension.high": 0.12}
    values["braid.extensibility"] = extensibility
    m = view(pamsim.load_rig("mas20_arm").with_parameters(values).model.actuator_user[0])
    for kappa in (-0.01, 0.03, 0.1):
        low, high = (volume_and_slope(m, kappa, p)[0] for p in (2e5 - 50.0, 2e5 + 50.0))
        slope = volume_and_slope(m, kappa, 2e5)[1]
        assert slope == pytest.approx((high - low) / 100.0, rel=1e-3, abs=1e-16)


def test_without_a_range_there_is_no_curve():
    assert not learns_tension(LearnedTension(area_3=1e-5))
    assert learns_tension(LearnedTension(low=-0.1, high=0.1))
