"""A batch is the same simulations, only sooner."""

from __future__ import annotations

import dataclasses
import itertools
import threading

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.engine.batch import simulate_batch
from pamsim.recordings.recording import Outcome

SIGNALS = ("time", "angle", "velocity", "pressure", "tension", "command", "final_state")


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("mas20_arm")


def valves(load=0.0, duration=0.3, settle=0.3, command="valve"):
    return pamsim.Experiment(
        drive=command,
        command_time=np.array([0.0, 0.1, 0.17]),
        command_value=np.array([[0.6, -1.0], [0.0, 0.3], [-0.5, 0.0]]),
        start_pressure=np.array([3e5, 2e5]),
        duration=duration,
        settle=settle,
        load=load,
    )


def pressures(load=0.0, duration=0.2, settle=0.3):
    step = pamsim.pressure_step((4e5, 4e5), (4e5, 1e5), duration=duration, load=load)
    return dataclasses.replace(step, settle=settle)


def assert_same(one, other):
    assert (one.outcome, one.message, one.meta) == (other.outcome, other.message, other.meta)
    assert (one.load, one.drive) == (other.load, other.drive)
    for name in SIGNALS:
        assert np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True), name


@pytest.mark.parametrize("threads", [1, 3])
def test_a_batch_equals_its_simulations_to_the_last_bit(rig, threads):
    heavier = rig.with_parameters(
        {"joint.shaft.damping": 0.3, "muscle_2:chamber.dead_volume": 3e-5}
    )
    sprocket = rig.with_parameters({"tendon.chain_1.coef": 0.015, "body.rig.tilt": 0.1})
    jobs = [
        (rig, valves()),
        (rig, valves(load=2.14)),
        (rig, pressures(duration=0.5)),
        (heavier, valves()),
        (heavier, valves(command="pulse", duration=0.4)),
        (sprocket, pressures(load=1.2)),
        (sprocket, pressures(load=1.2, settle=0.0)),
    ]
    batch = simulate_batch(jobs, threads=threads)
    assert len(batch) == len(jobs)
    for job, found in zip(jobs, batch, strict=True):
        assert_same(found, pamsim.simulate(*job))
    assert len({found.angle[-1] for found in batch}) == len(jobs)  # no two were mixed up


def test_a_shared_start_leaves_no_trace_of_the_other_experiment(rig):
    """The same start, but other kinds of command: the settled state must not carry any."""
    step = pressures()
    same_start = dataclasses.replace(valves(), start_pressure=step.start_pressure)
    measured = dataclasses.replace(step, drive="measured")
    alone = {id(e): pamsim.simulate(rig, e) for e in (step, same_start, measured)}
    for order in itertools.permutations((step, same_start, measured)):
        batch = simulate_batch([(rig, e) for e in order])
        for experiment, found in zip(order, batch, strict=True):
            assert_same(found, alone[id(experiment)])


def test_one_rest_serves_all_with_the_same_start(rig, monkeypatch):
    settled = []
    monkeypatch.setattr(
        "pamsim.engine.state.settle",
        lambda model, data, experiment, on: settled.append(experiment),
    )
    changed = rig.with_parameters({"passive.stiffness": 3e4})
    other = dataclasses.replace(valves(), start_pressure=np.array([3e5, 2.5e5]))
    jobs = [(rig, valves()), (rig, valves(command="pulse")), (changed, valves())]
    jobs += [(rig, valves(load=1.0)), (rig, other), (rig, valves(settle=0.5))]
    simulate_batch(jobs)
    assert len(settled) == len(jobs) - 1


@pytest.mark.usefixtures("unchecked")
def test_a_run_that_breaks_down_leaves_the_others_whole(rig):
    """Stretched until a muscle has no volume left, its state is lost."""
    loose = rig.with_parameters(
        {
            "force.a": 0.0,
            "braid.diameter": 0.01,
            "valve.conductance_exhaust": 3e-9,
            "passive.stiffness": 0.0,
            "chamber.dead_volume": 0.0,
            "muscle_2:mounting.length_at_zero": 0.24,
            "tendon.chain_1.coef": 0.05,
            "tendon.chain_2.coef": 0.05,
        }
    )
    fling = dataclasses.replace(
        pamsim.pressure_step((2e5, 2e5), (6e5, 0.0), duration=0.6), settle=0.3
    )
    jobs = [(rig, valves()), (loose, fling), (rig, fling)]
    batch = simulate_batch(jobs, threads=2)
    for job, found in zip(jobs, batch, strict=True):
        assert_same(found, pamsim.simulate(*job))
        # With a hook, every sample is taken by the loop in Python.
        assert_same(found, pamsim.simulate(*job, each_step=lambda model, data: None))
    assert [found.outcome is Outcome.COMPLETED for found in batch] == [True, False, True]
    assert 1 < len(batch[1].time) < 300  # in the middle of the run


def test_a_warning_while_settling_is_not_lost(rig, monkeypatch):
    def warned(model, data, experiment, on):
        data.warning[mujoco.mjtWarning.mjWARN_BADQVEL].number = 1

    monkeypatch.setattr("pamsim.engine.state.settle", warned)
    (found,) = simulate_batch([(rig, valves())])
    assert found.outcome is Outcome.ENGINE_WARNING
    assert "BADQVEL" in found.message
    assert len(found.time) == 0


def test_time_step_is_passed_on(rig):
    (found,) = simulate_batch([(rig, pressures())], timestep=2.5e-4)
    assert_same(found, pamsim.simulate(rig, pressures(), timestep=2.5e-4))
    assert found.meta["timestep_s"] == 2.5e-4


def test_no_more_threads_than_asked_for(rig, monkeypatch):
    seen = set()
    real = mujoco.mj_step

    def watched(*args):
        seen.add(threading.get_ident())
        real(*args)

    monkeypatch.setattr(mujoco, "mj_step", watched)
    simulate_batch([(rig, valves(load=load)) for load in (0.0, 0.5, 1.0, 1.5)], threads=1)
    assert len(seen) == 1


def test_an_empty_batch_is_empty_and_bad_ones_are_refused(rig):
    assert simulate_batch([]) == []
    with pytest.raises(InputError, match="0 threads"):
        simulate_batch([(rig, valves())], threads=0)
    with pytest.raises(InputError, match="sampling period"):
        simulate_batch([(rig, dataclasses.replace(valves(), sample_rate=333.0))])


def test_resting_early_is_resting(rig):
    """The start that ends early, once at rest, differs from a much longer one by rounding only."""
    step = pressures(duration=0.1)
    early = pamsim.simulate(rig, dataclasses.replace(step, settle=4.0))
    late = pamsim.simulate(rig, dataclasses.replace(step, settle=12.0))
    np.testing.assert_allclose(early.angle, late.angle, atol=1e-8)
    np.testing.assert_allclose(early.pressure, late.pressure, rtol=1e-7)


def test_a_rig_that_still_moves_does_not_count_as_at_rest(rig):
    """A shaft that its damping lets creep for seconds: there, the whole time asked for is taken."""
    creeping = rig.with_parameters({"joint.shaft.damping": 10.0})
    empty = pamsim.pressure_step((1e5, 0.0), (0.0, 0.0), duration=0.1)
    short, long = (
        pamsim.simulate(creeping, dataclasses.replace(empty, settle=settle))
        for settle in (1.0, 3.0)
    )
    assert abs(long.angle[0] - short.angle[0]) > 1e-3


def test_one_muscle_s_own_value_counts_in_either_order():
    rig = pamsim.load_rig("mas20_arm")
    values = {"valve.conductance_fill": 4e-10, "muscle_2:valve.conductance_fill": 3e-10}
    for order in (values, dict(reversed(values.items()))):
        found = [m.valve.conductance_fill for m in rig.with_parameters(order).muscles.values()]
        assert found == [4e-10, 3e-10]
