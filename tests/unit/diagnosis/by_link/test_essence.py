"""The guide shows the method in the lines that run."""

from __future__ import annotations

import inspect
import textwrap
from pathlib import Path

from pamsim.diagnosis.by_link.diagnose_links import diagnose_links

GUIDE = Path(__file__).resolve().parents[4] / "docs" / "diagnose.md"


def test_the_guide_quotes_the_method():
    body = inspect.getsource(diagnose_links).partition("    steps = Steps(")
    essence = (body[1] + body[2]).partition("    return LinkDiagnosis(")[0]
    quoted = textwrap.dedent(essence).strip()
    assert quoted.count("\n") > 5
    assert f"```text\n{quoted}\n```" in GUIDE.read_text(encoding="utf-8")
