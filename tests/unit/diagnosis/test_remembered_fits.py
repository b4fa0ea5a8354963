"""Fits on disk: taken up by the same diagnosis, refused to any other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.diagnosis.remembered_fits import ARRAYS, FILE, RememberedFits
from tests.unit.core.refusals import refused

FIT = {"place": [0.1], "cost": 1.25, "jacobian": np.array([[0.1], [1.0 / 3.0]])}


def test_what_was_fitted_is_there_after_an_interruption(tmp_path):
    RememberedFits(tmp_path, ["data", 1])["one"] = FIT
    resumed = RememberedFits(tmp_path, ["data", 1], resume=True)
    assert list(resumed) == ["one"]
    assert (resumed["one"]["place"], resumed["one"]["cost"]) == ([0.1], 1.25)
    assert np.array_equal(resumed["one"]["jacobian"], FIT["jacobian"])
    resumed["two"] = FIT
    assert set(RememberedFits(tmp_path, ["data", 1], resume=True)) == {"one", "two"}


def test_a_new_run_does_not_take_up_old_fits(tmp_path):
    RememberedFits(tmp_path, ["data", 1])["one"] = FIT
    assert not RememberedFits(tmp_path, ["data", 1])
    assert not (tmp_path / FILE).exists()
    assert not list((tmp_path / ARRAYS).iterdir())


@pytest.mark.parametrize("spoil", [Path.unlink, lambda path: path.write_bytes(b"")])
def test_an_array_that_cannot_be_read_is_said_in_one_line(tmp_path, spoil):
    RememberedFits(tmp_path, ["data", 1])["one"] = FIT
    (array,) = (tmp_path / ARRAYS).iterdir()
    spoil(array)
    with refused(array.name, "start without `resume`"):
        RememberedFits(tmp_path, ["data", 1], resume=True)["one"]


@pytest.fixture
def small_files():
    """No file may grow beyond 4 KiB, as on a disk with no more room."""
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.usefixtures("small_files")
def test_an_array_for_which_there_is_no_room_is_said_with_the_reason(tmp_path):
    fits = RememberedFits(tmp_path, ["data", 1])
    with pytest.raises(InputError, match=r"\Acannot write [^\n]*\.npy: File too large\Z"):
        fits["one"] = {**FIT, "jacobian": np.zeros((1000, 3))}
    assert not list((tmp_path / ARRAYS).iterdir())


def test_fits_of_other_data_or_none_are_refused(tmp_path):
    with pytest.raises(InputError, match="holds no interrupted diagnosis"):
        RememberedFits(tmp_path, ["data", 1], resume=True)
    RememberedFits(tmp_path, ["data", 1])["one"] = FIT
    with pytest.raises(InputError, match="of other data, another rig"):
        RememberedFits(tmp_path, ["data", 2], resume=True)
