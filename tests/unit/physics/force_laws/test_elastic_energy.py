"""The restoring force of the air against the energy of a closed muscle."""

from __future__ import annotations

import math

import pytest

from pamsim.physics.braid import volume
from pamsim.physics.force_laws.mckibben import elastic_energy_force, ideal_force, ideal_tension

LENGTH, BRAID = 0.3, (0.02, math.radians(28.6))  # DMSP-20-300N of Nguyen 2024
WORK = (3e5, 0.12)
LOAD = ideal_tension(*WORK, LENGTH, *BRAID)
"""What the muscle pulls at the working point (Nguyen 2024, (3))."""


@pytest.mark.parametrize("p", [0.0, 2e5, 5e5])
@pytest.mark.parametrize("kappa", [-0.02, 0.0, 0.1, 0.3])
def test_with_the_load_at_the_working_point_it_is_the_ideal_law(p, kappa):
    total = elastic_energy_force(p, kappa, *WORK, *BRAID) + LOAD
    ideal = ideal_force(p, LENGTH * (1.0 - kappa), LENGTH, *BRAID)
    assert total == pytest.approx(ideal, rel=1e-12, abs=1e-9)


def test_it_is_zero_at_the_working_point_and_pulls_back_from_a_stretch():
    assert elastic_energy_force(*WORK, *WORK, *BRAID) == 0.0
    assert elastic_energy_force(WORK[0], WORK[1] - 0.01, *WORK, *BRAID) > 0.0
    assert elastic_energy_force(WORK[0], WORK[1] + 0.01, *WORK, *BRAID) < 0.0


def test_the_filled_muscle_pulls():
    """The sign that the print of (3) has lost."""
    assert ideal_tension(3e5, 0.1, LENGTH, *BRAID) > 0.0


def test_the_work_of_a_closed_stretch_is_the_energy_of_the_air():
    """P V^k = const (2): the work done on muscle and atmosphere is what the air has gained."""
    k, atmosphere = 1.4, 101325.0

    def size(kappa):
        return volume(LENGTH * (1.0 - kappa), LENGTH, *BRAID)

    start, end, steps = WORK[1], 0.02, 2000
    absolute = WORK[0] + atmosphere
    width = (start - end) / steps
    work = 0.0
    for i in range(steps):
        kappa = start - (i + 0.5) * width
        p = absolute * (size(start) / size(kappa)) ** k - atmosphere
        total = elastic_energy_force(p, kappa, *WORK, *BRAID) + LOAD
        work += total * LENGTH * width
    squeezed = absolute * (size(start) / size(end)) ** k
    gained = (squeezed * size(end) - absolute * size(start)) / (k - 1.0)
    gained -= atmosphere * (size(start) - size(end))
    assert work == pytest.approx(gained, rel=1e-6)
