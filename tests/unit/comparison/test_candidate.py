"""Values on the ends of their ranges are moved inside."""

from __future__ import annotations

import pytest

from pamsim.comparison.candidate import INSIDE, inside
from pamsim.inference.free_parameter import FreeParameter


@pytest.mark.parametrize(
    ("value", "moved"),
    [(1.0, 1.0 + 2.0 * INSIDE), (9.0, 3.0 - 2.0 * INSIDE), (2.0, 2.0)],
)
def test_a_value_keeps_a_share_of_the_range_from_both_ends(value: float, moved: float) -> None:
    parameter = FreeParameter(name="x", unit="N", start=2.0, low=1.0, high=3.0)
    assert inside([parameter], {"x": value})["x"] == pytest.approx(moved, rel=1e-12)
