"""python-control transfer functions of fitted models agree with what was fitted."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.linear.continuous_fit import fit_continuous
from pamsim.linear.continuous_structure import ContinuousStructure
from pamsim.linear.discrete_fit import fit_oe
from pamsim.linear.first_second_order import first_order_step, second_order_step
from pamsim.linear.step_identification import fit_step
from pamsim.linear.transfer_function import (
    continuous,
    discrete,
    sampled_plants,
    state_space,
    step_response,
    with_held_input,
)
from tests.unit.linear.planted import arx, record, refuses, simulated

TIME = np.linspace(0.0, 5.0, 501)


@pytest.mark.parametrize(("t1", "t2"), [(0.090314, 0.57873), (0.5, 0.5), (0.01, 2.0)])
def test_second_order_closed_form_is_the_step_of_control(t1: float, t2: float) -> None:
    fit = replace(
        fit_step(TIME, second_order_step(TIME, 0.1, 0.6), order=2),
        coordinates=np.array([np.log(t1), np.log(t2), 3.0]),
    )
    expected = second_order_step(TIME, t1, t2, 3.0)
    np.testing.assert_allclose(step_response(continuous(fit), TIME), expected, atol=1e-9)


def test_first_order_closed_form_is_the_step_of_control() -> None:
    fit = fit_step(TIME, first_order_step(TIME, 0.64595), order=1)
    response = step_response(continuous(fit), TIME)
    np.testing.assert_allclose(response, first_order_step(TIME, 0.64595), atol=1e-9)


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_discrete_step_is_the_simulated_arx(delay: int) -> None:
    interval = 1.0 / 300.0  # its times, written with six decimals, are not its multiples
    model = arx((-1.2, 0.5), (0.3, -0.1), interval, delay)
    transfer = discrete(model)
    assert transfer.dt == interval
    np.testing.assert_allclose(
        step_response(transfer, np.round(np.arange(501) * interval, 6)),
        simulated(model, np.ones(501)),
        atol=1e-9,
    )


def test_arx_of_a_sampled_lag_becomes_that_lag() -> None:
    pole = np.exp(-0.01 / 0.4)
    model = arx((-pole,), (2.0 * (1.0 - pole),), 0.01)
    expected = first_order_step(TIME, 0.4, 2.0)
    np.testing.assert_allclose(step_response(continuous(model), TIME), expected, atol=1e-9)
    np.testing.assert_allclose(step_response(discrete(model), TIME), expected, atol=1e-9)


def test_dead_time_needs_a_pade_order() -> None:
    late = second_order_step(TIME - 0.2, 0.1, 0.6)
    fit = replace(
        fit_step(TIME, second_order_step(TIME, 0.1, 0.6), order=2),
        structure=ContinuousStructure(2, dead_time=True),
        coordinates=np.array([np.log(0.1), np.log(0.6), 0.2, 1.0]),
    )
    refuses("pade_order", continuous, fit)
    response = step_response(continuous(fit, pade_order=5), TIME)
    np.testing.assert_allclose(response, late, atol=2e-3)


def test_refusals() -> None:
    ringing = arx((-1.8, 0.9), (0.1,), 0.01)
    refuses("oscillates", continuous, ringing)
    refuses("sampled at", step_response, discrete(ringing), 2.0 * TIME)
    refuses("start at 0", step_response, discrete(ringing), TIME + 1.0)
    refuses("not uniform", step_response, discrete(ringing), TIME**2)


def test_a_held_input_sees_the_plant_with_its_dead_time() -> None:
    trial = record(1, constants=(0.1,), delay=0.05)
    fit = fit_continuous([trial], order=1, dead_time=True)
    times = np.arange(trial.time.size) * trial.sample_time
    for delay in (0.0, 0.004, 0.06, 0.07, 0.1234):
        late = replace(fit, coordinates=np.array([fit.coordinates[0], delay, 2.0]))
        plant = with_held_input(late, trial.sample_time)
        output = control.forced_response(plant, times, trial.input).outputs
        expected = 2.0 * fit.structure.responses(late.coordinates, trial)[:, 0]
        np.testing.assert_allclose(output, expected, atol=1e-9)
    refuses("period = 0 s must be above 0", with_held_input, fit, 0.0)


def test_state_space_answers_as_the_transfer_function() -> None:
    trial = record(2, constants=(0.1, 0.5), noise=0.02)
    for fit, form in (
        (fit_continuous([trial], order=2), continuous),
        (fit_oe([trial], nb=2, nf=2, nk=1), discrete),
    ):
        times = np.arange(100) * trial.sample_time
        np.testing.assert_allclose(
            step_response(state_space(fit), times), step_response(form(fit), times), atol=1e-9
        )


def test_drawn_plants_have_the_covariance_of_the_fit() -> None:
    fit = fit_continuous([record(3, constants=(0.1, 0.5), noise=0.05)], order=2)
    plants = sampled_plants(fit, 600, np.random.default_rng(1))
    poles = np.sort([-plant.poles().real for plant in plants], axis=1)[:, ::-1]
    gains = [float(plant.dcgain()) for plant in plants]
    found = np.cov(np.column_stack([-np.log(poles), gains]).T)
    order = [*np.argsort(fit.coordinates[:2]), 2]
    expected = fit.covariance[np.ix_(order, order)]
    error = np.sqrt(np.diag(expected))
    # Of 600 draws: 1/sqrt(600) = 4 % of an error, four times.
    np.testing.assert_allclose(
        found / np.outer(error, error), expected / np.outer(error, error), atol=0.16
    )
    np.testing.assert_allclose(
        np.mean(np.log(poles), axis=0), -fit.coordinates[order[:2]], atol=0.16 * error[:2].max()
    )


def test_drawn_plants_differ_by_as_much_as_the_prediction_errs() -> None:
    """Closed loops of the planted lag, against those predicted from noisy records of it."""
    times, errors = 0.02 * np.arange(1, 30), []

    def closed(gain: float, lag: float) -> np.ndarray:
        around = 1.0 + 3.0 * gain  # a controller of gain 3
        return first_order_step(times, lag / around, 3.0 * gain / around)

    for seed in range(15):
        fit = fit_continuous([record(seed, noise=0.3, n=200)], order=1)
        plants = sampled_plants(fit, 25, np.random.default_rng(seed))
        steps = [closed(float(p.dcgain()), -1.0 / float(p.poles()[0].real)) for p in plants]
        errors.append((closed(2.0, 0.3) - np.mean(steps, axis=0)) / np.std(steps, axis=0))
    assert 0.7 < np.sqrt(np.mean(np.square(errors))) < 1.4


def test_drawn_plants_are_as_stable_as_the_fit() -> None:
    fit = fit_oe([record(4, constants=(0.3, 1.0), noise=0.02)], nb=2, nf=2, nk=1)
    wide = replace(fit, covariance=1e4 * fit.covariance)
    plants = sampled_plants(wide, 20, np.random.default_rng(2))
    assert all(np.all(np.abs(plant.poles()) <= 1.0) for plant in plants)
    with pytest.raises(InputError, match="draws are as stable"):
        sampled_plants(replace(fit, covariance=1e10 * fit.covariance), 20, np.random.default_rng(2))
    with pytest.raises(InputError, match="no covariance"):
        sampled_plants(replace(fit, covariance=None), 1, np.random.default_rng(2))


def test_a_drawn_dead_time_is_never_below_0() -> None:
    fit = fit_continuous([record(5, delay=0.02, noise=0.3)], order=1, dead_time=True)
    wide = replace(fit, covariance=np.diag([0.0, 0.1, 0.0]) ** 2)
    plants = sampled_plants(wide, 30, np.random.default_rng(3), period=0.02)
    states = [plant.nstates for plant in plants]
    assert min(states) == 1  # without a dead time
    assert max(states) > 3
