"""First calibration of models/mas20_arm: the numbers its params.toml calls identified.

Two least-squares fits in the engine itself. Static: hardening and slack point of the passive
spring and the tilt of the shaft, to the 21 distinct printed end positions. Dynamic: sonic
conductance and joint damping, to the step of the printed G2, on the large step without load.

    python scripts/first_calibration.py

Intervals are linearised 95 % intervals that take the residuals as independent; model error
dominates them, so read them as a lower bound on the doubt.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import t as student

from pamsim.engine.rig import Rig, load_rig
from pamsim.engine.simulate import simulate
from pamsim.store.printed import distinct_steps, mas20_models, mas20_steps
from pamsim.sysid.first_second_order import second_order_step
from pamsim.workflows.printed_steps import STARTS, printed_experiment

START = STARTS["vent"]
CONTRACTING_RESISTANCE = 280.498151
"""k/h [N]: -f of the published DMSP-20-200 constants (see params.toml)."""


def static_parameters(x: NDArray[np.float64]) -> dict[str, float]:
    """Name the unknowns of the static fit: hardening [-], slack contraction [-], tilt [rad]."""
    hardening, slack, tilt = map(float, x)
    return {
        "passive.stiffness": CONTRACTING_RESISTANCE * hardening,
        "passive.hardening": hardening,
        "passive.slack_contraction": slack,
        "body.rig.tilt": tilt,
    }


def dynamic_parameters(x: NDArray[np.float64]) -> dict[str, float]:
    """Name the unknowns of the dynamic fit: log conductance, log damping."""
    conductance, damping = (math.exp(value) for value in x)
    return {
        "valve.conductance_fill": conductance,
        "valve.conductance_exhaust": conductance,
        "joint.shaft.damping": damping,
    }


def static_residuals(rig: Rig, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Simulated minus printed end positions of the distinct rows [rad]."""
    changed = rig.with_parameters(static_parameters(x))
    ends = [
        simulate(changed, printed_experiment(step, START, sample_rate=20.0)).completed().angle[-1]
        for step in distinct_steps()
    ]
    return np.array(ends) - np.array([step.angle for step in distinct_steps()])


def dynamic_residuals(rig: Rig, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Normalised large step minus the step of the printed G2 [-]."""
    changed = rig.with_parameters(dynamic_parameters(x))
    run = simulate(changed, printed_experiment(mas20_steps()[0], START, sample_rate=100.0))
    response = run.completed().angle - run.angle[0]
    printed = mas20_models()["g2"]
    return response / response[-1] - second_order_step(run.time, printed["T1_s"], printed["T2_s"])


def interval(fit: Any, degrees: int) -> NDArray[np.float64]:
    """Half-widths of linearised 95 % intervals of a least-squares fit."""
    jacobian, residual = fit.jac, fit.fun
    variance = float(residual @ residual) / degrees
    spread = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)) * variance)
    return spread * student.ppf(0.975, degrees)


def main() -> None:
    """Fit, and print what params.toml states."""
    rig = load_rig("mas20_arm")
    static = least_squares(
        lambda x: static_residuals(rig, x),
        [88.0, -0.015, -0.08],
        x_scale=[20.0, 0.005, 0.05],
        diff_step=3e-3,
        max_nfev=12,
    )
    half = interval(static, len(static.fun) - 3)
    rms = math.degrees(math.sqrt(np.mean(static.fun**2)))
    print(f"static: RMS {rms:.3f} deg over {len(static.fun)} rows, {static.nfev} evaluations")
    print(f"  passive.stiffness {CONTRACTING_RESISTANCE * static.x[0]:.0f} N (k/h fixed)")
    for name, value, width, scale in zip(
        ("passive.hardening [1]", "passive.slack_contraction [1]", "body.rig.tilt [deg]"),
        static.x,
        half,
        (1.0, 1.0, math.degrees(1.0)),
        strict=True,
    ):
        print(f"  {name} {value * scale:.6g} +- {width * scale:.2g}")
    tuned = rig.with_parameters(static_parameters(static.x))
    dynamic = least_squares(
        lambda x: dynamic_residuals(tuned, x),
        np.log([0.06e-8, 0.7]),
        diff_step=1e-3,
        max_nfev=20,
    )
    half = interval(dynamic, len(dynamic.fun) - 2)
    print(f"dynamic: largest deviation from G2 {100 * np.max(np.abs(dynamic.fun)):.2f} %")
    for name, value, width, scale in zip(
        ("conductance [dm^3/(s bar)]", "joint.shaft.damping [N m s/rad]"),
        np.exp(dynamic.x),
        half,
        (1e8, 1.0),
        strict=True,
    ):
        print(f"  {name} {value * scale:.4g} +- {value * width * scale:.2g}")


if __name__ == "__main__":
    main()
