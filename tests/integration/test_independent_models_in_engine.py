"""Independent models in the engine, against library laws wherever the two can be equal."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

import pamsim
from pamsim.actuator.layout import slot
from pamsim.comparison.effects_on_rig import at_size
from pamsim.comparison.protocols import PROTOCOLS
from pamsim.core.errors import InputError
from pamsim.effects.catalog import EFFECTS, TRIAL_EFFECTS, effect
from pamsim.pneumatics.air import GAS_CONSTANT
from pamsim.pneumatics.orifice import mass_flow
from pamsim.twins.hide import hide
from pamsim.twins.independent_models import catalog, joint, transmission
from pamsim.twins.independent_models.catalog import MODELS, ORDER, OUTSIDE
from pamsim.twins.independent_models.independent_model import StepHook
from pamsim.twins.independent_models.plant import RunContext

FINE = 2.5e-4


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("mas20_arm")


def trial(name, duration=0.6):
    return dataclasses.replace(PROTOCOLS[name].experiment(1), duration=duration, settle=1.0)


def run(rig, experiment, *laws, seed=0):
    context = RunContext(rig=rig, experiment=experiment, seed=seed, number=0)
    made = [law(context) if law is not None else None for law in laws]
    hook = StepHook(context, made) if laws else None
    return pamsim.simulate(rig, experiment, timestep=FINE, each_step=hook).completed()


def close(one, other, part):
    """Signals that differ by less than a share of how far they move."""
    for name in ("angle", "pressure", "tension"):
        found, known = getattr(one, name), getattr(other, name)
        np.testing.assert_allclose(found, known, atol=part * np.ptp(known, axis=0).max())


def test_a_pull_is_part_of_the_muscle(rig):
    def law(context):
        def pull(plant):
            plant.pull[0] += 20.0

        return pull

    known = run(rig.with_parameters({"muscle_1:force.f": 20.0}), trial("triangle"))
    found = run(rig, trial("triangle"), law)
    assert np.array_equal(found.tension, known.tension)
    assert np.array_equal(found.angle, known.angle)


@pytest.mark.parametrize("name", ["triangle", "bursts"])
def test_reading_openings_and_setting_them_again_changes_next_to_nothing(rig, name):
    def law(context):
        def open_by_hand(plant):
            for i in plant.muscles:
                plant.set_opening(i, plant.opening(i))

        return open_by_hand

    close(run(rig, trial(name), law), run(rig, trial(name)), 2e-3)


@pytest.mark.parametrize("name", ["triangle", "bursts"])
def test_air_let_out_as_the_library_s_leak_is_that_leak(rig, name):
    leaking = {"chamber.leak_conductance": 1e-11}

    def law(context):
        def leak(plant):
            for i, row in enumerate(plant.rows):
                outside = row[slot("chamber.atmosphere")]
                plant.add_air(
                    i, -mass_flow(plant.pressure_abs(i), outside, 1e-11, 0.3, 0.999, 293.15)
                )

        return leak

    known = run(rig.with_parameters(leaking), trial(name))
    assert np.ptp(known.pressure - run(rig, trial(name)).pressure) > 400.0
    close(run(rig, trial(name), law), known, 2e-3)


def test_a_shut_muscle_leaks_to_the_atmosphere_as_an_exponential(rig):
    """At a constant volume: equal muscles, upright, so that nothing turns."""
    upright = rig.with_parameters({"body.rig.tilt": 0.0})
    idle = pamsim.Experiment(
        command="valve",
        command_time=np.array([0.0]),
        command_value=np.zeros((1, 2)),
        start_pressure=np.array([2.5e5, 2.5e5]),
        duration=4.0,
        sample_rate=100.0,
    )
    size = 40.0
    found = run(upright, idle, lambda o: MODELS["air_leak"].law(size, o))
    assert np.ptp(found.angle) < 1e-9
    pressure = found.pressure[:, 0]
    rate = -np.diff(np.log(pressure)) / np.diff(found.time)
    assert pressure[-1] < 0.8 * pressure[0]
    np.testing.assert_allclose(rate, rate.mean(), rtol=2e-3)
    # The flow at the pressure where both leaks agree is the library's.
    sonic = run(
        upright.with_parameters(at_size(rig, effect("air_leak"), size)),
        dataclasses.replace(idle, duration=0.1),
    )
    fall = (sonic.pressure[0, 0] - sonic.pressure[-1, 0]) / 0.1
    assert rate[0] * pressure[0] == pytest.approx(fall, rel=0.02)


def test_ground_tilted_about_the_library_s_axis_is_the_library_s_tilt(rig, monkeypatch):
    monkeypatch.setattr(joint, "_TILT_AXIS", 0.0)
    experiment = trial("loaded_steps")
    known = run(rig.with_parameters(at_size(rig, effect("load_torque"), 2.0)), experiment)
    found = run(rig, experiment, lambda o: MODELS["load_torque"].law(2.0, o))
    assert np.abs(known.angle - run(rig, experiment).angle).max() > 1e-3
    np.testing.assert_allclose(found.angle, known.angle, atol=1e-9)


def test_the_plant_reads_what_is_recorded(rig):
    read = []

    def law(context):
        def look(plant):
            read.append((plant.time, *(plant.pressure(i) for i in plant.muscles), plant.angle))

        return look

    there = rig.with_parameters({"chain.compliance": 1e-6, "chain.backlash": 1e-3})
    found = run(there, trial("bursts"), law)
    rows = np.array([row for row in read if row[0] >= 0.0])[:: round(0.01 / FINE)]
    np.testing.assert_allclose(rows[:, 3], found.angle, atol=1e-12)
    np.testing.assert_allclose(rows[:, 1:3], found.pressure, atol=200.0)  # lengths one step old


def test_elastic_teeth_leave_a_loaded_arm_further_away_than_hard_ones(rig, monkeypatch):
    """At rest by the load's pull over the teeth's stiffness, and no further when they are hard."""
    loose = rig.with_parameters({"hysteresis.force_per_pressure": 0.0})
    idle = pamsim.pressure_step((3e5, 2e5), (3e5, 2e5), duration=0.1, load=1.2)
    hidden = MODELS["chain_backlash"]
    there = loose.with_parameters(hidden.parameters(loose, 1.0))
    known = run(loose.with_parameters(at_size(loose, effect("chain_backlash"), 1.0)), idle)
    found = run(there, idle, lambda o: hidden.law(1.0, o))
    monkeypatch.setattr(transmission, "_TOOTH", 1e12)
    hard = run(there, idle, lambda o: hidden.law(1.0, o))
    apart = abs(known.tension[0, 0] - known.tension[0, 1])
    np.testing.assert_allclose(hard.angle, known.angle, atol=1e-6)
    further = apart / 4e5 / 12.44e-3
    assert abs(found.angle[0] - known.angle[0]) == pytest.approx(further, rel=0.03)


def asked(name, rig, experiment, seed=0, **state):
    """What a law asks of an arm in a stated position: a namespace stands for the plant."""
    context = RunContext(rig=rig, experiment=experiment, seed=seed, number=0)
    law = (MODELS | OUTSIDE)[name].law(2.0, context)
    opened = {}
    plant = SimpleNamespace(
        torque=0.0, user=np.ones((2, 200)), rows=np.ones((2, 200)), muscles=range(2), **state
    )
    plant.set_opening = opened.__setitem__
    law(plant)
    return plant, opened


@pytest.mark.parametrize("speed", [-1.5, 0.5, 2.0])
def test_drag_is_against_the_motion_and_of_its_power(rig, speed):
    step = trial("loaded_steps")
    quadratic, _ = asked("quadratic_drag", rig, step, speed=speed)
    assert quadratic.torque == pytest.approx(-2.0 * 0.15 * speed * abs(speed))
    viscous, _ = asked("viscous_friction", rig, step, speed=speed)
    linear = -2.0 * 0.5 * 0.2484 * speed  # twice the typical half more of the rig's own
    assert viscous.torque == pytest.approx(linear * (abs(speed) / 0.5) ** 0.25)


def test_a_stuck_valve_holds_back_one_direction_of_one_muscle_from_half_time(rig):
    seen = set()
    for seed in range(12):
        limited = []
        for wanted in (0.9, -0.9):
            state = {"opening": lambda i, u=wanted: u}
            _, early = asked("stuck_valve", rig, trial("triangle"), seed, time=0.2, **state)
            _, late = asked("stuck_valve", rig, trial("triangle"), seed, time=0.4, **state)
            (muscle,) = early
            assert early[muscle] == wanted
            assert late[muscle] in (wanted, np.copysign(0.3**2, wanted))
            if late[muscle] != wanted:
                limited.append((muscle, wanted))
        assert len(limited) == 1
        seen |= set(limited)
    assert len(seen) == 4  # any of the valves, by the seed


def test_muscles_age_by_the_stated_share_and_a_ripple_has_its_pitch(rig):
    ages = [
        asked("ageing_drift", rig, trial("triangle"), time=t)[0].user[0, slot("force.0")]
        for t in (-1.0, 0.0, 4.0, 1e3)
    ]
    assert ages == pytest.approx([1.0, 1.0, 1.0 - 0.06 * (1.0 - np.exp(-1.0)), 0.94])
    turn = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    torque = [asked("sprocket_ripple", rig, trial("triangle"), angle=a)[0].torque for a in turn]
    lines = np.abs(np.fft.rfft(torque)) / 200.0
    assert lines[16] == pytest.approx(0.3)
    assert np.delete(lines, 16).max() < 1e-9


def test_cables_are_a_spring_and_a_bearing_rubs_by_what_it_carries(rig):
    step = trial("loaded_steps")
    pulled = [asked("cable_spring", rig, step, angle=a)[0].torque for a in (-0.4, 0.2)]
    assert pulled == pytest.approx([2.0 * 0.2 * 0.4, -2.0 * 0.2 * 0.2])
    for speed, carried in ((1.0, 900.0), (-1.0, 900.0), (1.0, 450.0)):
        tensions = {"tension": lambda i, c=carried: (0.7 if i else 0.3) * c}
        rubbed, _ = asked("bearing_friction", rig, step, speed=speed, **tensions)
        assert rubbed.torque == pytest.approx(-2.0 * 1e-4 * carried * np.sign(speed))


def test_a_cross_leak_takes_from_one_muscle_what_it_gives_to_the_other(rig):
    flows = {}
    for gap in (0.0, 1e5, 2e5):
        blown = {}
        levels = {"pressure_abs": lambda i, g=gap: 3e5 + (g if i == 0 else 0.0)}
        asked("cross_leak", rig, trial("triangle"), add_air=blown.__setitem__, **levels)
        assert blown[0] == -blown[1]
        flows[gap] = blown[1]
    density = 1.0 / GAS_CONSTANT  # of the namespace's air, at 1 Pa and 1 K
    assert flows[0.0] == 0.0
    assert flows[1e5] == pytest.approx(2.0 * 1e-11 * 1e5 * density)
    assert flows[2e5] == pytest.approx(2.0 * flows[1e5])


ALL = [*MODELS, *OUTSIDE]


@pytest.fixture(scope="module")
def quick():
    """The rig at a time step at which the many short runs below take little time."""
    quick = pamsim.load_rig("mas20_arm")
    quick.model.opt.timestep = 1e-3
    return quick


@pytest.fixture
def short(monkeypatch):
    monkeypatch.setattr("pamsim.comparison.protocols.DURATION", 1.0)


def recorded(rig, effects, **options):
    chosen = {"protocols": ("bursts",), "repeats": 1, "variation": 0.0, "noise": 0.0}
    return hide(rig, dict(effects), **{**chosen, "formulation": "independent", **options})


def test_every_effect_has_an_independent_model_and_no_outside_name_is_an_effect():
    assert set(MODELS) == set(TRIAL_EFFECTS)
    assert not set(OUTSIDE) & set(EFFECTS)
    assert len(ORDER) == len(set(ORDER))
    for model in OUTSIDE.values():
        assert set(model.resembles) <= set(EFFECTS)


def far(one, other):
    """Largest RMS of any signal's difference, in sensor noise."""
    sizes = (("angle", np.radians(0.05)), ("pressure", 400.0), ("tension", 1.5))
    return max(
        np.sqrt(np.mean((getattr(one.trials[k], s) - getattr(other.trials[k], s)) ** 2)) / sd
        for k in one.trials.keys() & other.trials.keys()
        for s, sd in sizes
    )


@pytest.mark.parametrize("name", ALL)
def test_each_shows_and_starts_afresh_in_every_run(quick, name, monkeypatch):
    # Bursts open a valve fully or not at all, which a dead zone does not notice.
    of_opening = name in ("valve_dead_zone", "stuck_valve")
    monkeypatch.setattr("pamsim.comparison.protocols.DURATION", 2.2 if of_opening else 1.0)
    protocol, size = ("staircase", 4.0) if of_opening else ("bursts", 1.0)

    def hidden(*effects, **options):
        return recorded(quick, effects, protocols=(protocol,), **options)

    there, plain = hidden((name, size), repeats=2), hidden()
    assert far(there, plain) > 0.2
    assert {e.name for e in there.effects if e.formulation != "library"} == {name}
    first, second = (there.trials[f"{protocol}_{k}"].angle for k in (1, 2))
    assert np.array_equal(first, second) == (name != "valve_delay")  # its bus ticks when it likes
    if name in MODELS and name != "added_inertia":
        library = hidden((name, size), formulation="library")
        assert far(there, library) > 1.2 * far(plain, hidden(formulation="library"))


def test_two_act_together_in_the_order_of_the_signal(quick, short):
    """A lag shapes the input of the regulator; after the valves are set, it would undo that."""

    def hidden(*effects):
        return recorded(quick, effects, protocols=("triangle",))

    lag, zone = ("line_lag", 2.0), ("valve_dead_zone", 6.0)
    both = hidden(lag, zone)
    assert far(both, hidden(zone, lag)) == 0.0
    assert far(both, hidden(lag)) > 0.2
    assert far(both, hidden(zone)) > 0.2


def test_independent_models_take_steps_half_as_long(quick, short):
    for effects in ([], [("air_leak", 1.0)], [("sprocket_ripple", 1.0)]):
        for formulation, step in (("library", 1e-3), ("independent", 5e-4)):
            run = recorded(quick, effects, formulation=formulation).trials["bursts_1"]
            assert run.meta["timestep_s"] == step


def test_what_cannot_be_hidden_is_said(quick, monkeypatch, short):
    with pytest.raises(InputError, match=r"\A[^\n]*did you mean 'sprocket_ripple'[^\n]*\Z"):
        recorded(quick, [("sprocket_riple", 1.0)])
    with pytest.raises(InputError, match="did you mean 'independent'"):
        recorded(quick, [], formulation="indepndent")
    with pytest.raises(InputError, match="must be above 0"):
        recorded(quick, [("valve_delay", 0.0)])
    with pytest.raises(InputError, match="line_lag cannot be combined"):
        recorded(quick, [("line_lag", 1.0), ("stuck_valve", 1.0)], formulation="library")
    monkeypatch.delitem(catalog.MODELS, "air_leak")
    with pytest.raises(
        InputError, match=r"air_leak has no independent model[^\n]*have one: added_inertia, "
    ):
        recorded(quick, [("air_leak", 1.0)])
