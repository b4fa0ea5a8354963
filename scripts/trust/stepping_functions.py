"""Every function of MuJoCo's Python API that evaluates muscles, in five situations.

    python scripts/trust/stepping_functions.py [--seed 0] [--json FILE]

Rows are functions that step or evaluate actuators, `mujoco.rollout`, ``Batch``, the environments
and `pamsim.simulate`. Situations are: plain (outside `pamsim.live`); another library's callbacks
set before and during; a second model stepped in between; a copy of the model (``copy``,
``deepcopy``, ``pickle``, MJB); another thread, while this one steps another model. A cell is
``right`` if its numbers equal those of the interpreted kernel to the bit (on Linux; elsewhere to
1e-9), ``no number`` if forces and states are NaN, ``error`` if something was raised. Anything else
is ``wrong``, and the script exits 1.

Which functions there are is tried: all that take a model and its data are called, and those
that change the muscles' force or the time have to be in the table.
"""

from __future__ import annotations

import contextlib
import copy
import pickle
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import TypeAlias

import gymnasium
import mujoco
import numpy as np
from mujoco import rollout
from mujoco.batch import Batch

import pamsim
import pamsim.envs  # registers the environments
from pamsim.core.units import FloatArray
from pamsim.engine import plugin

sys.path.insert(0, str(Path(__file__).parents[1]))
from records import head, parser, print_and_write

Model: TypeAlias = mujoco.MjModel
Data: TypeAlias = mujoco.MjData
Array: TypeAlias = FloatArray
Between: TypeAlias = Callable[[], None]
"""Called between two steps: what the situation does meanwhile."""

Function: TypeAlias = Callable[[Model, Data, Between], Array]

STEPS = 20
FULL = mujoco.mjtState.mjSTATE_FULLPHYSICS
EULER, IMPLICIT, RK4 = (
    mujoco.mjtIntegrator.mjINT_EULER,
    mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    mujoco.mjtIntegrator.mjINT_RK4,
)


def state(model: Model, data: Data) -> Array:
    """Time, positions, speeds and states."""
    values = np.empty(mujoco.mj_stateSize(model, FULL))
    mujoco.mj_getState(model, data, values, FULL)
    return values


def evaluated(data: Data) -> Array:
    """What the muscles give at an instant."""
    return np.concatenate([data.actuator_force, data.act_dot, data.qacc, data.qfrc_actuator])


def stepping(*calls: Callable[[Model, Data], None], integrator: int = EULER) -> Function:
    """A function that makes a time step by some calls."""

    def advance(model: Model, data: Data, between: Between) -> Array:
        model.opt.integrator = integrator
        for _ in range(STEPS):
            for call in calls:
                call(model, data)
            between()
        return state(model, data)

    return advance


def many_steps(model: Model, data: Data, between: Between) -> Array:
    """``mj_step`` with a number of steps."""
    between()
    mujoco.mj_step(model, data, STEPS)
    return state(model, data)


def instant(*calls: Callable[[Model, Data], None]) -> Function:
    """A function that evaluates the muscles by some calls."""

    def evaluate(model: Model, data: Data, between: Between) -> Array:
        for call in calls:
            call(model, data)
            between()
        return evaluated(data)

    return evaluate


def inverse(call: Callable[[Model, Data], None]) -> Function:
    """What inverse dynamics gives for the acceleration of forward dynamics."""

    def evaluate(model: Model, data: Data, between: Between) -> Array:
        mujoco.mj_forward(model, data)
        data.qacc += 1.0
        between()
        call(model, data)
        return np.concatenate([data.qfrc_inverse, data.actuator_force, data.solver_fwdinv])

    return evaluate


def transition(model: Model, data: Data, between: Between) -> Array:
    """``mjd_transitionFD``."""
    size = 2 * model.nv + model.na
    a, b = np.zeros((size, size)), np.zeros((size, model.nu))
    between()
    mujoco.mjd_transitionFD(model, data, 1e-6, True, a, b, None, None)
    return np.concatenate([a.ravel(), b.ravel()])


def inverse_derivatives(model: Model, data: Data, between: Between) -> Array:
    """``mjd_inverseFD`` with actuation; it refuses models with the noslip solver."""
    model.opt.noslip_iterations = 0
    mujoco.mj_forward(model, data)
    by = [np.zeros((model.nv, model.nv)) for _ in range(3)]
    between()
    mujoco.mjd_inverseFD(model, data, 1e-6, True, *by, None, None, None, None)
    return np.ravel(by)


def checked(call: Callable[[Model, Data], None]) -> Function:
    """State after a check that finds nothing."""

    def look(model: Model, data: Data, between: Between) -> Array:
        mujoco.mj_forward(model, data)
        between()
        call(model, data)
        return np.concatenate([state(model, data), evaluated(data)])

    return look


def after_bad_acceleration(model: Model, data: Data, between: Between) -> Array:
    """``mj_checkAcc`` that resets, which rigs' models do not ask for: the chambers are empty."""
    model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    mujoco.mj_forward(model, data)
    data.qacc[:] = np.nan
    between()
    mujoco.mj_checkAcc(model, data)
    return data.actuator_force.copy()


def rolled_out(threads: int) -> Function:
    """``mujoco.rollout``, of as many runs as threads."""

    def roll(model: Model, data: Data, between: Between) -> Array:
        controls = np.tile(data.ctrl, (threads, STEPS, 1))
        start = np.tile(state(model, data), (threads, 1))
        between()
        several = [mujoco.MjData(model) for _ in range(threads)]
        states, _ = rollout.rollout([model] * threads, several, start, controls)
        ends = states[:, -1]
        return ends[0] if (ends == ends[0]).all() else np.full(1, np.inf)

    return roll


def in_batch(model: Model, data: Data, between: Between) -> Array:
    """``mujoco.batch.Batch``."""
    with pamsim.live(model):
        many = Batch(model, 2, nthread=2)
        for name in ("time", "qpos", "qvel", "act", "ctrl"):
            getattr(many, name)[:] = getattr(data, name)
        between()
        many.step(nstep=STEPS)
    mujoco.mj_setState(model, data, state(model, data), FULL)
    data.time, data.qpos[:] = float(np.ravel(many.time)[1]), many.qpos[1]
    data.qvel[:], data.act[:] = many.qvel[1], many.act[1]
    return state(model, data)


def in_scope(model: Model, data: Data, between: Between) -> Array:
    """Inside `pamsim.live`."""
    with pamsim.live(model):
        return stepping(mujoco.mj_step)(model, data, between)


def skip(function: Callable[..., None]) -> Callable[[Model, Data], None]:
    """A function that may leave out stages, which leaves out none."""
    return lambda model, data: function(model, data, int(mujoco.mjtStage.mjSTAGE_NONE), 0)


def runge_kutta(model: Model, data: Data) -> None:
    """A step by ``mj_RungeKutta``."""
    mujoco.mj_RungeKutta(model, data, 4)


STAGES = (
    mujoco.mj_fwdPosition,
    mujoco.mj_fwdVelocity,
    mujoco.mj_fwdActuation,
    mujoco.mj_fwdAcceleration,
    mujoco.mj_fwdConstraint,
)
STEP = stepping(mujoco.mj_step)
FUNCTIONS: dict[str, tuple[Function, ...]] = {
    "mj_step": (STEP, STEP),
    "mj_step(nstep)": (many_steps, STEP),
    "mj_step1, mj_step2": (stepping(mujoco.mj_step1, mujoco.mj_step2), STEP),
    "mj_forward, mj_Euler": (stepping(mujoco.mj_forward, mujoco.mj_Euler), STEP),
    "mj_forwardSkip, mj_Euler": (stepping(skip(mujoco.mj_forwardSkip), mujoco.mj_Euler), STEP),
    "mj_forward, mj_implicit": (
        stepping(mujoco.mj_forward, mujoco.mj_implicit, integrator=IMPLICIT),
        stepping(mujoco.mj_step, integrator=IMPLICIT),
    ),
    "mj_forward, mj_RungeKutta": (stepping(mujoco.mj_forward, runge_kutta), STEP),
    "mj_step, integrator RK4": (stepping(mujoco.mj_step, integrator=RK4), STEP),
    "mj_forward": (instant(mujoco.mj_forward),) * 2,
    "mj_forwardSkip": (instant(skip(mujoco.mj_forwardSkip)), instant(mujoco.mj_forward)),
    "mj_fwdActuation": (instant(*STAGES), instant(mujoco.mj_forward)),
    "mj_inverse": (inverse(mujoco.mj_inverse),) * 2,
    "mj_inverseSkip": (inverse(skip(mujoco.mj_inverseSkip)), inverse(mujoco.mj_inverse)),
    "mj_compareFwdInv": (inverse(mujoco.mj_compareFwdInv),) * 2,
    "mjd_transitionFD": (transition, transition),
    "mjd_inverseFD": (inverse_derivatives, inverse_derivatives),
    "mj_checkPos": (checked(mujoco.mj_checkPos),) * 2,
    "mj_checkVel": (checked(mujoco.mj_checkVel),) * 2,
    "mj_checkAcc": (checked(mujoco.mj_checkAcc),) * 2,
    "mj_checkAcc that resets": (after_bad_acceleration, instant(mujoco.mj_forward)),
    "rollout, one thread": (rolled_out(1), STEP),
    "rollout, two threads": (rolled_out(2), STEP),
    "Batch.step": (in_batch, STEP),
    "pamsim.live, mj_step": (in_scope, STEP),
}
"""Name -> the function, and what the interpreted kernel is asked for instead."""

NO_NUMBER = {
    "mj_forward, mj_RungeKutta": "evaluates between time points",
    "mj_step, integrator RK4": "evaluates between time points",
    "mj_checkAcc that resets": "empty chambers",
}
"""Rows of which no number is the right answer, and why."""


def charged(name: str, seed: int) -> tuple[Model, Data]:
    """A rig's model in a state of its own, its valves open."""
    rig = pamsim.load_rig(name)
    rng = np.random.default_rng(seed)
    model = rig.model_for(command="valve")
    data = mujoco.MjData(model)
    pamsim.reset(model, data, rng.uniform(1e5, 4e5, len(rig.muscles)).tolist())
    data.ctrl[:] = rng.uniform(-1.0, 1.0, model.nu)
    mujoco.mj_step(model, data, 50)
    return model, data


def nothing() -> None:
    """Between steps of the plain situation."""


def plain(function: Function, seed: int) -> list[Array]:
    """Outside of any scope."""
    return [function(*charged("mas20_arm", seed), nothing)]


CALLBACKS = ("act_dyn", "act_gain", "act_bias", "control", "passive", "sensor")


@contextmanager
def another_library(names: Sequence[str] = CALLBACKS) -> Iterator[Between]:
    """Callbacks that are set before and, but for a moment, during."""

    def put() -> None:
        for name in names:
            forces = name.startswith("act_")
            callback = (lambda *_: 1e3) if forces else (lambda *_: None)
            getattr(mujoco, f"set_mjcb_{name}")(callback)

    def remove() -> None:
        for name in names:
            getattr(mujoco, f"set_mjcb_{name}")(None)

    def again() -> None:
        remove()
        put()

    put()
    try:
        yield again
    finally:
        remove()


def callbacks(function: Function, seed: int) -> list[Array]:
    """Under callbacks of another library."""
    model, data = charged("mas20_arm", seed)  # the engine compiles no model under some callbacks
    with another_library() as again:
        return [function(model, data, again)]


def two_models(function: Function, seed: int) -> list[Array]:
    """With another model in between."""
    other, its_data = charged("two_joint_arm", seed)

    def between() -> None:
        mujoco.mj_step(other, its_data)

    return [function(*charged("mas20_arm", seed), between)]


def copies(function: Function, seed: int) -> list[Array]:
    """On copies of the model, one by one."""
    found: list[Array] = []
    for twin_of in (copy.copy, copy.deepcopy, pickled, saved):
        model, data = charged("mas20_arm", seed)
        twin = twin_of(model)
        other = mujoco.MjData(twin)
        pamsim.restore_state(twin, other, pamsim.save_state(model, data))
        del model, data
        found.append(function(twin, other, nothing))
    return found


def pickled(model: Model) -> Model:
    """A model that went through ``pickle``."""
    return pickle.loads(pickle.dumps(model))


def saved(model: Model) -> Model:
    """A model that went through ``mj_saveModel``."""
    buffer = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return mujoco.MjModel.from_binary_path("saved.mjb", {"saved.mjb": buffer.tobytes()})


def another_thread(function: Function, seed: int) -> list[Array]:
    """In another thread, while this one steps."""
    other, its_data = charged("two_joint_arm", seed)
    with ThreadPoolExecutor(1) as pool:
        result = pool.submit(lambda: function(*charged("mas20_arm", seed), nothing))
        while not result.done():
            mujoco.mj_step(other, its_data, 10)
        return [result.result()]


SITUATIONS: dict[str, Callable[[Function, int], list[Array]]] = {
    "plain": plain,
    "other callbacks": callbacks,
    "two models": two_models,
    "copied model": copies,
    "another thread": another_thread,
}


def interpreted(function: Function, seed: int) -> Array:
    """What the interpreted kernel gives."""
    model, data = charged("mas20_arm", seed)
    with pamsim.live(model, backend="python"):
        return function(model, data, nothing)


def verdict(run: Callable[[], list[Array]], expected: Array) -> str:
    """Of a cell."""
    try:
        found = run()
    except Exception as error:
        return f"error: {type(error).__name__}"
    if all(same(one, expected) for one in found):
        return "right"
    if all(np.isnan(one).any() for one in found):
        return "no number"
    return "wrong"


def same(found: Array, expected: Array) -> bool:
    """To the bit where machine code and interpreter call one mathematics library."""
    if sys.platform == "linux":
        return found.tobytes() == expected.tobytes()
    return found.shape == expected.shape and np.allclose(found, expected, rtol=1e-9, atol=1e-12)


def cells(function: Function, expected: Array, seed: int) -> dict[str, str]:
    """All situations of a function."""
    return {
        situation: verdict(lambda place=place: place(function, seed), expected)
        for situation, place in SITUATIONS.items()
    }


def row(name: str, seed: int) -> dict[str, str]:
    """All situations of one of `FUNCTIONS`."""
    function, reference = FUNCTIONS[name]
    return cells(function, interpreted(reference, seed), seed)


def simulate_row(seed: int) -> dict[str, str]:
    """`pamsim.simulate` in all situations; it makes its own copies of the model."""
    rig = pamsim.load_rig("mas20_arm")
    pressures = np.random.default_rng(seed).uniform(1e5, 4e5, (2, 2))
    step = pamsim.pressure_step(*pressures, duration=0.05)
    slow = pamsim.simulate(rig, step, backend="python").completed().final_state

    def fast(_: Model, __: Data, between: Between) -> Array:
        between()
        found = pamsim.simulate(rig, step).completed().final_state
        return np.empty(0) if found is None else found

    assert slow is not None
    return cells(fast, slow, seed)


def environment(vector: bool) -> Function:
    """A step of an environment, beside that of its model by the interpreted kernel."""

    def play(_: Model, __: Data, between: Between) -> Array:
        single = gymnasium.make("pamsim/Rig-v0", frame_skip=STEPS)
        single.reset(seed=1)
        start = pamsim.save_state(single.unwrapped.model, single.unwrapped.data)
        action = np.full(single.action_space.shape, 0.3, np.float32)
        between()
        if vector:
            env = gymnasium.make_vec(
                "pamsim/Rig-v0",
                num_envs=2,
                vectorization_mode="vector_entry_point",
                frame_skip=STEPS,
            )
            env.reset(seed=1)
            pressure = np.asarray(env.step(np.stack([action] * 2))[-1]["pressure"])[0]
            env.close()
            single.step(action)
        else:
            pressure = np.ravel(single.step(action)[-1]["pressure"])
        command = single.unwrapped.data.ctrl.copy()
        model = copy.copy(single.unwrapped.model)
        single.close()
        data = mujoco.MjData(model)
        pamsim.restore_state(model, data, start)
        data.ctrl[:] = command
        with pamsim.live(model, backend="python"):
            mujoco.mj_step(model, data, STEPS)
        mujoco.mj_fwdPosition(model, data)
        return pressure - pamsim.pressures(model, data)

    return play


def evaluating_functions() -> set[str]:
    """Functions of the API with a model and its data that evaluate muscles or advance time."""
    found: set[str] = set()
    for name in dir(mujoco):
        declared = re.match(
            r"\w+\(m: mujoco._structs.MjModel, d: mujoco._structs.MjData((?:, \w+: [^,)]+)*)\)",
            getattr(getattr(mujoco, name), "__doc__", None) or "",
        )
        if not name.startswith(("mj_", "mjd_")) or declared is None:
            continue
        extra = declared.group(1).count(",")
        if "SupportsInt" not in declared.group(1) and extra:
            continue
        model, data = charged("mas20_arm", 0)
        model.opt.integrator = IMPLICIT  # or mj_implicit refuses
        mujoco.mj_forward(model, data)
        data.actuator_force[:], before = 12345.0, data.time
        if name == "mj_checkAcc":
            data.qacc[:] = np.nan
        with contextlib.suppress(mujoco.FatalError, TypeError):  # of what needs other arguments
            if not name.startswith("mj_reset"):
                order = {"mj_RungeKutta": 4, "mj_step": 1}.get(name, 0)
                getattr(mujoco, name)(model, data, *[order] * extra)
        if data.time != before or (data.actuator_force != 12345.0).any():
            found.add(name)
    return found


MJB = """
import sys, mujoco
if sys.argv[2] == "register":
    import pamsim
    pamsim.register()
model = mujoco.MjModel.from_binary_path(sys.argv[1])
mujoco.mj_step(model, mujoco.MjData(model))
"""


def mjb_in_another_process() -> dict[str, str]:
    """What a process makes of an MJB, with ``register()`` before and without."""
    found: dict[str, str] = {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rig.mjb"
        mujoco.mj_saveModel(pamsim.load_rig("mas20_arm").model, str(path), None)
        for how in ("register", "without"):
            done = subprocess.run(
                [sys.executable, "-c", MJB, str(path), how], capture_output=True, cwd=folder
            )
            crashed = done.returncode < 0 or done.returncode > 255
            found[how] = "crash" if crashed else "right" if done.returncode == 0 else "error"
    return found


def main() -> int:
    """Fill the table, print and keep it; 1 if a cell is wrong."""
    given = parser(__doc__, seed=0).parse_args()
    pamsim.load_rig("mas20_arm")
    plugin.load_kernel()
    table = {name: row(name, given.seed) for name in FUNCTIONS}
    table["pamsim.simulate"] = simulate_row(given.seed)
    for name, vector in (("environment", False), ("vector environment", True)):
        table[name] = cells(environment(vector), np.zeros(2), given.seed)
    missing = sorted(
        name for name in evaluating_functions() if not any(name in one for one in table)
    )
    bad = [
        f"{name}, {situation}: {cell}"
        for name, own in table.items()
        for situation, cell in own.items()
        if cell == "wrong" or (cell == "no number") != (name in NO_NUMBER)
    ]
    result = {
        **head(f"python scripts/trust/stepping_functions.py --seed {given.seed}"),
        "functions": table,
        "no_number_is_right": NO_NUMBER,
        "mjb_in_another_process": mjb_in_another_process(),
        "missing_functions": missing,
        "bad": bad,
    }
    print_and_write(result, given.json)
    return 1 if bad or missing else 0


if __name__ == "__main__":
    raise SystemExit(main())
