"""What lies on the ends of a range: values are moved inside, and effects stand for others."""

from __future__ import annotations

import pytest

from pamsim.comparison.candidate import INSIDE, Candidate, inside
from pamsim.effects.effect import Effect, EffectParameter
from pamsim.inference.free_parameter import FreeParameter


@pytest.mark.parametrize(
    ("value", "moved"),
    [(1.0, 1.0 + 2.0 * INSIDE), (9.0, 3.0 - 2.0 * INSIDE), (2.0, 2.0)],
)
def test_a_value_keeps_a_share_of_the_range_from_both_ends(value: float, moved: float) -> None:
    parameter = FreeParameter(name="x", unit="N", start=2.0, low=1.0, high=3.0)
    assert inside([parameter], {"x": value})["x"] == pytest.approx(moved, rel=1e-12)


def test_an_end_counts_unless_it_is_neutral_zero_or_natural() -> None:
    stated = (
        EffectParameter("size", 1.0, 0.0, 4.0),
        EffectParameter("shape", 1.0, 0.5, 2.0, shape=True),
        EffectParameter("natural", 1.0, 0.5, 2.0, shape=True, natural_ends=True),
    )
    effect = Effect(
        name="x", family="x", missing="x", parameters=stated, look_alikes=(), separating="x"
    )
    own = tuple(
        FreeParameter(name=one.name, unit="N", start=1.0, low=one.low, high=one.high)
        for one in stated
    )
    found = Candidate(effect=effect, parameters=own, neutral={"size": 0.0}, probes=())
    inner = {"size": 1.0, "shape": 1.0, "natural": 1.0}
    assert not found.at_end(inner)
    assert not found.at_end(inner | {"size": 0.0})
    assert not found.at_end(inner | {"natural": 2.0})
    assert found.at_end(inner | {"size": 3.99})
    assert found.at_end(inner | {"shape": 0.5})
    assert not found.at_end(inner | {"shape": 0.52})
