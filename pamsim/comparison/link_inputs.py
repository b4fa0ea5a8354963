"""Measured signals as inputs of single links: smoothed, and freed of the instruments' errors.

Imposed as they were read, a motion and a pressure would bring their noise along: at 100 Hz, noise
of 0.05 deg is a rate of 5 deg/s whose sign changes at every second sample, and every change moves
friction and hysteresis on.

The smoothing is a cubic regression spline. FITPACK puts knots where the signal bends (Dierckx,
Curve and Surface Fitting with Splines, 1993, chapter 5): few in a hold, many where a valve opens.
How many there are is not tuned. Of the splines on offer the one with the least estimated risk is
taken, Mallows' C_p (Technometrics 15, 1973): squared residual over the noise's variance plus twice
the number of coefficients. That knots are placed where the signal asks for them is not counted: too
little smoothing is noise, which repeats show, too much is an error that they share. The noise is
what the signal itself shows from sample to sample, so that slower drift is imposed as motion. A hum
that would be taken for more noise is taken off first, and wrong readings, into which a spline would
bend.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.interpolate import make_lsq_spline, splrep

from pamsim.comparison.experiments import as_read
from pamsim.comparison.links import LinkRun
from pamsim.core.units import FloatArray
from pamsim.engine.external import passable
from pamsim.engine.rig import Rig
from pamsim.inference.clean_signal import without_hum, without_spikes
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.sensors import ahead_of_lag, encoder_offset
from pamsim.recordings.signals import IMPOSED
from pamsim.recordings.start_pressures import resting_rows, start_pressures
from pamsim.recordings.step_metrics import rough_noise
from pamsim.recordings.trial import Trial

_DEGREE = 3  # of the spline: the least whose rate has no corners

_SHARES = (1.0, 0.85, 0.7, 0.5)
"""Mean squared residuals of the splines on offer, in variances of the noise: from that of the
noise itself down to that of a coefficient for every second sample."""

_PIECE, _OVERLAP = 1000, 100
"""Samples of a long signal that one spline smooths, and those at either side that it shares with
the next: FITPACK takes a time that grows with the square of the samples, and what lies some knots
away has no influence."""

_UNIFORM = np.sqrt(12.0)  # of a uniform distribution, in its standard deviations


def sample_noise(values: FloatArray) -> float:
    """Standard deviation of evenly sampled values (n,) from one to the next, rounding included."""
    return max(rough_noise(values), rounding_noise(values))


def rounding_noise(values: FloatArray) -> float:
    """Standard deviation of the rounding of values (n,); a reading in steps may not change."""
    # Neighbouring values of a converter are a step apart, those of a finer record are not.
    step = float(np.min(np.diff(np.unique(values)), initial=np.inf))
    return step / _UNIFORM if np.isfinite(step) else 0.0


def smoothed(time: FloatArray, values: FloatArray) -> FloatArray:
    """A measured signal (n,) without the hum, wrong readings and noise that its samples show.

    Times (n,) increase [s], values are in any unit. They are returned as they are if they show no
    noise, or are too few for a spline.
    """
    noise = rounding_noise(values)  # before a hum is taken off, which leaves no steps
    values = without_hum(values)
    noise = max(rough_noise(values), noise)
    values = without_spikes(values, noise)
    # Noise below rounding would ask for a knot at every sample.
    if values.size <= 2 * (_DEGREE + 1) or not noise > 1e-12 * float(np.ptp(values)):
        return values
    found = np.zeros(values.size)
    edges = np.linspace(0, values.size, math.ceil(values.size / _PIECE) + 1).astype(int).tolist()
    for begin, end in pairwise(edges):
        rows = slice(max(begin - _OVERLAP, 0), end + _OVERLAP)
        share = np.interp(
            np.arange(values.size)[rows],
            [begin - _OVERLAP, begin + _OVERLAP, end - _OVERLAP, end + _OVERLAP],
            [float(begin == 0), 1.0, 1.0, float(end == values.size)],
        )
        found[rows] += share * _spline(time[rows], values[rows], noise)
    return found


def _spline(time: FloatArray, values: FloatArray, noise: float) -> FloatArray:
    weight = np.full(values.size, 1.0 / noise)
    best, least = values, 2.0 * values.size  # as read: no residual, a coefficient for each sample
    for share in _SHARES:
        (knots, _, _), *_ = splrep(
            time, values, w=weight, k=_DEGREE, s=share * values.size, full_output=True, quiet=True
        )
        fitted = make_lsq_spline(time, values, knots, _DEGREE)(time)
        coefficients = knots.size - _DEGREE - 1
        risk = float(np.sum((weight * (values - fitted)) ** 2)) + 2.0 * coefficients
        if risk < least:
            best, least = fitted, risk
    return best


@dataclass(frozen=True, kw_only=True)
class LinkInputs:
    """Measured inputs of a trial, smoothed, with the errors of the rig's instruments."""

    pressures: Mapping[int, FloatArray]  # number of the muscle -> (n,) [Pa]
    positions: Mapping[str, FloatArray]  # joint -> (n,) [rad or m]
    noise: Mapping[str, float]  # joint -> standard deviation that was smoothed away [rad or m]
    # The same of the trial's lead-in; None without one, or if it was not measured
    before: LinkInputs | None = None

    def start(self, trial: Trial) -> FloatArray:
        """Pressures (m,) at which the muscles rest before the trial, or before its lead-in [Pa]."""
        if self.before is None:
            trial = replace(trial, lead_in=None)
        start = start_pressures(trial)
        if trial.lead_in is None and resting_rows(trial) > 1:
            return start
        first = self if self.before is None else self.before
        for muscle, values in first.pressures.items():
            start[muscle] = max(values[0], 0.0)
        return start


def inputs_of_runs(rig: Rig, runs: Sequence[tuple[Trial, LinkRun]]) -> dict[str, LinkInputs]:
    """Name of each trial to its inputs; empty where none of its runs imposes what was measured."""
    imposing = {
        trial.name
        for trial, run in runs
        if run.pressures or run.moved or "measured" in trial.drives.muscles
    }
    nothing = LinkInputs(pressures={}, positions={}, noise={})
    trials = {trial.name: trial for trial, _ in runs}
    return {n: link_inputs(rig, t) if n in imposing else nothing for n, t in trials.items()}


def link_inputs(rig: Rig, trial: Trial) -> LinkInputs:
    """The pressures and positions of a trial, measured or imposed, that single links are given."""
    lead = trial.lead_in
    if lead is None or trial.measured.keys() - lead.measured.keys():
        return _smoothed_inputs(rig, trial)
    whole = _smoothed_inputs(rig, trial.with_lead_in)
    count = lead.time.size
    before, own = (
        replace(
            whole,
            pressures={number: values[rows] for number, values in whole.pressures.items()},
            positions={joint: values[rows] for joint, values in whole.positions.items()},
        )
        for rows in (slice(count), slice(count, None))
    )
    return replace(own, before=before)


def _smoothed_inputs(rig: Rig, trial: Trial) -> LinkInputs:
    pressures: dict[int, FloatArray] = {}
    for muscle, kind in enumerate(trial.drives.muscles):
        channel = trial.pressure_channels[muscle]
        if kind == "measured":
            pressures[muscle] = smoothed(trial.time, trial.command[:, muscle])
        elif channel in trial.measured:
            pressures[muscle] = smoothed(trial.time, trial.measured[channel])
    driven = trial.command[:, trial.muscles :].T
    given = dict(zip(trial.drives.joints, driven, strict=True))
    positions: dict[str, FloatArray] = {}
    noise: dict[str, float] = {}
    for joint, kind in rig.joints.items():
        channel = rig.names.joint_channel(joint)
        read = given[joint] if joint in trial.drives.imposed else trial.measured.get(channel)
        if read is None:
            continue
        low = 0.0
        if rig.sensor is not None and kind == "angle":
            turned = channel in trial.turned
            low = encoder_offset(read, rig.sensor.encoder_increments, turned=turned)
        noise[joint] = sample_noise(read)
        positions[joint] = smoothed(trial.time, read) - low
    return LinkInputs(pressures=pressures, positions=positions, noise=noise)


def with_true_inputs(rig: Rig, experiment: Experiment) -> Experiment:
    """An experiment with the true signals, given what the rig's sensors read.

    Imposed signals are smooth, so that the lag of a sensor can be taken off them. A motion is
    imposed as far beyond a joint's stops as these give way.
    """
    experiment = as_read(rig, experiment)
    value, first = experiment.command_value.copy(), len(experiment.drives.muscles)
    lags: dict[str, float] = {}
    if rig.sensor is not None:
        angles = dict.fromkeys(IMPOSED, rig.sensor.angle_lag)
        lags = {"measured": rig.sensor.pressure_lag, **angles}
    for column, kind in enumerate(experiment.drives.kinds):
        lag = lags.get(kind, 0.0)
        value[:, column] = ahead_of_lag(experiment.command_time, value[:, column], lag)
    for column, joint in enumerate(experiment.drives.joints, start=first):
        if joint in experiment.drives.imposed:
            value[:, column] = np.clip(value[:, column], *passable(rig.model, joint))
    return replace(experiment, command_value=value)
