"""Every law, every operator and the step of a muscle in Warp, against Python."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.hysteresis.maxwell_slip import ParallelHysteresis
from pamsim.physics.muscle import Muscle
from pamsim.physics.passive import FirstStroke, Softening
from pamsim.physics.record import slot
from tests.unit.gpu.muscle_batch import TIMESTEP, batch, python_results, warp_results
from tests.unit.physics.muscles import KINDS, LOOPS, bellows, make

WORLDS = 12
DOUBLE_ONLY = {"pleated_shape", "arctangent"}
"""What `pamsim.gpu.worlds` refuses in single precision."""


def variants(law: str, loop: str) -> Muscle:
    """A muscle with all effects; every second one with a tube, slow valves that stick, warm air
    and asymmetric hysteresis beside its own."""
    muscle = make(law, loop)
    if (sum(map(ord, law + loop)) % 2) == 0:
        return muscle
    valve = dataclasses.replace(
        muscle.valve, tube_resistance=2e8, tube_volume=2e-6, travel_time=0.02, hysteresis=0.05,
        learned_low=-1.0, learned_high=0.9, learned_2=0.3, learned_5=-0.4, learned_8=0.2,
    )  # fmt: skip
    chain = dataclasses.replace(
        muscle.chain, learned_low=0.1, learned_high=0.3, learned_3=0.1, learned_6=-0.08
    )
    learned = dataclasses.replace(
        muscle.learned, rub_low=0.1, rub_high=0.3, rub_speed=0.02, brakes=1.0, rub_2=4.0, rub_5=7.0
    )
    return dataclasses.replace(
        muscle,
        valve=valve,
        chain=chain,
        learned=learned,
        chamber=dataclasses.replace(muscle.chamber, heat_rate=3.0),
        first_stroke=FirstStroke(force=12.0, travel=0.02),
        softening=Softening(share=0.1, time=0.5),
        parallel_hysteresis=ParallelHysteresis(force=20.0, asymmetry=0.4, dead_zone=0.2),
        command=("pressure_set", "pulse")[len(law) % 2],
    )


MUSCLES = {f"{law}-{loop}": variants(law, loop) for law, loop in KINDS} | {"pushing": bellows()}
IN_SINGLE = [name for name in MUSCLES if not set(name.split("-")) & DOUBLE_ONLY]


def test_every_law_and_operator_is_here():
    assert {law for law, _ in KINDS} | {"effective_area"} == set(FORCE_LAWS)
    assert set(LOOPS) == set(OPERATORS)


@pytest.fixture(scope="module")
def double():
    """Batch, Python's results and Warp's; muscles pull against each other and share a supply."""
    given = batch(list(MUSCLES.values()), WORLDS, "float64", seed=1)
    for i in range(len(MUSCLES) // 2 * 2):
        given.rows[:, i, slot("partner")] = i + 2 if i % 2 == 0 else i
    return given, python_results(given), warp_results(given, "float64")


@pytest.fixture(scope="module")
def single():
    """The same in single precision, as far as it goes."""
    given = batch([MUSCLES[name] for name in IN_SINGLE], WORLDS, "float32", seed=2)
    return given, python_results(given), warp_results(given, "float32")


def same_rates(results, i, relative, rounding, least=0.0):
    """Rates to the rounding of the value that a memory is led to in one step, over the step."""
    given, expected, got = results
    first, count = given.place[i]
    own = slice(first, first + count)
    size = np.maximum(np.abs(given.act[:, own]), least).max(axis=0)
    error = np.abs(got.rates[:, own] - expected.rates[:, own])
    bound = relative * np.abs(expected.rates[:, own]) + rounding * size / TIMESTEP
    return (error <= bound).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", MUSCLES)
def test_double_precision_is_pythons(double, name):
    """To rounding: the formulas are the same, so nothing but the order of sums may differ."""
    i, (_, expected, got) = [*MUSCLES].index(name), double
    assert same_rates(double, i, 1e-9, 1e-13)
    assert got.pressure[:, i] == pytest.approx(expected.pressure[:, i], rel=1e-12)
    assert got.tension[:, i] == pytest.approx(expected.tension[:, i], rel=1e-11)
    assert got.force[:, i] == pytest.approx(expected.force[:, i], rel=1e-6)  # the engine's number
    assert np.ptp(expected.tension[:, i]) > 10.0


@pytest.mark.slow
@pytest.mark.parametrize("name", IN_SINGLE)
def test_single_precision_is_pythons_to_1e_4(single, name):
    """Relative, of pressures, tensions and forces."""
    i, (_, expected, got) = IN_SINGLE.index(name), single
    # What a step adds to a state is known to the rounding of the state, or of the contraction that
    # a memory follows, no better.
    assert same_rates(single, i, 1e-4, 2e-6, least=0.1)
    assert got.pressure[:, i] == pytest.approx(expected.pressure[:, i], rel=1e-4)
    # A tension is a difference of forces of some 100 N.
    assert got.tension[:, i] == pytest.approx(expected.tension[:, i], rel=1e-4, abs=1e-3)
    assert got.force[:, i] == pytest.approx(expected.force[:, i], rel=1e-4, abs=1e-3)
