"""Matiskova 2021, recomputed: the claims' form and the checked numbers."""

from __future__ import annotations

import json

import pytest

from pamsim.actuator.antagonist import muscle_stiffness
from pamsim.core.encoding import to_dict
from pamsim.papers.antagonistic_pair import ideal_muscle, row
from pamsim.papers.claim import Claim, Verdict
from pamsim.papers.matiskova2021.stiffness import ideal_stiffness
from pamsim.papers.replicate import paper_claims

REPRODUCED, UNPRINTED, WRONG = (
    Verdict.REPRODUCED,
    Verdict.NOT_REPRODUCIBLE,
    Verdict.INCONSISTENT,
)


@pytest.fixture(scope="module")
def claims() -> dict[str, Claim]:
    return {claim.id: claim for claim in paper_claims("matiskova2021")}


def test_claims_are_whole_and_json_safe(claims):
    assert len(claims) >= 25
    assert list(claims) == [f"matiskova2021-{number:02d}" for number in range(1, len(claims) + 1)]
    for claim in claims.values():
        assert claim.paper == "matiskova2021"
        assert claim.place
        shown = json.loads(json.dumps(to_dict(claim), allow_nan=False))
        assert set(shown) == {
            "id", "paper", "statement", "place", "printed", "recomputed", "unit", "tolerance",
            "verdict", "reason",
        }  # fmt: skip
        assert shown["verdict"] in {verdict.value for verdict in Verdict}


@pytest.mark.parametrize(
    ("id", "verdict"),
    [
        ("matiskova2021-01", REPRODUCED),  # p_svd = p1 - p2
        ("matiskova2021-03", REPRODUCED),  # degrees of Table 1
        ("matiskova2021-06", WRONG),  # row 4 is printed without its minus
        ("matiskova2021-07", WRONG),  # 21 distinct rows
        ("matiskova2021-09", UNPRINTED),  # (17) fitted
        ("matiskova2021-11", WRONG),  # (23) in bar
        ("matiskova2021-13", WRONG),  # beta(0)
        ("matiskova2021-15", REPRODUCED),  # decreasing inclination
        ("matiskova2021-22", WRONG),  # signs of (5)
        ("matiskova2021-23", REPRODUCED),  # parts of (5)
        ("matiskova2021-25", WRONG),  # co-contraction softens
        ("matiskova2021-28", REPRODUCED),  # symmetric
        ("matiskova2021-29", REPRODUCED),  # T1 T2
        ("matiskova2021-30", REPRODUCED),  # T1 + T2
        ("matiskova2021-31", WRONG),  # G1 against G2
        ("matiskova2021-34", UNPRINTED),  # a length chosen to fit is no reproduction
        ("matiskova2021-40", REPRODUCED),  # monotonic
        ("matiskova2021-41", REPRODUCED),  # oscillating
    ],
)
def test_verdicts_are_those_of_the_evidence(claims, id, verdict):
    assert claims[id].verdict is verdict


@pytest.mark.parametrize(
    ("id", "expected", "tolerance"),
    [
        ("matiskova2021-11", 5.96, 0.01),  # deg RMS of (23) in bar
        ("matiskova2021-12", 2.01, 0.01),  # with the best scale
        ("matiskova2021-13", 0.6907, 1e-9),  # deg, a0 + a1
        ("matiskova2021-25", -0.0996, 5e-4),  # c
        ("matiskova2021-29", 0.090314 * 0.57873, 1e-15),
        ("matiskova2021-30", 0.090314 + 0.57873, 1e-15),
        ("matiskova2021-31", 0.6747, 1e-4),  # output error
        ("matiskova2021-32", 0.7470, 1e-4),  # ARX, unit gain
        ("matiskova2021-33", 0.7694, 1e-4),  # ARX, free gain
        ("matiskova2021-34", 0.64595, 1e-4),
    ],
)
def test_numbers_found_by_independent_scripts(claims, id, expected, tolerance):
    assert claims[id].recomputed == pytest.approx(expected, abs=tolerance)


def test_reasons_carry_what_was_chosen(claims):
    assert "182 kPa" in claims["matiskova2021-12"].reason
    assert "0.77 deg RMS" in claims["matiskova2021-25"].reason
    assert "1.06 leaving one out" in claims["matiskova2021-25"].reason
    assert "0.98 and 1.22" in claims["matiskova2021-25"].reason
    assert "2.414 s" in claims["matiskova2021-34"].reason


STATES = pytest.mark.parametrize(("length", "pressure"), [(0.0, 3e5), (-0.01, 5e5), (0.004, 1.5e5)])


@STATES
def test_equation_5_is_the_stiffness_of_the_kernel_under_the_ideal_law(length, pressure):
    par = row(ideal_muscle())
    closed = ideal_stiffness(par, length, pressure)
    numeric = muscle_stiffness(par, length, pressure)
    assert closed.compressibility == pytest.approx(numeric.compressibility, rel=1e-8)
    assert closed.geometric == pytest.approx(numeric.geometric, rel=1e-8)


def test_geometric_part_goes_with_gauge_pressure_and_compressibility_with_absolute():
    muscle = ideal_muscle()
    one, two = (ideal_stiffness(row(muscle), 0.0, pressure) for pressure in (2e5, 4e5))
    assert two.geometric == pytest.approx(2.0 * one.geometric, rel=1e-12)
    ratio = (4e5 + muscle.chamber.atmosphere) / (2e5 + muscle.chamber.atmosphere)
    assert two.compressibility == pytest.approx(ratio * one.compressibility, rel=1e-12)
