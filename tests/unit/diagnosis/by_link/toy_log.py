"""The toy chain recorded once: one log, whose noise drifts and which has a variation of its own."""

import numpy as np
from scipy.signal import lfilter

from pamsim.diagnosis.by_link.limits import USUAL
from pamsim.diagnosis.by_link.units import parts_of_trials
from pamsim.inference.blocks import correlation_length
from pamsim.inference.coloured_noise import ArNoise, fit_ar_noise
from tests.unit.diagnosis.by_link.toy_chain import ARMLINK, ROWS, ToyChain

DRIFT = 30  # correlation time of half of the noise's variance, in samples
VARIES = "passive.stiffness"  # what differs from log to log looks like this


def drifting(rng, shape):
    """Noise of variance 1, half of which drifts."""
    keep = np.exp(-1.0 / DRIFT)
    drive = np.sqrt(1.0 - keep**2) * rng.normal(size=shape)
    drive[..., 0] = rng.normal(size=shape[:-1])
    drift = lfilter([1.0], [1.0, -keep], drive)
    return np.sqrt(0.5) * (drift + rng.normal(size=shape))


KNOWN = fit_ar_noise(list(drifting(np.random.default_rng(99), (20, 2000))))
GAP = correlation_length(KNOWN, 2000)


class ToyLog(ToyChain):
    """One log.

    Args:
        variation: size of what differs from log to log, in its standard deviation.
    """

    names = ("t0_0",)
    rows = 24 * ROWS
    white = False  # whether no more of the noise is known than its samples show

    def __init__(self, effects, planted=None, *, variation=0.0, **options):
        super().__init__(effects, planted, **options)
        self.stated += variation * self._varying()[:, 0]

    def noise(self):
        return ArNoise((), KNOWN.variance) if self.white else KNOWN

    def _noise(self, rng):
        return drifting(rng, (len(self.blocks), self.rows)).ravel()

    def _varying(self):
        return 0.5 * self._shape(VARIES, ARMLINK)[:, np.newaxis]

    def units(self, limits=USUAL, *, gap=GAP, assumed=1.0):
        varying = assumed * self._varying()
        return parts_of_trials(self, (), gap=gap, varying=varying, limits=limits)
