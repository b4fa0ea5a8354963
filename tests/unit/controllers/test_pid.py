"""PID and its gains: rest, jumps of the reference, limits; IMC and schedules over models."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pamsim.controllers.controller import PressureSplit, present_reference
from pamsim.controllers.imc_tuning import imc_gains, imc_gains_of_fit
from pamsim.controllers.pid import GainSchedule, Pid
from pamsim.core.errors import InputError
from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.discrete import DiscreteStructure
from pamsim.identification.fit import fit
from pamsim.identification.local_models import LocalModel, OperatingPoint, local_model_map
from tests.unit.controllers.closed_loop import LEVEL, MODEL, PERIOD, SPLIT, observe
from tests.unit.core.refusals import refused
from tests.unit.identification.planted import fit_continuous, record

PI = Pid(split=SPLIT, period=PERIOD, gain=2e6, integral_time=0.5, tracking_time=0.2)
LAG, GAIN = 0.5, 1e-6  # of a plant T y' = K dp - y [s, rad/Pa]


@given(st.floats(0.0, 6e5), st.floats(-2e6, 2e6), st.floats(-2e6, 2e6))
def test_a_split_keeps_mean_and_difference_inside_the_limits_and_gives_no_more(common, one, two):
    split = PressureSplit(common=common, supply=6e5)
    first, second = split.pressures(one)
    assert 0.0 <= min(first, second) <= max(first, second) <= 6e5
    if abs(one) / 2.0 <= min(common, 6e5 - common):
        assert not split.beyond(one)
        assert first + second == pytest.approx(2.0 * common)
        assert split.given(one) == pytest.approx(one, abs=1e-9)
    assert (split.given(one) - split.given(two)) * (one - two) >= 0.0
    assert abs(split.given(one)) <= abs(one) + 1e-9
    if abs(split.given(one)) < abs(one) - 1e-6:
        assert split.beyond(one)


def test_under_constant_acceleration_the_present_reference_is_exact():
    def motion(t):
        return 0.2 + 0.7 * t - 1.5 * t * t, 0.7 - 3.0 * t, -3.0

    for period in (0.01, 0.3):
        later = observe(wanted=motion(0.4 + period)).joint
        assert present_reference(later, period) == pytest.approx(motion(0.4)[:2])


def lagged(pid, wanted, samples, angle, memory):
    """Angle after some samples on the lag, with the memory there."""
    keep = math.exp(-PERIOD / LAG)
    for _ in range(samples):
        observation = observe(angle=angle, wanted=(wanted, 0.0, 0.0))
        (first, second), memory = pid.step(observation, memory)
        angle = keep * angle + (1.0 - keep) * GAIN * (first - second)
    return angle, memory


def test_it_recovers_within_a_time_constant_where_plain_integration_stays_at_the_limit():
    reach, left = 2.0 * LEVEL * GAIN, []
    for pid in (PI, dataclasses.replace(PI, tracking_time=math.inf)):
        angle, memory = lagged(pid, 2.0 * reach, 500, 0.0, pid.start(observe()))
        assert angle == pytest.approx(reach, rel=1e-3)
        # One time constant after an unreachable reference came back into reach.
        left.append(lagged(pid, 0.2 * reach, round(LAG / PERIOD), angle, memory)[0] / reach)
    assert abs(left[0] - 0.2) < 0.2 * 0.8
    assert left[1] > 0.99


def test_the_integral_takes_the_offset():
    angle, _ = lagged(PI, 0.3, 500, 0.0, PI.start(observe()))
    assert angle == pytest.approx(0.3, abs=1e-6)
    proportional = dataclasses.replace(PI, integral_time=math.inf)
    angle, _ = lagged(proportional, 0.3, 500, 0.0, proportional.start(observe()))
    assert angle == pytest.approx(0.3 * PI.gain * GAIN / (1.0 + PI.gain * GAIN), rel=1e-6)
    rest = observe(angle=0.2, pressure=(4e5, 2e5), wanted=(0.2, 0.0, 0.0))
    assert PI.step(rest, PI.start(rest))[0] == pytest.approx((4e5, 2e5))  # it keeps what there is


def difference(pid, memory=None, **seen):
    command, _ = pid.step(observe(**seen), memory or pid.start(observe()))
    return command[0] - command[1]


def test_the_derivative_brakes_through_a_lag_what_the_weight_leaves_of_the_wanted_rate():
    pid = dataclasses.replace(PI, derivative_time=0.3, filter_time=0.01)
    # A jump of the reference kicks by the gain alone.
    assert difference(pid, wanted=(0.01, 0.0, 0.0)) == pytest.approx(0.01 * pid.gain)
    for weight in (0.0, 1.0):
        pid = dataclasses.replace(PI, derivative_time=0.3, rate_weight=weight)
        # At the next sample the reference is one period further: no error at this one.
        braked = difference(pid, velocity=0.5, wanted=(0.5 * PERIOD, 0.5, 0.0))
        assert braked == pytest.approx(-pid.gain * 0.3 * 0.5 * (1.0 - weight), abs=1e-6)
    pid = dataclasses.replace(PI, integral_time=math.inf, derivative_time=0.1, filter_time=0.1)
    memory, rates = pid.start(observe()), []
    for _ in range(6):
        _, memory = pid.step(observe(velocity=1.0), memory)
        rates.append(1.0 - memory.rate)
    left = pid.filter_time / (pid.filter_time + PERIOD)
    assert rates == pytest.approx([left ** (k + 1) for k in range(6)])


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
    return GainSchedule.from_models(found, pid=PID, closed_loop_time=0.2, at=(*PLACES, 3e5))


def test_at_a_models_own_point_the_gains_are_its_own_and_lie_on_lines_between(found, schedule):
    assert schedule.points == PLACES  # the fit that cannot be trusted is not among them
    for place, item in zip(PLACES, found.models, strict=False):
        assert schedule.at(place) == imc_gains_of_fit(item.fit, closed_loop_time=0.2)
        observation = observe(angle=0.1, pressure=(LEVEL + place / 2.0, LEVEL - place / 2.0))
        own = dataclasses.replace(PID, **dataclasses.asdict(schedule.at(place)))
        memory = schedule.start(observation)
        assert schedule.step(observation, memory) == own.step(observation, memory)
    halfway = schedule.at(0.25e5)
    for name in ("gain", "integral_time", "derivative_time"):
        low, high = (getattr(item, name) for item in schedule.gains[1:])
        assert getattr(halfway, name) == pytest.approx(0.75 * low + 0.25 * high)
    assert (schedule.at(-9e5), schedule.at(9e5)) == (schedule.gains[0], schedule.gains[-1])


def test_the_integral_part_does_not_jump_with_the_gains(schedule):
    rest = {"angle": 0.1, "wanted": (0.1, 0.0, 0.0)}
    one, other = (observe(pressure=p, **rest) for p in ((4e5, 2e5), (2e5, 4e5)))
    memory = schedule.start(one)
    assert schedule.step(one, memory)[0] == schedule.step(other, memory)[0]


def test_by_angle_the_gains_depend_on_the_angle(found):
    angles = np.radians([-20.0, 0.0, 20.0, 60.0]).tolist()
    by_angle = GainSchedule.from_models(found, pid=PID, closed_loop_time=0.2, by="angle", at=angles)
    assert by_angle.points == tuple(angles[:3])
    seen = {"angle": angles[2], "pressure": (2e5, 4e5), "wanted": (angles[2] + 0.01, 0.0, 0.0)}
    memory = by_angle.start(observe(**seen))
    extra = difference(by_angle, memory, **seen) - memory.integral
    assert extra == pytest.approx(0.01 * by_angle.gains[2].gain, rel=1e-6)


def test_imc_makes_the_open_loop_an_integrator_of_the_wanted_speed():
    s = 1j * np.geomspace(0.1, 100.0, 20)
    plant = MODEL.gain / (MODEL.a2 * s**2 + MODEL.a1 * s + 1.0)
    for late in (0.0, 0.03):
        gains = imc_gains(MODEL, closed_loop_time=0.1, dead_time=late)
        pid = gains.gain * (1.0 + 1.0 / (gains.integral_time * s) + gains.derivative_time * s)
        np.testing.assert_allclose(pid * plant, 1.0 / ((0.1 + late) * s), rtol=1e-12)
    given = [record(1, gain=2.0, noise=0.01, n=300)]
    one, two = (fit_continuous(given, order=order) for order in (1, 2))
    gains = imc_gains_of_fit(one, closed_loop_time=0.2)
    assert gains.integral_time == one.time_constants[0]
    assert gains.gain == pytest.approx(one.time_constants[0] / (0.2 * one.gain))
    both = imc_gains_of_fit(two, closed_loop_time=0.2).integral_time
    assert both == pytest.approx(sum(two.time_constants))
    with refused("no zero"):
        imc_gains_of_fit(fit_continuous(given, order=2, zeros=1), closed_loop_time=0.2)
    for other in (
        ContinuousStructure(0, integrators=1),
        ContinuousStructure(1, integrators=1),
        DiscreteStructure("arx", 1, 1, 1, given[0].sample_time),
        DiscreteStructure("oe", 2, 1, 1, given[0].sample_time),
    ):
        with refused(other.sentence, "order=2"):
            imc_gains_of_fit(fit(given, other), closed_loop_time=0.2)


def test_what_is_no_pid_and_no_schedule_is_refused(found, schedule):
    with refused("closed-loop"):
        imc_gains(MODEL, closed_loop_time=0.0)
    with refused("closed-loop"):
        imc_gains_of_fit(found.models[0].fit, closed_loop_time=-0.1)
    with refused("values for"):
        GainSchedule.from_models(found, pid=PID, closed_loop_time=0.2, at=(0.0,))
    late = {"tracking_time": 0.5 * PERIOD}
    for made, bad, word in (
        (schedule, {"by": "presure"}, "difference"),
        (schedule, {"points": PLACES[::-1]}, "increasing"),
        (MODEL, {"gain": -1.0}, "above 0"),
        (MODEL, {"a1": -1.0}, "above 0"),
        (MODEL, {"a2": -1.0}, "above 0"),
        (PI, {"period": 0.0}, "period"),
        (PI, {"integral_time": 0.0}, "integral_time"),
        (PI, {"derivative_time": -1.0}, "derivative_time"),
        (PI, late, "tracking_time"),
        (SPLIT, {"common": -1.0}, "common pressure"),
        (SPLIT, {"common": 6.1e5}, "common pressure"),
        (SPLIT, {"common": math.nan}, "common pressure"),
    ):
        with pytest.raises(InputError, match=word):
            dataclasses.replace(made, **bad)
