"""Numbers that documents quote are those of the recorded results."""

from __future__ import annotations

import re

import gymnasium
import numpy as np

from pamsim.controllers.neural_policy import NeuralPolicy
from pamsim.engine.rig import load_rig
from pamsim.envs.closed_loop import run_episode
from tests.records import SCRIPTS, page, recorded, words


def test_identify_s_table_is_that_of_the_study():
    study = recorded("results/identify_study")
    own = study["side_by_side_without_dead_time"]
    peers = study["peers_on_the_same_records"]["scenarios"]
    text = page("validation").partition("## Identification beside other")[2].partition("\n## ")[0]
    lines = [re.split(r"\s*\|\s*", line.strip("| ")) for line in text.splitlines() if "|" in line]
    head = next(cells for cells in lines if cells[0].startswith("median error"))
    scenarios = head[1:-1]
    rows = lines[lines.index(head) + 2 :]
    checked = 0
    for method, *cells, seconds in rows:
        for scenario, cell in zip(scenarios, cells, strict=True):
            found = {**own[scenario], **peers[scenario]}[method]
            pair = [found[f"median_error_{k}_percent"] for k in ("T1", "T2")]
            assert cell == " / ".join(f"{value:.1f}" for value in pair), (method, scenario)
            checked += 1
        assert seconds == f"{found_seconds(own, peers, method):.2g}"
    assert checked == 21


def found_seconds(own, peers, method):
    return {**own["20 dB white"], **peers["20 dB white"]}[method]["median_seconds"]


def test_identify_study_meets_what_is_promised():
    """Errors, dead times and coverage over 200 records of each kind."""
    recovery = recorded("results/identify_study")["recovery"]
    for name, found in recovery.items():
        assert found["runs"] == 200
        assert found["dead_time_within_one_sample_percent"] > 95.0
        for parameter, row in found["parameters"].items():
            assert 90.0 <= row["coverage_percent"] <= 98.0, (name, parameter)
    for parameter in ("T1", "T2"):
        assert recovery["40 dB white"]["parameters"][parameter]["median_error_percent"] < 1.0
    at_20 = recovery["20 dB white"]["parameters"]
    assert at_20["T2"]["median_error_percent"] < 3.0
    assert at_20["T1"]["median_error_percent"] < 10.0


def test_calibrate_study_meets_what_is_promised():
    """Coverage over 200 calibrations under white and 200 under drifting noise."""
    study = recorded("results/calibrate_study")
    for name, found in study["coverage"].items():
        assert found["runs"] == 200
        for parameter, row in found["parameters"].items():
            assert 90.0 <= row["coverage_percent"] <= 98.0, (name, parameter)
    blind = study["rank_deficient"]["valves only fill"]
    assert "converged" not in blind["statuses"]
    assert blind["flags_percent"]["valve.conductance_fill"] == {}
    flagged = blind["flags_percent"]["valve.conductance_exhaust"]
    assert set(flagged) <= {"dead", "at_bound"}
    assert sum(flagged.values()) >= 100.0
    assert study["rank_deficient"]["rest without load"]["flags_percent"] == {
        name: {"trade_off": 100.0} for name in ("force.scale", "passive.stiffness")
    }


def table_after(document, first_cell):
    """Rows of the table of a document whose head begins with a cell: first cell -> others."""
    lines = [re.split(r"\s*\|\s*", line.strip("| ")) for line in page(document).splitlines()]
    start = next(i for i, cells in enumerate(lines) if cells[0] == first_cell and len(cells) > 1)
    rows = {}
    for cells in lines[start + 2 :]:
        if len(cells) < 2:
            break
        rows[cells[0]] = cells[1:]
    return lines[start][1:], rows


def test_the_scoreboard_s_table_is_that_of_its_result():
    board = recorded("results/controller_scoreboard")
    got = {(r["plant"], r["task"], r["controller"]): r for r in board["rows"]}
    plants, rows = table_after("control", "controller on a sine")
    assert len(rows) == 12
    for name, cells in rows.items():
        for plant, cell in zip(plants, cells, strict=True):
            assert cell == f"{got[plant, 'sine', name]['rmse_deg']:.2f}", (plant, name)


def test_the_scoreboard_meets_what_is_promised():
    got = {
        (r["plant"], r["controller"]): r["rmse_deg"]
        for r in recorded("results/controller_scoreboard")["rows"]
        if r["task"] == "sine"
    }
    ahead = "feed-forward, compensated"
    for plant in ("unloaded", "1.2 kg"):
        assert got[plant, ahead] <= 0.5 * got[plant, "PID"]
    assert got["1.2 kg", "policy trained on sine"] < got["1.2 kg", "PID"]


def test_random_episodes_broke_nothing():
    text = words("control")
    for row in recorded("results/random_episodes")["rows"]:
        assert row["episodes"] >= 10_000
        assert row["broke_down"] == row["engine_warnings"] == row["not_finite"] == 0
        assert row["lowest_pressure_kpa"] >= 0.0
        # Air trapped in a muscle that the other one stretches may pass the supply's pressure.
        valves = row["environment"] != "pamsim/PamArmPressure-v0"
        assert row["highest_pressure_kpa"] <= (1.05 if valves else 1.0) * row["supply_kpa"]
        if valves:
            assert re.search(rf"\b{row['highest_pressure_kpa']:.0f}\b", text)


def test_environments_are_as_fast_as_is_promised():
    rows = recorded("benchmarks/results/environment_steps")["rows"]
    ratios = [row["ratio"] for row in rows]
    text = page("control")
    assert f"A step is {min(ratios):.1f} to {max(ratios):.0f} times as quick" in text
    at_the_peer_s = [row for row in rows if row["frame_skip"] == 2]
    assert {row["arms"] for row in at_the_peer_s} == {1, 64, 256}
    for row in at_the_peer_s:
        # Of 64 arms 4.0 while environments stopped the engine's timers, also those of other models;
        # five records of one code lie from 3.3 to 3.5.
        assert row["ratio"] >= (1.0 if row["arms"] == 1 else 3.3), row


def test_frames_are_as_quick_as_is_promised():
    ratios = [row["ratio"] for row in recorded("benchmarks/results/frames")["rows"]]
    assert max(ratios) < 3.0


def test_the_repaired_rig_s_table_is_that_of_its_result():
    result = recorded("results/repaired_rig_control")
    got = {(r["designed_on"], r["task"], r["controller"]): r for r in result["rows"]}
    head, rows = table_after("control", "sine RMSE [deg] of a controller designed on")
    assert rows
    for name, cells in rows.items():
        for place, cell in zip(head, cells, strict=True):
            assert cell == f"{got[place, 'sine', name]['rmse_deg']:.2f}", (place, name)


def test_the_policy_of_four_muscles_is_as_good_as_the_documents_state():
    text = words("control")
    trained = recorded("results/policy_two_joint")
    curve = trained["curve"]["mean_episode_reward"]
    assert f"took {trained['seconds']} s beside" in text
    assert f"from {curve[0]:.0f} to {curve[-1]:.0f}. On" in text
    rig = load_rig("two_joint_arm")
    policy = NeuralPolicy.read(SCRIPTS / "results/policy_two_joint.npz", rig)
    env = gymnasium.make("pamsim/Rig-v0", rig=rig, task="regulation")
    learned = [run_episode(env, policy, seed) for seed in range(100, 105)]
    env.close()
    off = [np.abs(run.position[-100:] - run.reference[-100:]).mean(axis=0) for run in learned]
    shoulder, elbow = np.degrees(np.mean(off, axis=0))
    assert f"{shoulder:.1f} deg (shoulder) and {elbow:.1f} deg (elbow) off" in text


def test_runs_in_threads_are_as_the_document_states():
    result = recorded("results/threads")
    text = page("callback")
    assert len(result["runs"]) == 7
    failed, runs = (sum(result[name].values()) for name in ("failed", "runs"))
    assert f"{failed} of {runs} runs differ" in text
    assert failed == 0


def test_the_five_tasks_are_as_recorded():
    record = recorded("benchmarks/results/five_tasks")
    _, rows = table_after("compared", "task")
    _, answers = table_after("compared", "task, answer")
    assert list(rows) == list(answers) == list(record["tasks"])
    for task, both in record["tasks"].items():
        own, peer = both["pamsim"], both["peer"]
        command, seconds, tools, lines, others = rows[task]
        assert command == f"`{' '.join(own['command'].split()[:2])}`"
        assert tools == peer["tools"]
        assert lines == str(peer["lines"])
        assert (seconds, others) == (f"{own['cpu_s']:.1f}", f"{peer['cpu_s']:.1f}")
        folder = SCRIPTS / "benchmarks" / "five_tasks"
        assert all((folder / name).is_file() for name in peer["scripts"])
        for side, shown in zip((own, peer), answers[task], strict=True):
            printed = re.findall(r"-?\d+\.?\d*", side["printed"])
            assert set(re.findall(r"\d+\.\d+", shown)) <= set(printed), (task, shown)
