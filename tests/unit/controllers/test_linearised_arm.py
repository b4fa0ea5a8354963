"""A model about a trim point has the slope that the law's angles at rest have."""

from __future__ import annotations

import numpy as np
import pytest

import pamsim
from pamsim.controllers.controller import PressureSplit
from pamsim.controllers.model_based import linearise_arm
from pamsim.engine.equilibrium import rest_angles
from pamsim.linear.identified_model import FitStatus
from tests.unit.controllers.closed_loop import LEVEL, SUPPLY


def test_gain_and_angle_are_those_at_rest():
    rig = pamsim.load_rig("mas20_arm").with_parameters({"hysteresis.force_per_pressure": 0.0})
    split = PressureSplit(common=LEVEL, supply=SUPPLY)
    found = linearise_arm(rig, split, difference=5e4, load=1.2, hold=1.2)
    assert found.fit.status is FitStatus.CONVERGED
    pressures = np.array([split.pressures(d) for d in (5e4, 3e4, 7e4)])
    angles = rest_angles(rig, pressures, np.full(3, 1.2))
    assert found.point.angle == pytest.approx(angles[0], abs=1e-4)
    assert found.model.gain == pytest.approx((angles[2] - angles[1]) / 4e4, rel=0.05)
