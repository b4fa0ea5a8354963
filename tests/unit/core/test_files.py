"""A file is complete or stays as it was, whatever stops the writing."""

import errno
import os
from contextlib import contextmanager
from pathlib import Path

import pytest
from filelock import FileLock

from pamsim.core.files import LOCK, complete_file, results_folder
from tests.unit.core.refusals import refused


@contextmanager
def half_written(path):
    with complete_file(path) as part:
        part.write_text("half")
        yield


def test_the_file_appears_with_the_end_of_the_block_and_others_may_read_it(tmp_path):
    path = tmp_path / "new" / "data.txt"
    with complete_file(path) as part:
        part.write_text("new")
        assert part.suffix == ".txt"
        assert not path.exists()
    assert path.read_text() == "new"
    assert list(path.parent.iterdir()) == [path]
    (tmp_path / "plain").write_text("")
    assert path.stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_what_stops_the_writing_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    path = tmp_path / "data.txt"
    path.write_text("old")
    for stop in (KeyboardInterrupt, ValueError):
        with pytest.raises(stop), half_written(path):
            raise stop
    for error, reason in (
        (OSError(errno.ENOSPC, "Error writing bytes to file"), "No space left on device"),
        (OSError("ffmpeg failed: Unknown encoder"), "ffmpeg failed: Unknown encoder"),
    ):  # the system's reason, in whatever words a library puts it
        with refused(f"cannot write {tmp_path}", reason), complete_file(path):
            raise error

    def full(handle):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with refused("cannot write", "No space left"), complete_file(path) as part:
            part.write_text("new")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]

    def interrupted(path, mode):
        path.touch()
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "open", interrupted)  # as the file is made
    with pytest.raises(KeyboardInterrupt), complete_file(tmp_path / "other.txt"):
        pass
    assert list(tmp_path.iterdir()) == [path]


def test_two_writers_of_one_file_do_not_share_their_halves(tmp_path):
    path = tmp_path / "data.txt"
    with complete_file(path) as first:
        first.write_text("first")
        with complete_file(path) as second:
            second.write_text("second")
        assert path.read_text() == "second"
    assert path.read_text() == "first"
    assert list(tmp_path.iterdir()) == [path]


def test_results_are_not_written_over_without_being_asked_to(tmp_path):
    folder = tmp_path / "out"
    with results_folder(folder) as there:
        (there / "result.json").write_text("old")
    assert [path.name for path in folder.iterdir()] == ["result.json"]
    with refused("result.json", "`force` replaces", "another folder"), results_folder(folder):
        pass
    again = results_folder(folder, force=True)
    with results_folder(folder, force=True), refused("another run writes"), again:
        pass
    with results_folder(folder, resume=True):
        assert (folder / LOCK).exists()
    assert (folder / "result.json").read_text() == "old"


def test_a_run_that_wrote_nothing_leaves_no_folder_and_a_file_is_none(tmp_path):
    with pytest.raises(KeyboardInterrupt), results_folder(tmp_path / "out"):
        raise KeyboardInterrupt
    assert not (tmp_path / "out").exists()
    (tmp_path / "out").write_text("")
    with refused("cannot write", "it is a file"), results_folder(tmp_path / "out"):
        pass


def test_what_a_killed_run_has_left_is_no_result_and_is_removed(tmp_path):
    killed = [complete_file(tmp_path / name) for name in ("data.csv", "rig/params.toml")]
    of_run, of_rig = (writing.__enter__() for writing in killed)
    with refused("(rig)"), results_folder(tmp_path):
        pass
    (tmp_path / "rig" / ".notes").write_text("of the user")
    with results_folder(tmp_path, resume=True):
        assert not of_run.exists()
        assert not of_rig.exists()
    assert (tmp_path / "rig" / ".notes").exists()


def test_a_lock_file_is_gone_before_another_run_can_take_it(tmp_path, monkeypatch):
    there = []
    release = FileLock.release

    def noted(self, *args, **kwargs):
        there.append((tmp_path / LOCK).exists())
        release(self, *args, **kwargs)

    monkeypatch.setattr(FileLock, "release", noted)
    with results_folder(tmp_path):
        pass
    assert there[0] is False
