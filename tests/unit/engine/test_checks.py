"""The switch that checks every step: quiet where physics holds, an error where it is broken."""

import contextlib
import dataclasses

import gymnasium
import mujoco
import numpy as np
import pytest

import pamsim
import pamsim.envs  # registers the environments
from pamsim.core.errors import InvariantError
from pamsim.engine import checks, compiled, plugin
from pamsim.physics import kernel
from pamsim.physics.force_laws.pleated import SLENDERNESS_6
from pamsim.physics.record import STATE_NAMES, slot
from pamsim.recordings.recording import Outcome

STEP = dataclasses.replace(
    pamsim.pressure_step((3e5, 2e5), (4e5, 0.0), duration=0.04, load=1.2), settle=0.1
)
BACKENDS = ("compiled", "python")


def air(model, muscle=0):
    return int(model.actuator_actadr[muscle] + model.actuator_actnum[muscle] - 1)


def not_finite(model, data):
    data.act[air(model) + 1 - len(STATE_NAMES) + STATE_NAMES.index("creep")] = np.nan


def too_much_air(model, data):
    data.act[air(model)] *= 10.0


def negative_volume(model, data):
    model.actuator_user[0, slot("chamber.dead_volume")] = -1.0


def time_goes_back(model, data):
    data.time -= 5.0 * model.opt.timestep


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_state_that_cannot_be_is_an_error_with_step_muscle_and_numbers(rig, backend):
    for spoil, message in (
        (not_finite, "its creep is nan, not finite"),
        (too_much_air, "kPa follow from its supply"),
        (negative_volume, "its air .* is nan"),
        (time_goes_back, "time is .* s, not"),
    ):

        def hook(model, data, spoil=spoil):
            if abs(data.time - 0.02) < 1e-9:
                spoil(model, data)

        with pytest.raises(InvariantError, match=message) as caught:
            pamsim.simulate(rig, STEP, backend=backend, each_step=hook)
        if spoil is not time_goes_back:
            assert "muscle 'muscle_1', t = 0.0205 s (step 41 of 0.5 ms)" in str(caught.value)
        with pamsim.checks(False):
            unchecked = pamsim.simulate(rig, STEP, backend=backend, each_step=hook)
        assert isinstance(unchecked.outcome, Outcome)  # a result, whatever it is


def spoilt_rate(model, data):
    data.act_dot[air(model)] *= 1.0 + 1e-6


def pushing(model, data):
    data.actuator_force[0] = 0.1


@pytest.mark.parametrize("backend", BACKENDS)
def test_air_from_nowhere_and_a_muscle_that_pushes_are_errors(rig, backend):
    model = rig.model_for(command="valve")
    data = mujoco.MjData(model)
    # Chambers after a reset of the engine alone break nothing.
    data.ctrl[:] = (0.5, -0.5)
    with pamsim.checks(), pamsim.live(model, backend=backend):
        mujoco.mj_step(model, data, 20)
    assert data.time > 0.0
    assert pamsim.pressures(model, data)[0] > 1e3
    pamsim.reset(model, data, (3e5, 2e5))
    data.ctrl[:] = (0.5, -0.5)

    def step(spoil):
        with pamsim.live(model, backend=backend):
            mujoco.mj_forward(model, data)
            spoil(model, data)
            mujoco.mj_Euler(model, data)

    for spoil, message in ((spoilt_rate, "air gained differs"), (pushing, "is -0.1 N")):
        with pytest.raises(InvariantError, match=message):
            step(spoil)
        step(lambda model, data: None)


def test_a_kernel_that_loses_air_or_lets_muscles_push_is_noticed(rig, monkeypatch):
    step = pamsim.pressure_step((3e5, 3e5), (6e5, 0.0), duration=0.1, load=1.2)
    step = dataclasses.replace(step, settle=0.002)
    for broken, substitute, changes, message in (
        (
            "tube_step",
            lambda m, p, _, w, dt: (p, 0.9 * w),
            {"valve.tube_resistance": 2e8},
            "air gained",
        ),
        ("limited", lambda m, force: -force, {}, "it only pulls"),
    ):
        there = rig.with_parameters(changes)
        pamsim.simulate(there, step, backend="python")
        with monkeypatch.context() as patch:
            patch.setattr(kernel, broken, substitute)
            with pytest.raises(InvariantError, match=message):
                pamsim.simulate(there, step, backend="python")


def test_results_are_the_same_to_the_bit_without_checks(rig):
    """Which other tests leave on, so that every way of air balances in them."""
    there = rig.with_parameters({"valve.tube_resistance": 2e8, "chamber.heat_rate": 2.0})
    with pamsim.checks():
        checked = pamsim.simulate(there, STEP)
    with pamsim.checks(False):
        usual = compiled.step_functions()[2].address
        assert plugin.engine_entry(plugin.slot()).advance == usual  # no check is called
        unchecked = pamsim.simulate(there, STEP)
    assert np.array_equal(checked.final_state, unchecked.final_state)
    assert np.array_equal(checked.pressure, unchecked.pressure)


def test_an_environment_raises_at_the_step():
    with contextlib.closing(gymnasium.make("pamsim/Rig-v0", frame_skip=4)) as env:
        env.reset(seed=1)
        env.unwrapped.data.act[air(env.unwrapped.model)] *= 10.0
        with pytest.raises(InvariantError, match=r"actuator 0, t = .* follow from its supply"):
            env.step(env.action_space.sample())
        env.reset(seed=1)
        env.unwrapped.model.opt.timestep *= 0.5
        with pytest.raises(InvariantError, match="time went from"):
            env.step(env.action_space.sample())


def test_one_of_many_environments_raises_too():
    env = gymnasium.make_vec(
        "pamsim/Rig-v0", num_envs=3, vectorization_mode="vector_entry_point", frame_skip=4
    )
    env.reset(seed=1)
    env.step(env.action_space.sample())
    env.rigs.plant.act[1, air(env.rigs.rig.model)] = np.nan
    with pytest.raises(InvariantError, match="actuator 0"):
        env.step(env.action_space.sample())
    env.close()


@pytest.fixture
def nothing_waits():
    yield
    with contextlib.suppress(InvariantError):
        checks.raise_found()


@pytest.mark.usefixtures("nothing_waits")
def test_a_model_is_not_blamed_for_another_that_lay_at_its_address_before(rig):
    def breaks():
        model = rig.model_for(command="valve")
        data = mujoco.MjData(model)
        pamsim.reset(model, data, 2e5)
        data.ctrl[0] = np.nan
        mujoco.mj_step(model, data)
        return int(model._address)

    plugin.load_kernel()
    before = set()
    with pamsim.checks():
        for _ in range(20):
            before.add(breaks())
            model = rig.model_for(command="valve")
            data = mujoco.MjData(model)
            pamsim.reset(model, data, 2e5)
            with pamsim.live(model):
                mujoco.mj_step(model, data)
            met = int(model._address) in before
            del model, data
            if met:
                break
        else:
            pytest.skip("no address was used twice")
        with pytest.raises(InvariantError, match="actuator 0"):
            checks.raise_found()


@pytest.mark.usefixtures("nothing_waits")
def test_the_step_with_which_the_engine_tries_a_model_is_not_checked(rig):
    """A pleated muscle has no finite force at nominal length, where this one stands."""
    muscle = dataclasses.replace(rig.muscles["muscle_1"], force=SLENDERNESS_6)
    spec = mujoco.MjSpec.from_file(str(rig.file.mjcf))
    pamsim.attach(spec, tendon="chain_1", muscle=muscle)
    model = pamsim.compile_model(spec)
    with pamsim.live(model), pamsim.checks():  # the law is compiled
        pamsim.compile_model(spec)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data)
    with pytest.raises(InvariantError, match="not finite"):
        checks.raise_found()


def test_steps_outside_of_any_scope_are_raised_at_the_end_of_the_block_or_printed(rig, capsys):
    model = rig.model_for(command="valve")
    data = mujoco.MjData(model)
    pamsim.reset(model, data, 2e5)
    data.ctrl[0] = np.nan

    def block():
        with pamsim.checks():
            mujoco.mj_step(model, data)

    with pytest.raises(InvariantError, match="not finite"):
        block()
    pamsim.reset(model, data, 2e5)
    data.ctrl[0] = np.nan
    mujoco.mj_step(model, data)
    checks._print_left()  # as at the end of the process
    assert "not finite" in capsys.readouterr().err
    with pytest.raises(InvariantError):
        checks.raise_found()
    checks._print_left()
    assert capsys.readouterr().err == ""


def test_the_environment_variable_has_it_on_from_the_start(monkeypatch):
    for value, on in (("1", True), ("", False), ("0", False)):
        monkeypatch.setenv(checks.VARIABLE, value)
        assert checks._Switch().on is on, value
    monkeypatch.delenv(checks.VARIABLE)
    assert not checks._Switch().on
