"""The paper's models beside the simulation's: (23) on the tables, G1 and G2 on one step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from pamsim.core.units import DEG_PER_RAD, PA_PER_BAR, PA_PER_KPA, FloatArray
from pamsim.linear.first_second_order import first_order_step, second_order_step, unit_step
from pamsim.linear.step_identification import StepIdentification
from pamsim.linear.transfer_function import continuous, step_response
from pamsim.recordings.printed import distinct_steps, mas20_models
from pamsim.recordings.recording import Recording

_CURVE_POINTS = 301


def odd_exponential_basis(x: FloatArray) -> FloatArray:
    """Factors of a0, a1, a2 in (17), continued as an odd function (Matiskova 2021, (17), (22)).

    Args:
        x: (n,) pressure difference over the pressure that counts as 1 [-].

    Returns:
        (n, 3): sign(x) times 1, exp(-abs(x)), abs(x) exp(-abs(x)).
    """
    size = np.abs(x)
    decay = np.exp(-size)
    return np.sign(x)[:, np.newaxis] * np.stack([np.ones_like(size), decay, size * decay], axis=1)


def static_angle(pressure_difference: FloatArray, scale: float) -> FloatArray:
    """Equation (23) of Matiskova 2021, continued as an odd function.

    Args:
        pressure_difference: (n,) p1 - p2 [Pa].
        scale: pressure that counts as 1 in the equation [Pa].

    Returns:
        (n,) angle [deg].
    """
    law = mas20_models()["static"]
    coefficients = np.array([law["a0_deg"], law["a1_deg"], law["a2_deg"]])
    return odd_exponential_basis(pressure_difference / scale) @ coefficients


def static_characteristic() -> dict[str, Any]:
    """Equation (23) against the printed tables, read in bar and with the scale that fits best.

    Returns:
        JSON-safe curves and RMS misfits, pressures in kPa and angles in deg.
    """
    steps = distinct_steps()
    difference = np.array([step.pressure[0] - step.pressure[1] for step in steps])
    measured = np.array([step.angle for step in steps]) * DEG_PER_RAD

    def rms(scale: float) -> float:
        return float(np.sqrt(np.mean((static_angle(difference, scale) - measured) ** 2)))

    best = minimize_scalar(rms, bounds=(0.5 * PA_PER_BAR, 5.0 * PA_PER_BAR), method="bounded")
    curve = np.linspace(-500.0, 500.0, _CURVE_POINTS) * PA_PER_KPA
    return {
        "p_svd_kpa": (curve / PA_PER_KPA).tolist(),
        "eq23_bar_deg": static_angle(curve, PA_PER_BAR).tolist(),
        "eq23_scaled_deg": static_angle(curve, float(best.x)).tolist(),
        "scale_kpa": float(best.x) / PA_PER_KPA,
        "rms_bar_deg": rms(PA_PER_BAR),
        "rms_scaled_deg": float(best.fun),
    }


def model_responses(
    recording: Recording, identified: StepIdentification
) -> Mapping[str, list[float] | None]:
    """Unit steps of every model beside the simulated one (the paper's Figure 9).

    The identified models answer through python-control, the paper's through the closed form.

    Args:
        recording: the large step that was identified.
        identified: its models.

    Returns:
        JSON-safe curves on a common grid; None where an ARX fit has no real time constants.
    """
    keep = slice(None, None, max(1, len(recording.time) // _CURVE_POINTS))
    time = recording.time[keep]
    travelled = recording.angle - recording.angle[0]
    printed = mas20_models()
    return {
        "time_s": time.tolist(),
        "simulated": (travelled[keep] / identified.final_value).tolist(),
        "g1_output_error": step_response(continuous(identified.g1.output_error), time).tolist(),
        "g2_output_error": step_response(continuous(identified.g2.output_error), time).tolist(),
        "g1_arx": _lags(identified.g1.arx_unit_gain.time_constants, time),
        "g2_arx": _lags(identified.g2.arx_unit_gain.time_constants, time),
        "g1_paper": first_order_step(time, printed["g1"]["T_s"]).tolist(),
        "g2_paper": second_order_step(time, printed["g2"]["T1_s"], printed["g2"]["T2_s"]).tolist(),
    }


def _lags(constants: tuple[float, ...], time: FloatArray) -> list[float] | None:
    return unit_step(time, constants).tolist() if constants else None
