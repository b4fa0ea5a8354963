"""A polished fit is at the bottom, wherever it began and however the valley bends."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.comparison.noise_floor import noise_floor
from pamsim.comparison.trial_residuals import TrialSimulator
from pamsim.diagnosis.method.polish import polish
from pamsim.diagnosis.method.refit import Fitter
from pamsim.inference.free_parameter import FreeParameter
from pamsim.inference.residual_block import ResidualBlock

COUNT, REPEATS = 200, 4
TIME = np.linspace(0.0, 1.0, COUNT)
BENT = tuple(
    FreeParameter(name=name, unit="1", start=0.5, low=0.0, high=2.0) for name in ("a", "b")
)
TRUE = {"a": 1.6, "b": 1.3}
TAKEN = ({"a": 0.4, "b": 0.4}, {"a": 1.9, "b": 0.3}, {"a": 0.3, "b": 1.9})


def signal(values):
    """The data show the product well and what sets its factors apart badly: a bent valley."""
    a, b = values["a"], values["b"]
    return 40.0 * a * b * TIME + (a - b**2) * np.sin(9.0 * TIME)


def bent_valley(noise, seed=0):
    rng = np.random.default_rng(seed)
    measured = [signal(TRUE) + noise * rng.standard_normal(COUNT) for _ in range(REPEATS)]

    def simulate(sets, *, held_out, fine):
        return [
            [
                ResidualBlock(
                    trial=f"{i}", protocol="one", channel="angle", residual=signal(values) - y
                )
                for i, y in enumerate(measured)
                if held_out or i < REPEATS - 1
            ]
            for values in sets
        ]

    simulator = TrialSimulator(simulate=simulate, held_out=frozenset({f"{REPEATS - 1}"}))
    first = simulator.anchor({p.name: p.start for p in BENT})
    return Fitter(simulator, noise_floor(simulator.layout, first))


@pytest.mark.parametrize("start", TAKEN)
def test_the_bottom_of_a_bent_valley_is_reached(start):
    fitter = bent_valley(0.5)
    rough = fitter.fit(BENT, [start], most=3)
    found = polish(fitter, rough)
    gradient = found.jacobian.T @ fitter.weighted(found.residual)
    assert found.cost <= rough.cost
    assert found.cost == pytest.approx(
        min(polish(fitter, fitter.fit(BENT, [s])).cost for s in TAKEN), rel=1e-4
    )
    assert np.abs(gradient).max() < 2e-2 * np.linalg.norm(found.jacobian, axis=0).max()
    for name, value in TRUE.items():
        assert found.values[name] == pytest.approx(value, abs=0.1)


def test_a_fit_at_the_bottom_stays_where_it_is():
    fitter = bent_valley(0.5)
    once = polish(fitter, fitter.fit(BENT, [TRUE]))
    again = polish(fitter, once)
    for name in TRUE:
        assert again.values[name] == pytest.approx(once.values[name], abs=2e-3)


def test_a_simulation_that_breaks_down_leaves_the_fit_as_it_is():
    fitter = bent_valley(0.5)
    found = fitter.fit(BENT, [TRUE])
    fitter.simulator.simulate = lambda sets, **_: [None] * len(sets)
    assert polish(fitter, found) is found
