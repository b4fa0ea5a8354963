"""What makes a run break off, and what it is called."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from pamsim.core.recording import Outcome
from pamsim.engine.simulate import _breakdown

PENDULUM = """<mujoco><worldbody><body><joint name='j'/><geom size='1'/></body></worldbody>
<actuator><general joint='j' dyntype='integrator'/></actuator></mujoco>"""


@pytest.fixture
def data():
    model = mujoco.MjModel.from_xml_string(PENDULUM)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data)
    return data


def test_a_healthy_state_goes_on(data):
    assert _breakdown(data, data.time, 1e-3) is None


@pytest.mark.parametrize("field", ["act", "qpos"])
def test_a_state_that_is_not_finite_stops(data, field):
    getattr(data, field)[0] = np.nan
    assert _breakdown(data, data.time, 1e-3)[0] is Outcome.NOT_FINITE


def test_a_warning_of_the_engine_stops_and_is_named(data):
    data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number = 1
    outcome, reason = _breakdown(data, data.time, 1e-3)
    assert outcome is Outcome.ENGINE_WARNING
    assert "BADQACC" in reason


def test_time_that_does_not_advance_stops(data):
    assert _breakdown(data, data.time + 0.1, 1e-3)[0] is Outcome.TIME_STALLED
