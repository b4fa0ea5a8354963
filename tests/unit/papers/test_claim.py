"""How a row and what was recomputed become a verdict, and which rows and results are refused."""

from __future__ import annotations

import dataclasses
import json

import pytest

from pamsim.core.errors import InputError
from pamsim.papers import claim as room
from pamsim.papers.claim import (
    Order,
    Recomputed,
    Verdict,
    evaluate,
    judge,
    recomputes,
)
from pamsim.papers.numerics import PrintedNumbers, propagated
from pamsim.papers.replicate import PAPERS, Replication, citation, replicate
from pamsim.recordings.printed import Printed
from tests.unit.core.refusals import refused

ROW = {
    "statement": "x", "place": "text", "unit": "s", "reason": "because of {cause}",
    "kind": "independent", "because": "b",
}  # fmt: skip
ID = "sarosi-99"
HOLDS, FAILS, OPEN = Verdict.INDEPENDENT, Verdict.INCONSISTENT, Verdict.NOT_SIGNIFICANT
PRODUCT = propagated(lambda a, b: a * b, Printed(2.0, 0.5), Printed(3.0, 0.05))
DIGITS = Printed.read("0.669")


def judged(printed, value, **more) -> Verdict:
    row = {**ROW, "printed": printed, "otherwise": "inconsistent in the paper"}
    return judge(ID, row, Recomputed(value, cause="y", **more)).verdict


RULES = {
    "a number holds up to half a unit of its last digit": (
        (HOLDS, DIGITS, 0.6695, {}),
        (HOLDS, DIGITS, 0.6685, {}),
        (FAILS, DIGITS, 0.66951, {}),
        (FAILS, DIGITS, 0.66849, {}),
    ),
    "what the rounding of its sources moves is accepted too": (
        (HOLDS, Printed(7.7, 0.2), PRODUCT, {}),
        (FAILS, Printed(7.7, 0.0), PRODUCT, {}),
        (HOLDS, "more", PRODUCT, {"low": 7.5}),
        (FAILS, "more", PRODUCT, {"low": 7.7}),
    ),
    "one number out of many decides": (
        (FAILS, [1, 2], (1.0, 2.6), {}),
        (HOLDS, [1, 2], (1.0, 2.4), {}),
        (FAILS, "more", (1.0, 2.0), {"low": (0.0, None), "high": (None, 1.5)}),
    ),
    "a number that scatters over the limit decides nothing": (
        (HOLDS, "more", 2.0, {"low": 0.0, "scatter": 1.0}),
        (OPEN, "more", 0.6, {"low": 0.0, "scatter": 1.0}),
        (OPEN, "more", -0.6, {"low": 0.0, "scatter": 1.0}),
        (FAILS, "more", -2.0, {"low": 0.0, "scatter": 1.0}),
    ),
    "a number outside counts more than one that is open": (
        (FAILS, "more", (0.1, -5.0), {"low": 0.0, "scatter": (1.0, 1.0)}),
        (OPEN, "more", (0.1, 5.0), {"low": 0.0, "scatter": (1.0, 1.0)}),
    ),
    "an order is strict": (
        (HOLDS, "falls", (3.0, 2.0, 1.0), {"order": Order.FALLING}),
        (FAILS, "falls", (3.0, 2.0, 2.0), {"order": Order.FALLING}),
        (HOLDS, "rises", (1.0, 2.0), {"order": Order.RISING}),
        (FAILS, "rises", (2.0, 1.0), {"order": Order.RISING}),
    ),
}


def test_a_verdict_follows_from_the_numbers():
    for rule, rows in RULES.items():
        for verdict, printed, value, more in rows:
            assert judged(printed, value, **more) is verdict, (rule, printed, value, more)
    assert (PRODUCT.value, PRODUCT.half_unit) == pytest.approx((6.0, 0.5 * 3.0 + 0.05 * 2.0))


def test_a_claim_that_holds_has_the_verdict_of_its_kind_and_others_what_their_row_says():
    for kind in ("independent", "calibrated"):
        row = {**ROW, "printed": 3, "kind": kind}
        assert judge(ID, row, Recomputed(3.0, cause="")).verdict == kind
        assert judge(ID, row, Recomputed(4.0, cause="")).verdict is Verdict.NOT_REPRODUCIBLE
    row = {**ROW, "printed": 3, "otherwise": "text damaged", "same_as": "07"}
    claim = judge(ID, row, Recomputed(4.0, cause="missing data"))
    assert claim.fact == ("sarosi-07", Verdict.TEXT_DAMAGED)
    assert claim.reason == "because of missing data"


def test_shared_texts_quote_the_evidence_and_rows_the_printed_digits(monkeypatch):
    row = {**ROW, "printed": ["$number.order"]}
    claim = judge("nguyen2024-99", row, Recomputed([0.2751], cause=""))
    assert claim.printed == (0.27,)
    assert claim.accepted == (pytest.approx((0.265, 0.275)),)
    assert claim.verdict is Verdict.NOT_REPRODUCIBLE
    printed = PrintedNumbers("nguyen2024")
    assert printed.digits("time_constant").half_unit == pytest.approx(0.005)
    with refused("time_constant"):
        printed.value("time_constnt")
    monkeypatch.setattr(room, "_table", lambda paper: {"shared": {"cause": "{size:.1f} m"}})
    claim = judge(ID, {**ROW, "printed": 3}, Recomputed(3.0, size=2.04))
    assert claim.reason == "because of 2.0 m"


def test_claims_that_cannot_be_judged_are_refused():
    for word, printed, value in (
        ("not finite", 1, float("nan")),
        ("no limit and no order", "more", 1.0),
        ("compares 2 numbers with 1", [1], (1.0, 2.0)),
        ("make it a note", 1, None),
    ):
        with refused(word):
            judged(printed, value)
    with refused("kinds are independent, calibrated"):
        judge(ID, {**ROW, "printed": 1, "kind": "not significant"}, Recomputed(1.0, cause=""))


def test_a_row_and_its_function_belong_together(monkeypatch):
    assert evaluate("sarosi-10").paper == "sarosi"
    for paper in PAPERS:
        room._import_room(paper)
        assert len(citation(paper)) > 40
    assert set(room._RECOMPUTE) <= {id for paper in PAPERS for id in room.claim_ids(paper)}
    with pytest.raises(InputError, match="two functions"):
        recomputes("sarosi-07")(lambda: None)
    monkeypatch.delitem(room._RECOMPUTE, "sarosi-07")
    with refused("sarosi-07 has no function"):
        evaluate("sarosi-07")
    with refused("no claim 'sarosi-77'"):
        evaluate("sarosi-77")
    with refused("no paper 'X'"):
        replicate(["X"])


def replication(*claims, notes=()):
    papers = {"sarosi": citation("sarosi")}
    return Replication(papers=papers, claims=claims, notes=notes, failures=(), wall_s=1.0)


def test_a_replication_counts_facts_and_saves_itself(tmp_path):
    rank, repeated, note = (evaluate(f"sarosi-{number}") for number in ("07", "08", "10"))
    assert repeated.same_as == rank.id
    done = replication(rank, repeated, notes=(note,))
    assert done.summary() == (
        "2 claims of 1 facts: 0 independent, 0 calibrated, 0 not significant,"
        " 0 inconsistent in the paper, 0 text damaged, 1 not reproducible from printed data;"
        " 1 notes"
    )
    done.save(tmp_path)
    assert json.loads((tmp_path / "replication.json").read_text()) == done.to_dict()
    assert done.to_dict()["counts_by_paper"]["sarosi"] == done.counts
    # A repeat whose verdict differs is counted of its own.
    other = dataclasses.replace(repeated, verdict=Verdict.INCONSISTENT)
    assert sum(replication(rank, other).counts.values()) == 2
