"""Models of several inputs: planted numbers, chosen structure, and the same plant elsewhere."""

import control
import numpy as np
import pytest

from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.curves import step_response_band
from pamsim.identification.fit import fit as fit_model
from pamsim.identification.identify import identify
from pamsim.identification.records import SignalRecord
from pamsim.identification.residual_tests import residual_independence, residual_nonlinearity
from pamsim.identification.structure_scan import StructureScan
from pamsim.identification.transfer_function import (
    continuous,
    sampled_plants,
    state_space,
    with_held_input,
)
from tests.unit.identification.planted import fit_continuous, lags, log, refuses, sampled, steps

TS, N = 0.02, 1500
CONSTANTS = (0.06, 0.5)
GAINS, ZERO, DELAY = (2.0, -0.7), -0.4, 0.13  # the zero is of the second input
ASKED = {"order": 2, "zeros": (0, 1), "dead_time": True, "undelayed": (1,)}


def given(seed):
    rng = np.random.default_rng(seed)
    return np.column_stack([steps(rng, N, hold) for hold in (20, 33)])


def record(seed=1, noise=0.02, squares=0.0):
    u = given(seed)
    below = lags(*CONSTANTS)
    y = sampled([GAINS[0]], below, u[:, 0], TS, DELAY)
    y += sampled([GAINS[1] * ZERO, GAINS[1]], below, u[:, 1] + squares * u[:, 0] * u[:, 1], TS)
    y += 3.0 + noise * np.random.default_rng(seed + 100).standard_normal(N)
    return SignalRecord("both", TS * np.arange(N), u, y, ("Pa", "V"), "rad")


@pytest.fixture(scope="module")
def fit():
    return fit_continuous([record()], **ASKED, start="rest")


def test_planted_numbers_lie_in_their_intervals(fit):
    planted = {"K[1]": GAINS[0], "K[2]": GAINS[1], "T1": CONSTANTS[0], "T2": CONSTANTS[1]}
    planted |= {"Tz[2]": ZERO, "L[1]": DELAY}
    assert [e.name for e in fit.estimates] == list(planted)
    for name, value in planted.items():
        low, high = fit[name].interval95
        assert low < value < high, name
        assert high - low < 0.1 * abs(value), name
    assert (fit["K[1]"].unit, fit["K[2]"].unit) == ("rad/Pa", "rad/V")
    assert residual_independence(fit, [record()]).independent
    assert residual_nonlinearity(fit, [record()]).p_value > 0.01
    bent = record(squares=0.5)  # products of inputs are a nonlinearity
    assert residual_nonlinearity(fit_continuous([bent], **ASKED), [bent]).p_value < 1e-6


def test_what_is_held_is_not_fitted_and_the_rest_fits_around_it(fit):
    structure = fit.structure
    held = fit_model([record()], structure, held={"K[2]": GAINS[1]})
    known = held["K[2]"]
    assert (known.value, known.interval95, known.held) == (GAINS[1], None, True)
    low, high = held["K[1]"].interval95
    assert low < GAINS[0] < high
    wrong = fit_model([record()], structure, held={"K[2]": 2.0 * GAINS[1]})
    assert wrong["K[2]"].value == 2.0 * GAINS[1]
    assert wrong.fit_percent < held.fit_percent - 1.0 < fit.fit_percent
    refuses("'K' cannot be held", fit_model, [record()], structure, held={"K": 1.0})


def test_the_sum_of_the_channels_is_the_model(fit):
    u, total = given(1), np.zeros(N)
    for i in range(2):
        alone = SignalRecord("one", TS * np.arange(N), u[:, i], record().output)
        run = fit.channel(i).simulate(alone)
        total += run - run[0]
    both = fit.simulate(record())
    np.testing.assert_allclose(total - np.mean(total), both - np.mean(both), atol=1e-9)
    assert (fit.channel(0).dead_time, fit.channel(1).dead_time) == (fit["L[1]"].value, 0.0)
    assert [e.name for e in fit.channel(1).estimates] == ["K", "T1", "T2", "Tz"]
    refuses("no input 2", fit.channel, 2)
    for question in ("dead_time", "numerator", "zeros"):
        refuses(r"take one by channel\(i\)", getattr, fit, question)


def test_the_scan_finds_which_input_has_the_zero_and_which_the_dead_time():
    scan = StructureScan(records=[record()], start="rest", report=lambda structure: None)
    two = ContinuousStructure(2, 1, True, False, inputs=2)
    scan.fit(two, [np.array([0.0, 0.0, 0.1, 0.1])])
    scan.near_the_best()
    best = min(scan.fits.values(), key=lambda one: one.criterion).structure
    assert (best.order, best.integrators) == (2, 0)
    assert (best.numerator_zeros, best.delayed) == ((0, 1), (0,))
    assert best.sentence == "2 poles, 0 and 1 zeros, dead time of input 1"
    same = ContinuousStructure(2, zeros=1, inputs=2, zeros_each=(1, 1))
    assert same == ContinuousStructure(2, zeros=1, inputs=2)


def test_an_input_may_rest_in_one_of_the_trials():
    u = given(5)
    u[:, 1] = 0.1
    y = sampled([GAINS[0]], lags(*CONSTANTS), u[:, 0], TS, DELAY)
    y += 0.02 * np.random.default_rng(6).standard_normal(N)
    alone = SignalRecord("first alone", TS * np.arange(N), u, y, ("Pa", "V"), "rad")
    for squares, bent in ((0.0, False), (0.3, True)):
        records = [record(squares=squares), alone]
        test = residual_nonlinearity(fit_continuous(records, **ASKED), records)
        assert (test.p_value < 1e-3) is bent


def test_what_one_input_does_not_have_is_said_of_it_alone():
    found = fit_continuous([record(2)], order=2, zeros=(0, 1), dead_time=True)
    low, high = found["L[2]"].interval95
    assert (found["L[2]"].value, low) == (0.0, 0.0)
    assert 0.5 * TS <= high < 2.0 * TS
    assert found["L[1]"].interval95[0] < DELAY < found["L[1]"].interval95[1]
    assert "no dead time of input 2 is detected" in found.sentence
    u = given(4)
    y = sampled([2.0], lags(0.3), u[:, 0], TS) + 0.05 * np.random.default_rng(5).standard_normal(N)
    found = fit_continuous([SignalRecord("idle", TS * np.arange(N), u, y)], order=1)
    assert found.status == "converged"
    assert "input 2 explains nothing of the output" in found.sentence
    assert found["K[1]"].interval95[0] < 2.0 < found["K[1]"].interval95[1]


def test_inputs_that_do_not_change_by_themselves_are_refused(tmp_path):
    u = given(6)[:200]
    columns = TS * np.arange(200), u[:, 0], 5.0 - 2.0 * u[:, 0], np.full(200, 5.0), u[:, 1]
    path = log(tmp_path / "log.csv", "time_s,a,b,c,y", *columns)
    refuses("'b' follows from a:", identify, path, input=["a", "b"], output="y")
    refuses("'c' never changes within a trial", identify, path, input=["a", "c"], output="y")


def test_an_integrating_output_has_its_rate_where_all_inputs_are_zero():
    u = given(6)
    u = u - np.mean(u, axis=0)
    y = sampled([2.0], [0.3, 1.0, 0.0], u[:, 0], TS) + sampled([1.0], [0.3, 1.0, 0.0], u[:, 1], TS)
    y += 0.25 * TS * np.arange(N) + 0.02 * np.random.default_rng(7).standard_normal(N)
    whole = SignalRecord("run", TS * np.arange(N), u, y, ("V",), "m")
    found = fit_continuous([whole], order=1, integrators=1, start="free")
    for name, value in {"K[1]": 2.0, "K[2]": 1.0, "T": 0.3, "r0": 0.25}.items():
        assert found[name].value == pytest.approx(value, rel=0.02), name
    assert (found["r0"].unit, found["K[1]"].unit) == ("m/s", "m/V/s")


def test_python_control_gets_a_column_per_input_and_few_states(fit):
    transfer, space = continuous(fit, pade_order=4), state_space(fit, pade_order=4)
    assert (transfer.noutputs, transfer.ninputs) == (1, 2)
    assert space.nstates == 2 + 4  # two poles, and those of one dead time
    times = np.linspace(0.0, 4.0, 401)
    for i in range(2):
        expected = step_response_band(fit.channel(i), times).output
        for system in (transfer[0, i], space[0, i]):
            found = control.step_response(system, T=times).outputs
            np.testing.assert_allclose(np.ravel(found), expected, atol=0.02)
    plants = sampled_plants(fit, 3, np.random.default_rng(8), pade_order=2)
    assert {plant.ninputs for plant in plants} == {2}
    refuses("pade_order", state_space, fit)
    refuses("one by channel", with_held_input, fit, TS)
