"""The figures of diagnoses of rows and loops show what the results hold."""

from __future__ import annotations

import numpy as np

from pamsim.report.diagnose_rows import loop_branches, row_errors

ROWS = [
    {"row": "row 1", "p1_kpa": 300.0, "p2_kpa": 0.0, "before_deg": 4.0, "after_deg": 0.5},
    {"row": "row 2", "p1_kpa": 300.0, "p2_kpa": 200.0, "before_deg": -8.0, "after_deg": -1.5},
]


def result(named=True):
    tried = [
        {"effects": ["one"], "held_out": 2.0, "accepted": True},
        {"effects": ["one", "two"], "held_out": 1.0, "accepted": True},
    ]
    after = {"value": 1.0} if named else None
    gap = {"as_it_stands": {"value": 9.0}, "before": {"value": 5.0}, "after": after}
    return {
        "rows": [{**row, "after_deg": row["after_deg"] if named else None} for row in ROWS],
        "resembles": {"name": "one+two"},
        "gap": {"angle_at_rest": gap},
        "tried": tried,
    }


def test_rows_lie_over_the_pressure_they_share_and_bars_are_the_errors():
    before, after, errors = row_errors(result()).axes
    assert before.lines[0].get_xdata().tolist() == [0.0, 200.0]
    assert after.lines[0].get_ydata().tolist() == [0.5, -1.5]
    assert before.get_ylim() == after.get_ylim()
    assert [bar.get_width() for bar in errors.patches] == [9.0, 5.0, 2.0, 1.0]
    assert "6.32 deg" in before.get_title(loc="left")


def test_rows_that_stand_out_are_named_unless_they_share_no_pressure():
    near = [{**ROWS[1], "row": f"row {n}", "before_deg": 0.5} for n in range(3, 7)]
    before, after, _ = row_errors({**result(), "rows": [*ROWS, *near]}).axes
    assert [text.get_text() for text in before.texts] == ["row 2"]
    assert not after.texts


def test_without_a_name_the_second_panel_says_so():
    _, after, errors = row_errors(result(named=False)).axes
    assert "no effect improves the prediction" in after.texts[0].get_text()
    assert len(errors.patches) == 3


def loop(nearest=True, claimed=False, error=None):
    model = {
        "effect": "muscle_hysteresis",
        "form": "stop",
        "rising_mm": [300.0, 280.0],
        "falling_mm": [299.5, 282.0],
    }
    return {
        "where": [{"p_value": 0.06}],
        "effects": [],
        "alternatives": [{"name": "muscle_hysteresis"}] if claimed else [],
        "branches": {
            "pressure_kpa": [0.0, 50.0],
            "rising_mm": [300.1, 279.0],
            "falling_mm": [300.0, 282.5],
            "reversible_mm": [300.05, 280.75],
            "nearest": model if nearest else None,
            "rising_minus_falling_mm": [0.1, -3.5],
            "error_mm": error,
        },
    }


def labels(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_a_loop_is_drawn_with_its_base_and_the_nearest_model():
    above, below = loop_branches(loop(claimed=True)).axes
    assert np.allclose([bar.get_height() for bar in below.patches], [0.1, -3.5])
    assert "p = 0.060" in below.get_title(loc="left")
    drawn = [line.get_ydata() for line in above.lines]
    for wanted in ([300.05, 280.75], [300.1, 279.0], [300.0, 282.5], [300.0, 280.0]):
        assert any(np.array_equal(wanted, line) for line in drawn)
    assert any(np.array_equal([0.5, -2.0], line.get_ydata()) for line in below.lines)
    assert "muscle hysteresis (stop)" in labels(above)


def test_a_model_that_is_not_claimed_says_so_and_none_is_drawn_where_none_was_tried():
    above, below = loop_branches(loop(error=[1.0, 2.0])).axes
    assert "muscle hysteresis (stop), not claimed" in labels(above)
    assert "readings ± standard error" in labels(below)
    above, below = loop_branches(loop(nearest=False)).axes
    assert labels(above) == ["reversible curve", "readings, rising", "readings, falling"]
    assert labels(below) == ["readings", "reversible curve"]
