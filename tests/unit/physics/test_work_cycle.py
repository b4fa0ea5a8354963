"""Work of a muscle over that of its air, and what is left out of the volume costs."""

from __future__ import annotations

import dataclasses

import pytest

from pamsim.papers.antagonistic_pair import ideal_muscle, rig_muscle
from pamsim.physics import static_muscle
from pamsim.physics.record import pack, parameters
from pamsim.physics.tension import taut
from tests.unit.physics.flat import work_ratio

PRESSURE, CONTRACTION = 4.87e5, 0.0316


def ratio(muscle, pressure=PRESSURE):
    return work_ratio(pack(muscle).tolist(), pressure, CONTRACTION)


def changed(group, **values):
    muscle = rig_muscle()
    return dataclasses.replace(
        muscle, **{group: dataclasses.replace(getattr(muscle, group), **values)}
    )


def test_the_rig_s_muscle_gives_the_work_of_its_air():
    assert ratio(rig_muscle()) == pytest.approx(1.0, abs=1e-5)
    assert ratio(ideal_muscle()) == pytest.approx(1.0, abs=1e-5)


def test_with_the_braid_s_volume_the_earlier_calibration_gave_a_third_more(monkeypatch):
    """Pressure acted less on a stretched muscle, and did not lengthen it."""
    earlier = changed("force", a=-45.82e-5)
    braid = dataclasses.replace(earlier.braid, extensibility=0.0)
    spring = dataclasses.replace(earlier.passive, softening=10.0)
    earlier = dataclasses.replace(earlier, braid=braid, passive=spring)
    ideal = parameters(ideal_muscle())
    shift = ideal_muscle().mounting.length_at_zero - rig_muscle().mounting.length_at_zero
    law = static_muscle.static_volume
    monkeypatch.setattr(
        static_muscle,
        "static_volume",
        lambda _, tendon, pressure: law(ideal, tendon - shift, pressure),
    )
    assert ratio(earlier) == pytest.approx(1.33, abs=0.005)


def test_a_threshold_costs_its_pressure_over_the_stroke():
    """Its volume is right above the threshold; a cycle that goes below does not get it back."""
    stiff = changed("braid", extensibility=0.0)
    for threshold in (1.5e4, 5e4):
        lost = dataclasses.replace(stiff.threshold, pressure=threshold)
        found = ratio(dataclasses.replace(stiff, threshold=lost))
        assert found == pytest.approx(1.0 - threshold / PRESSURE, abs=1e-3)


def test_a_braid_that_lengthens_gives_the_work_of_its_air():
    assert ratio(changed("braid", extensibility=2e-8)) == pytest.approx(1.0, abs=1e-5)


def test_ends_that_lose_force_lose_volume_with_it():
    assert ratio(changed("end_shape", loss=0.5, onset=0.01)) == pytest.approx(1.0, abs=1e-5)


def test_a_slack_muscle_does_not_carry_the_energy_of_its_rubber(monkeypatch):
    """The number that `taut` states."""
    law = static_muscle.static_force
    monkeypatch.setattr(static_muscle, "static_force", lambda *place: taut(law(*place)))
    assert ratio(rig_muscle()) == pytest.approx(0.94, abs=0.005)
