"""The volume of a law that states its force alone."""

from __future__ import annotations

import pytest

from pamsim.physics.force_laws.force_law import swept_volume


def test_volume_is_the_integral_of_the_slope_of_the_force_by_pressure():
    def force(pressure, contraction, area):
        return area * pressure * (1.0 - 3.0 * contraction + 40.0 * contraction**7)

    for kappa in (-0.05, 0.1, 0.4):
        expected = 2e-4 * (kappa - 1.5 * kappa**2 + 5.0 * kappa**8)
        assert swept_volume(force)(3e5, kappa, 2e-4) == pytest.approx(expected, rel=1e-9)
