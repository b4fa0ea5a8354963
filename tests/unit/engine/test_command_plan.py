"""When a late command reaches the valves, against the command looked up at every time."""

import numpy as np

from pamsim.engine.command_plan import arriving, command_plan
from pamsim.physics.valves import ValvePair
from pamsim.recordings.experiment import Experiment

DT, STEPS, SAMPLES = 5e-4, 4, 30
PAIR = {
    "conductance_fill": 5e-10,
    "conductance_exhaust": 5e-10,
    "critical_ratio": 0.3,
    "supply_pressure": 6e5,
}
BEFORE = (2e5, 3e5)
RNG = np.random.default_rng(9)
COMMANDS = np.repeat(RNG.uniform(0.0, 6e5, (10, 2)), 3, axis=0)


def planned(delays, drive="pressure_set", commands=COMMANDS, longer=(0.0, 0.0)):
    valves = [
        ValvePair(**PAIR, delay=late, closing_delay=more)
        for late, more in zip(delays, longer, strict=True)
    ]
    experiment = Experiment(
        drive=drive,
        command_time=STEPS * DT * np.arange(SAMPLES),
        command_value=commands,
        start_pressure=np.array(BEFORE),
        duration=SAMPLES * STEPS * DT,
    )
    return command_plan(experiment, commands, valves, np.empty(0, dtype=bool), DT, STEPS)


def test_every_time_hears_what_was_commanded_a_delay_ago():
    for delays in (
        (0.0, 0.0), (2e-3, 5e-4), (1.3e-4, 0.0), (0.0137, 0.0041), (3.3e-4, 3.3e-4), (0.9, 0)
    ):  # fmt: skip
        plan = planned(delays)
        ends = np.cumsum(plan.steps * plan.timestep)
        np.testing.assert_allclose(ends[plan.first[1:] - 1], STEPS * DT * np.arange(1, SAMPLES + 1))
        assert np.all((plan.timestep > 0.0) & (plan.timestep <= DT))
        for share in (0.001, 0.5, 0.999):  # an edge lies at no place but an end
            at = ends - (1.0 - share) * plan.steps * plan.timestep
            for muscle, delay in enumerate(delays):
                sample = np.floor((at - delay) / (STEPS * DT)).astype(int)
                held = np.append(BEFORE[muscle], COMMANDS[:, muscle])
                assert np.array_equal(plan.command[:, muscle], held[np.maximum(sample + 1, 0)])


def test_delays_of_whole_steps_divide_none():
    for delays in ((0.0, 0.0), (5e-4, 2e-3), (0.0215, 0.043)):  # the last two not exactly in floats
        plan = planned(delays)
        assert set(plan.timestep) == {DT}
        assert plan.steps.sum() == SAMPLES * STEPS


def test_changes_that_arrive_together_but_for_rounding_make_no_tiny_step():
    values = np.arange(40.0).reshape(20, 2)
    edges, _ = arriving(values, np.zeros(2), np.array([0.1 + 0.2, 4.3]), STEPS)
    assert np.diff(edges).min() > 0.1


def test_a_measured_pressure_is_never_late():
    late, plain = planned((3e-3, 0.0), "measured"), planned((0.0, 0.0), "measured")
    assert all(np.array_equal(one, other) for one, other in zip(late, plain, strict=True))
    assert np.array_equal(plain.first, STEPS * np.arange(SAMPLES + 1))


def test_a_valve_hears_the_latest_command_that_has_arrived():
    rng, sample = np.random.default_rng(3), STEPS * DT
    for _ in range(100):
        commands = rng.choice([0.0, 0.3, -0.3, 0.8], (SAMPLES, 2), p=[0.4, 0.2, 0.2, 0.2])
        late, longer = rng.uniform(0.0, 3.0 * sample, 2), rng.uniform(0.0, 5.0 * sample, 2)
        plan = planned(late, "valve", commands, longer)
        length = plan.steps * plan.timestep
        near, far = (np.cumsum(length) - share * length for share in (0.999, 0.001))
        for muscle in range(2):
            sent = np.append(0.0, commands[:, muscle])
            smaller = np.abs(sent[1:]) < np.abs(sent[:-1])
            arrival = sample * np.arange(SAMPLES) + late[muscle] + longer[muscle] * smaller
            arrival[np.diff(sent) == 0.0] = np.inf  # the same command again
            for at in (near, far):
                here = np.append(-np.inf, arrival) <= at[:, None]
                latest = SAMPLES - np.argmax(here[:, ::-1], axis=1)
                assert np.array_equal(plan.command[:, muscle], sent[latest])


def test_set_points_are_no_openings():
    plain, longer = planned((0.0, 0.0)), planned((0.0, 0.0), longer=(5e-3, 5e-3))
    assert all(np.array_equal(one, other) for one, other in zip(plain, longer, strict=True))
