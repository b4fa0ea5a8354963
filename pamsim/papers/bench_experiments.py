"""The papers' muscles on the bench: their laws and operators as the engine runs them.

Each paper's muscle is a rig of its own, ``models/muscle_bench/<paper>/params.toml``, on the MJCF of
`muscle_bench`: a muscle under a force cell, with a machine that sets its length or a weight below.
The pressure is imposed, or the air is shut in; what is read is what a laboratory reads, length,
pressure and the tension at the cell.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.engine.rig import Rig, load_rig
from pamsim.engine.simulate import simulate
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.rig_file import shipped_rigs

_SWINGING = 30.0  # until 30 kg that were let go hang still within 0.01 mm [s]


class BenchRun(NamedTuple):
    """What a bench reads, (n,) each."""

    contraction: FloatArray  # of the muscle [-]
    pressure: FloatArray  # gauge [Pa]
    tension: FloatArray  # at the force cell [N]


def bench(paper: str) -> Rig:
    """The muscle of a paper, such as ``sarosi``, on the bench."""
    return load_rig(shipped_rigs() / "muscle_bench" / paper)


def stretched(
    rig: Rig,
    time: FloatArray,
    contraction: FloatArray,
    pressure: FloatArray | float,
    *,
    sealed: bool = False,
    timestep: float | None = None,
) -> BenchRun:
    """Impose the contraction (n,) [-] of a muscle of `bench` at even times from 0 (n,) [s].

    The gauge pressure [Pa], (n,) or one, is imposed too, or with ``sealed`` that of the air which
    is shut in at the start. The engine's time step [s] is the rig's own if left out.
    """
    start, nominal = _lengths(rig)
    imposed = np.broadcast_to(np.asarray(pressure, dtype=np.float64), time.shape)
    air = np.zeros(time.shape) if sealed else imposed
    position = (1.0 - contraction) * nominal - start
    command = np.column_stack([air, position])
    drive = {"muscle": "sealed" if sealed else "measured", "rod": "length"}
    return _run(rig, timestep, time, command, drive=drive, start_pressure=imposed[:1])


def hung(rig: Rig, time: FloatArray, pressure: FloatArray, *, load: float) -> BenchRun:
    """Impose the gauge pressure (n,) [Pa] of a muscle of `bench` at even times from 0 (n,) [s].

    A load [kg] hangs below the rod, and the muscle moves freely.
    """
    hanging = {"drive": "measured", "load": load, "settle": _SWINGING}
    return _run(rig, None, time, pressure[:, None], start_pressure=pressure[:1], **hanging)


def hanging_weight(rig: Rig, load: float) -> float:
    """What hangs on the muscle, rod and load [N], with a load below the rod [kg]."""
    gravity = -float(rig.model.opt.gravity[2])
    return gravity * (float(rig.model.body("rod").mass[0]) + load)


def _run(
    rig: Rig, timestep: float | None, time: FloatArray, command: FloatArray, **experiment: Any
) -> BenchRun:
    imposed = Experiment(
        command_time=time,
        command_value=command,
        duration=float(time[-1]),
        sample_rate=1.0 / float(time[1]),
        **experiment,
    )
    run = simulate(rig, imposed, timestep=timestep).completed()
    start, nominal = _lengths(rig)
    contraction = 1.0 - (start + run.positions[:, 0]) / nominal
    return BenchRun(contraction, run.pressure[:, 0], run.tension[:, 0])


def _lengths(rig: Rig) -> tuple[float, float]:
    """Length of the muscle where the rod's position is 0, and nominal length [m]."""
    muscle = rig.muscles["muscle"]
    return muscle.mounting.length_at_zero, muscle.braided.nominal_length
