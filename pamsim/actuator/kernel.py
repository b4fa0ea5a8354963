"""The muscle actuator: the one composition of all laws, from parameters and state to force.

Every function takes the parameter row ``par`` and the states ``act`` of one actuator in the layout
of `pamsim.actuator.layout`. They are ordinary Python over anything that can be indexed, and the
engine compiles these same functions for its native callback. An effect at its neutral value leaves
the result unchanged to the last bit.
"""

from __future__ import annotations

import math

from pamsim.actuator.chain import extension_rate, rippled_ratio, rippled_travel, shift_rate
from pamsim.actuator.friction import dry_friction, stribeck_friction
from pamsim.actuator.layout import (
    AIR,
    AMBIENT,
    CREEP,
    EXTENSION,
    LINE,
    OPENING,
    RUBBING,
    SAG,
    SHIFT,
    TUBE,
    MutableRow,
    Row,
    slot,
)
from pamsim.hysteresis.catalog import chosen_energy, chosen_output, chosen_rates
from pamsim.hysteresis.group import COMMON_FIELDS
from pamsim.muscles.braid import braid_friction, pressurised_contraction
from pamsim.muscles.catalog import (
    chosen_force,
    chosen_volume,
    chosen_work,
    volume_depends_on_pressure,
)
from pamsim.muscles.creep import creep_force, creep_rate
from pamsim.muscles.end_shape import force_left, force_left_slope
from pamsim.muscles.passive import locking_force, tube_energy, tube_force
from pamsim.muscles.tension import effective_pressure, taut
from pamsim.pneumatics.air import GAS_CONSTANT
from pamsim.pneumatics.chamber import absolute_pressure, air_state_rate, relaxing_rate
from pamsim.pneumatics.orifice import mass_flow
from pamsim.pneumatics.supply import Valves, supply_sag
from pamsim.pneumatics.tube import line_outflow, near_end_pressure
from pamsim.pneumatics.valves import (
    clamped_opening,
    line_rate,
    past_dead_zone,
    pulsed_opening,
    regulated_opening,
    slewed_opening,
    valve_flow,
)

_COMMAND = slot("command")
_FORCE_LAW = slot("force.law")
_FORCE_SCALE = slot("force.0")
_FORCE_COEFFICIENTS = _FORCE_SCALE + 1
_HYSTERESIS_LAW = slot("hysteresis.law")
_HYSTERESIS = slot("hysteresis.0")
_HYSTERESIS_OWN = _HYSTERESIS + COMMON_FIELDS
_COMPLIANCE = slot("chain.compliance")
_RELAXATION = slot("chain.relaxation_time")
_BACKLASH = slot("chain.backlash")
_SEATING = slot("chain.seating_damping")
_RIPPLE = slot("chain.ripple")
_RIPPLE_PITCH = slot("chain.ripple_pitch")
_RIPPLE_PHASE = slot("chain.ripple_phase")
_STRIBECK_FORCE = slot("friction.stribeck_force")
_STRIBECK_VELOCITY = slot("friction.stribeck_velocity")
_COULOMB = slot("friction.coulomb_force")
_BREAKAWAY = slot("friction.breakaway_force")
_TENSION_SHARE = slot("friction.tension_share")
_PRESLIDING = slot("friction.presliding")
_BRISTLE_TIME = slot("friction.bristle_time")
_LENGTH_AT_ZERO = slot("mounting.length_at_zero")
_NOMINAL_LENGTH = slot("braid.nominal_length")
_DIAMETER = slot("braid.diameter")
_FIBRE_ANGLE = slot("braid.fibre_angle")
_EXTENSIBILITY = slot("braid.extensibility")
_BRAID_FRICTION = slot("braid.friction")
_PASSIVE_STIFFNESS = slot("passive.stiffness")
_PASSIVE_SOFTENING = slot("passive.softening")
_PASSIVE_SLACK = slot("passive.slack_contraction")
_PASSIVE_LOCKING = slot("passive.locking")
_THRESHOLD = slot("threshold.pressure")
_END_LOSS = slot("end_shape.loss")
_END_ONSET = slot("end_shape.onset")
_CREEP_STIFFNESS = slot("creep.stiffness")
_CREEP_TIME = slot("creep.relaxation_time")
_POLYTROPIC = slot("chamber.polytropic_index")
_TEMPERATURE = slot("chamber.temperature")
_DEAD_VOLUME = slot("chamber.dead_volume")
_ATMOSPHERE = slot("chamber.atmosphere")
_FLOOR = slot("chamber.floor")
_LEAK = slot("chamber.leak_conductance")
_HEAT_RATE = slot("chamber.heat_rate")
_FILL = slot("valve.conductance_fill")
_EXHAUST = slot("valve.conductance_exhaust")
_CRITICAL = slot("valve.critical_ratio")
_LAMINAR = slot("valve.laminar_ratio")
_SUPPLY = slot("valve.supply_pressure")
_RESISTANCE = slot("valve.supply_resistance")
_SUPPLY_VOLUME = slot("valve.supply_volume")
_LINE_LAG = slot("valve.line_lag")
_PULSE_PERIOD = slot("valve.pulse_period")
_BAND = slot("valve.regulator_band")
_DEAD_BAND = slot("valve.regulator_dead_band")
_DEAD_ZONE = slot("valve.dead_zone")
_TRAVEL_TIME = slot("valve.travel_time")
_TUBE_RESISTANCE = slot("valve.tube_resistance")
_TUBE_VOLUME = slot("valve.tube_volume")

_TYPICAL_PRESSURE = 3e5  # gauge [Pa]: where the search for a volume that depends on it starts
_CLOSE = 1e-9  # relative step of the pressure search by secants; what is left is rounding
_GAUSS = (
    (0.1488743389816312, 0.2955242247147529),
    (0.4333953941292472, 0.2692667193099963),
    (0.6794095682990244, 0.2190863625159820),
    (0.8650633666889845, 0.1494513491505806),
    (0.9739065285171717, 0.0666713443086881),
)  # nodes and weights of the rule with ten points on (-1, 1)


def chain_length(par: Row, tendon_length: float) -> float:
    """Tendon length behind the sprocket's teeth [m]."""
    if par[_RIPPLE] == 0.0:
        return tendon_length
    return rippled_travel(tendon_length, par[_RIPPLE], par[_RIPPLE_PITCH], par[_RIPPLE_PHASE])


def chain_ratio(par: Row, tendon_length: float) -> float:
    """Speed behind the sprocket's teeth over that of the tendon [-]; force on it over the pull."""
    if par[_RIPPLE] == 0.0:
        return 1.0
    return rippled_ratio(tendon_length, par[_RIPPLE], par[_RIPPLE_PITCH], par[_RIPPLE_PHASE])


def length_at_muscle(par: Row, act: Row, tendon_length: float) -> float:
    """Tendon length at the muscle [m]: behind the teeth, plus the shift, minus the extension."""
    length = chain_length(par, tendon_length)
    if par[_BACKLASH] > 0.0:
        length = length + act[len(act) - SHIFT]
    if par[_COMPLIANCE] == 0.0:
        return length
    return length - act[len(act) - EXTENSION]


def muscle_length(par: Row, tendon_length: float) -> float:
    """Length of the muscle l [m] from the tendon length at the muscle [m]."""
    return par[_LENGTH_AT_ZERO] + tendon_length


def contraction(par: Row, tendon_length: float) -> float:
    """Contraction kappa = 1 - l/l0 [-] from the length of the tendon [m]."""
    return 1.0 - muscle_length(par, tendon_length) / par[_NOMINAL_LENGTH]


def static_volume(par: Row, tendon_length: float, pressure: float) -> float:
    """Volume of the air [m^3]: tubing, and the muscle's under its force law, without hysteresis.

    The muscle without losses has one energy G(l, p) with F = dG/dl and V = -dG/dp, so the volume
    changes with length as the force does with pressure, dV/dl = -dF/dp, from the braid's volume at
    nominal length on. The air then does the work that the muscle gives.

    Args:
        par: parameter row.
        tendon_length: at the muscle [m].
        pressure: gauge pressure [Pa]; without influence if the force is linear in it.
    """
    kappa = contraction(par, tendon_length)
    return _volume_at_nominal_length(par) + _volume_gained(par, kappa, pressure)


def _volume_at_nominal_length(par: Row) -> float:
    """Tubing, and the cylinder that the braid is at nominal length [m^3]."""
    diameter = par[_DIAMETER]
    return par[_DEAD_VOLUME] + 0.25 * math.pi * diameter * diameter * par[_NOMINAL_LENGTH]


def _volume_gained(par: Row, kappa: float, pressure: float) -> float:
    """Volume gained since nominal length [m^3].

    Active force and tube know the contraction q against the length s l0 that the pressurised muscle
    has when free, s = 1 + e p. The integral of d F(p, q(p, kappa)) / dp by kappa is s times that of
    dF/dp by q, and, with dq/dp = e (1 - q) / s, e times that of (1 - q) dF/dq by q, by parts.
    """
    nominal, extensibility = par[_NOMINAL_LENGTH], par[_EXTENSIBILITY]
    effective = effective_pressure(pressure, par[_THRESHOLD])
    if extensibility == 0.0:
        return nominal * _active_gain(par, effective, kappa)
    grown = 1.0 + extensibility * pressure
    free, strained = 1.0 - 1.0 / grown, 1.0 - (1.0 - kappa) / grown
    gained, work = _gain_and_work(par, effective, strained)
    gained_free, work_free = _gain_and_work(par, effective, free)
    return nominal * (grown * (gained - gained_free) + extensibility * (work - work_free))


def _gain_and_work(par: Row, pressure: float, contraction: float) -> tuple[float, float]:
    """Integral of dF/dp from nominal length [m^2], and (1 - q) F plus the integral of F [N].

    F is the active force and the tube's, the second integral up to a constant.
    """
    scale, gain = par[_FORCE_SCALE], _whole_gain(par, pressure, contraction)
    work = _whole_work(par, pressure, contraction, gain)
    if par[_END_LOSS] > 0.0:
        gain = _left_by_ends(par, pressure, contraction, False)
        work = _left_by_ends(par, pressure, contraction, True)
    tube = tube_force(
        contraction, par[_PASSIVE_STIFFNESS], par[_PASSIVE_SOFTENING], par[_PASSIVE_SLACK]
    )
    stored = tube_energy(
        contraction, tube, par[_PASSIVE_STIFFNESS], par[_PASSIVE_SOFTENING], par[_PASSIVE_SLACK]
    )
    pull = _active_pull(par, pressure, contraction) + tube
    return scale * gain, (1.0 - contraction) * pull + scale * work - stored


def _active_gain(par: Row, pressure: float, contraction: float) -> float:
    """Integral of the active force's slope by pressure from nominal length [m^2]."""
    if par[_END_LOSS] > 0.0:
        return par[_FORCE_SCALE] * _left_by_ends(par, pressure, contraction, False)
    return par[_FORCE_SCALE] * _whole_gain(par, pressure, contraction)


def _left_by_ends(par: Row, pressure: float, contraction: float, work: bool) -> float:
    """Integral from nominal length of what the ends leave of force or slope, without the scale.

    Where they leave a share s it is, by parts, s times that without ends, less the integral of s'
    times it, for which ten points by Gauss suffice. Exact where the force pulls.

    Args:
        par: parameter row.
        pressure: that reaches the braid [Pa].
        contraction: [-].
        work: of the force [N], not of its slope by pressure [m^2].
    """
    loss, onset = par[_END_LOSS], par[_END_ONSET]
    low, high = max(onset, 0.0), max(contraction, onset)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    lost, whole = 0.0, _whole_gain(par, pressure, contraction)
    if work:
        whole = _whole_work(par, pressure, contraction, whole)
    for node, weight in _GAUSS:
        for at in (middle - half * node, middle + half * node):
            inner = _whole_gain(par, pressure, at)
            if work:
                inner = _whole_work(par, pressure, at, inner)
            lost += weight * half * force_left_slope(at, loss, onset) * inner
    return force_left(contraction, loss, onset) * whole - lost


def _whole_gain(par: Row, pressure: float, contraction: float) -> float:
    """Integral of the slope without ends and scale from nominal length [m^2]."""
    law, first, braid = par[_FORCE_LAW], _FORCE_COEFFICIENTS, _NOMINAL_LENGTH
    return chosen_volume(law, par, first, braid, pressure, contraction)


def _whole_work(par: Row, pressure: float, contraction: float, gain: float) -> float:
    """Integral of the force without ends and scale from nominal length [N]; its gain is known."""
    law, first, braid = par[_FORCE_LAW], _FORCE_COEFFICIENTS, _NOMINAL_LENGTH
    return chosen_work(law, par, first, braid, pressure, contraction, gain)


def hysteresis_volume(par: Row, act: Row, contraction: float) -> float:
    """Volume that the energy in the hysteresis takes [m^3]: minus its derivative by pressure.

    Without it a loop that is wider at a higher pressure could be loaded at a low one and unloaded
    at a high one, and give energy in every cycle. See `pamsim.hysteresis.group`.

    Args:
        par: parameter row.
        act: states.
        contraction: kappa [-].
    """
    per_pressure = par[_HYSTERESIS + 1]
    if par[_HYSTERESIS_LAW] == 0.0 or per_pressure == 0.0:
        return 0.0
    held = chosen_energy(par[_HYSTERESIS_LAW], par, _HYSTERESIS_OWN, act, contraction)
    return -per_pressure * par[_NOMINAL_LENGTH] * held


def chamber_volume(par: Row, act: Row, tendon_length: float, pressure: float) -> float:
    """Volume of the air [m^3], hysteresis included.

    Args:
        par: parameter row.
        act: states.
        tendon_length: at the muscle [m].
        pressure: gauge pressure [Pa], see `static_volume`.
    """
    kappa = contraction(par, tendon_length)
    return static_volume(par, tendon_length, pressure) + hysteresis_volume(par, act, kappa)


def chamber_pressure(par: Row, act: Row, tendon_length: float) -> float:
    """Absolute pressure in the chamber [Pa].

    A chamber without air is one whose state was never set (a bare ``mj_resetData`` zeroes it), one
    without volume is stretched beyond its fibres: both give NaN, so that the run stops there and
    not at a plausible wrong number.
    """
    length = length_at_muscle(par, act, tendon_length)
    kappa = contraction(par, length)
    fixed = _volume_at_nominal_length(par) + hysteresis_volume(par, act, kappa)
    air = act[len(act) - AIR]
    inside = fixed + _volume_gained(par, kappa, _TYPICAL_PRESSURE)
    if not (air > 0.0 and inside > 0.0):
        return math.nan
    pressure = absolute_pressure(air, inside, par[_POLYTROPIC], par[_FLOOR])
    if par[_EXTENSIBILITY] > 0.0 or volume_depends_on_pressure(par[_FORCE_LAW]):
        return _consistent_pressure(par, air, fixed, kappa, pressure)
    return pressure


def _consistent_pressure(par: Row, air: float, fixed: float, kappa: float, reply: float) -> float:
    """Absolute pressure at which air and a volume that depends on it agree [Pa].

    By secants, kept between pressures that are too low and too high: a volume that grows or hardly
    shrinks with pressure leaves one solution.

    Args:
        par: parameter row.
        air: air state y.
        fixed: volume that does not depend on the pressure [m^3].
        kappa: contraction [-].
        reply: pressure in the volume that belongs to the typical pressure [Pa].
    """
    low, high = par[_FLOOR], math.inf
    before = _TYPICAL_PRESSURE + par[_ATMOSPHERE]
    miss_before, pressure = reply - before, reply
    for _ in range(100):
        inside = fixed + _volume_gained(par, kappa, pressure - par[_ATMOSPHERE])
        if not inside > 0.0:
            return math.nan
        wanted = absolute_pressure(air, inside, par[_POLYTROPIC], par[_FLOOR])
        miss = wanted - pressure
        if miss > 0.0:
            low = pressure
        else:
            high = pressure
        following = wanted
        if miss != miss_before:
            secant = pressure - miss * (pressure - before) / (miss - miss_before)
            if low < secant < high:
                following = secant
        if abs(following - pressure) <= _CLOSE * pressure:
            return following
        before, miss_before, pressure = pressure, miss, following
    return pressure


def gauge_pressure(par: Row, act: Row, tendon_length: float) -> float:
    """Gauge pressure in the chamber [Pa]."""
    return chamber_pressure(par, act, tendon_length) - par[_ATMOSPHERE]


def active_force(par: Row, pressure: float, contraction: float) -> float:
    """Signed force of the muscle's active law, its scale included [N].

    Args:
        par: parameter row.
        pressure: gauge pressure that reaches the braid [Pa].
        contraction: kappa [-].
    """
    return par[_FORCE_SCALE] * chosen_force(
        par[_FORCE_LAW], par, _FORCE_COEFFICIENTS, _NOMINAL_LENGTH, pressure, contraction
    )


def hysteresis_force(
    par: Row, act: Row, contraction: float, pressure: float, static_force: float
) -> float:
    """Force that hysteresis takes from the static force [N]; 0 without an operator.

    Args:
        par: parameter row.
        act: states.
        contraction: kappa [-].
        pressure: gauge pressure, not below 0 [Pa].
        static_force: signed force without hysteresis [N].
    """
    if par[_HYSTERESIS_LAW] == 0.0:
        return 0.0
    width = par[_HYSTERESIS] + par[_HYSTERESIS + 1] * pressure + par[_HYSTERESIS + 2] * static_force
    return width * chosen_output(par[_HYSTERESIS_LAW], par, _HYSTERESIS_OWN, act, contraction)


def static_force(par: Row, tendon_length: float, pressure: float) -> float:
    """Signed muscle force without hysteresis [N] at a gauge pressure [Pa]."""
    kappa = pressurised_contraction(
        muscle_length(par, tendon_length), par[_NOMINAL_LENGTH], par[_EXTENSIBILITY], pressure
    )
    locked = locking_force(
        contraction(par, tendon_length),
        par[_PASSIVE_STIFFNESS],
        par[_PASSIVE_SLACK],
        par[_PASSIVE_LOCKING],
    )
    tube = tube_force(kappa, par[_PASSIVE_STIFFNESS], par[_PASSIVE_SOFTENING], par[_PASSIVE_SLACK])
    effective = effective_pressure(pressure, par[_THRESHOLD])
    return _active_pull(par, effective, kappa) + tube + locked


def _active_pull(par: Row, pressure: float, contraction: float) -> float:
    """Signed active force [N] that the ends leave, from the pressure that reaches the braid."""
    active = active_force(par, pressure, contraction)
    if par[_END_LOSS] > 0.0 and active > 0.0:
        active *= force_left(contraction, par[_END_LOSS], par[_END_ONSET])
    return active


def tension(par: Row, act: Row, tendon_length: float, tendon_velocity: float = 0.0) -> float:
    """Tension of the muscle [N], never negative; NaN if the chamber was never charged.

    The braid's friction is that at the speed of the tendon: a chain's stretching is left out.
    """
    pressure = gauge_pressure(par, act, tendon_length)
    length = length_at_muscle(par, act, tendon_length)
    kappa = contraction(par, length)
    force = static_force(par, length, pressure)
    above = effective_pressure(pressure, 0.0)
    pull = force - hysteresis_force(par, act, kappa, above, force)
    if par[_CREEP_STIFFNESS] > 0.0:
        pull -= creep_force(kappa, act[len(act) - CREEP], par[_CREEP_STIFFNESS])
    if par[_BRAID_FRICTION] > 0.0:
        speed = chain_ratio(par, tendon_length) * tendon_velocity
        rate = -speed / par[_NOMINAL_LENGTH]
        pull -= braid_friction(above, rate, par[_BRAID_FRICTION])
    return taut(pull)


def tendon_force(
    par: Row, act: Row, tendon_length: float, tendon_velocity: float, timestep: float
) -> float:
    """Force against the tendon's lengthening [N]: the muscle's tension and friction.

    Dry friction is that at the end of the time step, which the tendon's present velocity sets: with
    the one at its beginning the bristles would gain energy.
    """
    pull = tension(par, act, tendon_length, tendon_velocity)
    force = pull
    if par[_RIPPLE] > 0.0:
        force = chain_ratio(par, tendon_length) * pull
    if par[_STRIBECK_FORCE] > 0.0:
        force += stribeck_friction(tendon_velocity, par[_STRIBECK_FORCE], par[_STRIBECK_VELOCITY])
    if _rubs(par):
        before = act[len(act) - RUBBING]
        after = _rubbing_after(par, before, pull, tendon_velocity, timestep)
        force += after + par[_BRISTLE_TIME] * (after - before) / timestep
    return force


def _rubs(par: Row) -> bool:
    return par[_COULOMB] + par[_BREAKAWAY] + par[_TENSION_SHARE] > 0.0


def _rubbing_after(
    par: Row, before: float, pull: float, tendon_velocity: float, timestep: float
) -> float:
    """Dry friction along the tendon after a time step [N]."""
    return dry_friction(
        before,
        tendon_velocity,
        pull,
        par[_COULOMB],
        par[_BREAKAWAY],
        par[_TENSION_SHARE],
        par[_STRIBECK_VELOCITY],
        par[_PRESLIDING],
        timestep,
    )


def wanted_opening(par: Row, command: float, pressure: float, time: float) -> float:
    """Signed opening in [-1, 1] to which a command moves the valve pair, dead zone included.

    Args:
        par: parameter row.
        command: signed opening, signed duty or gauge pressure [Pa], as the row specifies.
        pressure: gauge pressure at the valves [Pa].
        time: [s].
    """
    if par[_COMMAND] == 0.0:
        return clamped_opening(command)
    if par[_COMMAND] == 1.0:
        return pulsed_opening(command, time, par[_PULSE_PERIOD])
    return regulated_opening(command, pressure, par[_BAND], par[_DEAD_BAND])


def valve_opening(par: Row, command: float, pressure: float, time: float) -> float:
    """Signed opening of the valve pair that a command means, dead zone passed, in [-1, 1].

    Args:
        par: parameter row.
        command: signed opening, signed duty or gauge pressure [Pa], as the row specifies.
        pressure: gauge pressure at the valves [Pa].
        time: [s].
    """
    return _open(par, wanted_opening(par, command, pressure, time))


def _open(par: Row, opening: float) -> float:
    """What the dead zone leaves of an opening."""
    if par[_DEAD_ZONE] == 0.0:
        return opening
    return past_dead_zone(opening, par[_DEAD_ZONE])


def reached_opening(
    par: Row, act: Row, command: float, pressure: float, time: float, timestep: float
) -> float:
    """Opening [-] reached in a time step, dead zone included; see `wanted_opening`."""
    wanted = wanted_opening(par, command, pressure, time)
    if par[_TRAVEL_TIME] == 0.0:
        return wanted
    return slewed_opening(wanted, act[len(act) - OPENING], par[_TRAVEL_TIME], timestep)


def command_at_valve(par: Row, act: Row, command: float) -> float:
    """The command behind the lag of its line; any unit."""
    if par[_LINE_LAG] > 0.0:
        return act[len(act) - LINE]
    return command


def pressure_at_valve(par: Row, act: Row, tendon_length: float) -> float:
    """Absolute pressure at the valves [Pa]: the chamber's, or that at the near end of a tube."""
    if par[_TUBE_RESISTANCE] > 0.0:
        return act[len(act) - TUBE]
    return chamber_pressure(par, act, tendon_length)


def sensed_pressure(par: Row, act: Row, tendon_length: float) -> float:
    """Gauge pressure that a sensor at the valves sees [Pa]."""
    return pressure_at_valve(par, act, tendon_length) - par[_ATMOSPHERE]


def fill_valve(par: Row, pressure_abs: float, opening: float, valve: MutableRow) -> None:
    """Write what a muscle's fill valve means to its supply.

    Args:
        par: parameter row.
        pressure_abs: absolute pressure behind it [Pa].
        opening: signed, of the pair, dead zone passed.
        valve: (VALVE,) written, see `pamsim.pneumatics.supply.supply_sag`.
    """
    valve[0] = par[_SUPPLY] + par[_ATMOSPHERE]
    valve[1] = pressure_abs
    valve[2] = 0.0 if opening <= 0.0 else opening * par[_FILL]
    valve[3] = par[_CRITICAL]
    valve[4] = par[_LAMINAR]
    valve[5] = par[_TEMPERATURE]


def fill_valve_of(
    par: Row,
    act: Row,
    tendon_length: float,
    command: float,
    time: float,
    timestep: float,
    valve: MutableRow,
) -> None:
    """Write what the fill valve of a muscle in a given state means to its supply.

    Args:
        par: parameter row.
        act: states.
        tendon_length: [m].
        command: as sent, before the lag of its line.
        time: [s].
        timestep: [s].
        valve: (VALVE,) written.
    """
    pressure_abs = pressure_at_valve(par, act, tendon_length)
    gauge = pressure_abs - par[_ATMOSPHERE]
    sent = command_at_valve(par, act, command)
    opening = reached_opening(par, act, sent, gauge, time, timestep)
    fill_valve(par, pressure_abs, _open(par, opening), valve)


def line_sag(par: Row, act: Row, valves: Valves, timestep: float) -> float:
    """Fall of a muscle's supply during a time step [Pa].

    Args:
        par: parameter row of the muscle.
        act: its states.
        valves: (m, VALVE) fill valves of all muscles on its supply, see `fill_valve`.
        timestep: [s].
    """
    full = par[_SUPPLY] + par[_ATMOSPHERE]
    storage = par[_SUPPLY_VOLUME] / (GAS_CONSTANT * par[_TEMPERATURE] * timestep)
    return supply_sag(valves, par[_RESISTANCE], storage, full * act[len(act) - SAG])


def air_flow(par: Row, pressure_abs: float, command: float, time: float, sag: float = 0.0) -> float:
    """Mass flow into a chamber right behind quick valves [kg/s], minus the leak.

    Args:
        par: parameter row.
        pressure_abs: absolute pressure in the chamber [Pa].
        command: see `valve_opening`.
        time: [s].
        sag: fall of the supply's pressure [Pa].
    """
    opening = valve_opening(par, command, pressure_abs - par[_ATMOSPHERE], time)
    return flow_through_valves(par, pressure_abs, opening, sag) - leak_flow(par, pressure_abs)


def flow_through_valves(par: Row, pressure_abs: float, opening: float, sag: float) -> float:
    """Mass flow through the valves [kg/s].

    Args:
        par: parameter row.
        pressure_abs: absolute pressure behind them [Pa].
        opening: signed, dead zone passed, in [-1, 1].
        sag: fall of the supply's pressure [Pa].
    """
    return valve_flow(
        opening,
        pressure_abs,
        par[_SUPPLY] + par[_ATMOSPHERE] - sag,
        par[_ATMOSPHERE],
        par[_FILL],
        par[_EXHAUST],
        par[_CRITICAL],
        par[_LAMINAR],
        par[_TEMPERATURE],
    )


def leak_flow(par: Row, pressure_abs: float) -> float:
    """Mass flow out of the chamber through its leak [kg/s]."""
    if par[_LEAK] == 0.0:
        return 0.0
    return mass_flow(
        pressure_abs,
        par[_ATMOSPHERE],
        par[_LEAK],
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
    opposing: float = 0.0,
    sag: float = 0.0,
) -> None:
    """Write the rates of all states of one muscle.

    Args:
        par: (SIZE,) parameter row.
        act: (n,) states in the order of `pamsim.actuator.layout`.
        rates: (n,) written: their rates [1/s].
        tendon_length: [m].
        tendon_velocity: [m/s].
        command: see `valve_opening`.
        time: [s].
        timestep: [s]; an operator that steps from turning point to turning point writes the rate
            that takes it to its next memory in one Euler step of this length.
        opposing: tension of the muscle at the other end of the chain [N]; used with backlash only.
        sag: fall of the supply's pressure during the step [Pa], see `line_sag`; used with
            resistance of the supply only.
    """
    count = len(act)
    pressure_abs = chamber_pressure(par, act, tendon_length)
    length = length_at_muscle(par, act, tendon_length)
    velocity = tendon_velocity
    if par[_RIPPLE] > 0.0:
        velocity = chain_ratio(par, tendon_length) * tendon_velocity
    rates[count - SHIFT] = 0.0
    if par[_BACKLASH] > 0.0:
        backlash_rate = shift_rate(
            act[count - SHIFT],
            tension(par, act, tendon_length, tendon_velocity),
            opposing,
            par[_BACKLASH],
            par[_SEATING],
            timestep,
        )
        rates[count - SHIFT] = backlash_rate
        velocity = velocity + backlash_rate
    rates[count - EXTENSION] = 0.0
    if par[_COMPLIANCE] > 0.0:
        pull = tension(par, act, tendon_length, tendon_velocity)
        stretch_rate = extension_rate(
            act[count - EXTENSION], pull, par[_COMPLIANCE], par[_RELAXATION]
        )
        rates[count - EXTENSION] = stretch_rate
        velocity = velocity - stretch_rate
    rates[count - RUBBING] = 0.0
    if _rubs(par):
        before = act[count - RUBBING]
        pull = tension(par, act, tendon_length, tendon_velocity)
        after = _rubbing_after(par, before, pull, tendon_velocity, timestep)
        rates[count - RUBBING] = (after - before) / timestep
    kappa = contraction(par, length)
    chosen_rates(
        par[_HYSTERESIS_LAW],
        par,
        _HYSTERESIS_OWN,
        act,
        rates,
        kappa,
        -velocity / par[_NOMINAL_LENGTH],
        timestep,
    )
    rates[count - CREEP] = 0.0
    if par[_CREEP_STIFFNESS] > 0.0:
        rates[count - CREEP] = creep_rate(kappa, act[count - CREEP], par[_CREEP_TIME], timestep)
    rates[count - LINE] = 0.0
    at_valve = command_at_valve(par, act, command)
    if par[_LINE_LAG] > 0.0:
        sent = command if par[_COMMAND] == 2.0 else clamped_opening(command)
        rates[count - LINE] = line_rate(sent, at_valve, par[_LINE_LAG], timestep)
    rates[count - SAG] = 0.0
    if par[_RESISTANCE] > 0.0:
        share = sag / (par[_SUPPLY] + par[_ATMOSPHERE])
        rates[count - SAG] = (share - act[count - SAG]) / timestep
    at_valve_abs = pressure_abs
    if par[_TUBE_RESISTANCE] > 0.0:
        at_valve_abs = act[count - TUBE]
    opening = reached_opening(par, act, at_valve, at_valve_abs - par[_ATMOSPHERE], time, timestep)
    rates[count - OPENING] = 0.0
    if par[_TRAVEL_TIME] > 0.0:
        rates[count - OPENING] = (opening - act[count - OPENING]) / timestep
    flow = flow_through_valves(par, at_valve_abs, _open(par, opening), sag)
    rates[count - TUBE] = 0.0
    if par[_TUBE_RESISTANCE] > 0.0:
        room, warmth = par[_TUBE_VOLUME], par[_TEMPERATURE]
        after = near_end_pressure(
            at_valve_abs, pressure_abs, flow, par[_TUBE_RESISTANCE], room, warmth, timestep
        )
        rates[count - TUBE] = (after - at_valve_abs) / timestep
        flow = line_outflow(flow, after - at_valve_abs, room, warmth, timestep)
    flow -= leak_flow(par, pressure_abs)
    rates[count - AIR] = air_state_rate(pressure_abs, par[_POLYTROPIC], par[_TEMPERATURE], flow)
    rates[count - AMBIENT] = 0.0
    if par[_HEAT_RATE] > 0.0:
        air = act[count - AIR]
        inside = chamber_volume(par, act, length, pressure_abs - par[_ATMOSPHERE])
        ambient = act[count - AMBIENT] / inside
        rates[count - AMBIENT] = GAS_CONSTANT * par[_TEMPERATURE] * flow
        rates[count - AIR] += relaxing_rate(
            air, pressure_abs, ambient, par[_POLYTROPIC], par[_HEAT_RATE], timestep
        )
