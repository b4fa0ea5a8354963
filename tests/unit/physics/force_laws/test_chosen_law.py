"""What a muscle's record names: the law's force with its volume and work, and the operator."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.core.errors import EngineError
from pamsim.physics.chosen_law import (
    law_derivatives,
    law_force,
    law_functions,
    law_pushes,
    law_volume,
    law_volume_varies,
    law_work,
    operator_energy,
    operator_functions,
    operator_output,
    operator_rates,
)
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.record import parameters
from tests.unit.physics.muscles import FORCES, LOOPS, bellows, make

MUSCLES = {law: make(law) for law in FORCES} | {"effective_area": bellows()}
PLACES = (0.06, 0.1, 0.16)


def assert_force_volume_and_work_agree(m, pressure):
    """Work is the integral of the force, volume that of its slope; both by `law_derivatives`."""
    near, step = 1e-5, 50.0

    def rise(function, at, by):
        return (function(at + by) - function(at - by)) / (2.0 * by)

    def work_at(kappa):
        return law_work(m, pressure, kappa, law_volume(m, pressure, kappa))

    for kappa in PLACES:
        force, rising, per_pressure, gained, work = law_derivatives(m, pressure, kappa)
        assert force == pytest.approx(law_force(m, pressure, kappa), rel=1e-12)
        assert gained == pytest.approx(law_volume(m, pressure, kappa), rel=1e-12)
        assert work == pytest.approx(work_at(kappa), rel=1e-12)
        assert rise(work_at, kappa, near) == pytest.approx(force, rel=1e-4)
        slope = rise(lambda p, k=kappa: law_force(m, p, k), pressure, step)
        assert per_pressure == pytest.approx(slope, rel=1e-3)
        assert rise(lambda k: law_volume(m, pressure, k), kappa, near) == pytest.approx(
            slope, rel=1e-4
        )
        steeper = rise(lambda k: law_force(m, pressure, k), kappa, near)
        assert rising == pytest.approx(steeper, rel=1e-3)


@pytest.mark.parametrize("law", MUSCLES)
def test_every_law_is_given_its_own_numbers_and_its_volume_and_work_belong_to_its_force(law):
    """Each by its name from the muscle's record, in whose row another law has other places."""
    muscle, card, m = MUSCLES[law], FORCE_LAWS[law], parameters(MUSCLES[law])
    length = muscle.braid or muscle.stroke
    rest = [*dataclasses.astuple(muscle.force)[1:]]
    rest += [getattr(length, name) for name in card.braid_fields]
    for kappa in PLACES:
        assert law_force(m, 3e5, kappa) == card.force_function(3e5, kappa, *rest)
    assert law_pushes(m) is card.pushes
    assert law_volume_varies(m) is card.volume_varies
    for pressure in (2.5e5, 4.5e5):
        assert_force_volume_and_work_agree(m, pressure)


def test_a_function_of_a_law_takes_all_numbers_in_order_or_some_by_their_names():
    card = FORCE_LAWS["effective_area"]
    assert card.numbers == ("pressure", "contraction", "area", "stiffness", "nominal_length")
    assert card.taken_by(lambda area, contraction: 0.0) == ("area", "contraction")
    for every in (lambda p, k, a, c, s: 0.0, lambda p, *rest: 0.0, card.force_function):
        assert card.taken_by(every) == card.numbers


def test_the_operator_of_a_muscle_is_given_its_own_numbers():
    for loop, group in LOOPS.items():
        m, card, count = parameters(make(loop=loop)), OPERATORS[loop], group.state_count
        z = [0.0] * count
        for x, x_rate in ((0.03, 0.4), (0.01, -0.2), (0.02, 0.1)):
            assert operator_output(m, z, x) == card.output(group, z, x), loop
            assert operator_energy(m, z, x) == card.energy(group, z, x), loop
            found, wanted = [7.0] * count, [0.0] * count
            operator_rates(m, z, found, x, x_rate, 1e-3)
            card.rates(group, z, wanted, x, x_rate, 1e-3)
            assert found == wanted, loop
            z = (np.array(z) + 1e-3 * np.array(found)).tolist()
        assert any(z)
    m, dz = parameters(make()), [7.0]  # without an operator there is no output, nothing moves
    assert math.isnan(operator_output(m, [0.0], 0.1))
    assert math.isnan(operator_energy(m, [0.0], 0.1))
    operator_rates(m, [0.0], dz, 0.1, 0.1, 1e-3)
    assert dz == [7.0]


@pytest.mark.parametrize("code", [99.0, 0.5, math.nan])
def test_a_code_that_stands_for_no_law_is_refused(code):
    m = SimpleNamespace(force=SimpleNamespace(law=code), hysteresis=SimpleNamespace(law=code))
    for asked in (
        lambda: law_functions(code),
        lambda: operator_functions(code),
        lambda: law_force(m, 1e5, 0.1),
        lambda: operator_output(m, [0.0], 0.1),
    ):
        with pytest.raises(EngineError, match="stands for no law"):
            asked()
