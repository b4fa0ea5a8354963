"""MuJoCo with the native callback against the independent plant, which shares no law with it."""

from __future__ import annotations

import numpy as np
import pytest

import pamsim
from pamsim.comparison.protocols import PROTOCOLS
from tests.plant.inputs import INPUTS
from tests.plant.read_rig import read_rig
from tests.plant.run import run

STEP = pamsim.pressure_step((487e3, 487e3), (487e3, 0.0), duration=3.0, load=1.2, sample_rate=100.0)

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
    "turbulent supply": {
        "valve.supply_resistance": 5e7,
        "valve.supply_square": 1e12,
        "valve.supply_volume": 1e-4,
    },
}


def in_plant(rig, experiment):
    numbers = read_rig(rig, experiment.load)
    return run(numbers, experiment, rig=rig.name, muscles=tuple(rig.muscles))


@pytest.fixture(scope="module", params=CASES)
def rig(request):
    return pamsim.load_rig("mas20_arm").with_parameters(CASES[request.param])


@pytest.fixture(scope="module")
def reference(rig):
    return in_plant(rig, STEP)


def test_engine_agrees_with_the_independent_plant(rig, reference):
    engine = pamsim.simulate(rig, STEP, timestep=0.5e-3).completed()
    error = np.degrees(np.abs(engine.angle - reference.angle))
    assert error.max() < 0.05
    assert error[-1] < 0.005
    assert np.abs(engine.pressure - reference.pressure).max() < 200.0


def test_error_falls_at_the_order_of_the_integrator(rig, reference):
    errors = [
        np.abs(pamsim.simulate(rig, STEP, timestep=dt).completed().angle - reference.angle).max()
        for dt in (2e-3, 1e-3, 0.5e-3)
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    print("max angle errors [deg]", np.degrees(errors), "orders", orders)
    # Euler is of order 1; the bounds leave room for the next term of the error's expansion.
    assert np.all((orders > 0.8) & (orders < 1.3))


@pytest.mark.parametrize("name", [*PROTOCOLS, *INPUTS])
@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_plant_and_engine_agree_on_random_inputs_with_nothing_hidden(name, friction):
    """A joint with dry friction sticks at instants that the plant locates and the engine not."""
    rig = pamsim.load_rig("mas20_arm").with_parameters({"joint.shaft.frictionloss": friction})
    if name in PROTOCOLS:
        experiment = PROTOCOLS[name].experiment(11, 3.0)
    else:
        experiment = INPUTS[name].experiment(read_rig(rig, 0.0), 11, 3.0)
    plant, engine = in_plant(rig, experiment), pamsim.simulate(rig, experiment).completed()
    assert np.ptp(plant.angle) > np.radians(0.3)
    assert np.degrees(np.abs(plant.angle - engine.angle)).max() < 0.05
    assert np.abs(plant.pressure - engine.pressure).max() < 100.0


def test_creep_of_two_branches_agrees_with_the_independent_plant():
    """The plant relaxes strains, the engine contractions; two of the plant's branches are used."""
    shipped = pamsim.load_rig("mas20_arm")
    numbers = read_rig(shipped, STEP.load)
    two = {"stiffness": 2e3, "relaxation_time": 0.15, "stiffness_2": 3e3, "relaxation_time_2": 1.5}
    for k in range(4):
        numbers.muscles[f"creep_time_{k + 1}"] = two["relaxation_time_2"]
    numbers.muscles.creep_0, numbers.muscles.creep_time_0 = 2e3, two["relaxation_time"]
    numbers.muscles.creep_1 = two["stiffness_2"]
    plant = run(numbers, STEP, rig=shipped.name, muscles=tuple(shipped.muscles))
    rig = shipped.with_parameters({f"creep.{name}": value for name, value in two.items()})
    engine = pamsim.simulate(rig, STEP, timestep=0.5e-3).completed()
    error = np.degrees(np.abs(engine.angle - plant.angle))
    without = pamsim.simulate(shipped, STEP, timestep=0.5e-3).completed()
    print("largest error [deg]", error.max())
    assert error.max() < 0.05
    assert np.degrees(np.abs(without.angle - plant.angle)).max() > 20.0 * error.max()


NAMED = {
    "valve.dead_zone": {"valve.dead_zone": 0.1},
    "valve.dead_zone_asymmetry": {"valve.dead_zone": 0.1, "valve.dead_zone_asymmetry": -0.7},
    "valve.delay": {"valve.delay": 0.0123},
    "chain.backlash": {"chain.backlash": 6e-4},
    "threshold.pressure": {"threshold.pressure": 2e4},
    "joint.shaft.armature": {"joint.shaft.armature": 0.01},
    "body.rig.tilt": {"body.rig.tilt": 0.1},
    "chamber.polytropic_index": {"chamber.polytropic_index": 1.35},
    "muscle_2:force.scale": {"muscle_2:force.scale": 1.05},
}


@pytest.mark.parametrize("name", NAMED)
def test_plant_and_engine_agree_on_what_a_rig_states(name):
    shipped = pamsim.load_rig("mas20_arm")
    rig = shipped.with_parameters(NAMED[name])
    experiment = INPUTS["pulses" if name.startswith("valve") else "levels"].experiment(
        read_rig(rig, 0.0), 3, 2.0
    )
    plant, engine = in_plant(rig, experiment), pamsim.simulate(rig, experiment).completed()
    without = in_plant(shipped, experiment)
    error = np.degrees(np.abs(plant.angle - engine.angle)).max()
    assert error < 0.05
    assert np.abs(plant.pressure - engine.pressure).max() < 100.0
    assert np.degrees(np.abs(plant.angle - without.angle)).max() > 4.0 * error
