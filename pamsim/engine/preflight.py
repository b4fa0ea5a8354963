"""What must hold before a muscle is stepped: checks of a model, its muscles and an experiment.

Muscles on one chain or supply state the same chain or supply, the time step is short enough,
commands ask for no more than the supply has, and each control has a range.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

import mujoco
import numpy as np

from pamsim.core.errors import InputError
from pamsim.engine.stepping import muscle_ids
from pamsim.physics.friction import stribeck_damping
from pamsim.physics.muscle import Muscle
from pamsim.physics.muscle_valves import SENSOR_ERROR
from pamsim.physics.record import Row, slot
from pamsim.physics.step_limits import bristle_stiffness, chain_step_limit, regulator_time_constant
from pamsim.physics.valves import MEASURED, PRESSURE_SET
from pamsim.recordings.experiment import Experiment

_COMMAND, _PARTNER = slot("command"), slot("partner")
_SUPPLY, _LINE = slot("valve.supply_pressure"), slot("valve.supply_line")
_FALL = ("valve.supply_resistance", "valve.supply_square")
_SUPPLIED = (
    *_FALL,
    "valve.supply_pressure",
    "valve.supply_volume",
    "chamber.temperature",
    "chamber.atmosphere",
)
_CHAINED = ("chain.backlash", "chain.seating_damping", "chain.tooth_compliance")
_SHARED = {
    "supply": (_FALL, _SUPPLIED, ", or each its own valve.supply_line"),
    "chain": (("chain.backlash",), _CHAINED, ""),
}
"""What muscles share -> fields with which it matters, fields to be equal, what else they can do."""

_MOST_BENDING = 2.0  # half of where an arm on its bristles becomes unstable


def control_range(par: Row) -> tuple[float, float] | None:
    """Ends of the range of a muscle's control, by its row of parameters.

    Gauge pressures [Pa] of a set point, up to the supply's; -1 and 1 of a valve or duty; None for a
    measured pressure, which has none.
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


def check_shared(model: mujoco.MjModel) -> None:
    """Check that muscles on one supply with resistance, or one chain with play, state the same.

    Raises:
        InputError: naming the first two that differ, and in what.
    """
    rows, first = model.actuator_user, {}
    for index in muscle_ids(model):
        partner = int(rows[index, _PARTNER]) - 1
        others = {
            "supply": first.setdefault(float(rows[index, _LINE]), index),
            "chain": partner if 0 <= partner < index else index,
        }
        for what, (mattering, equal, instead) in _SHARED.items():
            pair = rows[[others[what], index]]
            if not pair[:, [slot(name) for name in mattering]].any():
                continue
            for name in equal:
                if np.ptp(pair[:, slot(name)]):
                    both = f"{model.actuator(others[what]).name} and {model.actuator(index).name}"
                    raise InputError(f"{both} share a {what}: give both one {name}{instead}")


def above_supply(
    muscles: Mapping[str, Muscle], experiments: Iterable[Experiment]
) -> tuple[str, ...]:
    """What experiments ask of the supply that it does not have, a sentence for each muscle.

    Their commands are in the order of the muscles; measured pressures ask nothing of the supply.
    """
    return tuple(f"{one}, which the simulation has instead" for one in _above(muscles, experiments))


def _above(muscles: Mapping[str, Muscle], experiments: Iterable[Experiment]) -> Iterator[str]:
    highest: dict[tuple[str, str], float] = {}
    for experiment in experiments:
        for i, (name, kind) in enumerate(zip(muscles, experiment.drives.muscles, strict=True)):
            asked: dict[str, float] = {}
            if kind == "pressure_set":  # it comes first: a start that was not given follows from it
                asked["set point"] = float(experiment.command_value[:, i].max())
            asked["start pressure"] = float(experiment.start_pressure[i])
            for what, pressure in asked.items() if kind != "measured" else ():
                highest[name, what] = max(pressure, highest.get((name, what), 0.0))
    for (name, what), pressure in highest.items():
        supply = muscles[name].valve.supply_pressure
        if pressure > (1.0 + SENSOR_ERROR) * supply:
            yield (
                f"{name}: a {what} of {pressure / 1e3:,.6g} kPa is above its supply of"
                f" {supply / 1e3:,.6g} kPa"
            )


def refuse_above_supply(muscles: Mapping[str, Muscle], experiment: Experiment) -> None:
    """Refuse an experiment that asks more of the supply than it has, see `above_supply`.

    Raises:
        InputError: naming the first muscle.
    """
    for above in _above(muscles, [experiment]):
        raise InputError(
            f"{above}: lower it, or raise valve.supply_pressure; on the command line a bare number"
            " is in kPa, others have their unit: 487000Pa"
        )


class MuscleLimits(NamedTuple):
    """What the dynamics of a muscle ask of a time step.

    Attributes:
        name: of the muscle.
        regulator: time in which its pressure regulator settles [s].
        chain: longest step of its chain [s].
        damping: steepest slope of its friction over the tendon's speed [N s/m].
        bristles: stiffness of its dry friction before it slips [N/m].
        bristle_time: damping time of these [s].
    """

    name: str
    regulator: float
    chain: float
    damping: float
    bristles: float
    bristle_time: float


def muscle_limits(model: mujoco.MjModel, muscles: Mapping[str, Muscle]) -> list[MuscleLimits]:
    """Limits of a model's muscles, in actuator order."""
    found: list[MuscleLimits] = []
    for index, (name, muscle) in zip(muscle_ids(model), muscles.items(), strict=True):
        start, supply = float(model.actuator_length0[index]), muscle.valve.supply_pressure
        damping = stribeck_damping(muscle.friction)
        if muscle.braid is not None:
            damping += muscle.braid.friction * supply / muscle.braid.nominal_length
        if muscle.stroke is not None:
            damping += muscle.stroke.damping
        found.append(
            MuscleLimits(
                name=name,
                regulator=regulator_time_constant(muscle),
                chain=chain_step_limit(muscle, start, supply),
                damping=damping,
                bristles=bristle_stiffness(muscle, start, supply),
                bristle_time=muscle.friction.bristle_time,
            )
        )
    return found


def check_timestep(model: mujoco.MjModel, limits: Iterable[MuscleLimits]) -> None:
    """Check a model's time step against the fastest dynamics of its muscles, in actuator order.

    Raises:
        InputError: if a regulator, a chain or friction along the tendons needs a shorter step.
    """

    def require(limit: float, why: str) -> None:
        if (step := model.opt.timestep) > limit:
            raise InputError(
                f"a time step of {step * 1e3:g} ms is longer than the {limit * 1e3:.2g} ms {why}"
            )

    # Sums over the tendons of what acts times inverse inertia: a trace, so no less than any
    # eigenvalue. Damping, stiffness of the bristles, and that times twice their damping time.
    braking = bending = creeping = 0.0
    for index, muscle in zip(muscle_ids(model), limits, strict=True):
        require(
            # They hold the start pressures in every experiment, whatever its command.
            muscle.regulator,
            f"in which the pressure regulator that holds {muscle.name}'s start pressure settles;"
            " take a shorter step, a larger valve.tube_volume behind a tube, or a wider"
            " valve.regulator_band",
        )
        require(
            muscle.chain,
            f"above which the chain of {muscle.name} becomes unstable; take a shorter step, a"
            " longer chain.relaxation_time or, with backlash, a larger chain.seating_damping",
        )
        weight = float(model.tendon_invweight0[model.actuator_trnid[index, 0]])
        bristles = weight * muscle.bristles
        braking += weight * muscle.damping
        bending += bristles
        creeping += 2.0 * bristles * muscle.bristle_time
    require(
        1.0 / braking if braking else math.inf,
        "in which friction stops the arm; take a shorter step, a smaller friction.stribeck_force"
        " or braid.friction or stroke.damping, or a larger friction.stribeck_velocity",
    )
    # An arm of frequency w on bristles with the damping time t is stable in steps h while
    # w^2 (h^2 + 2 t h) is below 4.
    rate = (creeping + math.sqrt(creeping**2 + 4.0 * _MOST_BENDING * bending)) / 2.0
    require(
        _MOST_BENDING / rate if rate else math.inf,
        "above which the bristles of the dry friction become unstable; take a shorter step, a"
        " smaller friction.bristle_time or a larger friction.presliding",
    )
