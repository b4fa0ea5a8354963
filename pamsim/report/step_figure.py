"""The figure of one step response: angle, pressures, tensions against time."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from pamsim.core.recording import Recording
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.report.style import INK, finish_axes, new_figure, save_png, series_look, styled


def write_step_figure(recording: Recording, folder: Path) -> Path:
    """Draw a recording into ``step.png`` of a folder.

    Returns:
        The path written.
    """
    path = folder / "step.png"
    save_png(step_figure(recording), path)
    return path


@styled
def step_figure(recording: Recording) -> Figure:
    """Three panels over time: angle [deg], gauge pressures [kPa], tensions [N]."""
    figure, (top, middle, bottom) = new_figure(6.3, rows=3, sharex=True)
    top.plot(recording.time, recording.angle * DEG_PER_RAD, color=INK)
    finish_axes(top, y="angle β [deg]", title=f"load {recording.load:g} kg", zero=False)
    for i, name in enumerate(recording.muscles):
        colour, _ = series_look(i)
        label = name.replace("_", " ")
        middle.plot(
            recording.time, recording.pressure[:, i] / PA_PER_KPA, color=colour, label=label
        )
        if recording.command_kind == "pressure":
            middle.plot(
                recording.time,
                recording.command[:, i] / PA_PER_KPA,
                color=colour,
                linestyle=":",
                label=f"{label}, set point",
            )
        bottom.plot(recording.time, recording.tension[:, i], color=colour, label=label)
    finish_axes(middle, y="gauge pressure [kPa]", zero=False)
    finish_axes(bottom, y="tension [N]", x="time after the step [s]", zero=False)
    middle.legend(loc="best")
    return figure
