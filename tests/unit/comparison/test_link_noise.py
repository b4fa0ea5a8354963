"""Noise of outputs without repeats is that of repeats, whatever the model misses."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.comparison.link_noise import link_noise
from pamsim.comparison.links import JOINT, MUSCLE, Link
from pamsim.comparison.noise_floor import FloorRoute
from pamsim.engine.rig import load_rig
from pamsim.recordings.trial import Trial
from tests.unit.inference.closed_form_rigs import coloured

ARM, LINK = load_rig("mas20_arm"), Link((MUSCLE, JOINT))
TIME = np.arange(3000) / 100.0
HELD = np.floor(TIME / 1.5) % 7.0  # new levels every 1.5 s
PERIODIC = np.floor(TIME / 0.25) % 20.0  # again every 5 s


def trial(command, readings, name="a", load=0.0):
    return Trial(
        name=name,
        protocol="log",
        drive="pressure_set",
        load=load,
        time=TIME,
        command=np.stack([command, command], axis=1),
        measured={"angle": readings},
    )


def noise_of(trials, residuals):
    exact = {(LINK, t.name, "angle"): r for t, r in zip(trials, residuals, strict=True)}
    return link_noise(ARM, trials, exact)[LINK, "angle"]


def missed_by_a_model(command):
    """Constant or a trend while a command is held, and a kick where it changes."""
    since = TIME - np.floor(TIME / 1.5) * 1.5
    return 5.0 * np.sin(3.0 * command) + 2.0 * since + 9.0 * np.exp(-since / 0.05)


@pytest.mark.parametrize(
    ("command", "source"), [(HELD, FloorRoute.HOLDS), (PERIODIC, FloorRoute.PERIODS)]
)
def test_what_a_model_misses_is_no_noise(command, source):
    rng = np.random.default_rng(1)
    noise = coloured(rng, TIME.size, 0.7)
    missed = missed_by_a_model(command) if source == FloorRoute.HOLDS else 5.0 * np.sin(command)
    found = noise_of([trial(command, noise)], [missed + noise])
    assert found.source is source
    assert found.noise.standard_deviation == pytest.approx(1.0, abs=0.1)
    assert np.mean(found.noise.whiten(noise) ** 2) == pytest.approx(found.noise.variance, rel=0.1)


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
    """It does not change while a command is held, and rounding is noise as it moves."""
    angle = np.round(0.7 * HELD + np.sin(TIME) * (np.sin(2.0 * np.pi * TIME / 1.5) > 0.9))
    found = noise_of([trial(HELD, angle)], [np.zeros(TIME.size)])
    assert found.noise.standard_deviation == pytest.approx(1.0 / np.sqrt(12.0))
