"""Numbers in the rig's README and in the notes of its params.toml follow from record, data and rig.

Every sentence with a number stands here with the numbers left out, and with what computes them. A
number that no sentence here accounts for fails, as does a sentence whose words no longer hold. The
message says what the document should read.
"""

from __future__ import annotations

import dataclasses
import json
import math
import re
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest

from pamsim.effects.catalog import effect
from pamsim.engine.equilibrium import rest_angles
from pamsim.engine.rig import load_rig
from pamsim.papers.antagonistic_pair import ideal_muscle, rig_muscle
from pamsim.papers.calibration_record import calibration_record
from pamsim.papers.matiskova2021.equations import mounted
from pamsim.papers.matiskova2021.stiffness import rig_stiffness
from pamsim.papers.numerics import rms, root
from pamsim.physics.force_laws.published import PUBLISHED
from pamsim.physics.record import parameters
from pamsim.recordings.printed import distinct_steps, printed_document
from tests.unit.physics.flat import static_force

FOLDER = Path(__file__).parents[3] / "models" / "mas20_arm"
TEETH, PITCH = 8, 9.525  # mm, ISO 606, 06B
FULL = 490e3  # Pa, largest printed pressure
SCALE = 0.15
SHORT_RADIUS, SHORT_STRETCH = 3.0e-3, 2.4e-3  # m, of a fit of the short mounting
ARAMID_BREAKS = 4.5  # %, above the elongation at break of every aramid fibre sold

_NAMES = (
    r"MAS-20(-250)?", r"mas20\w*", r"matiskova2021", r"DMSP-20-\d+N?", r"2021, 11, 7288",
    r"Matiskova 2021", r"95 %", r"MuJoCo 3\.17", r"[Mm]uscle [12]", r"chain_[12]", r"G2",
    r"(equation )?\(1\)", r"\(\d\)", r"ISO \d+", r"06B", r"PMD 60G",
)  # fmt: skip


class Measured:
    """What sentences quote: the record and the rig at rest."""

    def __init__(self) -> None:
        self.rig = load_rig("mas20_arm")
        self.record = json.loads((FOLDER / "calibration.json").read_text(encoding="utf-8"))
        self.steps = distinct_steps()
        self.printed = np.degrees([step.angle for step in self.steps])

    def model(self, name):
        found = [each for each in self.record["static_models"] if each["name"] == name]
        assert found, f"calibration.json has no model {name!r}"
        return found[0]

    def rms(self, name):
        return self.model(name)["rms_deg"]

    @cached_property
    def used(self):
        return calibration_record(self.rig).used

    @cached_property
    def nested(self):
        return calibration_record(self.rig).nested.rms_deg

    @cached_property
    def worst(self):
        order = np.argsort(-np.abs(self.used["residual_deg"]))[:2]
        return [x for i in order for x in (self.steps[i].row, self.used["residual_deg"][i])]

    @cached_property
    def damping(self):
        found = self.record["dynamic"]
        (alone,) = [p for p in found["parameters"] if p["name"] == "joint.shaft.damping"]
        return (alone["value"], *alone["interval95"], found["damping_N_m_s_rad"])

    @cached_property
    def muscle(self):
        return rig_muscle()

    def pull(self, extensible):
        braid = self.muscle.braid
        braid = braid if extensible else dataclasses.replace(braid, extensibility=0.0)
        return static_force(parameters(dataclasses.replace(self.muscle, braid=braid)), 0.0, FULL)

    @cached_property
    def unloaded_contraction(self):
        par, length = parameters(self.muscle), self.muscle.braid.nominal_length
        free = root(lambda way: static_force(par, way, 600e3), -0.4 * length, 0.0, 1e-9)
        return -100.0 * free / length

    def at_rest(self, **changed):
        rig = self.rig.with_parameters({k.replace("__", "."): v for k, v in changed.items()})
        pressure = np.array([step.pressure for step in self.steps])
        load = np.array([step.load for step in self.steps])
        return np.degrees(rest_angles(rig, pressure, load))

    @cached_property
    def scaled(self):
        """Row 19 and the row that moves most, lower and higher force, then both RMS errors."""
        plain = self.at_rest()
        both = [self.at_rest(force__scale=1.0 + sign * SCALE) for sign in (-1.0, 1.0)]
        rows = [step.row for step in self.steps]
        near, far = rows.index(19), int(np.argmax(np.abs(both[0] - plain)))
        misses = [rms(angle - self.printed) for angle in both]
        moved = [[float((angle - plain)[i]) for angle in both] for i in (near, far)]
        return (100.0 * SCALE, *moved[0], rows[far], *moved[1], *misses)

    @cached_property
    def without_hysteresis(self):
        """By how much row 19 moves from where the record's simulation has it [deg]."""
        (i,) = [i for i, step in enumerate(self.steps) if step.row == 19]
        return self.at_rest()[i] - self.printed[i] - self.used["residual_deg"][i]

    @cached_property
    def hysteresis_share(self):
        return 100.0 * self.muscle.hysteresis.force_per_pressure * FULL / self.pull(True)

    @cached_property
    def radii(self):
        """Mean travel radius, smallest and largest radius of a chain on its teeth [mm]."""
        largest = PITCH / 2.0 / math.sin(math.pi / TEETH)
        return TEETH * PITCH / 2.0 / math.pi, largest * math.cos(math.pi / TEETH), largest

    def freed(self, term):
        """Value and interval of a term that is freed beside those used."""
        (found,) = self.model(f"used, and: {term}")["parameters"][-1:]
        return found["value"], *found["interval95"]

    @cached_property
    def half_stroke(self):
        return ideal_muscle().mounting.length_at_zero

    @cached_property
    def short_fit(self):
        """RMS error of a muscle at half of its stroke that is free there and locks beyond [deg]."""
        radius = {f"tendon.chain_{k}.coef": SHORT_RADIUS for k in (1, 2)}
        angle = self.at_rest(
            mounting__length_at_zero=self.half_stroke,
            passive__slack_contraction=1.0 - self.half_stroke / self.muscle.braid.nominal_length,
            passive__locking=self.muscle.braid.nominal_length / SHORT_STRETCH,
            braid__extensibility=1.13e-7,
            body__rig__tilt=-3e-3,
            **radius,
        )
        return rms(angle - self.printed)

    @cached_property
    def instead(self):
        names = [
            (
                m["leave_one_out_rms_deg"],
                m["rms_deg"],
                m["name"].partition(": ")[2],
                m["left_out_block_rms_deg"]["small steps"],
            )
            for m in self.record["static_models"]
            if m["name"].startswith("instead of ")
        ]
        return min(names)


MOUNTED = "published force map, muscles mounted mid-stroke"
MOUNTED_LOCKING = "muscles mounted mid-stroke, and a braid that locks"
NOMINAL = "published force map in a plain balance"
LOCKS = "+ braid locks when stretched"

README = (
    ("Identified from the {:d} end positions", lambda m: [len(m.steps)]),
    (
        "RMS error {:.2f} deg; {:.2f} deg on rows held out in turn, {:.2f} deg if the form of the"
        " model is chosen without the row as well, {:.2f} deg on the small steps held out"
        " together.",
        lambda m: [
            m.used["rms_deg"],
            m.used["leave_one_out_rms_deg"],
            m.nested,
            m.used["left_out_block_rms_deg"]["small steps"],
        ],
    ),
    ("Worst are rows {:d} ({:+.1f} deg) and {:d} ({:+.1f} deg).", lambda m: m.worst),
    (
        "It is {:.2f} %/bar, {:.1f} % at 4.9 bar: more than aramid fibres can stretch.",
        lambda m: [
            1e7 * m.muscle.braid.extensibility,
            grown(m),
        ],
    ),
    (
        "would shorten by {:.1f} % at 6 bar without load; the maker states {:g} to {:g} %.",
        lambda m: [
            m.unloaded_contraction,
            *printed_document("sarosi.toml")["number"]["max_contraction"]["value"],
        ],
    ),
    (
        "without it the RMS error is {:.2f} deg, and {:.2f} deg on the small steps held out.",
        lambda m: [m.rms(LOCKS), m.model(LOCKS)["left_out_block_rms_deg"]["small steps"]],
    ),
    (
        "at 4.9 bar and nominal length the rig's muscle pulls {:.0f} N, with the published law"
        " alone {:.0f} N.",
        lambda m: [m.pull(True), m.pull(False)],
    ),
    (
        "leaves the damping at {:.3f} N m s/rad, 95 % interval {:.3f} to {:.3f}. Used is {:.3f},",
        lambda m: m.damping,
    ),
    (
        "{:d} teeth of {:g} mm, mean travel radius {:.2f} mm, constant in the model. On real teeth"
        " the radius swings between {:.2f} and {:.2f} mm, by {:.1f} % of the larger;",
        lambda m: [TEETH, PITCH, *m.radii, 100.0 * (1.0 - m.radii[1] / m.radii[2])],
    ),
    (
        "Freed, the rows give a radius of {:.1f} +- {:.1f} mm.",
        lambda m: radius_and_half_interval(*m.freed("sprocket radius")),
    ),
    (
        "a force {:.0f} % lower or higher moves row 19 by {:+.2f} or {:+.2f} deg and row {:d} by"
        " {:+.2f} or {:+.2f} deg, and raises the RMS error to {:.2f} or {:.2f} deg.",
        lambda m: m.scaled,
    ),
    (
        "half-width {:g} N/bar, {:.1f} % of the pull at the reference point and 4.9 bar.",
        lambda m: [1e5 * m.muscle.hysteresis.force_per_pressure, m.hysteresis_share],
    ),
    (
        "Without it row 19 moves by {:+.2f} deg; a model fitted without it has {:.2f} deg RMS"
        " error.",
        lambda m: [m.without_hysteresis, m.rms("used, without hysteresis")],
    ),
    (
        "half of their stroke, at {:.0f} mm. The rig's rest at {:.0f} mm,",
        lambda m: [1e3 * m.half_stroke, 1e3 * m.muscle.mounting.length_at_zero],
    ),
    (
        "misses them by {:.1f} deg RMS there (the arm runs into its stop) and by {:.1f} deg at"
        " {:.0f} mm; with a locking braid, {:.1f} deg. Without the stop and with the radius freed"
        " it is {:.1f} and {:.1f} deg.",
        lambda m: [
            m.rms(MOUNTED),
            m.rms(NOMINAL),
            1e3 * m.muscle.braid.nominal_length,
            m.rms(MOUNTED_LOCKING),
            *(
                math.degrees(mounted(at)[0])
                for at in (m.half_stroke, m.muscle.braid.nominal_length)
            ),
        ],
    ),
    (
        "It fits ({:.1f} deg) with a radius of {:.1f} mm, {:.2f} of the chain's pitch,",
        lambda m: [m.short_fit, 1e3 * SHORT_RADIUS, 1e3 * SHORT_RADIUS / PITCH],
    ),
    (
        "fibres lock {:.0f} mm short of its nominal length",
        lambda m: [1e3 * (m.muscle.braid.nominal_length - m.half_stroke - SHORT_STRETCH)],
    ),
    (
        "`rest_length` reaches from {:.0f} to {:.0f} mm",
        lambda m: [1e3 * end for end in reach(m)],
    ),
    (
        "from {:.0f} to {:.0f} kPa in both muscles the stiffness at the reference point goes from"
        " {:.1f} to {:.1f} N m/rad.",
        lambda m: [100.0, FULL / 1e3, *(rig_stiffness(p).total for p in (100e3, FULL))],
    ),
    (
        "hold the pressures it goes from {:.1f} to {:.1f} N m/rad.",
        lambda m: [rig_stiffness(p).geometric for p in (100e3, FULL)],
    ),
    (
        "lists {:d} forms fitted in the engine to {:d} rows",
        lambda m: [len(m.record["static_models"]), len(m.steps)],
    ),
    (
        "No form has a lower error on rows held out in turn than the one used, {:.2f} deg.",
        lambda m: [min(each["leave_one_out_rms_deg"] for each in m.record["static_models"])],
    ),
    (
        "Freed, the tube's softening comes out at {:.1f} [{:.1f}, {:.1f}], the published {:.1f}.",
        lambda m: [*m.freed("tube softens in contraction"), m.muscle.passive.softening],
    ),
    (
        "In place of the growth with pressure the best is: {} ({:.2f} deg, held out {:.2f}; small"
        " steps held out {:.1f}).",
        lambda m: [m.instead[2], m.instead[1], m.instead[0], m.instead[3]],
    ),
)


def radius_and_half_interval(value, low, high):
    return 1e3 * value, 500.0 * (high - low)


def grown(m):
    return 100.0 * m.muscle.braid.extensibility * FULL


def reach(m):
    (found,) = effect("rest_length").parameters
    nominal = m.muscle.braid.nominal_length
    return [nominal * (1.0 + share) for share in (found.low, found.high)]


HOLDS = (
    (
        "the effect `sprocket_ripple` adds that",
        lambda _: effect("sprocket_ripple").parameters[0].name == "chain.ripple",
    ),
    ("more than aramid fibres can stretch", lambda m: grown(m) > ARAMID_BREAKS),
    (
        "would shorten by",
        lambda m: (
            m.unloaded_contraction
            < printed_document("sarosi.toml")["number"]["max_contraction"]["value"][0]
        ),
    ),
    (
        "the arm runs into its stop",
        lambda m: np.max(np.abs(m.printed + m.model(MOUNTED)["residual_deg"])) > 59.5,
    ),
    ("the rows reject half the stroke", lambda m: m.rms(MOUNTED) > 1.5 * m.rms(NOMINAL)),
    ("which no sprocket has", lambda m: smallest_sprocket() > SHORT_RADIUS),
    (
        "is slack and cannot stop the arm",
        lambda m: (
            static_force(
                parameters(m.muscle), m.half_stroke - m.muscle.mounting.length_at_zero, 0.0
            )
            <= 0.0
        ),
    ),
    (
        "so a diagnosis of your own data can find either mounting",
        lambda m: reach(m)[0] < m.half_stroke < m.muscle.mounting.length_at_zero < reach(m)[1],
    ),
    (
        "only while the chambers are shut",
        lambda m: (
            rig_stiffness(FULL).total > rig_stiffness(100e3).total
            and rig_stiffness(FULL).geometric < rig_stiffness(100e3).geometric
        ),
    ),
    ("the published ones of the DMSP-20-200, whole", lambda m: published_whole(m)),
    (
        "Rely on angles",
        lambda m: (
            m.used["rms_deg"] < 0.9 and m.record["dynamic"]["largest_deviation_percent"] < 2.0
        ),
    ),
)


def smallest_sprocket():
    """Pitch radius with four teeth, fewer than any chain runs on [m]."""
    return 1e-3 * PITCH / 2.0 / math.sin(math.pi / 4)


def published_whole(m):
    map_, law, tube = PUBLISHED["DMSP-20-200"], m.muscle.force, m.muscle.passive
    active = [law.scale, law.a, law.c, law.d, law.e, law.b, law.f, tube.softening]
    return active == pytest.approx(
        [1.0, map_.a, map_.c, map_.d, map_.e, 0.0, 0.0, -map_.c], rel=1e-9
    ) and tube.stiffness == pytest.approx(map_.f * map_.c, rel=1e-4)


NOTES = (
    (
        "{:d} teeth of a 3/8 in chain (ISO 606, 06B): travel per turn, {:d} times {:g} mm, over"
        " 2 pi",
        lambda m: [TEETH, TEETH, PITCH],
    ),
    ("locks at {:.1f} % stretch", lambda m: [100.0 / m.muscle.passive.locking]),
    (
        "half-width; {:.1f} % of the pull at the reference point and 4.9 bar",
        lambda m: [m.hysteresis_share],
    ),
    (
        "{:.1f} % at 4.9 bar, more than aramid stretches: it stands for something not known",
        lambda m: [grown(m)],
    ),
    (
        "a force {:.0f} % lower or higher moves row 19 by {:+.2f} or {:+.2f} deg",
        lambda m: m.scaled[:3],
    ),
    ("G2 alone gives {:.3f}", lambda m: m.damping[:1]),
    ("the highest printed pressure is {:.0f} kPa", lambda m: [highest(m)]),
    ("by (1) it would be {:.0f} mm", lambda m: [1e3 * m.half_stroke]),
    ("half a metre of {:g} mm tube, {:.0f} cm^3", lambda m: [4, 50.0 * math.pi / 4 * 0.4**2]),
    ("PMD 60G gives 0-10 V; 1 MPa full scale is not printed", lambda m: []),
)


def highest(m):
    return max(max(step.pressure) for step in m.steps) / 1e3


@pytest.fixture(scope="module")
def measured():
    return Measured()


def unaccounted(text, sentences, m):
    """Sentences that the text should have, and the numbers in it that are in none of them."""
    text, missing = " ".join(text.split()), []
    for template, compute in sentences:
        try:
            sentence = template.format(*compute(m))
        except (AssertionError, KeyError) as error:
            missing.append(f"{template!r} cannot be computed: {error}")
            continue
        if sentence in text:
            text = text.replace(sentence, " ")
        else:
            missing.append(sentence)
    for name in _NAMES:
        text = re.sub(name, " ", text)
    text = re.sub(r"\]\([^)]*\)|^\d+\.", " ", text)
    return missing, re.findall(r".{0,40}\d[\d.]*.{0,25}", text)


def test_every_number_of_the_readme_follows(measured):
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    missing, unknown = unaccounted(text, README, measured)
    assert not missing, "README.md should read:\n" + "\n".join(missing)
    assert not unknown, f"README.md: no sentence here accounts for {unknown}"


@pytest.mark.parametrize(("words", "hold"), HOLDS, ids=[words for words, _ in HOLDS])
def test_words_of_the_readme_hold(measured, words, hold):
    assert words in " ".join((FOLDER / "README.md").read_text(encoding="utf-8").split())
    assert hold(measured)


def test_every_number_in_a_note_follows(measured):
    notes = re.findall(r'note = "(.*?)"', (FOLDER / "params.toml").read_text(encoding="utf-8"))
    missing, unknown = unaccounted(" | ".join(notes), NOTES, measured)
    assert not missing, "a note of params.toml should read:\n" + "\n".join(missing)
    assert not unknown, f"params.toml: nothing accounts for {unknown}"


def test_a_wrong_number_is_seen(measured):
    notes = "locks at 3.1 % stretch; 7 of them"
    missing, unknown = unaccounted(notes, NOTES[1:2], measured)
    assert len(missing) == 1
    assert len(unknown) >= 1
