"""Noise of recordings by repeats, periods, holds, samples or as stated, and imposed signals.

Of outputs without repeats it is that of repeats, whatever the model misses.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

import pamsim
from pamsim.comparison import link_inputs
from pamsim.comparison.chain_runs import link_residuals
from pamsim.comparison.link_inputs import sample_noise, smoothed
from pamsim.comparison.link_noise import link_noise
from pamsim.comparison.links import JOINT, MUSCLE, Link
from pamsim.comparison.noise_floor import (
    FloorRoute,
    noise_floor,
    noise_within_trial,
    settled_holds,
)
from pamsim.comparison.repeats import samples_per_period
from pamsim.comparison.start_errors import start_error
from pamsim.engine.rig import load_rig
from pamsim.inference.simulator_fit import ResidualBlock, layout
from pamsim.recordings.stated_noise import StatedNoise
from tests.unit.inference.closed_form_rigs import coloured
from tests.unit.recordings.made_trial import made_trial

ARM = load_rig("mas20_arm")
LINK = Link((MUSCLE, JOINT))
TIME = np.arange(3000) / 100.0
HELD = np.floor(TIME / 1.5) % 7.0  # new levels every 1.5 s
PERIODIC = np.floor(TIME / 0.25) % 20.0  # again every 5 s


def trial(command, readings, name="a", load=0.0):
    both = np.stack([command, command], axis=1)
    return made_trial(both, {"angle": readings}, name=name, protocol="log", load=load)


def noise_of(trials, residuals):
    exact = {(LINK, t.name, "angle"): r for t, r in zip(trials, residuals, strict=True)}
    return link_noise(ARM, trials, exact)[LINK, "angle"]


def block(residual, trial="a", protocol="log", channel="angle", **more):
    return ResidualBlock(trial=trial, protocol=protocol, channel=channel, residual=residual, **more)


def floor_of(blocks, trials=()):
    return noise_floor(layout(blocks), np.concatenate([b.residual for b in blocks]), trials)


def missed_by_a_model(command):
    """Constant or a trend while a command is held, and a kick where it changes."""
    since = TIME - np.floor(TIME / 1.5) * 1.5
    return 5.0 * np.sin(3.0 * command) + 2.0 * since + 9.0 * np.exp(-since / 0.05)


def test_what_a_model_misses_is_no_noise():
    for command, source in ((HELD, FloorRoute.HOLDS), (PERIODIC, FloorRoute.PERIODS)):
        noise = coloured(np.random.default_rng(1), TIME.size, 0.7)
        missed = missed_by_a_model(command) if source == FloorRoute.HOLDS else 5.0 * np.sin(command)
        found = noise_of([trial(command, noise)], [missed + noise])
        assert found.source is source
        assert found.noise.standard_deviation == pytest.approx(1.0, abs=0.1)
        white = np.mean(found.noise.whiten(noise) ** 2)
        assert white == pytest.approx(found.noise.variance, rel=0.1)


def test_trends_that_are_taken_off_are_given_back_to_the_noise():
    """Else slow noise in short holds is too small by what the lines take up."""
    rng = np.random.default_rng(2)
    logs = [trial(HELD, coloured(rng, TIME.size, 0.9), f"t{k}", load=k) for k in range(3)]
    found = noise_of(logs, [log.measured["angle"] for log in logs])
    assert found.source is FloorRoute.HOLDS
    assert found.noise.standard_deviation == pytest.approx(1.0, abs=0.1)


def test_repeats_come_first():
    rng = np.random.default_rng(3)
    logs = [trial(HELD, rng.normal(size=TIME.size), name) for name in "ab"]
    drift = np.cumsum(rng.normal(size=TIME.size))
    found = noise_of(logs, [drift + log.measured["angle"] for log in logs])
    assert found.source is FloorRoute.REPEATS
    assert found.noise.standard_deviation == pytest.approx(1.0, abs=0.1)


def test_a_reading_in_steps_has_the_noise_of_its_rounding():
    """It does not change while a command is held, and repeats may read the same."""
    angle = np.round(0.7 * HELD + np.sin(TIME) * (np.sin(2.0 * np.pi * TIME / 1.5) > 0.9))
    found = noise_of([trial(HELD, angle)], [np.zeros(TIME.size)])
    assert found.noise.standard_deviation == pytest.approx(1.0 / np.sqrt(12.0))
    angle = np.round(3.0 * np.sin(TIME))
    logs = [trial(HELD, angle, name) for name in "ab"]
    found = noise_of(logs, [np.sin(TIME) - angle for _ in logs])
    assert found.source is FloorRoute.REPEATS
    assert found.noise.standard_deviation == pytest.approx(1.0 / np.sqrt(12.0))
    floor = floor_of([block(np.sin(TIME) - angle, log.name) for log in logs], logs)
    assert floor.routes["angle", "log"] is FloorRoute.REPEATS
    assert floor.variance["angle", "log"] == pytest.approx(1.0 / 12.0)


def test_the_floor_of_a_reading_in_steps_is_that_of_its_rounding():
    """One that hardly changes shows none, and one that changes fast has no more."""
    for reading, floor in (
        (np.round(np.sin(0.2 * TIME)), 1.0 / np.sqrt(12.0)),
        (np.sin(9.0 * TIME), 1e-3),
    ):
        noise = 1e-3 * np.random.default_rng(5).standard_normal(TIME.size)
        found = floor_of([block(noise, sample_interval=0.01)], [trial(HELD, reading)])
        assert found.sd["angle"] == pytest.approx(floor, rel=0.1)
        assert found.variance["angle", "log"] == pytest.approx(floor**2, rel=0.2)


def blocks(rng, *, repeats, count=400, model=0.0):
    time = np.linspace(0.0, 6.0, count)
    return [
        block(
            model * np.sin(time) + sd * rng.standard_normal(count),
            f"{protocol}_{k}",
            protocol=protocol,
            channel=channel,
        )
        for protocol, factor in (("calm", 1.0), ("rough", 3.0))
        for k in range(repeats)
        for channel, sd in (("angle", 0.1 * factor), ("pressure_1", 20.0 * factor))
    ]


def test_floor_is_the_planted_noise_whatever_the_model_misses():
    for model in (0.0, 50.0):
        found = blocks(np.random.default_rng(3), repeats=5, model=model)
        floor = floor_of(found)
        assert floor.variance["angle", "calm"] == pytest.approx(0.01, rel=0.1)
        assert floor.variance["pressure_1", "rough"] == pytest.approx(3600.0, rel=0.1)
        assert floor.sd["angle"] == pytest.approx(np.sqrt((0.01 + 0.09) / 2.0), rel=0.05)


INTERVAL, COUNT = 0.01, 6000
LONG = INTERVAL * np.arange(COUNT)
MISSED = 3.0 * np.sin(2.0 * np.pi * LONG / 4.0)  # what the model misses, every period again


def drifting(rng):
    """Noise of variance 1, half of which drifts with a correlation time of 0.3 s."""
    keep = np.exp(-INTERVAL / 0.3)
    drive = rng.standard_normal(COUNT + 500)
    drift = lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], drive)[500:]
    return np.sqrt(0.5) * (rng.standard_normal(COUNT) + drift)


def stairs(hold):
    """A command of random levels, each held for a time [s]."""
    levels = np.random.default_rng(9).uniform(1.0, 3.0, COUNT)
    return levels[(LONG / hold).astype(int)][:, np.newaxis]


def test_periods_are_repeats_that_drift_counts_in_and_model_error_does_not():
    command = np.sin(2.0 * np.pi * LONG / 4.0)[:, np.newaxis]
    rng = np.random.default_rng(0)
    route, noise = noise_within_trial(MISSED + drifting(rng), INTERVAL, command)
    assert route is FloorRoute.PERIODS
    assert noise.variance == pytest.approx(1.0, rel=0.15)
    assert noise.freedom == 13 * 400  # of 15 periods, the first is a transient


def test_a_period_is_one_of_all_columns_however_small_their_numbers():
    pressure = 3e5 + 1e5 * (np.arange(COUNT) // 200 % 2)
    angle = 0.1 * np.sin(2.0 * np.pi * LONG / 2.7)
    assert samples_per_period(np.column_stack([pressure, np.full(COUNT, 0.1)])) == 400
    assert samples_per_period(np.column_stack([pressure, angle])) is None


def test_holds_give_the_noise_where_the_model_misses_another_level_in_each():
    command = stairs(3.0)
    steps = 20.0 * command[:, 0]  # what the model misses
    rng = np.random.default_rng(1)
    route, noise = noise_within_trial(steps + drifting(rng), INTERVAL, command)
    assert route is FloorRoute.HOLDS
    # Over 0.5 s, second differences see 3/4 of a drift of 0.3 s.
    assert 0.75 < noise.variance < 1.0
    holds = settled_holds(command, INTERVAL)
    assert [h.stop - h.start for h in holds] == [250] * 20
    assert all(np.ptp(command[h]) == 0.0 for h in holds)


def test_otherwise_noise_is_what_changes_from_sample_to_sample():
    for command in (None, stairs(1.0)):
        rng = np.random.default_rng(2)
        white = MISSED + 0.3 * rng.standard_normal(COUNT)
        route, noise = noise_within_trial(white, INTERVAL, command)
        assert route is FloorRoute.WITHIN_TRIALS
        assert noise.variance == pytest.approx(0.09, rel=0.1)
        _, half = noise_within_trial(drifting(rng), INTERVAL, command)
        assert half.variance == pytest.approx(0.5, rel=0.15)  # the drift goes unseen


FILTERED = StatedNoise(rms=2e-3, cutoff=3.0)  # rad, Hz


def recorded(names=("log",), noise=FILTERED):
    """Logs of the arm in motion whose angle was filtered."""
    rng = np.random.default_rng(4)
    levels = np.array([3.0, 3.5, 2.6, 3.2, 2.4, 3.0, 3.4, 2.8]) * 1e5  # Pa
    time = 0.3 * np.arange(levels.size)  # too short to settle
    command = np.column_stack([levels, 6e5 - levels])
    experiment = pamsim.Experiment(
        drive="pressure_set", command_time=time, command_value=command,
        start_pressure=command[0], duration=2.4, sample_rate=100.0,
    )  # fmt: skip
    run = pamsim.simulate(ARM, experiment).completed()

    def read():
        angle = run.angle + noise.drawn(run.time.size, 0.01, rng)
        pressures = run.pressure.T + 50.0 * rng.normal(size=run.pressure.T.shape)
        return {"angle": angle, "pressure_1": pressures[0], "pressure_2": pressures[1]}

    own = {"protocol": "levels", "time": run.time}
    return [made_trial(run.command, read(), name=name, **own) for name in names]


def angle_noise(trials):
    found = link_noise(ARM, trials, link_residuals(ARM, trials))
    (one,) = (noise for (_, channel), noise in found.items() if channel == "angle")
    return one


def with_stated(trials, **noise):
    return [replace(trial, noise=noise) for trial in trials]


def test_drawn_noise_has_its_size_and_forgets_within_the_filters_time():
    drawn = FILTERED.drawn(200_000, 0.01, np.random.default_rng(1))
    assert np.std(drawn) == pytest.approx(FILTERED.rms, rel=0.03)
    correlation = np.mean(drawn[10:] * drawn[:-10]) / np.var(drawn)
    assert correlation == pytest.approx(np.exp(-2.0 * np.pi * 3.0 * 0.1), abs=0.02)
    white = StatedNoise(rms=1.0).drawn(100_000, 0.01, np.random.default_rng(2))
    assert abs(np.mean(white[1:] * white[:-1])) < 0.02


def test_a_filtered_log_hides_its_noise_until_it_is_stated():
    trials = recorded()
    hidden, stated = angle_noise(trials), angle_noise(with_stated(trials, angle=FILTERED))
    assert hidden.source is FloorRoute.WITHIN_TRIALS
    assert hidden.noise.standard_deviation < 0.5 * FILTERED.rms
    assert stated.source is FloorRoute.STATED
    assert stated.noise.standard_deviation == pytest.approx(FILTERED.rms, rel=0.3)  # one of 2.4 s
    assert stated.noise.correlation_time(0.01) > 3.0 * hidden.noise.correlation_time(0.01)
    # Less than what shows changes nothing.
    assert angle_noise(with_stated(trials, angle=StatedNoise(rms=1e-6))) == hidden


def test_the_noise_of_measured_pressures_counts_where_they_drive_the_muscles():
    """As where set points do: in either case the muscles are given what was measured."""
    (set_points,) = recorded(noise=StatedNoise(rms=1e-5))
    rng = np.random.default_rng(6)
    read = {
        c: set_points.measured[c] + 2e3 * rng.normal(size=241) for c in ("pressure_1", "pressure_2")
    }
    set_points = replace(set_points, measured=set_points.measured | read)
    driven = replace(set_points, drive="measured", command=np.column_stack([*read.values()]))
    one, other = (angle_noise([log]).noise.standard_deviation for log in (set_points, driven))
    assert other == pytest.approx(one, rel=0.05)


def test_repeats_stay_repeats_and_have_the_stated_noise_at_least():
    trials = recorded(("a", "b", "c"), StatedNoise(rms=1e-4))
    found = angle_noise(with_stated(trials, angle=FILTERED))
    assert found.source is FloorRoute.REPEATS
    assert found.noise.standard_deviation == pytest.approx(FILTERED.rms, rel=0.3)


def test_floor_and_start_pressures_are_uncertain_by_what_is_stated():
    trials = with_stated(recorded(), angle=FILTERED, pressure_1=StatedNoise(rms=5e3))
    blocks = [
        block(residual, name, protocol="levels", channel=channel)
        for (_, name, channel), residual in link_residuals(ARM, trials).items()
    ]
    floor = floor_of(blocks, trials)
    assert floor.sd["angle"] == FILTERED.rms
    assert floor.variance["angle", "levels"] == pytest.approx(FILTERED.rms**2)
    first, second = start_error(trials[0], np.array([3e5, 3e5])).spread
    assert first > 10.0 * second


SHORT = TIME[:800]
MOTION = 0.4 * np.sin(2.0 * SHORT)
STEPS = 3e5 - 1e5 * np.exp(-np.mod(SHORT, 2.0) / 0.15)


def test_smoothing_leaves_less_than_the_noise_and_nothing_that_repeats_share():
    rng = np.random.default_rng(11)
    for signal, noise in ((MOTION, 1e-3), (STEPS, 400.0)):
        errors = np.stack(
            [
                smoothed(SHORT, signal + rng.normal(0.0, noise, SHORT.size)) - signal
                for _ in range(12)
            ]
        )
        assert np.sqrt(np.mean(errors**2)) < 0.6 * noise
        products = errors @ errors.T / SHORT.size
        shared = (products.sum() - np.trace(products)) / (12 * 11)
        assert shared < (0.2 * noise) ** 2
    left = [np.std(smoothed(SHORT, 0.1 + rng.normal(0.0, 1e-3, SHORT.size))) for _ in range(20)]
    # Four coefficients of 800 samples leave 0.07 of the noise; in some chance bends the spline.
    assert np.mean(left) < 0.2e-3
    assert np.quantile(left, 0.9) < 0.5e-3
    noisy = STEPS + rng.normal(0.0, 400.0, SHORT.size)  # in any unit
    assert smoothed(SHORT, 1e-3 * noisy) == pytest.approx(1e-3 * smoothed(SHORT, noisy), rel=1e-6)


def test_a_long_signal_is_smoothed_in_pieces_as_well_as_whole(monkeypatch):
    time = np.arange(5000) / 100.0
    signal, rng = 3e5 - 1e5 * np.exp(-np.mod(time, 2.3) / 0.15), np.random.default_rng(12)
    read, sizes = signal + rng.normal(0.0, 400.0, time.size), []
    fit = link_inputs.splrep
    monkeypatch.setattr(
        link_inputs, "splrep", lambda t, *a, **k: sizes.append(len(t)) or fit(t, *a, **k)
    )
    left = smoothed(time, read) - signal
    assert max(sizes) == 1200
    places = [1000, 2000, 3000, 4000]  # where pieces meet
    for part in (left, *(left[at - 100 : at + 100] for at in places)):
        assert np.sqrt(np.mean(part**2)) < 0.6 * 400.0
    jumps = np.abs(np.diff(left))
    assert max(jumps[at] for at in places) < 400.0
    monkeypatch.setattr(link_inputs, "_PIECE", time.size)
    assert np.std(left) == pytest.approx(np.std(smoothed(time, read) - signal), rel=0.05)


def test_a_hum_is_smoothed_away_and_takes_nothing_of_the_signal_along():
    rng = np.random.default_rng(12)
    for per_sample in (0.499, 0.4, 0.31):  # of the mains, as the sampling rate aliases them
        errors = []
        for begin in rng.uniform(0.0, 6.3, 12):
            hum = 800.0 * np.sin(2.0 * np.pi * per_sample * np.arange(SHORT.size) + begin)
            read = STEPS + hum + rng.normal(0.0, 400.0, SHORT.size)
            errors.append(smoothed(SHORT, read) - STEPS)
        assert np.sqrt(np.mean(np.square(errors))) < 0.6 * 400.0
        assert np.std(np.mean(errors, axis=0)) < 0.3 * 400.0


def test_single_wrong_readings_are_no_motion():
    rng = np.random.default_rng(13)
    for signal, noise in ((MOTION, 1e-3), (STEPS, 400.0)):
        errors = []
        for _ in range(12):
            wrong = (rng.random(SHORT.size) < 0.005) * rng.choice([-30.0, 30.0], SHORT.size)
            read = signal + noise * (wrong + rng.standard_normal(SHORT.size))
            errors.append(smoothed(SHORT, read) - signal)
        assert np.sqrt(np.mean(np.square(errors))) < noise


def test_smoothing_takes_steps_of_a_converter_for_noise_and_leaves_exact_and_few_samples():
    assert np.array_equal(smoothed(SHORT, np.full(SHORT.size, 2.0)), np.full(SHORT.size, 2.0))
    assert np.array_equal(smoothed(SHORT[:6], STEPS[:6]), STEPS[:6])
    step = 2.0 * np.pi / 4096
    counted = np.floor(MOTION / step) * step
    assert sample_noise(counted) >= step / np.sqrt(12.0) * (1.0 - 1e-9)
    slow = np.floor(1e-3 * SHORT / step) * step
    assert np.abs(np.diff(smoothed(SHORT, slow))).max() < 0.2 * step
