"""Property tests draw the same examples in every run: a failure here is a failure everywhere."""

from __future__ import annotations

from collections.abc import Generator

import hypothesis
import pytest

hypothesis.settings.register_profile(
    "properties", derandomize=True, deadline=None, database=None, max_examples=60
)


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report() -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Import this folder's tests under the profile: `given` takes the one that is loaded then.

    Afterwards that of all tests is back: profiles belong to the process, not to a folder.
    """
    hypothesis.settings.load_profile("properties")
    try:
        return (yield)
    finally:
        hypothesis.settings.load_profile("pamsim")
