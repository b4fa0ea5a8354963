"""What repeats miss together: an estimate without bias, and p-values that hold under any noise."""

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import binom

from pamsim.comparison.repeated_misfit import repeated_misfit, shared_p_values

SAMPLES = 60


@pytest.fixture
def rng():
    return np.random.default_rng(11)


def drawn(rng, protocols=4, repeats=3, keep=0.0, varying=0.0, shared=0.0, outputs=2):
    """Outputs of protocols: noise (AR(1)) that varies from trial to trial, and a common gap."""
    shape = np.sin(np.arange(SAMPLES) / 5.0)
    found = []
    for number in range(outputs):
        own = []
        for protocol in range(protocols):
            white = rng.standard_normal((repeats, SAMPLES))
            noise = lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], white, axis=1)
            noise = noise + varying * rng.standard_normal((repeats, 1)) * shape
            noise = noise + (shared if number == 0 else 0.0) * np.sqrt(2.0) * shape
            own.append(repeated_misfit({f"{protocol}_{k}": row for k, row in enumerate(noise)}))
        found.append(own)
    return found


def test_the_shared_part_and_the_noise_are_estimated_without_bias(rng):
    pairs = [one for _ in range(400) for one in drawn(rng, shared=0.5, outputs=1)[0]]
    assert np.mean([one.shared for one in pairs]) == pytest.approx(0.25, rel=0.05)
    assert np.mean([one.noise for one in pairs]) == pytest.approx(1.0, rel=0.02)


@pytest.mark.parametrize(
    ("protocols", "repeats", "outputs", "keep", "varying"),
    [(1, 3, 1, 0.0, 0.0), (1, 3, 1, 0.0, 3.0), (4, 2, 2, 0.95, 0.0), (4, 3, 4, 0.0, 3.0)],
)
def test_p_values_of_noise_are_not_small(rng, protocols, repeats, outputs, keep, varying):
    count = 300
    least = [
        min(shared_p_values(drawn(rng, protocols, repeats, keep, varying, outputs=outputs)))
        for _ in range(count)
    ]
    for level in (0.05, 0.2):
        assert np.sum(np.array(least) <= level) <= binom.ppf(0.999, count, level)


def test_outputs_of_other_noise_do_not_hide_a_gap(rng):
    (varies,) = drawn(rng, 10, varying=0.5, shared=0.6, outputs=1)
    (white,) = drawn(rng, 10, outputs=1)
    assert shared_p_values([varies])[0] < 0.01
    found, other = shared_p_values([varies, white])
    assert found < 0.01
    assert other > 0.1


def test_a_gap_is_found_in_its_own_output(rng):
    for repeats, protocols, shared in ((3, 4, 4.0), (3, 10, 0.6)):
        found = [
            shared_p_values(drawn(rng, protocols, repeats, shared=shared), seed=k)
            for k in range(10)
        ]
        assert max(first for first, _ in found) < 0.01
        assert np.median([second for _, second in found]) > 0.3


def test_order_of_repeats_and_units_do_not_matter(rng):
    rows = rng.standard_normal((3, SAMPLES)) + 0.3
    one = repeated_misfit({"a": rows[0], "b": rows[1], "c": rows[2]})
    other = repeated_misfit({"c": 1e5 * rows[2], "a": 1e5 * rows[0], "b": 1e5 * rows[1]})
    assert other.shared == pytest.approx(1e10 * one.shared)
    assert other.noise == pytest.approx(1e10 * one.noise)


def test_exact_repeats_are_certain_and_no_gap_is_no_misfit():
    ones, zeros = np.ones(SAMPLES), np.zeros(SAMPLES)
    assert shared_p_values([[repeated_misfit({"a": ones, "b": ones})]])[0] == 0.0
    assert shared_p_values([[repeated_misfit({"a": zeros, "b": zeros})]])[0] == 1.0
