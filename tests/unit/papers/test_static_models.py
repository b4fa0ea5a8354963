"""Static models compared: nested models, neutral terms, planted terms, rows held out."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.core.units import DEG_PER_RAD
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import load_rig
from pamsim.engine.simulate import simulate
from pamsim.papers import static_models
from pamsim.papers.printed_steps import STARTS, printed_experiment
from pamsim.papers.static_models import StaticModel, Term, fit_static_models, row_blocks
from pamsim.recordings.printed import distinct_steps
from pamsim.recordings.recording import Outcome
from tests.unit.core.refusals import refused

LOCKING = Term(
    name="locks", parameter="passive.locking", low=0.0, high=60.0, start=20.0, neutral=0.0
)
TILT = Term(name="tilts", parameter="body.rig.tilt", low=-0.3, high=0.3, start=0.01, neutral=0.0)
RADIUS = Term(
    name="radius",
    parameter="tendon.chain_1.coef",
    also=("tendon.chain_2.coef",),
    low=8e-3,
    high=2e-2,
    start=1.3e-2,
    neutral=1.2e-2,
)
TERMS = (LOCKING, TILT, RADIUS)
NAMES = ("passive.locking", "body.rig.tilt", "tendon.chain_1.coef", "tendon.chain_2.coef",
         "passive.softening")  # fmt: skip
STEPS = distinct_steps()
PLANTED = {"passive.locking": 26.0, "body.rig.tilt": -0.04}


@pytest.fixture(scope="module")
def rig():
    return load_rig("mas20_arm").with_parameters({"passive.softening": 10.0})


def angle(values, step):
    """An end angle in closed form that depends on every term in its own way [rad]."""
    p1, p2 = (p / 1e5 for p in step.pressure)
    push = 100.0 * (values["tendon.chain_1.coef"] + values["tendon.chain_2.coef"]) * (p1 - p2)
    soft = 1.0 + 0.01 * values["passive.softening"]
    stiff = soft * (1.0 + 0.05 * values["passive.locking"] * (p1 + p2) / 5.0)
    return 0.1 * push / stiff + values["body.rig.tilt"] * step.load


class Stand:
    """Takes the engine's place: closed-form ends, every simulated rig noted."""

    def __init__(self):
        self.seen = []
        self.breaks = lambda values, row: False

    def __call__(self, pairs, *, timestep=None, threads=None):
        rigs = {id(rig): rig for rig, _ in pairs}
        values = {
            key: {name: rig_parameter(rig, name).value for name in NAMES}
            for key, rig in rigs.items()
        }
        return [self.run(values[id(rig)], experiment) for rig, experiment in pairs]

    def run(self, values, experiment):
        number = int(experiment.name.removeprefix("row "))
        self.seen.append(values)
        step = next(step for step in STEPS if step.row == number)
        broken = self.breaks(values, number)
        return SimpleNamespace(
            angle=np.array([0.0, angle(values, step)]),
            outcome=Outcome.NOT_FINITE if broken else Outcome.COMPLETED,
        )


@pytest.fixture
def stand(monkeypatch):
    found = Stand()
    monkeypatch.setattr(static_models, "simulate_batch", found)
    return found


def planted(noise=0.0, **values):
    """Rows whose printed angle is that of known terms, and a little off."""
    neutral = dict.fromkeys(NAMES[:2], 0.0) | dict.fromkeys(NAMES[2:4], 1.2e-2)
    truth = {**neutral, "passive.softening": 10.0, **PLANTED, **values}
    off = noise * np.random.default_rng(2).standard_normal(len(STEPS))
    return tuple(
        replace(step, angle=angle(truth, step) + e) for step, e in zip(STEPS, off, strict=True)
    )


def model(*terms, **rest):
    return StaticModel(
        name=" and ".join(t.name for t in terms) or "bare", terms=terms, accepted=True, **rest
    )


def test_planted_terms_are_recovered_by_the_model_that_has_them(rig, stand):
    (found,) = fit_static_models(rig, [model(LOCKING, TILT)], TERMS, steps=planted())
    assert found.fit.values == pytest.approx([26.0, -0.04], rel=1e-5)
    assert found.rms * DEG_PER_RAD < 1e-5
    assert found.leave_one_out_rms * DEG_PER_RAD < 1e-5


def test_a_nested_model_never_fits_worse_in_sample(rig, stand):
    models = [model(), model(LOCKING), model(LOCKING, TILT), model(LOCKING, TILT, RADIUS)]
    found = fit_static_models(rig, models, TERMS, steps=planted(noise=0.5 / DEG_PER_RAD))
    errors = [result.rms for result in found]
    assert all(b <= a * (1.0 + 1e-9) for a, b in itertools.pairwise(errors))
    assert errors[2] < 0.5 * errors[1]  # a term that is there
    assert errors[3] > 0.9 * errors[2]  # a term that is not
    for result in found[1:]:
        assert result.leave_one_out_rms > result.rms
    assert found[3].leave_one_out_rms > found[2].leave_one_out_rms
    assert found[0].leave_one_out_rms == found[0].rms


def test_blocks_are_the_sizes_of_step_and_the_loads():
    blocks = row_blocks(STEPS)
    sizes = [blocks[f"{size} steps"] for size in ("large", "medium", "small")]
    loads = [blocks[name] for name in blocks if name.startswith("load")]
    assert set(blocks) >= {"load 0 kg", "load 1.2 kg", "load 2.14 kg"}
    for kinds in (sizes, loads):  # each row is in one of each kind
        assert sorted(row for rows in kinds for row in rows) == list(range(len(STEPS)))
    assert all(STEPS[row].size == "small" for row in blocks["small steps"])
    assert all(STEPS[row].load == 2.14 for row in blocks["load 2.14 kg"])


def test_a_block_is_predicted_by_a_fit_that_has_not_seen_it(rig, stand):
    """Spoilt small steps cost the fit without them just that, and no other block is blind to it."""
    small = row_blocks(STEPS)["small steps"]
    off = 5.0 / DEG_PER_RAD
    spoilt = tuple(
        replace(step, angle=step.angle + off) if row in small else step
        for row, step in enumerate(planted())
    )
    kept, moved = (
        fit_static_models(rig, [model(LOCKING, TILT)], TERMS, steps=steps)[0].blocks
        for steps in (planted(), spoilt)
    )
    assert max(kept.values()) * DEG_PER_RAD < 1e-5
    assert moved["small steps"] == pytest.approx(off, rel=1e-5)
    for name in set(moved) - {"small steps"}:
        assert moved[name] * DEG_PER_RAD > 0.1, name


def test_a_block_without_which_a_model_is_undetermined_is_left_out(rig, stand):
    few = planted(noise=0.01)[4:10]  # of two large steps and four medium ones
    (found,) = fit_static_models(rig, [model(LOCKING, TILT)], TERMS, steps=few)
    assert "large steps" in found.blocks
    assert "medium steps" not in found.blocks


def test_a_model_without_a_free_term_has_not_seen_any_block(rig, stand):
    (found,) = fit_static_models(rig, [model()], TERMS, steps=planted(noise=0.01))
    rows = list(row_blocks(STEPS)["medium steps"])
    wanted = np.sqrt(np.mean(found.residual[rows] ** 2))
    assert found.blocks["medium steps"] == pytest.approx(wanted)
    assert found.to_dict()["left_out_block_rms_deg"]["medium steps"] == pytest.approx(
        wanted * DEG_PER_RAD
    )


def test_terms_not_freed_are_neutral_whatever_the_rig_says(rig, stand):
    assert rig_parameter(rig, "passive.locking").value != 0.0
    fit_static_models(rig, [model(TILT)], TERMS, steps=STEPS)
    assert {values["passive.locking"] for values in stand.seen} == {0.0}
    assert {values["tendon.chain_2.coef"] for values in stand.seen} == {1.2e-2}
    assert len({values["body.rig.tilt"] for values in stand.seen}) > 3
    assert stand.seen[0]["body.rig.tilt"] == pytest.approx(TILT.start)


def test_held_values_and_companions_are_those_of_their_model_only(rig, stand):
    models = [model(RADIUS, held={"passive.softening": 3.0}), model(LOCKING)]
    counts = []
    fit_static_models(
        rig, models, TERMS, steps=STEPS, report=lambda result: counts.append(len(stand.seen))
    )
    first, second = stand.seen[: counts[0]], stand.seen[counts[0] :]
    assert all(v["tendon.chain_1.coef"] == v["tendon.chain_2.coef"] for v in first)
    assert len({v["tendon.chain_2.coef"] for v in first}) > 3
    assert {v["passive.softening"] for v in first} == {3.0}
    own = rig_parameter(rig, "passive.softening").value
    assert {v["passive.softening"] for v in second} == {own}
    assert {v["tendon.chain_1.coef"] for v in second} == {1.2e-2}


def test_results_come_one_by_one_and_fit_into_json(rig, stand):
    reported = []
    models = [model(), model(LOCKING, RADIUS)]
    found = fit_static_models(rig, models, TERMS, steps=planted(noise=0.01), report=reported.append)
    assert tuple(reported) == found
    bare, fitted = (json.loads(json.dumps(r.to_dict(), allow_nan=False)) for r in found)
    assert bare["parameters"] == []
    assert bare["leave_one_out_residual_deg"] == bare["residual_deg"]
    assert [p["name"] for p in fitted["parameters"]] == ["passive.locking", "tendon.chain_1.coef"]
    assert [p["term"] for p in fitted["parameters"]] == ["locks", "radius"]
    for entry in (bare, fitted):
        for errors, rms in (
            ("residual_deg", "rms_deg"),
            ("leave_one_out_residual_deg", "leave_one_out_rms_deg"),
        ):
            assert len(entry[errors]) == len(STEPS)
            assert entry[rms] == pytest.approx(np.sqrt(np.mean(np.square(entry[errors]))))


def test_one_row_that_breaks_down_makes_its_values_impossible(rig, stand):
    stand.breaks = lambda values, row: row == 7
    with refused("diverge"):
        fit_static_models(rig, [model(LOCKING)], TERMS, steps=planted())
    with refused("breaks down with the terms at neutral"):
        fit_static_models(rig, [model()], TERMS, steps=planted())


def test_more_terms_than_rows_and_an_unknown_parameter_are_refused(rig, stand):
    with refused("do not determine"):
        fit_static_models(rig, [model(LOCKING, TILT, RADIUS)], TERMS, steps=planted(noise=0.01)[:4])
    unknown = replace(LOCKING, parameter="passive.lock")
    with refused("passive.lock"):
        fit_static_models(rig, [model(unknown)], (unknown,), steps=STEPS)


def test_the_bare_model_is_the_engine_s_own_end_angle(rig):
    term = Term(
        name="locks", parameter="passive.locking", low=0.0, high=60.0, start=20.0, neutral=26.39
    )
    (found,) = fit_static_models(rig, [model()], (term,), steps=STEPS[12:14], timestep=2e-3)
    plain = rig.with_parameters({"passive.locking": 26.39})
    ends = [
        simulate(plain, printed_experiment(s, STARTS["vent"]), timestep=2e-3).completed().angle[-1]
        for s in STEPS[12:14]
    ]
    printed = [s.angle for s in STEPS[12:14]]
    assert found.residual == pytest.approx(np.subtract(ends, printed), abs=1e-9)
