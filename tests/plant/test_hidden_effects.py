"""Every hidden effect shows, is not the library's formula, and has a size in physical terms."""

import dataclasses

import numpy as np
import pytest

from pamsim.diagnosis.bench import PRESSURE
from pamsim.effects.catalog import EFFECTS, TRIAL_EFFECTS
from tests.plant.hidden.catalog import PLANT_EFFECTS
from tests.plant.hidden.virtual_tests import joint_friction, muscle_loop
from tests.plant.hide import in_plant, measured_size
from tests.plant.inputs import INPUTS
from tests.plant.read_rig import read_rig

NOISE = {"angle": np.radians(0.05), "pressure": 400.0, "tension": 1.5}


def recorded(rig, name, effect=None, size=0.0, seed=(1, 0)):
    experiment = INPUTS[name].experiment(read_rig(rig, 0.0), 4, 2.0)
    effects = [] if effect is None else [(effect, size / effect.typical)]
    return in_plant(rig, dataclasses.replace(experiment, settle=0.5), effects, seed, 5e-4)


@pytest.fixture(scope="module")
def plain(rig):
    return {name: recorded(rig, name) for name in ("levels", "pulses")}


def far(one, other):
    """Largest RMS difference of any signal, in sensor noise."""
    return max(
        np.sqrt(np.mean((getattr(one, s) - getattr(other, s)) ** 2)) / sd for s, sd in NOISE.items()
    )


def measured(rig, name, size):
    effect = PLANT_EFFECTS[name]
    return measured_size(rig, rig, effect, size / effect.typical)[0].physical


@pytest.mark.parametrize("name", PLANT_EFFECTS)
def test_each_shows_and_is_not_the_library_s_formula(rig, plain, name):
    effect = PLANT_EFFECTS[name]
    protocol = "pulses" if "dead_zone" in name else "levels"
    there = recorded(rig, protocol, effect, effect.typical)
    shift = far(there, plain[protocol])
    assert shift > 0.3
    found, equal = measured_size(rig, rig, effect, 1.0)
    assert found.physical
    assert all(np.isfinite(q.value) and q.unit for q in found.physical.values())
    if equal and not any(n.startswith("sensor.") for n in equal):
        by_library = far(there, recorded(rig.with_parameters(equal), protocol))
        assert 0.02 < by_library < shift, "of another size or sign"


def test_every_effect_of_the_library_has_another_formula_and_names_are_distinct():
    answered = {name for effect in PLANT_EFFECTS.values() for name in effect.stands_for}
    usual = {name for name in TRIAL_EFFECTS if not EFFECTS[name].rare}
    assert {name for name in answered if not EFFECTS[name].rare} == usual - {"added_inertia"}
    assert not set(PLANT_EFFECTS) & set(TRIAL_EFFECTS)
    for effect in PLANT_EFFECTS.values():
        assert set(effect.resembles) <= set(EFFECTS)
        assert not set(effect.stands_for) & set(effect.resembles)


def test_dead_times_differ_from_run_to_run(rig):
    bus = PLANT_EFFECTS["bus_delay"]
    one, same, other = (recorded(rig, "levels", bus, 0.02, seed=(1, k)) for k in (0, 0, 1))
    assert far(one, other) > far(one, same) == 0.0


def test_friction_has_the_breakaway_torque_that_it_states(rig):
    for name, share in (
        ("dahl_friction", 1.0), ("sticking_friction", 0.55), ("lugre_friction", 0.55)
    ):  # fmt: skip
        found = measured(rig, name, 0.4)
        assert found["breakaway_torque"].value == pytest.approx(0.4, rel=0.01)
        assert found["sliding_torque"].value == pytest.approx(share * 0.4, rel=0.01)
        assert found["energy_per_cycle"].value == pytest.approx(4 * 0.1 * 0.4, rel=0.03)
    # That of the effect alone, where the rig has friction of its own.
    without = read_rig(rig.with_parameters({"joint.shaft.frictionloss": 0.7}), 0.0)
    there = without.copy()
    PLANT_EFFECTS["sticking_friction"].change(there, 0.2)
    found = joint_friction(there, without, 0.2)
    assert found["breakaway_torque"].value == pytest.approx(0.2, rel=0.01)


def test_a_slipping_bank_has_a_loop_as_wide_as_its_blocks_pull(rig):
    there = read_rig(rig, 0.0)
    PLANT_EFFECTS["slip_hysteresis"].change(there, 1e-4)
    found = muscle_loop(there, there, 1e-4)
    assert found["loop_half_width"].value == pytest.approx(1e-4 * PRESSURE)
    # A parallelogram of area 4 F (A - x_k) per block, of shares that fall by 0.7.
    shares, reach = 0.7 ** np.arange(6), 7e-3 * np.arange(1, 7) / 6
    lost = 4 * 25.0 * float(shares / shares.sum() @ (0.015 - reach)) * 0.25
    assert found["energy_per_cycle"].value == pytest.approx(lost, rel=1e-3)


def test_power_law_creep_is_straight_on_logarithmic_axes(rig):
    there = read_rig(rig, 0.0)
    PLANT_EFFECTS["power_law_creep"].change(there, 1.0)
    m = there.muscles[0]
    time = np.geomspace(0.05, 8.0, 50)
    force = sum(m[f"creep_{k}"] * np.exp(-time / m[f"creep_time_{k}"]) for k in range(1, 5))
    slope, level = np.polyfit(np.log(time), np.log(force), 1)
    assert np.abs(np.log(force) - slope * np.log(time) - level).max() < 0.15
    assert -0.4 < slope < -0.1
