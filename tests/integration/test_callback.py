"""Muscles in the engine: the same numbers on every path, and no number where there is none."""

import copy
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from mujoco import rollout
from mujoco.batch import Batch

import pamsim
from pamsim.core.errors import EngineError, InputError
from pamsim.engine import muscle_step
from pamsim.engine.state import charge
from pamsim.physics.record import slot
from tests.both_backends import both_backends

BACKENDS = ("compiled", "python")


def charged(rig, load=0.0, command="valve"):
    model = rig.model_for(load=load, command=command)
    data = mujoco.MjData(model)
    pamsim.reset(model, data, (3e5, 2e5))
    return model, data


def drive(model, data, steps, seed=0):
    """Step with a random command every 20 steps; returns the path of the full state."""
    commands = np.random.default_rng(seed).uniform(-1, 1, (steps // 20, model.nu))
    path = []
    for command in commands:
        data.ctrl[:] = command
        mujoco.mj_step(model, data, 20)
        path.append(pamsim.save_state(model, data))
    return np.array(path)


def test_compiled_and_python_steps_agree_on_pulses(rig):
    """On openings and set points as well, in the tests of effects and of laws."""
    experiment = pamsim.Experiment(
        drive="pulse",
        command_time=np.array([0.0, 0.08, 0.14]),
        command_value=np.array([[0.6, -1.0], [0.0, 0.3], [-0.5, 0.0]]),
        start_pressure=np.array([3e5, 3e5]),
        duration=0.2,
        settle=0.1,  # Python is slow
        load=2.14,
    )
    assert np.ptp(both_backends(rig, experiment).angle) > 1e-3


def stepped(model, data):
    mujoco.mj_step(model, data, 40)


def stepped_in_halves(model, data):
    for _ in range(40):
        mujoco.mj_step1(model, data)
        mujoco.mj_step2(model, data)


def forward_and_euler(model, data):
    for _ in range(40):
        mujoco.mj_forward(model, data)
        mujoco.mj_Euler(model, data)


def rolled_out(model, data):
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, start, kind)
    controls = np.tile(data.ctrl, (40, 1))
    states, _ = rollout.rollout(model, mujoco.MjData(model), start, controls)
    mujoco.mj_setState(model, data, np.reshape(states, (40, -1))[-1], kind)


def in_another_thread(model, data):
    with ThreadPoolExecutor(1) as pool:
        pool.submit(stepped, model, data).result()


def on(twin, model, data):
    other = mujoco.MjData(twin)
    pamsim.restore_state(twin, other, pamsim.save_state(model, data))
    stepped(twin, other)
    pamsim.restore_state(model, data, pamsim.save_state(twin, other))


def on_a_copy(model, data):
    on(copy.deepcopy(model), model, data)


def on_a_saved_model(model, data):
    buffer = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    saved = {"saved.mjb": buffer.tobytes()}
    on(mujoco.MjModel.from_binary_path("saved.mjb", saved), model, data)


def under_callbacks_of_another_library(model, data):
    setters = [getattr(mujoco, f"set_mjcb_act_{name}") for name in ("dyn", "gain", "bias")]
    for setter in setters:
        setter(lambda *_: 1e3)
    try:
        stepped(model, data)
    finally:
        for setter in setters:
            setter(None)


def test_every_path_of_the_engine_gives_the_same_numbers(rig):
    other, expected = charged(rig, load=1.2)
    expected.ctrl[:] = (0.5, -0.5)
    with pamsim.live(other):
        stepped(other, expected)
    assert abs(expected.qpos[0]) > 1e-4
    for advance in (
        stepped, stepped_in_halves, forward_and_euler, rolled_out, in_another_thread, on_a_copy,
        on_a_saved_model, under_callbacks_of_another_library,
    ):  # fmt: skip
        model, data = charged(rig, load=1.2)
        data.ctrl[:] = (0.5, -0.5)
        advance(model, data)
        assert data.qpos.tolist() == expected.qpos.tolist(), advance.__name__
        assert data.act.tolist() == expected.act.tolist(), advance.__name__


def test_runs_in_many_threads_equal_those_one_after_the_other(rig):
    fills = np.linspace(1e-9, 3e-9, 6)
    rigs = [rig.with_parameters({"valve.conductance_fill": fill}) for fill in fills]
    experiment = pamsim.pressure_step((2e5, 2e5), (4e5, 1e5), duration=0.1)

    def run(each):
        return pamsim.simulate(each, experiment).completed().angle.tolist()

    alone = [run(each) for each in rigs]
    with ThreadPoolExecutor(6) as pool:
        together = list(pool.map(run, rigs * 4))
    assert together == alone * 4


@pytest.fixture(scope="module")
def written(rig, tmp_path_factory):
    """A model written as MJCF, which keeps six digits of each parameter."""
    spec = mujoco.MjSpec.from_file(str(rig.file.mjcf))
    tendon = next(iter(rig.file.tendons.values()))
    pamsim.attach(spec, tendon=tendon, muscle=rig.muscles["muscle_1"], name="puller")
    pamsim.compile_model(spec)
    path = tmp_path_factory.mktemp("mjcf") / "model.xml"
    path.write_text(spec.to_xml(), encoding="utf-8")
    return str(path)


OTHER_CALLBACK = """
import mujoco, pamsim
rig = pamsim.load_rig("mas20_arm")
data = mujoco.MjData(rig.model)
mujoco.set_mjcb_passive(lambda model, data: None)
mujoco.mj_forward(rig.model, data)
print(data.actuator_force)
"""


def test_where_muscles_cannot_be_evaluated_a_process_gets_no_number_and_never_zero(written):
    alone = f"import mujoco; mujoco.MjModel.from_xml_path({written!r})"
    for script, code, out, err in (
        (alone, 1, "", "pamsim.muscle"),
        (OTHER_CALLBACK, 0, "[nan nan]\n", "pamsim: the muscles cannot be evaluated"),
    ):
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
        assert (done.returncode, done.stdout) == (code, out)
        assert err in done.stderr
        assert code or "Traceback" not in done.stderr


def test_a_model_that_was_written_as_mjcf_is_refused_and_never_without_force(written):
    with pamsim.checks(False):  # the engine makes a step to try it, to where nothing is a number
        model = mujoco.MjModel.from_xml_path(written)
    data = mujoco.MjData(model)
    for refused in (
        lambda: pamsim.reset(model, data, 2e5),
        lambda: pamsim.pressures(model, data),
        *(lambda b=b: pamsim.live(model, backend=b).__enter__() for b in BACKENDS),
    ):
        with pytest.raises(EngineError, match=r"'puller' .* six digits: load the rig with"):
            refused()
    data.act[:] = 1.0
    with pamsim.checks(False):
        for evaluate in (mujoco.mj_forward, mujoco.mj_step):
            evaluate(model, data)
            assert np.isnan(data.actuator_force).all()


def test_muscles_of_a_group_that_is_switched_off_neither_pull_nor_change(rig):
    model, data = charged(rig)
    data.ctrl[:] = (0.5, 0.5)
    model.actuator_group[0] = 3
    model.opt.disableactuator = 1 << 3
    for backend in BACKENDS:
        before = data.act.copy()
        with pamsim.live(model, backend=backend):
            mujoco.mj_step(model, data, 3)
        assert data.actuator_force[0] == 0.0
        assert data.actuator_force[1] < 0.0
        changed, size = data.act != before, model.actuator_actnum[0]
        assert (changed[:size].any(), changed[size:].any()) == (False, True)


@pytest.mark.parametrize("command", ["valve", "pressure_set"])
def test_after_a_reset_of_the_engine_alone_the_chambers_are_at_the_atmosphere(rig, command):
    model, data = charged(rig, command=command)
    ends = []
    for backend in BACKENDS:
        mujoco.mj_resetData(model, data)
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(pamsim.pressures(model, data), 0.0, atol=1e-6)
        with pamsim.live(model, backend=backend):
            for _ in range(20):
                mujoco.mj_step(model, data)
                assert np.isfinite(data.actuator_force).all()
        ends.append(pamsim.save_state(model, data))
    # The arm has moved a little, and shut valves keep the air in.
    assert np.all(data.act[model.actuator_actadr + model.actuator_actnum - 1] > 0.0)
    assert np.abs(pamsim.pressures(model, data)).max() < 5e3
    assert np.array_equal(*ends) or sys.platform != "linux"
    np.testing.assert_allclose(*ends, rtol=1e-9, atol=1e-12)


def test_charging_forgets_the_hysteresis_of_before(rig):
    model, data = charged(rig)
    with pamsim.live(model):
        drive(model, data, 200)
    memory = model.actuator_actadr  # of the operators; the states that all have follow
    assert np.all(data.act[memory] != 0.0)
    charge(model, data, 1e5)
    assert np.all(data.act[memory] == 0.0)
    np.testing.assert_allclose(pamsim.pressures(model, data), 1e5)


def test_a_run_that_was_saved_continues_bit_equal(rig):
    model, data = charged(rig, load=2.14)
    with pamsim.live(model):
        drive(model, data, 400)
        saved = pamsim.save_state(model, data)
        straight = drive(model, data, 600, seed=1)
        other = mujoco.MjData(model)
        pamsim.restore_state(model, other, saved)
        assert np.array_equal(straight, drive(model, other, 600, seed=1))
        pamsim.restore_state(model, other, saved.tolist())
        with pytest.raises(InputError, match=rf"shape \(3,\), this model's is \({saved.size},\)"):
            pamsim.restore_state(model, other, [0.0, 1.0, 2.0])


@pytest.mark.parametrize(
    ("before", "after", "refused"),
    [
        ("measured", "valve", True),
        ("measured", "pressure_set", True),
        ("pressure_set", "measured", True),
        ("pressure_set", "valve", True),
        ("pressure_set", "sealed", True),
        ("valve", "sealed", False),
    ],
)
def test_a_run_does_not_go_on_where_its_states_would_mean_something_else(
    rig, before, after, refused
):
    lagging = rig.with_parameters({"valve.line_lag": 0.05})
    step = pamsim.pressure_step((3e5, 3e5), (3e5, 2e5), duration=0.02)
    shut = replace(step, command_value=0.0 * step.command_value)
    first, second = (
        replace(shut if drive in ("valve", "sealed") else step, drive=drive)
        for drive in (before, after)
    )
    part = pamsim.simulate(lagging, first).completed()
    if refused:
        with pytest.raises(InputError, match=r"\Afrom_state: muscle 'muscle_1' had another drive"):
            pamsim.simulate(lagging, second, from_state=part.final_state)
    else:
        rest = pamsim.simulate(lagging, second, from_state=part.final_state).completed()
        assert rest.pressure[0] == pytest.approx(part.pressure[-1], rel=1e-9)


OTHER = """
<mujoco><worldbody><body><joint name="j" damping="0.1"/><geom size="0.1"/></body></worldbody>
<actuator><muscle joint="j" name="m" lengthrange="-1 1"/>
<general joint="j" dyntype="user" gaintype="user" biastype="user" actdim="2" user="1 2 3"/>
<general joint="j" dyntype="user" gaintype="user" biastype="user" actdim="1"/>
</actuator></mujoco>
"""


def test_another_model_in_the_same_process_is_unaffected(rig):
    model = mujoco.MjModel.from_xml_string(OTHER)

    def run():
        data = mujoco.MjData(model)
        data.act[:] = [0.3, 0.1, 0.2, 0.4]
        data.ctrl[:] = [0.7, 0.4, 0.5]
        mujoco.mj_step(model, data, 500)
        return np.concatenate([data.qpos, data.qvel, data.act])

    alone = run()
    ours, data = charged(rig)
    for backend in BACKENDS:
        with pamsim.live(ours, backend=backend):
            mujoco.mj_step(ours, data, 5)
            assert np.array_equal(run(), alone), backend
    assert np.array_equal(run(), alone)


def test_the_engine_s_timers_run_beside_our_models_and_a_clock_of_somebody_else_stays(rig):
    model, data = charged(rig)
    with pamsim.live(model):
        mujoco.mj_step(model, data, 20)
        assert mujoco.get_mjcb_time() is None
    timer = data.timer[mujoco.mjtTimer.mjTIMER_STEP]
    assert timer.number == 20
    assert timer.duration > 0.0

    def clock():
        return 1.0

    mujoco.set_mjcb_time(clock)
    try:
        with pamsim.live(model):
            assert mujoco.get_mjcb_time() is clock
        assert mujoco.get_mjcb_time() is clock
    finally:
        mujoco.set_mjcb_time(None)


def test_an_error_of_the_kernel_in_python_reaches_the_caller(rig, monkeypatch):
    model, data = charged(rig)

    def broken(*_):
        raise ZeroDivisionError("on purpose")

    monkeypatch.setattr(muscle_step, "state_rates", broken)
    with pytest.raises(ZeroDivisionError), pamsim.live(model, backend="python"):
        mujoco.mj_step(model, data)
    with pamsim.live(model, backend="compiled"):
        mujoco.mj_step(model, data)


def test_runge_kutta_an_unknown_backend_and_a_model_without_muscles_are_refused(rig):
    model, data = charged(rig)
    with pytest.raises(InputError, match="'compiled'"), pamsim.live(model, backend="compield"):
        pass
    other = mujoco.MjModel.from_xml_string(OTHER)
    with pytest.raises(InputError, match="no pamsim muscle"), pamsim.live(other):
        pass
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    with pytest.raises(EngineError, match="RK4"), pamsim.live(model):
        pass
    mujoco.mj_forward(model, data)
    assert np.isnan(data.actuator_force).all()


@pytest.mark.usefixtures("unchecked")
def test_a_step_that_evaluates_muscles_between_time_points_leaves_no_air(rig):
    """`mj_RungeKutta` may be called whatever the model's integrator is."""
    for backend in BACKENDS:
        model, data = charged(rig)
        with pamsim.live(model, backend=backend):
            mujoco.mj_step(model, data)
            assert np.isfinite(data.act).all()
            mujoco.mj_forward(model, data)
            mujoco.mj_RungeKutta(model, data, 4)
        assert np.isnan(data.act[model.actuator_actadr + model.actuator_actnum - 1]).all()


def test_every_allowed_integrator_gives_the_same_motion(rig):
    paths = []
    for integrator in ("mjINT_EULER", "mjINT_IMPLICIT", "mjINT_IMPLICITFAST"):
        model, data = charged(rig)
        with pamsim.live(model):
            model.opt.integrator = getattr(mujoco.mjtIntegrator, integrator)
            paths.append(drive(model, data, 400)[:, 1])
    np.testing.assert_allclose(paths[1:], [paths[0]] * 2, atol=2e-4)


def test_batch_gives_every_simulation_its_own_parameters(rig):
    scales, pressures = (0.5, 1.0, 1.5), (4e5, 1e5)
    index = slot("force.scale", rig.muscles["muscle_1"])
    model, data = charged(rig, command="pressure_set")
    one_by_one = []
    for scale in scales:
        single, own = charged(rig.with_parameters({"force.scale": scale}), command="pressure_set")
        own.ctrl[:] = pressures
        with pamsim.live(single):
            mujoco.mj_step(single, own, 500)
        one_by_one.append(pamsim.save_state(single, own))
    with pamsim.live(model):
        many = Batch(model, len(scales), nthread=2, persistent=True)
        many.expand("actuator_user")[:, :, index] = np.array(scales)[:, None]
        data.ctrl[:] = pressures
        many.state[:] = pamsim.save_state(model, data)
        many.step(nstep=500)
    assert np.array_equal(many.state, one_by_one)
