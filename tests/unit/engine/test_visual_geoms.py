"""What is only seen is left out of a rig's model, and nothing else."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.engine.visual_geoms import remove_visual_geoms

ARM = """<mujoco><worldbody>
<geom name="bench" size="1 1 .1" type="box" contype="0" conaffinity="0"/>
<body name="arm"><inertial pos="0 0 -.1" mass="1" diaginertia=".01 .01 .01"/>
  <joint name="hinge" axis="0 1 0"/>
  <geom name="screw" size=".1" contype="0" conaffinity="0"/>
  <geom name="bumper" size=".1"/>
  <body name="lead"><geom name="weight" size=".1" contype="0" conaffinity="0"/></body>
</body></worldbody>{more}</mujoco>"""


def left(more=""):
    spec = mujoco.MjSpec.from_string(ARM.format(more=more))
    remove_visual_geoms(spec)
    return [geom.name for geom in spec.geoms]


def test_what_collides_or_weighs_stays():
    assert left() == ["bumper", "weight"]


@pytest.mark.parametrize(
    "more",
    [
        '<option density="1.2"/>',
        '<sensor><framepos objtype="geom" objname="screw"/></sensor>',
        '<contact><pair geom1="screw" geom2="bench"/></contact>',
    ],
)
def test_all_stay_where_something_may_look_at_them(more):
    assert len(left(more)) == 4


def test_a_run_is_the_same_with_and_without_visual_geoms():
    step = pamsim.pressure_step((300e3, 200e3), (450e3, 50e3), duration=0.4, load=1.2)
    plain, seen = pamsim.load_rig("mas20_arm"), pamsim.load_rig("mas20_arm", scene=True)
    assert plain.model.ngeom == 0
    assert seen.model.ngeom > 70
    one, other = pamsim.simulate(plain, step), pamsim.simulate(seen, step)
    for name in ("angle", "velocity", "pressure", "tension"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
