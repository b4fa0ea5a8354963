"""Steps per second of the full muscle law against MuJoCo's own <muscle>, on the same arm.

    python scripts/benchmarks/steps_per_second.py [--json FILE]

Peers: the built-in ``<muscle>`` on the same two tendons, and the same kernel as Python callback.
Rounds alternate between the peers in one process, so that a slow phase of the machine hits all of
them; the ratio is the median over rounds.
"""

from __future__ import annotations

import argparse
import json
import platform
import statistics
import time
from pathlib import Path

import mujoco
import numpy as np

import pamsim
from pamsim.engine.rig import Rig
from pamsim.engine.visual_geoms import remove_visual_geoms

ROUNDS = 15
SECONDS_PER_RUN = 0.2


def builtin_arm(rig: Rig) -> mujoco.MjModel:
    """The rig's MJCF with MuJoCo's built-in muscle on each tendon."""
    spec = mujoco.MjSpec.from_file(str(rig.file.mjcf))
    remove_visual_geoms(spec)  # as in the rig's own model
    for name, tendon in rig.file.tendons.items():
        actuator = spec.add_actuator()
        actuator.name = name
        actuator.trntype = mujoco.mjtTrn.mjTRN_TENDON
        actuator.target = tendon
        actuator.set_to_muscle(
            timeconst=[0.01, 0.04],
            tausmooth=0.0,
            range=[0.75, 1.05],
            force=1000.0,
            scale=200.0,
            lmin=0.5,
            lmax=1.6,
            vmax=1.5,
            fpmax=1.3,
            fvmax=1.2,
        )
        actuator.lengthrange = [-0.01, 0.01]
    model = spec.compile()
    model.dof_damping[:] = rig.model.dof_damping
    return model


def rate(model: mujoco.MjModel, data: mujoco.MjData, steps: int) -> float:
    """Steps per second of one run."""
    began = time.perf_counter()
    mujoco.mj_step(model, data, steps)
    return steps / (time.perf_counter() - began)


def calibrated_steps(model: mujoco.MjModel, data: mujoco.MjData) -> int:
    """Number of steps that take about `SECONDS_PER_RUN`."""
    return max(200, round(rate(model, data, 2000) * SECONDS_PER_RUN))


def main() -> None:
    """Time the peers and print steps per second and ratios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    target = parser.parse_args().json
    rig = pamsim.load_rig("mas20_arm")
    ours = rig.model_for(command="valve")
    theirs = builtin_arm(rig)
    ours_data, theirs_data = mujoco.MjData(ours), mujoco.MjData(theirs)
    pamsim.reset(ours, ours_data, (3e5, 2e5))
    ours_data.ctrl[:] = (0.02, -0.01)
    theirs_data.ctrl[:] = (0.4, 0.2)
    runs = {
        "pamsim, compiled": (ours, ours_data, "compiled"),
        "mujoco <muscle>": (theirs, theirs_data, "compiled"),
        "pamsim, python": (ours, ours_data, "python"),
    }
    steps = {}
    for name, (model, data, backend) in runs.items():
        with pamsim.live(ours, backend=backend):
            steps[name] = calibrated_steps(model, data)
    rates: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(ROUNDS):
        for name, (model, data, backend) in runs.items():
            with pamsim.live(ours, backend=backend):
                rates[name].append(rate(model, data, steps[name]))
    assert np.isfinite(ours_data.act).all()
    full = np.array(rates["pamsim, compiled"])
    result = {
        "steps_per_second": {name: statistics.median(values) for name, values in rates.items()},
        "full_law_over_builtin_muscle": float(np.median(full / rates["mujoco <muscle>"])),
        "full_law_over_python_callback": float(np.median(full / rates["pamsim, python"])),
        "rounds": ROUNDS,
        "versions": {"mujoco": mujoco.__version__, "python": platform.python_version()},
        "command": "python scripts/benchmarks/steps_per_second.py",
    }
    for name, value in result["steps_per_second"].items():
        print(f"{name:20s} {value:12,.0f} steps/s")
    print(f"full law / built-in <muscle>  {result['full_law_over_builtin_muscle']:.2f}")
    print(f"full law / Python callback    {result['full_law_over_python_callback']:.1f}")
    if target is not None:
        target.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
