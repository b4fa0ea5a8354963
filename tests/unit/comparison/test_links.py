"""Which links the measured channels of a trial separate, and which trials are repeats."""

from dataclasses import replace

import numpy as np

from pamsim.comparison.links import (
    JOINT,
    MUSCLE,
    PARTS,
    VALVES,
    Link,
    in_links,
    joined_runs,
    link_runs,
    whole_run,
)
from pamsim.comparison.repeats import protocols_by_load, repeats
from pamsim.engine.rig import load_rig
from pamsim.recordings.trial import TrialLead, of_rig
from tests.unit.recordings.made_trial import made_trial

ARM = load_rig("mas20_arm")
PRESSURES = ("pressure_1", "pressure_2")
FORCES = ("force_1", "force_2")


def trial(*channels, drive="pressure_set", columns=2, muscles=()):
    read = dict.fromkeys(channels, np.full(5, 1e5))
    return made_trial(np.full((5, columns), 1e5), read, drive=drive, muscle_names=muscles)


def separated(*channels, rig=ARM, **settings):
    own, _ = of_rig(trial(*channels, **settings), rig.names, rig.name)
    return [(run.link.parts, run.outputs) for run in link_runs(rig, own)]


def test_links_end_where_signals_are_measured():
    air, muscle, joint = ((VALVES,), PRESSURES), ((MUSCLE,), FORCES), ((JOINT,), ("angle",))
    arm = ((MUSCLE, JOINT), ("angle",))
    for channels, links in (
        ((*PRESSURES, *FORCES, "angle"), [air, muscle, joint]),
        ((*PRESSURES, "angle"), [air, arm]),
        (("angle",), [(PARTS, ("angle",))]),
        ((*FORCES, "angle"), [((VALVES, MUSCLE), FORCES), joint]),
        ((*PRESSURES, *FORCES), [(PARTS, PRESSURES), ((MUSCLE, JOINT), FORCES)]),
        # One of two sensors separates nothing that both muscles act on.
        (("pressure_1", "angle"), [(PARTS, ("pressure_1",)), (PARTS, ("angle",))]),
        ((*PRESSURES, "force_1", "angle"), [air, ((MUSCLE,), ("force_1",)), arm]),
    ):
        assert separated(*channels) == links
    # Measured pressures that drive are an input alone.
    assert separated(*PRESSURES, *FORCES, "angle", drive="measured") == [muscle, joint]


def test_forces_leave_the_joined_link_and_the_whole_chain_has_but_what_drives_imposed():
    channels = (*PRESSURES, *FORCES, "angle")
    own, _ = of_rig(trial(*channels), ARM.names, ARM.name)
    parts = [run.link.parts for run in joined_runs(ARM, own)]
    assert parts == [(VALVES,), (MUSCLE,), (JOINT,), (MUSCLE, JOINT)]
    for drive, parts in (("pressure_set", PARTS), ("measured", PARTS[1:])):
        own, _ = of_rig(trial(*channels, drive=drive), ARM.names, ARM.name)
        (run,) = whole_run(ARM, own)
        assert (run.link.parts, run.moved) == (parts, ())
        assert run.outputs == (*(PRESSURES if drive == "pressure_set" else ()), *FORCES, "angle")


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


def test_names_of_several_links_stay_apart_in_a_sentence():
    assert in_links(["muscle"]) == "in muscle"
    between = in_links(["muscle and joint", "joint and transmission"])
    assert between == "in muscle and joint, and in joint and transmission"


def test_repeats_have_one_protocol_command_load_and_clock():
    a = trial("angle")
    b, c = replace(a, name="b"), replace(a, name="c")
    others = [
        replace(a, name="ramps", protocol="ramps"),
        replace(a, name="loaded", load=1.0),
        replace(a, name="commanded", command=1.1 * a.command),
        replace(a, name="slower", time=2.0 * a.time),
    ]
    late = a.time + 1792012500.37  # differences of such times are not equal to the last bit
    late = replace(a, name="late", time=late - late[0])
    found = [[t.name for t in group.trials] for group in repeats([a, b, *others, c, late])]
    assert found == [["one", "b", "c", "late"], ["ramps"], ["loaded"], ["commanded"], ["slower"]]


def test_periods_of_a_log_are_repeats_where_what_precedes_them_is():
    a = trial("angle")
    lead = TrialLead(
        time=a.time, duration=0.05, command=a.command, start_pressure=np.array([1e5, 3e5])
    )
    other = replace(lead, start_pressure=np.array([2e5, 3e5]))
    two = [replace(a, name=name, lead_in=own) for name, own in (("b", lead), ("c", other))]
    (group,) = repeats(two)
    assert group.mean().lead_in.start_pressure.tolist() == [1.5e5, 3e5]
    for changed in (
        None,
        replace(lead, command=1.1 * a.command),
        replace(lead, duration=0.06),
        replace(lead, time=a.time[:4], command=a.command[:4]),
    ):
        assert len(repeats([two[0], replace(two[1], lead_in=changed)])) == 2


def test_the_mean_of_repeats_is_that_of_what_was_measured_and_of_what_was_imposed():
    """Measured pressures that drive may differ, by their noise."""
    one = trial("angle", drive="measured")
    other = replace(
        one, name="b", command=1.02 * one.command, measured={"angle": 3.0 * one.measured["angle"]}
    )
    (group,) = repeats([one, other])
    mean = group.mean()
    assert mean.name == group.name == "one"
    np.testing.assert_allclose(mean.command, 1.01e5)
    np.testing.assert_allclose(mean.measured["angle"], 2e5)


def test_what_is_imposed_repeats_within_its_noise_and_what_machines_repeat_to():
    rng = np.random.default_rng(0)
    turned = {"muscle_1": "measured", "muscle_2": "pressure_set", "shaft": "angle"}

    def imposed(name, pressure, angle, noise=1e-3):
        read = trial("torque", drive=turned, columns=3)
        time = np.arange(500) / 100.0
        command = np.tile([pressure, 2e5, angle], (500, 1))
        command[:, ::2] += rng.normal(0.0, [500.0, noise], (500, 2))
        return replace(read, name=name, time=time, command=command, measured={"torque": time})

    trials = [
        imposed("one", 1e5, 0.0),
        imposed("again", 1.01e5, 0.0),
        imposed("filled", 3e5, 0.0),
        imposed("turned", 1e5, 0.2),
        imposed("noisy", 1e5, 0.2, noise=0.2),  # which may be any of them
    ]
    found = [[t.name for t in group.trials] for group in repeats(trials)]
    assert found == [["one", "again", "noisy"], ["filled"], ["turned"]]


def test_trials_of_a_protocol_with_several_loads_are_repeats_at_each_of_them():
    light, other = trial("angle"), replace(trial("angle"), name="other", protocol="other")
    heavy = replace(light, name="heavy", load=1.2)
    assert protocols_by_load([light, other]) == {"one": "one", "other": "other"}
    found = protocols_by_load([light, heavy, other])
    assert found == {"one": "one, 0 kg", "heavy": "one, 1.2 kg", "other": "other"}
