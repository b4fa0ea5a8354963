"""What is read off a sampled signal: figures of a step response, and the noise of the signal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pamsim.core.units import FloatArray
from pamsim.recordings.recording import Recording
from pamsim.recordings.signals import KINDS, Kind, SignalNames

_BAND = 0.02
"""Share of the travel within which a response counts as settled."""

_SECOND_DIFFERENCE = np.sqrt(6.0)  # of white noise, in its standard deviations
_MEDIAN_TO_SD = 1.4826


@dataclass(frozen=True)
class StepMetrics:
    """Figures of one step response, in the units of the response."""

    start: float  # first value
    final: float  # mean over the last 2 % of the record
    # From when on the response stays within 2 % of its travel of the final value [s]; NaN if it has
    # not settled by the last tenth of the record, or is still on its way then: a decay as over the
    # last three tenths would lead out of these 2 %.
    settling_time: float
    # Largest travel beyond the final value, before the time whose mean that is, as a share of the
    # travel [-]: what still goes on its way there, such as a ramp, has overshot nothing.
    overshoot: float
    reversal: float  # largest turn back against the direction of the step


def step_metrics(time: ArrayLike, response: ArrayLike) -> StepMetrics:
    """Figures of a step response (n,) in any unit; one without travel settles at once.

    Its times (n,) [s] increase from the step on.
    """
    t, y = np.asarray(time, dtype=float), np.asarray(response, dtype=float)
    end = max(1, len(y) // 50)
    start, final = float(y[0]), float(y[-end:].mean())
    travel = final - start
    if travel == 0.0:
        return StepMetrics(start, final, 0.0, 0.0, reversal=float(np.ptp(y)))
    forward, band = (y - start) * np.sign(travel), _BAND * abs(travel)
    last = int(np.max(np.flatnonzero(np.abs(y - final) > band), initial=-1)) + 1
    settled = last < 0.9 * len(t) and not _on_its_way(y, final, band)
    return StepMetrics(
        start=start,
        final=final,
        settling_time=float(t[last]) if settled else float("nan"),
        overshoot=max(0.0, float(forward[:-end].max() / abs(travel)) - 1.0),
        reversal=float(np.max(np.maximum.accumulate(forward) - forward)),
    )


def _on_its_way(y: FloatArray, final: float, band: float) -> bool:
    """Whether a response that decays as over its last three tenths ends outside a band."""
    tenth = len(y) // 10
    if not tenth:
        return False
    first, second, third = y[-3 * tenth :].reshape(3, tenth).mean(axis=1)
    earlier, later = second - first, third - second
    # Such a drift needs another record as long to leave the band; noise drifts as little.
    if abs(later) <= 0.1 * band or earlier * later < 0.0:
        return False
    if abs(later) >= abs(earlier):
        return True
    end = third + later**2 / (earlier - later)  # of a geometric series
    return bool(abs(end - final) > band)


def joint_figures(found: StepMetrics, kind: Kind) -> dict[str, float]:
    """Figures, found in SI, of one joint's step response by name, in the units of files."""
    return {
        f"start_{kind.suffix}": found.start * kind.scale,
        f"final_{kind.suffix}": found.final * kind.scale,
        "settling_s": found.settling_time,
        "overshoot_percent": 100.0 * found.overshoot,
    }


def step_figures(recording: Recording) -> dict[str, float]:
    """Figures of a complete step response of a rig, named as in `step_figure_units` [unit there].

    Of each joint start, final value, settling time and overshoot, and of each muscle pressure and
    tension at the end.
    """
    values: list[float] = []
    for kind, position in zip(recording.joints.values(), recording.positions.T, strict=True):
        values += joint_figures(step_metrics(recording.time, position), KINDS[kind]).values()
    for pressure, force in zip(recording.pressure[-1], recording.tension[-1], strict=True):
        values += [pressure * KINDS["pressure"].scale, force * KINDS["force"].scale]
    return dict(zip(step_figure_units(recording.names), map(float, values), strict=True))


def step_figure_units(names: SignalNames) -> dict[str, str]:
    """Name of each figure of a step response of a rig -> its unit."""
    units: dict[str, str] = {}
    for joint, kind in names.joints.items():
        own, shown = "" if names.short else f"{joint}_", KINDS[kind].shown
        figures = joint_figures(StepMetrics(0.0, 0.0, 0.0, 0.0, 0.0), KINDS[kind])
        units |= zip((own + name for name in figures), (shown, shown, "s", "%"), strict=True)
    for number, muscle in enumerate(names.muscles, start=1):
        for kind in ("pressure", "force"):
            owner = f"{kind}_{number}" if names.short else f"{muscle}_{kind}"
            units[f"final_{owner}_{KINDS[kind].suffix}"] = KINDS[kind].shown
    return units


def rough_noise(*signals: FloatArray, lag: int = 1) -> float:
    """Standard deviation of the noise of evenly sampled signals (n,) that share it [their unit].

    From second differences over a lag in samples, in which what is smooth over the lag all but
    cancels, by their median, which the few samples at a switching valve do not move. Noise that
    drifts more slowly than the lag is not seen; fewer than 2 lag + 1 samples give 0.
    """
    bends = [s[2 * lag :] - 2.0 * s[lag:-lag] + s[: -2 * lag] for s in signals]
    bend = np.abs(np.concatenate(bends))
    return _MEDIAN_TO_SD * float(np.median(bend)) / _SECOND_DIFFERENCE if len(bend) else 0.0
