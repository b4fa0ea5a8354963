"""The replication page: every claim, escaped, with a dash for what could not be recomputed."""

from __future__ import annotations

import html.parser

import pytest

from pamsim.core.errors import InputError
from pamsim.report.replication_page import (
    VERDICTS,
    accepted_text,
    recomputed_text,
    verdict_sentence,
    write_replication,
)

INDEPENDENT, OPEN, INCONSISTENT = (
    "independent",
    "not reproducible from printed data",
    "inconsistent in the paper",
)
HOSTILE = "<script>alert('x')</script> & \"quoted\""


class Page(html.parser.HTMLParser):
    """Tags with attributes, and all text."""

    def __init__(self, source):
        super().__init__()
        self.tags = []
        self.text = ""
        self.feed(source)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data):
        self.text += data


def claim(id, printed, recomputed, verdict, **more):
    return {
        "id": id,
        "paper": id[:-3],
        "statement": f"statement {id}",
        "place": "Table 1",
        "printed": printed,
        "recomputed": recomputed,
        "unit": "cm^2",
        "accepted": [[0.0, 1.0]],
        "scatter": [],
        "order": None,
        "kind": INDEPENDENT,
        "because": f"because {id}",
        "verdict": verdict,
        "same_as": None,
        "reason": f"reason {id}",
        **more,
    }


def counts(independent, open, inconsistent):
    some = {INDEPENDENT: independent, OPEN: open, INCONSISTENT: inconsistent}
    return {verdict: some.get(verdict, 0) for verdict in VERDICTS}


@pytest.fixture
def replication():
    return {
        "schema": "pamsim-replicate/2",
        "papers": {
            "matiskova2021": "Authors of A, Journal",
            "alraouf2025": "Authors of B",
            "nguyen2024": "Authors of C",
        },
        "claims": [
            claim("matiskova2021-01", 0.61, 0.6103515625, INDEPENDENT),
            claim("matiskova2021-02", [1.5, 2.25], [1.4, 2.251], OPEN),
            claim("alraouf2025-01", "decreasing", [3.0, 2.0], OPEN, same_as="alraouf2025-02"),
            claim("alraouf2025-02", 24.0, 21.0, INCONSISTENT, statement=HOSTILE, reason=HOSTILE),
        ],
        "failures": [{"paper": "nguyen2024", "error": f"ValueError: {HOSTILE}"}],
        "notes": [
            {
                "id": "alraouf2025-03",
                "paper": "alraouf2025",
                "statement": "what is not printed",
                "place": "text",
                "recomputed": 0.25,
                "unit": "kPa",
                "reason": "why not",
            },
        ],
        "counts": counts(1, 2, 1),
        "counts_by_paper": {
            "matiskova2021": counts(1, 1, 0),
            "alraouf2025": counts(0, 1, 1),
            "nguyen2024": counts(0, 0, 0),
        },
        "versions": {"pamsim": "0.1.0", HOSTILE: HOSTILE},
        "wall_s": 1.25,
    }


def write(result, out):
    (path,) = write_replication(result, {}, out)
    return path.read_text(encoding="utf-8")


def test_every_claim_is_a_row_with_its_numbers_mark_and_reason(replication, tmp_path):
    page = Page(write(replication, tmp_path / "new"))
    rows = [attrs for tag, attrs in page.tags if tag == "tr" and "claim" in attrs.get("class", "")]
    assert [row["id"] for row in rows] == [
        "matiskova2021-01",
        "matiskova2021-02",
        "alraouf2025-02",
        "alraouf2025-01",  # repeats the fact before it
    ]
    assert [row["class"] for row in rows] == [
        "claim independent",
        "claim open",
        "claim inconsistent",
        "claim open repeat",
    ]
    for text in (
        "0.610",
        "1.5, 2.25",
        "1.40, 2.251",
        "reason matiskova2021-02",
        "because matiskova2021-02",
        "repeats the fact of alraouf2025-02",
        "what is not printed: 0.250",
        "why not",
        "cm²",
        "Authors of A",
    ):
        assert text in page.text


def test_every_paper_is_one_details_element(replication, tmp_path):
    page = Page(write(replication, tmp_path))
    ids = [attrs["id"] for tag, attrs in page.tags if tag == "details"]
    assert ids == ["matiskova2021", "alraouf2025", "nguyen2024"]
    assert not any("open" in attrs for tag, attrs in page.tags if tag == "details")


def test_one_paper_alone_is_open(replication, tmp_path):
    replication |= {
        "papers": {"matiskova2021": "A"},
        "claims": replication["claims"][:2],
        "failures": [],
    }
    page = Page(write(replication, tmp_path))
    assert [("open" in attrs) for tag, attrs in page.tags if tag == "details"] == [True]


def test_hostile_text_is_shown_and_not_run(replication, tmp_path):
    source = write(replication, tmp_path)
    assert source.count("<script") == 1  # the page's own
    assert source.count("&lt;script&gt;") == 5  # statement, reason, failure, name and version
    assert HOSTILE in Page(source).text


def test_verdict_counts_come_first_and_name_what_failed(replication, tmp_path):
    sentence = verdict_sentence(replication)
    assert sentence == (
        "4 printed statements of 3 papers recomputed, 4 facts: 1 agree (1 independent, 0 identity,"
        " 0 calibrated), 0 not significant, 1 inconsistent in the paper, 0 text damaged and"
        " 2 not reproducible from printed data. Not evaluated: Nguyen 2024."
    )
    assert sentence in write(replication, tmp_path)


def test_a_result_without_claims_still_makes_a_page(replication, tmp_path):
    assert "0 printed statements of 0 papers" in write(
        {**replication, "papers": {}, "claims": [], "notes": [], "failures": []}, tmp_path
    )


@pytest.mark.parametrize(
    ("value", "printed", "text"),
    [
        (None, 3.0, "–"),
        (11.547005, 20.0, "11.5"),
        (0.6103515625, 0.61, "0.610"),
        (36.97083863, 35.135, "36.9708"),
        (-252.0138, 252.0, "−252.0"),
        (21.0, 24.0, "21"),
        (5.2859e-07, 5.47, "5.29×10⁻⁷"),
        ([1.4, 2.251], [1.5, 2.25], "1.40, 2.251"),
        ([8.0, 7.0], "fewer", "8, 7"),
        ("Table 2", "Table 1", "Table 2"),
    ],
)
def test_recomputed_numbers_show_what_a_comparison_needs(value, printed, text):
    assert recomputed_text(value, printed) == text


@pytest.mark.parametrize(
    ("accepted", "order", "scatter", "text"),
    [
        ([[0.5, 1.5]], None, [], "accepted 0.500000 to 1.50000"),
        ([[None, 1.5]], None, [], "at most 1.50000"),
        ([[0.5, None]], None, [0.25], "at least 0.500000, 95 % ±0.250"),
        ([[None, None], [None, None]], "falling", [], "must be falling"),
        ([[0.0, 1.0], [0.0, 2.0]], None, [], ""),
    ],
)
def test_what_a_number_must_be_stands_beside_it(accepted, order, scatter, text):
    given = {"accepted": accepted, "order": order, "scatter": scatter}
    assert accepted_text(given) == text


def test_another_schema_and_a_file_in_place_of_the_folder_are_refused(replication, tmp_path):
    with pytest.raises(InputError, match="pamsim-replicate/2"):
        write({**replication, "schema": "other/1"}, tmp_path)
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises(InputError, match="is a file"):
        write(replication, file)
