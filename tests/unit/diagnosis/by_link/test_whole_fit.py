"""The refit in the whole chain ends a diagnosis: sizes are its, intervals hold those by link."""

from dataclasses import replace

import numpy as np
import pytest

from pamsim.comparison.chain_simulator import ChainSimulator
from pamsim.comparison.links import VALVES, Link, whole_run
from pamsim.comparison.measurements import CalibrationData
from pamsim.comparison.repeats import repeats
from pamsim.diagnosis.by_link.limits import Remainder
from pamsim.diagnosis.by_link.sizes import Size
from pamsim.diagnosis.by_link.units import whole_trials
from pamsim.diagnosis.by_link.whole_chain import (
    confirmed,
    in_whole_chain,
    left_in_both,
    whole_chain,
)
from pamsim.recordings.recording_reader import read_recordings
from pamsim.twins.hide import hide
from tests.unit.diagnosis.by_link.toy_chain import ARM, tried

LINK = Link((VALVES,))


def size(value, low, high):
    return Size(value=value, interval95=(low, high))


def test_a_confirmed_size_is_that_of_the_whole_chain_and_its_interval_holds_that_by_link():
    found = confirmed({"x": size(1.0, 0.9, 1.1)}, {"x": size(1.15, 1.05, 1.25)})
    assert found == {"x": size(1.15, 1.0, 1.25)}


def test_what_a_link_has_left_counts_if_the_whole_chain_is_left_with_something_too():
    left, none = ({LINK: Remainder(excess=0.1, p_value=p)} for p in (0.004, 0.4))
    for excess, p_value, counts in ((0.4, 0.01, True), (0.4, 0.3, False), (0.01, 0.01, False)):
        whole = [Remainder(excess=excess, p_value=p_value)]
        assert left_in_both(left, whole)[LINK].counts == counts
        assert not left_in_both(none, whole)[LINK].counts


def test_a_size_that_links_show_wrongly_is_mended_by_the_whole_chain(tmp_path):
    hide(
        ARM, {"added_inertia": 1.0}, protocols=("bursts",), duration=1.5, repeats=2, forces=False
    ).save(tmp_path / "data")
    read = read_recordings(tmp_path / "data")
    data = CalibrationData(sources=(), rig=read.rig, trials=read.trials, tables=()).of_rig(ARM)
    simulator = ChainSimulator(ARM, repeats(data.trials), divided=whole_run)
    (effect,) = tried("added_inertia")
    (name,) = (parameter.name for parameter in effect.parameters)
    planted = 0.01  # [kg m^2], the effect's typical size

    class Off:
        effects, values, freed = (effect,), {name: 0.8 * planted}, {name}

    fitter, fit = in_whole_chain(simulator, ("force.scale",), whole_trials(simulator, ()), Off)
    assert [link.name for link in fitter.simulator.links] == ["whole chain"]
    assert fit.values[name] == pytest.approx(planted, rel=0.01)


def test_the_gap_of_the_whole_chain_is_that_of_all_samples(tmp_path):
    hide(ARM, {}, protocols=("bursts",), duration=1.0, repeats=1).save(tmp_path / "data")
    long, other = read_recordings(tmp_path / "data").trials
    short = replace(
        other,
        time=other.time[:50],
        command=other.command[:50],
        measured={channel: values[:50] + 0.1 for channel, values in other.measured.items()},
    )
    trials = (long, short)
    data = CalibrationData(sources=(), rig=None, trials=trials, tables=()).of_rig(ARM)
    found = whole_chain(ARM, data, {}, None, held_out=[trial.name for trial in trials])
    missed = [one.before - one.measured for one in found.comparisons if one.channel == "angle"]
    every = np.degrees(np.concatenate(missed))
    assert found.gap["angle"].before == pytest.approx(np.sqrt(np.mean(every**2)))


def test_no_refit_makes_the_whole_chain_worse_than_the_rig_as_it_is(tmp_path):
    """What a repair mends would otherwise be judged beside more than the rig misses."""
    hide(ARM, {}, protocols=("bursts",), duration=1.0, repeats=2).save(tmp_path / "data")
    trials = read_recordings(tmp_path / "data").trials
    data = CalibrationData(sources=(), rig=None, trials=trials, tables=()).of_rig(ARM)
    near, far = {"force.scale": 1.0}, {"force.scale": 0.8}
    held_out = [trial.name for trial in trials]
    off = ARM.with_parameters(far)
    as_it_is = whole_chain(ARM, data, {}, None, held_out=held_out).gap
    assert whole_chain(ARM, data, far, near, held_out=held_out).gap["angle"] == replace(
        as_it_is["angle"], after=as_it_is["angle"].before
    )
    assert whole_chain(off, data, near, None, held_out=held_out).gap["angle"].before < 0.5 * (
        whole_chain(off, data, {}, None, held_out=held_out).gap["angle"].before
    )
