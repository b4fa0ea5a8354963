"""The fit of a pleated muscle's polynomial force function to its exact shape."""

from __future__ import annotations

import pytest

from pamsim.core.errors import ParameterError
from pamsim.papers.vandamme2008.shape import fit_pleated, worst_relative_error
from pamsim.physics.force_laws.force_law import coefficients_of
from pamsim.physics.force_laws.pleated import FIT_RANGE, SLENDERNESS_6


def test_the_fit_for_slenderness_6_is_within_0_21_percent():
    assert FIT_RANGE == (0.05, 0.35)
    assert worst_relative_error(SLENDERNESS_6, 6.0) < 2.1e-3
    assert worst_relative_error(SLENDERNESS_6, 6.0) > 2.0e-3  # the number in the documentation


def test_the_stored_coefficients_are_those_of_the_fit():
    assert coefficients_of(fit_pleated(6.0)) == pytest.approx(
        coefficients_of(SLENDERNESS_6), rel=1e-7
    )


def test_the_fit_of_another_muscle_does_as_well():
    assert worst_relative_error(fit_pleated(10.0), 10.0) < 3e-3


def test_a_range_in_which_the_muscle_does_not_pull_is_refused():
    for contractions in ((0.05, 0.45), (-0.01, 0.3), (0.5, 1.5)):
        with pytest.raises(ParameterError, match=r"inside \(0, 0\.4025\)"):
            fit_pleated(6.0, contractions, points=40)
