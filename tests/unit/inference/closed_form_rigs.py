"""Simulators in closed form that stand in for a rig where calibration is tested."""

import numpy as np
from scipy.signal import lfilter

from pamsim.inference.free_parameter import FreeParameter
from pamsim.inference.simulator_fit import ResidualBlock

TIME = np.arange(100) / 40.0
TRUTH = np.array([2.0, 1.5])


def free(name, start=1.0, low=0.1, high=10.0, **rest):
    return FreeParameter(name=name, unit="1", start=start, low=low, high=high, **rest)


DECAY = (free("gain", 1.0, scale="log"), free("rate", 4.0))


def decay(values, size=1.0):
    return size * values[0] * np.exp(-values[1] * TIME)


def coloured(rng, count, correlation):
    """AR(1) noise of unit variance."""
    e = rng.standard_normal(count) * np.sqrt(1.0 - correlation**2)
    e[0] = rng.standard_normal()
    return lfilter([1.0], [1.0, -correlation], e)


class Rig:
    """Trials of a model: batched, counted, as `calibrate` wants its simulator.

    trials: (name, protocol, channel, curve(values), measured) each.
    """

    def __init__(self, trials, interval=0.025, diverges=lambda values: False, noise_sd=None):
        self.trials, self.interval, self.diverges = trials, interval, diverges
        self.noise_sd = noise_sd
        self.batches = []

    def __call__(self, sets):
        self.batches.append(len(sets))
        return [None if self.diverges(v) else self.blocks(v) for v in sets]

    def blocks(self, values):
        return [
            ResidualBlock(
                trial=trial,
                protocol=protocol,
                channel=channel,
                residual=curve(values) - measured,
                sample_interval=self.interval,
                noise_sd=self.noise_sd,
            )
            for trial, protocol, channel, curve, measured in self.trials
        ]


def decay_rig(noise, protocols=("a", "b", "c"), truth=TRUTH, **rest):
    """One decay per protocol entry, from another height for each protocol.

    noise: one array per trial.
    """
    heights = {name: 1.0 + 0.5 * k for k, name in enumerate(dict.fromkeys(protocols))}
    trials = []
    for k, (protocol, e) in enumerate(zip(protocols, noise, strict=True)):
        size = heights[protocol]
        measured = decay(truth, size) + e
        trials.append((f"t{k}", protocol, "angle", lambda v, s=size: decay(v, s), measured))
    return Rig(trials, **rest)


def line_rig(rows, measured, interval=None, noise_sd=0.1):
    """A simulator linear in its parameters: rows @ values."""
    rows = np.asarray(rows, dtype=float)
    trial = ("table", "table", "force", lambda v: rows @ v, np.asarray(measured))
    return Rig([trial], interval=interval, noise_sd=noise_sd)
