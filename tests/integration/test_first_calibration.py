"""Calibration of a rig whose file is far off: it begins link by link."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pamsim
from pamsim.calibration.calibrate import calibrate
from pamsim.calibration.first_values import first_values
from pamsim.comparison.free_parameters import first_names, freed_parameters
from pamsim.comparison.measurements import read_calibration_data
from pamsim.core.errors import InputError
from pamsim.inference.fit_simulator import fit_simulator
from pamsim.inference.simulator_fit import NoiseSource

PLANTED = {
    "muscle_1:mounting.length_at_zero": 0.2455,
    "muscle_2:mounting.length_at_zero": 0.2532,
    "valve.conductance_fill": 3.4e-10,
    "chamber.dead_volume": 14e-6,
    "joint.shaft.damping": 0.22,
    "joint.shaft.frictionloss": 0.13,
}
INPUTS = (
    [(0.4, -0.5), (0.0, 0.0), (-0.6, 0.5), (0.0, 0.2)],
    [(0.5, 0.5), (-0.2, 0.0), (-0.4, -0.6), (0.3, -0.2)],
)


@pytest.fixture(scope="module")
def rig():
    rig = pamsim.load_rig("mas20_arm")
    rig.model.opt.timestep = 1e-3
    return rig


@pytest.fixture(scope="module")
def recording(rig, tmp_path_factory):
    """Two trials of the planted rig, without noise: intervals are as wide as rounding."""
    folder = tmp_path_factory.mktemp("planted")
    planted = rig.with_parameters(PLANTED)
    trials = {
        f"input_{number}": pamsim.simulate(
            planted,
            pamsim.Experiment(
                drive="valve",
                command_time=0.3 * np.arange(4),
                command_value=np.array(openings),
                start_pressure=np.array([2.5e5, 2.5e5]),
                duration=1.2,
                sample_rate=100.0,
            ),
        )
        for number, openings in enumerate(INPUTS)
    }
    pamsim.write_recording(folder, "mas20_arm", trials)
    return folder


def test_each_link_leads_most_of_the_way_to_the_planted_rig(rig, recording):
    trials = read_calibration_data([recording]).of_rig(rig).trials
    stages: list[str] = []
    freed = freed_parameters(rig, list(PLANTED))
    found = first_values(rig, trials, freed, stage=stages.append)
    assert [one.name for one in found] == [one.name for one in freed]
    for before, one in zip(freed, found, strict=True):
        far = abs(one.before.value - PLANTED[one.name])
        assert before.free.start == one.before.value
        assert abs(one.free.start - PLANTED[one.name]) < 0.2 * far, one.name
    # From the joint back to the valves, all together at last.
    links = [text.partition(":")[0] for text in stages]
    assert links == ["joint and transmission", "muscle", "valves and air", "all links"]
    assert stages[1].count("length_at_zero") == 2


def test_a_calibration_that_begins_there_ends_at_the_planted_rig(rig, recording):
    names = list(PLANTED)
    found = calibrate([recording], rig=rig, free=names, first=True, channels=["angle", "pressure"])
    for one in found.parameters:
        assert one.value == pytest.approx(PLANTED[one.name], rel=1e-4), one.name
    rows = {row["name"]: row for row in found.to_dict()["parameters"]}
    assert rows["muscle_1:mounting.length_at_zero"]["before"] == 0.25
    friction = rows["joint.shaft.frictionloss"]
    assert friction["before"] == 0.0
    assert friction["range_source"] == "range of the effect coulomb_friction"


def test_tables_at_rest_cannot_lead_link_by_link(rig):
    with pytest.raises(InputError, match="`first` needs recordings over time"):
        calibrate(["mas20"], rig=rig, first=True)


def test_what_is_freed_is_what_a_file_seldom_has_measured(rig):
    assert set(PLANTED) < set(first_names(rig))


def test_one_input_with_two_loads_is_no_repeat(rig, recording, monkeypatch):
    fits = []

    def fitted(*arguments, **options):
        fits.append(fit_simulator(*arguments, **options))
        return fits[-1]

    monkeypatch.setattr("pamsim.calibration.first_values.fit_simulator", fitted)
    trial = read_calibration_data([recording]).of_rig(rig).trials[0]
    both = [trial, replace(trial, name="loaded", load=1.0)]
    first_values(rig, both, freed_parameters(rig, ["joint.shaft.damping"]))
    assert [one.source for one in fits[0].noise.values()] == [NoiseSource.RESIDUAL]
