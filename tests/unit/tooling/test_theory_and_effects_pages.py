"""The pages on laws, effects, rooms and names leave none out; pictures are those of today."""

from __future__ import annotations

import ast
import importlib
import inspect
import re
import runpy
import tomllib
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

import pamsim
import pamsim.controllers
import pamsim.envs
from pamsim.effects.catalog import FORMS, effect
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.muscle import PLAIN_GROUPS
from tests.records import recorded, script

ROOT = Path(__file__).parents[3]
DOCS = ROOT / "docs"
GALLERY: dict[str, Any] = vars(script("effect_gallery"))
LEARNING: dict[str, Any] = vars(script("learning_curves"))
FIELDS: dict[str, Any] = runpy.run_path(str(ROOT / "scripts" / "parameter_page.py"))
LABELS = [one.label for forms in FORMS.values() for one in forms]


def text(name):
    return (DOCS / name).read_text(encoding="utf-8")


def test_the_page_of_effects_is_that_of_the_catalog():
    again = "python scripts/effect_gallery.py"
    assert GALLERY["PAGE"].read_text(encoding="utf-8") == GALLERY["page"](), again
    assert all(effect(label).equation for label in LABELS)


def test_the_page_of_parameters_is_that_of_the_classes():
    again = "python scripts/parameter_page.py"
    written = FIELDS["PAGE"].read_text(encoding="utf-8")
    assert written == FIELDS["page"](), again
    assert all(f"\n## muscle.{one.group}\n" in written for one in PLAIN_GROUPS)


def curves(path):
    """Points of the drawn lines, in a row."""
    lines = re.findall(r'<path d="([^"]+)" clip-path', path.read_text(encoding="utf-8"))
    numbers = [re.findall(r"-?\d+(?:\.\d+)?", line) for line in lines]
    return np.array([float(number) for line in numbers if len(line) > 20 for number in line])


def test_every_effect_has_a_small_picture_of_what_the_simulation_does(tmp_path):
    pictures = {path.stem: path for path in GALLERY["PICTURES"].glob("*.svg")}
    assert set(pictures) == {label.replace(":", "-") for label in LABELS}
    assert max(path.stat().st_size for path in pictures.values()) < 30_000
    picture = pictures["added_inertia"]
    (name,) = re.findall(r">([a-z_]+)</text>\s*</g>\s*</g>", picture.read_text(encoding="utf-8"))
    GALLERY["draw"]([effect("added_inertia")], tmp_path, [name])
    kept, again = curves(picture), curves(tmp_path / picture.name)
    assert len(kept) > 1000
    assert kept.shape == again.shape
    assert abs(kept - again).max() < 1.0  # point of print


def test_the_learning_curves_are_those_of_the_records(tmp_path):
    LEARNING["draw"](tmp_path / "again.svg")
    kept, again = curves(LEARNING["PICTURE"]), curves(tmp_path / "again.svg")
    assert LEARNING["PICTURE"].stat().st_size < 30_000
    points = [len(recorded(f"results/{name}")["curve"]["steps"]) for name in LEARNING["COLOURS"]]
    assert len(points) == 3
    assert kept.size == 2 * sum(points)
    np.testing.assert_allclose(kept, again, atol=1.0)  # point of print


def test_the_theory_names_every_file_with_a_law_and_the_source_of_every_law():
    theory = " ".join(text("theory.md").split())
    composing = {
        "antagonist", "chamber_pressure", "chosen_law", "commands", "invariants", "kernel",
        "muscle", "muscle_hysteresis", "muscle_valves", "record", "regulation",
        "rest_state", "static_muscle", "step_limits", "chain", "friction",
    }  # fmt: skip
    every = (ROOT / "pamsim" / "physics").rglob("[!_]*.py")
    files = [path.name for path in every if path.stem not in composing]
    assert len(files) > 20
    assert [name for name in files if not re.search(rf"[`/]{re.escape(name)}`", theory)] == []
    for card in (*FORCE_LAWS.values(), *OPERATORS.values()):
        # The first author and year, or the standard, that the card names.
        name = re.match(r"[\w -]+?(?=[,;(]| and | et al)", card.source)
        assert name, card.source
        assert name[0].strip() in theory, card.name


def test_the_architecture_has_the_rooms_in_the_order_that_is_checked():
    table = text("architecture.md").split("| packages, from the top |")[1].split("\n\n")[0]
    rows = [re.findall(r"`(\w+)`", row.split("|")[1]) for row in table.splitlines()[2:]]
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    (rooms,) = (c for c in settings["tool"]["importlinter"]["contracts"] if c["id"] == "rooms")
    layers = [re.findall(r"\w+", layer) for layer in rooms["layers"] if "(" not in layer]
    assert [sorted(row) for row in rows] == [sorted(layer) for layer in layers]


DIRECTIVES = [
    match
    for name in ("api.md", "api_rooms.md")
    for match in re.findall(r"^\.\. auto(\w+):: (\S+)$", text(name), re.MULTILINE)
]
MODULES = {name for kind, name in DIRECTIVES if kind == "module"}
NAMES = {name for kind, name in DIRECTIVES if kind != "module"}


def test_the_api_pages_have_every_public_name_the_class_of_its_result_and_every_controller():
    top = [name for _, name in DIRECTIVES if re.fullmatch(r"pamsim\.\w+", name)]
    assert sorted(top) == [f"pamsim.{name}" for name in pamsim.__all__]
    classes = {name.rpartition(".")[2] for name in NAMES}
    classes |= {"Any", "Figure", "FloatArray", "None", "Path"}
    for job in (name for name in pamsim.__all__ if name[0].islower()):
        returned = inspect.signature(getattr(pamsim, job)).return_annotation
        assert not re.fullmatch(r"[A-Z]\w+", returned) or returned in classes, (job, returned)
    files = (ROOT / "pamsim" / "controllers").glob("[!_]*.py")
    assert {f"pamsim.controllers.{path.stem}" for path in files} <= MODULES
    for kind, name in DIRECTIVES:
        if name.endswith("sb3_adapter") and find_spec("stable_baselines3") is None:
            continue
        module, _, own = ("", "", "") if kind == "module" else name.rpartition(".")
        found = importlib.import_module(module or name)
        assert kind == "data" or inspect.getdoc(getattr(found, own) if own else found), name


FRONT = {
    f"{package.__name__}.{name}"
    for package in (pamsim, pamsim.controllers, pamsim.envs)
    for name in package.__all__
}
"""What can be imported without knowing in which module it is."""
OPTIONAL = {"pamsim.envs.sb3_adapter.Sb3Rigs"}  # an extra; `help(pamsim.envs)` works without it
INSIDE = {"architecture.md", "reproduce.py"}  # for whoever changes the package, or takes it apart


def imported(file):
    """Names of pamsim that the examples of a page or notebook import."""
    lines = re.findall(r"^from (pamsim[\w.]*) import (.+)$", file.read_text("utf-8"), re.MULTILINE)
    return {f"{module}.{name.strip()}" for module, names in lines for name in names.split(",")}


def test_examples_import_from_the_front_alone_and_those_inside_what_has_a_page():
    files = (ROOT / "README.md", *DOCS.glob("*.md"), *DOCS.glob("notebooks/*.py"))
    shown = {file.name: imported(file) for file in files}
    inside = set().union(*(shown.pop(name) for name in INSIDE))
    beyond = {name: names - FRONT - OPTIONAL for name, names in shown.items()}
    assert len(set().union(*shown.values()) & FRONT) > 5
    assert {name: rest for name, rest in beyond.items() if rest} == {}
    without_page = {name for name in inside - NAMES if name.rpartition(".")[0] not in MODULES}
    assert without_page == set()


def test_every_number_of_the_diagnosis_has_a_reason_and_few_decide_what_it_concludes():
    script = runpy.run_path(str(ROOT / "scripts/constants.py"), run_name="constants")
    found = list(script["constants"]())
    assert [f"{one.file}: {one.names}" for one in found if not one.reason] == []
    rules = [one.names for one in found if one.is_rule]
    assert sorted(rules) == sorted(name for names in script["RULES"].values() for name in names)
    assert len(rules) <= 15
    # Numbers of the rules that stand in a function are 0, 1, 2 and one half: none hides there.
    for file in script["RULES"]:
        source = (ROOT / "pamsim/diagnosis" / file).read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.FunctionDef):
                numbers = {n.value for n in ast.walk(node) if isinstance(n, ast.Constant)}
                plain = {n for n in numbers if isinstance(n, int | float)} - {0, 1, 2, 0.5, -1}
                assert not plain, f"{file}: {node.name}: {plain}"
