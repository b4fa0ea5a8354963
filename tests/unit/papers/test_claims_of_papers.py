"""What every claim of every paper must stand up to: its verdict, its numbering, wrong numbers."""

from __future__ import annotations

import copy
import json
import re
import sys
from pathlib import Path

import pytest

from pamsim.core.encoding import to_dict
from pamsim.papers import claim as room
from pamsim.papers.claim import Order, Verdict, judge
from pamsim.papers.replicate import Replication
from pamsim.recordings.printed import Printed
from tests.unit.papers.judged import judged, with_verdict

ROOT = Path(__file__).resolve().parents[3]

_ALRAOUF_INDEPENDENT = [2, 3, 6, 7, *range(26, 30), 36, 37, 41, 42, *range(54, 59), 60, 62, 64]
VERDICTS = {
    "matiskova2021": {
        Verdict.INDEPENDENT: [1, 2, 3, 8, 15, 29, 30, 41, 43],
        Verdict.IDENTITY: [19, 23],
        Verdict.CALIBRATED: [37, 40, 42],
        Verdict.NOT_SIGNIFICANT: [26, 28],
        Verdict.INCONSISTENT: [4, 6, 7, 11, 12, 13, 14, 16, 20, 22],
        Verdict.TEXT_DAMAGED: [17, 18],
        Verdict.NOT_REPRODUCIBLE: [5, 9, 10, 24, 25, 27, 31, 32, 33, 38, 39, 44],
    },
    "alraouf2025": {
        Verdict.INDEPENDENT: _ALRAOUF_INDEPENDENT,
        Verdict.IDENTITY: [52],
        Verdict.NOT_SIGNIFICANT: [34, 35, 39, 45, 46, 47, 48, 49, 50],
        Verdict.INCONSISTENT: [1, 30, 31, 51, 53],
        Verdict.NOT_REPRODUCIBLE: [4, 5, *range(8, 26), 32, 33, 38, 40, 43, 44],
    },
    "nguyen2024": {
        Verdict.INDEPENDENT: [6, 7, 9, 10, 12, 15, 28],
        Verdict.IDENTITY: [1, 4, 5, 8, 11, 13, 20, 21, 22, 23, 24],
        Verdict.INCONSISTENT: [14, 17, 18, 25],
        Verdict.TEXT_DAMAGED: [33],
        Verdict.NOT_REPRODUCIBLE: [3, 30, 31, 32],
    },
    "vandamme2008": {
        Verdict.INDEPENDENT: [1, 3, 5, 15, 19, 25],
        Verdict.IDENTITY: [2, 10, 11, 12, 13, 14, 16, 17, 20, 21],
        Verdict.INCONSISTENT: [7],
        Verdict.NOT_REPRODUCIBLE: [26],
    },
    "sarosi": {
        Verdict.INDEPENDENT: [11, 14],
        Verdict.IDENTITY: [1, 2, 4, 6, 9],
        Verdict.CALIBRATED: [15, 17],
        Verdict.NOT_REPRODUCIBLE: [7, 8, 16],
    },
}

every = pytest.mark.parametrize("paper", VERDICTS)


@every
def test_verdicts_are_those_of_the_evidence(paper):
    for verdict in Verdict:
        expected = {f"{paper}-{n:02d}" for n in VERDICTS[paper].get(verdict, ())}
        assert with_verdict(paper, verdict) == expected


@every
def test_ids_run_through_without_a_gap_and_claims_are_json_safe(paper):
    claims = judged(paper).claims
    numbered = sorted([*claims, *judged(paper).notes])
    assert numbered == [f"{paper}-{i:02d}" for i in range(1, len(numbered) + 1)]
    for claim in claims.values():
        assert claim.paper == paper
        json.dumps(to_dict(claim), allow_nan=False)


def verdict_of(id, values, printed=None) -> Verdict:
    """Verdict of a claim if these numbers had come out, or had been printed."""
    row, result = judged(id.rpartition("-")[0]).sources[id]
    changed = copy.copy(result)
    old = room._several(result.value)
    new = [Printed(v, room._digits(o).half_unit) for v, o in zip(values, old, strict=True)]
    changed.value = new if isinstance(result.value, list | tuple) else new[0]
    changed.printed = result.printed if printed is None else printed
    return judge(id, row, changed).verdict


def beyond(edge, half):
    return abs(edge) + 1e-9 + 2.0 * half


def right_numbers(claim):
    """Numbers that make a claim hold as clearly as its intervals allow."""
    numbers = room._several(claim.recomputed)
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


@every
def test_every_claim_fails_on_wrong_numbers(paper):
    """Put wrong numbers in: the recomputed ones in turn, then the printed ones."""
    for id, claim in judged(paper).claims.items():
        assert all([claim.because, claim.place, claim.statement]), id
        assert "{" not in claim.reason + claim.because, id
        row, result = judged(paper).sources[id]
        failing = room._OTHERWISE[row.get("otherwise")]
        assert verdict_of(id, right_numbers(claim)) is holding(claim), id
        wrong = list(wrong_numbers(claim))
        assert wrong, f"{id} accepts any number"
        for value, edges in zip(room._several(claim.recomputed), claim.accepted, strict=True):
            # A number that is wrong by no more than a hundred of its sizes must be out.
            assert all(abs(edge or 0.0) <= 100.0 * max(1.0, abs(value)) for edge in edges), id
        for numbers in wrong:
            assert verdict_of(id, numbers) is failing, (id, numbers)
        if result.low is None and result.high is None and result.order is None:
            values = room._several(claim.recomputed)
            assert verdict_of(id, values, printed=values) is holding(claim), id
            scatter = claim.scatter or (0.0,) * len(values)
            far = [
                value + beyond(value, half) + high - low
                for value, half, (low, high) in zip(values, scatter, claim.accepted, strict=True)
            ]
            assert verdict_of(id, values, printed=far) is failing, id


@every
def test_repeats_name_a_claim_with_their_verdict(paper):
    claims = judged(paper).claims
    for id, claim in claims.items():
        if claim.same_as:
            fact = claims[claim.same_as]
            assert fact.same_as is None, id
            assert fact.verdict is claim.verdict, (id, fact.id)


@pytest.mark.parametrize("paper", ["nguyen2024", "vandamme2008", "sarosi"])
def test_identities_hold_whatever_is_printed(paper, monkeypatch):
    """Falsify every printed number: what is true by construction stays true."""
    right = room.printed_numbers
    modules = [m for name, m in sys.modules.items() if name.startswith(f"pamsim.papers.{paper}")]
    caches = [value for m in modules for value in vars(m).values() if hasattr(value, "cache_clear")]

    def falsified(paper, name):
        return tuple(Printed(0.8 * n.value, n.half_unit) for n in right(paper, name))

    identities = sorted(with_verdict(paper, Verdict.IDENTITY))
    assert identities
    try:
        for module in (room, *modules):
            if hasattr(module, "printed_numbers"):
                monkeypatch.setattr(module, "printed_numbers", falsified)
        for cache in caches:
            cache.cache_clear()
        found = {id: room.evaluate(id).verdict for id in identities}
    finally:
        monkeypatch.undo()
        for cache in caches:
            cache.cache_clear()
    assert found == dict.fromkeys(identities, Verdict.IDENTITY)


@every
def test_counts_are_documented(paper):
    """Its line in docs/papers.md holds the counts of its facts; the last line and README sum."""
    found = judged(paper)
    done = Replication(
        papers={paper: ""},
        claims=tuple(found.claims.values()),
        notes=tuple(found.notes.values()),
        failures=(),
        wall_s=0.0,
    )
    lines = {
        cells[0]: [int(cell) for cell in cells[1:]]
        for line in (ROOT / "docs" / "papers.md").read_text(encoding="utf-8").splitlines()
        if re.fullmatch(r"\| `?\w+`? (\| \d+ )+\|", line)
        for cells in [[cell.strip("` ") for cell in line.strip("|").split("|")]]
    }
    counts = done.counts
    assert lines[paper] == [
        len(found.claims), sum(counts.values()), *counts.values(), len(found.notes)
    ]  # fmt: skip
    every = lines.pop("all")
    assert every == [sum(column) for column in zip(*lines.values(), strict=True)]
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    sentence = re.search(r"`pamsim replicate` recomputes (.*?) not reproducible", readme, re.DOTALL)
    assert sentence
    assert list(map(int, re.findall(r"\d+", sentence.group(1)))) == every[:-1]
