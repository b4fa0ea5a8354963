"""A written rig is the rig it came from, but for the parameters that were given."""

import numpy as np
import pytest

import pamsim
from pamsim.core.parameters import Sourced
from pamsim.recordings.rig_file import find_rig, read_rig
from pamsim.recordings.rig_writer import write_rig
from tests.unit.core.refusals import all_refused

SOURCE = read_rig("mas20_arm")
DEAD = "chamber.dead_volume"


def number(value, unit, **more):
    return Sourced(value=value, unit=unit, source="identified by a test", where="test", **more)


def volume(value):
    return number(value, "m^3")


def same_rig(one, other):
    """Whether two rigs are equal in all that the engine uses."""
    return (
        one.muscles == other.muscles
        and np.array_equal(one.model.actuator_user, other.model.actuator_user)
        and np.array_equal(one.model.dof_damping, other.model.dof_damping)
        and np.array_equal(one.model.wrap_prm, other.model.wrap_prm)
        and np.array_equal(one.model.body_quat, other.model.body_quat)
    )


@pytest.fixture
def written(tmp_path):
    """The rig that is loaded from what is written, and the text of its parameters."""

    def write(numbers, source=SOURCE, name="new", **options):
        path = write_rig(source, tmp_path / name, numbers, **options)
        return pamsim.load_rig(tmp_path / name), path.read_text(encoding="utf-8")

    return write


def test_a_rig_written_without_changes_is_the_same_rig(written, tmp_path):
    rig, text = written({})
    assert text == (SOURCE.folder / "params.toml").read_text("utf-8")
    assert same_rig(rig, pamsim.load_rig("mas20_arm"))
    # What is stated of the old numbers does not come along.
    kept = {p.name for p in (tmp_path / "new").iterdir()}
    assert kept == {p.name for p in SOURCE.folder.iterdir()} - {"README.md", "calibration.json"}


def test_a_rig_that_shares_its_mjcf_takes_it_along_and_leaves_other_rigs(written, tmp_path):
    for name, own in (("one", find_rig("muscle_bench") / "sarosi"), ("bench", "muscle_bench")):
        assert same_rig(written({}, read_rig(own), name)[0], pamsim.load_rig(own))
        assert {path.name for path in (tmp_path / name).iterdir()} >= {"muscle_bench.xml"}
        assert not any(path.is_dir() for path in (tmp_path / name).iterdir())


def test_a_shared_mjcf_that_refers_to_other_files_is_named_where_it_is(written, tmp_path):
    (tmp_path / "robot").mkdir()
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    (tmp_path / "robot" / "corner.obj").write_text(corners, encoding="utf-8")
    mesh = '<asset><mesh name="corner" file="corner.obj"/></asset><worldbody>'
    text = SOURCE.mjcf.read_text("utf-8").replace("<worldbody>", mesh)
    (tmp_path / "robot" / "arm.xml").write_text(text, encoding="utf-8")
    _, text = written({})
    for name in ("mas20_arm.xml", "scene.xml"):
        (tmp_path / "new" / name).unlink()
    text = text.replace('"mas20_arm.xml"', '"../robot/arm.xml"').replace('scene = "', '# "')
    (tmp_path / "new" / "params.toml").write_text(text, encoding="utf-8")
    one = read_rig(tmp_path / "new")
    rig, _ = written({}, one, "deeper/one")
    assert same_rig(rig, pamsim.load_rig(tmp_path / "new"))
    assert not list((tmp_path / "deeper/one").glob("*.xml"))


def test_another_hysteresis_operator_is_written_with_its_usual_numbers(written):
    numbers = {
        "hysteresis.force_per_pressure": number(7e-5, "N/Pa"),
        "hysteresis.maxwell_slip.full_slip": number(0.02, "1"),
        "hysteresis.maxwell_slip.decay": number(1.1, "1"),
    }
    found, text = written(numbers)
    values = {name: entry.value for name, entry in numbers.items()}
    expected = pamsim.load_rig("mas20_arm").with_parameters(values)
    assert found.muscles["muscle_2"].hysteresis.law == "maxwell_slip"
    np.testing.assert_allclose(found.model.actuator_user, expected.model.actuator_user, rtol=1e-9)
    assert written(numbers, found.file, "again")[1] == text


def test_values_arrive_to_the_printed_digits_in_the_unit_of_the_file(written):
    wanted = {
        "valve.conductance_fill": (6.123456789e-9, "m^3/(s*Pa)"),
        DEAD: (1.23456789e-5, "m^3"),
        "body.rig.tilt": (-0.0512345678, "rad"),
        "tendon.chain_1.coef": (0.0123456789, "m"),
        "passive.slack_contraction": (-0.0123456789, "1"),
    }
    found, _ = written({name: number(*one) for name, one in wanted.items()})
    assert found.file.muscle["valve"]["conductance_fill"].unit == "dm^3/(s*bar)"
    assert found.file.muscle["chamber"]["dead_volume"].value == pytest.approx(12.3456789, rel=1e-9)
    values = {name: value for name, (value, _) in wanted.items()}
    expected = pamsim.load_rig("mas20_arm").with_parameters(values)
    for part in ("actuator_user", "body_quat", "wrap_prm"):
        one, other = (getattr(rig.model, part) for rig in (found, expected))
        np.testing.assert_allclose(one, other, rtol=1e-9)


def test_what_is_known_of_a_value_goes_with_it_and_not_with_the_next(written):
    before = SOURCE.native["joint.shaft.damping"]
    assert before.interval95 is not None
    assert before.note
    known = {"interval95": (-0.06, -0.04), "bounds": (-0.1, 0.1), "note": "as measured"}
    rig, _ = written(
        {
            "joint.shaft.damping": number(0.7, "N*m*s/rad"),
            "body.rig.tilt": number(-0.05, "rad", **known),
        }
    )
    damping, tilt = (rig.file.native[name] for name in ("joint.shaft.damping", "body.rig.tilt"))
    assert (damping.interval95, damping.note) == (None, "")
    assert (tilt.source, tilt.note) == ("identified by a test", "as measured")
    assert tilt.interval95 == pytest.approx(np.degrees((-0.06, -0.04)), rel=1e-4)
    assert tilt.bounds == pytest.approx(np.degrees((-0.1, 0.1)), rel=1e-4)


def test_everything_else_in_the_file_stays_as_written(written, tmp_path):
    _, text = written({DEAD: volume(2e-5)}, heading="why\nwhen")
    old = (SOURCE.folder / "params.toml").read_text(encoding="utf-8").splitlines()
    new = text.splitlines()
    assert new[:2] == ["# why", "# when"]
    changed = [(a, b) for a, b in zip(old, new[2:], strict=True) if a != b]
    assert [a.split(" ")[0] for a, _ in changed] == ["dead_volume"]
    line = changed[0][1]
    assert line.startswith('dead_volume = { value = 20.0, unit = "cm^3"')
    path = tmp_path / "new" / "params.toml"
    path.write_text(text.replace(line, f"{line}  # measured twice"), encoding="utf-8")
    again, text = written({DEAD: volume(3e-5)}, read_rig(tmp_path / "new"), "again")
    assert "}  # measured twice" in text
    assert again.muscles["muscle_1"].chamber.dead_volume == pytest.approx(3e-5)


def test_parameters_missing_in_the_file_are_added(written, tmp_path):
    assert "threshold" not in SOURCE.muscle
    rig, text = written(
        {
            "threshold.pressure": number(12.0, "kPa"),
            "valve.regulator_dead_band": number(500.0, "Pa"),
            "joint.shaft.frictionloss": number(0.1, "N*m"),
            "sensor.angle_bias": number(-0.5, "deg"),
        }
    )
    assert [m.threshold.pressure for m in rig.muscles.values()] == [12e3, 12e3]
    assert rig.file.muscle["threshold"]["pressure"].unit == "kPa"
    assert rig.muscles["muscle_1"].valve.regulator_dead_band == 500.0
    assert rig.model.joint("shaft").frictionloss[0] == 0.1
    assert rig.sensor.angle_bias == pytest.approx(np.radians(-0.5))
    assert rig.sensor.converter_bits == 14.0
    # And where the rig has no table of sensors yet.
    path = tmp_path / "new" / "params.toml"
    path.write_text(text.split("[sensor]")[0], encoding="utf-8")
    numbers = {"sensor.pressure_scale": number(1.02, "1")}
    assert written(numbers, read_rig(tmp_path / "new"), "again")[0].sensor.pressure_scale == 1.02


def test_one_muscle_may_differ_until_a_shared_value_replaces_its_own(written):
    rig = pamsim.load_rig("mas20_arm")
    for numbers, expected in (
        ({f"muscle_1:{DEAD}": volume(3e-5), DEAD: volume(2e-5)}, [3e-5, 2e-5]),
        ({f"muscle_1:{DEAD}": volume(4e-5)}, [4e-5, 2e-5]),
        ({f"muscle_2:{DEAD}": volume(5e-5)}, [4e-5, 5e-5]),
        ({DEAD: volume(6e-5)}, [6e-5, 6e-5]),
    ):
        rig, text = written(numbers, rig.file, f"step_{expected[0]}_{expected[1]}")
        volumes = [m.chamber.dead_volume for m in rig.muscles.values()]
        assert volumes == pytest.approx(expected)
        assert rig.file.tendons == SOURCE.tendons  # in their order
        assert "# Both muscles are equal" in text


@pytest.mark.parametrize("law", ["bouc_wen", "maxwell_slip"])
def test_an_operators_number_is_written_as_the_rig_takes_it_where_muscles_differ(written, law):
    """Of all muscles or of one; the widths of single muscles stay."""
    field = {"bouc_wen": "yield_contraction", "maxwell_slip": "full_slip"}[law]
    width, shape = f"hysteresis.{law}.force_per_pressure", f"hysteresis.{law}.{field}"
    own = {"muscle_1:hysteresis.force_per_pressure": number(1e-5, "N/Pa")}
    differ, _ = written(own, name="differ")
    for k, name in enumerate((width, f"muscle_2:{width}", shape, f"muscle_1:{shape}")):
        value, unit = (3e-5, "N/Pa") if width in name else (0.02, "1")
        numbers = {name: number(value, unit)}
        found, _ = written(numbers, differ.file, f"new_{k}")
        expected = differ.with_parameters({name: value})
        np.testing.assert_allclose(
            found.model.actuator_user, expected.model.actuator_user, rtol=1e-9, err_msg=name
        )


@pytest.mark.parametrize("owner", ["", "hip_bellows:"])
def test_hysteresis_is_added_to_a_rig_that_states_none(written, owner):
    leg, name = pamsim.load_rig("equimus_leg"), f"{owner}hysteresis.force_share"
    assert "hysteresis" not in leg.file.muscle
    found, _ = written({name: number(0.02, "1")}, leg.file)
    assert same_rig(found, leg.with_parameters({name: 0.02}))


def test_bad_requests_are_refused_in_one_line(tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    new, own = tmp_path / "new", find_rig("mas20_arm")
    bad = {
        "muscle": (new, {f"muscle1:{DEAD}": volume(1.0)}, "did you mean 'muscle_1'"),
        "unit": (new, {DEAD: number(1.0, "kg")}, "dead_volume: unit 'kg' does not measure"),
        "over itself": (own, {}, "the folder it is made from, or inside it"),
        "inside itself": (own / "new", {}, "the folder it is made from, or inside it"),
        "a file": (tmp_path / "file", {}, "cannot write"),
    }
    all_refused(bad, lambda folder, numbers: write_rig(SOURCE, folder, numbers))
