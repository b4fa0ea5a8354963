"""Studies draw their cases and count as stated, and pages state what their records hold."""

import re
import tomllib
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

import pamsim
from pamsim.identification.records import SignalRecord
from tests.records import SCRIPTS, page, quoted, recorded, script, words
from tests.unit.identification.planted import fit_continuous


def test_the_table_of_the_study_by_link_is_that_of_the_record():
    scores, text = script("link_study_scores"), page("validation")
    two, one, *draws = (
        recorded(f"results/link_study{name}")
        for name in (
            *("_two_repeats", "_one_log"),
            *("", "_fifth", "_fresh", "_second", "_third", "_fourth"),
        )
    )
    these, before = scores.pooled(draws[:2]), scores.pooled(draws[2:])
    columns = {
        "these rules": these,
        "earlier rules": before,
        "two repeats, 40 cases": two,
        "one log, 40 cases": one,
    }
    assert "\n".join(scores.table(columns)) in text
    for record in (two, one, *draws):
        assert scores.must_show(record["rows"]) == record["must_show"]
    assert f"judged by {len(these['rows'])} cases" in words("validation")
    assert f"judged by {len(before['rows'])} cases" in words("validation")
    wrong, others = (
        [r["name"].partition("_")[0] for r in record["rows"] if scores.wrong(r)]
        for record in (these, before)
    )
    (paragraph,) = [one for one in text.split("\n\n") if one.startswith("*Outside the library*")]
    cases = re.findall(r"\((?:cases? )?([\d,\s]+)(?: of [^)]*)?\)", paragraph)
    named = re.findall(r"\d+", " ".join(cases))
    assert sorted(named) == sorted(wrong)
    assert f"wrong in {len(others)} of {len(before['rows'])}" in words("validation")
    of_one = sum(scores.wrong(row) for row in one["rows"])
    assert (
        f"wrong in {len(wrong)} of {len(these['rows'])} cases, with a single log in {of_one}"
        f" of {len(one['rows'])}"
    ) in words("faq")


def test_the_page_states_how_well_shapes_are_learned():
    study, record = script("learned_study"), recorded("results/learned_study")
    found, text = study.counted(record["rows"]), page("validation")
    assert {key: record[key] for key in found} == found
    drawn = record["command"].partition("--count ")[2].partition(" ")[0]
    assert f"{len(record['rows'])} of the {drawn} cases drawn were run" in words("validation")
    for row in study.page_rows(found):
        assert row in text


def test_pamsim_s_models_are_scored_as_its_own_free_start_does():
    """The poles alone give what the chain of lags gives."""
    study, rng = script("identify_literature"), np.random.default_rng(0)
    u = np.repeat(rng.choice([0.0, 1.0], 40), 20)
    time = 0.1 * np.arange(u.size)
    y = np.cumsum(u - 0.5) * 0.05 + 0.1 * rng.standard_normal(u.size)
    halves = study.Halves("u", "y", np.rec.fromarrays([time, u, y], names="time_s,u,y"))
    first, second = (
        SignalRecord("half", time[: len(output)], given, output)
        for given, output in (halves.half(0), halves.half(1))
    )
    fit = fit_continuous([first], order=2, real_lags=False)
    free = replace(fit.structure, start="free").free_run(fit.coordinates, second)[0]
    output = halves.half(1)[1]
    expected = study.fit_percent(output, free)
    assert expected == pytest.approx(
        100.0 * (1.0 - np.linalg.norm(output - free) / np.linalg.norm(output - output.mean()))
    )
    assert study.second_half_fit(fit, halves, "zoh") == pytest.approx(expected, abs=1e-6)
    assert expected > study.fit_percent(output, fit.simulate(second)) + 1.0


def test_the_table_of_public_data_is_that_of_the_records():
    own, peers = (recorded(f"results/identify_literature{one}") for one in ("", "_peers"))
    assert own["versions"]["peers"] == peers["versions"]
    assert list(own["sets"]) == list(peers["sets"])
    lines = page("validation").splitlines()
    for name, entry in own["sets"].items():
        bests = {method: row["best"] for method, row in entry["peers"].items()}
        for method, best in bests.items():
            stable = peers["sets"][name][method]["stable"].values()
            fits = [fit for fit in stable if fit is not None]
            assert (best or {"fit_percent": None})["fit_percent"] == max(fits, default=None)
        (line,) = [line for line in lines if line.startswith(f"| {name} |")]
        assert [cell.strip() for cell in line.strip("|").split("|")][1:] == [
            entry["pamsim"]["shown"].replace("_", " "),
            f"{entry['pamsim']['fit_percent']:.1f}",
            *("-" if best is None else f"{best['fit_percent']:.1f}" for best in bests.values()),
        ]
        assert (entry["pamsim"]["recommended"] is not None) is (name == "robot arm")


def test_the_counts_of_planted_systems_are_those_of_the_record():
    study, two = (recorded(f"results/identify_planted{one}") for one in ("", "_two_inputs"))
    text = page("validation")
    for label, score in (
        ("number of poles right within one", "poles_within_one"),
        ("number of poles exact", "poles_exact"),
        ("integrator or none, right", "integrator_right"),
        ("recommended", "recommended"),
        ("recommended models that fail their own residual test", "recommended_failing_their_test"),
        ("95 % intervals that hold the planted number, structure given", "intervals_that_hold"),
        (
            "95 % intervals that hold the planted gain, structure chosen",
            "K_after_choice_that_hold",
        ),
        (
            "95 % intervals that hold the planted dead time, structure chosen",
            "L_after_choice_that_hold",
        ),
    ):
        found = [s["scores"][score] for s in (study, two)]
        cells = [f"{one['hits']} of {one['count']}" for one in found]
        assert f"| {label} | {' | '.join(cells)} |" in text
    after = [s["scores"][f"{one}_after_choice_that_hold"] for s in (study, two) for one in "KL"]
    shares = [one["hits"] / one["count"] for one in after]
    assert min(shares) >= 0.88  # the command, its page and docs/identify.md say nine in ten
    assert max(shares) <= 0.96
    quoted("identify", "About nine in ten of these intervals [hold]")
    right = [row for row in two["rows"] if row["found"]["poles"] == row["poles"]]
    zeros, late = (
        sum(row["found"][what] == row[what] for row in right) for what in ("zeros", "dead_time")
    )
    assert f"Of the {len(right)} systems with two inputs" in text
    assert f"{zeros} have the planted zeros of both inputs, and {late} both dead times" in text
    single = [row for row in study["rows"] if row["poles"] == 1]
    more = sum(row["found"]["poles"] > 1 for row in single)
    assert f"{more} of {len(single)} systems of one pole got more poles." in text


def test_the_pages_state_how_often_intervals_of_force_laws_hold():
    rows = recorded("results/fit_coverage")["rows"]
    percent = {
        kind: [round(100.0 * row[kind]["share"]) for row in rows] for kind in ("fit", "independent")
    }
    least, most = min(percent["fit"]), max(percent["fit"])
    text = words("fit")
    assert f"[{least} to {most} % hold](validation.md" in text
    assert f"as few as {min(percent['independent'])} %." in text
    for row in rows:
        cells = [row["map"], row["shared error"]]
        for one in (row["fit"], row["independent"]):
            ends = [f"{100.0 * end:.1f}" for end in one["interval95"]]
            cells.append(f"{100.0 * one['share']:.1f} [{', '.join(ends)}] %")
        assert f"| {' | '.join(cells)} |" in page("validation")


def test_numbers_that_no_test_holds_to_a_page_state_their_source():
    stated = tomllib.loads((SCRIPTS / "doc_numbers.toml").read_text(encoding="utf-8"))
    pages = script("doc_numbers").PAGES
    for name, entries in stated.items():
        lines = pages[name].read_text(encoding="utf-8").splitlines()
        for one in entries:
            for text in one["text"]:
                assert any(text in line for line in lines), (name, text)
            for path in re.findall(r"\b(?:pamsim|scripts|tests)(?:/\w+)+(?:\.\w+)?", one["source"]):
                assert (SCRIPTS.parent / path).exists(), path
    recorded_pages = recorded("results/doc_numbers")["pages"]
    assert set(recorded_pages) == set(pages)
    assert not any("" in sources for sources in recorded_pages.values())


slips, SLIPS = script("trust/unit_slips"), recorded("results/unit_slips")


def test_a_mistake_in_units_is_named_with_its_correction_and_nothing_else(tmp_path):
    for name in ("valves", "set points"):  # of the arm, briefly
        made = replace(slips.ALTERED[name], effects={}, hide=pamsim.hide)
        options = {**made.options, "duration": 1.5, "repeats": 1}
        options.pop("formulation", None)  # only the plant's
        replace(made, options=options).save(tmp_path / name, 0)
        assert slips.checked(tmp_path / name) == ("silent", [])
    what = ("set points", "measured pressures in mbar")
    (mistake,) = (one for one in slips.MISTAKES if (one.recording, one.what) == what)
    slips.altered(tmp_path / "set points", tmp_path / "mistake", mistake.change)
    how, reported = slips.checked(tmp_path / "mistake")
    assert how != "silent"
    assert slips.named(mistake, reported)


def test_the_page_states_what_was_found_of_mistakes_in_units():
    each, text = SLIPS["each_mistake"], words("validation")
    pairs = list(zip(slips.MISTAKES, each, strict=True))
    assert all((m.recording, m.what) == (one["recording"], one["mistake"]) for m, one in pairs)
    named = [slips.named(m, one["reported"]) for m, one in pairs]
    assert SLIPS["found"] == sum(named) >= slips.FOUND * SLIPS["mistakes"]
    kinds = {one["recording"] for one in SLIPS["each_valid"]}
    assert kinds == set(slips.VALID)
    assert SLIPS["false_alarms"] == sum(one["how"] != "silent" for one in SLIPS["each_valid"])
    for recording in slips.ALTERED:
        own = [n for m, n in zip(slips.MISTAKES, named, strict=True) if m.recording == recording]
        assert f"| {recording} | {len(own)} | {sum(own)} |" in text
    alarms = f"{SLIPS['false_alarms']} of {SLIPS['valid']} valid recordings"
    assert f"{alarms}, of {len(kinds)} kinds" in text
    found = recorded("results/off_rigs")
    assert f"{found['false_alarms']} of {found['valid']} recordings raised a suspicion" in text
    assert f"of {found['mistakes']} with a mistake {found['named']} were answered" in text
    assert len(found["each_missed"]) == found["mistakes"] - found["named"]
    how = Counter(one["how"] for one in found["each_missed"])
    absolute = sum("absolute" in one["mistake"] for one in found["each_missed"])
    assert f"{how['silent']} mistakes were not seen, {absolute} of them absolute" in text
    assert f"{how['refused']} were refused, and {how['suspected']} answered with another" in text
