"""The torque balance is where the simulated arm comes to rest."""

from __future__ import annotations

import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.engine.equilibrium import rest_angles

PRESSURE = np.array([[300e3, 100e3], [120e3, 200e3], [400e3, 380e3]])
LOAD = np.array([0.0, 2.14, 1.2])


@pytest.fixture(scope="module")
def rig():
    """Without hysteresis, which the balance leaves out."""
    return pamsim.load_rig("mas20_arm").with_parameters({"hysteresis.force_per_pressure": 0.0})


@pytest.mark.parametrize(
    "values",
    [{}, {"body.rig.tilt": 0.2}, {"chain.compliance": 2e-6}, {"threshold.pressure": 2e4},
     {"braid.extensibility": 1e-7, "tendon.chain_1.coef": 0.011}],
    ids=["plain", "tilt", "chain", "threshold", "braid and sprocket"],
)  # fmt: skip
def test_it_is_where_the_simulated_arm_ends(rig, values):
    changed = rig.with_parameters(values)
    changed.model.opt.timestep = 1e-3
    balanced = rest_angles(changed, PRESSURE, LOAD)
    for angle, pressure, load in zip(balanced, PRESSURE, LOAD, strict=True):
        start = (float(pressure.max()),) * 2
        step = pamsim.pressure_step(start, tuple(pressure), duration=6.0, load=float(load),
                                    sample_rate=20.0)  # fmt: skip
        end = pamsim.simulate(changed, step).completed().angle[-1]
        assert angle == pytest.approx(end, abs=np.radians(0.05))


def test_where_the_search_begins_does_not_matter(rig):
    found = rest_angles(rig, PRESSURE, LOAD)
    for off in (-0.2, 1e-4, 0.3):
        assert rest_angles(rig, PRESSURE, LOAD, found + off) == pytest.approx(found, abs=1e-8)


def test_rows_do_not_see_one_another(rig):
    found = rest_angles(rig, PRESSURE, LOAD)
    alone = [rest_angles(rig, PRESSURE[[i]], LOAD[[i]])[0] for i in range(3)]
    assert np.array_equal(found, alone)


def test_equal_muscles_rest_in_the_middle_and_mirror_each_other(rig):
    upright = rig.with_parameters({"body.rig.tilt": 0.0})
    found = rest_angles(upright, np.array([[3e5, 3e5], [3e5, 1e5], [1e5, 3e5]]), np.zeros(3))
    assert found[0] == pytest.approx(0.0, abs=1e-9)
    assert found[1] == pytest.approx(-found[2], abs=1e-8)
    assert found[1] > 0.1


def test_a_row_without_a_balance_is_not_a_number(rig):
    weak = rig.with_parameters({"passive.stiffness": 0.0, "force.a": 0.0, "force.d": 0.0})
    assert np.isnan(rest_angles(weak, np.array([[3e5, 1e5]]), np.zeros(1))).all()


def test_an_arm_of_two_joints_is_refused():
    class Two:
        nv = 2

    other = type("Rig", (), {"model": Two(), "name": "two"})()
    with pytest.raises(InputError, match="2 degrees of freedom"):
        rest_angles(other, PRESSURE, LOAD)
