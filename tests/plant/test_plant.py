"""Laws and integrator of the independent plant against what is known of them in closed form."""

import ast
import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from pamsim.comparison.protocols import PROTOCOLS
from pamsim.core.errors import InputError
from tests.plant.air import GAMMA, R_AIR, pressure_rate
from tests.plant.compiled import compiled_integrator
from tests.plant.inputs import INPUTS
from tests.plant.muscle import (
    steady_pull,
    volume,
)
from tests.plant.read_rig import _COPIED, read_rig
from tests.plant.records import ANGLE
from tests.plant.run import STEP, at_zero, run


@pytest.fixture
def arm(rig):
    return read_rig(rig, 0.0)


def put(record, **values):
    for name, value in values.items():
        record[name] = value


@pytest.fixture
def pendulum(arm):
    """A spring-loaded joint without muscles, weight and damping."""
    arm.muscles.arm = 0.0
    put(arm.joint, weight_cos=0.0, weight_sin=0.0, damping=0.0, inertia=0.01, stiffness=5.0)
    return arm


def moved(numbers, start, times):
    """Angles and speeds of a joint that is let go at an angle."""
    states, plays = at_zero(numbers, np.full(2, 2e5))
    states[ANGLE] = start
    rows = np.zeros((len(times), 6))
    compiled_integrator()(
        numbers.joint, numbers.muscles, plays, states, times, np.zeros((0, 3)), False,
        np.zeros(2), STEP, rows,
    )  # fmt: skip
    return rows[:, 0], rows[:, 1]


def test_dry_friction_takes_the_same_from_every_swing_and_then_holds(pendulum):
    pendulum.joint.dry = 0.2
    angle, speed = moved(pendulum, 0.3, np.arange(0.0, 2.0, 1e-3))
    turns = angle[1:-1][np.diff(angle)[:-1] * np.diff(angle)[1:] < 0.0]
    lost = 2.0 * 0.2 / 5.0
    np.testing.assert_allclose(np.abs(turns), 0.3 - lost * np.arange(1, 1 + len(turns)), atol=1e-4)
    assert len(turns) == 3
    assert np.all(speed[-1000:] == 0.0)
    assert np.ptp(angle[-1000:]) == 0.0
    assert abs(angle[-1]) == pytest.approx(4 * lost - 0.3, abs=1e-5)


def test_a_joint_holds_any_torque_below_the_breakaway_torque_and_slides_above_it(pendulum):
    times = np.arange(0.0, 1.0, 0.01)
    put(pendulum.joint, stiffness=0.0, dry=0.3, static=0.2, static_speed=1e-6)
    for share in (-0.99, 0.99, 1.1, -2.0):
        pendulum.joint.torque = share * 0.5
        angle, _ = moved(pendulum, 0.0, times)
        left = math.copysign(abs(share) * 0.5 - 0.3, share) if abs(share) > 1.0 else 0.0
        np.testing.assert_allclose(angle, 0.5 * left / 0.01 * times**2, rtol=0.01, atol=1e-5)
        assert left or np.all(angle == 0.0)


def test_force_and_volume_do_the_same_work(rig):
    """Maxwell's relation: the volume falls with length as the force grows with pressure."""
    p = 2.5e5
    for hidden in (
        {},
        {"law": 1.0},
        {"end_loss": 0.6, "end_onset": -0.02},
        {"cone": 2.0},
        {"extensibility": 3e-8},
    ):
        m = read_rig(rig, 0.0).muscles[0]
        put(m, cone_bend=4e-3, **hidden)
        for length in (0.24, 0.25, 0.256):
            longer, shorter = (volume(m, length + d, p)[0] for d in (1e-6, -1e-6))
            more, less = (volume(m, length, p + d)[0] for d in (1e3, -1e3))
            stronger, weaker = (steady_pull(m, length, p + d) for d in (1e2, -1e2))
            work, found = (stronger - weaker) / 2e2, volume(m, length, p)
            assert found[1] == pytest.approx(-work, rel=1e-6, abs=1e-12), hidden
            assert (longer - shorter) / 2e-6 == pytest.approx(-work, rel=2e-3), hidden
            assert found[2] == pytest.approx((more - less) / 2e3, rel=1e-4, abs=1e-16), hidden


@pytest.mark.parametrize("heat_time", [0.02, 0.3, 1e9])
def test_air_keeps_mass_and_energy(arm, heat_time):
    m = arm.muscles[0]
    m.heat_time = heat_time
    p, v, t, into, out = 3.1e5, 9e-5, 288.0, 4e-4, 1e-4
    for softness in (0.0, 3e-11):
        rate, warming = pressure_rate(m, p, (v, softness), 2e-5, t, into, out)
        swept, mass = 2e-5 + softness * rate, p * v / (R_AIR * t)
        assert mass * (rate / p + swept / v - warming / t) == pytest.approx(into - out)
        cv, cp = R_AIR / (GAMMA - 1.0), GAMMA * R_AIR / (GAMMA - 1.0)
        heat = mass * cv * (m.temperature - t) / heat_time
        gained = (rate * v + p * swept) / (GAMMA - 1.0)
        assert gained == pytest.approx(cp * (m.temperature * into - t * out) - p * swept + heat)


def test_inputs_are_of_the_plant_alone_within_range_and_repeatable(arm):
    assert not set(INPUTS) & set(PROTOCOLS)
    for name, made in INPUTS.items():
        one, same, other = (made.experiment(arm, seed, 5.0) for seed in (1, 1, 2))
        assert np.array_equal(one.command_value, same.command_value), name
        assert not np.array_equal(one.command_value, other.command_value), name
        high = 0.9 * 6e5 if one.drive == "pressure_set" else 1.0
        assert np.abs(one.command_value).max() <= high, name
        assert made.experiment(arm, 1, 5.0, loads=False).load == 0.0


def test_a_rig_or_command_that_the_plant_cannot_have_is_refused(rig, arm, monkeypatch):
    monkeypatch.delitem(_COPIED, "threshold")
    assert read_rig(rig, 0.0)
    lines = {"valve.supply_resistance": 1e8, "muscle_2:valve.supply_line": 1.0}
    for changes, words in (
        ({"muscle_2:threshold.pressure": 1e4}, r"muscle_2: the independent plant has no threshold"),
        ({"muscle_1:chain.backlash": 1e-3}, "one backlash for all muscles"),
        (lines, "one supply for all muscles"),
    ):
        with pytest.raises(InputError, match=words):
            read_rig(rig.with_parameters(changes), 0.0)
    pulses = INPUTS["pulses"].experiment(arm, 1, 1.0)
    with pytest.raises(InputError, match="not pulses"):
        run(arm, dataclasses.replace(pulses, drive="pulse"), rig="x", muscles=("a", "b"))


FORBIDDEN = (
    "mujoco", "pamsim.physics", "pamsim.identification", "pamsim.engine.simulate",
    "pamsim.engine.batch",
)  # fmt: skip


def imported(source):
    """Full names of the modules, and of what is taken from them."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (one.name for one in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{one.name}" for one in node.names)


def test_no_file_of_the_plant_imports_a_law_or_the_engine():
    seen = imported("import mujoco\ndef f():\n    from pamsim.physics import air")
    assert list(seen) == ["mujoco", "pamsim.physics.air"]
    for path in Path(__file__).parent.rglob("*.py"):
        if not path.name.startswith("test_"):
            for name in imported(path.read_text(encoding="utf-8")):
                assert not f"{name}.".startswith(tuple(f"{one}." for one in FORBIDDEN)), path
