"""Which links the measured channels of a trial separate."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.comparison.links import (
    JOINT,
    MUSCLE,
    PARTS,
    VALVES,
    Link,
    joined_runs,
    link_runs,
    whole_run,
)
from pamsim.engine.rig import load_rig
from pamsim.recordings.trial import Trial, of_rig

ARM = load_rig("mas20_arm")
PRESSURES = ("pressure_1", "pressure_2")
FORCES = ("force_1", "force_2")


def trial(*channels, drive="pressure_set", columns=2, muscles=()):
    flat = np.full(5, 1e5)
    return Trial(
        name="one",
        protocol="one",
        drive=drive,
        load=0.0,
        time=np.arange(5) / 100.0,
        command=np.full((5, columns), 1e5),
        measured=dict.fromkeys(channels, flat),
        muscle_names=muscles,
    )


def separated(*channels, rig=ARM, **settings):
    own, _ = of_rig(trial(*channels, **settings), rig.names, rig.name)
    return [(run.link.parts, run.outputs) for run in link_runs(rig, own)]


@pytest.mark.parametrize(
    ("channels", "links"),
    [
        (
            (*PRESSURES, *FORCES, "angle"),
            [((VALVES,), PRESSURES), ((MUSCLE,), FORCES), ((JOINT,), ("angle",))],
        ),
        ((*PRESSURES, "angle"), [((VALVES,), PRESSURES), ((MUSCLE, JOINT), ("angle",))]),
        (("angle",), [(PARTS, ("angle",))]),
        ((*FORCES, "angle"), [((VALVES, MUSCLE), FORCES), ((JOINT,), ("angle",))]),
        ((*PRESSURES, *FORCES), [(PARTS, PRESSURES), ((MUSCLE, JOINT), FORCES)]),
        # One of two sensors separates nothing that both muscles act on.
        (("pressure_1", "angle"), [(PARTS, ("pressure_1",)), (PARTS, ("angle",))]),
        (
            (*PRESSURES, "force_1", "angle"),
            [((VALVES,), PRESSURES), ((MUSCLE,), ("force_1",)), ((MUSCLE, JOINT), ("angle",))],
        ),
    ],
)
def test_links_end_where_signals_are_measured(channels, links):
    assert separated(*channels) == links


def test_forces_leave_the_joined_link_beside_its_parts():
    own, _ = of_rig(trial(*PRESSURES, *FORCES, "angle"), ARM.names, ARM.name)
    parts = [run.link.parts for run in joined_runs(ARM, own)]
    assert parts == [(VALVES,), (MUSCLE,), (JOINT,), (MUSCLE, JOINT)]


@pytest.mark.parametrize(("drive", "parts"), [("pressure_set", PARTS), ("measured", PARTS[1:])])
def test_in_the_whole_chain_nothing_is_imposed_but_what_drives(drive, parts):
    own, _ = of_rig(trial(*PRESSURES, *FORCES, "angle", drive=drive), ARM.names, ARM.name)
    (run,) = whole_run(ARM, own)
    assert (run.link.parts, run.moved) == (parts, ())
    assert run.outputs == (*(PRESSURES if drive == "pressure_set" else ()), *FORCES, "angle")


def test_measured_pressures_that_drive_are_an_input_alone():
    found = separated(*PRESSURES, *FORCES, "angle", drive="measured")
    assert found == [((MUSCLE,), FORCES), ((JOINT,), ("angle",))]


def test_a_joint_that_a_machine_moves_gives_what_that_takes():
    bench = load_rig("muscle_bench")
    drive = {"muscle": "pressure_set", "rod": "length"}
    channels = ("muscle.pressure", "rod.force", "rod.position")
    settings = {"rig": bench, "drive": drive, "muscles": ("muscle",)}
    found = separated(*channels, **settings)
    assert found == [((VALVES,), ("muscle.pressure",)), ((MUSCLE, JOINT), ("rod.force",))]
    found = separated(*channels, "muscle.force", **settings)
    assert found[1:] == [((MUSCLE,), ("muscle.force",)), ((JOINT,), ("rod.force",))]


def test_every_joint_is_simulated_while_the_others_are_moved():
    rig = load_rig("two_joint_arm")
    channels = (*rig.names.of_muscles("pressure"), *rig.names.joint_channels)
    read = trial(*channels, columns=4, muscles=tuple(rig.muscles))
    own, _ = of_rig(read, rig.names, rig.name)
    air, shoulder, elbow = link_runs(rig, own)
    assert air.moved == ("shoulder", "elbow")
    assert (shoulder.outputs, shoulder.moved) == (("shoulder.angle",), ("elbow",))
    assert (elbow.outputs, elbow.moved) == (("elbow.angle",), ("shoulder",))


def test_links_are_sorted_from_the_command_on():
    links = [Link((JOINT,)), Link((MUSCLE, JOINT)), Link(PARTS), Link((MUSCLE,)), Link((VALVES,))]
    names = [link.name for link in sorted(links, key=lambda link: link.order)]
    assert names == [
        "valves and air", "muscle", "whole chain", "muscle and joint", "joint and transmission"
    ]  # fmt: skip
