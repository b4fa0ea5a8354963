"""``pamsim diagnose``: what is hidden is named by the command, repaired, and then gone."""

import json
from dataclasses import replace

import pytest

import pamsim
from pamsim.comparison.links import PARTS
from pamsim.core.errors import InputError
from pamsim.diagnosis.by_link.held_out import HeldOut
from pamsim.diagnosis.by_link.limits import Remainder
from pamsim.report.link_page import write_link_diagnosis
from pamsim.report.numbers import unit
from pamsim.report.page import PageImage
from pamsim.twins.hide import hide
from tests.unit.diagnosis.by_link.reports import VERDICTS

SHORT = {"protocols": ("bursts",), "repeats": 5, "duration": 1.5, "forces": False, "seed": 2}


@pytest.fixture
def run(run):
    return lambda *words: run("diagnose", *words)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Of an arm with a valve delay and viscous friction, and what was hidden."""
    folder = tmp_path_factory.mktemp("two") / "bench"
    planted = {"valve_delay": 1.0, "viscous_friction": 1.0}
    truth = hide("mas20_arm", planted, **SHORT).save(folder)
    return folder, json.loads(truth.read_text(encoding="utf-8"))["parameters"]


def test_two_causes_are_named_in_their_links_repaired_and_no_longer_missing(
    recording, tmp_path, run
):
    folder, truth = recording
    tried = ("--effects", "valve_delay,air_leak,viscous_friction,added_inertia")
    out = tmp_path / "out"
    code, printed, err = run(folder, *tried, "--out", out, "--json", tmp_path / "r.json")
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
    assert unit(sentence) in (out / "index.html").read_text(encoding="utf-8")
    repaired = pamsim.load_rig(out / "rig")
    found = [muscle.valve.delay for muscle in repaired.muscles.values()]
    assert found == pytest.approx([delay["value_si"]] * 2)
    code, printed, err = run(folder, *tried, "--rig", out / "rig")
    assert (code, printed.strip().splitlines()[-1]) == (0, "verdict: no_gap"), err


def test_one_log_shows_a_cause_to_the_family_and_says_how_its_noise_is_known(tmp_path, run):
    once = SHORT | {"repeats": 1, "duration": 5.0, "seed": 3}
    hide("mas20_arm", {"valve_delay": 1.0}, **once).save(tmp_path / "log")
    file = tmp_path / "r.json"
    code, _, err = run(tmp_path / "log", "--effects", "valve_delay,air_leak", "--json", file)
    assert code == 1, err
    result = json.loads(file.read_text(encoding="utf-8"))
    (effect,) = result["effects"]
    assert (effect["name"], effect["level"]) == ("valve_delay", "family")
    known = "without repeats the noise of pressure_1, pressure_2, angle is known from sample"
    assert sum(text.startswith(known) for text in result["warnings"]) == 1


TRIED = {"effects": ("air_leak", "coulomb_friction"), "nuisance": ("force.scale",)}


def test_a_leak_alone_is_named_with_its_size_and_nothing_where_nothing_is_hidden(tmp_path):
    for name, effects in (("nothing", {}), ("leak", {"air_leak": 2.0})):
        hide("mas20_arm", effects, **SHORT | {"seed": 4}).save(tmp_path / name)
        found = pamsim.diagnose(tmp_path / name, **TRIED)
        assert (found.alpha, found.material) == (0.05, 0.02)  # the stated defaults
        assert found.verdict.value == ("named" if effects else "no_gap")
        assert [one.name for one in found.effects] == list(effects)
    leak = found.effects[0].sizes["chamber.leak_conductance"]
    assert leak.value_si == pytest.approx(4e-12, rel=0.05)
    air, arm = found.links
    assert air.before > 1.5 > air.after
    assert arm.before == pytest.approx(1.0, abs=0.1)
    with pytest.raises(InputError, match="5 of the 7 independent parts that a level of 1 % needs"):
        pamsim.diagnose(tmp_path / name, **TRIED, alpha=0.01)
    # The same leak is not material to who asks for more of the noise than it takes away.
    more = 2.0 * (air.before - air.after)
    found = pamsim.diagnose(tmp_path / name, **TRIED, alpha=0.04, material=more)
    assert (found.verdict.value, found.effects) == ("no_gap", ())
    result = found.to_dict()
    assert (result["alpha"], result["material"]) == (0.04, more)
    page = write_link_diagnosis(result, found.comparisons, tmp_path).read_text(encoding="utf-8")
    for text in (f"{more:.3g} of the noise variance", "level of all tests (alpha)", "4 %"):
        assert text in page


def test_what_links_have_left_costs_the_name_only_if_the_whole_chain_has_it_too(
    tmp_path, monkeypatch
):
    hide("mas20_arm", {"air_leak": 6.0}, **SHORT | {"seed": 4}).save(tmp_path / "data")
    for of_whole, level in ((0.0, "form"), (0.5, "family")):

        def left(self, model, of_whole=of_whole):
            return {
                link: Remainder(excess=of_whole if link.parts == PARTS else 0.1, p_value=0.004)
                for link in self.links
            }

        monkeypatch.setattr(HeldOut, "remainders", left)
        found = pamsim.diagnose(tmp_path / "data", **TRIED | {"effects": ("air_leak",)})
        (leak,) = found.effects
        assert (leak.level, leak.exact) == (level, level == "form")
        assert bool(found.remainder) == (level == "family")


@pytest.mark.parametrize("verdict", list(VERDICTS))
def test_every_verdict_is_printed_and_has_its_exit_code(verdict, tmp_path, monkeypatch, run):
    asked = []

    def quick(sources, *, progress, **_):
        progress(3, None, "air_leak")
        asked.append(sources)
        return VERDICTS[verdict]

    monkeypatch.setattr("pamsim.diagnosis.diagnose.diagnose", quick)
    monkeypatch.setattr(
        "pamsim.report.page.page_image", lambda figure, path: PageImage("data:,", 691, 400, [])
    )
    out = tmp_path / "out"
    code, printed, _ = run("a", "b", "--out", out)
    assert code == (0 if verdict in ("no_gap", "named") else 1)
    assert printed.strip().splitlines()[-1] == f"verdict: {verdict}"
    repaired = bool(VERDICTS[verdict].effects)
    shown = [
        "warning: forces were not measured",
        "not tried: load_torque: no body's tilt is stated",
        "pressure_1 [kPa]",
        f"rig:  {out / 'rig'}" if repaired else "no effect was found",
    ]
    if verdict == "ambiguous":
        shown += ["may be instead: supply_sag", "next experiment: shut_hold"]
    for words in shown:
        assert words in printed
    assert asked == [("a", "b")]
    assert (out / "rig" / "params.toml").is_file() is repaired


def test_a_length_pressure_loop_is_diagnosed(run, tmp_path):
    for name, verdict, expected in (
        ("alraouf2025", "no_gap", 0),
        ("alraouf2025_equations", "ambiguous", 1),
    ):
        out = tmp_path / name
        code, text, err = run(name, "--out", out)
        assert (code, err) == (expected, "")
        result = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
        assert result["verdict"] == verdict
        assert f"verdict: {verdict}" in text
        page = (out / "index.html").read_text(encoding="utf-8")
        assert unit(result["sentence"]) in page
        # The same page as that of recordings, with the parts that a loop has.
        assert "The loop and the difference of its branches." in page
        for words in ("Where the gap is.", "Nuisance parameters"):
            assert words not in page


def test_bad_input_is_one_line_and_exit_2(recording, run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("", encoding="utf-8")
    own = pamsim.new_rig("own", "joint", out=tmp_path / "own")
    leak = (recording[0], "--effects", "air_leak")
    for args, words in (
        (["mas20", "--hold-out", "nonsense"], "--hold-out does not apply to a table of angles"),
        (["alraouf2025", "--rig", "mas20_arm"], "--rig does not apply to a length-pressure loop"),
        (["alraouf2025", "--nuisance", "x"], "--nuisance does not apply to a length-pressure loop"),
        (["alraouf2025", "--material", "0.1"], "--material does not apply to a length-pressure"),
        (["alraouf2025", "--threads", "2"], "--threads does not apply to a length-pressure loop"),
        (["alraouf2025", "--effects", "creep"], "no effect 'creep' that opens a loop"),
        (["alraouf2026"], "alraouf2026"),
        ([tmp_path / "none.csv"], "give the folder of a recording, as `pamsim import`"),
        ([leak[0], "mas20"], "recordings alone, or one table"),
        ([leak[0], "--effects", "air_lek"], "did you mean 'air_leak'"),
        ([*leak, "--nuisance", "force.scal"], "did you mean 'force.scale'"),
        ([*leak, "--nuisance", "chain.compliance"], "compliance is 0, so that a relative"),
        ([*leak, "--hold-out", "burst"], "did you mean 'bursts'"),
        ([*leak, "--rig", "mas30_arm"], "did you mean 'mas20_arm'"),
        ([*leak, "--hold-out", "bursts_1"], "samples; hold out 5 trials or more, record"),
        ([*leak, "--film"], "--film needs recordings, and --out"),
        ([*leak, "--threads", "0"], "0 threads"),
        ([*leak, "--alpha", "5"], "--alpha is 5; it must be from 0.001 to 0.5"),
        ([*leak, "--material", "0"], "--material is 0; it must be above 0"),
        # Places that cannot take the result, before the work.
        (["none", "--out", tmp_path / "file", "--force"], "is a file"),
        (["none", "--rig", own, "--out", own, "--force"], "the folder of the rig it is made from"),
    ):
        code, _, err = run(*args)
        assert code == 2, args
        assert words in err
        assert len(err.strip().splitlines()) == 1
    with pytest.raises(InputError, match="`hold_out` does not apply"):
        pamsim.diagnose("mas20", hold_out=["angle"])
    with pytest.raises(InputError, match="`seed` is -1"):
        pamsim.diagnose("mas20", seed=-1)
    with pytest.raises(InputError, match="locking is 0, so that a relative change"):
        pamsim.diagnose("mas20", nuisance=["pulley radius", "passive.locking"])


def test_the_film_is_of_the_trial_with_the_largest_gap_alone(tmp_path, monkeypatch, run):
    filmed = []

    def film(path, scene, parts, **_):
        path.write_bytes(b"GIF89a")
        filmed.append({part.trial for part in parts})

    monkeypatch.setattr("pamsim.report.film.film_gap", film)
    parts = [replace(part, protocol=part.trial) for part in VERDICTS["named"].comparisons]
    report = replace(VERDICTS["named"], comparisons=tuple(parts))
    monkeypatch.setattr("pamsim.diagnosis.diagnose.diagnose", lambda *_, **__: report)
    assert run("a", "b", "--rig", "mas20_arm", "--film", "--out", tmp_path / "out")[0] == 0
    assert filmed == [{"swing_check_2"}]
