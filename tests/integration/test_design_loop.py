"""Identify the arm, design with python-control, close the loop, compare with the prediction."""

import control
import gymnasium
import numpy as np
import pytest

import pamsim
import pamsim.envs
from pamsim.controllers.imc_tuning import imc_gains_of_fit
from pamsim.controllers.model_based import linear_controller
from pamsim.envs.closed_loop import run_episode
from pamsim.identification.transfer_function import sampled_plants
from pamsim.recordings.trial import Trial, TrialSet

pytestmark = pytest.mark.slow

COMMON, GOAL = 300e3, 0.05  # Pa, rad
LEVELS = 20e3 * np.array([0, 1, 2, 1, 0, -1, -2, -1, 0])


@pytest.fixture(scope="module")
def identified():
    """The arm's rest angle, its fit over a staircase, and those of the staircase's steps."""
    command = COMMON + 0.5 * np.column_stack([LEVELS, -LEVELS])
    run = pamsim.simulate(
        pamsim.load_rig("mas20_arm"),
        pamsim.Experiment(
            drive="pressure_set",
            command_time=np.array([0.0, *(0.1 + np.arange(8))]),
            command_value=command,
            start_pressure=command[0],
            duration=8.1,
            sample_rate=50.0,
            load=1.2,
        ),
    )
    trial = Trial(
        name="staircase",
        protocol="staircase",
        drive=run.drive,
        load=run.load,
        time=run.time,
        command=run.command,
        measured=run.signals(),
    )
    result = pamsim.identify(
        TrialSet(rig="mas20_arm", trials=(trial,)),
        order=2,
        poles="any",
        dead_time="free",
        arx=(1, 1, 1),
        oe=(1, 1, 1),
    )
    return float(run.angle[0]), result.shown.fit, [m.fit for m in result.local.models]


def pid(fit, closed_loop_time):
    gains, s = imc_gains_of_fit(fit, closed_loop_time=closed_loop_time), control.tf("s")
    lead = gains.derivative_time * s / (0.05 * s + 1.0)
    return gains.gain * (1.0 + 1.0 / (gains.integral_time * s) + lead)


def simulated(controller, rest):
    """The arm's step under a controller, and the period."""
    rig = pamsim.load_rig("mas20_arm")
    env = gymnasium.make("pamsim/Rig-v0", task="regulation", load=1.2, max_episode_steps=80)
    lti = linear_controller(controller, rig, period=env.unwrapped.dt, common=COMMON, load=1.2)
    target = dict.fromkeys(rig.joints, rest + GOAL)
    run = run_episode(env, lti, 0, {"target": target})
    env.close()
    return (run.position[:, 0] - rest) / GOAL, run.period


def beyond(step, controller, period, fits, count):
    """By how much each sample of a step lies beyond the 95 % band of plants drawn from fits."""
    sampled = control.sample_system(control.ss(controller), period, method="tustin")
    rng, times = np.random.default_rng(0), period * np.arange(step.size + 1)
    plants = [p for fit in fits for p in sampled_plants(fit, count, rng, period=period)]
    steps = [
        control.step_response(control.feedback(sampled * plant, 1), times).outputs[1:]
        for plant in plants
    ]
    low, high = np.percentile(steps, [2.5, 97.5], axis=0)
    return np.maximum(np.maximum(low - step, step - high), 0.0)


@pytest.mark.parametrize("closed_loop_time", [0.15, 0.3])
def test_the_arms_step_lies_among_the_plants_of_the_operating_points(identified, closed_loop_time):
    rest, fit, local = identified
    controller = pid(fit, closed_loop_time)
    step, period = simulated(controller, rest)
    assert step[-1] == pytest.approx(1.0, abs=0.02)
    miss = beyond(step, controller, period, local, 4)
    assert np.mean(miss == 0.0) > 0.9
    assert np.max(miss) < 0.02
    # One model of the whole staircase averages over points that differ by more than its noise: its
    # own band is too narrow. docs/control.md says so.
    assert np.mean(beyond(step, controller, period, [fit], 30) == 0.0) < 0.7
