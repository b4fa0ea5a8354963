"""What a reader may copy from README, docs and notebooks runs, and what they link exists."""

from __future__ import annotations

import ast
import inspect
import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import click
import gymnasium
import matplotlib.pyplot as plt
import pytest

import pamsim
from pamsim.cli.main import cli
from tests.integration.page_blocks import BLOCK, DOCS, ROOT, run_line
from tests.unit.core.refusals import refused

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.glob("*.md"))]
READMES = list(ROOT.glob("models/*/README.md"))
NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.py"))
# Tested block by block: the first below, the others in files of their own.
IN_ONE_FOLDER = {"walkthrough.md", "more_rigs.md", "own_physics.md", "sweep.md", "gpu.md"}
# What these do, tests of the commands, of the suite of controllers, the demo and the walkthrough do
# every day, in less time.
LONG = {
    "README.md-1", "control.md-2", "diagnose.md-0", "hide_and_diagnose", "identify.md-0",
    "recipes.md-8",
}  # fmt: skip

pytestmark = pytest.mark.usefixtures("catalogs_as_before")


def snippets(language):
    for page in (page for page in PAGES if page.name not in IN_ONE_FOLDER):
        for number, (kind, text) in enumerate(BLOCK.findall(page.read_text(encoding="utf-8"))):
            if kind == language:
                yield marked(small(text), f"{page.name}-{number}", "stable_baselines3" in text)


def marked(value, name, slow=False):
    marks = [pytest.mark.slow] if slow or name in LONG else []
    return pytest.param(value, id=name, marks=marks)


def small(text):
    """A text with the small settings that it states for a test."""
    return re.sub(r"= .+  # in a test: (.+)", r"= \1", text)


def run(command, folder):
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        command, cwd=folder, env=os.environ | {"PATH": path}, capture_output=True, text=True,
        timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Warning" not in done.stderr, done.stderr
    return done.stdout


@pytest.mark.parametrize("text", list(snippets("python")))
def test_python_snippets_run(text, tmp_path, monkeypatch, capsys):
    """In this process: to import everything again takes longer than most of them."""
    monkeypatch.chdir(tmp_path)
    if "stable_baselines3" in text:
        pytest.importorskip("stable_baselines3", reason="the extra rl is not installed")
    names: dict[str, object] = {"__name__": "__main__"}
    exec(compile(text, "snippet", "exec"), names)
    for made in names.values():  # what ends with the process there
        if isinstance(made, gymnasium.Env | gymnasium.vector.VectorEnv):
            made.close()
    printed = capsys.readouterr()
    assert printed.out.strip()
    assert "Warning" not in printed.err


def test_the_first_python_snippet_needs_nothing_that_is_already_there(tmp_path):
    first = next(snippets("python")).values[0]
    assert run([sys.executable, "-W", "error", "-c", first], tmp_path).strip()


@pytest.mark.parametrize("text", list(snippets("sh")))
def test_shell_snippets_run(text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for line in (line.split("#")[0].strip() for line in text.splitlines() if line.strip()):
        command, *words = line.split()
        if command == "make":  # its own target; running the suite in the suite never ends
            assert f"\n{words[0]}:" in (ROOT / "Makefile").read_text(encoding="utf-8")
        elif command == "pamsim":
            run_line(line, monkeypatch)
        else:
            run([command, *words], tmp_path)


@pytest.mark.parametrize("path", [marked(path, path.stem) for path in NOTEBOOKS])
def test_a_notebook_runs_with_the_small_settings_that_it_states(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    plt.switch_backend("agg")
    text = path.read_text(encoding="utf-8")
    assert small(text) != text
    exec(compile(small(text), path.name, "exec"), {"__name__": "__main__"})
    assert plt.get_fignums()
    plt.close("all")


def named(node, names):
    """What a dotted name stands for among what was imported; None of other expressions."""
    if isinstance(node, ast.Attribute):
        return getattr(named(node.value, names), node.attr, None)
    return names.get(node.id) if isinstance(node, ast.Name) else None


def test_what_long_snippets_type_and_call_is_there(monkeypatch, tmp_path):
    """Commands and their options, functions and the names of what they are given."""
    monkeypatch.chdir(tmp_path)  # results of the reader's own may lie where the tests began
    python = [*snippets("python"), *(marked(path.read_text(), path.stem) for path in NOTEBOOKS)]
    given = 0
    for text in (one.values[0] for one in python if one.id in LONG):
        tree, names = ast.parse(text), {}
        imports = [n for n in tree.body if isinstance(n, ast.Import | ast.ImportFrom)]
        exec(compile(ast.Module(imports, []), "imports", "exec"), names)
        for call in (node for node in ast.walk(tree) if isinstance(node, ast.Call)):
            if (function := named(call.func, names)) is not None:
                keywords = dict.fromkeys(k.arg for k in call.keywords)
                inspect.signature(function).bind_partial(*call.args, **keywords)
                given += len(keywords)
            elif isinstance(call.func, ast.Attribute) and named(call.func.value, names):
                pytest.fail(f"there is no {ast.unparse(call.func)}")
    assert given > 10
    for text in (one.values[0] for one in snippets("sh") if one.id in LONG):
        for line in text.splitlines():
            _, name, *words = line.split()
            cli.get_command(click.Context(cli), name).make_context(name, words)


def walked(page, folder, section=""):
    """Run all blocks of a page, or of a section, in a folder, and return its words."""
    text = (DOCS / page).read_text(encoding="utf-8")
    if section:
        (text,) = (part for part in text.split("\n## ") if part.startswith(f"{section}\n"))
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.chdir(folder)
        for language, block in BLOCK.findall(text):
            stated = re.match(r"(?:<!-- |# )(\S+)", block)  # the file that it shows
            match language:
                case "xml":
                    Path(stated[1]).write_text(block, encoding="utf-8")
                case "python":
                    exec(compile(block, page, "exec"), {"__name__": "__main__"})
                case "sh":
                    for line in block.splitlines():
                        run_line(line, monkeypatch)
                case "toml":
                    shown = tomllib.loads(block)
                    written = tomllib.loads(Path(stated[1]).read_text())
                    assert shown == {**written, "trial": written["trial"][:1]}
                case "text":  # the beginning of a file
                    assert any(f.read_text().startswith(block) for f in Path().glob("*.csv"))
                case _:
                    pytest.fail(f"a block of {language}, which nothing runs")
    return " ".join(text.split())


def result(folder, name):
    return json.loads((folder / name).read_text(encoding="utf-8"))


def test_the_walkthrough_runs_and_its_numbers_come_out(tmp_path):
    words = walked("walkthrough.md", tmp_path)
    checked, calibrated, diagnosed = (
        result(tmp_path, name)
        for name in ("page/check.json", "calibrated/calibration.json", "diagnosed/diagnosis.json")
    )
    assert checked["suspicions"] == []
    (seen,) = (one for one in checked["effects"] if one["name"] == "coulomb_friction")
    assert {"air_leak", "valve_flow"} <= set(checked["unseen"])
    (scale,), (angle,) = calibrated["parameters"], calibrated["misfit"]
    held_out = f"from {angle['held_out_before']:.1f} to {angle['held_out_after']:.1f} deg"
    (effect,) = diagnosed["effects"]
    assert diagnosed["verdict"] == "named"
    friction = effect["sizes"]["joint.elbow.frictionloss"]
    low, high = friction["interval95"]
    assert low < 0.1 < high  # as planted on the page
    for sentence in (
        f"misses the angle by {checked['channels']['angle']['missed']:.1f} deg",
        f"from {seen['shows_from']:.3f} N·m",
        f"It finds {scale['value']:.3f} and lowers the error {held_out}",
    ):
        assert sentence in words, sentence
    # Another processor adds in another order, and a search ends elsewhere in a flat valley.
    stated = re.search(rf"`{effect['name']}`, ([\d.]+) \[([\d.]+), ([\d.]+)\] N·m", words)
    assert stated
    shown = [float(number) for number in stated.groups()]
    assert shown == pytest.approx([friction["value"], low, high], abs=0.25 * (high - low))


def interval(size, digits, planted=None):
    """How a page writes a number with its interval, which holds what was planted, if stated."""
    low, high = size["interval95"]
    assert planted is None or low < planted < high
    return f"{size['value']:.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"


def named_sizes(folder):
    """Name of a parameter to what a diagnosis that names every cause found."""
    diagnosed = result(folder, "diagnosis.json")
    assert diagnosed["verdict"] == "named"
    return {n: size for one in diagnosed["effects"] for n, size in one["sizes"].items()}


@pytest.mark.slow
def test_a_sealed_joint_runs_and_its_numbers_come_out(tmp_path):
    words = walked("more_rigs.md", tmp_path, "A joint between shut muscles, moved by a motor")
    calibrated = result(tmp_path, "sealed_calibrated/calibration.json")
    assert calibrated["status"] == "converged"
    found = {one["name"]: one for one in calibrated["parameters"]}
    planted = {"joint.shaft.frictionloss": 0.3, "force.scale": 0.9}
    shown = [interval(found[name], 3, value) for name, value in planted.items()]
    (angle,) = (one for one in calibrated["misfit"] if one["channel"] == "angle")
    shown.append(f"from {angle['before']:.2f} to {angle['after']:.2f} deg")
    assert [text for text in shown if text not in words] == []


@pytest.mark.slow
def test_a_held_muscle_runs_and_its_numbers_come_out(tmp_path):
    words = walked("more_rigs.md", tmp_path, "A held muscle with on/off valves")
    sizes = named_sizes(tmp_path / "diagnosed")
    shown = [
        interval(sizes[name], digits)
        for name, digits in (
            ("chamber.heat_rate", 2), ("chamber.polytropic_index", 3), ("valve.closing_delay", 5),
        )
    ]  # fmt: skip
    assert [text for text in shown if text not in words] == []


@pytest.mark.slow
def test_a_leg_runs_and_its_numbers_come_out(tmp_path):
    words = walked("more_rigs.md", tmp_path, "A leg")
    log = {"logs": tmp_path / "swing.csv", "rig": "equimus_leg"}
    with refused("line 102: time_s = 0 does not come after 1.98", "state `wraps`"):
        pamsim.import_log(**log, out=tmp_path / "refused")
    taken = {
        c.column: c.quantity
        for c in pamsim.import_log(**log, out=tmp_path / "other", wraps="2s").columns
    }
    assert taken["pressure1_start"] == "hip_bellows.pressure"
    checked = result(tmp_path, "leg_page/check.json")
    assert checked["suspicions"] == []
    gaps = {one["channel"]: one["floors"] for one in checked["links"]["outputs"]}
    (size,) = named_sizes(tmp_path / "leg_diagnosed").values()
    for sentence in (
        f"misses the knee's angle by {gaps['knee.angle']:.0f} noise floors",
        f"a least pressure of {interval(size, 2, 5.0)} kPa",
    ):
        assert sentence in words, sentence


@pytest.mark.slow
def test_a_soft_arm_runs_and_its_numbers_come_out(tmp_path):
    words = walked("more_rigs.md", tmp_path, "A soft arm")
    checked = result(tmp_path, "chamber_page/check.json")
    assert checked["suspicions"] == []
    (gap,) = checked["links"]["outputs"]
    (size,) = named_sizes(tmp_path / "chamber_diagnosed").values()
    (warning,) = (
        one
        for one in result(tmp_path, "chamber_diagnosed/diagnosis.json")["warnings"]
        if "chamber.dead_volume" in one
    )
    (volume,) = result(tmp_path, "chamber_calibrated/calibration.json")["parameters"]
    for sentence in (
        f"a gap of {gap['floors']:.0f} noise floors in {gap['link']}",
        f"a delay of {interval(size, 4, 0.06)} s",
        f"refitted to {re.search('to (.+) times', warning)[1]} times",
        f"finds {interval(volume['written'], 1, 30.0)} cm³",
    ):
        assert sentence in words, sentence


def prose(page):
    return BLOCK.sub("", page.read_text(encoding="utf-8"))


def anchors(page):
    """Of its headings, as repository hosts and the site make them."""
    headings = re.findall(r"^#+ (.+)$", prose(page), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading).lower().replace(" ", "-") for heading in headings}


def test_links_lead_to_files_and_headings_that_exist():
    count = 0
    for page in (*PAGES, ROOT / "CHANGELOG.md", *READMES):
        for link in re.findall(r"\]\(([^)\s]+)\)", prose(page)):
            target, _, anchor = link.partition("#")
            if "://" in target:
                continue
            place = page.parent / target if target else page
            assert place.exists(), f"{page.name} links {target}"
            assert not anchor or anchor in anchors(place), f"{page.name} links {link}"
            count += 1
    assert count > 80


def test_files_of_the_table_which_file_to_open_exist():
    """A name without a folder lies in that of the path before it."""
    table = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").split("| question | file |")[1]
    count = 0
    for row in table.splitlines():
        folder = ROOT
        for name in re.findall(r"`([\w./]+(?:\.\w+|/))`", row):
            place = ROOT / name if "/" in name else folder / name
            assert place.exists(), f"CONTRIBUTING.md: {name} in {row!r}"
            folder, count = place.parent, count + 1
    assert count > 30


def test_the_index_lists_every_page_and_recipes_are_short():
    index = DOCS / "index.md"
    listed = re.findall(r"^- \*\*\[.+?\]\((\S+?)\)\*\*", index.read_text("utf-8"), re.MULTILINE)
    pages = {*PAGES, ROOT / "CHANGELOG.md", *READMES, *NOTEBOOKS} - {index}
    assert len(set(listed)) == len(listed)
    assert {(DOCS / page).resolve() for page in listed} == pages
    assert len(NOTEBOOKS) == 4
    recipes = BLOCK.findall((DOCS / "recipes.md").read_text(encoding="utf-8"))
    assert len(recipes) == 10
    assert all(sum(map(bool, text.splitlines())) <= 15 for _, text in recipes)
