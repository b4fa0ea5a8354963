"""A parameter that one muscle has to itself, where that of all muscles is fitted, too."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pamsim.comparison.candidate import of_all
from pamsim.diagnosis.method.evidence import losses
from pamsim.diagnosis.method.trial_diagnosis import diagnose_trials, fitted_base
from pamsim.diagnosis.method.trial_model import fit_effects
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.inference.free_parameter import FreeParameter
from tests.unit.diagnosis import toy_arm
from tests.unit.diagnosis.toy_arm import BIAS, DRY, LEAK, NUISANCE, recorded, regressors, simulator

SECOND = "second:gain"
MISMATCH = dataclasses.replace(
    toy_arm.candidate("mismatch", 0.0, 1.0, 0.03),
    parameters=(FreeParameter(name=SECOND, unit="1", start=1.04, low=0.3, high=3.0),),
    neutral={SECOND: 1.0},
    probes=(toy_arm.Probe(size=0.3, values={SECOND: 1.012}),),
)


@pytest.fixture(autouse=True)
def _two_gains(monkeypatch):
    """The gain turns the arm, and the pressure reads it, where it has none of its own."""
    plain = toy_arm.signals

    def signals(values, u):
        found = plain({n: v for n, v in values.items() if n not in (SECOND, "ratio")}, u)
        own = values.get(SECOND, values["gain"] * values.get("ratio", 1.0))
        return {"angle": found["angle"], "pressure_1": own * found["pressure_1"]}

    monkeypatch.setattr(toy_arm, "signals", signals)


def refitted(hidden, **options):
    trials = recorded(hidden, **options)
    fitter, base = fitted_base(simulator(trials), NUISANCE)
    loss = losses(fitter.simulator.layout, base.residual, fitter.floor, held_out=True)
    beside = MISMATCH.beside(base.values)
    return fitter, fit_effects(fitter, base, loss, [beside], [{SECOND: base.values["gain"] + 0.01}])


def test_the_name_for_all_is_what_follows_the_muscle():
    assert of_all("muscle_2:force.scale") == "force.scale"
    assert of_all("force.scale") == of_all("joint.shaft.damping") == ""


@pytest.mark.parametrize(("apart", "named"), [(0.04, True), (0.0, False)])
def test_it_is_present_where_it_differs_from_the_others_not_from_the_rig(apart, named):
    hidden = {"gain": 1.15, SECOND: 1.15 + apart}
    trials = recorded(hidden)
    library = (MISMATCH, DRY, BIAS, LEAK)
    one = diagnose_trials(simulator(trials), NUISANCE, library, regressors(trials)).conclusion
    if named:
        assert one.verdict is Verdict.NAMED
        assert one.best.names == ("mismatch",)
        low, high = one.best.apart[SECOND]
        assert low < apart < high < low + 0.01
    else:
        assert one.verdict is Verdict.NO_GAP
    _, model = refitted(hidden)
    assert abs(model.fit.values[SECOND] - 1.0) > 0.1
    assert model.all_present() == named


def test_a_difference_is_known_though_both_values_vary_from_trial_to_trial():
    _, model = refitted({"gain": 1.15, "ratio": 1.01}, variation=0.02)
    low, high = model.intervals[SECOND]
    assert low < model.candidates[0].neutral[SECOND] < high
    low, high = model.apart[SECOND]
    assert 0.0 < low < 0.0115 < high
    assert model.all_present()


def test_the_value_for_all_then_acts_on_the_others_only():
    """Also in a short descent, which keeps the sensitivities that it can."""
    fitter, model = refitted({"gain": 1.3, SECOND: 1.302})
    column = np.zeros(fitter.fitted.size)
    column[fitter.fitted] = model.fit.jacobian[:, 0]
    parts = {"angle": 0.0, "pressure_1": 0.0}
    for place in fitter.simulator.layout.places:
        parts[place.block.channel] += float(np.sum(column[place.rows] ** 2))
    assert parts["pressure_1"] < 1e-6 * parts["angle"]


def test_probes_and_neutral_move_with_the_value_for_all():
    moved = MISMATCH.beside({"gain": 1.3, "lag": 0.4})
    assert moved.neutral == {SECOND: pytest.approx(1.3)}
    assert moved.probes[0].values == {SECOND: pytest.approx(1.312)}
    assert moved.moved(moved.probes[0], -1.0) == {SECOND: pytest.approx(1.288)}
    assert MISMATCH.beside({"lag": 0.4}) is MISMATCH
