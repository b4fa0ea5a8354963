"""Published constants: the conversion of their units."""

from __future__ import annotations

import math

import pytest

from pamsim.physics.force_laws.exponential import six_parameter_force
from pamsim.physics.force_laws.force_law import coefficients_of
from pamsim.physics.force_laws.published import PUBLISHED


@pytest.mark.parametrize(
    ("name", "newton"),
    # at 4 bar and 10 %, worked out from the printed constants with p in bar and kappa in percent
    [
        (
            "DMSP-20-200",
            (-4.00180705 * 4.0 + 292.4620246) * math.exp(-0.32930845 * 10.0)
            - 9.33564098 * 40.0
            + 294.0538256 * 4.0
            - 280.498151,
        ),
        (
            "DMSP-20-400",
            (-4.35573 * 4.0 + 281.22370) * math.exp(-0.32866 * 10.0)
            - 9.27035 * 40.0
            + 302.20107 * 4.0
            - 263.69185,
        ),
        (
            "DMSP-10",
            (-9.2194029 * 4.0 + 203.7012413) * math.exp(-0.34221042 * 10.0)
            - 3.2255991 * 40.0
            + 109.2038216 * 4.0
            - 208.372034,
        ),
    ],
)
def test_si_gives_the_printed_force(name, newton):
    force = six_parameter_force(4e5, 0.1, *coefficients_of(PUBLISHED[name])[1:])
    assert force == pytest.approx(newton, rel=1e-12)
