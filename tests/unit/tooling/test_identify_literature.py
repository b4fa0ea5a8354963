"""The rule by which identify and its peers are scored on public data finds what is planted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import dlsim

from pamsim.linear.continuous_fit import fit_continuous
from pamsim.linear.signal_record import SignalRecord
from tests.records import page, recorded, script

runs = script("free_runs")


@pytest.fixture(scope="module")
def study():
    return script("identify_literature")


@pytest.mark.parametrize(
    "poles", [[0.5], [0.99, 0.99], [0.9 + 0.3j, 0.99, -0.4, 0.9 - 0.3j], [1.0, 1.0, 0.0]]
)
def test_the_start_of_any_linear_system_is_found(poles):
    """A real, double, complex or integrating system runs on from any state."""
    n = len(poles)
    rng = np.random.default_rng(n)
    a = np.diag(np.ones(n - 1), -1)
    a[0] = -np.real(np.poly(poles))[1:]
    system = (a, np.eye(n)[:, :1], rng.standard_normal((1, n)), np.zeros((1, 1)), 1.0)
    u = rng.standard_normal(300)
    forced = dlsim(system, u)[1][:, 0]
    y = dlsim(system, u, x0=10.0 * rng.standard_normal(n))[1][:, 0] + 3.0
    assert np.linalg.norm(y - forced - 3.0) > 0.1
    run = runs.started_freely(forced, poles, y)
    assert run == pytest.approx(y, abs=1e-6 * np.ptp(y))


def test_no_more_is_fitted_than_state_and_constant():
    """Of noise, n + 1 dimensions of 400 are explained."""
    noise = np.random.default_rng(3).standard_normal(400)
    left = noise - runs.started_freely(np.zeros(400), [0.95 + 0.2j, 0.95 - 0.2j, 0.8], noise)
    assert np.linalg.matrix_rank(runs.free_responses([0.95 + 0.2j, 0.95 - 0.2j, 0.8], 400)) == 4
    assert left @ left == pytest.approx(noise @ noise, rel=0.05)


def test_a_growing_mode_has_no_free_run():
    assert runs.grows([1.03, 0.9], 500)
    assert not runs.grows([1.0, 1.0, 0.9], 500)
    assert not np.any(np.isfinite(runs.started_freely(np.zeros(800), [5.0], np.ones(800))))


def test_pamsim_s_models_are_scored_as_its_own_free_start_does(study):
    """The poles alone give what the chain of lags gives."""
    rng = np.random.default_rng(0)
    u = np.repeat(rng.choice([0.0, 1.0], 40), 20)
    time = 0.1 * np.arange(u.size)
    y = np.cumsum(u - 0.5) * 0.05 + 0.1 * rng.standard_normal(u.size)
    table = np.rec.fromarrays([time, u, y], names="time_s,u,y")
    halves = study.Halves("u", "y", table)
    given, output = halves.half(0)
    fit = fit_continuous(
        [SignalRecord("first", time[: given.size], given, output)], order=2, real_lags=False
    )
    given, output = halves.half(1)
    record = SignalRecord("second", time[: given.size], given, output)
    free = replace(fit.structure, start="free").free_run(fit.coordinates, record)[0]
    expected = 100.0 * (
        1.0 - np.linalg.norm(output - free) / np.linalg.norm(output - output.mean())
    )
    assert study.second_half_fit(fit, halves, "zoh") == pytest.approx(expected, abs=1e-6)
    assert expected > study.fit_percent(output, fit.simulate(record)) + 1.0


def test_the_record_names_the_peers_it_was_compared_with():
    own, peers = (recorded(f"results/identify_literature{one}") for one in ("", "_peers"))
    assert own["versions"]["peers"] == peers["versions"]
    assert list(own["sets"]) == list(peers["sets"])
    for name, entry in own["sets"].items():
        for method, row in entry["peers"].items():
            fits = [
                fit for fit in peers["sets"][name][method]["stable"].values() if fit is not None
            ]
            assert (row["best"] or {"fit_percent": None})["fit_percent"] == max(fits, default=None)


def test_the_table_in_the_document_is_that_of_the_record():
    text = page("validation")
    for name, entry in recorded("results/identify_literature")["sets"].items():
        (line,) = [line for line in text.splitlines() if line.startswith(f"| {name} |")]
        _, model, own, *peers = [cell.strip() for cell in line.strip("|").split("|")]
        assert model == entry["pamsim"]["shown"].replace("_", " ")
        assert own == f"{entry['pamsim']['fit_percent']:.1f}"
        bests = [peer["best"] for peer in entry["peers"].values()]
        assert peers == ["-" if best is None else f"{best['fit_percent']:.1f}" for best in bests]
        reasoned = name == "robot arm"
        assert (entry["pamsim"]["recommended"] is not None) is reasoned


def test_the_counts_of_planted_systems_in_the_document_are_those_of_the_record():
    study, two = (recorded(f"results/identify_planted{one}") for one in ("", "_two_inputs"))
    text = page("validation")
    for label, score in (
        ("number of poles right within one", "poles_within_one"),
        ("number of poles exact", "poles_exact"),
        ("integrator or none, right", "integrator_right"),
        ("recommended", "recommended"),
        ("recommended models that fail their own residual test", "recommended_failing_their_test"),
        ("95 % intervals that hold the planted number, structure given", "intervals_that_hold"),
    ):
        cells = [
            f"{s['scores'][score]['hits']} of {s['scores'][score]['count']}" for s in (study, two)
        ]
        assert f"| {label} | {' | '.join(cells)} |" in text
    right = [row for row in two["rows"] if row["found"]["poles"] == row["poles"]]
    zeros, late = (
        sum(row["found"][what] == row[what] for row in right) for what in ("zeros", "dead_time")
    )
    assert f"Of the {len(right)} systems with two inputs" in text
    assert f"{zeros} have the planted zeros of both inputs, and {late} both dead times" in text
    single = [row for row in study["rows"] if row["poles"] == 1]
    more = sum(row["found"]["poles"] > 1 for row in single)
    assert f"{more} of {len(single)} systems of one pole got more poles." in text
