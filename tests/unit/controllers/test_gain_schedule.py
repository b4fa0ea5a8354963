"""Scheduled gains: those of a model at its point, lines between, constant beyond."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pamsim.controllers.controller import PressureSplit
from pamsim.controllers.imc_tuning import imc_gains_of_fit
from pamsim.controllers.pid import GainSchedule, Pid
from pamsim.core.errors import InputError
from pamsim.linear.continuous_fit import fit_continuous
from pamsim.linear.local_models import LocalModel, OperatingPoint, local_model_map
from tests.unit.controllers.closed_loop import LEVEL, PERIOD, SUPPLY, observe
from tests.unit.linear.planted import record

PLACES = (-1e5, 0.0, 1e5)
PID = Pid(
    split=PressureSplit(common=LEVEL, supply=SUPPLY), period=PERIOD, gain=1.0, tracking_time=0.5
)


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
