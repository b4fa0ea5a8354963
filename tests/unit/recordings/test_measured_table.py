"""Measured tables: kinds by their columns, SI inside, and one line for each mistake."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.recordings.measured_table import ForceLoops, ForceMap, LengthLoop, read_measured
from pamsim.recordings.printed import distinct_steps
from pamsim.recordings.static_table import read_static_table
from tests.unit.core.refusals import cases, refused

MAP = "p_kpa,contraction,force_n\n100,0.0,500\n200,0.1,600\n300,0.2,0\n"


@pytest.fixture
def table(tmp_path):
    def read(text, **options):
        path = tmp_path / "data.csv"
        path.write_text(text, encoding="utf-8")
        return read_measured(path, **options)

    return read


def test_a_force_map_in_si(table):
    found = table("# by hand\n\n" + MAP)
    assert isinstance(found, ForceMap)
    assert found.pressure.tolist() == [1e5, 2e5, 3e5]
    assert found.contraction.tolist() == [0.0, 0.1, 0.2]
    assert found.force.tolist() == [500.0, 600.0, 0.0]
    assert found.nominal_length is None


@pytest.mark.parametrize(
    ("header", "row", "pressure", "force"),
    [
        ("p_gauge_Pa,contraction_ratio,force_N", "150000,0.1,20", 1.5e5, 20.0),
        ("p_bar,contraction_percent,force_kn", "1.5,10,0.02", 1.5e5, 20.0),
        ("pressure_mpa,kappa,force_n", "0.15,0.1,20", 1.5e5, 20.0),
        ("force_n,p_psi,contraction", "20,21.7556607,0.1", 1.5e5, 20.0),
    ],
)
def test_units_are_read_off_the_names(table, header, row, pressure, force):
    found = table(f"{header}\n{row}\n")
    assert found.pressure == pytest.approx([pressure], rel=1e-6)
    assert found.contraction == pytest.approx([0.1])
    assert found.force == pytest.approx([force])


def test_lengths_become_contractions(table):
    text = "p_kpa,length_mm,force_n\n300,270,100\n300,285,200\n"
    assert table(text, nominal_length=0.3).contraction == pytest.approx([0.1, 0.05])
    with pytest.raises(InputError, match="give `nominal_length`"):
        table(text)
    with pytest.raises(InputError, match="line 2: length 270 mm of nominal 30 mm"):
        table(text, nominal_length=0.03)


def test_length_beside_contraction_gives_the_nominal_length_and_must_agree(table):
    head = "p_kpa,length_mm,contraction,force_n\n"
    assert table(head + "300,270,0.1,1\n300,240,0.2,1\n").nominal_length == pytest.approx(0.3)
    with pytest.raises(InputError, match="line 3: length and contraction disagree"):
        table(head + "300,270,0.1,1\n300,240,0.1,1\n300,255,0.15,1\n")


def test_zeros_are_dropped_and_said(table):
    found = table(MAP).without_zeros()
    assert found.force.tolist() == [500.0, 600.0]
    assert found.pressure.size == found.contraction.size == 2
    assert found.notes == ("1 points of zero force dropped: slack or not measured",)
    assert found.without_zeros().notes == found.notes
    with pytest.raises(InputError, match="no force but zero"):
        table("p_kpa,contraction,force_n\n300,0.2,0\n").without_zeros()


def test_a_length_loop_with_branches(table):
    found = table("p_kpa,length_cm,branch\n0,30,up\n500,24,UP\n0,29.9,down\n")
    assert isinstance(found, LengthLoop)
    assert found.length == pytest.approx([0.3, 0.24, 0.299])
    assert found.rising.tolist() == [True, True, False]
    assert found.notes == ()


def test_branches_are_taken_from_the_order(table):
    rows = "\n".join(f"{p},300" for p in (0, 0, 250, 500, 500, 250, 0, 250))
    found = table(f"p_kpa,length_mm\n{rows}\n")
    assert found.rising.tolist() == [True, True, True, True, True, False, False, True]
    assert "taken from whether the pressure rises" in found.notes[0]
    constant = table("p_kpa,length_mm\n100,300\n100,301\n")
    assert constant.rising.tolist() == [True, True]


def test_force_loops_by_name(table):
    found = table("loop,time_s,force_n,displacement_mm,note\na,0,1,2,x\na,1,2,3,x\nb,0,5,6,y\n")
    assert isinstance(found, ForceLoops)
    assert found.names == ("a", "b")
    assert found.displacement[0] == pytest.approx([2e-3, 3e-3])
    assert found.force[1].tolist() == [5.0]
    assert found.notes == ("column 'note' is not used",)
    assert table("time_s,force_n,displacement_mm\n0,1,2\n").names == ("1",)


SLIPS = {
    "text": ("# one\n" + MAP.replace("600", "many"), "line 4: force_n = 'many' is not a number"),
    "infinite": (MAP.replace("600", "inf"), "line 3: force_n = inf is not finite"),
    "gap": (MAP.replace("600", " "), "line 3: force_n is empty"),
    "short row": (MAP.replace("0.1,600", "0.1"), "line 3 has 2 cells, the header 3"),
    "decimal comma": (
        MAP.replace("0.1,", "0,1,"),
        "line 3 has 4 cells, the header 3; write points",
    ),
    "no rows": ("p_kpa,contraction,force_n\n", "no rows below the header in line 1"),
    "nothing": ("# only a comment\n", "no header"),
    "no pressure": ("contraction,force_n\n0.1,2\n", "no column for pressure; name one such as"),
    "no force": ("p_kpa,contraction\n100,0.1\n", "no column for force"),
    "only pressure": ("p_kpa,length\n100,1\n", "column 'length' has no unit"),
    "no length": ("p_kpa,froce_n\n100,1\n", "no column for length"),
    "no displacement": ("time_s,force_n\n0,1\n", "no column for displacement"),
    "unknown unit": (MAP.replace("p_kpa", "p_kpaa"), "column 'p_kpaa': unit 'kpaa' is not known"),
    "wrong quantity": (MAP.replace("p_kpa", "p_mm"), "unit 'mm' does not measure"),
    "twice": (MAP.replace("contraction", "p_bar"), "there is 'p_kpa' already"),
    "bar for kPa": (
        "p_kpa,contraction,force_n\n1,0,10\n6,0,60\n",
        "no 'p_kpa' is above 6 kpa, too little for a muscle; if it is bar",
    ),
    "kPa for Pa": ("p_pa,contraction,force_n\n600,0,10\n", "if it is kpa, name the column 'p_kpa'"),
    "kPa for bar": ("p_bar,contraction,force_n\n600,0,10\n", "line 2: p_bar = 600 is 600 bar"),
    "vacuum": (MAP.replace("200,", "-200,"), "line 3: p_kpa = -200 lies below vacuum"),
    "percent": (MAP.replace("0.1,", "10,"), "line 3: contraction = 10 is 1000%"),
    "branch": (
        "p_kpa,length_mm,branch\n100,300,upp\n",
        "line 2: branch = 'upp'; did you mean 'up'",
    ),
}


@pytest.mark.parametrize(("text", "expected"), cases(SLIPS))
def test_a_slip_is_one_line_that_says_where(table, text, expected):
    with refused("data.csv", expected):
        table(text)


def test_what_is_no_text_file_is_said(tmp_path):
    with pytest.raises(InputError, match="No such file"):
        read_measured(tmp_path / "missing.csv")
    (tmp_path / "data.xlsx").write_bytes(b"PK\x03\x04\xff\xfe")
    with pytest.raises(InputError, match="not a text file"):
        read_measured(tmp_path / "data.xlsx")


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
        ("angle_deg", "remark", "no column 'angle_deg'"),
        ("400,100", "400000,100", "line 2: p1_kpa = 400000 is 4000 bar, too much .* Pa by 1000"),
        ("400,100", "-400,100", "line 2: p1_kpa = -400 is negative"),
        ("1.2,30", "1.2,3000", "line 2: angle_deg = 3000 is more than a turn"),
        ("1.2,30", "1200,30", "line 2: load_kg = 1200 is no load"),
        ("1.2,30", "-1,30", "line 2: load_kg = -1 is negative"),
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
