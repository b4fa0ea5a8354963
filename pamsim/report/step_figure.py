"""Page and figure of one step response: angle, pressures, tensions against time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pamsim.comparison.compared_signal import shown_unit
from pamsim.core.units import PA_PER_KPA, FloatArray
from pamsim.recordings.recording import Recording
from pamsim.recordings.signals import JOINT_KINDS, kind_of, muscle_channels
from pamsim.recordings.trial import Trial
from pamsim.report.numbers import fixed, plain, words
from pamsim.report.page import write_page
from pamsim.report.style import finish_axes, new_figure, series_look, styled
from pamsim.scene.series_colours import INK, MUTED

SCHEMA = "pamsim-step/1"

Signals = Mapping[str, FloatArray]
"""Channel -> values over time (n,) [SI]."""


def write_step(result: Mapping[str, Any], recording: Recording, out: Path) -> Path:
    """Write page and figure of a step response as `write_page` does; return the page."""
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
            "Dotted: set points. Overshoot is a share of the travel from the start to the final"
            " value; the response has settled when it stays within 2 % of this travel.",
        ),
    )


def _fact(name: str, joint: Mapping[str, Any]) -> tuple[str, str, str]:
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
    signals, muscles = recording.signals(), recording.names.named_muscles
    plot_joints(top, recording, signals, muscles)
    top.set_title(f"load {recording.load:g} kg")
    plot_pressures(middle, recording, signals, muscles, labels=recording.muscles)
    for i, tension in enumerate(recording.tension.T):
        bottom.plot(recording.time, tension, color=series_look(i)[0])
    finish_axes(bottom, y="tension [N]", x="time after the step [s]", zero=False)
    return figure


def plot_joints(
    ax: Axes, run: Recording | Trial, signals: Signals, muscles: Sequence[str]
) -> list[Line2D]:
    """Plot the joints of a run over time; return their lines.

    There are no names of muscles where channels have numbers.
    """
    lines: list[Line2D] = []
    channels = [channel for channel in signals if kind_of(channel) in JOINT_KINDS]
    for index, channel in enumerate(channels):
        unit, scale = shown_unit(channel)
        colour = series_look(index)[0] if len(channels) > 1 else INK
        label = f"{words(channel)} [{unit}]"
        lines += ax.plot(run.time, signals[channel] * scale, color=colour, label=label)
    named = len(channels) > 1 or bool(muscles)
    finish_axes(ax, y="joint" if named else "angle β [deg]", zero=False)
    if named:
        ax.legend(loc="best")
    return lines


def plot_pressures(
    ax: Axes,
    run: Recording | Trial,
    signals: Signals,
    muscles: Sequence[str],
    *,
    labels: Sequence[str] = (),
) -> list[Line2D]:
    """Plot measured pressures, and set points if those were commanded; return the measured.

    The arguments are those of `plot_joints`; a pressure that was not measured is named. The legend
    names the muscles by ``labels``, or as the channels do.
    """
    written = labels or muscles
    curves: list[Line2D] = []
    missing: list[str] = []
    drives = run.drives.muscles
    for index, channel in enumerate(muscle_channels("pressure", muscles, len(drives))):
        colour, _ = series_look(index)
        label = words(written[index]) if written else f"muscle {index + 1}"
        if drives[index] == "pressure_set":
            look: dict[str, Any] = {"color": colour, "linestyle": ":", "linewidth": 1.1}
            ax.step(run.time, run.command[:, index] / PA_PER_KPA, where="post", **look)
        if channel in signals:
            curves += ax.plot(run.time, signals[channel] / PA_PER_KPA, color=colour, label=label)
        else:
            missing.append(label)
    handles = [*curves]
    if "pressure_set" in drives:
        handles.append(Line2D([], [], color=MUTED, linestyle=":", label="set point"))
    if missing:
        handles.append(Line2D([], [], linestyle="", label=f"{', '.join(missing)}: not measured"))
    finish_axes(ax, y="gauge pressure [kPa]", zero=False)
    ax.legend(
        handles=handles,
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=len(handles) if len(drives) <= 2 else -(-len(handles) // 2),
        borderaxespad=0.1,
        handlelength=1.4,
        columnspacing=1.1,
    )
    return curves
