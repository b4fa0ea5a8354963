"""Numbers in the rig's README and in the notes of its params.toml follow from record, data and rig.

They stand here in their order, as do words that must hold.
"""

from __future__ import annotations

import dataclasses
import itertools
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
from pamsim.papers.calibration_record import calibration_record
from pamsim.papers.matiskova2021.equations import (
    ideal_muscle,
    mounted,
    rig_muscle,
    rig_stiffness,
)
from pamsim.papers.numerics import rms, root
from pamsim.physics.force_laws.published import PUBLISHED
from pamsim.physics.record import parameters
from pamsim.recordings.printed import distinct_steps, printed_document
from tests.unit.physics.flat import static_force

FOLDER = Path(__file__).parents[3] / "models" / "mas20_arm"
TEETH, PITCH = 8, 9.525  # mm, ISO 606, 06B
SPROCKET = 1e-3 * PITCH / 2.0 / math.sin(math.pi / 4)  # m, with four teeth: no chain runs on fewer
LOW, FULL = 100e3, 490e3  # Pa, the latter the largest printed pressure
SCALE = 0.15
SHORT_RADIUS, SHORT_STRETCH = 3.0e-3, 2.4e-3  # m, of a fit of the short mounting
ARAMID_BREAKS = 4.5  # %, above the elongation at break of every aramid fibre sold

_NAMES = (
    r"MAS-20(-250)?", r"mas20\w*", r"matiskova2021", r"DMSP-20-\d+N?", r"2021, 11, 7288",
    r"Matiskova 2021", r"95 %", r"MuJoCo 3\.17", r"[Mm]uscle [12]", r"chain_[12]", r"G2",
    r"(equation )?\(1\)", r"\(\d\)", r"ISO \d+", r"06B", r"PMD 60G",
    r"cm\^3", r"0-10 V; 1 MPa", r"3/8 in", r"over 2 pi",
)  # fmt: skip


class Measured:
    """What sentences quote: the record and the rig at rest."""

    def __init__(self) -> None:
        self.rig = load_rig("mas20_arm")
        self.record = json.loads((FOLDER / "calibration.json").read_text(encoding="utf-8"))
        self.models = {entry["name"]: entry for entry in self.record["static_models"]}
        self.steps = distinct_steps()
        self.printed = np.degrees([step.angle for step in self.steps])
        self.muscle = rig_muscle()
        self.nominal = self.muscle.braid.nominal_length
        self.rest = self.muscle.mounting.length_at_zero
        self.half_stroke = ideal_muscle().mounting.length_at_zero
        self.in_mm = {
            "nominal": 1e3 * self.nominal,
            "rest": 1e3 * self.rest,
            "half stroke": 1e3 * self.half_stroke,
            "short radius": 1e3 * SHORT_RADIUS,
            "locked short": 1e3 * (self.nominal - self.half_stroke - SHORT_STRETCH),
            "reach": [1e3 * end for end in self.reach],
        }
        self.rows, self.forms = len(self.steps), len(self.models)
        self.locks = self.models["+ braid locks when stretched"]
        self.plain = self.models["published force map in a plain balance"]
        self.mounted = self.models["published force map, muscles mounted mid-stroke"]
        self.mounted_locking = self.models["muscles mounted mid-stroke, and a braid that locks"]
        self.without_hysteresis = self.models["used, without hysteresis"]
        self.least_unseen = min(m["leave_one_out_rms_deg"] for m in self.models.values())
        self.teeth, self.pitch = TEETH, PITCH
        self.radius_over_pitch = 1e3 * SHORT_RADIUS / PITCH
        self.softening = self.muscle.passive.softening
        self.stretch = 100.0 / self.muscle.passive.locking
        self.highest = max(max(step.pressure) for step in self.steps) / 1e3
        self.maker = printed_document("sarosi.toml")["number"]["max_contraction"]["value"]
        self.tube = [4, 50.0 * math.pi / 4 * 0.4**2]  # mm, and cm^3 of half a metre
        self.stiffness = [rig_stiffness(pressure).total for pressure in (LOW, FULL)]
        self.held_stiffness = [rig_stiffness(pressure).geometric for pressure in (LOW, FULL)]

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
    def reach(self):
        (found,) = effect("rest_length").parameters
        return [self.nominal * (1.0 + share) for share in (found.low, found.high)]

    @cached_property
    def damping(self):
        found = self.record["dynamic"]
        (alone,) = [p for p in found["parameters"] if p["name"] == "joint.shaft.damping"]
        return (alone["value"], *alone["interval95"], found["damping_N_m_s_rad"])

    @cached_property
    def growth(self):
        """Of the braid, in % per bar and in % at the largest pressure."""
        share = 100.0 * self.muscle.braid.extensibility
        return share * 1e5, share * FULL

    @cached_property
    def pulls(self):
        """At nominal length and the largest pressure: of the rig's muscle, and without growth."""
        stiff = dataclasses.replace(self.muscle.braid, extensibility=0.0)
        muscles = self.muscle, dataclasses.replace(self.muscle, braid=stiff)
        return [static_force(parameters(muscle), 0.0, FULL) for muscle in muscles]

    @cached_property
    def unloaded(self):
        par = parameters(self.muscle)
        free = root(lambda way: static_force(par, way, 600e3), -0.4 * self.nominal, 0.0, 1e-9)
        return -100.0 * free / self.nominal

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
    def moved_by_hysteresis(self):
        """By how much row 19 moves from where the record's simulation has it [deg]."""
        (i,) = [i for i, step in enumerate(self.steps) if step.row == 19]
        return self.at_rest()[i] - self.printed[i] - self.used["residual_deg"][i]

    @cached_property
    def hysteresis(self):
        """Half-width in N/bar, and its share of the pull in %."""
        width = self.muscle.hysteresis.force_per_pressure
        return 1e5 * width, 100.0 * width * FULL / self.pulls[0]

    @cached_property
    def radii(self):
        """Mean travel radius, smallest and largest of a chain on its teeth [mm], and its swing."""
        largest = PITCH / 2.0 / math.sin(math.pi / TEETH)
        smallest = largest * math.cos(math.pi / TEETH)
        return TEETH * PITCH / 2.0 / math.pi, smallest, largest, 100.0 * (1.0 - smallest / largest)

    def freed(self, term):
        """Value and interval of a term that is freed beside those used."""
        (found,) = self.models[f"used, and: {term}"]["parameters"][-1:]
        return found["value"], *found["interval95"]

    @cached_property
    def freed_radius(self):
        value, low, high = self.freed("sprocket radius")
        return 1e3 * value, 500.0 * (high - low)

    @cached_property
    def freed_softening(self):
        return self.freed("tube softens in contraction")

    @cached_property
    def freely_mounted(self):
        return [math.degrees(mounted(at)[0]) for at in (self.half_stroke, self.nominal)]

    @cached_property
    def short_fit(self):
        """RMS error of a muscle at half of its stroke that is free there and locks beyond [deg]."""
        radius = {f"tendon.chain_{k}.coef": SHORT_RADIUS for k in (1, 2)}
        angle = self.at_rest(
            mounting__length_at_zero=self.half_stroke,
            passive__slack_contraction=1.0 - self.half_stroke / self.nominal,
            passive__locking=self.nominal / SHORT_STRETCH,
            braid__extensibility=1.13e-7,
            body__rig__tilt=-3e-3,
            **radius,
        )
        return rms(angle - self.printed)

    @cached_property
    def instead(self):
        """The best form that something else takes the place of the growth in, and its name."""
        forms = [entry for name, entry in self.models.items() if name.startswith("instead of ")]
        best = min(forms, key=lambda entry: entry["leave_one_out_rms_deg"])
        return {**best, "name": best["name"].partition(": ")[2]}

    @cached_property
    def is_the_published_map(self):
        """Whether the rig's muscle is that of the DMSP-20-200, every constant of it."""
        map_, law, tube = PUBLISHED["DMSP-20-200"], self.muscle.force, self.muscle.passive
        active = [law.scale, law.a, law.c, law.d, law.e, law.b, law.f, tube.softening]
        wanted = [1.0, map_.a, map_.c, map_.d, map_.e, 0.0, 0.0, -map_.c]
        tube_holds = tube.stiffness == pytest.approx(map_.f * map_.c, rel=1e-4)
        return active == pytest.approx(wanted, rel=1e-9) and tube_holds


README = """
{m.rows:d} {m.used[rms_deg]:.2f} {m.used[leave_one_out_rms_deg]:.2f} {m.nested:.2f}
{m.used[left_out_block_rms_deg][small steps]:.2f}
{m.worst[0]:d} {m.worst[1]:+.1f} {m.worst[2]:d} {m.worst[3]:+.1f}

{m.growth[0]:.2f} {m.growth[1]:.1f} 4.9 {m.unloaded:.1f} 6 {m.maker[0]:g} {m.maker[1]:g}
{m.locks[rms_deg]:.2f} {m.locks[left_out_block_rms_deg][small steps]:.2f}
4.9 {m.pulls[0]:.0f} {m.pulls[1]:.0f}

{m.damping[0]:.3f} {m.damping[1]:.3f} {m.damping[2]:.3f} {m.damping[3]:.3f}

{m.teeth:d} {m.pitch:g} {m.radii[0]:.2f} {m.radii[1]:.2f} {m.radii[2]:.2f} {m.radii[3]:.1f}
{m.freed_radius[0]:.1f} {m.freed_radius[1]:.1f}

{m.scaled[0]:.0f} 19 {m.scaled[1]:+.2f} {m.scaled[2]:+.2f}
{m.scaled[3]:d} {m.scaled[4]:+.2f} {m.scaled[5]:+.2f} {m.scaled[6]:.2f} {m.scaled[7]:.2f}

{m.hysteresis[0]:g} {m.hysteresis[1]:.1f} 4.9 19 {m.moved_by_hysteresis:+.2f}
{m.without_hysteresis[rms_deg]:.2f}

{m.in_mm[half stroke]:.0f} {m.in_mm[rest]:.0f} {m.mounted[rms_deg]:.1f} {m.plain[rms_deg]:.1f}
{m.in_mm[nominal]:.0f} {m.mounted_locking[rms_deg]:.1f}
{m.freely_mounted[0]:.1f} {m.freely_mounted[1]:.1f}
{m.short_fit:.1f} {m.in_mm[short radius]:.1f} {m.radius_over_pitch:.2f} {m.in_mm[locked short]:.0f}
{m.in_mm[reach][0]:.0f} {m.in_mm[reach][1]:.0f}

100 490 {m.stiffness[0]:.1f} {m.stiffness[1]:.1f} {m.held_stiffness[0]:.1f}
{m.held_stiffness[1]:.1f}

{m.forms:d} {m.rows:d} {m.least_unseen:.2f}
{m.freed_softening[0]:.1f} {m.freed_softening[1]:.1f} {m.freed_softening[2]:.1f} {m.softening:.1f}
{m.instead[rms_deg]:.2f} {m.instead[leave_one_out_rms_deg]:.2f}
{m.instead[left_out_block_rms_deg][small steps]:.1f}
"""

NOTES = """
{m.in_mm[half stroke]:.0f} {m.growth[1]:.1f} 4.9
{m.scaled[0]:.0f} 19 {m.scaled[1]:+.2f} {m.scaled[2]:+.2f}
{m.stretch:.1f} {m.hysteresis[1]:.1f} 4.9 {m.tube[0]:g} {m.tube[1]:.0f} {m.highest:.0f}
{m.teeth:d} {m.teeth:d} {m.pitch:g} {m.damping[0]:.3f}
"""

HOLDS = {
    "the effect `sprocket_ripple` adds that": lambda _: (
        effect("sprocket_ripple").parameters[0].name == "chain.ripple"
    ),
    "more than aramid fibres can stretch": lambda m: m.growth[1] > ARAMID_BREAKS,
    "would shorten by": lambda m: m.unloaded < m.maker[0],
    "the arm runs into its stop": lambda m: (
        np.max(np.abs(m.printed + m.mounted["residual_deg"])) > 59.5
    ),
    "the rows reject half the stroke": lambda m: (
        m.mounted["rms_deg"] > 1.5 * m.plain["rms_deg"]
    ),
    "which no sprocket has": lambda _: SPROCKET > SHORT_RADIUS,
    "is slack and cannot stop the arm": lambda m: (
        static_force(parameters(m.muscle), m.half_stroke - m.rest, 0.0) <= 0.0
    ),
    "so a diagnosis of your own data can find either mounting": lambda m: (
        m.reach[0] < m.half_stroke < m.rest < m.reach[1]
    ),
    "only while the chambers are shut": lambda m: (
        m.stiffness[1] > m.stiffness[0] and m.held_stiffness[1] < m.held_stiffness[0]
    ),
    "the published ones of the DMSP-20-200, whole": lambda m: m.is_the_published_map,
    "the best is: pressure acts less on a stretched muscle, softer tube": lambda m: (
        m.instead["name"] == "pressure acts less on a stretched muscle, softer tube"
    ),
    "No form has a lower error on rows held out in turn than the one used": lambda m: (
        m.least_unseen == m.used["leave_one_out_rms_deg"]
    ),
    "Rely on angles": lambda m: (
        m.used["rms_deg"] < 0.9 and m.record["dynamic"]["largest_deviation_percent"] < 2.0
    ),
}  # fmt: skip


@pytest.fixture(scope="module")
def measured():
    return Measured()


def misstated(text, numbers, m):
    """What a text has in the place of each number that follows, with the words before it."""
    for name in _NAMES:
        text = re.sub(name, " ", text)
    found = re.findall(r"(\D*?)([-+]?\d+(?:\.\d+)?)", " ".join(text.split()))
    pairs = itertools.zip_longest(found, numbers.format(m=m).split(), fillvalue=("", "nothing"))
    return [f"{before[-60:]}{is_}, not {must}" for (before, is_), must in pairs if is_ != must]


def test_every_number_of_the_readme_follows_and_its_words_hold(measured):
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert misstated(text, README, measured) == []
    for words, hold in HOLDS.items():
        assert words in " ".join(text.split())
        assert hold(measured), words


def test_every_number_in_a_note_follows(measured):
    notes = re.findall(r'note = "(.*?)"', (FOLDER / "params.toml").read_text(encoding="utf-8"))
    assert misstated(" | ".join(notes), NOTES, measured) == []


def test_a_wrong_number_is_seen(measured):
    wrong = misstated("7 rows; locks at 3.1 % stretch", "7 {m.stretch:.1f}", measured)
    assert wrong == [" rows; locks at 3.1, not 3.9"]
