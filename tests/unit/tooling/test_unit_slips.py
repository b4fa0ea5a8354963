"""The study of mistakes in units counts as stated, and finds some of each kind again."""

from __future__ import annotations

from dataclasses import replace

import pytest

import pamsim
from tests.records import recorded as record_of
from tests.records import script, words

study, RECORD = script("trust/unit_slips"), record_of("results/unit_slips")


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Valves and set points of the arm, briefly."""
    place = tmp_path_factory.mktemp("mistakes")
    for name in ("valves", "set points"):
        made = replace(study.ALTERED[name], effects={}, hide=pamsim.hide)
        options = {**made.options, "duration": 1.5, "repeats": 1}
        options.pop("formulation", None)  # only the plant's
        replace(made, options=options).save(place / name, 0)
    return place


def mistake(recording, what):
    """A mistake by its name."""
    (found,) = (one for one in study.MISTAKES if (one.recording, one.what) == (recording, what))
    return found


@pytest.mark.parametrize(
    ("recording", "what"),
    [
        ("valves", "measured pressures absolute"),
        ("valves", "muscles swapped in measured pressures"),
        ("valves", "time in minutes"),
        ("set points", "measured pressures in mbar"),
        ("set points", "all pressures in psi"),
    ],
)
def test_a_mistake_is_named_with_its_correction(recorded, tmp_path, recording, what):
    made = mistake(recording, what)
    study.altered(recorded / recording, tmp_path / "mistake", made.change)
    how, reported = study.checked(tmp_path / "mistake")
    assert how != "silent"
    assert study.named(made, reported)


def test_without_a_mistake_nothing_is_suspected(recorded):
    assert study.checked(recorded / "valves") == ("silent", [])


def test_the_record_is_of_these_mistakes_and_the_page_states_it():
    assert [(one["recording"], one["mistake"]) for one in RECORD["each_mistake"]] == [
        (one.recording, one.what) for one in study.MISTAKES
    ]
    named = [
        study.named(s, one["reported"])
        for s, one in zip(study.MISTAKES, RECORD["each_mistake"], strict=True)
    ]
    assert RECORD["found"] == sum(named)
    assert RECORD["found"] >= study.FOUND * RECORD["mistakes"]
    kinds = {one["recording"] for one in RECORD["each_valid"]}
    assert kinds == set(study.VALID)
    assert RECORD["false_alarms"] == sum(one["how"] != "silent" for one in RECORD["each_valid"])
    page = words("validation")
    for recording in study.ALTERED:
        own = [n for s, n in zip(study.MISTAKES, named, strict=True) if s.recording == recording]
        assert f"| {recording} | {len(own)} | {sum(own)} |" in page
    alarms = f"{RECORD['false_alarms']} of {RECORD['valid']} valid recordings"
    assert f"{alarms}, of {len(kinds)} kinds" in page


def test_the_page_states_what_was_found_of_rigs_whose_numbers_are_off():
    found, page = record_of("results/off_rigs"), words("validation")
    assert f"{found['false_alarms']} of {found['valid']} recordings raised a suspicion" in page
    assert f"of {found['mistakes']} with a mistake {found['named']} were answered" in page
    assert len(found["each_missed"]) == found["mistakes"] - found["named"]
