"""Recordings of any rig: columns named after joints and muscles, in any order."""

import dataclasses

import numpy as np
import pytest

from pamsim.recordings.recording import write_recording
from pamsim.recordings.recording_reader import read_recordings
from pamsim.recordings.signals import SignalNames, column_of, kind_of
from pamsim.recordings.trial import of_rig
from tests.unit.core.refusals import all_refused, refused
from tests.unit.recordings.drawn_recording import drawn_recording

LEG = SignalNames(joints={"knee": "angle", "rail": "position"}, muscles=("front", "back", "calf"))
ARM = SignalNames(joints={"shaft": "angle"}, muscles=("muscle_1", "muscle_2"))
RUN = drawn_recording(LEG, "pressure_set")


@pytest.fixture
def read(tmp_path):
    def read_written(*changes, run=RUN, edit=lambda text: text):
        """The trial of a recording whose table is changed on disk."""
        write_recording(tmp_path, "my_leg", {"walk_1": run})
        path = tmp_path / "walk_1.csv"
        text = edit(path.read_text())
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        path.write_text(text)
        return read_recordings(tmp_path).trials[0]

    return read_written


def same_signals(trial, run):
    np.testing.assert_allclose(trial.command, run.command, rtol=1e-8)
    assert set(trial.measured) == set(run.signals())
    for channel, values in run.signals().items():
        np.testing.assert_allclose(trial.measured[channel], values, rtol=1e-8, err_msg=channel)


@pytest.mark.parametrize("kind", ["pressure_set", "valve", "pulse"])
def test_what_a_rig_with_several_joints_wrote_is_read_under_its_names(read, kind):
    run = drawn_recording(LEG, kind)
    trial = read(run=run)
    assert trial.muscle_names == ("front", "back", "calf")
    same_signals(trial, run)
    assert trial.pressure_channels == ("front.pressure", "back.pressure", "calf.pressure")
    assert {"knee_deg", "rail_mm", "calf_kpa", "calf_n"} <= run.columns().keys()


def test_the_order_of_columns_does_not_matter(read):
    def backwards(text):
        return "\n".join(",".join(row.split(",")[::-1]) for row in text.splitlines()) + "\n"

    trial = read(edit=backwards)
    assert trial.muscle_names == ("calf", "back", "front")
    bound, notes = of_rig(trial, LEG, "my_leg")
    assert notes == ()
    same_signals(bound, RUN)


def test_names_of_a_rig_with_one_joint_mean_its_short_forms(read):
    run = drawn_recording(ARM, "pressure_set")
    trial = read(
        ("p1_", "muscle_1_"),
        ("p2_", "muscle_2_"),
        ("angle_deg", "shaft_deg"),
        ("force1_n", "muscle_1_n"),
        ("force2_n", "muscle_2_n"),
        run=run,
    )
    bound, notes = of_rig(trial, ARM, "mas20_arm")
    assert (bound.muscle_names, notes) == ((), ())
    assert set(bound.measured) == {"angle", "pressure_1", "pressure_2", "force_1", "force_2"}
    same_signals(bound, run)


def test_what_the_rig_does_not_have_is_refused_by_name_or_noted(read):
    own = {
        "muscle": ([("calf_set", "toe_set"), ("calf_kpa", "toe_kpa")], "has no muscle 'toe'"),
        "slides": ([("rail_mm", "rail_deg")], "'rail' of rig 'my_leg' slides; give its column in"),
        "turns": ([("knee_deg", "knee_mm")], "'knee' of rig 'my_leg' turns; give its column in"),
    }
    all_refused(own, lambda changes: of_rig(read(*changes), LEG, "my_leg"))
    bound, notes = of_rig(read(("knee_deg", "hip_deg")), LEG, "my_leg")
    assert "knee.angle" not in bound.measured
    assert notes == (
        "walk_1: hip.angle is not used: rig 'my_leg' records knee, rail, front, back, calf",
    )
    one = read(run=drawn_recording(ARM, "pressure_set"))
    with refused("angle_deg may be any joint", "name the column knee_deg"):
        of_rig(one, SignalNames(joints=LEG.joints, muscles=LEG.muscles[:2]), "my_leg")
    with refused("is of 2 muscles, rig 'my_leg' has 3"):
        of_rig(one, LEG, "my_leg")


def test_names_and_units_are_checked(read):
    high, low = np.full_like(RUN.command, 3e5), np.full_like(RUN.pressure, 3e3)
    with refused("did you mean 'calf_kpa'"):
        read(("calf_kpa", "calff_kpa"))
    with refused("knee_deg = ", " is more than a turn"):
        read(run=dataclasses.replace(RUN, positions=RUN.positions * 100.0))
    with refused("front_kpa looks like bar"):
        read(run=dataclasses.replace(RUN, command=high, pressure=low))
    for name in ("p1", "u2", "calf_set"):
        with refused(f"muscle '{name}': the column {name}_kpa could mean"):
            SignalNames(joints=LEG.joints, muscles=("front", name))
        assert SignalNames(joints=ARM.joints, muscles=("front", name)).short


def test_every_channel_has_its_column():
    for channel, column, kind in (
        ("angle", "angle_deg", "angle"),
        ("pressure_2", "p2_kpa", "pressure"),
        ("force_1", "force1_n", "force"),
        ("left_knee.angle", "left_knee_deg", "angle"),
        ("calf.force", "calf_n", "force"),
        ("rail.position", "rail_mm", "position"),
    ):
        assert (column_of(channel), kind_of(channel)) == (column, kind)


@pytest.mark.parametrize("names", [LEG, ARM], ids=["by name", "by number"])
def test_a_drive_for_each_muscle_is_read_as_it_was_written(read, tmp_path, names):
    run = drawn_recording(names, "pressure_set")
    kinds = ("pressure_set", "measured", "sealed")[: len(names.muscles)]
    command = np.column_stack([run.command[:, 0], run.pressure[:, 1], np.zeros(len(run.time))])
    drive = dict(zip(names.muscles, kinds, strict=True))
    mixed = dataclasses.replace(run, drive=drive, command=command[:, : len(kinds)])
    trial = read(run=mixed)
    bound, _ = of_rig(trial, names, "my_leg")
    for one in (trial, bound):
        assert one.drive == drive
        np.testing.assert_allclose(one.command, mixed.command, rtol=1e-8)
    other = SignalNames(joints=names.joints, muscles=names.muscles[::-1])
    if names.short:
        with refused("in the same order"):
            of_rig(trial, other, "other")
        return
    turned, _ = of_rig(trial, other, "other")
    np.testing.assert_allclose(turned.command, mixed.command[:, ::-1], rtol=1e-8)
    assert turned.drive == {name: drive[name] for name in other.muscles}
    index = tmp_path / "recording.toml"
    missing = index.read_text().replace(', "calf" = "sealed"', "")
    assert missing != index.read_text()
    index.write_text(missing)
    with refused("2 muscles, rig 'leg' has 3"):
        of_rig(read_recordings(tmp_path).trials[0], LEG, "leg")


@pytest.mark.parametrize("names", [LEG, ARM], ids=["by name", "by number"])
@pytest.mark.parametrize("turned", ["torque", "angle"])
def test_what_drives_joints_is_read_as_it_was_written(read, tmp_path, names, turned):
    """A given torque is no measurement; what an imposed motion takes is one."""
    run = drawn_recording(names, "valve")
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
    bound, notes = of_rig(read(run=done), names, "my_leg")
    assert (bound.drive, notes, read_recordings(tmp_path).notes) == (drive, (), ())
    np.testing.assert_allclose(bound.command, command, rtol=1e-8)
    column, shown = ("torque_nm", "torque") if names.short else ("knee_nm", "knee.torque")
    first = effort[next(iter(joints))]
    assert done.columns()[column] is first
    assert (shown in bound.measured) == (turned == "angle")
    if not names.short:
        np.testing.assert_allclose(bound.measured["rail.force"], effort["rail"], rtol=1e-8)
    if turned == "angle":
        np.testing.assert_allclose(bound.measured[shown], first, rtol=1e-8)
