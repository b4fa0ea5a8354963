"""IMC gains make the loop one lag; scheduled, those of a model at its point, lines between."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pamsim.controllers.imc_tuning import imc_gains, imc_gains_of_fit
from pamsim.controllers.pid import GainSchedule, Pid
from pamsim.core.errors import InputError
from pamsim.linear.continuous_fit import fit_continuous
from pamsim.linear.local_models import LocalModel, OperatingPoint, local_model_map
from tests.unit.controllers.closed_loop import LEVEL, MODEL, PERIOD, SPLIT, observe
from tests.unit.linear.planted import record

PLACES = (-1e5, 0.0, 1e5)
PID = Pid(split=SPLIT, period=PERIOD, gain=1.0, tracking_time=0.5)


@pytest.fixture(scope="module")
def found():
    given = [
        (record(k, gain=2.0 + k, noise=0.01, n=300), OperatingPoint(place))
        for k, place in enumerate(PLACES)
    ]
    lost = (record(9, gain=1e-3, noise=1.0, n=300), OperatingPoint(3e5))
    models = [LocalModel(p, fit_continuous([trial], order=1)) for trial, p in [*given, lost]]
    return local_model_map(models)


@pytest.fixture(scope="module")
def schedule(found):
    return GainSchedule.from_models(found, pid=PID, closed_loop_time=0.2)


def test_at_a_models_own_point_the_gains_are_its_own(found, schedule):
    assert schedule.points == PLACES  # the fit that cannot be trusted is not among them
    for place, item in zip(PLACES, found.models, strict=False):
        assert schedule.at(place) == imc_gains_of_fit(item.fit, closed_loop_time=0.2)
        observation = observe(angle=0.1, pressure=(LEVEL + place / 2.0, LEVEL - place / 2.0))
        own = dataclasses.replace(PID, **dataclasses.asdict(schedule.at(place)))
        memory = schedule.start(observation)
        assert schedule.step(observation, memory) == own.step(observation, memory)


def test_between_two_points_gains_lie_on_a_line_and_beyond_they_stay(schedule):
    halfway = schedule.at(0.25e5)
    for name in ("gain", "integral_time", "derivative_time"):
        low, high = (getattr(item, name) for item in schedule.gains[1:])
        assert getattr(halfway, name) == pytest.approx(0.75 * low + 0.25 * high)
    assert schedule.at(-9e5) == schedule.gains[0]
    assert schedule.at(9e5) == schedule.gains[-1]


def test_the_integral_part_does_not_jump_with_the_gains(schedule):
    observation = [
        observe(angle=0.1, wanted=(0.1, 0.0, 0.0), pressure=p) for p in ((4e5, 2e5), (2e5, 4e5))
    ]
    memory = schedule.start(observation[0])
    commands = [schedule.step(item, memory)[0] for item in observation]
    assert commands[0] == commands[1]


def test_by_angle_the_gains_depend_on_the_angle(found):
    angles = np.radians([-20.0, 0.0, 20.0, 60.0]).tolist()
    by_angle = GainSchedule.from_models(found, pid=PID, closed_loop_time=0.2, by="angle", at=angles)
    assert by_angle.points == tuple(angles[:3])
    observation = observe(angle=angles[2], pressure=(2e5, 4e5), wanted=(angles[2] + 0.01, 0.0, 0.0))
    memory = by_angle.start(observation)
    command, _ = by_angle.step(observation, memory)
    extra = command[0] - command[1] - memory.integral
    assert extra == pytest.approx(0.01 * by_angle.gains[2].gain, rel=1e-6)


def test_a_schedule_that_is_none_is_refused(found, schedule):
    with pytest.raises(InputError, match="places"):
        GainSchedule.from_models(found, pid=PID, closed_loop_time=0.2, at=(0.0,))
    with pytest.raises(InputError, match="difference"):
        dataclasses.replace(schedule, by="presure")
    with pytest.raises(InputError, match="increasing"):
        dataclasses.replace(schedule, points=PLACES[::-1])


@pytest.mark.parametrize("late", [0.0, 0.03])
def test_the_open_loop_is_an_integrator_of_the_wanted_speed(late):
    gains = imc_gains(MODEL, closed_loop_time=0.1, dead_time=late)
    s = 1j * np.geomspace(0.1, 100.0, 20)
    plant = MODEL.gain / (MODEL.a2 * s**2 + MODEL.a1 * s + 1.0)
    pid = gains.gain * (1.0 + 1.0 / (gains.integral_time * s) + gains.derivative_time * s)
    np.testing.assert_allclose(pid * plant, 1.0 / ((0.1 + late) * s), rtol=1e-12)


def test_a_fit_is_tuned_by_its_own_numbers():
    fit = fit_continuous([record(1, gain=2.0, noise=0.01, n=300)], order=1)
    gains = imc_gains_of_fit(fit, closed_loop_time=0.2)
    assert gains.integral_time == fit.time_constants[0]
    assert gains.gain == pytest.approx(fit.time_constants[0] / (0.2 * fit.gain))
    two = fit_continuous([record(1, gain=2.0, noise=0.01, n=300)], order=2)
    assert imc_gains_of_fit(two, closed_loop_time=0.2).integral_time == pytest.approx(
        sum(two.time_constants)
    )


def test_what_is_no_g1_or_g2_or_not_stable_is_refused():
    fit = fit_continuous([record(1, gain=2.0, noise=0.01, n=300)], order=2, zeros=1)
    with pytest.raises(InputError, match="no zero"):
        imc_gains_of_fit(fit, closed_loop_time=0.2)
    with pytest.raises(InputError, match="closed-loop"):
        imc_gains(MODEL, closed_loop_time=0.0)
    for name in ("gain", "a1", "a2"):
        with pytest.raises(InputError, match="above 0"):
            dataclasses.replace(MODEL, **{name: -1.0})
