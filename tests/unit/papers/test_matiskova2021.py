"""The claims' form, the checked numbers, and what `replicate` refuses."""

from __future__ import annotations

import json

import pytest

from pamsim.core.errors import InputError, PamsimError
from pamsim.papers import replicate as registry
from pamsim.papers.claim import CITATIONS, Claim, Verdict, compare, half_unit
from pamsim.papers.replicate import replicate

REPRODUCED, UNPRINTED, WRONG = (
    Verdict.REPRODUCED,
    Verdict.NOT_REPRODUCIBLE,
    Verdict.INCONSISTENT,
)


@pytest.fixture(scope="module")
def claims() -> dict[str, Claim]:
    return {claim.id: claim for claim in replicate(["A"])}


def test_claims_are_whole_and_json_safe(claims):
    assert len(claims) >= 25
    assert list(claims) == [f"A-{number:02d}" for number in range(1, len(claims) + 1)]
    for claim in claims.values():
        assert claim.paper == "A"
        assert claim.citation == CITATIONS["A"]
        shown = json.loads(json.dumps(claim.as_dict(), allow_nan=False))
        keys = ["id", "paper", "what", "printed", "recomputed", "unit", "verdict", "reason"]
        assert list(shown) == keys
        assert shown["verdict"] in {verdict.value for verdict in Verdict}


@pytest.mark.parametrize(
    ("id", "verdict"),
    [
        ("A-01", REPRODUCED),  # p_svd = p1 - p2
        ("A-03", REPRODUCED),  # degrees of Table 1
        ("A-06", WRONG),  # row 4 lacks its minus
        ("A-07", WRONG),  # 21 distinct rows
        ("A-09", UNPRINTED),  # (17) fitted
        ("A-11", WRONG),  # (23) in bar
        ("A-13", WRONG),  # beta(0)
        ("A-15", REPRODUCED),  # decreasing inclination
        ("A-22", WRONG),  # signs of (5)
        ("A-23", REPRODUCED),  # parts of (5)
        ("A-25", WRONG),  # co-contraction softens
        ("A-28", REPRODUCED),  # symmetric
        ("A-29", REPRODUCED),  # T1 T2
        ("A-30", REPRODUCED),  # T1 + T2
        ("A-31", WRONG),  # G1 against G2
        ("A-34", UNPRINTED),  # a length chosen to fit is no reproduction
        ("A-40", REPRODUCED),  # monotonic
        ("A-41", REPRODUCED),  # oscillating
    ],
)
def test_verdicts_are_those_of_the_evidence(claims, id, verdict):
    assert claims[id].verdict is verdict


@pytest.mark.parametrize(
    ("id", "expected", "tolerance"),
    [
        ("A-11", 5.96, 0.01),  # deg RMS of (23) in bar
        ("A-12", 2.01, 0.01),  # with the best scale
        ("A-13", 0.6907, 1e-9),  # deg, a0 + a1
        ("A-25", -0.0996, 5e-4),  # c
        ("A-29", 0.090314 * 0.57873, 1e-15),
        ("A-30", 0.090314 + 0.57873, 1e-15),
        ("A-31", 0.6747, 1e-4),  # output error
        ("A-32", 0.7470, 1e-4),  # ARX, unit gain
        ("A-33", 0.7694, 1e-4),  # ARX, free gain
        ("A-34", 0.64595, 1e-4),
    ],
)
def test_numbers_found_by_independent_scripts(claims, id, expected, tolerance):
    assert claims[id].recomputed == pytest.approx(expected, abs=tolerance)


def test_reasons_carry_what_was_chosen(claims):
    assert "182 kPa" in claims["A-12"].reason
    assert "0.77 deg RMS" in claims["A-25"].reason
    assert "1.06 leaving one out" in claims["A-25"].reason
    assert "0.98 and 1.22" in claims["A-25"].reason
    assert "2.414 s" in claims["A-34"].reason


def test_a_claim_is_reproduced_up_to_half_a_unit_of_its_last_digit():
    def judged(recomputed: float) -> Verdict:
        return compare(
            "A-99", "x", 0.669, recomputed, half_unit(3), unit="s", reason="y", otherwise=WRONG
        ).verdict

    assert judged(0.6695) is REPRODUCED
    assert judged(0.6685) is REPRODUCED
    assert judged(0.66951) is WRONG
    assert judged(0.66849) is WRONG


def test_one_number_out_of_many_decides():
    claim = compare("A-99", "x", (1.0, 2.0), (1.0, 2.2), (0.1, 0.1), unit="1", reason="y")
    assert claim.verdict is UNPRINTED


def make(id: str = "A-99", value: float = 1.0) -> Claim:
    return compare(id, "x", value, 1.0, 0.1, unit="1", reason="y")


def test_unusable_claims_are_refused():
    for id in ("A99", "Z-01", "A-1", ""):
        with pytest.raises(InputError, match="claim id"):
            make(id)
    with pytest.raises(InputError, match="not finite"):
        make(value=float("nan"))


def test_registry_refuses_shared_ids_foreign_claims_and_unknown_papers(monkeypatch):
    monkeypatch.setattr(registry, "PAPERS", {"A": lambda: [make(), make()]})
    with pytest.raises(PamsimError, match="A-99"):
        replicate()
    monkeypatch.setattr(registry, "PAPERS", {"B": lambda: [make()]})
    with pytest.raises(PamsimError, match="handed in by paper B"):
        replicate()
    with pytest.raises(InputError, match="no paper 'X'"):
        replicate(["X"])
