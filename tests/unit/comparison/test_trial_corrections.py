"""A correction undoes its mistake, in commands, readings and the lead-in."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.comparison.trial_corrections import corrections
from pamsim.recordings.trial import Trial, TrialLead

TIME = np.linspace(0.0, 1.0, 11)
SET = np.column_stack([2e5 + 1e5 * TIME, 3e5 - 1e5 * TIME])
READ = {"pressure_1": SET[:, 0] - 1e3, "pressure_2": SET[:, 1] - 2e3}
ANGLE, FORCES = 0.3 * TIME, {"force_1": 500.0 * TIME, "force_2": 300.0 + TIME}


def trial(*, time=TIME, command=SET, drive="pressure_set", pressures=READ, **measured):
    """A trial with a lead-in that holds its first row."""
    return Trial(
        name="a",
        protocol="a",
        drive=drive,
        load=0.0,
        time=time,
        command=command,
        measured={**pressures, "angle": ANGLE, **FORCES, **measured},
        lead_in=TrialLead(
            time=time[:3],
            duration=float(time[3]),
            command=command[:3],
            start_pressure=np.array([pressures["pressure_1"][0], pressures["pressure_2"][0]]),
        ),
    )


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
    pairs += [tuple(getattr(lead, n) for lead in leads) for n in ("time", "command", "duration")]
    pairs.append(tuple(lead.start_pressure for lead in leads))
    for mine, its in pairs:
        np.testing.assert_allclose(mine, its, rtol=1e-6)


@pytest.mark.parametrize(
    ("unit", "in_kpa"), [("mbar", 0.1), ("mmHg", 0.1333224), ("psi", 6.894757)]
)
def test_units_of_pressures(unit, in_kpa):
    read = {channel: values / in_kpa for channel, values in READ.items()}
    mistaken = trial(pressures=read)
    same(of(mistaken, f"the measured pressures (p1_kpa, p2_kpa) look like {unit} "), trial())
    mistaken = trial(command=SET / in_kpa)
    same(of(mistaken, f"the set points (p1_set_kpa, p2_set_kpa) look like {unit} "), trial())
    mistaken = trial(command=SET / in_kpa, pressures=read)
    same(
        of(mistaken, f"all pressures (p1_kpa, p2_kpa, p1_set_kpa, p2_set_kpa) look like {unit} "),
        trial(),
    )
    one = {**READ, "pressure_2": READ["pressure_2"] / in_kpa}
    corrected = of(
        trial(pressures=one),
        f"measured pressures (p2_kpa) look like {unit} ",
        missed=("pressure_2",),
    )
    same(corrected, trial())


def test_absolute_pressures_that_drive_the_rig():
    read = {channel: values + 101325.0 for channel, values in READ.items()}
    command = np.column_stack(list(read.values()))
    right = trial(command=command - 101325.0, drive="measured")
    mistaken = trial(command=command, drive="measured", pressures=read)
    same(of(mistaken, "the measured pressures (p1_kpa, p2_kpa) look absolute"), right)


def test_clock():
    same(of(trial(time=TIME / 60.0), "time_s looks like minutes"), trial())
    same(of(trial(time=TIME * 1e3), "time_s looks like milliseconds"), trial())


def test_readings():
    same(of(trial(angle=np.radians(ANGLE)), "angle_deg looks like rad"), trial())
    same(of(trial(angle=ANGLE / 360.0), "angle_deg looks like turns"), trial())
    same(of(trial(angle=-ANGLE), "the sign of angle_deg looks turned"), trial())
    kilo = {channel: values / 1e3 for channel, values in FORCES.items()}
    same(of(trial(**kilo), "force1_n, force2_n look like kN"), trial())


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


def test_turned_valves():
    valves = np.column_stack([TIME, -TIME])
    right = trial(command=valves, drive="valve")
    same(of(trial(command=-valves, drive="valve"), "the sign of u1, u2 looks turned"), right)


def test_what_is_not_missed_has_no_mistake():
    texts = [one.text for one in corrections(trial(), ("angle",))]
    assert not any("force" in text or text.startswith("the set points") for text in texts)
    assert any(text.startswith("all pressures") for text in texts)
