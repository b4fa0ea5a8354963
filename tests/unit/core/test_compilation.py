"""Compiled code has a place wherever pamsim runs, and whoever waits for it is given a reason.

BLAS has one thread inside a block; steps are counted.
"""

import os
import stat
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest
import threadpoolctl

from pamsim.core import compilation
from pamsim.core.compilation import VARIABLE, choose_cache, compile_notice, writable
from pamsim.core.computation import Steps, one_blas_thread


@pytest.fixture
def nowhere(tmp_path, monkeypatch):
    """No folder set, the user's cache below a file, temporary files in the test's folder."""
    (tmp_path / "file").write_text("")
    (tmp_path / "tmp").mkdir()
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file" / "cache"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    yield
    os.environ.pop(VARIABLE, None)  # what a test has set is not for the others


@pytest.mark.usefixtures("nowhere")
def test_where_the_source_can_be_written_numba_chooses_and_a_stated_folder_stays(
    tmp_path, monkeypatch
):
    choose_cache(tmp_path)
    assert VARIABLE not in os.environ
    monkeypatch.setenv(VARIABLE, "mine")
    choose_cache(tmp_path / "file" / "source")
    assert os.environ[VARIABLE] == "mine"
    assert writable(tmp_path / "new" / "folder")
    assert not writable(tmp_path / "file" / "folder")
    assert compilation._users() == tmp_path / "file" / "cache"


@pytest.mark.usefixtures("nowhere")
@pytest.mark.parametrize("planted", [False, True])
def test_without_a_place_it_is_a_temporary_folder_that_others_cannot_write(tmp_path, planted):
    taken = tmp_path / "tmp" / f"pamsim-{os.getuid()}"
    if planted:
        taken.mkdir()
        taken.chmod(0o777)
    with pytest.warns(RuntimeWarning, match="Set NUMBA_CACHE_DIR"):
        choose_cache(tmp_path / "file" / "source")
    folder = Path(os.environ[VARIABLE])
    assert folder.parent == tmp_path / "tmp"
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert not (planted and folder == taken)


@pytest.mark.parametrize(
    ("terminal", "seconds", "printed"),
    [
        (True, 0.4, "pamsim: compiling the laws, once for this installation (a minute)\n"),
        (True, 0.0, ""),
        (False, 0.4, ""),
    ],
)
def test_one_line_on_a_terminal_while_it_takes_long(
    terminal, seconds, printed, capsys, monkeypatch
):
    monkeypatch.setattr(compilation, "_AFTER", 0.05)
    monkeypatch.setattr("sys.stderr.isatty", lambda: terminal)
    with compile_notice("the laws", "a minute"):
        time.sleep(seconds)
    time.sleep(0.1)
    assert capsys.readouterr() == ("", printed)


def threads():
    return {p["num_threads"] for p in threadpoolctl.threadpool_info() if p["user_api"] == "blas"}


def test_blas_has_one_thread_inside_and_what_it_had_afterwards():
    np.ones((2, 2)) @ np.ones((2, 2))
    with threadpoolctl.threadpool_limits(2, "blas"):
        if threads() != {2}:
            pytest.skip("this BLAS cannot have two threads")
        assert one_blas_thread()(threads)() == {1}
        with pytest.raises(ZeroDivisionError), one_blas_thread():
            raise ZeroDivisionError
        assert threads() == {2}


def test_steps_are_counted_and_the_total_is_never_behind():
    seen = []
    steps = Steps(lambda *now: seen.append(now), 3)
    for what in "ab":
        steps.begin(what)
    steps.expect(1)
    for what in "cd":
        steps.begin(what)
    assert seen == [(0, 3, "a"), (1, 3, "b"), (2, 3, "c"), (3, 4, "d")]
