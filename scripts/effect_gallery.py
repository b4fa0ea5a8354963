"""Write docs/effects.md: a card and a picture of every effect that a diagnosis can name.

    python scripts/effect_gallery.py [NAME ...]

The cards are those of the catalog. A picture shows what the effect, at its typical size, changes in
the readings of the MAS-20 arm, in the input that shows it best; NAMEs limit the pictures drawn.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np

import pamsim
from pamsim.comparison.effects_on_rig import at_size, rig_name
from pamsim.comparison.experiments import sensed_runs
from pamsim.comparison.protocols import DURATION, PROTOCOLS
from pamsim.core.files import complete_file
from pamsim.core.units import DEG_PER_RAD, FloatArray
from pamsim.effects import (
    command,
    joint,
    measurement,
    muscle,
    muscle_at_rest,
    pneumatic,
    transmission,
)
from pamsim.effects.catalog import FORMS
from pamsim.effects.effect import Effect, EffectParameter
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.report.style import BLUE, GREEN, VERMILION, finish_axes, new_figure, page_style
from pamsim.twins.noise import ANGLE_NOISE, PRESSURE_NOISE

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGE = DOCS / "effects.md"
PICTURES = DOCS / "images" / "effects"
RIG = "mas20_arm"
GREY = "#78828c"  # can be read on white and on black
EVERY = 3  # of the samples is drawn

LAYERS = {
    "Joint": joint,
    "Muscle": muscle,
    "Air and valves": pneumatic,
    "Command": command,
    "Transmission": transmission,
    "Sensors": measurement,
    "Static force of the muscle": muscle_at_rest,
}

INTRODUCTION = f"""\
# The effects

What `pamsim diagnose` can name, one card each; `pamsim list effects NAME` prints it. Written by
`scripts/effect_gallery.py` from the catalog (`pamsim/effects/`). Symbols and sources:
[theory](theory.md). How to find an effect: [diagnose](diagnose.md). One of your own:
[own_physics](own_physics.md).

A **card** states what an effect frees: each number with its typical value, from which a search
starts, and in brackets the range that it may try, and further starts. x is a factor of the rig's
own value, + and - are added to it. A shape has no influence while the effect is absent.

The **pictures** show what an effect of its typical size changes in the readings of `{RIG}`, with it
less without it, without noise. The input, above each picture, is the one of `pamsim hide` in which
the change is largest in units of the sensors' noise ({ANGLE_NOISE * DEG_PER_RAD:.2f} deg,
{PRESSURE_NOISE / 1e3:.1f} kPa). It need not separate effects with similar pictures: the experiment
of the card does.

The effects of a **family** act in one link of the chain from the command to the readings. They are
kinds of one cause, which data may be unable to separate.
"""


def page() -> str:
    """The text of docs/effects.md."""
    rig = pamsim.load_rig(RIG)
    parts = [INTRODUCTION]
    for layer, module in LAYERS.items():
        parts.append(f"\n## {layer}\n")
        for name in dict.fromkeys(one.name for one in module.EFFECTS):
            parts.append(f"\n### {name}\n")
            parts += [_card(rig, one) for one in FORMS[name]]
    return "".join(parts)


def _card(rig: Rig, one: Effect) -> str:
    form = f"**{one.label}**: " if one.form else ""
    resembling = ", ".join(f"[{name}](#{name})" for name in one.look_alikes)
    rows = "".join(_row(rig, parameter) for parameter in one.parameters)
    when = ""
    if one.rare:
        when = " Tried only where others leave a remainder, or by name."
    if not one.in_trials:
        when += " Tried in tables at rest; in recordings over time by name."
    return (
        f"\n{form}{one.missing[0].upper()}{one.missing[1:]}. Family `{one.family}`, link"
        f" {one.link}.{when}\n\n`{one.equation}`\n\n{rows}"
        f"- Mistaken for {resembling}. To separate them: {one.separating}.\n"
        f"\n![What {one.label} changes]({_picture(one).relative_to(DOCS).as_posix()})\n"
    )


def _row(rig: Rig, parameter: EffectParameter) -> str:
    spec = rig_parameter(rig, rig_name(rig, parameter.name)).spec
    mark = ""
    if parameter.relative:
        mark = "x "
    elif parameter.neutral is None and not parameter.shape:
        mark = "+ "
    typical, low, high = (
        (mark + f"{value:g}").replace("+ -", "- ")
        for value in (parameter.typical, parameter.low, parameter.high)
    )
    if not parameter.relative and parameter.neutral:
        typical = f"{parameter.neutral + parameter.typical:g}"
    starts = ", ".join(f"{value:g}" for value in parameter.starts)
    searched = f"{low} to {high}" + (f"; also from {starts}" if starts else "")
    unit = f"{spec.unit} per {parameter.scaled_by}" if parameter.scaled_by else spec.unit
    there = "" if parameter.relative or unit == "1" else f" {unit}"
    kind = "shape " if parameter.shape else ""
    name = re.sub(r"\{(\w+)\}", lambda place: place[1].upper(), parameter.name)
    return f"- {kind}`{name}`, {spec.doc}: {typical}{there} ({searched})\n"


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
            name: (run.time, run.angle - base.angle, run.pressure - base.pressure)
            for name, run, base in zip(inputs, runs, without, strict=True)
        }
        best = max(changes, key=lambda name: _visible(*changes[name][1:]))
        _draw_one(best, *changes[best], folder / _picture(one).name)


def _visible(angle: FloatArray, pressure: FloatArray) -> float:
    """Root mean square of the channel that changes most, over its noise."""
    squares = [
        np.mean(angle**2) / ANGLE_NOISE**2,
        *np.mean(pressure**2, axis=0) / PRESSURE_NOISE**2,
    ]
    return float(np.sqrt(max(squares)))


def _draw_one(
    name: str, time: FloatArray, angle: FloatArray, pressure: FloatArray, path: Path
) -> None:
    with page_style():
        figure, (left, right) = new_figure(2.0, 1, 2)
        figure.patch.set_alpha(0.0)
        time = time[::EVERY]
        left.plot(time, angle[::EVERY] * DEG_PER_RAD, color=VERMILION)
        right.plot(time, pressure[::EVERY, 0] / 1e3, color=BLUE, label="muscle 1")
        right.plot(time, pressure[::EVERY, 1] / 1e3, color=GREEN, label="muscle 2")
        finish_axes(left, x="time [s]", y="change of angle [deg]")
        left.set_title(name, color=GREY)
        finish_axes(right, x="time [s]", y="change of pressure [kPa]")
        for axes in (left, right):
            axes.set_xlim(0.0, DURATION)
            axes.patch.set_alpha(0.0)
            axes.grid(True, axis="y", color=GREY, alpha=0.35)
            axes.tick_params(colors=GREY, labelcolor=GREY)
            for text in (axes.xaxis.label, axes.yaxis.label):
                text.set_color(GREY)
            low, high = axes.get_ylim()
            axes.set_ylim(min(low, -0.01), max(high, 0.01))  # what changes nothing is a flat line
        right.legend(
            loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False, labelcolor=GREY
        )
    with (
        complete_file(path) as part,
        matplotlib.rc_context(
            {"svg.fonttype": "none", "font.sans-serif": ["DejaVu Sans"], "svg.hashsalt": "pamsim"}
        ),
    ):
        figure.savefig(part, format="svg", metadata={"Date": None, "Creator": None})
        text = part.read_text(encoding="utf-8")
        part.write_text(re.sub(r"(\.\d)\d+", r"\1", text), encoding="utf-8")


def main(names: Sequence[str]) -> None:
    """Write the page, and the pictures of some effects or of all."""
    forms = [one for each in FORMS.values() for one in each]
    draw([one for one in forms if not names or one.name in names])
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
