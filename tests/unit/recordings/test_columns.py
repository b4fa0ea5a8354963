"""Columns of a CSV file: names with units, SI values, and one line for each error."""

from __future__ import annotations

import struct

import numpy as np
import pytest
import scipy.io

from pamsim.recordings.table_reader import read_columns
from tests.unit.core.refusals import refused

NAMES = ("time_s", "angle_deg", "p{}_set_kpa", "p{}_kpa")


@pytest.fixture
def columns(tmp_path):
    def read(text):
        path = tmp_path / "log.csv"
        path.write_text(text, encoding="utf-8")
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


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("P1_kPa", "convert it if need be and name it 'p1_kpa'"),
        ("p3_set_bar", "name it 'p3_set_kpa'"),
        ("p1000000000_kpa", "is not of this format"),
        ("t_ms", "name it 'time_s'"),
        ("tmie_s", "did you mean 'time_s'"),
        ("beta_deg", "is there twice; keep one"),
        ("angle_deg", "is there twice; keep one"),
    ],
)
def test_a_name_that_must_mean_a_known_column_is_refused(columns, name, words):
    with refused("log.csv: line 1: column", words):
        columns(f"{name},beta_deg\n1,2\n").select(NAMES)


def test_numbers_and_words_may_stand_in_one_table_and_cells_are_kept_as_written(columns):
    text = 't;note;p\n0,10;"a; b";1,5\n0,20;c, d;2.5\n0,30;7;-1e1\n'
    found = columns(text)
    assert found.numbers("t").tolist() == [0.1, 0.2, 0.3]
    assert found.numbers("p").tolist() == [1.5, 2.5, -10.0]
    assert list(found.cells["note"]) == ["a; b", "c, d", "7"]
    assert list(found.cells["t"]) == ["0.10", "0.20", "0.30"]
    with refused("line 2: note = 'a; b' is not a number"):
        found.numbers("note")


@pytest.mark.parametrize("cell", ["x", "", "nan"])
def test_one_cell_that_is_no_number_spoils_its_column_alone(columns, cell):
    found = columns("t,p\n" + "".join(f"{k},{k}\n" for k in range(50)) + f"50,{cell}\n51,1\n")
    assert found.numbers("t").tolist() == list(range(52))
    with refused("line 52: p"):
        found.numbers("p")


def test_of_a_matlab_file_only_lists_of_numbers_are_read(tmp_path):
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
    path.write_bytes(path.read_bytes()[:-8])
    with refused("log.mat cannot be read as .mat"):
        read_columns(path)


@pytest.mark.parametrize(
    ("mark", "byte", "value", "message"),
    [
        *(
            (struct.pack("<II", 9, 400), 0, kind, f"unknown type {kind}")
            for kind in (0, 10, 14, 200)
        ),
        (struct.pack("<II", 6, 8), 9, 0x08, "an array of 4 parts where its flags ask for 5"),
    ],
)
def test_a_damaged_array_is_refused_before_scipy_would_crash(tmp_path, mark, byte, value, message):
    path = tmp_path / "log.mat"
    scipy.io.savemat(path, {"t": np.arange(50.0)})
    content = bytearray(path.read_bytes())
    content[content.index(mark) + byte] = value
    path.write_bytes(content)
    with refused("log.mat cannot be read as .mat", message):
        read_columns(path)
