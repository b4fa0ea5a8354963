"""What a run of a study is: the rig, the experiment and the figures that its values stand for."""

from __future__ import annotations

import time

import numpy as np
import pytest

import pamsim
from pamsim.comparison.effects_on_rig import at_size, forms, rig_effect
from pamsim.core.errors import InputError
from pamsim.engine.batch import simulate_batch
from pamsim.engine.parameters import rig_parameter, rig_parameters
from pamsim.recordings.step_metrics import step_figures
from pamsim.sweeps import examined, simulated
from pamsim.sweeps.job import with_values
from pamsim.sweeps.study import read_study
from pamsim.sweeps.sweep import sweep

SHORT = {"start_pressure": [300, 300], "final": [300, 100], "duration": 0.1}


def study(vary, **experiment):
    vary = {name: {"values": [value], "unit": unit} for name, (value, unit) in vary.items()}
    return {"schema": "pamsim-sweep/1", "experiment": {**SHORT, **experiment}, "vary": vary}


@pytest.mark.parametrize(
    ("drive", "final", "vary", "command"),
    [
        ("pressure_set", 100, {"final_1": 400, "chamber.dead_volume": 20, "load": 1.5}, [4e5, 1e5]),
        ("valve", -1, {"final_1": 0.5}, [0.5, -1.0]),
    ],
)
def test_a_run_is_the_simulation_of_what_it_states_and_leaves_out(
    tmp_path, drive, final, vary, command
):
    vary = {"start_pressure_1": 250, **vary}
    made = study({name: (one, "") for name, one in vary.items()}, drive=drive, final=[0, final])
    alone = pamsim.Experiment(
        drive=drive, command_time=np.zeros(1), command_value=[command], duration=0.1,
        start_pressure=[250e3, 300e3], sample_rate=200.0, load=vary.get("load", 0.0),
    )  # fmt: skip
    assert read_study(made).job.settle == alone.settle  # it rests sooner
    volume = {"chamber.dead_volume": 1e-6 * vary.get("chamber.dead_volume", 10)}
    run = pamsim.simulate(pamsim.load_rig("mas20_arm").with_parameters(volume), alone)
    columns = sweep(made, out=tmp_path).columns()
    for name, value in step_figures(run).items():
        assert columns[name] == pytest.approx([value], rel=1e-12, nan_ok=True), name


def test_a_value_in_another_unit_is_the_same_run(tmp_path):
    one, same = (
        {"load": (1, ""), "final_2": (150, ""), "chamber.dead_volume": (20, "")},
        {"load": (1000, "g"), "final_2": (1.5, "bar"), "chamber.dead_volume": (2e-5, "m^3")},
    )
    found = [sweep(study(vary), out=tmp_path / str(len(vary))) for vary in (one, same)]
    assert found[0].factors == {"load": "kg", "final_2": "kPa", "chamber.dead_volume": "cm^3"}
    assert found[1].factors == {name: unit for name, (_, unit) in same.items()}
    for name in found[0].outputs:
        first, second = (one.columns()[name] for one in found)
        np.testing.assert_allclose(first, second, rtol=1e-9, err_msg=name)


@pytest.mark.parametrize("loads", [[1], [0, 1], [0, 1, 2]])
def test_a_run_that_the_engine_refuses_stops_no_other(loads, tmp_path, monkeypatch):
    def refusing(jobs, **options):
        if any(experiment.load == 1.0 for _, experiment in jobs):
            raise InputError("too heavy")
        return simulate_batch(jobs, **options)

    monkeypatch.setattr(simulated, "simulate_batch", refusing)
    plan = {**study({}), "vary": {"load": {"values": loads}}}
    columns = sweep(plan, out=tmp_path).columns()
    refused = [message == "too heavy" for message in columns["message"]]
    assert refused == np.isnan(columns["final_deg"]).tolist() == [load == 1 for load in loads]


def numbers(rig):
    return {one.name: one.value for one in rig_parameters(rig)}


def test_an_effect_of_a_run_acts_on_the_rig_that_its_other_factors_make():
    """Each effect of the arm beside a parameter that it moves or is scaled by."""
    rig, tried = pamsim.load_rig("mas20_arm"), 0
    for name in forms(rig):
        effect = rig_effect(rig, name)
        try:
            moved = at_size(rig, effect, 1.0)
        except InputError:
            continue  # not on this rig
        for own in {next(iter(moved)), *(p.scaled_by for p in effect.parameters if p.scaled_by)}:
            known = rig_parameter(rig, own)
            value = {own: 0.9 * known.value or 0.1 * moved[own]}
            units = {own: known.spec.unit}
            first = with_values(rig, value, units)
            steps = with_values(first, {name: 0.5}, {})
            assert numbers(with_values(rig, {name: 0.5, **value}, units)) == numbers(steps), name
            tried += 1
    assert tried > 50


def test_every_run_is_reported_and_kept_by_itself_unless_the_study_makes_blocks(
    tmp_path, monkeypatch
):
    def refused(*_, **__):
        raise InputError("no recording")

    monkeypatch.setattr(examined, "hide", refused)
    runs = [{"gain": float(gain)} for gain in range(5)]
    own = pamsim.function_study(doubled, runs, columns={"error": "deg"})
    pairs = pamsim.function_study(doubled, runs, columns={"error": "deg"}, runs_in_block=2)
    vary = {"seed": {"values": [0, 1]}, "joint.shaft.damping": {"values": [0.3]}}
    fits = {"schema": "pamsim-sweep/1", "job": "calibrate", "experiment": {}, "vary": vary}
    steps = []
    for plan, expected in ((own, [0, 1, 2, 3, 4, 5]), (pairs, [0, 2, 4, 5]), (fits, [0, 1, 2])):
        steps.clear()
        began = time.perf_counter()
        found = sweep(plan, out=tmp_path, threads=1, progress=lambda *now: steps.append(now))
        assert 0.0 < found.seconds < time.perf_counter() - began
        assert steps == [(done, expected[-1], "runs") for done in expected]


def doubled(gain):
    return {"error": 2.0 * gain}
