"""A file is complete or stays as it was, whatever stops the writing."""

from __future__ import annotations

import pytest

from pamsim.core.files import complete_file
from tests.unit.core.refusals import refused


def test_the_file_appears_with_the_end_of_the_block(tmp_path):
    path = tmp_path / "new" / "data.txt"
    with complete_file(path) as part:
        part.write_text("new")
        assert part.suffix == ".txt"
        assert not path.exists()
    assert path.read_text() == "new"
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("stop", [KeyboardInterrupt, ValueError])
def test_what_stops_the_writing_leaves_the_old_file_and_nothing_else(tmp_path, stop):
    path = tmp_path / "data.txt"
    path.write_text("old")

    def interrupted():
        with complete_file(path) as part:
            part.write_text("half")
            raise stop

    with pytest.raises(stop):
        interrupted()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_place_that_cannot_be_written_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    with refused("cannot write", "data.txt"), complete_file(tmp_path / "file" / "data.txt"):
        pass
