"""What every refusal owes the user: one line that names the place."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import pytest

from pamsim.core.errors import InputError


def cases(table: Mapping[str, Any]) -> list[Any]:
    """Rows of a table, one argument or a tuple of several, as parameters named by their keys."""
    return [
        pytest.param(*(row if isinstance(row, tuple) else (row,)), id=name)
        for name, row in table.items()
    ]


@contextmanager
def refused(*words: str, error: type[InputError] = InputError) -> Iterator[None]:
    """Expect an error whose text is a single line that contains all the words."""
    with pytest.raises(error) as caught:
        yield
    text = str(caught.value)
    assert text
    assert "\n" not in text
    missing = [word for word in words if word not in text]
    assert not missing, f"{text!r} does not state {missing}"
