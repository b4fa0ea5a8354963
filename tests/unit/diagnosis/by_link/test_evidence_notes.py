"""What few trials can show is printed beside the result."""

import itertools
from types import SimpleNamespace

import pytest

from pamsim.comparison.noise_floor import FloorRoute
from pamsim.diagnosis.by_link.evidence_notes import evidence_notes


def judged(*repeats):
    """So many held-out trials of each input."""
    units = [f"{i}_{k}" for i, count in enumerate(repeats) for k in range(count)]
    return SimpleNamespace(
        judged=SimpleNamespace(units=units),
        input=lambda unit: unit[0],
        in_parts=False,
        varies=False,
    )


def share_of_signs(*repeats):
    """Share of all signs of trials under which no product of two repeats changes its sign."""
    every = itertools.product((-1, 1), repeat=sum(repeats))
    ends = list(itertools.accumulate(repeats))
    own = [slice(end - count, end) for end, count in zip(ends, repeats, strict=True)]
    unchanged = [all(len(set(signs[rows])) == 1 for rows in own) for signs in every]
    return sum(unchanged) / len(unchanged)


@pytest.mark.parametrize("repeats", [(5,), (3, 3), (4, 2), (2, 2, 2)])
def test_the_smallest_p_value_is_that_of_all_signs(repeats):
    (note,) = evidence_notes({}, judged(*repeats), 0.05)
    printed = float(note.partition("p = ")[2].split()[0])
    assert printed == pytest.approx(
        2.0 * share_of_signs(*repeats), rel=0.05
    )  # two tests, two digits


def test_enough_trials_need_no_note():
    assert evidence_notes({}, judged(3, 3, 3, 3), 0.05) == ()
    # Each beside a fitted one.
    assert evidence_notes({}, judged(1, 1, 1, 1, 1, 1), 0.05) == ()
    (note,) = evidence_notes({}, judged(1, 1, 1, 1, 1), 0.05)
    assert "5 held-out trials" in note
    assert float(note.partition("p = ")[2].split()[0]) == pytest.approx(
        2.0 * share_of_signs(2, 2, 2, 2, 2), rel=0.02
    )


@pytest.mark.parametrize(
    ("source", "advice"),
    [(FloorRoute.REPEATS, "hold out 5 trials"), (FloorRoute.HOLDS, "record every input three")],
)
def test_parts_of_trials_come_with_advice_on_what_would_decide(source, advice):
    noise = {("air", "pressure"): SimpleNamespace(source=source)}
    found = SimpleNamespace(**{**vars(judged(2)), "in_parts": True})
    *_, last = evidence_notes(noise, found, 0.05)
    assert advice in last
