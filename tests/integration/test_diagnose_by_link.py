"""``pamsim diagnose --by-link``: two causes in two links, each named in its own."""

from __future__ import annotations

import json
import sys

import pytest

from pamsim.cli.main import main
from pamsim.twins.hide import hide

EFFECTS = ["--effects", "valve_delay,air_leak,viscous_friction,added_inertia"]


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    folder = tmp_path_factory.mktemp("by_link") / "data"
    planted = {"valve_delay": 1.0, "viscous_friction": 1.0}
    options = {"protocols": ("bursts",), "repeats": 5, "duration": 1.5, "forces": False}
    truth = hide("mas20_arm", planted, **options, seed=2).save(folder)
    return folder, json.loads(truth.read_text(encoding="utf-8"))["parameters"]


@pytest.fixture
def run(monkeypatch, capsys):
    def diagnosed(*arguments):
        monkeypatch.setattr(sys, "argv", ["pamsim", "diagnose", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        return ended.value.code, capsys.readouterr()

    return diagnosed


def test_two_causes_are_named_with_sizes_that_hold_what_was_hidden(recordings, tmp_path, run):
    folder, truth = recordings
    file = tmp_path / "found.json"
    code, shown = run(folder, "--by-link", *EFFECTS, "--json", file)
    found = json.loads(file.read_text(encoding="utf-8"))
    assert (code, found["verdict"]) == (0, "named")
    assert [link["link"] for link in found["links"]] == ["valves and air", "muscle and joint"]
    effects = {one["effect"].partition(":")[0]: one for one in found["effects"]}
    assert set(effects) == {"valve_delay", "viscous_friction"}
    assert effects["valve_delay"]["links"] == ["valves and air"]
    assert effects["viscous_friction"]["links"] == ["muscle and joint"]
    delay = effects["valve_delay"]["sizes"]["valve.delay"]
    low, high = delay["interval95"]
    assert low <= truth["valve.delay"]["value"] <= high
    assert "certain: a delay before the valves act (valve_delay)" in shown.out


def test_one_log_shows_a_cause_to_the_family_and_says_how_its_noise_is_known(tmp_path, run):
    planted = {"valve_delay": 1.0}
    options = {"protocols": ("bursts",), "repeats": 1, "duration": 5.0, "forces": False}
    hide("mas20_arm", planted, **options, seed=3).save(tmp_path / "log")
    code, shown = run(tmp_path / "log", "--by-link", "--effects", "valve_delay,air_leak")
    assert code == 1
    assert "certain: command delay (nearest formula valve_delay)" in shown.out
    assert "note: without repeats the noise of pressure_1, pressure_2, angle is known" in shown.out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--out", "somewhere"], "does not apply to --by-link"),
        (["--hold-out", "bursts_1"], "parts to judge by"),
    ],
)
def test_what_cannot_be_done_is_refused_in_a_line(recordings, run, arguments, message):
    code, shown = run(recordings[0], "--by-link", *EFFECTS, *arguments)
    assert code == 2
    assert message in shown.err
    assert shown.err.count("\n") == 1


def test_tables_are_refused(run):
    code, shown = run("mas20", "--by-link")
    assert code == 2
    assert "--by-link does not apply" in shown.err
