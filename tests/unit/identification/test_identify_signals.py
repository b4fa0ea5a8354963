"""From trials to one input and one output: expressions, units, rest, clocks, operating points."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from pamsim.identification.local_models import fit_operating_points
from pamsim.identification.signals import (
    SignalTable,
    Unit,
    default_input,
    default_output,
    signal,
    table_of,
    used_trial,
)
from pamsim.recordings.trial import Trial
from tests.unit.core.refusals import all_refused
from tests.unit.identification.planted import fit_continuous, refuses, sampled

N = 100
TIME = np.arange(N) / 100.0


def trial(drive="pressure_set", **changes):
    step = np.where(TIME < 0.3, 0.0, 1e5)
    pressures = np.column_stack([3e5 + step, 3e5 - step])
    given = {
        "name": "step_1",
        "protocol": "step",
        "drive": drive,
        "load": 1.0,
        "time": TIME,
        "command": pressures if drive == "pressure_set" else (pressures - 3e5) / 1e5,
        "measured": {
            "pressure_1": pressures[:, 0] + 50.0,
            "pressure_2": pressures[:, 1] - 50.0,
            "angle": np.sin(TIME),
        },
    }
    return Trial(**(given | changes))


def record(given, text=None, output="angle_deg"):
    table = table_of(given)
    into = signal(text or default_input([*table.columns]), [table])
    used, note = used_trial(table, [into], signal(output, [table]))
    return used.record, note


def test_the_default_is_the_difference_of_what_was_commanded_in_si():
    table = table_of(trial())
    assert default_input([*table.columns]) == "p1_set_kpa-p2_set_kpa"
    assert default_input([*table_of(trial("valve")).columns]) == "u1-u2"
    assert default_output([*table.columns]) == "angle_deg"
    used, note = record(trial())
    assert note == ""
    assert (used.units_input, used.unit_output, used.holds) == (("Pa",), "rad", ("zoh",))
    assert (used.input[0], used.input[-1]) == (0.0, 2e5)
    np.testing.assert_allclose(used.output, np.sin(TIME))
    shown = signal("p1_kpa", [table])
    assert (shown.unit, shown.si_unit, shown.factor) == ("kPa", "Pa", 1e3)
    assert signal("angle_deg", [table]).factor == pytest.approx(np.pi / 180.0)
    assert record(trial(), "-p1_set_kpa + p2_set_kpa")[0].input[-1] == -2e5
    measured, _ = record(trial(), "p1_kpa-p2_kpa")  # runs straight between samples
    assert (measured.holds, measured.time.size) == (("foh",), N)


@pytest.mark.parametrize(("drive", "late"), [("pressure_set", (4e5, 2e5)), ("valve", (1.0, -1.0))])
def test_a_step_at_time_0_is_a_change_from_where_the_trial_rests(drive, late):
    rest = {"pressure_1": np.linspace(3e5, 4e5, N), "pressure_2": np.linspace(3e5, 2e5, N)}
    measured = {**rest, "angle": np.sin(TIME)}
    used, _ = record(trial(drive, command=np.tile(late, (N, 1)), measured=measured))
    jump = late[0] - late[1]
    before = used.time < -1e-9
    assert 0 < np.count_nonzero(before) == used.time.size - N
    assert used.input[before] == pytest.approx(0.0, abs=1e-9 * jump)
    assert np.all(used.input[~before] == jump)
    assert np.all(used.output[before] == used.output[~before][0])


def test_sensor_noise_of_the_first_row_is_no_step():
    given = trial()
    for noise in (500.0, -1500.0):
        measured = {**given.measured, "pressure_1": given.measured["pressure_1"] + noise}
        assert record(trial(measured=measured))[0].time.size == N
        held = np.tile([3e5, 3e5], (N, 1))
        refuses("input is constant", record, trial(command=held, measured=measured))


def test_an_uneven_clock_is_made_uniform_and_a_held_command_stays_held():
    time = TIME.copy()
    time[1:-1] += np.random.default_rng(1).uniform(-2e-3, 2e-3, N - 2)
    used, note = record(trial(time=time, measured={"angle": 2.0 * time}))
    assert "interpolated to a uniform step" in note
    np.testing.assert_allclose(np.diff(used.time), used.sample_time, rtol=1e-9)
    np.testing.assert_allclose(used.output, 2.0 * used.time, atol=1e-12)
    assert set(used.input) == {0.0, 2e5}
    changes = used.time[np.flatnonzero(np.diff(used.input)) + 1]
    assert 0.0 <= changes[0] - time[30] < used.sample_time


def test_a_bad_expression_is_one_clear_line():
    tables = [table_of(trial()), table_of(trial(name="step_2", measured={"angle": TIME}))]
    bad = {
        "unknown": ("p1_bar", "no column 'p1_bar'; did you mean 'p1_kpa'"),
        "mixed units": ("p1_kpa-angle_deg", "combines deg and kPa"),
        "product": ("p1_kpa*2", "is no signal"),
        "nothing": ("", "is no signal"),
        "trailing": ("p1_kpa-", "is no signal"),
    }
    all_refused(bad, lambda text: signal(text, tables[:1]))
    refuses("'p1_kpa' is not in trial 'step_2'", signal, "p1_kpa", tables)
    refuses("give `output`", default_output, [*table_of(trial(measured={})).columns])


TS = 0.02
LEVELS = (2e5, 3e5, 4e5, 3e5, 2e5)


def staircase(seed, gain=lambda level: 1e-6, hold=2.5, load=1.0, protocol="staircase"):
    """A lag whose gain depends on the higher level of a step."""
    per = round(hold / TS)
    level = np.repeat(LEVELS, per)
    time = np.arange(level.size) * TS
    settled, parts = 0.0, [np.zeros(per)]
    for before, after in itertools.pairwise(LEVELS):
        change = gain(max(before, after)) * 0.5 * (after - before)
        parts.append(settled + change * -np.expm1(-time[:per] / 0.3))
        settled += change
    command = np.column_stack([1.25 * level, 0.75 * level])
    noise = 1e-4 * np.random.default_rng(seed).normal(size=time.size)
    measured = {"angle": np.concatenate(parts) + noise}
    measured |= {"pressure_1": command[:, 0], "pressure_2": command[:, 1]}
    given = {"time": time, "command": command, "measured": measured}
    named = {"name": f"{protocol}_{seed}", "protocol": protocol, "load": load}
    table = table_of(trial(**named, **given))
    into = signal("p1_set_kpa-p2_set_kpa", [table])
    return used_trial(table, [into], signal("angle_deg", [table]))[0]


def mapped(*trials):
    """Local models and notes, by the first order that fits all trials best."""
    return fit_operating_points(trials, fit_continuous([trial.record for trial in trials], order=1))


def test_every_step_of_a_staircase_is_a_point_and_repeats_share_it(monkeypatch):
    local, notes = mapped(*(staircase(seed) for seed in (1, 2)))
    assert notes == []
    points = [model.point for model in local.models]
    assert [point.direction for point in points] == [1, 1, -1, -1]
    assert [len(model.fit.trials) for model in local.models] == [2, 2, 2, 2]
    # Mean over the step and the fifth of the plateau before it that it starts from.
    for point, (before, after) in zip(points, itertools.pairwise(LEVELS), strict=True):
        assert point.pressure == pytest.approx((0.2 * before + after) / 1.2, rel=0.01)
        assert point.amplitude == pytest.approx(0.25 * abs(after - before))
    for model in local.models:
        assert model.fit["T"].value == pytest.approx(0.3, rel=0.02)
    # A load makes points of its own; of very many some are drawn.
    loads = [staircase(seed, load=float(seed)) for seed in (1, 2)]
    assert len(mapped(*loads)[0].models) == 8
    monkeypatch.setattr("pamsim.identification.local_models._MOST", 3)
    local, notes = mapped(loads[0])
    assert notes == ["of 4 operating points 3, drawn at random, have a model"]
    assert len(local.models) == 3


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_step_after_which_output_moved_by_a_twentieth_had_not_settled(sign):
    given = staircase(1)
    change, lead = round(3 * 2.5 / TS), round(0.2 * 2.5 / TS)
    for share, expected in ((0.04, []), (0.06, ["before step 3 the output had not settled"])):
        output = given.record.output.copy()
        # The later half of the fifth of the plateau that the step starts from.
        output[change - lead // 2 : change] += sign * share * 1e-6 * 0.5 * 1e5
        moved = replace(given, record=replace(given.record, output=output))
        assert [note.partition(": ")[2] for note in mapped(moved)[1]] == expected


def test_a_gain_that_falls_with_the_level_is_found():
    local, _ = mapped(staircase(1, lambda p: 1e-6 * (1.0 - (p - 3e5) / 4e5)))
    gains = [model.fit.gain for model in local.models]
    assert gains == pytest.approx([1e-6, 0.75e-6, 0.75e-6, 1e-6], rel=0.02)


def test_an_input_that_changes_too_fast_stays_whole():
    trials = [staircase(seed, hold=0.4, protocol=name) for seed, name in enumerate("ab")]
    local, _ = mapped(*trials)
    assert [model.point.direction for model in local.models] == [0, 0]
    assert mapped(trials[0])[0] is None


def held_levels(respond, *, hold, levels=12):
    """A trial of random levels of one input, each held [s], and its output without noise."""
    rng, per = np.random.default_rng(5), round(hold / TS)
    given = np.repeat(np.cumsum(rng.choice([-2.0, -1.0, 1.0, 2.0], levels)), per)
    time = np.arange(given.size) * TS
    output = respond(given - given[0]) + 1e-4 * rng.normal(size=time.size)
    return SignalTable(
        name="log",
        protocol="log",
        load=0.0,
        time=time,
        columns={"u": given, "y": output},
        units={"u": Unit(), "y": Unit()},
        held=frozenset("u"),
        rest={"u": float(given[0])},
        level=None,
    )


def local_models_of(table, **structure):
    used = used_trial(table, [signal("u", [table])], signal("y", [table]))[0]
    return fit_operating_points([used], fit_continuous([used.record], **structure))


def test_an_output_that_follows_in_the_same_sample_has_settled_before_each_step():
    local, notes = local_models_of(held_levels(lambda u: 1.7 * u, hold=0.4), order=0)
    assert notes == []
    assert [model.fit.gain for model in local.models] == pytest.approx([1.7] * 11, rel=1e-3)


def test_steps_are_not_cut_before_an_oscillation_has_decayed():
    wn, zeta = 12.0, 0.1  # decays by e in 0.83 s, ten times as long as 1 / wn

    def oscillation(u):
        return sampled([wn**2], [1.0, 2.0 * zeta * wn, wn**2], u, TS)

    for hold, cut in ((0.8, False), (2.0, True)):
        table = held_levels(oscillation, hold=hold, levels=5)
        local, _ = local_models_of(table, order=2, real_lags=False)
        assert (local is not None) is cut
