"""What is typed reaches the function that does the job, and what is not typed is its default."""

from __future__ import annotations

import importlib
import inspect
import math
from pathlib import Path

import click
import numpy as np
import pytest

from pamsim.cli.main import cli
from pamsim.core.errors import InputError
from pamsim.engine.rig import Rig
from pamsim.envs.settings import EnvSettings
from pamsim.twins.synthetic_recording import HideSettings
from tests.typed_command import run

CONTEXT = click.Context(cli)

# What a command needs -> functions that it calls, that of the job last.
CALLS = {
    "calibrate data": "calibration.calibrate.calibrate",
    "check data": "diagnosis.check.check",
    "diagnose data": "diagnosis.diagnose.diagnose",
    "fit map.csv": "fitting.fit.fit",
    "hide air_leak --out new": "twins.hide.hide",
    "identify data": "identification.identify.identify",
    "identify --simulate mas20_arm": "engine.simulate.simulated_step",
    "import log.csv --rig mas20_arm --out new": "comparison.import_log.import_log",
    "new-rig mine": "engine.new_rig.new_rig",
    "render rest.png": "scene.picture.picture_rest",
    "render a.png --recording data --time 1": (
        "scene.replay.read_replay report.film.picture_instant"
    ),
    "render a.gif --recording data": "scene.replay.read_replay report.film.film_trial",
    "replicate": "papers.replicate.replicate",
    "reproduce": "papers.reproduce.reproduce",
    "step --pressure 487,0": "engine.simulate.simulate",
    "sweep study.toml --out new": "sweeps.sweep.sweep",
    "train --out new": "envs.train.train",
    "view": "scene.viewer.watch_live",
    "view data": "scene.replay.read_replay scene.viewer.watch_replay",
}
RENAMED = {
    "hide": {"no_forces": "forces"},
    "render": {"pressure": "pressures"},
    "step": {"start": "start_pressure", "sample_hz": "sample_rate"},
    "view": {"pressure": "start"},
}
SETTINGS = {"hide": HideSettings, "train": EnvSettings}
"""Whose fields a function takes by further keywords."""
OWN = {"train": {"task"}, "view": {"effects", "with_effects"}}
"""Where a command has another default, or gives more than was typed."""
OF_ALL = {"out", "json_file", "open", "force", "quiet", "verbose", "progress"}
"""What has tests of its own, for all commands."""

TYPED = {
    "--arx": ("1,2,3", (1, 2, 3)),
    "--bounds": ("valve.delay=1:2", {"valve.delay": ("1", "2")}),
    "--diameter": ("2cm", 0.02),
    "--dt": ("2min", 120.0),
    "--duration": ("800ms", 0.8),
    "--fibre-angle": ("180", math.pi),
    "fit --hold": ("scale=2", {"scale": 2.0}),
    "--load": ("1200g", 1.2),
    "--model": ("six_parameter", "six_parameter"),
    "--nominal-length": ("300", 0.3),
    "--oe": ("3,2,1", (3, 2, 1)),
    "--paper": ("Sarosi", ["sarosi"]),
    "--rig": ("two_joint_arm", "two_joint_arm"),
    "--segments": ("fill=1:2,vent=3:4", {"fill": [(1.0, 2.0)], "vent": [(3.0, 4.0)]}),
    "render --time": ("900ms", 0.9),
    "--timestep-ms": ("2", 0.002),
    "--top-pressure": ("400", 4e5),
}
"""Option with a grammar of its own -> what is typed, and what it means in SI."""


def typed(command, option, number):
    """Words of an option, and the value that its function is to get."""
    flag, text = option.opts[0], f"a_{option.name}"
    if option.is_flag:
        off = option.secondary_opts  # of what is on by default
        return off or [flag], option.name != "no_forces" and not off
    for key in (f"{command} {flag}", flag):
        if key in TYPED:
            return [flag, TYPED[key][0]], TYPED[key][1]
    if (option.help or "").endswith(": NAME,NAME."):
        return [flag, "one,two", flag, "three"], ("one", "two", "three")
    if isinstance(option.type, click.types.FloatParamType):
        return [flag, f"{number}.5"], number + 0.5
    if isinstance(option.type, click.types.IntParamType):
        return [flag, str(number)], number
    if option.type.name == "quantities":
        return [flag, "300,1bar"], [3e5, 1e5]
    value = Path(text) if isinstance(option.type, click.Path) else text
    return [flag, text], (value,) if option.multiple else value


def watch(monkeypatch, path, seen, *, last):
    """Have a function only note its arguments; the last that is called ends the command.

    Returns its arguments, each with its default.
    """
    module, _, name = f"pamsim.{path}".rpartition(".")
    signature = inspect.signature(getattr(importlib.import_module(module), name))
    (more,) = [p.name for p in signature.parameters.values() if p.kind is p.VAR_KEYWORD] or [""]

    def noted(*args, **options):
        bound = signature.bind(*args, **options).arguments
        seen.update(
            bound, **bound.get(more, {}), **getattr(bound.get("experiment"), "__dict__", {})
        )
        if last:
            raise InputError("it was called")

    monkeypatch.setattr(f"{module}.{name}", noted)
    own = {p.name: p.default for p in signature.parameters.values()}
    return own | (vars(SETTINGS[name]()) if more else {})


@pytest.mark.parametrize("line", CALLS)
def test_an_option_reaches_the_job_and_one_left_out_is_the_job_s_default(
    line, monkeypatch, capsys, tmp_path
):
    monkeypatch.chdir(tmp_path)
    command, *words = line.split()
    paths, usual, seen = CALLS[line].split(), {}, {}
    for path in paths:
        usual |= watch(monkeypatch, path, seen, last=path == paths[-1])

    def given(*more):
        seen.clear()
        code, _, error = run(monkeypatch, capsys, command, *words, *more)
        assert (code, error) == (2, "pamsim: error: it was called\n")
        arrays = {n: np.ravel(v).tolist() for n, v in seen.items() if isinstance(v, np.ndarray)}
        rigs = {name: value.name for name, value in seen.items() if isinstance(value, Rig)}
        return {**seen, **arrays, **rigs}

    apart = OF_ALL | OWN.get(command, set())
    left_out = given()
    for name in (left_out.keys() & usual.keys()) - apart:
        if usual[name] is not inspect.Parameter.empty:
            assert (left_out[name] or None) == (usual[name] or None), name
    options = {
        RENAMED.get(command, {}).get(option.name, option.name): typed(command, option, number)
        for number, option in enumerate(cli.get_command(CONTEXT, command).params, 2)
        if isinstance(option, click.Option) and option.opts[0] not in words
    }
    reached = {name: options[name] for name in options.keys() & {*usual, *left_out} - apart}
    found = given(*(word for own, _ in reached.values() for word in own))
    for name, (_, value) in reached.items():
        assert found[name] == (pytest.approx(value) if isinstance(value, float) else value), name
        assert left_out.get(name) != value, name
