"""MuJoCo with the native callback against the independent plant, which shares no law with it."""

import dataclasses
import itertools

import numpy as np
import pytest

import pamsim
from pamsim.comparison.protocols import PROTOCOLS
from tests.plant.inputs import INPUTS
from tests.plant.read_rig import read_rig
from tests.plant.run import run

STEP = pamsim.pressure_step((487e3, 487e3), (487e3, 0.0), duration=1.5, load=1.2, sample_rate=100.0)
SHIPPED = pamsim.load_rig("mas20_arm")
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


def in_plant(rig, experiment, numbers=None):
    numbers = read_rig(rig, experiment.load) if numbers is None else numbers
    return run(numbers, experiment, rig=rig.name, muscles=tuple(rig.muscles), step=4e-4)


def apart(one, other):
    """Largest difference of angle [deg] and of pressure [Pa]."""
    degrees = np.degrees(np.abs(one.angle - other.angle)).max()
    return degrees, np.abs(one.pressure - other.pressure).max()


@pytest.mark.parametrize("name", CASES)
def test_engine_agrees_with_the_independent_plant_at_the_order_of_its_integrator(name):
    rig = SHIPPED.with_parameters(CASES[name])
    plant = in_plant(rig, STEP)
    engines = [pamsim.simulate(rig, STEP, timestep=dt).completed() for dt in (1e-3, 0.5e-3)]
    errors = [apart(engine, plant)[0] for engine in engines]
    assert errors[1] < 0.05
    assert np.degrees(abs(engines[1].angle[-1] - plant.angle[-1])) < 0.005
    assert apart(engines[1], plant)[1] < 200.0
    # Euler is of order 1; the bounds leave room for the next term of the error's expansion.
    assert 0.8 < np.log2(errors[0] / errors[1]) < 1.3


def experiment_of(name, seed, duration):
    if name in PROTOCOLS:
        made = PROTOCOLS[name].experiment(seed, duration)
    else:
        made = INPUTS[name].experiment(read_rig(SHIPPED, 0.0), seed, duration)
    return dataclasses.replace(made, settle=2.0)


@pytest.mark.parametrize(
    ("name", "friction"),
    list(zip([*PROTOCOLS, *INPUTS], itertools.cycle((0.0, 0.4)), strict=False)),
)
def test_plant_and_engine_agree_on_random_inputs_with_nothing_hidden(name, friction):
    """A joint with dry friction sticks at instants that the plant locates and the engine not."""
    experiment = experiment_of(name, 11, 2.5)
    rig = SHIPPED.with_parameters({"joint.shaft.frictionloss": friction})
    plant, engine = in_plant(rig, experiment), pamsim.simulate(rig, experiment).completed()
    assert np.ptp(plant.angle) > np.radians(0.3)
    angle, pressure = apart(plant, engine)
    assert (angle < 0.05, pressure < 100.0) == (True, True)


def test_creep_of_two_branches_agrees_with_the_independent_plant():
    """The plant relaxes strains, the engine contractions; two of the plant's branches are used."""
    numbers = read_rig(SHIPPED, STEP.load)
    two = {"stiffness": 2e3, "relaxation_time": 0.15, "stiffness_2": 3e3, "relaxation_time_2": 1.5}
    for k in range(4):
        numbers.muscles[f"creep_time_{k + 1}"] = two["relaxation_time_2"]
    numbers.muscles.creep_0, numbers.muscles.creep_time_0 = 2e3, two["relaxation_time"]
    numbers.muscles.creep_1 = two["stiffness_2"]
    plant = in_plant(SHIPPED, STEP, numbers)
    rig = SHIPPED.with_parameters({f"creep.{name}": value for name, value in two.items()})
    engine, without = (
        pamsim.simulate(r, STEP, timestep=0.5e-3).completed() for r in (rig, SHIPPED)
    )
    error, _ = apart(engine, plant)
    assert error < 0.05
    assert apart(without, plant)[0] > 20.0 * error


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


@pytest.fixture(scope="module")
def as_shipped():
    """Experiments on openings and on set points, and the shipped rig's runs of them."""
    both = {name: experiment_of(name, 3, 2.0) for name in ("pulses", "levels")}
    return {name: (one, in_plant(SHIPPED, one)) for name, one in both.items()}


@pytest.mark.parametrize("name", NAMED)
def test_plant_and_engine_agree_on_what_a_rig_states(as_shipped, name):
    rig = SHIPPED.with_parameters(NAMED[name])
    experiment, without = as_shipped["pulses" if name.startswith("valve") else "levels"]
    plant, engine = in_plant(rig, experiment), pamsim.simulate(rig, experiment).completed()
    error, pressure = apart(plant, engine)
    assert error < 0.05
    assert pressure < 100.0
    assert apart(plant, without)[0] > 4.0 * error
