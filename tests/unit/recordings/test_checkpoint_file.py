"""A checkpoint is there whole or not at all."""

from __future__ import annotations

import pytest

from pamsim.core.errors import InputError
from pamsim.recordings.json_file import CheckpointFile


def test_what_was_saved_is_loaded_until_it_is_cleared(tmp_path):
    file = CheckpointFile(tmp_path / "deep" / "checkpoint.json")
    assert file.load() is None
    for state in ({"a": [1.0, 0.1 + 0.2]}, {"b": None}):
        file.save(state)
        assert file.load() == state
    file.clear()
    file.clear()
    assert file.load() is None


@pytest.mark.parametrize("text", ["{", "[1]", "", "[" * 100_000])
def test_a_spoilt_file_says_how_to_start_again(tmp_path, text):
    path = tmp_path / "checkpoint.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="remove it to start again"):
        CheckpointFile(path).load()
