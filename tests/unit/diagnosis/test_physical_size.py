"""Sizes of effects in physical terms: of every form, equal to an independent plant's."""

import dataclasses

import numpy as np
import pytest

import pamsim
from pamsim.comparison.effects_on_rig import at_size, candidate, rig_effect, rig_name
from pamsim.diagnosis.bench import CONDITIONS, bench
from pamsim.diagnosis.fitted_rig import PULLEY, pulleys
from pamsim.diagnosis.physical_size import Fitted, correlation, physical_sizes
from pamsim.diagnosis.virtual_tests import TESTS
from pamsim.effects.catalog import EFFECTS, FORMS
from pamsim.engine.parameters import rig_parameter
from pamsim.physics.chain import steady_extension
from pamsim.physics.hysteresis.maxwell_slip import MaxwellSlip
from pamsim.physics.muscle_valves import line_rate
from pamsim.physics.record import parameters, split_states, state_size
from pamsim.recordings.sensors import MeasurementChain, true_at_rest
from tests.plant.air import orifice
from tests.plant.hidden import virtual_tests as plant
from tests.plant.hidden.catalog import PLANT_EFFECTS
from tests.plant.read_rig import read_rig

DRY = "joint.shaft.frictionloss"
LEAK = "chamber.leak_conductance"
DAHL = {"friction.coulomb_force": 12.0, "friction.presliding": 2e-5}


def sized(rig, name, values, muscle=0):
    """Quantity -> value of an effect with some parameters."""
    found = TESTS[name](bench(rig.with_parameters(values)), bench(rig), muscle)
    return {quantity: value for quantity, (value, _) in found.items()}


def alone(found):
    return {name: value for name, value in found.items() if name not in CONDITIONS}


def arm(rig):
    return abs(bench(rig).arms[0])


def test_a_size_is_nothing_without_the_effect_and_grows_with_it(rig):
    assert set(TESTS) == set(EFFECTS)
    for effect in [form for forms in FORMS.values() for form in forms]:
        muscle = 1 if effect.name in ("muscle_mismatch", "valve_mismatch") else 0
        absent, *sizes = (
            alone(sized(rig, effect.name, at_size(rig, effect, s), muscle))
            for s in (0.0, 0.3, 0.6, 1.0)
        )
        assert absent.pop("force_per_pressure_ratio", 1.0) == 1.0
        none = [0.0] * len(absent)
        assert list(absent.values()) == pytest.approx(none, abs=1e-12), effect.label
        assert all(np.isfinite(list(found.values())).all() for found in sizes), effect.label
        main = next(iter(absent))
        first, second, third = (abs(found[main]) for found in sizes)
        assert 0.0 < first < second < third, effect.label


def test_forms_of_friction_that_are_made_equal_have_one_size(rig):
    torque = 2.0 * 12.0 * arm(rig)
    rigid = sized(rig, "coulomb_friction", {DRY: torque})
    dahl = sized(rig, "coulomb_friction", {**DAHL, "friction.presliding": 1e-7})
    assert dahl == pytest.approx(rigid, rel=2e-3)
    assert rigid["sliding_torque"] == pytest.approx(torque)
    lugre = sized(rig, "stribeck_friction", {**DAHL, "friction.breakaway_force": 0.0})
    assert lugre == sized(rig, "coulomb_friction", DAHL)


def test_friction_that_grows_at_rest_breaks_loose_with_what_has_grown(rig):
    stiff = {**DAHL, "friction.presliding": 1e-6}
    grown = {**stiff, "friction.dwell_force": 20.0, "friction.dwell_travel": 1e-4}
    found, without = (sized(rig, "coulomb_friction", values) for values in (grown, stiff))
    more = {name: found[name] - without[name] for name in ("breakaway_torque", "sliding_torque")}
    assert more["breakaway_torque"] == pytest.approx(2.0 * 20.0 * arm(rig), rel=0.2)
    speed = arm(rig) * CONDITIONS["at_speed"][0]
    left = 1.0 / (
        1.0 + speed * bench(rig).muscles[0].friction.dwell_time / grown["friction.dwell_travel"]
    )
    assert more["sliding_torque"] == pytest.approx(left * 2.0 * 20.0 * arm(rig), rel=1e-3)


def test_heat_without_exchange_is_the_plain_form_and_creep_relaxes_exponentially(rig):
    index = {"chamber.polytropic_index": 1.3}
    plain = sized(rig, "thermal_relaxation", index)
    assert sized(rig, "thermal_relaxation", {**index, "chamber.heat_rate": 0.0}) == plain
    exchanged = sized(rig, "thermal_relaxation", {**index, "chamber.heat_rate": 4.0})
    assert exchanged == {**plain, "temperature_time_constant": pytest.approx(0.25)}
    creep = {"creep.stiffness": 2000.0, "creep.relaxation_time": 0.7}
    found = sized(rig, "viscoelastic_creep", creep)
    assert found["half_relaxed_after"] == pytest.approx(0.7 * np.log(2.0), rel=1e-3)
    assert found["relaxed_within_4_s"] == pytest.approx(1.0 - np.exp(-4.0 / 0.7), rel=1e-3)


@pytest.mark.parametrize(("of", "reading", "bend"), [("pressure", 3e5, 1e-7), ("angle", 0.5, 0.06)])
def test_a_scale_has_the_error_of_its_reading_whether_it_bends_or_not(rig, of, reading, bend):
    errors = []
    for error in ({}, {f"{of}_bend": bend}):
        chain = MeasurementChain(**{f"{of}_scale": 0.97, **error})
        values = {f"sensor.{n}": getattr(chain, n) for n in (f"{of}_scale", f"{of}_bend")}
        (found,) = alone(sized(rig, f"{of}_scale", values)).values()
        assert true_at_rest((1.0 + found) * reading, chain, of) == pytest.approx(reading)
        errors.append(found)
    assert errors == pytest.approx([-0.03, bend * reading - 0.03])


def test_a_chain_that_seats_itself_is_as_compliant_as_it_extends(rig):
    values = {"chain.compliance": 1e-6, "chain.hardening": 1e-2}
    chain = bench(rig.with_parameters(values)).muscles[0].chain
    found = sized(rig, "chain_compliance", values)["compliance_at_700_N"]
    assert 700.0 * found == pytest.approx(steady_extension(chain, 700.0))
    assert found == pytest.approx(1e-6 * np.log(8.0) / 7.0)


@pytest.mark.parametrize(("lag", "slew_time"), [(2e-3, 0.03), (0.02, 0.03), (0.02, 0.01)])
def test_a_line_s_size_is_the_area_above_its_response_to_a_full_step(rig, lag, slew_time):
    values = {"valve.line_lag": lag, "valve.line_slew_time": slew_time}
    there = bench(rig.with_parameters(values))
    s = split_states([0.0] * there.states[0])[0]
    timestep, area = 1e-5, 0.0
    for _ in range(20_000):
        area += timestep * (1.0 - s.line)
        s.line += timestep * line_rate(there.muscles[0], s, 1.0, timestep)
    assert sized(rig, "line_lag", values)["sum_of_time_constants"] == pytest.approx(area, rel=2e-3)


def test_a_joint_that_slides_is_tested_in_newtons_and_metres_within_its_muscle_s_travel():
    slides = pamsim.load_rig("muscle_bench")
    without = bench(slides)
    assert CONDITIONS["stroke_amplitude"][0] < 0.02 * without.muscles[0].braid.nominal_length
    there = bench(slides.with_parameters({"joint.rod.damping": 2.0 + without.damping}))
    for test in TESTS.values():
        found = test(there, without, 0)
        assert not any("torque" in quantity or "angle" in quantity for quantity in found)
        assert not {unit for _, unit in found.values()} & {"N*m", "rad", "rad/s", "kg*m^2"}
    drag = TESTS["viscous_friction"](there, without, 0)
    assert drag["force_at_speed"] == (pytest.approx(2.0 * drag["at_sliding_speed"][0]), "N")


def test_a_size_is_what_was_missing_not_what_the_rig_has(rig):
    has = rig.with_parameters({DRY: 0.7, "creep.stiffness": 500.0, "creep.relaxation_time": 2.0})
    assert sized(has, "coulomb_friction", {DRY: 0.9})["sliding_torque"] == pytest.approx(0.2)
    less = sized(has, "coulomb_friction", {DRY: 0.6})
    assert less["breakaway_torque"] == pytest.approx(-0.1)
    rubs = rig.with_parameters(DAHL)
    half = sized(rubs, "coulomb_friction", {"friction.coulomb_force": 6.0})
    assert half["breakaway_torque"] == pytest.approx(-2.0 * 6.0 * arm(rig))
    bare = rig.with_parameters({"hysteresis.force_per_pressure": 0.0})
    lost = TESTS["muscle_hysteresis"](bench(bare), bench(rig), 0)
    gained = TESTS["muscle_hysteresis"](bench(rig), bench(bare), 0)
    assert 0.0 < gained["loop_half_width"][0] == pytest.approx(-lost["loop_half_width"][0])
    more = sized(has, "viscoelastic_creep", {"creep.stiffness": 800.0})
    assert more["force_per_sudden_contraction"] == pytest.approx(300.0)


# The same test on the independent plant, with the library's formula in it.


def in_plant(rig, change):
    without = read_rig(rig, 0.0)
    there = without.copy()
    change(there)
    return there, without


def same(found, measured, *, rel):
    """Every quantity of the plant's test, under its name; conditions exactly."""
    assert set(found) == set(measured)
    for name, quantity in measured.items():
        if name in CONDITIONS:
            assert (quantity.value, quantity.unit) == CONDITIONS[name]
        else:
            assert found[name] == pytest.approx(quantity.value, rel=rel, abs=1e-9), name


def bristles(rig, **forces):
    """Bristles on the plant's joint for those along the library's two tendons."""
    radius = arm(rig)
    always, lost = forces["coulomb"], forces.get("breakaway", 0.0)

    def change(n):
        n.joint.bristle = 2.0 * radius * always
        n.joint.bristle_slip = forces["presliding"] / radius * always / (always + lost)
        n.joint.bristle_power = 1.0
        n.joint.bristle_static = 2.0 * radius * lost
        n.joint.bristle_speed = 2e-3 / radius

    return change


def test_friction_has_the_plant_s_size(rig):
    def dry(n):
        n.joint.dry += 0.3

    def carried(n):
        n.joint.carried = 0.02 * arm(rig)

    stribeck = {
        "friction.coulomb_force": 4.0,
        "friction.breakaway_force": 8.0,
        "friction.stribeck_velocity": 2e-3,
        "friction.presliding": 2e-5,
    }
    share = {"friction.tension_share": 0.02, "friction.presliding": 1e-7}
    both = bristles(rig, coulomb=4.0, breakaway=8.0, presliding=2e-5)
    for name, values, change in (
        ("coulomb_friction", {DRY: 0.3}, dry),
        ("coulomb_friction", DAHL, bristles(rig, coulomb=12.0, presliding=2e-5)),
        ("stribeck_friction", stribeck, both),
        ("load_dependent_friction", share, carried),
    ):
        there, without = in_plant(rig, change)
        same(sized(rig, name, values), plant.joint_friction(there, without, 0.0), rel=4e-3)


def test_hysteresis_has_the_plant_s_size(rig):
    size = 1.5e-4
    bare = rig.with_parameters({"hysteresis.force_per_pressure": 0.0})
    slip = MaxwellSlip(force_per_pressure=size, elements=6.0, full_slip=7e-3, decay=0.7)
    muscles = [dataclasses.replace(m, hysteresis=slip) for m in bare.muscles.values()]
    there = dataclasses.replace(
        bench(bare),
        muscles=tuple(parameters(m) for m in muscles),
        states=tuple(state_size(m) for m in muscles),
    )
    found = {n: v for n, (v, _) in TESTS["muscle_hysteresis"](there, bench(bare), 0).items()}
    effect = PLANT_EFFECTS["slip_hysteresis"]
    same(found, effect.measured(*in_plant(bare, lambda n: effect.change(n, size)), size), rel=1e-9)
    # Bouc-Wen with n = sigma = 1 is Duhem's equation with the same way in both directions.
    duhem = sized(
        bare,
        "muscle_hysteresis",
        {
            "hysteresis.force_per_pressure": size,
            "hysteresis.yield_contraction": 4e-3,
            "hysteresis.sigma": 1.0,
            "hysteresis.sharpness": 1.0,
        },
    )

    def even(n):
        n.muscles.duhem_per_pressure, n.muscles.duhem_travel = size, 4e-3

    same(duhem, plant.muscle_loop(*in_plant(bare, even), size), rel=1e-9)


def stated_by(rig, name, size=None):
    """What the plant's effect has in its test."""
    effect = PLANT_EFFECTS[name]
    size = effect.typical if size is None else size

    def change(n):
        if effect.change is not None:
            effect.change(n, size)

    return effect, effect.measured(*in_plant(rig, change), size)


def test_an_effect_hidden_in_the_library_s_own_form_has_the_size_that_it_states(rig):
    creep = {
        "creep.stiffness": 1100.0,
        "creep.relaxation_time": 0.25,
        "creep.stiffness_2": 900.0,
        "creep.relaxation_time_2": 2.5,
    }
    zone = {"valve.dead_zone": 0.05, "valve.dead_zone_asymmetry": 0.4}
    for hidden, name, values in (
        ("two_branch_creep", "viscoelastic_creep", creep),  # times on a grid of 0.35 %
        ("asymmetric_dead_zone", "valve_dead_zone", zone),
    ):
        same(sized(rig, name, values), stated_by(rig, hidden)[1], rel=4e-3)
    # Leaks that lose as much at the test's pressure have one size.
    orifice_ = sized(rig, "air_leak", {LEAK: 2e-12})["mass_flow"]
    narrow = sized(rig, "air_leak", {"chamber.laminar_leak_conductance": 1e-12})["mass_flow"]
    equal = {"chamber.laminar_leak_conductance": 1e-12 * orifice_ / narrow}
    same(sized(rig, "air_leak", equal), stated_by(rig, "laminar_leak", 2e-12)[1], rel=1e-6)


def test_the_parts_change_as_the_plant_s(rig):
    def numbers(name, muscle=0):
        values = at_size(rig, EFFECTS[name], 1.0)
        return sized(rig, name, values, muscle), read_rig(rig.with_parameters(values), 0.0)

    without = read_rig(rig, 0.0)
    for name in (
        "passive_stiffness", "end_shape", "muscle_mismatch", "braid_locking",
        "braid_extensibility", "stretch_weakening", "force_slope",
    ):  # fmt: skip
        found, there = numbers(name, 1)
        same(found, plant.pull_change(there, without, 0.0), rel=1e-6)
    for name, measure in (
        ("threshold_pressure", PLANT_EFFECTS["smooth_threshold"].measured),
        ("load_torque", PLANT_EFFECTS["tilted_ground"].measured),
    ):
        found, there = numbers(name)
        same(found, measure(there, without, 0.0), rel=1e-6)
    found, there = numbers("viscous_friction")
    drag = float(there.joint[0].damping - without.joint[0].damping)
    there.joint.drag, there.joint.drag_power = drag, 1.0
    same(found, PLANT_EFFECTS["power_drag"].measured(there, without, 0.0), rel=1e-6)
    found, there = numbers("quadratic_damping")
    same(found, PLANT_EFFECTS["power_drag"].measured(there, without, 0.0), rel=1e-6)
    found, there = numbers("added_inertia")
    gained = float(there.joint[0].inertia - without.joint[0].inertia)
    assert found["inertia"] == pytest.approx(gained)
    found, there = numbers("air_leak")
    m = there.muscles[0]
    lost = orifice(m, m.leak, plant.PRESSURE + m.atmosphere, m.atmosphere)
    assert found["mass_flow"] == pytest.approx(float(lost), rel=1e-6)
    found, there = numbers("valve_dead_zone")
    assert found["opening_lost_filling"] == pytest.approx(float(there.muscles[0].dead_zone_fill))
    assert found["opening_lost_venting"] == pytest.approx(float(there.muscles[0].dead_zone_exhaust))


SHARED = {
    "bus_delay": "valve_delay",
    "two_lags": "line_lag",
    "small_reservoir": "supply_sag",
    "nozzle_flow": "valve_flow",
    "hardening_chain": "chain_compliance",
    "elastic_teeth": "chain_backlash",
    "round_teeth": "chain_backlash",
    "angle_filter": "angle_lag",
    "bent_angle_scale": "angle_scale",
    "unequal_channels": "angle_scale",
    "warming_encoder": "angle_bias",
    "pressure_filter": "pressure_lag",
    "bent_pressure_scale": "pressure_scale",
    "power_pressure_scale": "pressure_scale",
    "drifting_pressure_zero": "pressure_bias",
    "unequal_muscles": "muscle_mismatch",
}


def test_the_parameter_that_the_ground_truth_states_has_the_size_that_it_states(rig):
    """Where it states an equal parameter of the library's effect."""

    def own(parameter):
        return rig_parameter(rig, rig_name(rig, parameter)).value

    for name, library in SHARED.items():
        effect, measured = stated_by(rig, name)
        known = effect.in_library(effect.typical, measured, own)
        values = {rig_name(rig, n): v for n, v in known.items()}
        unequal = name == "unequal_muscles"
        found = sized(rig, library, values, muscle=int(unequal))
        # The unequal muscle has another shape: only its gain is that of a scale.
        for quantity in ["force_per_pressure_ratio"] if unequal else list(measured):
            assert found[quantity] == pytest.approx(measured[quantity].value), (name, quantity)


# Intervals.


def fitted(rig, name, jacobian, widths):
    """A fit of one effect of typical size, and that effect."""
    one = candidate(rig, EFFECTS[name])
    best = at_size(rig, one.effect, 1.0)
    known = {
        p.name: (best[p.name] - low, best[p.name] + high)
        for p, (low, high) in zip(one.parameters, widths, strict=True)
    }
    names = [p.name for p in one.parameters]
    return Fitted(values=best, intervals=known, parameters=names, jacobian=np.array(jacobian)), one


def test_the_interval_of_one_parameter_is_the_test_at_both_its_ends_and_ends_at_its_range(rig):
    """That of a table is found by leaving out rows, and may be wider than the range."""

    def flow(leak):
        return sized(rig, "air_leak", {LEAK: leak})["mass_flow"]

    for below, low in ((0.5e-12, 1.5e-12), (5e-12, 0.0)):
        model, effect = fitted(rig, "air_leak", [[1.0]], [(below, 0.2e-12)])
        size = physical_sizes(rig, model, effect)["mass_flow"]
        assert size.interval95 == pytest.approx((flow(low), flow(2.2e-12)))
        assert size.interval95[0] < size.value < size.interval95[1]
        assert size.unit == "kg/s"


def test_errors_of_two_parameters_add_up_as_they_are_correlated(rig):
    for shared in (0.0, 0.9, -0.9):
        # Columns that overlap by c leave estimates that are correlated by -c.
        columns = [[1.0, shared], [0.0, np.sqrt(1.0 - shared**2)]]
        model, effect = fitted(rig, "valve_flow", columns, [(2e-10, 2e-10)] * 2)
        fill, exhaust = (p.name for p in effect.parameters)
        assert correlation(model, [fill, exhaust])[0, 1] == pytest.approx(-shared)
        found = physical_sizes(rig, model, effect)
        one = 2e-10 / rig_parameter(rig, fill).value
        other = 2e-10 / rig_parameter(rig, exhaust).value
        both = 0.5 * np.sqrt(one**2 + other**2 - 2.0 * shared * one * other)
        size = found["relative_change_of_choked_flow"]
        assert size.interval95 == pytest.approx((size.value - both, size.value + both))
        low, high = found["relative_change_filling"].interval95
        assert high - low == pytest.approx(2.0 * one)


def test_conditions_unknown_sizes_and_ends_not_allowed_have_no_interval(rig):
    model, effect = fitted(rig, "coulomb_friction", [[1.0]], [(0.3, 0.1)])
    found = physical_sizes(rig, model, effect)
    assert found["at_speed"].interval95 is None
    assert found["breakaway_torque"].interval95 == pytest.approx((0.0, 0.4))
    model.intervals.clear()
    assert physical_sizes(rig, model, effect)["breakaway_torque"].interval95 is None
    model, effect = fitted(rig, "muscle_mismatch", [[1.0]], [(2.0, 0.1)])
    assert rig_parameter(rig, effect.parameters[0].name).spec.low_open
    sizes = physical_sizes(rig, model, effect)
    assert all(size.interval95 is None for size in sizes.values())


def test_the_pulley_radius_of_a_table_is_part_of_the_rig_that_is_tested(rig):
    own = rig_parameter(rig, pulleys(rig)[0]).value
    model, effect = fitted(rig, "stribeck_friction", np.eye(2), [(0.1, 0.1)] * 2)
    model.intervals.clear()
    plain = physical_sizes(rig, model, effect)["breakaway_torque"].value
    for factor in (1.0, 2.0):
        model.values[PULLEY] = factor * own
        found = physical_sizes(rig, model, effect)["breakaway_torque"].value
        # Below the speed of its peak the force grows with speed, and so with the radius too.
        assert found == pytest.approx(factor**2 * plain, rel=0.01)


def alone_on(rig, label, **more):
    """Sizes of an effect of typical size, with further values, whose intervals are not known."""
    one = candidate(rig, rig_effect(rig, label))
    own = at_size(rig, one.effect, 1.0)
    shown = np.eye(len(own))
    known = Fitted(values={**own, **more}, intervals={}, parameters=list(own), jacobian=shown)
    return physical_sizes(rig, known, one)


def test_an_effect_is_tested_at_its_muscle_and_at_the_joint_that_this_one_moves(rig):
    second = list(rig.muscles)[1]
    assert alone_on(rig, f"air_leak at {second}")["mass_flow"].value > 0.0
    arm = pamsim.load_rig("two_joint_arm")
    teeth = alone_on(arm, "sprocket_ripple at triceps", **{"triceps:chain.ripple": 2e-5})
    assert teeth["travel_amplitude"].value == pytest.approx(2e-5)


def test_what_is_refitted_keeps_the_share_in_which_muscles_differ(rig):
    uneven = rig.with_parameters({"muscle_2:force.scale": 0.5})
    refitted = alone_on(uneven, "load_dependent_friction", **{"force.scale": 1.0})
    assert alone_on(uneven, "load_dependent_friction") == refitted
