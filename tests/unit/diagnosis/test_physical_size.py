"""Sizes of effects in physical terms: of every form, equal to an independent plant's."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import pamsim
from pamsim.comparison.effects_on_rig import at_size, candidate, rig_effect, rig_name
from pamsim.diagnosis.bench import bench
from pamsim.diagnosis.physical_size import Fitted, correlation, physical_sizes
from pamsim.diagnosis.pulley_radius import PULLEY, pulleys
from pamsim.diagnosis.virtual_test_conditions import CONDITIONS
from pamsim.diagnosis.virtual_tests import TESTS
from pamsim.effects.catalog import EFFECTS, FORMS
from pamsim.engine.parameters import rig_parameter
from pamsim.physics.hysteresis.maxwell_slip import MaxwellSlip
from pamsim.physics.record import parameters, state_size
from tests.plant.air import orifice
from tests.plant.hidden import virtual_tests as plant
from tests.plant.hidden.catalog import PLANT_EFFECTS
from tests.plant.read_rig import read_rig

ALL_FORMS = [effect for forms in FORMS.values() for effect in forms]
DRY = "joint.shaft.frictionloss"
DAHL = {"friction.coulomb_force": 12.0, "friction.presliding": 2e-5}


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("mas20_arm")


def sized(rig, name, values, muscle=0):
    """Quantity -> value of an effect with some parameters."""
    found = TESTS[name](bench(rig.with_parameters(values)), bench(rig), muscle)
    return {quantity: value for quantity, (value, _) in found.items()}


def alone(found):
    return {name: value for name, value in found.items() if name not in CONDITIONS}


def arm(rig):
    return abs(bench(rig).arms[0])


@pytest.mark.parametrize("effect", ALL_FORMS, ids=lambda e: f"{e.name}:{e.form}".rstrip(":"))
def test_a_size_is_nothing_without_the_effect_and_grows_with_it(rig, effect):
    muscle = 1 if effect.name in ("muscle_mismatch", "valve_mismatch") else 0
    absent = alone(sized(rig, effect.name, at_size(rig, effect, 0.0), muscle))
    ratio = absent.pop("force_per_pressure_ratio", 1.0)
    assert ratio == 1.0
    assert list(absent.values()) == pytest.approx([0.0] * len(absent), abs=1e-12)
    sizes = [
        alone(sized(rig, effect.name, at_size(rig, effect, s), muscle)) for s in (0.3, 0.6, 1.0)
    ]
    assert all(np.isfinite(list(found.values())).all() for found in sizes)
    main = next(iter(absent))
    first, second, third = (abs(found[main]) for found in sizes)
    assert 0.0 < first < second < third


def test_every_effect_of_the_catalogue_has_a_test():
    assert set(TESTS) == set(EFFECTS)


def test_forms_of_friction_that_are_made_equal_have_one_size(rig):
    torque = 2.0 * 12.0 * arm(rig)
    rigid = sized(rig, "coulomb_friction", {DRY: torque})
    dahl = sized(rig, "coulomb_friction", {**DAHL, "friction.presliding": 1e-7})
    assert dahl == pytest.approx(rigid, rel=2e-3)
    assert rigid["sliding_torque"] == pytest.approx(torque)
    lugre = sized(rig, "stribeck_friction", {**DAHL, "friction.breakaway_force": 0.0})
    assert lugre == sized(rig, "coulomb_friction", DAHL)


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


def dry(n):
    n.joint.dry += 0.3


def carried(rig):
    def change(n):
        n.joint.carried = 0.02 * arm(rig)

    return change


def test_friction_has_the_plant_s_size(rig):
    for name, values, change in (
        ("coulomb_friction", {DRY: 0.3}, dry),
        ("coulomb_friction", DAHL, bristles(rig, coulomb=12.0, presliding=2e-5)),
        (
            "stribeck_friction",
            {
                "friction.coulomb_force": 4.0,
                "friction.breakaway_force": 8.0,
                "friction.stribeck_velocity": 2e-3,
                "friction.presliding": 2e-5,
            },
            bristles(rig, coulomb=4.0, breakaway=8.0, presliding=2e-5),
        ),
        (
            "load_dependent_friction",
            {"friction.tension_share": 0.02, "friction.presliding": 1e-7},
            carried(rig),
        ),
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


def test_creep_has_the_plant_s_size(rig):
    def branch(n):
        for k, stiffness in enumerate((1500.0, 0.0, 0.0, 0.0), start=1):
            n.muscles[f"creep_{k}"], n.muscles[f"creep_time_{k}"] = stiffness, 2.0

    values = {"creep.stiffness": 1500.0, "creep.relaxation_time": 2.0}
    there, without = in_plant(rig, branch)
    # The plant's times are a grid of 0.35 %.
    same(sized(rig, "viscoelastic_creep", values), plant.creep(there, without, 0.0), rel=4e-3)


@pytest.mark.parametrize(
    ("hidden", "name", "values"),
    [
        (
            "two_branch_creep",
            "viscoelastic_creep",
            {
                "creep.stiffness": 1100.0,
                "creep.relaxation_time": 0.25,
                "creep.stiffness_2": 900.0,
                "creep.relaxation_time_2": 2.5,
            },
        ),
        (
            "asymmetric_dead_zone",
            "valve_dead_zone",
            {"valve.dead_zone": 0.05, "valve.dead_zone_asymmetry": 0.4},
        ),
    ],
)
def test_an_effect_hidden_in_the_library_s_own_form_has_the_size_that_it_states(
    rig, hidden, name, values
):
    effect = PLANT_EFFECTS[hidden]
    there, without = in_plant(rig, lambda n: effect.change(n, effect.typical))
    measured = effect.measured(there, without, effect.typical)
    same(sized(rig, name, values), measured, rel=4e-3)


def test_leaks_that_lose_as_much_at_the_test_s_pressure_have_one_size(rig):
    orifice_ = sized(rig, "air_leak", {"chamber.leak_conductance": 2e-12})["mass_flow"]
    narrow = sized(rig, "air_leak", {"chamber.laminar_leak_conductance": 1e-12})["mass_flow"]
    equal = {"chamber.laminar_leak_conductance": 1e-12 * orifice_ / narrow}
    effect = PLANT_EFFECTS["laminar_leak"]
    measured = effect.measured(*in_plant(rig, lambda n: effect.change(n, 2e-12)), 2e-12)
    same(sized(rig, "air_leak", equal), measured, rel=1e-6)


@pytest.mark.parametrize(
    "name",
    [
        "passive_stiffness", "end_shape", "muscle_mismatch", "braid_locking",
        "braid_extensibility", "stretch_weakening", "force_slope",
    ],
)  # fmt: skip
def test_the_static_pull_changes_as_the_plant_s(rig, name):
    values = at_size(rig, EFFECTS[name], 1.0)
    there = read_rig(rig.with_parameters(values), 0.0)
    measured = plant.pull_change(there, read_rig(rig, 0.0), 0.0)
    same(sized(rig, name, values, muscle=1), measured, rel=1e-6)


def test_the_other_parts_change_as_the_plant_s(rig):
    def numbers(name):
        values = at_size(rig, EFFECTS[name], 1.0)
        return sized(rig, name, values), read_rig(rig.with_parameters(values), 0.0)

    without = read_rig(rig, 0.0)
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
"""Effect of the plant -> the library's, where the ground truth states an equal parameter."""


@pytest.mark.parametrize("name", SHARED)
def test_the_parameter_that_the_ground_truth_states_has_the_size_that_it_states(rig, name):
    effect = PLANT_EFFECTS[name]

    def change(n):
        if effect.change is not None:
            effect.change(n, effect.typical)

    measured = effect.measured(*in_plant(rig, change), effect.typical)

    def own(parameter):
        return rig_parameter(rig, rig_name(rig, parameter)).value

    known = effect.in_library(effect.typical, measured, own)
    values = {rig_name(rig, n): v for n, v in known.items()}
    found = sized(rig, SHARED[name], values, muscle=int(name == "unequal_muscles"))
    # The unequal muscle has another shape: only its gain is that of a scale.
    compared = ["force_per_pressure_ratio"] if name == "unequal_muscles" else list(measured)
    for quantity in compared:
        assert found[quantity] == pytest.approx(measured[quantity].value), quantity


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


def test_the_interval_of_one_parameter_is_the_test_at_both_its_ends(rig):
    model, effect = fitted(rig, "air_leak", [[1.0]], [(0.5e-12, 0.2e-12)])
    size = physical_sizes(rig, model, effect)["mass_flow"]
    low, high = (
        sized(rig, "air_leak", {"chamber.leak_conductance": c})["mass_flow"]
        for c in (1.5e-12, 2.2e-12)
    )
    assert size.interval95 == pytest.approx((low, high))
    assert low < size.value < high
    assert size.unit == "kg/s"


@pytest.mark.parametrize("shared", [0.0, 0.9, -0.9])
def test_errors_of_two_parameters_add_up_as_they_are_correlated(rig, shared):
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


def test_conditions_and_unknown_sizes_have_no_interval_and_ranges_hold(rig):
    model, effect = fitted(rig, "coulomb_friction", [[1.0]], [(0.3, 0.1)])
    found = physical_sizes(rig, model, effect)
    assert found["at_speed"].interval95 is None
    assert found["breakaway_torque"].interval95 == pytest.approx((0.0, 0.4))
    model.intervals.clear()
    assert physical_sizes(rig, model, effect)["breakaway_torque"].interval95 is None


def test_an_interval_beyond_the_parameter_s_range_ends_there(rig):
    """That of a table is found by leaving out rows, and may be wider than the range."""
    model, effect = fitted(rig, "air_leak", [[1.0]], [(5e-12, 0.2e-12)])
    low, high = physical_sizes(rig, model, effect)["mass_flow"].interval95
    assert (low, high) == pytest.approx(
        (0.0, sized(rig, "air_leak", {"chamber.leak_conductance": 2.2e-12})["mass_flow"])
    )


def test_an_interval_to_an_end_that_is_not_allowed_gives_no_interval(rig):
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


def test_an_effect_on_one_muscle_is_tested_there(rig):
    second = list(rig.muscles)[1]
    one = candidate(rig, rig_effect(rig, f"air_leak at {second}"))
    values = {f"{second}:chamber.leak_conductance": 2e-12}
    model = Fitted(values=values, intervals={}, parameters=list(values), jacobian=np.eye(1))
    assert physical_sizes(rig, model, one)["mass_flow"].value > 0.0
