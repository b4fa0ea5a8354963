"""The replication page: every claim, escaped, with a dash for what could not be recomputed."""

from __future__ import annotations

import dataclasses

import pytest

from pamsim.papers.claim import evaluate
from pamsim.papers.replicate import Replication
from pamsim.report.replication_page import (
    accepted_text,
    printed_text,
    recomputed_text,
    verdict_sentence,
    write_replication,
)
from tests.unit.report.page_laws import Page

HOSTILE = "<script>alert('x')</script> & \"quoted\""


@pytest.fixture
def replication():
    """Claims of two papers, a repeat before its fact, and a paper that could not be evaluated."""
    ids = ("matiskova2021-02", "matiskova2021-04", "sarosi-08", "sarosi-07")
    *claims, fact = map(evaluate, ids)
    claims.append(dataclasses.replace(fact, statement=HOSTILE, reason=HOSTILE, unit="cm^2"))
    return Replication(
        papers={"matiskova2021": "Authors of A", "sarosi": "B", "nguyen2024": "C"},
        claims=tuple(claims),
        notes=(evaluate("sarosi-10"),),
        failures=({"paper": "nguyen2024", "error": f"ValueError: {HOSTILE}"},),
        wall_s=1.25,
        versions={"pamsim": "0.1.0", HOSTILE: HOSTILE},
    ).to_dict()


def write(result, out):
    return write_replication(result, {}, out).read_text(encoding="utf-8")


def test_every_claim_is_a_row_with_its_numbers_mark_and_reason(replication, tmp_path):
    source = write(replication, tmp_path / "new")
    page = Page(source)
    rows = [attrs for attrs in page.all("tr") if "claim" in attrs.get("class", "")]
    assert [(row["id"], row["class"]) for row in rows] == [
        ("matiskova2021-02", "claim independent"),
        ("matiskova2021-04", "claim inconsistent"),
        ("sarosi-07", "claim open"),
        ("sarosi-08", "claim open repeat"),  # of the fact before it
    ]
    first, second, *_ = replication["claims"]
    (note,) = replication["notes"]
    for text in (
        recomputed_text(first["recomputed"], first["printed"]),
        printed_text(second["printed"]),
        second["reason"],
        second["because"],
        "repeats the fact of sarosi-07",
        note["statement"],
        note["reason"],
        "cm²",
        "Authors of A",
        HOSTILE,
    ):
        assert text in page.text, text
    # Statement, reason, failure, name and version.
    assert source.count("&lt;script&gt;") == 5
    sentence = verdict_sentence(replication)
    assert sentence == (
        "4 printed statements of 3 papers recomputed, 3 facts: 1 agree (1 independent,"
        " 0 calibrated), 1 inconsistent in the paper, 1 not reproducible from printed data."
        " Not evaluated: Nguyen 2024."
    )
    assert sentence in source
    summary = source[source.index("<summary>") : source.index("</summary>")]
    assert "claims, 2 facts: 1 agree (1 independent, 0 calibrated), 1 " in summary


def test_every_paper_is_one_details_element_which_is_open_if_it_stands_alone(replication, tmp_path):
    def opened():
        found = Page(write(replication, tmp_path)).all("details")
        return {attrs["id"]: "open" in attrs for attrs in found}

    assert opened() == {"matiskova2021": False, "sarosi": False, "nguyen2024": False}
    alone = {"matiskova2021": "A"}
    replication |= {"papers": alone, "claims": replication["claims"][:2], "failures": []}
    assert opened() == {"matiskova2021": True}
    replication |= {"papers": {}, "claims": [], "notes": []}
    assert "0 printed statements of 0 papers" in write(replication, tmp_path)


def test_recomputed_numbers_show_what_a_comparison_needs():
    for value, printed, text in (
        (11.547005, 20.0, "11.5"),
        (0.6103515625, 0.61, "0.610"),
        (36.97083863, 35.135, "36.9708"),
        (-252.0138, 252.0, "−252.0"),
        (0.123456789, 0.1234567890, "0.12345679"),
        (21.0, 24.0, "21"),
        (5.2859e-07, 5.47, "5.29×10⁻⁷"),
        ([1.4, 2.251], [1.5, 2.25], "1.40, 2.251"),
        ([8.0, 7.0], "fewer", "8, 7"),
    ):
        assert recomputed_text(value, printed) == text


def test_what_a_number_must_be_stands_beside_it():
    for accepted, order, scatter, text in (
        ([[0.5, 1.5]], None, [], "accepted 0.500000 to 1.50000"),
        ([[None, 1.5]], None, [], "at most 1.50000"),
        ([[0.5, None]], None, [0.25], "at least 0.500000, 95 % ±0.250"),
        ([[None, None], [None, None]], "falling", [], "must be falling"),
        ([[0.0, 1.0], [0.0, 2.0]], None, [], ""),
    ):
        given = {"accepted": accepted, "order": order, "scatter": scatter}
        assert accepted_text(given) == text
