"""How a row and what was recomputed become a verdict, and which rows and results are refused."""

from __future__ import annotations

import json

import pytest

from pamsim.core.errors import InputError
from pamsim.papers import claim as room
from pamsim.papers.claim import Recomputed, Verdict, evaluate, judge, recomputes
from pamsim.papers.replicate import PAPERS, Replication, citation, replicate
from pamsim.store.printed import Printed

ROW = {"statement": "x", "place": "text", "unit": "s", "reason": "because of {cause}"}
ID = "sarosi-99"


def judged(printed, value, **more) -> Verdict:
    row = {**ROW, "printed": printed, "otherwise": "inconsistent"}
    return judge(ID, row, Recomputed(value, cause="y", **more)).verdict


@pytest.mark.parametrize(
    ("value", "verdict"),
    [
        (0.6695, Verdict.REPRODUCED),
        (0.6685, Verdict.REPRODUCED),
        (0.66951, Verdict.INCONSISTENT),
        (0.66849, Verdict.INCONSISTENT),
    ],
)
def test_a_number_is_reproduced_up_to_half_a_unit_of_its_last_digit(value, verdict):
    assert judged(Printed.read("0.669"), value) is verdict


def test_one_number_out_of_many_decides():
    assert judged([1, 2], (1.0, 2.2), tolerance=0.1) is Verdict.INCONSISTENT
    assert judged([1, 2], (1.0, 2.2), tolerance=(0.1, 0.3)) is Verdict.REPRODUCED


def test_words_hold_only_if_the_function_says_so():
    assert judged("more", 3.0) is Verdict.INCONSISTENT
    assert judged("more", 3.0, holds=True) is Verdict.REPRODUCED
    assert judged("more", 3.0, otherwise=Verdict.NOT_REPRODUCIBLE) is Verdict.NOT_REPRODUCIBLE


def test_what_cannot_be_recomputed_is_not_reproducible():
    row = {**ROW, "printed": 3}
    claim = judge(ID, row, Recomputed(None, cause="missing data"))
    assert claim.verdict is Verdict.NOT_REPRODUCIBLE
    assert (claim.recomputed, claim.reason) == (None, "because of missing data")


def test_a_row_quotes_printed_numbers_with_their_digits():
    claim = judge(
        "nguyen2024-99", {**ROW, "printed": ["$number.order"]}, Recomputed([0.2751], cause="")
    )
    assert claim.printed == (0.27,)
    assert claim.tolerance == pytest.approx((0.005,))
    assert claim.verdict is Verdict.NOT_REPRODUCIBLE


def test_unusable_numbers_and_missing_tolerances_are_refused():
    with pytest.raises(InputError, match="not finite"):
        judged(1, float("nan"))
    with pytest.raises(InputError, match="no tolerance"):
        judge(ID, ROW, Recomputed(1.0, printed=1.0, cause=""))


def test_a_row_and_its_function_belong_together(monkeypatch):
    assert evaluate("sarosi-10").paper == "sarosi"
    with pytest.raises(InputError, match="two functions"):
        recomputes("sarosi-01")(lambda: None)
    monkeypatch.delitem(room._RECOMPUTE, "sarosi-01")
    with pytest.raises(InputError, match="sarosi-01 must have either"):
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


def test_a_replication_sums_itself_up_and_saves_itself(tmp_path):
    claim = evaluate("sarosi-10")
    done = Replication(
        papers={"sarosi": citation("sarosi")}, claims=(claim,), failures=(), wall_s=1.0
    )
    assert done.summary() == (
        "1 claims: 0 reproduced, 0 not reproducible from printed data, 1 inconsistent in the paper"
    )
    done.save(tmp_path)
    assert json.loads((tmp_path / "replication.json").read_text()) == done.to_dict()
    assert done.to_dict()["counts"]["inconsistent in the paper"] == 1
