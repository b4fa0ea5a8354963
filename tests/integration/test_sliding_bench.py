"""A rig of a stranger: one muscle on a spatial tendon lifts a weight along a rail."""

import dataclasses

import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.engine.parameters import rig_parameter
from pamsim.recordings.rig_file import shipped_rigs

MASS, WEIGHT = 5.0, 5.0 * 9.81  # [kg, N]
MJCF = f"""
<mujoco model="bench">
  <compiler autolimits="true"/>
  <option timestep="0.0005" integrator="Euler"><flag autoreset="disable"/></option>
  <worldbody>
    <site name="top" pos="0 0 0.5"/>
    <body name="carriage" pos="0 0 0.22">
      <joint name="rail" type="slide" axis="0 0 1" range="-0.2 0.2"/>
      <inertial pos="0 0 0" mass="{MASS}" diaginertia="0.01 0.01 0.01"/>
      <site name="hook" pos="0 0 0.02"/>
    </body>
  </worldbody>
  <tendon><spatial name="line"><site site="top"/><site site="hook"/></spatial></tendon>
</mujoco>
"""
HEAD = 'schema = "pamsim-rig/1"\n[rig]\nname = "bench"\nmjcf = "bench.xml"\n'
HEAD += '[muscles]\nlifter = { tendon = "line" }\n'
NATIVE = '[native]\n"joint.rail.damping" = { value = 20, unit = "N*s/m", source = "assumed" }\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The muscle of the two-joint arm with its whole length on the tendon."""
    folder = tmp_path_factory.mktemp("bench")
    shipped = (shipped_rigs() / "two_joint_arm" / "params.toml").read_text(encoding="utf-8")
    muscle = shipped[shipped.index("[muscle.mounting]") : shipped.index("[native]")]
    at_zero = 'length_at_zero = { value = 220, unit = "mm"'
    assert at_zero in muscle
    muscle = muscle.replace(at_zero, at_zero.replace("220", "0"))
    (folder / "bench.xml").write_text(MJCF, encoding="utf-8")
    (folder / "params.toml").write_text(f"{HEAD}{muscle}\n{NATIVE}", encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def rig(folder):
    return pamsim.load_rig(folder)


def step(rig, first, last, duration):
    experiment = pamsim.pressure_step([first], [last], duration=duration, name="lift_1")
    return pamsim.simulate(rig, dataclasses.replace(experiment, sample_rate=100.0)).completed()


def test_the_muscle_carries_the_weight_lifts_it_and_is_identified(folder, rig, tmp_path):
    assert rig.joints == {"rail": "position"}
    assert step(rig, 2e5, 2e5, 0.01).tension[-1, 0] == pytest.approx(WEIGHT, rel=1e-6)
    rising = step(rig, 1e5, 2.5e5, 1.0)
    assert rising.signal("rail.position")[-1] > rising.signal("rail.position")[0] + 0.02
    assert "rail 20.1" in rising.summary()
    assert rising.columns()["rail_mm"] == pytest.approx(1e3 * rising.angle)
    noise = np.random.default_rng(2).normal(0.0, 1e-5, rising.positions.shape)
    dataclasses.replace(rising, positions=rising.positions + noise).save(tmp_path / "log", folder)
    found = pamsim.identify(tmp_path / "log", order=1, arx=(1, 1, 1), oe=(1, 1, 1))
    assert (found.inputs[0].text, found.output.text) == ("lifter_set_kpa", "rail_mm")


def test_the_carriage_follows_a_machine_and_shows_what_that_takes(rig):
    """A body without children, whose inertia the engine does not compute again."""
    time = np.linspace(0.0, 0.2, 21)
    position = 0.03 + 0.01 * np.cos(10.0 * time)
    moved = pamsim.Experiment(
        drive={"lifter": "pressure_set", "rail": "length"},
        command_time=time,
        command_value=np.column_stack([np.full(21, 2e5), position]),
        start_pressure=np.array([2e5]),
        duration=0.2,
        sample_rate=100.0,
    )
    run = pamsim.simulate(rig, moved).completed()
    np.testing.assert_allclose(run.angle, position, rtol=0, atol=1e-11)
    gain, speed = -1.0 * np.cos(10.0 * time), -0.1 * np.sin(10.0 * time)
    newton = MASS * gain + 20.0 * speed + WEIGHT - run.tension[:, 0]
    np.testing.assert_allclose(run.signal("rail.force")[1:-1], newton[1:-1], rtol=0, atol=0.3)


def test_numbers_of_a_joint_that_slides_are_in_newtons_and_kilograms(folder, rig, tmp_path):
    assert rig.model.joint("rail").damping[0] == 20.0
    for field, unit in (("damping", "N*s/m"), ("frictionloss", "N"), ("armature", "kg")):
        assert rig_parameter(rig, f"joint.rail.{field}").spec.unit == unit
    for name in ("bench.xml", "params.toml"):
        text = (folder / name).read_text(encoding="utf-8")
        (tmp_path / name).write_text(text.replace("N*s/m", "N*m*s/rad"), encoding="utf-8")
    with pytest.raises(InputError, match=r"rail\.damping: unit .* converts to 'N\*s/m'"):
        pamsim.load_rig(tmp_path)
