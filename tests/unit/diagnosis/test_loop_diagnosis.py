"""What opens a loop is distinguished from what does not; noise is not taken for a loop."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.diagnosis.method.loop_diagnosis import diagnose_loop
from pamsim.diagnosis.method.loop_effects import (
    LOOP_EFFECTS,
    bouc_wen_signal,
    drift_signal,
    lag_signal,
    maxwell_slip_signal,
    rate_signal,
    stop_signal,
)
from pamsim.diagnosis.method.loop_fit import Loop, LoopFitter
from pamsim.diagnosis.method.verdict import Verdict

LEVELS = np.linspace(0.0, 5e5, 21)
PATH = np.concatenate([LEVELS, LEVELS[::-1]])
SCALED = PATH / PATH.max()
RISING = np.arange(PATH.size) < LEVELS.size


def loop(signal=None, *, size=4e-3, noise=3e-4, seed=0, error=None):
    """A bent reversible curve and what opens it [m]."""
    curve = 0.3 - 0.06 * np.arctan(4.0 * SCALED - 1.5)
    opened = 0.0 if signal is None else size * signal
    off = noise * np.random.default_rng(seed).standard_normal(PATH.size)
    return Loop(input=PATH, output=curve + opened + off, rising=RISING, error=error)


@pytest.mark.parametrize(
    "signal",
    [stop_signal(SCALED, 0.1), maxwell_slip_signal(SCALED, 0.3), bouc_wen_signal(SCALED, 0.1)],
    ids=["stop", "maxwell_slip", "bouc_wen"],
)
def test_hysteresis_is_named_whichever_operator_made_it(signal):
    found = diagnose_loop(loop(signal))
    assert found.verdict is Verdict.NAMED
    assert found.best.effect.name == "muscle_hysteresis"
    assert all(m.effect.name == "muscle_hysteresis" for m in found.tied)
    assert found.p_value < 0.01
    low, high = found.best.interval95
    assert low < 4e-3 * np.max(np.abs(signal[:21] - signal[:20:-1])) < high
    assert found.best.unseen_rms < 0.35 * found.base.unseen_rms
    assert found.best.rms < 0.5 * found.base.rms


def test_a_drift_is_not_called_hysteresis():
    found = diagnose_loop(loop(drift_signal(SCALED, 0.0), size=2e-3))
    assert found.verdict is Verdict.NAMED
    assert found.best.effect.name == "drift"


@pytest.mark.parametrize(
    ("signal", "family"),
    [
        (rate_signal(SCALED, 0.0), "viscous_friction"),
        (lag_signal(SCALED, 4.0), "viscoelastic_creep"),
    ],
    ids=["viscous", "creep"],
)
def test_what_hangs_on_the_rate_is_never_called_hysteresis_with_certainty(signal, family):
    """At one rate, a loop that turns over at once is that of a constant resistance."""
    found = diagnose_loop(loop(signal, size=4e-3))
    assert family in {found.best.effect.name} | {m.effect.name for m in found.tied}


def test_no_loop_names_nothing():
    named = [diagnose_loop(loop(seed=s)).best is not None for s in range(10)]
    assert sum(named) <= 1


def test_a_truth_outside_the_library_is_not_named():
    ripple = np.where(RISING, 1.0, -1.0) * np.sin(40.0 * SCALED)
    found = diagnose_loop(loop(ripple))
    assert found.best is None
    without = [c for c in LOOP_EFFECTS if c.name != "viscous_friction"]
    found = diagnose_loop(loop(rate_signal(SCALED, 0.0), size=2e-3), without)
    assert found.verdict is not Verdict.NAMED or found.best.effect.name == "muscle_hysteresis"


def test_known_errors_weigh_the_readings():
    """A reading that three runs scatter on must not make or break a loop."""
    made = loop(stop_signal(SCALED, 0.1), size=1e-3)
    spoilt = made.output.copy()
    spoilt[3] += 0.05
    error = np.full(PATH.size, 3e-4)
    error[3] = 0.05
    found = diagnose_loop(Loop(input=PATH, output=spoilt, rising=RISING, error=error))
    assert found.best.effect.name == "muscle_hysteresis"
    assert found.floor == pytest.approx(np.sqrt(np.mean(error**2)))
    assert diagnose_loop(Loop(input=PATH, output=spoilt, rising=RISING)).best is None


def test_a_reversible_curve_alone_errs_by_the_difference_of_the_branches():
    found = diagnose_loop(loop(stop_signal(SCALED, 0.1)))
    assert found.base.unseen_rms == pytest.approx(np.sqrt(np.mean(found.difference**2)))
    assert found.base.rms == pytest.approx(found.base.unseen_rms / 2.0)


def test_branches_are_those_of_the_readings_of_the_curve_and_of_the_nearest_model():
    made = loop(stop_signal(SCALED, 0.1))
    found = diagnose_loop(made)
    assert found.measured[0] == pytest.approx(made.output[:21])
    assert found.reversible == pytest.approx(found.measured.mean(axis=0))
    assert found.nearest is found.best
    assert np.sqrt(np.mean((found.fitted - found.measured) ** 2)) == pytest.approx(found.best.rms)
    assert max(found.fitted[0] - found.fitted[1], key=abs) == pytest.approx(found.best.opening)
    assert found.error is None


def test_the_error_of_a_difference_is_that_of_both_branches_and_falls_with_repeats():
    made, error = loop(), np.full(PATH.size, 3e-4)
    once = Loop(input=PATH, output=made.output, rising=RISING, error=error)
    assert diagnose_loop(once).error == pytest.approx(np.sqrt(2.0) * 3e-4)
    four = Loop(
        input=np.tile(PATH, 4),
        output=np.tile(made.output, 4),
        rising=np.tile(RISING, 4),
        error=np.tile(error, 4),
    )
    assert LoopFitter(four, (), 0).difference_error() == pytest.approx(np.sqrt(0.5) * 3e-4)


def test_hysteresis_signals_close_at_both_ends_and_rise_before_they_fall():
    for signal in (stop_signal, maxwell_slip_signal, bouc_wen_signal):
        along = signal(SCALED, 0.1)
        apart = along[:21] - along[:20:-1]
        assert np.max(np.abs(along)) <= 1.0 + 1e-9
        assert abs(apart[-1]) < 1e-9
        assert abs(apart[0]) < 0.05
        assert np.all(apart[3:-3] > 0.5)


def test_levels_read_once_only_are_refused():
    one_way = Loop(input=LEVELS, output=LEVELS * 1e-7, rising=np.ones(21, dtype=bool))
    with pytest.raises(InputError, match="0 levels were read on both branches"):
        diagnose_loop(one_way)
