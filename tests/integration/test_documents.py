"""Every snippet a reader may copy from README and docs runs as it stands."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import gymnasium
import pytest

from pamsim.cli.main import main

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
IN_ONE_FOLDER = {
    "walkthrough.md",
    "own_physics.md",
    "sweep.md",
    "gpu.md",
}  # tested block by block, in files of their own
FENCE = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)

pytestmark = pytest.mark.usefixtures("catalogs_as_before")


def snippets(language):
    for page in (page for page in PAGES if page.name not in IN_ONE_FOLDER):
        for number, (kind, text) in enumerate(FENCE.findall(page.read_text(encoding="utf-8"))):
            if kind == language:
                yield pytest.param(text, id=f"{page.name}-{number}")


def run(command, folder):
    environment = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
    }
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert "Warning" not in done.stderr, done.stderr
    return done.stdout


@pytest.mark.parametrize("text", list(snippets("python")))
def test_python_snippets_run(text, tmp_path, monkeypatch, capsys):
    """In this process: to import everything again takes longer than most of them."""
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "__main__"}
    exec(compile(text, "snippet", "exec"), names)
    for made in names.values():  # what ends with the process there
        if isinstance(made, gymnasium.Env | gymnasium.vector.VectorEnv):
            made.close()
    printed = capsys.readouterr()
    assert printed.out.strip()
    assert "Warning" not in printed.err


def test_ten_recipes_take_at_most_fifteen_lines_each():
    recipes = FENCE.findall((ROOT / "docs" / "recipes.md").read_text(encoding="utf-8"))
    assert len(recipes) == 10
    assert all(sum(map(bool, text.splitlines())) <= 15 for _, text in recipes)


def test_the_first_python_snippet_needs_nothing_that_is_already_there(tmp_path):
    first = next(snippets("python")).values[0]
    assert run([sys.executable, "-W", "error", "-c", first], tmp_path).strip()


@pytest.mark.parametrize("text", list(snippets("sh")))
def test_shell_snippets_run(text, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    lines = [line.split("#")[0].strip() for line in text.splitlines() if line.strip()]
    for line in lines:
        command, *words = line.split()
        if command == "make":  # its own target; running the suite in the suite never ends
            assert f"\n{words[0]}:" in (ROOT / "Makefile").read_text(encoding="utf-8")
        elif command == "pamsim":  # here: a process for every line takes half the time of them all
            monkeypatch.setattr("sys.argv", [command, *words])
            with pytest.raises(SystemExit) as ended:
                main()
            assert ended.value.code == 0, capsys.readouterr().err
        else:
            run([command, *words], tmp_path)


def anchors(page):
    """Of its headings, as repository hosts and the site make them."""
    prose = FENCE.sub("", page.read_text(encoding="utf-8"))
    headings = re.findall(r"^#+ (.+)$", prose, re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading).lower().replace(" ", "-") for heading in headings}


def test_links_lead_to_files_and_headings_that_exist():
    count = 0
    for page in (*PAGES, ROOT / "CHANGELOG.md", *sorted(ROOT.glob("models/*/README.md"))):
        for link in re.findall(r"\]\(([^)\s]+)\)", FENCE.sub("", page.read_text(encoding="utf-8"))):
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


def test_the_index_lists_every_page():
    index = ROOT / "docs" / "index.md"
    listed = re.findall(r"^- \*\*\[.+?\]\((\S+?)\)\*\*", index.read_text("utf-8"), re.MULTILINE)
    pages = {*PAGES, ROOT / "CHANGELOG.md", *ROOT.glob("models/*/README.md")} - {index}
    pages |= set((ROOT / "docs" / "notebooks").glob("*.py"))
    assert len(set(listed)) == len(listed)
    assert {(index.parent / page).resolve() for page in listed} == pages
