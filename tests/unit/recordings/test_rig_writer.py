"""A written rig is the rig it came from, but for the parameters that were given."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.core.parameters import Sourced
from pamsim.recordings.rig_file import find_rig, read_rig
from pamsim.recordings.rig_writer import write_rig


def number(value, unit, **more):
    return Sourced(value=value, unit=unit, source="identified by a test", where="test", **more)


def same_rig(one, other):
    """Whether two rigs are equal in all that the engine uses."""
    return (
        one.muscles == other.muscles
        and np.array_equal(one.model.actuator_user, other.model.actuator_user)
        and np.array_equal(one.model.dof_damping, other.model.dof_damping)
        and np.array_equal(one.model.wrap_prm, other.model.wrap_prm)
        and np.array_equal(one.model.body_quat, other.model.body_quat)
    )


@pytest.fixture(scope="module")
def source():
    return read_rig("mas20_arm")


def test_a_rig_written_without_changes_is_the_same_rig(source, tmp_path):
    path = write_rig(source, tmp_path / "copy", {})
    assert path.read_text(encoding="utf-8") == (source.folder / "params.toml").read_text("utf-8")
    assert same_rig(pamsim.load_rig(tmp_path / "copy"), pamsim.load_rig("mas20_arm"))


def test_another_hysteresis_operator_is_written_with_its_usual_numbers(source, tmp_path):
    numbers = {
        "hysteresis.force_per_pressure": number(7e-5, "N/Pa"),
        "hysteresis.maxwell_slip.full_slip": number(0.02, "1"),
        "hysteresis.maxwell_slip.decay": number(1.1, "1"),
    }
    write_rig(source, tmp_path / "slip", numbers)
    values = {name: entry.value for name, entry in numbers.items()}
    expected = pamsim.load_rig("mas20_arm").with_parameters(values)
    found = pamsim.load_rig(tmp_path / "slip")
    assert found.muscles["muscle_2"].hysteresis.law == "maxwell_slip"
    np.testing.assert_allclose(found.model.actuator_user, expected.model.actuator_user, rtol=1e-9)
    again = write_rig(read_rig(tmp_path / "slip"), tmp_path / "again", numbers)
    assert again.read_text("utf-8") == (tmp_path / "slip" / "params.toml").read_text("utf-8")


def test_values_arrive_to_the_printed_digits_in_the_unit_of_the_file(source, tmp_path):
    wanted = {
        "valve.conductance_fill": 6.123456789e-9,
        "chamber.dead_volume": 1.23456789e-5,
        "body.rig.tilt": -0.0512345678,
        "tendon.chain_1.coef": 0.0123456789,
        "passive.slack_contraction": -0.0123456789,
    }
    units = ("m^3/(s*Pa)", "m^3", "rad", "m", "1")
    write_rig(
        source,
        tmp_path / "new",
        {
            name: number(value, unit)
            for (name, value), unit in zip(wanted.items(), units, strict=True)
        },
    )
    written = read_rig(tmp_path / "new")
    assert written.muscle["valve"]["conductance_fill"].unit == "dm^3/(s*bar)"
    assert written.muscle["chamber"]["dead_volume"].value == pytest.approx(12.3456789, rel=1e-9)
    expected = pamsim.load_rig("mas20_arm").with_parameters(wanted)
    found = pamsim.load_rig(tmp_path / "new")
    np.testing.assert_allclose(found.model.actuator_user, expected.model.actuator_user, rtol=1e-9)
    np.testing.assert_allclose(found.model.body_quat, expected.model.body_quat, rtol=1e-9)
    np.testing.assert_allclose(found.model.wrap_prm, expected.model.wrap_prm, rtol=1e-9)


def test_what_is_known_of_a_value_goes_with_it(source, tmp_path):
    before = source.native["joint.shaft.damping"]
    assert before.interval95 is not None
    write_rig(
        source,
        tmp_path / "new",
        {
            "joint.shaft.damping": number(0.7, "N*m*s/rad"),
            "body.rig.tilt": number(
                -0.05, "rad", interval95=(-0.06, -0.04), bounds=(-0.1, 0.1), note="as measured"
            ),
        },
    )
    native = read_rig(tmp_path / "new").native
    assert native["joint.shaft.damping"].interval95 is None  # the old one was of the old value
    assert before.note
    assert not native["joint.shaft.damping"].note  # it was about the old value
    tilt = native["body.rig.tilt"]
    assert tilt.source == "identified by a test"
    assert tilt.note == "as measured"
    assert tilt.interval95 == pytest.approx(np.degrees((-0.06, -0.04)), rel=1e-4)
    assert tilt.bounds == pytest.approx(np.degrees((-0.1, 0.1)), rel=1e-4)


def test_everything_else_in_the_file_stays_as_written(source, tmp_path):
    path = write_rig(
        source, tmp_path / "new", {"chamber.dead_volume": number(2e-5, "m^3")}, heading="why\nwhen"
    )
    old = (source.folder / "params.toml").read_text(encoding="utf-8").splitlines()
    new = path.read_text(encoding="utf-8").splitlines()
    assert new[:2] == ["# why", "# when"]
    changed = [(a, b) for a, b in zip(old, new[2:], strict=True) if a != b]
    assert [a.split(" ")[0] for a, _ in changed] == ["dead_volume"]


def test_a_comment_behind_an_entry_stays(source, tmp_path):
    shutil.copytree(source.folder, tmp_path / "rig")
    path = tmp_path / "rig" / "params.toml"
    text = path.read_text(encoding="utf-8")
    line = next(line for line in text.splitlines() if line.startswith("dead_volume"))
    path.write_text(text.replace(line, f"{line}  # measured twice"), encoding="utf-8")
    new = write_rig(
        read_rig(tmp_path / "rig"), tmp_path / "new", {"chamber.dead_volume": number(2e-5, "m^3")}
    )
    assert 'dead_volume = { value = 20.0, unit = "cm^3"' in new.read_text(encoding="utf-8")
    assert "}  # measured twice" in new.read_text(encoding="utf-8")


def test_parameters_missing_in_the_file_are_added(source, tmp_path):
    assert "threshold" not in source.muscle
    write_rig(
        source,
        tmp_path / "new",
        {
            "threshold.pressure": number(12.0, "kPa"),
            "valve.regulator_dead_band": number(500.0, "Pa"),
            "joint.shaft.frictionloss": number(0.1, "N*m"),
        },
    )
    rig = pamsim.load_rig(tmp_path / "new")
    assert [m.threshold.pressure for m in rig.muscles.values()] == [12e3, 12e3]
    assert rig.muscles["muscle_1"].valve.regulator_dead_band == 500.0
    assert rig.model.joint("shaft").frictionloss[0] == 0.1
    assert rig.file.muscle["threshold"]["pressure"].unit == "kPa"


def test_what_sensors_err_by_goes_where_sensors_are_described(source, tmp_path):
    path = write_rig(
        source,
        tmp_path / "new",
        {"sensor.angle_bias": number(-0.5, "deg"), "sensor.pressure_lag": number(0.02, "s")},
    )
    rig = pamsim.load_rig(tmp_path / "new")
    assert rig.sensor.angle_bias == pytest.approx(np.radians(-0.5))
    assert rig.sensor.pressure_lag == 0.02
    assert rig.sensor.converter_bits == 14.0
    shutil.copytree(source.folder, tmp_path / "bare")
    bare = tmp_path / "bare" / "params.toml"
    bare.write_text(path.read_text(encoding="utf-8").split("[sensor]")[0], encoding="utf-8")
    write_rig(
        read_rig(tmp_path / "bare"),
        tmp_path / "again",
        {"sensor.pressure_scale": number(1.02, "1")},
    )
    assert pamsim.load_rig(tmp_path / "again").sensor.pressure_scale == 1.02


def test_one_muscle_may_differ_and_the_actuators_keep_their_order(source, tmp_path):
    write_rig(
        source,
        tmp_path / "new",
        {
            "muscle_1:chamber.dead_volume": number(3e-5, "m^3"),
            "chamber.dead_volume": number(2e-5, "m^3"),
        },
    )
    rig = pamsim.load_rig(tmp_path / "new")
    assert list(rig.muscles) == ["muscle_1", "muscle_2"]
    assert rig.file.tendons == source.tendons
    volumes = [m.chamber.dead_volume for m in rig.muscles.values()]
    assert volumes == pytest.approx([3e-5, 2e-5])
    comment = "# Both muscles are equal"
    assert comment in (tmp_path / "new" / "params.toml").read_text(encoding="utf-8")

    write_rig(rig.file, tmp_path / "again", {"muscle_1:chamber.dead_volume": number(4e-5, "m^3")})
    again = pamsim.load_rig(tmp_path / "again")
    volumes = [m.chamber.dead_volume for m in again.muscles.values()]
    assert volumes == pytest.approx([4e-5, 2e-5])


def test_a_shared_value_replaces_what_one_muscle_had_of_its_own(source, tmp_path):
    write_rig(source, tmp_path / "one", {"muscle_2:chamber.dead_volume": number(3e-5, "m^3")})
    write_rig(
        read_rig(tmp_path / "one"), tmp_path / "two", {"chamber.dead_volume": number(2e-5, "m^3")}
    )
    rig = pamsim.load_rig(tmp_path / "two")
    volumes = [m.chamber.dead_volume for m in rig.muscles.values()]
    assert volumes == pytest.approx([2e-5, 2e-5])


def test_the_folder_comes_along_but_not_what_is_said_of_the_old_numbers(source, tmp_path):
    write_rig(source, tmp_path / "new", {})
    kept = {p.name for p in (tmp_path / "new").iterdir()}
    assert kept == {p.name for p in source.folder.iterdir()} - {"README.md", "calibration.json"}
    assert read_rig(tmp_path / "new").scene is not None


def test_bad_requests_are_refused_in_one_line(source, tmp_path):
    with pytest.raises(InputError, match=r"did you mean 'muscle_1'"):
        write_rig(source, tmp_path / "new", {"muscle1:chamber.dead_volume": number(1.0, "m^3")})
    with pytest.raises(InputError, match="dead_volume: unit 'kg' does not measure"):
        write_rig(source, tmp_path / "new", {"chamber.dead_volume": number(1.0, "kg")})
    for inside in (find_rig("mas20_arm"), find_rig("mas20_arm") / "new"):
        with pytest.raises(InputError, match="the folder it is made from, or inside it"):
            write_rig(source, inside, {})
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(InputError, match="cannot write"):
        write_rig(source, tmp_path / "file", {})


def test_a_rig_that_shares_its_mjcf_takes_it_along_and_leaves_other_rigs(tmp_path):
    for name in ("sarosi", "."):
        folder = tmp_path / (name if name != "." else "bench")
        own = find_rig("muscle_bench") / name
        write_rig(read_rig(own), folder, {})
        assert same_rig(pamsim.load_rig(folder), pamsim.load_rig(own))
        assert {path.name for path in folder.iterdir()} >= {"muscle_bench.xml", "scene.xml"}
        assert not any(path.is_dir() for path in folder.iterdir())
