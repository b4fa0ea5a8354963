"""What opens a loop is distinguished from what does not; noise is not taken for a loop."""

import numpy as np
import pytest

from pamsim.comparison.loop_simulator import (
    LOOP_EFFECTS,
    Loop,
    LoopRows,
    bouc_wen_signal,
    drift_signal,
    lag_signal,
    maxwell_slip_signal,
    rate_signal,
    stop_signal,
)
from pamsim.core.errors import InputError
from pamsim.diagnosis.by_link.diagnose_rest import diagnose_rest

LEVELS = np.linspace(0.0, 5e5, 21)
PATH = np.concatenate([LEVELS, LEVELS[::-1]])
SCALED = PATH / PATH.max()
RISING = np.arange(PATH.size) < LEVELS.size
AT_REST = [own for own in LOOP_EFFECTS if not own.moving]


def loop(signal=None, *, size=4e-3, noise=3e-4, seed=0, error=None):
    """A bent reversible curve and what opens it [m]."""
    curve = 0.3 - 0.06 * np.arctan(4.0 * SCALED - 1.5)
    opened = 0.0 if signal is None else size * signal
    off = noise * np.random.default_rng(seed).standard_normal(PATH.size)
    return Loop(pressure=PATH, length=curve + opened + off, rising=RISING, error=error)


def diagnosed(made, effects=AT_REST):
    rows = LoopRows(made, effects)
    return diagnose_rest(lambda variance, _: rows.simulator(variance), rows.candidates, ())


def levels(found):
    return {one.effect.name: one.level() for one in found.effects}


def opening(signal):
    return max(signal[:21] - signal[:20:-1], key=abs)


@pytest.mark.parametrize(
    "signal",
    [stop_signal(SCALED, 0.1), maxwell_slip_signal(SCALED, 0.3), bouc_wen_signal(SCALED, 0.1)],
    ids=["stop", "maxwell_slip", "bouc_wen"],
)
def test_hysteresis_is_named_and_sized_whichever_operator_made_it(signal):
    found = diagnosed(loop(signal))
    assert levels(found) in ({"muscle_hysteresis": "name"}, {"muscle_hysteresis": "form"})
    first = found.effects[0].effect.parameters[0].name
    low, high = found.sizes[first].interval95
    assert low < 4e-3 * opening(signal) < high
    assert np.std(found.errors_after) < 0.35 * np.std(found.errors_before)


def test_a_drift_is_named_a_drift_and_not_hysteresis():
    found = diagnosed(loop(drift_signal(SCALED, 0.0), size=2e-3))
    assert levels(found) == {"drift": "form"}


def test_a_loop_that_turns_over_at_once_may_be_that_of_a_rate_or_of_hysteresis():
    found = diagnosed(loop(rate_signal(SCALED, 0.0)), LOOP_EFFECTS)
    (one,) = found.effects
    ties = {one.effect.name} | {r.effect.name for r in one.rivals if r.ties()}
    assert "viscous_friction" in ties


@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_creep_is_never_called_hysteresis_with_certainty(seed):
    found = diagnosed(loop(lag_signal(SCALED, 4.0), size=8e-3, seed=seed))
    for one in found.effects:
        assert one.effect.name == "viscoelastic_creep" or not one.certain()["family"]


def test_no_loop_names_nothing():
    assert sum(bool(diagnosed(loop(seed=seed)).effects) for seed in range(10)) <= 1


def test_a_truth_outside_the_library_is_not_named():
    ripple = np.where(RISING, 1.0, -1.0) * np.sin(40.0 * SCALED)
    assert not diagnosed(loop(ripple)).effects


def test_a_loop_that_no_formula_explains_leaves_something():
    found = diagnosed(loop(drift_signal(SCALED, 0.0), size=2e-3), AT_REST[:1])
    assert all(not one.exact for one in found.effects)
    (left,) = found.remainders.values()
    assert left.p_value < 0.05


def test_known_errors_weigh_the_readings():
    """A reading that three runs scatter on must not make or break a loop."""
    made = loop(stop_signal(SCALED, 0.1), size=1e-3)
    spoilt = made.length.copy()
    spoilt[3] += 0.05
    error = np.full(PATH.size, 3e-4)
    error[3] = 0.05
    weighed = Loop(pressure=PATH, length=spoilt, rising=RISING, error=error)
    assert set(levels(diagnosed(weighed))) == {"muscle_hysteresis"}
    assert not diagnosed(Loop(pressure=PATH, length=spoilt, rising=RISING)).effects


def test_a_reversible_curve_alone_errs_by_the_difference_of_the_branches():
    made = loop()
    rows = LoopRows(made, AT_REST)
    found = diagnosed(made)
    assert found.effects == ()
    assert found.errors_before == pytest.approx(-rows.apart)
    assert rows.branches[0] == pytest.approx(made.length[:21])
    assert rows.branches[1] == pytest.approx(made.length[:20:-1])


def test_the_error_of_a_difference_is_that_of_both_branches_and_falls_with_repeats():
    made, error = loop(), np.full(PATH.size, 3e-4)
    once = Loop(pressure=PATH, length=made.length, rising=RISING, error=error)
    assert LoopRows(once, ()).error == pytest.approx(np.sqrt(2.0) * 3e-4)
    four = Loop(
        pressure=np.tile(PATH, 4),
        length=np.tile(made.length, 4),
        rising=np.tile(RISING, 4),
        error=np.tile(error, 4),
    )
    assert LoopRows(four, ()).error == pytest.approx(np.sqrt(0.5) * 3e-4)


def test_hysteresis_signals_close_at_both_ends_and_rise_before_they_fall():
    for signal in (stop_signal, maxwell_slip_signal, bouc_wen_signal):
        along = signal(SCALED, 0.1)
        apart = along[:21] - along[:20:-1]
        assert np.max(np.abs(along)) <= 1.0 + 1e-9
        assert abs(apart[-1]) < 1e-9
        assert abs(apart[0]) < 0.05
        assert np.all(apart[3:-3] > 0.5)


def test_levels_read_once_only_are_refused():
    one_way = Loop(pressure=LEVELS, length=LEVELS * 1e-7, rising=np.ones(21, dtype=bool))
    with pytest.raises(InputError, match="no pressure was read on both branches"):
        diagnosed(one_way)
