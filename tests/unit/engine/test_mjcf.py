"""What is only seen is left out of a rig's model, and nothing else."""

import mujoco
import numpy as np

import pamsim
from pamsim.engine.mjcf import contacts, leave_out_visual_geoms, may_collide

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
    leave_out_visual_geoms(spec)
    model = spec.compile()
    assert model.body("lead").mass[0] > 0.0
    return [model.geom(i).name for i in range(model.ngeom)]


def test_what_collides_or_is_named_elsewhere_stays_and_all_where_something_may_look_at_them():
    assert left() == ["bumper"]
    pair = '<contact><pair geom1="screw" geom2="bench"/></contact>'
    assert left(pair) == ["bench", "screw", "bumper"]
    for watched in (
        '<option density="1.2"/>',
        '<sensor><framepos objtype="geom" objname="screw"/></sensor>',
    ):
        assert len(left(watched)) == 4


def test_a_run_is_the_same_with_and_without_visual_geoms():
    step = pamsim.pressure_step((300e3, 200e3), (450e3, 50e3), duration=0.4, load=1.2)
    plain, seen = pamsim.load_rig("mas20_arm"), pamsim.load_rig("mas20_arm", scene=True)
    assert plain.model.ngeom == 0
    assert seen.model.ngeom > 70
    one, other = pamsim.simulate(plain, step), pamsim.simulate(seen, step)
    for name in ("angle", "velocity", "pressure", "tension"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name


FLEX = """
<mujoco>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 0.1" contype="0" conaffinity="0"/>
    <flexcomp name="cloth" type="grid" count="3 3 1" spacing="0.05 0.05 0.05" pos="0 0 0.001"
      radius="0.01" dim="2" mass="0.1"><contact selfcollide="none"/></flexcomp>
    <body name="ball" pos="0 0 0.01"><freejoint/><geom name="ball" size="0.02" {}/></body>
  </worldbody>
</mujoco>
"""


def test_models_with_a_flex_may_collide_and_its_contacts_are_named():
    off = mujoco.MjModel.from_xml_string(FLEX.format('contype="0" conaffinity="0"'))
    assert not off.geom_contype.any()
    assert may_collide(off)
    touching = mujoco.MjModel.from_xml_string(FLEX.format(""))
    here = mujoco.MjData(touching).qpos[np.newaxis, :1]
    assert contacts(touching, [0], here) == {("ball", "cloth"): 1}
    bare = mujoco.MjModel.from_xml_string("<mujoco/>")
    assert not may_collide(bare)
