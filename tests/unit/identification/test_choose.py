"""A linear plant's structure by likelihood, others' by free runs; what the records do not show."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.identification import choose
from pamsim.identification.choose import (
    Choice,
    by_free_run,
    p_value_of_improvement,
    spanning_structures,
)
from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.models import ModelSet, fit_models
from pamsim.identification.recommendation import Candidate, recommend
from pamsim.identification.records import SignalRecord
from pamsim.identification.residual_tests import residual_nonlinearity, what_is_missing
from pamsim.identification.status import FitStatus, _undamped
from pamsim.identification.structure_scan import rough_fit
from tests.unit.identification.planted import (
    coloured,
    cut_out,
    fit_continuous,
    record,
    sampled,
    steps,
)

TS = 0.05
FEW = {"start": "free", "arx": (1, 1, 1), "oe": (1, 1, 1)}
LAG = [2.0], [0.4, 1.0]


def identified(record, dead_time="none"):
    fitted = fit_models([record], [], ModelSet(**FEW, dead_time=dead_time))
    chosen = fitted.recommended()
    best = next(c.fit for c in fitted.candidates if c.name == chosen.best)
    return fitted, chosen, best


def chosen_fit(fitted):
    return fitted.fitted[fitted.chosen].fit


PLANTS = {
    "one lag": LAG,
    "oscillation": ([2.0], [1.0 / 16.0, 0.4 / 4.0, 1.0]),
    "lag and integrator": ([0.8], [0.3, 1.0, 0.0]),
    "three poles, one zero": ([1.0, 2.0], np.convolve([1.0 / 25.0, 0.2 / 5.0, 1.0], [1.0, 1.0])),
}


@pytest.mark.parametrize("name", PLANTS)
def test_poles_of_the_plant_are_chosen_and_leave_nothing_to_explain(name):
    numerator, denominator = PLANTS[name]
    dead_time = (
        "auto" if name == "one lag" else "none"
    )  # a scan with dead times takes twice as long
    fitted, chosen, best = identified(cut_out(numerator, denominator, 1), dead_time)
    assert chosen.name == chosen.best == fitted.chosen
    assert "the Hannan-Quinn criterion" in chosen.reason
    expected = np.sort(np.abs(np.roots(denominator)))
    assert np.sort(np.abs(best.poles)) == pytest.approx(expected, rel=0.1, abs=1e-12)


def test_a_bent_plant_is_called_nonlinear_and_not_recommended():
    record = cut_out(*LAG, 2, bend=0.1)
    _, chosen, best = identified(record)
    assert (chosen.name, chosen.best != "") == ("", True)
    assert "the plant is not linear" in chosen.missing
    assert "the last third of each trial" in chosen.reason
    assert residual_nonlinearity(best, [record]).p_value < 1e-4


@pytest.mark.slow
def test_a_linear_plant_is_seldom_taken_for_a_bent_one():
    p_values: list[float] = []
    for seed in range(40):
        record = cut_out(*LAG, 100 + seed, n=200)
        fit = fit_continuous([record], order=1, start="free")
        p_values.append(residual_nonlinearity(fit, [record]).p_value)
    assert np.mean(np.array(p_values) < 0.05) < 0.2
    assert 0.3 < np.mean(p_values) < 0.7


def test_a_step_response_shows_one_pole():
    draw = np.random.default_rng(7)
    given = np.append(np.zeros(10), np.ones(390))
    output = sampled(*LAG, given, TS) + 0.01 * draw.normal(size=400)
    best = identified(SignalRecord("step", TS * np.arange(400), given, output))[2]
    assert (best.structure.order, best.structure.drift) == (1, False)


def test_a_bent_plant_whose_record_rests_at_its_end_is_judged_by_aicc():
    draw = np.random.default_rng(7)
    given = np.concatenate([steps(draw, 240, 10), np.zeros(160)])
    output = sampled(*LAG, given, TS)
    output = output + 0.3 * output**2 + 0.01 * draw.normal(size=400)
    record = SignalRecord("rests", TS * np.arange(400), given, output)
    assert "the best by AICc" in identified(record)[1].reason


def test_a_bent_plant_that_rests_at_first_is_judged_by_aicc():
    draw = np.random.default_rng(8)
    given = np.concatenate([0.01 * steps(draw, 280, 10), steps(draw, 120, 10)])
    output = np.round(sampled(*LAG, given, TS), 1)  # a coarse sensor does not show the small steps
    record = SignalRecord("late", TS * np.arange(400), given, output)
    assert np.ptp(output[:267]) == 0.0
    fit = rough_fit(ContinuousStructure(1, start="free"), [record], [np.log([0.4])])
    assert by_free_run([fit], [record], []).judged_by == "AICc"


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_a_last_third_judges_if_it_moves_a_fifth_as_much_as_the_rest(unit):
    draw = np.random.default_rng(9)
    given, output = steps(draw, 300, 10), draw.normal(size=300)
    output[200:] *= np.std(output[:200]) / np.std(output[200:])
    structure = ContinuousStructure(0, start="free")
    for share, judge in ((0.19, "AICc"), (0.21, "the last third of each trial")):
        moved = unit * np.append(output[:200], share * output[200:])
        records = [SignalRecord(f"{k}", TS * np.arange(300), given, moved) for k in range(3)]
        fit = rough_fit(structure, records, [np.empty(0)])
        assert by_free_run([fit], records[:1], []).judged_by == judge
        assert by_free_run([fit], records[:2], []).judged_by == judge
        assert by_free_run([fit], records, []).judged_by == "AICc"  # of three, none is cut


def test_an_unstable_plant_in_closed_loop_is_not_called_nonlinear():
    draw = np.random.default_rng(22)
    reference, pole = draw.choice([-1.0, 1.0], 20).repeat(30), np.exp(TS / 0.8)
    given, output, state = np.zeros(600), np.zeros(600), 0.0
    for k in range(600):
        output[k] = state + 0.02 * draw.normal()
        given[k] = 3.0 * (reference[k] - output[k])
        state = pole * state + (pole - 1.0) * given[k]
    record = SignalRecord("balanced", TS * np.arange(600), given, output)
    _, chosen, _ = identified(record)
    assert chosen.name == ""
    assert "may be unstable, in a closed loop: arx_1_1_1 has a pole" in chosen.missing
    assert "not linear" not in chosen.missing


def test_what_rounding_may_explain_is_said():
    noisy = cut_out(*LAG, 3)
    for given, rounds in ((noisy, False), (replace(noisy, output=noisy.output.round(0)), True)):
        fit = fit_continuous([given], order=1, start="free")
        missing = what_is_missing(fit, [given], adequate=False)
        assert missing.endswith("rounding may explain this") is rounds


@pytest.mark.parametrize(("late", "hold"), [(4, "zoh"), (1, "zoh"), (7, "foh")])
def test_a_gain_that_comes_late_is_chosen_with_all_its_dead_times(late, hold):
    draw = np.random.default_rng(21)
    given = draw.choice([-1.0, 1.0], 60).repeat(10)
    if hold == "foh":
        given = np.convolve(given, np.ones(8) / 8.0, "same")
    output = 3.0 * np.append(np.full(late, given[0]), given[:-late]) + 0.1 * draw.normal(size=600)
    record = SignalRecord("late", TS * np.arange(600), given, output, holds=(hold,))
    _, chosen, best = identified(record, "auto")
    assert chosen.name == "gain_dead_time"
    low, high = best["L"].interval95
    if hold == "zoh":
        assert (low, high) == pytest.approx((TS * (late - 1), TS * late))
    else:
        assert low < TS * late < high < low + 0.2 * TS
    assert best["K"].interval95[0] < 3.0 < best["K"].interval95[1]


def test_of_two_gains_one_may_come_late():
    draw = np.random.default_rng(23)
    given = np.column_stack([draw.choice([-1.0, 1.0], 60).repeat(10) for _ in range(2)])
    late = np.append(np.full(3, given[0, 0]), given[:-3, 0])
    output = 2.0 * late - given[:, 1] + 0.05 * draw.normal(size=600)
    record = SignalRecord("two", TS * np.arange(600), given, output, ("V", "V"))
    fitted = fit_models([record], [], ModelSet(start="free"))
    assert fitted.recommended().name == fitted.chosen == "gain_dead_time_of_1"
    assert chosen_fit(fitted)["L[1]"].interval95 == pytest.approx((2.0 * TS, 3.0 * TS))


def test_chance_finds_no_dead_time_of_an_input_without_effect():
    late = explained = 0
    for seed in range(10):
        draw = np.random.default_rng(seed)
        given, output = draw.choice([-1.0, 1.0], 40).repeat(10), draw.normal(size=400)
        # However fast it is sampled.
        record = SignalRecord("none", 1e-3 * TS * np.arange(400), given, output)
        fit = fit_continuous([record], order=0, dead_time=True, real_lags=False, start="free")
        late += fit.status is FitStatus.CONVERGED and fit.dead_time > 0.0
        assert fit.covariance is not None
        explained += "the best of 400 dead times has such a gain by chance" in fit.sentence
    assert late <= 1
    assert explained >= 5


@pytest.mark.slow
def test_slow_noise_is_not_taken_for_poles():
    right = 0
    for seed in range(6):
        best = identified(cut_out(*LAG, 20 + seed, n=600, noise=0.05, slow=0.85))[2]
        right += best.structure.order + best.structure.integrators == 1
    assert right >= 5


def test_undamped_poles_at_harmonics_of_the_command_are_passed_over():
    # Filled fast and vented slowly, as a regulator: what is not linear repeats with the command.
    interval, hold = 0.1, 10.0
    time = interval * np.arange(400)
    given = np.where(time // hold % 2 == 1, 10.0, 0.0)
    output = np.zeros(time.size)
    for k in range(1, time.size):
        left = given[k - 1] - output[k - 1]
        rate = left / 0.5 if left > 0.0 else max(0.8 * left, -1.6)
        output[k] = output[k - 1] + interval * rate
    output += 0.05 * np.random.default_rng(1).normal(size=time.size)
    _, chosen, best = identified(SignalRecord("regulator", time, given, output))
    assert chosen.name == ""
    duration = time[-1]
    lasting = [pole for pole in best.poles if pole.imag and -pole.real * duration < 1.0]
    assert lasting == []
    rich = fit_continuous(
        [SignalRecord("regulator", time, given, output)],
        order=4,
        zeros=3,
        real_lags=False,
        start="free",
        starts=[np.log([2.0 * 2.0 * np.pi / (2.0 * hold), 0.002, 0.7, 1.8])],
    )
    assert rich.refuted
    assert "lasts longer than the records, which do not show its damping" in rich.sentence


def test_an_undamped_pair_of_which_no_period_is_seen_stands_for_a_drift():
    fit = SimpleNamespace(half_width=lambda _: None, unit=int)  # the damping is not known
    for periods, expected in ((1.03, "lasts longer than the records"), (0.97, "")):
        fit.coordinates = np.log([2.0 * np.pi * periods / 40.0, 1e-3])
        objections = [one.sentence for one in _undamped(fit, SimpleNamespace(pairs=1), 40.0)]
        assert len(objections) == bool(expected)
        assert expected in "".join(objections)


@pytest.mark.parametrize("worse", [1.04, 1.06])
def test_the_simpler_of_two_is_picked_if_its_rms_error_is_at_most_five_percent_larger(worse):
    fits = tuple(SimpleNamespace(structure=SimpleNamespace(sentence=name)) for name in "ab")
    same = [np.ones(50)]  # so that no difference is significant
    choice = Choice(
        fits=fits, fit_percent=(0.0, 0.0), judged_by="held-out trials", errors=(same, same),
        sample_times=(1.0,), held_out=(100.0 - 10.0 * worse, 90.0),
    )  # fmt: skip
    simple = worse < 1.05
    assert choice.pick()[0] == (0 if simple else 1)
    assert choice.not_rejected(1) == list(fits if simple else fits[1:])
    assert choice.materially_worse(0) is not simple
    assert not choice.materially_worse(1)
    assert not choice.materially_worse(0, without=[1])


def test_a_criterion_picks_the_simplest_within_2_and_rejects_from_10_on():
    fits = tuple(SimpleNamespace(structure=SimpleNamespace(sentence=name)) for name in "abcd")
    choice = Choice(
        fits=fits, fit_percent=(0.0,) * 4, judged_by="AICc", scores=(10.1, 9.9, 1.9, 0.0)
    )
    assert choice.pick()[0] == 2
    assert choice.pick(without=[2, 3])[0] == 0
    assert choice.not_rejected(3) == list(fits[1:])
    assert [choice.materially_worse(place) for place in range(4)] == [True, True, False, False]


def test_held_out_trials_judge_a_linear_plant_too():
    fitted, held_out = (cut_out(*LAG, seed, n=200) for seed in (5, 6))
    models = fit_models([fitted], [held_out], ModelSet(**FEW))
    assert models.choice.judged_by == "the held-out trials"


def test_a_dead_time_is_chosen_where_it_is_asked_for_and_not_where_it_is_ruled_out():
    record = cut_out(*LAG, 9, n=300, noise=0.02, delay=0.4)
    for dead_time, expected in (("free", True), ("none", False)):
        chosen = chosen_fit(fit_models([record], [], ModelSet(**FEW, dead_time=dead_time)))
        assert chosen.structure.dead_time is expected
        if expected:  # 8 samples are no fast pole's
            assert chosen["L"].interval95 == pytest.approx((0.4, 0.4), rel=0.01)


def test_a_dead_time_that_stands_for_fast_poles_may_be_none():
    below = np.convolve(np.convolve([1.0, 1.0], [0.12, 1.0]), np.convolve([0.08, 1.0], [0.08, 1.0]))
    chosen = chosen_fit(fit_models([cut_out([1.0], below, 1, noise=0.02)], [], ModelSet(**FEW)))
    assert chosen.structure.order + chosen.structure.zeros < 4
    assert chosen["L"].value > 0.02
    assert chosen["L"].interval95[0] == 0.0
    assert chosen.sentence.endswith("span other structures that the records do not reject")


def test_the_end_of_a_record_that_began_at_rest_is_not_judged_as_if_it_rested_there():
    for seed in range(2):
        for integrators, denominator in ((0, [3.0, 1.0]), (1, [0.3, 1.0, 0.0])):
            draw = np.random.default_rng(seed)
            given = steps(draw, 600, 10)
            output = sampled([1.0], denominator, given, TS)
            output += 0.02 * np.std(output) * draw.normal(size=output.size)
            record = SignalRecord("trial", TS * np.arange(output.size), given, output)
            scores: list[float] = []
            for start in ("rest", "free"):
                structure = ContinuousStructure(order=1, integrators=integrators, start=start)
                fit = rough_fit(structure, [record], [np.log(denominator[:1])])
                scores += by_free_run([fit], [record], []).held_out
            assert scores[0] == pytest.approx(scores[1], abs=1.0)
            assert scores[0] > 90.0


def candidates(records, held_out=(), **second):
    """The first order, and what is asked for beside it."""
    fits = {
        "plain": fit_continuous(records, order=1, held_out=held_out),
        "second": fit_continuous(records, **{"order": 2, **second}, held_out=held_out),
    }
    return [Candidate(name=name, fit=fit, independence=None) for name, fit in fits.items()]


def lagged(constants, *seeds, n=600):
    noise = {"gain": 1.0, "noise": 0.05, "phi": 0.8, "hold": 20}
    return [record(seed, constants=constants, n=n, **noise) for seed in seeds]


@pytest.mark.parametrize("hold", [False, True])
@pytest.mark.parametrize(("constants", "expected"), [((0.5,), "plain"), ((0.15, 0.5), "second")])
def test_the_order_of_the_plant_is_recommended(constants, expected, hold):
    records, held = lagged(constants, 1, 2), lagged(constants, 3, 4) if hold else []
    given = candidates(records, held)
    found = recommend(given, records, held)
    assert found.name == expected, found.reason
    assert ("held-out" in found.reason) is hold or "only model" in found.reason
    assert min(found.aicc.values()) == 0.0
    # Noise correlated by 0.8 from sample to sample: (1 - 0.8) / (1 + 0.8) of them count.
    if expected == "second" and not hold:
        assert found.effective_samples == pytest.approx(1200 * 0.2 / 1.8, rel=0.35)
    if expected == "plain":  # none can be trusted
        assert given[1].fit.status is not FitStatus.CONVERGED
        alone = recommend(given[1:], records, held)
        assert alone.name == ""
        assert given[1].fit.sentence in alone.reason


def test_a_parameter_that_is_not_there_is_seldom_accepted():
    accepted = []
    for seed in range(8):
        records, held = lagged((0.5,), seed, n=250), lagged((0.5,), 100 + seed, n=250)
        given = candidates(records, held, order=1, dead_time=True)
        accepted.append(recommend(given, records, held).name == "second")
    assert sum(accepted) <= 1


def test_slow_errors_at_two_rates_are_no_more_often_taken_for_a_difference():
    p_values = []
    for seed in range(200):
        draw = np.random.default_rng(seed)
        # Of one correlation time: sampled fifty times as slowly it is white.
        first, second = ([coloured(draw, 600, 0.9), draw.normal(size=600)] for _ in range(2))
        p_values.append(p_value_of_improvement(first, second, [0.01, 0.5]))
    assert np.mean(np.array(p_values) < 0.05) == pytest.approx(0.05, abs=0.04)
    small = [coloured(np.random.default_rng(0), 800, 0.9)]
    assert p_value_of_improvement([1.5 * small[0]], small, [0.01]) < 0.01
    assert p_value_of_improvement(small, [1.5 * small[0]], [0.01]) > 0.99
    assert p_value_of_improvement(small, small, [0.01]) == 1.0


LATE = [record(1, delay=0.1, noise=0.02)]
CHOSEN = fit_continuous(LATE, order=1, dead_time=True)
SAME = replace(CHOSEN.structure, real_lags=False)


def rough(structure, gain, delay=()):
    """A rough fit: a time constant of 0.3 s, perhaps a dead time, and zeros of no influence."""
    x = np.append(np.full(structure.order, np.log(0.3)), delay)
    rest = np.zeros(structure.unknowns - x.size)
    rest[0] = gain
    return SimpleNamespace(structure=structure, x=x, coordinates=np.append(x, rest))


TWO_POLES = rough(replace(SAME, order=2), 2.5, 0.1)
WIDE = {"gain": (2.4, 2.6), "delay": 0.07}
DEGENERATE = FitStatus.DEGENERATE
# Another structure, what its own fit finds, and whether it widens the interval of a gain at its
# upper end; and of the dead time to which lower end.
SPANNED = {
    "numbers are determined": (TWO_POLES, WIDE, True, 0.07),
    "not determined": (TWO_POLES, {**WIDE, "status": DEGENERATE}, False, None),
    "a gain that may be 0": (TWO_POLES, {"gain": (-9.0, 9.0)}, False, None),
    "the same gain roughly": (rough(replace(SAME, order=2), 2.0, 0.1), WIDE, False, None),
    "another kind of gain": (rough(replace(SAME, integrators=1), 2.5, 0.1), WIDE, False, None),
    "no dead time": (
        rough(replace(SAME, order=3, dead_time=False), 2.0), {"status": DEGENERATE}, False, 0.0
    ),
}  # fmt: skip


@pytest.mark.parametrize(("other", "found", "gain", "late"), SPANNED.values(), ids=SPANNED)
def test_gains_and_dead_times_span_what_the_data_do_not_reject(
    monkeypatch, other, found, gain, late
):
    found = {"gain": CHOSEN["K"].interval95, "delay": 0.1, "status": CHOSEN.status, **found}
    estimates = [
        replace(CHOSEN["L"], value=found["delay"]),
        replace(CHOSEN["K"], interval95=found["gain"]),
    ]
    its_own = SimpleNamespace(status=found["status"], estimates=estimates)
    monkeypatch.setattr(choose, "fit_model", lambda *args, **more: its_own)
    choice = SimpleNamespace(
        fits=[rough(SAME, 2.0, 0.1), other], not_rejected=lambda place: [other]
    )
    wide = spanning_structures(CHOSEN, choice, LATE)
    if not gain and late is None:
        assert wide is CHOSEN
        return
    low, high = CHOSEN["K"].interval95
    assert wide["K"].interval95 == (low, 2.6 if gain else high)
    assert wide["L"].interval95 == (late, CHOSEN["L"].interval95[1])
    assert wide["T"] == CHOSEN["T"]
    assert wide.sentence.endswith("span other structures that the records do not reject")


def test_a_model_that_the_scan_does_not_hold_keeps_its_intervals():
    other = SimpleNamespace(fits=[rough(ContinuousStructure(order=4), 2.0)])
    assert spanning_structures(CHOSEN, other, LATE) is CHOSEN
