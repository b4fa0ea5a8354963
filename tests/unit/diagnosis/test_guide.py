"""The package's guide names files that exist."""

from __future__ import annotations

import re
from pathlib import Path

import pamsim.diagnosis


def test_files_of_the_guide_exist():
    folder = Path(pamsim.diagnosis.__file__).parent
    named = re.findall(r"[\w./]+\.py", pamsim.diagnosis.__doc__)
    assert len(named) > 20
    for name in named:
        assert (folder / name).is_file() or (folder / "by_link" / name).is_file(), name
