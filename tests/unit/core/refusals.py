"""What every refusal owes the user: one line that names the place."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import pytest

from pamsim.core.errors import InputError


def cases(table: Mapping[str, Any], *, bugs: Sequence[str] = ()) -> list[Any]:
    """Rows of a table of inputs as pytest parameters, named by their keys.

    Args:
        table: name -> one argument, or a tuple of several.
        bugs: names that fail today and should not. An expected failure that passes fails the run
            (xfail_strict), so whoever mends the code takes the name out.
    """
    unknown = set(bugs) - set(table)
    assert not unknown, unknown
    broken = pytest.mark.xfail(reason="known bug, see the closing note of these tests")
    return [
        pytest.param(
            *(row if isinstance(row, tuple) else (row,)),
            id=name,
            marks=[broken] if name in bugs else [],
        )
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
    assert not missing, f"{text!r} does not say {missing}"
