"""What every command has in the same way: JSON on standard output, the page, completion."""

import io
import json
import os
import re
import subprocess
import sys
import time
from importlib import resources

import click
import pytest
from click.shell_completion import ShellComplete

from pamsim.cli.command import Command, progress_bar, show_page
from pamsim.cli.main import cli
from pamsim.recordings.rig_file import shipped_rigs
from tests.typed_command import run

MAP = resources.files("pamsim") / "data" / "dmsp20_300_force_map.csv"
CONTEXT = click.Context(cli)


@pytest.fixture
def typed(monkeypatch, capsys):
    """Runs ``pamsim WORDS``; returns output and errors of the exit code expected."""

    def command(*words, code=0):
        ended, out, err = run(monkeypatch, capsys, *words)
        assert ended == code, err
        return out, err

    return command


def test_every_command_is_quiet_or_verbose_by_the_same_flags_and_opens_its_page():
    for name in cli.list_commands(CONTEXT):
        found = cli.get_command(CONTEXT, name)
        for command in found.commands.values() if isinstance(found, click.Group) else (found,):
            assert isinstance(command, Command), name
            flags = [flag for p in command.params for flag in p.opts]
            assert {"-q", "--quiet", "-v", "--verbose"} <= set(flags), name
            assert len(flags) == len(set(flags)), name
            with_page = ("calibrate", "check", "diagnose", "identify", "replicate", "reproduce")
            assert name not in with_page or "--open" in flags, name


def test_quiet_prints_the_answer_alone_which_is_last_otherwise(typed):
    for words in (
        ["step", "--pressure", "300,100", "--duration", "0.1"],
        ["fit", str(MAP), "--model", "six_parameter"],
    ):
        whole, answer = typed(*words), typed(*words, "-q")
        assert answer[0]
        assert whole[0].endswith(answer[0])
        assert len(answer[0]) < len(whole[0])
        assert answer[1] == whole[1] == ""


def test_a_quiet_list_has_a_name_in_each_line_which_shows_a_card(typed):
    for catalog in ("rigs", "protocols", "params", "effects", "models"):
        listed = typed("list", catalog, "-q")[0].split("\n")[:-1]
        assert len(listed) == len(set(listed)) > 3
        for name in (listed[0], listed[-1]):
            own = name.partition(":")[0]
            assert typed("list", catalog, own)[0].startswith(own)
        assert "known: " in typed("list", catalog, "no_such_thing", code=2)[1]


def test_json_on_standard_output_is_all_that_is_there(typed):
    out, err = typed("list", "models", "--json", "-")
    assert json.loads(out)["schema"] == "pamsim-models/1"
    assert "force laws" in err
    out, err = typed("list", "models")
    assert "force laws" in out  # the next command prints where it should
    assert err == ""
    out, err = typed("list", "effects", "no_such_effect", "--json", "-", code=2)
    assert out == ""
    assert "no_such_effect" in err
    out, err = typed("list", "rigs", "mas20_arm", "-q", "--json", "-")
    assert json.loads(out)["rigs"][0]["name"] == "mas20_arm"
    assert err.startswith("mas20_arm: ")


def test_verbose_logs_on_standard_error_and_shows_where_an_error_comes_from(typed):
    words = ["list", "protocols", "bursts"]
    plain, began = typed(*words), time.perf_counter()
    verbose, elapsed = typed(*words, "-v"), time.perf_counter() - began
    assert verbose[0] == plain[0]
    first, last = verbose[1].splitlines()
    assert 0.0 <= float(first.split()[0]) <= float(last.split()[0]) < elapsed + 0.01  # as rounded
    assert "mujoco" in first
    assert "done" in last
    _, plain = typed("list", "protocols", "bursst", code=2)
    _, log = typed("list", "protocols", "bursst", "-v", code=2)
    assert "Traceback" not in plain
    assert "Traceback" in log
    assert log.endswith(plain)


def test_colours_are_for_terminals(typed):
    words = ["list", "protocols", "bursst"]

    def on_a_terminal(**environment):
        ours, theirs = os.openpty()
        env = {k: value for k, value in os.environ.items() if k != "NO_COLOR"} | environment
        command = [sys.executable, "-m", "pamsim", *words]
        subprocess.run(command, stdout=theirs, stderr=theirs, env=env, check=False)
        os.close(theirs)
        shown = os.read(ours, 65536).decode()
        os.close(ours)
        return shown

    _, plain = typed(*words, code=2)
    assert "\x1b" not in plain
    assert "\x1b[31merror:" in on_a_terminal()
    assert on_a_terminal(NO_COLOR="1").replace("\r", "") == plain


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_progress_line_has_total_and_time_left_and_verbose_logs_the_stages(monkeypatch):
    @click.command(cls=Command)
    def computing():
        with progress_bar() as progress:
            for done in range(5):
                time.sleep(0.12)  # more than what the line waits between two looks
                progress(done, 5, f"part {done // 3}")

    for flags in ([], ["-q"], ["-v"]):
        shown = Terminal()
        monkeypatch.setattr("sys.stderr", shown)
        computing.main(flags, standalone_mode=False)
        line = re.search(r"part 1: .*4/5 \[00:00<00:0\d", shown.getvalue())
        assert bool(line) == (flags != ["-q"])
        for stage in ("part 0 (0 of 5)", "part 1 (3 of 5)"):
            assert (stage in shown.getvalue()) == (flags == ["-v"])


def test_open_shows_the_page(monkeypatch, tmp_path, capsys):
    page = tmp_path / "index.html"
    for flags in (["--open"], []):
        shown = []
        monkeypatch.setattr(click, "launch", shown.append)
        context = cli.get_command(CONTEXT, "check").make_context("check", ["data", *flags])
        with context:
            show_page(page)
        assert shown == ([str(page)] if flags else [])
        assert f"page: {page}" in capsys.readouterr().out


RIGS = sorted(path.parent.name for path in shipped_rigs().glob("*/params.toml"))
COMPLETED = {
    "diag": ["diagnose"],
    "step --rig ": [*RIGS, ""],
    "step --rig mus": ["muscle_bench", "mus"],
    "diagnose data --without air_leak,coulo": ["air_leak,coulomb_friction"],
    "check data --effects angle_bi": ["angle_bias"],
    "list models plea": ["pleated", "pleated_shape", "pleated_factor"],
    "fit map.csv --model six": ["six_parameter"],
    "list effects air": ["air_leak"],
    "list protocols burs": ["bursts"],
    "hide air_leak+coulomb": ["air_leak+coulomb_friction"],
    "hide none --protocols triangle,burs": ["triangle,bursts"],
    "list params joint.shaft.da": ["joint.shaft.damping"],
    "list params --rig two_joint_arm joint.elbow.da": ["joint.elbow.damping"],
    "calibrate data --free valve.delay,force.sc": ["valve.delay,force.scale"],
    "replicate --paper sa": ["sarosi"],
    "reproduce --from v": ["vent"],
    "step --backend py": ["python"],
    "fit map.csv --hold-out l": ["length"],
    "new-rig mine --kind b": ["bench", "bellows"],
    "train --task reg": ["regulation"],
}


def test_a_shell_completes_commands_and_values():
    for typed, known in COMPLETED.items():
        *args, incomplete = typed.split(" ")
        found = ShellComplete(cli, {}, "pamsim", "").get_completions(args, incomplete)
        assert sorted(one.value for one in found) == sorted(known), typed
