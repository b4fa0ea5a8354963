"""What every command has in the same way: JSON on standard output, the page, completion."""

from __future__ import annotations

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

from pamsim.cli.command import Command
from pamsim.cli.main import cli, main
from pamsim.cli.output import progress_bar, show_page
from pamsim.recordings.rig_file import shipped_rigs

MAP = resources.files("pamsim") / "data" / "dmsp20_300_force_map.csv"


def ended(monkeypatch, *words):
    monkeypatch.setattr("sys.argv", ["pamsim", *words])
    with pytest.raises(SystemExit) as end:
        main()
    return end.value.code


def completed(*words):
    args, incomplete = list(words[:-1]), words[-1]
    return [c.value for c in ShellComplete(cli, {}, "pamsim", "").get_completions(args, incomplete)]


def names():
    return cli.list_commands(click.Context(cli))


CATALOGS = [["list", one] for one in ("rigs", "protocols", "params", "effects", "models")]


def test_every_command_is_quiet_or_verbose_by_the_same_flags():
    for name in names():
        found = cli.get_command(click.Context(cli), name)
        for command in found.commands.values() if isinstance(found, click.Group) else (found,):
            assert isinstance(command, Command), name
            flags = [flag for p in command.params for flag in p.opts]
            assert {"-q", "--quiet", "-v", "--verbose"} <= set(flags), name
            assert len(flags) == len(set(flags)), name


@pytest.mark.parametrize(
    "words",
    [
        ["step", "--pressure", "300,100", "--duration", "0.1"],
        ["fit", str(MAP), "--model", "six_parameter"],
    ],
    ids=lambda words: words[0],
)
def test_quiet_prints_the_answer_alone_which_is_last_otherwise(monkeypatch, capsys, words):
    assert ended(monkeypatch, *words) == 0
    whole = capsys.readouterr()
    assert ended(monkeypatch, *words, "-q") == 0
    answer = capsys.readouterr()
    assert answer.out
    assert whole.out.endswith(answer.out)
    assert len(answer.out) < len(whole.out)
    assert answer.err == whole.err == ""


@pytest.mark.parametrize("words", CATALOGS)
def test_a_quiet_list_has_a_name_in_each_line_which_shows_a_card(monkeypatch, capsys, words):
    assert ended(monkeypatch, *words, "-q") == 0
    listed = capsys.readouterr().out.split("\n")[:-1]
    assert len(listed) == len(set(listed)) > 3
    for name in (listed[0], listed[-1]):
        assert ended(monkeypatch, *words, name.partition(":")[0]) == 0
        assert capsys.readouterr().out.startswith(name.partition(":")[0])
    assert ended(monkeypatch, *words, "no_such_thing") == 2
    assert "known: " in capsys.readouterr().err


def test_a_quiet_command_may_give_json_on_standard_output(monkeypatch, capsys):
    assert ended(monkeypatch, "list", "rigs", "mas20_arm", "-q", "--json", "-") == 0
    printed = capsys.readouterr()
    assert json.loads(printed.out)["rigs"][0]["name"] == "mas20_arm"
    assert printed.err.startswith("mas20_arm: ")


def test_verbose_logs_on_standard_error_and_prints_no_less(monkeypatch, capsys):
    words = ["list", "protocols", "bursts"]
    assert ended(monkeypatch, *words) == 0
    plain = capsys.readouterr().out
    assert ended(monkeypatch, *words, "-v") == 0
    printed = capsys.readouterr()
    assert printed.out == plain
    first, last = printed.err.splitlines()
    assert "mujoco" in first
    assert "done" in last


def test_only_verbose_shows_where_an_error_comes_from(monkeypatch, capsys):
    assert ended(monkeypatch, "list", "protocols", "bursst") == 2
    plain = capsys.readouterr().err
    assert "Traceback" not in plain
    assert ended(monkeypatch, "list", "protocols", "bursst", "-v") == 2
    log = capsys.readouterr().err
    assert "Traceback" in log
    assert log.endswith(plain)


def on_a_terminal(command, **environment):
    """What a command prints on a terminal."""
    ours, theirs = os.openpty()
    env = {name: value for name, value in os.environ.items() if name != "NO_COLOR"} | environment
    words = [sys.executable, "-m", "pamsim", *command]
    subprocess.run(words, stdout=theirs, stderr=theirs, env=env, check=False)
    os.close(theirs)
    shown = os.read(ours, 65536).decode()
    os.close(ours)
    return shown


def test_colours_are_for_terminals(monkeypatch, capsys):
    words = ["list", "protocols", "bursst"]
    assert ended(monkeypatch, *words) == 2
    plain = capsys.readouterr().err
    assert "\x1b" not in plain
    coloured = on_a_terminal(words)
    assert "\x1b[31merror:" in coloured
    assert on_a_terminal(words, NO_COLOR="1").replace("\r", "") == plain


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize("flags", [[], ["-q"], ["-v"]])
def test_a_progress_line_has_total_and_time_left_and_verbose_logs_the_stages(monkeypatch, flags):
    shown = Terminal()
    monkeypatch.setattr("sys.stderr", shown)

    @click.command(cls=Command)
    def computing():
        with progress_bar() as progress:
            for done in range(5):
                time.sleep(0.12)  # more than what the line waits between two looks
                progress(done, 5, f"part {done // 3}")

    computing.main(flags, standalone_mode=False)
    line = re.search(r"part 1: .*4/5 \[00:00<00:0\d", shown.getvalue())
    assert bool(line) == (flags != ["-q"])
    assert [stage in shown.getvalue() for stage in ("part 0 (0 of 5)", "part 1 (3 of 5)")] == [
        flags == ["-v"]
    ] * 2


def test_json_on_standard_output_is_all_that_is_there(monkeypatch, capsys):
    assert ended(monkeypatch, "list", "models", "--json", "-") == 0
    printed = capsys.readouterr()
    assert json.loads(printed.out)["schema"] == "pamsim-models/1"
    assert "force laws" in printed.err
    assert ended(monkeypatch, "list", "models") == 0
    printed = capsys.readouterr()
    assert "force laws" in printed.out  # the next command prints where it should
    assert printed.err == ""


def test_an_error_with_json_on_standard_output_leaves_it_empty(monkeypatch, capsys):
    assert ended(monkeypatch, "list", "effects", "no_such_effect", "--json", "-") == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert "no_such_effect" in printed.err


@pytest.mark.parametrize("opened", [True, False])
def test_open_shows_the_page(monkeypatch, tmp_path, capsys, opened):
    shown = []
    monkeypatch.setattr(click, "launch", shown.append)
    page = tmp_path / "index.html"
    command = cli.get_command(click.Context(cli), "check")
    context = command.make_context("check", ["data", *(["--open"] if opened else [])])
    with context:
        show_page(page)
    assert shown == ([str(page)] if opened else [])
    assert f"page: {page}" in capsys.readouterr().out


def test_every_command_with_a_page_opens_it():
    with_page = ("calibrate", "check", "diagnose", "identify", "replicate", "reproduce")
    context = click.Context(cli)
    for name in with_page:
        flags = [f for p in cli.get_command(context, name).params for f in p.opts]
        assert "--open" in flags, name


def test_a_shell_completes_commands_rigs_and_effects():
    assert completed("diag") == ["diagnose"]
    rigs = sorted(path.parent.name for path in shipped_rigs().glob("*/params.toml"))
    assert completed("step", "--rig", "") == [*rigs, ""]
    assert completed("step", "--rig", "mus") == ["muscle_bench", "mus"]
    assert completed("diagnose", "data", "--without", "air_leak,coulo") == [
        "air_leak,coulomb_friction"
    ]
    assert completed("check", "data", "--effects", "angle_bi") == ["angle_bias"]


@pytest.mark.parametrize(
    ("words", "known"),
    [
        (["list", "models", "plea"], {"pleated", "pleated_shape", "pleated_factor"}),
        (["fit", "map.csv", "--model", "six"], {"six_parameter"}),
        (["list", "effects", "air"], {"air_leak"}),
        (["list", "protocols", "burs"], {"bursts"}),
        (["hide", "air_leak+coulomb"], {"air_leak+coulomb_friction"}),
        (["hide", "none", "--protocols", "triangle,burs"], {"triangle,bursts"}),
        (["list", "params", "joint.shaft.da"], {"joint.shaft.damping"}),
        (["list", "params", "--rig", "two_joint_arm", "joint.elbow.da"], {"joint.elbow.damping"}),
        (["calibrate", "data", "--free", "valve.delay,force.sc"], {"valve.delay,force.scale"}),
        (["replicate", "--paper", "sa"], {"sarosi"}),
        (["reproduce", "--from", "v"], {"vent"}),
        (["step", "--backend", "py"], {"python"}),
        (["fit", "map.csv", "--hold-out", "l"], {"length"}),
        (["new-rig", "mine", "--kind", "b"], {"bench", "bellows"}),
        (["train", "--task", "reg"], {"regulation"}),
    ],
)
def test_a_shell_completes_values(words, known):
    assert set(completed(*words)) == known
