"""A rig of a stranger: one muscle on a spatial tendon lifts a weight along a rail."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.engine.parameters import rig_parameter
from pamsim.recordings.experiment import pressure_step
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
DAMPING = '"joint.rail.damping" = { value = 20, unit = "N*s/m", source = "assumed" }'


@pytest.fixture
def folder(tmp_path):
    """The muscle of the two-joint arm with its whole length on the tendon."""
    shipped = (shipped_rigs() / "two_joint_arm" / "params.toml").read_text(encoding="utf-8")
    muscle = shipped[shipped.index("[muscle.mounting]") : shipped.index("[native]")]
    at_zero = 'length_at_zero = { value = 220, unit = "mm"'
    assert at_zero in muscle
    (tmp_path / "bench.xml").write_text(MJCF, encoding="utf-8")
    (tmp_path / "params.toml").write_text(
        'schema = "pamsim-rig/1"\n[rig]\nname = "bench"\nmjcf = "bench.xml"\n'
        f'[muscles]\nlifter = {{ tendon = "line" }}\n'
        f"{muscle.replace(at_zero, at_zero.replace('220', '0'))}\n[native]\n{DAMPING}\n",
        encoding="utf-8",
    )
    return tmp_path


def lift(rig):
    step = pressure_step([1e5], [2.5e5], duration=1.0, sample_rate=100.0, name="lift_1")
    return pamsim.simulate(rig, step).completed()


def test_at_rest_the_muscle_carries_the_weight(folder):
    rig = pamsim.load_rig(folder)
    assert rig.joints == {"rail": "position"}
    hanging = pamsim.simulate(rig, pressure_step([2e5], [2e5], duration=0.01)).completed()
    assert hanging.tension[-1, 0] == pytest.approx(WEIGHT, rel=1e-6)
    rising = lift(rig)
    assert rising.signal("rail.position")[-1] > rising.signal("rail.position")[0] + 0.02
    assert "rail 20.1" in rising.summary()
    assert rising.columns()["rail_mm"] == pytest.approx(1e3 * rising.angle)


def test_the_carriage_follows_a_machine_and_shows_what_that_takes(folder):
    """A body without children, whose inertia the engine does not compute again."""
    rig = pamsim.load_rig(folder)
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


def test_numbers_of_a_joint_that_slides_are_in_newtons_and_kilograms(folder):
    rig = pamsim.load_rig(folder)
    assert rig_parameter(rig, "joint.rail.damping").spec.unit == "N*s/m"
    assert rig.model.joint("rail").damping[0] == 20.0
    units = {
        f: rig_parameter(rig, f"joint.rail.{f}").spec.unit for f in ("frictionloss", "armature")
    }
    assert units == {"frictionloss": "N", "armature": "kg"}
    text = (folder / "params.toml").read_text(encoding="utf-8")
    (folder / "params.toml").write_text(text.replace("N*s/m", "N*m*s/rad"), encoding="utf-8")
    with pytest.raises(InputError, match=r"rail\.damping: unit .* converts to 'N\*s/m'"):
        pamsim.load_rig(folder)


def test_its_recording_is_identified_without_naming_columns(folder, tmp_path):
    rising = lift(pamsim.load_rig(folder))
    noise = np.random.default_rng(2).normal(0.0, 1e-5, rising.positions.shape)
    dataclasses.replace(rising, positions=rising.positions + noise).save(tmp_path / "log", folder)
    found = pamsim.identify(tmp_path / "log")
    assert (found.inputs[0].text, found.output.text) == ("lifter_set_kpa", "rail_mm")
