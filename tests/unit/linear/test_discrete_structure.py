"""What a discrete model's coordinates say, by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pamsim.linear.discrete_structure import DiscreteStructure


@pytest.mark.parametrize(
    ("poles", "size"),
    [((0.9, 0.5), 0.9), ((1.2, 0.5), 0.5), ((0.5, 0.0), 0.5)],
)
def test_the_slowest_decay_is_that_of_the_largest_stable_pole(
    poles: tuple[float, float], size: float
) -> None:
    structure = DiscreteStructure("arx", na=2, nb=1, nk=1, sample_time=0.01)
    coordinates = np.append(np.poly(poles)[1:], 1.0)
    assert structure.slowest(coordinates) == pytest.approx(-0.01 / math.log(size), rel=1e-9)
