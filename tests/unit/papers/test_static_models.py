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
from pamsim.papers.printed_steps import STARTS, printed_experiment
from pamsim.recordings.printed import distinct_steps
from pamsim.recordings.recording import Outcome
from scripts import static_models
from scripts.static_models import StaticModel, Term, fit_static_models, row_blocks
from tests.unit.core.refusals import refused

LOCKING = Term(
    name="locks", parameter="passive.locking", low=0.0, high=60.0, start=20.0, neutral=0.0
)
TILT = Term(name="tilts", parameter="body.rig.tilt", low=-0.3, high=0.3, start=0.01, neutral=0.0)
CHAINS = ("tendon.chain_1.coef", "tendon.chain_2.coef")
RADIUS = Term(
    name="radius", parameter=CHAINS[0], also=CHAINS[1:],
    low=8e-3, high=2e-2, start=1.3e-2, neutral=1.2e-2,
)  # fmt: skip
TERMS = (LOCKING, TILT, RADIUS)
STEPS = distinct_steps()
SOFTENING = 10.0  # of the rig
PLANTED = {
    "passive.locking": 26.0, "body.rig.tilt": -0.04, "passive.softening": SOFTENING,
    **dict.fromkeys(CHAINS, 1.2e-2),
}  # fmt: skip


@pytest.fixture(scope="module")
def rig():
    return load_rig("mas20_arm").with_parameters({"passive.softening": SOFTENING})


def angle(values, step):
    """An end angle in closed form that depends on every term in its own way [rad]."""
    p1, p2 = (p / 1e5 for p in step.pressure)
    push = 100.0 * (values[CHAINS[0]] + values[CHAINS[1]]) * (p1 - p2)
    soft = 1.0 + 0.01 * values["passive.softening"]
    stiff = soft * (1.0 + 0.05 * values["passive.locking"] * (p1 + p2) / 5.0)
    return 0.1 * push / stiff + values["body.rig.tilt"] * step.load


class Stand:
    """Takes the engine's place: closed-form ends, every simulated rig noted."""

    def __init__(self):
        self.seen = []
        self.broken_row = None

    def __call__(self, pairs, *, timestep=None, threads=None):
        rigs = {id(rig): rig for rig, _ in pairs}
        values = {
            key: {name: rig_parameter(rig, name).value for name in PLANTED}
            for key, rig in rigs.items()
        }
        return [self.run(values[id(rig)], experiment) for rig, experiment in pairs]

    def run(self, values, experiment):
        number = int(experiment.name.removeprefix("row "))
        self.seen.append(values)
        step = next(step for step in STEPS if step.row == number)
        broken = number == self.broken_row
        return SimpleNamespace(
            angle=np.array([0.0, angle(values, step)]),
            outcome=Outcome.NOT_FINITE if broken else Outcome.COMPLETED,
        )

    def ranged(self, name):
        return {values[name] for values in self.seen}


@pytest.fixture
def stand(monkeypatch):
    found = Stand()
    monkeypatch.setattr(static_models, "simulate_batch", found)
    return found


def planted(noise=0.0):
    """Rows whose printed angle is that of known terms, and a little off."""
    off = noise * np.random.default_rng(2).standard_normal(len(STEPS))
    return tuple(
        replace(step, angle=angle(PLANTED, step) + e) for step, e in zip(STEPS, off, strict=True)
    )


def model(*terms, **rest):
    return StaticModel(
        name=" and ".join(t.name for t in terms) or "bare", terms=terms, accepted=True, **rest
    )


@pytest.fixture
def found(rig, stand):
    """Nested models of rows with noise, each reported as it is there."""
    models = [model(), model(LOCKING), model(LOCKING, TILT), model(*TERMS)]
    reported = []
    results = fit_static_models(
        rig, models, TERMS, steps=planted(noise=0.5 / DEG_PER_RAD), report=reported.append
    )
    assert tuple(reported) == results
    return results


def test_a_nested_model_fits_no_worse_and_what_is_reported_adds_up(found):
    errors = [result.rms for result in found]
    assert all(b <= a * (1.0 + 1e-9) for a, b in itertools.pairwise(errors))
    assert errors[2] < 0.5 * errors[1]  # a term that is there
    assert errors[3] > 0.9 * errors[2]  # a term that is not
    assert all(result.leave_one_out_rms > result.rms for result in found[1:])
    assert found[3].leave_one_out_rms > found[2].leave_one_out_rms
    # A model without a free term has not seen any row.
    bare = found[0]
    assert bare.leave_one_out_rms == bare.rms
    rows = list(row_blocks(STEPS)["medium steps"])
    wanted = np.sqrt(np.mean(bare.residual[rows] ** 2))
    assert bare.blocks["medium steps"] == pytest.approx(wanted)
    written = [json.loads(json.dumps(r.to_dict(), allow_nan=False)) for r in found]
    assert written[0]["left_out_block_rms_deg"]["medium steps"] == pytest.approx(
        wanted * DEG_PER_RAD
    )
    assert written[0]["leave_one_out_residual_deg"] == written[0]["residual_deg"]
    for entry, result in zip(written, found, strict=True):
        terms = result.model.terms
        assert [p["name"] for p in entry["parameters"]] == [term.parameter for term in terms]
        assert [p["term"] for p in entry["parameters"]] == [term.name for term in terms]
        assert np.shape(entry["jacobian_deg"]) == (len(STEPS), len(terms))
        for kind in ("", "leave_one_out_"):
            residual = entry[f"{kind}residual_deg"]
            assert len(residual) == len(STEPS)
            assert entry[f"{kind}rms_deg"] == pytest.approx(np.sqrt(np.mean(np.square(residual))))


def test_blocks_are_the_sizes_of_step_and_the_loads():
    blocks = row_blocks(STEPS)
    sizes = [blocks[f"{size} steps"] for size in ("large", "medium", "small")]
    loads = [blocks[f"load {load} kg"] for load in ("0", "1.2", "2.14")]
    for kinds in (sizes, loads):  # each row is in one of each kind
        assert sorted(row for rows in kinds for row in rows) == list(range(len(STEPS)))
    assert all(STEPS[row].size == "small" for row in blocks["small steps"])
    assert all(STEPS[row].load == 2.14 for row in blocks["load 2.14 kg"])


def test_planted_terms_are_found_and_a_block_is_predicted_by_a_fit_without_it(rig, stand):
    """Spoilt small steps cost the fit without them just that, and no other block is blind to it."""
    small = row_blocks(STEPS)["small steps"]
    off = 5.0 / DEG_PER_RAD
    spoilt = tuple(
        replace(step, angle=step.angle + off) if row in small else step
        for row, step in enumerate(planted())
    )
    kept, moved = (
        fit_static_models(rig, [model(LOCKING, TILT)], TERMS, steps=steps)[0]
        for steps in (planted(), spoilt)
    )
    assert kept.fit.values == pytest.approx([26.0, -0.04], rel=1e-5)
    assert kept.leave_one_out_rms * DEG_PER_RAD < 1e-5
    assert max(kept.blocks.values()) * DEG_PER_RAD < 1e-5
    for name, error in moved.blocks.items():
        if name == "small steps":
            assert error == pytest.approx(off, rel=1e-5)
        else:
            assert error * DEG_PER_RAD > 0.1, name


def test_a_block_without_which_a_model_is_undetermined_is_left_out(rig, stand):
    few = planted(noise=0.01)[4:10]  # of two large steps and four medium ones
    (found,) = fit_static_models(rig, [model(LOCKING, TILT)], TERMS, steps=few)
    assert "large steps" in found.blocks
    assert "medium steps" not in found.blocks


def test_terms_not_freed_are_neutral_and_held_values_those_of_their_model_only(rig, stand):
    assert rig_parameter(rig, "passive.locking").value != 0.0
    few = STEPS[::3]
    fit_static_models(rig, [model(RADIUS, held={"passive.softening": 3.0})], TERMS, steps=few)
    assert all(values[CHAINS[0]] == values[CHAINS[1]] for values in stand.seen)
    assert len(stand.ranged(CHAINS[1])) > 3
    assert stand.seen[0][CHAINS[0]] == pytest.approx(RADIUS.start)
    assert stand.ranged("passive.softening") == {3.0}
    assert stand.ranged("passive.locking") == {0.0}
    stand.seen.clear()
    fit_static_models(rig, [model(LOCKING)], TERMS, steps=few)
    assert stand.ranged("passive.softening") == {SOFTENING}
    assert stand.ranged(CHAINS[0]) == stand.ranged(CHAINS[1]) == {1.2e-2}
    assert len(stand.ranged("passive.locking")) > 3


def test_what_cannot_be_fitted_is_refused(rig, stand):
    with refused("do not determine"):
        fit_static_models(rig, [model(*TERMS)], TERMS, steps=planted(noise=0.01)[:4])
    unknown = replace(LOCKING, parameter="passive.lock")
    with refused("passive.lock"):
        fit_static_models(rig, [model(unknown)], (unknown,), steps=STEPS)
    stand.broken_row = 7  # makes its values impossible
    with refused("diverge"):
        fit_static_models(rig, [model(LOCKING)], TERMS, steps=planted())
    with refused("breaks down with the terms at neutral"):
        fit_static_models(rig, [model()], TERMS, steps=planted())


def test_the_bare_model_is_the_engine_s_own_end_angle(rig):
    term, steps = replace(LOCKING, neutral=26.39), STEPS[12:14]
    (found,) = fit_static_models(rig, [model()], (term,), steps=steps, timestep=2e-3)
    plain = rig.with_parameters({"passive.locking": 26.39})
    ends = [
        simulate(plain, printed_experiment(s, STARTS["vent"]), timestep=2e-3).completed().angle[-1]
        for s in steps
    ]
    assert found.residual == pytest.approx(np.subtract(ends, [s.angle for s in steps]), abs=1e-9)
