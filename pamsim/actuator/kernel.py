"""The muscle actuator: the one composition of all laws, from parameters and state to force.

Every function takes the parameter row ``par`` and the states ``act`` of one actuator in the layout
of `pamsim.actuator.layout`. They are ordinary Python over anything that can be indexed, and the
engine compiles these same functions for its native callback. An effect at its neutral value leaves
the result unchanged to the last bit.
"""

from __future__ import annotations

import math
from collections.abc import MutableSequence, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pamsim.actuator.layout import slot
from pamsim.hysteresis.bouc_wen import bouc_wen_rate
from pamsim.muscles.braid import volume
from pamsim.muscles.exponential import six_parameter_force
from pamsim.muscles.mckibben import ideal_force
from pamsim.muscles.passive import hardening_force
from pamsim.muscles.tension import effective_pressure, taut
from pamsim.pneumatics.chamber import absolute_pressure, air_state, air_state_rate
from pamsim.pneumatics.valves import (
    clamped_opening,
    pulsed_opening,
    regulated_opening,
    valve_flow,
)

Row: TypeAlias = Sequence[float] | NDArray[np.float64]
MutableRow: TypeAlias = MutableSequence[float] | NDArray[np.float64]

_COMMAND = slot("command")
_FORCE_LAW = slot("force.law")
_HYSTERESIS_LAW = slot("hysteresis.law")
_LENGTH_AT_ZERO = slot("mounting.length_at_zero")
_NOMINAL_LENGTH = slot("braid.nominal_length")
_DIAMETER = slot("braid.diameter")
_FIBRE_ANGLE = slot("braid.fibre_angle")
_PASSIVE_STIFFNESS = slot("passive.stiffness")
_PASSIVE_HARDENING = slot("passive.hardening")
_PASSIVE_SLACK = slot("passive.slack_contraction")
_THRESHOLD = slot("threshold.pressure")
_POLYTROPIC = slot("chamber.polytropic_index")
_TEMPERATURE = slot("chamber.temperature")
_DEAD_VOLUME = slot("chamber.dead_volume")
_ATMOSPHERE = slot("chamber.atmosphere")
_FLOOR = slot("chamber.floor")
_FILL = slot("valve.conductance_fill")
_EXHAUST = slot("valve.conductance_exhaust")
_CRITICAL = slot("valve.critical_ratio")
_LAMINAR = slot("valve.laminar_ratio")
_SUPPLY = slot("valve.supply_pressure")
_PULSE_PERIOD = slot("valve.pulse_period")
_BAND = slot("valve.regulator_band")
_DEAD_BAND = slot("valve.regulator_dead_band")
_F = slot("force.0")
_H = slot("hysteresis.0")


def muscle_length(par: Row, tendon_length: float) -> float:
    """Length of the muscle l [m] from the length of its tendon [m]."""
    return par[_LENGTH_AT_ZERO] + tendon_length


def contraction(par: Row, tendon_length: float) -> float:
    """Contraction kappa = 1 - l/l0 [-] from the length of the tendon [m]."""
    return 1.0 - muscle_length(par, tendon_length) / par[_NOMINAL_LENGTH]


def chamber_volume(par: Row, tendon_length: float) -> float:
    """Volume of the air [m^3]: inside of the braid and the tubing."""
    length = muscle_length(par, tendon_length)
    braid = volume(length, par[_NOMINAL_LENGTH], par[_DIAMETER], par[_FIBRE_ANGLE])
    return braid + par[_DEAD_VOLUME]


def chamber_pressure(par: Row, act: Row, tendon_length: float) -> float:
    """Absolute pressure in the chamber [Pa].

    A chamber without air is one whose state was never set (a bare ``mj_resetData`` zeroes it): it
    gives NaN, so that the run stops there and not at a plausible wrong number.
    """
    air = act[len(act) - 1]
    if not air > 0.0:
        return math.nan
    return absolute_pressure(air, chamber_volume(par, tendon_length), par[_POLYTROPIC], par[_FLOOR])


def gauge_pressure(par: Row, act: Row, tendon_length: float) -> float:
    """Gauge pressure in the chamber [Pa]."""
    return chamber_pressure(par, act, tendon_length) - par[_ATMOSPHERE]


def charged_air_state(par: Row, tendon_length: float, pressure: float) -> float:
    """Air state y that gives a gauge pressure [Pa] at a tendon length [m]."""
    return air_state(
        pressure + par[_ATMOSPHERE], chamber_volume(par, tendon_length), par[_POLYTROPIC]
    )


def static_force(par: Row, tendon_length: float, pressure: float) -> float:
    """Signed muscle force without hysteresis [N] at a gauge pressure [Pa]."""
    length = muscle_length(par, tendon_length)
    kappa = 1.0 - length / par[_NOMINAL_LENGTH]
    felt = effective_pressure(pressure, par[_THRESHOLD])
    if par[_FORCE_LAW] == 0.0:
        active = ideal_force(felt, length, par[_NOMINAL_LENGTH], par[_DIAMETER], par[_FIBRE_ANGLE])
    else:
        active = six_parameter_force(
            felt,
            kappa,
            par[_F + 1],
            par[_F + 2],
            par[_F + 3],
            par[_F + 4],
            par[_F + 5],
            par[_F + 6],
        )
    passive = hardening_force(
        kappa, par[_PASSIVE_STIFFNESS], par[_PASSIVE_HARDENING], par[_PASSIVE_SLACK]
    )
    return par[_F] * active + passive


def tension(par: Row, act: Row, tendon_length: float) -> float:
    """Tension of the muscle [N], never negative; NaN if the chamber was never charged."""
    pressure = gauge_pressure(par, act, tendon_length)
    force = static_force(par, tendon_length, pressure)
    if par[_HYSTERESIS_LAW] == 1.0:
        force -= (par[_H] + par[_H + 1] * effective_pressure(pressure, 0.0)) * act[0]
    return taut(force)


def valve_opening(par: Row, command: float, pressure: float, time: float) -> float:
    """Signed opening of the valve pair that a command means, in [-1, 1].

    Args:
        par: parameter row.
        command: signed opening, signed duty or gauge pressure [Pa], as the row says.
        pressure: gauge pressure in the chamber [Pa].
        time: [s].
    """
    if par[_COMMAND] == 0.0:
        return clamped_opening(command)
    if par[_COMMAND] == 1.0:
        return pulsed_opening(command, time, par[_PULSE_PERIOD])
    return regulated_opening(command, pressure, par[_BAND], par[_DEAD_BAND])


def air_flow(par: Row, pressure_abs: float, command: float, time: float) -> float:
    """Mass flow into the chamber [kg/s] at an absolute pressure [Pa] in it."""
    atmosphere = par[_ATMOSPHERE]
    return valve_flow(
        valve_opening(par, command, pressure_abs - atmosphere, time),
        pressure_abs,
        par[_SUPPLY] + atmosphere,
        atmosphere,
        par[_FILL],
        par[_EXHAUST],
        par[_CRITICAL],
        par[_LAMINAR],
        par[_TEMPERATURE],
    )


def state_rates(
    par: Row,
    act: Row,
    rates: MutableRow,
    tendon_length: float,
    tendon_velocity: float,
    command: float,
    time: float,
    timestep: float,
) -> None:
    """Write the rates of all states of one muscle.

    Args:
        par: (SIZE,) parameter row.
        act: (n,) states, the air state last.
        rates: (n,) written: their rates [1/s].
        tendon_length: [m].
        tendon_velocity: [m/s].
        command: see `valve_opening`.
        time: [s].
        timestep: [s]; an operator that steps from turning point to turning point writes the rate
            that takes it to its next memory in one Euler step of this length.
    """
    last = len(act) - 1
    pressure_abs = chamber_pressure(par, act, tendon_length)
    if par[_HYSTERESIS_LAW] == 1.0:
        rates[0] = bouc_wen_rate(
            act[0],
            -tendon_velocity / par[_NOMINAL_LENGTH],
            par[_H + 2],
            par[_H + 3],
            par[_H + 4],
        )
    rates[last] = air_state_rate(
        act[last],
        pressure_abs,
        chamber_volume(par, tendon_length),
        par[_TEMPERATURE],
        air_flow(par, pressure_abs, command, time),
    )
