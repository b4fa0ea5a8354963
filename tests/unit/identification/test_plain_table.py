"""Tables of any columns: whatever the dialect, the same signals are identified from."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.identification.data import load_data, select_trials, split_tables
from pamsim.identification.identify import identify
from pamsim.identification.signals import chosen_signals, signal, used_trial
from pamsim.linear.continuous_fit import fit_continuous
from tests.unit.linear.planted import refuses

N, GAIN, LAG = 240, 2.0, 7.0  # samples, output per input, samples
INPUT = np.repeat(np.random.default_rng(3).choice([0.0, 1.0, 2.5], N // 12), 12)


def planted():
    """A lag on the held input, with a little noise."""
    pole, output = np.exp(-1.0 / LAG), np.zeros(N)
    for k in range(1, N):
        output[k] = pole * output[k - 1] + (1.0 - pole) * GAIN * (INPUT[k - 1] - INPUT[0])
    return np.round(20.0 + output + 0.02 * np.random.default_rng(4).normal(size=N), 6)


OUTPUT = planted()


def table(header, clock=None, *, mark=",", point="."):
    """Text of a table: a clock, if there is one, the input and the output."""
    columns = [INPUT, OUTPUT] if clock is None else [clock, INPUT, OUTPUT]
    rows = [
        mark.join(v if isinstance(v, str) else repr(v).replace(".", point) for v in row)
        for row in zip(*(np.asarray(column).tolist() for column in columns), strict=True)
    ]
    return "\n".join([*([mark.join(header)] if header else []), *rows]) + "\n"


def record(path, *, given=None, explained=None, **clock):
    """The only trial's signals, and the notes."""
    data = load_data(path, **clock)
    inputs, explained, note = chosen_signals(data.tables, [given] if given else [], explained)
    (only,) = data.tables
    into, out = signal(inputs[0], data.tables), signal(explained, data.tables)
    return used_trial(only, [into], out)[0].record, (*data.notes, note)


K = np.arange(N)
DATES = [
    (datetime(2026, 3, 1, tzinfo=UTC) + timedelta(seconds=2 * k)).isoformat() for k in range(N)
]
LABVIEW = "LabVIEW\nWriter_Version\t2\n***End_of_Header***\n"

# Text of a file with two seconds between its rows, and how it is read.
DIALECTS = {
    "names of pamsim": (table(["time_s", "u", "y"], 2.0 * K), {}),
    "names with blanks": (
        table(["Time", "Power (V)", "T out"], 2.0 * K),
        {"given": "Power (V)", "explained": "T out"},
    ),
    "no flag": (table(["t", "Power (V)", "T out"], 2.0 * K), {}),
    "minus in a name": (table(["t", "u-1", "y+1"], 2.0 * K), {"given": "u-1"}),
    "output first": (
        table(["t", "a", "b"], 2.0 * K),
        {"given": "a", "explained": "b"},
    ),
    "milliseconds": (table(["Time [ms]", "u", "y"], 2000 * K), {}),
    "minutes": (table(["t_min", "u", "y"], (2.0 * K / 60.0).round(12)), {}),
    "days": (table(["clock (d)", "u", "y"], (2.0 * K / 86400.0).round(15)), {}),
    "dates": (table(["timestamp", "u", "y"], DATES), {}),
    "times of day": (
        table(["Time", "u", "y"], [f"10:{k // 30:02d}:{2 * k % 60:02d}.000" for k in K]),
        {},
    ),
    "named by its unit": (table(["seconds", "u", "y"], 2.0 * K), {}),
    "output first, in capitals": (
        "Time|Output|Input\n" + "".join(f"{2.0 * k}|{OUTPUT[k]}|{INPUT[k]}\n" for k in range(N)),
        {},
    ),
    "a clock by name": (
        table(["X_Value", "u", "y"], 2.0 * K),
        {"time": "X_Value"},
    ),
    "no clock": (table(["u", "y"]), {"dt": 2.0}),
    "rows by number": (table(["", "u", "y"], K), {"dt": 2.0}),
    "rows by number beside a clock": (
        ",t,u,y\n" + "".join(f"{k},{2.0 * k},{INPUT[k]},{OUTPUT[k]}\n" for k in range(N)),
        {},
    ),
    "a clock that is not used": (table(["t", "u", "y"], 7.0 * K), {"dt": 2.0}),
    "no header": (table(None), {"dt": 2.0}),
    "no header but a clock": (table(None, 2.0 * K), {}),
    "decimal commas": (table(["Zeit;Druck;Weg"], 2.0 * K, mark=";", point=","), {}),
    "tabs and a line of units": (
        LABVIEW + table(["t", "u", "y\nmin\tV\tdegC"], (2.0 * K / 60.0).round(12), mark="\t"),
        {},
    ),
    "spaces": (table(["t", "u", "y"], 2.0 * K, mark="  "), {}),
    "text beside": (
        "t,u,remark,y\n" + "".join(f"{2.0 * k},{INPUT[k]},ok,{OUTPUT[k]}\n" for k in range(N)),
        {},
    ),
    "epoch": (table(["timestamp", "u", "y"], 1.7e9 + 2.0 * K), {}),
}


@pytest.mark.parametrize("name", DIALECTS)
def test_every_dialect_gives_the_same_signals(name, tmp_path):
    text, how = DIALECTS[name]
    path = tmp_path / "log.csv"
    path.write_text(text, encoding="utf-8")
    found, notes = record(path, **how)
    assert found.sample_time == pytest.approx(2.0, rel=1e-9)
    np.testing.assert_array_equal(found.input, INPUT)
    np.testing.assert_array_equal(found.output, OUTPUT)
    assert found.holds == ("zoh",)
    assert bool(notes[-1]) == (len({"given", "explained"} & set(how)) < 2)


@pytest.mark.parametrize("seconds", [1e-6, 1e-3, 0.1, 6.0, 3600.0, 86400.0])
def test_any_sample_time_is_taken(seconds, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(table(["t", "u", "y"], seconds * K))
    found, _ = record(path)
    assert found.sample_time == pytest.approx(seconds, rel=1e-9)
    assert fit_continuous([found], order=1)["T"].value == pytest.approx(LAG * seconds, rel=0.02)


def test_times_that_were_rounded_are_those_of_an_even_clock(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(table(["t", "u", "y"], [f"{k / 300.0:.3f}" for k in K]))
    found, _ = record(path)
    assert found.sample_time == pytest.approx(1.0 / 300.0, rel=1e-4)
    np.testing.assert_array_equal(found.output, OUTPUT)  # not interpolated
    jitter = np.random.default_rng(1).uniform(-3e-3, 3e-3, N)
    path.write_text(table(["t", "u", "y"], np.round(0.02 * K + jitter, 6)))
    assert not np.array_equal(record(path)[0].output[1:-1], OUTPUT[1:-1])


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_the_encodings_of_spreadsheets_are_read(encoding, tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(table(["t", "Power [W]", "T [°C]"], 2.0 * K).encode(encoding))
    assert list(load_data(path).tables[0].columns) == ["Power [W]", "T [°C]"]
    path.write_bytes(bytes(range(256)) * 4)
    refuses("not a text file", load_data, path)


UNITS = {
    "y [%]": ("percent", "percent", 1.0),
    "y_deg": ("deg", "rad", np.pi / 180.0),
    "y (bar)": ("bar", "Pa", 1e5),
    "y [°C]": ("°C", "°C", 1.0),
    "y_v": ("V", "V", 1.0),
    "flow [l/min]": ("l/min", "l/min", 1.0),
    "T_out": ("1", "1", 1.0),
    "tank_level": ("1", "1", 1.0),
    "y": ("1", "1", 1.0),
}


@pytest.mark.parametrize("name", UNITS)
def test_a_unit_is_one_only_where_the_name_states_it(name, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(table(["t", "u", name], 0.02 * K))
    data = load_data(path)
    found = signal(name, data.tables)
    assert (found.unit, found.si_unit) == UNITS[name][:2]
    assert found.factor == pytest.approx(UNITS[name][2])
    np.testing.assert_allclose(found.of(data.tables[0].columns) / found.factor, OUTPUT)


def test_a_gap_of_the_clock_makes_two_trials(tmp_path):
    clock = np.where(K < 100, 2.0 * K, 2.0 * K + 50.0)
    path = tmp_path / "log.csv"
    path.write_text(table(["t", "u", "y"], clock))
    data = load_data(path)
    assert [(t.name, t.time.size, t.moving) for t in data.tables] == [
        ("log_1", 100, False),
        ("log_2", 140, True),
    ]
    np.testing.assert_array_equal(np.concatenate([t.columns["y"] for t in data.tables]), OUTPUT)
    assert any("gaps" in note for note in data.notes)


def test_several_tables_are_fitted_together_and_one_may_be_held_out(tmp_path):
    for name in ("a", "b"):
        (tmp_path / f"{name}.csv").write_text(table(["t", "u", "y"], 2.0 * K))
    data = load_data([tmp_path / "a.csv", tmp_path / "b.csv"])
    to_fit, to_test = select_trials(data, (), (), ["b"])
    assert ([t.name for t in to_fit], [t.name for t in to_test]) == (["a"], ["b"])
    refuses("/a' is there twice", load_data, [tmp_path / "a.csv", tmp_path / "a.csv"])
    (tmp_path / "day").mkdir()
    (tmp_path / "day" / "a.csv").write_text(table(["t", "u", "y"], 2.0 * K))
    data = load_data([tmp_path / "a.csv", tmp_path / "day" / "a.csv"])
    assert [t.name for t in data.tables] == [f"{tmp_path.name}/a", "day/a"]


SMOOTH = np.convolve(np.random.default_rng(5).normal(size=N + 30), np.hanning(30), "valid")[:N]
SHAPES = {
    "levels": (INPUT, True),
    "smooth": (SMOOTH, False),
    "noisy levels": (INPUT + 0.01 * np.random.default_rng(7).normal(size=N), False),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_few_values_are_held_unless_it_is_stated(shape, tmp_path):
    values, is_held = SHAPES[shape]
    path = tmp_path / "log.csv"
    rows = zip(K.tolist(), values.tolist(), OUTPUT.tolist(), strict=True)
    path.write_text("t,u,y\n" + "".join(f"{t},{u!r},{y!r}\n" for t, u, y in rows))
    assert record(path)[0].holds == (("zoh" if is_held else "foh"),)
    for hold in ("zoh", "foh"):
        assert record(path, hold=hold)[0].holds == (hold,)


@pytest.mark.parametrize("share", [0.3, 0.5, 0.01])
def test_a_split_keeps_every_sample_once(share, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(table(["t", "u", "y"], 2.0 * K))
    (whole,) = load_data(path).tables
    to_fit, to_test = split_tables([whole], share)
    assert [t.name for t in (*to_fit, *to_test)] == ["log", "log_end"]
    assert to_test[0].time.size == round(share * N)
    assert (to_fit[0].moving, to_test[0].moving) == (False, True)
    for name in ("u", "y"):
        parts = np.concatenate([t.columns[name] for t in (*to_fit, *to_test)])
        np.testing.assert_array_equal(parts, whole.columns[name])
    # What is held out begins in motion: there is no step at its beginning.
    assert to_test[0].rest["u"] == to_test[0].columns["u"][0]
    assert to_test[0].time[0] == 0.0


def test_an_end_is_predicted_from_the_state_it_begins_in(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(table(["t", "u", "y"], 2.0 * K))
    result = identify(
        path, order=1, dead_time="none", arx=(1, 1, 1), oe=(1, 1, 1), hold_out=0.25, local=False
    )
    (score,) = result.shown.fit.held_out
    assert score.samples == N // 4
    assert score.rms == pytest.approx(0.02, rel=0.2)  # the noise, nothing else


COMMA = "t,u,y\n" + "".join(f"{k},{INPUT[k]},{'' if k == 5 else OUTPUT[k]}\n" for k in range(N))
TWICE = [f"{k},{k}" for k in K]
BAD = {
    "no clock": (table(["u", "y"]), {}, "no column is a clock; give `time`, of u, y, or `dt`"),
    "a date of another form": (
        table(["Time", "u", "y"], [f"3/1/26 {k}" for k in K]),
        {},
        "(Time = 3/1/26 0, ...: not rising, or no number, no date as",
    ),
    "two clocks": (table(["t", "time,y", "z"], TWICE), {}, "t and time look like clocks"),
    "unknown clock": (table(["t", "u", "y"], K), {"time": "T"}, "no column 'T' for the time"),
    "both": (table(["t", "u", "y"], K), {"time": "t", "dt": 1.0}, "exclude each other"),
    "unknown hold": (table(["t", "u", "y"], K), {"hold": "soh"}, "did you mean 'zoh'"),
    "no interval": (table(["u", "y"]), {"dt": 0.0}, "`dt` = 0 s must be above 0"),
    "no unit of time": (
        table(["X (kPa)", "u", "y"], K),
        {"time": "X (kPa)"},
        "'kpa', which is no unit of time",
    ),
    "back in time": (
        table(["time_s", "u", "y"], np.abs(K - 7)),
        {},
        "line 3: time_s = 6 does not come after",
    ),
    "a gap in a column": (COMMA, {}, "line 7: y is empty; fill the gap"),
    "three columns": (
        table(["t", "u", "y,z"], K).replace("\n", ",1\n").replace("z,1", "z"),
        {"given": "x"},
        "no column 'x'; known: u, y, z",
    ),
    "which is which": (
        table(["t", "a", "b,c"], K).replace("\n", ",1\n").replace("c,1", "c"),
        {},
        "give `input`, of a, b, c",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_be_read_is_one_clear_line(name, tmp_path):
    text, how, expected = BAD[name]
    path = tmp_path / "log.csv"
    path.write_text(text)
    with pytest.raises(InputError) as refused:
        record(path, **how)
    assert expected in str(refused.value)
