"""What of a rig makes fits fail is reported, with what is suspected."""

import shutil

import numpy as np
import pytest

from pamsim.diagnosis.about_the_rig import about_the_rig
from pamsim.engine.rig import load_rig
from pamsim.recordings.rig_file import shipped_rigs
from pamsim.recordings.trial import Trial

STOP, REACH, THICK = 1.2, 0.2, 0.02 + 0.010  # angle [rad], distance [m], radius and half a bar [m]


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """The two-joint arm with a stopper on its base that the forearm meets."""
    folder = tmp_path_factory.mktemp("rig") / "arm"
    shutil.copytree(shipped_rigs() / "two_joint_arm", folder)
    mjcf = folder / "two_joint_arm.xml"
    text = mjcf.read_text(encoding="utf-8")
    at = f"{0.3 + REACH * np.cos(STOP)} {REACH * np.sin(STOP)} 0.08"
    touching = 'contype="1" conaffinity="1"'
    stopper = f'<geom name="stopper" type="sphere" size="0.02" pos="{at}" {touching}/>'
    text = text.replace('<body name="upper_arm"', f'{stopper}<body name="upper_arm"')
    text = text.replace('name="fore_bar"', f'name="fore_bar" {touching}')
    mjcf.write_text(text, encoding="utf-8")
    return load_rig(folder)


def report(rig, elbow, rough=(), measured=None):
    """What is said of a rig whose elbow turns while its shoulder stands still."""
    measured = {} if measured is None else {"elbow.angle": measured}
    return of_rig(rig, {"shoulder.angle": 0.0 * elbow, "elbow.angle": elbow}, rough, measured)


def of_rig(rig, simulated, rough=(), measured=None):
    """What is said of a rig by one trial."""
    count = len(next(iter(simulated.values())))
    trial = Trial(
        name="a",
        protocol="a",
        drive="pressure_set",
        load=0.0,
        time=0.01 * np.arange(count),
        command=np.zeros((count, len(rig.muscles))),
        measured=measured or {},
        muscle_names=tuple(rig.muscles),
    )
    return about_the_rig(rig, [trial], {"a": simulated}, dict(rough))


def test_geoms_that_touch_are_named_with_how_often(arm):
    elbow = np.linspace(0.0, STOP, 121)
    often = 100.0 * np.mean(REACH * np.sin(STOP - elbow) < THICK)
    (note,) = report(arm, elbow)
    assert note.startswith(f"stopper and fore_bar touch in {often:.3g} % of the samples: a contact")
    (note,) = report(arm, np.full(50, STOP))
    assert "touch in 100 % of the samples" in note
    (note,) = report(arm, np.linspace(0.0, 1.0, 50))
    assert note.startswith("geoms of the MJCF may touch, though none do here")
    assert report(load_rig("two_joint_arm"), elbow) == ()


def test_muscles_that_move_a_joint_one_way_are_named(tmp_path):
    folder = shutil.copytree(shipped_rigs() / "mas20_arm", tmp_path / "arm")
    mjcf = folder / "mas20_arm.xml"
    right = mjcf.read_text(encoding="utf-8")
    mjcf.write_text(right.replace('coef="-0.0125"', 'coef="0.0125"'), encoding="utf-8")
    still, wrong = {"angle": np.zeros(9)}, load_rig(folder)
    (note,) = of_rig(wrong, still)
    assert note.startswith("muscle_1, muscle_2 move shaft one way, and no spring moves it back")
    for rig in (load_rig("mas20_arm"), wrong.with_parameters({"joint.shaft.stiffness": 1.0})):
        assert of_rig(rig, still) == ()


def test_a_joint_that_begins_further_off_than_it_moves_or_rests_on_a_stop_is_named():
    plain, elbow = load_rig("two_joint_arm"), np.linspace(0.5, 0.7, 20)
    (note,) = report(plain, elbow, measured=elbow - np.radians(40.0))
    assert note.startswith(
        "elbow is +40 deg off at rest, further than it moves: calibrate mounting"
    )
    assert report(plain, elbow, measured=elbow - 0.1) == ()
    low = plain.model.joint("elbow").range[0]
    stopped = np.maximum(np.linspace(low - 0.5, low + 0.5, 40), low)
    free = np.linspace(low + 0.1, low + 0.9, 40)
    (note,) = report(plain, stopped, measured=free)
    assert note.startswith(f"elbow is on its stop at {np.degrees(low):.3g} deg in 50 % of the sim")
    assert report(plain, stopped, measured=stopped) == ()


def test_a_jump_names_what_may_be_behind_it(arm):
    jump = {"elbow.angle": np.radians(0.2)}
    _, note = report(arm, np.linspace(0.0, STOP, 121), jump)
    assert note.startswith("elbow.angle moves by 0.2 deg where the muscles' force changes by 1e-7")
    assert "suspected: stopper and fore_bar touch" in note
    plain = load_rig("two_joint_arm")
    limit = plain.model.joint("elbow").range[1]
    for rig, elbow, suspect in (
        (plain, np.linspace(0.0, limit, 20), "elbow reaches the limit of its range"),
        (plain, np.linspace(0.0, 1.0, 20), "the time step, which may be too long"),
        (plain.with_parameters({"joint.elbow.frictionloss": 0.2}), np.zeros(9), "dry friction"),
        (plain.with_parameters({"chain.backlash": 1e-3}), np.zeros(9), "backlash"),
        (plain.with_parameters({"valve.dead_zone": 0.1}), np.zeros(9), "the dead zone"),
    ):
        (note,) = report(rig, elbow, jump)
        assert f"suspected: {suspect}" in note
