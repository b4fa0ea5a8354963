"""Recordings of any rig: columns named after joints and muscles, in any order."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.recordings.recording import write_recording
from pamsim.recordings.recording_reader import read_recordings
from pamsim.recordings.signals import SignalNames, column_of, kind_of
from pamsim.recordings.trial import of_rig
from tests.unit.recordings.drawn_recording import drawn_recording

LEG = SignalNames(joints={"knee": "angle", "rail": "position"}, muscles=("front", "back", "calf"))
ARM = SignalNames(joints={"shaft": "angle"}, muscles=("muscle_1", "muscle_2"))


def recording(names=LEG, kind="pressure_set"):
    return drawn_recording(names, kind)


@pytest.mark.parametrize("kind", ["pressure_set", "valve", "pulse"])
def test_what_a_rig_with_several_joints_wrote_is_read_under_its_names(tmp_path, kind):
    run = recording(kind=kind)
    write_recording(tmp_path, "my_leg", {"walk_1": run})
    found = read_recordings(tmp_path)
    (trial,) = found.trials
    assert found.notes == ()
    assert trial.muscle_names == ("front", "back", "calf")
    np.testing.assert_allclose(trial.command, run.command, rtol=1e-8)
    assert set(trial.measured) == set(run.signals())
    for channel, values in run.signals().items():
        np.testing.assert_allclose(trial.measured[channel], values, rtol=1e-8, err_msg=channel)
    assert trial.pressure_channels == ("front.pressure", "back.pressure", "calf.pressure")
    assert {"knee_deg", "rail_mm", "calf_kpa", "calf_n"} <= run.columns().keys()


def test_the_order_of_columns_does_not_matter(tmp_path):
    run = recording()
    write_recording(tmp_path, "my_leg", {"walk_1": run})
    path = tmp_path / "walk_1.csv"
    rows = [line.split(",") for line in path.read_text().splitlines()]
    path.write_text("\n".join(",".join(reversed(row)) for row in rows) + "\n")
    (trial,) = read_recordings(tmp_path).trials
    assert trial.muscle_names == ("calf", "back", "front")
    bound, notes = of_rig(trial, LEG, "my_leg")
    assert notes == ()
    np.testing.assert_allclose(bound.command, run.command, rtol=1e-8)
    for channel, values in run.signals().items():
        np.testing.assert_allclose(bound.measured[channel], values, rtol=1e-8, err_msg=channel)


def test_names_of_a_rig_with_one_joint_mean_its_short_forms(tmp_path):
    run = recording(ARM)
    write_recording(tmp_path, "mas20_arm", {"turn_1": run})
    text = (tmp_path / "turn_1.csv").read_text()
    for old, new in (
        ("p1_", "muscle_1_"), ("p2_", "muscle_2_"), ("angle_deg", "shaft_deg"),
        ("force1_n", "muscle_1_n"), ("force2_n", "muscle_2_n"),
    ):  # fmt: skip
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "turn_1.csv").write_text(text)
    bound, notes = of_rig(read_recordings(tmp_path).trials[0], ARM, "mas20_arm")
    assert (bound.muscle_names, notes) == ((), ())
    assert set(bound.measured) == {"angle", "pressure_1", "pressure_2", "force_1", "force_2"}
    np.testing.assert_allclose(bound.measured["force_2"], run.tension[:, 1], rtol=1e-8)


def read(tmp_path, *changes, run=None):
    write_recording(tmp_path, "my_leg", {"walk_1": run or recording()})
    path = tmp_path / "walk_1.csv"
    text = path.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    return read_recordings(tmp_path).trials[0]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            [("calf_set_kpa", "toe_set_kpa"), ("calf_kpa", "toe_kpa")],
            "rig 'my_leg' has no muscle 'toe'",
        ),
        ([("rail_mm", "rail_deg")], "'rail' of rig 'my_leg' slides; give its column in mm"),
        ([("knee_deg", "knee_mm")], "'knee' of rig 'my_leg' turns; give its column in deg"),
    ],
)
def test_what_the_rig_does_not_have_is_refused_by_name(tmp_path, changes, words):
    with pytest.raises(InputError, match=words):
        of_rig(read(tmp_path, *changes), LEG, "my_leg")


def test_a_joint_that_the_rig_does_not_record_is_noted(tmp_path):
    bound, notes = of_rig(read(tmp_path, ("knee_deg", "hip_deg")), LEG, "my_leg")
    assert "knee.angle" not in bound.measured
    assert notes == (
        "walk_1: hip.angle is not used: rig 'my_leg' records knee, rail, front, back, calf",
    )


def test_an_angle_without_a_name_is_refused_where_there_are_several(tmp_path):
    trial = read(tmp_path, run=recording(ARM))
    three = SignalNames(joints=LEG.joints, muscles=LEG.muscles[:2])
    with pytest.raises(InputError, match=r"which joint .* is angle_deg\? Name the column knee_deg"):
        of_rig(trial, three, "my_leg")
    with pytest.raises(InputError, match="is of 2 muscles, rig 'my_leg' has 3"):
        of_rig(trial, LEG, "my_leg")


def test_names_and_units_are_checked(tmp_path):
    run = recording()
    with pytest.raises(InputError, match="did you mean 'calf_kpa'"):
        read(tmp_path, ("calf_kpa", "calff_kpa"))
    wide = dataclasses.replace(run, positions=run.positions * 100.0)
    with pytest.raises(InputError, match=r"knee_deg = .* is more than a turn"):
        read(tmp_path, run=wide)
    bar = dataclasses.replace(
        run, command=np.full_like(run.command, 3e5), pressure=np.full_like(run.pressure, 3e3)
    )
    with pytest.raises(InputError, match="front_kpa looks like bar"):
        read(tmp_path, run=bar)


@pytest.mark.parametrize(
    ("channel", "column", "kind"),
    [
        ("angle", "angle_deg", "angle"),
        ("pressure_2", "p2_kpa", "pressure"),
        ("force_1", "force1_n", "force"),
        ("left_knee.angle", "left_knee_deg", "angle"),
        ("calf.force", "calf_n", "force"),
        ("rail.position", "rail_mm", "position"),
    ],
)
def test_every_channel_has_its_column(channel, column, kind):
    assert (column_of(channel), kind_of(channel)) == (column, kind)


@pytest.mark.parametrize("name", ["p1", "u2", "calf_set"])
def test_a_muscle_whose_columns_would_be_ambiguous_is_refused(name):
    with pytest.raises(InputError, match=f"muscle '{name}': the column {name}_kpa could mean"):
        SignalNames(joints=LEG.joints, muscles=("front", name))
    assert SignalNames(joints=ARM.joints, muscles=("front", name)).short


@pytest.mark.parametrize("names", [LEG, ARM], ids=["by name", "by number"])
def test_a_drive_for_each_muscle_is_read_as_it_was_written(tmp_path, names):
    run = recording(names)
    kinds = ("pressure_set", "measured", "sealed")[: len(names.muscles)]
    command = np.column_stack([run.command[:, 0], run.pressure[:, 1], np.zeros(len(run.time))])
    drive = dict(zip(names.muscles, kinds, strict=True))
    mixed = dataclasses.replace(run, drive=drive, command=command[:, : len(kinds)])
    write_recording(tmp_path, "my_leg", {"walk_1": mixed})
    (trial,) = read_recordings(tmp_path).trials
    assert trial.drive == drive
    np.testing.assert_allclose(trial.command, mixed.command, rtol=1e-8)
    bound, _ = of_rig(trial, names, "my_leg")
    np.testing.assert_allclose(bound.command, mixed.command, rtol=1e-8)
    assert bound.drive == drive
    other = SignalNames(joints=names.joints, muscles=names.muscles[::-1])
    if names.short:
        with pytest.raises(InputError, match="in that order"):
            of_rig(trial, other, "other")
        return
    turned, _ = of_rig(trial, other, "other")
    np.testing.assert_allclose(turned.command, mixed.command[:, ::-1], rtol=1e-8)
    assert turned.drive == {name: drive[name] for name in other.muscles}


def test_a_muscle_that_is_not_named_in_the_drive_is_missed(tmp_path):
    write_recording(tmp_path, "my_leg", {"walk_1": recording()})
    index = tmp_path / "recording.toml"
    stated = 'drive = { front = "pressure_set", back = "pressure_set" }'
    index.write_text(index.read_text().replace('drive = "pressure_set"', stated))
    (trial,) = read_recordings(tmp_path).trials
    with pytest.raises(InputError, match="2 muscles, rig 'leg' has 3"):
        of_rig(trial, LEG, "leg")


@pytest.mark.parametrize("names", [LEG, ARM], ids=["by name", "by number"])
@pytest.mark.parametrize("turned", ["torque", "angle"])
def test_what_drives_joints_is_read_as_it_was_written(tmp_path, names, turned):
    """A given torque is no measurement; what an imposed motion takes is one."""
    run = recording(names, "valve")
    joints = dict(zip(names.joints, (turned, "length"), strict=False))
    draw = np.random.default_rng(3)
    effort = {joint: draw.uniform(-20.0, 20.0, len(run.time)) for joint in joints}
    driven = [
        effort[joint] if kind == "torque" else run.positions[:, list(names.joints).index(joint)]
        for joint, kind in joints.items()
    ]
    drive = {**dict.fromkeys(names.muscles, "valve"), **joints}
    command = np.column_stack([run.command, *driven])
    done = dataclasses.replace(run, drive=drive, command=command, effort=effort)
    write_recording(tmp_path, "my_leg", {"walk_1": done})
    (trial,) = read_recordings(tmp_path).trials
    bound, notes = of_rig(trial, names, "my_leg")
    assert (bound.drive, notes) == (drive, ())
    np.testing.assert_allclose(bound.command, command, rtol=1e-8)
    shown = "torque" if names.short else "knee.torque"
    assert done.columns()["torque_nm" if names.short else "knee_nm"] is effort[next(iter(joints))]
    assert (shown in bound.measured) == (turned == "angle")
    if not names.short:
        np.testing.assert_allclose(bound.measured["rail.force"], effort["rail"], rtol=1e-8)
    if turned == "angle":
        np.testing.assert_allclose(bound.measured[shown], effort[next(iter(joints))], rtol=1e-8)
