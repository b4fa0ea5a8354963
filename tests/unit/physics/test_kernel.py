"""The kernel is the laws put together and nothing else; what is neutral leaves no trace."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pamsim.physics.air import GAS_CONSTANT, mass_flow
from pamsim.physics.chamber import Chamber, air_state_rate
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.force_law import coefficients_of
from pamsim.physics.friction import bond_rate, dry_friction
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.muscle import Mounting, Muscle
from pamsim.physics.passive import PassiveSpring, locking_force, tube_force
from pamsim.physics.record import COMMON, STATE_NAMES, pack
from pamsim.physics.tension import EndShape
from pamsim.physics.valves import COMMANDS
from tests.unit.physics.flat import EARLIER_PRESSURE as EARLIER
from tests.unit.physics.flat import LAST_PRESSURE as LAST
from tests.unit.physics.flat import (
    chamber_pressure,
    chamber_volume,
    gauge_pressure,
    kernel,
    length_at_muscle,
    split,
    static_muscle,
    valve_opening,
)
from tests.unit.physics.muscles import (
    BONDED,
    EXTENSION,
    FORCES,
    KINDS,
    LASTING,
    LOOPS,
    PLAIN_VALVE,
    RELAXED,
    RELAXED_2,
    RUBBED,
    SAGGED,
    SHIFT,
    charged,
    make,
)

RNG = np.random.default_rng(5)
CASES = [
    (float(tendon), float(pressure), float(z))
    for tendon, pressure, z in zip(
        RNG.uniform(0.13, 0.21, 40),  # contraction from 28 % to -4 %
        RNG.uniform(-5e4, 6e5, 40),
        RNG.uniform(-1.0, 1.0, 40),
        strict=True,
    )
]
"""Tendon length [m], gauge pressure [Pa], z [-]."""
FEW = CASES[:8]
TIME, TIMESTEP = 0.0123, 1e-3
OPPOSING = 310.0
"""Tension at the other end of the chain [N]."""
SAG = 2.3e4
"""Fall of the supply's pressure [Pa]."""
STRETCHED = PassiveSpring(stiffness=9e3, slack_contraction=0.4)
"""A spring that keeps the muscle taut even when it is evacuated."""


def contraction(muscle: Muscle, act: list[float], tendon: float) -> float:
    """Straight from the parameters, less what the chain takes."""
    shift = act[-3] if muscle.chain.backlash else 0.0
    lost = (act[-2] if muscle.chain.compliance else 0.0) - shift
    length = muscle.mounting.length_at_zero + (tendon - lost)
    return 1.0 - length / muscle.braid.nominal_length


def composed_tension(muscle: Muscle, act: list[float], tendon: float) -> float:
    """Tension from the catalogs' laws and the muscle's groups, without any row."""
    kappa, braid = contraction(muscle, act, tendon), muscle.braid
    pressure = gauge_pressure(pack(muscle).tolist(), act, tendon)
    strained = 1.0 - (1.0 - kappa) / (1.0 + braid.extensibility * pressure)
    felt = max(pressure - muscle.threshold.pressure, 0.0)
    force = FORCE_LAWS[muscle.force.law].force(felt, strained, coefficients_of(muscle.force), braid)
    beyond = max(strained - muscle.end_shape.onset, 0.0) ** 2
    if force > 0.0:
        force *= 1.0 - muscle.end_shape.loss * beyond / (beyond + 0.01)
    force += tube_force(muscle.passive, strained) + locking_force(muscle.passive, kappa)
    loop = muscle.hysteresis
    if loop is not None:
        width = loop.force + loop.force_per_pressure * max(pressure, 0.0)
        output = OPERATORS[loop.law].output(loop, act, kappa)
        force -= (width + loop.force_share * force) * (output - loop.chord * kappa)
    force -= muscle.creep.stiffness * (kappa - act[-4])
    force -= muscle.creep.stiffness_2 * (kappa - act[-10])
    return force if math.isnan(force) else max(force, 0.0)


def rates(muscle: Muscle, act: list[float], tendon: float, velocity: float, command: float):
    out = [math.inf] * len(act)
    row = pack(muscle).tolist()
    kernel.state_rates(row, act, out, tendon, velocity, command, TIME, TIMESTEP, OPPOSING, SAG)
    return out


@pytest.mark.parametrize("passive", [make().passive, STRETCHED], ids=["plain", "stretched"])
def test_tension_is_the_laws_put_together(passive):
    for kind in KINDS:
        muscle = make(*kind, passive=passive)
        row, taut = pack(muscle), 0
        for tendon, pressure, z in CASES[::2]:
            act = charged(muscle, tendon, pressure, z)
            found = kernel.tension(row.tolist(), act, tendon)
            composed = composed_tension(muscle, act, tendon)
            assert found == pytest.approx(composed, rel=1e-11, abs=1e-9, nan_ok=True), kind
            again = kernel.tension(row, np.array(act), tendon)  # arrays do as well
            assert again == pytest.approx(found, rel=1e-13, nan_ok=True), kind
            taut += found > 0.0
        assert taut > 4
        if kind[0] == "ideal_mckibben" and passive is not STRETCHED:
            assert taut < 20  # slack muscles are among the cases as well


def net_flow(muscle: Muscle, pressure: float, opening: float) -> float:
    """Mass flow into the chamber at an absolute pressure [kg/s]."""
    chamber, valve = muscle.chamber, muscle.valve
    orifice = valve.critical_ratio, valve.laminar_ratio, chamber.temperature
    leak = mass_flow(pressure, chamber.atmosphere, chamber.leak_conductance, *orifice)
    squares = pressure**2 - chamber.atmosphere**2
    heat = GAS_CONSTANT * chamber.temperature
    leak += chamber.laminar_leak_conductance * squares / (2.0 * heat)
    if opening > 0.0:
        source = valve.supply_pressure + chamber.atmosphere - SAG
        return mass_flow(source, pressure, opening * valve.conductance_fill, *orifice) - leak
    vent = opening * valve.conductance_exhaust
    return mass_flow(pressure, chamber.atmosphere, vent, *orifice) - leak


@pytest.mark.parametrize("command", COMMANDS[:3])  # those that move valves
def test_rates_are_the_laws_put_together(command):
    for loop in ("none", *LOOPS):
        muscle = make(loop=loop, command=command)
        chain, creep, row = muscle.chain, muscle.creep, pack(muscle).tolist()

        def towards(there, here, time):
            """Rate that takes an Euler step exactly along an exponential."""
            return (there - here) * (1.0 - math.exp(-TIMESTEP / time)) / TIMESTEP

        for number, (tendon, pressure, z) in enumerate(FEW):
            velocity, carried = 0.1 * math.sin(number), math.cos(number)
            sent = 1.3 * math.sin(5 * number)
            meant = min(max(sent, -1.0), 1.0)
            if command == "pressure_set":
                carried, sent = pressure + 1.5e4 * carried, 1e5 * (1.0 + sent)
                meant = sent
            act = charged(muscle, tendon, pressure, z, carried=carried)
            kappa, pull = contraction(muscle, act, tendon), composed_tension(muscle, act, tendon)
            inside = chamber_pressure(row, act, tendon)
            moving = towards(meant, carried, muscle.valve.line_lag)
            arrived = carried + TIMESTEP * moving
            gauge = inside - muscle.chamber.atmosphere
            opening = valve_opening(row, arrived, gauge, TIME, TIMESTEP)
            half = 0.5 * chain.backlash
            after = SHIFT - TIMESTEP * (pull - OPPOSING) / chain.seating_damping
            rubbed = dry_friction(muscle.friction, RUBBED, pull, velocity, TIMESTEP, BONDED)
            supply = muscle.valve.supply_pressure + muscle.chamber.atmosphere
            expected = dict.fromkeys(STATE_NAMES, 0.0) | {
                "air": air_state_rate(muscle.chamber, inside, net_flow(muscle, inside, opening)),
                "extension": (chain.compliance * pull - EXTENSION) / chain.relaxation_time,
                "shift": (min(max(after, -half), half) - SHIFT) / TIMESTEP,
                "creep": towards(kappa, RELAXED, creep.relaxation_time),
                "creep_2": towards(kappa, RELAXED_2, creep.relaxation_time_2),
                "line": moving,
                "friction": (rubbed - RUBBED) / TIMESTEP,
                "bonds": bond_rate(muscle.friction, BONDED, velocity, TIMESTEP),
                "last_pressure": inside / TIMESTEP,  # for the next search; none was made before
                "sag": (SAG / supply - SAGGED) / TIMESTEP,
            }
            states, memory = split(rates(muscle, act, tendon, velocity, sent))
            assert vars(states) == pytest.approx(expected, rel=1e-11), (loop, number)
            own = [0.0] * len(memory)
            if muscle.hysteresis is not None:
                shortening = expected["extension"] - expected["shift"] - velocity
                shortening /= muscle.braid.nominal_length
                OPERATORS[loop].rates(muscle.hysteresis, act, own, kappa, shortening, TIMESTEP)
            assert list(memory) == pytest.approx(own, rel=1e-11), (loop, number)


def test_an_impossible_chamber_and_a_nan_command_give_nan():
    for kind in KINDS:
        muscle = make(*kind)
        row, act = pack(muscle).tolist(), charged(muscle, 0.2, 1e5)
        for air in (-1.0, math.nan):
            act[-1] = air
            assert math.isnan(gauge_pressure(row, act, 0.2)), kind
            assert math.isnan(kernel.tension(row, act, 0.2)), kind
            assert math.isnan(rates(muscle, act, 0.2, 0.0, 0.5)[-1]), kind
    for command in COMMANDS:  # none shuts the valves at a NaN
        prompt, lagging = make(command=command, valve=PLAIN_VALVE), make(command=command)
        assert math.isnan(rates(prompt, charged(prompt, 0.2, 1e5), 0.2, 0.0, math.nan)[-1])
        if command != "measured":  # which no line delays
            assert math.isnan(rates(lagging, charged(lagging, 0.2, 1e5), 0.2, 0.0, math.nan)[-5])
    empty = make(
        **LASTING | {"chamber": Chamber(polytropic_index=1.2, temperature=300.0, dead_volume=0.0)},
        force=dataclasses.replace(FORCES["ideal_mckibben"], scale=1.0),
        end_shape=EndShape(),
        mounting=Mounting(length_at_zero=0.0),
    )
    for tendon in (0.3, -0.1):  # beyond straight fibres, and shorter than nothing
        assert math.isnan(kernel.tension(pack(empty).tolist(), [0.0, 5.0], tendon))


def test_the_air_fills_the_volume_at_its_own_pressure():
    """P^(1/n) V(l, P) = y, also where the volume depends on the pressure."""
    for law in FORCES:
        muscle = make(law)
        row, chamber = pack(muscle).tolist(), muscle.chamber
        for tendon, pressure, _ in CASES:
            act = charged(muscle, tendon, pressure)
            length, found = length_at_muscle(row, act, tendon), gauge_pressure(row, act, tendon)
            assert length == (tendon + SHIFT) - EXTENSION
            if math.isnan(found):
                assert static_muscle.contraction(row, length) < 0.02
                continue
            assert found == pytest.approx(pressure, abs=1e-5), law
            inside = static_muscle.static_volume(row, length, found)
            filled = (found + chamber.atmosphere) ** (1.0 / chamber.polytropic_index) * inside
            assert filled == pytest.approx(act[-1], rel=1e-11), law


@pytest.mark.parametrize("extensibility", [0.0, 1.3e-7, 4e-7])
@pytest.mark.parametrize("loss", [0.0, 0.6])
def test_static_force_and_volume_have_one_potential(loss, extensibility):
    """dV/dl = -dF/dp with an extensible braid and the ends' loss: no closed path gives work."""
    for force in FORCES:
        base = make(force, passive=STRETCHED)
        braid = dataclasses.replace(base.braid, extensibility=extensibility)
        ends = EndShape(loss=loss, onset=0.02)
        row = pack(dataclasses.replace(base, braid=braid, end_shape=ends)).tolist()
        # The force of a pleated muscle is infinite at nominal length, near which the loss begins.
        pleated = force.startswith("pleated")
        near, checked = 1e-3 if pleated else 1e-5, 0
        for tendon, pressure, _ in CASES:
            kappa = static_muscle.contraction(row, tendon)
            strained = 1.0 - (1.0 - kappa) / (1.0 + extensibility * pressure)
            # Ends and the corrected law are exact where the muscle pulls, from 2 bar on.
            above = pressure - base.threshold.pressure
            if above < 2.1e5 or (pleated and strained < 0.02):
                continue
            if not static_muscle.active_force(row, above, max(strained, kappa)) > 0.0:
                continue
            h, step = 1e-6, 10.0
            by_length = static_muscle.static_volume(row, tendon + h, pressure)
            by_length -= static_muscle.static_volume(row, tendon - h, pressure)
            by_pressure = static_muscle.static_force(row, tendon, pressure + step)
            by_pressure -= static_muscle.static_force(row, tendon, pressure - step)
            by_pressure /= 2.0 * step
            assert by_length / (2.0 * h) == pytest.approx(-by_pressure, rel=near, abs=1e-8), force
            checked += 1
        assert checked >= 5, force


def test_the_air_has_less_room_by_what_the_operator_holds():
    """So that no cycle of length and pressure gives energy, for an operator gives none."""
    for loop, own in LOOPS.items():
        group = dataclasses.replace(own, chord=0.0)
        muscle = make("six_parameter", hysteresis=group)
        row, memory = pack(muscle).tolist(), [0.01 * (k + 1) for k in range(group.state_count)]
        act, tendon = [*memory, *[0.0] * COMMON], 0.175
        held = OPERATORS[loop].energy(group, act, static_muscle.contraction(row, tendon))
        extra = chamber_volume(row, act, tendon, 3e5)
        extra -= static_muscle.static_volume(row, tendon, 3e5)
        assert held != 0.0
        stored = -group.force_per_pressure * muscle.braid.nominal_length * held
        assert extra == pytest.approx(stored, rel=1e-9), loop


# Below nominal length, or below 2 bar, these state no force that belongs to their volume.
SHORT_OF_SLACK = ("pleated", "pleated_shape", "corrected_mckibben")


@pytest.mark.parametrize("extensibility", [0.0, 8e-8])
def test_the_slope_of_the_volume_is_its_difference_quotient(extensibility):
    """Ends and tube included, on both sides of the threshold."""
    for name in FORCES:
        muscle = make(name)
        braid = dataclasses.replace(muscle.braid, extensibility=extensibility)
        row = pack(dataclasses.replace(muscle, braid=braid)).tolist()
        whole = pack(dataclasses.replace(muscle, braid=braid, end_shape=EndShape())).tolist()
        near, slack = 200.0, 0.0 if name in SHORT_OF_SLACK else -5e3
        cases = [(row, 0.07, 4.5e5), *((whole, 0.18, p) for p in (slack, 2.5e5, 4.5e5) if p)]
        for par, kappa, pressure in cases:
            low, (_, slope), high = (
                static_muscle.volume_and_slope(par, kappa, pressure + step)
                for step in (-near, 0.0, near)
            )
            quotient = (high[0] - low[0]) / (2.0 * near)
            assert slope == pytest.approx(quotient, rel=1e-3, abs=1e-16), (name, pressure)


# --- the search for a pressure that the volume depends on ---------------------------------------


@pytest.mark.parametrize("pressure", [2e3, 1e5, 3e5, 7e5])
def test_where_the_search_begins_does_not_matter(pressure):
    muscle = make()
    row = pack(muscle).tolist()
    act = charged(muscle, 0.19, pressure)
    alone = chamber_pressure(row, act, 0.19)
    assert alone == pytest.approx(pressure + muscle.chamber.atmosphere, rel=1e-10)
    starts = [
        (1.0, 1.0),
        (1.001, 1.0),
        (1.3, 1.2),
        (0.7, 0.9),
        (1e-6, 1e-6),
        (1e6, 1e6),
        (1.0, 1e9),
    ]
    for last, earlier in starts:
        act[-LAST], act[-EARLIER] = last * alone, earlier * alone
        assert chamber_pressure(row, act, 0.19) == pytest.approx(alone, rel=3e-11), (last, earlier)


def test_the_last_pressures_are_kept_for_the_next_search_where_there_is_one():
    muscle = make()
    row, act = pack(muscle).tolist(), charged(muscle, 0.19, 2e5)
    out, found = [0.0] * len(act), []
    for step in range(4):
        found.append(chamber_pressure(row, act, 0.19 + 1e-5 * step))
        kernel.state_rates(row, act, out, 0.19 + 1e-5 * step, 0.01, 0.0, 0.0, 1e-3)
        for i in (LAST, EARLIER):
            act[-i] += 1e-3 * out[-i]
        assert [act[-LAST], act[-EARLIER]] == pytest.approx([found[-1], [0.0, *found][-2]])
