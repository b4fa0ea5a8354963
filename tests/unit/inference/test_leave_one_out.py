"""Leave-one-out: the closed form of linear models, rows that are really unseen, refusals."""

import numpy as np
import pytest

from pamsim.inference.fit_simulator import fit_simulator
from pamsim.inference.free_parameter import Prior
from pamsim.inference.leave_one_out import FittedForm, nested_leave_one_out
from tests.records import script
from tests.unit.core.refusals import refused
from tests.unit.inference.closed_form_rigs import Rig, free, line_rig

leave_one_out = script("static_models").leave_one_out

NOISE = 0.1
PLACES = np.linspace(0.0, 2.0, 12)


def line(seed=0, count=15):
    rng = np.random.default_rng(seed)
    return rng.standard_normal((count, 3)), 2.0 * rng.standard_normal(count)


def three(**rest):
    return tuple(free(name, 1.0, -50.0, 50.0, **rest) for name in "abc")


def left_out(rig, parameters):
    return leave_one_out(rig, parameters, fit_simulator(rig, parameters))


def bent(values, at=PLACES):
    return values[0] * np.exp(-values[1] * at)


def bent_rig(measured, at=PLACES):
    trial = ("table", "table", "force", lambda v: bent(v, at), measured)
    return Rig([trial], interval=None, noise_sd=NOISE)


BENT = (free("gain"), free("rate", scale="log"))
MEASURED = bent((2.0, 1.5)) + NOISE * np.random.default_rng(5).standard_normal(PLACES.size)


def test_a_linear_model_gives_the_closed_form():
    """Predicted residual sum of squares: e / (1 - h), h the diagonal of the hat matrix."""
    rows, measured = line()
    found = left_out(line_rig(rows, measured, noise_sd=NOISE), three())
    hat = rows @ np.linalg.pinv(rows)
    errors = (hat @ measured - measured) / (1.0 - np.diag(hat))
    assert found == pytest.approx(errors, abs=1e-6)


def test_priors_are_kept_in_every_refit():
    rows, measured = line(seed=1)
    known = Prior(mean=0.5, standard_deviation=0.05, source="data sheet")
    found = left_out(line_rig(rows, measured, noise_sd=NOISE), three(prior=known))
    whole = np.vstack([rows / NOISE, np.eye(3) / known.standard_deviation])
    right = np.append(measured / NOISE, np.full(3, known.mean / known.standard_deviation))
    for i, error in enumerate(found):
        best = np.linalg.lstsq(np.delete(whole, i, 0), np.delete(right, i), rcond=None)[0]
        assert error == pytest.approx(rows[i] @ best - measured[i], abs=1e-5)


def test_refits_of_a_bent_model_are_nearly_those_of_fits_to_the_other_rows():
    """The common Jacobian costs a few percent of a standard error, no more."""
    rig = bent_rig(MEASURED)
    fit = fit_simulator(rig, BENT)
    rig.batches.clear()
    found = leave_one_out(rig, BENT, fit)
    assert set(rig.batches) == {PLACES.size}  # all refits are simulated in one call
    assert len(rig.batches) > 1  # until they are settled
    for i, error in enumerate(found):
        others = np.delete(np.arange(PLACES.size), i)
        alone = fit_simulator(bent_rig(MEASURED[others], PLACES[others]), BENT)
        miss = bent(alone.values)[i] - MEASURED[i]
        assert error == pytest.approx(miss, abs=0.05 * NOISE)


def test_ranges_hold_in_refits_too():
    rows, measured = line(seed=2)
    best = np.linalg.lstsq(rows, measured, rcond=None)[0]
    narrow = tuple(
        free(name, value, value - 0.01, value + 0.01)
        for name, value in zip("abc", best, strict=True)
    )
    found = left_out(line_rig(rows, measured, noise_sd=NOISE), narrow)
    shift = np.abs(found - (rows @ best - measured))  # by values that have moved by 0.01 at most
    reach = 0.01 * np.sum(np.abs(rows), axis=1)
    assert np.all(shift <= reach * (1.0 + 1e-9))
    free_shift = np.abs(left_out(line_rig(rows, measured, noise_sd=NOISE), three()) - found)
    assert np.max(free_shift) > np.max(reach)  # and rows pull against the range


def test_what_proves_nothing_or_cannot_be_simulated_is_refused():
    rows, measured = line()
    rig = line_rig(rows, measured, interval=0.01, noise_sd=NOISE)
    fit = fit_simulator(rig, three())
    with refused("trial table", "hold out whole trials"):
        leave_one_out(rig, three(), fit)
    few = line_rig(rows[:4], measured[:4], noise_sd=NOISE)
    with refused("4 rows less one", "3 parameters"):
        left_out(few, three())
    rig = bent_rig(MEASURED)
    fit = fit_simulator(rig, BENT)
    calls = iter(range(100))
    rig.diverges = lambda values: next(calls) == 2
    with refused("without row 3 "):
        leave_one_out(rig, BENT, fit)


def linear_form(rows, measured):
    """A linear model of measurements with its exact errors; no column means no parameter."""
    hat = rows @ np.linalg.pinv(rows)
    residual = hat @ measured - measured
    return FittedForm(residual=residual, jacobian=rows, left_out=residual / (1 - np.diag(hat)))


def predicted(rows, measured, unseen, at):
    """Error at a row by a fit that did not see some rows, from scratch."""
    keep = np.setdiff1d(np.arange(measured.size), unseen)
    best = np.linalg.lstsq(rows[keep], measured[keep], rcond=None)[0]
    return float(rows[at] @ best - measured[at])


def some_forms(seed, count=12):
    """Linear models of one, two and no columns, of which none is clearly the best."""
    rng = np.random.default_rng(seed)
    columns = rng.standard_normal((count, 4))
    measured = columns[:, 0] + 0.8 * columns[:, 1] + rng.standard_normal(count)
    return [columns[:, picked] for picked in ([0], [1], [0, 1], [2, 3], [])], measured


def test_nested_errors_are_those_of_choosing_and_refitting_from_scratch():
    varied = 0
    for seed in range(4):
        designs, measured = some_forms(seed)
        errors, chosen = nested_leave_one_out([linear_form(rows, measured) for rows in designs])
        count = measured.size
        for i in range(count):
            others = [j for j in range(count) if j != i]
            inner = [
                sum(predicted(rows, measured, [i, j], j) ** 2 for j in others) for rows in designs
            ]
            best = int(np.argmin(inner))
            assert chosen[i] == best
            alone = predicted(designs[best], measured, [i], i)
            assert errors[i] == pytest.approx(alone, abs=1e-9)
        varied += len(set(chosen)) > 1
    assert varied


def test_a_form_that_the_other_rows_do_not_determine_is_not_chosen():
    """Row 0 alone has a say in the second parameter, so the fit without it has none."""
    designs, measured = some_forms(2)
    only = np.column_stack([designs[0][:, 0], np.eye(measured.size)[0]])
    form = linear_form(designs[0], measured)
    worse = FittedForm(residual=0.1 * form.residual, jacobian=only, left_out=form.left_out)
    assert nested_leave_one_out([worse, form])[1] == [1] * measured.size
