"""Limits of absent effects, nuisance parameters by protocol, the next experiment, smaller sets."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pamsim.comparison.noise_floor import noise_floor
from pamsim.comparison.trial_residuals import TrialSimulator
from pamsim.core.computation import Steps
from pamsim.diagnosis.method.absent_limits import (
    NOT_SHOWN,
    OUT_OF_RANGE,
    TIED,
    UNEXPLAINED_PART,
    AbsentLimit,
    absent_limits,
    supported,
    widest,
)
from pamsim.diagnosis.method.evidence import losses
from pamsim.diagnosis.method.nuisance_by_protocol import nuisance_by_protocol
from pamsim.diagnosis.method.refit import Fitter
from pamsim.diagnosis.method.screen import screen
from pamsim.diagnosis.method.trial_diagnosis import diagnose_trials
from pamsim.diagnosis.method.trial_model import fit_effects
from pamsim.diagnosis.method.trial_search import PAIRS, TrialSearch
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.diagnosis.method.verdict_thresholds import FORM_ERROR
from pamsim.inference.residual_block import ResidualBlock
from tests.unit.diagnosis.toy_arm import (
    BIAS,
    DRY,
    LEAK,
    NUISANCE,
    OWN,
    TIME,
    TWIN,
    candidate,
    drive,
    recorded,
    regressors,
    signals,
    simulator,
)


def fitted(hidden, candidates, **options):
    """Fitter, base fit and screened effects on data with something hidden."""
    arm = simulator(recorded(hidden, **options))
    start = {p.name: p.start for p in NUISANCE}
    fitter = Fitter(arm, noise_floor_of(arm, start))
    base = fitter.fit(NUISANCE, [start])
    fitter.keep_jacobian(base)
    return fitter, base, screen(fitter, base, candidates)


def noise_floor_of(arm, start):
    first = arm.anchor(start)
    return noise_floor(arm.layout, first)


def test_a_linear_effect_keeps_its_promise():
    """The fall of the mean loss and the size that a signature promises are those of the refit."""
    fitter, base, screened = fitted({"bias": 0.02}, (BIAS, DRY))
    assert screened[0].candidate is BIAS
    _, misfit = fitter.unexplained(base)
    (start,) = screened[0].starts(misfit)
    found = fitter.fit((*NUISANCE, *BIAS.parameters), [{**base.values, **start}])
    assert base.cost - found.cost == pytest.approx(screened[0].gain, rel=0.02)
    assert start["bias"] == pytest.approx(found.values["bias"], rel=0.02)


def test_an_effect_of_one_sign_promises_nothing_with_the_other():
    _, _, screened = fitted({"leak": -0.03}, (LEAK,))
    assert screened[0].gain == 0.0
    assert screened[0].similarity < 0.0


def test_what_is_there_is_within_the_bound_and_little_more_is():
    """97.5 % one-sided: of 12 data sets with a small bias, a few may lie beyond their bound."""
    beyond, limits = 0, []
    for seed in range(12):
        fitter, base, screened = fitted({"bias": 0.004}, (BIAS,), seed=seed)
        (bound,) = absent_limits(fitter, screened, base, NUISANCE)
        assert bound.cannot_tell is None
        beyond += bound.limit < 0.004
        limits.append(bound.limit)
    assert beyond <= 2
    assert np.median(limits) < 0.008


def test_a_limit_is_wider_by_the_size_that_leaves_what_a_formula_may_leave():
    """Of 0.03 nuisance parameters leave some loss: a formula off by as much may hide 0.03."""
    fitter, base, screened = fitted({}, (BIAS,))
    space, _ = fitter.unexplained(base)
    (change,) = fitter.changes([{**base.values, "bias": 0.03}], fitter.weighted(base.residual))
    left = float(np.sum(space.project_out(change) ** 2))
    (bare,) = absent_limits(fitter, screened, base, NUISANCE)
    (wide,) = absent_limits(fitter, screened, base, NUISANCE, form_error=left)
    assert wide.limit - bare.limit == pytest.approx(0.03, rel=0.02)


def test_a_base_model_that_predicts_better_than_a_perfect_one_by_chance_leaves_no_form_error():
    fitter, base, screened = fitted({}, (BIAS,))
    lucky = losses(fitter.simulator.layout, base.residual, fitter.floor, held_out=True)
    for worse, expected in ((2.0, 0.0), (0.5, 0.5 * FORM_ERROR * np.mean(list(lucky.values())))):
        perfect = {trial: worse * loss for trial, loss in lucky.items()}
        search = TrialSearch(fitter, base, lucky, perfect, screened, None, Steps(None, 0))
        assert search.form_error == pytest.approx(expected)


def test_of_several_models_the_widest_limit_holds():
    small, large = (dataclasses.replace(LIMITS[0], limit=limit) for limit in (1.0, 3.0))
    none = dataclasses.replace(small, cannot_tell=OUT_OF_RANGE)
    assert widest([[small], [large]]) == (large,)
    assert widest([[large], [none]]) == (none,)


def test_what_leaves_no_trace_has_no_bound():
    fitter, base, _ = fitted({}, (BIAS,))
    _, _, (blind,) = fitted({}, (DRY,))
    bare = type(blind)(candidate=DRY, traces=(), similarity=0.0, gain=0.0)
    (bound,) = absent_limits(fitter, [bare], base, NUISANCE)
    assert bound.cannot_tell == NOT_SHOWN
    assert bound.limit == np.inf


def standing_in(hidden, *, seed=0):
    """An arm whose nuisance gain can take the place of an effect, and what was fitted to it.

    Where the gain was refitted, the effect leaves another trace than where the rig is.
    """
    x, z = np.sin(7.0 * TIME), np.cos(13.0 * TIME)

    def angle(gain, grip):
        return gain * x + grip * (x + (0.1 + 5.0 * (gain - 1.0)) * z)

    rng = np.random.default_rng([seed, 17])
    trials = [
        (f"{p}_{i}", p, angle(1.0, hidden) + 0.01 * rng.standard_normal(TIME.size))
        for p in ("one", "two", "one_check")
        for i in range(4)
    ]

    def simulate(sets, *, held_out, fine):
        return [
            [
                ResidualBlock(
                    trial=name,
                    protocol=protocol,
                    channel="angle",
                    residual=angle(v.get("gain", 1.0), v.get("grip", 0.0)) - measured,
                    sample_interval=0.02,
                )
                for name, protocol, measured in trials
                if held_out or not protocol.endswith("_check")
            ]
            for v in sets
        ]

    arm = TrialSimulator(
        simulate=simulate, held_out=frozenset(n for n, p, _ in trials if p.endswith("_check"))
    )
    start = {"gain": 1.0}
    fitter = Fitter(arm, noise_floor_of(arm, start))
    base = fitter.fit(NUISANCE, [start])
    fitter.keep_jacobian(base)
    return fitter, base, screen(fitter, base, (candidate("grip", 0.0, 2.0, 0.1),))


def test_a_limit_that_rests_on_a_nuisance_parameter_far_from_the_rig_is_none():
    """The gain took 0.5 for the effect; at that gain the data would rule out much less than 0.5."""
    fitter, base, screened = standing_in(0.5)
    assert base.values["gain"] == pytest.approx(1.5, rel=0.01)
    (bound,) = absent_limits(fitter, screened, base, NUISANCE)
    assert bound.limit < 0.1
    assert bound.cannot_tell == "refitted far from the rig, gain may stand in for it"
    fitter, base, screened = standing_in(0.0)
    (honest,) = absent_limits(fitter, screened, base, NUISANCE)
    assert honest.cannot_tell is None
    assert honest.limit < 0.1


def test_a_limit_outside_the_parameter_s_range_is_none():
    fitter, base, _ = fitted({}, ())
    (size,) = BIAS.parameters
    size = dataclasses.replace(size, start=0.0, low=-1e-4, high=1e-4)
    narrow = dataclasses.replace(BIAS, parameters=(size,))
    (bound,) = absent_limits(fitter, screen(fitter, base, (narrow,)), base, NUISANCE)
    assert bound.limit > 1e-4
    assert bound.cannot_tell == OUT_OF_RANGE


LIMITS = [
    AbsentLimit(effect=name, parameter="p", size=1.0, limit=2.0, cannot_tell=None)
    for name in ("dry", "leak")
]
FAMILIES = {"dry": "friction", "load_dependent": "friction", "leak": "air"}


@pytest.mark.parametrize("verdict", [Verdict.NO_GAP, Verdict.NAMED])
def test_a_clean_verdict_leaves_every_limit(verdict):
    assert supported(LIMITS, verdict, FAMILIES, [["load_dependent"]]) == tuple(LIMITS)


def test_a_clean_name_leaves_no_limit_of_an_effect_whose_model_predicts_better():
    dry, leak = supported(LIMITS, Verdict.NAMED, FAMILIES, [["load_dependent"], ["leak"]])
    assert (dry.cannot_tell, leak.cannot_tell) == (None, TIED)


@pytest.mark.parametrize("verdict", [Verdict.UNEXPLAINED, Verdict.NAMED_WITH_REMAINDER])
def test_where_something_is_left_no_limit_is_stated(verdict):
    for limit in supported(LIMITS, verdict, FAMILIES, [["load_dependent"]]):
        assert limit.cannot_tell == UNEXPLAINED_PART


def test_among_ties_an_effect_of_the_same_family_has_no_limit():
    dry, leak = supported(LIMITS, Verdict.AMBIGUOUS, FAMILIES, [["x"], ["leak"]])
    assert (dry.cannot_tell, leak.cannot_tell) == (None, TIED)
    dry, leak = supported(LIMITS, Verdict.AMBIGUOUS, FAMILIES, [["x"], ["load_dependent"]])
    assert dry.cannot_tell == "load_dependent is of the same family and may stand in for it"
    assert leak.cannot_tell is None


def test_a_parameter_that_stands_in_for_an_effect_differs_between_protocols():
    honest = [nuisance_by_protocol(*fitted({}, (), seed=seed)[:2])[0] for seed in range(6)]
    assert min(r.p_value for r in honest) > 0.005
    for one in honest:
        inside = [low <= OWN["gain"] <= high for _, low, high in one.values.values()]
        assert sum(inside) >= len(inside) - 1
    bent = nuisance_by_protocol(*fitted({"bias": 0.1}, ())[:2])[0]
    assert bent.parameter == "gain"
    assert bent.p_value < 1e-4


def test_an_effect_that_is_not_needed_is_left_out_again():
    fitter, base, screened = fitted({"dry": 0.06}, (DRY, BIAS))
    base_loss = losses(fitter.simulator.layout, base.residual, fitter.floor, held_out=True)
    search = TrialSearch(fitter, base, base_loss, base_loss, screened, None, Steps(None, 0))
    both = fit_effects(fitter, base, base_loss, [DRY, BIAS], [{"dry": 0.05, "bias": 0.001}])
    assert search.reduced(both, PAIRS).names == ("dry",)
    needed = fitted({"dry": 0.06, "bias": 0.03}, (DRY, BIAS))
    base_loss = losses(needed[0].simulator.layout, needed[1].residual, needed[0].floor,
                       held_out=True)  # fmt: skip
    search = TrialSearch(
        needed[0], needed[1], base_loss, base_loss, needed[2], None, Steps(None, 0)
    )
    both = fit_effects(needed[0], needed[1], base_loss, [DRY, BIAS], [{"dry": 0.05, "bias": 0.02}])
    assert set(search.reduced(both, PAIRS).names) == {"dry", "bias"}


def test_three_effects_are_named_together():
    trials = recorded({"dry": 0.06, "leak": 0.05, "bias": 0.04})
    found = diagnose_trials(simulator(trials), NUISANCE, (DRY, LEAK, BIAS), regressors(trials))
    assert found.conclusion.verdict is Verdict.NAMED
    assert set(found.conclusion.best.names) == {"dry", "leak", "bias"}


def test_the_next_experiment_is_the_one_at_which_tied_effects_differ():
    """Two frictions of slightly different width: turns part them, rest does not."""

    def menu(sets):
        inputs = {"rest": np.zeros(200), "slow": drive("slow", check=False)}
        return [
            {name: signals({**OWN, **values}, u) for name, u in inputs.items()} for values in sets
        ]

    trials = recorded({"dry": 0.06})
    found = diagnose_trials(
        simulator(trials), NUISANCE, (DRY, TWIN, BIAS), regressors(trials), menu=menu
    )
    assert found.conclusion.verdict is Verdict.AMBIGUOUS
    chosen = found.next_experiment
    assert chosen.protocol == "slow"
    assert set(chosen.between) == {"dry", "twin"}
    assert chosen.menu["rest"] < 0.1 * chosen.menu["slow"]
    assert chosen.before >= 0.0
    named = recorded({"bias": 0.04})
    found = diagnose_trials(simulator(named), NUISANCE, (DRY, BIAS), regressors(named), menu=menu)
    assert found.next_experiment is None


def test_a_fit_that_is_not_worth_its_time_is_given_up_after_a_step_and_not_before():
    """What a start promises is of first order: a slow valve's grows with the square of its size."""
    fitter, base, _ = fitted({"dry": 0.06}, (DRY,))
    parameters = (*NUISANCE, *DRY.parameters)
    before = fitter.simulator.evaluations
    whole = fitter.fit(parameters, [{**base.values, "dry": 0.01}])
    took = fitter.simulator.evaluations - before
    fitter.simulator.evaluations = 0
    given_up = fitter.fit(parameters, [{**base.values, "dry": 0.011}], worth=-1.0)
    assert fitter.simulator.evaluations < took
    assert whole.cost <= given_up.cost < base.cost - 0.5 * (base.cost - whole.cost)
