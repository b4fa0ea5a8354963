"""What makes a run break off, where, and what it is called."""

from __future__ import annotations

import dataclasses

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.engine.batch import simulate_batch
from pamsim.engine.sampling import Trace, first_breakdown
from pamsim.recordings.recording import Outcome

SAMPLES = 10
TIME = 0.5 + 0.01 * np.arange(SAMPLES)


@pytest.fixture
def trace():
    """A run of a pendulum in which nothing is wrong, all in small numbers that can be spoilt."""
    kinds = len(mujoco.mjtWarning.__members__) - 1
    blank = np.zeros((SAMPLES, 2))
    return Trace(
        time=TIME.copy(),
        position=blank.copy(),
        velocity=blank.copy(),
        act=blank.copy(),
        length=blank.copy(),
        speed=blank.copy(),
        force=blank.copy(),
        effort=blank.copy(),
        warnings=np.zeros((SAMPLES, kinds), dtype=np.int32),
    )


def look(trace, first=0, last=SAMPLES):
    return first_breakdown(trace, TIME, 1e-3, first, last)


def test_a_healthy_run_goes_on(trace):
    trace.velocity[:] = np.nan  # follows from the position; not looked at
    assert look(trace) is None


@pytest.mark.parametrize("field", ["act", "position"])
def test_a_state_that_is_not_finite_stops(trace, field):
    getattr(trace, field)[6:, 1] = np.nan
    assert look(trace)[:2] == (6, Outcome.NOT_FINITE)


def test_a_warning_of_the_engine_stops_and_is_named(trace):
    trace.warnings[4:, mujoco.mjtWarning.mjWARN_BADQACC] = 1
    sample, outcome, reason = look(trace)
    assert (sample, outcome) == (4, Outcome.ENGINE_WARNING)
    assert "BADQACC" in reason


def test_time_that_does_not_advance_stops(trace):
    trace.time[3:] = trace.time[2]
    sample, outcome, reason = look(trace)
    assert (sample, outcome) == (3, Outcome.TIME_STALLED)
    assert "0.52 s, not 0.53 s" in reason


def test_of_two_faults_the_earlier_counts(trace):
    trace.act[7:, 0] = np.inf
    trace.warnings[5:, 0] = 1
    assert look(trace)[:2] == (5, Outcome.ENGINE_WARNING)


def test_only_the_asked_samples_are_looked_at(trace):
    trace.act[8, 0] = np.nan
    assert look(trace, 0, 8) is None
    assert look(trace, 8, 10)[0] == 8


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
    (settled,) = simulate_batch([(rig, step)], timestep=1e-3, settle_steps=4)
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
        simulate_batch([(rig, step)], timestep=1e-3, settle_steps=4)
    finally:
        mujoco.set_mju_user_warning(None)
    assert "QACC" in found[0]
