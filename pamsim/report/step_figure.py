"""The figure of one step response: angle, pressures, tensions against time."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from pamsim.core.recording import Recording
from pamsim.core.signal_names import KINDS
from pamsim.core.units import PA_PER_KPA
from pamsim.report.style import INK, finish_axes, new_figure, save_png, series_look, styled


def write_step_figure(recording: Recording, folder: Path) -> Path:
    """Draw a recording into ``step.png`` of a folder.

    Returns:
        The path written.

    Raises:
        InputError: if the place cannot be written.
    """
    path = folder / "step.png"
    save_png(step_figure(recording), path)
    return path


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
