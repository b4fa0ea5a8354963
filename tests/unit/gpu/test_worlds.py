"""Worlds of a rig against the engine on the CPU."""

import dataclasses
import math
import sys

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.engine.batch import simulate_batch
from pamsim.engine.simulate import prepare
from pamsim.gpu.simulate_worlds import simulate_worlds
from pamsim.gpu.worlds import Worlds, engine_model
from pamsim.physics.record import slot
from pamsim.recordings.recording import Outcome

RIG = pamsim.load_rig("mas20_arm")
VARIED = (
    RIG,
    RIG.with_parameters(
        {
            "passive.stiffness": 12e3,
            "joint.shaft.damping": 3.0,
            "joint.shaft.quadratic_damping": 2.0,
        }
    ),
    RIG.with_parameters({"joint.shaft.frictionloss": 0.3, "muscle_1:braid.nominal_length": 0.252}),
    RIG.with_parameters({"valve.delay": 0.0, "creep.stiffness": 3e3, "creep.relaxation_time": 0.2}),
)
LOADS = (1.2, 1.2, 0.0, 2.0)
CHANGED = RIG.with_parameters(
    {"joint.shaft.frictionloss": 0.4, "tendon.chain_1.coef": 0.014, "passive.stiffness": 1.1e4}
)


def step(load=1.2, end=1e5, **changes):
    values = {"duration": 0.6, "load": load, "sample_rate": 100.0, **changes}
    return pamsim.pressure_step((3e5, 3e5), (3e5, end), **values)


def two_at_rest():
    """A run, its data at rest, and two worlds in that state."""
    run = prepare(RIG, step())
    data = mujoco.MjData(run.model)
    pamsim.reset(run.model, data, [3e5, 3e5])
    worlds = Worlds(RIG, run.model, 2, device="cpu")
    worlds.put(dict.fromkeys((0, 1), (run.model, pamsim.save_state(run.model, data))))
    return run, data, worlds


@pytest.fixture(scope="module")
def responses():
    """Four arms with parameters, loads and commands of their own, on the CPU and as worlds."""
    ends = (1e5, 2.4e5, 2.2e5, 3.6e5)  # the last three are reached
    jobs = [(r, step(*rest)) for r, *rest in zip(VARIED, LOADS, ends, strict=True)]
    return simulate_batch(jobs, threads=1), simulate_worlds(jobs, device="cpu", threads=1)


@pytest.mark.slow
def test_a_step_response_is_that_of_the_engine(responses):
    for own, other in zip(*responses, strict=True):
        assert other.outcome is Outcome.COMPLETED
        assert np.ptp(own.angle) > math.radians(0.2)
        assert np.degrees(np.abs(other.angle - own.angle).max()) < 0.001  # 0.05 is asked for
        assert np.abs(other.pressure - own.pressure).max() < 0.5
        assert np.abs(other.tension - own.tension).max() < 0.02
        assert other.time == pytest.approx(own.time, abs=1e-12)
        assert other.command == pytest.approx(own.command)
        assert (other.drive, other.load, other.muscles) == (own.drive, own.load, own.muscles)
    ends = np.degrees([run.angle[-1] for run in responses[1]])
    assert np.diff(np.sort(ends)).min() > 0.1


@pytest.mark.slow
def test_in_single_precision_too(responses):
    given = [(VARIED[0], step())]
    (single,) = simulate_worlds(given, device="cpu", precision="float32", threads=1)
    assert np.degrees(np.abs(single.angle - responses[0][0].angle).max()) < 0.005
    assert np.abs(single.pressure - responses[0][0].pressure).max() < 50.0


@pytest.mark.slow
def test_a_state_goes_on_where_it_was_taken():
    """In the other engine as well, to single precision; and in any order of steps."""
    run, data, worlds = two_at_rest()
    command = np.array([[3e5, 1e5], [1e5, 3e5]])
    worlds.step(command, 40)
    half = worlds.state(0)
    worlds.step(command, 40)
    after = worlds.read()
    worlds.put({1: (run.model, half)})
    worlds.step(command[[0, 0]], 40)
    assert worlds.read().position[1] == pytest.approx(after.position[0], rel=1e-12)
    pamsim.restore_state(run.model, data, half)
    data.ctrl[:] = command[0]
    mujoco.mj_step(run.model, data, 40)
    assert data.qpos == pytest.approx(after.position[0], abs=1e-6)
    assert data.time == pytest.approx(0.04)
    assert worlds.time == pytest.approx([0.06, 0.04])


@pytest.mark.slow
def test_a_world_that_breaks_down_ends_alone(monkeypatch):
    """Its valves open to a supply without pressure, by which a flow is divided."""

    def without_supply(worlds, states):
        put(worlds, states)
        rows = worlds._arrays["par"].numpy()
        rows[0, :, slot("valve.supply_pressure")] = -rows[0, :, slot("chamber.atmosphere")]
        rows[0, :, slot("valve.conductance_exhaust")] = np.nan
        worlds._arrays["par"].assign(rows)

    put = Worlds.put
    monkeypatch.setattr(Worlds, "put", without_supply)
    bad, good = simulate_worlds([(RIG, step())] * 2, device="cpu", threads=1)
    assert good.outcome is Outcome.COMPLETED
    assert bad.outcome is Outcome.NOT_FINITE
    assert 0 < len(bad.angle) < len(good.angle)
    assert np.isfinite(bad.pressure).all()
    assert "broke down" in bad.message


def test_the_model_of_the_worlds_has_the_numbers_of_the_rig_and_no_plugin():
    model = CHANGED.model_for(load=2.0, timestep=1e-3, integrator="implicitfast")
    bare = engine_model(CHANGED, model)
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
    with pytest.raises(InputError, match="no integrator implicit on a GPU"):
        engine_model(CHANGED, CHANGED.model_for(integrator="implicit"))


def test_what_does_not_run_is_refused(monkeypatch):
    sagging = RIG.with_parameters({"valve.supply_resistance": 1e7})
    geared = RIG.with_parameters({"tendon.chain_1.coef": 0.014})
    late = RIG.with_parameters({"valve.delay": 0.00123})
    smooth = RIG.with_parameters(
        {"joint.shaft.frictionloss": 0.4, "joint.shaft.friction_speed": 0.5}
    )
    slipping = RIG.with_parameters({"hysteresis.maxwell_slip.elements": 3})
    first = slipping.with_parameters({"muscle_1:hysteresis.elements": 5})
    second = slipping.with_parameters({"muscle_2:hysteresis.elements": 5})
    approaching = dataclasses.replace(step(), approach=0.05)
    for jobs, options, message in (
        ([(RIG, step()), (smooth, step())], {}, "world 1 has another form of dry friction"),
        ([(first, step()), (second, step())], {}, "job 1 has another number of states"),
        ([(RIG, approaching)], {}, "an approach at rest"),
        ([(RIG, step())], {"precision": "float16"}, "no precision 'float16'"),
        ([(RIG, step()), (RIG, step(duration=0.7))], {}, "job 1 has another duration"),
        ([(RIG, step(end=9e6))], {}, "above its supply"),
        ([(sagging, step())], {"precision": "float32"}, "needs more than single precision"),
        ([(RIG, step()), (geared, step())], {}, "world 1 has another wrap_prm than the first"),
        ([(late, step())], {}, "valve.delay that is no whole number of time steps"),
    ):
        with pytest.raises(InputError, match=message):
            simulate_worlds(jobs, device="cpu", threads=1, **options)
    assert simulate_worlds([]) == []
    model = prepare(RIG, step()).model
    with pytest.raises(InputError, match=r"no device 'gpu'; Warp finds: cpu"):
        Worlds(RIG, model, 2, device="gpu")
    with pytest.raises(InputError, match="world 0 has no state"):
        Worlds(RIG, model, 2, device="cpu").step(np.zeros((2, 2)))
    monkeypatch.setitem(sys.modules, "warp", None)
    with pytest.raises(InputError, match=r"pip install 'pamsim\[gpu\]'"):
        Worlds(RIG, model, 1)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["muscle_bench", "two_joint_arm", "equimus_leg"])
def test_other_rigs_move_as_in_the_engine(name):
    """With one muscle, with two joints, with spatial tendons and actuators that push."""
    rig = pamsim.load_rig(name)
    start = np.full(len(rig.muscles), 0.25 * rig.supply_pressure)
    final = np.where(np.arange(len(start)) % 2, start, 1.6 * start)
    move = pamsim.pressure_step(start.tolist(), final.tolist(), duration=0.3, sample_rate=100.0)
    own = pamsim.simulate(rig, move).completed()
    (other,) = simulate_worlds([(rig, move)], device="cpu", threads=1)
    assert np.ptp(own.positions, axis=0).max() > 5e-3
    assert other.positions == pytest.approx(own.positions, abs=5e-6)
    assert other.tension == pytest.approx(own.tension, abs=0.02)
