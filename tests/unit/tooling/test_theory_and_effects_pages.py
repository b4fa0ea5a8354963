"""The pages on laws, effects and rooms leave none out; pictures are of today's simulation."""

from __future__ import annotations

import re
import runpy
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pamsim.effects.catalog import FORMS, effect
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.muscle import PLAIN_GROUPS

ROOT = Path(__file__).parents[3]
GALLERY: dict[str, Any] = runpy.run_path(str(ROOT / "scripts" / "effect_gallery.py"))
FIELDS: dict[str, Any] = runpy.run_path(str(ROOT / "scripts" / "parameter_page.py"))
LABELS = [one.label for forms in FORMS.values() for one in forms]


def test_the_page_of_effects_is_that_of_the_catalog():
    again = "python scripts/effect_gallery.py"
    assert GALLERY["PAGE"].read_text(encoding="utf-8") == GALLERY["page"](), again


def test_the_page_of_parameters_is_that_of_the_classes():
    again = "python scripts/parameter_page.py"
    assert FIELDS["PAGE"].read_text(encoding="utf-8") == FIELDS["page"](), again


def test_the_page_of_parameters_leaves_no_group_out():
    text = FIELDS["PAGE"].read_text(encoding="utf-8")
    assert [one.group for one in PLAIN_GROUPS if f"\n## muscle.{one.group}\n" not in text] == []


def test_every_effect_has_a_small_picture():
    pictures = {path.stem: path for path in GALLERY["PICTURES"].glob("*.svg")}
    assert set(pictures) == {label.replace(":", "-") for label in LABELS}
    assert max(path.stat().st_size for path in pictures.values()) < 30_000


@pytest.mark.parametrize("label", LABELS)
def test_every_effect_states_equation_look_alikes_and_experiment(label):
    one = effect(label)
    assert one.equation
    assert one.separating
    assert set(one.look_alikes) <= set(FORMS)


def curves(path):
    """Points of the drawn lines, in a row."""
    text = path.read_text(encoding="utf-8")
    lines = re.findall(r'<path d="([^"]+)" clip-path', text)
    numbers = [re.findall(r"-?\d+(?:\.\d+)?", line) for line in lines]
    return np.array([float(number) for line in numbers if len(line) > 20 for number in line])


def test_a_picture_shows_what_the_simulation_does(tmp_path):
    one = effect("added_inertia")
    picture = GALLERY["PICTURES"] / "added_inertia.svg"
    (name,) = re.findall(r">([a-z_]+)</text>\s*</g>\s*</g>", picture.read_text(encoding="utf-8"))
    GALLERY["draw"]([one], tmp_path, [name])
    kept, again = curves(picture), curves(tmp_path / picture.name)
    assert len(kept) > 1000
    assert kept.shape == again.shape
    assert abs(kept - again).max() < 1.0  # point of print


def test_the_theory_names_every_file_with_a_law():
    text = (ROOT / "docs" / "theory.md").read_text(encoding="utf-8")
    composing = {
        "antagonist", "chamber_pressure", "chosen_law", "commands", "invariants", "kernel",
        "muscle", "muscle_hysteresis", "muscle_valves", "record", "regulation",
        "rest_state", "static_muscle", "step_limits", "chain", "friction",
    }  # fmt: skip
    every = (ROOT / "pamsim" / "physics").rglob("[!_]*.py")
    files = [path for path in every if path.stem not in composing]
    assert len(files) > 20
    missing = [path.name for path in files if not re.search(rf"[`/]{re.escape(path.name)}`", text)]
    assert not missing


@pytest.mark.parametrize(
    "card", [*FORCE_LAWS.values(), *OPERATORS.values()], ids=lambda card: card.name
)
def test_the_theory_gives_the_source_of_every_law(card):
    """The first author and year, or the standard, that the card names."""
    text = " ".join((ROOT / "docs" / "theory.md").read_text(encoding="utf-8").split())
    name = re.match(r"[\w -]+?(?=[,;(]| and | et al)", card.source)
    assert name, card.source
    assert name[0].strip() in text


def test_the_architecture_has_the_rooms_in_the_order_that_is_checked():
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    table = text.split("| packages, from the top |")[1].split("\n\n")[0]
    rows = [re.findall(r"`(\w+)`", row.split("|")[1]) for row in table.splitlines()[2:]]
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    (rooms,) = (c for c in settings["tool"]["importlinter"]["contracts"] if c["id"] == "rooms")
    layers = [re.findall(r"\w+", layer) for layer in rooms["layers"] if "(" not in layer]
    assert [sorted(row) for row in rows] == [sorted(layer) for layer in layers]
