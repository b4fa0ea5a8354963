"""What to measure next: where tied effects differ, or the signal that divides a link."""

from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.comparison.links import JOINT, MUSCLE, VALVES, Link
from pamsim.diagnosis.by_link.limits import Remainder
from pamsim.diagnosis.by_link.next_experiment import MENU, next_experiment
from tests.unit.diagnosis.by_link.toy_chain import ARM, tried

AIR, REST = Link((VALVES,)), Link((MUSCLE, JOINT))
NOISE = {"pressure_1": 400.0, "angle": 1e-3}


def found(*effects, left=()):
    """A diagnosis with effects, and links in which something is left."""
    remainders = {
        link: Remainder(excess=0.5, p_value=0.001 if link in left else 0.9) for link in (AIR, REST)
    }
    return SimpleNamespace(
        links=(AIR, REST),
        effects=effects,
        unexplained=remainders,
        model=model({}),
        base=model({}),
        whole=None,
    )


def model(values):
    return SimpleNamespace(values=values, sensitivities={}, rows=np.zeros(4))


def rival(effect, values):
    return SimpleNamespace(effect=effect, model=model(values), ties=lambda: True)


@pytest.fixture
def short_menu(monkeypatch):
    monkeypatch.setattr("pamsim.comparison.protocols.DURATION", 1.0)
    for name in set(MENU) - {"shut_hold", "small_reversals"}:
        monkeypatch.delitem(MENU, name)


@pytest.mark.usefixtures("short_menu")
def test_tied_effects_are_separated_where_no_size_of_the_rival_does_the_same():
    leak, delay = tried("air_leak")[0], tried("valve_delay")[0]
    here = {"chamber.leak_conductance": 4e-12}
    one = SimpleNamespace(
        effect=leak, links=frozenset({AIR}), rivals=(rival(delay, {"valve.delay": 0.01}),)
    )
    diagnosis = found(one)
    diagnosis.model.values = here
    chosen = next_experiment(ARM, diagnosis, NOISE, threads=1)
    assert chosen.between == (leak.label, "valve_delay")
    assert set(chosen.menu) == {"shut_hold", "small_reversals"}
    assert chosen.after == chosen.menu[chosen.protocol] == max(chosen.menu.values()) > 1.0
    # A leak of another size is no other effect.
    larger = rival(leak, {"chamber.leak_conductance": 6e-12})
    larger.effect = SimpleNamespace(name="another", label="another", parameters=leak.parameters)
    one.rivals = (larger,)
    assert next_experiment(ARM, diagnosis, NOISE, threads=1).after < 0.02 * chosen.after


def test_what_is_left_is_divided_by_another_signal():
    assert next_experiment(ARM, found(), NOISE) is None
    forces = next_experiment(ARM, found(left=[REST]), NOISE)
    assert forces.protocol is None
    assert forces.advice.startswith("measure the muscles' forces")
    assert next_experiment(ARM, found(left=[AIR]), NOISE).advice.startswith("record valves and air")


def test_forces_that_are_measured_are_not_asked_for():
    one = found(left=[REST])
    one.links = (AIR, REST, Link((MUSCLE,)))
    one.unexplained[one.links[-1]] = one.unexplained[AIR]
    assert next_experiment(ARM, one, NOISE).advice.startswith("record muscle and joint")


@pytest.mark.usefixtures("short_menu")
def test_what_a_proposed_trial_does_not_measure_makes_it_no_worse():
    leak, delay = tried("air_leak")[0], tried("valve_delay")[0]
    diagnosis = found(SimpleNamespace(effect=leak, rivals=(rival(delay, {"valve.delay": 0.01}),)))
    diagnosis.model.values = {"chamber.leak_conductance": 4e-12}
    torque = {"torque": 0.05}  # of a joint that a machine moved
    chosen = next_experiment(ARM, diagnosis, NOISE, threads=1)
    assert next_experiment(ARM, diagnosis, {**NOISE, **torque}, threads=1) == chosen
    alone = next_experiment(ARM, diagnosis, torque, threads=1)
    assert (alone.protocol, alone.menu) == (None, {})
