"""Which models predict as well as the best one, and which of these the data reject."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from pamsim.diagnosis.method.lack_of_fit import LackOfFit
from pamsim.diagnosis.method.rivals import reject_rivals, shared_names, tied_with

TRIALS = ("a_1", "a_2", "a_3", "a_4")
LAYOUT = SimpleNamespace(protocol_of=dict.fromkeys(TRIALS, "a"))
SCATTER = (0.03, -0.03, 0.01, -0.01)
"""Of a difference of losses, in four trials: a standard error of 0.0129."""


def model(*names, behind=0.0, scatter=0.0, gain=1.0, present=True):
    """A model with a loss of 1 and more, that improves on the base by a gain."""
    loss = {t: 1.0 + behind + scatter * s for t, s in zip(TRIALS, SCATTER, strict=True)}
    return SimpleNamespace(
        names=names,
        candidates=[SimpleNamespace(name=name, label=name) for name in names],
        loss=loss,
        improvement=SimpleNamespace(gain=gain),
        all_present=lambda: present,
        fit=names,
    )


def ties(other, *, similarity=0.0, best=("dry",), **options):
    return bool(tied_with(model(*best), [other], LAYOUT, lambda *_: similarity, **options))


@pytest.mark.parametrize(
    ("other", "tied"),
    [
        (model("leak"), True),
        (model("leak", behind=-0.5), True),
        (model("leak", behind=0.0019), True),
        (model("leak", behind=0.0021), False),
        (model("leak", behind=0.0250, scatter=1.0), True),
        (model("leak", behind=0.0265, scatter=1.0), False),
        (model("leak", gain=0.51), True),
        (model("leak", gain=0.49), False),
        (model("leak", present=False), False),
        (model("dry"), False),
    ],
)
def test_a_model_ties_within_two_standard_errors_if_it_explains_half_as_much(other, tied):
    assert ties(other) is tied


@pytest.mark.parametrize(
    ("similarity", "behind", "gain", "tied"),
    [
        (0.96, 0.09, 1.0, True),
        (0.96, 0.11, 1.0, False),
        (0.94, 0.09, 1.0, False),
        (0.96, 0.09, 0.4, False),
    ],
)
def test_losses_do_not_separate_effects_of_the_same_signature(similarity, behind, gain, tied):
    assert ties(model("twin", behind=behind, gain=gain), similarity=similarity) is tied


def test_signatures_count_only_where_one_effect_stands_for_another():
    both = {"similarity": 1.0, "best": ("dry", "leak")}
    assert ties(model("dry", "bias", behind=0.05), **both)
    assert not ties(model("twin", "bias", behind=0.05), **both)
    assert ties(model("twin", "bias"), **both)
    assert not ties(model("leak", "dry"), **both)


def test_a_best_model_that_is_wrong_by_much_rejects_no_other_that_is_nearer():
    assert ties(model("leak", behind=0.09), wrong_by=0.1)
    assert not ties(model("leak", behind=0.11), wrong_by=0.1)


@pytest.mark.parametrize(
    ("p_values", "kept"),
    [
        ({"dry": 0.5, "leak": 0.5}, ["dry", "leak"]),
        ({"dry": 0.5, "leak": 0.005}, ["dry"]),
        ({"dry": 0.5, "leak": 0.02}, ["dry", "leak"]),
        ({"dry": 0.005, "leak": 0.5}, ["leak"]),
        ({"dry": 0.005, "leak": 0.09}, ["dry", "leak"]),
        ({"dry": 0.005, "leak": 0.11}, ["leak"]),
        ({"dry": 0.005, "leak": 0.02, "bias": 0.2}, ["leak", "bias"]),
        ({"dry": 0.001, "leak": 0.001}, ["dry", "leak"]),
    ],
)
def test_a_rival_that_does_not_fit_is_rejected_if_another_model_does(p_values, kept):
    best, *others = [model(name) for name in p_values]

    def lack(fit):
        return LackOfFit(size=0.0, error=0.0, p_value=p_values[fit[0]], attainable=1e-4)

    first, tied, test = reject_rivals(best, others, lack)
    assert [m.names[0] for m in (first, *tied)] == kept
    assert test.p_value == p_values[kept[0]]


def test_shared_effects_are_in_every_model():
    assert shared_names([]) == ()
    assert shared_names([("dry", "leak")]) == ("dry", "leak")
    assert shared_names([("dry", "leak", "bias"), ("leak", "dry")]) == ("dry", "leak")
    assert shared_names([("dry",), ("leak",)]) == ()
