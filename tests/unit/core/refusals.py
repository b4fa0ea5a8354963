"""What every refusal owes the user: one line that names the place."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import pytest

from pamsim.core.errors import InputError


def all_refused(table: Mapping[str, tuple[Any, ...]], call: Callable[..., Any], *always: str):
    """Each row, arguments and then a word or words, is refused by the call in one line."""
    for name, (*given, words) in table.items():
        text = ""
        try:
            call(*given)
        except InputError as refusal:
            text = str(refusal)
        wanted = (*always, *(words if isinstance(words, tuple) else (words,)))
        missing = [word for word in wanted if word not in text]
        assert not missing, f"{name}: {text!r} does not state {missing}"
        assert text.count("\n") == 0, name


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
