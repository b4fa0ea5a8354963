"""What every refusal owes the user: one line that names the place."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from pamsim.core.errors import InputError


@contextmanager
def refused(*words: str, error: type[InputError] = InputError) -> Iterator[None]:
    """Expect an error whose text is a single line that contains all the words."""
    with pytest.raises(error) as caught:
        yield
    text = str(caught.value)
    assert text
    assert "\n" not in text
    missing = [word for word in words if word not in text]
    assert not missing, f"{text!r} does not say {missing}"
