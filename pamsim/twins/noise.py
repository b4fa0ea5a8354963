"""What makes trials of one rig differ: sensor noise, and parameters that vary between trials."""

from __future__ import annotations

import dataclasses

import numpy as np

from pamsim.core.units import DEG_PER_RAD, FloatArray
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.physics.record import has_parameter
from pamsim.recordings.recording import Recording
from pamsim.recordings.stated_noise import drifting_noise

ANGLE_NOISE, PRESSURE_NOISE, FORCE_NOISE = 0.05 / DEG_PER_RAD, 400.0, 1.5
"""Standard deviations of sensor noise [rad, Pa, N]: an encoder of 2500 increments, transducers of
1 MPa with 12 bits, load cells of 2 kN."""

_JOINT_NOISE = {"angle": ANGLE_NOISE, "position": 1e-4}  # [rad, m]
_MACHINE_NOISE = {"angle": 2e-5, "position": 2e-6}
"""Of a joint whose motion a machine imposes, and reads, in steps of micrometres [rad, m]."""
_EFFORT_NOISE = {"angle": 0.05, "position": FORCE_NOISE}  # [N m, N]

DRIFT = 0.3
"""Correlation time of coloured noise [s]."""

# Temperature, seating of the muscle and supply differ a little from one trial to the next.
_VARYING = (
    "force.scale",
    "passive.stiffness",
    "valve.conductance_fill",
    "valve.conductance_exhaust",
)


def with_variation(rig: Rig, rng: np.random.Generator, variation: float) -> Rig:
    """The rig as it is in one trial; all muscles vary together, differences between them stay.

    The factors that ``rng`` draws have the relative standard deviation ``variation``.
    """
    factors = 1.0 + variation * rng.standard_normal(len(_VARYING))
    values = {
        f"{muscle}:{name}": rig_parameter(rig, f"{muscle}:{name}").value * factor
        for name, factor in zip(_VARYING, factors, strict=True)
        for muscle, own in rig.muscles.items()
        if has_parameter(own, name)  # bellows and pistons have neither braid nor tube
    }
    return rig.with_parameters(values) if variation else rig


def with_noise(
    run: Recording, rng: np.random.Generator, factor: float, *, coloured: bool
) -> Recording:
    """A recording with noise on joints, pressures and forces.

    All standard deviations are multiplied by ``factor``. Half of ``coloured`` noise drifts, with a
    correlation time of `DRIFT`.
    """
    rate = float(run.meta["sample_hz"])

    def noise(shape: tuple[int, ...], sd: float | FloatArray) -> FloatArray:
        return factor * sd * _unit_noise(rng, shape, coloured, rate)

    imposed = run.drives.imposed
    sizes = np.array(
        [(_MACHINE_NOISE if j in imposed else _JOINT_NOISE)[k] for j, k in run.joints.items()]
    )
    return dataclasses.replace(
        run,
        positions=run.positions + noise(run.positions.shape, sizes),
        pressure=run.pressure + noise(run.pressure.shape, PRESSURE_NOISE),
        tension=run.tension + noise(run.tension.shape, FORCE_NOISE),
        effort={
            joint: values + noise(values.shape, _EFFORT_NOISE[run.joints[joint]])
            for joint, values in run.effort.items()
        },
    )


def _unit_noise(
    rng: np.random.Generator, shape: tuple[int, ...], coloured: bool, rate: float
) -> FloatArray:
    """Noise of unit variance along the first axis."""
    white = rng.standard_normal(shape)
    if not coloured:
        return white
    drift = drifting_noise(rng, shape, float(np.exp(-1.0 / (rate * DRIFT))))
    return np.sqrt(0.5) * (white + drift)
