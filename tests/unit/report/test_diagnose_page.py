"""The page of a table at rest or a loop, and what pages share."""

from __future__ import annotations

import pytest

from pamsim.core.errors import InputError
from pamsim.diagnosis.diagnose import diagnose
from pamsim.report.diagnose_page import write_diagnosis
from pamsim.report.page import page_image
from pamsim.report.physical_words import physical_words
from pamsim.report.style import new_figure, page_style


def test_an_image_is_small_and_knows_what_its_panels_show(tmp_path):
    figure, (upper, lower) = new_figure(3.0, rows=2, sharex=True)
    with page_style():
        upper.plot([0.0, 4.0], [1.0, 100.0])
        upper.set_yscale("log")
        upper.set_ylim(1.0, 100.0)
        lower.plot([0.0, 4.0], [0.0, 1.0])
        lower.set_xlim(0.0, 4.0)
        lower.set_xlabel("time [s]")
        lower.set_yticks([0.0, 1.0], ["off", "on"])
    image = page_image(figure, tmp_path / "a.png")
    assert len(image.source) < (tmp_path / "a.png").stat().st_size
    ((x, y),) = image.panels  # the other has names along an axis
    assert (x["low"], x["high"], x["log"], x["label"]) == (0.0, 4.0, False, "time [s]")
    assert (y["low"], y["high"], y["log"], y["label"]) == (1.0, 100.0, True, "y")
    assert 0.0 < x["from"] < 0.2 < 0.9 < x["to"] <= 1.0
    assert 0.5 < y["from"] < y["to"] <= 1.0


def test_a_size_is_written_in_common_units_without_what_the_effect_cannot_change():
    physical = {
        "loop_half_width": {"value": 15.0, "unit": "N", "interval95": [13.2, 16.8]},
        "lost_travel": {"value": 3e-4, "unit": "m", "interval95": None},
        "force_per_pressure_ratio": {"value": 1.0, "unit": "1", "interval95": [1.0, 1.0]},
        "at_pressure": {"value": 2.5e5, "unit": "Pa", "interval95": None},
        "contraction_amplitude": {"value": 0.015, "unit": "1", "interval95": None},
    }
    assert physical_words(physical) == (
        "loop half width 15.0 [13.2, 16.8] N; lost travel 0.300 mm"
        " (test: pressure 2.5 bar, contraction amplitude 1.5 %)"
    )
    two = {f"chain_backlash.{name}": entry for name, entry in physical.items()}
    assert physical_words(two) == (
        "chain backlash: loop half width 15.0 [13.2, 16.8] N; chain backlash: lost travel 0.300 mm"
        " (test: pressure 2.5 bar, contraction amplitude 1.5 %)"
    )
    assert physical_words({}) == ""


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("name", ["alraouf2025", "alraouf2025_equations"])
def test_a_loop_gets_the_same_page_with_the_parts_that_it_has(name, tmp_path):
    one = diagnose(name)
    page = write_diagnosis(one.to_dict(), tmp_path)[0].read_text("utf-8")
    assert one.summary() in page
    assert "The loop and the difference of its branches." in page
    assert "Nuisance parameters" not in page
    assert "None" not in page
    assert "held out one at a time" in page
    result = {**one.to_dict(), "rig": "<arm>", "warnings": ["<b>"]}
    assert "<arm>" not in write_diagnosis(result, tmp_path)[0].read_text("utf-8")
    with pytest.raises(InputError, match="reads 'pamsim-diagnosis/2'"):
        write_diagnosis({**result, "schema": "x"}, tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="is a file; name a folder"):
        write_diagnosis(result, tmp_path / "file")
