"""The model that `mujoco_warp` is given has all numbers of the rig's."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.gpu.engine_model import engine_model

RIG = pamsim.load_rig("mas20_arm").with_parameters(
    {"joint.shaft.frictionloss": 0.4, "tendon.chain_1.coef": 0.014, "passive.stiffness": 1.1e4}
)


def test_it_has_the_numbers_of_the_rig_and_no_plugin():
    model = RIG.model_for(load=2.0, timestep=1e-3, integrator="implicitfast")
    bare = engine_model(RIG, model)
    assert (bare.nplugin, model.nplugin) == (0, 1)
    assert (bare.actuator_biastype == mujoco.mjtBias.mjBIAS_USER).all()
    checked = 0
    for name in dir(model):
        value = getattr(model, name)
        if isinstance(value, np.ndarray) and value.dtype.kind == "f":
            assert np.array_equal(getattr(bare, name), value), name
            checked += 1
    assert checked > 100
    for name in ("timestep", "integrator", "noslip_iterations", "iterations", "cone"):
        assert getattr(bare.opt, name) == getattr(model.opt, name), name
    assert bare.stat.meaninertia == model.stat.meaninertia
    off = int(bare.opt.disableflags)
    assert not off & mujoco.mjtDisableBit.mjDSBL_AUTORESET
    assert not off & mujoco.mjtDisableBit.mjDSBL_ACTUATION


def test_an_integrator_without_counterpart_is_refused():
    with pytest.raises(InputError, match="no integrator implicit on a GPU"):
        engine_model(RIG, RIG.model_for(integrator="implicit"))
