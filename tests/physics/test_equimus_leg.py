"""The rig equimus_leg stands where the equations of its authors put it, and swings as they swing.

The equations are written out here from the published geometry: lengths from pin to pin, masses of
links and bellows, springs. They know nothing of the engine or of pamsim's laws.
"""

from __future__ import annotations

import math
import re

import mujoco
import numpy as np
import pytest
from scipy.optimize import root

import pamsim
from pamsim.recordings.rig_file import shipped_rigs

A1, A2, B1, B2, D1, D2 = 0.25, 0.25, 0.21213, 0.1, 0.06, 0.10
BETA_1, BETA_2 = math.radians(8.13), math.radians(30.0)
GRAVITY = 9.8
THIGH, CALF, HIP_BELLOWS, KNEE_BELLOWS = 0.086, 0.1033, 0.18648, 0.27266
THIGH_AT, CALF_AT = (0.12665, 0.00125), (0.13903, -0.0037)
"""Centres of mass along and across the links, see equimus_leg.xml."""
K1, K2, L10, L20, S1, S2 = 208.2599, 129.6576, 0.1741, 0.2605, 3.9215e-4, 4.2904e-4


def along(angle: float, length: float, across: float = 0.0) -> np.ndarray:
    """Forward and down, of a point on a link at an angle."""
    return np.array(
        [
            length * math.cos(angle) + across * math.sin(angle),
            length * math.sin(angle) - across * math.cos(angle),
        ]
    )


def points(hip: float, knee: float) -> dict[str, np.ndarray]:
    tip = along(hip, A1)
    return {
        "thigh": along(hip, *THIGH_AT),
        "calf": tip + along(hip + knee, *CALF_AT),
        "hip_bellows": along(hip - BETA_1, B1),
        "knee_bellows": tip + along(hip + knee + BETA_2, B2),
    }


def energy(hip: float, knee: float, pressure: tuple[float, float]) -> float:
    """Potential of weights, springs and pressures [J]; half of a bellows hangs on its end."""
    at = points(hip, knee)
    weights = (THIGH, CALF, 0.5 * HIP_BELLOWS, 0.5 * KNEE_BELLOWS)
    total = -GRAVITY * sum(m * at[name][1] for m, name in zip(weights, at, strict=True))
    length_1 = math.dist((D1, 0.0), at["hip_bellows"])
    length_2 = math.dist((-D2, 0.0), at["knee_bellows"])
    total += 0.5 * K1 * (length_1 - L10) ** 2 + 0.5 * K2 * (length_2 - L20) ** 2
    return total - pressure[0] * S1 * length_1 - pressure[1] * S2 * length_2


def torques(angles, pressure) -> np.ndarray:
    h = 1e-6
    hip, knee = angles
    return np.array(
        [
            (energy(hip - h, knee, pressure) - energy(hip + h, knee, pressure)) / (2 * h),
            (energy(hip, knee - h, pressure) - energy(hip, knee + h, pressure)) / (2 * h),
        ]
    )


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("equimus_leg")


@pytest.mark.parametrize("pressure", [(6154.0, 2728.0), (19801.0, 8520.0), (0.0, 3e4)])
def test_it_rests_where_the_published_equations_balance(rig, pressure):
    found = root(torques, [1.4, 0.8], args=(pressure,), tol=1e-12)
    assert found.success
    step = pamsim.pressure_step(pressure, pressure, duration=4.0)
    run = pamsim.simulate(rig, step).completed()
    at_rest = [run.signal(f"{joint}.angle")[-1] for joint in ("hip", "knee")]
    assert at_rest == pytest.approx(found.x, abs=5e-5)


def test_its_inertia_is_that_of_the_links_and_a_third_of_each_bellows(rig):
    hip, knee = 1.4, 0.9
    model = rig.model
    data = mujoco.MjData(model)
    data.qpos[:] = hip, knee
    mujoco.mj_fwdPosition(model, data)
    full = np.zeros((2, 2))
    for row, unit in zip(full, np.eye(2), strict=True):
        mujoco.mj_mulM(model, data, row, unit)
    h = 1e-6
    moving = {"thigh": THIGH, "calf": CALF, "hip_bellows": HIP_BELLOWS / 3}
    moving["knee_bellows"] = KNEE_BELLOWS / 3
    wanted = np.array([[5.457e-4 + 6.523e-4, 6.523e-4], [6.523e-4, 6.523e-4]])
    for name, mass in moving.items():
        slope = np.column_stack(
            [
                (points(hip + h, knee)[name] - points(hip - h, knee)[name]) / (2 * h),
                (points(hip, knee + h)[name] - points(hip, knee - h)[name]) / (2 * h),
            ]
        )
        wanted += mass * slope.T @ slope
    np.testing.assert_allclose(full, wanted, rtol=1e-3, atol=1e-6)


def test_the_angles_its_readme_states_are_those_of_the_equations():
    text = (shipped_rigs() / "equimus_leg" / "README.md").read_text(encoding="utf-8")
    stated = re.search(r"([\d.]+) and ([\d.]+) deg at ([\d.]+) and ([\d.]+) kPa", text)
    assert stated
    numbers = [float(number) for number in stated.groups()]
    pressure = (6153.873691, 2728.246319)
    assert numbers[2:] == pytest.approx([p / 1e3 for p in pressure], abs=5e-3)
    found = root(torques, [1.4, 0.8], args=(pressure,), tol=1e-12)
    assert numbers[:2] == pytest.approx(np.degrees(found.x), abs=6e-3)
