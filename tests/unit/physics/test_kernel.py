"""The kernel is the laws put together and nothing else; what is neutral leaves no trace."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pamsim.core.parameters import specs
from pamsim.physics.air import GAS_CONSTANT, mass_flow
from pamsim.physics.braid import Braid
from pamsim.physics.chain import Chain
from pamsim.physics.chamber import Chamber, air_state_rate
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.force_law import coefficients_of
from pamsim.physics.force_laws.mckibben import IdealMcKibben
from pamsim.physics.friction import Friction, bond_rate, dry_friction
from pamsim.physics.hysteresis.bouc_wen import BoucWen
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.hysteresis.maxwell_slip import BLOCKS
from pamsim.physics.muscle import Mounting, Muscle
from pamsim.physics.passive import Creep, PassiveSpring, locking_force, tube_force
from pamsim.physics.record import pack
from pamsim.physics.tension import EndShape, Threshold
from pamsim.physics.valves import (
    COMMANDS,
    ValvePair,
)
from tests.unit.physics.flat import EARLIER_PRESSURE as EARLIER
from tests.unit.physics.flat import LAST_PRESSURE as LAST
from tests.unit.physics.flat import (
    OPENING,
    chamber_pressure,
    gauge_pressure,
    hysteresis_force,
    kernel,
    length_at_muscle,
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
    TIGHT,
    WIDTHS,
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
TIME, TIMESTEP = 0.0123, 1e-3
OPPOSING = 310.0
"""Tension at the other end of the chain [N]."""
SAG = 2.3e4
"""Fall of the supply's pressure [Pa]."""


def geometry(muscle: Muscle, tendon: float, extension: float = 0.0) -> tuple[float, float]:
    """Length [m] and contraction [-], straight from the parameters."""
    length = muscle.mounting.length_at_zero + (tendon - extension)
    return length, 1.0 - length / muscle.braid.nominal_length


def lost_length(muscle: Muscle, act: list[float], tendon: float) -> float:
    """What shift and extension of the chain take from a tendon's length [m]."""
    shift = act[-3] if muscle.chain.backlash else 0.0
    return (act[-2] if muscle.chain.compliance else 0.0) - shift


def composed_tension(muscle: Muscle, act: list[float], tendon: float) -> float:
    """Tension from the catalogs' laws and the muscle's groups, without any row."""
    length, kappa = geometry(muscle, tendon, lost_length(muscle, act, tendon))
    braid, pressure = (
        muscle.braid,
        gauge_pressure(pack(muscle).tolist(), act, tendon),
    )
    grown = braid.nominal_length * (1.0 + braid.extensibility * pressure)
    felt = max(pressure - muscle.threshold.pressure, 0.0)
    law = FORCE_LAWS[muscle.force.law]
    strained = 1.0 - length / grown
    force = law.force(felt, strained, coefficients_of(muscle.force), braid)
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


STRETCHED = PassiveSpring(stiffness=9e3, slack_contraction=0.4)
"""A spring that keeps the muscle taut even when it is evacuated."""


@pytest.mark.parametrize("passive", [make().passive, STRETCHED], ids=["plain", "stretched"])
@pytest.mark.parametrize("kind", KINDS, ids="-".join)
def test_tension_is_the_laws_put_together(kind, passive):
    muscle = make(*kind, passive=passive)
    row = pack(muscle)
    tensions: list[float] = []
    for tendon, pressure, z in CASES:
        act = charged(muscle, tendon, pressure, z)
        tensions.append(kernel.tension(row.tolist(), act, tendon))
        composed = composed_tension(muscle, act, tendon)
        assert tensions[-1] == pytest.approx(composed, rel=1e-11, abs=1e-9, nan_ok=True)
        again = kernel.tension(row, np.array(act), tendon)  # arrays do as well
        assert again == pytest.approx(tensions[-1], rel=1e-13, nan_ok=True)
    assert sum(tension > 0.0 for tension in tensions) > 8
    if kind[0] == "ideal_mckibben" and passive is not STRETCHED:
        assert min(tensions) == 0.0  # slack muscles are among the cases as well


@pytest.mark.parametrize("command", COMMANDS[:3])  # those that move valves
@pytest.mark.parametrize("loop", ["none", *LOOPS])
def test_rates_are_the_laws_put_together(loop, command):
    muscle = make(loop=loop, command=command)
    chamber, valve = muscle.chamber, muscle.valve
    for number, (tendon, pressure, z) in enumerate(CASES):
        velocity, target = 0.1 * math.sin(number), math.cos(number)
        sent = 1.3 * math.sin(5 * number)
        if command == "pressure_set":
            target, sent = pressure + 1.5e4 * target, 1e5 * (1.0 + sent)
        act = charged(muscle, tendon, pressure, z, carried=target)
        _, kappa = geometry(muscle, tendon, lost_length(muscle, act, tendon))
        row = pack(muscle).tolist()
        p_abs = chamber_pressure(row, act, tendon)
        opening = valve_opening(row, target, p_abs - chamber.atmosphere, TIME)
        orifice = valve.critical_ratio, valve.laminar_ratio, chamber.temperature
        leak = mass_flow(p_abs, chamber.atmosphere, chamber.leak_conductance, *orifice)
        squares = p_abs**2 - chamber.atmosphere**2
        heat = GAS_CONSTANT * chamber.temperature
        leak += chamber.laminar_leak_conductance * squares / (2.0 * heat)
        supply = valve.supply_pressure + chamber.atmosphere
        if opening > 0.0:
            fill = opening * valve.conductance_fill
            flow = mass_flow(supply - SAG, p_abs, fill, *orifice)
        else:
            vent = opening * valve.conductance_exhaust
            flow = mass_flow(p_abs, chamber.atmosphere, vent, *orifice)
        expected = [0.0] * len(act)
        expected[-1] = air_state_rate(chamber, p_abs, flow - leak)
        pulled = muscle.chain.compliance * composed_tension(muscle, act, tendon)
        expected[-2] = (pulled - EXTENSION) / muscle.chain.relaxation_time
        apart = composed_tension(muscle, act, tendon) - OPPOSING
        half = 0.5 * muscle.chain.backlash
        after = SHIFT - TIMESTEP * apart / muscle.chain.seating_damping
        expected[-3] = (min(max(after, -half), half) - SHIFT) / TIMESTEP
        whole = 1.0 - math.exp(-TIMESTEP / muscle.creep.relaxation_time)
        expected[-4] = (kappa - RELAXED) * whole / TIMESTEP
        whole = 1.0 - math.exp(-TIMESTEP / muscle.creep.relaxation_time_2)
        expected[-10] = (kappa - RELAXED_2) * whole / TIMESTEP
        meant = sent if command == "pressure_set" else min(max(sent, -1.0), 1.0)
        whole = 1.0 - math.exp(-TIMESTEP / valve.line_lag)
        expected[-5] = (meant - target) * whole / TIMESTEP
        pull = composed_tension(muscle, act, tendon)
        rubbed = dry_friction(muscle.friction, RUBBED, pull, velocity, TIMESTEP, BONDED)
        expected[-6] = (rubbed - RUBBED) / TIMESTEP
        expected[-14] = bond_rate(muscle.friction, BONDED, velocity, TIMESTEP)
        expected[-12] = p_abs / TIMESTEP  # for the next search; none was made before
        expected[-7] = (SAG / supply - SAGGED) / TIMESTEP
        if muscle.hysteresis is not None:
            shortening = expected[-2] - expected[-3] - velocity
            shortening /= muscle.braid.nominal_length
            OPERATORS[loop].rates(muscle.hysteresis, act, expected, kappa, shortening, TIMESTEP)
        assert rates(muscle, act, tendon, velocity, sent) == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize("field", ["hysteresis", "travel_time"])
def test_valves_that_stick_or_are_slow_remember_where_they_are(field):
    muscle = make(valve=dataclasses.replace(PLAIN_VALVE, **{field: 0.2}))
    act, opened = charged(muscle, 0.2, 1e5), []
    for command in (0.5, 0.5, 0.45, -0.2):
        act[-OPENING] += TIMESTEP * rates(muscle, act, 0.2, 0.0, command)[-OPENING]
        opened.append(act[-OPENING])
    slow = TIMESTEP / 0.2
    expected = (
        [slow, 2 * slow, 3 * slow, 2 * slow] if field == "travel_time" else [0.4, 0.4, 0.4, -0.1]
    )
    assert opened == pytest.approx(expected)


def test_commands_mean_what_the_row_says():
    valve = PLAIN_VALVE
    rows = {command: pack(make(command=command, valve=valve)).tolist() for command in COMMANDS}
    half, late = 0.4 * valve.pulse_period, 0.6 * valve.pulse_period
    assert valve_opening(rows["valve"], 1.7, 1e5, half) == 1.0
    assert valve_opening(rows["valve"], -0.5, 1e5, half) == -0.5
    assert valve_opening(rows["pulse"], -0.5, 1e5, half) == -1.0
    assert valve_opening(rows["pulse"], -0.5, 1e5, late) == 0.0
    error = valve.regulator_dead_band + 0.25 * valve.regulator_band
    assert valve_opening(rows["pressure_set"], 1e5 + error, 1e5, half) == pytest.approx(0.25)
    assert valve_opening(rows["pressure_set"], 1e5 - error, 1e5, half) == pytest.approx(-0.25)


@pytest.mark.parametrize("kind", KINDS, ids="-".join)
@pytest.mark.parametrize("air", [-1.0, math.nan])
def test_a_chamber_with_an_impossible_amount_of_air_gives_nan(kind, air):
    muscle = make(*kind)
    act = [*charged(muscle, 0.2, 1e5)[:-1], air]
    row = pack(muscle).tolist()
    assert math.isnan(gauge_pressure(row, act, 0.2))
    assert math.isnan(kernel.tension(row, act, 0.2))
    assert math.isnan(rates(muscle, act, 0.2, 0.0, 0.5)[-1])


@pytest.mark.parametrize("command", COMMANDS)
def test_a_nan_command_does_not_shut_the_valves(command):
    prompt, lagging = make(command=command, valve=PLAIN_VALVE), make(command=command)
    assert math.isnan(rates(prompt, charged(prompt, 0.2, 1e5), 0.2, 0.0, math.nan)[-1])
    if command != "measured":  # which no line delays
        assert math.isnan(rates(lagging, charged(lagging, 0.2, 1e5), 0.2, 0.0, math.nan)[-5])


def test_charging_and_reading_the_pressure_invert_each_other():
    muscle = make()
    row = pack(muscle)
    for tendon, pressure, _ in CASES:
        act = charged(muscle, tendon, pressure)
        assert gauge_pressure(row, act, tendon) == pytest.approx(pressure, abs=1e-6)


@pytest.mark.parametrize("law", FORCES)
def test_the_volume_is_what_the_force_does_work_with(law):
    """dV/dl = -dF/dp, so that one energy G(l, p) has F = dG/dl and V = -dG/dp, ends included."""
    braid = dataclasses.replace(make().braid, extensibility=0.0)
    row = pack(make(law, braid=braid)).tolist()
    seen = 0
    for tendon, pressure, _ in CASES:
        force = static_muscle.static_force(row, tendon, pressure)
        # The ends take their share of a pull only, the corrected law is vouched for from 2 bar on,
        # and where the pull of a pleated muscle begins no difference is fine enough.
        if (
            not force > 0.0
            or pressure < 2.3e5
            or 0.0 < static_muscle.contraction(row, tendon) < 0.01
        ):
            continue
        h = 2e-5
        near = static_muscle.static_volume(row, tendon + h, pressure)
        near -= static_muscle.static_volume(row, tendon - h, pressure)
        far = static_muscle.static_volume(row, tendon + 2 * h, pressure)
        far -= static_muscle.static_volume(row, tendon - 2 * h, pressure)
        by_pressure = static_muscle.static_force(row, tendon, pressure + 10.0)
        by_pressure -= static_muscle.static_force(row, tendon, pressure - 10.0)
        slope = (8.0 * near - far) / (12.0 * h)
        assert slope == pytest.approx(-by_pressure / 20.0, rel=2e-5, abs=1e-9), (tendon, pressure)
        seen += 1
    assert seen >= 6


@pytest.mark.parametrize("law", FORCES)
def test_at_nominal_length_the_volume_is_the_braid_s(law):
    if law.startswith("pleated"):
        pytest.skip("begins at zero contraction, where it has no force")
    muscle = make(law, end_shape=EndShape())
    row, braid = pack(muscle).tolist(), muscle.braid
    cylinder = math.pi * braid.diameter**2 / 4.0 * braid.nominal_length
    tendon = braid.nominal_length - muscle.mounting.length_at_zero
    inside = static_muscle.static_volume(row, tendon, 3e5)
    assert inside == pytest.approx(cylinder + muscle.chamber.dead_volume, rel=1e-12)


@pytest.mark.parametrize("law", FORCES)
def test_the_air_fills_the_volume_at_its_own_pressure(law):
    """P^(1/n) V(l, P) = y, also where the volume depends on the pressure."""
    muscle = make(law)
    row, chamber = pack(muscle).tolist(), muscle.chamber
    for tendon, pressure, _ in CASES:
        act = charged(muscle, tendon, pressure)
        found = gauge_pressure(row, act, tendon)
        if math.isnan(found):
            assert static_muscle.contraction(row, length_at_muscle(row, act, tendon)) < 0.02
            continue
        assert found == pytest.approx(pressure, abs=1e-5)
        inside = static_muscle.static_volume(row, length_at_muscle(row, act, tendon), found)
        filled = (found + chamber.atmosphere) ** (1.0 / chamber.polytropic_index) * inside
        assert filled == pytest.approx(act[-1], rel=1e-11)


def test_shut_valves_leave_the_air_state_alone_at_any_motion():
    muscle = make(chamber=TIGHT)
    for tendon, pressure, _ in CASES:
        assert rates(muscle, charged(muscle, tendon, pressure), tendon, 3.0, 0.0)[-1] == 0.0


def test_length_and_contraction_are_those_of_the_muscle_on_its_tendon():
    muscle = make()
    row = pack(muscle).tolist()
    for tendon, _, _ in CASES:
        length, kappa = geometry(muscle, tendon)
        assert static_muscle.muscle_length(row, tendon) == length
        assert static_muscle.contraction(row, tendon) == kappa
        act = charged(muscle, tendon, 1e5)
        assert length_at_muscle(row, act, tendon) == (tendon + SHIFT) - EXTENSION


@pytest.mark.parametrize("law", [law for law in FORCES if not law.startswith("pleated")])
def test_an_extended_braid_pulls_like_one_made_longer(law):
    """Until it locks, and but for the pleated laws, which know the nominal length by itself."""
    muscle = make(law)
    muscle = dataclasses.replace(muscle, passive=dataclasses.replace(muscle.passive, locking=0.0))
    for tendon, pressure, _ in CASES:
        grown = muscle.braid.nominal_length * (1.0 + muscle.braid.extensibility * pressure)
        longer = dataclasses.replace(muscle.braid, nominal_length=grown, extensibility=0.0)
        made = pack(dataclasses.replace(muscle, braid=longer))
        force = static_muscle.static_force(pack(muscle), tendon, pressure)
        assert force == pytest.approx(
            static_muscle.static_force(made, tendon, pressure), rel=1e-12, abs=1e-9, nan_ok=True
        )


def test_muscle_pulls_less_while_it_shortens_and_a_cycle_costs_work():
    """The loop's sign: at one length the shortening muscle is the weaker one."""
    muscle = make(loop="bouc_wen", valve=PLAIN_VALVE, **LASTING)  # the rest would cost work as well
    row, steps = pack(muscle).tolist(), 4000
    phase = 2.0 * math.pi * np.arange(2 * steps + 1) / steps
    tendons, velocities = 0.18 + 0.01 * np.sin(phase), 0.01 * np.cos(phase)
    act = charged(muscle, float(tendons[0]), 3e5, 0.0)
    tensions, out = [], [0.0] * len(act)
    for tendon, velocity in zip(tendons.tolist(), velocities.tolist(), strict=True):
        tensions.append(kernel.tension(row, act, tendon))
        kernel.state_rates(row, act, out, tendon, velocity, 0.0, 0.0, 1e-3)
        act[0] += out[0] * 2.0 * math.pi / steps
        assert [*out[1:-EARLIER], *out[-LAST + 1 :]] == [0.0] * (BLOCKS + LAST + 2)  # no search
    lengthening, shortening = tensions[steps], tensions[steps + steps // 2]
    assert lengthening > shortening > 0.0
    last = slice(steps, None)
    assert np.trapezoid(tensions[last], tendons[last]) > 0.0  # the tendon puts work in


# --- neutral values: equal to the last bit ------------------------------------------------------


def bits(values: list[float]) -> list[str]:
    return [(value + 0.0).hex() for value in values]  # a slack muscle's zero has no sign


def traces(muscle: Muscle) -> list[list[str]]:
    """Tension and rate of the air over all cases of a gauge pressure that is not negative."""
    row = pack(muscle).tolist()
    found = []
    for tendon, pressure, z in CASES:
        act = charged(muscle, tendon, abs(pressure), z)
        tension = kernel.tension(row, act, tendon)
        pull = kernel.tension(row, act, tendon, 2e-3)
        pull = kernel.tendon_force(row, act, pull, tendon, 2e-3, TIMESTEP)
        moved = rates(muscle, act, tendon, 0.02, 0.7)
        found.append(bits([tension, pull, moved[-1]]))
    return found


RIGID_BRAID = Braid(nominal_length=0.25, diameter=0.02, fibre_angle=0.5)
NO_LEAK = {"leak_conductance": 0.0, "laminar_leak_conductance": 0.0}
GIVEN_CHAMBER = {
    name: getattr(make().chamber, name) for name, _ in specs(Chamber) if name not in NO_LEAK
}
NO_VALVE_EFFECT = {"dead_zone": 0.0, "supply_resistance": 0.0, "line_lag": 0.0}
GIVEN_VALVE = {
    name: getattr(make().valve, name) for name, _ in specs(ValvePair) if name not in NO_VALVE_EFFECT
}
OFF = {
    "passive": (
        PassiveSpring(),
        PassiveSpring(softening=77.0, slack_contraction=0.1, locking=60.0),
    ),
    "threshold": (Threshold(), Threshold(pressure=0.0)),
    "chain": (Chain(), Chain(relaxation_time=3.0)),
    "end_shape": (EndShape(), EndShape(onset=-0.05)),
    "creep": (Creep(), Creep(relaxation_time=0.1, relaxation_time_2=0.2)),
    "friction": (
        Friction(),
        Friction(stribeck_velocity=1e-3, presliding=1e-6, bristle_time=0.01, dwell_time=0.1),
    ),
    "braid": (RIGID_BRAID, dataclasses.replace(RIGID_BRAID, extensibility=0.0)),
    "chamber": (Chamber(**GIVEN_CHAMBER), Chamber(**GIVEN_CHAMBER, **NO_LEAK)),
    "valve": (ValvePair(**GIVEN_VALVE), ValvePair(**GIVEN_VALVE, **NO_VALVE_EFFECT)),
}
"""Effect -> the group that a rig gets which does not state it, and one of no size."""
NO_WIDTH = dict.fromkeys(WIDTHS, 0.0)


@pytest.mark.parametrize("kind", KINDS, ids="-".join)
@pytest.mark.parametrize("effect", OFF)
def test_effect_of_no_size_leaves_no_trace(kind, effect):
    absent, neutral = OFF[effect]
    base = make(*kind)
    assert traces(dataclasses.replace(base, **{effect: neutral})) == traces(
        dataclasses.replace(base, **{effect: absent})
    )


@pytest.mark.parametrize("effect", OFF)
def test_effect_of_some_size_does_leave_a_trace(effect):
    base = make()
    assert traces(base) != traces(dataclasses.replace(base, **{effect: OFF[effect][0]}))


def test_locking_by_itself_leaves_a_trace():
    base = make()
    free = dataclasses.replace(base.passive, locking=0.0)
    assert traces(base) != traces(dataclasses.replace(base, passive=free))


@pytest.mark.parametrize("kind", KINDS, ids="-".join)
def test_braid_spring_and_chain_that_do_not_give_leave_the_plain_sum_of_forces(kind):
    """No locking, extensibility or compliance: written without them, equal to the bit."""
    linear = PassiveSpring(stiffness=900.0, softening=9.0, slack_contraction=0.02)
    off = {"chain": Chain(relaxation_time=0.5), "end_shape": EndShape(), "creep": Creep()}
    muscle = make(*kind, passive=linear, braid=RIGID_BRAID, **off)
    row = pack(muscle).tolist()
    for tendon, pressure, z in CASES:
        act = charged(muscle, tendon, abs(pressure), z)
        kappa, gauge = (
            static_muscle.contraction(row, tendon),
            gauge_pressure(row, act, tendon),
        )
        stretch = 0.02 - kappa
        spring = 900.0 * stretch if stretch > 0.0 else 100.0 * math.expm1(9.0 * stretch)
        active = static_muscle.active_force(row, max(gauge - muscle.threshold.pressure, 0.0), kappa)
        force = active + spring
        force = max(force - hysteresis_force(row, act, kappa, max(gauge, 0.0), force), 0.0)
        assert bits([kernel.tension(row, act, tendon)]) == bits([force])


@pytest.mark.parametrize("loop", LOOPS)
def test_states_of_effects_that_are_off_stand_still_and_nobody_minds_them(loop):
    """Rates of all states with such as a rig cannot have left there but by hand."""
    off = {"chain": Chain(), "creep": Creep(), "friction": Friction(), "valve": PLAIN_VALVE}
    muscle = make(loop=loop, **off)
    for tendon, pressure, z in CASES:
        act = charged(muscle, tendon, pressure, z, carried=0.4)
        without = [*act[:-7], *[0.0] * 6, act[-1]]
        found = rates(muscle, act, tendon, 0.03, 0.4)
        assert found[-7:-1] == [0.0] * 6
        assert bits(found) == bits(rates(muscle, without, tendon, 0.03, 0.4))


@pytest.mark.parametrize("loop", LOOPS)
def test_operator_of_no_width_leaves_no_trace(loop):
    base = make(loop=loop)
    still = dataclasses.replace(LOOPS[loop], **NO_WIDTH)
    without = traces(dataclasses.replace(base, hysteresis=None))
    assert traces(dataclasses.replace(base, hysteresis=still)) == without
    for width, size in WIDTHS.items():  # and each width by itself does leave one
        one = dataclasses.replace(still, **{width: size})
        assert traces(dataclasses.replace(base, hysteresis=one)) != without


# Below nominal length, or below 2 bar, these state no force that belongs to their volume.
SHORT_OF_SLACK = ("pleated", "pleated_shape", "corrected_mckibben")


@pytest.mark.parametrize("extensibility", [0.0, 8e-8])
@pytest.mark.parametrize("name", FORCES)
def test_the_slope_of_the_volume_is_its_difference_quotient(name, extensibility):
    """Ends and tube included, on both sides of the threshold."""
    muscle = make(name)
    braid = dataclasses.replace(muscle.braid, extensibility=extensibility)
    row = pack(dataclasses.replace(muscle, braid=braid)).tolist()
    whole = pack(dataclasses.replace(muscle, braid=braid, end_shape=EndShape())).tolist()
    near, slack = 200.0, 0.0 if name in SHORT_OF_SLACK else -5e3
    cases = [(row, 0.07, 4.5e5), *((whole, 0.18, p) for p in (slack, 2.5e5, 4.5e5) if p)]
    for par, kappa, pressure in cases:
        above, below = (
            static_muscle.volume_and_slope(par, kappa, pressure + step)[0] for step in (near, -near)
        )
        slope = static_muscle.volume_and_slope(par, kappa, pressure)[1]
        assert slope == pytest.approx((above - below) / (2.0 * near), rel=1e-3, abs=1e-16)


@pytest.mark.parametrize("name", FORCES)
def test_all_effects_neutral_leave_the_bare_force_law(name):
    """Scale 1 and all else off: the tension is the law's own number, to the bit."""
    stated = dataclasses.asdict(FORCES[name])
    del stated["scale"]  # its default is the neutral value
    group = type(FORCES[name])(**stated)
    off = {
        "passive": PassiveSpring(),
        "threshold": Threshold(),
        "chain": Chain(),
        "end_shape": EndShape(),
        "creep": Creep(),
        "braid": RIGID_BRAID,
    }
    muscle = make(force=group, hysteresis=BoucWen(yield_contraction=0.01), **off)
    row, law = pack(muscle).tolist(), FORCE_LAWS[name]
    numbers = [*coefficients_of(group)[1:], *(getattr(muscle.braid, f) for f in law.braid_fields)]
    taut = 0
    for tendon, pressure, z in CASES:
        act = charged(muscle, tendon, abs(pressure), z)
        felt = gauge_pressure(row, act, tendon)
        bare = law.force_function(felt, geometry(muscle, tendon)[1], *numbers)
        taut += bare > 0.0
        expected = bare if math.isnan(bare) else max(bare, 0.0)
        assert bits([kernel.tension(row, act, tendon)]) == bits([expected])
    assert taut > 8


def test_loop_without_a_part_per_pressure_has_one_width_at_every_pressure():
    """force_per_pressure = 0 gives, bit by bit, the loop of the constant width alone."""
    loop = BoucWen(force=5.0, force_per_pressure=0.0, yield_contraction=0.005)
    for tendon, pressure, z in CASES:
        bare = make(passive=STRETCHED, **LASTING)
        air = charged(bare, tendon, pressure)
        plain = static_muscle.static_force(
            pack(bare), tendon, gauge_pressure(pack(bare), air, tendon)
        )
        looped = pack(dataclasses.replace(bare, hysteresis=loop)).tolist()
        assert bits([kernel.tension(looped, [z, *air], tendon)]) == bits(
            [max(plain - 5.0 * z, 0.0)]
        )


def test_a_chamber_without_volume_stops_the_run():
    muscle = make(
        force=IdealMcKibben(),
        braid=LASTING["braid"],
        end_shape=EndShape(),
        chamber=Chamber(polytropic_index=1.2, temperature=300.0, dead_volume=0.0),
        chain=Chain(),
        creep=Creep(),
        mounting=Mounting(length_at_zero=0.0),
    )
    row = pack(muscle).tolist()
    for tendon in (0.3, -0.1):  # beyond straight fibres, and shorter than nothing
        assert math.isnan(chamber_pressure(row, [0.0, 5.0], tendon))
        assert math.isnan(kernel.tension(row, [0.0, 5.0], tendon))


@pytest.mark.parametrize("extensibility", [0.0, 1.3e-7, 4e-7])
@pytest.mark.parametrize("loss", [0.0, 0.6])
@pytest.mark.parametrize("force", FORCES)
def test_static_force_and_volume_have_one_potential(force, loss, extensibility):
    """dV/dl = -dF/dp with an extensible braid and the ends' loss: no closed path gives work."""
    base = make(force, passive=STRETCHED)
    muscle = dataclasses.replace(
        base,
        braid=dataclasses.replace(base.braid, extensibility=extensibility),
        end_shape=EndShape(loss=loss, onset=0.02),
    )
    row = pack(muscle).tolist()
    # The force of a pleated muscle is infinite at nominal length, near which the ends' loss begins.
    pleated = force.startswith("pleated")
    near, checked = 1e-3 if pleated else 1e-5, 0
    for tendon, pressure, _ in CASES:
        # Ends and the corrected law are exact where the muscle pulls, from 2 bar on.
        _, kappa = geometry(muscle, tendon)
        strained = 1.0 - (1.0 - kappa) / (1.0 + extensibility * pressure)
        if pleated and strained < 0.02:
            continue
        above = pressure - muscle.threshold.pressure
        if above < 2.1e5 or not static_muscle.active_force(row, above, max(strained, kappa)) > 0.0:
            continue
        h, step = 1e-6, 10.0
        by_length = static_muscle.static_volume(row, tendon + h, pressure)
        by_length -= static_muscle.static_volume(row, tendon - h, pressure)
        by_pressure = static_muscle.static_force(row, tendon, pressure + step)
        by_pressure -= static_muscle.static_force(row, tendon, pressure - step)
        by_pressure /= 2.0 * step
        assert by_length / (2.0 * h) == pytest.approx(-by_pressure, rel=near, abs=1e-8)
        checked += 1
    assert checked >= 5


# --- the search for a pressure that the volume depends on ---------------------------------------


@pytest.mark.parametrize(
    ("last", "earlier"),
    [(1.0, 1.0), (1.001, 1.0), (1.3, 1.2), (0.7, 0.9), (1e-6, 1e-6), (1e6, 1e6), (1.0, 1e9)],
)
@pytest.mark.parametrize("pressure", [2e3, 1e5, 3e5, 7e5])
def test_where_the_search_begins_does_not_matter(last, earlier, pressure):
    muscle = make()
    row = pack(muscle).tolist()
    act = charged(muscle, 0.19, pressure)
    alone = chamber_pressure(row, act, 0.19)
    assert alone == pytest.approx(pressure + muscle.chamber.atmosphere, rel=1e-10)
    act[-LAST], act[-EARLIER] = last * alone, earlier * alone
    assert chamber_pressure(row, act, 0.19) == pytest.approx(alone, rel=3e-11)


def test_the_last_pressures_are_kept_for_the_next_search():
    muscle = make()
    row, act = pack(muscle).tolist(), charged(muscle, 0.19, 2e5)
    out, found = [0.0] * len(act), []
    for step in range(4):
        found.append(chamber_pressure(row, act, 0.19 + 1e-5 * step))
        kernel.state_rates(row, act, out, 0.19 + 1e-5 * step, 0.01, 0.0, 0.0, 1e-3)
        for i in (LAST, EARLIER):
            act[-i] += 1e-3 * out[-i]
        assert [act[-LAST], act[-EARLIER]] == pytest.approx([found[-1], [0.0, *found][-2]])


def test_a_rigid_braid_keeps_no_pressures():
    braid = dataclasses.replace(make().braid, extensibility=0.0)
    muscle = make(braid=braid)
    row, act = pack(muscle).tolist(), charged(muscle, 0.19, 2e5)
    out = [0.0] * len(act)
    kernel.state_rates(row, act, out, 0.19, 0.01, 0.0, 0.0, 1e-3)
    assert [out[-LAST], out[-EARLIER]] == [0.0, 0.0]
