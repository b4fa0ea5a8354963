"""Tables of a logger: dialects, arrays, names with units, and one line for each error."""

import struct

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest
import scipy.io

from pamsim.recordings.table_reader import read_columns
from tests.unit.core.refusals import all_refused, refused

NAMES = ("time_s", "angle_deg", "p{}_set_kpa", "p{}_kpa")
NUMBERS = np.column_stack([np.arange(9) * 0.5, np.linspace(-1.25, 2.0, 9)])


@pytest.fixture
def columns(tmp_path):
    def read(content, name="log.csv"):
        path = tmp_path / name
        if isinstance(content, dict):
            np.savez(path, **content)
        else:
            path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_columns(path)

    return read


def test_cells_keep_their_line_numbers_and_values_are_read_in_si(columns):
    found = columns("# by hand\ntime_s,p1_kpa,angle_deg\n0,100,90\n\n1,200,-90\n")
    assert (found.header, found.lines) == (2, [3, 5])
    assert found.si("p1_kpa").tolist() == [1e5, 2e5]
    np.testing.assert_allclose(found.si("angle_deg"), [np.pi / 2, -np.pi / 2])
    assert found.values["angle_deg"].tolist() == [90.0, -90.0]
    with refused("log.csv: line 5: p1_kpa = 200 is too much"):
        found.require_range("p1_kpa", 0.0, 150.0, "is too low", "is too much")
    with refused("log.csv: line 3: p1_kpa = 100 is too low"):
        found.require_range("p1_kpa", 150.0, 300.0, "is too low", "is too much")


def test_a_format_selects_its_columns_under_their_own_names(columns):
    found = columns("time_s,beta_deg,p12_kpa,remark\n0,1,2,x\n").select(NAMES)
    assert list(found.cells) == ["time_s", "angle_deg", "p12_kpa"]
    assert found.ignored == ("remark",)
    found.require("angle_deg")
    with refused("no column 'p1_kpa', at rest", "there are: time_s, angle_deg, p12_kpa, remark"):
        found.require("p1_kpa", ", at rest")
    bad = {
        "capitals": ("P1_kPa", "convert it if it has another unit, and name it 'p1_kpa'"),
        "unit": ("p3_set_bar", "name it 'p3_set_kpa'"),
        "million": ("p1000000_kpa", "of a muscle of too high a number"),
        "milliseconds": ("t_ms", "name it 'time_s'"),
        "slip": ("tmie_s", "did you mean 'time_s'"),
        "twice": ("beta_deg", "is there twice; keep one"),
        "both names": ("angle_deg", "is there twice; keep one"),
    }
    all_refused(
        bad, lambda name: columns(f"{name},beta_deg\n1,2\n").select(NAMES), "line 1: column"
    )


def test_any_separator_and_either_decimal_mark_mean_the_same(columns):
    for mark, comma in [(",", False), *((m, c) for m in ";\t " for c in (False, True))]:
        lines = [mark.join(map(repr, row)) for row in NUMBERS.tolist()]
        if comma:
            lines = [line.replace(".", ",") for line in lines]
        head = "\ufeff# made by a logger\n" + mark.join("ab") + "\n\n"
        found = columns(head + "\n".join(lines))
        read = np.column_stack([found.values["a"], found.values["b"]])
        np.testing.assert_array_equal(read, NUMBERS, err_msg=f"{mark!r}, {comma}")


def test_separators_of_thousands_are_refused_and_decimal_commas_are_not(columns):
    def read(cells):
        lines = [f"{k};{cell}" for k, cell in enumerate(cells)]
        return columns("\n".join(["t;y", *lines])).numbers("y")

    with refused("line 4: y = 1,234 looks like 1234 with a separator"):
        read(["0", "999", "1,234", "-12,345", "1,234,567"])
    with refused("line 3: y = 1,234 looks like 1234 with a separator"):
        read(['"999"', '"1,234"'])
    with refused("line 3: y = 1.234 looks like 1234 with a separator"):
        read(["999", "1.234", "12", "0"])
    for cells in (
        ["0", "12", "1.234"],  # points are decimal ones, but beside hundreds
        ["980", "1.25", "1.234"],
        ["0,000", "999", "1,234"],  # three decimals
        ["1,234", "2,345", "3,456"],  # either; decimals are usual
        ["1,23", "12", "1,234"],
        ["1234", "12", "1,234"],
    ):
        assert read(cells).tolist() == [float(cell.replace(",", ".")) for cell in cells]


def test_what_a_logger_writes_above_the_header_is_left_out_and_units_below_it_are_read(columns):
    found = columns("Logger 3.1, arm 2\nby hand\nt,p a,remark\n[s],(bar),-\n0,1,x\n1,2,y\n")
    assert (found.header, found.lines, list(found.cells)) == (3, [5, 6], ["t", "p a", "remark"])
    assert found.units == {"t": "s", "p a": "bar"}
    assert found.numbers("p a").tolist() == [1.0, 2.0]
    found = columns("t,u\ns,1\n0,1\n")  # of an opening, which has no unit
    assert (found.lines, found.units) == ([3], {"t": "s"})
    for more in ("5", ""):
        with refused("line 2 has 3 cells, the header 2"):
            columns(f"t,p\n0,1,{more}\n1,2,{more}\n2,3,{more}\n")


def test_numbers_and_words_may_stand_in_one_table_and_cells_are_kept_as_written(columns):
    found = columns('t;note;p\n0,10;"a; b";1,5\n0,20;c, d;2.5\n0,30;7;-1e1\n')
    assert found.numbers("t").tolist() == [0.1, 0.2, 0.3]
    assert found.numbers("p").tolist() == [1.5, 2.5, -10.0]
    assert list(found.cells["note"]) == ["a; b", "c, d", "7"]
    assert list(found.cells["t"]) == ["0.10", "0.20", "0.30"]
    with refused("line 2: note = 'a; b' is not a number"):
        found.numbers("note")
    found = columns('t,note\n0,"a\n1,b\n2,c"\n3,"d\n')  # quotes that are not closed merge no rows
    assert found.numbers("t").tolist() == [0, 1, 2, 3]
    for cell in ("x", "", "nan"):  # one that is no number spoils its column alone
        found = columns("t,p\n" + "".join(f"{k},{k}\n" for k in range(50)) + f"50,{cell}\n51,1\n")
        assert found.numbers("t").tolist() == list(range(52))
        with refused("line 52: p"):
            found.numbers("p")


def test_arrays_are_columns_and_what_is_no_list_of_numbers_is_left_out(columns, tmp_path):
    arrays = {"a": NUMBERS[:, 0], "b": NUMBERS[:, 1], "note": np.array(["x"]), "gain": np.eye(3)}
    found = columns(arrays, "log.npz")
    assert set(found.cells) == {"a", "b"}
    assert found.notes == ("not used, no list of numbers: note, gain",)
    np.testing.assert_array_equal(found.values["b"], NUMBERS[:, 1])
    path = tmp_path / "log.mat"
    log = {
        "t": np.arange(5) * 0.01,
        "n": np.arange(5, dtype=np.int16),
        "cell": np.array([np.ones(3), "text"], dtype=object),
        "structure": {"angle": np.ones((2, 2)), "name": "knee"},
        "z": np.arange(5) * 1j,
        "large": np.zeros((100, 100)),
    }
    for version in ("5", "4"):
        kept = {k: v for k, v in log.items() if version == "5" or k in ("t", "large")}
        scipy.io.savemat(path, kept, format=version, do_compression=version == "5")
        found = read_columns(path)
        assert set(found.cells) == {"t", "n"} & set(kept)
        assert found.numbers("t").tolist() == log["t"].tolist()


def test_what_is_on_or_off_is_1_or_0_and_a_duration_is_in_seconds(columns, tmp_path):
    on = np.array([True, False, True])
    assert columns({"u": on}, "log.npz").numbers("u").tolist() == [1.0, 0.0, 1.0]
    path = tmp_path / "log.parquet"
    elapsed = np.array([500, 750, 1000], dtype="timedelta64[ms]")
    table = pyarrow.table({"t": elapsed, "at": np.datetime64("2020-01-01") + elapsed, "u": on})
    pyarrow.parquet.write_table(table, path)
    found = read_columns(path)
    assert found.numbers("t").tolist() == [0.5, 0.75, 1.0]
    assert found.numbers("at").tolist() == [0.0, 0.25, 0.5]
    assert found.numbers("u").tolist() == [1.0, 0.0, 1.0]


def test_dates_in_the_place_of_a_pressure_are_refused(tmp_path):
    path = tmp_path / "log.parquet"
    dates = np.array([100, 200, 300], "datetime64[s]")
    for name, kind in (("p1_kpa", dates), ("shaft_deg", dates - dates[0])):
        pyarrow.parquet.write_table(pyarrow.table({"time_s": [0.0, 1.0, 2.0], name: kind}), path)
        with refused(f"{name} holds dates or durations, no"):
            read_columns(path)


def test_files_of_arrays_that_cannot_be_read_say_so_before_scipy_would_crash(columns, tmp_path):
    path = tmp_path / "sound.mat"
    scipy.io.savemat(path, {"t": np.arange(50.0)})
    sound, unlike = path.read_bytes(), {"a": np.arange(3.0), "b": np.arange(4.0)}

    def damaged(mark, byte, value):
        content = bytearray(sound)
        content[content.index(mark) + byte] = value
        return bytes(content)

    kinds, flags = struct.pack("<II", 9, 400), struct.pack("<II", 6, 8)
    bad = {
        "no archive": (b"PK\x03\x04 no archive", "log.npz", "cannot be read as .npz"),
        "lengths": (unlike, "log.npz", "a has 3 numbers, another array 4"),
        "objects": ({"c": np.array([{}], dtype=object)}, "log.npz", "cannot be read as .npz"),
        "cut off": (sound[:-8], "log.mat", "log.mat cannot be read as .mat"),
        "parts": (damaged(flags, 9, 8), "log.mat", "an array of 4 parts where its flags ask for 5"),
    }
    for kind in (0, 10, 14, 200):
        bad[f"type {kind}"] = (damaged(kinds, 0, kind), "log.mat", f"unknown type {kind}")
    all_refused(bad, columns)
