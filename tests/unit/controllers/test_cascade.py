"""Pressure loops: their limits, their place on the rig, and the valves' speed they rest on."""

import dataclasses
import math

import numpy as np
import pytest

import pamsim
from pamsim.controllers.cascade import Cascade, PressureLoop, full_rates, regulated_lag
from pamsim.controllers.feed_forward import FeedForward
from pamsim.controllers.joint_control import JointControl
from pamsim.controllers.pid import Pid
from pamsim.core.errors import InputError
from pamsim.physics.record import parameters
from tests.unit.controllers.closed_loop import (
    LEVEL,
    PERIOD,
    SPLIT,
    SUPPLY,
    constant,
    miss,
    observe,
    run,
    sine,
)
from tests.unit.core.refusals import refused

LOOP = PressureLoop(period=PERIOD, gain=5e-5, integral_time=0.3, tracking_time=0.3)


def filled(loop, goal, samples, pressure, integral):
    """Pressure after some samples in a chamber that fills at 300 kPa/s at full opening."""
    for _ in range(samples):
        opening, integral = loop.opening(goal - pressure, integral)
        assert abs(opening) <= 1.0
        pressure += 3e5 * PERIOD * opening
    return pressure, integral


def test_it_recovers_from_a_full_opening_where_plain_integration_overshoots():
    wound = dataclasses.replace(LOOP, tracking_time=math.inf)
    ends = []
    for loop in (LOOP, wound):
        pressure, integral = filled(loop, 4e5, 60, 0.0, 0.0)
        ends.append(filled(loop, 4e5, 20, pressure, integral)[0])
    assert abs(ends[0] - 4e5) < 1.5e4
    assert ends[1] > 4.5e5


def test_the_valves_are_as_fast_as_it_takes_them_to_be(rig):
    m = parameters(rig.muscles["muscle_1"])
    rates = full_rates(m, 0.0, LEVEL)
    for opening, rate in zip((1.0, -1.0), rates, strict=True):
        experiment = pamsim.Experiment(
            drive="valve",
            command_time=np.zeros(1),
            command_value=np.full((1, 2), opening),  # both equal: the arm stays
            start_pressure=np.full(2, LEVEL),
            duration=0.01,
            sample_rate=1000.0,
        )
        pressure = pamsim.simulate(rig, experiment).pressure[:, 0]
        assert (pressure[4] - pressure[0]) / 4e-3 == pytest.approx(rate, rel=0.02)
    band = rig.muscles["muscle_1"].valve.regulator_band
    assert regulated_lag(m, 0.0, LEVEL) == pytest.approx(0.5 * (band / rates[0] + band / -rates[1]))


def test_a_loop_is_designed_for_the_muscle_at_its_length(tmp_path):
    # Its cable, from site to site, is 0.3 m long at first: at 0 m the muscle would hold no air.
    bench = pamsim.load_rig(pamsim.new_rig("bench", kind="bench", out=tmp_path / "bench"))
    low, time = 50e3, 0.04  # Pa, s
    fill = pamsim.Experiment(
        drive="valve",
        command_time=np.zeros(1),
        command_value=np.ones((1, 1)),
        start_pressure=np.array([low]),
        duration=0.01,
        sample_rate=1000.0,
        load=100.0,  # holds the rail at its lower end, where it is at first
    )
    pressure = pamsim.simulate(bench, fill).pressure[:, 0]
    (loop,) = PressureLoop.for_rig(bench, period=PERIOD, common_pressure=low, closed_loop_time=time)
    assert (pressure[4] - pressure[0]) / 4e-3 == pytest.approx(1.0 / (loop.gain * time), rel=0.02)
    control = JointControl.for_rig(bench, closed_loop_time=0.1, common_pressure=low)
    band = bench.muscles["lifter"].valve.regulator_band
    assert control.laws[0].integral_time > 0.5 * band * loop.gain * time


class Held:
    """Commands the same pressure of both muscles."""

    command = "pressure_set"

    def start(self, first):
        return ()

    def step(self, observation, memory):
        return (LEVEL, LEVEL), memory


def test_muscles_with_other_valves_have_a_loop_each(rig):
    """With the loop of the other, the pressure behind a narrow valve would follow as late."""
    narrow = {
        f"muscle_2:valve.{name}": 0.3 * getattr(rig.muscles["muscle_2"].valve, name)
        for name in ("conductance_fill", "conductance_exhaust")
    }
    pair = rig.with_parameters(narrow)
    time = 0.04
    inner = PressureLoop.for_rig(pair, period=PERIOD, common_pressure=LEVEL, closed_loop_time=time)
    assert inner[1].gain == pytest.approx(inner[0].gain / 0.3, rel=1e-6)
    cascade = Cascade(outer=Held(), inner=inner)
    rates = [full_rates(parameters(muscle), 0.0, LEVEL) for muscle in pair.muscles.values()]
    fastest = np.array([max(fill, -exhaust) for fill, exhaust in rates])
    pressure = np.full(2, LEVEL - 2e3)  # so near that neither valve opens fully
    memory = cascade.start(observe(pressure=tuple(pressure)))
    for _ in range(round(time / PERIOD)):
        openings, memory = cascade.step(observe(pressure=tuple(pressure)), memory)
        pressure += fastest * PERIOD * np.array(openings)
    assert pressure[1] == pytest.approx(pressure[0], abs=1.0)
    assert pressure[0] > LEVEL - 1e3


def test_it_brings_the_pressures_where_the_angle_controller_wants_them(rig):
    forward = FeedForward.for_rig(rig, load=1.2, common_pressure=LEVEL, lead=0.04)
    inner = PressureLoop.for_rig(rig, period=PERIOD, common_pressure=LEVEL, closed_loop_time=0.04)
    cascade = Cascade(outer=forward, inner=inner)
    assert cascade.command == "valve"
    still = run(rig, cascade, constant(0.15), 2.5)
    goal, _ = forward.ahead(observe(angle=0.15, wanted=(0.15, 0.0, 0.0)), ())
    np.testing.assert_allclose(still.pressure[-1], goal, atol=2e3)
    assert miss(run(rig, cascade, sine(0.5, 10.0), 4.0), after=2.0) < math.radians(0.6)


def test_what_does_not_fit_is_refused(rig):
    outer = Pid(split=SPLIT, period=PERIOD, gain=1e5)
    with pytest.raises(InputError, match="must command pressure"):
        Cascade(outer=Cascade(outer=outer, inner=(LOOP, LOOP)), inner=(LOOP, LOOP))
    with pytest.raises(InputError, match="samples every"):
        PressureLoop.for_rig(rig, period=PERIOD, common_pressure=LEVEL, closed_loop_time=0.03)
    # At an end of the supply valves can only raise a pressure, or only lower it.
    for end in (0.0, SUPPLY):
        with refused(f"of {end / 1e3:g} kPa", "supply's 600 kPa"):
            FeedForward.for_rig(rig, common_pressure=end)
