"""MuJoCo with the native callback against an independent integration of the same equations."""

from __future__ import annotations

import numpy as np
import pytest

import pamsim
from tests.physics.independent_arm import IndependentArm

START, END, DURATION = (487e3, 487e3), (487e3, 0.0), 3.0

CASES = {
    "as shipped": {},
    "soft chain": {"chain.compliance": 3e-6, "chain.relaxation_time": 0.03},
    "stiffer braid that locks soon": {
        "braid.extensibility": 3e-8,
        "passive.locking": 32.0,
        "chain.compliance": 1e-6,
        "chain.relaxation_time": 0.01,
    },
    "creep, ends and friction": {
        "creep.stiffness": 3e3,
        "creep.relaxation_time": 0.4,
        "end_shape.loss": 0.5,
        "end_shape.onset": -0.02,
        "friction.stribeck_force": 12.0,
        "friction.stribeck_velocity": 8e-3,
    },
    "dry friction of LuGre": {
        "friction.coulomb_force": 9.0,
        "friction.breakaway_force": 6.0,
        "friction.stribeck_velocity": 5e-3,
        "friction.presliding": 5e-5,
        "friction.bristle_time": 2e-3,
    },
    "dry friction that grows with the pull": {
        "friction.tension_share": 0.03,
        "friction.presliding": 5e-5,
    },
    "rubbing braid and teeth": {
        "braid.friction": 2e-3,
        "chain.ripple": 2e-4,
        "chain.ripple_pitch": 4e-3,
        "chain.ripple_phase": 0.7,
    },
    "leak, sag and line": {
        "chamber.leak_conductance": 1e-11,
        "valve.supply_resistance": 3e8,
        "valve.line_lag": 0.15,
    },
    "supply of small volume": {"valve.supply_resistance": 1e9, "valve.supply_volume": 2e-5},
}


@pytest.fixture(scope="module", params=CASES)
def rig(request):
    return pamsim.load_rig("mas20_arm").with_parameters(CASES[request.param])


@pytest.fixture(scope="module")
def reference(rig):
    return IndependentArm(rig, load=1.2).run(START, END, DURATION, 301)


def simulated(rig, timestep):
    step = pamsim.pressure_step(START, END, duration=DURATION, load=1.2, sample_rate=100.0)
    return pamsim.simulate(rig, step, timestep=timestep).completed()


def test_engine_agrees_with_independent_integration(rig, reference):
    angle, pressure = reference
    run = simulated(rig, 0.5e-3)
    error = np.degrees(np.abs(run.angle - angle))
    assert error.max() < 0.05
    assert error[-1] < 0.005
    assert np.abs(run.pressure - pressure).max() < 200.0


def test_error_falls_at_the_order_of_the_integrator(rig, reference):
    angle, _ = reference
    errors = [np.abs(simulated(rig, dt).angle - angle).max() for dt in (2e-3, 1e-3, 0.5e-3)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    print("max angle errors [deg]", np.degrees(errors), "orders", orders)
    # Euler is of order 1; the bounds leave room for the next term of the error's expansion.
    assert np.all((orders > 0.8) & (orders < 1.3))
