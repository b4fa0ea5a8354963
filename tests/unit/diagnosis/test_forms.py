"""The name is the physics: its form is chosen on fitted trials, the name is judged on others."""

from __future__ import annotations

import dataclasses

import pytest

from pamsim.diagnosis.method import trial_diagnosis, trial_model, trial_search
from pamsim.diagnosis.method.evidence import losses
from pamsim.diagnosis.method.lack_of_fit import LackOfFit
from pamsim.diagnosis.method.rivals import tied_with
from pamsim.diagnosis.method.trial_diagnosis import diagnose_trials
from pamsim.diagnosis.method.trial_model import fit_effects
from pamsim.diagnosis.method.verdict import Verdict
from tests.unit.diagnosis.test_limits_and_next_experiment import fitted
from tests.unit.diagnosis.toy_arm import (
    BIAS,
    LEAK,
    NUISANCE,
    candidate,
    recorded,
    regressors,
    simulator,
)

SHARP = candidate("dry", 0.0, 1.0, 0.03, "friction", form_of="dry")
WIDE = candidate("wide", 0.0, 1.0, 0.03, "friction", form_of="dry")
TWIN = candidate("twin", -1.0, 0.0, -0.03, "friction", form_of="dry")


def found(hidden, library, **options):
    trials = recorded(hidden, **options)
    return diagnose_trials(simulator(trials), NUISANCE, library, regressors(trials))


def offset_with_width(named, *, another_size=False):
    """An effect under a name whose size is an offset and whose second number is wide friction."""
    (offset,), (width,) = BIAS.effect.parameters, WIDE.effect.parameters
    both = (offset, dataclasses.replace(width, another_size=another_size))
    return dataclasses.replace(
        named,
        effect=dataclasses.replace(named.effect, parameters=both),
        parameters=(*BIAS.parameters, *WIDE.parameters),
        neutral={**BIAS.neutral, **WIDE.neutral},
        probes=tuple(
            dataclasses.replace(probe, values={**probe.values, **other.values})
            for probe, other in zip(BIAS.probes, WIDE.probes, strict=True)
        ),
    )


@pytest.mark.parametrize("hidden", ["dry", "wide"])
def test_one_name_in_the_form_that_fits(hidden):
    for seed in range(3):
        one = found({hidden: 0.15}, (SHARP, WIDE, BIAS, LEAK), seed=seed).conclusion
        assert one.verdict is Verdict.NAMED, (seed, one)
        assert one.best.names == ("dry",)
        assert one.best.labels == (f"dry:{hidden}",)
        assert one.best.fit.values[hidden] == pytest.approx(0.15, rel=0.1)


def test_without_the_form_the_same_data_leave_a_remainder():
    one = found({"wide": 0.15}, (SHARP, BIAS, LEAK)).conclusion
    assert one.verdict is not Verdict.NAMED
    assert one.nearest.names == ("dry",)
    assert one.lack.significant


def test_forms_of_one_effect_are_never_rivals_nor_partners():
    """Two forms with the same trace are one name, not an ambiguity."""
    for hidden in ({"dry": 0.06}, {"dry": 0.06, "leak": 0.05}):
        one = found(hidden, (SHARP, TWIN, BIAS, LEAK)).conclusion
        assert one.verdict is Verdict.NAMED
        assert set(one.best.names) == set(hidden)
        assert one.tied == ()


def test_a_form_whose_size_stays_unknown_is_not_preferred():
    """It fits by its second number; its size is the offset, and there is none."""
    vague = offset_with_width(WIDE)
    one = found({"wide": 0.15}, (SHARP, vague, LEAK))
    assert one.conclusion.nearest.labels == ("dry:dry",)
    assert one.conclusion.nearest.size_known()
    assert found({"wide": 0.15}, (vague, LEAK)).conclusion.nearest.labels == ("dry:wide",)


def test_a_partner_must_beat_the_other_forms_of_the_main_effect(monkeypatch):
    """`stick` is a small effect that takes the edge off a wrong form."""
    stick = candidate("ripple", -1.0, 1.0, 0.03)
    library = (SHARP, WIDE, stick, BIAS)
    with_forms = found({"wide": 0.2}, library).conclusion
    assert with_forms.best.names == ("dry",)
    monkeypatch.setattr(trial_search, "forms_beside", lambda *_: ())
    monkeypatch.setattr(trial_diagnosis, "PARTNER_SHARE", 0.0)
    without = found({"wide": 0.2}, (SHARP, stick, BIAS)).conclusion
    assert without.verdict is not Verdict.NAMED


def test_unexplained_names_the_model_that_explains_most_and_where_it_fails():
    for hidden in ({"ripple": 0.05}, {"wide": 0.1}):
        one = found(hidden, (BIAS, LEAK))
        assert one.conclusion.verdict is Verdict.UNEXPLAINED
        better = [m for m in one.models if m.improvement.gain > 0.0]
        nearest = min(better, key=lambda m: m.mean_loss, default=None)
        assert one.conclusion.nearest is nearest
        assert (one.conclusion.explained.value > 0.0) == (nearest is not None)
        assert bool(one.cells_after) == bool(one.maps_after) == (nearest is not None)
    assert found({}, (BIAS, LEAK)).conclusion.nearest is None


def test_rare_effects_are_tried_only_where_the_others_leave_a_remainder():
    rare = dataclasses.replace(WIDE, effect=dataclasses.replace(WIDE.effect, name="odd", rare=True))
    assert found({"dry": 0.06}, (SHARP, rare, BIAS)).conclusion.best.names == ("dry",)
    one = found({"dry": 0.06}, (SHARP, rare, BIAS))
    assert {name for m in one.models for name in m.names} <= {"dry", "bias"}
    for library in ((SHARP, rare, BIAS), (BIAS, LEAK, rare)):
        assert found({"wide": 0.2}, library).conclusion.best.names == ("odd",)
    asked = dataclasses.replace(rare, asked_for=True)
    one = found({"dry": 0.06}, (SHARP, asked, BIAS))
    assert ("odd",) in {m.names for m in one.models}


@pytest.mark.parametrize(("left", "tried"), [(0.03, True), (0.0, False)])
def test_rare_effects_are_tried_where_losses_alone_show_a_remainder(monkeypatch, left, tried):
    """Repeats do not prove it (p = 0.06), but held-out losses are above a perfect model's."""
    unproven = LackOfFit(size=left, error=0.01, p_value=0.06, attainable=1e-3)
    monkeypatch.setattr(trial_diagnosis, "lack_of_fit", lambda *_, **__: unproven)
    rare = dataclasses.replace(WIDE, effect=dataclasses.replace(WIDE.effect, name="odd", rare=True))
    hidden = {"wide": 0.2} if left else {"dry": 0.06}
    one = found(hidden, (SHARP, rare, BIAS))
    assert any("odd" in m.names for m in one.models) is tried


def test_a_loose_fit_of_a_usual_effect_is_no_reason_to_try_rare_ones(monkeypatch):
    """A fit that ended half-way leaves what a rare effect would explain."""

    def half_way(fitter, base, base_loss, candidates, starts, **options):
        model = fit_effects(fitter, base, base_loss, candidates, starts, **options)
        if model is None or model.names != ("dry",):
            return model
        values = {**model.fit.values, "dry": 0.5 * model.fit.values["dry"]}
        loose = dataclasses.replace(
            model.fit, values=values, residual=fitter.simulator.fine(values)
        )
        return trial_model._judged(fitter, base_loss, model.candidates, loose, options["variation"])

    monkeypatch.setattr(trial_search, "fit_effects", half_way)
    rare = dataclasses.replace(WIDE, effect=dataclasses.replace(WIDE.effect, name="odd", rare=True))
    one = found({"dry": 0.15}, (SHARP, rare, BIAS))
    assert not any("odd" in m.names for m in one.models)
    assert one.conclusion.best.names == ("dry",)
    assert one.conclusion.best.fit.values["dry"] == pytest.approx(0.15, rel=0.05)


def test_rare_effects_are_tried_where_the_one_that_fits_cannot_be_named():
    """What fits is carried by its second number; alone, that is the rare effect."""
    rare = dataclasses.replace(WIDE, effect=dataclasses.replace(WIDE.effect, name="odd", rare=True))
    together = offset_with_width(BIAS)
    one = found({"wide": 0.2}, (together, LEAK, rare))
    assert not next(m for m in one.models if m.names == ("bias",)).all_present()
    assert one.conclusion.best.names == ("odd",)


@pytest.mark.parametrize("another_size", [False, True])
def test_either_of_two_sizes_is_enough_where_both_are_sizes(another_size):
    """Muscles that differ in stroke and not in strength differ."""
    together = offset_with_width(BIAS, another_size=another_size)
    (model,) = found({"wide": 0.2}, (together,)).models
    assert model.all_present() is another_size
    assert not any(m.all_present() for m in found({}, (together,)).models)


def test_a_model_that_is_wrong_itself_does_not_reject_one_that_is_wrong_by_as_much_again():
    fitter, base, _ = fitted({"wide": 0.3}, (SHARP, BIAS))
    layout = fitter.simulator.layout
    base_loss = losses(layout, base.residual, fitter.floor, held_out=True)
    best = fit_effects(fitter, base, base_loss, [SHARP], [{"dry": 0.2}])
    worse = {trial: loss + 0.3 for trial, loss in best.loss.items()}
    other = dataclasses.replace(
        best, candidates=(BIAS,), loss=worse, intervals={"bias": (1.0, 2.0)}
    )

    def tied(wrong_by):
        return tied_with(best, [other], layout, lambda *_: 0.0, wrong_by=wrong_by)

    assert tied(0.0) == ()
    assert tied(0.2) == ()
    assert tied(0.4) == (other,)
