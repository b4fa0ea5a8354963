"""After a choice of structure, gains and dead times span what the data do not reject."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.identification import choose
from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.status import FitStatus
from tests.unit.identification.planted import fit_continuous, record

RECORDS = [record(1, delay=0.1, noise=0.02)]
CHOSEN = fit_continuous(RECORDS, order=1, dead_time=True)
SAME = replace(CHOSEN.structure, real_lags=False)


def rough(structure, gain, delay=None):
    """A rough fit: a time constant of 0.3 s, perhaps a dead time, and zeros of no influence."""
    searched = np.append(np.full(structure.order, np.log(0.3)), [] if delay is None else delay)
    rest = np.zeros(structure.unknowns - searched.size)
    rest[0] = gain
    return SimpleNamespace(
        structure=structure, x=searched, coordinates=np.concatenate([searched, rest])
    )


def span(monkeypatch, other, *, gain=None, delay=0.1, status=FitStatus.CONVERGED):
    """The chosen fit beside another structure, whose own fit is given by its gain's interval."""
    estimates = [replace(CHOSEN["L"], value=delay)]
    if gain is not None:
        estimates.append(replace(CHOSEN["K"], interval95=gain))
    found = SimpleNamespace(status=status, estimates=estimates)
    monkeypatch.setattr(choose, "fit_model", lambda *args, **more: found)
    choice = SimpleNamespace(
        fits=[rough(SAME, 2.0, 0.1), other], not_rejected=lambda place: [other]
    )
    return choose.spanning_structures(CHOSEN, choice, RECORDS)


TWO_POLES = rough(replace(SAME, order=2), 2.5, 0.1)


def test_a_gain_spans_that_of_a_structure_whose_numbers_are_determined(monkeypatch):
    wide = span(monkeypatch, TWO_POLES, gain=(2.4, 2.6), delay=0.07)
    assert wide["K"].interval95 == (CHOSEN["K"].interval95[0], 2.6)
    assert wide["L"].interval95 == (0.07, CHOSEN["L"].interval95[1])
    assert wide["T"] == CHOSEN["T"]
    assert wide.sentence.endswith("span other structures that the records do not reject")


@pytest.mark.parametrize(
    ("other", "found"),
    [
        (TWO_POLES, {"gain": (2.4, 2.6), "status": FitStatus.DEGENERATE}),
        (TWO_POLES, {"gain": (-9.0, 9.0)}),
        (rough(replace(SAME, order=2), 2.0, 0.1), {"gain": (2.4, 2.6)}),
        (rough(replace(SAME, integrators=1), 2.5, 0.1), {"gain": (2.4, 2.6)}),
    ],
    ids=["not determined", "a gain that may be 0", "the same gain roughly", "another kind of gain"],
)
def test_a_structure_that_shows_nothing_else_widens_nothing(monkeypatch, other, found):
    assert span(monkeypatch, other, **found) is CHOSEN


def test_a_dead_time_may_be_none_where_a_structure_without_is_not_rejected(monkeypatch):
    poles = rough(replace(SAME, order=3, dead_time=False), 2.0)
    wide = span(monkeypatch, poles, status=FitStatus.DEGENERATE)
    assert wide["L"].interval95 == (0.0, CHOSEN["L"].interval95[1])
    assert wide["K"] == CHOSEN["K"]


def test_a_model_that_the_scan_does_not_hold_stays():
    other = SimpleNamespace(fits=[rough(ContinuousStructure(order=4), 2.0)])
    assert choose.spanning_structures(CHOSEN, other, RECORDS) is CHOSEN
