"""When which commands reach the valves, and what acts on driven joints.

Commands reach the valves late, each muscle's by its own dead time. MuJoCo delays the control of its
own actuator types only: a plugin sees it as it was set. So the delay is in the commands that a
simulated experiment sets, and in no loop of ``mj_step`` of one's own. A command that arrives within
a time step divides it in two, so that what follows depends smoothly on the delay.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pamsim.core.units import FloatArray
from pamsim.physics.valves import ValvePair
from pamsim.recordings.experiment import Experiment

_ROUNDING = 1e-6  # of a time step: a change closer to its end counts as at the end


class Plan(NamedTuple):
    """What a run commands, in stretches of equal time steps under one command.

    What acts on driven joints is of stretches of a single step, see `pamsim.engine.external.act`.
    """

    first: NDArray[np.int64]  # (n + 1,) stretch that each sample begins with; the last ends them
    command: FloatArray  # (s, m) of each stretch
    timestep: FloatArray  # (s,) [s]
    steps: NDArray[np.int64]  # (s,)
    external: FloatArray  # (s, j)


def command_plan(
    experiment: Experiment,
    commands: FloatArray,
    valves: Sequence[ValvePair],
    imposed: NDArray[np.bool_],
    timestep: float,
    steps: int,
) -> Plan:
    """The plan of an experiment whose commands at the samples are (n, m + j).

    The muscles have valves with delays; of the driven joints (j,) some have their motion imposed. A
    sample has a number of time steps [s].
    """
    drives, each = experiment.drives, steps
    muscles, between = len(drives.muscles), np.array(drives.between)
    values = commands
    if between.any():
        each = 1
        values = experiment.command_at(timestep * np.arange(1, len(commands) * steps + 1))
        values[:, ~between] = np.repeat(commands[:, ~between], steps, axis=0)
    muscle = [
        (
            p if kind == "pressure_set" else 0.0,
            0.0 if kind == "measured" else valve.delay,
            valve.closing_delay if kind == "valve" else 0.0,
        )
        for kind, p, valve in zip(drives.muscles, experiment.start_pressure, valves, strict=True)
    ]
    before, late, longer = np.array(muscle).reshape(-1, 3).T
    edges, command = arriving(values[:, :muscles], before, late / timestep, each, longer / timestep)
    lengths = np.diff(edges)
    plan = Plan(
        first=np.searchsorted(edges, np.arange(len(commands) + 1) * steps),
        command=command,
        timestep=np.minimum(lengths, 1.0) * timestep,
        steps=np.ceil(lengths).astype(np.int64),
        external=np.empty((len(lengths), 0)),
    )
    if not drives.joints:
        return plan
    ends = np.cumsum(plan.timestep * plan.steps)
    acting = experiment.command_at(ends)[:, muscles:]
    if not imposed.all():
        middle = experiment.command_at(ends - 0.5 * plan.timestep)[:, muscles:]
        acting[:, ~imposed] = middle[:, ~imposed]
    last = int(plan.first[-2])
    if last >= 3:  # the motion goes on, or stopping at the last sample would show as a blow
        one, two, three = acting[last - 3 : last, imposed]
        acting[last, imposed] = one - 3.0 * two + 3.0 * three
    return plan._replace(external=np.ascontiguousarray(acting))


def arriving(
    values: FloatArray,
    before: FloatArray,
    late: FloatArray,
    each: int,
    longer: FloatArray | float = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """When the commands at the valves may change, and what they are in between.

    Commands (n, m) are held for some time steps each, those (m,) before time 0 until then; the
    muscles hear them late (m,), and those that are nearer to 0 longer (m,) after that, in time
    steps. A command that a later one overtakes is never heard.

    Returns:
        (s + 1,) edges in time steps, between which lie whole steps or part of one; (s, m) commands.
    """
    late, longer = np.broadcast_arrays(late, longer)
    grid = np.arange(len(values) + 1.0) * each
    if not (late.any() or longer.any()):
        return grid, np.ascontiguousarray(values)
    heard = [
        _heard(np.append(first, own), each, *times)
        for first, own, *times in zip(before, values.T, late, longer, strict=True)
    ]
    changes = np.concatenate([arrival for arrival, _ in heard])
    changes = changes[(changes >= 0.0) & (changes < len(values) * each)]
    edges: Any = np.unique(np.concatenate([grid, changes, np.floor(changes), np.ceil(changes)]))
    # Sums that should be equal differ by rounding.
    edges = edges[np.diff(edges, prepend=-1.0) > 0.5 * _ROUNDING]
    middle = 0.5 * (edges[:-1] + edges[1:])
    columns = [own[np.searchsorted(arrival, middle) - 1] for arrival, own in heard]
    return edges, np.stack(columns, axis=1)


def _heard(
    held: FloatArray, each: int, late: float, longer: float
) -> tuple[FloatArray, FloatArray]:
    """Commands that a muscle hears, and when; the first always was.

    Those held for some time steps each, the first until time 0, go in.
    """
    changed = np.flatnonzero(np.diff(held))
    size = np.abs(held)
    arrival = changed * each + late + longer * (size[changed + 1] < size[changed])
    whole = np.round(arrival)
    arrival = np.where(np.abs(arrival - whole) < _ROUNDING, whole, arrival)
    following = np.minimum.accumulate(arrival[::-1])[::-1]
    in_time = arrival < np.append(following[1:], np.inf)
    return np.append(-np.inf, arrival[in_time]), held[np.append(0, changed[in_time] + 1)]
