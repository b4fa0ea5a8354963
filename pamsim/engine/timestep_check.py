"""Refuse a time step that the muscles of a rig cannot be stepped with."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco

from pamsim.core.errors import InputError
from pamsim.engine.stepping import muscle_ids
from pamsim.physics.friction import stribeck_damping
from pamsim.physics.muscle import Muscle
from pamsim.physics.regulation import regulator_time_constant
from pamsim.physics.step_limits import bristle_stiffness, chain_step_limit

_MOST_BENDING = 2.0  # half of where an arm on its bristles becomes unstable


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
