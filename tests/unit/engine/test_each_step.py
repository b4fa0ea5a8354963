"""What acts before every time step: when it is called, what it sees, what it moves."""

import dataclasses

import numpy as np

import pamsim
from pamsim.physics.record import slot

SIGNALS = ("angle", "velocity", "pressure", "tension", "final_state")


def valves(duration=0.2, settle=0.3):
    return pamsim.Experiment(
        drive="valve",
        command_time=np.array([0.0, 0.1]),
        command_value=np.array([[0.6, -0.8], [0.0, 0.3]]),
        start_pressure=np.array([3e5, 2e5]),
        duration=duration,
        settle=settle,
        sample_rate=200.0,
    )


def step():
    made = pamsim.pressure_step((3e5, 3e5), (4.5e5, 1e5), duration=0.2, load=1.2)
    return dataclasses.replace(made, settle=0.3)


def same(one, other):
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in SIGNALS)


def test_one_that_does_nothing_changes_nothing(rig):
    for changes, backend in (
        ({}, "compiled"),
        ({"valve.delay": 0.0133}, "compiled"),
        ({"friction.stribeck_force": 8.0}, "compiled"),
        ({"valve.delay": 0.0133, "friction.stribeck_force": 8.0}, "python"),
    ):
        there = rig.with_parameters(changes)
        for experiment in (valves(), step()):
            plain, watched = (
                pamsim.simulate(there, experiment, backend=backend, each_step=hook).completed()
                for hook in (None, lambda model, data: None)
            )
            assert same(plain, watched), (changes, backend)


def test_it_sees_every_step_once_with_the_command_and_negative_time_while_settling(rig):
    seen = []
    experiment = valves()
    pamsim.simulate(
        rig, experiment, each_step=lambda model, data: seen.append((data.time, *data.ctrl))
    )
    dt = rig.model.opt.timestep
    at_rest = [row for row in seen if row[0] < 0.0]
    under_way = np.array(seen[len(at_rest) :])
    assert at_rest[0][0] == -0.3
    assert {row[1:] for row in at_rest} == {(3e5, 2e5)}
    np.testing.assert_allclose(under_way[:, 0], dt * np.arange(round(0.2 / dt) + 1), atol=1e-9)
    commands = np.where(under_way[:, :1] < 0.1 - 1e-9, (0.6, -0.8), (0.0, 0.3))
    assert np.array_equal(under_way[:, 1:], commands)


def test_a_command_that_it_changes_acts_and_the_next_step_has_the_commanded_one_again(rig):
    commands = []

    def shut(model, data):
        if data.time >= 0.0:
            commands.append(tuple(data.ctrl))
            data.ctrl[:] = 0.0

    run = pamsim.simulate(rig, valves(), each_step=shut).completed()
    idle = dataclasses.replace(valves(), command_value=np.zeros((2, 2)))
    assert np.array_equal(run.angle, pamsim.simulate(rig, idle).angle)
    assert set(commands) == {(0.6, -0.8), (0.0, 0.3)}
    assert np.array_equal(run.command, pamsim.simulate(rig, valves()).command)


def test_tension_and_pressure_are_recorded_as_the_muscle_is_at_its_time(rig):
    """A parameter moved at half time: before and after, what the rig with that parameter has."""
    for changes in ({}, {"friction.stribeck_force": 8.0}):
        there = rig.with_parameters(changes)
        muscle = there.muscles["muscle_1"]
        scale, dead_volume = slot("force.scale", muscle), slot("chamber.dead_volume", muscle)

        def weaken(model, data, scale=scale):
            model.actuator_user[:, scale] = 1.0 if data.time < 0.1 - 1e-9 else 0.9

        def widen(model, data, dead_volume=dead_volume):
            if data.time > 0.1 - 1e-9:
                model.actuator_user[:, dead_volume] *= 1.01

        plain, weak, wide = (
            pamsim.simulate(there, valves(), each_step=hook).completed()
            for hook in (None, weaken, widen)
        )
        assert np.array_equal(weak.tension[:20], plain.tension[:20])
        assert np.all(weak.tension[20] < 0.95 * weak.tension[19])
        assert np.array_equal(wide.pressure[:20], plain.pressure[:20])
        assert np.all(wide.pressure[20] < plain.pressure[20])
