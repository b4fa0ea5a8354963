"""Controllers of python-control as numbers: what they answer, where they rest, what is refused."""

from __future__ import annotations

import control
import numpy as np
import pytest

from pamsim.controllers.sampled_controller import sampled_controller
from pamsim.core.errors import InputError

PERIOD = 0.02
PID = control.tf([2.0, 20.0, 30.0], [0.01, 1.0, 0.0])


def test_rest_is_where_an_integrator_holds_the_output_without_error():
    design = sampled_controller(PID, PERIOD)
    x = np.array(design.rest)
    np.testing.assert_allclose(np.array(design.transition) @ x, x, atol=1e-12)
    assert np.dot(design.output, x) == pytest.approx(1.0)
    lag = control.tf([1.0], [1e4, 1.0])  # slow, but forgets
    assert sampled_controller(lag, PERIOD).rest == (0.0,)


def test_conditioning_needs_a_direct_path_and_stable_zeros():
    assert any(sampled_controller(PID, PERIOD).correction)
    assert sampled_controller(control.tf([1.0], [1.0, 0.0], PERIOD), PERIOD).correction == (0.0,)
    unstable_zero = control.tf([1.0, -2.0], [1.0, -1.0], PERIOD)
    assert sampled_controller(unstable_zero, PERIOD).correction == (0.0,)
    own = sampled_controller(unstable_zero, PERIOD, back_calculation=np.array([0.3]))
    assert own.correction == (0.3,)


TWO = control.tf([[[1.0], [2.0]]], [[[1.0, 1.0], [1.0, 2.0]]])
BAD = {
    "improper": (control.tf([1.0, 0.0], [1.0]), {}, "more zeros than poles"),
    "another period": (control.tf([1.0], [1.0, 0.5], 0.01), {}, "is sampled at 0.01 s"),
    "two by transfer function": (TWO, {}, "needs slycot"),
    "three inputs": (control.ss([[0.1]], np.ones((1, 3)), [[1.0]], 0.0, PERIOD), {}, "3 inputs"),
    "corrections": (PID, {"back_calculation": np.zeros(5)}, "2 states"),
    "period": (PID, {"period": 0.0}, "must be above 0"),
}


@pytest.mark.parametrize("name", BAD)
def test_refusals(name):
    system, changes, expected = BAD[name]
    with pytest.raises(InputError, match=expected):
        sampled_controller(system, **({"period": PERIOD} | changes))
