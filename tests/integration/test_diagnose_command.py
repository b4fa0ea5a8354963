"""``pamsim diagnose``: a hidden effect is named by the command, repaired, and then gone."""

from __future__ import annotations

import json

import pytest

import pamsim
from pamsim.cli.main import main
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.recordings.rig_file import shipped_rigs
from pamsim.report.page import PageImage
from tests.unit.diagnosis.diagnosed import VERDICTS, following, report

TRIED = ("--effects", "air_leak,pressure_bias", "--nuisance", "force.scale")


def run(monkeypatch, capsys, *args):
    """Run ``pamsim ...`` through its entry point; returns exit code, output and errors."""
    monkeypatch.setattr("sys.argv", ["pamsim", *map(str, args)])
    with pytest.raises(SystemExit) as ended:
        main()
    captured = capsys.readouterr()
    return ended.value.code, captured.out, captured.err


@pytest.fixture(scope="module")
def rig_folder(tmp_path_factory):
    """The shipped rig in steps twice as long, for synthetic data and fit."""
    folder = tmp_path_factory.mktemp("rig") / "quick_arm"
    folder.mkdir()
    for path in (shipped_rigs() / "mas20_arm").glob("*.*"):
        if path.suffix in (".toml", ".xml"):
            text = path.read_text(encoding="utf-8")
            text = text.replace('timestep="0.0005"', 'timestep="0.001"')
            (folder / path.name).write_text(text, encoding="utf-8")
    assert pamsim.load_rig(folder).model.opt.timestep == 1e-3
    return folder


@pytest.fixture(autouse=True)
def short_trials(monkeypatch):
    monkeypatch.setattr("pamsim.comparison.protocols.DURATION", 3.2)


@pytest.fixture
def recording(rig_folder, tmp_path, monkeypatch, capsys):
    data = tmp_path / "bench"
    code, _, err = run(
        monkeypatch, capsys, "hide", "air_leak", "--out", data, "--rig", rig_folder,
        "--protocols", "bursts", "--repeats", "7", "--seed", "4",
    )  # fmt: skip
    assert code == 0, err
    return data


def test_a_hidden_leak_is_named_repaired_and_no_longer_missing(
    recording, tmp_path, monkeypatch, capsys
):
    out = tmp_path / "out"
    code, printed, err = run(
        monkeypatch, capsys, "diagnose", recording, *TRIED, "--out", out, "--json",
        tmp_path / "r.json",
    )  # fmt: skip
    assert code == 0, err
    *_, sentence, verdict = printed.strip().splitlines()
    assert verdict == "verdict: named"
    assert sentence.startswith("Missing: a leak of air from the muscles (air_leak, leak conduct")
    result = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
    assert result == json.loads((tmp_path / "r.json").read_text(encoding="utf-8"))
    assert result["sentence"] == sentence
    leak = result["effects"][0]["parameters"]["chamber.leak_conductance"]
    assert leak["value_si"] == pytest.approx(2e-12, rel=0.1)
    for gap in result["gap"].values():
        assert gap["after"]["value"] < 1.5 * gap["floor"]["value"]
    assert sentence in (out / "index.html").read_text(encoding="utf-8")
    repaired = pamsim.load_rig(out / "rig")
    found = [m.chamber.leak_conductance for m in repaired.muscles.values()]
    assert found == pytest.approx([leak["value_si"]] * 2)

    code, printed, err = run(
        monkeypatch, capsys, "diagnose", recording, *TRIED, "--rig", out / "rig"
    )  # fmt: skip
    assert code == 0, err
    assert printed.strip().splitlines()[-1] == "verdict: no_gap"


@pytest.mark.parametrize("verdict", list(Verdict))
def test_every_verdict_is_printed_and_has_its_exit_code(verdict, tmp_path, monkeypatch, capsys):
    rig = pamsim.load_rig("mas20_arm")
    one = report(rig, verdict, **VERDICTS[verdict], following=following())
    asked = {}

    def quick(sources, **options):
        options["progress"](3, None, "air_leak")
        asked.update(options, sources=sources)
        return one

    monkeypatch.setattr("pamsim.diagnosis.diagnose.diagnose", quick)
    monkeypatch.setattr(
        "pamsim.report.page.page_image", lambda figure, path: PageImage("data:,", 691, 400, [])
    )
    out = tmp_path / "out"
    code, printed, _ = run(
        monkeypatch, capsys, "diagnose", "a", "b", "--effects", "air_leak", "--effects",
        "angle_bias", "--hold-out", "x,y", "--seed", "7", "--out", out,
    )  # fmt: skip
    assert code == (0 if verdict in (Verdict.NO_GAP, Verdict.NAMED) else 1)
    assert printed.strip().splitlines()[-1] == f"verdict: {verdict.value}"
    assert "warning: forces were not measured" in printed
    assert "not tried: load_torque: no body's tilt is stated" in printed
    assert "pressure_1 [kPa]" in printed
    assert (asked["sources"], asked["hold_out"], asked["seed"]) == (("a", "b"), ("x", "y"), 7)
    assert asked["effects"] == ("air_leak", "angle_bias")
    repaired = verdict in (Verdict.NAMED, Verdict.NAMED_WITH_REMAINDER)
    assert (out / "rig" / "params.toml").is_file() is repaired
    assert (f"rig:  {out / 'rig'}" if repaired else "no repaired rig written") in printed
    if verdict is Verdict.AMBIGUOUS:
        assert "alternative" in printed
        assert "next experiment: shut_hold" in printed


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["mas20", "--hold-out", "nonsense"], "--hold-out does not apply to a table of angles"),
        (["mas20", "--channels", "bogus"], "--channels does not apply to a table of angles"),
        (["mas20", "--resume", "--out", "out"], "--resume does not apply to a table"),
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
        (["--channels", "angel"], "did you mean 'angle'"),
        (["--hold-out", "burst"], "did you mean 'bursts'"),
        (["--rig", "mas30_arm"], "did you mean 'mas20_arm'"),
        (["--resume"], "--resume needs --out"),
        (["--threads", "0"], "0 threads"),
    ],
)
def test_bad_input_is_one_line_and_exit_2(recording, monkeypatch, capsys, options, words):
    code, _, err = run(
        monkeypatch, capsys, "diagnose", recording, "--effects", "air_leak", *options
    )
    assert code == 2
    assert words in err
    assert len(err.strip().splitlines()) == 1


def test_places_that_cannot_take_the_result_are_refused_before_the_work(
    rig_folder, tmp_path, monkeypatch, capsys
):
    (tmp_path / "file").write_text("", encoding="utf-8")
    for rig, out, words in (
        ("mas20_arm", tmp_path / "file", "is a file"),
        (rig_folder, rig_folder, "the folder of the rig it is made from"),
    ):
        args = ("--rig", rig, "--out", out, "--force")
        code, _, err = run(monkeypatch, capsys, "diagnose", "none", *args)
        assert (code, words in err) == (2, True)
    code, _, err = run(monkeypatch, capsys, "diagnose", tmp_path / "none.csv")
    assert (code, "cannot read" in err) == (2, True)


def test_an_interrupted_diagnosis_says_how_to_go_on(tmp_path, monkeypatch, capsys):
    def stopped(*args, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr("pamsim.diagnosis.diagnose.diagnose", stopped)
    code, _, err = run(monkeypatch, capsys, "diagnose", "data", "--out", tmp_path / "out")
    assert code == 130
    assert "the same command and --resume" in err
