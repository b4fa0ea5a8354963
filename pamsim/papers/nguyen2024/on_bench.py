"""Nguyen 2024 on the bench: the slow stroke on shut-in air, and cycles from 0.05 to 50 Hz."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from pamsim.core.units import PA_PER_BAR, FloatArray
from pamsim.engine.rig import Rig
from pamsim.papers.bench_experiments import bench, stretched
from pamsim.papers.claim import printed_values
from pamsim.papers.nguyen2024.fractional_reference import complex_stiffness
from pamsim.papers.nguyen2024.numbers import MILLIMETRE, PERCENT, element, muscle, omega, value
from pamsim.physics.air import ATMOSPHERE
from pamsim.physics.braid import volume, volume_slope

_AMPLITUDE = 2.0 * MILLIMETRE
"""Of the cycles, about nominal length, where the element starts relaxed; it is linear."""
_PERIODS, _STEPS = 12, 400
"""Cycles of a run, of which the last is read, and time steps of a cycle."""
_SAMPLES = 200  # of a cycle; as a polygon its loop loses 0.02 % of its area
_SLOW_STEP = 5e-3  # time step of the slow stroke [s]
_WIDE = (0.05, 0.16, 0.5, 1.6, 5.0, 16.0, 50.0)
"""Frequencies over three decades [Hz]."""
_SHOWN = (0.05, 1.6, 50.0)


def bench_curves() -> Mapping[str, Any]:
    """The engine beside (2) to (5) on a slow stroke, and beside (9) over frequency.

    Returns:
        ``stroke``: see `slow_stroke`; ``frequency_hz`` (n,); ``area_mj`` of the engine and of
        (9), (n,) each; ``area_off_percent``, ``stiffness_off_percent``: largest distances of area
        and dynamic stiffness; ``loops``: frequency -> displacement [mm], force of the engine and
        by (9) [N], (m,) each; ``width_mm``: frequency of the second study case -> width at zero
        force and 125 N, engine and (15).
    """
    rig = bench("nguyen2024")
    cycles = {f: cycle(rig, f) for f in (*_WIDE, *_printed_frequencies())}
    exact = {f: complex_stiffness(omega(f), *element()) for f in cycles}
    square = math.pi * _AMPLITUDE**2
    area = np.array([[cycles[f]["area"], square * exact[f].imag] for f in _WIDE]).T
    stiffness = [abs(cycles[f]["stiffness"]) / abs(exact[f]) - 1.0 for f in _WIDE]
    force = value("second_case_amplitude")
    return {
        "stroke": slow_stroke(rig),
        "frequency_hz": np.array(_WIDE),
        "area_mj": {"engine": 1e3 * area[0], "law": 1e3 * area[1]},
        "area_off_percent": 100.0 * float(np.max(np.abs(area[0] / area[1] - 1.0))),
        "stiffness_off_percent": 100.0 * float(np.max(np.abs(stiffness))),
        "loops": {f"{f:g} Hz": _beside(cycles[f], exact[f]) for f in _SHOWN},
        "width_mm": {
            f"{f:g} Hz": [
                -2.0 * force * (1.0 / found).imag / MILLIMETRE
                for found in (cycles[f]["stiffness"], exact[f])
            ]
            for f in _printed_frequencies()
        },
    }


def cycle(rig: Rig, frequency: float) -> Mapping[str, Any]:
    """Last of several imposed cycles at the printed pressure.

    Args:
        rig: the bench.
        frequency: [Hz].

    Returns:
        ``displacement`` (n,) [m] and ``rubber`` (n,) [N], the tension less that of the air by (3);
        ``area``: work lost in a cycle by tension and displacement [J]; ``stiffness``: complex, of
        the first harmonic [N/m].
    """
    count = _PERIODS * _SAMPLES
    time = np.arange(count + 1) / (frequency * _SAMPLES)
    braid, pressure = muscle(), value("test_pressure") * PA_PER_BAR
    nominal = braid.nominal_length
    x = _AMPLITUDE * np.sin(omega(frequency) * time)
    run = stretched(rig, time, -x / nominal, pressure, timestep=1.0 / (frequency * _STEPS))
    last = slice(count - _SAMPLES, None)
    found, tension = -nominal * run.contraction[last], run.tension[last]
    rubber = tension - np.array([_air_force(pressure, nominal + shift) for shift in found])
    turn = np.exp(-2j * np.pi * np.arange(_SAMPLES) / _SAMPLES)
    return {
        "displacement": found,
        "rubber": rubber,
        "area": float(np.sum(0.5 * (tension[1:] + tension[:-1]) * np.diff(found))),
        "stiffness": complex(np.sum(rubber[:-1] * turn) / np.sum(found[:-1] * turn)),
    }


def slow_stroke(rig: Rig) -> Mapping[str, Any]:
    """The 60 mm at 0.6 mm/s with the air shut in at 3.7 bar, without the rubber.

    Args:
        rig: the bench; its operator is switched off.

    Returns:
        ``length_mm`` (n,); ``pressure_bar`` and ``force_n`` (n,) each of the engine and by (2)
        with (4) and by (5); ``pressure_off_bar``, ``force_off_n``: largest distances.
    """
    braid = muscle()
    nominal, shape = braid.nominal_length, (braid.diameter, braid.fibre_angle)
    start = value("slow_contraction") * PERCENT
    lasts = value("slow_shortening") / value("slow_speed")
    time = np.linspace(0.0, lasts, 201)
    pressure = value("slow_pressure") * PA_PER_BAR
    air = rig.with_parameters({"hysteresis.force": 0.0})
    contraction = start * (1.0 - time / lasts)
    run = stretched(air, time, contraction, pressure, sealed=True, timestep=_SLOW_STEP)
    length = (1.0 - run.contraction) * nominal
    inside = np.array([volume(float(each), nominal, *shape) for each in length])
    isothermal = (pressure + ATMOSPHERE) * inside[0] / inside - ATMOSPHERE
    pairs = zip(isothermal.tolist(), length.tolist(), strict=True)
    tension = np.array([_air_force(*pair) for pair in pairs])
    exact = tension - tension[0]
    force = run.tension - run.tension[0]
    return {
        "length_mm": length / MILLIMETRE,
        "pressure_bar": {"engine": run.pressure / PA_PER_BAR, "law": isothermal / PA_PER_BAR},
        "force_n": {"engine": force, "law": exact},
        "pressure_off_bar": float(np.max(np.abs(run.pressure - isothermal))) / PA_PER_BAR,
        "force_off_n": float(np.max(np.abs(force - exact))),
    }


def _printed_frequencies() -> tuple[float, ...]:
    return printed_values("nguyen2024", "second_case_frequencies")


def _air_force(pressure: float, length: float) -> float:
    """(3): -p dV/dl [N], gauge pressure [Pa] and length [m]."""
    braid = muscle()
    return -pressure * volume_slope(length, braid.nominal_length, braid.diameter, braid.fibre_angle)


def _beside(found: Mapping[str, Any], exact: complex) -> Mapping[str, FloatArray]:
    turn = 2.0 * np.pi * np.arange(_SAMPLES + 1) / _SAMPLES
    force = _AMPLITUDE * abs(exact) * np.sin(turn + math.atan2(exact.imag, exact.real))
    return {
        "displacement_mm": found["displacement"] / MILLIMETRE,
        "force_n": found["rubber"] - found["rubber"][:-1].mean(),
        "law_n": force,
    }
