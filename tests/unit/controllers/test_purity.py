"""Every controller is a pure function: memory in, memory out, nothing kept, nothing changed."""

from __future__ import annotations

import copy
import math
import pickle

import control
import pytest

import pamsim
from pamsim.controllers.cascade import Cascade, PressureLoop
from pamsim.controllers.controller import PressureSplit
from pamsim.controllers.feed_forward import FeedForward
from pamsim.controllers.imc_tuning import PidGains
from pamsim.controllers.lead_lag_design import design_lead_lag
from pamsim.controllers.model_based import Lqg, Lti, SlidingMode, lead_lag
from pamsim.controllers.pid import GainSchedule, Pid
from pamsim.controllers.regulator_design import design_regulator
from pamsim.controllers.sampled_controller import sampled_controller
from pamsim.physics.hysteresis.prandtl_ishlinskii import PlaySum
from tests.unit.controllers.closed_loop import LEVEL, PERIOD, SUPPLY, observe
from tests.unit.controllers.linear_plant import MODEL, POINT

PID = Pid(
    split=PressureSplit(common=LEVEL, supply=SUPPLY),
    period=PERIOD,
    gain=4e5,
    integral_time=0.2,
    derivative_time=0.1,
    filter_time=0.01,
    tracking_time=0.5,
)
SOFT, HARD = (PidGains(gain=g, integral_time=0.1, derivative_time=0.05) for g in (1e5, 4e5))
PLAYS = PlaySum(linear=0.6, thresholds=(0.02, 0.1), weights=(0.3, 0.2))


def _forward():
    return FeedForward.for_rig(
        pamsim.load_rig("mas20_arm"),
        load=1.2,
        common_pressure=LEVEL,
        hysteresis=PLAYS.inverse(),
        feedback=PID,
    )


def _lqg():
    design = design_regulator(
        MODEL,
        period=PERIOD,
        largest_error=0.03,
        largest_input=3e4,
        input_noise=1e4,
        output_noise=1e-3,
    )
    return Lqg(design=design, point=POINT)


def _lead_lag():
    design = design_lead_lag(MODEL, period=PERIOD, crossover=14.0, phase_margin=0.8)
    return lead_lag(design, MODEL, POINT)


def _cascade():
    inner = PressureLoop(period=PERIOD, gain=2e-6, integral_time=0.3, tracking_time=0.3)
    return Cascade(outer=PID, inner=inner)


MADE = {
    "pid": lambda: PID,
    "cascade": _cascade,
    "feed forward": _forward,
    "lqg": _lqg,
    "lead-lag": _lead_lag,
    "sliding mode": lambda: SlidingMode(
        model=MODEL, point=POINT, period=PERIOD, bandwidth=6.0, reach=4.0, layer=1.0
    ),
    "lti": lambda: Lti(
        design=sampled_controller(control.tf([8e3, 1.2e5, 9e5], [0.01, 1.0, 0.0]), PERIOD),
        point=POINT,
    ),
    "schedule": lambda: GainSchedule(pid=PID, by="angle", points=(0.0, 0.2), gains=(SOFT, HARD)),
}


def _seen(k):
    return observe(
        angle=0.1 * math.sin(0.3 * k),
        velocity=math.cos(0.3 * k),
        pressure=(LEVEL + 2e4 * math.sin(0.2 * k), LEVEL - 1e4 * math.cos(0.5 * k)),
        wanted=(0.2 * math.sin(0.1 * k), 0.3, -0.5),
    )


def _go_on(controller, memory, start, count):
    commands = []
    for k in range(start, start + count):
        command, memory = controller.step(_seen(k), memory)
        commands.append(command)
    return commands, memory


@pytest.mark.parametrize("name", MADE)
def test_a_memory_can_be_copied_and_continued(name):
    controller = MADE[name]()
    _, memory = _go_on(controller, controller.start(_seen(0)), 0, 20)
    before = pickle.dumps(memory)
    once, _ = _go_on(controller, memory, 20, 20)
    assert pickle.dumps(memory) == before
    again, _ = _go_on(controller, copy.deepcopy(memory), 20, 20)
    stranger, _ = _go_on(MADE[name](), pickle.loads(before), 20, 20)
    assert once == again == stranger
    assert len(set(once)) == 20


@pytest.mark.parametrize("name", MADE)
def test_commands_can_be_had(name):
    controller = MADE[name]()
    commands, _ = _go_on(controller, controller.start(_seen(0)), 0, 200)
    low, high = (0.0, SUPPLY) if controller.command == "pressure_set" else (-1.0, 1.0)
    assert all(low <= value <= high for command in commands for value in command)
