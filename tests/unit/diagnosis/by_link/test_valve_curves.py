"""A learned change of the valves' flow: over which openings, of which rigs, and what it adds."""

import numpy as np
import pytest

import pamsim
from pamsim.comparison.links import VALVES
from pamsim.diagnosis.by_link.learned_curve import ALL_VALVES, Kind
from pamsim.diagnosis.by_link.valve_curves import valve_place
from pamsim.physics.valves import flow_share
from pamsim.recordings.trial import Trial
from tests.unit.diagnosis.by_link.known_errors import KnownErrors

TIME = np.linspace(0.0, 5.0, 200)
OPENED = np.column_stack([-0.7 * np.sin(TIME), np.full(TIME.size, 0.2)])


def commanded(drive, command=OPENED):
    return Trial(
        name=drive, protocol=drive, drive=drive, load=0.0, time=TIME, command=command, measured={}
    )


def test_its_curve_runs_over_the_openings_commanded_or_all_of_a_regulator():
    rig = pamsim.load_rig("mas20_arm")
    opened = valve_place(rig, [commanded("valve")])
    assert (opened.low, opened.high) == pytest.approx((-0.7, 0.7), abs=1e-3)
    beyond = valve_place(rig, [commanded("valve", 9.0 * OPENED)])
    assert (beyond.low, beyond.high) == (-1.0, 1.0)
    regulated = valve_place(rig, [commanded("valve"), commanded("pressure_set", 1e5 + OPENED)])
    assert (regulated.low, regulated.high) == (-1.0, 1.0)
    for shut in ("pulse", "measured"):
        assert valve_place(rig, [commanded(shut)]) is None
    assert valve_place(rig, [commanded("valve"), commanded("pulse")]) is None


def test_it_is_a_share_of_the_flow_of_all_valves():
    rig = pamsim.load_rig("mas20_arm")
    valves = valve_place(rig, [commanded("valve")])
    assert [kind for kind in Kind if valves.controls(kind)] == [Kind.FLOW]
    assert Kind.FLOW.parts == (VALVES,)
    values = {name: 0.1 * k for k, name in enumerate(valves.controls(Kind.FLOW))}
    learned = rig.with_parameters({**valves.ends([Kind.FLOW]), **values})
    (curve,) = valves.curves([Kind.FLOW], values, KnownErrors())
    assert curve.acts_at == ALL_VALVES
    shares = [flow_share(learned.muscles["muscle_2"].valve, one) for one in curve.at.tolist()]
    assert curve.at * (1.0 + curve.value) == pytest.approx(shares)
    assert valve_place(learned, [commanded("valve")]) is None  # what was learned before stays
