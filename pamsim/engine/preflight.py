"""What must hold before a muscle is stepped: checks of a model, its muscles and an experiment.

Muscles on one chain or supply state the same chain or supply, the time step is short enough,
commands ask for no more than the supply has, no muscle is longer than its fibres, and each control
has a range.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.engine.stepping import muscle_ids
from pamsim.physics.chosen_law import law_pushes
from pamsim.physics.commands import MEASURED, PRESSURE_SET
from pamsim.physics.friction import stribeck_damping
from pamsim.physics.muscle import Muscle
from pamsim.physics.muscle_length import chain_length
from pamsim.physics.muscle_valves import SENSOR_ERROR
from pamsim.physics.record import Row, slot, view
from pamsim.physics.regulation import regulator_time_constant
from pamsim.physics.static_muscle import muscle_length
from pamsim.physics.step_limits import bristle_stiffness, chain_step_limit
from pamsim.recordings.experiment import Experiment

_COMMAND, _PARTNER = slot("command"), slot("partner")
_SUPPLY, _LINE = slot("valve.supply_pressure"), slot("valve.supply_line")
_FALL = [slot("valve.supply_resistance"), slot("valve.supply_square")]
_SHARED = (
    "valve.supply_pressure",
    "valve.supply_resistance",
    "valve.supply_square",
    "valve.supply_volume",
    "chamber.temperature",
    "chamber.atmosphere",
)
_MOST_BENDING = 2.0  # half of where an arm on its bristles becomes unstable
_ROUNDING = 1e-9


def control_range(par: Row) -> tuple[float, float] | None:
    """Ends of the range of a muscle's control; None for a measured pressure, which has none.

    Args:
        par: parameter row.

    Returns:
        Gauge pressures [Pa] of a set point, up to the supply's; -1 and 1 of a valve or duty.
    """
    if par[_COMMAND] == MEASURED:
        return None
    return (0.0, float(par[_SUPPLY])) if par[_COMMAND] == PRESSURE_SET else (-1.0, 1.0)


def state_control_ranges(model: mujoco.MjModel) -> None:
    """Write ``actuator_ctrlrange`` of all muscles of a model, which sliders and users go by.

    It changes no step: the valves' laws hold beyond it, too.
    """
    for index in muscle_ids(model):
        ends, at = control_range(model.actuator_user[index]), model.actuator_ctrladr[index]
        model.actuator_ctrllimited[at] = ends is not None
        model.actuator_ctrlrange[at] = ends or 0.0


def check_lengths(
    model: mujoco.MjModel, data: mujoco.MjData, pressures: NDArray[np.float64]
) -> None:
    """Check that no muscle is longer than its fibres at the present position.

    Args:
        model: a model with pamsim muscles.
        data: its data, tendons measured.
        pressures: (m,) gauge pressure of each muscle [Pa], which may stretch the fibres.

    Raises:
        InputError: naming the first one with both lengths.
    """
    for index, pressure in zip(muscle_ids(model), pressures.tolist(), strict=True):
        m = view(model.actuator_user[index])
        if law_pushes(m):
            continue
        tendon = float(data.actuator_length[model.actuator_outadr[index]])
        length = muscle_length(m, chain_length(m, tendon))
        stretched = 1.0 + m.braid.extensibility * max(pressure, 0.0)
        straight = m.braid.nominal_length * stretched / math.cos(m.braid.fibre_angle)
        if length > (1.0 + _ROUNDING) * straight:
            raise InputError(
                f"muscle {model.actuator(index).name!r} would be {length:.4g} m long where it"
                f" starts, but its fibres are straight at {straight:.4g} m; give a smaller"
                " length_at_zero (of pamsim.attach, or mounting.length_at_zero of a rig), a longer"
                " braid.nominal_length or another position"
            )


def check_backlash(model: mujoco.MjModel, muscles: Mapping[str, Muscle]) -> None:
    """Check that both muscles of a chain state the same backlash: the chain shifts as a whole.

    Args:
        model: set up for an experiment.
        muscles: its muscles, in actuator order.

    Raises:
        InputError: if they differ in backlash, or in the damping of the chain within it.
    """
    named = dict(zip(muscle_ids(model), muscles, strict=True))
    for index, name in named.items():
        partner = named.get(int(model.actuator_user[index, _PARTNER]) - 1)
        if partner is None:
            continue
        first, second = muscles[name].chain, muscles[partner].chain
        if first.backlash != second.backlash:
            raise InputError(f"{name} and {partner} share a chain: give both one chain.backlash")
        if first.backlash > 0.0 and first.seating_damping != second.seating_damping:
            raise InputError(
                f"{name} and {partner} share a chain: give both one chain.seating_damping"
            )


def above_supply(
    muscles: Mapping[str, Muscle], experiments: Iterable[Experiment]
) -> tuple[str, ...]:
    """What experiments ask of the supply that it does not have, a sentence for each muscle.

    Args:
        muscles: of the rig that runs them, in actuator order.
        experiments: commands in that order; measured pressures ask nothing of the supply.
    """
    highest: dict[tuple[str, str], float] = {}
    for experiment in experiments:
        for i, (name, kind) in enumerate(zip(muscles, experiment.drives.muscles, strict=True)):
            asked = {"start pressure": float(experiment.start_pressure[i])}
            if kind == "pressure_set":
                asked["set point"] = float(experiment.command_value[:, i].max())
            for what, pressure in asked.items() if kind != "measured" else ():
                highest[name, what] = max(pressure, highest.get((name, what), 0.0))
    return tuple(
        f"{name}: a {what} of {pressure / 1e3:.4g} kPa is above its supply; the simulation has the"
        f" supply's {supply / 1e3:.4g} kPa instead"
        for (name, what), pressure in highest.items()
        if pressure > (1.0 + SENSOR_ERROR) * (supply := muscles[name].valve.supply_pressure)
    )


def refuse_above_supply(muscles: Mapping[str, Muscle], experiment: Experiment) -> None:
    """Refuse an experiment that asks more of the supply than it has.

    Args:
        muscles: of the rig that runs it, in actuator order.
        experiment: commands in that order.

    Raises:
        InputError: naming the first muscle, and what the simulation would have instead.
    """
    for above in above_supply(muscles, [experiment]):
        raise InputError(f"{above}; lower it, or raise valve.supply_pressure")


def check_supply(model: mujoco.MjModel) -> None:
    """Check that muscles on one supply with resistance state the same supply.

    Raises:
        InputError: naming the first two that differ, and in what.
    """
    first: dict[float, int] = {}
    rows = model.actuator_user
    for index in muscle_ids(model):
        other = first.setdefault(float(rows[index, _LINE]), index)
        if not np.any(rows[[[index], [other]], _FALL]):
            continue
        for name in _SHARED:
            if rows[index, slot(name)] != rows[other, slot(name)]:
                raise InputError(
                    f"{model.actuator(other).name} and {model.actuator(index).name} share a supply:"
                    f" give both one {name}, or each its own valve.supply_line"
                )


def check_timestep(model: mujoco.MjModel, muscles: Mapping[str, Muscle]) -> None:
    """Check a model's time step against the fastest dynamics of its muscles.

    Args:
        model: set up for an experiment.
        muscles: its muscles, in actuator order.

    Raises:
        InputError: if a regulator, a chain or friction along the tendons needs a shorter step.
    """
    step = model.opt.timestep
    # The regulators hold the start pressures in every experiment, whatever its command.
    for name, muscle in muscles.items():
        limit = regulator_time_constant(muscle)
        if step > limit:
            raise InputError(
                f"a time step of {step * 1e3:g} ms is longer than the {limit * 1e3:.2g} ms in"
                f" which the pressure regulator of {name} settles; take a shorter step, a larger"
                " valve.tube_volume behind a tube, or a wider valve.regulator_band"
            )
    for index, (name, muscle) in zip(muscle_ids(model), muscles.items(), strict=True):
        start = float(model.actuator_length0[index])
        limit = chain_step_limit(muscle, start, muscle.valve.supply_pressure)
        if step > limit:
            raise InputError(
                f"a time step of {step * 1e3:g} ms is longer than the {limit * 1e3:.2g} ms above"
                f" which the chain of {name} becomes unstable; take a shorter step, a longer"
                " chain.relaxation_time or, with backlash, a larger chain.seating_damping"
            )
    braking = _braking_rate(model, muscles)
    if step * braking > 1.0:
        raise InputError(
            f"a time step of {step * 1e3:g} ms is longer than the {1e3 / braking:.2g} ms in which"
            " friction stops the arm; take a shorter step, a smaller friction.stribeck_force or"
            " braid.friction or stroke.damping, or a larger friction.stribeck_velocity"
        )
    bending = _bending(model, muscles, step)
    if bending > _MOST_BENDING:
        raise InputError(
            f"a time step of {step * 1e3:g} ms is too long for the bristles of the dry friction;"
            " take a shorter step, a smaller friction.bristle_time or a larger friction.presliding"
        )


def _bending(model: mujoco.MjModel, muscles: Mapping[str, Muscle], step: float) -> float:
    """Bound on w^2 (h^2 + 2 t h) of the arm on the bristles, with their damping time t [-].

    With the frequency w of the arm on its bristles and the step h; it is stable up to 4.
    """
    total = 0.0
    for index, muscle in zip(muscle_ids(model), muscles.values(), strict=True):
        start = float(model.actuator_length0[index])
        stiffness = bristle_stiffness(muscle, start, muscle.valve.supply_pressure)
        weight = float(model.tendon_invweight0[model.actuator_trnid[index, 0]])
        total += stiffness * weight * step * (step + 2.0 * muscle.friction.bristle_time)
    return total


def _braking_rate(model: mujoco.MjModel, muscles: Mapping[str, Muscle]) -> float:
    """Bound on the rate at which friction stops any motion from the initial position [1/s].

    The sum over tendons of slope times inverse inertia is a trace: no less than any eigenvalue.
    """
    total = 0.0
    for index, muscle in zip(muscle_ids(model), muscles.values(), strict=True):
        slope = stribeck_damping(muscle.friction.stribeck_force, muscle.friction.stribeck_velocity)
        if muscle.braid is not None:
            braid = muscle.braid
            slope += braid.friction * muscle.valve.supply_pressure / braid.nominal_length
        if muscle.stroke is not None:
            slope += muscle.stroke.damping
        total += slope * float(model.tendon_invweight0[model.actuator_trnid[index, 0]])
    return total
