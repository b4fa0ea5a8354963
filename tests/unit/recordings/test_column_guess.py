"""What the columns of a log are taken for: quantity, unit, and what is not certain."""

from __future__ import annotations

import pytest

from pamsim.core.errors import InputError
from pamsim.recordings.column_guess import Guess, guess_columns, unit_of
from pamsim.recordings.signals import SignalNames
from pamsim.recordings.table_reader import read_columns

JOINT = SignalNames(joints={"elbow": "angle"}, muscles=("flexor", "extensor"))
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
    (LEG, "KneeAngle_deg", (1, 30), ("knee.angle", "deg", False)),
    (LEG, "pKneeFlexor_kPa", (0, 300), ("knee_flexor.pressure", "kPa", False)),
    (LEG, "q_hip_rad", (0, 1), ("hip.angle", "rad", False)),
    (BENCH, "x/mm", (0, 40), ("rail.position", "mm", False)),
    (JOINT, "tau_Nm", (-2, 2), ("elbow.torque", "N*m", False)),
    (BENCH, "F rail [N]", (0, 20), ("rail.force", "N", False)),
    (BENCH, "valve", (-1, 1), ("lifter.valve", "1", False)),
]


@pytest.mark.parametrize(("names", "column", "values", "expected"), SURE)
def test_a_name_with_quantity_unit_and_place_is_certain(guess, names, column, values, expected):
    found, unused = guess(names, {column: values, "remark": ("x", "y")})
    one = found[column]
    assert (one.quantity, one.unit, one.absolute) == expected
    assert one.warnings == ()
    assert set(unused) == {"remark"}


@pytest.mark.parametrize(
    ("top", "unit"), [(300, "kPa"), (3.0, "bar"), (45.0, "psi"), (3e5, "Pa"), (3000, "mbar")]
)
def test_the_unit_of_pressures_follows_from_the_supply(guess, top, unit):
    """All columns together: a muscle that is hardly filled is in the unit of the other."""
    found, _ = guess(JOINT, {"p_flexor": (0.0, top), "p_extensor": (0.0, top / 50)})
    assert [one.unit for one in found.values()] == [unit, unit]
    assert all("unit" in one.warnings[0] for one in found.values())


def test_abbreviations_numbers_and_letters_are_not_certain(guess):
    found, _ = guess(JOINT, {"p_flex_bar": (0, 3), "p2_bar": (0, 3)})
    assert [one.quantity for one in found.values()] == ["flexor.pressure", "extensor.pressure"]
    assert "fits best" in found["p_flex_bar"].warnings[0]
    assert "number 2 in the rig's order is extensor" in found["p2_bar"].warnings
    by_letter, _ = guess(JOINT, {"p_a_bar": (0, 3), "p_b_bar": (0, 3)})
    assert [one.quantity for one in by_letter.values()] == ["flexor.pressure", "extensor.pressure"]
    # Numbers at the end of the muscles' own names are.
    names = SignalNames(joints={"shaft": "angle"}, muscles=("muscle_1", "muscle_2"))
    found, _ = guess(names, {"p2_kpa": (0, 300), "p1_kpa": (0, 300)})
    assert (found["p2_kpa"].quantity, found["p2_kpa"].warnings) == ("muscle_2.pressure", ())


def test_pressures_that_never_fall_below_the_atmosphere_may_be_absolute(guess):
    found, _ = guess(JOINT, {"p_flexor_kpa": (101.0, 400.0)})
    assert "absolute, or never vented" in found["p_flexor_kpa"].warnings[0]


UNUSED = [
    ("battery [V]", (12, 12), "unit 'V' is not known"),
    ("u_flexor [V]", (0, 10), "would be flexor.valve, but its unit 'V'"),
    ("elbow_speed", (0, 1), "name not known"),
    ("elbow_angle_speed", (0, 1), "a rate"),
    ("angle_ref_deg", (0, 10), "a reference for elbow"),
    ("pressure [bar]", (0, 1), "of no joint or muscle"),
    ("remark", ("x", "y"), "numbers"),
]


@pytest.mark.parametrize(("column", "values", "why"), UNUSED)
def test_what_is_not_understood_is_not_used_and_says_why(guess, column, values, why):
    found, unused = guess(JOINT, {"time_s": (0, 0.01), column: values})
    assert set(found) == {"time_s"}
    assert why in unused[column]


def test_of_two_columns_for_one_quantity_the_second_is_not_used(guess):
    found, unused = guess(JOINT, {"phi_deg": (0, 9), "theta_deg": (0, 9)})
    assert set(found) == {"phi_deg"}
    assert unused == {"theta_deg": "would be elbow.angle, which 'phi_deg' is"}


def test_what_is_stated_is_taken_and_only_its_missing_unit_guessed(guess):
    stated = [
        Guess(quantity="elbow.angle", column="theta_deg", unit="rad", sign=-1),
        Guess(quantity="flexor.pressure", column="ch7", unit=""),
    ]
    found, unused = guess(JOINT, {"phi_deg": (0, 9), "theta_deg": (0, 9), "ch7": (0, 4)}, stated)
    assert (found["theta_deg"].unit, found["theta_deg"].sign) == ("rad", -1)
    assert found["ch7"].unit == "bar"
    assert set(unused) == {"phi_deg"}
    with pytest.raises(InputError, match="no column 'ch8' for"):
        guess(JOINT, {"a": (1, 2)}, [Guess(quantity="time", column="ch8", unit="s")])


def test_units_of_pressure_gauges_are_understood():
    known = {"barg": ("bar", False), "PSIA": ("psi", True), "0.1*bar": ("0.1*bar", False)}
    assert {text: unit_of(text) for text in known} == known
