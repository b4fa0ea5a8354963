"""What every claim of every paper must stand up to: its verdict, its numbering, wrong numbers.

All that needs the claims is in this file, so that one process recomputes them once.
"""

from __future__ import annotations

import copy
import functools
import json
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.core.encoding import to_dict
from pamsim.core.errors import InputError
from pamsim.papers import claim as room
from pamsim.papers.claim import Claim, Order, Verdict, evaluate, judge
from pamsim.papers.matiskova2021 import dynamics as matiskova_rig
from pamsim.papers.nguyen2024.geometry import element
from pamsim.papers.numerics import digits_of, several
from pamsim.papers.replicate import PAPERS, Replication
from pamsim.papers.sarosi import equations as sarosi_fits
from pamsim.recordings.printed import Printed
from tests.records import recorded
from tests.unit.papers.second_route import (
    alraouf2025,
    matiskova2021,
    nguyen2024,
    sarosi,
    vandamme2008,
)

ROOT = Path(__file__).resolve().parents[3]
approx = pytest.approx

ROUTES = {
    id: route
    for paper in (alraouf2025, matiskova2021, nguyen2024, sarosi, vandamme2008)
    for id, route in paper.ROUTES.items()
}


@functools.cache
def judged(paper):
    """Claims and notes of a paper, with the rows and results they come from."""
    found = SimpleNamespace(claims={}, notes={}, sources={})
    for id in room.claim_ids(paper):
        found.sources[id] = room.recomputed(id)
        one = judge(id, *found.sources[id])
        (found.claims if isinstance(one, Claim) else found.notes)[id] = one
    return found


def entry(id):
    found = judged(id.rpartition("-")[0])
    return found.claims.get(id) or found.notes[id]


def test_ids_are_numbered_and_a_claim_that_repeats_a_fact_has_its_verdict():
    for paper in PAPERS:
        found = judged(paper)
        assert all(re.fullmatch(rf"{paper}-\d\d", id) for id in (*found.claims, *found.notes))
        for claim in found.claims.values():
            assert claim.paper == paper
            if claim.same_as:
                fact = found.claims[claim.same_as]
                assert fact.same_as is None, claim.id
                assert fact.verdict is claim.verdict, (claim.id, fact.id)


def verdict_of(id, values, printed=None) -> Verdict:
    """Verdict of a claim if these numbers had come out, or had been printed."""
    row, result = judged(id.rpartition("-")[0]).sources[id]
    changed = copy.copy(result)
    old = several(result.value)
    new = [Printed(v, digits_of(o).half_unit) for v, o in zip(values, old, strict=True)]
    changed.value = new if isinstance(result.value, list | tuple) else new[0]
    changed.printed = result.printed if printed is None else printed
    return judge(id, row, changed).verdict


def beyond(edge, half):
    return abs(edge) + 1e-9 + 2.0 * half


def right_numbers(claim):
    """Numbers that make a claim hold as clearly as its intervals allow."""
    numbers = several(claim.recomputed)
    if claim.order:
        rising = [float(k + 1) for k in range(len(numbers))]
        return rising if claim.order is Order.RISING else rising[::-1]
    scatter = claim.scatter or (0.0,) * len(numbers)
    return [
        0.5 * (low + high)
        if None not in (low, high)
        else low + beyond(low, half)
        if high is None
        else high - beyond(high, half)
        for (low, high), half in zip(claim.accepted, scatter, strict=True)
    ]


def wrong_numbers(claim):
    """The right numbers, falsified in turn; each must make the claim fail."""
    right = right_numbers(claim)
    if claim.order:
        yield right[::-1]
    scatter = claim.scatter or (0.0,) * len(right)
    for index, ((low, high), half) in enumerate(zip(claim.accepted, scatter, strict=True)):
        if (low, high) != (None, None):
            wrong = list(right)
            wrong[index] = low - beyond(low, half) if high is None else high + beyond(high, half)
            yield wrong


def holding(claim):
    """The verdict of the right numbers: scatter wider than an interval leaves it open."""
    closed = [(i, half) for i, half in zip(claim.accepted, claim.scatter, strict=False)]
    open_ended = any(None not in i and i[1] - i[0] < 2.0 * half for i, half in closed)
    return Verdict.NOT_SIGNIFICANT if open_ended else claim.kind


def test_every_claim_fails_on_wrong_numbers():
    """Put wrong numbers in: the recomputed ones in turn, then the printed ones."""
    for paper in PAPERS:
        for id, claim in judged(paper).claims.items():
            check_wrong_numbers(id, claim, *judged(paper).sources[id])


def check_wrong_numbers(id, claim, row, result):
    assert all([claim.because, claim.place, claim.statement]), id
    assert "{" not in claim.reason + claim.because, id
    failing = Verdict(row.get("otherwise", Verdict.NOT_REPRODUCIBLE))
    assert verdict_of(id, right_numbers(claim)) is holding(claim), id
    values = several(claim.recomputed)
    for value, edges in zip(values, claim.accepted, strict=True):
        # A number that is wrong by no more than a hundred of its sizes must be out.
        assert all(abs(edge or 0.0) <= 100.0 * max(1.0, abs(value)) for edge in edges), id
    wrong = list(wrong_numbers(claim))
    assert wrong, f"{id} accepts any number"
    for numbers in wrong:
        assert verdict_of(id, numbers) is failing, (id, numbers)
    if result.low is None and result.high is None and result.order is None:
        assert verdict_of(id, values, printed=values) is holding(claim), id
        scatter = claim.scatter or (0.0,) * len(values)
        far = [
            value + beyond(value, half) + high - low
            for value, half, (low, high) in zip(values, scatter, claim.accepted, strict=True)
        ]
        assert verdict_of(id, values, printed=far) is failing, id


def test_a_second_route_gives_the_same():
    """By methods that share no code with pamsim.

    A route returns its number or numbers and how far both methods may be apart. That follows from
    what is known of their errors, such as rounding, the order of a scheme or where a search stops,
    and not from the difference that was found.
    """
    for id, route in ROUTES.items():
        numbers, errors = route()
        apart = np.abs(np.subtract(entry(id).recomputed, numbers))
        assert np.all(apart <= errors), f"{id}: apart by {apart}, known errors {errors}"


def magnitudes(*orders):
    """|K*| = Ke u / |1 + u exp(j alpha pi/2)| with u = 4/3 9^alpha."""
    order = np.array(orders)
    u = 4.0 / 3.0 * 9.0**order
    return tuple(150000.0 * u / np.abs(1.0 + u * np.exp(0.5j * np.pi * order)))


PER_COUNT = 5.0 / 1024.0 / 4.0 * 500.0  # kPa, ten bits over 5 V
NUMBERS = {
    # Least squares with the unit of pressure free, and of a law of angles, searched otherwise.
    "matiskova2021-10": approx((38.80038, -40.20652, 0.0), abs=1e-4),
    "matiskova2021-25": approx(-0.0996151, rel=1e-4),
    "matiskova2021-11": approx(5.96, abs=0.01),  # deg RMS of (23) in bar
    "matiskova2021-12": approx(2.01, abs=0.01),  # with the best scale
    "matiskova2021-13": approx(0.6907, abs=1e-9),  # deg, a0 + a1
    "matiskova2021-29": approx(0.090314 * 0.57873, abs=1e-15),
    "matiskova2021-32": approx(0.7470, abs=1e-4),  # ARX, unit gain
    "matiskova2021-33": approx(0.769434, abs=1e-6),  # s, by sums of geometric series
    "matiskova2021-44": approx(13.06257, abs=1e-5),  # deg RMS, balances by bisection
    "matiskova2021-34": approx(0.64595, abs=1e-4),
    "vandamme2008-01": approx(40.25, abs=0.01),
    "vandamme2008-04": approx((0.0230027, 1.031349, -4.596929, 6.726459, -5.078787), rel=1e-5),
    "vandamme2008-07": (-650.0, 2150.0),
    "vandamme2008-18": approx((1.0477988128, 0.0), abs=1e-9),  # by weights without a relay
    "sarosi-07": 4.0,
    "sarosi-08": 7.0,
    "sarosi-18": approx((104.35, 51.83), abs=0.01),  # N, of a fit with other code
    "sarosi-20": approx((73.41, 27.69), abs=0.01),
    "nguyen2024-02": approx((341.69, 2.6032), rel=1e-4),
    "nguyen2024-03": approx(34.24, abs=0.01),
    "nguyen2024-15": approx(magnitudes(0.8, 0.5, 0.2)),
    "nguyen2024-16": approx((16.09949347, 23.14001530, 19.54941457), rel=1e-8),
    "nguyen2024-17": approx(149.2, abs=0.1),
    "nguyen2024-32": approx((0.142841, 0.397846, 0.0254648), rel=1e-5),
    "alraouf2025-17": approx(0.988874599969, abs=1e-12),  # sums in fractions
    "alraouf2025-32": approx((0.0149924, 0.9965265, 0.1224436, 0.1030662), rel=1e-5),
    "alraouf2025-40": approx((0.3396038, 0.2407918), rel=1e-5),
    "alraouf2025-16": approx(0.04802, abs=5e-6),  # cm^2, of the printed coefficients, rising
    "alraouf2025-20": approx(0.04238, abs=5e-6),  # falling
    "alraouf2025-24": approx(0.03430, abs=5e-6),  # of ours
    "alraouf2025-25": approx(0.03678, abs=5e-6),
    "alraouf2025-54": (0.0, 500.0),
    "alraouf2025-55": approx(PER_COUNT, rel=1e-12),
    "alraouf2025-56": 10.0,
    "alraouf2025-57": 20.0,
    "alraouf2025-58": approx(273.15 * ((2.0 / 58e-4 / 331.3) ** 2 - 1.0), rel=1e-12),  # deg C
    "alraouf2025-60": approx(100.0 * 0.606 / (331.3 + 0.606 * 25.0), rel=1e-12),
    "alraouf2025-61": approx(30.0 * 10.0 / (2.0 * 298.15), rel=0.01),  # of an ideal gas
    "alraouf2025-64": approx((100.0 + PER_COUNT**2) ** 0.5 - 10.0, rel=1e-12),
}
WORDS = {
    "matiskova2021-12": ("182 kPa",),
    "matiskova2021-25": ("0.77 deg RMS", "1.06 leaving one out", "0.98 and 1.22"),
    "matiskova2021-34": ("2.414 s",),
}


def test_numbers_are_those_found_by_hand_or_by_other_scripts_and_reasons_carry_what_was_chosen():
    for id, number in NUMBERS.items():
        assert entry(id).recomputed == number, id
    for id, words in WORDS.items():
        assert all(each in entry(id).reason for each in words), id
    assert sarosi_fits.measured("DMSP-20").force.size == 60  # points that pull
    # Better on the printed means, but by less than their printed intervals.
    for id in ("alraouf2025-34", "alraouf2025-35"):
        assert 0.0 < entry(id).recomputed < entry(id).scatter[0]
    # One limit for the printed law and for the rig.
    limits = {entry(f"matiskova2021-{number}").accepted for number in (11, 12, 16, 37)}
    assert len(limits) == 1
    # Least squares recovers the element, population searches do not.
    assert entry("nguyen2024-28").recomputed == approx(element(), rel=1e-6)
    for id in ("nguyen2024-29", "nguyen2024-30"):
        assert entry(id).recomputed != approx(element(), rel=0.1)


NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]\d+)?")


def test_all_that_a_reader_sees_of_a_claim_is_as_recorded():
    """By `pamsim replicate --json`: numbers in reasons too, on which no verdict hangs."""
    record = recorded("results/replicate")
    shown = [to_dict(one) for paper in PAPERS for one in judged(paper).claims.values()]
    shown += [to_dict(one) for paper in PAPERS for one in judged(paper).notes.values()]
    for one, kept in zip(shown, [*record["claims"], *record["notes"]], strict=True):
        numbers, known = (claim.pop("recomputed", None) or 0.0 for claim in (one, kept))
        # Of numbers that belong together one may vanish but for rounding, as a2 of (23) does.
        assert numbers == approx(known, rel=1e-4, abs=max(1e-6 * np.max(np.abs(known)), 1e-9))
        one, kept = json.dumps(one), json.dumps(kept)
        assert NUMBER.split(one) == NUMBER.split(kept)
        for new, old in zip(NUMBER.findall(one), NUMBER.findall(kept), strict=True):
            last = 10.0 ** -len(old.partition(".")[2]) if "." in old else 0.0
            assert float(new) == approx(float(old), rel=1e-4, abs=max(1.01 * last, 1e-9)), one


def test_claims_that_need_what_was_fitted_are_calibrated_or_predictions(monkeypatch):
    """Withhold a fit: the claims that cannot be evaluated without it rest on it."""
    right = sarosi_fits.fitted_residual

    def withheld(law=None):
        # (1) has nothing to fit; of (4) sarosi-14 takes only the scatter of the points.
        if law in (None, "strain", "corrected"):
            raise InputError("no fit")
        return right(law)

    monkeypatch.setattr(sarosi_fits, "fitted_residual", withheld)
    monkeypatch.setattr(matiskova_rig, "_simulated", withheld)
    # What is not calibrated is a prediction: no small step's response and no force were fitted.
    for paper, predictions in (("sarosi", set()), ("matiskova2021", {41, 43})):
        resting = set()
        for id in judged(paper).claims:
            try:
                evaluate(id)
            except InputError:
                resting.add(id)
        calibrated = {id for id, c in judged(paper).claims.items() if c.kind is Verdict.CALIBRATED}
        assert calibrated
        assert resting - calibrated == {f"{paper}-{number}" for number in predictions}
        assert calibrated <= resting


def test_counts_are_documented():
    """A paper's line in docs/papers.md holds the counts of its facts; the last and README sum."""
    lines = {
        cells[0]: [int(cell) for cell in cells[1:]]
        for line in (ROOT / "docs" / "papers.md").read_text(encoding="utf-8").splitlines()
        if re.fullmatch(r"\| `?\w+`? (\| \d+ )+\|", line)
        for cells in [[cell.strip("` ") for cell in line.strip("|").split("|")]]
    }
    for paper in PAPERS:
        claims, notes = judged(paper).claims, judged(paper).notes
        counts = Replication(
            papers={paper: ""}, claims=tuple(claims.values()), notes=(), failures=(), wall_s=0.0
        ).counts
        assert lines[paper] == [len(claims), sum(counts.values()), *counts.values(), len(notes)]
    every = lines.pop("all")
    assert every == [sum(column) for column in zip(*lines.values(), strict=True)]
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    sentence = re.search(r"`pamsim replicate` recomputes (.*?) not reproducible", readme, re.DOTALL)
    assert sentence
    assert list(map(int, re.findall(r"\d+", sentence.group(1)))) == every[:-1]
