"""The element of Nguyen 2024: order, relaxation time and stiffness, with intervals that cover."""

from __future__ import annotations

import numpy as np

from pamsim.fitting.maxwell import fit_maxwell, maxwell_loop
from pamsim.recordings.measured_table import ForceLoops

PLANTED = (0.45, 0.05, 5e3)  # alpha [-], beta [s], Ke [N/m]
FREQUENCIES = (0.5, 1.0, 2.0, 3.5, 5.0, 10.0)  # Hz
FORCE = 125.0  # N


def loops(noise, rng):
    """Four periods of each loop, with white noise of a share of either amplitude."""
    records = []
    for frequency in FREQUENCIES:
        w = 2 * np.pi * frequency
        t = np.arange(200) / (50.0 * frequency)
        point = maxwell_loop(*PLANTED, w, FORCE)
        # x1 and x2 of the steady loop fix its in-phase and out-of-phase parts.
        x = point.at_force * np.sin(w * t) + point.at_zero * np.cos(w * t)
        size = np.hypot(point.at_force, point.at_zero)
        f = FORCE * np.sin(w * t)
        records.append(
            (
                t,
                f + noise * FORCE * rng.standard_normal(t.size),
                x + noise * size * rng.standard_normal(t.size),
            )
        )
    names = tuple(f"{frequency:g} Hz" for frequency in FREQUENCIES)
    time, force, displacement = zip(*records, strict=True)
    return ForceLoops(names=names, time=time, force=force, displacement=displacement)


def planted():
    alpha, beta, stiffness = PLANTED
    return np.array([alpha, np.log10(beta), np.log10(stiffness)])


def test_element_is_recovered_within_one_percent_without_noise():
    fitted, _ = fit_maxwell(loops(0.0, np.random.default_rng(0)), held={})
    alpha, beta, stiffness = fitted.fit.values
    np.testing.assert_allclose([alpha, 10**beta, 10**stiffness], PLANTED, rtol=0.01)


def test_intervals_cover_at_two_percent_noise():
    rng = np.random.default_rng(11)
    repeats = 30
    hits = np.zeros(3)
    for _ in range(repeats):
        fit = fit_maxwell(loops(0.02, rng), held={})[0].fit
        for i, (coefficient, value) in enumerate(zip(fit.coefficients, planted(), strict=True)):
            low, high = coefficient.interval95
            hits[i] += low <= value <= high
    print("coverage of alpha, beta, Ke:", hits / repeats)
    # Binomial(30, 0.95): 99.9 % of all seeds give 24 to 30 hits.
    assert np.all(hits >= 24), hits
