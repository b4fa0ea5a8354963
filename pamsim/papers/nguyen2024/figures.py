"""Curves of Nguyen 2024: loops of its element; on the bench the slow stroke and cycles."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from pamsim.core.units import PA_PER_BAR, FloatArray
from pamsim.engine.rig import Rig
from pamsim.papers.bench_experiments import bench, stretched
from pamsim.papers.nguyen2024.geometry import (
    MILLIMETRE,
    element,
    isothermal,
    muscle,
    omega,
    slope_at,
    slow_start,
    value,
    values,
)
from pamsim.papers.nguyen2024.loop import complex_stiffness, figure_elements, harmonic

_LOOP = np.linspace(0.0, 2.0 * np.pi, 241)  # one period, closed
_AMPLITUDE = 2.0 * MILLIMETRE
"""Of the cycles, about nominal length, where the element starts relaxed; it is linear."""
_PERIODS, _STEPS = 12, 400
"""Cycles of a run, of which the last is read, and time steps of a cycle."""
_SAMPLES = 200  # of a cycle; as a polygon its loop loses 0.02 % of its area
_SLOW_STEP = 5e-3  # time step of the slow stroke [s]
_WIDE = (0.05, 0.16, 0.5, 1.6, 5.0, 16.0, 50.0)
"""Frequencies over three decades [Hz]."""
_SHOWN = (0.05, 1.6, 50.0)


def _fractional_loop(
    amplitude: float, w: float, law: tuple[float, float, float]
) -> tuple[FloatArray, FloatArray]:
    """Displacement [mm] and force [N] of one period under F = F0 sin(w t)."""
    compliance = 1.0 / complex_stiffness(w, *law)
    x = amplitude * abs(compliance) * np.sin(_LOOP + math.atan2(compliance.imag, compliance.real))
    return x / MILLIMETRE, amplitude * np.sin(_LOOP)


def curves() -> Mapping[str, Any]:
    """Loops of Figures 3, 11 and 12, displacement [mm] and force [N], and what they come down to.

    The loss is half the width of the loop at zero force over its amplitude.
    """
    frequency = np.linspace(1.0, 10.0, 91)
    complex_values = np.array([complex_stiffness(omega(float(f)), *element()) for f in frequency])
    first, second = omega(value("first_case_frequency")), value("second_case_amplitude")
    return {
        "by_order": {
            f"{law[0]:g}": _fractional_loop(
                value("figure_amplitude"), value("figure_frequency"), law
            )
            for law in figure_elements()
        },
        "by_amplitude": {
            f"{force:g} N": _fractional_loop(force, first, element())
            for force in values("first_case_amplitudes")
        },
        "by_frequency": {
            f"{f:g} Hz": _fractional_loop(second, omega(f), element())
            for f in values("second_case_frequencies")
        },
        "frequency_hz": frequency,
        "stiffness_n_per_m": np.abs(complex_values),
        "loss_percent": 100.0 * np.sin(np.angle(complex_values)),
        "bench": bench_curves(),
    }


def bench_curves() -> Mapping[str, Any]:
    """The engine beside (2) to (5) on a slow stroke, and beside (9) over frequency.

    What is called ``off`` is the largest distance of the two; ``width_mm`` is that at zero force
    and 125 N, of the engine and by (15), for each frequency of the second study case.
    """
    rig, printed = bench("nguyen2024"), values("second_case_frequencies")
    cycles = {f: cycle(rig, f) for f in (*_WIDE, *printed)}
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
            for f in printed
        },
    }


def cycle(rig: Rig, frequency: float) -> Mapping[str, Any]:
    """Last of several imposed cycles on the bench at the printed pressure and a frequency [Hz].

    Returns:
        ``displacement`` (n,) [m] and ``rubber`` (n,) [N], the tension less that of the air by (3);
        ``area``: work lost in a cycle by tension and displacement [J]; ``stiffness``: complex, of
        the first harmonic [N/m].
    """
    count = _PERIODS * _SAMPLES
    time = np.arange(count + 1) / (frequency * _SAMPLES)
    nominal, pressure = muscle().nominal_length, value("test_pressure") * PA_PER_BAR
    x = _AMPLITUDE * np.sin(omega(frequency) * time)
    run = stretched(rig, time, -x / nominal, pressure, timestep=1.0 / (frequency * _STEPS))
    last = slice(count - _SAMPLES, None)
    found, tension = -nominal * run.contraction[last], run.tension[last]
    # (3): -p dV/dl.
    rubber = tension - np.array([-pressure * slope_at(nominal + shift) for shift in found])
    return {
        "displacement": found,
        "rubber": rubber,
        "area": float(np.trapezoid(tension, found)),
        "stiffness": harmonic(rubber[:-1]) / harmonic(found[:-1]),
    }


def slow_stroke(rig: Rig) -> Mapping[str, Any]:
    """The 60 mm at 0.6 mm/s with the air shut in at 3.7 bar, without the rubber.

    Pressures are those of the engine and by (2) with (4), forces by (5).
    """
    pressure, start = slow_start()
    lasts = value("slow_shortening") / value("slow_speed")
    time = np.linspace(0.0, lasts, 201)
    air = rig.with_parameters({"hysteresis.force": 0.0})
    contraction = start * (1.0 - time / lasts)
    run = stretched(air, time, contraction, pressure, sealed=True, timestep=_SLOW_STEP)
    length = (1.0 - run.contraction) * muscle().nominal_length
    by_law = np.array([isothermal(float(each)) for each in length])
    tension = np.array([-p * slope_at(at) for p, at in zip(by_law, length.tolist(), strict=True)])
    exact, force = tension - tension[0], run.tension - run.tension[0]
    return {
        "length_mm": length / MILLIMETRE,
        "pressure_bar": {"engine": run.pressure / PA_PER_BAR, "law": by_law / PA_PER_BAR},
        "force_n": {"engine": force, "law": exact},
        "pressure_off_bar": float(np.max(np.abs(run.pressure - by_law))) / PA_PER_BAR,
        "force_off_n": float(np.max(np.abs(force - exact))),
    }


def _beside(found: Mapping[str, Any], exact: complex) -> Mapping[str, FloatArray]:
    turn = 2.0 * np.pi * np.arange(_SAMPLES + 1) / _SAMPLES
    force = _AMPLITUDE * abs(exact) * np.sin(turn + math.atan2(exact.imag, exact.real))
    return {
        "displacement_mm": found["displacement"] / MILLIMETRE,
        "force_n": found["rubber"] - found["rubber"][:-1].mean(),
        "law_n": force,
    }
