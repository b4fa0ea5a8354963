"""The command as a user types it: results, one-line errors, exit codes."""

import contextlib
import csv
import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import time
import tomllib

import click
import pytest
from click.testing import CliRunner

from pamsim.cli.main import cli, with_flags
from pamsim.core.files import results_folder
from pamsim.recordings.rig_file import shipped_rigs
from tests.unit.report.page_laws import check_page


@pytest.fixture
def broken_rig(tmp_path):
    """Makes a copy of the shipped rig with a text replaced in its params.toml or MJCF."""

    def broken(old, new):
        folder, found = tmp_path / "rig", 0
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(shipped_rigs() / "mas20_arm", folder)
        for path in (folder / "params.toml", *folder.glob("*.xml")):
            text = path.read_text(encoding="utf-8")
            found += text.count(old)
            path.write_text(text.replace(old, new), encoding="utf-8")
        assert found, f"{old!r} is in no file of the rig"
        return folder

    return broken


BAD_INPUT = (
    ("step --rig mas21_arm --pressure 1,0", "did you mean 'mas20_arm'"),
    ("step --pressure 4.87barr,0", "'barr' is not known"),
    ("step --pressure 4kg,0", "does not measure"),
    ("step --pressure -5,0", "-5 kPa is negative; give 0 or more"),
    ("step --pressure 300,0 --integrator RK4", "RK4 evaluates the muscles"),
    ("step --valve nan,0 --start 1bar,1bar", "nan at entry 0"),
    ("step --valve 2,0 --start 1bar,1bar", "outside [-1, 1]"),
    ("step --valve 1,0", "--valve needs --start"),
    ("step", "either --pressure or --valve"),
    ("step --pressure 300,300", "nothing changes: give the pressures before the step, by --start"),
    ("step --pressure 487,0 --start 300", "--start has 1 pressures for 2 muscles"),
    ("import x.csv --rig mas20_arm --out o --segments nan:1", "write BEGIN:END,BEGIN:END"),
    ("step --pressure 300", "has 2 muscles (muscle_1, muscle_2), the drive has 1: give"),
    ("step --pressure 400 100", "unexpected extra argument (100): values of a list are joined by"),
    ("hide frictoin --out o", "did you mean 'braid_friction' or 'coulomb_friction' or"),
    ("list effects frictoin", "or 'coulomb_friction'"),
    ("diagnose nowhere --out o", "no data at nowhere: give the folder of a recording, as `pamsim"),
    ("hide coulomb_friction", "missing --out ("),
    ("sweep", "missing argument 'STUDY'; `pamsim sweep --help`"),
    ("import log.csv", "missing --rig (Shipped rig or rig folder that the logs are of), --out ("),
    ("import log.csv --rig=mas20_arm", "error: missing --out ("),
    ("-x", "; `pamsim --help` shows all"),
    ("step --pressure high,low", "'high' is not a number"),
    ("step --pressure 300,0 --load -1", "experiment.load = -1"),
    ("step --pressure 300,0 --load 1200", "in grams, write 1200g"),
    ("step --pressure 300,0 --timestep-ms 0.3", "not a whole number of time steps"),
    (
        "step --pressure 300,0 --timestep-ms 40 --sample-hz 25",
        "a time step of 40 ms is longer than the 21 ms in which the pressure regulator that holds",
    ),
    ("step --pressure 300,0 --timestep-ms 0", "time step"),
    ("step --pressure 9,0 --backend gpu", "no backend 'gpu'"),
    ("reproduce --from vnet", "did you mean 'vent'"),
    ("reprodcue", "did you mean 'reproduce'"),
    ("rigs", "it is `pamsim list rigs`"),
    ("list rig", "did you mean 'rigs'"),
    ("reproduce --ot x", "--ot"),
    ("render x.png --camera sky", "no camera 'sky'"),
    ("step --pressure 300,0 --sample-hz 1e-320", "end before the second sample"),
    *(  # nothing named is not everything
        (f"{command} data {option} ,,", f"{option} ',,' names nothing; leave the option out")
        for command, option in (
            ("check", "--effects"),
            ("diagnose", "--without"),
            ("check", "--hold-out"),
            ("calibrate", "--free"),
            ("identify", "--trial"),
        )
    ),
)


def test_bad_input_is_one_clear_line_and_exit_2(run):
    for line, expected in BAD_INPUT:
        code, out, err = run(*line.split())
        assert code == 2, line
        assert expected in err
        assert "Traceback" not in err + out
        (shown,) = err.splitlines()
        assert shown.startswith("pamsim: error: ")


def test_a_log_in_place_of_a_recording_is_refused_with_what_to_type(run, tmp_path):
    log, empty = tmp_path / "log.csv", tmp_path / "empty"
    log.write_text("time_s,angle_deg\n" + "".join(f"{0.1 * i:.1f},{i}\n" for i in range(20)))
    empty.mkdir()
    for words, expected in (
        (("diagnose", log), f"pamsim import {log} --rig RIG --out data"),
        (("check", log), f"pamsim import {log} --rig RIG --out data"),
        (("diagnose", empty), "as `pamsim import LOG --rig RIG --out FOLDER` writes it"),
        (("identify", log), "the only column is angle_deg; a model needs an input"),
        (("fit", log), "give --model, one of `pamsim list models`"),
    ):
        code, _, err = run(*words)
        assert (code, err.count("\n")) == (2, 1), err
        assert expected in err


def test_a_broken_rig_is_one_clear_line_and_exit_2(broken_rig, run):
    motor = "<actuator><motor name='m' joint='shaft'/></actuator></mujoco>"
    for old, new, expected in (
        ('unit = "cm^3"', 'unit = "cm^2"', "muscle.chamber.dead_volume: unit 'cm^2' does not"),
        ('integrator="Euler"', 'integrator="RK4"', "RK4"),
        ('integrator="Euler"', 'wind="0 NaN 0"', "<option> wind='0 NaN 0' is no number"),
        ("polytropic_index = { value = 1.2", "polytropic_index = { value = 2.2", "outside [1, 1.4"),
        ('tendon = "chain_1"', 'tendon = "chian_1"', "did you mean 'chain_1'"),
        (
            "nominal_length = { value = 250,",
            "nominal_length = { value = 2.5,",
            "its fibres are straight at 0.002",
        ),
        ("<mujoco", "<mujuco", "mas20_arm.xml"),
        ("</mujoco>", motor, "may not have actuators"),
        ('"joint.shaft.damping"', '"joint.shft.damping"', "no joint 'shft'"),
    ):
        code, _, err = run("step", "--rig", broken_rig(old, new), "--pressure", "300,0")
        assert (code, err.count("\n")) == (2, 1), err
        assert expected in err


@pytest.mark.usefixtures("unchecked")
def test_a_diverging_simulation_says_when_and_keeps_what_it_has(tmp_path, broken_rig, run):
    # An arm of one gram on stiff muscles, undamped: far too fast for the step.
    light = '"body.arm.mass" = { value = 0.001, unit = "kg", source = "assumed" }'
    rig = broken_rig("value = 0.3247,", "value = 0,")
    toml = rig / "params.toml"
    toml.write_text(toml.read_text().replace("[native]", f"[native]\n{light}"))
    args = ["--pressure", "487,0", "--timestep-ms", "5", "--sample-hz", "20", "--load", "0"]
    code, _, err = run("step", "--rig", rig, *args, "--out", tmp_path / "kept")
    assert (code, "simulation broke down" in err) == (2, True), err
    assert (tmp_path / "kept" / "step.csv").read_text().startswith("time_s,")


def test_step_writes_recording_figure_and_json(tmp_path, run):
    target, folder = tmp_path / "r.json", tmp_path / "d"
    args = ["--pressure", "4.87bar,0", "--load", "1200g", "--duration", "3", "--sensors"]
    code, out, _ = run("step", *args, "--out", folder, "--json", target)
    result = json.loads(target.read_text())
    assert (code, f"settles in {result['settling_s']:.3f} s" in out) == (0, True)
    brief = run("step", *args[:2], "--duration", "0.1")[1]
    assert "settles" not in brief
    assert "not settled when the recording ended" in brief
    assert result["load_kg"] == 1.2
    assert 30.0 < result["final_deg"] < 40.0
    index = tomllib.loads((folder / "recording.toml").read_text())
    assert index["schema"] == "pamsim-recording/1"
    trial = index["trial"][0]
    assert (trial["drive"], trial["load_kg"], trial["protocol"]) == ("pressure_set", 1.2, "step")
    rows = list(csv.DictReader((folder / trial["file"]).read_text().splitlines()))
    assert len(rows) == 1501
    assert set(rows[0]) == {
        *("time_s", "p1_set_kpa", "p2_set_kpa", "p1_kpa", "p2_kpa"),
        *("angle_deg", "force1_n", "force2_n"),
    }
    # through the encoder every angle is a whole number of increments
    counts = float(rows[-1]["angle_deg"]) / 0.144
    assert abs(counts - round(counts)) < 1e-6
    last = {name: float(text) for name, text in rows[-1].items()}
    assert result["start_pressure_kpa"] == [487.0, 487.0]  # the highest set point
    for key, columns in (
        ("pressure_kpa", ("p1_kpa", "p2_kpa")),
        ("tension_n", ("force1_n", "force2_n")),
    ):
        assert result[f"final_{key}"] == pytest.approx([last[c] for c in columns], rel=1e-6)
    assert (folder / "step.png").stat().st_size > 10_000
    page = (folder / "index.html").read_text(encoding="utf-8")
    assert f"{result['start_deg']:.2f} → {result['final_deg']:.2f} deg" in page
    assert f"settles in {result['settling_s']:.3f} s" in page
    check_page(page)


def test_a_step_begins_at_the_pressures_given_or_without_any(run):
    for words, start in (
        ("--rig muscle_bench --pressure 300", [0.0]),
        ("--valve 0.5,-1 --start 1bar,200", [100.0, 200.0]),
    ):
        code, out, _ = run("step", *words.split(), "--duration", "0.1", "--json", "-")
        assert code == 0
        assert json.loads(out)["start_pressure_kpa"] == start


def test_help_shows_a_default_wherever_there_is_one():
    for name in set(cli.list_commands(None)) - {"list"}:
        command = cli.get_command(None, name)
        assert CliRunner().invoke(cli, [name, "--help"]).exit_code == 0
        context = click.Context(command)
        for option in command.params:
            if isinstance(option, click.Option):
                usual, (_, shown) = option.get_default(context), option.get_help_record(context)
                stated = isinstance(usual, str | float | int) and usual != ""
                assert ("default: " in shown) == (stated and usual is not False), (name, shown)


def test_arguments_of_the_library_are_shown_as_flags_of_the_command():
    film = "write a film: `pamsim render`"
    for message, shown in (
        ("`speed` 0 must be above 0", "--speed 0 must be above 0"),
        ("give `pressure` and `width`", "give --pressure and `width`"),
        (f"no trial in `recording`; {film}", f"no trial in RECORDING; {film}"),
    ):
        assert with_flags(message, cli.get_command(None, "view")) == shown


def test_nothing_is_written_over_without_force(tmp_path, monkeypatch, run):
    file = tmp_path / "models.json"
    listed = ("list", "models", "--json", file)
    assert run(*listed)[0] == 0
    file.write_text("mine")
    code, _, err = run(*listed)
    assert (code, file.read_text()) == (2, "mine")
    assert err.endswith("is there already; --force replaces it\n")
    assert run(*listed, "--force")[0] == 0
    assert json.loads(file.read_text())["schema"] == "pamsim-models/1"
    # Results are refused before anything is computed.
    monkeypatch.setattr("pamsim.envs.train.train", lambda **_: pytest.fail("it trains"))
    (tmp_path / "policy.json").write_text("old")
    code, _, err = run("train", "--out", tmp_path / "policy.npz")
    assert (code, "policy.json is there already; --force" in err) == (2, True)
    out = tmp_path / "out"
    out.mkdir()
    (out / "old.txt").write_text("")
    for line in ("reproduce", "fit none.csv --compare", "hide none"):
        code, _, err = run(*line.split(), "--out", out)
        assert code == 2
        assert f"{out} holds results already (old.txt); --force replaces them" in err
    assert [path.name for path in out.iterdir()] == ["old.txt"]


def test_a_bad_option_leaves_no_folder(tmp_path, run):
    for bad in ("--duration x", "--duration 3s --rig mas21_arm"):
        assert run("hide", "none", "--out", tmp_path / "out", *bad.split())[0] == 2
    assert not (tmp_path / "out").exists()


def test_muscles_of_an_own_rig_go_by_their_names(tmp_path, run):
    folder = tmp_path / "arm"
    assert run("new-rig", "arm", "--kind", "joint", "--out", folder)[0] == 0
    step = ("step", "--rig", folder, "--start", "200,200", "--pressure", "300,100")
    code, out, _ = run(*step, "--duration", "0.1")
    assert code == 0
    assert [line.partition(":")[0] for line in out.splitlines()[:2]] == ["flexor", "extensor"]


def test_two_runs_do_not_write_one_folder(tmp_path, run):
    log = tmp_path / "log.csv"
    log.write_text("")
    with results_folder(tmp_path, force=True):
        for args in (
            ["hide", "none", "--force"],
            ["import", log, "--rig", "mas20_arm"],
            ["new-rig", "arm", "--kind", "joint"],
        ):
            code, _, err = run(*args, "--out", tmp_path)
            assert (code, f"another run writes to {tmp_path}" in err) == (2, True), args


def test_what_the_system_refuses_and_an_interruption_are_one_line(monkeypatch, run):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device", "/disk/page.html")

    def ended(*_):
        os.kill(os.getpid(), signal.SIGTERM)

    def swallowed(*_):
        """As by a compiled module while it is loaded."""
        with contextlib.suppress(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(1.0)
        raise ImportError("initialization failed")

    class Image:
        def __del__(self):
            raise OSError("the library was interrupted")

    def half_made(*_):
        with contextlib.suppress(KeyboardInterrupt):
            ended()
        image = Image()
        del image
        raise KeyboardInterrupt

    llvm, returned = {"__name__": "llvmlite.binding"}, []
    exec("def call(end, returned):\n    end()\n    returned.append(True)", llvm)

    def compiling(*_):
        llvm["call"](ended, returned)
        time.sleep(1.0)

    terminated = signal.getsignal(signal.SIGTERM)
    before = signal.getsignal(signal.SIGINT), sys.unraisablehook
    try:
        for happens, code, line in (
            (full, 2, "pamsim: error: /disk/page.html: No space left on device"),
            (ended, 130, "pamsim: interrupted"),
            (swallowed, 130, "pamsim: interrupted"),
            (compiling, 130, "pamsim: interrupted"),
            (half_made, 130, "pamsim: interrupted"),
        ):
            monkeypatch.setattr("pamsim.fitting.models.models", happens)
            found, _, err = run("list", "models")
            assert (found, err.strip()) == (code, line)
    finally:
        signal.signal(signal.SIGTERM, terminated)
    assert (signal.getsignal(signal.SIGINT), sys.unraisablehook) == before
    assert returned  # a call into LLVM is not left in its midst

    def missing(*_):
        raise ImportError("no module named x")

    monkeypatch.setattr("pamsim.fitting.models.models", missing)
    with pytest.raises(ImportError, match="no module named x"):
        run("list", "models")


@pytest.mark.skipif(sys.platform == "win32", reason="glfw starts no process there")
def test_ctrl_c_in_a_terminal_is_one_line_also_while_an_import_runs_a_process(tmp_path):
    """A terminal interrupts every process of a command: here that of glfw, which MuJoCo imports."""
    code = "import os, signal, time; os.killpg(0, signal.SIGINT); time.sleep(0.2)"
    (tmp_path / "glfw").mkdir()
    (tmp_path / "glfw" / "__init__.py").write_text("import glfw.library")
    (tmp_path / "glfw" / "library.py").write_text(
        f"import subprocess, sys\nsubprocess.run([sys.executable, '-c', {code!r}])"
    )
    env = {name: text for name, text in os.environ.items() if name != "MUJOCO_GL"}
    done = subprocess.run(
        [sys.executable, "-m", "pamsim", "list", "params"],
        env={**env, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])},
        start_new_session=True,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr.strip()) == (130, "pamsim: interrupted")


@pytest.mark.parametrize(("supplies", "code"), [("600, 100", 0), ("100, 150", 1)])
def test_a_sweep_of_which_every_run_fails_exits_with_1(supplies, code, tmp_path, run):
    study = tmp_path / "study.toml"
    study.write_text(
        'schema = "pamsim-sweep/1"\ndesign = "grid"\n[experiment]\nstart_pressure = [300, 300]\n'
        "final = [300, 100]\nduration = 0.1\nsettle = 0.1\n[vary]\n"
        f'"valve.supply_pressure" = {{ values = [{supplies}] }}\n'
    )
    assert run("sweep", study, "--out", tmp_path / "out")[0] == code
