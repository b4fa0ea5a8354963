"""The six-parameter law against the constants its authors printed, in their own units."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pamsim.core.units import PA_PER_BAR, to_si
from pamsim.physics.force_laws.exponential import SixParameter, six_parameter_force

# a [N/bar], b [N], c [1/%], d [N/(bar %)], e [N/bar], f [N]: p in bar, k in percent
PRINTED = {
    "DMSP-20-200": (-4.00180705, 292.4620246, -0.32930845, -9.33564098, 294.0538256, -280.498151),
    "DMSP-20-400": (-4.35573, 281.22370, -0.32866, -9.27035, 302.20107, -263.69185),
    "DMSP-10": (-9.2194029, 203.7012413, -0.34221042, -3.2255991, 109.2038216, -208.372034),
}
PRESSURES = np.linspace(1.0, 6.0, 11)  # bar
CONTRACTIONS = np.linspace(0.0, 25.0, 26)  # percent


def si(constants: tuple[float, ...]) -> SixParameter:
    a, b, c, d, e, f = constants

    def per_bar(value: float) -> float:
        return to_si(value, "N/bar", "N/Pa", where="test")

    return SixParameter(
        a=per_bar(a), b=b, c=to_si(c, "1/percent", "1", where="test"), d=per_bar(d * 100.0),
        e=per_bar(e), f=f,
    )  # fmt: skip


def force(law: SixParameter, bar: float, percent: float) -> float:
    return six_parameter_force(
        bar * PA_PER_BAR, percent / 100.0, law.a, law.b, law.c, law.d, law.e, law.f
    )


@pytest.mark.parametrize("name", PRINTED)
def test_si_law_is_the_printed_law(name):
    a, b, c, d, e, f = PRINTED[name]
    law = si(PRINTED[name])
    for p in PRESSURES:
        for k in CONTRACTIONS:
            terms = ((a * p + b) * math.exp(c * k), d * p * k, e * p, f)
            tolerance = 1e-12 * max(map(abs, terms))
            assert force(law, p, k) == pytest.approx(sum(terms), abs=tolerance)


@pytest.mark.parametrize("name", PRINTED)
def test_force_falls_with_contraction_and_rises_with_pressure(name):
    law = si(PRINTED[name])
    surface = np.array([[force(law, p, k) for k in CONTRACTIONS] for p in PRESSURES])
    assert np.all(np.diff(surface, axis=1) < 0.0)
    assert np.all(np.diff(surface, axis=0) > 0.0)


def test_the_20_mm_muscle_pulls_as_hard_as_printed_sources_say():
    """Sources for 6 bar and no contraction lie between 1264 and 1752 N."""
    assert 1264.0 < force(si(PRINTED["DMSP-20-200"]), 6.0, 0.0) < 1760.0
