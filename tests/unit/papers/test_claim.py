"""How a row and what was recomputed become a verdict, and which rows and results are refused."""

from __future__ import annotations

import dataclasses
import json

import pytest

from pamsim.core.errors import InputError
from pamsim.papers import claim as room
from pamsim.papers.claim import Order, Recomputed, Verdict, evaluate, judge, recomputes
from pamsim.papers.numerics import propagated
from pamsim.papers.replicate import PAPERS, Replication, citation, replicate
from pamsim.recordings.printed import Printed

ROW = {
    "statement": "x", "place": "text", "unit": "s", "reason": "because of {cause}",
    "kind": "independent", "because": "b",
}  # fmt: skip
ID = "sarosi-99"


def judged(printed, value, **more) -> Verdict:
    row = {**ROW, "printed": printed, "otherwise": "inconsistent"}
    return judge(ID, row, Recomputed(value, cause="y", **more)).verdict


@pytest.mark.parametrize(
    ("value", "verdict"),
    [
        (0.6695, Verdict.INDEPENDENT),
        (0.6685, Verdict.INDEPENDENT),
        (0.66951, Verdict.INCONSISTENT),
        (0.66849, Verdict.INCONSISTENT),
    ],
)
def test_a_number_holds_up_to_half_a_unit_of_its_last_digit(value, verdict):
    assert judged(Printed.read("0.669"), value) is verdict


def test_what_the_rounding_of_its_sources_moves_is_accepted_too():
    product = propagated(lambda a, b: a * b, Printed(2.0, 0.5), Printed(3.0, 0.05))
    assert (product.value, product.half_unit) == pytest.approx((6.0, 0.5 * 3.0 + 0.05 * 2.0))
    assert judged(Printed(7.7, 0.2), product) is Verdict.INDEPENDENT
    assert judged(Printed(7.7, 0.0), product) is Verdict.INCONSISTENT
    assert judged("more", product, low=7.5) is Verdict.INDEPENDENT
    assert judged("more", product, low=7.7) is Verdict.INCONSISTENT


def test_one_number_out_of_many_decides():
    assert judged([1, 2], (1.0, 2.6)) is Verdict.INCONSISTENT
    assert judged([1, 2], (1.0, 2.4)) is Verdict.INDEPENDENT
    assert judged("more", (1.0, 2.0), low=(0.0, None), high=(None, 1.5)) is Verdict.INCONSISTENT


@pytest.mark.parametrize(
    ("value", "verdict"),
    [
        (2.0, Verdict.INDEPENDENT),
        (0.6, Verdict.NOT_SIGNIFICANT),
        (-0.6, Verdict.NOT_SIGNIFICANT),
        (-2.0, Verdict.INCONSISTENT),
    ],
)
def test_a_number_that_scatters_over_the_limit_decides_nothing(value, verdict):
    assert judged("more", value, low=0.0, scatter=1.0) is verdict


def test_a_number_outside_counts_more_than_one_that_is_open():
    assert judged("more", (0.1, -5.0), low=0.0, scatter=(1.0, 1.0)) is Verdict.INCONSISTENT
    assert judged("more", (0.1, 5.0), low=0.0, scatter=(1.0, 1.0)) is Verdict.NOT_SIGNIFICANT


def test_an_order_is_strict():
    assert judged("falls", (3.0, 2.0, 1.0), order=Order.FALLING) is Verdict.INDEPENDENT
    assert judged("falls", (3.0, 2.0, 2.0), order=Order.FALLING) is Verdict.INCONSISTENT
    assert judged("rises", (1.0, 2.0), order=Order.RISING) is Verdict.INDEPENDENT
    assert judged("rises", (2.0, 1.0), order=Order.RISING) is Verdict.INCONSISTENT


@pytest.mark.parametrize("kind", ["independent", "identity", "calibrated"])
def test_a_claim_that_holds_has_the_verdict_of_its_kind(kind):
    row = {**ROW, "printed": 3, "kind": kind}
    assert judge(ID, row, Recomputed(3.0, cause="")).verdict == kind
    assert judge(ID, row, Recomputed(4.0, cause="")).verdict is Verdict.NOT_REPRODUCIBLE


def test_a_row_says_what_else_it_is():
    row = {**ROW, "printed": 3, "otherwise": "text damaged", "same_as": "07"}
    claim = judge(ID, row, Recomputed(4.0, cause="missing data"))
    assert claim.fact == ("sarosi-07", Verdict.TEXT_DAMAGED)
    assert claim.reason == "because of missing data"


def test_shared_texts_quote_the_evidence(monkeypatch):
    monkeypatch.setattr(room, "_table", lambda paper: {"shared": {"cause": "{size:.1f} m"}})
    claim = judge(ID, {**ROW, "printed": 3}, Recomputed(3.0, size=2.04))
    assert claim.reason == "because of 2.0 m"


def test_a_row_quotes_printed_numbers_with_their_digits():
    claim = judge(
        "nguyen2024-99", {**ROW, "printed": ["$number.order"]}, Recomputed([0.2751], cause="")
    )
    assert claim.printed == (0.27,)
    assert claim.accepted == (pytest.approx((0.265, 0.275)),)
    assert claim.verdict is Verdict.NOT_REPRODUCIBLE


def test_claims_that_cannot_be_judged_are_refused():
    with pytest.raises(InputError, match="not finite"):
        judged(1, float("nan"))
    with pytest.raises(InputError, match="no limit and no order"):
        judged("more", 1.0)
    with pytest.raises(InputError, match="compares 2 numbers with 1"):
        judged([1], (1.0, 2.0))
    with pytest.raises(InputError, match="make it a note"):
        judged(1, None)
    with pytest.raises(InputError, match="kinds are independent, identity, calibrated"):
        judge(ID, {**ROW, "printed": 1, "kind": "not significant"}, Recomputed(1.0, cause=""))


def test_a_row_and_its_function_belong_together(monkeypatch):
    assert evaluate("sarosi-10").paper == "sarosi"
    with pytest.raises(InputError, match="two functions"):
        recomputes("sarosi-01")(lambda: None)
    monkeypatch.delitem(room._RECOMPUTE, "sarosi-01")
    with pytest.raises(InputError, match="sarosi-01 has no function"):
        evaluate("sarosi-01")
    with pytest.raises(InputError, match="no claim 'sarosi-77'"):
        evaluate("sarosi-77")


def test_every_function_has_a_row():
    for paper in PAPERS:
        room._import_room(paper)
    ids = {id for paper in PAPERS for id in room.claim_ids(paper)}
    assert set(room._RECOMPUTE) <= ids


def test_papers_are_known_by_author_and_year():
    for paper in PAPERS:
        assert len(citation(paper)) > 40
    with pytest.raises(InputError, match="no paper 'X'"):
        replicate(["X"])


def test_a_replication_counts_facts_and_saves_itself(tmp_path):
    rank, repeated, note = (evaluate(f"sarosi-{number}") for number in ("07", "08", "10"))
    assert repeated.same_as == rank.id
    done = Replication(
        papers={"sarosi": citation("sarosi")},
        claims=(rank, repeated),
        notes=(note,),
        failures=(),
        wall_s=1.0,
    )
    assert done.summary() == (
        "2 claims of 1 facts: 0 independent, 0 identity, 0 calibrated, 0 not significant,"
        " 0 inconsistent in the paper, 0 text damaged, 1 not reproducible from printed data;"
        " 1 notes"
    )
    done.save(tmp_path)
    assert json.loads((tmp_path / "replication.json").read_text()) == done.to_dict()
    assert done.to_dict()["counts_by_paper"]["sarosi"] == done.counts


def test_a_repeat_whose_verdict_differs_is_counted_of_its_own():
    first, second = (evaluate(f"sarosi-{number}") for number in ("07", "08"))
    other = dataclasses.replace(second, verdict=Verdict.INCONSISTENT)
    done = Replication(papers={}, claims=(first, other), notes=(), failures=(), wall_s=1.0)
    assert sum(done.counts.values()) == 2
