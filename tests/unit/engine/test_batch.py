"""A batch is the same simulations, only sooner; what makes a run break off, where, and its name."""

import dataclasses
import itertools

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.engine.batch import simulate_batch
from pamsim.engine.sampling import Trace, first_breakdown
from pamsim.engine.state import RestSteps
from pamsim.recordings.recording import Outcome

SIGNALS = ("time", "angle", "velocity", "pressure", "tension", "command", "final_state")


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


def test_a_batch_equals_its_simulations_to_the_last_bit(rig):
    heavier = rig.with_parameters(
        {"joint.shaft.damping": 0.3, "muscle_2:chamber.dead_volume": 3e-5}
    )
    sprocket = rig.with_parameters({"tendon.chain_1.coef": 0.015, "body.rig.tilt": 0.1})
    jobs = [
        (rig, valves()),
        (rig, valves(load=2.14)),
        (rig, pressures(duration=0.5)),
        (heavier, valves(command="pulse", duration=0.4)),
        (sprocket, pressures(load=1.2)),
        (sprocket, pressures(load=1.2, settle=0.0)),
    ]
    for threads in (1, 3):
        batch = simulate_batch(jobs, threads=threads)
        for job, found in zip(jobs, batch, strict=True):
            assert_same(found, pamsim.simulate(*job))
        assert len({found.angle[-1] for found in batch}) == len(jobs)  # no two were mixed up
    (found,) = simulate_batch([(rig, pressures())], timestep=2.5e-4)
    assert_same(found, pamsim.simulate(rig, pressures(), timestep=2.5e-4))
    assert found.meta["timestep_s"] == 2.5e-4


def test_rigs_of_one_file_whose_memories_differ_in_size_go_together(rig):
    few = rig.with_parameters({"hysteresis.maxwell_slip.elements": 3, "hysteresis.force": 20.0})
    many = few.with_parameters({"hysteresis.elements": 30})
    assert few.file is many.file
    assert few.model.na < many.model.na
    for jobs in itertools.permutations([(few, pressures()), (many, pressures())]):
        for job, found in zip(jobs, simulate_batch(jobs, threads=1), strict=True):
            assert_same(found, pamsim.simulate(*job))


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
        "pamsim.engine.batch.settle",
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

    monkeypatch.setattr("pamsim.engine.batch.settle", warned)
    (found,) = simulate_batch([(rig, valves())])
    assert found.outcome is Outcome.ENGINE_WARNING
    assert "BADQVEL" in found.message
    assert len(found.time) == 0


def test_an_empty_batch_is_empty_and_bad_ones_are_refused(rig):
    assert simulate_batch([]) == []
    with pytest.raises(InputError, match="0 threads"):
        simulate_batch([(rig, valves())], threads=0)
    with pytest.raises(InputError, match="sampling period"):
        simulate_batch([(rig, dataclasses.replace(valves(), sample_rate=333.0))])


def test_a_rig_that_still_moves_does_not_count_as_at_rest(rig):
    """A shaft that its damping lets creep for seconds: there, the whole time asked for is taken."""
    creeping = rig.with_parameters({"joint.shaft.damping": 10.0})
    empty = pamsim.pressure_step((1e5, 0.0), (0.0, 0.0), duration=0.1)
    short, long = (
        pamsim.simulate(creeping, dataclasses.replace(empty, settle=settle))
        for settle in (1.0, 3.0)
    )
    assert abs(long.angle[0] - short.angle[0]) > 1e-3


SAMPLES = 10
TIME = 0.5 + 0.01 * np.arange(SAMPLES)


def trace():
    """A run of a pendulum in which nothing is wrong, all in small numbers that can be spoilt."""
    kinds = len(mujoco.mjtWarning.__members__) - 1
    fields = ("position", "velocity", "act", "length", "speed", "force", "effort")
    return Trace(
        time=TIME.copy(),
        **{name: np.zeros((SAMPLES, 2)) for name in fields},
        warnings=np.zeros((SAMPLES, kinds), dtype=np.int32),
    )


def look(trace, first=0, last=SAMPLES):
    return first_breakdown(trace, TIME, 1e-3, first, last)


def test_a_state_not_finite_a_warning_or_a_time_that_stalls_stops_and_the_earlier_counts():
    healthy = trace()
    healthy.velocity[:] = np.nan  # follows from the position; not looked at
    assert look(healthy) is None
    for field in ("act", "position"):
        lost = trace()
        getattr(lost, field)[6:, 1] = np.nan
        assert look(lost)[:2] == (6, Outcome.NOT_FINITE), field
        assert look(lost, 0, 6) is None  # only the asked samples are looked at
        assert look(lost, 8, 10)[0] == 8
        lost.warnings[4:, mujoco.mjtWarning.mjWARN_BADQACC] = 1
        sample, outcome, reason = look(lost)
        assert (sample, outcome) == (4, Outcome.ENGINE_WARNING)
        assert "BADQACC" in reason
    stalled = trace()
    stalled.time[3:] = stalled.time[2]
    sample, outcome, reason = look(stalled)
    assert (sample, outcome) == (3, Outcome.TIME_STALLED)
    assert "0.52 s, not 0.53 s" in reason


@pytest.mark.usefixtures("unchecked")
@pytest.mark.parametrize("stop", [3, 64, 100])
def test_a_run_ends_before_the_sample_that_is_not_to_be_trusted(stop):
    """Looking only now and then must not let a bad sample into the recording."""
    rig = pamsim.load_rig("mas20_arm")
    step = pamsim.pressure_step((3e5, 3e5), (3e5, 1e5), duration=0.3, sample_rate=500.0)
    step = dataclasses.replace(step, settle=0.1)
    whole = pamsim.simulate(rig, step).completed()
    last = (stop - 0.5) * 0.002  # in the time steps between the last good sample and the next

    def spoil(model, data):
        if data.time > last:
            data.act[-1] = np.nan

    broken = pamsim.simulate(rig, step, each_step=spoil)
    assert broken.outcome is Outcome.NOT_FINITE
    assert len(broken.time) == stop
    assert f"before t = {stop * 0.002:.4g} s" in broken.message
    for name in ("angle", "pressure", "tension"):
        assert np.array_equal(getattr(broken, name), getattr(whole, name)[:stop])


@pytest.mark.usefixtures("unchecked")
def test_an_unstable_run_is_reported_by_its_outcome_alone(tmp_path, monkeypatch, capfd):
    """The engine's own prints would reach the user without a word on which run they are of."""
    monkeypatch.chdir(tmp_path)
    rig = pamsim.load_rig("muscle_bench")
    step = pamsim.pressure_step((2e5,), (4e5,), duration=0.1)
    slow = dataclasses.replace(step, sample_rate=250.0)
    (settled,) = simulate_batch([(rig, step)], timestep=1e-3, rest_steps=RestSteps(later=4e-3))
    (batch,) = simulate_batch([(rig, slow)], timestep=4e-3)
    for broken in (batch, pamsim.simulate(rig, slow, timestep=4e-3)):
        assert broken.outcome is Outcome.NOT_FINITE
    # Only its way to rest in longer steps breaks down, which is gone again in its own.
    assert settled.outcome is Outcome.COMPLETED
    assert "WARNING" not in "".join(capfd.readouterr())
    assert not list(tmp_path.iterdir())
    assert mujoco.get_mju_user_warning() is None


@pytest.mark.usefixtures("unchecked")
def test_a_handler_of_warnings_that_the_user_has_set_is_called():
    found = []
    mujoco.set_mju_user_warning(found.append)
    try:
        rig = pamsim.load_rig("muscle_bench")
        step = pamsim.pressure_step((2e5,), (4e5,), duration=0.1)
        simulate_batch([(rig, step)], timestep=1e-3, rest_steps=RestSteps(later=4e-3))
    finally:
        mujoco.set_mju_user_warning(None)
    assert "QACC" in found[0]
