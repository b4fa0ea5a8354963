"""The figures of diagnoses of rows and loops show what the results hold."""

from __future__ import annotations

import numpy as np

from pamsim.report.row_errors import loop_branches, row_errors

ROWS = [
    {"row": "row 1", "pressure_kpa": [300.0, 0.0], "before_deg": 4.0, "after_deg": 0.5},
    {"row": "row 2", "pressure_kpa": [300.0, 200.0], "before_deg": -8.0, "after_deg": -1.5},
]
FOUND = [{"effect": "muscle_hysteresis:stop"}]


def result(rows=ROWS, *, named=True):
    return {"rows": rows, "effects": FOUND if named else []}


def test_rows_lie_over_the_pressure_they_share():
    before, after = row_errors(result()).axes
    assert before.lines[0].get_xdata().tolist() == [0.0, 200.0]
    assert after.lines[0].get_ydata().tolist() == [0.5, -1.5]
    assert before.get_ylim() == after.get_ylim()
    assert "6.32 deg" in before.get_title(loc="left")
    (alone,) = row_errors(result(named=False)).axes
    assert alone.lines[0].get_ydata().tolist() == [4.0, -8.0]


def test_rows_that_stand_out_are_named_unless_they_share_no_pressure():
    near = [{**ROWS[1], "row": f"row {n}", "before_deg": 0.5} for n in range(3, 7)]
    before, after = row_errors(result([*ROWS, *near])).axes
    assert [text.get_text() for text in before.texts] == ["row 2"]
    assert not after.texts


def loop(*, named=True, error=None):
    return {
        "effects": FOUND if named else [],
        "branches": {
            "pressure_kpa": [0.0, 50.0],
            "rising_mm": [300.1, 279.0],
            "falling_mm": [300.0, 282.5],
            "opened_mm": [0.5, -2.0] if named else None,
            "error_mm": error,
        },
    }


def labels(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_a_loop_is_drawn_with_its_base_and_what_was_found():
    above, below = loop_branches(loop()).axes
    assert np.allclose([bar.get_height() for bar in below.patches], [0.1, -3.5])
    drawn = [line.get_ydata() for line in above.lines]
    for wanted in ([300.05, 280.75], [300.1, 279.0], [300.0, 282.5], [300.3, 279.75]):
        assert any(np.allclose(wanted, line) for line in drawn)
    assert any(np.array_equal([0.5, -2.0], line.get_ydata()) for line in below.lines)
    assert "muscle hysteresis:stop" in labels(above)


def test_where_nothing_was_found_the_reversible_curve_stands_alone():
    above, below = loop_branches(loop(named=False, error=[1.0, 2.0])).axes
    assert labels(above) == ["reversible curve", "readings, rising", "readings, falling"]
    assert labels(below) == ["readings ± standard error", "reversible curve"]
