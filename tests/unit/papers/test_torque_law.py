"""Torque laws without a muscle: planted coefficients, rows that are really unseen, no false law."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from pamsim.core.units import DEG_PER_RAD, PA_PER_BAR
from pamsim.papers.torque_law import EXTRA_TERMS, fit_torque_law, torque_laws
from pamsim.recordings.printed import distinct_steps

PLANTED = {"k1": 3.4, "k5": 25.0, "t": 0.1, "c": 0.2, "o": 0.05}


def planted(extra, off=0.0):
    """Printed rows whose difference of pressures is what a known law asks for; small ones are off.

    The sum of the pressures and the printed angle are kept, so that no root is to be found.
    """
    law = PLANTED | dict.fromkeys({"c", "o"} - set(extra), 0.0)

    def row(step):
        b, both = step.angle, sum(step.pressure) / PA_PER_BAR
        push = (law["k1"] + law["c"] * both) * b + law["k5"] * b**5 + law["o"]
        push -= law["t"] * step.load
        pair = (0.5 * PA_PER_BAR * (both + push), 0.5 * PA_PER_BAR * (both - push))
        return replace(step, pressure=pair, angle=b + (off if step.size == "small" else 0.0))

    return tuple(map(row, distinct_steps()))


def test_planted_coefficients_are_recovered_and_predict_what_was_held_out():
    for extra in EXTRA_TERMS:
        law = fit_torque_law(planted(extra), extra)
        wanted = {name: PLANTED[name] for name in ("k1", "k5", "t", *extra)}
        assert law.coefficients == pytest.approx(wanted, rel=1e-5)
        for error in (law.rms_deg, law.left_out_rms_deg, law.small_steps_rms_deg):
            assert error < 1e-4, extra


def test_small_steps_are_predicted_by_a_law_that_has_not_seen_them():
    law = fit_torque_law(planted(("o",), 1.0 / DEG_PER_RAD), ("o",))
    assert law.small_steps_rms_deg == pytest.approx(1.0, rel=1e-4)
    assert 0.1 < law.rms_deg < 0.9  # the fit to all rows has seen them


def test_held_out_errors_of_the_printed_rows():
    """The large and medium rows alone do not determine how the sum of pressures stiffens the arm:
    their best law has angles that fall with the pressure difference at high sums, and predicts
    nothing."""
    plain, stiffened, offset = torque_laws()
    for law in (plain, stiffened, offset):
        assert law.left_out_rms_deg > law.rms_deg
    assert stiffened.left_out_rms_deg < plain.left_out_rms_deg < offset.left_out_rms_deg
    assert plain.small_steps_rms_deg > plain.left_out_rms_deg
    assert math.isnan(stiffened.small_steps_rms_deg)
