"""Steps per second of worlds in Warp against the engine's batch, and what rounding costs.

    python scripts/benchmarks/worlds.py [--device NAME] [--counts 1,16,128,1024] [--json FILE]

Speed: the MAS-20 arm under one command, on a device of Warp's in both precisions of the muscles and
on the engine's own thread pool, one thread per processor. Rounds alternate between the peers in one
process, so that a slow phase of the machine hits all of them; a ratio is the median over rounds.

Rounding: 10 s of a sine of the set points, or of the openings of the valves, where no regulator
makes up for errors; arms with parameters of their own, as worlds and by `simulate_batch` in double
precision; the largest difference at any sample.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import mujoco
import numpy as np
from timing import finish, in_turn, parser, seconds

import pamsim
from pamsim.engine.batch import simulate_batch
from pamsim.engine.simulate import prepare
from pamsim.envs.plant import ManyRigs
from pamsim.gpu.port import PRECISIONS, mujoco_warp, warp
from pamsim.gpu.simulate_worlds import simulate_worlds
from pamsim.gpu.worlds import Worlds
from pamsim.recordings.experiment import Experiment

STEPS, ROUNDS = 40, 5
COMMAND = np.array([3e5, 1e5])
SECONDS, RATE, FREQUENCY = 10.0, 100.0, 0.5  # s, Hz, Hz
MIDDLE, SWING, OPENING = 2.5e5, 1.5e5, 0.2  # Pa, Pa, -
VARIANTS: tuple[dict[str, float], ...] = (
    {},
    {"passive.stiffness": 11e3, "joint.shaft.damping": 3.0},
    {"joint.shaft.frictionloss": 0.5},
    {"creep.stiffness": 1e3, "creep.relaxation_time": 5.0},
    {"chain.backlash": 5e-4},
    {"friction.coulomb_force": 5.0},
    {"chamber.leak_conductance": 1e-12},
    {"valve.dead_zone": 0.05},
)
DRIVES = ("pressure_set", "valve")
LOAD = 1.2  # kg


def speed(counts: list[int], device: str | None) -> list[dict[str, object]]:
    """Steps per second, all worlds together, and ratio to the engine's batch."""
    rig = pamsim.load_rig("mas20_arm")
    run = prepare(rig, pamsim.pressure_step((3e5, 3e5), (3e5, 1e5), duration=1.0, load=LOAD))
    data = mujoco.MjData(run.model)
    pamsim.reset(run.model, data, [3e5, 3e5])
    start = run.model, pamsim.save_state(run.model, data)
    rows: list[dict[str, object]] = []
    for count in counts:
        states = dict.fromkeys(range(count), start)
        command = np.tile(COMMAND, (count, 1))
        peers: dict[str, Callable[[], object]] = {}
        for precision in PRECISIONS:
            worlds = Worlds(rig, run.model, count, precision=precision, device=device)
            worlds.put(states)
            peers[precision] = functools.partial(_step, worlds, command)
        batch = ManyRigs(run.model, count, 0)
        batch.put(states)
        peers["batch"] = functools.partial(batch.step, command, STEPS)
        timers = [functools.partial(seconds, peer) for peer in peers.values()]
        in_turn(timers, 1)
        times = dict(zip(peers, in_turn(timers, ROUNDS), strict=True))
        rates = {name: round(count * STEPS / np.median(own)) for name, own in times.items()}
        for precision in PRECISIONS:
            ratios = times["batch"] / times[precision]
            row = {
                "worlds": count,
                "precision": precision,
                "steps_per_second": rates[precision],
                "batch_steps_per_second": rates["batch"],
                "ratio": float(f"{np.median(ratios):.3g}"),
                "ratio_range": [float(f"{one:.3g}") for one in (ratios.min(), ratios.max())],
            }
            rows.append(row)
    return rows


def _step(worlds: Worlds, command: np.ndarray) -> None:
    worlds.step(command, STEPS)
    _ = worlds.position  # waits for the device


def motion(drive: str) -> Experiment:
    """10 s of a sine of the set points, or of the openings of the valves."""
    times = np.arange(0.0, SECONDS, 1.0 / RATE)
    wave = np.sin(2.0 * np.pi * FREQUENCY * times)
    middle, swing = (MIDDLE, SWING) if drive == "pressure_set" else (0.0, OPENING)
    return Experiment(
        drive=drive,
        command_time=times,
        command_value=np.stack([middle + swing * wave, middle - swing * wave], axis=1),
        start_pressure=np.array([MIDDLE, MIDDLE]),
        duration=SECONDS,
        sample_rate=RATE,
        load=LOAD,
    )


def rounding(device: str | None) -> list[dict[str, object]]:
    """Largest differences from the engine in double precision over 10 s."""
    rig = pamsim.load_rig("mas20_arm")
    rows: list[dict[str, object]] = []
    for drive in DRIVES:
        jobs = [(rig.with_parameters(values), motion(drive)) for values in VARIANTS]
        exact = simulate_batch(jobs)
        for precision in PRECISIONS:
            runs = simulate_worlds(jobs, precision=precision, device=device)
            for values, own, other in zip(VARIANTS, exact, runs, strict=True):
                differences = {
                    "angle_deg": np.degrees(np.abs(other.angle - own.angle)),
                    "pressure_pa": np.abs(other.pressure - own.pressure),
                    "tension_n": np.abs(other.tension - own.tension),
                }
                row = {
                    "drive": drive,
                    "precision": precision,
                    "parameters": values,
                    **{name: float(f"{one.max():.2g}") for name, one in differences.items()},
                    "angle_at_the_end_deg": float(f"{differences['angle_deg'][-1]:.2g}"),
                    "swing_deg": round(float(np.degrees(np.ptp(own.angle))), 2),
                }
                rows.append(row)
    return rows


def main() -> None:
    """Measure both, write them if asked."""
    options = parser(__doc__, counts="1,16,128,1024")
    options.add_argument("--device")
    arguments = options.parse_args()
    counts = [int(one) for one in arguments.counts.split(",")]
    device = warp().get_device(arguments.device)
    page = {
        "device": device.name,
        "gpu": device.is_cuda,
        "rounds": ROUNDS,
        "steps_per_round": STEPS,
        "speed": speed(counts, arguments.device),
        "rounding_over_10_s": rounding(arguments.device),
        "mujoco_warp": mujoco_warp().__version__,
        "warp": warp().__version__,
    }
    finish(f"worlds.py --counts {arguments.counts}", page, arguments.json)


if __name__ == "__main__":
    main()
