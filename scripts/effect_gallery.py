"""Write docs/effects.md: a card and a film of every effect that a diagnosis can name.

    python scripts/effect_gallery.py [NAME ...]

The cards are those of the catalog. A picture shows what the effect, at its typical size, changes in
the readings of the MAS-20 arm, in the input that shows it best; NAMEs limit the pictures drawn.
"""

from __future__ import annotations

import itertools
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from moving_arms import animate, draw_arms
from pictures import DOCUMENTS, GREY, on_any_ground, save_small_svg

import pamsim
from pamsim.comparison.effects_on_rig import at_size, rig_name
from pamsim.comparison.experiments import sensed_runs
from pamsim.comparison.protocols import DURATION, PROTOCOLS
from pamsim.core.units import DEG_PER_RAD, FloatArray
from pamsim.effects.catalog import FORMS, PARTS
from pamsim.effects.effect import Effect, EffectParameter
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.recordings.recording import Recording
from pamsim.report.style import finish_axes, new_figure, page_style
from pamsim.scene.series_colours import BLUE, GREEN, VERMILION
from pamsim.twins.noise import ANGLE_NOISE, PRESSURE_NOISE

DOCS = DOCUMENTS.parent
PAGE = DOCS / "effects.md"
PICTURES = DOCUMENTS / "effects"
RIG = "mas20_arm"
EVERY = 3  # of the samples is drawn

LAYERS = {
    "Joint": "joint",
    "Muscle": "muscle",
    "Air and valves": "air",
    "Command": "command",
    "Transmission": "transmission",
    "Sensors": "sensor",
    "Static force of the muscle": "muscle_at_rest",
}

INTRODUCTION = f"""\
# The effects

What `pamsim diagnose` can name, link by link from the command to the readings. `pamsim list effects
NAME` prints an effect's equation; symbols and sources: [theory](theory.md); meaning of each
parameter: [parameters](parameters.md). Find effects in your data: [diagnose](diagnose.md); add your
own: [own physics](own_physics.md).

An effect may have several **forms**: formulas of the same physics, in bold. Effects of one
**family** are kinds of one cause, which data may be unable to separate.

- **Numbers**: typical value, where a search starts, and in brackets the range that it may try.
  x multiplies the rig's own value, + and - are added to it. A *shape* is a parameter that counts
  only while the effect is there.
- **Second round**: tried only where the other effects leave more than noise, or by name.
- **Picture**: what an effect of typical size changes in the readings of `{RIG}`, in the input of
  `pamsim hide` (its title) that shows it best over the sensors' noise
  ({ANGLE_NOISE * DEG_PER_RAD:.2f} deg, {PRESSURE_NOISE / 1e3:.1f} kPa). The arms move by the
  readings without and with the effect, in real time; a small difference is drawn larger.

Written by `scripts/effect_gallery.py` from `pamsim/data/effects/`.
"""

AT_REST = "Tried in tables of angles at rest. In recordings over time, name them with `--effects`."


def page() -> str:
    """The text of docs/effects.md."""
    rig = pamsim.load_rig(RIG)
    parts = [INTRODUCTION]
    for layer, part in LAYERS.items():
        parts.append(f"\n## {layer}\n")
        if part == "muscle_at_rest":
            parts.append(f"\n{AT_REST}\n")
        for name in dict.fromkeys(one.name for one in PARTS[part]):
            first, *others = FORMS[name]
            where = "" if first.link == PARTS[part][0].link else f", link {first.link}"
            parts.append(f"\n### {name}\n\nFamily `{first.family}`{where}.")
            parts.append(("\n\n" if first.form else " ") + _card(rig, first, None))
            for before, one in itertools.pairwise((first, *others)):
                parts.append(f"\n{_card(rig, one, before)}")
    return "".join(parts)


def _card(rig: Rig, one: Effect, before: Effect | None) -> str:
    """A form of an effect, without what the form before states as well."""
    form = f"**{one.form}**: " if one.form else ""
    when = " Second round." if one.rare else ""
    apart: list[str] = []
    if before is None or before.look_alikes != one.look_alikes:
        resembling = ", ".join(f"[{name}](#{name})" for name in one.look_alikes)
        apart.append(f"Resembles {resembling}.")
    if apart or (before and before.separating != one.separating):
        apart.append(f"To separate: {one.separating}.")
    last = f"\n{' '.join(apart)}\n" if apart else ""
    return (
        f"{form}{_missing(one)}.{when}\n\n"
        f"{_numbers(rig, one)}\n{last}\n"
        f"![{one.label}]({_picture(one).relative_to(DOCS).as_posix()})\n"
    )


def _missing(one: Effect) -> str:
    """What is missing, in a sentence."""
    return f"{one.missing[0].upper()}{one.missing[1:]}"


def _numbers(rig: Rig, one: Effect) -> str:
    """The sizes of a form with their ranges, and its shapes by name."""
    sizes = [_number(rig, each) for each in one.parameters if not each.shape]
    shapes = [f"`{_name(each)}`" for each in one.parameters if each.shape]
    return "; ".join([*sizes, f"shape {', '.join(shapes)}"] if shapes else sizes)


def _name(parameter: EffectParameter) -> str:
    """Its name, with what is to be filled in in capitals."""
    return re.sub(r"\{(\w+)\}", lambda place: place[1].upper(), parameter.name)


def _number(rig: Rig, parameter: EffectParameter) -> str:
    """A number of a card; one of the MJCF with its meaning."""
    spec = rig_parameter(rig, rig_name(rig, parameter.name)).spec
    added = parameter.neutral is None
    form = "x{:g}" if parameter.relative else "{:+g}" if added else "{:g}"
    values = (parameter.typical, parameter.low, parameter.high)
    typical, low, high = (form.format(value) for value in values)
    if not parameter.relative and parameter.neutral:
        typical = f"{parameter.neutral + parameter.typical:g}"
    unit = f"{spec.unit} per {parameter.scaled_by}" if parameter.scaled_by else spec.unit
    there = "" if parameter.relative or unit == "1" else f" {unit}"
    native = parameter.name.startswith(("joint.", "body."))  # docs/parameters.md has the others
    meaning = spec.doc if native else ""
    return f"`{_name(parameter)}`{meaning and ', '}{meaning}: {typical}{there} [{low}, {high}]"


def _picture(one: Effect) -> Path:
    return PICTURES / f"{one.label.replace(':', '-')}.svg"


def draw(
    effects: Sequence[Effect], folder: Path = PICTURES, inputs: Sequence[str] = tuple(PROTOCOLS)
) -> None:
    """Simulate the arm with and without each effect and draw what differs."""
    rig = pamsim.load_rig(RIG)
    experiments = [PROTOCOLS[name].experiment() for name in inputs]
    without = sensed_runs([(rig, experiment) for experiment in experiments])
    for one in effects:
        changed = rig.with_parameters(at_size(rig, one, 1.0))
        runs = sensed_runs([(changed, experiment) for experiment in experiments])
        changes = {
            name: _Change(base, run.angle - base.angle, run.pressure - base.pressure)
            for name, run, base in zip(inputs, runs, without, strict=True)
        }
        best = max(changes, key=lambda name: changes[name].visible)
        _draw_one(best, changes[best], folder / _picture(one).name)


@dataclass(frozen=True)
class _Change:
    """What an effect adds to the readings of a run without it."""

    without: Recording
    angle: FloatArray  # (n,) [rad]
    pressure: FloatArray  # (n, 2) [Pa]

    @property
    def visible(self) -> float:
        """Root mean square of the channel that changes most, over its noise."""
        squares = [
            np.mean(self.angle**2) / ANGLE_NOISE**2,
            *np.mean(self.pressure**2, axis=0) / PRESSURE_NOISE**2,
        ]
        return float(np.sqrt(max(squares)))


def _draw_one(name: str, change: _Change, path: Path) -> None:
    angle, pressure = change.angle, change.pressure
    with page_style():
        figure, (arms, left, right) = new_figure(2.0, 1, 3, width_ratios=(0.5, 1.0, 1.0))
        factor = draw_arms(arms, angle, unseen=ANGLE_NOISE)
        time = change.without.time[::EVERY]
        left.plot(time, angle[::EVERY] * DEG_PER_RAD, color=VERMILION)
        right.plot(time, pressure[::EVERY, 0] / 1e3, color=BLUE, label="muscle 1")
        right.plot(time, pressure[::EVERY, 1] / 1e3, color=GREEN, label="muscle 2")
        finish_axes(left, x="time [s]", y="Δ angle [deg]")
        left.set_title(name, color=GREY)
        finish_axes(right, x="time [s]", y="Δ pressure [kPa]")
        for axes in (left, right):
            axes.axvline(0.0, color=GREY, lw=1.0, gid="cursor")
            axes.set_xlim(0.0, DURATION)
            on_any_ground(figure, axes)
            low, high = axes.get_ylim()
            axes.set_ylim(min(low, -0.01), max(high, 0.01))  # what changes nothing is a flat line
        right.legend(
            loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False, labelcolor=GREY
        )
    save_small_svg(figure, path)
    seen = change.without.angle + factor * angle
    animate(path, arms, left, change.without.time, change.without.angle, seen)


def main(names: Sequence[str]) -> None:
    """Write the page, and the pictures of some effects or of all."""
    forms = [one for each in FORMS.values() for one in each]
    draw([one for one in forms if not names or one.name in names])
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
