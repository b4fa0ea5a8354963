"""Records that cannot be identified from are refused with a sentence that names them."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.linear.signal_record import SignalRecord, checked_records
from tests.unit.linear.planted import refuses

T = 0.01 * np.arange(50)
U = np.sign(np.sin(T * 40.0))
Y = np.cos(T)


def test_interval_and_duration() -> None:
    record = SignalRecord("a", T + 3.0, U, Y)
    assert record.sample_time == pytest.approx(0.01)
    assert record.duration == pytest.approx(0.49)


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"output": Y[:-1]}, "50 samples but response has 49"),
        ({"inputs": np.append(U[:-1], np.nan)}, "not finite"),
        ({"inputs": np.full(50, 3.0)}, "input is constant"),
        ({"output": np.full(50, 3.0)}, "response is constant"),
        ({"time": T**2}, "not uniform"),
        ({"time": T[::-1]}, "does not increase"),
        ({"holds": ("cubic",)}, "hold 'cubic'"),
        ({"holds": ("zoh", "zoh")}, "2 entries for 1 inputs"),
        ({"inputs": np.full((50, 2), 3.0)}, "input is constant"),
        ({"time": T[:8], "inputs": U[:8], "output": Y[:8]}, "too short"),
    ],
)
def test_bad_records_are_refused_by_name(changes: dict[str, object], word: str) -> None:
    with pytest.raises(InputError, match=word) as caught:
        SignalRecord(**{"name": "arm_3", "time": T, "inputs": U, "output": Y, **changes})
    assert "arm_3" in str(caught.value)


def test_records_of_one_identification_fit_together() -> None:
    a, b = (SignalRecord(n, T, U, Y, (unit,), "rad") for n, unit in (("a", "Pa"), ("b", "kPa")))
    refuses("at least one", checked_records, [])
    refuses("twice", checked_records, [a, a])
    refuses("convert", checked_records, [a, b])
    with pytest.raises(InputError, match="has 2 inputs but a 1"):
        checked_records([a, SignalRecord("c", T, np.column_stack([U, Y]), Y, ("Pa",), "rad")])
    assert checked_records([a]) == (a,)


def test_several_inputs_share_what_is_given_once_and_none_is_taken_for_the_only_one() -> None:
    both = SignalRecord("a", T, np.column_stack([U, np.full(50, 3.0)]), Y, ("Pa",), holds=("foh",))
    assert (both.units_input, both.holds) == (("Pa", "Pa"), ("foh", "foh"))
    with pytest.raises(InputError, match="has 2 inputs where one is expected"):
        _ = both.input
    np.testing.assert_array_equal(SignalRecord("b", T, U, Y).input, U)
