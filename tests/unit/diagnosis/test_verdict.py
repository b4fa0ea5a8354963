"""The one rule of the verdict: each word has one meaning, whatever the data."""

from __future__ import annotations

import dataclasses

import pytest

from pamsim.diagnosis.method.verdict import Evidence, Verdict, decide
from pamsim.diagnosis.method.verdict_thresholds import ADEQUATE, MOST

NAMED = Evidence(claimed=True, gap=True, explained=1.0)
ABSENT = Evidence(claimed=False, gap=False)


@pytest.mark.parametrize(
    ("evidence", "changes", "verdict"),
    [
        (ABSENT, {}, Verdict.NO_GAP),
        (ABSENT, {"conclusive": False}, Verdict.NO_GAP),
        (ABSENT, {"suspected": True}, Verdict.NOT_IDENTIFIABLE),
        (ABSENT, {"gap": True}, Verdict.UNEXPLAINED),
        (ABSENT, {"gap": True, "suspected": True}, Verdict.UNEXPLAINED),
        (ABSENT, {"gap": True, "conclusive": False}, Verdict.NOT_IDENTIFIABLE),
        (NAMED, {}, Verdict.NAMED),
        (NAMED, {"gap": False}, Verdict.NAMED),
        (NAMED, {"conclusive": False}, Verdict.NOT_IDENTIFIABLE),
        (NAMED, {"tied": True}, Verdict.AMBIGUOUS),
        (NAMED, {"tied": True, "large_remainder": True}, Verdict.AMBIGUOUS),
        (NAMED, {"large_remainder": True}, Verdict.NAMED_WITH_REMAINDER),
        (NAMED, {"untested": True}, Verdict.NAMED_WITH_REMAINDER),
        (NAMED, {"untested": True, "tied": True}, Verdict.AMBIGUOUS),
        (ABSENT, {"untested": True}, Verdict.NO_GAP),
        (NAMED, {"strained": True}, Verdict.NAMED),
        (NAMED, {"strained": True, "untested": True}, Verdict.NAMED_WITH_REMAINDER),
        (NAMED, {"strained": True, "remainder": True}, Verdict.UNEXPLAINED),
        (NAMED, {"strained": True, "large_remainder": True}, Verdict.UNEXPLAINED),
        (NAMED, {"strained": True, "large_remainder": True, "tied": True}, Verdict.UNEXPLAINED),
        (NAMED, {"rare": True}, Verdict.NAMED),
        (NAMED, {"rare": True, "untested": True}, Verdict.NAMED_WITH_REMAINDER),
        (NAMED, {"rare": True, "large_remainder": True}, Verdict.UNEXPLAINED),
        (NAMED, {"rare": True, "explained": ADEQUATE}, Verdict.NAMED),
        (NAMED, {"rare": True, "explained": ADEQUATE - 1e-6}, Verdict.UNEXPLAINED),
        (NAMED, {"strained": True, "explained": ADEQUATE}, Verdict.NAMED),
        (NAMED, {"strained": True, "explained": ADEQUATE - 1e-6}, Verdict.UNEXPLAINED),
        (NAMED, {"large_remainder": True, "explained": ADEQUATE - 1e-6}, Verdict.UNEXPLAINED),
        (NAMED, {"remainder": True, "explained": ADEQUATE}, Verdict.NAMED),
        (NAMED, {"remainder": True, "explained": ADEQUATE - 1e-6}, Verdict.UNEXPLAINED),
        (NAMED, {"remainder": True, "explained": 0.5, "tied": True}, Verdict.UNEXPLAINED),
        (NAMED, {"remainder": True, "effects": 2, "explained": 2 * ADEQUATE - 1}, Verdict.NAMED),
        (
            NAMED,
            {"remainder": True, "effects": 2, "explained": 2 * ADEQUATE - 1 - 1e-6},
            Verdict.UNEXPLAINED,
        ),
        (
            NAMED,
            {"remainder": True, "effects": 3, "explained": 2 * ADEQUATE - 1 - 1e-6},
            Verdict.UNEXPLAINED,
        ),
        (
            NAMED,
            {"remainder": True, "effects": 2, "rare": True, "explained": ADEQUATE},
            Verdict.NAMED,
        ),
        (
            NAMED,
            {"remainder": True, "effects": 2, "rare": True, "explained": ADEQUATE - 1e-6},
            Verdict.UNEXPLAINED,
        ),
        (NAMED, {"remainder": False, "explained": MOST}, Verdict.NAMED),
        (NAMED, {"remainder": False, "explained": MOST - 1e-6}, Verdict.UNEXPLAINED),
    ],
)
def test_the_verdict_follows_from_the_evidence(evidence, changes, verdict):
    assert decide(dataclasses.replace(evidence, **changes)) is verdict


def test_what_a_verdict_claims_and_repairs():
    assert [v for v in Verdict if v.claims] == [Verdict.NAMED, Verdict.NAMED_WITH_REMAINDER]
    assert [v for v in Verdict if v.repairs] == [
        Verdict.NAMED, Verdict.NAMED_WITH_REMAINDER, Verdict.AMBIGUOUS
    ]  # fmt: skip
