"""Guides name files that exist and show the method in the lines that run."""

import inspect
import re
import textwrap
from pathlib import Path

import pamsim.diagnosis
from pamsim.diagnosis.by_link.diagnose_links import diagnose_links
from tests.records import page


def test_files_of_the_packages_guide_exist():
    folder = Path(pamsim.diagnosis.__file__).parent
    named = re.findall(r"[\w./]+\.py", pamsim.diagnosis.__doc__)
    assert len(named) > 20
    for name in named:
        assert (folder / name).is_file() or (folder / "by_link" / name).is_file(), name


def test_the_page_quotes_the_method():
    body = inspect.getsource(diagnose_links).partition("    steps = Steps(")
    essence = (body[1] + body[2]).partition("    return LinkDiagnosis(")[0]
    quoted = textwrap.dedent(essence).strip()
    assert quoted.count("\n") > 5
    assert f"```text\n{quoted}\n```" in page("diagnose")
