"""One supply feeds both muscles: no air is made or lost, and each feels the other."""

import dataclasses

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.physics.air import GAS_CONSTANT, mass_flow
from tests.plant.read_rig import read_rig
from tests.plant.run import run
from tests.unit.physics.flat import AIR, SAG, chamber_volume

LINE = {"valve.supply_resistance": 8e8}
TANK = LINE | {"valve.supply_volume": 2e-5}
LEAK = {"chamber.leak_conductance": 1e-11}
WIDE = {"valve.conductance_fill": 2e-9, "valve.conductance_exhaust": 2e-9}


def rig_with(**parameters):
    # The books below know no elastic energy: pressure must not lengthen the muscle.
    stiff = {"braid.extensibility": 0.0} | parameters
    return pamsim.load_rig("mas20_arm").with_parameters(stiff)


def random_run(rig, seconds, timestep=1e-3):
    """Books before each step of a run on random valve openings, and after the last.

    Each opening lasts 25 ms; a third of them are shut.
    """
    model = rig.model_for(command="valve", load=1.2, timestep=timestep)
    data = mujoco.MjData(model)
    pamsim.reset(model, data, (1e5, 4e5))
    steps, held = round(seconds / timestep), round(0.025 / timestep)
    commands = np.random.default_rng(3).uniform(-1.0, 1.0, (steps // held + 1, 2))
    commands[np.abs(commands) < 1.0 / 3.0] = 0.0
    books = []
    with pamsim.live(model):
        for k in range(steps + 1):
            data.ctrl[:] = commands[k // held]
            mujoco.mj_forward(model, data)
            books.append(Books(rig, model, data))
            mujoco.mj_step(model, data)
    return books


def places(model, state):
    """Where a state of both muscles lies in ``data.act``."""
    return model.actuator_actadr + model.actuator_actnum - state


class Books:
    """Air of arm and supply at one instant, by the gas laws, not by the states' names.

    Flows are those of the coming step.
    """

    def __init__(self, rig, model, data):
        chamber, valve = rig.muscles["muscle_1"].chamber, rig.muscles["muscle_1"].valve
        heat = GAS_CONSTANT * chamber.temperature
        orifice = valve.critical_ratio, valve.laminar_ratio, chamber.temperature
        full = valve.supply_pressure + chamber.atmosphere
        airs, (one, other) = places(model, AIR), places(model, SAG)
        assert data.act[one] == data.act[other], "both muscles hold the same sag"
        before = full * data.act[one]
        sag = before + full * data.act_dot[one] * model.opt.timestep  # during the step
        self.source = sag / valve.supply_resistance
        self.mass = (full - before) * valve.supply_volume / heat
        self.lost, self.backflow = 0.0, False
        for i in range(2):
            # This force law is linear in pressure, and so the volume does not depend on it.
            first = model.actuator_actadr[i]
            own = data.act[first : first + model.actuator_actnum[i]]
            length = float(data.actuator_length[i])
            volume = chamber_volume(model.actuator_user[i].tolist(), own, length, 0.0)
            pressure = (data.act[airs[i]] / volume) ** chamber.polytropic_index
            self.mass += pressure * volume / heat
            opening = float(data.ctrl[i])
            fill = max(opening, 0.0) * valve.conductance_fill
            out = max(-opening, 0.0) * valve.conductance_exhaust + chamber.leak_conductance
            self.backflow |= mass_flow(full - sag, pressure, fill, *orifice) < 0.0
            self.lost += mass_flow(pressure, chamber.atmosphere, out, *orifice)


SUPPLIES = pytest.mark.parametrize("supply", [LINE, TANK], ids=["no volume", "tank"])


@SUPPLIES
def test_air_of_muscles_and_supply_is_what_the_source_gave_minus_what_got_out(supply):
    """Isothermal air, whose mass is P V / (R T): closed to 1e-9 of what moved."""
    rig = rig_with(**supply, **LEAK, **WIDE, **{"chamber.polytropic_index": 1.0})
    books = random_run(rig, 4.0)
    given, lost = (1e-3 * sum(getattr(b, n) for b in books[:-1]) for n in ("source", "lost"))
    assert given > books[0].mass, "the run must move more air than there was"
    assert any(each.backflow for each in books), "and some of it from a muscle into the line"
    assert abs(books[-1].mass - books[0].mass - given + lost) < 1e-9 * given


FILL = pamsim.pressure_step((1e5, 1e5), (5e5, 3e5), duration=1.5, load=1.2, sample_rate=100.0)


@SUPPLIES
def test_a_muscle_feels_what_the_other_draws_as_in_the_independent_plant(supply):
    shared = rig_with(**supply)
    apart = rig_with(**supply, **{"muscle_2:valve.supply_line": 1.0})
    muscles = tuple(shared.muscles)
    expected = run(read_rig(shared, 1.2), FILL, rig="x", muscles=muscles).pressure
    together, alone = (pamsim.simulate(rig, FILL, timestep=2.5e-4) for rig in (shared, apart))
    assert np.abs(together.pressure - expected).max() < 200.0
    lost = alone.pressure[:, 1] - together.pressure[:, 1]
    assert lost.max() > 3e4
    np.testing.assert_allclose(lost, alone.pressure[:, 1] - expected[:, 1], atol=200.0)


def driven(rig, commands):
    """Data after 60 steps of each pair of valve openings, from 3 bar in both muscles."""
    model = rig.model_for(command="valve", load=1.2)
    data = mujoco.MjData(model)
    pamsim.reset(model, data, (3e5, 3e5))
    with pamsim.live(model):
        for command in commands:
            data.ctrl[:] = command
            mujoco.mj_step(model, data, 60)
    return data


@SUPPLIES
def test_while_the_other_draws_nothing_a_shared_supply_is_one_s_own_to_the_bit(supply):
    shared, apart = (rig_with(**supply, **{"muscle_2:valve.supply_line": n}) for n in (0.0, 1.0))
    for commands, equal in (([(0.4, -0.3), (1.0, 0.0)], True), ([(0.4, 0.3)], False)):
        one, other = (driven(rig, commands) for rig in (shared, apart))
        assert np.array_equal(one.qpos, other.qpos) == equal
        air = places(shared.model, AIR)
        assert np.array_equal(one.act[air], other.act[air]) == equal


def test_a_muscle_that_is_switched_off_takes_and_gives_no_air_and_does_not_pull_the_chain():
    """Its neighbour feels what it feels beside a vented one that is shut and does not leak."""

    def rates(leak, held, opening, off):
        rig = rig_with(**LINE, **{"chamber.cross_leak_conductance": leak, "chain.backlash": 1e-3})
        model = rig.model_for(command="valve")
        model.actuator_group[1], model.opt.disableactuator = 1, 2 * off
        data = mujoco.MjData(model)
        pamsim.reset(model, data, (1e5, held))
        data.ctrl[:] = 0.5, opening
        mujoco.mj_forward(model, data)
        return data.act_dot[: model.actuator_actnum[0]].copy()

    alone = rates(0.0, 0.0, 0.0, False)
    assert np.array_equal(rates(1e-10, 4e5, 1.0, True), alone)
    assert not np.array_equal(rates(1e-10, 4e5, 1.0, False), alone)


def test_a_supply_that_its_muscles_state_differently_is_refused():
    short = dataclasses.replace(FILL, duration=0.05)
    for name, value in (
        ("supply_pressure", 5e5),
        ("supply_resistance", 0.0),
        ("supply_volume", 1e-3),
    ):
        differs = TANK | {f"muscle_2:valve.{name}": value}
        message = rf"\Amuscle_1 and muscle_2 share a supply: [^\n]*{name}[^\n]*\Z"
        with pytest.raises(InputError, match=message):
            pamsim.simulate(rig_with(**differs), short)
        pamsim.simulate(rig_with(**differs, **{"muscle_2:valve.supply_line": 1.0}), short)


def test_muscles_put_on_a_model_are_checked_as_well():
    muscle = rig_with(**LINE).muscles["muscle_1"]
    lower = dataclasses.replace(muscle.valve, supply_pressure=4e5)
    for line, refused in ((0.0, True), (1.0, False)):
        spec = mujoco.MjSpec.from_string(
            """<mujoco><worldbody><body><joint name="j"/><geom size="0.1"/></body></worldbody>
            <tendon><fixed name="a"><joint joint="j" coef="1"/></fixed>
            <fixed name="b"><joint joint="j" coef="-1"/></fixed></tendon></mujoco>"""
        )
        pamsim.attach(spec, tendon="a", muscle=muscle)
        other = dataclasses.replace(lower, supply_line=line)
        pamsim.attach(spec, tendon="b", muscle=dataclasses.replace(muscle, valve=other))
        if refused:
            with pytest.raises(InputError, match="a and b share a supply"):
                pamsim.compile_model(spec)
        else:
            pamsim.compile_model(spec)
