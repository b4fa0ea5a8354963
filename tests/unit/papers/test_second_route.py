"""Claims of all five papers recomputed a second time, by methods that share no code with pamsim.

A route returns its number or numbers and how far both methods may be apart. That follows from what
is known of their errors, such as rounding, the order of a scheme or where a search stops, and not
from the difference that was found.
"""

import numpy as np
import pytest

from pamsim.papers.claim import evaluate
from tests.unit.papers.second_route import (
    alraouf2025,
    matiskova2021,
    nguyen2024,
    sarosi,
    vandamme2008,
)

PAPERS = (alraouf2025, matiskova2021, nguyen2024, sarosi, vandamme2008)
ROUTES = {id: route for paper in PAPERS for id, route in paper.ROUTES.items()}


@pytest.mark.parametrize("id", ROUTES)
def test_a_second_route_gives_the_same(id):
    numbers, errors = ROUTES[id]()
    apart = np.abs(np.subtract(evaluate(id).recomputed, numbers))
    assert np.all(apart <= errors), f"apart by {apart}, known errors {errors}"
