"""Coarse steps, remembered fits: quicker ways to the same diagnosis."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.comparison.trial_residuals import TrialSimulator
from pamsim.diagnosis.method.trial_diagnosis import diagnose_trials
from pamsim.inference.residual_block import ResidualBlock
from tests.unit.diagnosis.toy_arm import (
    BIAS,
    DRY,
    LEAK,
    NOISE,
    NUISANCE,
    TIME,
    recorded,
    regressors,
    simulator,
)

LIBRARY = (DRY, BIAS, LEAK)


def coarse(trials, off):
    """The arm, off by something when it is not simulated in fine steps."""
    exact = simulator(trials)

    def simulate(sets, *, held_out, fine):
        answers = exact.simulate(sets, held_out=held_out, fine=fine)
        if fine:
            return answers
        return [
            [
                ResidualBlock(
                    trial=b.trial,
                    protocol=b.protocol,
                    channel=b.channel,
                    residual=b.residual + off(values) * NOISE[b.channel] * np.sin(3.0 * TIME),
                    sample_interval=b.sample_interval,
                )
                for b in blocks
            ]
            for values, blocks in zip(sets, answers, strict=True)
        ]

    return TrialSimulator(simulate, exact.held_out)


def test_what_coarse_steps_are_off_by_does_not_move_the_result():
    trials = recorded({"dry": 0.06})
    one = diagnose_trials(simulator(trials), NUISANCE, LIBRARY, regressors(trials))
    other = diagnose_trials(coarse(trials, lambda _: 0.8), NUISANCE, LIBRARY, regressors(trials))
    assert other.conclusion.best.names == one.conclusion.best.names == ("dry",)
    for name, value in one.conclusion.best.fit.values.items():
        assert other.conclusion.best.fit.values[name] == pytest.approx(value, rel=2e-3)
    np.testing.assert_allclose(other.base.residual, one.base.residual, atol=2e-4)


def test_the_end_is_fitted_in_fine_steps():
    """An error that grows with the effect biases coarse fits; the result must not show it."""
    trials = recorded({"bias": 0.06})
    one = diagnose_trials(simulator(trials), NUISANCE, (BIAS,), regressors(trials))
    skewed = coarse(trials, lambda values: 4.0 * values.get("bias", 0.0))
    other = diagnose_trials(skewed, NUISANCE, (BIAS,), regressors(trials))
    ends = [d.conclusion.best.fit.values["bias"] for d in (one, other)]
    assert ends[1] == pytest.approx(ends[0], rel=5e-3)
    assert other.conclusion.best.mean_loss == pytest.approx(one.conclusion.best.mean_loss, rel=1e-3)


def test_an_interrupted_diagnosis_goes_on_to_the_same_end():
    trials = recorded({"dry": 0.06, "leak": 0.05})
    steps = []
    whole = diagnose_trials(simulator(trials), NUISANCE, LIBRARY, regressors(trials),
                            progress=lambda *now: steps.append(now))  # fmt: skip
    assert [done for done, _, _ in steps] == list(range(len(steps)))
    assert all(total > done for done, total, _ in steps)
    assert steps[-1][1] == len(steps)  # nothing is left when the last one is done
    fits, calls = {}, []

    def stop(done, total, what):
        calls.append(what)
        if len(calls) == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        diagnose_trials(simulator(trials), NUISANCE, LIBRARY, regressors(trials), remembered=fits,
                 progress=stop)  # fmt: skip
    assert fits
    resumed = diagnose_trials(
        simulator(trials), NUISANCE, LIBRARY, regressors(trials), remembered=fits
    )
    assert resumed.evaluations < whole.evaluations
    # To the bit: fits, what is judged by their Jacobians, and what follows from that.
    assert resumed.conclusion.best.names == whole.conclusion.best.names
    assert resumed.conclusion.best.fit.values == whole.conclusion.best.fit.values
    seen = [[(s.similarity, s.gain) for s in one.screened] for one in (resumed, whole)]
    assert seen[0] == seen[1]
    assert resumed.absent == whole.absent
    again = diagnose_trials(
        simulator(trials), NUISANCE, LIBRARY, regressors(trials), remembered=fits
    )
    assert again.evaluations < 0.7 * whole.evaluations


def test_trials_that_are_held_out_are_not_simulated_while_fitting():
    """Only where a fit ended, at the anchor, and once for what varies from trial to trial."""
    trials = recorded({"dry": 0.06})
    exact = simulator(trials)
    seen = []

    def simulate(sets, *, held_out, fine):
        seen.append((len(sets), held_out))
        return exact.simulate(sets, held_out=held_out, fine=fine)

    diagnose_trials(TrialSimulator(simulate, exact.held_out), NUISANCE, LIBRARY, regressors(trials))
    whole = sum(count for count, held_out in seen if held_out)
    assert whole < 0.35 * sum(count for count, _ in seen)
