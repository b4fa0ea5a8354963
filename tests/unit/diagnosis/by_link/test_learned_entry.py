"""A curve is described by the form with the fewest numbers that follows it, in the units shown."""

import math

import numpy as np
import pytest

import pamsim
from pamsim.comparison.links import JOINT, MUSCLE, Link
from pamsim.diagnosis.by_link.curve_places import MUSCLES, Curve, Kind
from pamsim.diagnosis.by_link.curve_properties import properties
from pamsim.diagnosis.by_link.learned_entry import description, learned_entries
from pamsim.diagnosis.by_link.learned_shape import LearnedShape

AT = np.linspace(-0.6, 0.5, 60)
NOISE = 2e-3 * np.random.default_rng(2).normal(size=AT.size)
CURVES = {
    "constant": (Kind.POSITION, np.full_like(AT, 0.2), {"value": 0.2}),
    "spring": (Kind.POSITION, 0.1 - 0.8 * AT, {"stiffness": 0.8}),
    "stop": (
        Kind.POSITION,
        -1.2 * np.maximum(AT - 0.14, 0.0),
        {"stiffness": 1.2, "begin": 0.14, "side": 1.0},
    ),
    "ripple": (
        Kind.POSITION,
        0.15 * np.sin(16.0 * AT + 0.7),
        {"amplitude": 0.15, "period": 0.3927},
    ),
    "viscous": (Kind.RATE, -0.3 * AT, {"damping": 0.3}),
    "quadratic": (Kind.RATE, -0.5 * AT * np.abs(AT), {"coefficient": 0.5}),
    "dry": (Kind.RATE, -0.2 * np.tanh(AT / 0.03), {"torque": 0.2, "speed": 0.03}),
    "line": (Kind.UNPRESSED, 20.0 + 90.0 * AT, {"slope": 90.0}),
    "ripple of a reading": (
        Kind.READING,
        4e-3 * np.sin(14.0 * AT + 0.7),
        {"amplitude": 4e-3, "period": 2.0 * np.pi / 14.0},
    ),
    "bump of the arm": (
        Kind.ARM,
        0.1 * np.exp(-0.5 * ((AT + 0.1) / 0.15) ** 2),
        {"height": 0.1, "middle": -0.1, "width": 0.3},
    ),
    "constant of dry friction": (Kind.FRICTION, np.full_like(AT, 0.3), {"value": 0.3}),
    "line of the flow": (Kind.FLOW, 0.1 - 0.4 * AT, {"slope": -0.4}),
    "bump": (
        Kind.PRESSED,
        2e-5 * np.exp(-0.5 * ((AT - 0.1) / 0.15) ** 2),
        {"height": 2e-5, "middle": 0.1, "width": 0.3},
    ),
}


AT_PLACE = {Kind.ARM: "muscle_1", Kind.PRESSED: MUSCLES, Kind.UNPRESSED: MUSCLES}


def test_each_form_is_found_with_its_numbers():
    for form, (kind, value, numbers) in CURVES.items():
        noisy = value + NOISE * np.abs(value).max()
        expected = form.split()[0], pytest.approx(numbers, rel=0.15)
        assert description(kind, AT, noisy) == expected


def test_a_stop_on_the_other_side_pushes_up():
    form, numbers = description(Kind.POSITION, AT, 1.2 * np.maximum(-0.2 - AT, 0.0))
    assert (form, numbers["side"]) == ("stop", -1.0)
    assert numbers["stiffness"] == pytest.approx(1.2, rel=0.1)


def test_a_curve_that_no_form_follows_is_not_described():
    detent = (AT + 0.07) * np.exp(-0.5 * ((AT + 0.07) / 0.04) ** 2)
    assert description(Kind.POSITION, AT, detent) == ("", {})
    assert description(Kind.RATE, AT, np.cos(9.0 * AT)) == ("", {})


def test_a_curve_obeys_what_its_band_does_not_contradict():
    def holds(kind, value, reach):
        return properties(
            Curve(kind=kind, acts_at="shaft", at=AT, value=value, reach=reach + 0.0 * AT)
        )

    _, viscous, _ = CURVES["viscous"]
    _, spring, _ = CURVES["spring"]
    assert holds(Kind.RATE, viscous, 0.01) == ("passive", "odd")
    assert holds(Kind.RATE, -viscous, 0.01) == ("odd",)
    assert holds(Kind.RATE, np.minimum(viscous, 0.0), 0.01) == ("passive",)
    assert holds(Kind.RATE, viscous + 0.05, 0.01) == ()  # it drives where it is slow
    assert holds(Kind.RATE, viscous + 0.05, 0.06) == ("passive", "odd")
    assert holds(Kind.POSITION, spring, 0.01) == ("restoring",)
    assert holds(Kind.POSITION, -spring, 0.01) == ()
    assert holds(Kind.POSITION, CURVES["ripple"][1], 0.01) == ()
    assert holds(Kind.UNPRESSED, spring, 0.01) == holds(Kind.READING, spring, 0.01) == ()
    assert holds(Kind.FLOW, spring, 0.01) == holds(Kind.ARM, spring, 0.01) == ()
    patch = CURVES["bump of the arm"][1]
    assert holds(Kind.FRICTION, patch, 0.01) == ("passive",)
    assert holds(Kind.FRICTION, patch - 0.05, 0.01) == ()  # it drives where there is no patch
    assert holds(Kind.FRICTION, patch, 1.0) == ()
    for kind, torque in ((Kind.RATE, viscous), (Kind.POSITION, spring)):
        assert "passive" not in holds(kind, torque, 1.0)  # nothing is known
        assert "restoring" not in holds(kind, torque, 1.0)


def test_numbers_are_written_in_the_units_of_the_curve_and_every_form_in_words():
    shape = LearnedShape(
        curves=tuple(
            Curve(
                kind=kind,
                acts_at={"ARM": "muscle_1"}.get(
                    kind.name, MUSCLES if "tension" in kind else "shaft"
                ),
                joint="" if kind.over == "contraction" else "shaft",
                at=AT,
                value=value,
                reach=np.full_like(AT, 0.01),
            )
            for kind, value, _ in CURVES.values()
        ),
        links=(Link(parts=(MUSCLE, JOINT)),),
        model=None,
        rest=None,
        values={},
        before=4.0,
        after=1.05,
        p_value=1e-4,
    )
    found = learned_entries(pamsim.load_rig("mas20_arm"), shape)
    entries = dict(zip(CURVES, found, strict=True))
    assert [one.resembles for one in found] == [form.split()[0] for form in CURVES]
    assert all(one.words for one in entries.values())
    one = entries["stop"]
    assert one.band95 == pytest.approx(np.column_stack([one.value - 0.01, one.value + 0.01]))
    assert entries["viscous"].holds == ("passive", "odd")
    assert one.at == pytest.approx(np.degrees(AT))
    assert (one.at_unit, one.unit) == ("deg", "N*m")
    assert one.numbers["begin"] == pytest.approx(math.degrees(0.14), rel=0.1)
    assert one.numbers["stiffness"] == pytest.approx(1.2 * math.pi / 180.0, rel=0.1)
    assert one.words.startswith("a stop from ")
    assert entries["dry"].at_unit == "deg/s"
    bump, line = entries["bump"], entries["line"]
    assert (bump.at_unit, bump.unit) == ("%", "N/bar")
    assert bump.value.max() == pytest.approx(2.0, rel=0.01)
    assert bump.numbers == pytest.approx({"height": 2.0, "middle": 10.0, "width": 30.0}, rel=0.1)
    assert line.numbers["slope"] == pytest.approx(0.9)
    flow = entries["line of the flow"]
    assert (flow.at_unit, flow.unit) == ("%", "%")
    assert flow.value == pytest.approx(10.0 - 40.0 * AT)
    assert flow.numbers["slope"] == pytest.approx(-0.4)
    arm, friction = entries["bump of the arm"], entries["constant of dry friction"]
    assert (arm.at_unit, arm.unit, friction.at_unit, friction.unit) == ("deg", "%", "deg", "N*m")
    assert arm.numbers["height"] == pytest.approx(10.0, rel=0.1)
    assert arm.numbers["middle"] == pytest.approx(math.degrees(-0.1), rel=0.1)
    assert (arm.where, bump.where) == ("shaft, at muscle_1", MUSCLES)
    reading = entries["ripple of a reading"]
    assert (reading.at_unit, reading.unit) == ("deg", "deg")
    ripple = {"amplitude": math.degrees(4e-3), "period": 360.0 / 14.0}
    assert reading.numbers == pytest.approx(ripple, rel=0.1)
    assert learned_entries(pamsim.load_rig("mas20_arm"), None) == ()
