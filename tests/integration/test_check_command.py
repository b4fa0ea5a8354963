"""`pamsim check`: what was read, what is implausible, what the data could show."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

import pamsim
from pamsim.comparison.trial_prediction import TrialPredictor
from pamsim.recordings.rig_file import shipped_rigs
from pamsim.twins.hide import hide
from tests.typed_command import run as command

SETTINGS = {"protocols": ("triangle", "bursts"), "duration": 1.0, "repeats": 2, "seed": 3}
ONE = ["viscous_friction"]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Recordings of the arm as it is: of one protocol."""
    folder = tmp_path_factory.mktemp("check") / "data"
    hide("mas20_arm", {}, **SETTINGS | {"protocols": ("triangle",), "duration": 2.0}).save(folder)
    return folder


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Runs the command: its exit code, output and result."""

    def run(data, effects, *more):
        file = tmp_path / "check.json"
        words = ("check", data, "--effects", effects, "--json", file, *more)
        code, shown, _ = command(monkeypatch, capsys, *words)
        return code, shown, json.loads(file.read_text())

    return run


def angle_times(factor, recorded, folder):
    """The recording with the angle of every row of its CSV files multiplied."""
    shutil.copytree(recorded, folder)
    for path in folder.glob("*.csv"):
        header, *rows = path.read_text().splitlines()
        table = np.array([row.split(",") for row in rows], dtype=float)
        table[:, header.split(",").index("angle_deg")] *= factor
        path.write_text("\n".join([header, *(",".join(map(repr, r)) for r in table.tolist())]))
    return folder


def test_a_good_recording_is_described_and_raises_no_suspicion(tmp_path, run):
    recorded, page = tmp_path / "data", tmp_path / "page"
    hide("mas20_arm", {}, **SETTINGS).save(recorded)
    effects = "viscous_friction,valve_flow,sprocket_ripple,angle_bias"
    code, shown, found = run(recorded, effects, "--out", page)
    assert (code, found["schema"]) == (0, "pamsim-check/2")
    assert sum(found["protocols"].values()) == 8
    assert set(found["held_out"]) < {p.stem for p in recorded.glob("*.csv")}
    angle = found["channels"]["angle"]
    assert angle["low"] < 0.0 < angle["high"]
    assert angle["missed"] == pytest.approx(angle["floor"], rel=0.3)  # nothing is hidden
    assert {"viscous_friction", "valve_flow", "angle_bias"} <= set(found["seen"])
    (friction,) = (one for one in found["effects"] if one["name"] == "viscous_friction")
    assert (friction["parameter"], friction["channel"]) == ("joint.shaft.damping", "angle")
    assert friction["typical"] == pytest.approx(0.5 * 0.3247)  # half as much again
    assert 0.0 < friction["shows_from"] < friction["typical"]
    # One trial of each input, those that fits see: a long run of many trials costs no more.
    assert sorted(name[:-2] for name in found["run"]["trials"]) == ["bursts", "triangle"]
    assert "viscous friction" in (page / "index.html").read_text()
    assert all((page / name).stat().st_size > 1e4 for name in ("signals.png", "effects.png"))
    assert json.loads((page / "check.json").read_text())["seen"] == found["seen"]
    assert "suspicious" not in shown
    assert "no link has a certain gap" in shown
    assert "e+" not in shown  # sizes are read, not decoded
    links = found["links"]
    assert [one["link"] for one in links["outputs"]] == [
        "valves and air", "valves and air", "muscle", "muscle", "joint and transmission"
    ]  # fmt: skip
    assert links["born_in"] == ""
    for one in links["outputs"]:
        assert one["gap"] == pytest.approx(one["floors"] * one["floor"])


def test_the_link_in_which_a_gap_begins_is_reported(tmp_path, run):
    hide("mas20_arm", {"coulomb_friction": 1.0}, **SETTINGS).save(tmp_path / "data")
    code, shown, found = run(tmp_path / "data", "viscous_friction")
    assert code == 0  # a gap is no mistake of the recording
    assert found["links"]["born_in"] == "joint and transmission"
    outputs = found["links"]["outputs"]
    assert [one["channel"] for one in outputs if one["exceeds"]] == ["angle"]
    assert "the gap begins in joint and transmission" in shown


def test_a_turned_sign_and_a_channel_that_stands_still_are_suspicious(recorded, tmp_path, run):
    turned = angle_times(-1.0, recorded, tmp_path / "turned")
    code, shown, _ = run(turned, "viscous_friction")
    assert (code, "in all trials" in shown) == (1, True)
    assert "suspicious: the sign of angle_deg looks turned: multiply by -1" in shown
    still = angle_times(0.0, recorded, tmp_path / "stuck")
    (found,) = pamsim.check(still, effects=ONE).suspicions
    assert "angle does not change; if a machine holds it, state shaft = 'angle'" in found


def test_a_rod_that_a_machine_holds_may_stand_still(tmp_path):
    time = np.arange(0.0, 1.0, 0.01)
    held = np.column_stack([np.where(time < 0.5, 3e5, 4e5), 0.0 * time])
    run = pamsim.simulate(
        pamsim.load_rig("muscle_bench"),
        pamsim.Experiment(
            drive={"muscle": "pressure_set", "rod": "length"},
            command_time=time,
            command_value=held,
            start_pressure=[3e5],
            duration=0.99,
            sample_rate=100.0,
        ),
    )
    run.save(tmp_path)
    assert pamsim.check(tmp_path, effects=ONE).suspicions == ()


def test_trials_that_are_all_held_out_show_their_effects_all_the_same(recorded):
    every = pamsim.check(recorded, effects=ONE)
    assert pamsim.plot(every).axes
    held = pamsim.check(recorded, effects=ONE, hold_out=["triangle"])
    assert [one.name for one in held.effects] == [one.name for one in every.effects]


def test_a_set_point_above_the_supply_is_reported_with_the_number_used(recorded):
    weak = pamsim.load_rig("mas20_arm").with_parameters({"valve.supply_pressure": 3e5})
    notes = pamsim.check(recorded, rig=weak, effects=ONE).notes
    first, second = (note for note in notes if "above its supply" in note)
    highest = max(
        np.genfromtxt(p, delimiter=",", names=True)["p1_set_kpa"].max()
        for p in recorded.glob("triangle*.csv")
    )
    assert f"muscle_1: a set point of {highest:,.6g} kPa is above its supply" in first
    assert first.endswith("supply of 300 kPa, which the simulation has instead")
    assert second.startswith("muscle_2")


def test_the_progress_counts_simulations_and_foresees_how_many_there_will_be(tmp_path):
    steps = []
    settings = {**SETTINGS, "protocols": ("triangle",), "repeats": 1}
    recording = hide("mas20_arm", {}, **settings, progress=lambda *now: steps.append(now))
    assert steps == [(done, 2, "simulating trials") for done in range(2)]
    recording.save(tmp_path / "data")
    steps.clear()
    effects = [*ONE, "valve_flow"]
    pamsim.check(tmp_path / "data", effects=effects, progress=lambda *now: steps.append(now))
    assert [done for done, _, _ in steps] == list(range(len(steps)))
    # The trials as they are, their rest and three links; then of one of them the rig, nudged, its
    # sensitivities, two effects.
    assert [what for _, _, what in steps[:11]] == [
        *["simulating the rig as it is"] * 2,
        *["simulating single links"] * 8,
        "simulating each effect",
    ]
    assert len(steps) <= steps[-1][1] <= len(steps) + 3


def test_what_the_inputs_cannot_show_is_said(tmp_path):
    hide("mas20_arm", {}, **SETTINGS, measured_drive=True).save(tmp_path / "data")
    found = pamsim.check(tmp_path / "data", effects=[*ONE, "air_leak", "valve_flow"])
    assert found.seen == ("viscous_friction",)
    assert set(found.unseen) == {"air_leak", "valve_flow"}
    assert any("measured pressures" in note for note in found.notes)


def test_geoms_that_may_touch_are_reported(recorded, tmp_path):
    folder = shutil.copytree(shipped_rigs() / "mas20_arm", tmp_path / "arm")
    mjcf = folder / "mas20_arm.xml"
    pad = '<geom name="pad" type="sphere" size="0.01" pos="0 0 5" contype="1" conaffinity="1"/>'
    mjcf.write_text(mjcf.read_text().replace("<worldbody>", f"<worldbody>{pad}"))
    found = pamsim.check(recorded, rig=folder, effects=ONE)
    assert any("geoms of the MJCF may touch, though none do" in note for note in found.notes)
    quiet = pamsim.check(recorded, effects=ONE)
    assert not any("touch" in note or "smooth" in note for note in quiet.notes)


def test_a_signal_that_jumps_when_a_parameter_hardly_changes_is_not_smooth(monkeypatch, recorded):
    """Friction that holds or lets go by the last digits of the force, planted in the simulation."""
    blocks = TrialPredictor.blocks
    nudged = iter([False] * 6 + [True])  # after the rig, three sensitivities, two effects and a run

    def jumpy(self, prediction):
        shift = np.radians(0.1) if next(nudged) else 0.0
        return [
            replace(b, residual=b.residual + shift) if b.channel == "angle" else b
            for b in blocks(self, prediction)
        ]

    monkeypatch.setattr(TrialPredictor, "blocks", jumpy)
    dry = pamsim.load_rig("mas20_arm").with_parameters({"joint.shaft.frictionloss": 0.1})
    found = pamsim.check(recorded, rig=dry, effects=ONE)
    (note,) = (note for note in found.notes if note.startswith("angle moves by 0.1 deg where"))
    assert note.endswith("suspected: dry friction, which holds or lets go")
