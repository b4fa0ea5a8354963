"""Property tests draw the same examples in every run: a failure here is a failure everywhere."""

from __future__ import annotations

from collections.abc import Iterator

import hypothesis
import pytest

hypothesis.settings.register_profile(
    "properties", derandomize=True, deadline=None, database=None, max_examples=60
)


@pytest.fixture(autouse=True)
def reproducible_examples(request: pytest.FixtureRequest) -> Iterator[None]:
    """Use the profile inside this folder only: profiles belong to the process, not to a folder."""
    before = hypothesis.settings.get_current_profile_name()
    hypothesis.settings.load_profile("properties")
    yield
    hypothesis.settings.load_profile(before)
