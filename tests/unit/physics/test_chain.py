"""The chain in series: what it holds at rest, what it passes on, what a cycle costs."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from pamsim.physics.chain import Chain, extension_rate
from pamsim.physics.muscle import Muscle
from pamsim.physics.record import pack
from tests.unit.physics.flat import gauge_pressure, kernel, length_at_muscle
from tests.unit.physics.muscles import LASTING, LOOPS, charged, make

COMPLIANCE, RELAXATION = 3e-6, 0.02
SOFT = Chain(compliance=COMPLIANCE, relaxation_time=RELAXATION)
STATES = [(0.185, 2e5), (0.19, 4e5), (0.21, 0.0), (0.205, 1e5)]
"""Tendon length [m] and gauge pressure [Pa]; the last two stretch the muscle beyond slack."""


def on_chain(chain: Chain, loop: str = "none") -> Muscle:
    return make("six_parameter", loop, **(LASTING | {"chain": chain}))


def follow(
    muscle: Muscle, act: list[float], lengths: NDArray[np.float64], timestep: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Tension and extension along a path of the tendon with the valves shut, by explicit Euler.

    Each operator and the chain take their rates at the present length, as in the engine.
    """
    row, count = pack(muscle).tolist(), len(act)
    tensions, extensions = [], []
    out = [0.0] * count
    velocities = np.diff(lengths, append=lengths[-1]) / timestep
    for length, velocity in zip(lengths.tolist(), velocities.tolist(), strict=True):
        tensions.append(kernel.tension(row, act, length))
        extensions.append(act[-2])
        kernel.state_rates(row, act, out, length, velocity, 0.0, 0.0, timestep)
        for i in range(count):
            act[i] += timestep * out[i]
    return np.array(tensions), np.array(extensions)


@pytest.mark.parametrize("tension", [0.0, 40.0, 900.0])
@pytest.mark.parametrize("start", [-1e-3, 0.0, 4e-3])
def test_under_a_held_tension_the_extension_closes_in_with_its_time_constant(tension, start):
    """x - C T decays with exp(-t / tau), so its rate is -1 / tau of it; none at x = C T."""
    apart = start - COMPLIANCE * tension
    rate = extension_rate(SOFT, start, tension)
    assert rate == pytest.approx(-apart / RELAXATION, rel=1e-12)
    assert extension_rate(SOFT, COMPLIANCE * tension, tension) == 0.0


@pytest.mark.parametrize("tension", [1.0, 300.0, 5e3])
def test_a_hardening_chain_gives_per_tension_what_its_law_says(tension):
    """dx/dT = C / (1 + h T) of the extension at which the rate is zero."""
    hard = dataclasses.replace(SOFT, hardening=2e-3)

    def resting(at):
        return float(brentq(lambda x: extension_rate(hard, x, at), -1.0, 1.0, xtol=1e-15))

    step = 1e-3 * tension
    slope = (resting(tension + step) - resting(tension - step)) / (2.0 * step)
    assert slope == pytest.approx(COMPLIANCE / (1.0 + 2e-3 * tension), rel=1e-5)


@pytest.mark.parametrize("loop", ["none", *LOOPS])
@pytest.mark.parametrize(("tendon", "pressure"), STATES)
def test_it_passes_on_the_tension_of_the_muscle_at_its_own_length(loop, tendon, pressure):
    """It has no mass: with the same air and memory a rigid one, so much shorter, pulls the same."""
    muscle = on_chain(SOFT, loop)
    rigid = dataclasses.replace(muscle, chain=Chain())
    act = charged(muscle, tendon, pressure)
    own = tendon - act[-2]
    assert kernel.tension(pack(muscle), act, tendon) == kernel.tension(pack(rigid), act, own)
    assert gauge_pressure(pack(muscle), act, tendon) == pytest.approx(pressure, abs=1e-6)


@pytest.mark.parametrize("relaxation", [4e-3, 0.02, 0.1])
@pytest.mark.parametrize(("tendon", "pressure"), STATES)
def test_at_rest_the_tension_balances_whatever_the_time_constant(tendon, pressure, relaxation):
    """T = F(l - C T) at the pressure that the shut chamber has there, by scipy's root finder."""
    muscle = on_chain(Chain(compliance=COMPLIANCE, relaxation_time=relaxation))
    row, rigid = pack(muscle), pack(dataclasses.replace(muscle, chain=Chain()))
    act = charged(muscle, tendon, pressure)

    def short(tension: float) -> float:
        return kernel.tension(rigid, [0.0, act[-1]], tendon - COMPLIANCE * tension) - tension

    balanced = brentq(short, 0.0, kernel.tension(rigid, [0.0, act[-1]], tendon), xtol=1e-12)
    steps = round(25.0 * relaxation / 5e-4)
    tensions, extensions = follow(muscle, act, np.full(steps, tendon), 5e-4)
    assert balanced > 10.0
    assert tensions[-1] == pytest.approx(balanced, rel=1e-9)
    assert extensions[-1] == pytest.approx(COMPLIANCE * balanced, rel=1e-9)
    assert length_at_muscle(row, act, tendon) == tendon - act[-2]


def cycle(muscle: Muscle, period: float, steps: int) -> tuple[float, float, float]:
    """Second cycle on shut valves: work put in, work lost in the chain [J], swing [N]."""
    phase = 2.0 * math.pi * np.arange(2 * steps + 1) / steps
    lengths = 0.19 + 0.012 * np.sin(phase)
    act = charged(muscle, float(lengths[0]), 2e5, 0.0)
    timestep = period / steps
    tensions, extensions = follow(muscle, act, lengths, timestep)
    last = slice(steps, None)
    speed = np.gradient(extensions[last], timestep)
    work = float(np.trapezoid(tensions[last], lengths[last]))
    chain = muscle.chain
    lost = chain.relaxation_time / chain.compliance * float(np.trapezoid(speed**2, dx=timestep))
    return work, lost, float(np.ptp(tensions[last]))


@pytest.mark.parametrize("period", [0.1, 1.0, 10.0])
def test_work_of_a_closed_cycle_is_what_the_damper_in_the_chain_takes(period):
    """Muscle and air give back all they take; the damper tau / C takes its v^2 over time."""
    work, lost, swing = cycle(on_chain(SOFT), period, 2500)
    assert swing > 100.0
    assert lost > 0.0
    assert work == pytest.approx(lost, rel=1e-3)


def test_a_slow_cycle_costs_less_in_proportion_and_nothing_in_the_end():
    slow, slower = (cycle(on_chain(SOFT), period, 2500)[0] for period in (4.0, 8.0))
    assert slower > 0.0
    assert slow / slower == pytest.approx(2.0, rel=0.02)


@pytest.mark.parametrize("loop", LOOPS)
@pytest.mark.parametrize("period", [0.2, 5.0])
def test_with_an_operator_a_cycle_costs_work_as_well(loop, period):
    """The operator's loop comes on top of what the chain takes: ten times the error of the sum."""
    work, lost, _ = cycle(on_chain(SOFT, loop), period, 2000)
    assert work > 1.005 * lost > 0.0
