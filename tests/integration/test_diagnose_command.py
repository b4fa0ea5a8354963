"""``pamsim diagnose``: hidden effects are named by the command, repaired, and then gone."""

from __future__ import annotations

import json

import pytest

import pamsim
from pamsim.report.page import PageImage
from pamsim.twins.hide import hide
from tests.typed_command import run
from tests.unit.diagnosis.by_link.reports import VERDICTS

EFFECTS = ("--effects", "valve_delay,air_leak,viscous_friction,added_inertia")
SHORT = {"protocols": ("bursts",), "repeats": 5, "duration": 1.5, "forces": False, "seed": 2}


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Of an arm with a valve delay and viscous friction, and what was hidden."""
    folder = tmp_path_factory.mktemp("two") / "bench"
    planted = {"valve_delay": 1.0, "viscous_friction": 1.0}
    truth = hide("mas20_arm", planted, **SHORT).save(folder)
    return folder, json.loads(truth.read_text(encoding="utf-8"))["parameters"]


def test_two_causes_are_named_in_their_links_repaired_and_no_longer_missing(
    recording, tmp_path, monkeypatch, capsys
):
    folder, truth = recording
    out = tmp_path / "out"
    code, printed, err = run(
        monkeypatch, capsys, "diagnose", folder, *EFFECTS, "--out", out, "--json",
        tmp_path / "r.json",
    )  # fmt: skip
    assert code == 0, err
    *_, sentence, verdict = printed.strip().splitlines()
    assert verdict == "verdict: named"
    assert "Certain: a delay before the valves act (valve_delay), delay " in sentence
    result = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
    assert result == json.loads((tmp_path / "r.json").read_text(encoding="utf-8"))
    assert result["sentence"] == sentence
    effects = {one["name"]: one for one in result["effects"]}
    assert {name: one["links"] for name, one in effects.items()} == {
        "valve_delay": ["valves and air"],
        "viscous_friction": ["muscle and joint"],
    }
    delay = effects["valve_delay"]["sizes"]["valve.delay"]
    low, high = delay["interval95_si"]
    assert low <= truth["valve.delay"]["value"] <= high
    for gap in result["gap"].values():
        assert gap["after"] < 1.5 * gap["floor"]  # start pressures are as read, with their noise
        assert gap["before"] > 2.5 * gap["after"]
    assert sentence in (out / "index.html").read_text(encoding="utf-8")
    repaired = pamsim.load_rig(out / "rig")
    found = [muscle.valve.delay for muscle in repaired.muscles.values()]
    assert found == pytest.approx([delay["value_si"]] * 2)

    code, printed, err = run(
        monkeypatch, capsys, "diagnose", folder, *EFFECTS, "--rig", out / "rig"
    )  # fmt: skip
    assert code == 0, err
    assert printed.strip().splitlines()[-1] == "verdict: no_gap"


def test_one_log_shows_a_cause_to_the_family_and_says_how_its_noise_is_known(
    tmp_path, monkeypatch, capsys
):
    once = SHORT | {"repeats": 1, "duration": 5.0, "seed": 3}
    hide("mas20_arm", {"valve_delay": 1.0}, **once).save(tmp_path / "log")
    code, _, err = run(
        monkeypatch, capsys, "diagnose", tmp_path / "log", "--effects", "valve_delay,air_leak",
        "--json", tmp_path / "r.json",
    )  # fmt: skip
    assert code == 1, err
    result = json.loads((tmp_path / "r.json").read_text(encoding="utf-8"))
    (effect,) = result["effects"]
    assert (effect["name"], effect["level"]) == ("valve_delay", "family")
    known = "without repeats the noise of pressure_1, pressure_2, angle is known from sample"
    assert sum(text.startswith(known) for text in result["warnings"]) == 1


@pytest.mark.parametrize("verdict", list(VERDICTS))
def test_every_verdict_is_printed_and_has_its_exit_code(verdict, tmp_path, monkeypatch, capsys):
    asked = {}

    def quick(sources, **options):
        options["progress"](3, None, "air_leak")
        asked.update(options, sources=sources)
        return VERDICTS[verdict]

    monkeypatch.setattr("pamsim.diagnosis.diagnose.diagnose", quick)
    monkeypatch.setattr(
        "pamsim.report.page.page_image", lambda figure, path: PageImage("data:,", 691, 400, [])
    )
    out = tmp_path / "out"
    code, printed, _ = run(
        monkeypatch, capsys, "diagnose", "a", "b", "--effects", "air_leak", "--effects",
        "angle_bias", "--hold-out", "x,y", "--seed", "7", "--out", out,
    )  # fmt: skip
    assert code == (0 if verdict in ("no_gap", "named") else 1)
    assert printed.strip().splitlines()[-1] == f"verdict: {verdict}"
    assert "warning: forces were not measured" in printed
    assert "not tried: load_torque: no body's tilt is stated" in printed
    assert "pressure_1 [kPa]" in printed
    assert (asked["sources"], asked["hold_out"], asked["seed"]) == (("a", "b"), ("x", "y"), 7)
    assert asked["effects"] == ("air_leak", "angle_bias")
    repaired = bool(VERDICTS[verdict].effects)
    assert (out / "rig" / "params.toml").is_file() is repaired
    assert (f"rig:  {out / 'rig'}" if repaired else "no effect was found") in printed
    if verdict == "ambiguous":
        assert "may be instead: supply_sag" in printed
        assert "next experiment: shut_hold" in printed


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["mas20", "--hold-out", "nonsense"], "--hold-out does not apply to a table of angles"),
        (["alraouf2025", "--rig", "mas20_arm"], "--rig does not apply to a length-pressure loop"),
        (["alraouf2025", "--nuisance", "x"], "--nuisance does not apply to a length-pressure loop"),
        (["alraouf2025", "--threads", "2"], "--threads does not apply to a length-pressure loop"),
        (["alraouf2025", "--effects", "creep"], "no effect 'creep' that opens a loop"),
        (["alraouf2026"], "alraouf2026"),
    ],
)
def test_an_option_that_does_not_apply_is_refused(monkeypatch, capsys, tmp_path, options, words):
    monkeypatch.chdir(tmp_path)
    code, _, err = run(monkeypatch, capsys, "diagnose", *options)
    assert code == 2
    assert words in err
    assert len(err.strip().splitlines()) == 1


@pytest.mark.parametrize(
    ("name", "verdict", "expected"),
    [("alraouf2025", "no_gap", 0), ("alraouf2025_equations", "ambiguous", 1)],
)
def test_a_length_pressure_loop_is_diagnosed(
    monkeypatch, capsys, tmp_path, name, verdict, expected
):
    out = tmp_path / "out"
    code, text, err = run(monkeypatch, capsys, "diagnose", name, "--out", out)
    assert (code, err) == (expected, "")
    result = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
    assert result["verdict"] == verdict
    assert f"verdict: {verdict}" in text
    assert result["sentence"] in (out / "index.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--effects", "air_lek"], "did you mean 'air_leak'"),
        (["--nuisance", "force.scal"], "did you mean 'force.scale'"),
        (["--hold-out", "burst"], "did you mean 'bursts'"),
        (["--rig", "mas30_arm"], "did you mean 'mas20_arm'"),
        (["--hold-out", "bursts_1"], "independent parts"),
        (["--film"], "--film needs recordings, and --out"),
        (["--threads", "0"], "0 threads"),
    ],
)
def test_bad_input_is_one_line_and_exit_2(recording, monkeypatch, capsys, options, words):
    code, _, err = run(
        monkeypatch, capsys, "diagnose", recording[0], "--effects", "air_leak", *options
    )
    assert code == 2
    assert words in err
    assert len(err.strip().splitlines()) == 1


def test_places_that_cannot_take_the_result_are_refused_before_the_work(
    tmp_path, monkeypatch, capsys
):
    (tmp_path / "file").write_text("", encoding="utf-8")
    own = pamsim.new_rig("own", "joint", out=tmp_path / "own")
    for rig, out, words in (
        ("mas20_arm", tmp_path / "file", "is a file"),
        (own, own, "the folder of the rig it is made from"),
    ):
        args = ("--rig", rig, "--out", out, "--force")
        code, _, err = run(monkeypatch, capsys, "diagnose", "none", *args)
        assert (code, words in err) == (2, True)
    code, _, err = run(monkeypatch, capsys, "diagnose", tmp_path / "none.csv")
    assert (code, "cannot read" in err) == (2, True)
