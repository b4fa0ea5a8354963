"""A correction undoes its mistake, in commands, readings and the lead-in; numbers of a rig may."""

import numpy as np
import pytest

from pamsim.comparison.likely_mistakes import least_missed
from pamsim.comparison.trial_corrections import corrections
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import load_rig
from pamsim.recordings.trial import TrialLead
from tests.unit.recordings.made_trial import made_trial

TIME = np.linspace(0.0, 1.0, 11)
SET = np.column_stack([2e5 + 1e5 * TIME, 3e5 - 1e5 * TIME])
READ = {"pressure_1": SET[:, 0] - 1e3, "pressure_2": SET[:, 1] - 2e3}
ANGLE, FORCES = 0.3 * TIME, {"force_1": 500.0 * TIME, "force_2": 300.0 + TIME}


def trial(*, time=TIME, command=SET, drive="pressure_set", pressures=READ, **measured):
    """A trial with a lead-in that holds its first row."""
    read = {**pressures, "angle": ANGLE, **FORCES, **measured}
    lead = TrialLead(
        time=time[:3],
        duration=float(time[3]),
        command=command[:3],
        start_pressure=np.array([pressures["pressure_1"][0], pressures["pressure_2"][0]]),
        measured={channel: values[:3] for channel, values in read.items()},
    )
    return made_trial(command, read, drive=drive, time=time, lead_in=lead)


def of(mistaken, text, missed=("pressure_1", "pressure_2", "angle", "force_1", "force_2")):
    """The correction whose text begins so, applied."""
    (correction,) = (one for one in corrections(mistaken, missed) if one.text.startswith(text))
    return correction.applied(mistaken)


def same(one, other):
    """Whether two trials are the same numbers."""
    assert one.measured.keys() == other.measured.keys()
    pairs = [(one.time, other.time), (one.command, other.command)]
    pairs += [(one.measured[c], other.measured[c]) for c in one.measured]
    leads = one.lead_in, other.lead_in
    assert leads[0].measured.keys() == leads[1].measured.keys()
    pairs += [(values, leads[1].measured[c]) for c, values in leads[0].measured.items()]
    pairs += [tuple(getattr(lead, n) for lead in leads) for n in ("time", "command", "duration")]
    pairs.append(tuple(lead.start_pressure for lead in leads))
    for mine, its in pairs:
        np.testing.assert_allclose(mine, its, rtol=1e-6)


def test_units_of_pressures():
    for unit, in_kpa in (("mbar", 0.1), ("mmHg", 0.1333224), ("psi", 6.894757)):
        read = {channel: values / in_kpa for channel, values in READ.items()}
        command = SET / in_kpa
        looking = f"look like {unit} "
        same(
            of(trial(pressures=read), f"the measured pressures (p1_kpa, p2_kpa) {looking}"), trial()
        )
        same(
            of(trial(command=command), f"the set points (p1_set_kpa, p2_set_kpa) {looking}"),
            trial(),
        )
        both = trial(command=command, pressures=read)
        every = f"all pressures (p1_kpa, p2_kpa, p1_set_kpa, p2_set_kpa) {looking}"
        same(of(both, every), trial())
        one = trial(pressures={**READ, "pressure_2": READ["pressure_2"] / in_kpa})
        corrected = of(one, f"measured pressures (p2_kpa) {looking}", missed=("pressure_2",))
        same(corrected, trial())


def test_absolute_pressures_that_drive_the_rig():
    read = {channel: values + 101325.0 for channel, values in READ.items()}
    command = np.column_stack(list(read.values()))
    right = trial(command=command - 101325.0, drive="measured")
    mistaken = trial(command=command, drive="measured", pressures=read)
    same(of(mistaken, "the measured pressures (p1_kpa, p2_kpa) look absolute"), right)


def test_clock_readings_and_valves():
    kilo, milli = ({c: factor * f for c, f in FORCES.items()} for factor in (1e-3, 1e3))
    for mistaken, text in (
        (trial(time=TIME / 60.0), "time_s looks like minutes"),
        (trial(time=TIME * 1e3), "time_s looks like milliseconds"),
        (trial(angle=np.radians(ANGLE)), "angle_deg looks like rad"),
        (trial(angle=ANGLE / 360.0), "angle_deg looks like turns"),
        (trial(angle=-ANGLE), "the sign of angle_deg looks turned"),
        (trial(**kilo), "force1_n, force2_n look like kN"),
        (trial(**milli), "force1_n, force2_n look like mN"),
    ):
        same(of(mistaken, text), trial())
    valves = np.column_stack([TIME, -TIME])
    right = trial(command=valves, drive="valve")
    same(of(trial(command=-valves, drive="valve"), "the sign of u1, u2 looks turned"), right)


def test_a_clock_that_ticks_a_hundred_times_a_second_is_not_in_minutes():
    def clocks(time):
        return {one.clock for one in corrections(trial(time=time), ()) if one.clock != 1.0}

    ticks = np.arange(11) / 100.0
    assert clocks(ticks) == {0.001}
    assert clocks(ticks / 60.0) == {60.0, 0.001}
    assert clocks(ticks + 1e-4 * ticks**2) == {60.0, 0.001}  # no whole rate


def test_columns_under_each_others_names():
    def exchanged(table, one, two):
        return {**table, one: table[two], two: table[one]}

    read = exchanged(READ, "pressure_1", "pressure_2")
    same(of(trial(pressures=read), "p1_kpa and p2_kpa look swapped"), trial())
    same(of(trial(command=SET[:, ::-1]), "p1_set_kpa and p2_set_kpa look swapped"), trial())
    both = trial(command=SET[:, ::-1], pressures=read)
    text = "p1_set_kpa and p2_set_kpa, and p1_kpa and p2_kpa look swapped"
    same(of(both, text, missed=("angle",)), trial())
    forces = exchanged(FORCES, "force_1", "force_2")
    same(of(trial(**forces), "force1_n and force2_n look swapped"), trial())


def test_muscles_that_are_driven_in_different_ways_are_not_exchanged():
    """Their columns are of different quantities, in this trial or in another one."""
    mixed = trial(drive={"muscle_1": "measured", "muscle_2": "pressure_set"})
    for missed in (("angle",), ("pressure_1", "pressure_2", "angle")):
        found = list(corrections(mixed, missed))
        assert not any("p1" in one.text and "swapped" in one.text for one in found)
        for one in found:
            one.applied(mixed)
    both = next(one for one in corrections(trial(), ("angle",)) if "p1_set_kpa" in one.taken)
    np.testing.assert_array_equal(both.applied(mixed).command[:, 1], mixed.command[:, 1])


def test_readings_that_drive_nothing_are_judged_by_themselves():
    every = ("pressure_1", "pressure_2", "angle", "force_1", "force_2")
    for drive, text, expected in (
        ("pressure_set", "the measured pressures", ["pressure_1", "pressure_2"]),
        ("pressure_set", "all pressures", []),
        ("measured", "the measured pressures", []),
        ("pressure_set", "the sign of angle_deg", ["angle"]),
        ("pressure_set", "force1_n and force2_n look swapped", ["force_1", "force_2"]),
        ("pressure_set", "time_s", []),
    ):
        one = trial(drive=drive)
        found = {tuple(c.reads(one)) for c in corrections(one, every) if c.text.startswith(text)}
        assert found == {tuple(expected)}, (drive, text)


def test_what_is_not_missed_has_no_mistake():
    texts = [one.text for one in corrections(trial(), ("angle",))]
    assert not any("force" in text or text.startswith("the set points") for text in texts)
    assert any(text.startswith("all pressures") for text in texts)


RIG = load_rig("mas20_arm")


def missing(**true):
    """Misses numbers of a rig by their logarithms; ``__`` stands for a point."""

    def missed(rig):
        found = [rig_parameter(rig, name.replace("__", ".")).value for name in true]
        return np.log(np.array(found) / np.array(list(true.values())))

    return missed


def test_a_scale_within_twice_and_valves_within_five_times_are_explained_and_no_more():
    width = rig_parameter(RIG, "valve.conductance_fill").value
    assert least_missed(RIG, missing(force__scale=1.7)) < 1e-3
    assert least_missed(RIG, missing(force__scale=0.6, valve__conductance_fill=4 * width)) < 1e-3
    assert least_missed(RIG, missing(force__scale=6.0)) == pytest.approx(np.log(3.0) ** 2, rel=1e-3)
    assert least_missed(RIG, missing(body__rig__tilt=-0.1)) > 1.0  # is none of them


def test_the_mounting_of_each_muscle_may_be_off_by_itself():
    def missed(rig):
        off = [one.mounting.length_at_zero - 0.25 for one in rig.muscles.values()]
        return 1e3 * (np.array(off) - np.array([0.008, -0.01]))

    assert least_missed(RIG, missed) < 1e-3


def test_a_rig_that_breaks_down_explains_nothing():
    assert least_missed(RIG, lambda _: None) == np.inf

    def only_as_described(rig):
        return np.ones(1) if rig is RIG else None

    assert least_missed(RIG, only_as_described) == pytest.approx(1.0)
