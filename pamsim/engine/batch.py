"""Many simulations at once, each with its own rig and experiment, on a pool of threads.

Every simulation has a model of its own, so whatever `Rig.with_parameters` can set may differ, and
the loads, commands and lengths of the experiments too. The engine steps outside Python's lock, so
that two threads are nearly twice as fast as one.
"""

from __future__ import annotations

import os
import threading
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.engine import checks
from pamsim.engine.external import set_off
from pamsim.engine.preflight import refuse_above_supply
from pamsim.engine.rig import Rig
from pamsim.engine.simulate import Run, prepare, record
from pamsim.engine.state import (
    RestSteps,
    quieten,
    restore_state,
    save_state,
    settle,
    settle_quickly,
)
from pamsim.engine.stepping import engine_warnings_held, live
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.recording import Outcome, Recording

_Begun: TypeAlias = Callable[[Run], mujoco.MjData]


class _ReusedData(dict[tuple[int, int], mujoco.MjData]):
    """Data of rigs, of which each thread has its own: making one takes a hundred time steps.

    Models that are copies of one compiled model share a data, which holds whatever was last done
    with it. The rigs have to exist meanwhile.
    """

    def of(self, rig: Rig) -> mujoco.MjData:
        key = threading.get_ident(), id(rig.compiled)
        if key not in self:
            self[key] = mujoco.MjData(rig.model)
        return self[key]


def simulate_batch(
    jobs: Sequence[tuple[Rig, Experiment]],
    *,
    timestep: float | None = None,
    rest_steps: RestSteps | None = None,
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
        rest_steps: time steps in which rigs come to rest; those of the experiments if left out.
            Longer ones are quicker and leave rest where it is, but memory a little off; they are
            not taken where a muscle does not allow them.
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
    reused = _ReusedData()
    runs = [
        prepare(rig, experiment, timestep=timestep, data=reused.of(rig)) for rig, experiment in jobs
    ]
    for run in () if above_supply else runs:
        refuse_above_supply(run.rig.muscles, run.experiment)
    recordings: list[Recording] = []
    with _rested(runs, rest_steps, threads, reused) as (pool, begun):

        def recorded(run: Run) -> Recording:
            found = record(run, begun(run))
            if found.outcome is not Outcome.COMPLETED:
                checks.forget(run.model)  # it is read
            if above_supply:
                checks.forget(run.model, above_supply=True)
            return found

        for recording in pool.map(recorded, runs):
            recordings.append(recording)
            if simulated is not None:
                simulated()
    return recordings


def rest_states(runs: Sequence[Run], *, threads: int | None = None) -> list[FloatArray]:
    """States in which runs begin, as `simulate_batch` brings them to rest in some threads."""
    with _rested(runs, None, threads, _ReusedData()) as (pool, begun):
        return list(pool.map(lambda run: save_state(run.model, begun(run)), runs))


@contextmanager
def _rested(
    runs: Sequence[Run], steps: RestSteps | None, threads: int | None, reused: _ReusedData
) -> Iterator[tuple[ThreadPoolExecutor, _Begun]]:
    """Runs at rest, once for all with the same start: a pool, and what begins a run in a thread."""

    def settled(run: Run) -> mujoco.MjData:
        data = reused.of(run.rig)
        if steps is None:
            settle(run.model, data, run.experiment, run.external)
        else:
            settle_quickly(run.model, data, run.experiment, run.rig.limits, steps, run.external)
        return data

    def kept(run: Run) -> tuple[FloatArray, NDArray[np.int32]]:
        data = settled(run)
        return save_state(run.model, data), data.warning.number.copy()

    def begun(run: Run) -> mujoco.MjData:
        start = _start(run)
        if start in rests:
            data, (state, warnings) = reused.of(run.rig), rests[start]
            mujoco.mj_resetData(run.model, data)
            restore_state(run.model, data, state)
            quieten(run.model, data, run.experiment.start_pressure)  # under the run's own command
            data.warning.number[:] = warnings
        else:
            data = settled(run)
        set_off(data, run.external, run.experiment, run.model.opt.timestep)
        return data

    begin = Counter(map(_start, runs))
    shared = {_start(run): run for run in reversed(runs) if begin[_start(run)] > 1}
    with (
        live(*(run.model for run in runs)),
        engine_warnings_held(),
        ThreadPoolExecutor(threads or os.cpu_count()) as pool,
    ):
        rests = dict(zip(shared, pool.map(kept, shared.values()), strict=True))
        yield pool, begun


def _start(run: Run) -> tuple[object, ...]:
    """What the state at time 0 depends on; the time step is the same in a rig and batch."""
    start = run.experiment
    joints = start.command_value[0, len(start.drives.muscles) :]
    # The air state of a muscle whose pressure is measured is that pressure.
    measured = tuple(kind == "measured" for kind in start.drives.muscles)
    drives = (measured, tuple(start.drives.joints.items()), tuple(joints.tolist()))
    return id(run.rig), start.load, tuple(start.start_pressure.tolist()), start.settle, drives
