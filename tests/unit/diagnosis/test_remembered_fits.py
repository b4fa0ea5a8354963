"""Fits on disk: taken up by the same diagnosis, refused to any other."""

from __future__ import annotations

import pytest

from pamsim.core.errors import InputError
from pamsim.diagnosis.remembered_fits import FILE, RememberedFits

FIT = {"values": {"gain": 1.0}, "cost": 1.25}


def test_what_was_fitted_is_there_after_an_interruption(tmp_path):
    RememberedFits(tmp_path, ["data", 1])["one"] = FIT
    resumed = RememberedFits(tmp_path, ["data", 1], resume=True)
    assert dict(resumed) == {"one": FIT}
    resumed["two"] = FIT
    assert set(RememberedFits(tmp_path, ["data", 1], resume=True)) == {"one", "two"}


def test_a_new_run_does_not_take_up_old_fits(tmp_path):
    RememberedFits(tmp_path, ["data", 1])["one"] = FIT
    assert not RememberedFits(tmp_path, ["data", 1])
    assert not (tmp_path / FILE).exists()


def test_fits_of_other_data_or_none_are_refused(tmp_path):
    with pytest.raises(InputError, match="holds no interrupted diagnosis"):
        RememberedFits(tmp_path, ["data", 1], resume=True)
    RememberedFits(tmp_path, ["data", 1])["one"] = FIT
    with pytest.raises(InputError, match="of other data, another rig"):
        RememberedFits(tmp_path, ["data", 2], resume=True)
