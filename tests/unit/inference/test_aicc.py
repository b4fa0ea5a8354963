"""AICc weighs what a fit misses against its unknowns, however few samples there are."""

from __future__ import annotations

import math

import pytest

from pamsim.inference.aicc import aicc_above_best


def test_with_many_samples_it_is_that_of_the_textbook():
    found = aicc_above_best([2.0, 1.0, 0.99], [2.0, 3.0, 4.0], 50.0)
    stated = [
        50.0 * math.log(square) + 2.0 * k + 2.0 * k * (k + 1.0) / (50.0 - k - 1.0)
        for square, k in ((2.0, 2.0), (1.0, 3.0), (0.99, 4.0))
    ]
    assert found == pytest.approx([score - min(stated) for score in stated])
    assert found[1] == 0.0


def test_of_equal_errors_the_fit_with_fewer_unknowns_is_best():
    for samples in (0.5, 3.0, 30.0):
        first, second, third = aicc_above_best([1.0, 1.0, 1.0], [2.0, 3.0, 9.0], samples)
        assert first == 0.0 < second < third


@pytest.mark.parametrize("samples", [3.0, 5.0, 9.0])
def test_few_samples_still_tell_missing_nearly_all_from_missing_nearly_nothing(samples):
    """The step of an arm is worth three samples: an integrator was best, with 40 % fit."""
    scores = aicc_above_best([0.36, 2e-4, 1.9e-4], [2.0, 4.0, 12.0], samples)
    assert scores[1] == 0.0


def test_no_error_at_all_is_no_reason_to_fail():
    assert aicc_above_best([1.0, 0.0], [1.0, 2.0], 20.0)[1] == 0.0
