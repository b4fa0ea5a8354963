"""What every command has in the same way: JSON on standard output, the page, completion."""

from __future__ import annotations

import json

import click
import pytest
from click.shell_completion import ShellComplete

from pamsim.cli.main import cli, main
from pamsim.cli.output import show_page
from pamsim.store.rig_file import shipped_rigs


def ended(monkeypatch, *words):
    monkeypatch.setattr("sys.argv", ["pamsim", *words])
    with pytest.raises(SystemExit) as end:
        main()
    return end.value.code


def completed(*words):
    args, incomplete = list(words[:-1]), words[-1]
    return [c.value for c in ShellComplete(cli, {}, "pamsim", "").get_completions(args, incomplete)]


def test_json_on_standard_output_is_all_that_is_there(monkeypatch, capsys):
    assert ended(monkeypatch, "models", "--json", "-") == 0
    printed = capsys.readouterr()
    assert json.loads(printed.out)["schema"] == "pamsim-models/1"
    assert "force laws" in printed.err
    assert ended(monkeypatch, "models") == 0
    printed = capsys.readouterr()
    assert "force laws" in printed.out  # the next command prints where it should
    assert printed.err == ""


def test_an_error_with_json_on_standard_output_leaves_it_empty(monkeypatch, capsys):
    assert ended(monkeypatch, "effects", "no_such_effect", "--json", "-") == 2
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
    assert completed("check", "data", "--effects", "angle_b") == ["angle_bias"]
