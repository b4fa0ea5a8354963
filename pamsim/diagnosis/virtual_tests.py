"""Tests of a rig's parts that give the size of an effect in terms that no formula defines.

Each compares a rig with an effect and the same rig without it, as a bench test of the part would: a
joint turned by hand, a muscle stretched at a held pressure, a valve opened slowly. The parts are
those that a simulation is made of, so that a size means the same whichever form the effect has.
The tests' independent plant is tested under the same names and conditions.
"""

from __future__ import annotations

import copy
import operator
from collections.abc import Callable, Mapping
from typing import TypeAlias

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.diagnosis.bench import (
    CONDITIONS,
    CONTRACTION_RATE,
    FAST,
    PRESSURE,
    SLOW,
    STRAIN,
    TURN,
    Bench,
)
from pamsim.physics.air import GAS_CONSTANT, mass_flow
from pamsim.physics.chain import chain_length, chain_ratio, steady_extension
from pamsim.physics.friction import bond_rate, dry_friction, tendon_friction
from pamsim.physics.kernel import state_rates, tension
from pamsim.physics.muscle_hysteresis import hysteresis_force, hysteresis_rates
from pamsim.physics.muscle_valves import flow_through_valves, leak_flow, valve_opening
from pamsim.physics.record import Parameters, States, split_states
from pamsim.physics.rest_state import charged_air_state, rest
from pamsim.physics.static_muscle import active_force, limited, static_force
from pamsim.physics.supply import sags, supply_sag
from pamsim.physics.tension import effective_pressure

Quantities: TypeAlias = dict[str, tuple[float, str]]
"""Name -> value [unit] and SI unit."""

_FLOW = 2e-4
"""Flow at which a supply's sag and a tube's loss are stated [kg/s]: it fills a MAS-20 muscle of
0.1 litres to 2 bar in about a second."""

_TENSION = 700.0
"""At which a chain's compliance is stated [N]: a middle tension of a MAS-20 muscle."""

_READ_PRESSURE = 3e5
"""At which the scale of a pressure sensor is stated [Pa]: a middle one of those that rigs use."""

_JOINT_STEPS, _MUSCLE_STEPS = 400, 300  # of a quarter of a cycle
_SUDDEN = 1e-3  # contraction [-]
_CREEP_TIMES = np.concatenate([[0.0], np.geomspace(1e-3, 1e3, 300)])  # [s]
_LONG = 1e9  # a time step after which a supply is steady [s]


VirtualTest: TypeAlias = Callable[[Bench, Bench, int], Quantities]
"""Rig with an effect, the same without, and index of the muscle, to the size of the effect."""


def cycle(amplitude: float, steps: int) -> FloatArray:
    """A path from 0 to the amplitude and through one closed cycle; 5 ``steps`` and a point."""
    corners = amplitude * np.array([0.0, 1.0, 0.0, -1.0, 0.0, 1.0])
    return np.interp(np.arange(5 * steps + 1) / steps, np.arange(6), corners)


def _chosen(quantities: Quantities, *conditions: str) -> Quantities:
    return {**quantities, **{name: CONDITIONS[name] for name in conditions}}


def _difference(
    quantity: str, unit: str, read: Callable[[Bench, int], float], *conditions: str
) -> VirtualTest:
    """The test of an effect whose size is a difference of what both rigs read at a muscle."""

    def test(there: Bench, without: Bench, muscle: int) -> Quantities:
        found: Quantities = {quantity: (read(there, muscle) - read(without, muscle), unit)}
        return _chosen(found, *conditions)

    return test


def _stated(parameter: str, quantity: str, unit: str) -> VirtualTest:
    """The test of an effect whose parameter is a physical quantity already."""
    read = operator.attrgetter(parameter)
    return _difference(quantity, unit, lambda rig, muscle: read(rig.muscles[muscle]))


def _sensed(field: str, quantity: str, unit: str = "") -> VirtualTest:
    """The test of a sensor's error, in the unit of the joint's position if none is given."""

    def test(there: Bench, without: Bench, _: int) -> Quantities:
        change = getattr(there.sensor, field) - getattr(without.sensor, field)
        return {quantity: (float(change), unit or there.motion.unit)}

    return test


def _angle_scale(there: Bench, without: Bench, _: int) -> Quantities:
    """Relative error of a joint's position, at one that is far from 0."""
    place = there.motion.at_place
    error = _read_at(there, "angle", CONDITIONS[place][0], without)
    return _chosen({"relative_error": (error, "1")}, place)


def _pressure_scale(there: Bench, without: Bench, _: int) -> Quantities:
    error = _read_at(there, "pressure", _READ_PRESSURE, without)
    return {"relative_error_at_3_bar": (error, "1")}


def _read_at(there: Bench, what: str, true: float, without: Bench) -> float:
    """Relative difference of what is read of a true value [SI], bend of the scale included."""
    scale, bend = f"{what}_scale", f"{what}_bend"
    read, base = (
        getattr(rig.sensor, scale) + getattr(rig.sensor, bend) * true for rig in (there, without)
    )
    return read / base - 1.0


def _weight(there: Bench, without: Bench, _: int) -> Quantities:
    motion = there.motion
    return {f"{motion.effort}_at_zero": (there.weight - without.weight, motion.effort_unit)}


def _inertia(there: Bench, without: Bench, _: int) -> Quantities:
    return {"inertia": (there.inertia - without.inertia, there.motion.inertia_unit)}


def _drag(there: Bench, without: Bench, _: int) -> Quantities:
    """Torque of what damps the joint."""
    motion = there.motion
    speed = motion.scale * FAST
    torque = (there.damping - without.damping) * speed
    torque += (there.quadratic_damping - without.quadratic_damping) * speed**2
    return _chosen({f"{motion.effort}_at_speed": (torque, motion.effort_unit)}, motion.at_speed)


def _joint_path(rig: Bench) -> FloatArray:
    return cycle(rig.motion.scale * TURN, _JOINT_STEPS)


def _friction(rig: Bench, speed: float) -> FloatArray:
    """Torque that dry friction and Stribeck friction take along a cycle at one speed [N m].

    It begins after a long rest.
    """
    moved = np.diff(_joint_path(rig))
    sliding = min(speed / rig.dry_speed, 1.0) if rig.dry_speed > 0.0 else 1.0
    taken = sliding * rig.dry * np.sign(moved)
    timestep = float(np.abs(moved[0])) / speed
    for m, length, arm in zip(rig.muscles, rig.lengths, rig.arms, strict=True):
        pull = abs(limited(m, static_force(m, length, PRESSURE)))
        rubbed, bonds = 0.0, 1.0
        for k, sense in enumerate(np.sign(moved).tolist()):
            velocity = arm * speed * sense
            taken[k] += arm * tendon_friction(m.friction, rubbed, pull, velocity, timestep, bonds)
            rubbed = dry_friction(m.friction, rubbed, pull, velocity, timestep, bonds)
            bonds += timestep * bond_rate(m.friction, bonds, velocity, timestep)
    return taken


def _joint_friction(there: Bench, without: Bench, _: int) -> Quantities:
    """Breakaway torque after a long rest, that in sliding, energy of a slow cycle, at position 0.

    Breakaway and energy are those at the slow speed: friction that does not stick, and needs more
    speed than that for its peak, has little of either.
    """
    motion = there.motion
    speeds = motion.scale * SLOW, motion.scale * FAST
    slow, fast = (_friction(there, v) - _friction(without, v) for v in speeds)
    moved = np.diff(_joint_path(there))
    breakaway = float(slow[np.argmax(np.abs(slow[:_JOINT_STEPS]))])
    return _chosen(
        {
            # Of the larger sign, for a rig that has too much friction.
            f"breakaway_{motion.effort}": (breakaway, motion.effort_unit),
            f"sliding_{motion.effort}": (float(fast[_JOINT_STEPS - 1]), motion.effort_unit),
            "energy_per_cycle": (float(slow[_JOINT_STEPS:] @ moved[_JOINT_STEPS:]), "J"),
        },
        motion.at_speed,
        motion.amplitude,
    )


def _tendon(m: Parameters, kappa: float) -> float:
    """Length of the tendon at which a muscle without chain has a contraction [m]."""
    return (1.0 - kappa) * m.braid.nominal_length - m.mounting.length_at_zero


def _loop(rig: Bench, muscle: int, path: FloatArray) -> FloatArray:
    """Force that hysteresis takes along a path of contractions at a held pressure [N]."""
    m = rig.muscles[muscle]
    z = split_states([0.0] * rig.states[muscle])[1]
    dz = [0.0] * len(z)
    forces: list[float] = []
    timestep = float(path[1] - path[0]) / CONTRACTION_RATE
    before = 0.0
    for kappa in path.tolist():
        rate = (kappa - before) / timestep
        hysteresis_rates(m, z, dz, before, rate, timestep)
        for k, change in enumerate(dz):
            z[k] += timestep * change
        force = static_force(m, _tendon(m, kappa), PRESSURE)
        forces.append(hysteresis_force(m, z, kappa, PRESSURE, force))
        before = kappa
    return np.array(forces)


def _muscle_loop(there: Bench, without: Bench, muscle: int) -> Quantities:
    """Half-width and energy of a muscle's loop at a held pressure."""
    path = cycle(STRAIN, _MUSCLE_STEPS)
    taken = _loop(there, muscle, path) - _loop(without, muscle, path)
    quarter = _MUSCLE_STEPS
    energy = float(np.trapezoid(taken[quarter:], path[quarter:]))
    apart = taken[3 * quarter :] - taken[quarter : 3 * quarter + 1][::-1]
    return _chosen(
        {
            # Of the larger sign, for a rig that has too much hysteresis.
            "loop_half_width": (0.5 * float(apart[np.argmax(np.abs(apart))]), "N"),
            "energy_per_cycle": (energy * there.muscles[muscle].braid.nominal_length, "J"),
        },
        "at_pressure",
        "contraction_amplitude",
    )


def _held(rig: Bench, muscle: int) -> tuple[Parameters, States, list[float]]:
    """A muscle at rest, held by its ends at the test's pressure, its air at ambient temperature."""
    m = copy.deepcopy(rig.muscles[muscle])
    m.chain.compliance = m.chain.backlash = m.chain.ripple = m.chamber.heat_rate = 0.0
    m.chain.learned_high = m.chain.learned_low
    return m, *split_states(rest(m, rig.states[muscle], _tendon(m, 0.0), PRESSURE))


def _relaxing(rig: Bench, muscle: int) -> FloatArray:
    """Tension after a sudden contraction that is held, at a held pressure, over `_CREEP_TIMES`."""
    m, s, z = _held(rig, muscle)
    ds, dz = split_states([0.0] * rig.states[muscle])
    length = _tendon(m, _SUDDEN)
    tensions: list[float] = []
    for timestep in np.diff(_CREEP_TIMES, prepend=0.0).tolist():
        if timestep > 0.0:
            state_rates(m, s, z, ds, dz, length, 0.0, 0.0, 0.0, timestep)
            for name, change in vars(ds).items():
                setattr(s, name, getattr(s, name) + timestep * change)
            z = [held + timestep * change for held, change in zip(z, dz, strict=True)]
        s.air = charged_air_state(m, z, length, PRESSURE)
        tensions.append(tension(m, s, z, length))
    return np.array(tensions)


def _creep(there: Bench, without: Bench, muscle: int) -> Quantities:
    """Force per sudden contraction, the share that relaxes within 4 s, and the time to half."""
    left = (_relaxing(without, muscle) - _relaxing(there, muscle)) / _SUDDEN
    whole = float(left[0])
    found: Quantities = {"force_per_sudden_contraction": (whole, "N")}
    if whole == 0.0:
        return found
    share = left / whole
    found["relaxed_within_4_s"] = (1.0 - float(np.interp(4.0, _CREEP_TIMES, share)), "1")
    if share[-1] < 0.5:
        after = int(np.argmax(share < 0.5))
        near = slice(after, after - 2, -1)  # np.interp wants the shares rising
        half = float(np.interp(0.5, share[near], _CREEP_TIMES[near]))
        found["half_relaxed_after"] = (half, "s")
    return found


def _pull_change(there: Bench, without: Bench, muscle: int) -> Quantities:
    """Change of a muscle's static pull at nominal length, and 2 % contracted and stretched."""
    one, other = there.muscles[muscle], without.muscles[muscle]
    found: Quantities = {}
    for name, kappa in (("contracted", 0.02), ("nominal", 0.0), ("stretched", -0.02)):
        at = _tendon(other, kappa)
        change = static_force(one, at, PRESSURE) - static_force(other, at, PRESSURE)
        found[f"force_change_{name}"] = (change, "N")
    gain, base = (active_force(p, PRESSURE, 0.0) - active_force(p, 0.0, 0.0) for p in (one, other))
    return _chosen({**found, "force_per_pressure_ratio": (gain / base, "1")}, "at_pressure")


def _rest_length(there: Bench, without: Bench, muscle: int) -> Quantities:
    longer = _stated("mounting.length_at_zero", "length_change", "m")
    return {**longer(there, without, muscle), **_pull_change(there, without, muscle)}


def _pull_lost(rig: Bench, muscle: int) -> float:
    """Pull of a muscle that contracts at a held pressure, as a loss [N]."""
    m, s, z = _held(rig, muscle)
    velocity = -CONTRACTION_RATE * m.braid.nominal_length
    return -tension(m, s, z, _tendon(m, 0.0), velocity)


def _pressure_lost(rig: Bench, muscle: int) -> float:
    """Pressure that presses on a muscle's braid, as a loss [Pa]."""
    threshold = rig.muscles[muscle].threshold
    return -effective_pressure(PRESSURE, threshold.pressure, threshold.width)


def _leak(rig: Bench, muscle: int) -> float:
    """Mass flow that a muscle loses at the test's pressure [kg/s]."""
    m = rig.muscles[muscle]
    return leak_flow(m, PRESSURE + m.chamber.atmosphere)


def _sag(rig: Bench, muscle: int) -> float:
    """Steady fall of the supply's pressure per flow, at a flow into an empty muscle [Pa s/kg]."""
    m = rig.muscles[muscle]
    if not sags(m):
        return 0.0
    s = split_states([0.0] * rig.states[muscle])[0]
    full, empty = m.valve.supply_pressure + m.chamber.atmosphere, m.chamber.atmosphere
    air = (m.valve.critical_ratio, m.valve.laminar_ratio, m.chamber.temperature)
    conductance, sag, flow = 1e-10, 0.0, 1.0
    for _ in range(20):  # opens the valve until it passes that flow, or all it can
        sag = supply_sag(m, s, [(full, empty, conductance, *air)], _LONG)
        flow = mass_flow(full - sag, empty, conductance, *air)
        conductance = min(conductance * _FLOW / flow, 1e-6)
    return sag / flow


def _shut_up_to(m: Parameters, sense: float) -> float:
    """Opening up to which a valve stays shut [-]."""
    shut, opens = 0.0, 1.0
    while opens - shut > 1e-12:
        middle = 0.5 * (shut + opens)
        stays = valve_opening(m, sense * middle, PRESSURE, 0.0) == 0.0
        shut, opens = (middle, opens) if stays else (shut, middle)
    return shut if shut > 1e-11 else 0.0


def _dead_zones(there: Bench, without: Bench, muscle: int) -> Quantities:
    one, other = there.muscles[muscle], without.muscles[muscle]
    return {
        f"opening_lost_{name}": (_shut_up_to(one, sense) - _shut_up_to(other, sense), "1")
        for name, sense in (("filling", 1.0), ("venting", -1.0))
    }


def _choked_flow(there: Bench, without: Bench, muscle: int) -> Quantities:
    """Relative change of the flow through open valves, from the supply and to the atmosphere."""

    def flow(rig: Bench, sense: float) -> float:
        m = rig.muscles[muscle]
        inside = m.chamber.atmosphere + (0.0 if sense > 0.0 else m.valve.supply_pressure)
        return flow_through_valves(m, inside, sense, 0.0)

    filling, venting = (flow(there, s) / flow(without, s) - 1.0 for s in (1.0, -1.0))
    return {
        "relative_change_of_choked_flow": (0.5 * (filling + venting), "1"),
        "relative_change_filling": (filling, "1"),
        "relative_change_venting": (venting, "1"),
    }


def _heat(there: Bench, without: Bench, muscle: int) -> Quantities:
    """Rise of pressure per sudden compression, both relative, and the time in which it dies."""
    one, other = there.muscles[muscle].chamber, without.muscles[muscle].chamber
    found: Quantities = {
        "pressure_rise_per_compression": (one.polytropic_index - other.polytropic_index, "1")
    }
    if one.heat_rate > 0.0:
        found["temperature_time_constant"] = (1.0 / one.heat_rate, "s")
    return found


def _compliance(rig: Bench, muscle: int) -> float:
    """Extension of the chain per tension, at the test's tension [m/N]."""
    return steady_extension(rig.muscles[muscle].chain, _TENSION) / _TENSION


def _ripple(there: Bench, without: Bench, muscle: int) -> Quantities:
    """Half the peak-to-peak torque and travel over a tooth, all muscles at one pressure."""
    teeth, own_arm = there.muscles[muscle], there.arms[muscle]
    reach = 0.5 * teeth.chain.ripple_pitch / abs(own_arm)
    torque, travel = np.zeros(181), np.zeros(181)
    for k, angle in enumerate(np.linspace(-reach, reach, 181).tolist()):
        for rig, sign in ((there, 1.0), (without, -1.0)):
            for m, length, arm in zip(rig.muscles, rig.lengths, rig.arms, strict=True):
                at = length + arm * angle
                pull = limited(m, static_force(m, chain_length(m.chain, at), PRESSURE))
                torque[k] -= sign * arm * chain_ratio(m.chain, at) * pull
        at = there.lengths[muscle] + own_arm * angle
        travel[k] = chain_length(teeth.chain, at) - chain_length(without.muscles[muscle].chain, at)
    motion = there.motion
    return _chosen(
        {
            f"{motion.effort}_amplitude": (0.5 * float(np.ptp(torque)), motion.effort_unit),
            "travel_amplitude": (0.5 * float(np.ptp(travel)), "m"),
        },
        "at_pressure",
    )


def _tube(rig: Bench, muscle: int) -> float:
    """Pressure that the line to a muscle takes per mass flow, a turbulent one at a density."""
    m = rig.muscles[muscle]
    density = (PRESSURE + m.chamber.atmosphere) / (GAS_CONSTANT * m.chamber.temperature)
    return m.valve.tube_resistance + m.valve.tube_friction * _FLOW / density


def _waited(rig: Bench, muscle: int) -> float:
    """What a full-scale step waits for on the command's line: the area above its response [s].

    The rate is limited for as long as the lag alone would be faster.
    """
    valve = rig.muscles[muscle].valve
    lag, slew_time = valve.line_lag, valve.line_slew_time
    return 0.5 * (slew_time + lag**2 / slew_time) if slew_time > lag else lag


def _line(there: Bench, without: Bench, muscle: int) -> Quantities:
    """Wait of a full-scale step on the command's line, and the time its limited rate takes."""
    waited = _waited(there, muscle) - _waited(without, muscle)
    found = {"sum_of_time_constants": (waited, "s")}
    one, other = there.muscles[muscle].valve, without.muscles[muscle].valve
    slew_time = one.line_slew_time - other.line_slew_time
    return found if slew_time == 0.0 else {**found, "time_for_full_scale": (slew_time, "s")}


TESTS: Mapping[str, VirtualTest] = {
    **dict.fromkeys(
        ("coulomb_friction", "stribeck_friction", "load_dependent_friction"), _joint_friction
    ),
    **dict.fromkeys(("viscous_friction", "quadratic_damping"), _drag),
    "load_torque": _weight,
    "added_inertia": _inertia,
    "muscle_hysteresis": _muscle_loop,
    "viscoelastic_creep": _creep,
    "first_stroke": _stated("first_stroke.force", "force_lost", "N"),
    "softening": _stated("softening.share", "share_of_force_lost", "1"),
    "braid_friction": _difference(
        "force_lost", "N", _pull_lost, "at_pressure", "at_contraction_rate"
    ),
    "threshold_pressure": _difference("pressure_lost", "Pa", _pressure_lost, "at_pressure"),
    **dict.fromkeys(
        (
            "passive_stiffness", "end_shape", "muscle_mismatch", "braid_locking",
            "braid_extensibility", "stretch_weakening", "force_slope",
        ),
        _pull_change,
    ),
    "rest_length": _rest_length,
    "air_leak": _difference("mass_flow", "kg/s", _leak, "at_pressure"),
    "leak_between_muscles": _stated(
        "chamber.cross_leak_conductance", "flow_per_difference", "m^3/(s*Pa)"
    ),
    "supply_sag": _difference("pressure_drop_per_flow_at_200_mg/s", "Pa*s/kg", _sag),
    "valve_dead_zone": _dead_zones,
    "valve_hysteresis": _stated("valve.hysteresis", "lost_opening", "1"),
    "regulator_dead_band": _stated("valve.regulator_dead_band", "pressure_left_alone", "Pa"),
    "least_set_point": _stated("valve.least_set_point", "least_pressure", "Pa"),
    **dict.fromkeys(("valve_flow", "valve_asymmetry", "valve_mismatch"), _choked_flow),
    "tube_resistance": _difference(
        "pressure_drop_per_flow_at_200_mg/s", "Pa*s/kg", _tube, "at_pressure"
    ),
    "thermal_relaxation": _heat,
    "valve_delay": _stated("valve.delay", "mean_dead_time", "s"),
    "valve_closing": _stated("valve.closing_delay", "extra_open_time", "s"),
    "line_lag": _line,
    "valve_slew": _stated("valve.travel_time", "time_for_full_scale", "s"),
    "chain_backlash": _stated("chain.backlash", "lost_travel", "m"),
    "chain_compliance": _difference("compliance_at_700_N", "m/N", _compliance),
    "sprocket_ripple": _ripple,
    "angle_bias": _sensed("angle_bias", "mean_offset"),
    "angle_scale": _angle_scale,
    "angle_lag": _sensed("angle_lag", "sum_of_time_constants", "s"),
    "angle_backlash": _sensed("angle_backlash", "lost_motion"),
    "dead_angle": _sensed("angle_dead_share", "share_of_the_time", "1"),
    "dead_pressure": _sensed("pressure_dead_share", "share_of_the_time", "1"),
    "clock_offset": _sensed("clock_offset", "time_offset", "s"),
    "pressure_bias": _sensed("pressure_bias", "offset_at_3_bar", "Pa"),
    "pressure_scale": _pressure_scale,
    "pressure_lag": _sensed("pressure_lag", "sum_of_time_constants", "s"),
}  # fmt: skip
"""Name of an effect -> its test."""
