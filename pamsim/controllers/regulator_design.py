"""LQG design on G2: state feedback with integral action, and the Kalman filter that feeds it.

G2 is sampled under a held input; the integral of the error is a third state. Both Riccati equations
are solved by python-control (Anderson and Moore, Optimal Control, 1990).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import control
import numpy as np

from pamsim.controllers.sampled_controller import Row, rows
from pamsim.controllers.second_order_model import SecondOrderModel

_control: Any = control  # carries no types


@dataclass(frozen=True, kw_only=True)
class RegulatorDesign:
    """What a sampled LQG regulator of G2 needs, as plain numbers.

    States are the output's and its rate's distance from the operating point.

    Attributes:
        period: between two samples [s].
        model: G2.
        transition: (2, 2) A of ``x+ = A x + B u``.
        input: (2,) B.
        feedback: (2,) gains on the state.
        integral_gain: on the sum of the error times the period.
        correction: (2,) Kalman gains: state += gains x (measured less expected output).
        poles: of the closed loop of state feedback and integral.
    """

    period: float
    model: SecondOrderModel
    transition: tuple[Row, ...]
    input: Row
    feedback: Row
    integral_gain: float
    correction: Row
    poles: tuple[complex, ...]


def design_regulator(
    model: SecondOrderModel,
    *,
    period: float,
    largest_error: float,
    largest_input: float,
    integral_time: float = 1.0,
    input_noise: float,
    output_noise: float,
) -> RegulatorDesign:
    """Design the regulator; weights by Bryson's rule.

    Args:
        model: G2.
        period: between two samples [s].
        largest_error: of the output that is as bad as the largest input [output unit].
        largest_input: [input unit].
        integral_time: over which that error may last at the same cost [s].
        input_noise: standard deviation of what disturbs the input [input unit].
        output_noise: of the measured output [output unit].
    """
    a, b = model.matrices()
    plant = _control.ss(a, b, [[1.0, 0.0]], 0.0)
    sampled = _control.sample_system(plant, period, method="zoh")
    transition, into = np.asarray(sampled.A), np.asarray(sampled.B)
    # z+ = z + period (reference - output): the reference is no state of the design.
    augmented = np.block([[transition, np.zeros((2, 1))], [np.array([[-period, 0.0, 1.0]])]])
    driven = np.vstack([into, [[0.0]]])
    # A rate costs nothing of its own.
    cost = np.diag([largest_error**-2.0, 0.0, (largest_error * integral_time) ** -2.0])
    gains, _, poles = _control.dlqr(augmented, driven, cost, [[largest_input**-2.0]])
    correction, _, _ = _control.dlqe(
        transition, into, [[1.0, 0.0]], [[input_noise**2.0]], [[output_noise**2.0]]
    )
    # python-control's gains are of the prediction; the filter's are those before the transition.
    correction = np.linalg.solve(transition, np.asarray(correction))
    first, second, integral = map(float, np.asarray(gains)[0])
    return RegulatorDesign(
        period=period,
        model=model,
        transition=rows(transition),
        input=tuple(map(float, into[:, 0])),
        feedback=(first, second),
        integral_gain=-integral,
        correction=tuple(map(float, correction[:, 0])),
        poles=tuple(complex(pole) for pole in poles),
    )
