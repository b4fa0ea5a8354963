"""Calibration: planted parameters, priors, noise, divergence, resuming, and what stays open."""

import copy
import json

import numpy as np
import pytest

from pamsim.core.encoding import to_dict
from pamsim.core.errors import InputError, ParameterError
from pamsim.inference.difference_jacobian import BatchedResidual
from pamsim.inference.estimate import Flag
from pamsim.inference.fit_simulator import fit_simulator, shown
from pamsim.inference.fit_summary import summarise_fit
from pamsim.inference.free_parameter import FreeParameter, Prior, SearchScale
from pamsim.inference.search import RowWeights, SearchEnd, SearchState
from pamsim.inference.simulator_fit import FitStatus, NoiseSource, ResidualBlock
from tests.unit.inference.closed_form_rigs import DECAY, TIME, TRUTH, Rig, decay_rig, free, line_rig

ABC = tuple(free(name, 1.0, -10.0, 10.0) for name in "abc")

NOISE = 0.01 * np.random.default_rng(0).standard_normal(TIME.size)


def noisy(seed=0, trials=3, sd=0.02):
    return sd * np.random.default_rng(seed).standard_normal((trials, TIME.size))


def test_a_parameter_is_shown_if_its_range_moves_more_than_the_noise():
    rows = np.ones((100, 3)) * [1.0, 5e-4, 0.0]
    measured = 0.3 + 0.1 * np.random.default_rng(2).standard_normal(100)
    three = [free("a"), free("b"), free("c")]
    seen, jacobian = shown(line_rig(rows, measured, noise_sd=0.1), three)
    ranges = np.array([one.high - one.low for one in three])
    np.testing.assert_allclose(jacobian, rows * ranges, rtol=1e-6)
    known = np.linalg.norm(jacobian / 0.1, axis=0)  # ranges over standard errors
    assert known[0] > 1.0 > known[1]
    assert seen.tolist() == [True, False, False]


def test_planted_parameters_are_recovered_within_their_errors():
    fit = fit_simulator(decay_rig(noisy()), DECAY)
    errors = np.array([p.standard_error for p in fit.parameters])
    assert fit.status is FitStatus.CONVERGED
    assert np.all(np.abs(fit.values - TRUTH) < 3.0 * errors)
    assert np.all(errors < 0.02)
    assert fit.noise["angle"].standard_deviation == pytest.approx(0.02, rel=0.1)
    assert set(fit.noise["angle"].rms_per_trial) == {"t0", "t1", "t2"}
    json.dumps(to_dict(fit), allow_nan=False)


def test_the_optimum_is_that_of_linear_least_squares_whose_jacobian_is_taken_once():
    rng = np.random.default_rng(3)
    rows, measured = rng.standard_normal((40, 3)), rng.standard_normal(40)
    rig = line_rig(rows, measured, noise_sd=None)
    fit = fit_simulator(rig, ABC)
    best = np.linalg.lstsq(rows, measured, rcond=None)[0]
    assert fit.values == pytest.approx(best, abs=1e-6)
    rms = np.sqrt(np.mean((rows @ best - measured) ** 2))
    assert fit.noise["force"].standard_deviation == pytest.approx(rms, rel=1e-6)
    assert rig.batches.count(3) == 1
    known = line_rig(rows, measured)
    fit_simulator(known, ABC, jacobian=20.0 * rows)  # of ranges 20 wide
    assert known.batches.count(3) == 0


def test_a_jacobian_is_one_call_and_every_vector_is_counted():
    rig = decay_rig(noisy())
    steps = []
    fit = fit_simulator(rig, DECAY, progress=steps.append)
    assert set(rig.batches) == {1, len(DECAY), 2 * len(DECAY)}  # steps, Jacobians, the last one
    assert rig.batches.count(len(DECAY)) == fit.iterations == len(steps)
    assert rig.batches.count(2 * len(DECAY)) == 1
    assert fit.evaluations == sum(rig.batches)
    assert fit.calls == len(rig.batches)
    assert [s.iteration for s in steps] == list(range(1, len(steps) + 1))
    lean = decay_rig(noisy())
    assert fit_simulator(lean, DECAY, central=False).evaluations == fit.evaluations - len(DECAY)


def test_a_wrong_jacobian_is_found_out():
    rig = decay_rig(noisy())
    fit = fit_simulator(rig, DECAY, jacobian=np.ones((3 * TIME.size, 2)))
    assert fit.values == pytest.approx(fit_simulator(decay_rig(noisy()), DECAY).values, rel=1e-6)
    assert rig.batches.count(len(DECAY)) > 0


def test_priors_pull_as_the_bayesian_solution_says():
    rng = np.random.default_rng(5)
    rows = rng.standard_normal((30, 2))
    measured = rows @ [1.0, -2.0] + 0.1 * rng.standard_normal(30)
    known = (Prior(mean=1.3, standard_deviation=0.02, source="data sheet"), None)
    pair = tuple(free(n, 0.5, -10.0, 10.0, prior=p) for n, p in zip("ab", known, strict=True))
    fit = fit_simulator(line_rig(rows, measured, noise_sd=0.1), pair)
    weight = np.diag([1.0 / 0.02**2, 0.0])
    information = rows.T @ rows / 0.1**2 + weight
    posterior = np.linalg.solve(information, rows.T @ measured / 0.1**2 + weight @ [1.3, 0.0])
    assert fit.values == pytest.approx(posterior, abs=1e-8)
    pull = fit.parameters[0].prior
    assert pull.distance == pytest.approx((posterior[0] - 1.3) / 0.02, abs=1e-6)
    assert pull.share == pytest.approx(np.linalg.inv(information)[0, 0] / 0.02**2, rel=1e-6)
    squares = np.sum(((rows @ posterior - measured) / 0.1) ** 2) + pull.distance**2
    assert fit.objective == pytest.approx(squares + 2.0 * 30 * np.log(0.1), abs=1e-6)
    assert fit.parameters[1].prior is None


def test_a_prior_on_a_logarithmic_parameter_counts_in_its_own_unit():
    prior = Prior(mean=3.0, standard_deviation=0.001, source="scale")
    pair = (free("gain", 1.0, scale="log", prior=prior), free("rate", 4.0))
    gain = fit_simulator(decay_rig(noisy()), pair).parameters[0]
    assert gain.value == pytest.approx(3.0, abs=0.02)
    assert gain.prior.share > 0.9


def test_channels_count_in_units_of_their_noise_not_of_their_signal():
    rng = np.random.default_rng(7)
    unit = {"pressure": (1e5, 3e4), "angle": (1.0, 0.001)}  # signal, noise

    def curve(channel):
        return lambda v: unit[channel][0] * np.exp(-v[0] * TIME)

    trials = [
        (f"t{k}", f"p{k}", c, curve(c), curve(c)([1.5]) + sd * rng.standard_normal(TIME.size))
        for k, (c, (_, sd)) in enumerate(unit.items())
    ]
    both = fit_simulator(Rig(trials), (DECAY[1],))
    angle = fit_simulator(Rig(trials[1:]), (DECAY[1],))
    assert both.noise["pressure"].standard_deviation == pytest.approx(3e4, rel=0.2)
    # 0.3 against 0.001 of the signal: the pressure adds next to nothing.
    assert both.values == pytest.approx(angle.values, abs=0.1 * angle.parameters[0].standard_error)


def test_noise_comes_from_repeats_where_there_are_some():
    twice = decay_rig(noisy(trials=4), protocols=("a", "a", "b", "b"))
    # What the simulator misses is equal in repeats and must not pass for noise.
    twice.trials = [(*t[:3], t[3], t[4] + 0.2 * np.sin(9.0 * TIME)) for t in twice.trials]
    fit = fit_simulator(twice, DECAY)
    assert fit.noise["angle"].source is NoiseSource.REPEATS
    assert fit.noise["angle"].standard_deviation == pytest.approx(0.02, rel=0.1)
    assert fit.noise["angle"].rms > 0.1
    once = fit_simulator(decay_rig(noisy(), noise_sd=0.05), DECAY).noise["angle"]
    assert once.source is NoiseSource.GIVEN
    assert once.standard_deviation == pytest.approx(0.05)


def test_a_start_on_a_bound_without_slope_there_is_moved_off():
    def curve(v):  # like friction: the effect grows with the square, no slope at 0
        return v[0] ** 2 * np.exp(-TIME)

    rig = Rig([("t", "p", "angle", curve, curve([2.0]) + noisy()[0])])
    fit = fit_simulator(rig, (free("friction", 0.0, 0.0, 5.0),))
    assert fit.values == pytest.approx([2.0], abs=0.01)
    assert fit.starts[0].start == pytest.approx((0.25,))


def test_a_bound_that_attracts_is_reached_and_said():
    fit = fit_simulator(decay_rig(noisy()), (free("gain"), free("rate", 1.0, 0.5, 1.2)))
    rate = fit.parameters[1]
    assert fit.status is FitStatus.AT_BOUND
    assert "rate" in fit.sentence
    assert (rate.value, rate.interval95, rate.flags) == (1.2, None, (Flag.AT_BOUND,))
    held = fit_simulator(
        Rig([(*t[:3], lambda v, c=t[3]: c([v[0], 1.2]), t[4]) for t in decay_rig(noisy()).trials]),
        (free("gain"),),
    )
    assert fit.values[0] == pytest.approx(held.values[0], rel=1e-5)
    assert fit.parameters[0].interval95 == pytest.approx(held.parameters[0].interval95, rel=1e-3)


def test_diverging_regions_are_survived_and_counted():
    rig = decay_rig(noisy(), diverges=lambda v: v[1] > 2.2)
    fit = fit_simulator(rig, (free("gain", 0.2), free("rate", 2.0)), starts=3, seed=2)
    assert fit.status is FitStatus.CONVERGED
    assert fit.diverged > 0
    assert fit.values == pytest.approx(TRUTH, abs=0.03)
    assert len(fit.starts) == 3  # places that diverge were drawn again


def test_a_bound_beside_which_the_simulation_diverges_ends_the_search():
    rig = decay_rig(noisy(), diverges=lambda v: 1.2 - 1e-8 < v[1] < 1.2)
    fit = fit_simulator(rig, (free("gain"), free("rate", 1.0, 0.5, 1.2)))
    assert (fit.values[1], fit.status) == (1.2, FitStatus.NOT_CONVERGED)


def test_divergence_beside_the_optimum_or_at_the_start_is_gone_round():
    optimum = fit_simulator(decay_rig(noisy()), DECAY).values
    edge = optimum[1] + 1e-9  # the optimum lies on the rim
    fit = fit_simulator(decay_rig(noisy(), diverges=lambda v: v[1] > edge), DECAY)
    assert fit.values == pytest.approx(optimum, rel=1e-4)
    assert fit.parameters[1].interval95 is not None

    def curve(v):  # not finite above 2, as at the nominal start
        with np.errstate(invalid="ignore"):
            return np.sqrt(2.0 - v[0]) * np.ones(5)

    rig = Rig([("t", "p", "angle", curve, np.ones(5))])
    fit = fit_simulator(rig, (free("x", 9.0),))
    assert fit.values == pytest.approx([1.0], abs=1e-5)
    assert fit.diverged > 0


def test_starts_tell_how_many_agree():
    def curve(v):  # two optima: the right frequency, and one a search gets caught in
        return np.sin(v[0] * TIME)

    rig = Rig([("t", "p", "angle", curve, curve([6.0]) + noisy()[0])])
    fit = fit_simulator(rig, (free("frequency", 1.0, 0.1, 20.0),), starts=12, seed=1)
    assert fit.values == pytest.approx([6.0], abs=0.01)
    assert 1 <= fit.same_optimum < 12
    for start in fit.starts:
        assert start.same_optimum == (abs(start.end[0] - 6.0) < 0.01)
    again = fit_simulator(rig, (free("frequency", 1.0, 0.1, 20.0),), starts=12, seed=1)
    assert to_dict(again)["starts"] == to_dict(fit)["starts"]


def test_a_search_without_enough_steps_states_no_interval():
    fit = fit_simulator(decay_rig(noisy()), DECAY, max_iterations=2)
    assert fit.status is FitStatus.NOT_CONVERGED
    assert "ran out of steps" in fit.sentence
    assert all(p.interval95 is None and p.standard_error is None for p in fit.parameters)


class Memory:
    def __init__(self):
        self.state, self.saves = None, 0

    def load(self):
        return copy.deepcopy(self.state)

    def save(self, state):
        self.state, self.saves = json.loads(json.dumps(state)), self.saves + 1


class Impatient:
    """A simulator that is interrupted at one of its calls."""

    def __init__(self, rig, calls):
        self.rig, self.left = rig, calls

    def __call__(self, sets):
        self.left -= 1
        if self.left < 0:
            raise KeyboardInterrupt
        return self.rig(sets)


@pytest.mark.parametrize("calls", [1, 13, 24])
def test_an_interrupted_calibration_goes_on_to_the_same_result(calls):
    whole = fit_simulator(decay_rig(noisy()), DECAY, starts=3)
    memory = Memory()
    with pytest.raises(KeyboardInterrupt):
        fit_simulator(Impatient(decay_rig(noisy()), calls), DECAY, starts=3, checkpoint=memory)
    rest = decay_rig(noisy())
    resumed = fit_simulator(rest, DECAY, starts=3, checkpoint=memory)
    errors = np.array([p.standard_error for p in whole.parameters])
    assert np.all(np.abs(resumed.values - whole.values) < 1e-3 * errors)
    assert resumed.objective == pytest.approx(whole.objective, abs=1e-4)
    assert resumed.parameters[0].interval95 == pytest.approx(whole.parameters[0].interval95)
    assert [s.same_optimum for s in resumed.starts] == [s.same_optimum for s in whole.starts]
    if calls > 20:  # what was finished is not done again
        assert sum(rest.batches) < 0.7 * whole.evaluations
        assert resumed.evaluations > sum(rest.batches)


def test_a_checkpoint_is_finished_or_of_another_fit():
    memory = Memory()
    fit_simulator(decay_rig(noisy()), DECAY, checkpoint=memory)
    other_rate = (DECAY[0], free("rate", 4.0, 0.2))
    for seed, parameters, options, differ in (
        (1, DECAY, {}, "residuals"),
        (0, DECAY, {"seed": 1}, "options"),
        (0, other_rate, {}, "parameters"),
    ):
        with pytest.raises(InputError, match=f"another fit: its {differ} differ"):
            fit_simulator(decay_rig(noisy(seed)), parameters, checkpoint=memory, **options)
    rig = decay_rig(noisy())
    done = fit_simulator(rig, DECAY, checkpoint=memory)  # finished: only judged again
    assert sum(rig.batches) <= 3 + 2 * len(DECAY)
    assert done.status is FitStatus.CONVERGED


def test_the_search_scale_and_back():
    pair = (free("k", 2.0, 0.5, 50.0, scale="log"), free("c", 0.0, -1.0, 3.0))
    scale = SearchScale(pair)
    places = np.array([[0.0, 0.0], [1.0, 1.0], [0.3, 0.7]])
    found = scale.from_unit(places)
    assert found[:2].tolist() == [[0.5, -1.0], [50.0, 3.0]]
    assert scale.to_unit(found) == pytest.approx(places, abs=1e-12)
    step = (scale.from_unit(places[2] + 1e-6) - scale.from_unit(places[2] - 1e-6)) / 2e-6
    assert scale.slope(places[2]) == pytest.approx(step, rel=1e-6)


def test_parameters_check_themselves():
    right = {"name": "k", "unit": "N", "start": 1.0, "low": 0.5, "high": 9.0}
    for change, text in (
        ({"low": 10.0}, "is empty"),
        ({"start": 11.0}, "start 11 is outside"),
        ({"start": float("nan")}, "not a finite number"),
        ({"scale": "log", "low": 0.0}, "must be positive"),
        ({"scale": "sqrt"}, "give linear or log"),
        ({"prior": Prior(mean=1.0, standard_deviation=0.0, source="")}, "positive standard"),
    ):
        with pytest.raises(ParameterError, match=text):
            FreeParameter(**{**right, **change})


def test_refusals():
    def growing(sets):
        block = {"trial": "t", "protocol": "p", "channel": "angle"}
        return [[ResidualBlock(**block, residual=np.ones(int(10 * v[0])))] for v in sets]

    rig = decay_rig(noisy())
    never = decay_rig(noisy(), diverges=lambda v: True)
    for simulator, parameters, options, text in (
        (rig, (), {}, "no parameter"),
        (rig, (DECAY[0], DECAY[0]), {}, "given twice"),
        (rig, DECAY, {"starts": 0}, "0 starts"),
        (rig, DECAY, {"seed": -1}, "`seed` is -1"),
        (never, DECAY, {}, "diverges at all 25 starts"),
        (lambda sets: [[] for _ in sets], DECAY, {}, "no residuals"),
        (lambda sets: [], DECAY, {}, "1 vectors were simulated, 0 results"),
        (growing, (free("gain", 1.0),), {"starts": 3}, "different layout"),
    ):
        with pytest.raises(InputError, match=text):
            fit_simulator(simulator, parameters, **options)


@pytest.mark.parametrize("off", [0.0, 1.5, 4.0])
def test_intervals_allow_for_what_a_search_ended_short_of_the_optimum(off):
    rows = np.random.default_rng(5).standard_normal((400, 1))
    measured = 0.1 * np.random.default_rng(6).standard_normal(400)
    one, short = (free("a", 0.0, -1.0, 1.0),), 0.1 / np.linalg.norm(rows)
    best = float((rows[:, 0] @ measured) / (rows[:, 0] @ rows[:, 0]))
    residual = BatchedResidual(line_rig(rows, measured, noise_sd=0.1), one)
    place = residual.scale.to_unit(np.array([best + off * short]))
    missed = residual.at(place)
    cost = RowWeights(residual, one, missed)
    end = SearchEnd(SearchState(place, cost.noise.estimate(missed)), 0.0, converged=True)
    fit = summarise_fit(cost, one, [place], [end], end, 2.0 * rows)
    (found,) = fit.parameters
    assert found.value == pytest.approx(best + off * short)
    if off > 2.0:
        assert fit.status is FitStatus.NOT_CONVERGED
        return
    assert fit.status is FitStatus.CONVERGED
    assert found.standard_error == pytest.approx(short * np.hypot(1.0, off), rel=0.15)


def rig(curve, truth):
    return Rig([("t", "p", "angle", curve, curve(np.asarray(truth)) + NOISE)])


def flags(fit):
    return {p.name: set(p.flags) for p in fit.parameters}


def product(v):
    return v[0] * v[1] * np.exp(-v[2] * TIME)


def test_a_product_is_determined_though_its_factors_are_not():
    three = (free("a", 2.0, scale="log"), free("b", 2.0, scale="log"), free("rate", 2.0))
    fit = fit_simulator(rig(product, [2.0, 3.0, 1.0]), three)
    assert fit.status is FitStatus.NOT_IDENTIFIABLE
    assert fit.determined == ("a * b",)
    assert "do not determine a, b, only a * b" in fit.sentence
    flat = {Flag.FLAT_DIRECTION}
    assert flags(fit) == {"a": flat, "b": flat, "rate": set()}
    assert fit.parameters[0].partners == ("b",)
    assert fit.parameters[0].interval95 is fit.parameters[1].interval95 is None
    assert np.all(np.isnan(fit.covariance[0]))
    assert fit.values[0] * fit.values[1] == pytest.approx(6.0, rel=0.01)
    low, high = fit.parameters[2].interval95
    assert low < 1.0 < high
    assert high - low < 0.02


def test_determined_combinations_are_written_as_they_enter():
    def ratio(v):
        return v[0] ** 2 / v[1] * np.exp(-TIME)

    def two_sums(v):
        return (v[0] + v[1]) * np.exp(-TIME) + (v[1] - v[2]) * np.exp(-4.0 * TIME)

    for curve, truth, scale, texts in (
        (ratio, [5.0, 2.0], "log", {"a / b^0.5"}),
        (lambda v: (v[0] + 2.0 * v[1]) * np.exp(-TIME), [5.0, 2.0], "linear", {"a + 2 b"}),
        (lambda v: (v[0] - v[1]) * np.exp(-TIME), [5.0, 2.0], "linear", {"a - b"}),
        (two_sums, [3.0, 2.0, 1.0], "linear", {"a + c", "b - c"}),
    ):
        parameters = [free(n, 3.0, scale=scale) for n in "abc"[: len(truth)]]
        assert set(fit_simulator(rig(curve, truth), parameters).determined) == texts


def test_a_prior_holds_what_the_data_leave_open_unless_it_is_wider_than_the_range():
    def fitted(deviation):
        known = Prior(mean=3.0, standard_deviation=deviation, source="data sheet")
        three = (free("a", 2.0), free("b", 2.0, prior=known), free("rate", 2.0))
        return fit_simulator(rig(product, [2.0, 3.0, 1.0]), three)

    fit = fitted(0.1)
    a, b, _ = fit.parameters
    assert fit.status is FitStatus.CONVERGED
    assert fit.values == pytest.approx([2.0, 3.0, 1.0], rel=0.01)
    assert b.standard_error == pytest.approx(0.1, rel=1e-3)
    # a = 6 / b: its relative error is that of the prior.
    assert a.standard_error / 2.0 == pytest.approx(0.1 / 3.0, rel=0.02)
    assert "its prior holds it" in a.sentence
    assert b.prior.share == pytest.approx(1.0, abs=0.01)
    assert fitted(50.0).status is FitStatus.NOT_IDENTIFIABLE


def test_a_dead_parameter_is_called_dead_spares_the_others_and_keeps_its_prior():
    def curve(v):
        return v[0] * np.exp(-TIME)

    fit = fit_simulator(rig(curve, [2.0, 0.0]), (free("gain"), free("ghost")))
    assert fit.status is FitStatus.NOT_IDENTIFIABLE
    assert flags(fit) == {"gain": set(), "ghost": {Flag.DEAD}}
    gain, ghost = fit.parameters
    assert gain.interval95 is not None
    assert ghost.interval95 is None
    assert ghost.sentence == "the data do not depend on ghost"
    assert fit.determined == ()
    nothing = fit_simulator(rig(lambda v: np.exp(-TIME), [0.0]), (free("ghost"),))
    assert nothing.status is FitStatus.NOT_IDENTIFIABLE
    known = Prior(mean=3.0, standard_deviation=0.2, source="data sheet")
    fit = fit_simulator(rig(curve, [2.0, 0.0]), (free("gain"), free("ghost", prior=known)))
    ghost = fit.parameters[1]
    assert fit.status is FitStatus.CONVERGED
    assert (ghost.value, ghost.standard_error) == pytest.approx((3.0, 0.2))
    assert ghost.flags == (Flag.DEAD,)


def test_a_trade_off_names_its_partner_and_keeps_its_interval():
    far = 100.0 + TIME  # slope and offset of a line far from the origin
    pair = (free("slope", 0.4, -5.0, 5.0), free("offset", 0.0, -500.0, 500.0))
    fit = fit_simulator(rig(lambda v: v[0] * far + v[1], [0.5, 3.0]), pair)
    assert Flag.TRADE_OFF in flags(fit)["slope"]
    assert fit.parameters[0].partners == ("offset",)
    assert fit.parameters[0].interval95 is not None
    assert abs(fit.correlation[0, 1]) > 0.95
    assert fit.status is FitStatus.CONVERGED


def test_an_error_larger_than_the_range_is_a_flag():
    rows = np.column_stack([np.ones(10), np.linspace(-0.01, 0.01, 10)])
    measured = rows @ [1.0, 1.0] + 0.3 * np.cos(40.0 * np.arange(10))
    pair = (free("c"), free("k", 1.0, 0.5, 1.5))
    k = fit_simulator(line_rig(rows, measured, noise_sd=None), pair).parameters[1]
    assert (Flag.NOT_PINNED in k.flags) or (Flag.AT_BOUND in k.flags)


def test_flags_do_not_depend_on_units():
    def scaled(v):
        return product([v[0] * 1e-6, v[1] * 1e6, v[2]])

    three = (free("a", 2e6, 1e5, 1e7), free("b", 2e-6, 1e-7, 1e-5), free("rate", 2.0))
    fit = fit_simulator(rig(scaled, [2e6, 3e-6, 1.0]), three)
    assert fit.status is FitStatus.NOT_IDENTIFIABLE
    assert flags(fit)["rate"] == set()


def test_a_number_that_the_data_do_not_depend_on_stays_as_it_was():
    line = rig(lambda v: v[0] * np.exp(-TIME) + 0.0 * v[1], [2.0, 0.0])
    fit = fit_simulator(line, (free("a"), free("idle", 0.0, 0.0, 5.0)))
    assert flags(fit) == {"a": set(), "idle": {Flag.DEAD}}
    assert fit.values[1] == 0.0
