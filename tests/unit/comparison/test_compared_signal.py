"""Misfits of a channel's trials together are those of all of its samples."""

from dataclasses import replace

import numpy as np
import pytest

from pamsim.comparison.compared_signal import Comparison, pooled_rms


def part(size, error):
    measured = np.zeros(size)
    return Comparison(
        trial="t",
        protocol="p",
        channel="pressure_1",
        time=np.arange(float(size)),
        measured=measured,
        before=measured + error,
        after=None,
        held_out=True,
    )


def test_trials_count_by_their_samples_and_one_that_is_missing_leaves_none():
    parts = [part(100, 2e3), part(300, -1e3)]
    assert pooled_rms(parts, "before") == pytest.approx(np.sqrt(1.75))  # kPa
    assert pooled_rms(parts, "after") is None
    assert pooled_rms([parts[0], replace(parts[1], before=None)], "before") is None
    assert pooled_rms([], "before") is None
