"""Rules by which a fit is trusted: each objects from its stated number on, not before."""

from dataclasses import replace

import numpy as np
import pytest

from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.discrete import DiscreteStructure
from pamsim.identification.status import FitStatus, judged
from tests.unit.identification.planted import fit_continuous, record

GIVEN = record(1, noise=0.02)
DURATION, TS = GIVEN.duration, GIVEN.sample_time
FIT = fit_continuous([GIVEN], order=1)
T, WN, ZETA, FEW = np.log(0.3), np.log(6.0), np.log(0.3), 0.01
THREE = np.log(3.0) / 2.0  # standard error of a logarithm that is known to a factor of 3
LAG, RATE = ContinuousStructure(1), ContinuousStructure(0, start="free", integrators=1)
PAIR, PAIRS = (ContinuousStructure(n, real_lags=False) for n in (2, 4))
OPEN = ContinuousStructure(1, 1, start="free", integrators=1)
LATE = ContinuousStructure(0, dead_time=True)

# Structure; coordinates and standard errors where one of them is at its number if f is 1, and
# beyond if it is larger; what the rule says. All coordinates are correlated by a half.
RULES = [
    (LAG, lambda f: ([np.log(TS / f), 2.0], [FEW] * 2), "one sample"),
    (PAIR, lambda f: ([np.log(f * np.pi / TS), ZETA, 2.0], [FEW] * 3), "one sample"),
    (LAG, lambda f: ([np.log(100.0 * DURATION * f) - 1e-3, 2.0], [FEW] * 2), "a hundred records"),
    (LAG, lambda f: ([T, 2.0], [f * THREE, FEW]), "T = 0.3 s is known to no better"),
    (PAIR, lambda f: ([WN, ZETA, 2.0], [FEW, f * THREE, FEW]), "zeta = 0.3 is known to no better"),
    (LAG, lambda f: ([T, -2.0], [FEW, f * 1.0]), "explains nothing"),
    # Wald's test of two coefficients.
    (
        ContinuousStructure(1, 1),
        lambda f: ([T, 2.0, 0.0], [FEW, *[f * np.sqrt(2.0 / 3.0)] * 2]),
        "explains nothing",
    ),
    (ContinuousStructure(2), lambda f: ([T, T - 0.4 / f, 2.0], [0.1, 0.1, FEW]), "merge"),
    (ContinuousStructure(2), lambda f: ([T, T - 1e-6 / f, 2.0], [1e-9] * 3), "merge"),
    (PAIR, lambda f: ([WN, np.log(0.01), 2.0], [FEW, f * THREE, FEW]), "longer than the records"),
    (
        PAIRS,
        lambda f: (
            [WN + 1.0, ZETA, WN, np.log(1.0 / (6.0 * DURATION * f)), 2.0],
            [FEW] * 3 + [2.0, FEW],
        ),
        "longer than the records",
    ),
    (RATE, lambda f: ([2.0, 0.1], [f * 1.0, FEW]), "a zero cancels an integrator"),
    (OPEN, lambda f: ([T, 2.0, -2.0 * DURATION * f, 0.1], [FEW] * 4), "a zero slower than"),
    # 0.05 / 600 is the probability, on two sides, of 3.9346 standard errors.
    (LATE, lambda f: ([0.1, -2.0], [FEW, f * 2.0 / 3.9346]), "the best of 600 dead times"),
    (DiscreteStructure("arx", 1, 1, 1, TS), lambda f: ([-f, 2.0], [FEW] * 2), "the unit circle"),
]


@pytest.mark.parametrize(("structure", "at", "sentence"), RULES)
def test_a_rule_objects_from_its_number_on(structure, at, sentence):
    for factor, objects in ((0.97, False), (1.03, True)):
        x, errors = at(factor)
        correlation = 0.5 * (1.0 + np.eye(len(x)))
        fit = replace(
            FIT,
            structure=structure,
            coordinates=np.array(x),
            covariance=np.outer(errors, errors) * correlation,
            quantile=2.0,
        )
        found = judged(fit, [GIVEN], {}, white=False)
        assert (sentence in found.sentence) is objects, found.sentence
        assert found.status is not FitStatus.CONVERGED or not objects


def test_a_note_begins_at_its_number():
    trial = FIT.trials[0]
    for change, white, note in (
        (lambda f: {"trials": (replace(trial, residual_lag1=0.5 * f),)}, True, "are correlated"),
        (lambda f: {"fit_percent_one_step": FIT.fit_percent + 5.0 * f}, False, "points worse"),
    ):
        for factor, expected in ((0.99, False), (1.01, True)):
            found = judged(replace(FIT, **change(factor)), [GIVEN], {}, white=white)
            assert found.status is FitStatus.CONVERGED
            assert (note in found.sentence) is expected
