"""The calibrated rig: the numbers of a fit written into the rig's file, with their sources."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pamsim.comparison.free_parameters import FreedParameter
from pamsim.core.parameters import Sourced
from pamsim.engine.rig import Rig
from pamsim.inference.estimate import Flag
from pamsim.inference.simulator_fit import SimulatorFit
from pamsim.recordings.rig_writer import write_rig

RIG_FOLDER = "rig"


def write_calibrated_rig(
    rig: Rig,
    freed: Sequence[FreedParameter],
    fit: SimulatorFit,
    sources: Sequence[str],
    folder: Path,
) -> Path:
    """Write a rig with the fitted numbers; what the data do not show stays as it was.

    Args:
        rig: that was calibrated.
        freed: the parameters.
        fit: of these, in the same order.
        sources: of the measurements.
        folder: the rig is written into its subfolder ``rig``.

    Returns:
        The rig's folder.
    """
    data = ", ".join(Path(source).name or source for source in sources)
    numbers: dict[str, Sourced] = {}
    for freed_parameter, estimate in zip(freed, fit.parameters, strict=True):
        if Flag.DEAD in estimate.flags:
            continue
        for name in freed_parameter.names:
            tied = [other for other in freed_parameter.names if other != name]
            notes = [f"one number with {', '.join(tied)}"] if tied else []
            notes += [estimate.sentence] if estimate.sentence else []
            numbers[name] = Sourced(
                value=estimate.value,
                unit=estimate.unit,
                source=f"identified by pamsim calibrate from {data}",
                where=f"calibrated {name}",
                interval95=estimate.interval95,
                note="; ".join(notes),
            )
    heading = (
        f"Written by pamsim calibrate from {data}.\n"
        f"Status: {fit.status}: {fit.sentence}.\n"
        "Other entries are those of the rig that was calibrated."
    )
    write_rig(rig.file, folder / RIG_FOLDER, numbers, heading=heading)
    return folder / RIG_FOLDER
