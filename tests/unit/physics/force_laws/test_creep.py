"""The Maxwell element beside a muscle: what it holds, how it lets go, what a cycle costs."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pamsim.physics.passive import Creep, creep_rate
from pamsim.physics.record import pack
from tests.unit.physics.flat import CREEP, CREEP_2, contraction, kernel
from tests.unit.physics.muscles import LASTING, PLAIN_VALVE, RELAXED, RELAXED_2, charged, make

STIFFNESS, TAU = 2500.0, 0.7
TWO = Creep(stiffness=700.0, relaxation_time=0.3, stiffness_2=900.0, relaxation_time_2=2.0)


def follow(contractions: np.ndarray, timestep: float, relaxed: float = 0.0) -> np.ndarray:
    forces = []
    for kappa in contractions.tolist():
        forces.append(STIFFNESS * (kappa - relaxed))
        relaxed += timestep * creep_rate(kappa, relaxed, TAU, timestep)
    return np.array(forces)


@pytest.mark.parametrize("timestep", [1e-4, 0.01, 0.5, 5.0])
def test_a_held_contraction_relaxes_exactly_at_any_time_step(timestep):
    """Standard linear solid: k kappa exp(-t / tau), also where the step is longer than tau."""
    forces = follow(np.full(40, 0.08), timestep)
    assert forces == pytest.approx(
        STIFFNESS * 0.08 * np.exp(-timestep * np.arange(40) / TAU), rel=1e-9, abs=1e-12
    )


def test_two_elements_let_go_each_in_its_own_time():
    """The kernel holds k exp(-t / tau) of both, to the bit nothing of one without stiffness."""
    muscle = dataclasses.replace(make(**LASTING, valve=PLAIN_VALVE), creep=TWO)
    row, timestep = pack(muscle).tolist(), 0.05
    act = charged(muscle, 0.2, 3e5)
    plain = pack(dataclasses.replace(muscle, creep=Creep())).tolist()
    kappa = contraction(row, 0.2)
    for k in range(60):
        held = kernel.tension(plain, act, 0.2) - kernel.tension(row, act, 0.2)
        first = TWO.stiffness * (kappa - RELAXED) * math.exp(-k * timestep / TWO.relaxation_time)
        time, start = TWO.relaxation_time_2, kappa - RELAXED_2
        second = TWO.stiffness_2 * start * math.exp(-k * timestep / time)
        assert held == pytest.approx(first + second, rel=1e-9)
        out = [0.0] * len(act)
        kernel.state_rates(row, act, out, 0.2, 0.0, 0.0, 0.0, timestep)
        act = [
            state + timestep * rate if -i in (CREEP, CREEP_2) else state
            for i, (state, rate) in enumerate(zip(act, out, strict=True), start=-len(act))
        ]


@pytest.mark.parametrize("kappa", [-0.05, 0.0, 0.2])
def test_relaxed_it_is_free_at_any_contraction(kappa):
    assert creep_rate(kappa, kappa, TAU, 1e-3) == 0.0


@pytest.mark.parametrize("omega", [0.2, 1.0 / TAU, 20.0])
def test_a_cycle_costs_what_the_damper_takes(omega):
    """Loss per cycle pi k A^2 w tau / (1 + (w tau)^2), largest at w = 1 / tau, none at the ends."""
    steps, amplitude = 20000, 0.05
    timestep = 2.0 * math.pi / omega / steps
    rounds = max(2, math.ceil(8.0 * TAU * omega / (2.0 * math.pi)) + 1)  # the start is forgotten
    kappa = amplitude * np.sin(2.0 * math.pi * np.arange(rounds * steps + 1) / steps)
    forces = follow(kappa, timestep)
    last = slice(-steps - 1, None)
    work = float(np.trapezoid(forces[last], kappa[last]))
    turn = omega * TAU
    lost = math.pi * STIFFNESS * amplitude**2 * turn / (1.0 + turn**2)
    assert work == pytest.approx(lost, rel=2e-3)
