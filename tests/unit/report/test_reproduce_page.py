"""The page: complete, escaped, indifferent to unknown keys, with a word for what is absent."""

from __future__ import annotations

import html.parser
import math
import re
from pathlib import Path

import pytest

from pamsim.core.errors import InputError
from pamsim.report.reproduce_page import verdict_sentence, write_reproduction

FILES = {
    "index.html",
    "figure_6_static.png",
    "figure_7_large_medium.png",
    "figure_8_small.png",
    "figure_9_models.png",
    "errors.png",
    "pressures.png",
    "rows.csv",
}


class Page(html.parser.HTMLParser):
    """Tags with attributes, and the visible text."""

    def __init__(self, source: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self._style = False
        self.feed(source)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self._style = tag == "style"

    def handle_endtag(self, tag):
        self._style = False

    def handle_data(self, data):
        if not self._style:
            self.text += data

    def all(self, tag):
        return [attrs for name, attrs in self.tags if name == tag]


def write(result, recordings, out: Path) -> Page:
    write_reproduction(result, recordings, out)
    return Page((out / "index.html").read_text(encoding="utf-8"))


def test_writes_every_file_and_returns_its_path(result, recordings, tmp_path):
    out = tmp_path / "new" / "folder"
    paths = write_reproduction(result, recordings, out)
    assert {path.name for path in paths} == FILES
    assert {p.name for p in out.iterdir() if p.suffix not in (".svg", ".pdf")} == FILES
    assert all(path.parent == out and path.stat().st_size > 500 for path in paths)


@pytest.mark.usefixtures("quick")
def test_page_has_every_row_and_marks_repeats_and_slips(result, recordings, tmp_path):
    page = write(result, recordings, tmp_path)
    ids = [attrs.get("id") for attrs in page.all("tr")]
    assert [name for name in ids if name] == [f"row-{row}" for row in range(1, 25)]
    repeated = [attrs["id"] for attrs in page.all("tr") if attrs.get("class") == "repeat"]
    assert repeated == ["row-22", "row-23", "row-24"]
    for row in result["rows"]:
        assert f"{row['measured_deg']:.2f}".replace("-", "−") in page.text
        assert f"{row['simulated_deg']:.2f}".replace("-", "−") in page.text
    assert "Row 22: repeats row 13 in every figure; counted once in the RMS." in page.text
    assert "Row 4: the printed increment 252 has no minus sign." in page.text


@pytest.mark.usefixtures("quick")
def test_verdict_is_made_of_the_result_s_numbers(result, recordings, tmp_path):
    page = write(result, recordings, tmp_path)
    seen = f"{result['rms_deg']:.2f} deg RMS"
    assert "21 distinct operating points predicted with 1.23 deg RMS, each by a model" in page.text
    assert f"(nested leave-one-out); {seen} in sample (worst: row" in page.text
    assert "G₁: T = 0.672 s (output error) against 0.646 s printed" in page.text
    assert "T₁ = 0.0893 s, T₂ = 0.584 s (output error) against 0.0903 s and 0.579 s" in page.text
    assert "Checks: 1 of 3 fail" in page.text


def test_held_out_errors_of_another_arm_are_no_headline(result):
    seen = f"21 distinct operating points reproduced with {result['rms_deg']:.2f} deg RMS (worst"
    for calibration in ({**result["calibration"], "applies": False}, None):
        assert verdict_sentence({**result, "calibration": calibration}).startswith(seen)


@pytest.mark.usefixtures("quick")
def test_every_internal_link_and_image_exists(result, recordings, tmp_path):
    page = write(result, recordings, tmp_path)
    ids = {attrs["id"] for _, attrs in page.tags if "id" in attrs}
    for attrs in page.all("a"):
        target = attrs["href"]
        assert target[1:] in ids if target.startswith("#") else (tmp_path / target).is_file()
    assert len(page.all("img")) == 6
    for attrs in page.all("img"):
        assert int(attrs["width"]) > 300
        assert int(attrs["height"]) > 200


@pytest.mark.usefixtures("quick")
def test_page_needs_nothing_from_outside(result, recordings, tmp_path):
    page = write(result, recordings, tmp_path)
    source = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert not page.all("link")
    assert "http" not in source
    assert "url(" not in source
    assert source.startswith("<!DOCTYPE html>")


@pytest.mark.usefixtures("quick")
def test_hostile_text_is_escaped(result, recordings, tmp_path):
    attack = "<script>alert('x')</script><img src=x onerror=y>\"&"
    result["rig"] = result["start"] = result["start_meaning"] = attack
    result["rows"][0].update(message=attack, outcome="engine_warning", slip=attack)
    result["checks"][0].update(name=attack, sentence=attack)
    result["g1"]["method"] = result["g2"]["status"] = attack
    result["paper"]["source"] = attack
    result["paper"]["notes"] = [attack]
    result["parameters"][0].update(name=attack, unit=attack, source=attack, note=attack)
    result["versions"][attack] = attack
    page = write(result, recordings, tmp_path)
    assert len(page.all("script")) == 1  # the page's own
    assert len(page.all("img")) == 6
    assert page.text.count(attack) >= 15


def test_unknown_keys_change_nothing(result, recordings, tmp_path):
    write(result, recordings, tmp_path / "a")
    result["future"] = {"x": [1]}
    for place in (result["rows"][3], result["g1"], result["paper"], result["parameters"][0]):
        place["future"] = object()
    write(result, recordings, tmp_path / "b")
    for name in FILES:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


@pytest.mark.usefixtures("quick")
def test_arx_without_time_constants_is_shown_with_its_status(result, recordings, tmp_path):
    result["g2"]["arx"]["free_gain"] = {
        "method": "arx",
        "status": "complex_poles",
        "K": None,
        "T1_s": None,
        "T2_s": None,
        "fit_percent": None,
    }
    result["figure9"]["g2_arx"] = None
    page = write(result, recordings, tmp_path)
    assert "complex poles" in page.text
    assert "None" not in page.text
    assert "nan" not in page.text


@pytest.mark.usefixtures("quick")
def test_nothing_identified_leaves_the_models_out(result, recordings, tmp_path):
    for key in ("g1", "g2", "figure9", "worst", "fit_percent", "parameters"):
        result[key] = None
    page = write(result, recordings, tmp_path)
    assert "None" not in page.text
    assert "against 0.646 s" not in page.text
    assert "as printed" in page.text


@pytest.mark.usefixtures("quick")
def test_broken_run_is_said_everywhere(result, recordings, tmp_path):
    result["rows"][12].update(
        simulated_deg=None,
        error_deg=None,
        settling_s=None,
        outcome="not_finite",
        message="the angle is not finite at 0.21 s",
    )
    result["rms_deg"] = None
    del recordings[1]
    page = write(result, recordings, tmp_path)
    assert "20 of 21 distinct operating points" in page.text
    assert "the run ended early (not finite): the angle is not finite at 0.21 s" in page.text
    assert "nan" not in page.text


@pytest.mark.parametrize("value", [math.nan, math.inf, None])
@pytest.mark.usefixtures("quick")
def test_numbers_that_are_none_become_dashes(result, recordings, tmp_path, value):
    result["wall_s"] = value
    result["rows"][0]["settling_s"] = value
    page = write(result, recordings, tmp_path)
    assert not re.search(r"\b(nan|inf)\b", page.text)


@pytest.mark.usefixtures("quick")
def test_bad_input_is_said_in_one_line(result, recordings, tmp_path):
    with pytest.raises(InputError, match=r"pamsim-reproduce/1"):
        write_reproduction({**result, "schema": "pamsim-reproduce/9"}, recordings, tmp_path)
    file = tmp_path / "taken"
    file.write_text("x")
    with pytest.raises(InputError, match=r"is a file"):
        write_reproduction(result, recordings, file)
