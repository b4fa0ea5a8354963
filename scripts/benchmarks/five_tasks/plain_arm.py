"""Task 1 with plain MuJoCo: the MAS-20 arm, its muscles and valves in a loop of one's own."""

import mujoco
import numpy as np

RADIUS, LENGTH, DIAMETER, ANGLE = 0.0121276, 0.25, 0.02, np.radians(28.6)
TURNS_LENGTH = LENGTH / np.cos(ANGLE)
A, C, D, E = -4.00180705, -32.930845, -933.564098, 294.0538256  # N/bar, 1, N/bar, N/bar
VALVE, DEAD, INDEX, ATMOSPHERE, BAND, SUPPLY = 4.92e-10, 1e-5, 1.2, 101325.0, 1e4, 6e5
XML = f"""<mujoco><option timestep="0.0005"/><worldbody><body name="arm" euler="-1.902 0 0">
  <joint name="shaft" axis="0 0 1" damping="0.3247"/>
  <geom type="box" size="0.1 0.01 0.01" pos="0.1 0 0" mass="0.3" contype="0" conaffinity="0"/>
  <geom name="load" type="sphere" size="0.03" pos="0.2 0 0" mass="1.2"/></body></worldbody>
  <tendon><fixed name="t1"><joint joint="shaft" coef="-{RADIUS}"/></fixed>
  <fixed name="t2"><joint joint="shaft" coef="{RADIUS}"/></fixed></tendon>
  <actuator><general tendon="t1"/><general tendon="t2"/></actuator></mujoco>"""


def volume(length):
    sine2 = np.clip(1 - (length / TURNS_LENGTH) ** 2, 1e-6, 1)
    return np.pi * length * (DIAMETER / 2) ** 2 * sine2 / np.sin(ANGLE) ** 2 + DEAD


def force(pressure, length):
    k = 1 - length / LENGTH
    active = 1e-5 * pressure * (A * np.exp(C * k) + D * k + E)
    stretched = np.maximum(-k, 0)
    return np.maximum(active, 0) + 9237 * stretched * np.exp(25.53 * stretched)


def flow(upstream, downstream):
    ratio = downstream / upstream
    choked = np.where(ratio <= 0.3, 1.0, np.sqrt(np.clip(1 - ((ratio - 0.3) / 0.7) ** 2, 0, 1)))
    return VALVE * upstream * choked * 1.2


def simulate(
    start, target, *, load=1.2, duration=4.0, damping=0.3247, friction=0.0, leak=0.0, rate=100
):
    model = mujoco.MjModel.from_xml_string(XML)
    model.dof_damping[0], model.dof_frictionloss[0] = damping, friction
    model.body_mass[1] = 0.3 + load
    model.body_inertia[1] *= model.body_mass[1] / 1.5
    mujoco.mj_setConst(model, mujoco.MjData(model))
    data = mujoco.MjData(model)
    dt = model.opt.timestep
    times, targets = target if np.ndim(target[1]) == 2 else ([0.0], [target])
    pressure = np.asarray(start, float) + ATMOSPHERE
    rows, every = [], round(1 / rate / dt)
    settle = round(0.5 / dt)
    for step in range(-settle, round(duration / dt) + 1):
        row = np.searchsorted(times, step * dt + 1e-9, side="right") - 1
        set_point = np.asarray(start, float) if step < 0 else np.asarray(targets[row], float)
        length = LENGTH + data.ten_length
        opening = np.clip((set_point + ATMOSPHERE - pressure) / BAND, -1, 1)
        air = np.where(
            opening > 0,
            opening * flow(SUPPLY + ATMOSPHERE, pressure),
            opening * flow(pressure, ATMOSPHERE),
        )
        air = air - leak * pressure
        rate_of_volume = (volume(length + 1e-6) - volume(length)) / 1e-6 * data.ten_velocity
        pressure = pressure + dt * INDEX * (
            287 * 293.15 * air - pressure * rate_of_volume
        ) / volume(length)
        pressure = np.clip(pressure, ATMOSPHERE, SUPPLY + ATMOSPHERE)
        data.ctrl[:] = -force(pressure - ATMOSPHERE, length)
        mujoco.mj_step(model, data)
        if step >= 0 and step % every == 0:
            rows.append([step * dt, *(pressure - ATMOSPHERE), data.qpos[0]])
    return np.array(rows)


if __name__ == "__main__":
    run = simulate((0, 0), (487e3, 0))
    np.savetxt("plain_step.csv", run, delimiter=",", header="time_s,p1,p2,angle_rad", comments="")
    print(f"end angle {np.degrees(run[-1, 3]):.2f} deg")
