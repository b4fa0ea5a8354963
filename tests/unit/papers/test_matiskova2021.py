"""Matiskova 2021, recomputed: the claims' form and the checked numbers."""

from __future__ import annotations

import dataclasses

import pytest

from pamsim.core.errors import InputError
from pamsim.papers.antagonistic_pair import ideal_muscle, rig_muscle, sprocket_radius
from pamsim.papers.claim import Claim, Verdict, evaluate
from pamsim.papers.matiskova2021 import equations, simulation, stiffness
from pamsim.papers.matiskova2021.stiffness import ideal_stiffness, stiffness_over_pressure
from pamsim.physics.antagonist import antagonist_torque
from pamsim.physics.record import COMMON, parameters
from tests.unit.papers.judged import judged, with_verdict
from tests.unit.physics.flat import charged_air_state, gauge_pressure, muscle_stiffness

PAPER = "matiskova2021"


@pytest.fixture(scope="module")
def claims() -> dict[str, Claim]:
    return judged(PAPER).claims


def test_claims_of_the_rig_that_its_fit_touched_are_calibrated(claims, monkeypatch):
    """Withhold the simulated rows: the claims that need them are calibrated, or predictions."""

    def withheld():
        raise InputError("no simulated rows")

    monkeypatch.setattr(simulation, "_simulated", withheld)
    resting = set()
    for id in claims:
        try:
            evaluate(id)
        except InputError:
            resting.add(id)
    assert resting == {f"{PAPER}-{number}" for number in range(37, 44)}
    calibrated = {id for id, claim in claims.items() if claim.kind is Verdict.CALIBRATED}
    assert calibrated <= resting
    # What is left is a prediction: no small step's response and no force were fitted.
    assert resting - calibrated == {f"{PAPER}-41", f"{PAPER}-43"}


def test_identities_hold_for_another_muscle(monkeypatch):
    ideal = ideal_muscle()
    braid = dataclasses.replace(ideal.braid, fibre_angle=0.4, nominal_length=0.2)
    mounting = dataclasses.replace(ideal.mounting, length_at_zero=0.18)
    other = dataclasses.replace(ideal, braid=braid, mounting=mounting)
    for module in (equations, stiffness):
        monkeypatch.setattr(module, "ideal_muscle", lambda: other)
    for id in sorted(with_verdict(PAPER, Verdict.IDENTITY)):
        again = evaluate(id)
        assert again.verdict is Verdict.IDENTITY, id
    assert again.recomputed != judged(PAPER).claims[id].recomputed


def test_one_limit_for_the_printed_law_and_for_the_rig(claims):
    limits = {claims[f"{PAPER}-{number}"].accepted for number in (11, 12, 16, 37)}
    assert len(limits) == 1


@pytest.mark.parametrize(
    ("id", "expected", "tolerance"),
    [
        ("matiskova2021-11", 5.96, 0.01),  # deg RMS of (23) in bar
        ("matiskova2021-12", 2.01, 0.01),  # with the best scale
        ("matiskova2021-13", 0.6907, 1e-9),  # deg, a0 + a1
        ("matiskova2021-29", 0.090314 * 0.57873, 1e-15),
        ("matiskova2021-32", 0.7470, 1e-4),  # ARX, unit gain
    ],
)
def test_numbers_found_by_independent_scripts(claims, id, expected, tolerance):
    assert claims[id].recomputed == pytest.approx(expected, abs=tolerance)


def test_reasons_carry_what_was_chosen(claims):
    assert "182 kPa" in claims["matiskova2021-12"].reason
    assert "0.77 deg RMS" in claims["matiskova2021-25"].reason
    assert "1.06 leaving one out" in claims["matiskova2021-25"].reason
    assert "0.98 and 1.22" in claims["matiskova2021-25"].reason
    assert "2.414 s" in judged(PAPER).notes["matiskova2021-34"].reason
    assert judged(PAPER).notes["matiskova2021-34"].recomputed == pytest.approx(0.64595, abs=1e-4)


STATES = pytest.mark.parametrize(("length", "pressure"), [(0.0, 3e5), (-0.01, 5e5), (0.004, 1.5e5)])


@STATES
def test_equation_5_is_the_stiffness_of_the_kernel_under_the_ideal_law(length, pressure):
    par = parameters(ideal_muscle())
    closed = ideal_stiffness(par, length, pressure)
    numeric = muscle_stiffness(par, length, pressure)
    assert closed.compressibility == pytest.approx(numeric.compressibility, rel=1e-8)
    assert closed.geometric == pytest.approx(numeric.geometric, rel=1e-8)


def test_geometric_part_goes_with_gauge_pressure_and_compressibility_with_absolute():
    muscle = ideal_muscle()
    one, two = (ideal_stiffness(parameters(muscle), 0.0, pressure) for pressure in (2e5, 4e5))
    assert two.geometric == pytest.approx(2.0 * one.geometric, rel=1e-12)
    ratio = (4e5 + muscle.chamber.atmosphere) / (2e5 + muscle.chamber.atmosphere)
    assert two.compressibility == pytest.approx(ratio * one.compressibility, rel=1e-12)


def test_stiffness_curves_are_the_change_of_torque_of_the_turned_pair():
    """Turn the joint of the rig and of the ideal pair, pressures held and chambers shut."""
    curves, h = stiffness_over_pressure(), 1e-4
    radius = sprocket_radius()
    for kind, muscle in (("", rig_muscle()), ("ideal_", ideal_muscle())):
        par = parameters(dataclasses.replace(muscle, hysteresis=None))
        for place in (0, 20, -1):
            pressure = 500.0 * curves["sum_kpa"][place]
            air = [*[0.0] * (COMMON - 1), charged_air_state(par, [], 0.0, pressure)]

            def torque(angle, shut, par=par, air=air, pressure=pressure):
                ways = -radius * angle, radius * angle
                now = [gauge_pressure(par, air, way) if shut else pressure for way in ways]
                return antagonist_torque((par, par), radius, angle, now)

            for name, shut in (("held", False), ("shut", True)):
                change = (torque(-h, shut) - torque(h, shut)) / (2.0 * h)
                assert curves[kind + name][place] == pytest.approx(change, rel=1e-4)
