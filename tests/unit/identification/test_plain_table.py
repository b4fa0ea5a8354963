"""Tables of any columns: whatever the dialect, the same signals are identified from."""

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from pamsim.identification.data import read_data, select_trials, split_tables, trials_of
from pamsim.identification.identify import identify
from pamsim.identification.signals import chosen_signals, signal, used_trial
from tests.unit.core.refusals import all_refused
from tests.unit.identification.planted import FEW, fit_continuous, refuses, sampled

N, GAIN, LAG = 240, 2.0, 7.0  # samples, output per input, samples
INPUT = np.repeat(np.random.default_rng(3).choice([0.0, 1.0, 2.5], N // 12), 12)
NOISE = 0.02 * np.random.default_rng(4).normal(size=N)
OUTPUT = np.round(20.0 + sampled([GAIN], [LAG, 1.0], INPUT - INPUT[0], 1.0) + NOISE, 6)
K = np.arange(N)


def table(header, clock=None, *, mark=",", given=INPUT):
    """Text of a table: a clock, if there is one, the input and the output."""
    columns = [given, OUTPUT] if clock is None else [clock, given, OUTPUT]
    rows = zip(*(np.asarray(column).tolist() for column in columns), strict=True)
    lines = [mark.join(v if isinstance(v, str) else repr(v) for v in row) for row in rows]
    return "\n".join([*([mark.join(header)] if header else []), *lines]) + "\n"


@pytest.fixture
def path(tmp_path):
    return tmp_path / "log.csv"


def load_data(data, **clock):
    return trials_of(read_data(data), **clock)


def record(path, *, given=None, explained=None, **clock):
    """The only trial's signals, and the notes."""
    data = load_data(path, **clock)
    inputs, explained, note = chosen_signals(data.tables, [given] if given else [], explained)
    (only,) = data.tables
    into, out = signal(inputs[0], data.tables), signal(explained, data.tables)
    return used_trial(only, [into], out)[0].record, (*data.notes, note)


START = datetime(2026, 3, 1, tzinfo=UTC)
DATES = [(START + timedelta(seconds=2 * k)).isoformat() for k in range(N)]
OF_DAY = [f"10:{k // 30:02d}:{2 * k % 60:02d}.000" for k in K]
OVER_MIDNIGHT = [(START + timedelta(seconds=2 * k - 100)).strftime("%H:%M:%S") for k in range(N)]
LABVIEW = "LabVIEW\nWriter_Version\t2\n***End_of_Header***\n"
MINUTES = (2.0 * K / 60.0).round(12)
CAPITALS = "".join(f"{2.0 * k}|{OUTPUT[k]}|{INPUT[k]}\n" for k in K)
REMARKS = "".join(f"{2.0 * k},{INPUT[k]},ok,{OUTPUT[k]}\n" for k in K)
NUMBERED = "".join(f"{k},{2.0 * k},{INPUT[k]},{OUTPUT[k]}\n" for k in K)
WITH_BLANKS = table(["Time", "Power (V)", "T out"], 2.0 * K)
COMMAS = table(["Zeit", "Druck", "Weg"], 2.0 * K, mark=";").replace(".", ",")

# Text of a file with two seconds between its rows, and how it is read.
DIALECTS = {
    "names of pamsim": (table(["time_s", "u", "y"], 2.0 * K), {}),
    "names with blanks": (WITH_BLANKS, {"given": "Power (V)", "explained": "T out"}),
    "no flag": (WITH_BLANKS, {}),
    "minus in a name": (table(["t", "u-1", "y+1"], 2.0 * K), {"given": "u-1"}),
    "milliseconds": (table(["Time [ms]", "u", "y"], 2000 * K), {}),
    "minutes": (table(["t_min", "u", "y"], MINUTES), {}),
    "days": (table(["clock (d)", "u", "y"], (2.0 * K / 86400.0).round(15)), {}),
    "dates": (table(["timestamp", "u", "y"], DATES), {}),
    "times of day": (table(["Time", "u", "y"], OF_DAY), {}),
    "over midnight": (table(["Time", "u", "y"], OVER_MIDNIGHT), {}),
    "named by its unit": (table(["seconds", "u", "y"], 2.0 * K), {}),
    "output first, in capitals": ("Time|Output|Input\n" + CAPITALS, {}),
    "a clock by name": (table(["X_Value", "u", "y"], 2.0 * K), {"time": "X_Value"}),
    "no clock": (table(["u", "y"]), {"dt": 2.0}),
    "rows by number": (table(["", "u", "y"], K), {"dt": 2.0}),
    "rows by number beside a clock": (",t,u,y\n" + NUMBERED, {}),
    "a clock that is not used": (table(["t", "u", "y"], 7.0 * K), {"dt": 2.0}),
    "no header": (table(None), {"dt": 2.0}),
    "no header but a clock": (table(None, 2.0 * K), {}),
    "decimal commas": (COMMAS, {}),
    "a line of units": (LABVIEW + table(["t", "u", "y\nmin\tV\tdegC"], MINUTES, mark="\t"), {}),
    "spaces": (table(["t", "u", "y"], 2.0 * K, mark="  "), {}),
    "text beside": ("t,u,remark,y\n" + REMARKS, {}),
    "epoch": (table(["timestamp", "u", "y"], 1.7e9 + 2.0 * K), {}),
}


def test_every_dialect_gives_the_same_signals(path):
    for name, (text, how) in DIALECTS.items():
        path.write_text(text, encoding="utf-8")
        found, notes = record(path, **how)
        assert found.sample_time == pytest.approx(2.0, rel=1e-9), name
        np.testing.assert_array_equal(found.input, INPUT, err_msg=name)
        np.testing.assert_array_equal(found.output, OUTPUT, err_msg=name)
        assert found.holds == ("zoh",), name
        assert bool(notes[-1]) == (len({"given", "explained"} & set(how)) < 2), name
    for encoding in ("utf-8", "utf-8-sig", "utf-16", "cp1252"):
        path.write_bytes(table(["t", "Power [W]", "T [°C]"], 2.0 * K).encode(encoding))
        assert list(load_data(path).tables[0].columns) == ["Power [W]", "T [°C]"]
    path.write_bytes(bytes(range(256)) * 4)
    refuses("not a text file", load_data, path)


def test_any_sample_time_is_taken_and_rounded_times_are_those_of_an_even_clock(path):
    for seconds in (1e-6, 0.1, 86400.0):
        path.write_text(table(["t", "u", "y"], seconds * K))
        found, _ = record(path)
        assert found.sample_time == pytest.approx(seconds, rel=1e-9)
        assert fit_continuous([found], order=1)["T"].value == pytest.approx(LAG * seconds, rel=0.02)
    path.write_text(table(["t", "u", "y"], [f"{k / 300.0:.3f}" for k in K]))
    found, _ = record(path)
    assert found.sample_time == pytest.approx(1.0 / 300.0, rel=1e-4)
    np.testing.assert_array_equal(found.output, OUTPUT)  # not interpolated
    jitter = np.random.default_rng(1).uniform(-3e-3, 3e-3, N)
    path.write_text(table(["t", "u", "y"], np.round(0.02 * K + jitter, 6)))
    assert not np.array_equal(record(path)[0].output[1:-1], OUTPUT[1:-1])


def test_a_unit_is_one_only_where_the_name_states_it(path):
    for name, unit, si_unit, factor in (
        ("y [%]", "percent", "percent", 1.0),
        ("y_deg", "deg", "rad", np.pi / 180.0),
        ("y (bar)", "bar", "Pa", 1e5),
        ("y [°C]", "°C", "°C", 1.0),
        ("y_v", "V", "V", 1.0),
        ("u_kpa", "kPa", "Pa", 1e3),  # an input, not a valve's opening
        ("valve1_bar", "bar", "Pa", 1e5),
        ("q_mm", "1", "1", 1.0),  # an angle is in no mm
        ("flow [l/min]", "l/min", "l/min", 1.0),
        ("T_out", "1", "1", 1.0),
        ("tank_level", "1", "1", 1.0),
        ("y", "1", "1", 1.0),
    ):
        path.write_text(table(["t", "given", name], 0.02 * K), encoding="utf-8")
        data = load_data(path)
        found = signal(name, data.tables)
        assert (found.unit, found.si_unit) == (unit, si_unit)
        assert found.factor == pytest.approx(factor)
        np.testing.assert_allclose(found.of(data.tables[0].columns) / factor, OUTPUT)


def test_a_gap_of_the_clock_makes_two_trials(path):
    path.write_text(table(["t", "u", "y"], np.where(K < 100, 2.0 * K, 2.0 * K + 50.0)))
    data = load_data(path)
    found = [(t.name, t.time.size, t.moving) for t in data.tables]
    assert found == [("log_1", 100, False), ("log_2", 140, True)]
    assert [t.protocol for t in data.tables] == ["log_1", "log_2"]  # none repeats another
    np.testing.assert_array_equal(np.concatenate([t.columns["y"] for t in data.tables]), OUTPUT)
    assert any("gaps" in note for note in data.notes)


def test_several_tables_are_fitted_together_and_one_may_be_held_out(tmp_path):
    a, b, day = tmp_path / "a.csv", tmp_path / "b.csv", tmp_path / "day" / "a.csv"
    day.parent.mkdir()
    for one in (a, b, day):
        one.write_text(table(["t", "u", "y"], 2.0 * K))
    to_fit, to_test = select_trials(load_data([a, b]), (), (), ["b"])
    assert ([t.name for t in to_fit], [t.name for t in to_test]) == (["a"], ["b"])
    assert [t.name for t in select_trials(load_data([a, b]), "a", (), ())[0]] == ["a"]
    refuses("'30%' is not in the data", select_trials, load_data([a, b]), (), (), "30%")
    refuses("/a' is there twice", load_data, [a, a])
    apart = load_data([a, day]).tables
    assert [t.name for t in apart] == [t.protocol for t in apart] == [f"{tmp_path.name}/a", "day/a"]


def test_a_row_alone_is_left_out_or_refused(path):
    path.write_text(table(["t", "u", "y"], np.where(K < N - 1, 2.0 * K, 2.0 * K + 50.0)))
    found = identify(path, **FEW)
    assert [trial.table.name for trial in found.used] == ["log_1"]
    assert "not used: trial log_2: one row alone shows no change; exclude it" in found.notes
    path.write_text("t,u,y\n0,1,2\n")
    refuses("trial log: one row alone", identify, path, **FEW)


def test_few_values_are_held_unless_it_is_stated(path):
    draw = np.random.default_rng(5)
    smooth = np.convolve(draw.normal(size=N + 30), np.hanning(30), "valid")[:N]
    noisy = INPUT + 0.01 * draw.normal(size=N)
    few, many = (1.0 * np.minimum(K // 5, n) for n in (23, 24))  # up to a tenth of 240 may differ
    guesses = {"zoh": (INPUT, few), "foh": (many, smooth, noisy)}
    for guessed, values in ((guessed, v) for guessed, each in guesses.items() for v in each):
        path.write_text(table(["t", "u", "y"], K, given=values))
        assert record(path)[0].holds == (guessed,)
        for hold in ("zoh", "foh"):
            assert record(path, hold=hold)[0].holds == (hold,)


def test_a_split_keeps_every_sample_once_and_its_end_is_predicted_from_its_own_state(path):
    path.write_text(table(["t", "u", "y"], 2.0 * K))
    (whole,) = load_data(path).tables
    for share in (0.3, 0.5, 0.01):
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
    (score,) = identify(path, **FEW, hold_out=0.25).shown.fit.held_out
    assert score.samples == N // 4
    assert score.rms == pytest.approx(0.02, rel=0.2)  # the noise, nothing else


HOLE = "".join(f"{k},{INPUT[k]},{'' if k == 5 else OUTPUT[k]}\n" for k in K)
BACK = table(["time_s", "u", "y"], np.abs(K - 7))
PRESSED = table(["X (kPa)", "u", "y"], K)
USUAL = table(["t", "u", "y"], K)
TWO_CLOCKS = table(["t", "time,y", "z"], [f"{k},{k}" for k in K])
FOUR = "".join(f"{k},{INPUT[k]},{OUTPUT[k]},1\n" for k in K)
AMERICAN = table(["Time", "u", "y"], [f"3/1/26 {k}" for k in K])
BAD = {
    "no clock": (table(["u", "y"]), {}, "no column is a clock; give `time`, of u, y, or `dt`"),
    "other dates": (AMERICAN, {}, "(Time = 3/1/26 0, ...: not rising, or no number, no date as"),
    "two clocks": (TWO_CLOCKS, {}, "t and time look like clocks"),
    "unknown clock": (USUAL, {"time": "T"}, "no column 'T' for the time"),
    "both": (USUAL, {"time": "t", "dt": 1.0}, "exclude each other"),
    "unknown hold": (USUAL, {"hold": "soh"}, "did you mean 'zoh'"),
    "no interval": (table(["u", "y"]), {"dt": 0.0}, "`dt` = 0 s must be above 0"),
    "endless": (table(["u", "y"]), {"dt": np.inf}, "`dt` = inf s must be above 0"),
    "no time": (PRESSED, {"time": "X (kPa)"}, "'kpa', which is no unit of time"),
    "back in time": (BACK, {}, "line 3: time_s = 6 does not come after"),
    "a gap in a column": ("t,u,y\n" + HOLE, {}, "line 7: y is empty; fill the gap"),
    "three columns": ("t,u,y,z\n" + FOUR, {"given": "x"}, "no column 'x'; known: u, y, z"),
    "which is which": (
        "t,a,b,c\n" + FOUR,
        {},
        "give `input`, a column or a difference as in p1-p2, and `output`",
    ),
}


def test_what_cannot_be_read_is_one_clear_line(path):
    def read(text, how):
        path.write_text(text)
        record(path, **how)

    all_refused(BAD, read)


def test_a_gap_is_not_hidden_behind_what_it_leads_to(path):
    path.write_text("t,u,y\n" + HOLE)
    refuses(rf"^\S*{path.name}: line 7: y is empty", record, path)


def test_rows_missing_from_a_rounded_clock_leave_the_others_as_they_were(path):
    draw = np.random.default_rng(3)
    rows = np.flatnonzero(np.append(True, draw.random(299) > 0.1))
    u, y = np.floor(rows / 20) % 2, draw.normal(size=rows.size)
    lines = (f"{k / 30:.3f},{a:g},{b:.9f}" for k, a, b in zip(rows, u, y, strict=True))
    path.write_text("t,u,y\n" + "\n".join(lines))
    found, _ = record(path)
    assert found.sample_time == pytest.approx(1.0 / 30.0, rel=1e-4)
    np.testing.assert_allclose(found.output[rows], y, atol=1e-6)
    np.testing.assert_array_equal(found.input[rows], u)
