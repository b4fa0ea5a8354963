"""Measured tables: kinds by their columns, SI inside, and one line for each mistake."""

import numpy as np
import pytest

from pamsim.recordings.measured_table import ForceLoops, ForceMap, LengthLoop, read_measured
from pamsim.recordings.printed import distinct_steps
from pamsim.recordings.static_table import read_static_table
from tests.unit.core.refusals import all_refused, refused

MAP = "p_kpa,contraction,force_n\n100,0.0,500\n200,0.1,600\n300,0.2,0\n"


@pytest.fixture
def table(tmp_path):
    def read(text, reader=read_measured, **options):
        path = tmp_path / "data.csv"
        path.write_text(text, encoding="utf-8")
        return reader(path, **options)

    return read


def test_a_force_map_is_read_in_si_whatever_the_units_of_its_names(table):
    found = table("# by hand\n\n" + MAP)
    assert isinstance(found, ForceMap)
    assert found.pressure.tolist() == [1e5, 2e5, 3e5]
    assert found.contraction.tolist() == [0.0, 0.1, 0.2]
    assert found.force.tolist() == [500.0, 600.0, 0.0]
    for text in (
        "p_gauge_Pa,contraction_ratio,force_N\n150000,0.1,20\n",
        "p_bar,contraction_percent,force_kn\n1.5,10,0.02\n",
        "pressure_mpa,kappa,force_n\n0.15,0.1,20\n",
        "force_n,p_psi,contraction\n20,21.7556607,0.1\n",
    ):
        found = table(text)
        values = (found.pressure[0], found.contraction[0], found.force[0])
        assert values == pytest.approx((1.5e5, 0.1, 20.0), rel=1e-6), text


def test_a_contraction_that_may_be_a_ratio_but_is_called_percent_is_noted(table):
    head = "p_kpa,contraction_percent,force_n\n"
    assert "if it is a ratio" in table(head + "300,0,400\n300,0.22,90\n").notes[0]
    for plain in ("300,0,400\n", "300,0,400\n300,5,300\n"):
        assert table(head + plain).notes == ()


def test_lengths_become_contractions(table):
    text = "p_kpa,length_mm,force_n\n300,270,100\n300,285,200\n"
    assert table(text, nominal_length=0.3).contraction == pytest.approx([0.1, 0.05])
    head = "p_kpa,length_mm,contraction,force_n\n"
    assert table(head + "300,270,0.1,1\n300,240,0.2,1\n").nominal_length == pytest.approx(0.3)
    with refused("give `nominal_length`"):
        table(text)
    with refused("line 2: length 270 mm of nominal 30 mm"):
        table(text, nominal_length=0.03)
    with refused("line 3: length and contraction disagree"):
        table(head + "300,270,0.1,1\n300,240,0.1,1\n300,255,0.15,1\n")


def test_zeros_are_dropped_and_said(table):
    found = table(MAP).without_zeros()
    assert found.force.tolist() == [500.0, 600.0]
    assert found.pressure.size == found.contraction.size == 2
    assert found.notes == ("1 points of zero force dropped: slack or not measured",)
    assert found.without_zeros().notes == found.notes
    with refused("no force but zero"):
        table("p_kpa,contraction,force_n\n300,0.2,0\n").without_zeros()


def test_branches_of_a_length_loop_are_stated_or_taken_from_the_order(table):
    found = table("p_kpa,length_cm,branch\n0,30,up\n500,24,UP\n0,29.9,down\n")
    assert isinstance(found, LengthLoop)
    assert found.length == pytest.approx([0.3, 0.24, 0.299])
    assert (found.rising.tolist(), found.notes) == ([True, True, False], ())
    rows = "\n".join(f"{p},300" for p in (0, 0, 250, 500, 500, 250, 0, 250))
    found = table(f"p_kpa,length_mm\n{rows}\n")
    assert found.rising.tolist() == [True, True, True, True, True, False, False, True]
    assert "taken from whether the pressure rises" in found.notes[0]
    assert table("p_kpa,length_mm\n100,300\n100,301\n").rising.tolist() == [True, True]


def test_force_loops_have_names(table):
    found = table("loop,time_s,force_n,displacement_mm,note\na,0,1,2,x\na,1,2,3,x\nb,0,5,6,y\n")
    assert isinstance(found, ForceLoops)
    assert found.names == ("a", "b")
    assert found.displacement[0] == pytest.approx([2e-3, 3e-3])
    assert found.force[1].tolist() == [5.0]
    assert found.notes == ("column 'note' is not used",)
    assert table("time_s,force_n,displacement_mm\n0,1,2\n").names == ("1",)


HEAD = "p_kpa,contraction,force_n\n"
SLIPS = {
    "text": ("# one\n" + MAP.replace("600", "many"), "line 4: force_n = 'many' is not a number"),
    "infinite": (MAP.replace("600", "inf"), "line 3: force_n = inf is not finite"),
    "gap": (MAP.replace("600", " "), "line 3: force_n is empty"),
    "short row": (MAP.replace("0.1,600", "0.1"), "line 3 has 2 cells, the header 3"),
    "decimal comma": (MAP.replace("0.1,", "0,1,"), "the header 3; write points"),
    "no rows": (HEAD, "no rows below the header in line 1"),
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
        HEAD + "1,0,10\n6,0,60\n",
        "too little for a muscle; if it is bar",
    ),
    "kPa for Pa": (HEAD.replace("kpa", "pa") + "600,0,10\n", "if it is kpa, name the column"),
    "kPa for bar": (HEAD.replace("kpa", "bar") + "600,0,10\n", "line 2: p_bar = 600 is 600 bar"),
    "vacuum": (MAP.replace("200,", "-200,"), "line 3: p_kpa = -200 lies below vacuum"),
    "percent": (MAP.replace("0.1,", "10,"), "line 3: contraction = 10 is 1000%"),
    "force": (MAP.replace("600", "-1e300"), "line 3: force_n = -1e+300 is more force than any"),
    "length": ("p_kpa,length_mm\n100,300\n200,1e6\n", "line 3: length_mm = 1e+06 is more length"),
    "branch": ("p_kpa,length_mm,branch\n100,300,upp\n", "branch = 'upp'; did you mean 'up'"),
}


def test_a_slip_is_one_line_that_says_where(table, tmp_path):
    all_refused(SLIPS, table, "data.csv")
    with refused("No such file"):
        read_measured(tmp_path / "missing.csv")
    (tmp_path / "data.xlsx").write_bytes(b"PK\x03\x04\xff\xfe")
    with refused("not a text file"):
        read_measured(tmp_path / "data.xlsx")


GOOD = "p1_kpa,p2_kpa,load_kg,angle_deg\n400,100,1.2,30\n100,400,0,-29\n"


def test_angles_at_rest_are_read_in_si_with_start_and_load_if_there_are(table):
    found = table(GOOD, read_static_table)
    assert (found.name, found.rows, found.start) == ("data", ("line 2", "line 3"), None)
    np.testing.assert_allclose(found.pressure, [[4e5, 1e5], [1e5, 4e5]])
    np.testing.assert_allclose(found.load, [1.2, 0.0])
    np.testing.assert_allclose(np.degrees(found.angle), [30.0, -29.0])
    text = "p1_kpa,p2_kpa,beta_deg,start_p1_kpa,start_p2_kpa,remark\n400,100,30,250,260,x\n"
    found = table(text, read_static_table)
    np.testing.assert_allclose(found.start, [[2.5e5, 2.6e5]])
    np.testing.assert_allclose(found.load, [0.0])
    assert "not used: 'remark'" in found.notes[0]
    assert "no load" in found.notes[1]


def test_the_packaged_table_has_the_distinct_printed_rows():
    table, steps = read_static_table("mas20"), distinct_steps()
    assert len(table.rows) == len(steps) == 21
    assert table.rows[0] == "row 1"
    np.testing.assert_allclose(table.angle, [step.angle for step in steps])
    np.testing.assert_allclose(table.pressure, [step.pressure for step in steps])


STATIC_SLIPS = {
    "a log": (
        "load_kg",
        "Time [s]",
        ("column 'Time [s]' is a clock", "pamsim import", "--rig RIG --out data"),
    ),
    "raw log": (GOOD, "t,p1,p2,angle\n0,400,100,30\n", "column 't' is a clock"),
    "unit": ("p2_kpa", "p2_bar", "column 'p2_bar' is not known; convert it"),
    "no angle": ("angle_deg", "remark", "no column 'angle_deg'"),
    "Pa": ("400,100", "400000,100", ("line 2: p1_kpa = 400000 is 4000 bar", "Pa by 1000")),
    "negative": ("400,100", "-400,100", "line 2: p1_kpa = -400 is negative"),
    "turns": ("1.2,30", "1.2,3000", "line 2: angle_deg = 3000 is more than a turn"),
    "gram": ("1.2,30", "1200,30", "line 2: load_kg = 1200 is no load"),
    "negative load": ("1.2,30", "-1,30", "line 2: load_kg = -1 is negative"),
    "no pressure": ("p1_kpa,p2_kpa", "a,b", "no column 'p1_kpa'"),
    "half a start": ("load_kg", "start_p1_kpa", "start_p1_kpa alone"),
    "bar": (GOOD, "p1_kpa,p2_kpa,angle_deg\n4,1,30\n1,4,-29\n", "hold bar, multiply them by 100"),
}


def test_slips_of_a_table_at_rest_are_answered(table, tmp_path):
    all_refused(STATIC_SLIPS, lambda old, new: table(GOOD.replace(old, new, 1), read_static_table))
    with refused("cannot read"):
        read_static_table(tmp_path / "none.csv")
