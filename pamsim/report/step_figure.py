"""Page and figure of one step response: angle, pressures, tensions against time."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from pamsim.core.units import PA_PER_KPA
from pamsim.recordings.recording import Recording
from pamsim.recordings.signals import KINDS
from pamsim.report.numbers import fixed, plain, words
from pamsim.report.page import write_page
from pamsim.report.style import INK, finish_axes, new_figure, series_look, styled

SCHEMA = "pamsim-step/1"


def write_step(result: Mapping[str, Any], recording: Recording, out: Path) -> Path:
    """Write page and figure of a step response as `write_page` does; return the page.

    Args:
        result: of schema ``pamsim-step/1``.
        recording: the response.
        out: folder.
    """
    joints = result.get("joints") or {"angle": result}
    facts = [_fact(name, joint) for name, joint in joints.items()]
    pressures, tensions = (
        ", ".join(fixed(end, 1) for end in result[key])
        for key in ("final_pressure_kpa", "final_tension_n")
    )
    settled = all(joint["settling_s"] is not None for joint in joints.values())
    return write_page(
        out,
        "summary.html",
        result,
        lambda: {"step": step_figure(recording)},
        schema=SCHEMA,
        headline=f"Step response of {result['rig']}{'' if settled else ': not settled'}",
        under=f"Load {plain(result['load_kg'])} kg; time step {plain(result['timestep_s'])} s",
        tone="found" if settled else "open",
        facts=[*facts, ("pressures at the end", f"{pressures} kPa", f"tensions {tensions} N")],
        caption=(
            "Step response.",
            "Position of the joints, pressures and tensions of the muscles against time",
            "Dotted: set points. Overshoot and settling count from the start to the final value;"
            " settled is within 2 % of that way.",
        ),
    )


def _fact(name: str, joint: Mapping[str, Any]) -> tuple[str, str, str]:
    """A joint, where it went, and how."""
    suffix = next(key for key in joint if key.startswith("final_")).removeprefix("final_")
    way = f"{fixed(joint[f'start_{suffix}'], 2)} → {fixed(joint[f'final_{suffix}'], 2)} {suffix}"
    settled = joint["settling_s"]
    ends = f"settles in {fixed(settled, 3)} s"
    if settled is None:
        ends = "not settled when the recording ended"
    return words(name), way, f"overshoot {fixed(joint['overshoot_percent'], 1)} %, {ends}"


@styled
def step_figure(recording: Recording) -> Figure:
    """Three panels over time: joints [deg or mm], gauge pressures [kPa], tensions [N]."""
    figure, (top, middle, bottom) = new_figure(6.3, rows=3, sharex=True)
    joints = zip(recording.joints.items(), recording.positions.T, strict=True)
    for i, ((name, kind), position) in enumerate(joints):
        colour = INK if recording.names.short else series_look(i)[0]
        label = f"{name} [{KINDS[kind].shown}]"
        top.plot(recording.time, position * KINDS[kind].scale, color=colour, label=label)
    what = "angle β [deg]" if recording.names.short else "joint"
    finish_axes(top, y=what, title=f"load {recording.load:g} kg", zero=False)
    if not recording.names.short:
        top.legend(loc="best")
    for i, name in enumerate(recording.muscles):
        colour, _ = series_look(i)
        label = name.replace("_", " ")
        middle.plot(
            recording.time, recording.pressure[:, i] / PA_PER_KPA, color=colour, label=label
        )
        if recording.drives.muscles[i] == "pressure_set":
            middle.plot(
                recording.time,
                recording.command[:, i] / PA_PER_KPA,
                color=colour,
                linestyle=":",
                label="set point" if i == 0 else None,
            )
        bottom.plot(recording.time, recording.tension[:, i], color=colour, label=label)
    finish_axes(middle, y="gauge pressure [kPa]", zero=False)
    finish_axes(bottom, y="tension [N]", x="time after the step [s]", zero=False)
    middle.legend(loc="best")
    return figure
