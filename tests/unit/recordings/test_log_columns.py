"""A lab's own log: separators, decimal commas, arrays, and what its columns mean."""

from __future__ import annotations

import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.physics.air import ATMOSPHERE
from pamsim.recordings.log_columns import in_own_format
from pamsim.recordings.table_reader import read_columns
from tests.unit.core.refusals import cases

NUMBERS = np.column_stack([np.arange(9) * 0.5, np.linspace(-1.25, 2.0, 9)])
INDEX = """schema = "pamsim-recording/2"
rig = "mas20_arm"

[columns]
time = { column = "t", unit = "ms" }
angle = { column = "Winkel", unit = "rad", sign = -1, offset = 0.5 }
pressure_1 = { column = "P a", unit = "psi", absolute = true }
pressure_2 = { column = "P b", unit = "bar" }
pressure_set_1 = { column = "soll", unit = "mbar" }
pressure_set_2 = { column = "soll2", unit = "kPa" }

[[trial]]
file = "log.txt"
protocol = "step"
drive = "pressure_set"
"""
LOG = "t;Winkel;P a;P b;soll;soll2;Notiz\n" + "".join(
    f"{20 * k};0,{k}5;{44 + k},5;1,{k};2000;150,5;x\n" for k in range(9)
)


@pytest.mark.parametrize(
    ("separator", "comma"),
    [(",", False), *((mark, comma) for mark in ";\t " for comma in (False, True))],
)
def test_any_separator_and_either_decimal_mark_mean_the_same(tmp_path, separator, comma):
    lines = [separator.join(map(repr, row)) for row in NUMBERS.tolist()]
    if comma:
        lines = [line.replace(".", ",") for line in lines]
    path = tmp_path / "log.csv"
    path.write_text("\ufeff# made by a logger\n" + separator.join(("a", "b")) + "\n\n")
    path.write_text(path.read_text() + "\n".join(lines), encoding="utf-8")
    found = read_columns(path)
    np.testing.assert_array_equal(np.column_stack([found.values["a"], found.values["b"]]), NUMBERS)


def test_what_a_logger_writes_above_the_header_is_left_out_and_units_below_it_are_read(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("Logger 3.1, arm 2\nby hand\nt,p a,remark\n[s],(bar),-\n0,1,x\n1,2,y\n")
    found = read_columns(path)
    assert (found.header, found.lines, list(found.cells)) == (3, [5, 6], ["t", "p a", "remark"])
    assert found.units == {"t": "s", "p a": "bar"}
    assert found.numbers("p a").tolist() == [1.0, 2.0]

    path.write_text("t,p\n0,1,5\n1,2,5\n2,3,5\n")
    with pytest.raises(InputError, match="line 2 has 3 cells, the header 2"):
        read_columns(path)


def test_arrays_are_columns_and_what_is_no_list_of_numbers_is_left_out(tmp_path):
    path = tmp_path / "log.npz"
    arrays = {"a": NUMBERS[:, 0], "b": NUMBERS[:, 1], "note": np.array(["x"]), "gain": np.eye(3)}
    np.savez(path, **arrays)
    found = read_columns(path)
    assert set(found.cells) == {"a", "b"}
    np.testing.assert_array_equal(found.values["b"], NUMBERS[:, 1])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"PK\x03\x04 no archive", "cannot be read as .npz"),
        ({"a": np.arange(3.0), "b": np.arange(4.0)}, "a has 3 numbers, another array 4"),
        ({"code": np.array([{"a": 1}], dtype=object)}, "cannot be read as .npz"),
    ],
)
def test_files_of_arrays_that_cannot_be_read_say_so(tmp_path, content, message):
    path = tmp_path / "log.npz"
    if isinstance(content, dict):
        np.savez(path, **content)
    else:
        path.write_bytes(content)
    with pytest.raises(InputError, match=message):
        read_columns(path)


def test_a_log_is_read_as_it_lies(tmp_path):
    (tmp_path / "recording.toml").write_text(INDEX, encoding="utf-8")
    (tmp_path / "log.txt").write_text(LOG, encoding="utf-8")
    (trial,) = pamsim.read_recordings(tmp_path).trials
    k = np.arange(9)
    np.testing.assert_allclose(trial.time, 0.02 * k, atol=1e-12)
    np.testing.assert_allclose(trial.measured["angle"], 0.5 - (0.1 * k + 0.05), atol=1e-9)
    psi = 6894.757293168361
    expected = (44.5 + k) * psi - ATMOSPHERE
    np.testing.assert_allclose(trial.measured["pressure_1"], expected, rtol=1e-9)
    np.testing.assert_allclose(trial.measured["pressure_2"], (1.0 + 0.1 * k) * 1e5, rtol=1e-9)
    np.testing.assert_allclose(trial.command, np.tile([2e5, 150500.0], (9, 1)), rtol=1e-9)
    assert trial.load == 0.0
    assert any("Notiz" in note for note in pamsim.read_recordings(tmp_path).notes)


@pytest.fixture
def log(tmp_path):
    """Columns of a log of two rows: 1 and 2 in each."""
    path = tmp_path / "log.csv"
    path.write_text("t,a,b,c,d\n1,1,1,1,1\n2,2,2,2,2\n")
    return read_columns(path)


def test_named_quantities_become_the_columns_of_their_joints_and_muscles(log):
    table = {
        "time": {"column": "t", "unit": "s"},
        "knee.angle": {"column": "a", "unit": "turn"},
        "slider.position": {"column": "b", "unit": "inch", "offset": 2},
        "flexor.valve": {"column": "c", "unit": "percent"},
        "flexor.force": {"column": "d", "unit": "kN", "sign": -1},
    }
    found = in_own_format(log, table, "[columns]").values
    expected = {
        "time_s": 1.0,
        "knee_deg": 360.0,
        "slider_mm": 3 * 25.4,
        "flexor_valve": 0.01,
        "flexor_n": -1000.0,
    }
    assert {name: values[0] for name, values in found.items()} == pytest.approx(expected)
    assert found["slider_mm"][1] == pytest.approx(4 * 25.4)


CLOCK = {"time": {"column": "t", "unit": "s"}}
WRONG = {
    "no clock": ({"angle": {"column": "a", "unit": "deg"}}, "no clock"),
    "unknown quantity": (CLOCK | {"knee.speed": {"column": "a", "unit": "deg"}}, "JOINT.angle"),
    "unknown key": (CLOCK | {"angle": {"column": "a", "units": "deg"}}, "unknown key units"),
    "no unit": (CLOCK | {"angle": {"column": "a"}}, 'needs unit = "..."'),
    "wrong unit": (CLOCK | {"angle": {"column": "a", "unit": "bar"}}, "bar"),
    "sign": (CLOCK | {"angle": {"column": "a", "unit": "deg", "sign": 2}}, "write sign = 1 or -1"),
    "nan": (CLOCK | {"angle": {"column": "a", "unit": "deg", "offset": float("nan")}}, "finite"),
    "absolute": (
        CLOCK | {"angle": {"column": "a", "unit": "deg", "absolute": True}},
        "only pressures",
    ),
    "no table": (3, "no clock; write time = "),
    "no column": (
        CLOCK | {"angle": {"column": "beta", "unit": "deg"}},
        r"no column 'beta' for angle \(there are: t, a, b, c, d\)",
    ),
}


@pytest.mark.parametrize(("table", "message"), cases(WRONG))
def test_what_cannot_be_meant_is_refused_by_name(log, table, message):
    with pytest.raises(InputError, match=message):
        in_own_format(log, table, "recording.toml: [columns]")


def wrapping(folder, wraps, first=0.0):
    """Three rounds of a clock that begins again after 1 s, at set points of a few kPa."""
    rows = [f"{(first + 0.1 * k) % 1.0:.3f},0.1,5,6" for k in range(30)]
    (folder / "log.csv").write_text("t,a,p,q\n" + "\n".join(rows) + "\n", encoding="utf-8")
    index = INDEX.replace("log.txt", "log.csv").replace('unit = "ms" }', f'unit = "s"{wraps} }}')
    lines = [line for line in index.splitlines() if not line.startswith("pressure_1 =")]
    text = "\n".join(line for line in lines if not line.startswith("pressure_2 ="))
    for old, new in (("Winkel", "a"), ('"soll"', '"p"'), ('"soll2"', '"q"'), ("mbar", "kPa")):
        text = text.replace(old, new)
    (folder / "recording.toml").write_text(text + "\n", encoding="utf-8")
    return folder


def test_a_clock_that_begins_again_runs_on(tmp_path):
    (trial,) = pamsim.read_recordings(wrapping(tmp_path, ", wraps = 1", first=0.03)).trials
    np.testing.assert_allclose(trial.time, 0.1 * np.arange(30), atol=1e-9)
    assert trial.command[0].tolist() == [5000.0, 6000.0]  # low, but in a unit that is stated


@pytest.mark.parametrize(
    ("wraps", "message"),
    [
        ("", "does not come after"),
        (", wraps = 0.5", "line 7: t: the clock is at 0.5 s, but should begin again after 0.5 s"),
        (", wraps = true", "wraps = True; write wraps = a time in"),
        (", wraps = -1", "wraps = -1; write wraps = a time in"),
    ],
)
def test_a_clock_that_does_not_is_refused(tmp_path, wraps, message):
    with pytest.raises(InputError, match=message):
        pamsim.read_recordings(wrapping(tmp_path, wraps))


@pytest.mark.parametrize(
    ("cells", "grouped"),
    [
        (["0", "999", "1,234", "-12,345", "1,234,567"], True),
        (["0,000", "999", "1,234"], False),  # three decimals
        (["1,234", "2,345", "3,456"], False),  # either; decimals are usual
        (["1,23", "12", "1,234"], False),
        (["1234", "12", "1,234"], False),
    ],
)
def test_separators_of_thousands_are_refused_and_decimal_commas_are_not(tmp_path, cells, grouped):
    (tmp_path / "log.csv").write_text("t;y\n" + "\n".join(f"{k};{c}" for k, c in enumerate(cells)))
    if grouped:
        with pytest.raises(InputError, match=r"line 4: y = 1,234 looks like 1234 with a separator"):
            read_columns(tmp_path / "log.csv")
    else:
        read = read_columns(tmp_path / "log.csv").numbers("y")
        assert read.tolist() == [float(cell.replace(",", ".")) for cell in cells]
