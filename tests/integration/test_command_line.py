"""The command as a user types it: results, one-line errors, exit codes."""

from __future__ import annotations

import contextlib
import csv
import errno
import json
import os
import signal
import sys
import time
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner

from pamsim.cli.main import cli, with_flags
from pamsim.core.files import results_folder
from tests.typed_command import run
from tests.unit.report.page_laws import check_page


def broken_rig(tmp_path, old, new):
    """A copy of the shipped rig with one text replaced in its params.toml or MJCF."""
    from pamsim.recordings.rig_file import shipped_rigs

    folder = tmp_path / "rig"
    folder.mkdir()
    found = False
    for path in (shipped_rigs() / "mas20_arm").glob("*.*"):
        if path.suffix in (".toml", ".xml"):
            text = path.read_text(encoding="utf-8")
            found = found or old in text
            (folder / path.name).write_text(text.replace(old, new), encoding="utf-8")
    assert found, f"{old!r} is in no file of the rig"
    return str(folder)


BAD_INPUT = {
    "unknown rig": (
        ["step", "--rig", "mas21_arm", "--pressure", "1,1"],
        "did you mean 'mas20_arm'",
    ),
    "bad unit": (["step", "--pressure", "4.87barr,0"], "'barr' is not known"),
    "wrong quantity": (["step", "--pressure", "4kg,0"], "does not measure"),
    "negative pressure": (["step", "--pressure", "-5,0"], "-5 kPa is negative"),
    "RK4": (["step", "--pressure", "300,0", "--integrator", "RK4"], "RK4 evaluates the muscles"),
    "NaN control": (["step", "--valve", "nan,0", "--start", "1bar,1bar"], "nan at entry 0"),
    "valve beyond 1": (["step", "--valve", "2,0", "--start", "1bar,1bar"], "outside [-1, 1]"),
    "no start": (["step", "--valve", "1,0"], "--valve needs --start"),
    "nothing to step": (["step"], "either --pressure or --valve"),
    "wrong number of muscles": (["step", "--pressure", "300"], "commands 1 muscles"),
    "nowhere to hide": (["hide", "coulomb_friction"], "Missing option '--out'"),
    "nowhere to sweep": (["sweep", "study.toml"], "Missing option '--out'"),
    "no number": (["step", "--pressure", "high,low"], "'high' is not a number"),
    "negative load": (["step", "--pressure", "300,0", "--load", "-1"], "experiment.load = -1"),
    "sampling off the grid": (
        ["step", "--pressure", "300,0", "--timestep-ms", "0.3"],
        "not a whole number of time steps",
    ),
    "step longer than the regulator": (
        ["step", "--pressure", "300,0", "--timestep-ms", "40", "--sample-hz", "25"],
        "a time step of 40 ms is longer than the 21 ms in which the pressure regulator of muscle_1",
    ),
    "zero time step": (["step", "--pressure", "300,0", "--timestep-ms", "0"], "time step"),
    "unknown backend": (["step", "--pressure", "9,0", "--backend", "gpu"], "no backend 'gpu'"),
    "unknown start": (["reproduce", "--from", "vnet"], "did you mean 'vent'"),
    "unknown command": (["reprodcue"], "did you mean 'reproduce'"),
    "command of a list": (["rigs"], "it is `pamsim list rigs`"),
    "unknown list": (["list", "rig"], "did you mean 'rigs'"),
    "unknown option": (["reproduce", "--ot", "x"], "--ot"),
    "unknown camera": (["render", "x.png", "--camera", "sky"], "no camera 'sky'"),
}


@pytest.mark.parametrize("name", BAD_INPUT)
def test_bad_input_is_one_clear_line_and_exit_2(monkeypatch, capsys, name):
    args, expected = BAD_INPUT[name]
    code, out, err = run(monkeypatch, capsys, *args)
    assert code == 2
    assert expected in err
    assert "Traceback" not in err + out
    message = [line for line in err.splitlines() if "rror:" in line]
    assert len(message) == 1, err


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('unit = "cm^3"', 'unit = "cm^2"', "muscle.chamber.dead_volume: unit 'cm^2' does not"),
        ('integrator="Euler"', 'integrator="RK4"', "RK4"),
        (
            "polytropic_index = { value = 1.2",
            "polytropic_index = { value = 2.2",
            "outside [1, 1.4]",
        ),
        ('tendon = "chain_1"', 'tendon = "chian_1"', "did you mean 'chain_1'"),
        ("<mujoco", "<mujuco", "mas20_arm.xml"),
        (
            "</mujoco>",
            "<actuator><motor name='m' joint='shaft'/></actuator></mujoco>",
            "may not have actuators",
        ),
        ('"joint.shaft.damping"', '"joint.shft.damping"', "no joint 'shft'"),
    ],
)
def test_a_broken_rig_is_one_clear_line_and_exit_2(
    tmp_path, monkeypatch, capsys, old, new, expected
):
    rig = broken_rig(tmp_path, old, new)
    code, _, err = run(monkeypatch, capsys, "step", "--rig", rig, "--pressure", "300,0")
    assert (code, err.count("\n")) == (2, 1), err
    assert expected in err


@pytest.mark.usefixtures("unchecked")
def test_a_diverging_simulation_says_when_and_keeps_what_it_has(tmp_path, monkeypatch, capsys):
    # An arm of one gram on stiff muscles, undamped: far too fast for the step.
    rig = broken_rig(tmp_path, "value = 0.3247,", "value = 0,")
    toml = Path(rig) / "params.toml"
    light = '"body.arm.mass" = { value = 0.001, unit = "kg", source = "assumed" }'
    toml.write_text(toml.read_text().replace("[native]", f"[native]\n{light}"))
    args = ["--pressure", "487,0", "--timestep-ms", "5", "--sample-hz", "20", "--load", "0"]
    out = tmp_path / "kept"
    code, _, err = run(monkeypatch, capsys, "step", "--rig", rig, *args, "--out", str(out))
    assert code == 2, err
    assert "simulation broke down" in err
    assert (out / "step.csv").read_text().startswith("time_s,")


def test_step_writes_recording_figure_and_json(tmp_path, monkeypatch, capsys):
    target = tmp_path / "r.json"
    code, out, _ = run(
        monkeypatch, capsys, "step", "--pressure", "4.87bar,0", "--load", "1200g", "--duration",
        "3", "--sensors", "--out", str(tmp_path / "d"), "--json", str(target),
    )  # fmt: skip
    assert code == 0
    result = json.loads(target.read_text())
    assert result["load_kg"] == 1.2
    assert 30.0 < result["final_deg"] < 40.0
    assert "deg" in out
    index = tomllib.loads((tmp_path / "d" / "recording.toml").read_text())
    assert index["schema"] == "pamsim-recording/1"
    trial = index["trial"][0]
    assert (trial["drive"], trial["load_kg"], trial["protocol"]) == ("pressure_set", 1.2, "step")
    rows = list(csv.DictReader((tmp_path / "d" / trial["file"]).read_text().splitlines()))
    assert len(rows) == 1501
    assert set(rows[0]) == {
        *("time_s", "p1_set_kpa", "p2_set_kpa", "p1_kpa", "p2_kpa"),
        *("angle_deg", "force1_n", "force2_n"),
    }
    # through the encoder every angle is a whole number of increments
    counts = float(rows[-1]["angle_deg"]) / 0.144
    assert abs(counts - round(counts)) < 1e-6
    assert (tmp_path / "d" / "step.png").stat().st_size > 10_000
    page = (tmp_path / "d" / "index.html").read_text(encoding="utf-8")
    assert f"{result['start_deg']:.2f} → {result['final_deg']:.2f} deg" in page
    assert f"settles in {result['settling_s']:.3f} s" in page
    check_page(page)


def test_every_command_has_help():
    for name in cli.list_commands(None):
        shown = CliRunner().invoke(cli, [name, "--help"])
        assert shown.exit_code == 0
        assert "Usage" in shown.output


@pytest.mark.parametrize(
    ("message", "shown"),
    [
        ("`speed` 0 must be above 0", "--speed 0 must be above 0"),
        ("give `pressure` and `width`", "give --pressure and `width`"),
        ("no trial in `recording`; write a film: `pamsim render`",
         "no trial in RECORDING; write a film: `pamsim render`"),
    ],
)  # fmt: skip
def test_arguments_of_the_library_are_shown_as_flags_of_the_command(message, shown):
    assert with_flags(message, cli.get_command(None, "view")) == shown


def test_nothing_is_written_over_without_force(tmp_path, monkeypatch, capsys):
    file = tmp_path / "models.json"
    assert run(monkeypatch, capsys, "list", "models", "--json", str(file))[0] == 0
    file.write_text("mine")
    code, _, err = run(monkeypatch, capsys, "list", "models", "--json", str(file))
    assert (code, file.read_text()) == (2, "mine")
    assert err.endswith("is there already; --force replaces it\n")
    assert run(monkeypatch, capsys, "list", "models", "--json", str(file), "--force")[0] == 0
    assert json.loads(file.read_text())["schema"] == "pamsim-models/1"


def test_a_folder_with_results_is_refused_before_anything_is_computed(
    tmp_path, monkeypatch, capsys
):
    (tmp_path / "old.txt").write_text("")
    for args in (["reproduce"], ["fit", "none.csv", "--compare"], ["hide", "none"]):
        code, _, err = run(monkeypatch, capsys, *args, "--out", str(tmp_path))
        assert code == 2
        assert f"{tmp_path} holds results already (old.txt); --force replaces them" in err
    assert [path.name for path in tmp_path.iterdir()] == ["old.txt"]


def test_a_bad_option_leaves_no_folder(tmp_path, monkeypatch, capsys):
    args = ["hide", "none", "--out", str(tmp_path / "out"), "--duration"]
    assert run(monkeypatch, capsys, *args, "x")[0] == 2
    assert run(monkeypatch, capsys, *args, "3s", "--rig", "mas21_arm")[0] == 2
    assert not (tmp_path / "out").exists()


def test_two_runs_do_not_write_one_folder(tmp_path, monkeypatch, capsys):
    log = tmp_path / "log.csv"
    log.write_text("")
    with results_folder(tmp_path, force=True):
        for args in (
            ["hide", "none", "--force"],
            ["import", str(log), "--rig", "mas20_arm"],
            ["new-rig", "arm", "--kind", "joint"],
        ):
            code, _, err = run(monkeypatch, capsys, *args, "--out", str(tmp_path))
            assert (code, f"another run writes to {tmp_path}" in err) == (2, True), args


def test_what_the_system_refuses_is_one_line(monkeypatch, capsys):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device", "/disk/page.html")

    monkeypatch.setattr("pamsim.fitting.models.models", full)
    code, _, err = run(monkeypatch, capsys, "list", "models")
    assert (code, err) == (2, "pamsim: error: /disk/page.html: No space left on device\n")


def test_a_policy_that_is_there_is_refused_before_the_training(tmp_path, monkeypatch, capsys):
    (tmp_path / "policy.json").write_text("old")
    monkeypatch.setattr("pamsim.envs.train.train", lambda **_: pytest.fail("it trains"))
    code, _, err = run(monkeypatch, capsys, "train", "--out", str(tmp_path / "policy.npz"))
    assert (code, "policy.json is there already; --force" in err) == (2, True)


def test_to_be_ended_is_to_be_interrupted(monkeypatch, capsys):
    before = signal.getsignal(signal.SIGTERM)
    monkeypatch.setattr(
        "pamsim.fitting.models.models", lambda *_: os.kill(os.getpid(), signal.SIGTERM)
    )
    try:
        code, _, err = run(monkeypatch, capsys, "list", "models")
    finally:
        signal.signal(signal.SIGTERM, before)
    assert (code, err.strip()) == (130, "pamsim: interrupted")


def test_an_interruption_that_a_compiled_module_swallows_still_ends_the_run(monkeypatch, capsys):
    def initialised(*_):
        with contextlib.suppress(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(1.0)
        raise ImportError("initialization failed")

    monkeypatch.setattr("pamsim.fitting.models.models", initialised)
    before = signal.getsignal(signal.SIGINT), sys.unraisablehook
    code, _, err = run(monkeypatch, capsys, "list", "models")
    assert (code, err.strip()) == (130, "pamsim: interrupted")
    assert (signal.getsignal(signal.SIGINT), sys.unraisablehook) == before

    def missing(*_):
        raise ImportError("no module named x")

    monkeypatch.setattr("pamsim.fitting.models.models", missing)
    with pytest.raises(ImportError, match="no module named x"):
        run(monkeypatch, capsys, "list", "models")
