"""Tables of angles at rest: read in SI, slips answered with line and remedy."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.recordings.printed import distinct_steps
from pamsim.recordings.static_table import read_static_table

GOOD = "p1_kpa,p2_kpa,load_kg,angle_deg\n400,100,1.2,30\n100,400,0,-29\n"


def write(folder, text):
    path = folder / "rest.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_numbers_arrive_in_si(tmp_path):
    table = read_static_table(write(tmp_path, GOOD))
    assert table.name == "rest"
    assert table.rows == ("line 2", "line 3")
    np.testing.assert_allclose(table.pressure, [[4e5, 1e5], [1e5, 4e5]])
    np.testing.assert_allclose(table.load, [1.2, 0.0])
    np.testing.assert_allclose(np.degrees(table.angle), [30.0, -29.0])
    assert table.start is None
    assert table.notes == ()


def test_starts_load_and_the_papers_name_of_the_angle_may_differ(tmp_path):
    text = "p1_kpa,p2_kpa,beta_deg,start_p1_kpa,start_p2_kpa,remark\n400,100,30,250,260,x\n"
    table = read_static_table(write(tmp_path, text))
    np.testing.assert_allclose(table.start, [[2.5e5, 2.6e5]])
    np.testing.assert_allclose(table.load, [0.0])
    assert "column 'remark' is not used" in table.notes[0]
    assert "no load" in table.notes[1]


def test_the_packaged_table_has_the_distinct_printed_rows():
    table = read_static_table("mas20")
    steps = distinct_steps()
    assert len(table.rows) == len(steps) == 21
    assert table.rows[0] == "row 1"
    np.testing.assert_allclose(table.angle, [step.angle for step in steps])
    np.testing.assert_allclose(table.pressure, [step.pressure for step in steps])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("p2_kpa", "p2_bar", "column 'p2_bar' is not of this format"),
        ("angle_deg", "angle_rad", "column 'angle_rad' is not of this format"),
        ("angle_deg", "remark", "no column 'angle_deg'"),
        ("angle_deg", "p1_kpa", "column 'p1_kpa' is there twice"),
        ("400,100", "400000,100", "line 2: p1_kpa = 400000 is too much .* divide it by 1000"),
        ("400,100", "-400,100", "line 2: p1_kpa = -400 is negative"),
        ("1.2,30", "1.2,3000", "line 2: angle_deg = 3000 is more than a turn"),
        ("1.2,30", "1200,30", "line 2: load_kg = 1200 is no load"),
        ("1.2,30", "-1,30", "line 2: load_kg = -1 is negative"),
        ("1.2,30", "1.2,", "line 2: angle_deg is empty"),
        ("1.2,30", "1.2,nan", "line 2: angle_deg = nan is not finite"),
        ("p1_kpa,p2_kpa", "a,b", "no column 'p1_kpa'"),
        ("load_kg", "start_p1_kpa", "start_p1_kpa alone"),
    ],
)
def test_slips_are_answered(tmp_path, old, new, words):
    with pytest.raises(InputError, match=words):
        read_static_table(write(tmp_path, GOOD.replace(old, new, 1)))


def test_bar_for_kpa_and_a_missing_file_are_refused(tmp_path):
    text = "p1_kpa,p2_kpa,angle_deg\n4,1,30\n1,4,-29\n"
    with pytest.raises(InputError, match="hold bar, multiply them by 100"):
        read_static_table(write(tmp_path, text))
    with pytest.raises(InputError, match="cannot read"):
        read_static_table(tmp_path / "none.csv")
