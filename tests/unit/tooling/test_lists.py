"""What ``pamsim list`` prints is what its JSON states, in units that are read easily."""

import json
import re

import pytest

from pamsim.core.units import parse_quantity
from pamsim.recordings.rig_file import shipped_rig_names
from pamsim.twins.protocol_cards import KINDS
from tests.typed_command import run


@pytest.fixture
def listed(monkeypatch, capsys):
    """The entries of a list or card as JSON, and the text printed beside it."""

    def both(kind, *words):
        code, out, err = run(monkeypatch, capsys, "list", kind, *words, "--json", "-")
        assert code == 0, err
        return json.loads(out)["parameters" if kind == "params" else kind], err

    return both


def labelled(text):
    """Label -> text of a card."""
    return dict(re.findall(r"^  (\S.*?): +(.+)$", text, re.M))


def si(text, unit):
    """The numbers of a text that ends with their unit, in SI."""
    numbers = re.findall(r"(?<!\S)-?[\d.]+(?:e[+-]?\d+)?(?!\S)", text)
    after = text.rpartition(numbers[-1])[2].strip()
    return [parse_quantity(f"{one} {after}", unit, unit, where=text) for one in numbers]


@pytest.mark.parametrize("name", shipped_rig_names())
def test_ranges_pressures_and_values_of_a_rig_are_those_of_its_json(listed, name):
    (rig,), text = listed("rigs", name)
    shown = labelled(text)
    for joint in rig["joints"]:
        motion, _, ends = shown[f"joint {joint['name']}"].partition(" from ")
        verb, unit = ("turns", "rad") if joint["kind"] == "angle" else ("slides", "m")
        assert motion == verb
        assert si(ends, unit) == pytest.approx(joint["range"], rel=1e-3)
    for muscle in rig["muscles"]:
        law, hysteresis, pressures = shown[f"muscle {muscle['name']}"].split(", ")
        assert law == f"force law {muscle['force']}"
        assert hysteresis == f"hysteresis {muscle['hysteresis'] or 'none'}"
        assert si(pressures, "Pa") == pytest.approx([0.0, muscle["supply_pressure"]])
    parameters, text = listed("params", "--rig", name)
    rows = dict(re.findall(r"^  (\S+) +(\S+(?: \S+)?)  ", text, re.M))
    assert rows.keys() == {one["name"] for one in parameters}
    for one in parameters:
        assert si(rows[one["name"]], one["unit"]) == pytest.approx([one["value"]], rel=1e-5)


def test_the_card_of_a_parameter_has_the_interval_and_note_that_the_rig_s_file_states(listed):
    (one,), text = listed("params", "joint.shaft.damping")
    shown, stated = labelled(text), one["stated"]
    assert si(shown["95 % interval"], "N*m*s/rad") == pytest.approx(stated["interval95"])
    assert (shown["note"], shown["source"]) == (stated["note"], stated["source"])
    assert "note" not in labelled(listed("params", "chamber.floor")[1])  # of a default


@pytest.mark.parametrize(("kind", "group"), [("effects", "family"), ("protocols", "kind")])
def test_each_name_stands_under_the_title_of_its_group(listed, kind, group):
    entries, text = listed(kind)
    found, title = [], ""
    for line in text.splitlines()[:-1]:
        if line.startswith("  "):
            found.append((title, re.split(r"[ :]", line.strip())[0]))
        else:
            title = line.removesuffix(":")
    assert sorted(found) == sorted((KINDS.get(e[group], e[group]), e["name"]) for e in entries)


def test_the_card_of_an_effect_has_its_look_alikes_and_why_a_rig_cannot_have_it(listed):
    for rig, tried in (("mas20_arm", True), ("equimus_leg", False)):  # of several joints
        (one,), text = listed("effects", "viscous_friction", "--rig", rig)
        shown = labelled(text)
        assert shown["looks like"] == ", ".join(one["look_alikes"])
        assert shown.get("not tried") == one["not_tried"]
        assert (one["not_tried"] is None) == tried
