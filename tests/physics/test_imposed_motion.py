"""Joints driven from outside: imposed motion beside other methods and laws, and torques."""

import dataclasses
import re

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pamsim
from pamsim.core.errors import InputError
from pamsim.engine.batch import simulate_batch
from pamsim.engine.external import act, effort, external
from pamsim.engine.simulate import simulate
from pamsim.physics.friction import Friction, stribeck_friction
from pamsim.recordings.experiment import Experiment, pressure_step
from pamsim.recordings.rig_file import find_rig
from pamsim.recordings.signals import Drive

GRAVITY, ROD = 9.81, 0.5
"""Of muscle_bench [m/s^2, kg]."""

LENGTH, UPPER, LOWER = 0.3, (0.6, 0.15, 0.0046), (0.35, 0.125, 0.0019)
"""Two bars on hinges without gravity: the first one's length [m]; mass [kg], centre [m] and inertia
about it [kg m^2] of each."""

SWING, RATE = 0.4, 4.0 * np.pi
"""Motion imposed on the first hinge [rad, rad/s]."""


def bars(step):
    def body(place, name, bar):
        mass, centre, inertia = bar
        return (
            f'<body pos="{place} 0 0"><joint name="{name}" axis="0 0 1"/><inertial'
            f' pos="{centre} 0 0" mass="{mass}" diaginertia="{inertia} {inertia} {inertia}"/>'
        )

    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{step}" gravity="0 0 0"/><worldbody>{body(0, "first", UPPER)}'
        f"{body(LENGTH, 'second', LOWER)}</body></body></worldbody></mujoco>"
    )


def motion(t):
    return SWING * np.sin(RATE * t)


def expected(time):
    """Angle of the second hinge and torque on the first one, by Lagrange's equations."""
    mass, centre, inertia = LOWER
    own, coupling = inertia + mass * centre**2, mass * LENGTH * centre

    def rates(t, state):
        angle, speed = state
        turn, gain = SWING * RATE * np.cos(RATE * t), -(RATE**2) * motion(t)
        pulled = (own + coupling * np.cos(angle)) * gain + coupling * np.sin(angle) * turn**2
        return speed, -pulled / own

    angle, speed = solve_ivp(
        rates, (0.0, time[-1]), [0.3, 0.0], t_eval=time, rtol=1e-10, atol=1e-12
    ).y
    gain, turn = -(RATE**2) * motion(time), SWING * RATE * np.cos(RATE * time)
    whole = UPPER[2] + UPPER[0] * UPPER[1] ** 2 + mass * LENGTH**2 + own
    torque = (
        (whole + 2.0 * coupling * np.cos(angle)) * gain
        + (own + coupling * np.cos(angle)) * np.array(rates(time, (angle, speed)))[1]
        - coupling * np.sin(angle) * (2.0 * turn * speed + speed**2)
    )
    return angle, torque


def imposed(step):
    """Errors of the imposed angle, of the angle of the free hinge [rad] and of the torque [N m]."""
    count = round(0.5 / step)
    time, model = np.arange(count + 1) * step, bars(step)
    on, data = external(model, Drive(muscles=(), joints={"first": "angle"})), mujoco.MjData(model)
    data.qpos[1], data.qvel[0] = 0.3, (motion(0.0) - motion(-step)) / step
    places, torque = np.zeros((count, 2)), np.zeros(count)
    for k in range(count):
        places[k] = data.qpos
        act(data, on, np.array([motion((k + 1) * step)]), step)
        mujoco.mj_step(model, data)
        torque[k] = effort(data, on, 0)
    angle, needed = expected(time)
    return (
        np.abs(places[:, 0] - motion(time[:count])).max(),
        np.abs(places[:, 1] - angle[:count]).max(),
        np.abs(torque - needed[:count]).max() / np.abs(needed).max(),
    )


def test_a_heavy_joint_follows_and_takes_the_others_along():
    """A motion of 0.4 rad at 2 Hz, with the engine's own error."""
    coarse, fine = imposed(5e-4), imposed(2.5e-4)
    assert coarse[0] < 1e-13
    assert coarse[1] < 1.5e-3
    assert coarse[2] < 3e-3
    assert coarse[1] / fine[1] == pytest.approx(2.0, abs=0.1)
    assert coarse[2] / fine[2] == pytest.approx(2.0, abs=0.1)


@pytest.fixture(scope="module")
def bench():
    return pamsim.load_rig("muscle_bench")


def stretched(time, positions, pressure=3e5, **changes):
    """The muscle under a constant measured pressure, its length imposed."""
    given = {"sample_rate": 500.0, "settle": 0.3, "duration": float(time[-1])}
    return Experiment(
        drive={"muscle": "measured", "rod": "length"},
        command_time=time,
        command_value=np.column_stack([np.full(len(time), pressure), positions]),
        start_pressure=np.array([pressure]),
        **{**given, **changes},
    )


def test_numbers_of_the_bench_s_readme_are_those_of_the_rig(bench):
    readme = (find_rig("muscle_bench") / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"\| 300 kPa, (\d+) mm \| tension (\d+) N, .* (\d+) N \|", readme)
    assert len(rows) == 2
    for length, *stated in rows:
        position = 1e-3 * float(length) - 0.25
        held = stretched(np.zeros(1), [position], duration=0.01, settle=1.0)
        held = dataclasses.replace(held, drive={"muscle": "pressure_set", "rod": "length"})
        run = simulate(bench, held).completed()
        found = (run.signal("muscle.force")[-1], run.signal("rod.force")[-1])
        assert [f"{value:.0f}" for value in found] == stated
    (hung,) = re.findall(r"10 kg hung on \| length ([\d.]+) mm", readme)
    run = simulate(bench, pressure_step([3e5], [3e5], duration=0.01, load=10.0)).completed()
    assert f"{250.0 + 1e3 * run.positions[-1, 0]:.1f}" == hung
    assert "0.5 kg" in readme
    assert bench.model.body("rod").mass[0] == ROD


def cycles(count=2, **changes):
    time = np.arange(0.0, 0.5 * count + 5e-4, 0.002)
    return stretched(time, -0.03 + 0.02 * np.sin(4.0 * np.pi * time), **changes)


def test_force_of_a_motion_is_that_of_newton_at_every_sample_from_the_first_to_the_last(bench):
    """A record that begins and ends while it moves: no blow at either end."""
    time = np.arange(0.0, 0.1001, 0.0025)
    run = simulate(bench, stretched(time, -0.03 + 0.02 * np.sin(4.0 * np.pi * time))).completed()
    rate = 4.0 * np.pi
    speed = 0.02 * rate * np.cos(rate * run.time)
    gain = -0.02 * rate**2 * np.sin(rate * run.time)
    newton = ROD * (gain - GRAVITY) + 20.0 * speed + run.tension[:, 0]
    np.testing.assert_allclose(run.signal("rod.force"), newton, rtol=0, atol=0.3)
    assert np.ptp(newton) > 100.0


def test_backends_and_batches_agree(bench):
    short = cycles(count=1, duration=0.06)
    one, other = (simulate(bench, short, backend=b) for b in ("compiled", "python"))
    (batch,) = simulate_batch([(bench, short)])
    for name, values in one.signals().items():
        np.testing.assert_allclose(values, other.signal(name), rtol=1e-9, atol=1e-9)
        assert np.array_equal(values, batch.signal(name)), name


def test_nothing_of_the_drive_is_left_in_a_run_that_goes_on_without_it(bench):
    held = simulate(bench, stretched(np.zeros(1), [-0.03], duration=0.02)).completed()
    free = pressure_step([3e5], [3e5], duration=0.01, sample_rate=2000.0)
    free = dataclasses.replace(free, drive="measured")
    on = simulate(bench, free, from_state=held.final_state).completed()
    # Let go, the rod begins with the acceleration of the force that held it.
    gain = -held.signal("rod.force")[-1] / ROD
    assert on.velocities[1, 0] == pytest.approx(5e-4 * gain, rel=0.05)


def test_friction_too_steep_for_a_free_rod_is_none_for_one_that_is_moved(bench):
    """The limit of the time step is that of what friction can stop."""
    steep = bench.with_parameters(
        {"friction.stribeck_force": 20.0, "friction.stribeck_velocity": 0.02}
    )
    with pytest.raises(InputError, match="friction stops the arm"):
        simulate(steep, pressure_step([3e5], [3e5], duration=0.01))
    run, plain = (simulate(rig, cycles(duration=0.14)).completed() for rig in (steep, bench))
    taken = run.signal("rod.force") - plain.signal("rod.force")
    rubbing = Friction(stribeck_force=20.0, stribeck_velocity=0.02)
    law = [stribeck_friction(rubbing, speed) for speed in run.velocities[:, 0].tolist()]
    assert max(law) > 5.0
    np.testing.assert_allclose(taken, law, atol=1e-4)


def test_a_force_from_outside_is_a_weight(bench):
    """On a rod that hangs, 98.1 N downwards are 10 kg: at rest, and nothing at all are no drive."""
    bench = bench.with_parameters({"hysteresis.force_per_pressure": 0.0})
    hung = simulate(bench, pressure_step([3e5], [3e5], duration=0.01, load=10.0)).completed()
    pulled = Experiment(
        drive={"muscle": "pressure_set", "rod": "force"},
        command_time=np.zeros(1),
        command_value=np.array([[3e5, 10.0 * GRAVITY]]),
        start_pressure=np.array([3e5]),
        duration=0.01,
    )
    run = simulate(bench, pulled).completed()
    np.testing.assert_allclose(run.positions, hung.positions, rtol=0, atol=2e-6)
    np.testing.assert_allclose(run.signal("rod.force"), 98.1)
    none = dataclasses.replace(pulled, command_value=np.array([[3e5, 0.0]]))
    plain = simulate(bench, pressure_step([3e5], [3e5], duration=0.01)).completed()
    assert np.array_equal(simulate(bench, none).positions, plain.positions)


def test_a_torque_on_a_free_joint_turns_it_as_the_formula_says(tmp_path):
    """A ramp of torque on a bar with a bearing, the muscles' joint held still."""
    rig = pamsim.load_rig("two_joint_arm").with_parameters(
        {"tendon.biceps_cable.coef_elbow": 1e-9, "tendon.triceps_cable.coef_elbow": 1e-9}
    )
    pressures, ramp = np.full((3, 4), 1e5), np.array([0.0, 0.02, 0.04])
    drive = {**dict.fromkeys(rig.muscles, "measured"), "shoulder": "angle", "elbow": "torque"}
    turning = Experiment(
        drive=drive,
        command_time=np.array([0.0, 0.2, 0.4]),
        command_value=np.column_stack([pressures, np.zeros(3), ramp]),
        start_pressure=pressures[0],
        duration=0.4,
        settle=0.1,
    )
    run = simulate(rig, turning).completed()
    mass, centre, inertia = LOWER
    own, drag, slope = inertia + mass * centre**2, 0.15, 0.1
    lag, t = own / drag, run.time
    speed = slope / drag * (t - lag * (1.0 - np.exp(-t / lag)))
    angle = slope / drag * (0.5 * t**2 - lag * t + lag**2 * (1.0 - np.exp(-t / lag)))
    assert angle[-1] > 0.03
    np.testing.assert_allclose(run.positions[:, 1], angle, rtol=0, atol=1e-5)
    np.testing.assert_allclose(run.velocities[:, 1], speed, rtol=0, atol=2e-4)
    np.testing.assert_allclose(run.positions[:, 0], 0.0, atol=1e-12)
    np.testing.assert_allclose(run.signal("elbow.torque"), slope * t, atol=1e-12)


def test_a_motion_passes_a_soft_stop_as_it_was_measured(bench):
    """The rod's range ends at 10 mm; its stop would turn any mass back."""
    beyond = np.linspace(0.005, 0.015, 11)
    run = simulate(bench, stretched(0.01 * np.arange(11), beyond, duration=0.1)).completed()
    np.testing.assert_allclose(run.positions[-1, 0], 0.015, atol=1e-7)


def test_what_a_joint_cannot_do_is_refused(bench):
    for joint, drive, position, message in (
        ("rod", "length", 0.03, "leaves its range of -0.09 to 0.01"),
        ("rod", "angle", 0.0, "slides, so that its drive is force or"),
        ("rud", "length", 0.0, "no joint 'rud'; did you mean 'rod'"),
    ):
        still = stretched(np.zeros(1), [position], duration=0.02)
        still = dataclasses.replace(still, drive={"muscle": "measured", joint: drive})
        with pytest.raises(InputError, match=message):
            simulate(bench, still)
