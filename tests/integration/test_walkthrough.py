"""The documentation's walkthrough, block by block in one folder, and the numbers it states."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import pytest

from pamsim.cli.main import main

PAGE = Path(__file__).resolve().parents[2] / "docs" / "walkthrough.md"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def run(text, monkeypatch):
    """The commands of a block."""
    for line in text.splitlines():
        words = [sorted(map(str, Path().glob(w))) if "*" in w else [w] for w in line.split()]
        monkeypatch.setattr("sys.argv", [word for part in words for word in part])
        with pytest.raises(SystemExit) as end:
            main()
        assert end.value.code == 0, line


def stated(text):
    """The file that a block shows, by the name in its first line."""
    return Path(re.match(r"(?:<!-- |# )(\S+)", text)[1])


@pytest.fixture(scope="module")
def walked(tmp_path_factory):
    """Folder of the whole walkthrough, and the words of the page."""
    folder = tmp_path_factory.mktemp("walkthrough")
    text = PAGE.read_text(encoding="utf-8")
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.chdir(folder)
        for language, block in BLOCK.findall(text):
            match language:
                case "xml":
                    stated(block).write_text(block, encoding="utf-8")
                case "python":
                    exec(compile(block, "walkthrough", "exec"), {"__name__": "__main__"})
                case "sh":
                    run(block, monkeypatch)
                case "toml":
                    shown, written = tomllib.loads(block), tomllib.loads(stated(block).read_text())
                    assert shown["columns"] == written["columns"]
                    assert shown["trial"] == written["trial"][:1]
                    assert {**shown, "trial": 0} == {**written, "trial": 0}
                case _:
                    pytest.fail(f"a block of {language}, which nothing runs")
    return folder, " ".join(text.split())


def test_every_block_runs_and_the_numbers_of_the_page_come_out(walked):
    folder, words = walked
    calibrated = json.loads((folder / "calibrated" / "calibration.json").read_text())
    (scale,), (angle,) = calibrated["parameters"], calibrated["misfit"]
    held_out = f"from {angle['held_out_before']:.1f} to {angle['held_out_after']:.1f} deg"
    assert f"It finds {scale['value']:.3f} and lowers the error {held_out}" in words
    found = json.loads((folder / "diagnosed" / "diagnosis.json").read_text())
    (effect,) = found["effects"]
    friction = effect["sizes"]["joint.elbow.frictionloss"]
    low, high = friction["interval95"]
    size = f"{friction['value']:.3f} [{low:.3f}, {high:.3f}] N·m"
    assert f"`{effect['name']}`, {size}" in words
    assert found["verdict"] == "named"
    assert low < 0.1 < high  # as planted on the page


def test_the_check_says_what_the_page_says_of_it(walked):
    folder, words = walked
    found = json.loads((folder / "page" / "check.json").read_text())
    assert found["suspicions"] == []
    assert f"misses the angle by {found['channels']['angle']['missed']:.1f} deg" in words
    (friction,) = (one for one in found["effects"] if one["name"] == "coulomb_friction")
    assert f"from {friction['shows_from']:.3f} N·m" in words
    assert {"air_leak", "valve_flow"} <= set(found["unseen"])
