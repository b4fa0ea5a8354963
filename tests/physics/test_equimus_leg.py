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

A1, B1, B2, D1, D2 = 0.25, 0.21213, 0.1, 0.06, 0.10
BETA_1, BETA_2 = math.radians(8.13), math.radians(30.0)
GRAVITY = 9.8
THIGH, CALF, HIP_BELLOWS, KNEE_BELLOWS = 0.086, 0.1033, 0.18648, 0.27266
THIGH_AT, CALF_AT = (0.12665, 0.00125), (0.13903, -0.0037)
"""Centres of mass along and across the links, see equimus_leg.xml."""
K1, K2, L10, L20, S1, S2 = 208.2599, 129.6576, 0.1741, 0.2605, 3.9215e-4, 4.2904e-4
H = 1e-6


def along(angle: float, length: float, across: float = 0.0) -> np.ndarray:
    """Forward and down, of a point on a link at an angle."""
    sine, cosine = math.sin(angle), math.cos(angle)
    return np.array([length * cosine + across * sine, length * sine - across * cosine])


def points(hip: float, knee: float) -> np.ndarray:
    """Centres of thigh and calf, and where the bellows of hip and knee end."""
    tip = along(hip, A1)
    return np.array(
        [
            along(hip, *THIGH_AT),
            tip + along(hip + knee, *CALF_AT),
            along(hip - BETA_1, B1),
            tip + along(hip + knee + BETA_2, B2),
        ]
    )


def energy(hip: float, knee: float, pressure: tuple[float, float]) -> float:
    """Potential of weights, springs and pressures [J]; half of a bellows hangs on its end."""
    at = points(hip, knee)
    weights = np.array([THIGH, CALF, 0.5 * HIP_BELLOWS, 0.5 * KNEE_BELLOWS])
    length_1, length_2 = math.dist((D1, 0.0), at[2]), math.dist((-D2, 0.0), at[3])
    total = 0.5 * K1 * (length_1 - L10) ** 2 + 0.5 * K2 * (length_2 - L20) ** 2
    total -= pressure[0] * S1 * length_1 + pressure[1] * S2 * length_2
    return total - GRAVITY * float(weights @ at[:, 1])


def by_angle(function, hip, knee):
    """Differences of a function by either angle."""
    turns = ((H, 0.0), (0.0, H))
    return [(function(hip + a, knee + b) - function(hip - a, knee - b)) / (2 * H) for a, b in turns]


def at_rest(pressure):
    """Angles at which the published equations balance."""

    def torques(angles):
        return by_angle(lambda hip, knee: energy(hip, knee, pressure), *angles)

    found = root(torques, [1.4, 0.8], tol=1e-12)
    assert found.success
    return found.x


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("equimus_leg")


def test_it_rests_where_the_published_equations_balance(rig):
    for pressure in ((6154.0, 2728.0), (19801.0, 8520.0), (0.0, 3e4)):
        step = pamsim.pressure_step(pressure, pressure, duration=4.0)
        run = pamsim.simulate(rig, step).completed()
        angles = [run.signal(f"{joint}.angle")[-1] for joint in ("hip", "knee")]
        assert angles == pytest.approx(at_rest(pressure), abs=5e-5), pressure


def test_its_inertia_is_that_of_the_links_and_a_third_of_each_bellows(rig):
    hip, knee = 1.4, 0.9
    data = mujoco.MjData(rig.model)
    data.qpos[:] = hip, knee
    mujoco.mj_fwdPosition(rig.model, data)
    full = np.zeros((2, 2))
    for row, unit in zip(full, np.eye(2), strict=True):
        mujoco.mj_mulM(rig.model, data, row, unit)
    wanted = np.array([[5.457e-4 + 6.523e-4, 6.523e-4], [6.523e-4, 6.523e-4]])
    jacobians = np.array(by_angle(points, hip, knee))
    for i, mass in enumerate((THIGH, CALF, HIP_BELLOWS / 3, KNEE_BELLOWS / 3)):
        wanted += mass * jacobians[:, i] @ jacobians[:, i].T
    np.testing.assert_allclose(full, wanted, rtol=1e-3, atol=1e-6)


def test_the_angles_its_readme_states_are_those_of_the_equations():
    text = (shipped_rigs() / "equimus_leg" / "README.md").read_text(encoding="utf-8")
    stated = re.search(r"([\d.]+) and ([\d.]+) deg at ([\d.]+) and ([\d.]+) kPa", text)
    assert stated
    numbers = [float(number) for number in stated.groups()]
    pressure = (6153.873691, 2728.246319)
    assert numbers[2:] == pytest.approx([p / 1e3 for p in pressure], abs=5e-3)
    assert numbers[:2] == pytest.approx(np.degrees(at_rest(pressure)), abs=6e-3)
