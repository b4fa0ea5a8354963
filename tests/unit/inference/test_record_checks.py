"""A time that is not uniform is refused where it is worst."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.inference.record_checks import uniform_interval


@pytest.mark.parametrize("odd", [0.004, 0.02], ids=["too short", "too long"])
def test_the_interval_that_differs_most_is_named(odd: float) -> None:
    steps = np.full(50, 0.01)
    steps[17] = odd
    time = np.concatenate([[0.0], np.cumsum(steps)])
    with pytest.raises(InputError, match=rf"interval {odd:g} s after time\[17\]"):
        uniform_interval(time)


def test_jitter_within_a_hundredth_is_uniform() -> None:
    time = 0.01 * np.arange(50) + 4e-5 * (np.arange(50) % 2)
    assert uniform_interval(time) == pytest.approx(0.01, rel=1e-3)
