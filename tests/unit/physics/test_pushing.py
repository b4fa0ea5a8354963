"""Actuators that push: bellows and pistons on a joint that slides, or beside a muscle."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import pamsim
from pamsim.engine.parameters import rig_parameter
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.effective_area import Stroke
from pamsim.physics.friction import dry_friction
from pamsim.physics.hysteresis.bouc_wen import BoucWen
from pamsim.physics.record import COMMON, pack
from pamsim.physics.step_limits import bristle_stiffness
from tests.unit.core.refusals import refused
from tests.unit.physics.flat import (
    charged_air_state,
    kernel,
    parameter_slot,
    static_muscle,
)
from tests.unit.physics.muscles import bellows, make

AREA, STIFFNESS, FREE, DAMPING, MASS = 5e-4, 300.0, 0.10, 12.0, 0.4
GRAVITY = 9.81
MJCF = """<mujoco><option timestep="0.0005" integrator="implicitfast"/>
  <default><geom mass="0" contype="0" conaffinity="0" size="0.01"/></default>
  <worldbody><body><joint name="rod" type="slide" axis="0 0 1"/>
    <inertial pos="0 0 0" mass="0.4" diaginertia="1e-4 1e-4 1e-4"/><geom/></body>
    <body pos="1 0 0"><joint name="flap" type="hinge" axis="0 1 0"/>
    <inertial pos="0 0 0" mass="0.1" diaginertia="1e-3 1e-3 1e-3"/><geom/></body></worldbody>
  <tendon><fixed name="cable"><joint joint="flap" coef="0.02"/></fixed></tendon></mujoco>
"""
PARAMS = """schema = "pamsim-rig/1"
[rig]
name = "lift"
mjcf = "lift.xml"
joints = ["rod"]
[muscles]
bellows = { joint = "rod" }
[muscle.mounting]
length_at_zero = { value = 80, unit = "mm", source = "assumed" }
[muscle.stroke]
nominal_length = { value = 100, unit = "mm", source = "assumed" }
damping = { value = 12, unit = "N*s/m", source = "assumed" }
[muscle.force]
law = "effective_area"
area = { value = 5, unit = "cm^2", source = "assumed" }
stiffness = { value = 300, unit = "N/m", source = "assumed" }
[muscle.chamber]
polytropic_index = { value = 1.2, unit = "1", source = "assumed" }
temperature = { value = 293, unit = "K", source = "assumed" }
dead_volume = { value = 30, unit = "cm^3", source = "assumed" }
[muscle.valve]
conductance_fill = { value = 0.05, unit = "dm^3/(s*bar)", source = "assumed" }
conductance_exhaust = { value = 0.05, unit = "dm^3/(s*bar)", source = "assumed" }
critical_ratio = { value = 0.3, unit = "1", source = "assumed" }
supply_pressure = { value = 200, unit = "kPa", source = "assumed" }
"""


def lift(folder, text=PARAMS):
    (folder / "lift.xml").write_text(MJCF, encoding="utf-8")
    (folder / "params.toml").write_text(text, encoding="utf-8")
    return pamsim.load_rig(folder)


def test_it_pushes_with_the_pressure_on_its_area_less_spring_and_damper():
    row = pack(bellows(1.0)).tolist()
    act = [0.0] * COMMON
    for stroke, pressure in ((0.06, 2e4), (0.13, 5e4), (0.1, -2e4)):
        tendon = stroke - 0.08
        wanted = pressure * AREA - STIFFNESS * (stroke - FREE)
        assert static_muscle.static_force(row, tendon, pressure) == pytest.approx(-wanted)
        act[-1] = charged_air_state(row, act, tendon, pressure)
        moving = kernel.tension(row, act, tendon, 0.3)
        assert moving == pytest.approx(-wanted + 0.3 * DAMPING, rel=1e-9)


def test_it_alone_pushes_and_has_no_names_without_meaning():
    assert [name for name, law in FORCE_LAWS.items() if law.pushes] == ["effective_area"]
    muscle, actuator = make(), bellows(1.0)
    row = pack(muscle).tolist()
    slack = muscle.braided.nominal_length * 0.5 - muscle.mounting.length_at_zero
    force = static_muscle.static_force(row, slack, 1e5)
    assert force < 0.0 == static_muscle.limited(row, force)
    for name in ("braid.diameter", "passive.stiffness", "threshold.pressure", "chain.backlash"):
        with refused("no muscle parameter"):
            parameter_slot(actuator, name)
    with refused("no muscle parameter"):
        parameter_slot(muscle, "stroke.damping")
    with refused("needs a stroke"):
        bellows(1.0, braid=muscle.braid)
    with refused("needs a braid"):
        make(stroke=Stroke(nominal_length=0.1))


def test_its_friction_and_its_hysteresis_grow_with_its_push():
    """Compressed it pushes more than at rest, as whatever loses energy does."""
    friction = dataclasses.replace(make().friction, tension_share=0.1)
    push = bellows(1.0, friction=friction)
    weak, strong = (bristle_stiffness(push, 0.02, pressure) for pressure in (1e4, 1e5))
    more = 0.1 * AREA * 9e4 / friction.presliding
    assert strong - weak == pytest.approx(more, rel=1e-9)
    pushed, pulled = (dry_friction(friction, 0.0, pull, 0.1, 1.0) for pull in (-30.0, 30.0))
    assert pushed == pulled > 0.0
    loop = BoucWen(yield_contraction=0.005, sigma=0.5, sharpness=1.0, force_share=0.1)
    row = pack(bellows(1.0, hysteresis=loop)).tolist()
    at_rest = [0.0] * (COMMON + 1)
    at_rest[-1] = charged_air_state(row, at_rest, 0.02, 5e4)
    free, held = (kernel.tension(row, [z, *at_rest[1:]], 0.02) for z in (0.0, 0.8))
    assert free == pytest.approx(-AREA * 5e4)
    assert held == pytest.approx(1.08 * free, rel=1e-6)


def test_it_lifts_a_weight_to_where_its_forces_balance(tmp_path):
    rig = lift(tmp_path)
    assert rig.joints == {"rod": "position"}
    experiment = pamsim.pressure_step((1e4,), (4e4,), duration=4.0, sample_rate=50.0)
    fast = pamsim.simulate(rig, experiment).completed()
    height = fast.signal("rod.position")[-1]
    push = AREA * fast.signal("bellows.pressure")[-1]
    assert height + 0.08 - FREE == pytest.approx((push - MASS * GRAVITY) / STIFFNESS, abs=1e-5)
    assert fast.signal("bellows.force")[-1] == pytest.approx(-MASS * GRAVITY, rel=1e-3)
    brief = dataclasses.replace(experiment, duration=0.2, settle=0.2)
    both = (pamsim.simulate(rig, brief, backend=name) for name in ("compiled", "python"))
    one, other = (run.signal("rod.position") for run in both)
    np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-12)


def test_a_rig_file_asks_only_for_what_a_bellows_has(tmp_path):
    ends = '[muscle.end_shape]\nloss = { value = 0.1, unit = "1", source = "assumed" }\n'
    rod = 'joint = "rod" }'
    for text, words in (
        (PARAMS + ends, "'end_shape' has no meaning"),
        (PARAMS.replace("[muscle.stroke]", "[muscle.nothing]", 1), "unknown group"),
        (PARAMS.replace(rod, 'joint = "flap" }'), "does not slide"),
        (PARAMS.replace(rod, 'joint = "rodd" }'), "no joint 'rodd'"),
        (PARAMS.replace(rod, 'joint = "rod", tendon = "cable" }'), "keep one of them"),
    ):
        with refused(words):
            lift(tmp_path, text)


def test_a_muscle_and_a_bellows_share_what_both_have(tmp_path):
    """Shared groups serve those that can have them; a parameter is set where it exists."""
    text = PARAMS.replace(
        '[muscles]\nbellows = { joint = "rod" }', '[muscles.bellows]\njoint = "rod"'
    )
    for group in ("stroke", "force"):
        text = text.replace(f"[muscle.{group}]", f"[muscles.bellows.{group}]")
    text += """[muscles.cord]
tendon = "cable"
[muscles.cord.force]
law = "ideal_mckibben"
[muscle.braid]
nominal_length = { value = 100, unit = "mm", source = "assumed" }
diameter = { value = 10, unit = "mm", source = "assumed" }
fibre_angle = { value = 25, unit = "deg", source = "assumed" }
"""
    rig = lift(tmp_path, text)
    assert rig.muscles["bellows"].braid is None
    assert rig.muscles["cord"].stroke is None
    changed = rig.with_parameters({"braid.friction": 1e-4, "stroke.damping": 3.0})
    assert changed.muscles["cord"].braided.friction == 1e-4
    assert changed.muscles["bellows"].stroke.damping == 3.0
    assert rig_parameter(rig, "stroke.damping").value == DAMPING
    assert rig_parameter(rig, "braid.diameter").value == pytest.approx(0.01)
    with refused("stroke.damping"):
        rig.with_parameters({"cord:stroke.damping": 3.0})
