"""A lab's own log: what its columns are stated to mean, or are taken for by their names."""

from datetime import datetime, timedelta

import numpy as np
import pytest

import pamsim
from pamsim.physics.air import ATMOSPHERE
from pamsim.recordings.column_guess import Guess, guess_columns, unit_of
from pamsim.recordings.log_columns import in_own_format
from pamsim.recordings.signals import SignalNames
from pamsim.recordings.table_reader import read_columns
from tests.unit.core.refusals import all_refused, refused

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


def test_a_log_is_read_as_it_lies(tmp_path):
    (tmp_path / "recording.toml").write_text(INDEX, encoding="utf-8")
    (tmp_path / "log.txt").write_text(LOG, encoding="utf-8")
    read = pamsim.read_recordings(tmp_path)
    (trial,) = read.trials
    k = np.arange(9)
    np.testing.assert_allclose(trial.time, 0.02 * k, atol=1e-12)
    np.testing.assert_allclose(trial.measured["angle"], 0.5 - (0.1 * k + 0.05), atol=1e-9)
    psi = 6894.757293168361
    expected = (44.5 + k) * psi - ATMOSPHERE
    np.testing.assert_allclose(trial.measured["pressure_1"], expected, rtol=1e-9)
    np.testing.assert_allclose(trial.measured["pressure_2"], (1.0 + 0.1 * k) * 1e5, rtol=1e-9)
    np.testing.assert_allclose(trial.command, np.tile([2e5, 150500.0], (9, 1)), rtol=1e-9)
    assert trial.load == 0.0
    assert any("Notiz" in note for note in read.notes)


@pytest.fixture
def log(tmp_path):
    """Columns of a log of two rows: 1 and 2 in each."""
    path = tmp_path / "log.csv"
    path.write_text("t,a,b,c,d\n1,1,1,1,1\n2,2,2,2,2\n")
    return read_columns(path)


CLOCK = {"time": {"column": "t", "unit": "s"}}
ANGLE = {"column": "a", "unit": "deg"}


def test_named_quantities_become_the_columns_of_their_joints_and_muscles(log):
    table = CLOCK | {
        "knee.angle": {"column": "a", "unit": "turn"},
        "slider.position": {"column": "b", "unit": "inch", "offset": 2},
        "flexor.valve": {"column": "c", "unit": "percent"},
        "flexor.force": {"column": "d", "unit": "kN", "sign": -1},
    }
    found = in_own_format(log, table, "[columns]").values
    expected = {"time_s": 1.0, "knee_deg": 360.0, "slider_mm": 3 * 25.4}
    expected |= {"flexor_valve": 0.01, "flexor_n": -1000.0}
    assert {name: values[0] for name, values in found.items()} == pytest.approx(expected)
    assert found["slider_mm"][1] == pytest.approx(4 * 25.4)
    wrong = {
        "no clock": ({"angle": ANGLE}, "no clock"),
        "no table": (3, "no clock; write time = "),
        "unknown quantity": (CLOCK | {"knee.speed": ANGLE}, "JOINT.angle"),
    }
    for name, changed, words in (
        ("unknown key", {"units": "deg"}, "unknown key units"),
        ("wrong unit", {"unit": "bar"}, "bar"),
        ("sign", {"sign": 2}, "write sign = 1 or -1"),
        ("nan", {"offset": float("nan")}, "finite"),
        ("absolute", {"absolute": True}, "for pressures only; leave it out"),
        ("column", {"column": "beta"}, "no column 'beta' for angle (there are: t, a, b, c, d)"),
    ):
        wrong[name] = (CLOCK | {"angle": ANGLE | changed}, words)
    wrong["no unit"] = (CLOCK | {"angle": {"column": "a"}}, 'needs unit = "..."')
    all_refused(wrong, lambda stated: in_own_format(log, stated, "recording.toml: [columns]"))


def test_a_clock_that_begins_again_runs_on(tmp_path):
    """Three rounds of a clock that begins again after 1 s, at set points of a few kPa."""

    def read(wraps, first=0.0):
        rows = [f"{(first + 0.1 * k) % 1.0:.3f},0.1,5,6" for k in range(30)]
        (tmp_path / "log.csv").write_text("\n".join(["t,Winkel,soll,soll2", *rows]))
        index = INDEX.replace("log.txt", "log.csv").replace('"ms" }', f'"s"{wraps} }}')
        lines = [s for s in index.splitlines() if not s.startswith(("pressure_1", "pressure_2"))]
        text = "\n".join(lines).replace("mbar", "kPa")
        (tmp_path / "recording.toml").write_text(text, encoding="utf-8")
        return pamsim.read_recordings(tmp_path).trials[0]

    trial = read(", wraps = 1, offset = 0.5", first=0.03)
    np.testing.assert_allclose(trial.time, 0.1 * np.arange(30), atol=1e-9)
    assert trial.command[0].tolist() == [5000.0, 6000.0]  # low, but in a unit that is stated
    late = "line 7: t: the clock is at 0.5 s, but should begin again after 0.5 s"
    bad = {
        "none": ("", "does not come after"),
        "too early": (", wraps = 0.5", late),
        "a word": (", wraps = true", "wraps = True; write wraps = a time in"),
        "negative": (", wraps = -1", "wraps = -1; write wraps = a time in"),
    }
    all_refused(bad, read)


JOINT = SignalNames(joints={"elbow": "angle"}, muscles=("flexor", "extensor"))
NUMBERED = SignalNames(joints={"shaft": "angle"}, muscles=("muscle_1", "muscle_2"))
LEG = SignalNames(
    joints={"hip": "angle", "knee": "angle"},
    muscles=("hip_flexor", "hip_extensor", "knee_extensor", "knee_flexor"),
)
BENCH = SignalNames(joints={"rail": "position"}, muscles=("lifter",))


@pytest.fixture
def guess(tmp_path):
    def run(names, columns, stated=(), supply=6e5):
        """Column -> what it is taken for, from column -> its values."""
        path = tmp_path / "log.csv"
        rows = zip(*columns.values(), strict=True)
        lines = [";".join(columns), *(";".join(map(str, row)) for row in rows)]
        path.write_text("\n".join(lines))
        found, unused = guess_columns(read_columns(path), names, supply=supply, stated=stated)
        return {one.column: one for one in found}, unused

    return run


SURE = [
    (JOINT, "time [s]", (0, 0.01), ("time", "s", False)),
    (JOINT, "t_ms", (0, 10), ("time", "ms", False)),
    (JOINT, "P flexor [bar]", (0.0, 4.0), ("flexor.pressure", "bar", False)),
    (JOINT, "p_extensor_psia", (14.0, 60.0), ("extensor.pressure", "psi", True)),
    (JOINT, "ExtensorPressureCmd (kPa)", (0, 400), ("extensor.pressure_set", "kPa", False)),
    (JOINT, "flexor_pwm/%", (-20, 60), ("flexor.pulse", "percent", False)),
    (JOINT, "phi [rad]", (0.1, 1.0), ("elbow.angle", "rad", False)),
    (JOINT, "F flexor [N]", (10, 100), ("flexor.force", "N", False)),
    (JOINT, "tau_Nm", (-2, 2), ("elbow.torque", "N*m", False)),
    (JOINT, "encoder_abs_deg", (1, 30), ("elbow.angle", "deg", False)),
    (JOINT, "p_flexor_abs_kpa", (1, 300), ("flexor.pressure", "kPa", True)),
    (LEG, "KneeAngle_deg", (1, 30), ("knee.angle", "deg", False)),
    (LEG, "pKneeFlexor_kPa", (0, 300), ("knee_flexor.pressure", "kPa", False)),
    (LEG, "q_hip_rad", (0, 1), ("hip.angle", "rad", False)),
    (BENCH, "x/mm", (0, 40), ("rail.position", "mm", False)),
    (BENCH, "F rail [N]", (0, 20), ("rail.force", "N", False)),
    (BENCH, "valve", (-1, 1), ("lifter.valve", "1", False)),
    (NUMBERED, "p2_kpa", (0, 300), ("muscle_2.pressure", "kPa", False)),
]
UNUSED = [
    ("battery [V]", (12, 12), "unit 'V' is not known"),
    ("u_flexor [V]", (0, 10), "would be flexor.valve, but its unit 'V'"),
    ("elbow_speed", (0, 1), "name not known"),
    ("elbow_angle_speed", (0, 1), "a rate"),
    ("angle_ref_deg", (0, 10), "a reference for elbow"),
    ("pressure [bar]", (0, 1), "of no joint or muscle"),
    ("remark", ("x", "y"), "numbers"),
    ("elbow_theta_rad_s", (0, 1), "a rate"),
    ("F_flexor_ref [N]", (0, 10), "a reference for flexor"),
    ("flexor_valve_V", (0, 5), "would be flexor.valve, but its unit 'v'"),
    ("Flexor pressure error [kPa]", (0, 5), "no reading of a joint or muscle"),
]


def test_a_name_with_quantity_unit_and_place_is_certain_and_others_say_why_not(guess):
    for names, column, values, expected in SURE:
        found, unused = guess(names, {column: values, "remark": ("x", "y")})
        one = found[column]
        assert (one.quantity, one.unit, one.absolute) == expected
        assert (one.warnings, set(unused)) == ((), {"remark"})
    for column, values, why in UNUSED:
        found, unused = guess(JOINT, {"time_s": (0, 0.01), column: values})
        assert set(found) == {"time_s"}
        assert why in unused[column]
    known = {"barg": ("bar", False), "PSIA": ("psi", True), "0.1*bar": ("0.1*bar", False)}
    assert {text: unit_of(text) for text in known} == known


def test_a_signal_with_a_cell_that_is_no_number_is_not_left_out_silently(guess):
    times = tuple(0.01 * k for k in range(5))
    for cell in ("NaN", "", "x"):
        read = {"t_s": times, "phi_deg": (0, 1, cell, 2, 3), "remark": (1, 1, cell, 1, 1)}
        with refused("line 4: phi_deg", "--ignore 'phi_deg'"):
            guess(JOINT, read)
        _, unused = guess(JOINT, read | {"phi_deg": (0, cell, cell, cell, 3)})
        assert unused.keys() == {"phi_deg", "remark"}


def test_dates_with_times_of_day_are_a_clock_in_seconds(guess, tmp_path):
    begin = datetime(2026, 11, 2, 23, 59, 59, 900_000)
    times = [begin + timedelta(seconds=0.02 * k) for k in range(9)]
    for separator in ("T", " "):
        written = [time.isoformat(separator) for time in times]
        found, _ = guess(BENCH, {"timestamp": written, "x_mm": range(9)})
        assert (found["timestamp"].quantity, found["timestamp"].unit) == ("time", "s")
        columns = read_columns(tmp_path / "log.csv")
        clock = {"time": {"column": "timestamp", "unit": "s"}}
        read = in_own_format(columns, clock, "[columns]").values["time_s"]
        np.testing.assert_allclose(read, 0.02 * np.arange(9), atol=1e-9)
        with refused("'timestamp' holds dates"):
            in_own_format(columns, {"time": clock["time"] | {"unit": "ms"}}, "[columns]")
    other = [*written[:4], "0.08", *written[5:]]
    with refused("line 2: timestamp"):
        guess(BENCH, {"timestamp": other, "x_mm": range(9)}, [Guess("time", "timestamp", "")])


def test_the_pressure_of_the_supply_is_not_that_of_the_only_muscle(guess):
    found, unused = guess(BENCH, {"p_supply [bar]": (6, 6), "p [bar]": (0, 3)})
    assert found["p [bar]"].quantity == "lifter.pressure"
    assert set(unused) == {"p_supply [bar]"}
    boiler = SignalNames(joints={"rail": "position"}, muscles=("supply",))
    assert set(guess(boiler, {"t_s": (0, 1), "p_supply [bar]": (0, 3)})[0]) >= {"p_supply [bar]"}


def test_the_unit_of_a_clock_follows_from_its_rows_where_they_repeat_a_time_stamp(guess):
    for rows, stamp, unit in ((100, 1, "s"), (3, 1, "ms"), (3, 0.01, "s")):
        clock = [stamp * (k // rows) for k in range(300)]
        assert guess(BENCH, {"t": clock})[0]["t"].unit == unit


def test_the_unit_of_pressures_follows_from_the_supply(guess):
    """All columns together: a muscle that is hardly filled is in the unit of the other."""
    for top, unit in ((300, "kPa"), (3.0, "bar"), (45.0, "psi"), (3e5, "Pa"), (3000, "mbar")):
        found, _ = guess(JOINT, {"p_flexor": (0.0, top), "p_extensor": (0.0, top / 50)})
        assert [one.unit for one in found.values()] == [unit, unit]
        assert all("unit" in one.warnings[0] for one in found.values())
    found, _ = guess(JOINT, {"p_flexor_kpa": (101.0, 400.0)})  # never below the atmosphere
    assert "absolute, or never vented" in found["p_flexor_kpa"].warnings[0]


def test_abbreviations_numbers_and_letters_are_not_certain(guess):
    for columns, warnings in (
        (("p_flex_bar", "p2_bar"), ("fits best", "number 2 in the rig's order is extensor")),
        (("p_a_bar", "p_b_bar"), ("", "")),
    ):
        found, _ = guess(JOINT, dict.fromkeys(columns, (0, 3)))
        quantities = [one.quantity for one in found.values()]
        assert quantities == ["flexor.pressure", "extensor.pressure"]
        for column, words in zip(columns, warnings, strict=True):
            assert words in " ".join(found[column].warnings)
            assert found[column].warnings


def test_what_is_stated_is_taken_and_a_second_column_for_one_quantity_is_not(guess):
    found, unused = guess(JOINT, {"phi_deg": (0, 9), "theta_deg": (0, 9)})
    assert set(found) == {"phi_deg"}
    assert unused == {"theta_deg": "would be elbow.angle, which 'phi_deg' is"}
    stated = [
        Guess(quantity="elbow.angle", column="theta_deg", unit="rad", sign=-1),
        Guess(quantity="flexor.pressure", column="ch7", unit=""),
    ]
    found, unused = guess(JOINT, {"phi_deg": (0, 9), "theta_deg": (0, 9), "ch7": (0, 4)}, stated)
    assert (found["theta_deg"].unit, found["theta_deg"].sign) == ("rad", -1)
    assert found["ch7"].unit == "bar"  # only the missing unit is guessed
    assert set(unused) == {"phi_deg"}
    with refused("no column 'ch8' for"):
        guess(JOINT, {"a": (1, 2)}, [Guess(quantity="time", column="ch8", unit="s")])
