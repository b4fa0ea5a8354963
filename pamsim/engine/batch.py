"""Many simulations at once, each with its own rig and experiment, on a pool of threads.

Every simulation has a model of its own, so whatever `Rig.with_parameters` can set may differ, and
the loads, commands and lengths of the experiments too. The engine steps outside Python's lock, so
that two threads are nearly twice as fast as one.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.engine.preflight import refuse_above_supply
from pamsim.engine.rig import Rig
from pamsim.engine.settle import settle_quickly
from pamsim.engine.simulate import Run, prepare, record
from pamsim.engine.state import restore_state, save_state, settled
from pamsim.engine.stepping import live
from pamsim.engine.trace import engine_warnings_held
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.recording import Recording
from pamsim.recordings.rig_file import RigFile

_Key: TypeAlias = tuple[object, ...]


class ReusedData(threading.local):
    """Data of rigs, of which each thread has its own: making one takes a hundred time steps.

    Models of one rig file are copies of one compiled model, so that they share a data, which holds
    whatever was last done with it.
    """

    def __init__(self) -> None:
        self._known: dict[int, tuple[RigFile, mujoco.MjData]] = {}

    def of(self, rig: Rig) -> mujoco.MjData:
        """Data for a rig's models in this thread."""
        key = id(rig.file)
        if key not in self._known:
            self._known[key] = rig.file, mujoco.MjData(rig.model)
        return self._known[key][1]


@dataclass(frozen=True)
class _Rest:
    """A rig at rest before time 0, and the engine's warnings until then."""

    state: NDArray[np.float64]
    warnings: NDArray[np.int32]


def simulate_batch(
    jobs: Sequence[tuple[Rig, Experiment]],
    *,
    timestep: float | None = None,
    settle_steps: int = 1,
    threads: int | None = None,
    simulated: Callable[[], None] | None = None,
    above_supply: bool = False,
) -> list[Recording]:
    """Run many experiments at once.

    Each result is bit-identical to that of `pamsim.simulate`, broken runs included.
    Experiments that start from the same pressures with the same load on the same rig object come to
    rest once for all of them.

    Args:
        jobs: rig and experiment of each simulation.
        timestep: [s]; each rig's own if left out.
        settle_steps: time steps that rigs come to rest in, in those of the experiments. More than 1
            is quicker and leaves rest where it is, but memory a little off; it is not done where
            a muscle does not allow it.
        threads: how many run at a time; one per processor if left out.
        simulated: called as each simulation ends.
        above_supply: True to simulate experiments that ask for more pressure than the supply has,
            as recordings do whose supply is stated too low: the valves stay open, and the pressure
            ends at the supply's. `pamsim.engine.preflight.above_supply` says which do.

    Returns:
        One recording per job, in their order.

    Raises:
        InputError: if an experiment does not fit its rig or the time step, or asks for more
            pressure than the supply has, or there is no thread.
        EngineError: if a rig's integrator cannot carry the muscles' memory.
        InvariantError: while `pamsim.checks` is on, if a run reaches a state that cannot be and its
            outcome does not report that it broke down.
    """
    if threads is not None and threads < 1:
        raise InputError(f"{threads} threads cannot run a simulation; give 1 or more")
    reused = ReusedData()
    runs = [
        prepare(rig, experiment, timestep=timestep, data=reused.of(rig)) for rig, experiment in jobs
    ]
    if not above_supply:
        for run in runs:
            refuse_above_supply(run.rig.muscles, run.experiment)
    first = _first_of_each_start(runs)
    with (
        live(*(run.model for run in runs)),
        engine_warnings_held(),
        ThreadPoolExecutor(threads or os.cpu_count()) as pool,
    ):
        rests = _rests(first, settle_steps, reused, pool)
        recordings: list[Recording] = []

        def recorded_from_rest(run: Run) -> Recording:
            data = _begun(run, rests[_start(run)], reused)
            return record(run, data, tried=True, above_supply=above_supply)

        recorded = pool.map(recorded_from_rest, runs)
        for recording in recorded:
            recordings.append(recording)
            if simulated is not None:
                simulated()
        return recordings


def _start(run: Run) -> _Key:
    """What the state at time 0 depends on; the time step is the same in a rig and batch."""
    start = run.experiment
    joints = start.command_value[0, len(start.drives.muscles) :]
    driven = (tuple(start.drives.joints.items()), tuple(joints.tolist()))
    return id(run.rig), start.load, tuple(start.start_pressure.tolist()), start.settle, driven


def _first_of_each_start(runs: Sequence[Run]) -> dict[_Key, Run]:
    """Runs that come to rest for all that begin as they do."""
    first: dict[_Key, Run] = {}
    for run in runs:
        first.setdefault(_start(run), run)
    return first


def _rests(
    first: Mapping[_Key, Run], steps: int, reused: ReusedData, pool: ThreadPoolExecutor
) -> dict[_Key, _Rest]:
    """Runs brought to rest, several at a time."""
    settling = pool.map(lambda run: _settled(run, steps, reused), first.values())
    return dict(zip(first, settling, strict=True))


def _settled(run: Run, steps: int, reused: ReusedData) -> _Rest:
    data = reused.of(run.rig)
    settle_quickly(run.model, data, run.experiment, run.rig.muscles, steps, run.external)
    return _Rest(save_state(run.model, data), data.warning.number.copy())


def rest_states(runs: Sequence[Run], *, threads: int | None = None) -> list[NDArray[np.float64]]:
    """States in which runs begin, as `simulate_batch` brings them to rest.

    Args:
        runs: see `pamsim.engine.simulate.prepare`.
        threads: how many come to rest at a time; one per processor if left out.

    Returns:
        State of each, see `pamsim.restore_state`.
    """
    first, reused = _first_of_each_start(runs), ReusedData()
    with (
        live(*(run.model for run in runs)),
        engine_warnings_held(),
        ThreadPoolExecutor(threads or os.cpu_count()) as pool,
    ):
        rests = _rests(first, 1, reused, pool)
        begun = ((run, _begun(run, rests[_start(run)], reused)) for run in runs)
        return [save_state(run.model, data) for run, data in begun]


def _begun(run: Run, rest: _Rest, reused: ReusedData) -> mujoco.MjData:
    data = reused.of(run.rig)
    mujoco.mj_resetData(run.model, data)
    restore_state(run.model, data, rest.state)
    settled(run.model, data, run.experiment.start_pressure.tolist())  # under the run's own command
    data.warning.number[:] = rest.warnings
    return data
